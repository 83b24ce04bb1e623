//! Inverse dynamics, the regressor and their exact derivatives, over batches of samples.
//!
//! A [`Tree`] is the immutable model, a [`Workspace`] the memory of one thread, [`Samples`]
//! (positions, velocities, accelerations of many samples, joint by joint) the input. Every
//! function writes into memory that the caller owns and allocates nothing once the workspace has
//! grown to its size; several threads may share one [`Tree`].
//!
//! ```
//! use excite::dynamics::{Samples, Tree};
//! use excite::dynamics::parts::Workspace;
//! let robot = excite::Robot::load("planar2")?;
//! let tree = Tree::new(&robot);
//! let motion = Samples::from_rows(2, &[[0.3, -0.5]], &[[1.0, 0.2]], &[[0.0, 3.0]]);
//! let mut tau = vec![0.0; 2];
//! tree.inverse_dynamics(&mut Workspace::default(), &robot.parameters(), &motion, &mut tau);
//! # assert!(tau.iter().all(|t| t.is_finite()));
//! # Ok::<(), excite::Error>(())
//! ```

mod kernel;
pub(crate) mod lanes;
pub mod parts;
pub(crate) mod point;
mod samples;
mod tree;
mod workspace;

#[doc(hidden)]
pub use lanes::Isa;
pub(crate) use parts::Derivatives;
pub use samples::Samples;
pub use tree::Tree;
pub(crate) use workspace::Workspace;

use kernel::{Gradients, Scratch, Sink};
use lanes::Lanes;
use rayon::prelude::*;

/// One run over a range of samples; implemented once for each kernel.
trait Job {
    fn tree(&self) -> &Tree;
    /// Handles the pack of `L::WIDTH` samples that starts at `i`.
    ///
    /// # Safety
    /// All of them must be samples of the job.
    unsafe fn pack<L: Lanes>(&self, i: usize, s: &mut Scratch<L>);
}

#[inline(always)]
unsafe fn sweep<L: Lanes, J: Job>(job: &J, from: usize, to: usize, s: &mut Scratch<L>) -> usize {
    s.fit(job.tree());
    let mut i = from;
    while i + L::WIDTH <= to {
        // SAFETY: i .. i + WIDTH lies in from .. to
        unsafe { job.pack::<L>(i, s) };
        i += L::WIDTH;
    }
    i
}

#[cfg(all(target_arch = "x86_64", feature = "wide"))]
#[target_feature(enable = "avx2")]
unsafe fn sweep_avx2<J: Job>(
    job: &J,
    from: usize,
    to: usize,
    s: &mut Scratch<lanes::Avx2>,
) -> usize {
    // SAFETY: the caller made sure of AVX2
    unsafe { sweep(job, from, to, s) }
}

#[cfg(all(target_arch = "x86_64", feature = "wide"))]
#[target_feature(enable = "avx512f,avx512dq")]
unsafe fn sweep_avx512<J: Job>(
    job: &J,
    from: usize,
    to: usize,
    s: &mut Scratch<lanes::Avx512>,
) -> usize {
    // SAFETY: the caller made sure of AVX-512
    unsafe { sweep(job, from, to, s) }
}

/// Runs samples `from .. to` of a job on this thread.
fn run<J: Job>(job: &J, from: usize, to: usize, ws: &mut Workspace) {
    // SAFETY: the workspace was made for an instruction set that this machine has, and all packs
    // lie within the `count` samples that the public functions have checked
    unsafe {
        let done = match ws.isa {
            Isa::Scalar => from,
            Isa::Portable => sweep(job, from, to, &mut ws.portable),
            #[cfg(all(target_arch = "x86_64", feature = "wide"))]
            Isa::Avx2 => sweep_avx2(job, from, to, &mut ws.avx2),
            #[cfg(all(target_arch = "x86_64", feature = "wide"))]
            Isa::Avx512 => {
                let done = sweep_avx512(job, from, to, &mut ws.avx512);
                sweep_avx2(job, done, to, &mut ws.avx2)
            }
        };
        sweep(job, done, to, &mut ws.one);
    }
}

/// Runs all samples of a job on the threads of the pool; each sample is written by one thread,
/// so the result does not depend on their number.
fn run_parallel<J: Job + Sync>(job: &J, count: usize) {
    const CHUNK: usize = 256;
    (0..count.div_ceil(CHUNK))
        .into_par_iter()
        .for_each_init(Workspace::default, |ws, c| {
            run(job, c * CHUNK, ((c + 1) * CHUNK).min(count), ws);
        });
}

struct RegressorJob<'a> {
    tree: &'a Tree,
    motion: &'a Samples,
    sink: Sink,
}
// SAFETY: packs of different samples are written to different places, and the memory outlives the
// run because the functions that make a job also run it
unsafe impl Sync for RegressorJob<'_> {}
impl Job for RegressorJob<'_> {
    fn tree(&self) -> &Tree {
        self.tree
    }
    #[inline(always)]
    unsafe fn pack<L: Lanes>(&self, i: usize, s: &mut Scratch<L>) {
        // SAFETY: by the caller's promise
        unsafe {
            let sink = Sink {
                base: self.sink.base.add(i),
                ..self.sink
            };
            kernel::regressor(self.tree, self.motion.pack(i), s, sink);
        }
    }
}

struct ProjectedJob<'a> {
    tree: &'a Tree,
    bodies: &'a [usize],
    motion: &'a Samples,
    g: &'a [f64],
    actuators: usize,
    sink: Sink,
}
impl Job for ProjectedJob<'_> {
    fn tree(&self) -> &Tree {
        self.tree
    }
    #[inline(always)]
    unsafe fn pack<L: Lanes>(&self, i: usize, s: &mut Scratch<L>) {
        // SAFETY: by the caller's promise
        unsafe {
            let sink = Sink {
                base: self.sink.base.add(i),
                ..self.sink
            };
            kernel::projected_regressor(
                self.tree,
                self.bodies,
                self.motion.pack(i),
                self.g.as_ptr().add(i),
                self.actuators,
                s,
                sink,
            );
        }
    }
}

struct TorqueJob<'a> {
    tree: &'a Tree,
    phi: &'a [f64],
    motion: &'a Samples,
    tau: *mut f64,
}
impl Job for TorqueJob<'_> {
    fn tree(&self) -> &Tree {
        self.tree
    }
    #[inline(always)]
    unsafe fn pack<L: Lanes>(&self, i: usize, s: &mut Scratch<L>) {
        // SAFETY: by the caller's promise
        unsafe {
            let (pack, row) = (self.motion.pack(i), self.motion.count);
            kernel::inverse_dynamics(self.tree, self.phi, pack, s, self.tau.add(i), row);
        }
    }
}

struct GradientJob<'a> {
    tree: &'a Tree,
    parameters: &'a [f64],
    each: usize,
    motion: &'a Samples,
    rates: *const f64,
    out: Gradients,
    step: usize,
}
impl Job for GradientJob<'_> {
    fn tree(&self) -> &Tree {
        self.tree
    }
    #[inline(always)]
    unsafe fn pack<L: Lanes>(&self, i: usize, s: &mut Scratch<L>) {
        // SAFETY: by the caller's promise
        unsafe {
            let out = Gradients {
                q: self.out.q.add(i),
                qd: self.out.qd.add(i),
                qdd: self.out.qdd.add(i),
                row: self.out.row,
            };
            let (pack, rates) = (self.motion.pack(i), self.rates.add(i));
            kernel::gradients(
                self.tree,
                self.parameters,
                self.each,
                pack,
                s,
                rates,
                out,
                self.step,
            );
        }
    }
}

impl Tree {
    /// Rigid-body regressor of all samples, stacked joint-major: entry of coordinate `j`, sample
    /// `i`, column `c` at `w[c * stride + j * count + i]` with `count` the samples of the motion.
    /// Columns `10·body + k`, see `inertia`.
    ///
    /// `Y_ij φ_j = v_ij·f_j + w_ij·n_j` (Atkeson, An & Hollerbach 1986, eq. 10-14).
    /// Blocks of coordinates that do not move a body are zero by structure and are **not
    /// written**: hand in memory that was zeroed once.
    ///
    /// # Panics
    /// If `w` is too short or the motion is of another robot.
    pub fn regressor(&self, ws: &mut Workspace, motion: &Samples, w: &mut [f64], stride: usize) {
        let job = self.regressor_job(motion, w, stride);
        run(&job, 0, motion.count, ws);
    }

    /// [`Tree::regressor`] in blocks: coordinate `j`, column `c`, sample `i` at
    /// `w[(j * columns + c) * count + i]`, so that the rows of one joint are a matrix of their own.
    ///
    /// # Panics
    /// If `w` is too short or the motion is of another robot.
    pub fn regressor_blocks(
        &self,
        ws: &mut Workspace,
        motion: &Samples,
        w: &mut [f64],
        columns: usize,
    ) {
        motion.check(self);
        let (dof, count) = (self.dof(), motion.count);
        assert!(columns >= 10 * self.bodies() && w.len() >= dof * columns * count);
        if self.shared {
            w[..dof * columns * count].fill(0.0);
        }
        let sink = Sink {
            base: w.as_mut_ptr(),
            column: count,
            row: columns * count,
        };
        run(
            &RegressorJob {
                tree: self,
                motion,
                sink,
            },
            0,
            count,
            ws,
        );
    }

    /// [`Tree::regressor`] on all threads of the pool.
    ///
    /// # Panics
    /// As there.
    pub fn regressor_parallel(&self, motion: &Samples, w: &mut [f64], stride: usize) {
        run_parallel(&self.regressor_job(motion, w, stride), motion.count);
    }

    fn regressor_job<'a>(
        &'a self,
        motion: &'a Samples,
        w: &mut [f64],
        stride: usize,
    ) -> RegressorJob<'a> {
        motion.check(self);
        let rows = self.dof() * motion.count;
        assert!(stride >= rows, "stride {stride} is less than {rows} rows");
        let columns = 10 * self.bodies();
        assert!(
            w.len() >= stride * (columns - 1) + rows,
            "regressor needs {columns} columns"
        );
        if self.shared {
            for c in 0..columns {
                w[c * stride..c * stride + rows].fill(0.0);
            }
        }
        let sink = Sink {
            base: w.as_mut_ptr(),
            column: stride,
            row: motion.count,
        };
        RegressorJob {
            tree: self,
            motion,
            sink,
        }
    }

    /// Rigid-body regressor of a closed chain, `Y = Gᵀ Y_tree`, for the bodies listed: entry of
    /// actuator `a`, sample `i`, column `10·b + k` (parameter `k` of body `bodies[b]`) at
    /// `w[(10·b + k)·stride + a·row + i]`. `g` holds `G = ∂q/∂q_a`: coordinate `c`, actuator `a`,
    /// sample `i` at `(c·actuators + a)·count + i`.
    ///
    /// # Panics
    /// If an array is too short, a body does not exist or the motion is of another robot.
    #[allow(clippy::too_many_arguments)]
    pub fn projected_regressor(
        &self,
        ws: &mut Workspace,
        bodies: &[usize],
        motion: &Samples,
        g: &[f64],
        actuators: usize,
        w: &mut [f64],
        stride: usize,
        row: usize,
    ) {
        motion.check(self);
        let count = motion.count;
        assert!(bodies.iter().all(|&b| b < self.bodies()), "no such body");
        assert!(g.len() >= self.dof() * actuators * count, "G is too short");
        if bodies.is_empty() || actuators == 0 || count == 0 {
            return;
        }
        assert!(
            row >= count
                && w.len() >= stride * (10 * bodies.len() - 1) + row * (actuators - 1) + count,
            "the regressor does not fit"
        );
        let sink = Sink {
            base: w.as_mut_ptr(),
            column: stride,
            row,
        };
        let job = ProjectedJob {
            tree: self,
            bodies,
            motion,
            g,
            actuators,
            sink,
        };
        run(&job, 0, count, ws);
    }

    /// Inverse dynamics of the rigid bodies: `τ = Y φ` by recursive Newton-Euler, coordinate `j`
    /// at sample `i` in `tau[j * count + i]`, N m or N. `phi` holds ten parameters a body first;
    /// what follows is ignored.
    ///
    /// # Panics
    /// If an array is too short or the motion is of another robot.
    pub fn inverse_dynamics(
        &self,
        ws: &mut Workspace,
        phi: &[f64],
        motion: &Samples,
        tau: &mut [f64],
    ) {
        motion.check(self);
        assert!(phi.len() >= 10 * self.bodies(), "ten parameters a body");
        assert!(tau.len() >= self.dof() * motion.count, "torques do not fit");
        let job = TorqueJob {
            tree: self,
            phi,
            motion,
            tau: tau.as_mut_ptr(),
        };
        run(&job, 0, motion.count, ws);
    }

    /// Adjoint product of the inverse dynamics: for each of the parameter vectors `φ_k` (in
    /// `parameters`, each `10·bodies` long) and rates `r_k` the gradient of
    /// `Σ_j r_kj τ_j(q, q̇, q̈; φ_k)` with respect to `q`, `q̇` and `q̈` of every sample, added to
    /// `out`. All arrays hold, for vector `k`, joint `j`, sample `i`, entry
    /// `(k·dof + j)·count + i`.
    ///
    /// With `r = weights · τ` this is the gradient of `½ ‖W φ‖²`: the derivative of an eigenvalue
    /// of the information matrix. Cost: kinematics once and about three inverse dynamics for
    /// each `k`.
    ///
    /// # Panics
    /// If an array is too short or the motion is of another robot.
    pub fn gradients(
        &self,
        ws: &mut Workspace,
        parameters: &[f64],
        motion: &Samples,
        rates: &[f64],
        out: &mut Derivatives,
    ) {
        motion.check(self);
        let each = 10 * self.bodies();
        let step = self.dof() * motion.count;
        let k = parameters.len() / each;
        assert!(rates.len() >= k * step, "rates for every vector and sample");
        out.resize(k * step);
        let Derivatives { q, qd, qdd } = out;
        let out = Gradients {
            q: q.as_mut_ptr(),
            qd: qd.as_mut_ptr(),
            qdd: qdd.as_mut_ptr(),
            row: motion.count,
        };
        let rates = rates.as_ptr();
        let job = GradientJob {
            tree: self,
            parameters,
            each,
            motion,
            rates,
            out,
            step,
        };
        run(&job, 0, motion.count, ws);
    }
}
