//! What a closed chain does along a motion that is smooth in stretches, a move for example, against its limits.
//!
//! As in the [certificate](super::certificate) of a periodic motion: positions, velocities, accelerations and jerks of the
//! actuators are proven where the kinematics has a closed form; forces, opening angles, singular values, distances and a
//! platform that follows are sampled, with the stated bound of [`smooth`](super::smooth). Coordinates are the caller's.

use super::Mechanism;
use super::certificate::{PosePeak, forces, pose_peaks};
use super::reach::{Enclosure, Reach, proven, sampled_reach};
use super::smooth::Smooth;
use crate::dynamics::Samples;
use crate::error::Result;
use crate::robot::{Joint, Limits};
use crate::trajectory::TorqueBound;
use crate::trajectory::certificate::{JointCertificate, Proof};

/// Stretches of time that are enclosed one by one, at least.
const ENCLOSED: f64 = 400.0;

/// What a motion reaches, for all time.
#[derive(Clone)]
pub(crate) struct Reached {
    /// what follows from the coordinates: the platform's box where the actuators are the coordinates, otherwise the actuators
    pub led: Vec<(Joint, Reach)>,
    /// forces of the actuators
    pub forces: Vec<TorqueBound>,
    /// passive joints, singularities, distances
    pub pose: Vec<PosePeak>,
    /// how these joints are known
    pub proof: Proof,
}

impl Reached {
    /// The larger of both.
    pub fn or(mut self, other: Reached) -> Self {
        let led = self.led.into_iter().zip(&other.led);
        self.led = led.map(|((j, a), (_, b))| (j, a.or(b))).collect();
        for (own, new) in self.forces.iter_mut().zip(other.forces) {
            if new.bound() > own.bound() {
                *own = new;
            }
        }
        for (own, new) in self.pose.iter_mut().zip(other.pose) {
            if new.bound_used() > own.bound_used() {
                *own = new;
            }
        }
        self.proof = self.proof.max(other.proof);
        self
    }

    /// The same, begun so many seconds later.
    pub fn later(mut self, seconds: f64) -> Self {
        let led = self.led.into_iter();
        self.led = led.map(|(j, r)| (j, r.later(seconds))).collect();
        self.forces.iter_mut().for_each(|f| f.time += seconds);
        self.pose.iter_mut().for_each(|p| p.time += seconds);
        self
    }

    /// The joints that follow, against a share of their limits of velocity, acceleration and jerk.
    pub fn certificates(&self, share: f64) -> Vec<JointCertificate> {
        let one = |(joint, reach): &(Joint, Reach)| {
            let own = joint.limits;
            let limits = Limits {
                velocity: share * own.velocity,
                acceleration: share * own.acceleration,
                jerk: share * own.jerk,
                ..own
            };
            reach.certificate(&joint.name, &limits)
        };
        self.led.iter().map(one).collect()
    }
}

impl Mechanism {
    /// What a motion reaches: `samples` of it, smooth in `smooth`, with `task` the coordinates over `c ± r`.
    ///
    /// # Errors
    /// A motion that leaves the reach.
    pub(crate) fn reached(
        &self,
        samples: &Samples,
        smooth: &Smooth,
        task: &dyn Fn(f64, f64) -> Vec<Enclosure>,
    ) -> Result<Reached> {
        let actuators = self.actuator_robot();
        let poses = self.platform_motion(samples)?;
        let sampled = |joints: &[usize]| -> Result<Vec<Reach>> {
            let tree = self.motion(samples)?.tree;
            Ok(sampled_reach(&tree.rows(joints), smooth))
        };
        let given = self.task_joints();
        let (joints, reach, proof) = if let Some(platform) = self.follows() {
            let box_of = platform.task_robot().joints;
            (box_of, sampled_reach(&poses, smooth), Proof::Stated)
        } else if given.is_empty() {
            let proven = proven(self, task, &actuators, pieces(smooth).into_iter());
            let (reach, proof) = match proven {
                Some(reach) => (reach, Proof::Enclosed),
                None => (sampled(&self.actuated)?, Proof::Stated),
            };
            (actuators.joints.clone(), reach, proof)
        } else {
            let free = self.actuated.iter().copied();
            let free: Vec<usize> = free.filter(|a| !given.contains(a)).collect();
            let joints = free.iter().map(|&a| self.robot.joints[a].clone());
            match free.is_empty() {
                true => (Vec::new(), Vec::new(), Proof::Exact),
                false => (joints.collect(), sampled(&free)?, Proof::Stated),
            }
        };
        Ok(Reached {
            led: joints.into_iter().zip(reach).collect(),
            forces: forces(self, &actuators, samples, smooth)?,
            pose: pose_peaks(self.platform(), &poses, smooth, 1.0),
            proof,
        })
    }
}

/// Stretches `c ± r` that together cover all of a motion.
fn pieces(smooth: &Smooth) -> Vec<(f64, f64)> {
    let Smooth::Stretches(all) = smooth else {
        return Vec::new();
    };
    let length = |s: &super::smooth::Stretch| (s.samples.len() - 1) as f64 * s.step;
    let total: f64 = all.iter().map(length).sum();
    let each = all.iter().flat_map(|s| {
        let count = (ENCLOSED * length(s) / total).ceil().max(1.0);
        let r = 0.5 * length(s) / count;
        let start = s.start;
        (0..count as usize).map(move |i| (start + (2 * i + 1) as f64 * r, r))
    });
    each.collect()
}
