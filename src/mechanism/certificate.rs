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

use super::margins::PoseKind;
use super::motion::slice;
use super::reach::{actuator_reach, sampled_reach};
use super::smooth::Smooth;
use super::{Mechanism, MechanismWorkspace};
use crate::dynamics::Samples;
use crate::error::Result;
use crate::robot::Robot;
use crate::trajectory::bounds::TOLERANCE;
use crate::trajectory::certificate::{Certificate, JointCertificate, Proof};
use crate::trajectory::{Fourier, TorqueBound, certify};

/// Samples of a period for what is sampled.
const SAMPLES: usize = 4000;

/// What is known of the limits of a closed chain.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
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

impl PosePeak {
    /// Share of the limit that the bound uses; 1 at the limit.
    pub(crate) fn bound_used(&self) -> f64 {
        self.kind.used(self.bound, self.limit)
    }
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
    let smooth = Smooth::Period(fourier.period / samples.count as f64);
    let platform = platform_certificate(mechanism, fourier, &samples, &smooth)?;
    let (kinematic, proof) = actuator_certificates(mechanism, fourier, &actuators, &samples)?;
    let forces = forces(mechanism, &actuators, &samples, &smooth)?;
    let joints = kinematic.into_iter().zip(forces);
    let joints = joints.map(|(own, force)| JointCertificate {
        torque: Some(force),
        ..own
    });
    let actuators = Certificate::new(joints.collect());
    let poses = mechanism.platform_motion(&samples)?;
    let pose = pose_peaks(mechanism.platform(), &poses, &smooth, derate);
    let satisfied = platform.satisfied && actuators.satisfied && pose.iter().all(|p| p.satisfied);
    Ok(MechanismCertificate {
        platform,
        actuators,
        pose,
        proof,
        satisfied,
    })
}

/// Forces of the actuators at the samples, with the stated bound between them.
pub(super) fn forces(
    mechanism: &Mechanism,
    actuators: &Robot,
    samples: &Samples,
    smooth: &Smooth,
) -> Result<Vec<TorqueBound>> {
    let mut ws = MechanismWorkspace::default();
    let n = samples.count;
    let na = mechanism.actuators();
    let (mut rest, mut friction) = (vec![0.0; na * n], vec![0.0; na * n]);
    let (mut part, mut force) = (Samples::default(), Vec::new());
    for (from, to) in mechanism.chunks(n) {
        slice(samples, from, to, &mut part);
        let count = part.count;
        mechanism.evaluate_motion(&mut ws, &part)?;
        mechanism.smooth_force(&mut ws, &mut force);
        for a in 0..na {
            let rows = a * n + from..a * n + to;
            rest[rows.clone()].copy_from_slice(&force[a * count..(a + 1) * count]);
            let at = (na + a) * count;
            friction[rows].copy_from_slice(&force[at..at + count]);
        }
    }
    let each = actuators.joints.iter().enumerate();
    Ok(each
        .map(|(a, joint)| {
            let tau = &rest[a * n..(a + 1) * n];
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
            TorqueBound {
                joint: joint.name.clone(),
                max_on_grid: most,
                time: smooth.time(at),
                between_grid_bound: smooth.missing(tau),
                coulomb,
                samples: n,
                limit,
                used: limit.map(|l| value / l),
                margin: limit.map(|l| l - value),
            }
        })
        .collect())
}

/// The workspace box. Exact where the series are those of the platform (or of the joints that the
/// box is about); otherwise sampled with the stated bound.
fn platform_certificate(
    mechanism: &Mechanism,
    fourier: &Fourier,
    samples: &Samples,
    smooth: &Smooth,
) -> Result<Certificate> {
    if mechanism.follows().is_none() {
        return certify(&mechanism.task_robot(), fourier);
    }
    let reach = sampled_reach(&*mechanism.platform_motion(samples)?, smooth);
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

/// Passive joints, singularities and distances at the samples, with the stated bound between them.
pub(super) fn pose_peaks(
    mechanism: &Mechanism,
    samples: &Samples,
    smooth: &Smooth,
    derate: f64,
) -> Vec<PosePeak> {
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
            let bound = value + sign * smooth.missing(&values);
            let limit = match u.kind {
                PoseKind::PassiveJoint => u.limit * derate,
                _ => u.limit / derate,
            };
            let used = |v: f64| u.kind.used(v, limit);
            PosePeak {
                name: u.name,
                kind: u.kind,
                value,
                time: smooth.time(at),
                bound,
                limit,
                used: used(value),
                satisfied: used(bound) <= 1.0 + TOLERANCE,
            }
        })
        .collect()
}
