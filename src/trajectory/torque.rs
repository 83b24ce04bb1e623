//! Torque over all time: samples, and a proof of what happens between them.

use super::certificate::{TorqueBound, check};
use super::fourier::Fourier;
use super::jets::{Jet, Norms};
use crate::error::{Error, Result};
use crate::robot::{JointTerm, Robot};

/// What may be missing between samples, as a fraction of the effort limit.
const TARGET: f64 = 0.002;

/// The smooth part of the torque (rigid bodies, armature, viscous friction, offset) at one state:
/// `(q, qd, qdd, tau)` with `tau` to be written.
pub type TorqueFn<'a> = dyn Fn(&[f64], &[f64], &[f64], &mut [f64]) + 'a;

/// Part of the period between two samples.
#[derive(Clone, Copy)]
struct Interval {
    start: f64,
    width: f64,
    /// indices of the samples at its ends
    ends: [usize; 2],
    /// index of the segment it came from, whose bound of `τ̈` holds in it
    segment: usize,
}

/// Bounds every joint's torque over all time, `torque` being the smooth part.
///
/// The period is cut into segments; on each, `sup |τ̈|` follows from the coordinates' derivatives
/// by norm jets (see [`jets`](super::jets)). An interval of width `h` then holds
/// `|τ| ≤ max(|τ_i|, |τ_{i+1}|) + (h²/8) sup |τ̈|`. Intervals where this could exceed the largest
/// sample of some joint by more than 0.2 % of its effort limit (of the largest torque of the
/// robot, where there is no limit) are halved, the most excessive first, until none is left or
/// `samples` evaluations are spent. Either way the bound reported holds, up
/// to the rounding of `torque` itself.
///
/// # Errors
/// [`Error::Argument`] if the trajectory is malformed or has another number of joints than the
/// robot, or if `torque` returns a number that is not finite.
pub fn torque_certificate(
    robot: &Robot,
    trajectory: &Fourier,
    samples: usize,
    torque: &TorqueFn,
) -> Result<Vec<TorqueBound>> {
    check(robot, trajectory)?;
    let n = robot.dof();
    let period = trajectory.period;
    let segments = (8 * trajectory.harmonic_max() as usize)
        .clamp(64, 1024)
        .min(samples.max(1));
    let width = period / segments as f64;

    let mut tau: Vec<f64> = Vec::new();
    let mut times: Vec<f64> = Vec::new();
    let mut state = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
    let mut highest = vec![0.0f64; n];
    let mut when = vec![0.0f64; n];
    let mut take = |t: f64, tau: &mut Vec<f64>| -> Result<()> {
        let [q, qd, qdd] = &mut state;
        trajectory.evaluate(t, [q, qd, qdd]);
        let at = tau.len();
        tau.resize(at + n, 0.0);
        torque(q, qd, qdd, &mut tau[at..]);
        for (j, value) in tau[at..].iter_mut().enumerate() {
            *value = value.abs();
            if !value.is_finite() {
                return Err(Error::Argument(format!(
                    "the torque of joint {} is not finite at t = {t} s; check the inertial \
                     parameters",
                    robot.joints[j].name
                )));
            }
            if *value > highest[j] {
                (highest[j], when[j]) = (*value, t);
            }
        }
        times.push(t);
        Ok(())
    };

    let mut curvature = Vec::with_capacity(segments * n);
    let bounds = Derivatives::new(trajectory);
    let norms = Norms::new(robot);
    let mut open = Vec::with_capacity(segments);
    for segment in 0..segments {
        let start = segment as f64 * width;
        take(start, &mut tau)?;
        curvature.extend(norms.torque_curvature(&bounds.on(trajectory, start, width)));
        open.push(Interval {
            start,
            width,
            ends: [segment, (segment + 1) % segments],
            segment,
        });
    }
    // the sup of what intervals already closed could hold
    let mut settled = vec![0.0f64; n];
    loop {
        let best: Vec<f64> = (0..n)
            .map(|j| {
                (0..tau.len() / n)
                    .map(|i| tau[i * n + j])
                    .fold(0.0, f64::max)
            })
            .collect();
        let scale = best.iter().copied().fold(0.0, f64::max);
        let target: Vec<f64> = robot
            .joints
            .iter()
            .map(|joint| {
                let effort = joint.limits.effort;
                TARGET
                    * if effort.is_finite() && effort > 0.0 {
                        effort
                    } else {
                        scale
                    }
            })
            .collect();
        let above = |interval: &Interval, j: usize| {
            let [a, b] = interval.ends;
            let sag = interval.width * interval.width / 8.0 * curvature[interval.segment * n + j];
            tau[a * n + j].max(tau[b * n + j]) + sag
        };
        // by how many targets the worst joint's bound exceeds its largest sample
        let mut ranked: Vec<(f64, Interval)> = open
            .drain(..)
            .map(|interval| {
                let excess = (0..n)
                    .map(|j| (above(&interval, j) - best[j]) / target[j])
                    .map(|e| if e.is_nan() { 0.0 } else { e })
                    .fold(f64::NEG_INFINITY, f64::max);
                (excess, interval)
            })
            .collect();
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.start.total_cmp(&b.1.start)));
        let wanted = ranked
            .iter()
            .take_while(|(excess, _)| *excess > 1.0)
            .count();
        let halved = wanted.min(samples.saturating_sub(tau.len() / n));
        for (_, interval) in &ranked[halved..] {
            for (j, sup) in settled.iter_mut().enumerate() {
                *sup = sup.max(above(interval, j));
            }
        }
        if halved == 0 {
            break;
        }
        for (_, interval) in &ranked[..halved] {
            let half = 0.5 * interval.width;
            let middle = tau.len() / n;
            take(interval.start + half, &mut tau)?;
            let [a, b] = interval.ends;
            open.push(Interval {
                width: half,
                ends: [a, middle],
                ..*interval
            });
            open.push(Interval {
                start: interval.start + half,
                width: half,
                ends: [middle, b],
                ..*interval
            });
        }
    }

    let taken = times.len();
    Ok(robot
        .joints
        .iter()
        .enumerate()
        .map(|(j, joint)| {
            let coulomb = joint.terms[JointTerm::Coulomb as usize].abs();
            let limit = joint
                .limits
                .effort
                .is_finite()
                .then_some(joint.limits.effort);
            let value = highest[j] + coulomb;
            TorqueBound {
                joint: joint.name.clone(),
                max_on_grid: highest[j],
                time: when[j],
                between_grid_bound: (settled[j] - highest[j]).max(0.0),
                coulomb,
                samples: taken,
                limit,
                used: limit.map(|l| if value == 0.0 { 0.0 } else { value / l }),
                margin: limit.map(|l| l - value),
            }
        })
        .collect())
}

/// Bounds of `|q⁽ᵏ⁾|` on intervals of time.
struct Derivatives {
    /// `Σ_h (hω)ᵏ A_h` of every joint, `k = 0 … 6` (without the constant)
    sums: Vec<[f64; 7]>,
}

impl Derivatives {
    fn new(trajectory: &Fourier) -> Self {
        let omega = trajectory.omega();
        let sums = trajectory
            .joints
            .iter()
            .map(|s| {
                std::array::from_fn(|k| {
                    s.amplitude_sum(&trajectory.harmonics, omega, k as u32) * (1.0 + 1e-9)
                })
            })
            .collect();
        Derivatives { sums }
    }

    /// `k = 0 … 4` on an interval, by Taylor about its centre `m`, half width `r`:
    /// `|q⁽ᵏ⁾| ≤ |q⁽ᵏ⁾(m)| + r |q⁽ᵏ⁺¹⁾(m)| + ½ r² sup |q⁽ᵏ⁺²⁾|`.
    fn on(&self, trajectory: &Fourier, start: f64, width: f64) -> Vec<Jet> {
        let n = trajectory.dof();
        let (r, mut d) = (0.5 * width, vec![0.0; 6 * n]);
        let mut rows = d.chunks_exact_mut(n);
        let mut row = || rows.next().unwrap_or_default();
        trajectory.evaluate(start + r, [row(), row(), row(), row(), row(), row()]);
        (0..n)
            .map(|j| {
                let sums = &self.sums[j];
                std::array::from_fn(|k| {
                    let at = |order: usize| d[order * n + j].abs();
                    let local = at(k) + r * at(k + 1) + 0.5 * r * r * sums[k + 2];
                    let shift = if k == 0 {
                        trajectory.joints[j].constant.abs()
                    } else {
                        0.0
                    };
                    local.min(sums[k] + shift) + 1e-12 * (sums[k] + shift)
                })
            })
            .collect()
    }
}
