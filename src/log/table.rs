//! A CSV file of numbers as columns.
//!
//! The file is read in blocks; each block is cut at line ends into pieces that are parsed on all
//! threads, straight into columns. In memory are the columns and one block, whatever the size of the
//! file.

use super::number;
use crate::error::{Error, Result, Warning, WarningKind};
use rayon::prelude::*;
use std::io::Read;
use std::path::Path;

/// Bytes of one block.
const BLOCK: usize = 8 << 20;
/// Bytes of the piece that one thread parses.
const PIECE: usize = 256 << 10;
/// Longest line; a longer one is not a table of numbers.
const LINE: usize = 1 << 20;

/// Columns of numbers with names.
#[derive(Debug, Clone, Default)]
pub struct Table {
    /// names in the order of the file
    pub names: Vec<String>,
    /// one column a name; NaN where a value was dropped
    pub columns: Vec<Vec<f64>>,
    /// what was imperfect
    pub warnings: Vec<Warning>,
}

/// What is wrong with a line: its number within the piece, and why.
struct Bad {
    line: usize,
    /// whether the text ends in it
    last: bool,
    message: String,
}

/// Columns of one piece and its lines.
struct Piece {
    columns: Vec<Vec<f64>>,
    lines: usize,
    bad: Option<Bad>,
}

impl Table {
    /// Reads a file; columns for which `wanted` is false are checked for their presence in every
    /// line but not kept (their column is empty).
    ///
    /// # Errors
    /// A file that cannot be read, without header or without lines; a line with another number of
    /// cells than the header, or with a cell that is no number, by its number.
    pub fn read(path: impl AsRef<Path>, wanted: &dyn Fn(&str) -> bool) -> Result<Self> {
        Ok(Self::read_checked(path.as_ref(), wanted, &|_| Ok(()))?.0)
    }

    /// As [`Table::read`]; `check` looks at the names before any line is read, and what it returns is
    /// handed on.
    ///
    /// # Errors
    /// Those of [`Table::read`] and of `check`.
    pub fn read_checked<T>(
        path: &Path,
        wanted: &dyn Fn(&str) -> bool,
        check: &dyn Fn(&Table) -> Result<T>,
    ) -> Result<(Self, T)> {
        let mut checked = None;
        let mut file = std::fs::File::open(path).map_err(|e| Error::io(path, e))?;
        let size = file.metadata().map_or(0, |m| m.len());
        let mut block = vec![0u8; BLOCK.min(size as usize + 1).max(64 << 10)];
        let mut filled = 0;
        let mut table = Table::default();
        let mut keep: Vec<bool> = Vec::new();
        let mut line = 0;
        loop {
            let got = file
                .read(&mut block[filled..])
                .map_err(|e| Error::io(path, e))?;
            filled += got;
            let end = got == 0;
            if !end && filled < block.len() {
                continue;
            }
            // up to the last line end; at the end of the file everything
            let whole = match end {
                true => filled,
                false => match block[..filled].iter().rposition(|&b| b == b'\n') {
                    Some(at) => at + 1,
                    None if filled > LINE => {
                        let message = "a line of more than a megabyte: this is not a CSV log";
                        return Err(Error::file(path, format!("line {}", line + 1), message));
                    }
                    None => {
                        block.resize(2 * filled, 0);
                        continue;
                    }
                },
            };
            let mut text = &block[..whole];
            if table.names.is_empty() {
                let (names, rest, lines) = header(path, text)?;
                keep = names.iter().map(|n| wanted(n)).collect();
                table.columns = vec![Vec::new(); names.len()];
                let each = text.len() - rest.len();
                let rows = (size as usize / each.max(1)).min(1 << 24);
                for (column, keep) in table.columns.iter_mut().zip(&keep) {
                    column.reserve(if *keep { rows / 2 } else { 0 });
                }
                table.names = names;
                checked = Some(check(&table)?);
                line = lines;
                text = rest;
            }
            let cut_off = end && !text.is_empty() && text.last() != Some(&b'\n');
            table.parse(path, text, &keep, &mut line, cut_off)?;
            block.copy_within(whole..filled, 0);
            filled -= whole;
            if end {
                break;
            }
        }
        match checked {
            Some(checked) if table.rows() > 0 => Ok((table, checked)),
            _ => {
                let message = "it has a header and no samples under it; was the recording stopped?";
                Err(Error::file(path, "", message))
            }
        }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.iter().map(Vec::len).max().unwrap_or(0)
    }

    /// Index of the column of this name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }

    /// Parses whole lines and appends them.
    fn parse(
        &mut self,
        path: &Path,
        text: &[u8],
        keep: &[bool],
        line: &mut usize,
        cut_off: bool,
    ) -> Result<()> {
        let pieces: Vec<Piece> = cut(text).into_par_iter().map(|p| piece(p, keep)).collect();
        let last = pieces.len().wrapping_sub(1);
        for (k, p) in pieces.into_iter().enumerate() {
            for (column, more) in self.columns.iter_mut().zip(p.columns) {
                column.extend_from_slice(&more);
            }
            if let Some(bad) = p.bad {
                let at = *line + bad.line;
                // a recording that was cut in the middle of its last line
                if cut_off && k == last && bad.last {
                    self.warnings.push(Warning::new(
                        WarningKind::RowsLeftOut,
                        path.display().to_string(),
                        format!("line {at} breaks off at the end of the file; it was left out"),
                    ));
                    return Ok(());
                }
                return Err(Error::file(
                    path,
                    format!("line {at}"),
                    self.explain(&bad.message),
                ));
            }
            *line += p.lines;
        }
        Ok(())
    }

    /// Puts the name for the `{k}` of a message.
    fn explain(&self, message: &str) -> String {
        match message.split_once('{').and_then(|(before, rest)| {
            let (k, after) = rest.split_once('}')?;
            let name = self.names.get(k.parse::<usize>().ok()?)?;
            Some(format!("{before}{name}{after}"))
        }) {
            Some(text) => text,
            None => message.to_string(),
        }
    }
}

/// The names in the first line, the text after it, and the lines read so far.
fn header<'a>(path: &Path, text: &'a [u8]) -> Result<(Vec<String>, &'a [u8], usize)> {
    let mut rest = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let mut lines = 0;
    while !rest.is_empty() {
        lines += 1;
        let end = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        let (first, after) = (&rest[..end], &rest[(end + 1).min(rest.len())..]);
        let first = String::from_utf8_lossy(first);
        let first = first.trim();
        rest = after;
        if first.is_empty() || first.starts_with('#') {
            continue;
        }
        let place = format!("line {lines}");
        if !first.contains(',') && first.contains([';', '\t']) {
            let message = "the cells are separated by semicolons or tabs; a log is separated by \
                           commas, with a point in decimal numbers";
            return Err(Error::file(path, place, message));
        }
        let names: Vec<String> = first
            .split(',')
            .map(|n| n.trim().trim_matches('"').trim().to_string())
            .collect();
        if names.iter().all(|n| n.parse::<f64>().is_ok()) {
            let message = "the first line holds numbers where the names of the columns should be \
                           (t, q1, …, tau1, …)";
            return Err(Error::file(path, place, message));
        }
        for (k, name) in names.iter().enumerate() {
            if name.is_empty() {
                let message = format!("column {} has no name", k + 1);
                return Err(Error::file(path, place, message));
            }
            if names[..k].contains(name) {
                let message = format!("the column {name} stands there twice");
                return Err(Error::file(path, place, message));
            }
        }
        return Ok((names, rest, lines));
    }
    Err(Error::file(
        path,
        "",
        "it is empty; a log begins with the names of its columns",
    ))
}

/// Cuts a text at line ends into pieces.
fn cut(text: &[u8]) -> Vec<&[u8]> {
    let mut pieces = Vec::with_capacity(text.len() / PIECE + 1);
    let mut rest = text;
    while rest.len() > PIECE {
        let end = rest[PIECE..]
            .iter()
            .position(|&b| b == b'\n')
            .map_or(rest.len(), |at| PIECE + at + 1);
        pieces.push(&rest[..end]);
        rest = &rest[end..];
    }
    if !rest.is_empty() {
        pieces.push(rest);
    }
    pieces
}

/// Parses the lines of one piece, up to the first bad one.
fn piece(text: &[u8], keep: &[bool]) -> Piece {
    let n = keep.len();
    let mut out = Piece {
        columns: vec![Vec::new(); n],
        lines: 0,
        bad: None,
    };
    let first = text.iter().position(|&b| b == b'\n').unwrap_or(text.len());
    let rows = text.len() / first.max(8) + 16;
    for (column, keep) in out.columns.iter_mut().zip(keep) {
        column.reserve(if *keep { rows } else { 0 });
    }
    let bad = |line: usize, at: usize, message: String| {
        let rest = text.get(at.saturating_sub(1)..).unwrap_or_default();
        let last = !rest.contains(&b'\n');
        Some(Bad {
            line,
            last,
            message,
        })
    };
    let mut row = vec![0.0; n];
    let mut at = 0;
    while at < text.len() {
        out.lines += 1;
        if matches!(text[at], b'\n' | b'\r' | b'#') {
            while at < text.len() && text[at] != b'\n' {
                at += 1;
            }
            at += 1;
            continue;
        }
        let mut k = 0;
        loop {
            let start = at;
            while at < text.len() && !matches!(text[at], b',' | b'\n') {
                at += 1;
            }
            let line_end = at >= text.len() || text[at] == b'\n';
            let mut cell = &text[start..at];
            if line_end && cell.last() == Some(&b'\r') {
                cell = &cell[..cell.len() - 1];
            }
            at += 1;
            if k < n {
                match number::parse(cell) {
                    Some(x) => row[k] = x,
                    None => {
                        let shown: String =
                            String::from_utf8_lossy(cell).chars().take(40).collect();
                        let message = format!("column {{{k}}}: `{shown}` is not a number");
                        out.bad = bad(out.lines, at, message);
                        return out;
                    }
                }
            }
            k += 1;
            if line_end {
                break;
            }
        }
        if k != n {
            let message = format!("it has {k} cells and the header {n} names");
            out.bad = bad(out.lines, at, message);
            return out;
        }
        for k in 0..n {
            if keep[k] {
                out.columns[k].push(row[k]);
            }
        }
    }
    out
}
