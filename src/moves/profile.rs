//! One coordinate of a leg: a piecewise cubic with constant jerk in each piece.
//!
//! ```text
//! q(t) = q₀ + v₀ s + a₀ s²/2 + j s³/6          s = t − t₀,  0 ≤ s ≤ h
//! ```
//!
//! Extrema are exact: positions turn where the quadratic `v` vanishes, velocities where the straight
//! line `a` does.

use super::peaks::Peaks;
use crate::robot::VelocityByPosition;
use crate::trajectory::by_position::share;
use nalgebra::{Matrix3, Vector3};

/// How closely the share of a velocity by position is bounded.
const CLOSE: f64 = 1e-4;

/// Position, velocity and acceleration.
pub type Point = [f64; 3];

/// A stretch of time with constant jerk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// begin, s from the begin of the profile
    pub start: f64,
    /// length, s
    pub length: f64,
    /// position, velocity and acceleration at the begin
    pub state: Point,
    /// rad/s³ or m/s³
    pub jerk: f64,
}

impl Piece {
    /// State `s` seconds after the begin.
    pub fn at(&self, s: f64) -> Point {
        let ([q, v, a], j) = (self.state, self.jerk);
        [
            q + s * (v + s * (a / 2.0 + s * j / 6.0)),
            v + s * (a + s * j / 2.0),
            a + s * j,
        ]
    }

    /// Instants between `from` and `to` at which the velocity vanishes.
    fn turns(&self, from: f64, to: f64) -> [Option<f64>; 2] {
        let ([_, v, a], j) = (self.state, self.jerk);
        let inside = |s: f64| (s > from && s < to).then_some(s);
        // v + a s + j s²/2 = 0, without cancellation
        let root = a * a - 2.0 * j * v;
        if root < 0.0 {
            return [None, None];
        }
        let w = -(a + root.sqrt().copysign(a));
        let divided = |x: f64, y: f64| if y == 0.0 { None } else { inside(x / y) };
        [divided(w, j), divided(2.0 * v, w)]
    }
}

/// One coordinate of a leg over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    pieces: Vec<Piece>,
    /// end, s
    pub duration: f64,
}

impl Profile {
    /// Phases `(length, jerk)` one after the other from a state. Where they miss the target by
    /// rounding, the jerks are moved by the least amount that meets it: least `∫ δj² dt`, a linear
    /// problem of three equations.
    pub fn new(from: Point, phases: &[(f64, f64)], to: Point, duration: f64) -> Self {
        let mut phases: Vec<(f64, f64)> =
            phases.iter().copied().filter(|(h, _)| *h > 0.0).collect();
        let sum: f64 = phases.iter().map(|(h, _)| h).sum();
        match phases.last_mut() {
            // lengths that differ from the duration by rounding
            Some(last) if last.0 + duration - sum > 0.0 && duration - sum < 1e-9 => {
                last.0 += duration - sum;
            }
            _ if duration > sum => phases.push((duration - sum, 0.0)),
            _ => {}
        }
        if phases.len() < 3 {
            phases = phases
                .iter()
                .flat_map(|&(h, j)| [(h / 3.0, j); 3])
                .collect();
        }
        for _ in 0..2 {
            let end = run(from, &phases).1;
            let missed = Vector3::new(to[0] - end[0], to[1] - end[1], to[2] - end[2]);
            if missed.amax() > 0.0 && missed.iter().all(|x| x.is_finite()) {
                correct(&mut phases, &missed, duration);
            }
        }
        let (pieces, _) = run(from, &phases);
        Profile { pieces, duration }
    }

    /// Stands still.
    pub fn still(q: f64, duration: f64) -> Self {
        let piece = Piece {
            start: 0.0,
            length: duration,
            state: [q, 0.0, 0.0],
            jerk: 0.0,
        };
        Profile {
            pieces: vec![piece],
            duration,
        }
    }

    fn index(&self, t: f64) -> usize {
        let after = self.pieces.partition_point(|p| p.start <= t);
        after.max(1) - 1
    }

    /// Position, velocity and acceleration at a time; beyond the ends, those of the ends.
    pub fn at(&self, t: f64) -> Point {
        let t = t.clamp(0.0, self.duration);
        match self.pieces.get(self.index(t)) {
            Some(p) => p.at((t - p.start).min(p.length)),
            None => [0.0; 3],
        }
    }

    /// Calls `f` with each piece that has a part in `[from, to]`, and that part.
    fn within(&self, from: f64, to: f64, mut f: impl FnMut(&Piece, f64, f64)) {
        for p in &self.pieces[self.index(from)..] {
            if p.start > to {
                break;
            }
            let low = (from - p.start).clamp(0.0, p.length);
            f(p, low, (to - p.start).clamp(low, p.length));
        }
    }

    /// Least and largest position over `[from, to]`.
    pub fn range(&self, from: f64, to: f64) -> [f64; 2] {
        let mut out = [f64::INFINITY, f64::NEG_INFINITY];
        self.within(from, to, |p, low, high| {
            let turns = p.turns(low, high);
            for s in [Some(low), Some(high)].into_iter().chain(turns).flatten() {
                let q = p.at(s)[0];
                out = [out[0].min(q), out[1].max(q)];
            }
        });
        out
    }

    /// Least and largest velocity over `[from, to]`.
    pub fn velocities(&self, from: f64, to: f64) -> [f64; 2] {
        let mut out = [f64::INFINITY, f64::NEG_INFINITY];
        self.within(from, to, |p, low, high| {
            let top = -p.state[2] / p.jerk;
            let inside = top > low && top < high;
            for s in [low, high, if inside { top } else { low }] {
                let v = p.at(s)[1];
                out = [out[0].min(v), out[1].max(v)];
            }
        });
        out
    }

    /// Largest speed over `[from, to]`.
    pub fn speed(&self, from: f64, to: f64) -> f64 {
        let [low, high] = self.velocities(from, to);
        high.max(-low).max(0.0)
    }

    /// Instants at which the jerk may jump, both ends included.
    pub fn breaks(&self) -> impl Iterator<Item = f64> + '_ {
        let ends = self.pieces.iter().map(|p| p.start + p.length);
        self.pieces.iter().map(|p| p.start).chain(ends)
    }

    /// Largest magnitudes of the position and its five derivatives over `[from, to]`, where the jerk is constant.
    pub fn jet(&self, from: f64, to: f64) -> [f64; 6] {
        let mut out = [0.0; 6];
        self.within(from, to, |p, low, high| {
            // pieces that the interval only touches
            if high - low > 1e-9 * (to - from) {
                let ends = [p.at(low)[2], p.at(high)[2]];
                out[2] = ends.into_iter().fold(out[2], |m: f64, a| m.max(a.abs()));
                out[3] = out[3].max(p.jerk.abs());
            }
        });
        let [low, high] = self.range(from, to);
        [out[0], out[1]] = [low.abs().max(high.abs()), self.speed(from, to)];
        out
    }

    /// Middle and radius of the position and its first four derivatives over `c ± r`, where the jerk is constant.
    pub fn enclosure(&self, c: f64, r: f64) -> [[f64; 2]; 5] {
        let Some(p) = self.pieces.get(self.index(c)) else {
            return [[0.0; 2]; 5];
        };
        let s = c - p.start;
        let ([q, v, a], j) = (p.at(s), p.jerk);
        let [q0, v0, a0] = p.state.map(f64::abs);
        // right to rounding of what is added up
        let rounding = 1e-13;
        let (fast, bent) = (v0 + s * (a0 + s * j.abs()), a0 + s * j.abs());
        let place = q0 + s * fast;
        let (v1, a1) = (v.abs() + 0.5 * r * a.abs(), a.abs() + 0.5 * r * j.abs());
        [
            [q, r * (v1 + r * r * j.abs() / 6.0) + rounding * place],
            [v, r * a1 + rounding * fast],
            [a, r * j.abs() + rounding * bent],
            [j, rounding * j.abs()],
            [0.0; 2],
        ]
    }

    /// What the share of a velocity by position exceeds at no time: intervals whose bound, the largest
    /// velocity against the one allowed at the outermost position, exceeds the largest share found by more
    /// than [`CLOSE`] are halved. Less than `still` counts as standing.
    pub fn share(&self, limit: &VelocityByPosition, still: f64) -> f64 {
        let mut found = 0.0_f64;
        for side in limit.sides() {
            let of = |q: f64, v: f64| match v <= still {
                true => 0.0,
                false => share(&side, q, v),
            };
            let outermost = |[low, high]: [f64; 2]| if side.sign > 0.0 { high } else { -low };
            let bound = |from: f64, to: f64| {
                let (q, v) = (self.range(from, to), self.velocities(from, to));
                of(outermost(q), outermost(v))
            };
            let ends = self.pieces.iter().map(|p| (p.start, p.start + p.length));
            let mut open: Vec<(f64, f64)> = ends.collect();
            while let Some((from, to)) = open.pop() {
                let most = bound(from, to);
                let middle = 0.5 * (from + to);
                let [q, v, _] = self.at(middle);
                let here = of(side.sign * q, side.sign * v);
                if most <= found * (1.0 + CLOSE) {
                    continue;
                }
                if most <= here * (1.0 + CLOSE) || to - from < 1e-9 * self.duration {
                    found = found.max(most);
                    continue;
                }
                found = found.max(here);
                open.extend([(from, middle), (middle, to)]);
            }
        }
        // what was left out exceeds the largest share by no more than this
        found * (1.0 + CLOSE)
    }

    /// Largest magnitudes over all time.
    pub fn peaks(&self) -> Peaks {
        let mut out = Peaks {
            position: self.range(0.0, self.duration),
            velocity: self.speed(0.0, self.duration),
            ..Peaks::default()
        };
        for p in &self.pieces {
            let end = p.at(p.length)[2];
            out.acceleration = out.acceleration.max(p.state[2].abs()).max(end.abs());
            out.jerk = out.jerk.max(p.jerk.abs());
        }
        out
    }

    /// The same positions, `factor` times as slow: `q̇/f`, `q̈/f²`, `q⃛/f³`.
    pub fn stretched(&self, factor: f64) -> Self {
        let f = factor;
        let slower = |p: &Piece| Piece {
            start: p.start * f,
            length: p.length * f,
            state: [p.state[0], p.state[1] / f, p.state[2] / (f * f)],
            jerk: p.jerk / (f * f * f),
        };
        Profile {
            pieces: self.pieces.iter().map(slower).collect(),
            duration: self.duration * f,
        }
    }
}

/// The pieces of phases, and the state at their end.
fn run(from: Point, phases: &[(f64, f64)]) -> (Vec<Piece>, Point) {
    let (mut start, mut state) = (0.0, from);
    let mut pieces = Vec::with_capacity(phases.len());
    for &(length, jerk) in phases {
        let piece = Piece {
            start,
            length,
            state,
            jerk,
        };
        state = piece.at(length);
        start += length;
        pieces.push(piece);
    }
    if pieces.is_empty() {
        pieces.push(Piece {
            start: 0.0,
            length: 0.0,
            state: from,
            jerk: 0.0,
        });
    }
    (pieces, state)
}

/// Moves the jerks by the least amount that moves the end by `missed`. With `u` the time that is left
/// after a phase of length `h`, in units of the duration,
///
/// ```text
/// δ(q, v, a) at the end = δj · (h³/6 + h²u/2 + hu²/2,  h²/2 + hu,  h)
/// ```
fn correct(phases: &mut [(f64, f64)], missed: &Vector3<f64>, duration: f64) {
    let unit = duration;
    if !(unit > 0.0) {
        return;
    }
    let mut left = 1.0;
    let mut columns = Vec::with_capacity(phases.len());
    let mut gram = Matrix3::zeros();
    for (length, _) in phases.iter() {
        let h = length / unit;
        left -= h;
        let u: f64 = left;
        // the effect of a jerk over the phase, per length
        let g = Vector3::new(h * h / 6.0 + h * u / 2.0 + u * u / 2.0, h / 2.0 + u, 1.0);
        gram += g * g.transpose() * h;
        columns.push(g);
    }
    let wanted = Vector3::new(
        missed.x / unit.powi(3),
        missed.y / unit.powi(2),
        missed.z / unit,
    );
    if let Some(solved) = gram.lu().solve(&wanted)
        && solved.iter().all(|x| x.is_finite())
    {
        for ((_, jerk), g) in phases.iter_mut().zip(&columns) {
            *jerk += g.dot(&solved);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extrema_are_those_of_a_fine_grid() {
        let phases = [(0.3, 4.0), (0.2, 0.0), (0.5, -7.0), (0.1, 2.0), (0.4, 6.0)];
        let from = [0.4, -0.9, 0.2];
        let end = run(from, &phases).1;
        let p = Profile::new(from, &phases, end, 1.5);
        for (a, b) in [(0.0, 1.5), (0.05, 0.4), (0.31, 0.33), (0.7, 1.45)] {
            let (mut low, mut high, mut fast) = (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64);
            for k in 0..=200_000 {
                let [q, v, _] = p.at(a + (b - a) * f64::from(k) / 200_000.0);
                (low, high, fast) = (low.min(q), high.max(q), fast.max(v.abs()));
            }
            let [l, h] = p.range(a, b);
            assert!(l <= low + 1e-15 && h >= high - 1e-15 && p.speed(a, b) >= fast - 1e-15);
            assert!(low - l < 1e-9 && h - high < 1e-9 && p.speed(a, b) - fast < 1e-4);
        }
        let slow = p.stretched(3.0);
        let ([q, v, a], [sq, sv, sa]) = (p.at(0.77), slow.at(2.31));
        assert!((q - sq).abs() < 1e-14 && (v - 3.0 * sv).abs() < 1e-14);
        assert!((a - 9.0 * sa).abs() < 1e-13);
    }

    #[test]
    fn the_share_of_a_velocity_by_position_is_bounded_closely() {
        let limit = VelocityByPosition {
            deceleration: 2.5,
            offset: 0.25,
            position: [-1.8, 1.8],
        };
        #[allow(clippy::type_complexity)]
        let ways: [(f64, f64, [(f64, f64); 7]); 3] = [
            (
                -1.2,
                1.7,
                [
                    (0.1, 5.0),
                    (0.2, 0.0),
                    (0.1, -5.0),
                    (0.9, 0.0),
                    (0.1, -5.0),
                    (0.2, 0.0),
                    (0.1, 5.0),
                ],
            ),
            (
                1.0,
                -1.75,
                [
                    (0.2, -9.0),
                    (0.1, 0.0),
                    (0.2, 9.0),
                    (0.2, 0.0),
                    (0.2, 9.0),
                    (0.1, 0.0),
                    (0.2, -9.0),
                ],
            ),
            (
                1.799,
                0.0,
                [
                    (0.2, -9.0),
                    (0.1, 0.0),
                    (0.2, 9.0),
                    (0.6, 0.0),
                    (0.2, 9.0),
                    (0.1, 0.0),
                    (0.2, -9.0),
                ],
            ),
        ];
        for (from, to, phases) in ways {
            let duration: f64 = phases.iter().map(|(h, _)| h).sum();
            let p = Profile::new([from, 0.0, 0.0], &phases, [to, 0.0, 0.0], duration);
            let bound = p.share(&limit, 1e-9);
            let dense = (0..=100_000).map(|i| {
                let [q, v, _] = p.at(duration * f64::from(i) * 1e-5);
                let [low, high] = limit.at(q);
                match v {
                    v if v > 1e-9 => v / high,
                    v if v < -1e-9 => v / low,
                    _ => 0.0,
                }
            });
            let dense = dense.fold(0.0, f64::max);
            assert!(
                bound >= dense && bound <= dense * 1.0003 + 1e-9,
                "{bound} {dense}"
            );
            assert!(dense > 0.1 && dense.is_finite());
        }
        // beyond the position at which no velocity is left
        let out = Profile::new([0.0; 3], &[(1.0, 1.0)], [1.795, 0.0, 0.0], 1.0);
        assert!(out.share(&limit, 1e-9).is_infinite());
    }

    #[test]
    fn a_target_that_is_missed_by_rounding_is_met() {
        let phases = [(0.3, 4.0), (0.2, 0.0), (0.5, -7.0)];
        let from = [0.4, -0.9, 0.2];
        let end = run(from, &phases).1;
        let to = [end[0] + 1e-8, end[1] - 2e-8, end[2] + 1e-8];
        for duration in [1.0, 1.0 + 1e-12, 1.0 - 1e-12] {
            let p = Profile::new(from, &phases, to, duration);
            let [q, v, a] = p.at(duration);
            assert!((q - to[0]).abs() < 1e-13 && (v - to[1]).abs() < 1e-13);
            assert!((a - to[2]).abs() < 1e-12 && p.peaks().jerk < 7.0 + 1e-4);
        }
        let short = Profile::new(from, &[(0.4, 1.0)], [0.1, -0.7, 0.6], 0.4);
        assert!((short.at(0.4)[0] - 0.1).abs() < 1e-12);
        assert_eq!(Profile::still(0.3, 2.0).at(1.0), [0.3, 0.0, 0.0]);
    }
}
