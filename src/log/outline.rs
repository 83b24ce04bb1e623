//! `experiment.toml`, and what it names before that is read.

use super::formats::Format;
use super::layout::Layout;
use super::record::Reading;
use super::{Experiment, Payload, Purpose, Record};
use super::{pose_check, pressure};
use crate::error::{Error, Result, Warning, WarningKind, line_of};
use crate::plant::Plant;
use rayon::prelude::*;
use serde::Deserialize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// Bytes of text from which on a log is long: some seven hundred thousand rows of seven joints.
const LONG_TEXT: u64 = 100_000_000;
/// Bytes of a bag from which on it is long: compressed, about as many.
const LONG_BAG: u64 = 50_000_000;

/// What an experiment names: the robot is read, its logs are not.
#[derive(Debug)]
pub struct Outline {
    /// the `experiment.toml`, or the log
    pub path: PathBuf,
    /// the robot as the file names it
    pub spec: String,
    /// the robot
    pub plant: Plant,
    entries: Vec<Planned>,
    /// pressure outside of the cylinders, Pa, where forces are made from chamber pressures
    atmosphere: Option<f64>,
}

/// A record to be read.
#[derive(Debug)]
struct Planned {
    logs: Vec<PathBuf>,
    purpose: Purpose,
    period: Option<f64>,
    payload: Payload,
    reading: Reading,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    robot: String,
    record: Vec<Spanned<Entry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    log: Logs,
    #[serde(rename = "use")]
    purpose: Purpose,
    period: Option<f64>,
    payload: Option<PayloadEntry>,
    from: Option<f64>,
    to: Option<f64>,
    format: Option<Format>,
    topic: Option<String>,
    columns: Option<toml::Table>,
}

/// One file, or several with a quantity each.
#[derive(Deserialize)]
#[serde(untagged)]
enum Logs {
    One(String),
    Several(Vec<String>),
}

#[derive(Deserialize)]
#[serde(untagged)]
enum PayloadEntry {
    Word(String),
    Body(PayloadBody),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PayloadBody {
    mass: f64,
    #[serde(default)]
    com: Option<[f64; 3]>,
    inertia: Option<[f64; 6]>,
}

impl Experiment {
    /// Reads an `experiment.toml`, its robot and its logs. Paths in it are relative to it; a robot
    /// that is no file beside it may be a bundled one.
    ///
    /// # Errors
    /// Unknown or missing keys, a robot or log that cannot be read, logs that do not fit the robot:
    /// each with the file and line.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        Outline::read(path)?.whole()
    }
}

impl Outline {
    /// Reads an `experiment.toml` and its robot.
    ///
    /// # Errors
    /// As [`Experiment::read`], but for the logs.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
        let place = |at: usize| format!("line {}", line_of(&text, at));
        let file: File = toml::from_str(&text).map_err(|e| {
            let at = e.span().map_or(String::new(), |s| place(s.start));
            let message = e.message().trim().replace('\n', "; ");
            let message = match message.contains("untagged") {
                true if text[e.span().map_or(0..0, |s| s)]
                    .trim_start()
                    .starts_with("log") =>
                {
                    "log is a file, or a list of files with a quantity each".into()
                }
                true => {
                    "payload is \"none\", \"unknown\" or { mass = 2.0, com = [0, 0, 0.05] }".into()
                }
                false if message.contains("missing field `robot`") => {
                    "it names no robot: state robot = \"…\", a robot.toml, a URDF or a bundled name (`excite robots`)".into()
                }
                false => message,
            };
            Error::file(path, at, message)
        })?;
        if file.record.is_empty() {
            return Err(Error::file(
                path,
                "",
                "no [[record]] is named; each needs log and use",
            ));
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        let beside = folder.join(&file.robot);
        // arguments of a xacro stand behind the path
        let named = crate::robot::xacro::with_arguments(&file.robot).0;
        let spec = match folder.join(named).is_file() {
            true => beside.to_string_lossy().into_owned(),
            false
                if Path::new(named).components().count() > 1
                    || [".toml", ".urdf", ".xacro"]
                        .iter()
                        .any(|e| named.ends_with(e)) =>
            {
                beside.to_string_lossy().into_owned()
            }
            false => file.robot.clone(),
        };
        let plant = Plant::load(&spec)?;
        let mut entries = Vec::new();
        for entry in &file.record {
            let place = place(entry.span().start);
            let entry = entry.get_ref();
            if let Some(p) = entry.period
                && !(p.is_finite() && p > 0.0)
            {
                let message = format!("period is {p}; it must be positive, in seconds");
                return Err(Error::file(path, place, message));
            }
            let fail = |message| Error::file(path, place.clone(), message);
            let payload = entry.payload().map_err(fail)?;
            let reading = entry.reading().map_err(fail)?;
            let logs = match &entry.log {
                Logs::One(log) => vec![folder.join(log)],
                Logs::Several(logs) => logs.iter().map(|l| folder.join(l)).collect(),
            };
            entries.push(Planned {
                logs,
                purpose: entry.purpose,
                period: entry.period,
                payload,
                reading,
            });
        }
        Ok(Outline {
            path: path.to_path_buf(),
            spec,
            plant,
            entries,
            atmosphere: None,
        })
    }

    /// Makes forces from chamber pressures, as [`Experiment::press`].
    pub fn pressed(self, atmosphere: f64) -> Self {
        Outline {
            atmosphere: Some(atmosphere),
            ..self
        }
    }

    /// One log of a robot, for the fit.
    ///
    /// # Errors
    /// A robot that cannot be read.
    pub fn of_log(path: &Path, robot: &str, period: Option<f64>) -> Result<Self> {
        Ok(Outline {
            path: path.to_path_buf(),
            spec: robot.into(),
            plant: Plant::load(robot)?,
            entries: vec![Planned {
                logs: vec![path.to_path_buf()],
                purpose: Purpose::Fit,
                period,
                payload: Payload::None,
                reading: Reading::default(),
            }],
            atmosphere: None,
        })
    }

    /// Reads all logs.
    ///
    /// # Errors
    /// Logs that cannot be read or do not fit the robot.
    pub fn whole(self) -> Result<Experiment> {
        let one = |e: &Planned| {
            let record = Record::read_as(&e.logs, &self.plant, e.purpose, e.period, &e.reading)?;
            self.finished(e, record)
        };
        let records = self
            .entries
            .par_iter()
            .map(one)
            .collect::<Result<Vec<_>>>()?;
        Ok(Experiment {
            path: self.path,
            spec: self.spec,
            plant: self.plant,
            records,
        })
    }

    /// Whether a log is so long that it should be read in parts.
    pub fn is_long(&self) -> bool {
        let long = |path: &PathBuf| {
            let bag = path.extension().is_some_and(|e| e == "mcap" || e == "db3");
            let most = if bag || path.is_dir() {
                LONG_BAG
            } else {
                LONG_TEXT
            };
            size(path) > most
        };
        self.entries.iter().any(|e| e.logs.iter().any(long))
    }

    /// Number of records, and for what each is.
    pub fn purposes(&self) -> Vec<Purpose> {
        self.entries.iter().map(|e| e.purpose).collect()
    }

    /// Reads a record in parts of `rows` rows until `each` has enough. See [`Record::read_parts`].
    ///
    /// # Errors
    /// As [`Record::read_parts`].
    pub fn parts(
        &self,
        record: usize,
        rows: usize,
        each: &mut dyn FnMut(Record) -> Result<ControlFlow<()>>,
    ) -> Result<()> {
        let e = &self.entries[record];
        let mut finished = |record: Record| each(self.finished(e, record)?);
        Record::parts_as(
            &e.logs,
            &self.plant,
            e.purpose,
            e.period,
            &e.reading,
            rows,
            &mut finished,
        )
    }

    /// That a record which is held out is fitted as well, whole or in part.
    fn fitted_too(&self, held: &Planned) -> Option<Warning> {
        if held.purpose == Purpose::Fit {
            return None;
        }
        let ends = |e: &Planned| {
            let [from, to] = e.reading.part;
            [from.unwrap_or(0.0), to.unwrap_or(f64::INFINITY)]
        };
        let [a, b] = ends(held);
        let same = self.entries.iter().any(|e| {
            let [c, d] = ends(e);
            e.purpose == Purpose::Fit && e.logs == held.logs && a.max(c) < b.min(d)
        });
        same.then(|| {
            Warning::new(
                WarningKind::LogSuspect,
                held.logs[0].display().to_string(),
                "it is held out and fitted, too: what it says is no test on motion that was not fitted",
            )
        })
    }

    /// A record as it was read, with what the experiment says of it.
    fn finished(&self, planned: &Planned, mut record: Record) -> Result<Record> {
        record.payload = planned.payload;
        // parts of one log by their times
        let also = self.entries.iter().filter(|e| e.logs == planned.logs);
        let [from, to] = planned.reading.part;
        if also.count() > 1 && (from.is_some() || to.is_some()) {
            let end = to.map_or("the end".into(), |t| format!("{t} s"));
            record.name = format!("{}, {} s to {end}", record.name, from.unwrap_or(0.0));
        }
        let seen = pose_check::check(&self.plant, &record);
        record.warnings.extend(seen);
        record.warnings.extend(self.fitted_too(planned));
        if let Some(atmosphere) = self.atmosphere {
            pressure::press(&mut record, &self.plant, atmosphere)?;
        }
        Ok(record)
    }
}

/// Bytes of a file, or of the files of a folder.
pub(crate) fn size(path: &Path) -> u64 {
    let of = |p: &Path| std::fs::metadata(p).map_or(0, |m| m.len());
    match std::fs::read_dir(path) {
        Ok(list) => list.flatten().map(|e| of(&e.path())).sum(),
        Err(_) => of(path),
    }
}

impl Entry {
    fn reading(&self) -> Result<Reading, String> {
        for (name, value) in [("from", self.from), ("to", self.to)] {
            if let Some(x) = value
                && !(x.is_finite() && x >= 0.0)
            {
                return Err(format!(
                    "{name} is {x}; it is in seconds from the record's start"
                ));
            }
        }
        if let (Some(from), Some(to)) = (self.from, self.to)
            && from >= to
        {
            return Err(format!("from = {from} is not before to = {to}"));
        }
        if matches!(&self.log, Logs::Several(list) if list.is_empty()) {
            return Err("log is an empty list".into());
        }
        Ok(Reading {
            format: self.format,
            topic: self.topic.clone(),
            layout: self.columns.as_ref().map(Layout::of_entry).transpose()?,
            part: [self.from, self.to],
        })
    }

    fn payload(&self) -> Result<Payload, String> {
        let Some(payload) = &self.payload else {
            return Ok(Payload::None);
        };
        match payload {
            PayloadEntry::Word(word) => match word.as_str() {
                "none" => Ok(Payload::None),
                "unknown" => Ok(Payload::Unknown),
                other => Err(format!(
                    "payload is `{other}`; it can be \"none\", \"unknown\" or {{ mass = 2.0, com = [0, 0, 0.05] }}"
                )),
            },
            PayloadEntry::Body(body) => {
                let finite = body
                    .com
                    .iter()
                    .flatten()
                    .chain(body.inertia.iter().flatten())
                    .all(|x| x.is_finite());
                if !(body.mass.is_finite() && body.mass > 0.0 && finite) {
                    return Err(format!(
                        "the payload's mass is {} kg; it must be positive, and all numbers of the payload finite",
                        body.mass
                    ));
                }
                if body.com.is_none() && body.inertia.is_some() {
                    return Err(
                        "the payload's inertia is about its centre of mass: state com, too".into(),
                    );
                }
                Ok(Payload::Known {
                    mass: body.mass,
                    com: body.com,
                    inertia: body.inertia,
                })
            }
        }
    }
}
