//! The information matrix of a trajectory and its exact derivatives.
//!
//! ```text
//! G(x) = Σ_t Bᵀ Y(t)ᵀ Σ⁻¹ Y(t) B        (r × r)
//! ```
//!
//! over `N` uniform samples of one period, with `B` (`p × r`) choosing the coordinates in which
//! the parameters are judged (kept columns, or an orthonormal basis of the row space) and `Σ` the
//! torque noise of the joints (1 where not asked for). `x` holds the free numbers of the Fourier
//! series ([`Basis`]).
//!
//! For a vector `u` the derivative of the quadratic form is an adjoint product of the inverse
//! dynamics of a robot with parameters `B u`:
//!
//! ```text
//! ∂(uᵀG u)/∂x = 2 Σ_t (∂(Y B u)/∂x)ᵀ Σ⁻¹ Y B u
//! ```
//!
//! so the derivative of any spectral function of `G` costs a few inverse dynamics.

use super::closed::ClosedModel;
use crate::dynamics::{Derivatives, Samples, Tree, Workspace};
use crate::mechanism::{ClosedWorkspace, Mechanism, TaskDerivatives};
use crate::robot::{Column, JointTerm, Robot};
use crate::trajectory::{Basis, Table};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};

/// Everything about the problem that does not change while `x` does.
#[derive(Debug, Clone)]
pub struct Information<'a> {
    dof: usize,
    count: usize,
    free: usize,
    /// `N × m` for position, velocity, acceleration
    designs: [Mat<f64>; 3],
    /// constant part of the position of each joint
    rest: Vec<f64>,
    /// `B`
    transform: Mat<f64>,
    model: Model<'a>,
}

/// What moves.
#[derive(Debug, Clone)]
enum Model<'a> {
    Tree(TreeModel),
    Closed(ClosedModel<'a>),
}

/// A serial or tree robot.
#[derive(Debug, Clone)]
struct TreeModel {
    tree: Tree,
    columns: usize,
    /// joint term columns: (column, joint, term)
    terms: Vec<(usize, usize, JointTerm)>,
    /// bodies that joint `j` moves lie in this range
    active: Vec<(usize, usize)>,
    /// `1/σ_j²`
    weights: Vec<f64>,
    /// width over which `sign(q̇)` is rounded, per joint
    sign_width: Vec<f64>,
}

/// Width over which `sign(q̇)` is rounded, so that it has a derivative: a hundredth of the velocity
/// limit, 0.02 rad/s or m/s where there is none.
pub(super) fn sign_width(robot: &Robot) -> Vec<f64> {
    robot
        .joints
        .iter()
        .map(|j| match j.limits.velocity.is_finite() {
            true => 0.01 * j.limits.velocity,
            false => 0.02,
        })
        .collect()
}

/// Memory of one evaluation; grows once.
#[derive(Clone)]
pub struct Evaluation {
    /// the motion at the samples
    pub motion: Samples,
    /// `G`, lower triangle and upper
    pub gram: Mat<f64>,
    ws: Workspace,
    pub(super) blocks: Vec<f64>,
    full: Mat<f64>,
    pub(super) rates: Vec<f64>,
    phi: Vec<f64>,
    derivatives: Derivatives,
    /// of closed chains
    pub(super) closed: ClosedWorkspace,
    pub(super) task: TaskDerivatives,
    pub(super) projected: Mat<f64>,
}

impl Default for Evaluation {
    fn default() -> Self {
        Evaluation {
            motion: Samples::default(),
            gram: Mat::new(),
            ws: Workspace::default(),
            blocks: Vec::new(),
            full: Mat::new(),
            rates: Vec::new(),
            phi: Vec::new(),
            derivatives: Derivatives::default(),
            closed: ClosedWorkspace::default(),
            task: TaskDerivatives::default(),
            projected: Mat::new(),
        }
    }
}

impl<'a> Information<'a> {
    /// For a closed chain: `transform` has as many rows as the mechanism has parameters,
    /// `torque_noise` is that of its actuators, where rows are to be weighted.
    pub fn closed(
        mechanism: &'a Mechanism,
        basis: &Basis,
        period: f64,
        count: usize,
        transform: Mat<f64>,
        torque_noise: Option<&[f64]>,
    ) -> Self {
        let model = ClosedModel::new(mechanism, transform.as_ref(), torque_noise);
        let dof = mechanism.freedoms();
        Self::assemble(dof, basis, period, count, transform, Model::Closed(model))
    }

    fn assemble(
        dof: usize,
        basis: &Basis,
        period: f64,
        count: usize,
        transform: Mat<f64>,
        model: Model<'a>,
    ) -> Self {
        let table = Table::new(period, &basis.harmonics, count);
        let designs = [0, 1, 2].map(|order| {
            let d = table.design(order) * &basis.map;
            Mat::from_fn(count, basis.free(), |i, k| d[(i, k)])
        });
        Information {
            dof,
            count,
            free: basis.free(),
            designs,
            rest: basis.offset.iter().map(|o| o[0]).collect(),
            transform,
            model,
        }
    }

    /// For a robot, a parametrisation, a period and `count` samples.
    ///
    /// `transform` is `B`, with as many rows as the robot has columns; `torque_noise` the
    /// standard deviations where rows are to be weighted.
    pub fn new(
        robot: &Robot,
        basis: &Basis,
        period: f64,
        count: usize,
        transform: Mat<f64>,
        torque_noise: Option<&[f64]>,
    ) -> Self {
        let tree = Tree::new(robot);
        let dof = robot.dof();
        let active = (0..dof)
            .map(|j| {
                let moved = || (0..tree.bodies()).filter(|&b| tree.moves(j, b));
                (
                    moved().min().unwrap_or(0),
                    moved().max().map_or(0, |b| b + 1),
                )
            })
            .collect();
        let terms = robot
            .columns()
            .into_iter()
            .enumerate()
            .filter_map(|(c, column)| match column {
                Column::Term { joint, term } => Some((c, joint, term)),
                Column::Inertial { .. } => None,
            })
            .collect();
        let model = TreeModel {
            columns: robot.parameter_count(),
            terms,
            active,
            weights: match torque_noise {
                Some(s) => s.iter().map(|s| 1.0 / (s * s)).collect(),
                None => vec![1.0; dof],
            },
            sign_width: sign_width(robot),
            tree,
        };
        Self::assemble(dof, basis, period, count, transform, Model::Tree(model))
    }

    /// Length of `x`.
    pub fn len(&self) -> usize {
        self.dof * self.free
    }

    /// Never true.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Rows of `W`: samples times actuators.
    pub fn rows(&self) -> usize {
        match &self.model {
            Model::Tree(_) => self.dof * self.count,
            Model::Closed(c) => c.mechanism().actuators() * self.count,
        }
    }

    /// Samples of a period.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Order of `G`.
    pub fn order(&self) -> usize {
        self.transform.ncols()
    }

    /// `B`.
    pub fn transform(&self) -> MatRef<'_, f64> {
        self.transform.as_ref()
    }

    /// The flattened robot; of a closed chain its tree.
    pub fn tree(&self) -> &Tree {
        match &self.model {
            Model::Tree(t) => &t.tree,
            Model::Closed(c) => c.mechanism().tree(),
        }
    }

    /// Positions, velocities and accelerations at the samples.
    pub fn sample(&self, x: &[f64], motion: &mut Samples) {
        if motion.count != self.count || motion.dof != self.dof {
            *motion = Samples::zeros(self.dof, self.count);
        }
        let x = MatRef::from_column_major_slice(x, self.free, self.dof);
        for (design, out) in
            self.designs
                .iter()
                .zip([&mut motion.q, &mut motion.qd, &mut motion.qdd])
        {
            let out = MatMut::from_column_major_slice_mut(out, self.count, self.dof);
            matmul(out, Accum::Replace, design, x, 1.0, Par::Seq);
        }
        for (j, rest) in self.rest.iter().enumerate() {
            motion.q[j * self.count..(j + 1) * self.count]
                .iter_mut()
                .for_each(|q| *q += rest);
        }
    }

    /// Evaluates the motion, the regressor and `G`; a motion that a closed chain cannot make gives
    /// a `G` of zeros.
    pub fn evaluate(&self, x: &[f64], e: &mut Evaluation) {
        self.sample(x, &mut e.motion);
        let model = match &self.model {
            Model::Tree(model) => model,
            Model::Closed(model) => return model.evaluate(e),
        };
        let (n, p, c) = (self.count, model.columns, self.dof);
        e.blocks.resize(n * p * c, 0.0);
        model
            .tree
            .regressor_blocks(&mut e.ws, &e.motion, &mut e.blocks, p);
        for &(column, joint, term) in &model.terms {
            let at = (joint * p + column) * n;
            for i in 0..n {
                e.blocks[at + i] = model.factor(joint, term, e.motion.at(joint, i));
            }
        }
        if e.full.nrows() != p {
            e.full = Mat::zeros(p, p);
        } else {
            e.full.fill(0.0);
        }
        for j in 0..c {
            let block =
                MatRef::from_column_major_slice(&e.blocks[j * p * n..(j + 1) * p * n], n, p);
            let (from, to) = (10 * model.active[j].0, 10 * model.active[j].1);
            let bodies = block.subcols(from, to - from);
            let w = model.weights[j];
            let size = to - from;
            let target = e.full.as_mut().submatrix_mut(from, from, size, size);
            matmul(target, Accum::Add, bodies.transpose(), bodies, w, Par::Seq);
            let own = model.terms.iter().filter(|t| t.1 == j);
            for &(column, ..) in own.clone() {
                let x = block.col(column);
                for k in from..to {
                    let s = w * (block.col(k).transpose() * x);
                    e.full[(k, column)] = s;
                    e.full[(column, k)] = s;
                }
                for &(other, ..) in own.clone() {
                    e.full[(column, other)] = w * (block.col(other).transpose() * x);
                }
            }
        }
        let half = &e.full * &self.transform;
        e.gram = self.transform.transpose() * half;
    }

    /// Gradients `∂(uᵀG u)/∂x` for each column `u` of `vectors` (`r × k`), as the columns of the
    /// result (`x` × `k`). Needs [`Information::evaluate`] at the same point before.
    pub fn quadratic_gradients(&self, e: &mut Evaluation, vectors: MatRef<'_, f64>) -> Mat<f64> {
        let model = match &self.model {
            Model::Tree(model) => model,
            Model::Closed(model) => {
                model.quadratic_gradients(e, vectors);
                let d = &e.task;
                return self.contract([&d.x, &d.xd, &d.xdd], vectors.ncols());
            }
        };
        let (n, p, k) = (self.count, model.columns, vectors.ncols());
        let step = n * self.dof;
        let phi = &self.transform * vectors;
        e.rates.resize(k * step, 0.0);
        for j in 0..self.dof {
            let block =
                MatRef::from_column_major_slice(&e.blocks[j * p * n..(j + 1) * p * n], n, p);
            let (from, to) = (10 * model.active[j].0, 10 * model.active[j].1);
            let at = &mut e.rates[j * n..];
            let out = MatMut::from_column_major_slice_with_stride_mut(at, n, k, step);
            let (w, bodies) = (2.0 * model.weights[j], block.subcols(from, to - from));
            matmul(
                out,
                Accum::Replace,
                bodies,
                phi.subrows(from, to - from),
                w,
                Par::Seq,
            );
            for &(column, ..) in model.terms.iter().filter(|t| t.1 == j) {
                for v in 0..k {
                    let f = w * phi[(column, v)];
                    for i in 0..n {
                        e.rates[v * step + j * n + i] += f * block[(i, column)];
                    }
                }
            }
        }
        let inertial = 10 * model.tree.bodies();
        e.phi.clear();
        for v in 0..k {
            e.phi.extend((0..inertial).map(|c| phi[(c, v)]));
        }
        model
            .tree
            .gradients(&mut e.ws, &e.phi, &e.motion, &e.rates, &mut e.derivatives);
        for &(column, joint, term) in &model.terms {
            for v in 0..k {
                let f = phi[(column, v)];
                let at = v * step + joint * n;
                for i in 0..n {
                    let r = f * e.rates[at + i];
                    match term {
                        JointTerm::Armature => e.derivatives.qdd[at + i] += r,
                        JointTerm::Viscous => e.derivatives.qd[at + i] += r,
                        JointTerm::Coulomb => {
                            let s = model.sign_width[joint];
                            let v = e.motion.qd[joint * n + i];
                            e.derivatives.qd[at + i] += r * s * s / (v * v + s * s).powf(1.5);
                        }
                        JointTerm::Offset => {}
                    }
                }
            }
        }
        let d = &e.derivatives;
        self.contract([&d.q, &d.qd, &d.qdd], k)
    }

    /// Chain rule from samples to `x`: `Σ_i D_0ᵀ ∂/∂q + D_1ᵀ ∂/∂q̇ + D_2ᵀ ∂/∂q̈`.
    fn contract(&self, d: [&[f64]; 3], k: usize) -> Mat<f64> {
        let mut out = Mat::zeros(self.free, self.dof * k);
        for (design, g) in self.designs.iter().zip(d) {
            let g = MatRef::from_column_major_slice(g, self.count, self.dof * k);
            matmul(
                out.as_mut(),
                Accum::Add,
                design.transpose(),
                g,
                1.0,
                Par::Seq,
            );
        }
        let m = self.free;
        Mat::from_fn(self.len(), k, |i, v| out[(i % m, v * self.dof + i / m)])
    }

    /// Chain rule of one sample: gradient with respect to `x` of a scalar at sample `i`, from its
    /// derivatives by position, velocity and acceleration of each coordinate.
    pub fn pull_back(&self, i: usize, d: [&[f64]; 3]) -> Vec<f64> {
        let mut out = vec![0.0; self.len()];
        for (design, g) in self.designs.iter().zip(d) {
            for (j, g) in g.iter().enumerate() {
                if *g != 0.0 {
                    for k in 0..self.free {
                        out[j * self.free + k] += design[(i, k)] * g;
                    }
                }
            }
        }
        out
    }
}

impl TreeModel {
    /// Factor of a joint column, with the sign function rounded so that it has a derivative.
    fn factor(&self, joint: usize, term: JointTerm, state: [f64; 3]) -> f64 {
        match term {
            JointTerm::Coulomb => {
                let s = self.sign_width[joint];
                state[1] / (state[1] * state[1] + s * s).sqrt()
            }
            _ => crate::regressor::term_factor(term, state),
        }
    }
}
