//! A part of a record, and values that nothing can have measured.

use crate::error::{Error, Result, Warning, WarningKind, counted};
use crate::extremes::{all_finite, extremes};
use crate::log::Record;
use crate::log::clock::{self, Clock};
use rayon::prelude::*;
use std::path::Path;

/// A value this many times as far from the median as the middle 98 % of the channel are wide is impossible, if it
/// stands alone.
const FAR: f64 = 50.0;
/// Longest run of impossible values, samples.
const RUN: usize = 3;
/// Finite samples of a channel from which on its middle 98 % say something.
const FEW: usize = 50;
/// Larger numbers are impossible in any unit.
const LARGEST: f64 = 1e12;

/// Stamps that are written with few digits lie this far from where they should, s.
const SLACK: f64 = 1e-6;

impl Clock {
    /// Which rows' times lie between, s from the first.
    pub(super) fn rows_between(&self, from: f64, to: f64) -> impl Iterator<Item = usize> + '_ {
        let first = self.t.first().copied().unwrap_or_default();
        let ends = from - SLACK..=to + SLACK;
        (0..self.t.len()).filter(move |&i| ends.contains(&(self.t[i] - first)))
    }

    /// The rows whose time lies between, s from the first.
    pub(super) fn between(self, [from, to]: [Option<f64>; 2], path: &Path) -> Result<Clock> {
        let (Some(&first), true) = (self.t.first(), from.is_some() || to.is_some()) else {
            return Ok(self);
        };
        let (from, to) = (from.unwrap_or(0.0), to.unwrap_or(f64::INFINITY));
        let inside: Vec<usize> = self.rows_between(from, to).collect();
        if inside.len() < 8 {
            let last = self.t[self.t.len() - 1] - first;
            let message = format!(
                "{} samples lie between {from} s and {to} s of the record, which is {last:.3} s long",
                inside.len()
            );
            return Err(Error::file(path, "", message));
        }
        let t: Vec<f64> = inside.iter().map(|&i| self.t[i]).collect();
        let mut again = clock::repair(&t, self.before, &path.display().to_string());
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

/// Whether it shows without any sorting that no sample is far: where more than a hundredth of them lie in the lowest
/// quarter of the range, and as many in the highest, the middle 98 % are at least half the range wide.
fn none_is_far(y: &[f64], [low, high]: [f64; 2]) -> bool {
    if low < -LARGEST || high > LARGEST {
        return false;
    }
    let quarter = 0.25 * (high - low);
    let (from, to) = (low + quarter, high - quarter);
    // infinite ones are in neither end
    let ends = |[a, b]: [u64; 2], x: &f64| {
        let lowest = (*x <= from) & (*x >= low);
        let highest = (*x >= to) & (*x <= high);
        [a + u64::from(lowest), b + u64::from(highest)]
    };
    let ends = y.iter().fold([0, 0], ends);
    let enough = |of: usize| ends.iter().all(|count| *count > of as u64 / 100 + 1);
    match all_finite(y) {
        true => enough(y.len()),
        false => {
            let numbers = y.iter().filter(|x| !x.is_nan());
            numbers.clone().all(|x| x.is_finite()) && enough(numbers.count())
        }
    }
}

/// Samples of a channel that cannot have been measured: far from everything else, alone or a few in a row.
pub(crate) fn impossible(y: &[f64]) -> Vec<usize> {
    impossible_within(y, extremes(y))
}

/// The same of one whose smallest and largest finite values are known.
fn impossible_within(y: &[f64], ends: [f64; 2]) -> Vec<usize> {
    match y.len() >= FEW && none_is_far(y, ends) {
        true => Vec::new(),
        false => far_ones(y),
    }
}

/// That so many values are impossible, the first in this row.
pub(crate) fn unmeasured(count: usize, row: usize, value: f64) -> String {
    format!(
        "{} cannot have been measured, the first at row {row} ({value:e}): dropped",
        counted(count, "value")
    )
}

fn far_ones(y: &[f64]) -> Vec<usize> {
    let mut sorted: Vec<f64> = y.iter().copied().filter(|x| x.is_finite()).collect();
    let n = sorted.len();
    if n < FEW {
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
    /// Takes impossible values out, so that they count as dropped; names them with their rows. Returns the smallest and largest
    /// finite value of each channel.
    pub(super) fn drop_impossible(&mut self, clock: &Clock) -> Vec<[f64; 2]> {
        let path = self.path.display().to_string();
        let mut warnings = Vec::new();
        let channels = self.channels();
        let look = |y: &[f64]| {
            let ends = extremes(y);
            (impossible_within(y, ends), ends)
        };
        let (all, mut ends): (Vec<Vec<usize>>, Vec<[f64; 2]>) =
            channels.par_iter().map(|(.., c)| look(c)).unzip();
        for (((name, _, column), wrong), ends) in channels.into_iter().zip(all).zip(&mut ends) {
            let Some(&first) = wrong.first() else {
                continue;
            };
            let row = clock.before + clock.keep.as_ref().map_or(first, |k| k[first]) + 1;
            let value = column[first];
            for &i in &wrong {
                column[i] = f64::NAN;
            }
            *ends = extremes(column);
            warnings.push(Warning::new(
                WarningKind::SamplesLeftOut,
                format!("{path}: {name}"),
                unmeasured(wrong.len(), row, value),
            ));
        }
        self.warnings.extend(warnings);
        ends
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// The quick look must never hide what sorting finds.
    #[test]
    fn channels_without_far_samples_are_told_without_sorting() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let (mut quick, mut found) = (0, 0);
        for case in 0..400 {
            let mut y: Vec<f64> = match case % 4 {
                0 => (0..300).map(|i| (0.05 * i as f64).sin()).collect(),
                1 => (0..300).map(|_| rng.random_range(-1.0..1.0)).collect(),
                // tails as heavy as those of shocks
                2 => (0..300)
                    .map(|_| rng.random_range(-1.0_f64..1.0).powi(99))
                    .collect(),
                // rests nearly throughout
                _ => (0..300).map(|i| f64::from(u8::from(i % 97 == 0))).collect(),
            };
            for _ in 0..case % 5 {
                let at = rng.random_range(0..y.len());
                y[at] = [1e3, -60.0, 1e13, f64::NAN, f64::INFINITY][rng.random_range(0..5)];
            }
            let expected = far_ones(&y);
            assert_eq!(impossible(&y), expected, "case {case}");
            quick += usize::from(none_is_far(&y, extremes(&y)));
            found += usize::from(!expected.is_empty());
        }
        assert!(
            quick > 50 && found > 50,
            "{quick} quick, {found} with far samples"
        );
    }
}
