//! Random states that a regressor is judged at.

use crate::dynamics::Samples;
use crate::robot::Robot;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Random states inside the limits (±π, 2 rad/s, 10 rad/s² or the like where there are none),
/// uniform, from a fixed stream.
pub fn random_states(robot: &Robot, count: usize, seed: u64) -> Samples {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut s = Samples::zeros(robot.dof(), count);
    for (j, joint) in robot.joints.iter().enumerate() {
        let ([low, high], reach) = (joint.range(), joint.free_reach());
        let (middle, half) = (0.5 * (low + high), (0.5 * (high - low)).clamp(1e-3, reach));
        let finite = |x: f64, other: f64| if x.is_finite() && x > 0.0 { x } else { other };
        let v = finite(joint.limits.velocity, 2.0).min(100.0);
        let a = finite(joint.limits.acceleration, 10.0).min(1000.0);
        for i in 0..count {
            let k = j * count + i;
            s.q[k] = middle + half * rng.random_range(-1.0..1.0);
            s.qd[k] = v * rng.random_range(-1.0..1.0);
            s.qdd[k] = a * rng.random_range(-1.0..1.0);
        }
    }
    s
}

/// The same robot with equal limits of velocity and acceleration for all joints.
pub(super) fn equally_fast(robot: &Robot) -> Robot {
    let mut robot = robot.clone();
    for joint in &mut robot.joints {
        joint.limits.velocity = f64::INFINITY;
        joint.limits.acceleration = f64::INFINITY;
    }
    robot
}
