//! Angles that jump by a whole turn at the ends of their range, as encoders and some controllers report them: Kinova's Kortex
//! from 0° to 360°, drivers of ROS from −π to π.
//!
//! With the steps `d_i = y_{i+1} − y_i` and `r_i = d_i − P round(d_i/P)`, a step of more than half a turn `P` is a jump of the
//! count and no motion where `r_i` is like the steps beside it:
//!
//! ```text
//! |r_i| ≤ min(4 max(|r_{i−1}|, |r_{i+1}|) + P/500, P/4)
//! ```
//!
//! A signal in which one such step is no jump is no angle that wraps.

use crate::robot::{Joint, Motion};
use std::f64::consts::TAU;

/// How much larger the step of the angle at a jump may be than those beside it.
const LARGER: f64 = 4.0;
/// Steps that say nothing, in turns.
const STILL: f64 = 0.002;
/// Step of an angle at a jump at the most, in turns.
const FASTEST: f64 = 0.25;
/// What an angle that wraps covers at the least, in turns, and what at the most.
const RANGE: [f64; 2] = [0.9, 1.02];
/// Part of the width of its limits by which a joint may exceed them, and at most in turns.
const SLACK: [f64; 2] = [0.02, 0.02];
/// Angles beyond so many turns are no angles of a joint in another turn, but in another unit.
const FARTHEST: f64 = 2.0;

/// Whether a signal with this smallest and largest value may be an angle that wraps.
pub(crate) fn may_wrap([low, high]: [f64; 2], turn: f64) -> bool {
    (RANGE[0] * turn..=RANGE[1] * turn).contains(&(high - low))
}

/// Makes an angle continuous that wraps at a `turn`, with its first value within half a turn of zero. Returns how often it
/// jumps, and the first value after a jump; nothing where it does not wrap. Values that are not finite are passed over.
pub(crate) fn unwrap(y: &mut [f64], turn: f64) -> Option<(usize, usize)> {
    let at: Vec<usize> = (0..y.len()).filter(|i| y[*i].is_finite()).collect();
    let step = |k: usize| y[at[k + 1]] - y[at[k]];
    let rest = |k: usize| {
        let d = step(k);
        d - turn * (d / turn).round()
    };
    let last = at.len().saturating_sub(1);
    let jumps: Vec<usize> = (0..last).filter(|k| step(*k).abs() > 0.5 * turn).collect();
    let like_motion = |k: &usize| {
        let before = k.checked_sub(1).map_or(0.0, |k| rest(k).abs());
        let after = match k + 1 < last {
            true => rest(k + 1).abs(),
            false => 0.0,
        };
        rest(*k).abs() <= (LARGER * before.max(after) + STILL * turn).min(FASTEST * turn)
    };
    let first = at[*jumps.first()? + 1];
    if !jumps.iter().all(like_motion) {
        return None;
    }
    let mut by = -turn * (y[at[0]] / turn).round();
    let mut jumps_left = jumps.iter().map(|k| at[k + 1]).peekable();
    let mut before = f64::NAN;
    for (i, y) in y.iter_mut().enumerate() {
        let read = *y;
        if jumps_left.next_if_eq(&i).is_some() {
            by -= turn * ((read - before) / turn).round();
        }
        if read.is_finite() {
            before = read;
        }
        *y = read + by;
    }
    Some((jumps.len(), first))
}

/// Whole turns to add to positions of a joint in this range that lie beyond its limits, and within them so; 0 where they lie
/// within them as they are or not in any turn, and for a joint that slides.
pub(crate) fn to_add(joint: &Joint, range: [f64; 2]) -> f64 {
    match joint.motion {
        Motion::Revolute => into_limits(range, joint.limits.position, TAU),
        _ => 0.0,
    }
}

fn into_limits([low, high]: [f64; 2], limits: [f64; 2], turn: f64) -> f64 {
    let width = limits[1] - limits[0];
    let slack = (SLACK[0] * width).min(SLACK[1] * turn);
    let fits = |k: f64| low + k * turn >= limits[0] - slack && high + k * turn <= limits[1] + slack;
    if !width.is_finite() || fits(0.0) || low.abs().max(high.abs()) > FARTHEST * turn {
        return 0.0;
    }
    let k = (0.5 * (limits[0] + limits[1] - low - high) / turn).round();
    if fits(k) { k } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wrapped(y: &[f64], from: f64) -> Vec<f64> {
        y.iter()
            .map(|x| from + (x - from).rem_euclid(TAU))
            .collect()
    }

    /// Motions that pass the ends of the range come back as they were, with noise and missing values, but for whole turns.
    #[test]
    fn an_angle_that_wraps_is_made_continuous() {
        for (start, from) in [(0.0, 0.0), (3.0, -0.5 * TAU), (-2.9, 0.0), (5.0, 0.0)] {
            let noise = |i: usize| 2e-3 * (7.9 * i as f64).sin();
            let motion = |i: usize| start + 3.5 * (0.01 * i as f64).sin() + noise(i);
            let y: Vec<f64> = (0..2000).map(motion).collect();
            let mut read = wrapped(&y, from);
            (700..705).for_each(|i| read[i] = f64::NAN);
            let low_high = crate::extremes::extremes(&read);
            assert!(may_wrap(low_high, TAU), "{low_high:?}");
            let (count, first) = unwrap(&mut read, TAU).expect("it wraps");
            assert!(count >= 2 && first > 0);
            let turns = ((read[0] - y[0]) / TAU).round();
            assert!(read[0].abs() <= 0.5 * TAU + 1e-9);
            for (i, (a, b)) in read.iter().zip(&y).enumerate() {
                let as_it_was = (a - b - turns * TAU).abs() < 1e-9;
                assert!(as_it_was || (700..705).contains(&i) && a.is_nan(), "{i}");
            }
        }
    }

    /// What jumps otherwise stays as it is: a flag, noise over the whole range, a motion with a gap in it.
    #[test]
    fn what_does_not_wrap_stays() {
        let flag: Vec<f64> = (0..400).map(|i| 6.0 * f64::from(i / 50 % 2)).collect();
        let noise: Vec<f64> = (0..400)
            .map(|i| (i as f64 * i as f64 * 0.618_033_9).fract() * 6.2)
            .collect();
        let mut gap: Vec<f64> = (0..400).map(|i| 0.01 * i as f64).collect();
        gap[300..].iter_mut().for_each(|y| *y -= 4.0);
        for y in [flag, noise, gap] {
            let mut same = y.clone();
            assert_eq!(unwrap(&mut same, TAU), None);
            assert_eq!(same, y);
        }
    }

    #[test]
    fn angles_in_another_turn_are_found_by_the_limits() {
        let limits = [-2.0, 2.0];
        assert_eq!(into_limits([5.0, 6.2], limits, TAU), -1.0);
        assert_eq!(into_limits([-6.0, -5.0], limits, TAU), 1.0);
        assert_eq!(into_limits([-1.0, 1.0], limits, TAU), 0.0);
        // beyond them in any turn, in degrees, of a joint that turns freely
        assert_eq!(into_limits([2.5, 3.5], limits, TAU), 0.0);
        assert_eq!(into_limits([40.0, 41.0], limits, TAU), 0.0);
        assert_eq!(
            into_limits([5.0, 6.2], [-f64::INFINITY, f64::INFINITY], TAU),
            0.0
        );
    }
}
