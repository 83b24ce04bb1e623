//! What a leg of a parallel robot asks between its samples, stretch by stretch in which every jerk is constant.
//!
//! The actuators' motion is proven where the kinematics has a closed form. Forces and the limits of the pose are sampled,
//! with a stated bound: see [`stretches`](crate::mechanism::stretches).

use super::leg::Leg;
use super::most::Most;
use crate::error::Result;
use crate::mechanism::smooth::{Smooth, Stretch};
use crate::mechanism::stretches::Reached;
use crate::mechanism::{Mechanism, PosePeak};
use crate::trajectory::certificate::{JointCertificate, Proof};

/// Samples of a leg, at least, and of each stretch of it.
const SAMPLES: f64 = 2000.0;
const FEWEST: f64 = 16.0;

/// What a move of a parallel robot exceeds at no time.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct ClosedPeaks {
    /// the actuators; where they are the coordinates, the platform's box
    pub joints: Vec<JointCertificate>,
    /// how these are known between the samples
    pub proof: Proof,
    /// passive joints, singularities, distances: sampled, with a stated bound
    pub pose: Vec<PosePeak>,
}

impl From<Reached> for ClosedPeaks {
    fn from(found: Reached) -> Self {
        ClosedPeaks {
            joints: found.certificates(1.0),
            proof: found.proof,
            pose: found.pose,
        }
    }
}

/// What a leg reaches.
///
/// # Errors
/// A leg that leaves the reach.
pub fn reached(mechanism: &Mechanism, leg: &Leg) -> Result<Reached> {
    let times = leg.instants(Vec::new());
    let total = leg.duration.max(1e-9);
    let (mut at, mut stretches) = (Vec::new(), Vec::new());
    for ends in times.windows(2) {
        let length = ends[1] - ends[0];
        let count = (SAMPLES * length / total).ceil().max(FEWEST) as usize;
        let step = length / count as f64;
        stretches.push(Stretch {
            samples: at.len()..at.len() + count + 1,
            start: ends[0],
            step,
        });
        at.extend((0..=count).map(|i| ends[0] + i as f64 * step));
    }
    let task = |c: f64, r: f64| {
        let profiles = leg.profiles.iter();
        profiles.map(|p| p.enclosure(c, r)).collect()
    };
    mechanism.reached(&leg.samples(&at), &Smooth::Stretches(stretches), &task)
}

/// Raises the limit that is used most by what a leg reaches, `share` of those of velocity, acceleration and jerk being allowed.
pub fn offer(out: &mut Most, found: &Reached, share: f64) {
    for joint in found.certificates(share) {
        let [low, high] = joint.position.bounds;
        if let (Some(least), Some(largest)) = (joint.position.lower, joint.position.upper) {
            let (middle, half) = (0.5 * (least + largest), 0.5 * (largest - least));
            let used = (high - middle).max(middle - low) / half;
            out.offer(used, || {
                format!(
                    "position of {}: up to [{low:.4}, {high:.4}], its limits are [{least}, {largest}]",
                    joint.joint
                )
            });
        }
        let rates = [
            ("velocity", joint.velocity),
            ("acceleration", joint.acceleration),
            ("jerk", joint.jerk),
        ];
        for (what, peak) in rates {
            let limit = peak.limit.unwrap_or(f64::INFINITY);
            out.offer(peak.bound / limit, || {
                format!(
                    "{what} of {}: up to {:.4} of {limit:.4}",
                    joint.joint, peak.bound
                )
            });
        }
    }
    for pose in &found.pose {
        out.offer(pose.bound_used(), || {
            format!("{}: {:.4} of {:.4}", pose.name, pose.bound, pose.limit)
        });
    }
}
