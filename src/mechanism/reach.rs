//! What the actuators of a closed chain reach between the samples: enclosed by interval arithmetic, or
//! sampled with a stated bound. The equations are in [`certificate`](super::certificate).

use super::Mechanism;
use super::geometry::Path;
use super::interval::{Interval, Series};
use super::smooth::Smooth;
use crate::dynamics::Samples;
use crate::error::Result;
use crate::robot::{Limits, Robot};
use crate::trajectory::certificate::{JointCertificate, Peak, Range};
use crate::trajectory::{Extremum, Fourier};

/// Fewest stretches of a period.
const STRETCHES: usize = 1000;
/// How often a stretch is halved, and what is missing before it is, as a part of the limit.
const DEPTH: u32 = 7;
const MISSING: f64 = 1e-3;

/// Largest of the orders 0 (both signs) to 3 of an actuator so far: at a point of time, and bound.
#[derive(Clone, Copy)]
pub(crate) struct Reach {
    low: Extremum,
    high: Extremum,
    bounds: [f64; 2],
    peak: [Extremum; 3],
    bound: [f64; 3],
}

impl Reach {
    /// The larger of both.
    pub fn or(mut self, other: &Reach) -> Self {
        if other.low.value < self.low.value {
            self.low = other.low;
        }
        if other.high.value > self.high.value {
            self.high = other.high;
        }
        self.bounds[0] = self.bounds[0].min(other.bounds[0]);
        self.bounds[1] = self.bounds[1].max(other.bounds[1]);
        for k in 0..3 {
            if other.peak[k].value > self.peak[k].value {
                self.peak[k] = other.peak[k];
            }
            self.bound[k] = self.bound[k].max(other.bound[k]);
        }
        self
    }

    /// The same, begun so many seconds later.
    pub fn later(mut self, seconds: f64) -> Self {
        let peaks = self.peak.iter_mut();
        for at in peaks.chain([&mut self.low, &mut self.high]) {
            at.time += seconds;
        }
        self
    }

    /// Against limits, without a torque.
    pub fn certificate(&self, joint: &str, limits: &Limits) -> JointCertificate {
        let peak = |k: usize, limit: f64| Peak::new(self.peak[k], self.bound[k], limit);
        JointCertificate {
            joint: joint.to_string(),
            position: Range::new(self.low, self.high, self.bounds, limits.position),
            velocity: peak(0, limits.velocity),
            acceleration: peak(1, limits.acceleration),
            jerk: peak(2, limits.jerk),
            velocity_by_position: None,
            torque: None,
            torque_rate: None,
        }
    }
}

impl Default for Reach {
    fn default() -> Self {
        let at = |value: f64| Extremum { time: 0.0, value };
        Reach {
            low: at(f64::INFINITY),
            high: at(f64::NEG_INFINITY),
            bounds: [f64::INFINITY, f64::NEG_INFINITY],
            peak: [at(0.0); 3],
            bound: [0.0; 3],
        }
    }
}

/// Factorials of the Taylor coefficients.
const FACTORIAL: [f64; 5] = [1.0, 1.0, 2.0, 6.0, 24.0];

/// Middle and radius of a task coordinate and of its first four derivatives over `c ± r`.
pub(crate) type Enclosure = [[f64; 2]; 5];

/// Evaluates stretches of time.
struct Prover<'a> {
    mechanism: &'a Mechanism,
    /// the task coordinates over `c ± r`
    task: &'a dyn Fn(f64, f64) -> Vec<Enclosure>,
    /// middle and half of the position limits, and limits of velocity, acceleration and jerk
    limits: Vec<([f64; 2], [f64; 3])>,
    reach: Vec<Reach>,
}

impl Prover<'_> {
    /// Taylor coefficients of the task coordinates over `c ± r`.
    fn task(&self, c: f64, r: f64) -> Vec<Path> {
        let each = (self.task)(c, r).into_iter();
        each.map(|d| {
            Series(std::array::from_fn(|k| {
                Interval::around(d[k][0], d[k][1]) * (1.0 / FACTORIAL[k])
            }))
        })
        .collect()
    }

    /// Takes the stretch `c ± r` into account; `None` without closed form.
    fn stretch(&mut self, c: f64, r: f64, depth: u32) -> Option<()> {
        let geometry = self.mechanism.geometry();
        let middle = geometry.enclosure(&self.task(c, 0.0))?;
        let whole = geometry.enclosure(&self.task(c, r))?;
        let mut tight = true;
        let mut found = Vec::with_capacity(self.reach.len());
        for (a, &j) in self.mechanism.actuated.iter().enumerate() {
            let at = |k: usize| {
                let i = middle[j].0[k];
                (
                    0.5 * (i.low + i.high) * FACTORIAL[k],
                    i.magnitude() * FACTORIAL[k],
                )
            };
            let sup = |k: usize| whole[j].0[k].magnitude() * FACTORIAL[k];
            let spread = |k: usize| match k {
                3 => r * sup(4),
                _ => (r * at(k + 1).1 + 0.5 * r * r * sup(k + 2)).min(r * sup(k + 1)),
            };
            let value: [f64; 4] = std::array::from_fn(|k| at(k).0);
            let rounding = |k: usize| (at(k).1 - value[k].abs()).abs();
            let radius: [f64; 4] = std::array::from_fn(|k| spread(k) + rounding(k));
            let ([center, half], limits) = self.limits[a];
            let near = |bound: f64, here: f64, limit: f64| {
                limit.is_finite() && bound > 0.9 * limit && bound - here > MISSING * limit
            };
            let off = (value[0] - center).abs();
            tight &= !near(off + radius[0], off, half);
            for k in 0..3 {
                let here = value[k + 1].abs();
                tight &= !near(here + radius[k + 1], here, limits[k]);
            }
            found.push((value, radius));
        }
        if !tight && depth < DEPTH {
            self.stretch(c - 0.5 * r, 0.5 * r, depth + 1)?;
            return self.stretch(c + 0.5 * r, 0.5 * r, depth + 1);
        }
        for (reach, (value, radius)) in self.reach.iter_mut().zip(found) {
            let at = |value: f64| Extremum { time: c, value };
            if value[0] < reach.low.value {
                reach.low = at(value[0]);
            }
            if value[0] > reach.high.value {
                reach.high = at(value[0]);
            }
            let [low, high] = &mut reach.bounds;
            *low = low.min(value[0] - radius[0]);
            *high = high.max(value[0] + radius[0]);
            if radius[0].is_nan() || value[0].is_nan() {
                *high = f64::INFINITY;
            }
            for k in 0..3 {
                let here = value[k + 1].abs();
                if here > reach.peak[k].value {
                    reach.peak[k] = at(here);
                }
                let bound = here + radius[k + 1];
                reach.bound[k] = match bound.is_nan() {
                    true => f64::INFINITY,
                    false => reach.bound[k].max(bound),
                };
            }
        }
        Some(())
    }
}

/// What the actuators reach: proven where the kinematics has a closed form, else sampled with the
/// stated bound.
pub(super) fn actuator_reach(
    mechanism: &Mechanism,
    fourier: &Fourier,
    actuators: &Robot,
    samples: &Samples,
) -> Result<(Vec<Reach>, bool)> {
    let omega = fourier.omega();
    let sums = fourier.joints.iter().map(|s| {
        std::array::from_fn(|k| s.amplitude_sum(&fourier.harmonics, omega, k as u32) * (1.0 + 1e-9))
    });
    // Σ_h (hω)ᵏ A_h of each coordinate, k = 0 … 6
    let sums: Vec<[f64; 7]> = sums.collect();
    let m = fourier.dof();
    let task = |c: f64, r: f64| {
        let mut d = vec![0.0; 6 * m];
        let mut rows = d.chunks_exact_mut(m);
        let mut row = || rows.next().unwrap_or_default();
        fourier.evaluate(c, [row(), row(), row(), row(), row(), row()]);
        let one = |j: usize| -> Enclosure {
            let sums = &sums[j];
            std::array::from_fn(|k| {
                let here = d[k * m + j];
                // evaluation is right to rounding of its amplitudes
                let rounding = 1e-13 * (sums[k] + here.abs());
                let radius = r * d[(k + 1) * m + j].abs() + 0.5 * r * r * sums[k + 2];
                [here, radius + rounding]
            })
        };
        (0..m).map(one).collect()
    };
    let count = (40 * fourier.harmonic_max() as usize).clamp(STRETCHES, 20_000);
    let r = 0.5 * fourier.period / count as f64;
    let stretches = (0..count).map(|i| ((2 * i + 1) as f64 * r, r));
    if let Some(reach) = proven(mechanism, &task, actuators, stretches) {
        return Ok((reach, true));
    }
    let motion = mechanism.motion(samples)?.tree;
    let smooth = Smooth::Period(fourier.period / samples.count as f64);
    Ok((
        sampled_reach(&motion.rows(&mechanism.actuated), &smooth),
        false,
    ))
}

/// What the actuators reach over stretches of time `c ± r`, proven; `None` where the kinematics has no closed form.
pub(super) fn proven(
    mechanism: &Mechanism,
    task: &dyn Fn(f64, f64) -> Vec<Enclosure>,
    actuators: &Robot,
    mut stretches: impl Iterator<Item = (f64, f64)>,
) -> Option<Vec<Reach>> {
    let limits = actuators.joints.iter().map(|joint| {
        let l = &joint.limits;
        let [low, high] = l.position;
        (
            [0.5 * (low + high), 0.5 * (high - low)],
            [l.velocity, l.acceleration, l.jerk],
        )
    });
    let mut prover = Prover {
        mechanism,
        task,
        limits: limits.collect(),
        reach: vec![Reach::default(); mechanism.actuators()],
    };
    stretches.try_for_each(|(c, r)| prover.stretch(c, r, 0))?;
    Some(prover.reach)
}

/// What the rows of a motion reach at the samples, with the stated bound between them.
pub(super) fn sampled_reach(motion: &Samples, smooth: &Smooth) -> Vec<Reach> {
    let n = motion.count;
    (0..motion.dof)
        .map(|j| {
            let rows = j * n..(j + 1) * n;
            let (q, qd, qdd) = (
                &motion.q[rows.clone()],
                &motion.qd[rows.clone()],
                &motion.qdd[rows],
            );
            let jerk = smooth.rates(qdd);
            let mut reach = Reach::default();
            let extremum = |u: &[f64], sign: f64| {
                let mut best = Extremum {
                    time: 0.0,
                    value: f64::NEG_INFINITY,
                };
                for (s, v) in u.iter().enumerate() {
                    if sign * v > best.value {
                        best = Extremum {
                            time: smooth.time(s),
                            value: sign * v,
                        };
                    }
                }
                best
            };
            let low = extremum(q, -1.0);
            reach.low = Extremum {
                value: -low.value,
                ..low
            };
            reach.high = extremum(q, 1.0);
            reach.bounds = [
                reach.low.value - smooth.missing(q),
                reach.high.value + smooth.missing(q),
            ];
            for (k, u) in [qd, qdd, &jerk].into_iter().enumerate() {
                let (a, b) = (extremum(u, 1.0), extremum(u, -1.0));
                reach.peak[k] = if a.value > b.value { a } else { b };
                reach.bound[k] = reach.peak[k].value + smooth.missing(u);
            }
            reach
        })
        .collect()
}
