//! Messages of a bag as columns: one row a message, joints by their names.
//!
//! | type | columns |
//! |---|---|
//! | `sensor_msgs/JointState` | `position/JOINT`, `velocity/JOINT`, `effort/JOINT` |
//! | `control_msgs/JointTrajectoryControllerState` | `reference.position/JOINT` … (the command), `feedback.position/JOINT` …, `output.effort/JOINT` |
//! | `control_msgs/DynamicJointState` | `INTERFACE/JOINT` |
//! | `std_msgs/Float64MultiArray` | `data[0]` … |
//!
//! Messages of one topic may name joints in any order and come from several sources (an arm and its
//! gripper): those that name the same set are one table.

mod layout;

pub(super) use layout::append;

use super::cdr::Cdr;
use crate::error::{Error, Result, Warning, WarningKind, agreeing, counted};
use crate::log::Table;
use layout::{Layout, merge};
use std::ops::ControlFlow;
use std::path::Path;

/// What is known of a message's layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    JointState,
    Controller,
    Dynamic,
    Array,
    Other,
}

struct Topic {
    name: String,
    kind: Kind,
    type_name: String,
    layouts: Vec<Layout>,
    damaged: usize,
}

/// Takes messages and makes the table of one topic.
pub(super) struct Collector<'a> {
    wanted: Option<String>,
    topics: Vec<Topic>,
    key: Vec<u8>,
    values: Vec<f64>,
    /// first stamps: what all times are counted from, so that nanoseconds are not lost
    origin: Option<(i64, i64)>,
    /// whether the stamps of the headers are the times, once that is decided
    stamped: Option<bool>,
    pub warnings: Vec<Warning>,
    parts: Option<Parts<'a>>,
}

/// A bag that is handed on in parts.
struct Parts<'a> {
    /// messages of one table that are collected before it is handed on
    rows: usize,
    /// the fullest table
    fullest: usize,
    path: &'a Path,
    each: &'a mut dyn FnMut(Table, &str) -> Result<ControlFlow<()>>,
}

impl<'a> Collector<'a> {
    pub fn new(topic: Option<&str>) -> Self {
        Collector {
            wanted: topic.map(String::from),
            topics: Vec::new(),
            key: Vec::new(),
            values: Vec::new(),
            origin: None,
            stamped: None,
            warnings: Vec::new(),
            parts: None,
        }
    }

    /// One that hands a table of the messages so far to `each`, with its topic, whenever there are `rows` of them; what
    /// comes later is of the same topic.
    pub fn in_parts(
        topic: Option<&str>,
        rows: usize,
        path: &'a Path,
        each: &'a mut dyn FnMut(Table, &str) -> Result<ControlFlow<()>>,
    ) -> Self {
        Collector {
            parts: Some(Parts {
                rows,
                fullest: 0,
                path,
                each,
            }),
            ..Self::new(topic)
        }
    }

    /// Hands a part on where there is one.
    ///
    /// # Errors
    /// As [`Collector::table`]; what the receiver returns.
    pub fn flush(&mut self) -> Result<ControlFlow<()>> {
        let Some(mut parts) = self.parts.take_if(|p| p.fullest >= p.rows) else {
            return Ok(ControlFlow::Continue(()));
        };
        let (table, topic) = self.table(parts.path)?;
        let next = (parts.each)(table, &topic)?;
        parts.fullest = 0;
        self.wanted = Some(topic);
        self.parts = Some(parts);
        Ok(next)
    }

    /// Number of a topic, new or known.
    pub fn topic(&mut self, name: &str, type_name: &str, encoding: &str) -> usize {
        if let Some(known) = self.topics.iter().position(|t| t.name == name) {
            return known;
        }
        let short = type_name.rsplit('/').next().unwrap_or_default();
        let kind = match short {
            _ if encoding != "cdr" => Kind::Other,
            "JointState" => Kind::JointState,
            "JointTrajectoryControllerState" => Kind::Controller,
            "DynamicJointState" => Kind::Dynamic,
            "Float64MultiArray" => Kind::Array,
            _ => Kind::Other,
        };
        self.topics.push(Topic {
            name: name.into(),
            kind,
            type_name: type_name.into(),
            layouts: Vec::new(),
            damaged: 0,
        });
        self.topics.len() - 1
    }

    /// A message of a topic, recorded at `received` nanoseconds.
    pub fn message(&mut self, topic: usize, received: i64, data: &[u8]) {
        let Some(t) = self.topics.get_mut(topic) else {
            return;
        };
        if t.kind == Kind::Other || self.wanted.as_ref().is_some_and(|w| *w != t.name) {
            return;
        }
        self.key.clear();
        self.values.clear();
        let Some(stamp) = decode(t.kind, data, &mut self.key, &mut self.values) else {
            t.damaged += 1;
            return;
        };
        let nano = stamp.map(|(s, n)| i64::from(s) * 1_000_000_000 + i64::from(n));
        let (first, begin) = *self
            .origin
            .get_or_insert((nano.unwrap_or(received), received));
        let seconds = |x: i64, from: i64| x.saturating_sub(from) as f64 * 1e-9;
        let at = match t.layouts.iter().position(|l| l.key == self.key) {
            Some(at) => at,
            None if t.layouts.len() < 64 => {
                let names: Vec<String> = self
                    .key
                    .split(|b| *b == 0)
                    .skip(1)
                    .map(|n| String::from_utf8_lossy(n).into_owned())
                    .collect();
                t.layouts.push(Layout {
                    key: self.key.clone(),
                    columns: vec![Vec::new(); names.len()],
                    names,
                    stamps: Vec::new(),
                    received: Vec::new(),
                });
                t.layouts.len() - 1
            }
            None => {
                t.damaged += 1;
                return;
            }
        };
        let layout = &mut t.layouts[at];
        layout
            .stamps
            .push(nano.map_or(f64::NAN, |n| seconds(n, first)));
        layout.received.push(seconds(received, begin));
        if let Some(parts) = &mut self.parts {
            parts.fullest = parts.fullest.max(layout.received.len());
        }
        for (column, x) in layout.columns.iter_mut().zip(&self.values) {
            column.push(*x);
        }
    }

    /// Hands on what was not yet.
    ///
    /// # Errors
    /// As [`Collector::flush`]; no message at all.
    pub fn finish(&mut self, path: &Path) -> Result<()> {
        let any = self.topics.iter().any(|t| !t.layouts.is_empty());
        if !any {
            return match self.stamped {
                Some(_) => Ok(()),
                None => self.table(path).map(|_| ()),
            };
        }
        if let Some(parts) = &mut self.parts {
            parts.fullest = parts.rows;
        }
        self.flush().map(|_| ())
    }

    /// The table of the topic that was asked for, or of that with most numbers; and its name. The messages are gone
    /// then.
    pub fn table(&mut self, path: &Path) -> Result<(Table, String)> {
        let subject = path.display().to_string();
        for t in &mut self.topics {
            merge(&mut t.layouts);
            t.layouts
                .sort_by_key(|l| std::cmp::Reverse(l.stamps.len() * l.names.len()));
        }
        let listed: Vec<String> = self
            .topics
            .iter()
            .map(|t| format!("{} ({})", t.name, t.type_name))
            .collect();
        // where a topic is as rich as another, the one with positions and efforts
        let worth = |t: &Topic| {
            let Some(l) = t.layouts.first() else { return 0 };
            let has = |what: &str| usize::from(l.names.iter().any(|n| n.contains(what)));
            l.stamps.len() * l.names.len() * (1 + 4 * has("position/") + 4 * has("effort/"))
        };
        let best = (0..self.topics.len())
            .filter(|&k| {
                self.wanted
                    .as_ref()
                    .is_none_or(|w| *w == self.topics[k].name)
            })
            .max_by_key(|&k| (worth(&self.topics[k]), std::cmp::Reverse(k)))
            .filter(|&k| worth(&self.topics[k]) > 0);
        let Some(best) = best else {
            let topics = match listed.is_empty() {
                true => "it has no topics".to_string(),
                false => format!("its topics are {}", listed.join(", ")),
            };
            let damaged = match self.topics.iter().map(|t| t.damaged).sum() {
                0 => String::new(),
                n => format!("; {} damaged", counted(n, "message")),
            };
            let message = match &self.wanted {
                Some(w) => format!("topic {w} has no messages that are read; {topics}{damaged}"),
                None => format!(
                    "it has no messages with states of joints (JointState, JointTrajectoryControllerState, \
                     DynamicJointState, Float64MultiArray); {topics}{damaged}"
                ),
            };
            return Err(Error::file(path, "", message));
        };
        let also: Vec<&str> = (0..self.topics.len())
            .filter(|&k| k != best && worth(&self.topics[k]) > 0)
            .map(|k| self.topics[k].name.as_str())
            .collect();
        let mut warnings = std::mem::take(&mut self.warnings);
        if !also.is_empty() {
            warnings.push(Warning::new(
                WarningKind::ColumnsIgnored,
                &subject,
                format!(
                    "topic {} was read; {} can be read instead (topic = \"…\")",
                    self.topics[best].name,
                    also.join(", ")
                ),
            ));
        }
        let topic = &mut self.topics[best];
        let name = topic.name.clone();
        let mut layouts = std::mem::take(&mut topic.layouts);
        let damaged = std::mem::take(&mut topic.damaged);
        self.topics.iter_mut().for_each(|t| t.layouts.clear());
        if damaged > 0 {
            warnings.push(Warning::new(
                WarningKind::RowsLeftOut,
                &subject,
                format!(
                    "{} damaged and left out",
                    agreeing(
                        damaged,
                        &format!("message of {name} is"),
                        &format!("messages of {name} are")
                    )
                ),
            ));
        }
        for other in layouts.iter().skip(1) {
            let names: Vec<&str> = other.names.iter().take(4).map(String::as_str).collect();
            warnings.push(Warning::new(
                WarningKind::RowsLeftOut,
                &subject,
                format!(
                    "{} other joints ({}{}): left out",
                    agreeing(
                        other.stamps.len(),
                        &format!("message of {name} names"),
                        &format!("messages of {name} name"),
                    ),
                    names.join(", "),
                    if other.names.len() > 4 { ", …" } else { "" }
                ),
            ));
        }
        let layout = layouts.swap_remove(0);
        // the stamps of the headers are when it was measured, unless nobody set them
        let ahead = layout.stamps.windows(2).filter(|w| w[1] > w[0]).count();
        let first = self.stamped.is_none();
        let set = *self
            .stamped
            .get_or_insert(10 * ahead >= 9 * layout.stamps.len().saturating_sub(1));
        if !set && first {
            warnings.push(Warning::new(
                WarningKind::TimeRepaired,
                &subject,
                "the headers hold no stamps that go on; the times of recording were taken, which jitter",
            ));
        }
        let mut table = Table {
            names: vec!["t".into()],
            columns: vec![if set { layout.stamps } else { layout.received }],
            warnings,
            ..Table::default()
        };
        table.names.extend(layout.names);
        table.columns.extend(layout.columns);
        Ok((table, name))
    }
}

/// Puts the names of the columns (each behind a zero) and their values of one message; returns the
/// stamp of its header, if it has one.
fn decode(
    kind: Kind,
    data: &[u8],
    key: &mut Vec<u8>,
    values: &mut Vec<f64>,
) -> Option<Option<(i32, u32)>> {
    let mut cdr = Cdr::new(data)?;
    let name = |key: &mut Vec<u8>, what: &str, joint: &[u8]| {
        key.push(0);
        key.extend(what.as_bytes());
        key.push(b'/');
        key.extend(joint);
    };
    match kind {
        Kind::JointState => {
            let stamp = cdr.header()?;
            let joints = texts(&mut cdr)?;
            for what in ["position", "velocity", "effort"] {
                match cdr.doubles(values)? {
                    0 => {}
                    n if n == joints.len() => joints.iter().for_each(|j| name(key, what, j)),
                    _ => return None,
                }
            }
            Some(Some(stamp))
        }
        Kind::Controller => {
            let stamp = cdr.header()?;
            let joints = texts(&mut cdr)?;
            for part in ["reference", "feedback", "error", "output"] {
                let before = (key.len(), values.len());
                let point = (|| {
                    for what in ["position", "velocity", "acceleration", "effort"] {
                        match cdr.doubles(values)? {
                            0 => {}
                            n if n == joints.len() => {
                                for j in &joints {
                                    name(key, &format!("{part}.{what}"), j);
                                }
                            }
                            _ => return None,
                        }
                    }
                    cdr.time()
                })();
                if point.is_none() {
                    // older messages have three points
                    if part != "output" {
                        return None;
                    }
                    key.truncate(before.0);
                    values.truncate(before.1);
                }
            }
            Some(Some(stamp))
        }
        Kind::Dynamic => {
            let stamp = cdr.header()?;
            let joints = texts(&mut cdr)?;
            let count = cdr.u32()? as usize;
            if count != joints.len() {
                return None;
            }
            for joint in &joints {
                let interfaces = texts(&mut cdr)?;
                if cdr.doubles(values)? != interfaces.len() {
                    return None;
                }
                for interface in interfaces {
                    name(key, &String::from_utf8_lossy(interface), joint);
                }
            }
            Some(Some(stamp))
        }
        Kind::Array => {
            for _ in 0..cdr.u32()? {
                cdr.text()?;
                cdr.time()?;
            }
            cdr.u32()?;
            for k in 0..cdr.doubles(values)? {
                key.push(0);
                key.extend(format!("data[{k}]").as_bytes());
            }
            Some(None)
        }
        Kind::Other => None,
    }
}

fn texts<'a>(cdr: &mut Cdr<'a>) -> Option<Vec<&'a [u8]>> {
    let n = cdr.u32()?;
    // zeros separate the names of columns
    let text = |_| cdr.text().filter(|t| !t.contains(&0));
    (0..n).map(text).collect()
}
