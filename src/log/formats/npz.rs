//! NumPy's `.npz` (a ZIP archive of arrays, stored or deflated) and `.npy` (one array).
//!
//! An array is `\x93NUMPY`, a version, the length of a Python dictionary with `descr`, `fortran_order`
//! and `shape`, then its numbers (NEP 1).

use super::arrays::{self, Array};
use super::bytes::{Bytes, Kind};
use crate::error::{Error, Result, Warning, WarningKind};
use crate::log::Table;
use std::path::Path;

/// Largest array after unpacking, bytes.
const LARGEST: usize = 8 << 30;

pub(super) fn read(path: &Path) -> Result<Table> {
    let data = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    if data.starts_with(b"\x93NUMPY") {
        let array = npy(&data, "").map_err(|m| Error::file(path, "", m))?;
        return arrays::table(vec![array], path);
    }
    let broken = || Error::file(path, "", "the archive is cut off or damaged");
    // the directory stands at the end, before a comment of at most 65535 bytes
    let from = data.len().saturating_sub(65557);
    let tail = &data[from..];
    let end = tail
        .windows(4)
        .rposition(|w| w == b"PK\x05\x06")
        .ok_or_else(broken)?;
    let mut b = Bytes::new(&tail[end..], true);
    let directory = (|| {
        b.skip(10)?;
        let count = b.u16()?;
        b.skip(4)?;
        Some((count, b.u32()?))
    })();
    let (count, at) = directory.ok_or_else(broken)?;
    if at == u32::MAX {
        return Err(Error::file(
            path,
            "",
            "it is larger than 4 GB (ZIP64), which is not read; split it",
        ));
    }
    let mut list = Bytes::new(data.get(at as usize..).unwrap_or_default(), true);
    let (mut found, mut left) = (Vec::new(), Vec::new());
    let mut workbook = false;
    for _ in 0..count {
        let (name, method, packed, full, head) = entry(&mut list).ok_or_else(broken)?;
        workbook |= name.starts_with("xl/");
        let Some(short) = name.strip_suffix(".npy") else {
            continue;
        };
        let fail = |m: String| Error::file(path, format!("array {short}"), m);
        let body = body(&data, head, packed).ok_or_else(broken)?;
        let unpacked = match method {
            0 => body.to_vec(),
            8 => miniz_oxide::inflate::decompress_to_vec_with_limit(body, full.min(LARGEST))
                .map_err(|_| fail("its compressed numbers are damaged".into()))?,
            other => return Err(fail(format!("compression method {other} is not read"))),
        };
        match npy(&unpacked, short) {
            Ok(array) => found.push(array),
            Err(m) if m.contains("not numbers") || m.contains("dimensions") => {
                left.push(format!("{short} ({m})"));
            }
            Err(m) => return Err(fail(m)),
        }
    }
    if workbook && found.is_empty() {
        let message = "it is a workbook of Excel, which is not read; save its sheet as CSV";
        return Err(Error::file(path, "", message));
    }
    let mut table = arrays::table(found, path)?;
    if !left.is_empty() {
        table.warnings.push(Warning::new(
            WarningKind::ColumnsIgnored,
            path.display().to_string(),
            format!(
                "arrays that are no columns were left out: {}",
                left.join(", ")
            ),
        ));
    }
    Ok(table)
}

/// One entry of the directory: name, method, packed and full size, where the file stands.
fn entry(list: &mut Bytes) -> Option<(String, u16, usize, usize, usize)> {
    if list.take(4)? != b"PK\x01\x02" {
        return None;
    }
    list.skip(6)?;
    let method = list.u16()?;
    list.skip(8)?;
    let (packed, full) = (list.u32()? as usize, list.u32()? as usize);
    let (n, extra, comment) = (list.u16()?, list.u16()?, list.u16()?);
    list.skip(8)?;
    let head = list.u32()? as usize;
    let name = String::from_utf8_lossy(list.take(usize::from(n))?).into_owned();
    list.skip(usize::from(extra) + usize::from(comment))?;
    Some((name, method, packed, full, head))
}

/// The packed bytes of a file.
fn body(data: &[u8], head: usize, packed: usize) -> Option<&[u8]> {
    let mut b = Bytes::new(data.get(head..)?, true);
    b.skip(26)?;
    let (n, extra) = (b.u16()?, b.u16()?);
    b.skip(usize::from(n) + usize::from(extra))?;
    b.take(packed)
}

/// An array of the `.npy` format.
fn npy(data: &[u8], name: &str) -> Result<Array, String> {
    let broken = || "it is cut off or damaged".to_string();
    let mut b = Bytes::new(data, true);
    b.skip(6).ok_or_else(broken)?;
    let version = b.take(2).ok_or_else(broken)?[0];
    let length = match version {
        1 => b.u16().map(u32::from),
        _ => b.u32(),
    };
    let head = b
        .take(length.ok_or_else(broken)? as usize)
        .ok_or_else(broken)?;
    let head = String::from_utf8_lossy(head);
    let value = |key: &str| {
        let (_, rest) = head.split_once(&format!("'{key}':"))?;
        Some(rest.trim_start())
    };
    let descr = value("descr")
        .and_then(|v| v.strip_prefix('\''))
        .and_then(|v| v.split('\'').next())
        .ok_or("its elements are not numbers")?;
    let (order, kind) = descr.split_at(descr.len().min(1));
    let (little, kind) = match order {
        "<" | "|" | "=" => (true, kind),
        ">" => (false, kind),
        _ => (true, descr),
    };
    let kind = match kind {
        "f4" => Kind::F32,
        "f8" => Kind::F64,
        "i1" => Kind::I8,
        "u1" | "b1" => Kind::U8,
        "i2" => Kind::I16,
        "u2" => Kind::U16,
        "i4" => Kind::I32,
        "u4" => Kind::U32,
        "i8" => Kind::I64,
        "u8" => Kind::U64,
        _ => return Err(format!("its elements ({descr}) are not numbers")),
    };
    let shape: Vec<usize> = value("shape")
        .and_then(|v| v.strip_prefix('('))
        .and_then(|v| v.split(')').next())
        .ok_or_else(broken)?
        .split(',')
        .filter_map(|d| d.trim().parse().ok())
        .collect();
    let (rows, columns) = match shape[..] {
        [] => (1, 1),
        [n] => (n, 1),
        [n, k] => (n, k),
        _ => return Err("it has more than two dimensions".into()),
    };
    let count = rows.checked_mul(columns).ok_or_else(broken)?;
    let bytes = count.checked_mul(kind.size()).ok_or_else(broken)?;
    let values = kind.numbers(b.take(bytes).ok_or_else(broken)?, little);
    let fortran = value("fortran_order").is_some_and(|v| v.starts_with("True"));
    let values = match fortran || columns == 1 {
        true => values,
        false => (0..count)
            .map(|i| values[(i % rows) * columns + i / rows])
            .collect(),
    };
    Ok(Array {
        name: name.into(),
        rows,
        columns,
        values,
    })
}
