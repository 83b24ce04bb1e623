//! What happens between the points that are sent: how far a controller that interpolates leaves the motion.
//!
//! With the step `h` and a motion `q(t)` that is smooth between two points, Peano's remainder gives
//!
//! ```text
//! held until the next point     |e| ≤ h max|q̇|
//! straight lines                |e| ≤ h²/8 max|q̈|
//! cubics through q, q̇           |e| ≤ h⁴/384 max|q⁗|
//! quintics through q, q̇, q̈      |e| ≤ h⁶/46080 max|q⁽⁶⁾|
//! ```
//!
//! and all four are sharp. A jerk-limited move has jumps of its jerk, so that of the last two only the first part of
//! Peano's kernel is left: `h³/96 max|q⃛|` for cubics, `19 h³/3072 max|q⃛|` for quintics.

/// What a controller does between two points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Interpolation {
    /// the last point stays until the next one
    Hold,
    /// a straight line from point to point
    Linear,
    /// a cubic through positions and velocities
    Cubic,
    /// a quintic through positions, velocities and accelerations
    Quintic,
}

impl Interpolation {
    /// Order of the derivative that bounds the deviation, and of the step in that bound.
    pub fn order(self) -> u32 {
        match self {
            Interpolation::Hold => 1,
            Interpolation::Linear => 2,
            Interpolation::Cubic => 4,
            Interpolation::Quintic => 6,
        }
    }

    /// Bound of the deviation where the derivative of [`Interpolation::order`] is at most `largest`; `step` in s.
    pub fn bound(self, step: f64, largest: f64) -> f64 {
        let factor = match self {
            Interpolation::Hold => 1.0,
            Interpolation::Linear => 1.0 / 8.0,
            Interpolation::Cubic => 1.0 / 384.0,
            Interpolation::Quintic => 1.0 / 46080.0,
        };
        factor * step.powi(self.order() as i32) * largest
    }

    /// The same bound of a motion whose velocity, acceleration and jerk are at most `largest`, and whose jerk may jump.
    pub fn bound_with_jumps(self, step: f64, largest: [f64; 3]) -> f64 {
        match self {
            Interpolation::Hold => self.bound(step, largest[0]),
            Interpolation::Linear => self.bound(step, largest[1]),
            Interpolation::Cubic => step.powi(3) / 96.0 * largest[2],
            Interpolation::Quintic => 19.0 * step.powi(3) / 3072.0 * largest[2],
        }
    }

    /// The bound as a formula.
    pub fn formula(self) -> &'static str {
        match self {
            Interpolation::Hold => "h max|dq|",
            Interpolation::Linear => "h²/8 max|ddq|",
            Interpolation::Cubic => "h⁴/384 max|4th derivative|",
            Interpolation::Quintic => "h⁶/46080 max|6th derivative|",
        }
    }

    /// What lies between the points, in words.
    pub fn name(self) -> &'static str {
        match self {
            Interpolation::Hold => "each point is held until the next",
            Interpolation::Linear => "straight lines from point to point",
            Interpolation::Cubic => "cubics through positions and velocities",
            Interpolation::Quintic => "quintics through positions, velocities and accelerations",
        }
    }

    /// Position at the share `u` of a step `h` between the states `a` and `b` (position, velocity, acceleration).
    pub fn between(self, u: f64, h: f64, a: [f64; 3], b: [f64; 3]) -> f64 {
        match self {
            Interpolation::Hold => a[0],
            Interpolation::Linear => bezier([a[0], b[0]], u),
            Interpolation::Cubic => {
                let (out, into) = (a[0] + h * a[1] / 3.0, b[0] - h * b[1] / 3.0);
                bezier([a[0], out, into, b[0]], u)
            }
            Interpolation::Quintic => bezier(quintic(h, a, b), u),
        }
    }
}

/// Control points of the quintic between two states (position, velocity, acceleration).
pub(super) fn quintic(h: f64, a: [f64; 3], b: [f64; 3]) -> [f64; 6] {
    let bend = h * h / 20.0;
    [
        a[0],
        a[0] + h * a[1] / 5.0,
        a[0] + 2.0 * h * a[1] / 5.0 + bend * a[2],
        b[0] - 2.0 * h * b[1] / 5.0 + bend * b[2],
        b[0] - h * b[1] / 5.0,
        b[0],
    ]
}

/// Control points of the derivative of a curve with these control points over a step `h`.
pub(super) fn derived<const N: usize, const M: usize>(points: [f64; N], h: f64) -> [f64; M] {
    std::array::from_fn(|i| M as f64 * (points[i + 1] - points[i]) / h)
}

/// Value of the curve of these control points at `u` in `[0, 1]`, by de Casteljau's scheme.
pub(super) fn bezier<const N: usize>(mut points: [f64; N], u: f64) -> f64 {
    for left in (1..N).rev() {
        for i in 0..left {
            points[i] += u * (points[i + 1] - points[i]);
        }
    }
    points[0]
}

/// How far a controller may leave the motion of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// rad or m
    pub value: f64,
    /// what was aimed at: 1e-5 rad or m, or the step of the encoder where that is more
    pub aim: f64,
    /// a bound for all time; otherwise the largest of many points that were tried
    pub proven: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Interpolation; 4] = [
        Interpolation::Hold,
        Interpolation::Linear,
        Interpolation::Cubic,
        Interpolation::Quintic,
    ];

    /// A monomial of the order of the bound has a constant derivative there: the bound is reached in the middle (at the
    /// end of a step that is held).
    #[test]
    fn bounds_are_sharp() {
        let h = 0.7;
        for way in ALL {
            let n = way.order() as i32;
            let state = |t: f64| {
                let d = |k: i32| match (0..k).map(|i| f64::from(n - i)).product::<f64>() {
                    f if n >= k => f * t.powi(n - k),
                    _ => 0.0,
                };
                [d(0), d(1), d(2)]
            };
            let largest = (1..=n).map(f64::from).product::<f64>();
            let worst = (0..=100)
                .map(|i| {
                    let u = f64::from(i) / 100.0;
                    (way.between(u, h, state(0.0), state(h)) - state(u * h)[0]).abs()
                })
                .fold(0.0, f64::max);
            let bound = way.bound(h, largest);
            assert!(
                (worst / bound - 1.0).abs() < 1e-9,
                "{way:?} {worst} {bound}"
            );
        }
    }

    /// A jerk that switches once: no switch exceeds the bound, and some switch comes close to half of it.
    #[test]
    fn bounds_hold_where_the_jerk_jumps() {
        let (h, jerk) = (0.3, 11.0);
        for way in ALL {
            let mut near = 0.0f64;
            for switch in (0..=60).map(|i| h * f64::from(i) / 60.0) {
                let state = |t: f64| {
                    let after = (t - switch).max(0.0);
                    [
                        jerk * (t.powi(3) - 2.0 * after.powi(3)) / 6.0,
                        jerk * (t * t - 2.0 * after * after) / 2.0,
                        jerk * (t - 2.0 * after),
                    ]
                };
                let most = |k: usize| {
                    (0..=600)
                        .map(|i| state(h * f64::from(i) / 600.0)[k].abs())
                        .fold(0.0, f64::max)
                };
                let bound = way.bound_with_jumps(h, [most(1), most(2), jerk]);
                for i in 0..=60 {
                    let u = f64::from(i) / 60.0;
                    let e = (way.between(u, h, state(0.0), state(h)) - state(u * h)[0]).abs();
                    assert!(e <= bound * (1.0 + 1e-9), "{way:?} {e} {bound}");
                    near = near.max(e / bound);
                }
            }
            assert!(near > 0.3, "{way:?} {near}");
        }
    }

    #[test]
    fn a_quintic_meets_its_states() {
        let (a, b, h) = ([0.3, -1.0, 2.0], [0.4, 0.5, -3.0], 0.2);
        let points = quintic(h, a, b);
        let first: [f64; 5] = derived(points, h);
        let second: [f64; 4] = derived(first, h);
        for (u, state) in [(0.0, a), (1.0, b)] {
            let found = [bezier(points, u), bezier(first, u), bezier(second, u)];
            for (x, y) in found.iter().zip(state) {
                assert!((x - y).abs() < 1e-12, "{found:?} {state:?}");
            }
        }
    }
}
