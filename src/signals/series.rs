//! A record at its full length on a uniform grid, with the motion of its coordinates and actuators: what
//! a stage needs that looks at single samples and at what the periods have in common.
//!
//! Derivatives come from a Fourier series where the motion repeats ([`wiener`](super::wiener)); what the encoder
//! cannot resolve is left out of it. Samples that were not measured are marked.

use super::grid::{RATE, Source, lattice, repeats, resample, thinned, third_difference};
use super::repeats::{freedoms, means, repeat, scatter, widen};
use super::wiener::{BAND, Differentiated, Filter, SMOOTH, differentiated, half_width};
use super::{cutoff, standstill};
use crate::dynamics::Samples;
use crate::error::{Error, Result};
use crate::log::{self, Payload, Purpose};
use crate::plant::Plant;
use std::borrow::Cow;

/// Fewest samples of a record.
const LEAST: usize = 64;
/// The most of a record that an end of it takes is one part of so many.
const MOST_OF_ENDS: usize = 8;

/// A record on a uniform grid with its motion.
#[derive(Debug, Clone)]
pub struct Series {
    /// name
    pub name: String,
    /// whether it is fitted to
    pub fit: bool,
    /// sampling interval, s
    pub dt: f64,
    /// samples
    pub count: usize,
    /// samples of a period, where the motion repeats
    pub cycle: Option<usize>,
    /// motion of the coordinates
    pub x: Samples,
    /// motion of the actuators (the same for a serial robot)
    pub actuators: Samples,
    /// commanded motion of the actuators, where it was logged
    pub reference: Option<Samples>,
    /// measured torque, actuator-major
    pub tau: Vec<f64>,
    /// position of the link less that of the motor, as measured, actuator-major; not a number where an actuator has no
    /// second encoder
    pub deflection: Option<Vec<f64>>,
    /// whether torque and motion of a sample rest on measured values; the others have no weight
    pub measured: Vec<bool>,
    /// whether an actuator stands still, actuator-major; empty where none ever does
    pub standing: Vec<bool>,
    /// standard deviation of a measured position, by actuator
    pub position_noise: Vec<f64>,
    /// highest frequency with motion in it, Hz
    pub band: f64,
    /// whether its encoder is coarse, by actuator; empty where none is
    pub coarse: Vec<bool>,
    /// what the positions of coarse encoders passed, by actuator; empty where none is coarse
    pub filters: Vec<Option<Filter>>,
    /// what the robot carried
    pub payload: Payload,
    /// place in the experiment file
    pub order: usize,
    /// remarks for the report
    pub remarks: Vec<String>,
}

impl Series {
    /// Whole periods in the record (1 where it does not repeat).
    pub fn periods(&self) -> usize {
        self.cycle.map_or(1, |c| self.count / c)
    }

    /// Torque of one actuator.
    pub fn torque(&self, j: usize) -> &[f64] {
        &self.tau[j * self.count..(j + 1) * self.count]
    }

    /// Position and velocity of one actuator.
    pub fn state(&self, j: usize) -> (&[f64], &[f64]) {
        let row = j * self.count..(j + 1) * self.count;
        (&self.actuators.q[row.clone()], &self.actuators.qd[row])
    }

    /// Acceleration of one actuator.
    pub fn acceleration(&self, j: usize) -> &[f64] {
        &self.actuators.qdd[j * self.count..(j + 1) * self.count]
    }

    /// What the positions of actuator `j` passed, where its encoder is coarse.
    pub fn filter(&self, j: usize) -> Option<&Filter> {
        self.filters.get(j)?.as_ref()
    }

    /// Number of measured samples.
    pub fn sound(&self) -> usize {
        self.measured.iter().filter(|m| **m).count()
    }

    /// Samples that say something about actuator `j`: measured, and not at rest.
    pub fn counted(&self, j: usize) -> Cow<'_, [bool]> {
        if self.standing.is_empty() {
            return Cow::Borrowed(&self.measured);
        }
        let stands = &self.standing[j * self.count..(j + 1) * self.count];
        let pairs = self.measured.iter().zip(stands);
        Cow::Owned(pairs.map(|(m, s)| *m && !s).collect())
    }

    /// Standard deviation of the velocity of actuator `j`, from the noise of its position and the band of the motion.
    pub fn velocity_noise(&self, j: usize) -> f64 {
        let density = 2.0 * self.position_noise[j].powi(2) * self.dt / self.periods() as f64;
        cutoff::velocity_noise(density, self.band.min(0.5 / self.dt))
    }

    /// Number of them.
    pub fn counts(&self, j: usize) -> usize {
        self.counted(j).iter().filter(|c| **c).count()
    }

    /// Whether any actuator moves at any time.
    pub fn moves(&self) -> bool {
        self.standing.is_empty() || self.standing.contains(&false)
    }

    /// A signal of actuator `j` with zeros where nothing was measured or the actuator stood.
    pub fn silenced<'a>(&self, j: usize, x: &'a [f64]) -> Cow<'a, [f64]> {
        let counted = self.counted(j);
        if counted.iter().all(|c| *c) {
            return Cow::Borrowed(x);
        }
        let kept = x.iter().zip(counted.iter());
        Cow::Owned(kept.map(|(x, c)| if *c { *x } else { 0.0 }).collect())
    }

    /// Mean period of a signal of actuator `j`, over samples that count; 0 where no period has one. A record that does
    /// not repeat is one period.
    pub fn period_mean(&self, j: usize, x: &[f64]) -> Vec<f64> {
        means(x, &self.counted(j), self.cycle.unwrap_or(self.count))
            .into_iter()
            .map(Option::unwrap_or_default)
            .collect()
    }

    /// Freedoms that are left of the samples of actuator `j` that count, beside their mean period; none of a record
    /// that does not repeat.
    pub fn freedoms(&self, j: usize) -> usize {
        freedoms(&self.counted(j), self.cycle.unwrap_or(self.count))
    }

    /// Brings a log onto its grid. `likely` are periods of other records, tried where it states none.
    ///
    /// # Errors
    /// A record without torques, one that is too short or has too few sound samples, or poses of a
    /// parallel robot that cannot be reached.
    pub fn prepare(plant: &Plant, log: &log::Record, likely: &[f64]) -> Result<Self> {
        let n = plant.actuators().len();
        let mut remarks = Vec::new();
        if log.tau.is_empty() {
            return Err(Error::Infeasible(format!(
                "{} has no torque columns tau1…: a diagnosis needs measured torques",
                log.path.display()
            )));
        }
        if log.len() < LEAST {
            return Err(Error::Infeasible(format!(
                "{}: {} samples are too few for a diagnosis; record at least a whole period",
                log.name,
                log.len()
            )));
        }
        let raw = &Source::of(log);
        let total = raw.t.len();
        let span = raw.t[total - 1] - raw.t[0];
        let mean = span / (total - 1) as f64;
        // a repeating record is cut to whole periods on a grid that divides the period
        let period = log.period.or_else(|| {
            let found = likely.iter().copied().find(|p| repeats(raw, mean, *p));
            if found.is_some() {
                remarks.push("it repeats with the period of another record".to_string());
            }
            found
        });
        let (dt, count, cycle) = match period {
            Some(period)
                if span + 1.5 * mean >= period
                    && period >= 4.0 * mean
                    && thinned(period, mean) >= 4 =>
            {
                let whole = ((span + 1.5 * mean) / period).floor().max(1.0) as usize;
                let per = thinned(period, mean);
                (period / per as f64, whole * per, Some(per))
            }
            _ => {
                let mut step = mean;
                while 1.0 / step > RATE {
                    step *= 2.0;
                }
                (step, (span / step).floor() as usize + 1, None)
            }
        };
        let cycle = cycle.filter(|c| count / c >= 2);
        let grid = |columns: &[Vec<f64>], stamped: bool| -> Vec<f64> {
            let mut out = Vec::with_capacity(n * count);
            for column in columns.iter().take(n) {
                out.extend(resample(raw.t, column, mean, dt, count, stamped));
            }
            out
        };
        // stamps may jitter about a clock that did not: what repeats better is believed
        let regular = raw
            .t
            .iter()
            .enumerate()
            .all(|(i, t)| (t - raw.t[0] - i as f64 * mean).abs() < 0.5 * mean);
        let mut q = grid(raw.q, true);
        let mut stamped = true;
        if regular {
            let by_clock = grid(raw.q, false);
            let roughness = |x: &[f64]| match cycle {
                Some(c) => {
                    let free = c * (count / c - 1);
                    scatter(x, n, count, c, free).iter().sum::<f64>()
                }
                None => third_difference(x, n, count),
            };
            if roughness(&by_clock) < roughness(&q) {
                (q, stamped) = (by_clock, false);
                remarks.push(
                    "time stamps jitter about a regular clock; the clock is used".to_string(),
                );
            }
        }
        let mut tau = grid(raw.tau, stamped);
        let deflection = log.ql.as_ref().map(|ql| {
            let mut all = Vec::with_capacity(n * count);
            for (ql, q) in ql.iter().zip(&log.q) {
                match ql.is_empty() {
                    true => all.resize(all.len() + count, f64::NAN),
                    false => {
                        let apart: Vec<f64> = ql.iter().zip(q).map(|(l, m)| l - m).collect();
                        all.extend(resample(&log.t, &apart, log.step, dt, count, true));
                    }
                }
            }
            all
        });
        let mut reference = raw.qref.map(|columns| grid(columns, stamped));
        let mut measured = vec![true; count];
        if raw.valid.contains(&false) {
            // what a grid point takes from a sample that was not measured is not zero here
            let bad: Vec<f64> = raw.valid.iter().map(|v| f64::from(u8::from(!*v))).collect();
            let share = resample(raw.t, &bad, mean, dt, count, stamped);
            measured = share.iter().map(|s| *s == 0.0).collect();
        }
        let free = cycle.map_or(1, |c| freedoms(&measured, c));
        if let Some(cycle) = cycle.filter(|_| measured.contains(&false)) {
            for x in [Some(&mut q), Some(&mut tau), reference.as_mut()] {
                for row in x.into_iter().flat_map(|x| x.chunks_exact_mut(count)) {
                    repeat(row, &measured, cycle);
                }
            }
        }
        let reach = match cycle {
            Some(_) => (1.0 / (BAND * dt)).ceil() as usize,
            None => 4 * half_width(dt) + 2,
        };
        widen(&mut measured, cycle, reach);
        if cycle.is_none() && count > 4 * reach {
            // a low-pass does not know what was before and after: a record that is cut out of a motion has no
            // accelerations at its ends
            measured[..reach].fill(false);
            measured[count - reach..].fill(false);
        }
        if 2 * measured.iter().filter(|m| **m).count() < LEAST {
            return Err(Error::Infeasible(format!(
                "{}: too few samples are sound in all channels for a diagnosis; see the warnings of \
                 this log, and record it anew",
                log.name
            )));
        }
        let steps: Vec<f64> = plant
            .actuators()
            .iter()
            .zip(raw.q)
            .map(|(joint, q)| {
                joint
                    .position_resolution
                    .unwrap_or_else(|| lattice(q))
                    .powi(2)
                    / 12.0
            })
            .collect();
        let cycles = cycle.map(|cycle| (cycle, free));
        let Differentiated {
            motion,
            noise: position_noise,
            band,
            coarse,
            filters,
        } = differentiated(&q, &steps, count, cycles, dt);
        if cycle.is_none() {
            // what an end does to the positions of a coarse encoder reaches farther
            let reach = filters.iter().flatten().map(Filter::reach).max();
            let reach = reach.unwrap_or(0).min(count / MOST_OF_ENDS);
            measured[..reach].fill(false);
            measured[count - reach..].fill(false);
        }
        let reference = reference.map(|columns| {
            let exact = vec![0.0; n];
            differentiated(&columns, &exact, count, cycles, dt).motion
        });
        let standing = standing(
            plant,
            &motion,
            &position_noise,
            cycle.map_or(1, |c| count / c),
            dt,
        );
        let x = plant.coordinate_motion(&motion, cycle)?;
        let actuators = motion;
        Ok(Series {
            name: log.name.clone(),
            fit: log.purpose == Purpose::Fit,
            dt,
            count,
            cycle,
            x,
            actuators,
            reference,
            tau,
            deflection,
            measured,
            standing,
            position_noise,
            band,
            coarse,
            filters,
            payload: log.payload,
            order: 0,
            remarks,
        })
    }
}

/// Where each actuator stands still, actuator-major; empty where none ever does. `periods` are averaged.
pub fn standing(
    plant: &Plant,
    motion: &Samples,
    noise: &[f64],
    periods: usize,
    dt: f64,
) -> Vec<bool> {
    let band = if periods > 1 { BAND } else { SMOOTH };
    let mut all = Vec::with_capacity(motion.q.len());
    for (j, actuator) in plant.actuators().into_iter().enumerate() {
        let row = j * motion.count..(j + 1) * motion.count;
        let density = 2.0 * noise[j].powi(2) * dt / periods as f64;
        let joint = standstill::Joint {
            position_noise: noise[j],
            velocity_noise: cutoff::velocity_noise(density, band.min(0.5 / dt)),
            motion: actuator.motion,
        };
        let slow = standstill::slow(joint, &motion.q[row.clone()], &motion.qd[row]);
        all.extend(standstill::lasting(&slow, dt));
    }
    match all.contains(&true) {
        true => all,
        false => Vec::new(),
    }
}
