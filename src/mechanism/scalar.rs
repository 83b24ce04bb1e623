//! Numbers that carry their derivatives, so that a mechanism only states its position kinematics.
//!
//! Inverse kinematics `q = F(x)` is written once, generic over [`Scalar`], and evaluated with
//!
//! * packs of samples: positions;
//! * [`Taylor`] in time, `x + ẋ s + ẍ s²/2`: positions, velocities and accelerations;
//! * [`Dual`] in the task coordinates: the Jacobian `D = ∂F/∂x`;
//! * `Dual<Taylor<_>>`: what the accelerations depend on, for the gradient of a design.
//!
//! All of it is exact (Griewank & Walther 2008, ch. 3 and 13): no difference quotient anywhere.

use crate::dynamics::lanes::{self, Lanes};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Arithmetic of the position kinematics: a field with square roots, sines and angles.
pub trait Scalar:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Mul<f64, Output = Self>
    + Add<f64, Output = Self>
{
    /// The constant `x`.
    fn constant(x: f64) -> Self;
    /// Square root; not a number where the value is negative.
    fn sqrt(self) -> Self;
    /// Sine and cosine.
    fn sin_cos(self) -> (Self, Self);
    /// Angle of the vector `(x, self)`, rad.
    fn atan2(self, x: Self) -> Self;
}

/// A sample or a pack of samples as a scalar: `Lanes` with a sum of constants.
#[derive(Clone, Copy)]
pub struct Pack<L>(pub L);

macro_rules! pack_op {
    ($trait:ident, $f:ident, $op:tt) => {
        impl<L: Lanes> $trait for Pack<L> {
            type Output = Self;
            #[inline(always)]
            fn $f(self, o: Self) -> Self {
                Pack(self.0 $op o.0)
            }
        }
    };
}
pack_op!(Add, add, +);
pack_op!(Sub, sub, -);
pack_op!(Mul, mul, *);
pack_op!(Div, div, /);

impl<L: Lanes> Neg for Pack<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Pack(-self.0)
    }
}
impl<L: Lanes> Mul<f64> for Pack<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: f64) -> Self {
        Pack(self.0 * o)
    }
}
impl<L: Lanes> Add<f64> for Pack<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: f64) -> Self {
        Pack(self.0 + L::splat(o))
    }
}
impl<L: Lanes> Scalar for Pack<L> {
    #[inline(always)]
    fn constant(x: f64) -> Self {
        Pack(L::splat(x))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Pack(self.0.sqrt())
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = lanes::sin_cos(self.0);
        (Pack(s), Pack(c))
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        Pack(self.0.atan2(x.0))
    }
}

/// A value and its gradient with respect to `N` numbers.
#[derive(Clone, Copy)]
pub struct Dual<S, const N: usize> {
    /// value
    pub v: S,
    /// gradient
    pub d: [S; N],
}

impl<S: Scalar, const N: usize> Dual<S, N> {
    /// Variable number `i` with value `v`.
    #[inline(always)]
    pub fn variable(v: S, i: usize) -> Self {
        let mut d = [S::constant(0.0); N];
        d[i] = S::constant(1.0);
        Dual { v, d }
    }
    /// Value `v` with the gradient of this one times `f`.
    #[inline(always)]
    fn chain(self, v: S, f: S) -> Self {
        let mut d = self.d;
        for d in &mut d {
            *d = *d * f;
        }
        Dual { v, d }
    }
    /// Gradient of `atan2(y, x)`.
    #[inline(always)]
    pub fn angle_slopes(y: Self, x: Self) -> [S; N] {
        let inverse = S::constant(1.0) / (y.v * y.v + x.v * x.v);
        let (fx, fy) = (x.v * inverse, y.v * inverse);
        let mut d = y.d;
        for i in 0..N {
            d[i] = y.d[i] * fx - x.d[i] * fy;
        }
        d
    }
}

impl<S: Scalar, const N: usize> Add for Dual<S, N> {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, o: Self) -> Self {
        self.v = self.v + o.v;
        for i in 0..N {
            self.d[i] = self.d[i] + o.d[i];
        }
        self
    }
}
impl<S: Scalar, const N: usize> Sub for Dual<S, N> {
    type Output = Self;
    #[inline(always)]
    fn sub(mut self, o: Self) -> Self {
        self.v = self.v - o.v;
        for i in 0..N {
            self.d[i] = self.d[i] - o.d[i];
        }
        self
    }
}
impl<S: Scalar, const N: usize> Mul for Dual<S, N> {
    type Output = Self;
    #[inline(always)]
    fn mul(mut self, o: Self) -> Self {
        for i in 0..N {
            self.d[i] = self.d[i] * o.v + o.d[i] * self.v;
        }
        self.v = self.v * o.v;
        self
    }
}
impl<S: Scalar, const N: usize> Div for Dual<S, N> {
    type Output = Self;
    #[inline(always)]
    fn div(mut self, o: Self) -> Self {
        let inverse = S::constant(1.0) / o.v;
        self.v = self.v * inverse;
        for i in 0..N {
            self.d[i] = (self.d[i] - self.v * o.d[i]) * inverse;
        }
        self
    }
}
impl<S: Scalar, const N: usize> Neg for Dual<S, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(mut self) -> Self {
        self.v = -self.v;
        for i in 0..N {
            self.d[i] = -self.d[i];
        }
        self
    }
}
impl<S: Scalar, const N: usize> Mul<f64> for Dual<S, N> {
    type Output = Self;
    #[inline(always)]
    fn mul(mut self, o: f64) -> Self {
        self.v = self.v * o;
        for i in 0..N {
            self.d[i] = self.d[i] * o;
        }
        self
    }
}
impl<S: Scalar, const N: usize> Add<f64> for Dual<S, N> {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, o: f64) -> Self {
        self.v = self.v + o;
        self
    }
}
impl<S: Scalar, const N: usize> Scalar for Dual<S, N> {
    #[inline(always)]
    fn constant(x: f64) -> Self {
        Dual {
            v: S::constant(x),
            d: [S::constant(0.0); N],
        }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let v = self.v.sqrt();
        self.chain(v, S::constant(0.5) / v)
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.v.sin_cos();
        (self.chain(s, c), self.chain(c, -s))
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        Dual {
            v: self.v.atan2(x.v),
            d: Dual::angle_slopes(self, x),
        }
    }
}

/// Three Taylor coefficients in a parameter `s`: `a + b s + c s²`. With `s` the time, position,
/// velocity and half the acceleration.
#[derive(Clone, Copy)]
pub struct Taylor<S> {
    /// value
    pub a: S,
    /// first derivative
    pub b: S,
    /// half the second derivative
    pub c: S,
}

impl<S: Scalar> Add for Taylor<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Taylor {
            a: self.a + o.a,
            b: self.b + o.b,
            c: self.c + o.c,
        }
    }
}
impl<S: Scalar> Sub for Taylor<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Taylor {
            a: self.a - o.a,
            b: self.b - o.b,
            c: self.c - o.c,
        }
    }
}
impl<S: Scalar> Mul for Taylor<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Taylor {
            a: self.a * o.a,
            b: self.a * o.b + self.b * o.a,
            c: self.a * o.c + self.b * o.b + self.c * o.a,
        }
    }
}
impl<S: Scalar> Div for Taylor<S> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        let inverse = S::constant(1.0) / o.a;
        let a = self.a * inverse;
        let b = (self.b - a * o.b) * inverse;
        let c = (self.c - a * o.c - b * o.b) * inverse;
        Taylor { a, b, c }
    }
}
impl<S: Scalar> Neg for Taylor<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Taylor {
            a: -self.a,
            b: -self.b,
            c: -self.c,
        }
    }
}
impl<S: Scalar> Mul<f64> for Taylor<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: f64) -> Self {
        Taylor {
            a: self.a * o,
            b: self.b * o,
            c: self.c * o,
        }
    }
}
impl<S: Scalar> Add<f64> for Taylor<S> {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, o: f64) -> Self {
        self.a = self.a + o;
        self
    }
}
impl<S: Scalar> Scalar for Taylor<S> {
    #[inline(always)]
    fn constant(x: f64) -> Self {
        Taylor {
            a: S::constant(x),
            b: S::constant(0.0),
            c: S::constant(0.0),
        }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let a = self.a.sqrt();
        let half = S::constant(0.5) / a;
        let b = self.b * half;
        let c = (self.c - b * b) * half;
        Taylor { a, b, c }
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.a.sin_cos();
        let (s1, c1) = (c * self.b, -(s * self.b));
        let s2 = c * self.c + c1 * self.b * 0.5;
        let c2 = -(s * self.c + s1 * self.b * 0.5);
        (Taylor { a: s, b: s1, c: s2 }, Taylor { a: c, b: c1, c: c2 })
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        // θ' r² = x y' − y x'
        let y = self;
        let inverse = S::constant(1.0) / (x.a * x.a + y.a * y.a);
        let b = (x.a * y.b - y.a * x.b) * inverse;
        let r1 = x.a * x.b + y.a * y.b;
        let c = (x.a * y.c - y.a * x.c - b * r1) * inverse;
        Taylor {
            a: y.a.atan2(x.a),
            b,
            c,
        }
    }
}

/// Vectors and matrices of scalars.
pub(crate) mod linear {
    use super::Scalar;

    #[inline(always)]
    pub fn dot<S: Scalar>(a: [S; 3], b: [S; 3]) -> S {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }
    /// `aᵀ b` with a constant vector
    #[inline(always)]
    pub fn along<S: Scalar>(a: [S; 3], x: f64, y: f64, z: f64) -> S {
        a[0] * x + a[1] * y + a[2] * z
    }
    /// `Mᵀ a` with a constant matrix
    #[inline(always)]
    pub fn turned_back<S: Scalar>(m: &nalgebra::Matrix3<f64>, a: [S; 3]) -> [S; 3] {
        [
            along(a, m.m11, m.m21, m.m31),
            along(a, m.m12, m.m22, m.m32),
            along(a, m.m13, m.m23, m.m33),
        ]
    }
    /// `Rz(yaw) Ry(pitch) Rx(roll)`
    #[inline(always)]
    pub fn rpy<S: Scalar>(roll: S, pitch: S, yaw: S) -> [[S; 3]; 3] {
        let (sr, cr) = roll.sin_cos();
        let (sp, cp) = pitch.sin_cos();
        let (sy, cy) = yaw.sin_cos();
        let (spsr, spcr) = (sp * sr, sp * cr);
        [
            [cy * cp, cy * spsr - sy * cr, cy * spcr + sy * sr],
            [sy * cp, sy * spsr + cy * cr, sy * spcr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    }
    /// `R v` with a constant vector
    #[inline(always)]
    pub fn turned<S: Scalar>(r: &[[S; 3]; 3], v: &nalgebra::Vector3<f64>) -> [S; 3] {
        [
            along(r[0], v.x, v.y, v.z),
            along(r[1], v.x, v.y, v.z),
            along(r[2], v.x, v.y, v.z),
        ]
    }
}

#[cfg(test)]
mod tests;
