//! What a mechanism has to state, and what follows from it for many samples at once.
//!
//! The author of a closed-form mechanism writes [`Kinematics`]: the inverse kinematics of
//! *positions*, from the task coordinates `x` to all tree coordinates `q = F(x)`, generic over
//! [`Scalar`]. [`ClosedForm`] turns that into a [`Geometry`]: motions, Jacobians and curvatures of
//! batches, exact and in packs of samples. Mechanisms without closed form
//! implement [`Geometry`] themselves.
//!
//! With `D = ∂F/∂x`:
//!
//! ```text
//! q = F(x)     q̇ = D ẋ     q̈ = D ẍ + F_xx[ẋ, ẋ]
//! ```

use super::dimensions::Dimensions;
use super::scalar::{Dual, Pack, Scalar, Taylor};
use crate::dynamics::Samples;
#[cfg(all(target_arch = "x86_64", feature = "wide"))]
use crate::dynamics::lanes;
use crate::dynamics::lanes::{Isa, Lanes, Portable4};
use nalgebra::{DMatrix, Vector3};

/// Takes the tree coordinates one by one, in any order.
pub trait Coordinates<S> {
    /// Coordinate `i` is `q`.
    fn put(&mut self, i: usize, q: S);
}

impl<S> Coordinates<S> for [S] {
    #[inline(always)]
    fn put(&mut self, i: usize, q: S) {
        self[i] = q;
    }
}

/// Enclosures of a coordinate and its derivatives over a stretch of time, as Taylor coefficients:
/// position, velocity, half the acceleration, a sixth of the jerk, a 24th of its derivative.
pub type Path = super::interval::Series<super::interval::Interval, 5>;

/// A line between two points of the mechanism, for pictures and distances.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Segment {
    /// what it is: `leg3`, `arm1`, `platform`
    pub name: String,
    /// its ends in base axes, m
    #[serde(serialize_with = "crate::output::points")]
    pub ends: [Vector3<f64>; 2],
}

/// The cone that a passive joint opens.
#[derive(Debug, Clone, PartialEq)]
pub struct Cone {
    /// which joint
    pub name: String,
    /// angle from the middle of its range, rad
    pub angle: f64,
    /// largest angle that it allows, rad; infinite where none is stated
    pub limit: f64,
}

/// Closed-form position kinematics: the one thing that a new mechanism has to bring.
pub trait Kinematics: std::fmt::Debug + Send + Sync {
    /// Number of tree coordinates.
    fn coordinates(&self) -> usize;

    /// `q = F(x)`: all tree coordinates from the task coordinates. Where the pose cannot be reached
    /// the result is not a number (the square root of something negative).
    fn inverse<S: Scalar, C: Coordinates<S> + ?Sized>(&self, x: &[S], q: &mut C);

    /// Why a pose cannot be reached, with the number that shows it; `None` where it can.
    fn unreachable(&self, x: &[f64]) -> Option<String>;

    /// Matrix of the conditions that hold the motions which the tree leaves out (tilts of a
    /// platform that only translates, spins of hinged bars); dimensionless, singular where the
    /// mechanism loses its shape. `None` where the tree leaves out nothing.
    fn constraint_block(&self, _x: &[f64]) -> Option<DMatrix<f64>> {
        None
    }

    /// The lines of the mechanism.
    fn segments(&self, x: &[f64]) -> Vec<Segment>;

    /// Opening of the passive joints.
    fn cones(&self, _x: &[f64]) -> Vec<Cone> {
        Vec::new()
    }

    /// Its dimensions, where they can be calibrated.
    #[doc(hidden)]
    fn dimensions(&self) -> Option<Dimensions> {
        None
    }

    /// The same with the joints of its legs moved: deviations as [`Dimensions`] has them, those of zeros left out.
    /// `None` where the bodies of the tree would change with them.
    #[doc(hidden)]
    fn deformed(&self, _off: &[f64]) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }
}

/// Kinematics of batches, with their derivatives; object-safe. All arrays are sample-fastest:
/// entry `(i, k)` of sample `s` of an `n × m` matrix at `(i·m + k)·count + s`.
pub trait Geometry: std::fmt::Debug + Send + Sync {
    /// Number of tree coordinates.
    fn coordinates(&self) -> usize;

    /// Number of task coordinates.
    fn task(&self) -> usize;

    /// Positions, velocities and accelerations of all tree coordinates into `motion` (sized
    /// already), and `D` into `d`. Numbers that are not finite where a pose cannot be reached.
    fn motion(&self, isa: Isa, x: &Samples, motion: &mut Samples, d: &mut [f64]);

    /// `∂q̇/∂x` and `∂q̈/∂x` at fixed `ẋ, ẍ` (and, for use as it comes, `D`): with
    /// `∂q̇/∂ẋ = ∂q̈/∂ẍ = D` and `∂q̈/∂ẋ = 2 ∂q̇/∂x` all that a gradient needs.
    fn sensitivity(&self, isa: Isa, x: &Samples, d: &mut [f64], dqd: &mut [f64], dqdd: &mut [f64]);

    /// `F_xx[u, ·]`, the derivative of `D u` with respect to `x` at fixed `u`; `u` holds task
    /// coordinate `k` of sample `s` at `k·count + s`.
    fn curvature(&self, isa: Isa, x: &Samples, u: &[f64], out: &mut [f64]);

    /// As [`Kinematics::unreachable`].
    fn unreachable(&self, x: &[f64]) -> Option<String>;

    /// As [`Kinematics::constraint_block`].
    fn constraint_block(&self, x: &[f64]) -> Option<DMatrix<f64>>;

    /// As [`Kinematics::segments`].
    fn segments(&self, x: &[f64]) -> Vec<Segment>;

    /// As [`Kinematics::cones`].
    fn cones(&self, x: &[f64]) -> Vec<Cone>;

    /// As [`Kinematics::dimensions`].
    #[doc(hidden)]
    fn dimensions(&self) -> Option<Dimensions> {
        None
    }

    /// As [`Kinematics::deformed`].
    #[doc(hidden)]
    fn deformed(&self, _off: &[f64]) -> Option<Box<dyn Geometry>> {
        None
    }

    /// Taylor coefficients of all tree coordinates over a stretch of time, from enclosures of those
    /// of the task coordinates; `None` where the kinematics has no closed form.
    fn enclosure(&self, _x: &[Path]) -> Option<Vec<Path>> {
        None
    }

    /// Where the task coordinates are joints: which of the tree coordinates they are. `None`: the
    /// first actuators.
    fn task_joints(&self) -> Option<&[usize]> {
        None
    }

    /// Whether each sample starts from the solution of the one before, so that a batch must not be
    /// cut into pieces.
    fn sequential(&self) -> bool {
        false
    }
}

/// [`Kinematics`] with `M` task coordinates as a [`Geometry`].
#[derive(Debug, Clone)]
pub struct ClosedForm<K, const M: usize>(pub K);

/// A loop body over packs of samples.
pub(crate) trait Pass {
    /// # Safety
    /// `s .. s + L::WIDTH` must be samples of the batch.
    unsafe fn pack<L: Lanes>(&self, s: usize);
}

#[inline(always)]
unsafe fn sweep<L: Lanes, P: Pass>(pass: &P, from: usize, to: usize) -> usize {
    let mut s = from;
    while s + L::WIDTH <= to {
        // SAFETY: s .. s + WIDTH lies in from .. to
        unsafe { pass.pack::<L>(s) };
        s += L::WIDTH;
    }
    s
}

#[cfg(all(target_arch = "x86_64", feature = "wide"))]
#[target_feature(enable = "avx2")]
unsafe fn sweep_avx2<P: Pass>(pass: &P, from: usize, to: usize) -> usize {
    // SAFETY: the caller made sure of AVX2
    unsafe { sweep::<lanes::Avx2, P>(pass, from, to) }
}

#[cfg(all(target_arch = "x86_64", feature = "wide"))]
#[target_feature(enable = "avx512f,avx512dq")]
unsafe fn sweep_avx512<P: Pass>(pass: &P, from: usize, to: usize) -> usize {
    // SAFETY: the caller made sure of AVX-512
    unsafe { sweep::<lanes::Avx512, P>(pass, from, to) }
}

/// Runs a pass over `count` samples with the widest packs of `isa`.
///
/// # Safety
/// All of them must be samples of the pass.
///
/// # Panics
/// If the machine does not have these instructions.
pub(crate) unsafe fn run<P: Pass>(isa: Isa, pass: &P, count: usize) {
    assert!(isa.is_available(), "{isa:?} is not available");
    // SAFETY: the machine has the instructions
    unsafe {
        let done = match isa {
            Isa::Scalar => 0,
            Isa::Portable => sweep::<Portable4, P>(pass, 0, count),
            #[cfg(all(target_arch = "x86_64", feature = "wide"))]
            Isa::Avx2 => sweep_avx2(pass, 0, count),
            #[cfg(all(target_arch = "x86_64", feature = "wide"))]
            Isa::Avx512 => {
                let done = sweep_avx512(pass, 0, count);
                done + if count - done >= 4 {
                    sweep_avx2(pass, done, count) - done
                } else {
                    0
                }
            }
        };
        sweep::<f64, P>(pass, done, count);
    }
}

/// Where a scalar leaves its parts: an array of `rows` numbers a sample.
#[derive(Clone, Copy)]
struct Target {
    to: *mut f64,
    count: usize,
    rows: usize,
}

impl Target {
    /// Writes number `i` of the sample or pack that `to` points to.
    ///
    /// # Safety
    /// `to` must point to a pack of an array of `rows·count` numbers.
    #[inline(always)]
    unsafe fn write<L: Lanes>(self, i: usize, x: Pack<L>) {
        assert!(i < self.rows, "coordinate of another mechanism");
        // SAFETY: by the caller's promise
        unsafe { x.0.store(self.to.add(i * self.count)) }
    }
    #[inline(always)]
    unsafe fn at(self, s: usize) -> Self {
        // SAFETY: by the caller's promise
        Target {
            to: unsafe { self.to.add(s) },
            ..self
        }
    }
}

fn target(a: &mut [f64], count: usize) -> Target {
    Target {
        to: a.as_mut_ptr(),
        count,
        rows: a.len() / count.max(1),
    }
}

struct PutMotion {
    q: [Target; 3],
}
impl<L: Lanes> Coordinates<Taylor<Pack<L>>> for PutMotion {
    #[inline(always)]
    fn put(&mut self, i: usize, q: Taylor<Pack<L>>) {
        // SAFETY: the target points to the pack
        unsafe {
            self.q[0].write(i, q.a);
            self.q[1].write(i, q.b);
            self.q[2].write(i, q.c + q.c);
        }
    }
}

struct PutJacobian<const M: usize> {
    d: Target,
}
impl<L: Lanes, const M: usize> Coordinates<Dual<Pack<L>, M>> for PutJacobian<M> {
    #[inline(always)]
    fn put(&mut self, i: usize, q: Dual<Pack<L>, M>) {
        for k in 0..M {
            // SAFETY: the target points to the pack
            unsafe { self.d.write(i * M + k, q.d[k]) }
        }
    }
}

struct PutSensitivity<const M: usize> {
    d: [Target; 3],
}
impl<L: Lanes, const M: usize> Coordinates<Dual<Taylor<Pack<L>>, M>> for PutSensitivity<M> {
    #[inline(always)]
    fn put(&mut self, i: usize, q: Dual<Taylor<Pack<L>>, M>) {
        for k in 0..M {
            // SAFETY: the target points to the pack
            unsafe {
                self.d[0].write(i * M + k, q.d[k].a);
                self.d[1].write(i * M + k, q.d[k].b);
                self.d[2].write(i * M + k, q.d[k].c + q.d[k].c);
            }
        }
    }
}

struct PutCurvature<const M: usize> {
    out: Target,
}
impl<L: Lanes, const M: usize> Coordinates<Dual<Dual<Pack<L>, 1>, M>> for PutCurvature<M> {
    #[inline(always)]
    fn put(&mut self, i: usize, q: Dual<Dual<Pack<L>, 1>, M>) {
        for k in 0..M {
            // SAFETY: the target points to the pack
            unsafe { self.out.write(i * M + k, q.d[k].d[0]) }
        }
    }
}

/// Bounds that the passes rely on.
fn check<const M: usize>(n: usize, x: &Samples, matrices: &[&mut [f64]]) {
    assert_eq!(x.dof, M, "task coordinates");
    let len = M * x.count;
    assert!(x.q.len() >= len && x.qd.len() >= len && x.qdd.len() >= len);
    for a in matrices {
        assert!(a.len() >= n * M * x.count, "matrix does not fit");
    }
}

#[inline(always)]
unsafe fn load<L: Lanes>(a: &[f64], k: usize, count: usize, s: usize) -> Pack<L> {
    // SAFETY: by the caller's promise
    Pack(unsafe { L::load(a.as_ptr().add(k * count + s)) })
}

#[inline(always)]
unsafe fn load_path<L: Lanes>(x: &Samples, k: usize, s: usize) -> Taylor<Pack<L>> {
    // SAFETY: by the caller's promise
    unsafe {
        Taylor {
            a: load(&x.q, k, x.count, s),
            b: load(&x.qd, k, x.count, s),
            c: load::<L>(&x.qdd, k, x.count, s) * 0.5,
        }
    }
}

struct MotionPass<'a, K, const M: usize> {
    k: &'a K,
    x: &'a Samples,
    motion: [Target; 3],
    d: Target,
}
impl<K: Kinematics, const M: usize> Pass for MotionPass<'_, K, M> {
    #[inline(always)]
    unsafe fn pack<L: Lanes>(&self, s: usize) {
        // SAFETY: by the caller's promise
        unsafe {
            let zero = Taylor::<Pack<L>>::constant(0.0);
            let mut path = [zero; M];
            let mut x = [Dual::<Pack<L>, M>::constant(0.0); M];
            for k in 0..M {
                path[k] = load_path(self.x, k, s);
                x[k] = Dual::variable(path[k].a, k);
            }
            let [a, b, c] = self.motion;
            let mut q = PutMotion {
                q: [a.at(s), b.at(s), c.at(s)],
            };
            self.k.inverse(&path, &mut q);
            let mut d = PutJacobian::<M> { d: self.d.at(s) };
            self.k.inverse(&x, &mut d);
        }
    }
}

struct SensitivityPass<'a, K, const M: usize> {
    k: &'a K,
    x: &'a Samples,
    d: [Target; 3],
}
impl<K: Kinematics, const M: usize> Pass for SensitivityPass<'_, K, M> {
    #[inline(always)]
    unsafe fn pack<L: Lanes>(&self, s: usize) {
        // SAFETY: by the caller's promise
        unsafe {
            let mut x = [Dual::<Taylor<Pack<L>>, M>::constant(0.0); M];
            for k in 0..M {
                x[k] = Dual::variable(load_path(self.x, k, s), k);
            }
            let [a, b, c] = self.d;
            let mut d = PutSensitivity::<M> {
                d: [a.at(s), b.at(s), c.at(s)],
            };
            self.k.inverse(&x, &mut d);
        }
    }
}

struct CurvaturePass<'a, K, const M: usize> {
    k: &'a K,
    x: &'a Samples,
    u: &'a [f64],
    out: Target,
}
impl<K: Kinematics, const M: usize> Pass for CurvaturePass<'_, K, M> {
    #[inline(always)]
    unsafe fn pack<L: Lanes>(&self, s: usize) {
        // SAFETY: by the caller's promise
        unsafe {
            let mut x = [Dual::<Dual<Pack<L>, 1>, M>::constant(0.0); M];
            for k in 0..M {
                let v = Dual {
                    v: load(&self.x.q, k, self.x.count, s),
                    d: [load(self.u, k, self.x.count, s)],
                };
                x[k] = Dual::variable(v, k);
            }
            let mut out = PutCurvature::<M> {
                out: self.out.at(s),
            };
            self.k.inverse(&x, &mut out);
        }
    }
}

impl<K: Kinematics + 'static, const M: usize> Geometry for ClosedForm<K, M> {
    fn coordinates(&self) -> usize {
        self.0.coordinates()
    }
    fn task(&self) -> usize {
        M
    }
    fn motion(&self, isa: Isa, x: &Samples, motion: &mut Samples, d: &mut [f64]) {
        let n = self.0.coordinates();
        check::<M>(n, x, &[&mut *d]);
        assert_eq!((motion.dof, motion.count), (n, x.count), "motion");
        let Samples { q, qd, qdd, .. } = motion;
        assert!([&q, &qd, &qdd].iter().all(|a| a.len() >= n * x.count));
        let pass = MotionPass::<K, M> {
            k: &self.0,
            x,
            motion: [q, qd, qdd].map(|a| target(a, x.count)),
            d: target(d, x.count),
        };
        // SAFETY: the lengths were checked
        unsafe { run(isa, &pass, x.count) }
    }
    fn sensitivity(&self, isa: Isa, x: &Samples, d: &mut [f64], dqd: &mut [f64], dqdd: &mut [f64]) {
        check::<M>(self.0.coordinates(), x, &[&mut *d, &mut *dqd, &mut *dqdd]);
        let pass = SensitivityPass::<K, M> {
            k: &self.0,
            x,
            d: [d, dqd, dqdd].map(|a| target(a, x.count)),
        };
        // SAFETY: the lengths were checked
        unsafe { run(isa, &pass, x.count) }
    }
    fn curvature(&self, isa: Isa, x: &Samples, u: &[f64], out: &mut [f64]) {
        check::<M>(self.0.coordinates(), x, &[&mut *out]);
        assert!(u.len() >= M * x.count, "direction");
        let pass = CurvaturePass::<K, M> {
            k: &self.0,
            x,
            u,
            out: target(out, x.count),
        };
        // SAFETY: the lengths were checked
        unsafe { run(isa, &pass, x.count) }
    }
    fn unreachable(&self, x: &[f64]) -> Option<String> {
        self.0.unreachable(x)
    }
    fn constraint_block(&self, x: &[f64]) -> Option<DMatrix<f64>> {
        self.0.constraint_block(x)
    }
    fn segments(&self, x: &[f64]) -> Vec<Segment> {
        self.0.segments(x)
    }
    fn enclosure(&self, x: &[Path]) -> Option<Vec<Path>> {
        let mut q = vec![Path::constant(f64::NAN); self.0.coordinates()];
        self.0.inverse::<Path, [Path]>(x, q.as_mut_slice());
        Some(q)
    }
    fn cones(&self, x: &[f64]) -> Vec<Cone> {
        self.0.cones(x)
    }
    fn dimensions(&self) -> Option<Dimensions> {
        self.0.dimensions()
    }

    fn deformed(&self, off: &[f64]) -> Option<Box<dyn Geometry>> {
        let other: Box<dyn Geometry> = Box::new(ClosedForm::<K, M>(self.0.deformed(off)?));
        Some(other)
    }
}
