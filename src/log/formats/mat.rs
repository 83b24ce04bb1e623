//! MATLAB files of level 5 (versions 5 to 7.2), little or big endian, compressed or not: numeric
//! matrices, and those that stand in a structure (MathWorks, "MAT-File Format").

use super::arrays::{self, Array};
use super::bytes::{Bytes, Kind};
use crate::error::{Error, Result};
use crate::log::Table;
use std::path::Path;

/// Largest variable after unpacking, bytes.
const LARGEST: usize = 8 << 30;
/// Depth of structures in structures.
const DEEPEST: usize = 8;
/// Types of data elements.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Class of structures.
const STRUCT: u8 = 2;

pub(super) fn read(path: &Path) -> Result<Table> {
    let data = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    let little = match data.get(126..128) {
        Some(b"IM") => true,
        Some(b"MI") => false,
        _ => {
            let message = "its header is damaged, or it is of MATLAB 4; save it with -v7";
            return Err(Error::file(path, "", message));
        }
    };
    let mut out = Vec::new();
    let mut b = Bytes::new(data.get(128..).unwrap_or_default(), little);
    while b.rest().len() >= 8 {
        let at = 128 + b.position();
        let broken = || {
            Error::file(
                path,
                format!("byte {at}"),
                "the variable is cut off or damaged",
            )
        };
        let (kind, body) = element(&mut b, false).ok_or_else(broken)?;
        match kind {
            MATRIX => matrix(body, little, "", 0, &mut out).ok_or_else(broken)?,
            COMPRESSED => {
                let full = miniz_oxide::inflate::decompress_to_vec_zlib_with_limit(body, LARGEST)
                    .map_err(|_| broken())?;
                let mut inner = Bytes::new(&full, little);
                if let Some((MATRIX, body)) = element(&mut inner, false) {
                    matrix(body, little, "", 0, &mut out).ok_or_else(broken)?;
                }
            }
            _ => {}
        }
    }
    arrays::table(out, path)
}

/// The next data element: type and bytes. Elements inside a matrix end at multiples of eight bytes.
fn element<'a>(b: &mut Bytes<'a>, padded: bool) -> Option<(u32, &'a [u8])> {
    let tag = b.u32()?;
    // small element: length and type in one word, data in the next
    if tag >> 16 != 0 {
        let body = b.take(4)?;
        return Some((tag & 0xffff, body.get(..(tag >> 16) as usize)?));
    }
    let length = b.u32()? as usize;
    let body = b.take(length)?;
    if padded && !length.is_multiple_of(8) {
        // the last one may lack its padding
        let _ = b.skip((8 - length % 8).min(b.rest().len()));
    }
    Some((tag, body))
}

fn kind(code: u32) -> Option<Kind> {
    Some(match code {
        1 => Kind::I8,
        2 => Kind::U8,
        3 => Kind::I16,
        4 => Kind::U16,
        5 => Kind::I32,
        6 => Kind::U32,
        7 => Kind::F32,
        9 => Kind::F64,
        12 => Kind::I64,
        13 => Kind::U64,
        _ => return None,
    })
}

/// A matrix of numbers, or the fields of a structure. What is neither is passed over.
fn matrix(
    body: &[u8],
    little: bool,
    prefix: &str,
    depth: usize,
    out: &mut Vec<Array>,
) -> Option<()> {
    if body.is_empty() {
        return Some(());
    }
    let mut b = Bytes::new(body, little);
    let (_, flags) = element(&mut b, true)?;
    let class = Bytes::new(flags, little).u32()?.to_le_bytes()[0];
    let (_, dims) = element(&mut b, true)?;
    let dims = Kind::I32.numbers(dims, little);
    let (_, name) = element(&mut b, true)?;
    let own = String::from_utf8_lossy(name).into_owned();
    let name = match (prefix.is_empty(), own.is_empty()) {
        (true, _) => own,
        (false, true) => prefix.to_string(),
        (false, false) => format!("{prefix}.{own}"),
    };
    if class == STRUCT && depth < DEEPEST {
        let (_, length) = element(&mut b, true)?;
        let length = Bytes::new(length, little).u32()? as usize;
        let (_, names) = element(&mut b, true)?;
        if length == 0 || dims.iter().any(|d| *d != 1.0) {
            return Some(());
        }
        for field in names.chunks(length) {
            let end = field.iter().position(|c| *c == 0).unwrap_or(field.len());
            let field = String::from_utf8_lossy(&field[..end]);
            let (_, inner) = element(&mut b, true)?;
            matrix(inner, little, &format!("{name}.{field}"), depth + 1, out)?;
        }
        return Some(());
    }
    // double, single and the eight classes of integers
    if !(6..=15).contains(&class) || dims.len() != 2 {
        return Some(());
    }
    let (code, data) = element(&mut b, true)?;
    let values = kind(code)?.numbers(data, little);
    out.push(Array {
        name,
        rows: dims[0].max(0.0) as usize,
        columns: dims[1].max(0.0) as usize,
        values,
    });
    Some(())
}
