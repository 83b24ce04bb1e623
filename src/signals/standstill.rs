//! When a joint stands still.
//!
//! The torque of a joint at rest differs from that of the rigid bodies by any friction up to the break-away
//! value, and by whatever pushes it; the sign of what little velocity the noise of the position makes says
//! nothing. A joint stands where it is slower than three standard deviations of its velocity, or than a thousandth
//! of its fastest, and in all of a record in which it moves by less than half a degree or half a millimetre: an arm
//! that is held and pushed gives by that much. A reversal is slow for a moment only; [`lasting`] keeps it.

use crate::extremes::extremes;
use crate::robot::Motion;

/// Standard deviations of the velocity within which a joint may stand still.
const SIGMAS: f64 = 3.0;
/// Fraction of its fastest velocity below which a joint counts as standing.
const SLOW: f64 = 1e-3;
/// Travel in a record, beyond the noise, below which a joint is held: half a degree, rad, and half a millimetre, m.
const HELD: [f64; 2] = [0.0087, 0.5e-3];
/// Standard deviations of a position that noise may add to its travel to either side.
const SCATTER: f64 = 3.0;
/// Time over more than half of which a joint must be slow to stand, s.
const LASTING: f64 = 0.5;

/// What tells that a joint stands: standard deviations of its position and velocity, and how it moves.
#[derive(Debug, Clone, Copy)]
pub struct Joint {
    /// standard deviation of its position, rad or m
    pub position_noise: f64,
    /// standard deviation of its velocity, rad/s or m/s
    pub velocity_noise: f64,
    /// whether it turns or slides
    pub motion: Motion,
}

/// Whether a joint is so slow that it may stand, sample by sample, from its position and velocity in one record.
pub fn slow(joint: Joint, q: &[f64], v: &[f64]) -> Vec<bool> {
    let [low, high] = extremes(q);
    let held = match joint.motion {
        Motion::Revolute => HELD[0],
        Motion::Prismatic => HELD[1],
    };
    if high - low - 2.0 * SCATTER * joint.position_noise < held {
        return vec![true; v.len()];
    }
    let [back, forth] = extremes(v);
    let fastest = back.abs().max(forth.abs());
    let least = (SIGMAS * joint.velocity_noise).max(SLOW * fastest);
    v.iter().map(|x| x.abs() <= least).collect()
}

/// Samples about which a joint is slow for more than half of half a second; `dt` is the time between two.
pub fn lasting(slow: &[bool], dt: f64) -> Vec<bool> {
    let half = ((0.5 * LASTING / dt).round() as usize).max(1);
    let mut sums = Vec::with_capacity(slow.len() + 1);
    sums.push(0usize);
    for s in slow {
        sums.push(sums[sums.len() - 1] + usize::from(*s));
    }
    let count = slow.len();
    let stands = |i: usize| {
        let (from, to) = (i.saturating_sub(half), (i + half + 1).min(count));
        slow[i] && 2 * (sums[to] - sums[from]) > to - from
    };
    (0..count).map(stands).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const JOINT: Joint = Joint {
        position_noise: 1e-5,
        velocity_noise: 1e-4,
        motion: Motion::Revolute,
    };

    /// Position and velocity every 10 ms.
    fn motion(count: usize, f: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<f64>) {
        let t = |i: usize| i as f64 * 0.01;
        let q: Vec<f64> = (0..count).map(|i| f(t(i))).collect();
        let v = (0..count).map(|i| (f(t(i) + 1e-4) - f(t(i) - 1e-4)) / 2e-4);
        let v = v.collect();
        (q, v)
    }

    #[test]
    fn head_and_tail_stand_and_reversals_do_not() {
        let (q, v) = motion(1000, |t| match t {
            t if t < 2.0 => 0.3,
            t if t < 8.0 => 0.3 + 0.4 * (1.0 - (std::f64::consts::PI * (t - 2.0)).cos()),
            _ => 0.3,
        });
        let stands = lasting(&slow(JOINT, &q, &v), 0.01);
        assert!(stands[..198].iter().all(|s| *s) && stands[802..].iter().all(|s| *s));
        assert!(
            stands[205..795].iter().all(|s| !*s),
            "a reversal is no rest"
        );
    }

    #[test]
    fn an_arm_that_is_pushed_stands() {
        // 0.15 degrees, as a person pushes a robot that holds its place
        let (q, v) = motion(1000, |t| 0.0026 * (0.7 * t).sin());
        assert!(slow(JOINT, &q, &v).iter().all(|s| *s));
        // the same speed over a longer way is motion
        let (q, v) = motion(4000, |t| 0.0026 * 7.0 * (0.1 * t).sin());
        let stands = lasting(&slow(JOINT, &q, &v), 0.01);
        assert!(stands.iter().filter(|s| **s).count() < 400);
    }

    #[test]
    fn a_coarse_encoder_does_not_make_a_joint_move() {
        let rough = Joint {
            position_noise: 4.4e-4,
            velocity_noise: 1e-2,
            motion: Motion::Revolute,
        };
        let (q, v) = motion(500, |t| 0.001 * (40.0 * t).sin());
        assert!(slow(rough, &q, &v).iter().all(|s| *s));
    }
}
