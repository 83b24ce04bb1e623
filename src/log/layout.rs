//! Where each quantity stands in a file and how it becomes one of ours: `[record.columns]` of an experiment, or
//! what the names of the columns say.

mod entry;

use super::formats::Format;
use super::names::{self, Quantity};
use super::place::Place;
use super::resample::{Order, interpolate};
use super::{Table, clock};
use crate::error::{Error, Result, Warning, WarningKind};
use crate::robot::Joint;
use std::path::Path;

/// Steps of a sampling, s, that are believed.
const STEPS: [f64; 2] = [2e-5, 0.5];

impl Place {
    fn find(&self, table: &Table, path: &Path) -> Result<usize> {
        let all = table.names.iter().map(String::as_str);
        self.position(all.clone()).ok_or_else(|| {
            let message = match self {
                Place::Name(name) => {
                    let names: Vec<&str> = all.take(40).collect();
                    format!(
                        "there is no column `{name}`; its columns are {}{}",
                        names.join(", "),
                        if table.names.len() > 40 { ", …" } else { "" }
                    )
                }
                Place::Number(k) => {
                    format!("there is no column {k}; it has {}", table.names.len())
                }
            };
            Error::file(path, "", message)
        })
    }
}

/// One column of a quantity: `factor · value` is in SI units on the side of the joint.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Source {
    pub place: Place,
    pub factor: f64,
    /// how much later than the positions it was measured that stand in the same row, s
    pub delay: f64,
}

/// The columns of a group, one an actuator.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Group {
    /// our name: `q`, `tau`, …
    pub name: &'static str,
    pub sources: Vec<Source>,
}

/// Where the time stands.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Time {
    /// a column, and the factor that makes it seconds where that is stated
    Column(Place, Option<f64>),
    /// no column: samples a second
    Rate(f64),
}

/// Where everything stands.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Layout {
    pub time: Option<Time>,
    pub groups: Vec<Group>,
    /// what the torques are said to be without, such as gravity
    pub without: Vec<String>,
    /// whether torques are currents whose gain nobody states
    pub currents: bool,
    /// whether torques are currents times gains that are stated
    pub gains: bool,
    /// the stamp from which the time is counted, once it is known: parts of a log have one clock
    pub origin: Option<f64>,
    pub warnings: Vec<Warning>,
}

/// Factor that makes stamps seconds, from their size and their usual step, with its name.
pub(crate) fn time_unit(t: &[f64]) -> (f64, &'static str) {
    let step = crate::median::median(
        t.windows(2)
            .map(|w| w[1] - w[0])
            .filter(|d| d.is_finite() && *d > 0.0),
    );
    let first = crate::median::median(t.iter().copied().filter(|x| x.abs() < 1e21));
    // rows that a coarse clock gives one stamp lie closer
    let on = t.windows(2).filter(|w| w[1] > w[0]).count();
    let each = 1.0 + clock::same(t) as f64 / on.max(1) as f64;
    // the time since 1970, between 2001 and 2100
    for (factor, name) in [(1.0, "s"), (1e-3, "ms"), (1e-6, "us"), (1e-9, "ns")] {
        let since = first * factor;
        let sound = (STEPS[0]..=STEPS[1]).contains(&(step / each * factor));
        if (1e9..4.1e9).contains(&since) && sound {
            return (factor, name);
        }
    }
    match step {
        d if d < 0.4 => (1.0, "s"),
        // closer than a log in milliseconds has them
        d if d < 400.0 && d / each * 1e-3 < STEPS[0] => (1.0, "s"),
        d if d < 400.0 => (1e-3, "ms"),
        d if d < 4e5 => (1e-6, "us"),
        d if d.is_finite() => (1e-9, "ns"),
        _ => (1.0, "s"),
    }
}

impl Layout {
    /// From the names of the columns, for the joints of a robot.
    pub fn of_names(table: &Table, format: Format, joints: &[&Joint], path: &Path) -> Result<Self> {
        let n = joints.len();
        let own: Vec<&str> = joints.iter().map(|j| j.name.as_str()).collect();
        let all = names::all(&table.names, &table.labels, format);
        let mut out = Layout {
            time: Self::time_of(table, format),
            ..Layout::default()
        };
        for quantity in [
            Quantity::Position,
            Quantity::Velocity,
            Quantity::Acceleration,
            Quantity::Torque,
            Quantity::Current,
            Quantity::Link,
            Quantity::Command,
        ] {
            let Some(group) = quantity.group() else {
                continue;
            };
            if out.groups.iter().any(|g| g.name == group) {
                continue;
            }
            let columns: Vec<usize> = (0..all.len())
                .filter(|&k| all[k].as_ref().is_some_and(|c| c.quantity == quantity))
                .collect();
            let chosen = match choose(table, &columns, &all, &own, group, path) {
                // what a log can do without is left alone where it is not clear
                Err(Error::File { message, .. }) if !matches!(group, "q" | "tau") => {
                    out.warnings.push(Warning::new(
                        WarningKind::ColumnsIgnored,
                        path.display().to_string(),
                        message,
                    ));
                    continue;
                }
                other => other?,
            };
            let Some(chosen) = chosen else { continue };
            let mut sources = Vec::with_capacity(n);
            for k in chosen {
                let unit = all[k].as_ref().and_then(|c| c.unit).and_then(names::unit);
                sources.push(Source {
                    place: Place::Number(k + 1),
                    factor: unit.map_or(1.0, |(_, f)| f),
                    delay: 0.0,
                });
            }
            out.currents |= quantity == Quantity::Current;
            out.groups.push(Group {
                name: group,
                sources,
            });
        }
        Ok(out)
    }

    /// The columns as ours, `t`, `q1` … .
    pub fn apply(&mut self, table: &mut Table, joints: &[&Joint], path: &Path) -> Result<Table> {
        let rows = table.rows();
        let mut out = Table {
            before: table.before,
            warnings: std::mem::take(&mut table.warnings),
            ..Table::default()
        };
        out.warnings.extend(self.warnings.iter().cloned());
        let subject = path.display().to_string();
        let t = match &mut self.time {
            Some(Time::Rate(rate)) => (0..rows).map(|i| i as f64 / *rate).collect(),
            Some(Time::Column(place, factor)) => {
                let mut t = table.columns[place.find(table, path)?].clone();
                let (factor, name) = match *factor {
                    Some(f) => (f, ""),
                    None => {
                        let found = time_unit(&t);
                        *factor = Some(found.0);
                        found
                    }
                };
                if !name.is_empty() && name != "s" {
                    out.warnings.push(Warning::new(
                        WarningKind::UnitSuspect,
                        &subject,
                        format!("the time was taken to be in {name} from its steps"),
                    ));
                }
                // counted from the first stamp: a clock of nanoseconds since 1970 keeps its digits
                let origin = match t.iter().find(|x| x.abs() < 1e21) {
                    Some(x) if x.abs() * factor > 1e6 => *x,
                    _ => 0.0,
                };
                let origin = *self.origin.get_or_insert(origin);
                t.iter_mut().for_each(|x| *x = (*x - origin) * factor);
                t
            }
            None => {
                let message = "no column was recognised as the time; state it in [record.columns]: time = { \
                               column = 1, unit = \"ms\" }, or time = { rate = 500 } where there is none \
                               (`excite log` finds out what can be found out)";
                return Err(Error::file(path, "", message));
            }
        };
        out.names.push("t".into());
        out.columns.push(t);
        if !self.groups.iter().any(|g| g.name == "q") {
            let names: Vec<&str> = joints.iter().map(|j| j.name.as_str()).collect();
            let message = format!(
                "no columns were recognised as the positions of {}; state them in [record.columns]: q = [\"…\"], by \
                 name or by number (`excite log FILE --robot ROBOT` finds out what can be found out)",
                names.join(", ")
            );
            return Err(Error::file(path, "", message));
        }
        let mut used = Vec::new();
        for group in &self.groups {
            if group.sources.len() != joints.len() {
                let message = format!(
                    "columns.{} names {} columns, but the robot has {} actuated joints",
                    group.name,
                    group.sources.len(),
                    joints.len()
                );
                return Err(Error::file(path, "", message));
            }
            for (j, source) in group.sources.iter().enumerate() {
                let at = source.place.find(table, path)?;
                if used.contains(&at) {
                    let message = format!(
                        "column {} is named twice, the second time as {}{}",
                        table.names[at],
                        group.name,
                        j + 1
                    );
                    return Err(Error::file(path, "", message));
                }
                used.push(at);
                let mut values = std::mem::take(&mut table.columns[at]);
                if values.is_empty() {
                    let message = format!("column {} holds no numbers", table.names[at]);
                    return Err(Error::file(path, "", message));
                }
                if source.factor != 1.0 {
                    values.iter_mut().for_each(|x| *x *= source.factor);
                }
                let values = match source.delay == 0.0 {
                    true => values,
                    false => earlier(&out.columns[0], values, source.delay),
                };
                out.names.push(format!("{}{}", group.name, j + 1));
                out.columns.push(values);
            }
        }
        Ok(out)
    }
}

/// A channel that comes `delay` seconds late, taken back to the time it belongs to.
fn earlier(t: &[f64], y: Vec<f64>, delay: f64) -> Vec<f64> {
    // rows with sound increasing stamps and values; others stay as they are
    let mut last = f64::NEG_INFINITY;
    let good: Vec<usize> = (0..t.len())
        .filter(|&i| {
            let ok = t[i].is_finite() && t[i].abs() < 1e15 && t[i] > last && y[i].is_finite();
            if ok {
                last = t[i];
            }
            ok
        })
        .collect();
    if good.len() < 3 {
        return y;
    }
    let times: Vec<f64> = good.iter().map(|&i| t[i]).collect();
    let values: Vec<f64> = good.iter().map(|&i| y[i]).collect();
    let to: Vec<f64> = times.iter().map(|x| x + delay).collect();
    let moved = interpolate(&times, &values, &to, Order::Linear);
    let mut out = y;
    for (k, &i) in good.iter().enumerate() {
        let outside = to[k] > times[times.len() - 1] || to[k] < times[0];
        out[i] = if outside { f64::NAN } else { moved[k] };
    }
    out
}

/// One column of a quantity for each joint: by the names of the joints, or in the order of their numbers.
fn choose(
    table: &Table,
    columns: &[usize],
    all: &[Option<names::Named>],
    own: &[&str],
    group: &str,
    path: &Path,
) -> Result<Option<Vec<usize>>> {
    if columns.is_empty() {
        return Ok(None);
    }
    let joint = |k: usize| all[k].as_ref().and_then(|c| c.joint.clone());
    let named: Vec<usize> = columns
        .iter()
        .copied()
        .filter(|&k| joint(k).is_some())
        .collect();
    if named.len() >= own.len() {
        let found: Vec<String> = named.iter().filter_map(|&k| joint(k)).collect();
        let at = names::match_joints(&found, own);
        if at.iter().all(Option::is_some) {
            return Ok(Some(at.into_iter().flatten().map(|k| named[k]).collect()));
        }
        let numbered = named
            .iter()
            .all(|&k| all[k].as_ref().is_some_and(|c| c.number.is_some()));
        if !numbered {
            let missing: Vec<&str> = own
                .iter()
                .zip(&at)
                .filter(|(_, a)| a.is_none())
                .map(|(n, _)| *n)
                .collect();
            let message = format!(
                "the joints of {group} are called {}; which of them is {} of the robot cannot be told: state it in \
                 [record.columns], {group} = [\"…\"]",
                found.join(", "),
                missing.join(", ")
            );
            return Err(Error::file(path, "", message));
        }
    }
    let mut numbers: Vec<(usize, usize)> = columns
        .iter()
        .filter_map(|&k| Some((all[k].as_ref()?.number?, k)))
        .collect();
    numbers.sort_unstable();
    let distinct = numbers.windows(2).all(|w| w[0].0 < w[1].0);
    if numbers.len() == own.len() && distinct {
        return Ok(Some(numbers.into_iter().map(|(_, k)| k).collect()));
    }
    if columns.len() == 1 && own.len() == 1 {
        return Ok(Some(columns.to_vec()));
    }
    let names: Vec<&str> = columns.iter().map(|&k| table.names[k].as_str()).collect();
    let message = format!(
        "{} columns look like {group} ({}), but the robot has {} actuated joints; state which in [record.columns]: \
         {group} = [\"…\"]",
        columns.len(),
        names.join(", "),
        own.len()
    );
    Err(Error::file(path, "", message))
}
