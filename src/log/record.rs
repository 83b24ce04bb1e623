//! A log of a robot: which column is what, repaired and put on an even time grid.

mod checks;
mod cut;
mod reading;

pub(crate) use cut::{impossible, unmeasured};
pub(crate) use reading::{Reading, long_enough};

use super::clock::{self, Clock};
use super::resample::{Order, interpolate};
use super::{Payload, Purpose, Record, Table};
use crate::error::{Error, Result, Warning, WarningKind, listed};
use crate::plant::Plant;
use crate::robot::Joint;
use rayon::prelude::*;
use std::path::Path;

const POSE: [&str; 7] = ["x", "y", "z", "qw", "qx", "qy", "qz"];
/// Groups of one column an actuator.
const GROUPS: [&str; 8] = ["tau", "ddq", "dq", "qref", "ql", "q", "pa", "pb"];

/// Most samples of the even grid, in rows of the log.
const MOST: usize = 30;

/// That so few rows are left, and what was left out.
pub(crate) fn too_few(rows: usize, warnings: &[Warning]) -> String {
    let mut text = match rows {
        1 => "1 row is too few: there must be 8 or more".to_string(),
        _ => format!("{rows} rows are too few: there must be 8 or more"),
    };
    for w in warnings
        .iter()
        .filter(|w| w.kind == WarningKind::RowsLeftOut)
    {
        text += "; ";
        text += &w.message;
    }
    text
}

/// Group and number of a column name: `tau3` is `("tau", 3)`.
fn numbered(name: &str) -> Option<(&'static str, usize)> {
    let digits = name.trim_start_matches(|c: char| !c.is_ascii_digit());
    let head = &name[..name.len() - digits.len()];
    let group = GROUPS.into_iter().find(|g| *g == head)?;
    (!digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()))
        .then(|| digits.parse().ok().map(|k| (group, k)))
        .flatten()
}

/// Where the columns of a group stand, one an actuator; `None` where there is none of them.
fn columns_of(table: &Table, group: &str, n: usize, path: &Path) -> Result<Option<Vec<usize>>> {
    let at: Vec<Option<usize>> = (1..=n)
        .map(|k| table.find(&format!("{group}{k}")))
        .collect();
    if at.iter().all(Option::is_none) {
        return Ok(None);
    }
    if let Some(k) = at.iter().position(Option::is_none) {
        let message = format!(
            "it has columns {group}… but not {group}{}: the robot has {n} actuated joints",
            k + 1
        );
        return Err(Error::file(path, "line 1", message));
    }
    Ok(Some(at.into_iter().flatten().collect()))
}

/// Takes the columns of a group out of the table, one an actuator.
fn take(table: &mut Table, group: &str, n: usize, path: &Path) -> Result<Option<Vec<Vec<f64>>>> {
    let at = columns_of(table, group, n, path)?;
    Ok(at.map(|at| {
        at.into_iter()
            .map(|c| std::mem::take(&mut table.columns[c]))
            .collect()
    }))
}

/// Takes the columns of a group of which an actuator may have none: its list is empty then.
fn take_some(table: &mut Table, group: &str, n: usize) -> Option<Vec<Vec<f64>>> {
    let mut one = |k: usize| match table.find(&format!("{group}{k}")) {
        Some(c) => std::mem::take(&mut table.columns[c]),
        None => Vec::new(),
    };
    let columns: Vec<Vec<f64>> = (1..=n).map(&mut one).collect();
    columns.iter().any(|c| !c.is_empty()).then_some(columns)
}

/// Whether the names of the columns can be those of a log of `n` actuators.
pub(super) fn check_names(table: &Table, joints: &[&Joint], path: &Path) -> Result<Vec<Warning>> {
    let n = joints.len();
    let error = |message: String| Err(Error::file(path, "line 1", message));
    let mut unknown = Vec::new();
    for name in &table.names {
        match numbered(name) {
            Some((group, 0)) => {
                return error(format!(
                    "column {name}: joints are counted from 1, in the order of the robot file ({group}1 is {})",
                    joints.first().map_or("the first", |j| &j.name)
                ));
            }
            Some((_, k)) if k > n => {
                let names: Vec<&str> = joints.iter().map(|j| j.name.as_str()).collect();
                return error(format!(
                    "column {name}: the robot has {n} actuated joints ({}); is this the log of another robot?",
                    names.join(", ")
                ));
            }
            Some(_) => {}
            None if name == "t" || POSE.contains(&name.as_str()) => {}
            None => unknown.push(name.as_str()),
        }
    }
    let missing = if table.find("t").is_none() {
        match table.find("time") {
            Some(_) => "there is no column t; it has one called time: rename it",
            None => "there is no column t (time, s)",
        }
    } else if table.find("q1").is_none() {
        "there are no columns q1… (positions of the actuated joints)"
    } else if table.find("tau1").is_none() && table.find("pa1").is_none() {
        "there are no columns tau1… (torques or forces of the actuated joints)"
    } else {
        ""
    };
    if !missing.is_empty() {
        return error(format!(
            "{missing}; the header is `{}`, expected are t, q1 to q{n}, tau1 to tau{n}, and if recorded dq1…, \
             ddq1…, qref1…",
            listed(&table.names)
        ));
    }
    for group in GROUPS {
        columns_of(table, group, n, path)?;
    }
    Ok(match unknown.is_empty() {
        true => Vec::new(),
        false => vec![Warning::new(
            WarningKind::ColumnsIgnored,
            path.display().to_string(),
            format!(
                "columns that are not known were left alone: {}",
                unknown.join(", ")
            ),
        )],
    })
}

impl Record {
    /// Reads a log of `plant`; see the [module](super) for what is done to it. `period` is that of
    /// the motion, s.
    ///
    /// # Errors
    /// A file that is no log of this robot, a channel without any value, a log that does not move;
    /// with the file, and the line or channel.
    pub fn read(
        path: impl AsRef<Path>,
        plant: &Plant,
        purpose: Purpose,
        period: Option<f64>,
    ) -> Result<Record> {
        let paths = [path.as_ref().to_path_buf()];
        Self::read_as(&paths, plant, purpose, period, &Reading::default())
    }

    /// A record from the columns of a log.
    pub(super) fn of_table(
        table: Table,
        path: &Path,
        plant: &Plant,
        purpose: Purpose,
        period: Option<f64>,
        part: [Option<f64>; 2],
    ) -> Result<Record> {
        let clock = Self::clock(&table, path).between(part, path)?;
        let (mut record, clock) = Self::repaired(table, clock, path, plant, purpose, period)?;
        record.written = record.before_grid(&clock);
        record.put_on_grid(&clock)?;
        Ok(record)
    }

    /// The clock of a log.
    fn clock(table: &Table, path: &Path) -> Clock {
        let at = table.find("t").unwrap_or(0);
        clock::repair(
            &table.columns[at],
            table.before,
            &path.display().to_string(),
        )
    }

    /// A record from the columns of a log, at those times of its clock at which they were taken.
    fn repaired(
        mut table: Table,
        clock: Clock,
        path: &Path,
        plant: &Plant,
        purpose: Purpose,
        period: Option<f64>,
    ) -> Result<(Record, Clock)> {
        let joints = plant.actuators();
        let n = joints.len();
        let mut warnings = std::mem::take(&mut table.warnings);
        warnings.extend(clock.warnings.iter().cloned());
        if clock.t.len() < 8 {
            let message = match table.rows() >= 8 {
                true => format!(
                    "of {} rows, only {} have a time stamp later than the one before: column t must increase",
                    table.rows(),
                    clock.t.len()
                ),
                false => too_few(table.rows(), &warnings),
            };
            return Err(Error::file(path, "", message));
        }
        if let Some(keep) = &clock.keep {
            for column in table.columns.iter_mut().filter(|c| !c.is_empty()) {
                *column = keep.iter().map(|&i| column[i]).collect();
            }
        }
        let mut record = Record {
            name: path
                .file_stem()
                .map_or(String::new(), |s| s.to_string_lossy().into_owned()),
            path: path.to_path_buf(),
            purpose,
            period,
            payload: Payload::None,
            step: clock.step,
            t: Vec::new(),
            valid: vec![true; clock.t.len()],
            q: take(&mut table, "q", n, path)?.unwrap_or_default(),
            tau: take(&mut table, "tau", n, path)?.unwrap_or_default(),
            dq: take(&mut table, "dq", n, path)?,
            ddq: take(&mut table, "ddq", n, path)?,
            qref: take(&mut table, "qref", n, path)?,
            ql: take_some(&mut table, "ql", n),
            pose: None,
            pressures: None,
            resampled: false,
            written: None,
            warnings,
        };
        if let (Some(a), Some(b)) = (
            take(&mut table, "pa", n, path)?,
            take(&mut table, "pb", n, path)?,
        ) {
            record.pressures = Some([a, b]);
        }
        let pose: Option<Vec<usize>> = POSE.iter().map(|c| table.find(c)).collect();
        record.pose = pose.map(|at| {
            at.into_iter()
                .map(|c| std::mem::take(&mut table.columns[c]))
                .collect()
        });
        drop(table);

        let mut ends = record.drop_impossible(&clock);
        record.count_turns(&joints, &clock, &mut ends);
        record.fill_dropped(&clock, &mut ends)?;
        record.check_channels(&joints, &ends)?;
        let duration = clock.t[clock.t.len() - 1] - clock.t[0];
        record.drop_wrong_period(clock.step, duration);
        Ok((record, clock))
    }

    /// The record on an even grid, its period compared.
    fn put_on_grid(&mut self, clock: &Clock) -> Result<()> {
        self.resample(clock)?;
        self.check_period();
        Ok(())
    }

    /// Every channel with its name and how it is interpolated.
    fn channels(&mut self) -> Vec<(String, Order, &mut Vec<f64>)> {
        let mut out: Vec<(String, Order, &mut Vec<f64>)> = Vec::new();
        let [mut pa, mut pb] = [None, None];
        if let Some([a, b]) = &mut self.pressures {
            (pa, pb) = (Some(a), Some(b));
        }
        for (group, order, columns) in [
            ("q", Order::Cubic, Some(&mut self.q)),
            ("tau", Order::Linear, Some(&mut self.tau)),
            ("dq", Order::Cubic, self.dq.as_mut()),
            ("ddq", Order::Linear, self.ddq.as_mut()),
            ("qref", Order::Cubic, self.qref.as_mut()),
            ("ql", Order::Cubic, self.ql.as_mut()),
            ("pose ", Order::Cubic, self.pose.as_mut()),
            ("pa", Order::Linear, pa),
            ("pb", Order::Linear, pb),
        ] {
            let some = columns.into_iter().flatten().enumerate();
            // an actuator may have no second encoder
            for (k, column) in some.filter(|(_, c)| !c.is_empty()) {
                out.push((format!("{group}{}", k + 1), order, column));
            }
        }
        out
    }

    /// Puts all channels on an even grid; with a period, on one that divides it.
    fn resample(&mut self, clock: &Clock) -> Result<()> {
        let (first, last) = (clock.t[0], clock.t[clock.t.len() - 1]);
        let mut step = clock.step;
        if let Some(period) = self.period {
            step = period / (period / step).round();
        }
        // time stamps that jitter may miss the last point of the grid by some of a step
        let count = ((last - first) / step + 0.1).floor() as usize + 1;
        if count > MOST * clock.t.len() {
            let message = format!(
                "its {} rows last {:.3e} s, but their usual step is {step:.3e} s: column t is not an even clock; \
                 check its unit and its numbers",
                clock.t.len(),
                last - first
            );
            return Err(Error::file(&self.path, "column t", message));
        }
        let drift = (step - clock.step).abs() * count as f64;
        self.step = step;
        if clock.even && drift <= 0.02 * step && count >= clock.t.len() {
            self.t = (0..clock.t.len())
                .map(|i| first + step * i as f64)
                .collect();
            return Ok(());
        }
        let grid: Vec<f64> = (0..count).map(|i| first + step * i as f64).collect();
        let mut list = self.channels();
        list.par_iter_mut().for_each(|(_, order, column)| {
            **column = interpolate(&clock.t, column, &grid, *order);
        });
        // a grid point is sound when both neighbours are, and close
        let mut i = 0;
        let valid = grid
            .iter()
            .map(|&x| {
                while i + 2 < clock.t.len() && clock.t[i + 1] < x {
                    i += 1;
                }
                let close = clock.t[i + 1] - clock.t[i] <= 2.5 * clock.step;
                (self.valid[i] && self.valid[i + 1] && close)
                    || (self.valid[i] && (x - clock.t[i]).abs() < 1e-3 * step)
            })
            .collect();
        self.valid = valid;
        self.t = grid;
        self.resampled = true;
        Ok(())
    }
}
