//! The robot's kinematics with its errors.

use super::feature::{Feature, Rate};
use super::frame::Frame;
use super::parallel::Parallel;
use super::serial::{Arm, Posed};
use super::unknown::Unknown;
use crate::error::Result;
use crate::robot::Motion;

/// The robot's kinematics with its errors.
#[derive(Debug)]
pub enum Kin {
    /// a chain of joints
    Arm(Arm),
    /// a platform on several chains
    Parallel(Box<Parallel>),
}

impl Kin {
    /// Geometric unknowns.
    pub fn unknowns(&self, tolerance: [f64; 2]) -> Vec<Unknown> {
        match self {
            Kin::Arm(arm) => arm.unknowns(tolerance),
            Kin::Parallel(p) => p.unknowns(tolerance),
        }
    }

    /// Number of geometric unknowns.
    pub fn errors(&self) -> usize {
        match self {
            Kin::Arm(arm) => arm.errors(),
            Kin::Parallel(p) => p.errors(),
        }
    }

    /// Kinds of the joints that are measured.
    pub fn motions(&self, joints: usize) -> Vec<Motion> {
        let mut all = vec![Motion::Revolute; joints];
        match self {
            Kin::Arm(arm) => {
                for l in &arm.links {
                    all[l.coordinate] = l.body.motion;
                }
            }
            Kin::Parallel(p) => {
                for (motion, &a) in all.iter_mut().zip(&p.mechanism.actuated) {
                    *motion = p.mechanism.robot.joints[a].motion;
                }
            }
        }
        all
    }

    /// Pose with nominal geometry.
    ///
    /// # Errors
    /// Joint readings that no pose gives.
    pub fn nominal(&self, q: &[f64]) -> Result<Frame> {
        match self {
            Kin::Arm(arm) => Ok(arm.pose(0, q, &vec![0.0; arm.errors()], &[], &[]).frame),
            Kin::Parallel(p) => p.nominal(q),
        }
    }

    /// Nominal pose of the second arm's frame; `None` of robots that have none.
    pub fn nominal_other(&self, q: &[f64]) -> Option<Frame> {
        let none = vec![0.0; self.errors()];
        Some(self.other(q, &none, &[], &[])?.frame)
    }

    /// Pose and Jacobian of the second arm's frame; `None` of robots that have none.
    pub fn other(
        &self,
        q: &[f64],
        x: &[f64],
        features: &[Feature],
        rate: &[Rate],
    ) -> Option<Posed> {
        match self {
            Kin::Arm(arm) if arm.ends.len() > 1 => Some(arm.pose(1, q, x, features, rate)),
            _ => None,
        }
    }

    /// Pose and Jacobian.
    ///
    /// # Errors
    /// Joint readings that no pose gives.
    pub fn pose(
        &self,
        q: &[f64],
        x: &[f64],
        features: &[Feature],
        rate: &[Rate],
        near: Option<&Frame>,
    ) -> Result<Posed> {
        match self {
            Kin::Arm(arm) => Ok(arm.pose(0, q, x, features, rate)),
            Kin::Parallel(p) => match near {
                Some(near) => p.pose(q, x, features, rate, near),
                None => p.pose(q, x, features, rate, &p.nominal(q)?),
            },
        }
    }
}
