//! Files as text.

use crate::error::{Error, Result};
use std::io::Read;
use std::path::Path;

/// Largest robot file that is read, bytes.
pub const MAX_BYTES: u64 = 64 << 20;

/// The file at this path, as text.
pub(crate) fn read_text(path: &Path) -> Result<String> {
    let file = std::fs::File::open(path).map_err(|e| Error::io(path, e))?;
    let mut bytes = Vec::new();
    file.take(MAX_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(|e| Error::io(path, e))?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(Error::file(
            path,
            "",
            format!(
                "larger than {} MiB: this is not a robot file",
                MAX_BYTES >> 20
            ),
        ));
    }
    String::from_utf8(bytes).map_err(|e| {
        let valid = e.utf8_error().valid_up_to();
        let line = 1 + e
            .as_bytes()
            .iter()
            .take(valid)
            .filter(|b| **b == b'\n')
            .count();
        Error::file(
            path,
            format!("line {line}"),
            "it is not UTF-8 text; save it as UTF-8",
        )
    })
}
