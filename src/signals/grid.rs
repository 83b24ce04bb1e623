//! From the samples of a log to a uniform grid: by their stamps, or by the clock about which they jitter.

use super::wiener::triangle;
use crate::log;

/// The samples of a log that the diagnosis starts from.
pub(super) struct Source<'a> {
    pub t: &'a [f64],
    pub valid: &'a [bool],
    pub q: &'a [Vec<f64>],
    pub tau: &'a [Vec<f64>],
    pub qref: Option<&'a [Vec<f64>]>,
}

impl<'a> Source<'a> {
    /// Stamps that jitter about a clock are not believed before the samples were compared both ways,
    /// so the samples are taken as they were written where that can be.
    pub fn of(log: &'a log::Record) -> Self {
        match log.as_written() {
            Some(w) => Source {
                t: &w.t,
                valid: &w.valid,
                q: &w.q,
                tau: &w.tau,
                qref: w.qref.as_deref(),
            },
            None => Source {
                t: &log.t,
                valid: &log.valid,
                q: &log.q,
                tau: &log.tau,
                qref: log.qref.as_deref(),
            },
        }
    }
}

/// Highest rate of the grid, Hz: of what lies above the band of any motion nothing is learnt, and time and memory
/// grow with it. Logs of 2.5 kHz come to 312.5 Hz, those of 1 kHz and 500 Hz to 250 Hz.
pub(super) const RATE: f64 = 320.0;

/// Samples of a period at intervals of `mean` or multiples of it: far above the band nothing is learnt
/// from more of them.
pub(super) fn thinned(period: f64, mean: f64) -> usize {
    let mut per = (period / mean).round() as usize;
    while per as f64 / period > RATE {
        per /= 2;
    }
    per
}

/// Whether a record repeats after `period`: at least two of them, and the positions one period
/// apart differ by less than a thousandth of their range.
pub(super) fn repeats(raw: &Source, mean: f64, period: f64) -> bool {
    let lag = (period / mean).round() as usize;
    let n = raw.t.len();
    if lag == 0 || lag > n || 2 * lag > n + lag / 10 {
        return false;
    }
    raw.q.iter().all(|q| {
        let (lo, hi) = q
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                (a.min(*v), b.max(*v))
            });
        let apart: f64 = (0..n - lag).map(|i| (q[i + lag] - q[i]).powi(2)).sum();
        (apart / (n - lag) as f64).sqrt() < 1e-3 * (hi - lo).max(1e-9)
    })
}

/// A column at `count` times `0, dt, …` after the first stamp: by its stamps, or by its number
/// times the mean interval. Where the grid is coarser than the samples, they are averaged over a
/// triangle first.
pub(super) fn resample(
    t: &[f64],
    x: &[f64],
    mean: f64,
    dt: f64,
    count: usize,
    stamped: bool,
) -> Vec<f64> {
    let coarse = (dt / mean).round() as usize;
    let filtered: Vec<f64>;
    let x = if coarse > 1 {
        filtered = triangle(x, coarse);
        &filtered
    } else {
        x
    };
    let last = x.len() - 1;
    let mut k = 0;
    (0..count)
        .map(|i| {
            let at = i as f64 * dt;
            let (lo, w) = if stamped {
                while k + 1 < last && t[k + 1] - t[0] <= at {
                    k += 1;
                }
                let step = t[k + 1] - t[k];
                (k, (at - (t[k] - t[0])) / step)
            } else {
                let lo = ((at / mean + 1e-9) as usize).min(last - 1);
                (lo, at / mean - lo as f64)
            };
            let w = if w.abs() < 1e-6 { 0.0 } else { w };
            // cubic where there are neighbours on both sides
            if lo >= 1 && lo + 2 <= last && w != 0.0 {
                let (a, b, c, d) = (x[lo - 1], x[lo], x[lo + 1], x[lo + 2]);
                let h = w.clamp(-0.5, 1.5);
                // tangents at b and c, times the interval between them
                let [before, here, after] = match stamped {
                    true => [0, 1, 2].map(|i| t[lo + i] - t[lo + i - 1]),
                    false => [1.0; 3],
                };
                let tangent = |left: f64, right: f64, [l, r]: [f64; 2]| {
                    here * (left / l * r + right / r * l) / (l + r)
                };
                let m0 = tangent(b - a, c - b, [before, here]);
                let m1 = tangent(c - b, d - c, [here, after]);
                b + h * (m0 + h * (3.0 * (c - b) - 2.0 * m0 - m1 + h * (2.0 * (b - c) + m0 + m1)))
            } else {
                x[lo] + w.clamp(-1.0, 2.0) * (x[lo + 1] - x[lo])
            }
        })
        .collect()
}

/// Step of a channel whose values are whole multiples of it; 0 where they are not.
pub(super) fn lattice(x: &[f64]) -> f64 {
    let moves = || x.windows(2).map(|w| (w[1] - w[0]).abs());
    let step = moves().filter(|d| *d > 1e-12).fold(f64::INFINITY, f64::min);
    let off = |d: f64| (d / step - (d / step).round()).abs();
    match step.is_finite() && moves().all(|d| off(d) < 0.1) {
        true => step,
        false => 0.0,
    }
}

pub(super) fn third_difference(x: &[f64], n: usize, count: usize) -> f64 {
    (0..n)
        .map(|j| {
            x[j * count..(j + 1) * count]
                .windows(4)
                .map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).powi(2))
                .sum::<f64>()
        })
        .sum()
}
