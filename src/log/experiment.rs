//! `experiment.toml`.

use super::formats::Format;
use super::layout::Layout;
use super::pose_check;
use super::record::Reading;
use super::{Payload, Purpose, Record};
use crate::error::{Error, Result, Warning};
use crate::plant::Plant;
use rayon::prelude::*;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// A robot and what was recorded of it.
#[derive(Debug)]
pub struct Experiment {
    /// the `experiment.toml`
    pub path: PathBuf,
    /// the robot as the file names it: a path (made relative to the working directory) or a
    /// bundled name
    pub spec: String,
    /// the robot
    pub plant: Plant,
    /// its records, in the order of the file
    pub records: Vec<Record>,
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
        let path = path.as_ref();
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
        let place = |at: usize| {
            let line = text.bytes().take(at).filter(|b| *b == b'\n').count();
            format!("line {}", line + 1)
        };
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
            entries.push((entry, payload, reading));
        }
        let records = entries
            .par_iter()
            .map(|(entry, payload, reading)| {
                let logs: Vec<PathBuf> = match &entry.log {
                    Logs::One(log) => vec![folder.join(log)],
                    Logs::Several(logs) => logs.iter().map(|l| folder.join(l)).collect(),
                };
                let mut record =
                    Record::read_as(&logs, &plant, entry.purpose, entry.period, reading)?;
                record.payload = *payload;
                record.warnings.extend(pose_check::check(&plant, &record));
                Ok(record)
            })
            .collect::<Result<Vec<_>>>()?;
        Ok(Experiment {
            path: path.to_path_buf(),
            spec,
            plant,
            records,
        })
    }

    /// Records for one purpose.
    pub fn records(&self, purpose: Purpose) -> impl Iterator<Item = &Record> {
        self.records.iter().filter(move |r| r.purpose == purpose)
    }

    /// Everything that was found in robot and logs.
    pub fn warnings(&self) -> Vec<Warning> {
        let logs = self.records.iter().flat_map(|r| r.warnings.clone());
        self.plant.warnings().iter().cloned().chain(logs).collect()
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
                        "the payload's mass is {} kg with centre of mass {:?}; it must be positive, all \
                         numbers finite",
                        body.mass, body.com
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
