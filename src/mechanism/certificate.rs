//! Proof that a platform motion keeps the limits of a closed chain at all times.
//!
//! The platform's own box holds by the exact extrema of its series ([`trajectory::certify`](crate::trajectory::certify)). What the
//! actuators do is no trigonometric polynomial. Over a stretch `[c − r, c + r]` of time
//!
//! ```text
//! |x⁽ᵏ⁾(t) − x⁽ᵏ⁾(c)| ≤ r |x⁽ᵏ⁺¹⁾(c)| + ½ r² Σ_h (hω)ᵏ⁺² A_h
//! q⁽ᵏ⁾(t) ∈ q⁽ᵏ⁾(c) ± ( r |q⁽ᵏ⁺¹⁾(c)| + ½ r² sup |q⁽ᵏ⁺²⁾| )
//! ```
//!
//! with the suprema from interval arithmetic on the Taylor coefficients of the kinematics
//! ([`Geometry::enclosure`](super::Geometry::enclosure)), rounding included: position, velocity,
//! acceleration and jerk of the actuators are **proven**. Stretches that come too close to a limit
//! are halved. Forces, opening angles, singular values and distances are sampled, and bounded
//! between two samples a time `h` apart by
//!
//! ```text
//! |u(t)| ≤ max(|u_i|, |u_{i+1}|) + (h²/8) · 2 max |ü|
//! ```
//!
//! with the largest second difference of all samples, doubled, for `ü`: a bound that is **stated**,
//! not proven; as is that of a mechanism without closed form, for all of it.
//!
//! Where the series are those of the actuators ([`Mechanism::in_actuators`], and loops), it is the
//! other way round: the actuators are exact, by the extrema of their series as for a serial robot,
//! and the box of a platform that follows is sampled with the stated bound.

use super::geometry::Path;
use super::interval::Interval;
use super::margins::PoseKind;
use super::motion::slice;
use super::{Mechanism, MechanismWorkspace};
use crate::dynamics::Samples;
use crate::error::Result;
use crate::robot::{Limits, Robot};
use crate::trajectory::certificate::{
    Certificate, JointCertificate, Peak, Proof, Range, TOLERANCE,
};
use crate::trajectory::{Extremum, Fourier, TorqueBound, certify};

/// Samples of a period for what is sampled, and the fewest stretches.
const SAMPLES: usize = 4000;
const STRETCHES: usize = 1000;
/// How often a stretch is halved, and what is missing before it is, as a part of the limit.
const DEPTH: u32 = 7;
const MISSING: f64 = 1e-3;

/// What is known of the limits of a closed chain.
#[derive(Debug, Clone, PartialEq)]
pub struct MechanismCertificate {
    /// the workspace box, coordinates of the platform as joints: exact where the series are theirs,
    /// else sampled with a stated bound
    pub platform: Certificate,
    /// the actuators
    pub actuators: Certificate,
    /// passive joints, singularities, distances
    pub pose: Vec<PosePeak>,
    /// how the kinematic limits of the actuators are known between the samples
    pub proof: Proof,
    /// whether every limit holds
    pub satisfied: bool,
}

impl MechanismCertificate {
    /// Whether the kinematic limits of the actuators are proven: by series of the actuators or by a
    /// closed form of the kinematics.
    pub fn proven(&self) -> bool {
        self.proof != Proof::Stated
    }
}

/// The worst of one limit of the pose over all time.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct PosePeak {
    /// what, see [`PoseUse`](super::PoseUse)
    pub name: String,
    /// which kind
    pub kind: PoseKind,
    /// its worst value at a sample: rad, dimensionless or m
    pub value: f64,
    /// when, s into the period
    pub time: f64,
    /// stated bound of it between the samples
    pub bound: f64,
    /// its limit: at most, of an angle; at least, of the others
    pub limit: f64,
    /// 1 at the limit, more beyond
    pub used: f64,
    /// whether the bound keeps the limit
    pub satisfied: bool,
}

/// Largest of the orders 0 (both signs) to 3 of an actuator so far: at a point of time, and bound.
#[derive(Clone, Copy)]
struct Reach {
    low: Extremum,
    high: Extremum,
    bounds: [f64; 2],
    peak: [Extremum; 3],
    bound: [f64; 3],
}

impl Reach {
    /// Against limits, without a torque.
    fn certificate(&self, joint: &str, limits: &Limits) -> JointCertificate {
        let peak = |k: usize, limit: f64| Peak::new(self.peak[k], self.bound[k], limit);
        JointCertificate {
            joint: joint.to_string(),
            position: Range::new(self.low, self.high, self.bounds, limits.position),
            velocity: peak(0, limits.velocity),
            acceleration: peak(1, limits.acceleration),
            jerk: peak(2, limits.jerk),
            torque: None,
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

/// Evaluates stretches of time.
struct Prover<'a> {
    mechanism: &'a Mechanism,
    fourier: &'a Fourier,
    /// `Σ_h (hω)ᵏ A_h` of each coordinate, `k = 0 … 6`
    sums: Vec<[f64; 7]>,
    /// middle and half of the position limits, and limits of velocity, acceleration and jerk
    limits: Vec<([f64; 2], [f64; 3])>,
    reach: Vec<Reach>,
}

impl Prover<'_> {
    /// Enclosures of the task coordinates over `c ± r`, Taylor coefficients.
    fn task(&self, c: f64, r: f64) -> Vec<Path> {
        let m = self.fourier.dof();
        let mut d = vec![0.0; 6 * m];
        let mut rows = d.chunks_exact_mut(m);
        let mut row = || rows.next().unwrap_or_default();
        self.fourier
            .evaluate(c, [row(), row(), row(), row(), row(), row()]);
        (0..m)
            .map(|j| {
                let sums = &self.sums[j];
                crate::mechanism::interval::Series(std::array::from_fn(|k| {
                    let here = d[k * m + j];
                    // evaluation is right to rounding of its amplitudes
                    let rounding = 1e-13 * (sums[k] + here.abs());
                    let radius = r * d[(k + 1) * m + j].abs() + 0.5 * r * r * sums[k + 2];
                    Interval::around(here, radius + rounding) * (1.0 / FACTORIAL[k])
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
        let time = c.rem_euclid(self.fourier.period);
        for (reach, (value, radius)) in self.reach.iter_mut().zip(found) {
            let at = |value: f64| Extremum { time, value };
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

/// Largest second difference of a cyclic sequence, doubled, over 8: what may be missing between
/// two samples.
fn missing(u: &[f64]) -> f64 {
    let n = u.len();
    let bend = |s: usize| (u[(s + 1) % n] - 2.0 * u[s] + u[(s + n - 1) % n]).abs();
    (0..n).map(bend).fold(0.0, f64::max) / 4.0
}

impl Mechanism {
    /// Judges a motion of the task coordinates against the workspace box and all limits of the
    /// actuators times `derate` (positions keep the middle of their range), and against passive joints,
    /// singularities and distances.
    ///
    /// # Errors
    /// A trajectory of another mechanism, or one that leaves the reach.
    pub fn certify(&self, fourier: &Fourier, derate: f64) -> Result<MechanismCertificate> {
        judge(self, fourier, derate)
    }
}

/// [`Mechanism::certify`].
fn judge(mechanism: &Mechanism, fourier: &Fourier, derate: f64) -> Result<MechanismCertificate> {
    let mut actuators = mechanism.actuator_robot();
    for joint in &mut actuators.joints {
        joint.limits = joint.limits.derated(derate);
    }
    let samples = fourier.motion(SAMPLES);
    let platform = platform_certificate(mechanism, fourier, &samples)?;
    let (kinematic, proof) = actuator_certificates(mechanism, fourier, &actuators, &samples)?;
    let mut ws = MechanismWorkspace::default();
    let n = samples.count;
    let na = mechanism.actuators();
    let (mut smooth, mut friction) = (vec![0.0; na * n], vec![0.0; na * n]);
    let (mut part, mut force) = (Samples::default(), Vec::new());
    for (from, to) in mechanism.chunks(n) {
        slice(&samples, from, to, &mut part);
        let count = part.count;
        mechanism.evaluate_motion(&mut ws, &part)?;
        mechanism.smooth_force(&mut ws, &mut force);
        for a in 0..na {
            let rows = a * n + from..a * n + to;
            smooth[rows.clone()].copy_from_slice(&force[a * count..(a + 1) * count]);
            let at = (na + a) * count;
            friction[rows].copy_from_slice(&force[at..at + count]);
        }
    }
    let step = fourier.period / n as f64;
    let joints = actuators
        .joints
        .iter()
        .enumerate()
        .map(|(a, joint)| {
            let tau = &smooth[a * n..(a + 1) * n];
            let coulomb = friction[a * n..(a + 1) * n]
                .iter()
                .copied()
                .fold(0.0, f64::max);
            let (mut at, mut most) = (0, 0.0);
            for (s, t) in tau.iter().enumerate() {
                if t.abs() > most {
                    (at, most) = (s, t.abs());
                }
            }
            let limit = joint.limits.effort;
            let limit = limit.is_finite().then_some(limit);
            let value = most + coulomb;
            JointCertificate {
                torque: Some(TorqueBound {
                    joint: joint.name.clone(),
                    max_on_grid: most,
                    time: at as f64 * step,
                    between_grid_bound: missing(tau),
                    coulomb,
                    samples: n,
                    limit,
                    used: limit.map(|l| value / l),
                    margin: limit.map(|l| l - value),
                }),
                ..kinematic[a].clone()
            }
        })
        .collect();
    let actuators = Certificate::new(joints);
    let poses = mechanism.platform_motion(&samples)?;
    let pose = pose_peaks(mechanism.platform(), &poses, step, derate);
    let satisfied = platform.satisfied && actuators.satisfied && pose.iter().all(|p| p.satisfied);
    Ok(MechanismCertificate {
        platform,
        actuators,
        pose,
        proof,
        satisfied,
    })
}

/// The workspace box. Exact where the series are those of the platform (or of the joints that the
/// box is about); otherwise sampled with the stated bound.
fn platform_certificate(
    mechanism: &Mechanism,
    fourier: &Fourier,
    samples: &Samples,
) -> Result<Certificate> {
    if mechanism.follows().is_none() {
        return certify(&mechanism.task_robot(), fourier);
    }
    let reach = sampled_reach(&*mechanism.platform_motion(samples)?, fourier.period);
    let joints = mechanism.platform().task_robot().joints;
    let all = reach.iter().zip(&joints);
    Ok(Certificate::new(
        all.map(|(r, joint)| r.certificate(&joint.name, &joint.limits))
            .collect(),
    ))
}

/// Position, velocity, acceleration and jerk of the actuators, and whether all of it is proven:
/// exact for those whose series is given, as for a serial robot.
fn actuator_certificates(
    mechanism: &Mechanism,
    fourier: &Fourier,
    actuators: &Robot,
    samples: &Samples,
) -> Result<(Vec<JointCertificate>, Proof)> {
    let given: Vec<Option<usize>> = (mechanism.actuated.iter())
        .map(|a| mechanism.task_joints().iter().position(|j| j == a))
        .collect();
    let (mut all, mut proof) = (Vec::new(), Proof::Exact);
    if given.contains(&None) {
        let (reach, enclosed) = actuator_reach(mechanism, fourier, actuators, samples)?;
        let each = reach.iter().zip(&actuators.joints);
        all.extend(each.map(|(r, joint)| r.certificate(&joint.name, &joint.limits)));
        proof = match enclosed {
            true => Proof::Enclosed,
            false => Proof::Stated,
        };
    }
    let mut moved = mechanism.task_robot();
    for (joint, k) in actuators.joints.iter().zip(&given) {
        if let Some(k) = *k {
            moved.joints[k] = joint.clone();
        }
    }
    let exact = certify(&moved, fourier)?.joints;
    for (a, k) in given.into_iter().enumerate() {
        match (k, all.get_mut(a)) {
            (Some(k), Some(own)) => *own = exact[k].clone(),
            (Some(k), None) => all.push(exact[k].clone()),
            (None, _) => {}
        }
    }
    Ok((all, proof))
}

/// What the actuators reach: proven where the kinematics has a closed form, else sampled with the
/// stated bound.
fn actuator_reach(
    mechanism: &Mechanism,
    fourier: &Fourier,
    actuators: &Robot,
    samples: &Samples,
) -> Result<(Vec<Reach>, bool)> {
    let omega = fourier.omega();
    let sums = fourier.joints.iter().map(|s| {
        std::array::from_fn(|k| s.amplitude_sum(&fourier.harmonics, omega, k as u32) * (1.0 + 1e-9))
    });
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
        fourier,
        sums: sums.collect(),
        limits: limits.collect(),
        reach: vec![Reach::default(); mechanism.actuators()],
    };
    let count = (40 * fourier.harmonic_max() as usize).clamp(STRETCHES, 20_000);
    let r = 0.5 * fourier.period / count as f64;
    let proven = (0..count)
        .try_for_each(|i| prover.stretch((2 * i + 1) as f64 * r, r, 0))
        .is_some();
    if proven {
        return Ok((prover.reach, true));
    }
    let motion = mechanism.motion(samples)?.tree;
    Ok((
        sampled_reach(&motion.rows(&mechanism.actuated), fourier.period),
        false,
    ))
}

/// What the rows of a cyclic motion reach at the samples, with the stated bound between them.
fn sampled_reach(motion: &Samples, period: f64) -> Vec<Reach> {
    let n = motion.count;
    let step = period / n as f64;
    (0..motion.dof)
        .map(|j| {
            let rows = j * n..(j + 1) * n;
            let (q, qd, qdd) = (
                &motion.q[rows.clone()],
                &motion.qd[rows.clone()],
                &motion.qdd[rows],
            );
            let jerk: Vec<f64> = (0..n)
                .map(|s| (qdd[(s + 1) % n] - qdd[(s + n - 1) % n]) / (2.0 * step))
                .collect();
            let mut reach = Reach::default();
            let extremum = |u: &[f64], sign: f64| {
                let mut best = Extremum {
                    time: 0.0,
                    value: f64::NEG_INFINITY,
                };
                for (s, v) in u.iter().enumerate() {
                    if sign * v > best.value {
                        best = Extremum {
                            time: s as f64 * step,
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
            reach.bounds = [reach.low.value - missing(q), reach.high.value + missing(q)];
            for (k, u) in [qd, qdd, &jerk].into_iter().enumerate() {
                let (a, b) = (extremum(u, 1.0), extremum(u, -1.0));
                reach.peak[k] = if a.value > b.value { a } else { b };
                reach.bound[k] = reach.peak[k].value + missing(u);
            }
            reach
        })
        .collect()
}

/// Passive joints, singularities and distances at the samples, with the stated bound between them.
fn pose_peaks(mechanism: &Mechanism, samples: &Samples, step: f64, derate: f64) -> Vec<PosePeak> {
    let pairs = mechanism.pairs();
    let n = samples.count;
    let mut x = vec![0.0; samples.dof];
    let mut along: Vec<Vec<f64>> = Vec::new();
    let mut first = Vec::new();
    for s in 0..n {
        for (k, x) in x.iter_mut().enumerate() {
            *x = samples.q[k * n + s];
        }
        let uses = mechanism.pose_uses(&x, &pairs);
        if along.is_empty() {
            along = vec![Vec::with_capacity(n); uses.len()];
        }
        for (a, u) in along.iter_mut().zip(&uses) {
            a.push(u.value);
        }
        if s == 0 {
            first = uses;
        }
    }
    first
        .into_iter()
        .zip(along)
        .map(|(u, values)| {
            // angles are limited from above, the others from below
            let sign = match u.kind {
                PoseKind::PassiveJoint => 1.0,
                _ => -1.0,
            };
            let (mut at, mut worst) = (0, f64::NEG_INFINITY);
            for (s, v) in values.iter().enumerate() {
                if sign * v > worst {
                    (at, worst) = (s, sign * v);
                }
            }
            let value = sign * worst;
            let bound = value + sign * missing(&values);
            let limit = match u.kind {
                PoseKind::PassiveJoint => u.limit * derate,
                _ => u.limit / derate,
            };
            let used = |v: f64| match u.kind {
                PoseKind::PassiveJoint => v / limit,
                _ => limit / v.max(1e-12),
            };
            PosePeak {
                name: u.name,
                kind: u.kind,
                value,
                time: at as f64 * step,
                bound,
                limit,
                used: used(value),
                satisfied: used(bound) <= 1.0 + TOLERANCE,
            }
        })
        .collect()
}
