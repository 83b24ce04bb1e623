//! The fastest motion between two postures at rest, in closed form.
//!
//! Over a distance `L` with limits `v, a, j` the jerk is `+j, 0, −j, 0, −j, 0, +j`. The velocity that
//! is reached is the largest `w ≤ v` whose rise and fall fit into the distance:
//!
//! ```text
//! w T_r(w) ≤ L,     T_r(w) = w/a + a/j   if w ≥ a²/j,   else  2 √(w/j)
//! ```

use super::profile::{Point, Profile};
use crate::robot::Limits;

/// Phases `(length, jerk)` of the fastest motion from rest to rest over a distance (not negative).
pub fn phases(distance: f64, v: f64, a: f64, j: f64) -> Vec<(f64, f64)> {
    if !(distance > 0.0) {
        return Vec::new();
    }
    // largest velocity by the distance alone: with and without a time of constant acceleration
    let sharp = (0.25 * distance * distance * j).cbrt();
    let w = if sharp * j <= a * a {
        sharp
    } else {
        // w²/a + w a/j = L
        let half = 0.5 * a * a / j;
        (half * half + a * distance).sqrt() - half
    };
    let w = w.min(v);
    let (ramp, hold) = if w * j >= a * a {
        (a / j, (w / a - a / j).max(0.0))
    } else {
        ((w / j).sqrt(), 0.0)
    };
    let rise = 2.0 * ramp + hold;
    let cruise = (distance / w - rise).max(0.0);
    vec![
        (ramp, j),
        (hold, 0.0),
        (ramp, -j),
        (cruise, 0.0),
        (ramp, -j),
        (hold, 0.0),
        (ramp, j),
    ]
}

fn length(phases: &[(f64, f64)]) -> f64 {
    phases.iter().map(|(h, _)| h).sum()
}

/// Each coordinate by its own fastest motion, stretched to the time of the slowest one: all of them
/// leave and arrive together, and none goes beyond its ends.
pub fn fastest(from: &[f64], to: &[f64], limits: &[Limits]) -> Vec<Profile> {
    let own: Vec<Vec<(f64, f64)>> = (from.iter().zip(to).zip(limits))
        .map(|((a, b), l)| phases((b - a).abs(), l.velocity, l.acceleration, l.jerk))
        .collect();
    let duration = own.iter().map(|p| length(p)).fold(0.0, f64::max);
    let ends = from.iter().zip(to);
    ends.zip(&own)
        .map(|((&a, &b), p)| {
            let mine = length(p);
            if mine == 0.0 {
                return Profile::still(a, duration);
            }
            let f = duration / mine;
            let sign = (b - a).signum();
            let slower: Vec<(f64, f64)> = (p.iter())
                .map(|(h, j)| (h * f, sign * j / (f * f * f)))
                .collect();
            Profile::new(rest(a), &slower, rest(b), duration)
        })
        .collect()
}

/// All coordinates in proportion: a straight line between the postures, as fast as the limits of
/// every coordinate allow together.
pub fn straight(from: &[f64], to: &[f64], limits: &[Limits]) -> Vec<Profile> {
    let (mut v, mut a, mut j) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
    for ((x, y), l) in from.iter().zip(to).zip(limits) {
        let d = (y - x).abs();
        if d > 0.0 {
            v = v.min(l.velocity / d);
            a = a.min(l.acceleration / d);
            j = j.min(l.jerk / d);
        }
    }
    let law = match v.is_finite() {
        true => phases(1.0, v, a, j),
        false => Vec::new(),
    };
    let duration = length(&law);
    let ends = from.iter().zip(to);
    ends.map(|(&x, &y)| {
        if x == y {
            return Profile::still(x, duration);
        }
        let own: Vec<(f64, f64)> = law.iter().map(|(h, j)| (*h, j * (y - x))).collect();
        Profile::new(rest(x), &own, rest(y), duration)
    })
    .collect()
}

fn rest(q: f64) -> Point {
    [q, 0.0, 0.0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_motion_arrives_inside_its_limits() {
        for distance in [1e-6, 1e-3, 0.1, 1.0, 30.0] {
            for (v, a, j) in [(1.0, 2.0, 10.0), (0.1, 50.0, 1e4), (5.0, 0.3, 0.2)] {
                let p = phases(distance, v, a, j);
                let t = length(&p);
                let x = Profile::new(rest(0.2), &p, rest(0.2 + distance), t);
                let peaks = x.peaks();
                assert!(peaks.velocity <= v * (1.0 + 1e-9));
                assert!(peaks.acceleration <= a * (1.0 + 1e-9) && peaks.jerk <= j * (1.0 + 1e-9));
                assert!(peaks.position[0] >= 0.2 - 1e-15);
                assert!(peaks.position[1] <= 0.2 + distance * (1.0 + 1e-12) + 1e-15);
                // nothing to gain: one of the limits of the velocity, or none of the pauses, is used
                let used = peaks.velocity / v > 1.0 - 1e-9 || p[3].0 < 1e-9 * t;
                assert!(used, "{distance} {v} {a} {j}: {p:?}");
            }
        }
        assert!(phases(0.0, 1.0, 1.0, 1.0).is_empty());
    }
}
