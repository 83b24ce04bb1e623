//! A part of a record, and values that nothing can have measured.

use crate::error::{Error, Result, Warning, WarningKind};
use crate::log::Record;
use crate::log::clock::{self, Clock};
use std::path::Path;

/// A value this many times as far from the median as the middle 98 % of the channel are wide is impossible, if it
/// stands alone.
const FAR: f64 = 50.0;
/// Longest run of impossible values, samples.
const RUN: usize = 3;
/// Larger numbers are impossible in any unit.
const LARGEST: f64 = 1e12;

impl Clock {
    /// The rows whose time lies between, s from the first.
    pub(super) fn between(self, [from, to]: [Option<f64>; 2], path: &Path) -> Result<Clock> {
        let (Some(&first), true) = (self.t.first(), from.is_some() || to.is_some()) else {
            return Ok(self);
        };
        let (from, to) = (from.unwrap_or(0.0), to.unwrap_or(f64::INFINITY));
        // stamps that are written with few digits
        let slack = 1e-6;
        let inside: Vec<usize> = (0..self.t.len())
            .filter(|&i| (from - slack..=to + slack).contains(&(self.t[i] - first)))
            .collect();
        if inside.len() < 8 {
            let last = self.t[self.t.len() - 1] - first;
            let message = format!(
                "{} samples lie between {from} s and {to} s of the record, which is {last:.3} s long",
                inside.len()
            );
            return Err(Error::file(path, "", message));
        }
        let t: Vec<f64> = inside.iter().map(|&i| self.t[i]).collect();
        let mut again = clock::repair(&t, &path.display().to_string());
        let row = |i: usize| self.keep.as_ref().map_or(i, |k| k[i]);
        again.keep = Some(match &again.keep {
            Some(keep) => keep.iter().map(|&k| row(inside[k])).collect(),
            None => inside.into_iter().map(row).collect(),
        });
        // what was said of the whole record's rows stays; gaps and jitter are those of the part
        let rows = self
            .warnings
            .into_iter()
            .filter(|w| matches!(w.kind, WarningKind::RowsLeftOut | WarningKind::TimeRepaired));
        again.warnings.splice(0..0, rows);
        Ok(again)
    }
}

impl Record {
    /// The first samples, not more than `count` of them.
    pub(crate) fn first(&self, count: usize) -> Record {
        let count = count.min(self.len());
        let mut out = self.clone();
        out.t.truncate(count);
        out.valid.truncate(count);
        out.written = None;
        for (_, _, column) in out.channels() {
            column.truncate(count);
        }
        out
    }
}

/// Samples of a channel that cannot have been measured: far from everything else, alone or a few in a row.
pub(crate) fn impossible(y: &[f64]) -> Vec<usize> {
    let mut sorted: Vec<f64> = y.iter().copied().filter(|x| x.is_finite()).collect();
    let n = sorted.len();
    if n < 50 {
        return (0..y.len()).filter(|&i| y[i].abs() > LARGEST).collect();
    }
    let mut rank = |k: usize| *sorted.select_nth_unstable_by(k, f64::total_cmp).1;
    let (low, middle, high) = (rank(n / 100), rank(n / 2), rank(n - 1 - n / 100));
    let width = high - low;
    let far = |x: f64| x.abs() > LARGEST || (width > 0.0 && (x - middle).abs() > FAR * width);
    let mut out = Vec::new();
    let mut i = 0;
    while i < y.len() {
        let run = y[i..].iter().take_while(|x| far(**x)).count();
        let alone = run <= RUN || y[i].abs() > LARGEST;
        if run > 0 && alone {
            out.extend(i..i + run);
        }
        i += run.max(1);
    }
    out
}

impl Record {
    /// Takes impossible values out, so that they count as dropped; names them with their rows.
    pub(super) fn drop_impossible(&mut self, rows: Option<&[usize]>) {
        let path = self.path.display().to_string();
        let mut warnings = Vec::new();
        for (name, _, column) in self.channels() {
            let wrong = impossible(column);
            let Some(&first) = wrong.first() else {
                continue;
            };
            let row = rows.map_or(first, |r| r[first]) + 1;
            let value = column[first];
            for &i in &wrong {
                column[i] = f64::NAN;
            }
            warnings.push(Warning::new(
                WarningKind::SamplesLeftOut,
                format!("{path}: {name}"),
                format!(
                    "{} values cannot have been measured, the first at row {row} ({value:e}); they count as dropped",
                    wrong.len()
                ),
            ));
        }
        self.warnings.extend(warnings);
    }
}
