//! Velocities of the actuators, with those of every period where a joint turns.
//!
//! Torques are averaged over the periods of a motion. Friction of the mean velocity is not the mean friction: a controller
//! does not follow exactly, so a joint turns a little earlier or later in each period, and between the first and the last
//! of them the mean of `sign(q̇)` is none of −1, 0 and 1. With 20 N at 500 Hz a millisecond leaves a newton behind the
//! filter, at the same places in every record of a motion. So near a reversal a function of the speed is
//!
//! ```text
//! (1/n_p) Σ_p f(v + δ̇_p)        δ_p = q_p − q̄, low-passed
//! ```

use crate::error::Result;
use crate::signals::butterworth::{Butterworth, first_derivative};
use crate::signals::{Prepared, cutoff};

/// Order of the low-pass of the deviations.
const ORDER: usize = 4;
/// A function counts period by period where the speed is below so many of the largest deviation.
const NEAR: f64 = 4.0;

/// Velocities of the actuators, at full rate.
#[derive(Debug)]
pub struct Speeds {
    /// samples
    count: usize,
    /// of the mean period, actuator-major
    mean: Vec<f64>,
    /// for each actuator, samples near a reversal with the velocities of every period
    turns: Vec<Vec<(usize, Vec<f64>)>>,
}

impl Speeds {
    /// From the velocities of the mean period (or of all samples where nothing repeats), actuator-major.
    ///
    /// # Errors
    /// A rate at which nothing can be filtered.
    pub fn new(mean: Vec<f64>, record: &Prepared) -> Result<Self> {
        let (count, actuators) = (record.count(), record.actuators);
        let turns = (0..actuators)
            .map(|a| turns(record, a, &mean[a * count..(a + 1) * count]))
            .collect::<Result<_>>()?;
        Ok(Speeds { count, mean, turns })
    }

    /// A function of the speed of an actuator, zero at rest, as the mean of all periods shows it.
    pub fn of(&self, a: usize, f: impl Fn(f64) -> f64) -> Vec<f64> {
        let f = |v: f64| if v == 0.0 { 0.0 } else { f(v) };
        let mean = &self.mean[a * self.count..(a + 1) * self.count];
        let mut out: Vec<f64> = mean.iter().map(|v| f(*v)).collect();
        for (i, each) in &self.turns[a] {
            out[*i] = each.iter().map(|v| f(*v)).sum::<f64>() / each.len() as f64;
        }
        out
    }
}

/// Samples near a reversal of an actuator, with the velocities of every period.
fn turns(record: &Prepared, a: usize, mean: &[f64]) -> Result<Vec<(usize, Vec<f64>)>> {
    let Some(p) = record.periods.as_ref().filter(|p| p.count > 1) else {
        return Ok(Vec::new());
    };
    let n = p.samples;
    let of = |k: usize, i: usize| p.position[k][a * n + i];
    let middle = |i: usize| (0..p.count).map(|k| of(k, i)).sum::<f64>() / p.count as f64;
    let middle: Vec<f64> = (0..n).map(middle).collect();
    // the periods follow one another
    let off: Vec<f64> = (0..p.count)
        .flat_map(|k| middle.iter().enumerate().map(move |(i, m)| of(k, i) - m))
        .collect();
    let rate = record.rate;
    let found = cutoff::aperiodic(&off, rate, ORDER).frequency;
    let low = Butterworth::low_pass(ORDER, found.min(0.45 * rate), rate)?;
    let pad = low.default_pad().max((3.0 * rate / found) as usize);
    let rates = first_derivative(&low.zero_phase(&off, pad), 1.0 / rate);
    let near = |(i, v): (usize, &f64)| {
        let each = (0..p.count).map(|k| rates[k * n + i]);
        let most = each.clone().fold(0.0, |m: f64, d| m.max(d.abs()));
        (v.abs() < NEAR * most).then(|| (i, each.map(|d| v + d).collect()))
    };
    Ok(mean.iter().enumerate().filter_map(near).collect())
}
