//! Interval arithmetic with outward rounding, and Taylor series of any order: bounds of the
//! kinematics over stretches of time.
//!
//! `Series<Interval, N>` evaluated with enclosures of `x, ẋ, ẍ/2, …` over a stretch gives
//! enclosures of `q, q̇, q̈/2, …` over it (Moore, Kearfott & Cloud 2009, ch. 5 and 9).

use super::scalar::Scalar;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// All numbers from `low` to `high`. Not numbers where an operation has no result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// smallest
    pub low: f64,
    /// largest
    pub high: f64,
}

impl Interval {
    /// Everything.
    const ALL: Interval = Interval {
        low: f64::NEG_INFINITY,
        high: f64::INFINITY,
    };

    /// `middle ± radius`, rounded outwards.
    pub fn around(middle: f64, radius: f64) -> Self {
        Interval::outward(middle - radius, middle + radius)
    }

    /// Rounded outwards by the last digit.
    fn outward(low: f64, high: f64) -> Self {
        Interval {
            low: low.next_down(),
            high: high.next_up(),
        }
    }

    /// The range of several values, rounded outwards by `ulps` digits; everything where one is not
    /// a number.
    fn hull(values: &[f64], ulps: u32) -> Self {
        if values.iter().any(|v| v.is_nan()) {
            return Interval::ALL;
        }
        let mut low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let mut high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        for _ in 0..ulps {
            low = low.next_down();
            high = high.next_up();
        }
        Interval { low, high }
    }

    /// Largest magnitude.
    pub fn magnitude(self) -> f64 {
        match self.low.is_nan() || self.high.is_nan() {
            true => f64::INFINITY,
            false => self.low.abs().max(self.high.abs()),
        }
    }

    /// Whether `x` lies in it.
    pub fn contains(self, x: f64) -> bool {
        x >= self.low && x <= self.high
    }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Interval::outward(self.low + o.low, self.high + o.high)
    }
}
impl Sub for Interval {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Interval::outward(self.low - o.high, self.high - o.low)
    }
}
impl Neg for Interval {
    type Output = Self;
    fn neg(self) -> Self {
        Interval {
            low: -self.high,
            high: -self.low,
        }
    }
}
impl Mul for Interval {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        let [a, b, c, d] = [self.low, self.high, o.low, o.high];
        Interval::hull(&[a * c, a * d, b * c, b * d], 1)
    }
}
impl Div for Interval {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        if o.low <= 0.0 && o.high >= 0.0 {
            return Interval::ALL;
        }
        let [a, b, c, d] = [self.low, self.high, o.low, o.high];
        Interval::hull(&[a / c, a / d, b / c, b / d], 1)
    }
}
impl Mul<f64> for Interval {
    type Output = Self;
    fn mul(self, o: f64) -> Self {
        Interval::hull(&[self.low * o, self.high * o], 1)
    }
}
impl Add<f64> for Interval {
    type Output = Self;
    fn add(self, o: f64) -> Self {
        Interval::outward(self.low + o, self.high + o)
    }
}

impl Scalar for Interval {
    fn constant(x: f64) -> Self {
        Interval { low: x, high: x }
    }

    fn sqrt(self) -> Self {
        if self.low.is_nan() || self.low < 0.0 {
            return Interval {
                low: f64::NAN,
                high: f64::NAN,
            };
        }
        Interval::outward(self.low.sqrt(), self.high.sqrt())
    }

    fn sin_cos(self) -> (Self, Self) {
        use std::f64::consts::{FRAC_PI_2, PI, TAU};
        let (a, b) = (self.low, self.high);
        // NaN and whole turns alike
        if (b - a).is_nan() || b - a >= TAU {
            let all = Interval {
                low: -1.0,
                high: 1.0,
            };
            return (all, all);
        }
        // whether a peak at `phase + k 2π` lies inside, a digit more on either side
        let peak = |phase: f64| {
            let k = ((a - phase) / TAU - 1e-12).ceil();
            phase + k * TAU <= b + 1e-12
        };
        let range = |x: f64, y: f64, top: f64, bottom: f64| {
            let mut r = Interval::hull(&[x, y], 2);
            if peak(top) {
                r.high = 1.0;
            }
            if peak(bottom) {
                r.low = -1.0;
            }
            r
        };
        (
            range(a.sin(), b.sin(), FRAC_PI_2, -FRAC_PI_2),
            range(a.cos(), b.cos(), 0.0, PI),
        )
    }

    /// Angles of all points of the box; the whole circle where it holds the origin or crosses the
    /// negative axis.
    fn atan2(self, x: Self) -> Self {
        use std::f64::consts::PI;
        let crosses = self.low <= 0.0 && self.high >= 0.0 && x.low <= 0.0;
        if crosses || self.low.is_nan() || x.low.is_nan() {
            return Interval { low: -PI, high: PI };
        }
        let corner = |y: f64, x: f64| y.atan2(x);
        let all = [
            corner(self.low, x.low),
            corner(self.low, x.high),
            corner(self.high, x.low),
            corner(self.high, x.high),
        ];
        Interval::hull(&all, 2)
    }
}

/// Taylor coefficients `Σ c_k s^k`, `k < N`.
#[derive(Debug, Clone, Copy)]
pub struct Series<S, const N: usize>(pub [S; N]);

impl<S: Scalar, const N: usize> Series<S, N> {
    fn zero() -> Self {
        Series([S::constant(0.0); N])
    }
}

impl<S: Scalar, const N: usize> Add for Series<S, N> {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Series(std::array::from_fn(|k| self.0[k] + o.0[k]))
    }
}
impl<S: Scalar, const N: usize> Sub for Series<S, N> {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Series(std::array::from_fn(|k| self.0[k] - o.0[k]))
    }
}
impl<S: Scalar, const N: usize> Neg for Series<S, N> {
    type Output = Self;
    fn neg(self) -> Self {
        Series(self.0.map(|c| -c))
    }
}
impl<S: Scalar, const N: usize> Mul for Series<S, N> {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        let mut out = Self::zero();
        for k in 0..N {
            for i in 0..=k {
                out.0[k] = out.0[k] + self.0[i] * o.0[k - i];
            }
        }
        out
    }
}
impl<S: Scalar, const N: usize> Div for Series<S, N> {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let mut out = Self::zero();
        for k in 0..N {
            let mut rest = self.0[k];
            for i in 0..k {
                rest = rest - out.0[i] * o.0[k - i];
            }
            out.0[k] = rest / o.0[0];
        }
        out
    }
}
impl<S: Scalar, const N: usize> Mul<f64> for Series<S, N> {
    type Output = Self;
    fn mul(self, o: f64) -> Self {
        Series(self.0.map(|c| c * o))
    }
}
impl<S: Scalar, const N: usize> Add<f64> for Series<S, N> {
    type Output = Self;
    fn add(mut self, o: f64) -> Self {
        self.0[0] = self.0[0] + o;
        self
    }
}

impl<S: Scalar, const N: usize> Scalar for Series<S, N> {
    fn constant(x: f64) -> Self {
        let mut out = Self::zero();
        out.0[0] = S::constant(x);
        out
    }

    fn sqrt(self) -> Self {
        let mut out = Self::zero();
        out.0[0] = self.0[0].sqrt();
        for k in 1..N {
            let mut rest = self.0[k];
            for i in 1..k {
                rest = rest - out.0[i] * out.0[k - i];
            }
            out.0[k] = rest / (out.0[0] * 2.0);
        }
        out
    }

    fn sin_cos(self) -> (Self, Self) {
        let (mut sin, mut cos) = (Self::zero(), Self::zero());
        (sin.0[0], cos.0[0]) = self.0[0].sin_cos();
        for k in 1..N {
            for i in 1..=k {
                let f = i as f64 / k as f64;
                sin.0[k] = sin.0[k] + self.0[i] * cos.0[k - i] * f;
                cos.0[k] = cos.0[k] - self.0[i] * sin.0[k - i] * f;
            }
        }
        (sin, cos)
    }

    /// From `θ' = (x y' − y x') / (x² + y²)`.
    fn atan2(self, x: Self) -> Self {
        let y = self;
        let slope = |a: &Self| {
            let mut out = Self::zero();
            for k in 0..N - 1 {
                out.0[k] = a.0[k + 1] * (k + 1) as f64;
            }
            out
        };
        let rate = (x * slope(&y) - y * slope(&x)) / (x * x + y * y);
        let mut out = Self::zero();
        out.0[0] = y.0[0].atan2(x.0[0]);
        for k in 1..N {
            out.0[k] = rate.0[k - 1] * (1.0 / k as f64);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    /// Something of everything.
    fn function<S: Scalar>(x: S) -> S {
        let (s, c) = (x * 1.7 + 0.2).sin_cos();
        let root = (x * x + 2.0).sqrt();
        (s * root + 0.3).atan2(c * c + 1.5) / (root + s * 0.5)
    }

    #[test]
    fn intervals_hold_all_values_of_the_function() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        for _ in 0..300 {
            let a: f64 = rng.random_range(-3.0..3.0);
            let b = a + rng.random_range(0.0..0.5);
            let range = function(Interval { low: a, high: b });
            for i in 0..=40 {
                let x = a + (b - a) * i as f64 / 40.0;
                let y = function(Interval::constant(x));
                assert!(y.high - y.low < 1e-12 * (1.0 + y.magnitude()));
                assert!(range.low <= y.low && range.high >= y.high, "{a} {b} {x}");
            }
        }
    }

    #[test]
    fn series_are_the_derivatives() {
        for x in [-1.3, 0.1, 2.2] {
            let mut path = Series::<Interval, 4>::constant(x);
            path.0[1] = Interval::constant(1.0);
            let s = function(path).0.map(|c| 0.5 * (c.low + c.high));
            let at = |h: f64| {
                let y = function(Interval::constant(x + h));
                0.5 * (y.low + y.high)
            };
            let h = 1e-3;
            let first = (at(h) - at(-h)) / (2.0 * h);
            let second = (at(h) - 2.0 * at(0.0) + at(-h)) / (h * h);
            let third =
                (at(2.0 * h) - 2.0 * at(h) + 2.0 * at(-h) - at(-2.0 * h)) / (2.0 * h * h * h);
            assert!((s[1] - first).abs() < 1e-5, "{} {first}", s[1]);
            assert!((2.0 * s[2] - second).abs() < 1e-4, "{} {second}", s[2]);
            assert!((6.0 * s[3] - third).abs() < 1e-2, "{} {third}", s[3]);
        }
    }

    #[test]
    fn what_has_no_result_is_not_bounded() {
        let zero = Interval {
            low: -1.0,
            high: 1.0,
        };
        assert_eq!((Interval::constant(1.0) / zero).magnitude(), f64::INFINITY);
        assert_eq!(zero.sqrt().magnitude(), f64::INFINITY);
        assert!(zero.atan2(zero).contains(3.0));
        let (s, c) = Interval::ALL.sin_cos();
        assert!(s.contains(1.0) && c.contains(-1.0));
    }
}
