//! Files that logs come in, one file a format: each gives a [`Table`] of named columns.
//!
//! | format | file | names of the columns |
//! |---|---|---|
//! | CSV of any layout, RTDE, libfranka, Kortex; also packed or in UTF-16 (`source`) | `csv` | the header's, or numbers from 1; lists in cells as `name[0]` … |
//! | rosbag2 | `db3`, `mcap` | `position/JOINT`, `velocity/JOINT`, `effort/JOINT`, … (`bag`) |
//! | NumPy | `npz` | `array`, or `array[0]` … |
//! | JSON, JSON Lines | `json` | `member`, `object.member`, `list[0]` … |
//! | MATLAB 5 to 7.2 | `mat` | `variable`, `struct.field`, or `variable[0]` … |

mod arrays;
mod bag;
mod bytes;
mod cdr;
pub(crate) mod csv;
mod db3;
mod dialect;
mod json;
mod mat;
mod mcap;
mod npz;
mod source;
mod sqlite;

use super::Table;
use crate::error::{Error, Result};
use crate::log::place::Place;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Format of a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// text in cells, of any layout
    Csv,
    /// rosbag2 in SQLite
    Db3,
    /// rosbag2 in MCAP
    Mcap,
    /// CSV of the RTDE recorder of Universal Robots
    Rtde,
    /// CSV of libfranka's log
    Libfranka,
    /// CSV of the feedback of Kinova's Kortex
    Kortex,
    /// NumPy arrays, `.npz` or `.npy`
    Npz,
    /// MATLAB 5 to 7.2
    Mat,
    /// JSON: one object a line, a list of objects, or one object of lists
    Json,
}

impl Format {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Format::Csv => "csv",
            Format::Db3 => "db3",
            Format::Mcap => "mcap",
            Format::Rtde => "rtde",
            Format::Libfranka => "libfranka",
            Format::Kortex => "kortex",
            Format::Npz => "npz",
            Format::Mat => "mat",
            Format::Json => "json",
        }
    }

    /// Whether it is text in cells.
    pub fn text(self) -> bool {
        matches!(
            self,
            Format::Csv | Format::Rtde | Format::Libfranka | Format::Kortex
        )
    }

    /// The dialect of CSV that these names of columns are of.
    pub(super) fn of_names(names: &[String]) -> Format {
        let has = |what: &str| names.iter().any(|n| n.trim().starts_with(what));
        if has("actual_q_") || has("target_q_") || has("actual_current_") {
            Format::Rtde
        } else if has("state.q[") || has("state.tau_J") || has("state.q_d") {
            Format::Libfranka
        } else if has("actuators[") || has("actuators_") || has("actuators.") {
            Format::Kortex
        } else {
            Format::Csv
        }
    }
}

/// What is read of a file.
pub(crate) struct Request<'a> {
    /// the format that was stated
    pub format: Option<Format>,
    /// the topic of a bag that was stated
    pub topic: Option<&'a str>,
    /// whether a column of this name is kept
    pub wanted: &'a dyn Fn(&str) -> bool,
    /// rows that need not be read, of a text that comes in parts
    pub skip: Option<Skip>,
}

/// Rows that come too early.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Skip {
    /// where the time stands
    pub time: Place,
    /// how long after the first stamp the first row comes that counts, in the unit of the stamps
    pub before: f64,
}

/// A table and what it came from.
pub(crate) struct Read {
    /// the columns
    pub table: Table,
    /// format of the file
    pub format: Format,
    /// the topic of a bag that was read
    pub topic: Option<String>,
}

/// What takes the parts of a file; it says whether it wants more.
pub(crate) type Each<'a> = &'a mut dyn FnMut(Table) -> Result<ControlFlow<()>>;

/// The format of a file, which is that which is stated.
fn format_of(path: &Path, request: &Request) -> Result<Format> {
    let found = detect(path)?;
    if let Some(stated) = request.format
        && stated != found
        && !(stated.text() && found.text())
    {
        let message = format!(
            "format = \"{}\" is stated, but it is a file of format {}",
            stated.name(),
            found.name()
        );
        return Err(Error::file(path, "", message));
    }
    Ok(found)
}

/// Reads a file, or a folder that holds a bag.
pub(crate) fn read(path: &Path, request: &Request) -> Result<Read> {
    let found = format_of(path, request)?;
    let plain = |table: Table, format| Read {
        table,
        format,
        topic: None,
    };
    Ok(match found {
        Format::Db3 | Format::Mcap => {
            let mut bag = bag::Collector::new(request.topic);
            messages(path, &mut bag)?;
            let (table, topic) = bag.table(path)?;
            Read {
                table,
                format: found,
                topic: Some(topic),
            }
        }
        Format::Npz => plain(npz::read(path)?, found),
        Format::Mat => plain(mat::read(path)?, found),
        Format::Json => plain(json::read(path)?, found),
        _ => {
            let (table, ()) = csv::read(path, request.wanted, &|_| Ok(()))?;
            let format = request
                .format
                .unwrap_or_else(|| Format::of_names(&table.names));
            plain(table, format)
        }
    })
}

/// Reads the messages of all files of a bag.
fn messages(path: &Path, bag: &mut bag::Collector) -> Result<()> {
    for part in parts(path)? {
        match detect(&part)? {
            Format::Mcap => mcap::read(&part, bag)?,
            _ => db3::read(&part, bag)?,
        }
    }
    Ok(())
}

/// Whether a file can be read in parts: text and bags, no arrays.
pub(crate) fn divides(path: &Path) -> Result<bool> {
    let found = detect(path)?;
    Ok(found.text() || matches!(found, Format::Db3 | Format::Mcap))
}

/// Reads text or a bag in parts of `rows` rows, and hands each to `each`; the last has half as many at least and up to
/// half as many again. Files of arrays come as a whole. Returns the topic of a bag.
pub(crate) fn read_parts(
    path: &Path,
    request: &Request,
    rows: usize,
    each: &mut dyn FnMut(Table, Format) -> Result<ControlFlow<()>>,
) -> Result<Option<String>> {
    let found = format_of(path, request)?;
    if found.text() {
        let text = |table: Table, each: &mut dyn FnMut(Table, Format) -> _| {
            let format = request.format;
            let format = format.unwrap_or_else(|| Format::of_names(&table.names));
            each(table, format)
        };
        let mut enough = false;
        let mut one = |table: Table| {
            let next: Result<ControlFlow<()>> = text(table, each);
            enough = matches!(next, Ok(ControlFlow::Break(())));
            next
        };
        let (last, ()) = csv::read_parts(
            path,
            request.wanted,
            &|_| Ok(()),
            rows,
            request.skip.as_ref(),
            &mut one,
        )?;
        // nothing is left where the last rows were passed over
        if !enough && !last.columns.iter().all(Vec::is_empty) {
            let _ = text(last, each)?;
        }
        return Ok(None);
    }
    if !matches!(found, Format::Db3 | Format::Mcap) {
        let whole = read(path, request)?;
        let _ = each(whole.table, whole.format)?;
        return Ok(whole.topic);
    }
    let mut held = Table::default();
    let mut enough = false;
    let mut topic = None;
    let mut take = |table: Table, name: &str| {
        topic.get_or_insert_with(|| name.to_string());
        bag::append(&mut held, table, path)?;
        while held.rows() >= rows + rows / 2 && !enough {
            let mut part = csv::first_rows(&mut held, rows);
            part.warnings = std::mem::take(&mut held.warnings);
            enough = each(part, found)?.is_break();
        }
        Ok(match enough {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        })
    };
    let mut bag = bag::Collector::in_parts(request.topic, (rows / 2).max(1), path, &mut take);
    messages(path, &mut bag)?;
    bag.finish(path)?;
    if !enough {
        let _ = each(held, found)?;
    }
    Ok(topic)
}

/// The files of a bag: itself, or those of its folder by name.
fn parts(path: &Path) -> Result<Vec<PathBuf>> {
    if !path.is_dir() {
        return Ok(vec![path.to_path_buf()]);
    }
    let mut parts = Vec::new();
    for entry in std::fs::read_dir(path).map_err(|e| Error::io(path, e))? {
        let file = entry.map_err(|e| Error::io(path, e))?.path();
        let bag = file
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("db3") || e.eq_ignore_ascii_case("mcap"));
        if bag && file.is_file() {
            parts.push(file);
        }
    }
    parts.sort();
    match parts.is_empty() {
        false => Ok(parts),
        true => Err(Error::file(
            path,
            "",
            "it is a folder without a bag (.db3 or .mcap); name a file",
        )),
    }
}

/// The format of a file by its first bytes.
pub(crate) fn detect(path: &Path) -> Result<Format> {
    if path.is_dir() {
        let first = parts(path)?;
        return detect(first.first().map_or(path, |p| p.as_path()));
    }
    let mut head = [0u8; 132];
    let (packed, filled) = source::open(path)
        .and_then(|mut s| Ok((s.packed, source::fill(&mut s.read, &mut head)?)))
        .map_err(|e| Error::io(path, e))?;
    let found = format_of_bytes(path, &head[..filled])?;
    match packed && !(found.text() || found == Format::Json) {
        true => Err(Error::file(
            path,
            "",
            "the whole file is compressed; unpack it first",
        )),
        false => Ok(found),
    }
}

/// The format of a file that begins so.
fn format_of_bytes(path: &Path, head: &[u8]) -> Result<Format> {
    let refuse = |what: &str| Err(Error::file(path, "", what));
    if head.starts_with(b"SQLite format 3\0") {
        return Ok(Format::Db3);
    }
    if head.starts_with(b"\x89MCAP0\r\n") {
        return Ok(Format::Mcap);
    }
    if head.starts_with(b"PK\x03\x04") || head.starts_with(b"\x93NUMPY") {
        return Ok(Format::Npz);
    }
    // a text of its own, then version 1 and the order of bytes
    let matlab = matches!(head.get(124..128), Some(b"\x00\x01IM" | b"\x01\x00MI"));
    if head.starts_with(b"MATLAB 5.0") || matlab {
        return Ok(Format::Mat);
    }
    if head.starts_with(b"MATLAB 7.3") || head.starts_with(b"\x89HDF") {
        return refuse("it is HDF5 (MATLAB 7.3), which is not read; save it with -v7");
    }
    if head.starts_with(b"#ROSBAG") {
        return refuse(
            "it is a bag of ROS 1, which is not read; convert it with `rosbags-convert`",
        );
    }
    if head.starts_with(b"PAR1") || head.starts_with(b"ARROW1") || head.starts_with(b"FEA1") {
        return refuse(
            "it is Parquet or Arrow, which are not read; save it as CSV (pandas: `to_csv`)",
        );
    }
    // protocols 2 to 5
    if matches!(head, [0x80, 2..=5, ..]) {
        return refuse(
            "it is a pickle of Python, which is not read; save its arrays with `numpy.savez`",
        );
    }
    if head.iter().filter(|b| **b == 0).count() > head.len() / 8 {
        return refuse(
            "it is a binary file of no known format (known are csv, json, db3, mcap, npz and mat)",
        );
    }
    if json::begins(head) {
        return Ok(Format::Json);
    }
    Ok(Format::Csv)
}
