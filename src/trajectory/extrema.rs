//! Extrema of a trigonometric polynomial over all time, found and proven.
//!
//! [`extrema`] returns the true global minimum and maximum together with a rigorous enclosure of
//! the range. With the time in turns, `x = t/T`, and `p(x) = c_0 + Σ A_h cos(2π h x − φ_h)`, the
//! third derivative never exceeds `M_3 = Σ (2π h)³ A_h`, so that on an interval of centre `m` and
//! half width `r` Taylor's theorem gives
//!
//! ```text
//! p(x) ≤ max over |u| ≤ r of [ p(m) + p'(m) u + ½ p''(m) u² ] + M_3 r³ / 6
//! ```
//!
//! Branch and bound discards every interval whose bound does not exceed the best value found and
//! halves the others; intervals around the maximum shrink until the bound is within rounding. The
//! rounding of the evaluation itself is bounded too and added.
//!
//! `extrema_fast` is for the inner loop of an optimiser: no proof.

use super::fourier::{HARMONIC_MAX, Series, sin_cos_turns};
use super::table::Table;
use std::f64::consts::TAU;

/// A point of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Extremum {
    /// time in the period, s
    pub time: f64,
    /// value there
    pub value: f64,
}

/// Range of a curve over all time.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Extrema {
    /// smallest value and where
    pub min: Extremum,
    /// largest value and where
    pub max: Extremum,
    /// no value at any time is smaller
    pub lower_bound: f64,
    /// no value at any time is larger
    pub upper_bound: f64,
}

impl Extrema {
    /// The extremum of largest magnitude, its value made positive.
    pub fn largest(&self) -> Extremum {
        if self.max.value.abs() >= self.min.value.abs() {
            Extremum {
                value: self.max.value.abs(),
                ..self.max
            }
        } else {
            Extremum {
                value: self.min.value.abs(),
                ..self.min
            }
        }
    }

    /// No magnitude at any time is larger.
    pub fn magnitude_bound(&self) -> f64 {
        self.upper_bound.max(-self.lower_bound)
    }
}

/// Positions are rounded to multiples of this many turns, see [`Curve::new`].
const QUANTUM: f64 = 1.0 / (1u64 << 38) as f64;

/// Evaluations of branch and bound before it settles for the bound it has.
const BUDGET: usize = 200_000;

/// Global extrema of the derivative of the given order (0: position) of a series, with a rigorous
/// enclosure: the true range lies inside `[lower_bound, upper_bound]` and contains
/// `[min.value, max.value]` to rounding. The bounds typically exceed the values by 1e-12 of the
/// amplitude or less. A series with a coefficient that is not finite has infinite bounds.
pub fn extrema(period: f64, harmonics: &[u32], series: &Series, order: u32) -> Extrema {
    let series = series.derivative(harmonics, TAU / period, order);
    let (top, upper_bound) = maximum(&Curve::new(harmonics, &series, order, 1.0));
    let (bottom, lower_bound) = maximum(&Curve::new(harmonics, &series, order, -1.0));
    Extrema {
        min: Extremum {
            time: bottom.time * period,
            value: -bottom.value,
        },
        max: Extremum {
            time: top.time * period,
            value: top.value,
        },
        lower_bound: -lower_bound,
        upper_bound,
    }
}

/// A polynomial `±p` in turns, with what is needed to bound it.
struct Curve<'a> {
    harmonics: &'a [u32],
    series: &'a Series,
    sign: f64,
    /// `M_2`, `M_3`: bounds of the second and third derivative
    second: f64,
    third: f64,
    /// bound of the rounding of one evaluation
    rounding: f64,
}

impl<'a> Curve<'a> {
    fn new(harmonics: &'a [u32], series: &'a Series, order: u32, sign: f64) -> Self {
        let sum = |power: u32| series.amplitude_sum(harmonics, TAU, power);
        // positions are multiples of 2⁻³⁸ turns, so that h·x is exact and the angle within a few
        // roundings; the sum has H + 1 terms of three operations; the coefficients went through
        // `order` multiplications
        let operations = (3 * harmonics.len() + 24 + 2 * order as usize) as f64;
        let mut rounding = f64::EPSILON * operations * (sum(0) + series.constant.abs());
        if harmonics.iter().any(|&h| h > HARMONIC_MAX) {
            rounding += 2.0 * f64::EPSILON * sum(1);
        }
        let inflate = 1.0 + 1e-9;
        Curve {
            harmonics,
            series,
            sign,
            second: sum(2) * inflate,
            third: sum(3) * inflate,
            rounding,
        }
    }

    /// Value, first and second derivative (per turn) at `x` turns.
    fn at(&self, x: f64) -> [f64; 3] {
        let [mut p, mut p1, mut p2] = [self.series.constant, 0.0, 0.0];
        for ((&s, &c), &h) in self
            .series
            .sin
            .iter()
            .zip(&self.series.cos)
            .zip(self.harmonics)
        {
            let (sin, cos) = sin_cos_turns(h, x);
            let w = TAU * f64::from(h);
            let value = s * sin + c * cos;
            p += value;
            p1 += w * (s * cos - c * sin);
            p2 -= w * w * value;
        }
        [self.sign * p, self.sign * p1, self.sign * p2]
    }
}

/// Maximum of a curve: where (turns) and value, and a bound nothing exceeds.
fn maximum(curve: &Curve) -> (Extremum, f64) {
    if !(curve.third.is_finite() && curve.rounding.is_finite()) {
        return (
            Extremum {
                time: 0.0,
                value: f64::NAN,
            },
            f64::INFINITY,
        );
    }
    let amplitude = curve.series.amplitude_sum(curve.harmonics, TAU, 0);
    let highest = curve.harmonics.iter().copied().max().unwrap_or(1) as usize;
    // a power of two: sample positions and their halvings are exact
    let samples = (16 * highest).next_power_of_two();
    let step = 1.0 / samples as f64;
    let table = Table::new(1.0, curve.harmonics, samples);
    let mut values = vec![0.0; samples];
    table.series(curve.series, 0, &mut values);
    values.iter_mut().for_each(|v| *v *= curve.sign);

    let top = values
        .iter()
        .enumerate()
        .fold(0, |k, (i, v)| if *v > values[k] { i } else { k });
    let best = polish(curve, top as f64 * step, step);
    let mut best = if best.value >= values[top] {
        best
    } else {
        Extremum {
            time: top as f64 * step,
            value: values[top],
        }
    };
    let tolerance = (2.0 * curve.rounding).max(1e-14 * amplitude);
    let mut bound = best.value + curve.rounding;
    // between two samples a chord is exceeded by at most M_2 step² / 8; table and direct
    // evaluation both stay within the rounding bound
    let sag = curve.second * step * step / 8.0 + 2.0 * curve.rounding;
    let mut open: Vec<(f64, f64)> = Vec::new();
    for i in (0..samples).rev() {
        let chord = values[i].max(values[(i + 1) % samples]) + sag;
        if chord > best.value + tolerance {
            open.push(((i as f64 + 0.5) * step, 0.5 * step));
        } else {
            bound = bound.max(chord);
        }
    }
    let mut left = BUDGET;
    while let Some((m, r)) = open.pop() {
        let [p, p1, p2] = curve.at(m);
        if p > best.value {
            best = polish(curve, m, r);
            if best.value < p {
                best = Extremum { time: m, value: p };
            }
            bound = bound.max(best.value + curve.rounding);
        }
        let mut quadratic = p + p1.abs() * r + 0.5 * p2 * r * r;
        if p2 < 0.0 && p1.abs() < -p2 * r {
            quadratic = p - 0.5 * p1 * p1 / p2;
        }
        let above = quadratic + curve.third * r * r * r / 6.0 + 2.0 * curve.rounding;
        left = left.saturating_sub(1);
        if above <= best.value + tolerance || left == 0 || r <= 2.0 * QUANTUM {
            bound = bound.max(above);
        } else {
            open.extend([(m - 0.5 * r, 0.5 * r), (m + 0.5 * r, 0.5 * r)]);
        }
    }
    best.time -= best.time.floor();
    if best.time >= 1.0 {
        best.time = 0.0;
    }
    (best, bound)
}

/// Newton's method for a maximum within `width` turns of `x`, by bisection where it leaves the
/// neighbourhood; the best point seen.
fn polish(curve: &Curve, start: f64, width: f64) -> Extremum {
    let mut best = Extremum {
        time: start,
        value: f64::NEG_INFINITY,
    };
    let mut x = start;
    let (mut low, mut high) = (start - width, start + width);
    for _ in 0..60 {
        let [p, p1, p2] = curve.at(x);
        if p > best.value {
            best = Extremum { time: x, value: p };
        }
        if p1 > 0.0 {
            low = x;
        } else {
            high = x;
        }
        let newton = x - p1 / p2;
        let next = if p2 < 0.0 && newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        let next = (next / QUANTUM).round() * QUANTUM;
        if p1 == 0.0 || next == x {
            break;
        }
        x = next;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::super::extrema_fast;
    use super::*;
    use proptest::prelude::*;

    fn dense(period: f64, harmonics: &[u32], series: &Series, order: u32) -> (f64, f64) {
        let samples = 100_000;
        let mut values = vec![0.0; samples];
        Table::new(period, harmonics, samples).series(series, order, &mut values);
        values
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &v| {
                (a.min(v), b.max(v))
            })
    }

    fn compare(period: f64, harmonics: &[u32], series: &Series, order: u32) {
        let found = extrema(period, harmonics, series, order);
        let (low, high) = dense(period, harmonics, series, order);
        let omega = TAU / period;
        let derived = series.derivative(harmonics, omega, order);
        let amplitude = derived.amplitude_sum(harmonics, omega, 0) + derived.constant.abs();
        // the enclosure holds against the samples, and is narrow
        assert!(found.upper_bound >= high && found.lower_bound <= low);
        assert!(found.upper_bound - found.max.value <= 1e-12 * amplitude + f64::MIN_POSITIVE);
        assert!(found.min.value - found.lower_bound <= 1e-12 * amplitude + f64::MIN_POSITIVE);
        // dense sampling comes this close
        let sag = derived.amplitude_sum(harmonics, omega, 2) * (period * 1e-5).powi(2) / 8.0;
        assert!(found.max.value - high <= sag + 1e-13 * amplitude);
        assert!(low - found.min.value <= sag + 1e-13 * amplitude);
        // the value is taken at the time given
        let f = super::super::Fourier {
            period,
            harmonics: harmonics.to_vec(),
            joints: vec![series.clone()],
        };
        for e in [found.min, found.max] {
            let mut v = [0.0];
            f.derivative(order, e.time, &mut v);
            assert!(
                (v[0] - e.value).abs() <= 1e-11 * amplitude,
                "{} {}",
                v[0],
                e.value
            );
            assert!((0.0..=period).contains(&e.time));
        }
        // the fast version finds the same two
        let table = Table::new(period, harmonics, 16 * *harmonics.last().unwrap() as usize);
        let (mut work, mut all) = (Vec::new(), Vec::new());
        extrema_fast(&table, series, order, &mut work, &mut all);
        let top = all
            .iter()
            .map(|e| e.value)
            .fold(f64::NEG_INFINITY, f64::max);
        let bottom = all.iter().map(|e| e.value).fold(f64::INFINITY, f64::min);
        let close = 1e-6 * amplitude;
        assert!(
            (top - found.max.value).abs() <= close,
            "{top} {}",
            found.max.value
        );
        assert!((bottom - found.min.value).abs() <= close);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]
        #[test]
        fn random_series(
            coefficients in proptest::collection::vec(-2.0..2.0f64, 1 + 2 * 12),
            steps in proptest::collection::vec(1u32..5, 12),
            count in 1usize..12, order in 0u32..4, period in 0.1..20.0f64,
        ) {
            let harmonics: Vec<u32> =
                steps[..count].iter().scan(0, |h, s| { *h += s; Some(*h) }).collect();
            compare(period, &harmonics, &Series::from_coefficients(&coefficients[..2 * count + 1]), order);
        }
    }

    #[test]
    fn sixty_harmonics_and_a_high_harmonic() {
        let harmonics: Vec<u32> = (1..=60).collect();
        let wave = |k: usize| ((k * k) as f64 * 0.71 + k as f64).sin();
        let c: Vec<f64> = (0..121).map(wave).collect();
        for order in 0..4 {
            compare(5.0, &harmonics, &Series::from_coefficients(&c), order);
        }
        compare(
            1.0,
            &[1, 977],
            &Series::from_coefficients(&[0.0, 1.0, 0.3, 0.2, 0.1]),
            0,
        );
    }

    #[test]
    fn constant_and_zero() {
        let mut series = Series::zero(2);
        series.constant = -0.7;
        let e = extrema(2.0, &[1, 2], &series, 0);
        assert_eq!((e.min.value, e.max.value), (-0.7, -0.7));
        assert!(e.upper_bound >= -0.7 && e.upper_bound < -0.7 + 1e-13);
        let e = extrema(2.0, &[1, 2], &series, 1);
        assert_eq!((e.lower_bound, e.upper_bound), (0.0, 0.0));
        assert_eq!(e.largest().value, 0.0);
        let (mut work, mut all) = (Vec::new(), Vec::new());
        extrema_fast(
            &Table::new(2.0, &[1, 2], 32),
            &series,
            0,
            &mut work,
            &mut all,
        );
        assert_eq!(
            all,
            [Extremum {
                time: 0.0,
                value: -0.7
            }]
        );
    }

    #[test]
    fn one_harmonic_has_known_extrema() {
        // 0.4 + 3 sin(2π·2t/4) + 4 cos(...): amplitude 5
        let series = Series {
            constant: 0.4,
            sin: vec![3.0],
            cos: vec![4.0],
        };
        for order in 0..5u32 {
            let e = extrema(4.0, &[2], &series, order);
            let (amplitude, shift) = (
                5.0 * std::f64::consts::PI.powi(order as i32),
                if order == 0 { 0.4 } else { 0.0 },
            );
            assert!((e.max.value - shift - amplitude).abs() < 1e-13 * amplitude);
            assert!((e.min.value - shift + amplitude).abs() < 1e-13 * amplitude);
        }
        let e = extrema(4.0, &[2], &series, 0);
        let first = (3f64 / 4.0).atan() / std::f64::consts::PI;
        assert!(
            [first, first + 2.0]
                .iter()
                .any(|t| (e.max.time - t).abs() < 1e-7)
        );
        let (mut work, mut all) = (Vec::new(), Vec::new());
        extrema_fast(&Table::new(4.0, &[2], 32), &series, 0, &mut work, &mut all);
        assert_eq!(all.len(), 4);
        assert!((all[0].time - first).abs() < 1e-9 && (all[0].value - 5.4).abs() < 1e-13);
    }

    #[test]
    fn flat_extrema() {
        // (1 − cos θ)² is quartic at its minimum, (1 − cos θ)³ of sixth order
        let square = Series {
            constant: 1.5,
            sin: vec![0.0; 2],
            cos: vec![-2.0, 0.5],
        };
        compare(3.0, &[1, 2], &square, 0);
        let e = extrema(3.0, &[1, 2], &square, 0);
        assert!(e.min.value.abs() < 1e-14 && (e.max.value - 4.0).abs() < 1e-14);
        let cube = Series {
            constant: 2.5,
            sin: vec![0.0; 3],
            cos: vec![-3.75, 1.5, -0.25],
        };
        compare(3.0, &[1, 2, 3], &cube, 0);
        // a double root of the derivative that is no extremum
        compare(3.0, &[1, 2, 3], &cube, 1);
    }

    #[test]
    fn not_finite() {
        let series = Series {
            constant: 0.0,
            sin: vec![f64::NAN],
            cos: vec![0.0],
        };
        assert_eq!(extrema(1.0, &[1], &series, 0).upper_bound, f64::INFINITY);
    }
}
