//! Several samples at once: the arithmetic that the dynamics kernels are written in.
//!
//! A kernel is generic over [`Lanes`], a pack of `f64` of which each element belongs to another
//! sample. It is compiled for one sample (`f64`), for a portable pack of four, and on x86-64 for
//! AVX2 (4 samples) and AVX-512 (8 samples), chosen at run time by [`Isa::detect`].
//!
//! Only exactly rounded operations (`+ − × ÷ √`) are used and none is fused, so that every width
//! returns **bit-identical** results: the answer does not depend on the machine. The one exception
//! is [`Lanes::atan2`], which asks the standard library lane by lane: the same bits from every
//! width, but from the mathematical library of the machine.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A pack of `WIDTH` numbers, one per sample.
pub trait Lanes:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Mul<f64, Output = Self>
{
    /// samples in a pack
    const WIDTH: usize;
    /// One number in all lanes.
    fn splat(x: f64) -> Self;
    /// Reads `WIDTH` consecutive numbers.
    ///
    /// # Safety
    /// `p .. p + WIDTH` must be readable.
    unsafe fn load(p: *const f64) -> Self;
    /// Writes `WIDTH` consecutive numbers.
    ///
    /// # Safety
    /// `p .. p + WIDTH` must be writable.
    unsafe fn store(self, p: *mut f64);
    /// Square root of every lane; not a number where it is negative.
    fn sqrt(self) -> Self;
    /// Angle of the vector `(x, self)` of every lane, rad.
    fn atan2(self, x: Self) -> Self;
}

impl Lanes for f64 {
    const WIDTH: usize = 1;
    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }
    #[inline(always)]
    unsafe fn load(p: *const f64) -> Self {
        // SAFETY: by the caller's promise
        unsafe { *p }
    }
    #[inline(always)]
    unsafe fn store(self, p: *mut f64) {
        // SAFETY: by the caller's promise
        unsafe { *p = self }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        f64::atan2(self, x)
    }
}

/// Angles lane by lane, in place of `y`.
fn angles(y: &mut [f64], x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y = y.atan2(*x);
    }
}

/// Portable pack of four.
#[derive(Clone, Copy)]
#[repr(align(32))]
pub struct Portable4([f64; 4]);

macro_rules! portable_op {
    ($trait:ident, $f:ident, $op:tt) => {
        impl $trait for Portable4 {
            type Output = Self;
            #[inline(always)]
            fn $f(self, o: Self) -> Self {
                let (a, b) = (self.0, o.0);
                Portable4([a[0] $op b[0], a[1] $op b[1], a[2] $op b[2], a[3] $op b[3]])
            }
        }
    };
}
portable_op!(Add, add, +);
portable_op!(Sub, sub, -);
portable_op!(Mul, mul, *);
portable_op!(Div, div, /);

impl Mul<f64> for Portable4 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: f64) -> Self {
        Portable4(self.0.map(|x| x * s))
    }
}
impl Neg for Portable4 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Portable4(self.0.map(|x| -x))
    }
}
impl Lanes for Portable4 {
    const WIDTH: usize = 4;
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Portable4([x; 4])
    }
    #[inline(always)]
    unsafe fn load(p: *const f64) -> Self {
        // SAFETY: by the caller's promise; arrays of f64 have the alignment of f64
        Portable4(unsafe { *(p as *const [f64; 4]) })
    }
    #[inline(always)]
    unsafe fn store(self, p: *mut f64) {
        // SAFETY: by the caller's promise
        unsafe { *(p as *mut [f64; 4]) = self.0 }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Portable4(self.0.map(f64::sqrt))
    }
    #[inline(always)]
    fn atan2(mut self, x: Self) -> Self {
        angles(&mut self.0, &x.0);
        self
    }
}

#[cfg(all(target_arch = "x86_64", feature = "wide"))]
mod x86 {
    use super::*;
    use std::arch::x86_64::*;

    macro_rules! pack {
        ($name:ident, $reg:ty, $width:literal, $add:ident, $sub:ident, $mul:ident, $div:ident,
         $sqrt:ident, $set1:ident, $load:ident, $store:ident, $doc:literal) => {
            #[doc = $doc]
            #[derive(Clone, Copy)]
            pub struct $name($reg);
            // SAFETY of all blocks below: a value of this type only exists inside the functions
            // that `Isa` dispatches to after the CPU was asked for the feature.
            impl Add for $name {
                type Output = Self;
                #[inline(always)]
                fn add(self, o: Self) -> Self {
                    $name(unsafe { $add(self.0, o.0) })
                }
            }
            impl Sub for $name {
                type Output = Self;
                #[inline(always)]
                fn sub(self, o: Self) -> Self {
                    $name(unsafe { $sub(self.0, o.0) })
                }
            }
            impl Mul for $name {
                type Output = Self;
                #[inline(always)]
                fn mul(self, o: Self) -> Self {
                    $name(unsafe { $mul(self.0, o.0) })
                }
            }
            impl Div for $name {
                type Output = Self;
                #[inline(always)]
                fn div(self, o: Self) -> Self {
                    $name(unsafe { $div(self.0, o.0) })
                }
            }
            impl Mul<f64> for $name {
                type Output = Self;
                #[inline(always)]
                fn mul(self, s: f64) -> Self {
                    $name(unsafe { $mul(self.0, $set1(s)) })
                }
            }
            impl Neg for $name {
                type Output = Self;
                #[inline(always)]
                fn neg(self) -> Self {
                    $name(unsafe { $sub($set1(-0.0), self.0) })
                }
            }
            impl Lanes for $name {
                const WIDTH: usize = $width;
                #[inline(always)]
                fn splat(x: f64) -> Self {
                    $name(unsafe { $set1(x) })
                }
                #[inline(always)]
                unsafe fn load(p: *const f64) -> Self {
                    $name(unsafe { $load(p) })
                }
                #[inline(always)]
                unsafe fn store(self, p: *mut f64) {
                    unsafe { $store(p, self.0) }
                }
                #[inline(always)]
                fn sqrt(self) -> Self {
                    $name(unsafe { $sqrt(self.0) })
                }
                #[inline(always)]
                fn atan2(self, x: Self) -> Self {
                    let (mut a, mut b) = ([0.0; $width], [0.0; $width]);
                    unsafe {
                        self.store(a.as_mut_ptr());
                        x.store(b.as_mut_ptr());
                        angles(&mut a, &b);
                        Self::load(a.as_ptr())
                    }
                }
            }
        };
    }
    pack!(
        Avx2,
        __m256d,
        4,
        _mm256_add_pd,
        _mm256_sub_pd,
        _mm256_mul_pd,
        _mm256_div_pd,
        _mm256_sqrt_pd,
        _mm256_set1_pd,
        _mm256_loadu_pd,
        _mm256_storeu_pd,
        "Four samples in an AVX2 register."
    );
    pack!(
        Avx512,
        __m512d,
        8,
        _mm512_add_pd,
        _mm512_sub_pd,
        _mm512_mul_pd,
        _mm512_div_pd,
        _mm512_sqrt_pd,
        _mm512_set1_pd,
        _mm512_loadu_pd,
        _mm512_storeu_pd,
        "Eight samples in an AVX-512 register."
    );
}
#[cfg(all(target_arch = "x86_64", feature = "wide"))]
pub use x86::{Avx2, Avx512};

/// Instruction set that a kernel is run with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Isa {
    /// one sample at a time
    Scalar,
    /// packs of four without special instructions
    Portable,
    /// packs of four
    #[cfg(all(target_arch = "x86_64", feature = "wide"))]
    Avx2,
    /// packs of eight
    #[cfg(all(target_arch = "x86_64", feature = "wide"))]
    Avx512,
}

impl Isa {
    /// The widest that this machine has.
    pub fn detect() -> Isa {
        #[cfg(all(target_arch = "x86_64", feature = "wide"))]
        {
            if std::arch::is_x86_feature_detected!("avx512f")
                && std::arch::is_x86_feature_detected!("avx512dq")
            {
                return Isa::Avx512;
            }
            if std::arch::is_x86_feature_detected!("avx2") {
                return Isa::Avx2;
            }
        }
        Isa::Portable
    }

    /// Whether this machine can run it.
    pub fn is_available(self) -> bool {
        match self {
            Isa::Scalar | Isa::Portable => true,
            #[cfg(all(target_arch = "x86_64", feature = "wide"))]
            Isa::Avx2 => std::arch::is_x86_feature_detected!("avx2"),
            #[cfg(all(target_arch = "x86_64", feature = "wide"))]
            Isa::Avx512 => {
                std::arch::is_x86_feature_detected!("avx512f")
                    && std::arch::is_x86_feature_detected!("avx512dq")
                    && std::arch::is_x86_feature_detected!("avx2")
            }
        }
    }

    /// All that this machine can run.
    pub fn available() -> Vec<Isa> {
        #[cfg_attr(not(all(target_arch = "x86_64", feature = "wide")), allow(unused_mut))]
        let mut all = vec![Isa::Scalar, Isa::Portable];
        #[cfg(all(target_arch = "x86_64", feature = "wide"))]
        {
            if std::arch::is_x86_feature_detected!("avx2") {
                all.push(Isa::Avx2);
            }
            if Isa::detect() == Isa::Avx512 {
                all.push(Isa::Avx512);
            }
        }
        all
    }

    /// Samples per pack.
    pub fn width(self) -> usize {
        match self {
            Isa::Scalar => 1,
            Isa::Portable => 4,
            #[cfg(all(target_arch = "x86_64", feature = "wide"))]
            Isa::Avx2 => 4,
            #[cfg(all(target_arch = "x86_64", feature = "wide"))]
            Isa::Avx512 => 8,
        }
    }
}

/// A 3-vector of packs.
pub type V3<L> = [L; 3];
/// A 3×3 matrix of packs, row by row.
pub type M3<L> = [V3<L>; 3];

#[inline(always)]
pub(crate) fn zero<L: Lanes>() -> V3<L> {
    [L::splat(0.0); 3]
}
/// Reads element by element: a copy of a whole array of wide packs would become a call of memcpy.
#[inline(always)]
pub(crate) fn get<L: Lanes>(a: &V3<L>) -> V3<L> {
    [a[0], a[1], a[2]]
}
/// Writes element by element, for the same reason.
#[inline(always)]
pub(crate) fn set<L: Lanes>(to: &mut V3<L>, a: V3<L>) {
    to[0] = a[0];
    to[1] = a[1];
    to[2] = a[2];
}
/// `to += a`.
#[inline(always)]
pub(crate) fn increase<L: Lanes>(to: &mut V3<L>, a: V3<L>) {
    to[0] = to[0] + a[0];
    to[1] = to[1] + a[1];
    to[2] = to[2] + a[2];
}
#[inline(always)]
pub(crate) fn add<L: Lanes>(a: V3<L>, b: V3<L>) -> V3<L> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}
#[inline(always)]
pub(crate) fn sub<L: Lanes>(a: V3<L>, b: V3<L>) -> V3<L> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
#[inline(always)]
pub(crate) fn scale<L: Lanes>(a: V3<L>, s: L) -> V3<L> {
    [a[0] * s, a[1] * s, a[2] * s]
}
#[inline(always)]
pub(crate) fn dot<L: Lanes>(a: V3<L>, b: V3<L>) -> L {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
#[inline(always)]
pub(crate) fn cross<L: Lanes>(a: V3<L>, b: V3<L>) -> V3<L> {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}
/// Constant vector in all lanes.
#[inline(always)]
pub(crate) fn splat3<L: Lanes>(a: &[f64; 3]) -> V3<L> {
    [L::splat(a[0]), L::splat(a[1]), L::splat(a[2])]
}
/// `M x`.
#[inline(always)]
pub(crate) fn mul<L: Lanes>(m: &M3<L>, x: V3<L>) -> V3<L> {
    [dot(m[0], x), dot(m[1], x), dot(m[2], x)]
}
/// `Mᵀ x`.
#[inline(always)]
pub(crate) fn mul_t<L: Lanes>(m: &M3<L>, x: V3<L>) -> V3<L> {
    [
        m[0][0] * x[0] + m[1][0] * x[1] + m[2][0] * x[2],
        m[0][1] * x[0] + m[1][1] * x[1] + m[2][1] * x[2],
        m[0][2] * x[0] + m[1][2] * x[1] + m[2][2] * x[2],
    ]
}
/// Symmetric 3×3 `[xx, xy, xz, yy, yz, zz]` times a vector.
#[inline(always)]
pub(crate) fn sym_mul<L: Lanes>(s: &[f64; 6], x: V3<L>) -> V3<L> {
    [
        x[0] * s[0] + x[1] * s[1] + x[2] * s[2],
        x[0] * s[1] + x[1] * s[3] + x[2] * s[4],
        x[0] * s[2] + x[1] * s[4] + x[2] * s[5],
    ]
}

/// Sine and cosine of every lane, within 2 units in the last place of 1 for
/// `|x| ≤ 1e5`.
///
/// `x = k π/2 + r`, `|r| ≤ π/4` by a three-part π/2 (Cody & Waite), Taylor series of `r`
/// (remainder below 1e-18), and a quarter-turn by the integers `sin(kπ/2)`, `cos(kπ/2)` written as
/// cubics in `k mod 4`, so that no lane ever branches.
#[inline(always)]
pub fn sin_cos<L: Lanes>(x: L) -> (L, L) {
    const ROUND: f64 = 6_755_399_441_055_744.0; // 1.5 · 2^52: adding it rounds to an integer
    // 2/π, and π/2 in three parts of 33 bits and a rest
    const FRAC_2_PI: f64 = std::f64::consts::FRAC_2_PI;
    const P1: f64 = 1.570_796_326_734_125_6;
    const P2: f64 = 6.077_100_506_303_966e-11;
    const P3: f64 = 2.022_266_248_795_950_7e-21;
    let big = L::splat(ROUND);
    let k = (x * FRAC_2_PI + big) - big;
    let r = ((x - k * P1) - k * P2) - k * P3;
    // k mod 4 in {-2, …, 2}, then in {0, …, 3}: m = k − 4 round(k/4), and −1 ≡ 3, −2 ≡ 2
    let m = k - ((k * 0.25 + big) - big) * 4.0;
    // sin(mπ/2) and cos(mπ/2) for the integers m = −2 … 2: odd and even polynomials
    let m2 = m * m;
    let sk = m * (L::splat(4.0) - m2) * (1.0 / 3.0);
    let ck = (L::splat(6.0) - m2 * 7.0 + m2 * m2) * (1.0 / 6.0);
    let z = r * r;
    let s = r + r
        * z
        * ((((((z * (1.0 / 355_687_428_096_000.0) - L::splat(1.0 / 1_307_674_368_000.0)) * z
            + L::splat(1.0 / 6_227_020_800.0))
            * z
            - L::splat(1.0 / 39_916_800.0))
            * z
            + L::splat(1.0 / 362_880.0))
            * z
            - L::splat(1.0 / 5_040.0))
            * z
            + L::splat(1.0 / 120.0))
        * z
        - r * z * (1.0 / 6.0);
    let c = L::splat(1.0) - z * 0.5
        + z * z
            * ((((((z * (1.0 / 20_922_789_888_000.0) - L::splat(1.0 / 87_178_291_200.0)) * z
                + L::splat(1.0 / 479_001_600.0))
                * z
                - L::splat(1.0 / 3_628_800.0))
                * z
                + L::splat(1.0 / 40_320.0))
                * z
                - L::splat(1.0 / 720.0))
                * z
                + L::splat(1.0 / 24.0));
    (s * ck + c * sk, c * ck - s * sk)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest argument that [`sin_cos`] reduces accurately.
    const SIN_COS_RANGE: f64 = 1e5;

    #[test]
    fn sin_cos_is_accurate_to_two_ulp_of_one() {
        let mut x = -SIN_COS_RANGE;
        while x < SIN_COS_RANGE {
            let (s, c) = sin_cos(x);
            assert!((s - x.sin()).abs() < 4.5e-16, "sin {x}: {s} {}", x.sin());
            assert!((c - x.cos()).abs() < 4.5e-16, "cos {x}: {c} {}", x.cos());
            x += 0.317_231_7;
        }
        for k in -40..=40 {
            for d in [-1e-9, 0.0, 1e-9] {
                let x = k as f64 * std::f64::consts::FRAC_PI_4 + d;
                let (s, c) = sin_cos(x);
                assert!(
                    (s - x.sin()).abs() < 4.5e-16 && (c - x.cos()).abs() < 4.5e-16,
                    "{x}"
                );
            }
        }
    }
}
