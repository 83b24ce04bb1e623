//! Text in cells as columns of numbers.
//!
//! The file is read in blocks; each block is cut at line ends into pieces that are parsed on all
//! threads, straight into columns. In memory are the columns and one block, whatever the size of the
//! file. Lines that are no rows are left out and named.

use super::dialect::{Cell, Dialect, canonical, idle, stamp, strip};
use super::{Each, Skip, source};
use crate::error::{Error, Result, Warning, WarningKind, listed};
use crate::log::{Table, abreast, number};
use rayon::prelude::*;
use std::borrow::Cow;
use std::io::Read;
use std::ops::ControlFlow;
use std::path::Path;

/// Bytes of one block.
const BLOCK: usize = 8 << 20;
/// Bytes of the piece that one thread parses.
const PIECE: usize = 256 << 10;
/// Longest line; a longer one is not a table of numbers.
const LINE: usize = 1 << 20;
/// Bad lines that are kept with their reasons.
const NAMED: usize = 3;

/// What is wrong with a line: its number within the piece, and why.
struct Bad {
    line: usize,
    message: String,
}

/// Columns of one piece and its lines.
struct Piece {
    columns: Vec<Vec<f64>>,
    lines: usize,
    /// the first bad lines
    bad: Vec<Bad>,
    /// number of bad lines
    count: usize,
    /// whether the last line is one of them
    last: bool,
}

/// Lines that are no rows.
#[derive(Default)]
pub(super) struct Left {
    /// how many
    pub count: usize,
    /// the first of them, with what is wrong
    pub first: Vec<String>,
}

impl Left {
    /// Names another one, of which `what` says what is wrong, while few are named.
    pub(super) fn name(&mut self, what: impl FnOnce() -> String) {
        if self.first.len() < NAMED {
            self.first.push(what());
        }
    }

    /// That they were left out.
    pub(super) fn warning(&self, path: &Path) -> Warning {
        let count = match self.count {
            1 => "1 line is no row and was".to_string(),
            n => format!("{n} lines are no rows and were"),
        };
        let first = self.first.join("; ");
        let more = match self.count > self.first.len() {
            true => "; …",
            false => "",
        };
        Warning::new(
            WarningKind::RowsLeftOut,
            path.display().to_string(),
            format!("{count} left out: {first}{more}"),
        )
    }
}

/// Reads a file; columns for which `wanted` is false are not kept (their column is empty). `check`
/// looks at the names before any line is read, and what it returns is handed on.
pub(crate) fn read<T>(
    path: &Path,
    wanted: &dyn Fn(&str) -> bool,
    check: &dyn Fn(&Table) -> Result<T>,
) -> Result<(Table, T)> {
    read_parts(path, wanted, check, usize::MAX, None, &mut |_| {
        Ok(ControlFlow::Continue(()))
    })
}

/// The same, but no more than `rows` and a half of them are held: as many rows are handed to `each` whenever there are
/// so many, and what is returned are the last, at least half a part; no rows where `each` said that it has enough.
pub(crate) fn read_parts<T>(
    path: &Path,
    wanted: &dyn Fn(&str) -> bool,
    check: &dyn Fn(&Table) -> Result<T>,
    rows: usize,
    skip: Option<&Skip>,
    each: Each,
) -> Result<(Table, T)> {
    let mut skip = skip.map(Skipping::new);
    let most = rows.saturating_add(rows / 2);
    let mut given = 0;
    let mut checked = None;
    let mut file = source::open(path).map_err(|e| Error::io(path, e))?.read;
    let size = std::fs::metadata(path).map_or(0, |m| m.len());
    let mut block = vec![0u8; BLOCK.min(size as usize + 1).max(64 << 10)];
    let mut filled = 0;
    let mut table = Table::default();
    let mut layout: Option<(Dialect, Vec<bool>)> = None;
    let mut left = Left::default();
    let mut line = 0;
    'file: loop {
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
        if layout.is_none() {
            let dialect = Dialect::of(text).ok_or_else(|| no_numbers(path, text))?;
            if let Some((column, turn)) = &dialect.turns {
                return Err(in_turn(path, column, turn));
            }
            text = strip(text);
            let first = text.iter().take(LINE).position(|b| *b == b'\n');
            for _ in 0..dialect.head {
                let at = text.iter().position(|b| *b == b'\n');
                text = at.map_or(&[], |at| &text[at + 1..]);
            }
            line = dialect.head;
            let mut keep: Vec<bool> = (0..dialect.names.len())
                .map(|k| dialect.cells[k] != Cell::Text && wanted(&dialect.names[k]))
                .collect();
            // whoever wants the seconds of a stamp wants all of it; seconds alone are too coarse to pass rows over by
            if let Some([seconds, more]) = stamp_in_two(&dialect.names) {
                keep[more] |= keep[seconds];
                skip = None;
            }
            let lines = (size as usize / first.unwrap_or(80).max(8)).min(1 << 24);
            table.names = dialect.names.clone();
            table.columns = vec![Vec::new(); table.names.len()];
            for (column, keep) in table.columns.iter_mut().zip(&keep) {
                column.reserve(if *keep { most.min(lines / 2) } else { 0 });
            }
            checked = Some(check(&table)?);
            layout = Some((dialect, keep));
        }
        let early = (skip.as_mut().zip(layout.as_ref()))
            .is_some_and(|(s, (dialect, _))| s.early(text, dialect))
            && given + table.rows() > 0;
        let mut passed = 0;
        if early {
            let lines = || text.split_inclusive(|b| *b == b'\n');
            line += lines().count();
            passed = lines().filter(|l| !idle(l)).count();
        } else if let Some((dialect, keep)) = &layout {
            let cut_off = end && !text.is_empty() && text.last() != Some(&b'\n');
            let text: Cow<[u8]> = match dialect.plain {
                true => Cow::Borrowed(text),
                false => {
                    let parts: Vec<Vec<u8>> = cut(text)
                        .into_par_iter()
                        .map(|p| {
                            let mut out = Vec::with_capacity(p.len());
                            canonical(p, dialect.delimiter, dialect.comma, &mut out);
                            out
                        })
                        .collect();
                    Cow::Owned(parts.concat())
                }
            };
            append(
                &mut table, &text, dialect, keep, &mut line, cut_off, &mut left, path,
            );
        }
        loop {
            // what was read before rows that are passed over is a part of its own
            let count = match early {
                true => table.rows(),
                false if table.rows() >= most => rows,
                false => 0,
            };
            let Some((dialect, _)) = layout.as_ref().filter(|_| count > 0) else {
                break;
            };
            let mut part = first_rows(&mut table, count);
            finish(&mut part, dialect);
            given += count;
            if each(part)?.is_break() {
                table.columns.iter_mut().for_each(Vec::clear);
                break 'file;
            }
        }
        table.before += passed;
        block.copy_within(whole..filled, 0);
        filled -= whole;
        if end {
            break;
        }
    }
    let rows = given + table.rows();
    let (Some(checked), Some((dialect, keep))) = (checked, layout) else {
        return Err(no_numbers(path, &[]));
    };
    if left.count > 0 {
        let first = left.first.join("; ");
        if left.count > rows {
            let message = format!(
                "{} of {} lines are no rows of {} cells: {first}",
                left.count,
                left.count + rows,
                table.names.len()
            );
            return Err(Error::file(path, "", message));
        }
        table.warnings.push(left.warning(path));
    }
    if rows == 0 && keep.contains(&true) {
        return Err(no_numbers(path, &[]));
    }
    table.warnings.extend(times_as_texts(&dialect, path));
    table.warnings.extend(dialect.unused.iter().map(|what| {
        Warning::new(
            WarningKind::ColumnsIgnored,
            path.display().to_string(),
            format!("its header has {what}: it was not used, and the columns are called by their numbers"),
        )
    }));
    finish(&mut table, &dialect);
    Ok((table, checked))
}

/// Blocks of rows that come before those that count.
struct Skipping<'a> {
    what: &'a Skip,
    /// first and last stamp that was seen; `None` before there is any
    seen: Option<[f64; 2]>,
    /// whether the stamps increased so far
    sound: bool,
}

impl<'a> Skipping<'a> {
    fn new(what: &'a Skip) -> Self {
        Skipping {
            what,
            seen: None,
            sound: true,
        }
    }

    /// Whether all rows of a block come too early, by its first and last line. Stamps that do not increase from block to
    /// block say nothing, and nothing that follows is skipped.
    fn early(&mut self, text: &[u8], dialect: &Dialect) -> bool {
        // columns of texts are not counted
        let kept: Vec<usize> = (0..dialect.cells.len())
            .filter(|&k| dialect.cells[k] != Cell::Text)
            .collect();
        let names = kept.iter().map(|&k| dialect.names[k].as_str());
        let column = self.what.time.position(names).map(|at| kept[at]);
        let column = column.filter(|k| dialect.plain && dialect.cells[*k] == Cell::Number);
        let Some(column) = column.filter(|_| self.sound) else {
            return false;
        };
        let stamp = |line: &[u8]| {
            let cell = line.split(|b| *b == dialect.delimiter).nth(column)?;
            number::parse(cell.trim_ascii()).filter(|x| x.is_finite())
        };
        let mut lines = text.trim_ascii_end();
        let first = lines.split(|b| *b == b'\n').next().and_then(stamp);
        if let Some(at) = lines.iter().rposition(|b| *b == b'\n') {
            lines = &lines[at + 1..];
        }
        let (Some(first), Some(last)) = (first, stamp(lines)) else {
            self.sound = false;
            return false;
        };
        let [origin, before] = self.seen.unwrap_or([first, first]);
        self.sound = before <= first && first <= last;
        self.seen = Some([origin, last]);
        // a row to spare for what is written with few digits
        self.sound && last - origin < self.what.before * (1.0 - 1e-9) - 1e-6
    }
}

/// Takes the first rows out of a table; columns that are not kept are empty.
pub(super) fn first_rows(table: &mut Table, rows: usize) -> Table {
    let columns = table.columns.iter_mut();
    let before = table.before;
    table.before += rows;
    Table {
        names: table.names.clone(),
        columns: columns
            .map(|c| {
                let mut rest = Vec::with_capacity(c.capacity());
                rest.extend_from_slice(&c[rows.min(c.len())..]);
                c.truncate(rows);
                std::mem::replace(c, rest)
            })
            .collect(),
        labels: table.labels.clone(),
        before,
        warnings: Vec::new(),
    }
}

/// Columns of the seconds and of the nanoseconds of a stamp.
fn stamp_in_two(names: &[String]) -> Option<[usize; 2]> {
    let of = |name: &str, ends: &[&str]| {
        let name = name.to_lowercase();
        let (stem, end) = name.rsplit_once(['.', '_']).unwrap_or(("", &name));
        ends.contains(&end).then(|| stem.to_string())
    };
    (1..names.len()).find_map(|k| {
        let seconds = of(&names[k - 1], &["sec", "secs"])?;
        let more = of(&names[k], &["nanosec", "nanosecs", "nsec", "nsecs"])?;
        (seconds == more).then_some([k - 1, k])
    })
}

/// Makes of the rows that were read what is handed on.
fn finish(table: &mut Table, dialect: &Dialect) {
    without_texts(table, dialect);
    whole_stamp(table);
}

/// Makes the seconds of a stamp in two columns the whole stamp.
pub(super) fn whole_stamp(table: &mut Table) {
    let Some([seconds, more]) = stamp_in_two(&table.names) else {
        return;
    };
    let (before, after) = table.columns.split_at_mut(more);
    for (s, ns) in before[seconds].iter_mut().zip(&after[0]) {
        *s += 1e-9 * ns;
    }
}

/// A column of texts can be neither a time nor a measurement; one that holds the same text throughout is a label.
fn without_texts(table: &mut Table, dialect: &Dialect) {
    let labels = dialect.names.iter().zip(&dialect.texts);
    table.labels = labels
        .filter_map(|(name, text)| Some([name.clone(), text.clone()?]))
        .collect();
    let texts: Vec<usize> = (0..table.names.len())
        .filter(|&k| dialect.cells[k] == Cell::Text)
        .collect();
    for k in texts.into_iter().rev() {
        table.names.remove(k);
        table.columns.remove(k);
    }
}

/// Columns of texts that are called a time: stamps of a kind that is not known.
fn times_as_texts(dialect: &Dialect, path: &Path) -> Option<Warning> {
    let time = |name: &str| {
        let name = name.to_lowercase();
        name == "t" || name.contains("time") || name.contains("stamp")
    };
    let all = dialect.names.iter().zip(&dialect.cells);
    let lost: Vec<&str> = all
        .filter(|(name, cell)| **cell == Cell::Text && time(name))
        .map(|(name, _)| name.as_str())
        .collect();
    (!lost.is_empty()).then(|| {
        Warning::new(
            WarningKind::ColumnsIgnored,
            path.display().to_string(),
            format!(
                "{}: called a time, and neither numbers nor dates that are known: left out",
                lost.join(", ")
            ),
        )
    })
}

fn no_numbers(path: &Path, text: &[u8]) -> Error {
    let message = match text.is_empty() || text.trim_ascii().is_empty() {
        true => "it is empty, or has a header and no samples under it; was the recording stopped?",
        false => "it has a header and no samples under it, or no line of numbers at all",
    };
    Error::file(path, "", message)
}

/// Parses whole lines and appends them.
#[allow(clippy::too_many_arguments)]
fn append(
    table: &mut Table,
    text: &[u8],
    dialect: &Dialect,
    keep: &[bool],
    line: &mut usize,
    cut_off: bool,
    left: &mut Left,
    path: &Path,
) {
    let delimiter = if dialect.plain {
        dialect.delimiter
    } else {
        b','
    };
    let pieces: Vec<Piece> = cut(text)
        .into_par_iter()
        .flat_map_iter(|p| piece(p, delimiter, &dialect.cells, keep))
        .filter(|p| p.lines > 0)
        .collect();
    let columns = table.columns.par_iter_mut().enumerate();
    columns.for_each(|(k, column)| {
        for p in &pieces {
            column.extend_from_slice(&p.columns[k]);
        }
    });
    let end = pieces.len().wrapping_sub(1);
    for (k, mut p) in pieces.into_iter().enumerate() {
        // a recording that was cut in the middle of its last line
        if cut_off && k == end && p.last {
            p.count -= 1;
            p.bad.retain(|b| b.line != p.lines);
            table.warnings.push(Warning::new(
                WarningKind::RowsLeftOut,
                path.display().to_string(),
                format!(
                    "line {} breaks off at the end of the file; it was left out",
                    *line + p.lines
                ),
            ));
        }
        left.count += p.count;
        for bad in p.bad {
            left.name(|| {
                let message = explain(&bad.message, &dialect.names);
                format!("line {}: {message}", *line + bad.line)
            });
        }
        *line += p.lines;
    }
}

/// Puts the name for the `{k}` of a message.
fn explain(message: &str, names: &[String]) -> String {
    match message.split_once('{').and_then(|(before, rest)| {
        let (k, after) = rest.split_once('}')?;
        let name = names.get(k.parse::<usize>().ok()?)?;
        Some(format!("{before}{name}{after}"))
    }) {
        Some(text) => text,
        None => message.to_string(),
    }
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

/// Parses the lines of one piece, in two parts.
fn piece(text: &[u8], delimiter: u8, cells: &[Cell], keep: &[bool]) -> [Piece; 2] {
    let middle = text.len() / 2;
    let end = text[middle..].iter().position(|b| *b == b'\n');
    let (a, b) = text.split_at(end.map_or(text.len(), |at| middle + at + 1));
    let [mut x, mut y] = [a, b].map(|text| empty(text, keep));
    let usual = |k: usize| !keep[k] || cells[k] == Cell::Number;
    let ([p, q], rows) = match (0..keep.len()).all(usual) {
        true => abreast::rows([a, b], delimiter, keep, [&mut x.columns, &mut y.columns]),
        false => ([0, 0], 0),
    };
    (x.lines, y.lines) = (rows, rows);
    rest(a, p, delimiter, cells, keep, &mut x);
    rest(b, q, delimiter, cells, keep, &mut y);
    [x, y]
}

/// A piece with room for the lines of a text.
fn empty(text: &[u8], keep: &[bool]) -> Piece {
    let first = text.iter().position(|&b| b == b'\n').unwrap_or(text.len());
    let rows = text.len() / first.max(8) + 16;
    let room = |keep: &bool| Vec::with_capacity(if *keep { rows } else { 0 });
    Piece {
        columns: keep.iter().map(room).collect(),
        lines: 0,
        bad: Vec::new(),
        count: 0,
        last: false,
    }
}

/// Parses the lines of a text from a place on.
fn rest(text: &[u8], from: usize, delimiter: u8, cells: &[Cell], keep: &[bool], out: &mut Piece) {
    let n = keep.len();
    let mut row = vec![0.0; n];
    let mut brief = vec![true; n];
    let mut at = from;
    while at < text.len() {
        out.lines += 1;
        out.last = false;
        if abreast::may_be_idle(text[at]) {
            let end = text[at..]
                .iter()
                .position(|b| *b == b'\n')
                .map_or(text.len(), |k| at + k);
            if idle(&text[at..end]) {
                at = end + 1;
                continue;
            }
        }
        let mut k = 0;
        let mut wrong = None;
        loop {
            if k < n
                && keep[k]
                && cells[k] == Cell::Number
                && let Some((x, end)) = number::plain(text, at, delimiter, &mut brief[k])
            {
                row[k] = x;
                k += 1;
                at = end + 1;
                if text[end] == b'\n' {
                    break;
                }
                continue;
            }
            let start = at;
            while at < text.len() && text[at] != delimiter && text[at] != b'\n' {
                at += 1;
            }
            let line_end = at >= text.len() || text[at] == b'\n';
            let mut cell = &text[start..at];
            if line_end && cell.last() == Some(&b'\r') {
                cell = &cell[..cell.len() - 1];
            }
            at += 1;
            if k < n && keep[k] {
                let value = match cells[k] {
                    Cell::Number => number::parse(cell),
                    Cell::Empty => Some(number::parse(cell).unwrap_or(f64::NAN)),
                    _ => stamp(cell).or(cell.trim_ascii().is_empty().then_some(f64::NAN)),
                };
                match value {
                    Some(x) => row[k] = x,
                    None if wrong.is_none() => {
                        let shown: String = String::from_utf8_lossy(cell)
                            .chars()
                            .filter(|c| !c.is_control())
                            .take(40)
                            .collect();
                        wrong = Some(format!("column {{{k}}}: `{shown}` is not a number"));
                    }
                    None => {}
                }
            }
            k += 1;
            if line_end {
                break;
            }
        }
        // a delimiter behind the last cell of every line is no cell
        let ends = |b: &&u8| **b == delimiter || !b.is_ascii_whitespace();
        let last = || text[..at.min(text.len())].iter().rev().find(ends);
        if k != n && !(k == n + 1 && last() == Some(&delimiter)) {
            wrong = Some(format!("it has {k} cells instead of {n}"));
        }
        if let Some(message) = wrong {
            out.count += 1;
            out.last = true;
            if out.bad.len() < NAMED || at >= text.len() {
                out.bad.push(Bad {
                    line: out.lines,
                    message,
                });
            }
            continue;
        }
        for k in 0..n {
            if keep[k] {
                out.columns[k].push(row[k]);
            }
        }
    }
}

/// Rows that are of one joint each.
fn in_turn(path: &Path, column: &str, turn: &[String]) -> Error {
    let message = format!(
        "its rows are of {} in turn, by its column {column}: a row must hold all of one time. With pandas: \
         df.pivot(index=\"TIME\", columns=\"{column}\"), with the name of the column of times for TIME, and then to_csv with joined names",
        listed(turn)
    );
    Error::file(path, "", message)
}

/// The names of the columns.
pub(crate) fn names(path: &Path) -> Result<Vec<String>> {
    let file = source::open(path).map_err(|e| Error::io(path, e))?;
    let mut text = Vec::new();
    file.read
        .take(256 << 10)
        .read_to_end(&mut text)
        .map_err(|e| Error::io(path, e))?;
    match Dialect::of(&text) {
        Some(dialect) => Ok(dialect.names),
        None => Err(no_numbers(path, &text)),
    }
}
