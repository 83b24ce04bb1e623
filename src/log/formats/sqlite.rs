//! Reads tables of an SQLite 3 database, read-only and without indexes: the b-trees of its pages
//! ("Database File Format", sqlite.org).

use super::bytes::Bytes;
use crate::error::{Error, Result};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Largest row, bytes.
const LARGEST: usize = 1 << 30;
/// Deepest tree: 2⁶⁴ rows need less.
const DEEPEST: usize = 64;

/// A value of a row.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value<'a> {
    Null,
    Integer(i64),
    Real,
    Text(String),
    Blob(&'a [u8]),
}

/// An open database.
pub(super) struct Database {
    path: PathBuf,
    file: File,
    page: usize,
    /// bytes of a page that hold content
    usable: usize,
    pages: u32,
    utf8: bool,
}

impl Database {
    pub fn open(path: &Path) -> Result<Self> {
        let mut file = File::open(path).map_err(|e| Error::io(path, e))?;
        let size = file.metadata().map_err(|e| Error::io(path, e))?.len();
        let mut head = [0u8; 100];
        let short = || Error::file(path, "", "it is too short for a database");
        file.read_exact(&mut head).map_err(|_| short())?;
        let mut b = Bytes::new(&head, false);
        let parsed = (|| {
            b.skip(16)?;
            let page = match b.u16()? {
                1 => 65536,
                n => usize::from(n),
            };
            let reserved = usize::from(head[20]);
            let mut b = Bytes::new(&head[56..], false);
            let encoding = b.u32()?;
            let usable = page.checked_sub(reserved)?;
            (page.is_power_of_two() && page >= 512 && usable >= 480)
                .then_some((page, usable, encoding))
        })();
        let (page, usable, encoding) =
            parsed.ok_or_else(|| Error::file(path, "", "the header of the database is damaged"))?;
        Ok(Database {
            path: path.to_path_buf(),
            file,
            page,
            usable,
            pages: (size / page as u64).min(u64::from(u32::MAX)) as u32,
            utf8: encoding <= 1,
        })
    }

    fn error(&self, page: u32) -> Error {
        let message = "this page of the database is damaged or missing; was the recording stopped? Try \
                       `sqlite3 FILE .recover`";
        Error::file(&self.path, format!("page {page}"), message)
    }

    fn load(&mut self, number: u32, into: &mut Vec<u8>) -> Result<()> {
        if number == 0 || number > self.pages {
            return Err(self.error(number));
        }
        into.resize(self.page, 0);
        let at = u64::from(number - 1) * self.page as u64;
        let path = self.path.clone();
        self.file
            .seek(SeekFrom::Start(at))
            .and_then(|_| self.file.read_exact(into))
            .map_err(|e| Error::io(path, e))
    }

    /// Root page of a table and the names of its columns.
    pub fn table(&mut self, name: &str) -> Result<Option<(u32, Vec<String>)>> {
        let mut found = None;
        self.rows(1, &mut |_, row| {
            if let [
                Value::Text(kind),
                Value::Text(n),
                _,
                Value::Integer(root),
                Value::Text(sql),
            ] = row
                && kind == "table"
                && n.eq_ignore_ascii_case(name)
            {
                found = Some((*root as u32, columns(sql)));
            }
            Ok(())
        })?;
        Ok(found)
    }

    /// Calls `each` with the number and the values of every row under page `root`, in order.
    pub fn rows(
        &mut self,
        root: u32,
        each: &mut dyn FnMut(i64, &[Value]) -> Result<()>,
    ) -> Result<()> {
        let mut seen = 0;
        self.walk(root, 0, &mut seen, each)
    }

    fn walk(
        &mut self,
        number: u32,
        depth: usize,
        seen: &mut u32,
        each: &mut dyn FnMut(i64, &[Value]) -> Result<()>,
    ) -> Result<()> {
        *seen += 1;
        if depth > DEEPEST || *seen > self.pages {
            return Err(self.error(number));
        }
        let mut page = Vec::new();
        self.load(number, &mut page)?;
        let start = if number == 1 { 100 } else { 0 };
        let broken = |db: &Self| db.error(number);
        let kind = page[start];
        let mut head = Bytes::new(&page[start..], false);
        let cells = (|| {
            head.skip(3)?;
            head.u16()
        })()
        .ok_or_else(|| broken(self))?;
        let pointers = start + if kind == 5 { 12 } else { 8 };
        let pointer = |i: usize| {
            let at = pointers + 2 * i;
            let b: [u8; 2] = page.get(at..at + 2)?.try_into().ok()?;
            Some(usize::from(u16::from_be_bytes(b)))
        };
        match kind {
            // interior page: the children, then the rightmost
            5 => {
                for i in 0..usize::from(cells) {
                    let child = pointer(i)
                        .and_then(|at| Bytes::new(page.get(at..)?, false).u32())
                        .ok_or_else(|| broken(self))?;
                    self.walk(child, depth + 1, seen, each)?;
                }
                let mut b = Bytes::new(&page[start + 8..], false);
                let right = b.u32().ok_or_else(|| broken(self))?;
                self.walk(right, depth + 1, seen, each)
            }
            13 => {
                let mut body = Vec::new();
                for i in 0..usize::from(cells) {
                    let cell = pointer(i)
                        .and_then(|at| page.get(at..))
                        .ok_or_else(|| broken(self))?;
                    let mut b = Bytes::new(cell, false);
                    let head = (|| Some((varint(&mut b)?, varint(&mut b)?)))();
                    let (length, id) = head.ok_or_else(|| broken(self))?;
                    let length = usize::try_from(length).map_err(|_| broken(self))?;
                    self.payload(&mut b, length, &mut body, number)?;
                    let values = record(&body, self.utf8).ok_or_else(|| broken(self))?;
                    each(id, &values)?;
                }
                Ok(())
            }
            _ => Err(broken(self)),
        }
    }

    /// The bytes of a row: those in the page, and those in a chain of overflow pages.
    fn payload(
        &mut self,
        b: &mut Bytes,
        length: usize,
        out: &mut Vec<u8>,
        number: u32,
    ) -> Result<()> {
        out.clear();
        let most = self.usable - 35;
        if length > LARGEST {
            return Err(self.error(number));
        }
        let local = match length <= most {
            true => length,
            false => {
                let least = (self.usable - 12) * 32 / 255 - 23;
                let k = least + (length - least) % (self.usable - 4);
                if k <= most { k } else { least }
            }
        };
        out.extend(b.take(local).ok_or_else(|| self.error(number))?);
        if local == length {
            return Ok(());
        }
        let mut next = b.u32().ok_or_else(|| self.error(number))?;
        let mut page = Vec::new();
        while out.len() < length {
            self.load(next, &mut page)?;
            let more = (length - out.len()).min(self.usable - 4);
            out.extend(&page[4..4 + more]);
            next = u32::from_be_bytes([page[0], page[1], page[2], page[3]]);
        }
        Ok(())
    }
}

/// An integer of one to nine bytes, seven bits each.
fn varint(b: &mut Bytes) -> Option<i64> {
    let mut out: u64 = 0;
    for k in 0..9 {
        let byte = *b.take(1)?.first()?;
        if k == 8 {
            return Some(((out << 8) | u64::from(byte)) as i64);
        }
        out = (out << 7) | u64::from(byte & 0x7f);
        if byte & 0x80 == 0 {
            break;
        }
    }
    Some(out as i64)
}

/// The values of a row.
fn record(body: &[u8], utf8: bool) -> Option<Vec<Value<'_>>> {
    let mut head = Bytes::new(body, false);
    let length = usize::try_from(varint(&mut head)?).ok()?;
    let mut data = Bytes::new(body.get(length..)?, false);
    let mut out = Vec::new();
    while head.position() < length {
        let code = varint(&mut head)?;
        out.push(match code {
            0 => Value::Null,
            1..=6 => {
                let size = [1, 2, 3, 4, 6, 8][code as usize - 1];
                let bytes = data.take(size)?;
                let sign = if bytes[0] & 0x80 != 0 { -1i64 } else { 0 };
                Value::Integer(bytes.iter().fold(sign, |x, b| (x << 8) | i64::from(*b)))
            }
            7 => {
                data.skip(8)?;
                Value::Real
            }
            8 => Value::Integer(0),
            9 => Value::Integer(1),
            n if n >= 12 => {
                let bytes = data.take(usize::try_from((n - 12) / 2).ok()?)?;
                match n % 2 == 1 && utf8 {
                    true => Value::Text(String::from_utf8_lossy(bytes).into_owned()),
                    false => Value::Blob(bytes),
                }
            }
            _ => return None,
        });
    }
    Some(out)
}

/// Names of the columns of `CREATE TABLE name(a INTEGER, b TEXT)`.
fn columns(sql: &str) -> Vec<String> {
    let inside = sql.split_once('(').map_or("", |(_, rest)| rest);
    let mut depth = 0;
    let mut parts = vec![String::new()];
    for c in inside.chars() {
        match c {
            '(' => depth += 1,
            ')' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(String::new());
                continue;
            }
            _ => {}
        }
        if let Some(last) = parts.last_mut() {
            last.push(c);
        }
    }
    let word = |p: &String| {
        p.split_whitespace()
            .next()
            .map(|w| w.trim_matches(['"', '`', '[', ']']).to_string())
    };
    parts.iter().filter_map(word).collect()
}
