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
use crate::robot::Joint;
use crate::trajectory::TorqueBound;
use crate::trajectory::certificate::{JointCertificate, Proof};

/// Stretches of time that are enclosed one by one, at least.
const ENCLOSED: f64 = 400.0;

/// What a motion reaches, for all time.
#[derive(Clone)]
pub(crate) struct Reached {
    /// the joints of [`Mechanism::led`]
    pub led: Vec<Reach>,
    /// forces of the actuators
    pub forces: Vec<TorqueBound>,
    /// passive joints, singularities, distances
    pub pose: Vec<PosePeak>,
    /// how the joints of [`Mechanism::led`] are known
    pub proof: Proof,
}

impl Reached {
    /// The larger of both.
    pub fn or(mut self, other: Reached) -> Self {
        let led = self.led.into_iter().zip(&other.led);
        self.led = led.map(|(a, b)| a.or(b)).collect();
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
        self.led = self.led.into_iter().map(|r| r.later(seconds)).collect();
        self.forces.iter_mut().for_each(|f| f.time += seconds);
        self.pose.iter_mut().for_each(|p| p.time += seconds);
        self
    }

    /// The joints of [`Mechanism::led`] against limits.
    pub fn certificates(&self, led: &[Joint]) -> Vec<JointCertificate> {
        let each = led.iter().zip(&self.led);
        each.map(|(joint, reach)| reach.certificate(&joint.name, &joint.limits))
            .collect()
    }
}

impl Mechanism {
    /// What follows from the coordinates and has limits of position and rates: the platform's box where the actuators are
    /// the coordinates, otherwise the actuators.
    pub(crate) fn led(&self) -> Vec<Joint> {
        match (self.follows(), self.task_joints().is_empty()) {
            (Some(platform), _) => platform.task_robot().joints,
            (None, true) => self.actuator_robot().joints,
            (None, false) => {
                let given = self.task_joints();
                let free = self.actuated.iter().filter(|a| !given.contains(a));
                free.map(|&a| self.robot.joints[a].clone()).collect()
            }
        }
    }

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
        let (led, proof) = match (self.follows(), self.task_joints().is_empty()) {
            (Some(_), _) => (sampled_reach(&poses, smooth), Proof::Stated),
            (None, true) => match proven(self, task, &actuators, pieces(smooth).into_iter()) {
                Some(reach) => (reach, Proof::Enclosed),
                None => {
                    let tree = self.motion(samples)?.tree;
                    (
                        sampled_reach(&tree.rows(&self.actuated), smooth),
                        Proof::Stated,
                    )
                }
            },
            (None, false) => {
                let given = self.task_joints();
                let free: Vec<usize> = (self.actuated.iter().copied())
                    .filter(|a| !given.contains(a))
                    .collect();
                match free.is_empty() {
                    true => (Vec::new(), Proof::Exact),
                    false => {
                        let tree = self.motion(samples)?.tree;
                        (sampled_reach(&tree.rows(&free), smooth), Proof::Stated)
                    }
                }
            }
        };
        Ok(Reached {
            led,
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
