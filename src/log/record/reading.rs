//! A record from a file of any format.

use super::{POSE, check_names, numbered};
use crate::error::{Error, Result, Warning, WarningKind};
use crate::log::clock::Clock;
use crate::log::formats::{self, Format, Request, Skip, csv};
use crate::log::layout::{Layout, Time};
use crate::log::place::Place;
use crate::log::{Purpose, Record, Table, merge};
use crate::plant::Plant;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// How a record is read, as an experiment states it.
#[derive(Debug, Clone, Default)]
pub(crate) struct Reading {
    pub format: Option<Format>,
    pub topic: Option<String>,
    /// where the quantities stand
    pub layout: Option<Layout>,
    /// the part that counts, s from the start
    pub part: [Option<f64>; 2],
}

impl Reading {
    /// Whether a column may be needed: not where the columns are stated by name and it is not among them.
    fn wants(&self, name: &str) -> bool {
        let Some(layout) = &self.layout else {
            return true;
        };
        let time = match &layout.time {
            Some(Time::Column(place, _)) => Some(place),
            _ => None,
        };
        let places = layout
            .groups
            .iter()
            .flat_map(|g| &g.sources)
            .map(|s| &s.place);
        places.chain(time).any(|p| match p {
            Place::Name(n) => n == name,
            // by number: which one it is shows when all names are known
            Place::Number(_) => true,
        }) || layout.time.is_none()
    }

    /// Rows before the part that counts, where the time of a text tells them at a glance.
    fn skip(&self) -> Option<Skip> {
        let from = self.part[0].filter(|x| *x > 0.0)?;
        let (place, factor) = match &self.layout {
            None => (Place::Name("t".into()), 1.0),
            Some(layout) => match &layout.time {
                Some(Time::Column(place, Some(factor))) => (place.clone(), *factor),
                _ => return None,
            },
        };
        Some(Skip {
            time: place,
            before: from / factor,
        })
    }
}

impl Record {
    /// Reads a record from a file, or from files that hold a quantity each.
    pub(crate) fn read_as(
        paths: &[PathBuf],
        plant: &Plant,
        purpose: Purpose,
        period: Option<f64>,
        reading: &Reading,
    ) -> Result<Record> {
        let Some(path) = paths.first() else {
            return Err(Error::Argument("no log is named".into()));
        };
        let table = match own(paths, reading)? {
            true => {
                let joints = plant.actuators();
                let check = |table: &Table| check_names(table, &joints, path);
                let (mut table, unknown) = csv::read(path, &known, &check)?;
                table.warnings.extend(unknown);
                table
            }
            false => foreign(paths, plant, reading)?,
        };
        Self::of_table(table, path, plant, purpose, period, reading.part)
    }

    /// Reads a log of `plant` in parts of `rows` rows, one after the other, and hands each to `each` as a record of its
    /// own: what is held at a time does not grow with the log. The last part has half as many rows at least, and up to
    /// half as many again. A part in which no position changes is left out; it is a record without motion. CSV and bags
    /// are read in parts; arrays (`.npz`, `.mat`) come as a whole.
    ///
    /// # Errors
    /// As [`Record::read`]; fewer than 64 rows a part; what `each` returns.
    pub fn read_parts(
        path: impl AsRef<Path>,
        plant: &Plant,
        purpose: Purpose,
        period: Option<f64>,
        rows: usize,
        each: &mut dyn FnMut(Record) -> Result<()>,
    ) -> Result<()> {
        let paths = [path.as_ref().to_path_buf()];
        let reading = Reading::default();
        Self::parts_as(
            &paths,
            plant,
            purpose,
            period,
            &reading,
            rows,
            &mut |record| each(record).map(ControlFlow::Continue),
        )
    }

    /// The same, as an experiment states it, until `each` has enough. A record from several files comes as a whole.
    pub(crate) fn parts_as(
        paths: &[PathBuf],
        plant: &Plant,
        purpose: Purpose,
        period: Option<f64>,
        reading: &Reading,
        rows: usize,
        each: &mut dyn FnMut(Record) -> Result<ControlFlow<()>>,
    ) -> Result<()> {
        long_enough(rows)?;
        let [path] = paths else {
            return each(Self::read_as(paths, plant, purpose, period, reading)?).map(|_| ());
        };
        if !formats::divides(path)? {
            return each(Self::read_as(paths, plant, purpose, period, reading)?).map(|_| ());
        }
        let joints = plant.actuators();
        let (mut parts, mut still, mut enough) = (0, 0, false);
        let mut window = Window::new(reading.part);
        let mut take = |table: Table| -> Result<ControlFlow<()>> {
            let clock = Self::clock(&table, path);
            let clock = match window.cut(clock, path)? {
                Cut::Inside(clock) => clock,
                Cut::Before => return Ok(ControlFlow::Continue(())),
                Cut::Behind => {
                    enough = true;
                    return Ok(ControlFlow::Break(()));
                }
            };
            parts += 1;
            let rows = match clock.keep.as_deref() {
                Some([first, .., last]) => *first..*last + 1,
                _ => 0..table.rows(),
            };
            let moves = |k: usize| {
                let column = table.find(&format!("q{}", k + 1));
                column.is_some_and(|c| {
                    let rows = &table.columns[c][rows.clone()];
                    rows.windows(2).any(|w| w[0] != w[1])
                })
            };
            if !(0..joints.len()).any(moves) {
                still += 1;
                return Ok(ControlFlow::Continue(()));
            }
            let (mut record, clock) = Self::repaired(table, clock, path, plant, purpose, period)?;
            record.put_on_grid(&clock)?;
            record.name = format!("{}[{parts}]", record.name);
            let next = each(record)?;
            enough = next.is_break();
            Ok(next)
        };
        if own(paths, reading)? {
            let check = |table: &Table| check_names(table, &joints, path);
            let (mut last, unknown) = csv::read_parts(
                path,
                &known,
                &check,
                rows,
                reading.skip().as_ref(),
                &mut take,
            )?;
            if !last.columns.iter().all(Vec::is_empty) {
                last.warnings.extend(unknown);
                let _ = take(last)?;
            }
        } else {
            let wanted = |name: &str| reading.wants(name);
            let request = Request {
                format: reading.format,
                topic: reading.topic.as_deref(),
                wanted: &wanted,
                skip: reading.skip(),
            };
            let mut layout = None;
            formats::read_parts(path, &request, rows, &mut |table, format| {
                take(translate(table, format, plant, reading, &mut layout, path)?)
            })?;
        }
        if parts == 0 {
            return Err(window.empty(path));
        }
        if !enough && still == parts {
            let message = format!("nothing moves in its {still} parts: no position changes");
            return Err(Error::file(path, "", message));
        }
        Ok(())
    }
}

/// Rows of a part at least.
const LEAST: usize = 64;

/// Whether parts of so many rows can be looked at.
pub(crate) fn long_enough(rows: usize) -> Result<()> {
    match rows < LEAST {
        true => {
            let message = format!("parts of {rows} rows are too short; take {LEAST} or more");
            Err(Error::Argument(message))
        }
        false => Ok(()),
    }
}

/// What a part of a log has of the part of the record that counts.
enum Cut {
    /// these rows
    Inside(Clock),
    /// none, it comes before
    Before,
    /// none, and nor will those that follow
    Behind,
}

/// The part of a record that counts, while the log is read in parts.
struct Window {
    /// s from the start of the record; infinite where nothing is said
    ends: [f64; 2],
    /// whether only a part counts
    stated: bool,
    /// of what was read: its end, s from the start, the last stamp, and the usual step
    read: Option<[f64; 3]>,
}

impl Window {
    fn new([from, to]: [Option<f64>; 2]) -> Self {
        Window {
            ends: [from.unwrap_or(0.0), to.unwrap_or(f64::INFINITY)],
            stated: from.is_some() || to.is_some(),
            read: None,
        }
    }

    /// Cuts the next part of the log. Fewer rows than a part has are left out.
    fn cut(&mut self, clock: Clock, path: &Path) -> Result<Cut> {
        let (true, [first, .., last]) = (self.stated, &clock.t[..]) else {
            return Ok(Cut::Inside(clock));
        };
        // stamps that do not go on are followed as those within a log are
        let start = self.read.map_or(0.0, |[end, before, step]| {
            let ahead = first - before;
            end + if ahead > 0.0 { ahead } else { step }
        });
        self.read = Some([start + (last - first), *last, clock.step]);
        let [from, to] = self.ends.map(|x| x - start);
        if to < 0.0 {
            return Ok(Cut::Behind);
        }
        match clock.rows_between(from, to).count() {
            n if n < LEAST => Ok(Cut::Before),
            n if n == clock.t.len() => Ok(Cut::Inside(clock)),
            _ => clock.between([Some(from), Some(to)], path).map(Cut::Inside),
        }
    }

    /// That nothing of the log counts. How long it is nobody knows: rows before the part that counts are not all read.
    fn empty(&self, path: &Path) -> Error {
        let [from, to] = self.ends;
        let end = match to.is_finite() {
            true => format!("{to} s"),
            false => "its end".into(),
        };
        let message = format!(
            "fewer than {LEAST} samples lie between {from} s of the record and {end}; `excite log` says how long it is"
        );
        Error::file(path, "", message)
    }
}

/// Whether a column of this name is one of ours.
fn known(name: &str) -> bool {
    name == "t" || POSE.contains(&name) || numbered(name).is_some()
}

/// Whether it is a log with our names.
fn own(paths: &[PathBuf], reading: &Reading) -> Result<bool> {
    let [path] = paths else { return Ok(false) };
    if reading.layout.is_some()
        || reading.topic.is_some()
        || reading.format.is_some_and(|f| f != Format::Csv)
        || formats::detect(path)? != Format::Csv
    {
        return Ok(false);
    }
    let names = csv::names(path)?;
    let ours = |what: &str| {
        names
            .iter()
            .any(|n| numbered(n).is_some_and(|(group, _)| group == what))
    };
    // counted from 0 by somebody else
    if names.iter().any(|n| matches!(numbered(n), Some((_, 0)))) {
        return Ok(false);
    }
    Ok(names.iter().any(|n| n == "t") && (ours("q") || ours("tau")))
}

/// A table with our names from files with others.
fn foreign(paths: &[PathBuf], plant: &Plant, reading: &Reading) -> Result<Table> {
    let path: &Path = &paths[0];
    let mut parts = Vec::new();
    for path in paths {
        let wanted = |name: &str| reading.wants(name);
        let request = Request {
            format: reading.format,
            topic: reading.topic.as_deref(),
            wanted: if paths.len() > 1 { &|_| true } else { &wanted },
            skip: None,
        };
        parts.push((path.clone(), formats::read(path, &request)?));
    }
    let (table, format) = merge::merge(parts)?;
    translate(table, format, plant, reading, &mut None, path)
}

/// A table with our names from one with others. Where the quantities stand is found once, and kept in `found`.
fn translate(
    mut table: Table,
    format: Format,
    plant: &Plant,
    reading: &Reading,
    found: &mut Option<Layout>,
    path: &Path,
) -> Result<Table> {
    let joints = plant.actuators();
    let layout = match found {
        Some(layout) => layout,
        None => {
            let mut layout = match &reading.layout {
                Some(stated) => stated.clone(),
                None => Layout::of_names(&table, format, &joints, path)?,
            };
            if layout.time.is_none() {
                layout.time = Layout::time_of(&table, format);
            }
            found.insert(layout)
        }
    };
    let subject = path.display().to_string();
    if layout.currents {
        let message = "the columns of tau are motor currents, whose gains are not stated: tau = { columns = […], unit = \
                       \"A\", scale = [N m at the joint for each A, …] } in [record.columns]";
        return Err(Error::file(path, "", message));
    }
    let mut out = layout.apply(&mut table, &joints, path)?;
    if layout.gains {
        out.warnings.push(Warning::new(
            WarningKind::DriveGainAssumed,
            &subject,
            "tau is motor currents times the gains of `scale`: torques, and what is identified from them, are as good as \
             those gains, whatever their ± says",
        ));
    }
    for what in &layout.without {
        let weightless = plant.robot().gravity.norm() == 0.0;
        match what.as_str() {
            "gravity" if !weightless => {
                let message = format!(
                    "tau is stated to be without gravity, but {} has gravity: state gravity = [0, 0, 0] in the robot \
                     file for such records, or record torques with gravity",
                    plant.name()
                );
                return Err(Error::file(path, "", message));
            }
            "gravity" => {}
            other => out.warnings.push(Warning::new(
                WarningKind::UnitSuspect,
                &subject,
                format!("tau is stated to be without {other}: what is identified is the rest"),
            )),
        }
    }
    if out.find("tau1").is_none() && out.find("pa1").is_none() {
        let message = "it has positions and no torques: neither a model nor a load can be told from it (`excite log` \
                       says what can)";
        return Err(Error::file(path, "", message));
    }
    check_names(&out, &joints, path)?;
    Ok(out)
}
