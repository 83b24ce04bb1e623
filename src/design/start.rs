//! Feasible random starts.

use super::information::Information;
use super::limits::{ExtremaWork, Limits};
use super::torque::TorqueLimits;
use crate::dynamics::Samples;
use crate::robot::{Motion, Robot};
use crate::trajectory::Basis;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Size of a unit step of each joint in `x`: the amplitude that the position range or the
/// velocity limit allows at the base frequency, whichever is less.
pub fn scales(robot: &Robot, period: f64) -> Vec<f64> {
    let omega = std::f64::consts::TAU / period;
    robot
        .joints
        .iter()
        .map(|j| {
            let [low, high] = j.limits.position;
            let free = if j.motion == Motion::Revolute {
                std::f64::consts::PI
            } else {
                0.5
            };
            let half = 0.5 * (high - low);
            let half = if half.is_finite() {
                half.min(2.0 * free)
            } else {
                free
            };
            half.min(j.limits.velocity / omega).max(1e-6)
        })
        .collect()
}

/// A random trajectory inside the limits, made from its own stream of random numbers.
///
/// Amplitudes are drawn with falling weight in the harmonic, the middle of the motion near the
/// middle of the range, and the motion of each joint is scaled up to the limit that it meets
/// first, times a random factor; then all joints are shrunk until the torques fit. `None` where
/// they do not fit even at rest there.
pub fn random(
    robot: &Robot,
    basis: &Basis,
    info: &Information,
    limits: &Limits,
    torque: Option<&TorqueLimits>,
    scale: &[f64],
    seed: u64,
) -> Option<Vec<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (m, h) = (basis.free(), basis.harmonics.len());
    let mut work = ExtremaWork::default();
    let mut x = vec![0.0; info.len()];
    let mut centre = vec![0.0; info.len()];
    for (j, joint) in robot.joints.iter().enumerate() {
        let half = match joint.limits.position {
            [low, high] if high - low < f64::INFINITY => 0.5 * (high - low),
            _ => scale[j],
        };
        let rest = limits.rest_parameters(j);
        let mut c = vec![0.0; 2 * h + 1];
        c[0] = limits.rest(j) + half * rng.random_range(-0.3..0.3);
        for k in 0..h {
            let weight = 1.0 / f64::from(basis.harmonics[k]).sqrt();
            for at in [1 + k, 1 + h + k] {
                c[at] = scale[j] * weight * rng.random_range(-1.0..1.0);
            }
        }
        let full = basis.parameters(j, &c);
        // the multiple of the motion about its rest that touches a limit, times a random factor
        let gauge = limits.gauge(j, full.as_slice(), &mut work);
        let factor = rng.random_range(0.6..0.98) / gauge.max(1e-9);
        for k in 0..m {
            centre[j * m + k] = rest[k];
            x[j * m + k] = rest[k] + factor * (full[k] - rest[k]);
        }
    }
    if let Some(t) = torque {
        let (mut motion, mut ws, mut tau) = (Samples::default(), Default::default(), Vec::new());
        let mut f = 1.0;
        for attempt in 0..40 {
            let trial: Vec<f64> = x
                .iter()
                .zip(&centre)
                .map(|(x, c)| c + f * (x - c))
                .collect();
            info.sample(&trial, &mut motion);
            t.torques(info, &motion, &mut ws, &mut tau);
            if t.worst(&tau).0 <= 1.0 {
                return Some(trial);
            }
            f = if attempt == 38 { 0.0 } else { f * 0.85 };
        }
        return None;
    }
    Some(x)
}
