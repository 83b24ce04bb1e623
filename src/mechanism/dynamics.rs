//! Motion, regressor, torques and gradients of a closed chain over batches of samples.
//!
//! ```text
//! u = D_a⁺ r    S = rᵀ τ = (D u)ᵀ Γ
//! dS = (D u)ᵀ dΓ + λᵀ F_xx[u, dx] + ρᵀ F_a,xx[z, dx]
//! λ = Γ − Σ_a τ_a e_a      ρ = r − D_a u      z = D_a⁺ D_a⁺ᵀ Dᵀ Γ
//! ```
//!
//! is the derivative of a weighted sum of actuator forces; `ρ = 0` without redundant actuators.
//! Matrices of a batch are sample-fastest, as in [`Geometry`](super::geometry::Geometry).

use super::Mechanism;
use super::geometry::{Pass, run};
use super::task::{PITCH_MARGIN, Task};
use crate::dynamics::lanes::{Isa, Lanes};
use crate::dynamics::{Derivatives, Samples, Workspace};
use crate::error::{Error, Result};
use crate::regressor::term_factor;
use crate::robot::JointTerm;
use faer::Mat;
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::f64::consts::FRAC_PI_2;

/// Samples that one thread handles at a time, so that a regressor of a hexapod (6 kB a sample) is
/// written into the cache and copied from there: written straight into a large matrix, its 780
/// streams cost three times the arithmetic.
const CHUNK: usize = 64;

/// A motion of the whole mechanism.
#[derive(Debug, Clone, Default)]
pub struct ClosedMotion {
    /// all tree coordinates
    pub tree: Samples,
    /// `D = ∂q/∂x`, coordinates × task
    pub d: Vec<f64>,
    /// `D_a⁺`, task × actuators
    pub a: Vec<f64>,
    /// `G = D D_a⁺`, coordinates × actuators
    pub g: Vec<f64>,
}

/// Memory of one thread; grows once.
#[derive(Clone, Default)]
pub struct ClosedWorkspace {
    /// of the tree's kernels
    pub tree: Workspace,
    /// the motion last evaluated
    pub motion: ClosedMotion,
    d: [Vec<f64>; 3],
    derivatives: Derivatives,
    phi: Vec<f64>,
    rates: Vec<f64>,
    torque: Vec<f64>,
    u: Vec<f64>,
    z: Vec<f64>,
    curvature: Vec<f64>,
    part: Samples,
    raw: Vec<f64>,
    terms: Vec<(usize, JointTerm, f64)>,
    /// rate over which `sign(q̇)` of each coordinate is rounded in [`Mechanism::gradients`], so that
    /// Coulomb friction has a derivative; empty: it is constant between changes of sign
    pub sign_width: Vec<f64>,
}

/// `sign(v)` rounded over `w`: `v/√(v² + w²)`, and its derivative.
pub(crate) fn rounded_sign(v: f64, w: f64) -> [f64; 2] {
    let size = v * v + w * w;
    [v / size.sqrt(), w * w / size.powf(1.5)]
}

/// Gradients by the task coordinates and their two derivatives: parameter vector `v`, task
/// coordinate `k`, sample `s` at `(v·task + k)·count + s`.
#[derive(Debug, Clone, Default)]
pub struct TaskDerivatives {
    /// `∂/∂x`
    pub x: Vec<f64>,
    /// `∂/∂ẋ`
    pub xd: Vec<f64>,
    /// `∂/∂ẍ`
    pub xdd: Vec<f64>,
}

/// `A = D_a⁻¹` by Gram-Schmidt (twice, so that `Q` is orthogonal to rounding) and `G = D A`, in
/// packs: no pivot has to be chosen.
struct ActuationPass<'a, const N: usize> {
    actuated: &'a [usize],
    coordinates: usize,
    count: usize,
    d: *const f64,
    a: *mut f64,
    g: *mut f64,
}

impl<const N: usize> Pass for ActuationPass<'_, N> {
    #[inline(always)]
    unsafe fn pack<L: Lanes>(&self, s: usize) {
        let zero = L::splat(0.0);
        // columns of D_a become Q; R above its diagonal, 1/R on it
        let mut q = [[zero; N]; N];
        let mut r = [[zero; N]; N];
        // SAFETY: by the caller's promise
        unsafe {
            for k in 0..N {
                for (i, &c) in self.actuated.iter().enumerate().take(N) {
                    q[k][i] = L::load(self.d.add((c * N + k) * self.count + s));
                }
            }
        }
        for k in 0..N {
            for _ in 0..2 {
                for j in 0..k {
                    let mut dot = zero;
                    for i in 0..N {
                        dot = dot + q[j][i] * q[k][i];
                    }
                    for i in 0..N {
                        q[k][i] = q[k][i] - q[j][i] * dot;
                    }
                    r[j][k] = r[j][k] + dot;
                }
            }
            let mut norm = zero;
            for i in 0..N {
                norm = norm + q[k][i] * q[k][i];
            }
            r[k][k] = L::splat(1.0) / norm.sqrt();
            for i in 0..N {
                q[k][i] = q[k][i] * r[k][k];
            }
        }
        // rows of A = R⁻¹ Qᵀ replace Q from below
        for k in (0..N).rev() {
            for j in k + 1..N {
                for i in 0..N {
                    q[k][i] = q[k][i] - q[j][i] * r[k][j];
                }
            }
            for i in 0..N {
                q[k][i] = q[k][i] * r[k][k];
            }
        }
        // SAFETY: by the caller's promise
        unsafe {
            for k in 0..N {
                for i in 0..N {
                    q[k][i].store(self.a.add((k * N + i) * self.count + s));
                }
            }
            for c in 0..self.coordinates {
                let mut row = [zero; N];
                for k in 0..N {
                    let d = L::load(self.d.add((c * N + k) * self.count + s));
                    for i in 0..N {
                        row[i] = row[i] + d * q[k][i];
                    }
                }
                for i in 0..N {
                    row[i].store(self.g.add((c * N + i) * self.count + s));
                }
            }
        }
    }
}

/// `(AᵀA)⁻¹Aᵀ` by orthogonal triangularisation with column pivots; not numbers where the columns
/// depend on each other.
fn left_inverse(a: DMatrix<f64>) -> DMatrix<f64> {
    let (rows, columns) = a.shape();
    let singular = DMatrix::from_element(columns, rows, f64::NAN);
    if rows < columns {
        return singular;
    }
    let qr = a.col_piv_qr();
    let (q, r) = (qr.q(), qr.r());
    let pivots = r.diagonal().abs();
    let mut inverse = q.transpose();
    if pivots.min() <= 1e-13 * pivots.max() || !r.solve_upper_triangular_mut(&mut inverse) {
        return singular;
    }
    qr.p().inv_permute_rows(&mut inverse);
    inverse
}

/// Whether every number is finite.
fn finite(a: &[f64]) -> bool {
    a.iter().map(|x| x * 0.0).sum::<f64>() == 0.0
}

/// Samples `from .. to` of a motion, into memory that is reused.
pub(super) fn slice(x: &Samples, from: usize, to: usize, part: &mut Samples) {
    let n = to - from;
    part.dof = x.dof;
    part.count = n;
    for (to, source) in [
        (&mut part.q, &x.q),
        (&mut part.qd, &x.qd),
        (&mut part.qdd, &x.qdd),
    ] {
        to.clear();
        for k in 0..x.dof {
            to.extend_from_slice(&source[k * x.count + from..][..n]);
        }
    }
}

impl Mechanism {
    /// Motion of all joints, and `G`, from a motion of the task coordinates.
    ///
    /// # Errors
    /// A pose that cannot be reached or where the actuation Jacobian has no inverse: which sample
    /// and why.
    pub fn motion(&self, x: &Samples) -> Result<ClosedMotion> {
        let mut out = ClosedMotion::default();
        self.motion_into(Workspace::default().isa(), x, &mut out)?;
        Ok(out)
    }

    /// [`Mechanism::motion`] into memory that is reused.
    ///
    /// # Errors
    /// As there.
    ///
    /// # Panics
    /// If the motion has not one row for each task coordinate.
    pub fn motion_into(&self, isa: Isa, x: &Samples, out: &mut ClosedMotion) -> Result<()> {
        let (n, m, na) = (self.robot.dof(), self.freedoms(), self.actuators());
        let count = x.count;
        assert_eq!(x.dof, m, "one row for each task coordinate");
        out.tree.dof = n;
        out.tree.count = count;
        for a in [&mut out.tree.q, &mut out.tree.qd, &mut out.tree.qdd] {
            a.resize(n * count, 0.0);
        }
        out.d.resize(n * m * count, 0.0);
        out.a.resize(m * na * count, 0.0);
        out.g.resize(n * na * count, 0.0);
        if count == 0 {
            return Ok(());
        }
        if self.task == Task::Pose {
            let steep = FRAC_PI_2 - PITCH_MARGIN;
            if x.q[4 * count..5 * count].iter().any(|p| p.abs() > steep) {
                return Err(self.why_not(x, None));
            }
        }
        self.geometry.motion(isa, x, &mut out.tree, &mut out.d);
        match (m, na) {
            (1, 1) => self.actuation::<1>(isa, count, out),
            (2, 2) => self.actuation::<2>(isa, count, out),
            (3, 3) => self.actuation::<3>(isa, count, out),
            (4, 4) => self.actuation::<4>(isa, count, out),
            (6, 6) => self.actuation::<6>(isa, count, out),
            _ => self.actuation_any(count, out),
        }
        if finite(&out.tree.qdd) && finite(&out.tree.q) && finite(&out.g) {
            return Ok(());
        }
        Err(self.why_not(x, Some(out)))
    }

    /// The first sample that failed, and why.
    fn why_not(&self, x: &Samples, out: Option<&ClosedMotion>) -> Error {
        let count = x.count;
        for s in 0..count {
            let pose: Vec<f64> = (0..x.dof).map(|k| x.q[k * count + s]).collect();
            let why = self.problem(&pose).or_else(|| {
                let out = out?;
                let bad = |a: &[f64], rows: usize| (0..rows).any(|i| !a[i * count + s].is_finite());
                let n = out.tree.dof;
                if bad(&out.tree.q, n) || bad(&out.tree.qdd, n) {
                    Some("the motion is not finite there".to_string())
                } else if bad(&out.g, n * self.actuators()) {
                    Some("the actuation Jacobian is singular: σ_min = 0".to_string())
                } else {
                    None
                }
            });
            if let Some(why) = why {
                return Error::Infeasible(format!(
                    "{}: sample {s} at {} cannot be taken: {why}",
                    self.robot.name,
                    self.show(&pose)
                ));
            }
        }
        Error::Infeasible(format!("{}: the motion is not finite", self.robot.name))
    }

    /// A pose with the names of its coordinates.
    pub fn show(&self, x: &[f64]) -> String {
        let all: Vec<String> = self
            .task_names
            .iter()
            .zip(x)
            .map(|(n, v)| format!("{n} = {v:.4}"))
            .collect();
        all.join(", ")
    }

    fn actuation<const N: usize>(&self, isa: Isa, count: usize, out: &mut ClosedMotion) {
        let pass = ActuationPass::<N> {
            actuated: &self.actuated,
            coordinates: out.tree.dof,
            count,
            d: out.d.as_ptr(),
            a: out.a.as_mut_ptr(),
            g: out.g.as_mut_ptr(),
        };
        // SAFETY: the arrays were sized for N task coordinates and N actuators
        unsafe { run(isa, &pass, count) }
    }

    /// Any numbers of actuators and freedoms: pseudo-inverse sample by sample.
    fn actuation_any(&self, count: usize, out: &mut ClosedMotion) {
        let (n, m, na) = (out.tree.dof, self.freedoms(), self.actuators());
        for s in 0..count {
            let d = DMatrix::from_fn(n, m, |i, k| out.d[(i * m + k) * count + s]);
            let da = DMatrix::from_fn(na, m, |i, k| d[(self.actuated[i], k)]);
            let a = match finite(da.as_slice()) {
                true => left_inverse(da),
                false => DMatrix::from_element(m, na, f64::NAN),
            };
            let g = &d * &a;
            for k in 0..m {
                for i in 0..na {
                    out.a[(k * na + i) * count + s] = a[(k, i)];
                }
            }
            for c in 0..n {
                for i in 0..na {
                    out.g[(c * na + i) * count + s] = g[(c, i)];
                }
            }
        }
    }

    /// Regressor of the raw columns for a motion that was evaluated: actuator `a`, sample `s`,
    /// column `c` at `w[c·stride + a·row + s]`.
    ///
    /// # Panics
    /// If `w` is too short.
    pub fn raw_regressor(
        &self,
        ws: &mut Workspace,
        motion: &ClosedMotion,
        w: &mut [f64],
        stride: usize,
        row: usize,
    ) {
        let (na, count) = (self.actuators(), motion.tree.count);
        let p = &self.parameters;
        self.tree
            .projected_regressor(ws, &p.bodies, &motion.tree, &motion.g, na, w, stride, row);
        for (t, &(joint, term)) in p.terms.iter().enumerate() {
            let c = (10 * p.bodies.len() + t) * stride;
            for a in 0..na {
                let g = &motion.g[(joint * na + a) * count..][..count];
                let own = self.own_row(joint, a);
                for (s, to) in w[c + a * row..][..count].iter_mut().enumerate() {
                    let g = own.unwrap_or(g[s]);
                    *to = g * term_factor(term, motion.tree.at(joint, s));
                }
            }
        }
    }

    /// Entry of `G` where it is known to be 0 or 1: actuated coordinates without redundancy.
    fn own_row(&self, joint: usize, a: usize) -> Option<f64> {
        let i = self.actuated.iter().position(|&c| c == joint)?;
        (self.actuators() == self.freedoms()).then_some(if i == a { 1.0 } else { 0.0 })
    }

    /// Regressor of the samples `from .. to` alone, in the cache: actuator `a`, sample `s`, raw
    /// column `c` at `(c·actuators + a)·(to − from) + s` of the result. For sums over samples, such
    /// as an information matrix, that never need the whole of `W`.
    ///
    /// # Errors
    /// As [`Mechanism::motion`].
    ///
    /// # Panics
    /// If the motion does not have these samples.
    pub fn raw_block<'a>(
        &self,
        ws: &'a mut ClosedWorkspace,
        x: &Samples,
        from: usize,
        to: usize,
    ) -> Result<&'a [f64]> {
        let isa = ws.tree.isa();
        slice(x, from, to, &mut ws.part);
        self.motion_into(isa, &ws.part, &mut ws.motion)
            .map_err(|e| shifted(e, from))?;
        let n = to - from;
        let rows = self.actuators() * n;
        ws.raw.resize(rows * self.parameters.raw_count(), 0.0);
        self.raw_regressor(&mut ws.tree, &ws.motion, &mut ws.raw, rows, n);
        Ok(&ws.raw)
    }

    /// The stacked regressor `W` of a motion of the task coordinates, column by column: row
    /// `a·count + s` is actuator `a` at sample `s`, columns are
    /// [`Parameters::list`](super::Parameters). On this thread.
    ///
    /// # Errors
    /// As [`Mechanism::motion`].
    ///
    /// # Panics
    /// If `w` has not `actuators·count` rows for each parameter.
    pub fn regressor_into(
        &self,
        ws: &mut ClosedWorkspace,
        x: &Samples,
        w: &mut [f64],
    ) -> Result<()> {
        let (na, count) = (self.actuators(), x.count);
        let rows = na * count;
        assert_eq!(w.len(), rows * self.parameters.list.len(), "size of W");
        for (from, to) in self.chunks(count) {
            let part = self.raw_block(ws, x, from, to)?;
            self.scatter(part, from, to, count, |c| {
                w[c * rows..][..rows].as_mut_ptr()
            });
        }
        Ok(())
    }

    /// Copies the block of samples `from .. to` to the columns.
    fn scatter(
        &self,
        part: &[f64],
        from: usize,
        to: usize,
        count: usize,
        mut column: impl FnMut(usize) -> *mut f64,
    ) {
        let (na, n) = (self.actuators(), to - from);
        assert!(to <= count);
        for (c, p) in self.parameters.list.iter().enumerate() {
            let column = column(c);
            for a in 0..na {
                // SAFETY: columns have na·count rows, and rows from .. to of an actuator are written
                // by the one thread that has this block
                let to = unsafe { std::slice::from_raw_parts_mut(column.add(a * count + from), n) };
                for (i, &r) in p.raw.iter().enumerate() {
                    let source = &part[(r * na + a) * n..][..n];
                    match i {
                        0 => to.copy_from_slice(source),
                        _ => to.iter_mut().zip(source).for_each(|(t, s)| *t += s),
                    }
                }
            }
        }
    }

    /// [`Mechanism::regressor_into`] on all threads of the pool.
    ///
    /// # Errors
    /// As [`Mechanism::motion`].
    pub fn regressor(&self, x: &Samples) -> Result<Mat<f64>> {
        /// The matrix, shared by threads that write different rows.
        struct Columns(Vec<*mut f64>);
        // SAFETY: see above
        unsafe impl Sync for Columns {}
        impl Columns {
            fn at(&self, c: usize) -> *mut f64 {
                self.0[c]
            }
        }
        let count = x.count;
        let mut w = Mat::zeros(self.actuators() * count, self.parameters.list.len());
        let columns = Columns(
            (0..w.ncols())
                .map(|c| w.col_as_slice_mut(c).as_mut_ptr())
                .collect(),
        );
        self.chunks(count)
            .par_iter()
            .map_init(ClosedWorkspace::default, |ws, &(from, to)| {
                let part = self.raw_block(ws, x, from, to)?;
                self.scatter(part, from, to, count, |c| columns.at(c));
                Ok(())
            })
            .collect::<Vec<Result<()>>>()
            .into_iter()
            .collect::<Result<()>>()?;
        Ok(w)
    }

    /// Pieces of a batch that may be handled on their own, see [`Mechanism::raw_block`].
    pub fn chunks(&self, count: usize) -> Vec<(usize, usize)> {
        let size = match self.geometry.sequential() {
            true => count.max(1),
            false => CHUNK,
        };
        (0..count)
            .step_by(size)
            .map(|from| (from, (from + size).min(count)))
            .collect()
    }

    /// Inertial parameters of all bodies of the tree: those of `raw` for bodies with columns, and,
    /// where asked, the nominal ones of the others.
    fn tree_phi(&self, raw: &[f64], known: bool, phi: &mut Vec<f64>) {
        let start = phi.len();
        for body in &self.robot.bodies {
            match known {
                true => phi.extend(body.inertia.0),
                false => phi.extend([0.0; 10]),
            }
        }
        for (b, &body) in self.parameters.bodies.iter().enumerate() {
            phi[start + 10 * body..start + 10 * body + 10]
                .copy_from_slice(&raw[10 * b..10 * b + 10]);
        }
    }

    /// Actuator forces of the nominal model, known bodies and all joint terms included: actuator
    /// `a`, sample `s` at `a·count + s`, N or N m.
    ///
    /// # Errors
    /// As [`Mechanism::motion`].
    pub fn nominal_torque(&self, x: &Samples) -> Result<Vec<f64>> {
        let motion = self.motion(x)?;
        let phi: Vec<f64> = self.robot.bodies.iter().flat_map(|b| b.inertia.0).collect();
        let mut gamma = vec![0.0; motion.tree.dof * x.count];
        let ws = &mut Workspace::default();
        self.tree
            .inverse_dynamics(ws, &phi, &motion.tree, &mut gamma);
        for (j, joint) in self.robot.joints.iter().enumerate() {
            for (term, value) in JointTerm::ALL.into_iter().zip(joint.terms) {
                if value != 0.0 {
                    for s in 0..x.count {
                        gamma[j * x.count + s] += value * term_factor(term, motion.tree.at(j, s));
                    }
                }
            }
        }
        Ok(self.project(&motion, &gamma))
    }

    /// Actuator forces of other values of the unknowns: `τ = Y φ`, plus what the known bodies add.
    ///
    /// # Errors
    /// As [`Mechanism::motion`].
    ///
    /// # Panics
    /// If there is not one number for each parameter.
    pub fn torque(&self, x: &Samples, phi: &[f64]) -> Result<Vec<f64>> {
        let motion = self.motion(x)?;
        let raw = self.parameters.expand(phi);
        let mut all = Vec::new();
        self.tree_phi(&raw, true, &mut all);
        let mut gamma = vec![0.0; motion.tree.dof * x.count];
        let ws = &mut Workspace::default();
        self.tree
            .inverse_dynamics(ws, &all, &motion.tree, &mut gamma);
        self.add_terms(&motion, &raw, &mut gamma);
        Ok(self.project(&motion, &gamma))
    }

    /// Motion of all joints, and `G`, into the memory ([`ClosedWorkspace::motion`]).
    ///
    /// # Errors
    /// As [`Mechanism::motion`].
    pub fn evaluate_motion(&self, ws: &mut ClosedWorkspace, x: &Samples) -> Result<()> {
        let isa = ws.tree.isa();
        self.motion_into(isa, x, &mut ws.motion)
    }

    /// Actuator forces of the nominal model along the motion in the memory, in two halves: without
    /// Coulomb friction, and the most that Coulomb friction of any sign can add,
    /// `Σ_j |G_ja| F_c,j`. Each actuator-major.
    pub fn smooth_force(&self, ws: &mut ClosedWorkspace, force: &mut Vec<f64>) {
        let ClosedWorkspace {
            tree,
            motion,
            phi,
            torque,
            ..
        } = ws;
        let (na, count) = (self.actuators(), motion.tree.count);
        phi.clear();
        phi.extend(self.robot.bodies.iter().flat_map(|b| b.inertia.0));
        torque.clear();
        torque.resize(motion.tree.dof * count, 0.0);
        self.tree.inverse_dynamics(tree, phi, &motion.tree, torque);
        for (j, joint) in self.robot.joints.iter().enumerate() {
            let [armature, viscous, _, offset] = joint.terms;
            if armature != 0.0 || viscous != 0.0 || offset != 0.0 {
                for s in 0..count {
                    let [_, qd, qdd] = motion.tree.at(j, s);
                    torque[j * count + s] += armature * qdd + viscous * qd + offset;
                }
            }
        }
        force.clear();
        force.resize(2 * na * count, 0.0);
        let (smooth, friction) = force.split_at_mut(na * count);
        contract(&motion.g, torque, motion.tree.dof, na, count, smooth);
        for (j, joint) in self.robot.joints.iter().enumerate() {
            let coulomb = joint.terms[JointTerm::Coulomb as usize].abs();
            if coulomb == 0.0 {
                continue;
            }
            for a in 0..na {
                let g = &motion.g[(j * na + a) * count..][..count];
                let own = self.own_row(j, a);
                for (to, g) in friction[a * count..][..count].iter_mut().zip(g) {
                    *to += coulomb * own.unwrap_or(*g).abs();
                }
            }
        }
    }

    /// Adds the terms of raw parameters to the torques of the tree.
    fn add_terms(&self, motion: &ClosedMotion, raw: &[f64], gamma: &mut [f64]) {
        let count = motion.tree.count;
        let values = &raw[10 * self.parameters.bodies.len()..];
        for (&(joint, term), value) in self.parameters.terms.iter().zip(values) {
            for s in 0..count {
                gamma[joint * count + s] += value * term_factor(term, motion.tree.at(joint, s));
            }
        }
    }

    /// `Gᵀ Γ`.
    ///
    /// # Panics
    /// If `gamma` is too short.
    pub fn project(&self, motion: &ClosedMotion, gamma: &[f64]) -> Vec<f64> {
        let mut tau = vec![0.0; self.actuators() * motion.tree.count];
        contract(
            &motion.g,
            gamma,
            motion.tree.dof,
            self.actuators(),
            motion.tree.count,
            &mut tau,
        );
        tau
    }

    /// For each of the raw parameter vectors `φ_v` (one after another in `raw`) and rates `r_v` of
    /// the actuators the gradient of `Σ_a r_va τ_a(x, ẋ, ẍ; φ_v)`, see the head of this file.
    /// `rates` holds vector `v`, actuator `a`, sample `s` at `(v·actuators + a)·count + s`. Known
    /// bodies do not count; Coulomb friction is rounded by [`ClosedWorkspace::sign_width`].
    ///
    /// # Errors
    /// As [`Mechanism::motion`].
    ///
    /// # Panics
    /// If an array is too short.
    pub fn gradients(
        &self,
        ws: &mut ClosedWorkspace,
        raw: &[f64],
        x: &Samples,
        rates: &[f64],
        out: &mut TaskDerivatives,
    ) -> Result<()> {
        let each = self.parameters.raw_count();
        ws.phi.clear();
        ws.terms.clear();
        for raw in raw.chunks_exact(each.max(1)) {
            self.tree_phi(raw, false, &mut ws.phi);
            let values = &raw[10 * self.parameters.bodies.len()..];
            let terms = self.parameters.terms.iter().zip(values);
            ws.terms
                .extend(terms.map(|(&(joint, term), &value)| (joint, term, value)));
        }
        let vectors = raw.len() / each.max(1);
        self.gradients_of(ws, vectors, x, rates, out)
    }

    /// As [`Mechanism::gradients`], with `vectors` times the nominal model: known bodies and all
    /// joint terms count.
    ///
    /// # Errors
    /// As [`Mechanism::motion`].
    ///
    /// # Panics
    /// If `rates` is too short.
    pub fn nominal_gradients(
        &self,
        ws: &mut ClosedWorkspace,
        vectors: usize,
        x: &Samples,
        rates: &[f64],
        out: &mut TaskDerivatives,
    ) -> Result<()> {
        ws.phi.clear();
        ws.terms.clear();
        for _ in 0..vectors {
            ws.phi
                .extend(self.robot.bodies.iter().flat_map(|b| b.inertia.0));
            for (j, joint) in self.robot.joints.iter().enumerate() {
                let terms = JointTerm::ALL.into_iter().zip(joint.terms);
                ws.terms.extend(terms.map(|(term, value)| (j, term, value)));
            }
        }
        self.gradients_of(ws, vectors, x, rates, out)
    }

    /// Gradients for the bodies in `ws.phi` and the terms in `ws.terms`, both vector by vector.
    fn gradients_of(
        &self,
        ws: &mut ClosedWorkspace,
        vectors: usize,
        x: &Samples,
        rates: &[f64],
        out: &mut TaskDerivatives,
    ) -> Result<()> {
        let isa = ws.tree.isa();
        self.motion_into(isa, x, &mut ws.motion)?;
        let (n, m, na, count) = (self.robot.dof(), self.freedoms(), self.actuators(), x.count);
        assert!(rates.len() >= vectors * na * count, "rates do not fit");
        for a in &mut ws.d {
            a.resize(n * m * count, 0.0);
        }
        let [d, dqd, dqdd] = &mut ws.d;
        self.geometry.sensitivity(isa, x, d, dqd, dqdd);
        let motion = &ws.motion;

        // virtual motion of the tree, and the gradients of the tree along it
        ws.rates.clear();
        ws.rates.resize(vectors * n * count, 0.0);
        ws.u.clear();
        ws.u.resize(vectors * m * count, 0.0);
        for v in 0..vectors {
            let r = &rates[v * na * count..(v + 1) * na * count];
            let tree = &mut ws.rates[v * n * count..(v + 1) * n * count];
            spread(&motion.g, r, n, na, count, tree);
            let u = &mut ws.u[v * m * count..(v + 1) * m * count];
            spread(&motion.a, r, m, na, count, u);
        }
        self.tree.gradients(
            &mut ws.tree,
            &ws.phi,
            &motion.tree,
            &ws.rates,
            &mut ws.derivatives,
        );
        for a in [&mut out.x, &mut out.xd, &mut out.xdd] {
            a.clear();
            a.resize(vectors * m * count, 0.0);
        }
        ws.torque.resize(n * count, 0.0);
        ws.curvature.resize(n * m * count, 0.0);
        let terms_each = ws.terms.len() / vectors.max(1);
        for v in 0..vectors {
            let block = |len: usize| v * len * count..(v + 1) * len * count;
            let terms = &ws.terms[v * terms_each..(v + 1) * terms_each];
            let tree_rates = &ws.rates[block(n)];
            let (gq, gqd, gqdd) = (
                &ws.derivatives.q[block(n)],
                &mut ws.derivatives.qd[block(n)],
                &mut ws.derivatives.qdd[block(n)],
            );
            for &(joint, term, value) in terms {
                let row = joint * count..(joint + 1) * count;
                let r = &tree_rates[row.clone()];
                match term {
                    JointTerm::Armature => {
                        let to = gqdd[row].iter_mut().zip(r);
                        to.for_each(|(g, r)| *g += value * r);
                    }
                    JointTerm::Viscous => {
                        let to = gqd[row].iter_mut().zip(r);
                        to.for_each(|(g, r)| *g += value * r);
                    }
                    JointTerm::Coulomb => {
                        let Some(&w) = ws.sign_width.get(joint) else {
                            continue;
                        };
                        let to = gqd[row.clone()].iter_mut().zip(r);
                        for ((g, r), qd) in to.zip(&motion.tree.qd[row]) {
                            *g += value * r * rounded_sign(*qd, w)[1];
                        }
                    }
                    JointTerm::Offset => {}
                }
            }
            let (ox, oxd, oxdd) = (
                &mut out.x[block(m)],
                &mut out.xd[block(m)],
                &mut out.xdd[block(m)],
            );
            contract(d, gqdd, n, m, count, oxdd);
            contract(d, gqd, n, m, count, oxd);
            contract(dqd, gqdd, n, m, count, ox);
            oxd.iter_mut().zip(&*ox).for_each(|(a, b)| *a += 2.0 * b);
            ox.fill(0.0);
            contract(d, gq, n, m, count, ox);
            contract(dqd, gqd, n, m, count, ox);
            contract(dqdd, gqdd, n, m, count, ox);

            // change of G: λᵀ F_xx[u, ·]
            let bodies = 10 * self.tree.bodies();
            let phi = &ws.phi[v * bodies..(v + 1) * bodies];
            let gamma = &mut ws.torque;
            self.tree
                .inverse_dynamics(&mut ws.tree, phi, &motion.tree, gamma);
            for &(joint, term, value) in terms {
                for s in 0..count {
                    let state = motion.tree.at(joint, s);
                    let factor = match (term, ws.sign_width.get(joint)) {
                        (JointTerm::Coulomb, Some(&w)) => rounded_sign(state[1], w)[0],
                        _ => term_factor(term, state),
                    };
                    gamma[joint * count + s] += value * factor;
                }
            }
            let tau = self.project(motion, gamma);
            let u = &ws.u[block(m)];
            let redundant = na > m;
            if redundant {
                // z = D_a⁺ D_a⁺ᵀ Dᵀ Γ = D_a⁺ τ
                ws.z.clear();
                ws.z.resize(m * count, 0.0);
                spread(&motion.a, &tau, m, na, count, &mut ws.z);
            }
            for (i, &c) in self.actuated.iter().enumerate() {
                for s in 0..count {
                    gamma[c * count + s] -= tau[i * count + s];
                }
            }
            self.geometry.curvature(isa, x, u, &mut ws.curvature);
            contract(&ws.curvature, gamma, n, m, count, ox);
            if redundant {
                let r = &rates[block(na)];
                gamma.fill(0.0);
                for (i, &c) in self.actuated.iter().enumerate() {
                    for s in 0..count {
                        let along: f64 = (0..m)
                            .map(|k| motion.d[(c * m + k) * count + s] * u[k * count + s])
                            .sum();
                        gamma[c * count + s] = r[i * count + s] - along;
                    }
                }
                self.geometry.curvature(isa, x, &ws.z, &mut ws.curvature);
                contract(&ws.curvature, gamma, n, m, count, ox);
            }
        }
        Ok(())
    }
}

/// An error of sample `s` of a chunk, said of the whole.
fn shifted(e: Error, from: usize) -> Error {
    match e {
        Error::Infeasible(m) if from > 0 => {
            Error::Infeasible(format!("{m} (counted from sample {from})"))
        }
        other => other,
    }
}

/// `out_k += Σ_i M_ik x_i` sample by sample.
fn contract(matrix: &[f64], x: &[f64], n: usize, m: usize, count: usize, out: &mut [f64]) {
    for i in 0..n {
        let x = &x[i * count..][..count];
        for k in 0..m {
            let row = &matrix[(i * m + k) * count..][..count];
            let out = &mut out[k * count..][..count];
            for s in 0..count {
                out[s] += row[s] * x[s];
            }
        }
    }
}

/// `out_i += Σ_k M_ik x_k` sample by sample.
fn spread(matrix: &[f64], x: &[f64], n: usize, m: usize, count: usize, out: &mut [f64]) {
    for i in 0..n {
        for k in 0..m {
            let row = &matrix[(i * m + k) * count..][..count];
            let x = &x[k * count..][..count];
            let out = &mut out[i * count..][..count];
            for s in 0..count {
                out[s] += row[s] * x[s];
            }
        }
    }
}
