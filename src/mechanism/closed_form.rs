//! Kinematics in closed form over batches of samples, with their derivatives.

use super::batch::{Pass, run};
use super::dimensions::Dimensions;
use super::geometry::{Cone, Coordinates, Geometry, Kinematics, Path, Segment};
use super::scalar::{Dual, Pack, Scalar, Taylor};
use crate::dynamics::Samples;
use crate::dynamics::lanes::{Isa, Lanes};
use nalgebra::DMatrix;

/// [`Kinematics`] with `M` task coordinates as a [`Geometry`].
#[derive(Debug, Clone)]
pub struct ClosedForm<K, const M: usize>(pub K);

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
    #[inline(always)]
    fn put_angle(&mut self, to: &[usize], y: Dual<Pack<L>, M>, x: Dual<Pack<L>, M>) {
        let d = Dual::angle_slopes(y, x);
        for &i in to {
            self.put(i, Dual { v: y.v, d });
        }
    }
}

/// Some coordinates of one pose, and their rows of `D`.
struct PutRows<'a> {
    rows: &'a [usize],
    q: &'a mut [f64],
    d: &'a mut [f64],
}
impl<const M: usize> Coordinates<Dual<Pack<f64>, M>> for PutRows<'_> {
    #[inline(always)]
    fn put(&mut self, i: usize, q: Dual<Pack<f64>, M>) {
        if let Some(r) = self.rows.iter().position(|&row| row == i) {
            self.q[r] = q.v.0;
            for k in 0..M {
                self.d[r * M + k] = q.d[k].0;
            }
        }
    }
    #[inline(always)]
    fn put_angle(&mut self, to: &[usize], y: Dual<Pack<f64>, M>, x: Dual<Pack<f64>, M>) {
        if to.iter().any(|i| self.rows.contains(i)) {
            let angle = y.atan2(x);
            for &i in to {
                self.put(i, angle);
            }
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
    #[inline(always)]
    fn put_angle(
        &mut self,
        to: &[usize],
        y: Dual<Taylor<Pack<L>>, M>,
        x: Dual<Taylor<Pack<L>>, M>,
    ) {
        let d = Dual::angle_slopes(y, x);
        for &i in to {
            self.put(i, Dual { v: y.v, d });
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
    #[inline(always)]
    fn put_angle(
        &mut self,
        to: &[usize],
        y: Dual<Dual<Pack<L>, 1>, M>,
        x: Dual<Dual<Pack<L>, 1>, M>,
    ) {
        let d = Dual::angle_slopes(y, x);
        for &i in to {
            self.put(i, Dual { v: y.v, d });
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
    fn rows(&self, x: &[f64], rows: &[usize], q: &mut [f64], d: &mut [f64]) {
        let x: [Dual<Pack<f64>, M>; M] = std::array::from_fn(|k| Dual::variable(Pack(x[k]), k));
        self.0.inverse(&x, &mut PutRows { rows, q, d });
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
