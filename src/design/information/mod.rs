//! The information matrix of a trajectory and its exact derivatives.
//!
//! ```text
//! Λ(x) = Σ_t Bᵀ Y(t)ᵀ Σ⁻¹ Y(t) B        (r × r)
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
//! so the derivative of any spectral function of `Λ` costs a few inverse dynamics.

mod mechanism;
mod memory;
mod model;
mod tree;

pub use memory::Evaluation;

use crate::dynamics::{Samples, Tree};
use crate::plant::Plant;
use crate::trajectory::{Basis, Table};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use mechanism::MechanismModel;
use model::Model;
use std::sync::Arc;
use tree::TreeModel;

/// Everything about the problem that does not change while `x` does.
#[derive(Debug, Clone)]
pub struct Information<'a> {
    dof: usize,
    actuators: usize,
    tree: &'a Tree,
    count: usize,
    free: usize,
    /// `N × m` for position, velocity, acceleration
    designs: [Mat<f64>; 3],
    /// constant part of the position of each joint
    rest: Vec<f64>,
    /// `B`
    transform: Mat<f64>,
    model: Arc<dyn Model + 'a>,
}

impl<'a> Information<'a> {
    /// For a plant, a parametrisation, a period and `count` samples.
    ///
    /// `transform` is `B`, with as many rows as the plant has parameters; `torque_noise` the
    /// standard deviations of the actuators where rows are to be weighted.
    pub fn new(
        plant: &'a Plant,
        basis: &Basis,
        period: f64,
        count: usize,
        transform: Mat<f64>,
        torque_noise: Option<&[f64]>,
    ) -> Self {
        let model: Arc<dyn Model + 'a> = match plant.mechanism() {
            None => Arc::new(TreeModel::new(plant, torque_noise)),
            Some(m) => Arc::new(MechanismModel::new(m, transform.as_ref(), torque_noise)),
        };
        let table = Table::new(period, &basis.harmonics, count);
        let designs = [0, 1, 2].map(|order| {
            let d = table.design(order) * &basis.map;
            Mat::from_fn(count, basis.free(), |i, k| d[(i, k)])
        });
        Information {
            dof: plant.coordinates(),
            actuators: plant.actuated().len(),
            tree: plant.tree(),
            count,
            free: basis.free(),
            designs,
            rest: basis.offset.iter().map(|o| o[0]).collect(),
            transform,
            model,
        }
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
        self.actuators * self.count
    }

    /// Samples of a period.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Order of `Λ`.
    pub fn order(&self) -> usize {
        self.transform.ncols()
    }

    /// `B`.
    pub fn transform(&self) -> MatRef<'_, f64> {
        self.transform.as_ref()
    }

    /// The bodies and joints.
    pub fn tree(&self) -> &Tree {
        self.tree
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

    /// Evaluates the motion, the regressor and `Λ`; a motion that a closed chain cannot make gives
    /// a `Λ` of zeros.
    pub fn evaluate(&self, x: &[f64], e: &mut Evaluation) {
        self.sample(x, &mut e.motion);
        self.model.evaluate(e, self.transform.as_ref());
    }

    /// Gradients `∂(uᵀG u)/∂x` for each column `u` of `vectors` (`r × k`), as the columns of the
    /// result (`x` × `k`). Needs [`Information::evaluate`] at the same point before.
    pub fn quadratic_gradients(&self, e: &mut Evaluation, vectors: MatRef<'_, f64>) -> Mat<f64> {
        if vectors.ncols() == 0 {
            return Mat::zeros(self.len(), 0);
        }
        let d = self
            .model
            .quadratic_gradients(e, self.transform.as_ref(), vectors);
        self.contract(d, vectors.ncols())
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
