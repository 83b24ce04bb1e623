//! Files that hold a quantity each as one table, on the stamps of the first.

use super::formats::{Format, Read};
use super::layout::{Layout, Time, time_unit};
use super::names::{self, Quantity};
use super::resample::{Order, interpolate};
use super::{Table, clock};
use crate::error::{Error, Result};
use std::path::PathBuf;

impl Layout {
    /// The time by the names of the columns: of several the first that goes on from row to row, as a clock of whole seconds does
    /// not.
    pub(crate) fn time_of(table: &Table, format: Format) -> Option<Time> {
        let named = table.names.iter().enumerate().filter_map(|(k, name)| {
            let named = names::named(name, format)?;
            (named.quantity == Quantity::Time).then_some((k, named))
        });
        let (k, named) = named.min_by_key(|(k, _)| clock::coarse(&table.columns[*k]))?;
        let factor = named.unit.and_then(names::unit).map(|(_, f)| f);
        Some(Time::Column(super::place::Place::Number(k + 1), factor))
    }
}

/// Number of the column of the time and its factor.
fn time(table: &Table, format: Format) -> Option<(usize, f64)> {
    match Layout::time_of(table, format)? {
        Time::Column(super::place::Place::Number(k), factor) => {
            let k = k - 1;
            Some((k, factor.unwrap_or_else(|| time_unit(&table.columns[k]).0)))
        }
        _ => None,
    }
}

/// Calls the columns of files `FILE.COLUMN` where the names of two or more files say what they hold, each something else, and those
/// of their columns do not: `q.csv`, `dq.csv` and `current_mA.csv`, each with the names of the joints.
///
/// So are those of files of a joint each, [`joint1.csv` and `joint2.csv`](of_a_joint_each), of a robot with so many `joints`.
pub(crate) fn call_by_files(parts: &mut [(PathBuf, Read)], joints: Option<usize>) {
    let says = |name: &str, format| names::named(name, format).map(|n| n.quantity);
    let holds = |name: &str, format| says(name, format).filter(|q| *q != Quantity::Time);
    let own = |(_, part): &(PathBuf, Read)| {
        let mut names = part.table.names.iter();
        names.any(|n| holds(n, part.format).is_some())
    };
    let stems: Vec<(String, Option<Quantity>)> = parts
        .iter()
        .map(|(path, part)| {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            let quantity = holds(&stem, part.format).filter(|q| *q != Quantity::Other);
            (stem.into_owned(), quantity)
        })
        .collect();
    let told: Vec<Quantity> = stems.iter().filter_map(|s| s.1).collect();
    let distinct = (0..told.len()).all(|k| !told[..k].contains(&told[k]));
    let quantities = told.len() > 1 && distinct && !parts.iter().any(own);
    if !quantities && !of_a_joint_each(parts, joints) {
        return;
    }
    for ((_, part), (stem, _)) in parts.iter_mut().zip(stems) {
        let format = part.format;
        let own = part.table.names.iter_mut();
        own.filter(|n| says(n, format) != Some(Quantity::Time))
            .for_each(|n| *n = format!("{stem}.{n}"));
    }
}

/// Whether files have the same columns, one of a position and none of whose quantities stands there twice, and are called by a word
/// for a joint and its number.
fn of_a_joint_each(parts: &[(PathBuf, Read)], joints: Option<usize>) -> bool {
    let Some((_, first)) = parts.first() else {
        return false;
    };
    let named = first.table.names.iter();
    let mut quantities: Vec<Quantity> = named
        .filter_map(|name| Some(names::named(name, first.format)?.quantity))
        .filter(|q| *q != Quantity::Other)
        .collect();
    let count = quantities.len();
    quantities.sort_unstable();
    quantities.dedup();
    let once = count == quantities.len() && quantities.contains(&Quantity::Position);
    let alike = parts
        .iter()
        .all(|(_, part)| part.table.names == first.table.names);
    let numbers: Option<Vec<usize>> = parts
        .iter()
        .map(|(path, _)| names::joint_of(&path.file_stem()?.to_string_lossy()))
        .collect();
    let distinct = numbers.is_some_and(|mut all| {
        all.sort_unstable();
        all.windows(2).all(|w| w[0] < w[1])
    });
    let as_many = joints.is_none_or(|n| n == parts.len());
    parts.len() > 1 && as_many && once && alike && distinct
}

/// One table of all. Columns that several files have are called `FILE.COLUMN` in all but the first, or [in all](call_by_files).
pub(crate) fn merge(mut parts: Vec<(PathBuf, Read)>) -> Result<(Table, Format)> {
    call_by_files(&mut parts, None);
    let mut parts = parts.into_iter();
    let Some((_, first)) = parts.next() else {
        return Err(Error::Argument("no log is named".into()));
    };
    let (mut table, format) = (first.table, first.format);
    for (path, part) in parts {
        let stem = path
            .file_stem()
            .map_or(String::new(), |s| s.to_string_lossy().into_owned());
        let mut more = part.table;
        let rows = (table.rows(), more.rows());
        let times = (time(&table, format), time(&more, part.format));
        let on: Option<(Vec<f64>, Vec<f64>, usize)> = match times {
            (Some((a, fa)), Some((b, fb))) => {
                let ta: Vec<f64> = table.columns[a].iter().map(|x| x * fa).collect();
                let tb: Vec<f64> = more.columns[b].iter().map(|x| x * fb).collect();
                Some((ta, tb, b))
            }
            _ if rows.0 == rows.1 => None,
            _ => {
                let message = format!(
                    "it has {} rows beside {} of the first file, and no column of both was recognised as the time",
                    rows.1, rows.0
                );
                return Err(Error::file(&path, "", message));
            }
        };
        if on.as_ref().is_some_and(|(ta, tb, _)| common(ta, tb) < 2) {
            let message = "its stamps have less than two in common with those of the first file";
            return Err(Error::file(&path, "", message));
        }
        for k in 0..more.names.len() {
            let column = std::mem::take(&mut more.columns[k]);
            let values = match &on {
                Some((_, _, at)) if *at == k => continue,
                Some((ta, tb, _)) if ta != tb => onto(ta, tb, &column),
                _ => column,
            };
            let name = &more.names[k];
            table.names.push(match table.names.contains(name) {
                true => format!("{stem}.{name}"),
                false => name.clone(),
            });
            table.columns.push(values);
        }
        table.labels.append(&mut more.labels);
        table.warnings.append(&mut more.warnings);
    }
    Ok((table, format))
}

/// Whether a stamp can be one.
fn sound(t: f64) -> bool {
    t.is_finite() && t.abs() < 1e21
}

/// How many stamps of the one lie within those of the other.
fn common(to: &[f64], t: &[f64]) -> usize {
    let t = t.iter().copied().filter(|t| sound(*t));
    let (begin, end) = t.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| {
        (a.min(t), b.max(t))
    });
    to.iter().filter(|x| (begin..=end).contains(*x)).count()
}

/// A channel on other stamps; NaN outside of its own, and where it has no two values.
fn onto(to: &[f64], t: &[f64], y: &[f64]) -> Vec<f64> {
    let mut out = vec![f64::NAN; to.len()];
    let mut last = f64::NEG_INFINITY;
    let (mut times, mut values) = (Vec::new(), Vec::new());
    for (&t, &y) in t.iter().zip(y) {
        if sound(t) && t > last && y.is_finite() {
            last = t;
            times.push(t);
            values.push(y);
        }
    }
    let (Some(&begin), true) = (times.first(), times.len() > 1) else {
        return out;
    };
    // walked once: the stamps must increase, those that do not stay without a value
    let mut order: Vec<usize> = (0..to.len()).filter(|&i| to[i].is_finite()).collect();
    order.sort_by(|a, b| to[*a].total_cmp(&to[*b]));
    let sorted: Vec<f64> = order.iter().map(|&i| to[i]).collect();
    let moved = interpolate(&times, &values, &sorted, Order::Linear);
    for (k, &i) in order.iter().enumerate() {
        if (begin..=last).contains(&sorted[k]) {
            out[i] = moved[k];
        }
    }
    out
}
