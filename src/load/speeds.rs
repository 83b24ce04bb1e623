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
use crate::signals::butterworth::{first_derivative, smoother};
use crate::signals::cutoff::{self, Spectra};
use crate::signals::{Prepared, Settings, mean};

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
fn turns(record: &Prepared, a: usize, speed: &[f64]) -> Result<Vec<(usize, Vec<f64>)>> {
    let Some(p) = record.periods.as_ref().filter(|p| p.count > 1) else {
        return Ok(Vec::new());
    };
    let n = p.samples;
    let parts: Vec<&[f64]> = p.position.iter().map(|q| &q[a * n..(a + 1) * n]).collect();
    let middle = mean(&parts);
    // the periods follow one another
    let off: Vec<f64> = (parts.iter())
        .flat_map(|q| q.iter().zip(&middle).map(|(q, m)| q - m))
        .collect();
    let (rate, order) = (record.rate, Settings::default().order);
    let spectra = Spectra::fine(off.len(), rate, usize::MAX);
    let cutoff = cutoff::aperiodic(&off, &spectra, order).frequency;
    let low = smoother(order, cutoff, rate)?;
    let rates = first_derivative(&low(&off), 1.0 / rate);
    let near = |(i, v): (usize, &f64)| {
        let each = (0..p.count).map(|k| rates[k * n + i]);
        let most = each.clone().fold(0.0, |m: f64, d| m.max(d.abs()));
        (v.abs() < NEAR * most).then(|| (i, each.map(|d| v + d).collect()))
    };
    Ok(speed.iter().enumerate().filter_map(near).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::{Channels, Record, parts::Purpose};
    use crate::plant::Plant;
    use std::f64::consts::TAU;

    /// A joint that does not follow exactly turns elsewhere in every period; the mean friction is that of all periods.
    #[test]
    fn the_mean_friction_is_that_of_all_periods() {
        let (rate, period, count) = (200.0, 4.0, 5);
        let n = (rate * period) as usize;
        // sines of 0.25 Hz, and of 0.57 Hz, which no period repeats
        let waves = [(0.25, 0.5), (0.57, 4e-3)];
        let at = |i: usize, j: usize| i as f64 / rate + 0.3 * j as f64;
        let place = |t: f64| -> f64 { waves.iter().map(|(f, a)| a * (TAU * f * t).sin()).sum() };
        let rate_of = |t: f64| -> f64 {
            waves
                .iter()
                .map(|(f, a)| a * TAU * f * (TAU * f * t).cos())
                .sum()
        };
        let plant = Plant::load("planar2").unwrap();
        let all = n * count;
        let of = |f: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
            (0..2)
                .map(|j| (0..all).map(|i| f(i, j)).collect())
                .collect()
        };
        let channels = Channels {
            t: (0..all).map(|i| i as f64 / rate).collect(),
            q: of(&|i, j| place(at(i, j))),
            // a torque that does not move is a stuck channel
            tau: of(&|i, j| rate_of(at(i, j))),
            qref: None,
        };
        let record =
            Record::from_channels("it", channels, &plant, Purpose::Fit, Some(period)).unwrap();
        let prepared = Prepared::new(&record, &plant, &Settings::default()).unwrap();
        assert_eq!(prepared.periods.as_ref().map(|p| p.count), Some(count));
        let speeds = Speeds::new(prepared.motion.qd.clone(), &prepared).unwrap();
        for j in 0..2 {
            let found = speeds.of(j, f64::signum);
            let (mut own, mut plain) = (0.0, 0.0);
            for i in 0..n {
                let each = (0..count).map(|k| rate_of(at(k * n + i, j)).signum());
                let truth = each.sum::<f64>() / count as f64;
                own += (found[i] - truth).abs();
                plain += (prepared.motion.qd[j * n + i].signum() - truth).abs();
            }
            assert!(plain > 2.0 && own < 0.2 * plain, "{own} {plain}");
        }
    }
}
