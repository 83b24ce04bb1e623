//! `[record.columns]` as it is written.

use super::{Group, Layout, Source, Time};
use crate::log::names;
use crate::log::place::Place;
use toml::{Table, Value};

const GROUPS: [&str; 6] = ["q", "tau", "dq", "ddq", "qref", "ql"];

/// Keys of a group, of the time, and of the whole.
const GROUP_KEYS: [&str; 7] = [
    "columns", "unit", "scale", "sign", "delay", "gear", "without",
];
const TIME_KEYS: [&str; 3] = ["column", "unit", "rate"];

impl Layout {
    /// Reads `[record.columns]`; what is wrong is said with its key.
    pub fn of_entry(entry: &Table) -> Result<Self, String> {
        let mut out = Layout::default();
        for (key, value) in entry {
            match GROUPS.into_iter().find(|g| g == key) {
                Some(name) => {
                    let group = out.group(name, value)?;
                    out.groups.push(group);
                }
                None if key == "time" => out.time = Some(time(value)?),
                None => {
                    return Err(format!(
                        "columns.{key} is not known; it can be time, {}",
                        GROUPS.join(", ")
                    ));
                }
            }
        }
        Ok(out)
    }

    fn group(&mut self, name: &'static str, value: &Value) -> Result<Group, String> {
        let table = match value {
            Value::Table(t) => t.clone(),
            other => Table::from_iter([("columns".to_string(), other.clone())]),
        };
        known(&table, &GROUP_KEYS, &format!("columns.{name}"))?;
        let places = match table.get("columns") {
            Some(Value::Array(list)) => list
                .iter()
                .map(|v| place(v, name))
                .collect::<Result<Vec<_>, _>>()?,
            Some(one) => vec![place(one, name)?],
            None => return Err(format!("columns.{name}.columns is missing")),
        };
        let n = places.len();
        let list = |key: &str, none: f64| numbers(&table, key, n, none, name);
        let (scale, sign, delay, gear) = (
            list("scale", 1.0)?,
            list("sign", 1.0)?,
            list("delay", 0.0)?,
            list("gear", 1.0)?,
        );
        if let Some(s) = sign.iter().find(|s| s.abs() != 1.0) {
            return Err(format!("columns.{name}.sign is {s}; it is 1 or -1"));
        }
        if scale.iter().chain(&gear).any(|s| *s == 0.0) {
            return Err(format!("columns.{name}: scale and gear cannot be 0"));
        }
        if let Some(s) = scale.iter().find(|s| **s < 0.0) {
            return Err(format!(
                "columns.{name}.scale is {s}; it is positive: state sign = -1"
            ));
        }
        if let Some(d) = delay.iter().find(|d| d.abs() > 1.0) {
            return Err(format!("columns.{name}.delay is {d} s; is it in seconds?"));
        }
        let factor = match table.get("unit") {
            None => 1.0,
            Some(Value::String(unit)) => match names::unit(unit) {
                Some(("counts", _)) if !table.contains_key("scale") => {
                    return Err(format!(
                        "columns.{name}.unit is counts: state scale, SI units a count"
                    ));
                }
                Some(("A" | "mA", f)) => {
                    let gains = table.contains_key("scale");
                    self.currents |= name == "tau" && !gains;
                    self.gains |= name == "tau" && gains;
                    f
                }
                Some((_, f)) => f,
                None => return Err(format!("columns.{name}.unit `{unit}` is not known")),
            },
            Some(other) => return Err(format!("columns.{name}.unit is {other}; it is a text")),
        };
        if let Some(without) = table.get("without") {
            let list = without.as_array().cloned().unwrap_or_default();
            for what in &list {
                match what.as_str() {
                    Some(w @ ("gravity" | "friction")) if name == "tau" => {
                        self.without.push(w.into())
                    }
                    _ => {
                        return Err(format!(
                            "columns.{name}.without can be [\"gravity\", \"friction\"], of tau"
                        ));
                    }
                }
            }
            if list.is_empty() && without.as_array().is_none() {
                return Err(format!("columns.{name}.without is a list"));
            }
        }
        let sources = places
            .into_iter()
            .enumerate()
            .map(|(j, place)| {
                // a motor turns gear times as far, and its torque counts gear times
                let geared = match name {
                    "tau" => gear[j],
                    _ => 1.0 / gear[j],
                };
                Source {
                    place,
                    factor: factor * scale[j] * sign[j] * geared,
                    delay: delay[j],
                }
            })
            .collect();
        Ok(Group { name, sources })
    }
}

fn time(value: &Value) -> Result<Time, String> {
    let Value::Table(table) = value else {
        return Ok(Time::Column(place(value, "time")?, None));
    };
    known(table, &TIME_KEYS, "columns.time")?;
    if let Some(rate) = table.get("rate") {
        let rate = number(rate).filter(|r| *r > 0.0 && r.is_finite());
        return match (rate, table.len()) {
            (Some(r), 1) => Ok(Time::Rate(r)),
            (None, _) => Err("columns.time.rate must be positive, in samples a second".into()),
            _ => Err("columns.time: state either rate or column".into()),
        };
    }
    let column = table
        .get("column")
        .ok_or("columns.time needs column, or rate where there is none")?;
    let factor = match table.get("unit") {
        None => None,
        Some(Value::String(u)) => match names::unit(u) {
            Some(("s" | "ms" | "us" | "ns" | "min", f)) => Some(f),
            _ => {
                return Err(format!(
                    "columns.time.unit `{u}` is not known; it can be s, ms, us, ns, min"
                ));
            }
        },
        Some(other) => return Err(format!("columns.time.unit is {other}; it is a text")),
    };
    Ok(Time::Column(place(column, "time")?, factor))
}

fn known(table: &Table, keys: &[&str], what: &str) -> Result<(), String> {
    match table.keys().find(|k| !keys.contains(&k.as_str())) {
        Some(key) => Err(format!(
            "{what}.{key} is not known; it can be {}",
            keys.join(", ")
        )),
        None => Ok(()),
    }
}

fn place(value: &Value, name: &str) -> Result<Place, String> {
    match value {
        Value::String(text) => Ok(Place::Name(text.clone())),
        Value::Integer(k) if *k >= 1 => Ok(Place::Number(*k as usize)),
        other => Err(format!(
            "columns.{name}: a column is its name or its number from 1, not {other}"
        )),
    }
}

fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Float(x) => Some(*x),
        Value::Integer(x) => Some(*x as f64),
        _ => None,
    }
}

/// One number for each of `n` columns: a list, or one for all.
fn numbers(table: &Table, key: &str, n: usize, none: f64, name: &str) -> Result<Vec<f64>, String> {
    let wrong = || format!("columns.{name}.{key} is a number or a list of {n} numbers");
    let list = match table.get(key) {
        None => return Ok(vec![none; n]),
        Some(Value::Array(list)) => list.iter().map(number).collect::<Option<Vec<f64>>>(),
        Some(one) => number(one).map(|x| vec![x; n]),
    };
    list.filter(|l| l.len() == n && l.iter().all(|x| x.is_finite()))
        .ok_or_else(wrong)
}
