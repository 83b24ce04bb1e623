//! Velocity against a limit that depends on the position, over all time.
//!
//! On one side of a [`VelocityByPosition`] the limit is `s(q) = √(2 d (E − q)) − o`. A motion uses the
//! share `λ` of it at most if and only if, at every time with `q̇ > 0`,
//!
//! ```text
//! P(t) = (q̇ + λ o)² − 2 λ² d (E − q) ≤ 0
//! ```
//!
//! a trigonometric polynomial of twice the order of the series. The largest share is sought on a grid and
//! refined; then `P ≤ 0` is proven for a `λ` that is larger by [`INFLATE`], by branch and bound: on an
//! interval of centre `m` and half width `r`
//!
//! ```text
//! P(t) ≤ max over |u| ≤ r of [ P(m) + P'(m) u + ½ P''(m) u² ] + sup|P'''| r³ / 6
//! ```
//!
//! and intervals in which `q̇` is nowhere positive do not count. What is found to exceed `λ` on the way
//! raises it. The rounding of the evaluation is bounded and added.

use super::fourier::{Series, sin_cos_turns};
use crate::robot::{Side, VelocityByPosition};
use std::f64::consts::TAU;

/// By how much the proven share may exceed the largest one found; larger ones are tried in turn.
const INFLATE: [f64; 4] = [1e-10, 1e-8, 1e-6, 1e-3];
/// Evaluations of one proof.
const BUDGET: usize = 200_000;
/// Shares that are tried until none larger is found.
const ROUNDS: usize = 20;

/// The largest share of a velocity by position that a motion uses.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct PositionPeak {
    /// velocity where the share is largest, rad/s or m/s, with its sign
    pub velocity: f64,
    /// position there, rad or m
    pub position: f64,
    /// when, s into the period
    pub time: f64,
    /// velocity allowed there, with the sign of the velocity; 0 where none is
    pub limit: f64,
    /// `velocity / limit`; infinite beyond the position where no velocity is left
    pub used: f64,
    /// the share exceeds this at no time (rigorous, including rounding)
    pub bound: f64,
}

impl PositionPeak {
    /// Whether the proven share stays within the limit.
    pub fn satisfied(&self) -> bool {
        self.bound <= 1.0 + super::bounds::TOLERANCE
    }
}

/// Largest share over all time, of both sides.
pub fn velocity_by_position(
    period: f64,
    harmonics: &[u32],
    series: &Series,
    limit: &VelocityByPosition,
) -> PositionPeak {
    let [up, down] = limit.sides().map(|side| {
        let curve = Curve::new(period, harmonics, series, side);
        let (x, bound) = curve.largest();
        let [q, v, ..] = curve.at(x);
        PositionPeak {
            velocity: side.sign * v,
            position: side.sign * q,
            time: x * period,
            limit: side.sign * side.allowed(q).max(0.0),
            used: curve.share(x),
            bound,
        }
    });
    let bound = up.bound.max(down.bound);
    let most = if down.used > up.used { down } else { up };
    PositionPeak { bound, ..most }
}

/// The motion of one joint towards one side, times in turns.
struct Curve<'a> {
    side: Side,
    harmonics: &'a [u32],
    series: &'a Series,
    period: f64,
    /// `Σ (h ω)ᵏ A_h`, bounds of the derivatives
    sums: [f64; 5],
}

impl<'a> Curve<'a> {
    fn new(period: f64, harmonics: &'a [u32], series: &'a Series, side: Side) -> Self {
        let omega = TAU / period;
        let sum = |k: usize| series.amplitude_sum(harmonics, omega, k as u32) * (1.0 + 1e-9);
        Curve {
            side,
            harmonics,
            series,
            period,
            sums: std::array::from_fn(sum),
        }
    }

    /// Position and its four derivatives (per second) at `x` turns, negated on the lower side.
    fn at(&self, x: f64) -> [f64; 5] {
        let mut d = [self.series.constant, 0.0, 0.0, 0.0, 0.0];
        let coefficients = self.series.sin.iter().zip(&self.series.cos);
        for ((&s, &c), &h) in coefficients.zip(self.harmonics) {
            let (sin, cos) = sin_cos_turns(h, x);
            let w = TAU / self.period * f64::from(h);
            let (even, odd) = (s * sin + c * cos, s * cos - c * sin);
            d[0] += even;
            d[1] += w * odd;
            d[2] -= w * w * even;
            d[3] -= w * w * w * odd;
            d[4] += w * w * w * w * even;
        }
        d.map(|y| self.side.sign * y)
    }

    /// Share of the limit at `x` turns.
    fn share(&self, x: f64) -> f64 {
        let [q, v, ..] = self.at(x);
        share(&self.side, q, v)
    }

    /// The instant of the largest share within `width` turns of `x`, by golden section.
    fn refined(&self, x: f64, width: f64) -> f64 {
        golden(x - width, x + width, &|x| self.share(x))
    }

    /// Instant (turns) of the largest share, and what no share exceeds.
    fn largest(&self) -> (f64, f64) {
        let finite = self.sums.iter().all(|s| s.is_finite()) && self.series.constant.is_finite();
        if !finite {
            return (0.0, f64::INFINITY);
        }
        if self.sums[1] == 0.0 {
            // it stands, which no position forbids
            return (0.0, 0.0);
        }
        let highest = self.harmonics.iter().copied().max().unwrap_or(1) as usize;
        let count = (32 * highest).next_power_of_two();
        let step = 1.0 / count as f64;
        let first = (0..count)
            .map(|i| i as f64 * step)
            .fold((0.0, 0.0), |a, x| {
                let share = self.share(x);
                if share > a.1 { (x, share) } else { a }
            });
        let mut best = self.better(first.0, step);
        for _ in 0..ROUNDS {
            let share = self.share(best);
            if share.is_infinite() {
                return (best, share);
            }
            let mut higher = None;
            for inflate in INFLATE {
                let bound = share * (1.0 + inflate) + f64::MIN_POSITIVE;
                match self.proven(bound, step) {
                    Proven::Holds => return (best, bound),
                    Proven::Exceeded(x) => {
                        higher = Some(x);
                        break;
                    }
                    Proven::Unknown => {}
                }
            }
            match higher {
                Some(x) => best = self.better(x, step),
                None => break,
            }
        }
        (best, f64::INFINITY)
    }

    /// `x` or an instant near it whose share is larger, in `[0, 1)`.
    fn better(&self, x: f64, step: f64) -> f64 {
        let near = self.refined(x, step);
        let best = if self.share(near) > self.share(x) {
            near
        } else {
            x
        };
        let turns = best - best.floor();
        if turns < 1.0 { turns } else { 0.0 }
    }

    /// Whether no share is larger than `λ`.
    fn proven(&self, lambda: f64, step: f64) -> Proven {
        let Side {
            deceleration: d,
            offset,
            end,
            ..
        } = self.side;
        let o = lambda * offset;
        // 2 λ² d, per second squared
        let k = 2.0 * lambda * lambda * d;
        let a = &self.sums;
        let third = 6.0 * a[2] * a[3] + 2.0 * (a[1] + o) * a[4] + k * a[3];
        let size = a[0] + self.series.constant.abs() + end.abs();
        let operations = (3 * self.harmonics.len() + 40) as f64;
        let rounding = f64::EPSILON * operations;
        let of_p = rounding * ((a[1] + o) * (a[1] + o) + k * size);
        let count = (1.0 / step) as usize;
        let mut open: Vec<(f64, f64)> = (0..count)
            .map(|i| ((i as f64 + 0.5) * step, 0.5 * step))
            .collect();
        let mut left = BUDGET;
        while let Some((m, r)) = open.pop() {
            let [q, v, acceleration, jerk, _] = self.at(m);
            let t = r * self.period;
            // largest velocity of the interval
            let fastest =
                v + acceleration.abs() * t + 0.5 * jerk.abs() * t * t + a[4] * t * t * t / 6.0;
            if fastest <= -rounding * a[1] {
                continue;
            }
            let p = (v + o) * (v + o) + k * (q - end);
            if v > 0.0 && share(&self.side, q, v) > lambda {
                return Proven::Exceeded(m);
            }
            let p1 = 2.0 * (v + o) * acceleration + k * v;
            let p2 = 2.0 * acceleration * acceleration + 2.0 * (v + o) * jerk + k * acceleration;
            let mut quadratic = p + p1.abs() * t + 0.5 * p2 * t * t;
            if p2 < 0.0 && p1.abs() < -p2 * t {
                quadratic = p - 0.5 * p1 * p1 / p2;
            }
            if quadratic + third * t * t * t / 6.0 + of_p <= 0.0 {
                continue;
            }
            left = left.saturating_sub(1);
            if left == 0 || r < 1e-12 {
                return Proven::Unknown;
            }
            open.extend([(m - 0.5 * r, 0.5 * r), (m + 0.5 * r, 0.5 * r)]);
        }
        Proven::Holds
    }
}

/// Outcome of a proof.
enum Proven {
    Holds,
    /// at this instant (turns) the share is larger
    Exceeded(f64),
    /// the budget is spent
    Unknown,
}

/// Share of the limit of one side: 0 where it moves inwards.
pub(crate) fn share(side: &Side, q: f64, v: f64) -> f64 {
    let allowed = side.allowed(q);
    if v <= 0.0 {
        0.0
    } else if allowed > 0.0 {
        v / allowed
    } else {
        f64::INFINITY
    }
}

/// Argument of the maximum of a function with one peak in `[a, b]`.
pub(crate) fn golden(mut a: f64, mut b: f64, f: &dyn Fn(f64) -> f64) -> f64 {
    const RATIO: f64 = 0.618_033_988_749_894_9;
    let (mut x, mut y) = (b - RATIO * (b - a), a + RATIO * (b - a));
    let (mut fx, mut fy) = (f(x), f(y));
    for _ in 0..44 {
        if fx >= fy {
            (b, y, fy) = (y, x, fx);
            x = b - RATIO * (b - a);
            fx = f(x);
        } else {
            (a, x, fx) = (x, y, fy);
            y = a + RATIO * (b - a);
            fy = f(y);
        }
    }
    if fx >= fy { x } else { y }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Largest share by the controller's formula at 100 000 instants.
    fn dense(period: f64, harmonics: &[u32], series: &Series, l: &VelocityByPosition) -> f64 {
        let omega = TAU / period;
        (0..100_000)
            .map(|i| {
                let t = f64::from(i) * 1e-5 * period;
                let (mut q, mut v) = (series.constant, 0.0);
                for (k, &h) in harmonics.iter().enumerate() {
                    let w = f64::from(h) * omega;
                    q += series.sin[k] * (w * t).sin() + series.cos[k] * (w * t).cos();
                    v += w * (series.sin[k] * (w * t).cos() - series.cos[k] * (w * t).sin());
                }
                let [low, high] = l.at(q);
                match v {
                    v if v > 0.0 => v / high,
                    v if v < 0.0 => v / low,
                    _ => 0.0,
                }
            })
            .fold(0.0, f64::max)
    }

    proptest! {
        #[test]
        fn no_sample_exceeds_the_bound(
            amplitudes in prop::collection::vec(-1.0..1.0f64, 6),
            constant in -0.8..0.8f64,
            size in 0.02..0.5f64,
            deceleration in 1.0..20.0f64,
            offset in 0.0..0.7f64,
        ) {
            let limit = VelocityByPosition { deceleration, offset, position: [-2.0, 2.2] };
            let scaled: Vec<f64> = amplitudes.iter().map(|a| a * size).collect();
            let series = Series {
                constant,
                sin: scaled[..3].to_vec(),
                cos: scaled[3..].to_vec(),
            };
            let harmonics = [1, 2, 5];
            let found = velocity_by_position(6.0, &harmonics, &series, &limit);
            let sampled = dense(6.0, &harmonics, &series, &limit);
            prop_assert!(sampled <= found.bound, "{sampled} {found:?}");
            if found.used.is_finite() {
                prop_assert!(found.bound <= found.used * (1.0 + 1e-6));
                prop_assert!(found.used >= sampled * (1.0 - 1e-12), "{sampled} {found:?}");
                prop_assert!(found.used <= sampled * (1.0 + 1e-4) + 1e-6, "{sampled} {found:?}");
                prop_assert!((found.velocity / found.limit - found.used).abs() < 1e-9 * found.used);
                let there = limit.at(found.position)[usize::from(found.velocity > 0.0)];
                prop_assert!((there - found.limit).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn what_passes_the_last_position_uses_more_than_everything() {
        let limit = VelocityByPosition {
            deceleration: 6.0,
            offset: 0.6599,
            position: [-2.9007, 2.9007],
        };
        let turn = limit.range()[1];
        let swing = |top: f64| Series {
            constant: top - 0.5,
            sin: vec![0.5],
            cos: vec![0.0],
        };
        // 0.5 rad at 0.1 rad/s²: turns before the last position, and beyond it
        let inside = velocity_by_position(14.0, &[1], &swing(turn - 0.1), &limit);
        assert!(inside.satisfied() && inside.used > 0.1, "{inside:?}");
        let beyond = velocity_by_position(14.0, &[1], &swing(turn + 1e-3), &limit);
        assert!(
            beyond.used.is_infinite() && !beyond.satisfied(),
            "{beyond:?}"
        );
        let still = Series::zero(1);
        assert_eq!(velocity_by_position(14.0, &[1], &still, &limit).bound, 0.0);
    }
}
