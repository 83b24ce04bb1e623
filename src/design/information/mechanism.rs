//! Information matrix of a closed chain, `Λ = Bᵀ (Σ_t Yᵀ Σ⁻¹ Y) B` with `Y = Gᵀ Y_tree E`, and its
//! adjoint products.

use super::memory::Evaluation;
use super::model::{Model, sign_width};
use crate::mechanism::{Mechanism, rounded_sign};
use crate::robot::JointTerm;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};

/// A parallel robot as an information matrix sees it.
#[derive(Debug, Clone)]
pub(super) struct MechanismModel<'a> {
    mechanism: &'a Mechanism,
    /// `E B`: raw columns × order of the matrix
    transform: Mat<f64>,
    /// `1/σ_a` of each actuator
    weights: Vec<f64>,
    /// rounding of `sign(q̇)`, per coordinate
    sign_width: Vec<f64>,
}

impl<'a> MechanismModel<'a> {
    pub fn new(
        mechanism: &'a Mechanism,
        transform: MatRef<'_, f64>,
        torque_noise: Option<&[f64]>,
    ) -> Self {
        let unknowns = &mechanism.parameters;
        let mut raw = Mat::zeros(unknowns.raw_count(), transform.ncols());
        for (k, p) in unknowns.list.iter().enumerate() {
            for &r in &p.raw {
                for c in 0..transform.ncols() {
                    raw[(r, c)] += transform[(k, c)];
                }
            }
        }
        MechanismModel {
            mechanism,
            transform: raw,
            weights: match torque_noise {
                Some(s) => s.iter().map(|s| 1.0 / s).collect(),
                None => vec![1.0; mechanism.actuators()],
            },
            sign_width: sign_width(&mechanism.robot),
        }
    }
}

impl Model for MechanismModel<'_> {
    /// `Σ^{-1/2} W E B` into `e.projected` and `Λ` into `e.gram`; zeros where the motion cannot be
    /// made.
    fn evaluate(&self, e: &mut Evaluation, _transform: MatRef<'_, f64>) {
        let (na, n) = (self.mechanism.actuators(), e.motion.count);
        let order = self.transform.ncols();
        if e.projected.nrows() != na * n || e.projected.ncols() != order {
            e.projected = Mat::zeros(na * n, order);
        }
        if e.gram.nrows() != order {
            e.gram = Mat::zeros(order, order);
        }
        let raw = self.transform.nrows();
        let made = self
            .mechanism
            .raw_block(&mut e.mechanism, &e.motion, 0, n)
            .map(|w| {
                e.blocks.clear();
                e.blocks.extend_from_slice(w);
            });
        if made.is_err() {
            e.gram.fill(0.0);
            return;
        }
        let unknowns = &self.mechanism.parameters;
        let motion = &e.mechanism.motion;
        for (t, &(joint, term)) in unknowns.terms.iter().enumerate() {
            if term != JointTerm::Coulomb {
                continue;
            }
            let at = (10 * unknowns.bodies.len() + t) * na * n;
            for a in 0..na {
                for s in 0..n {
                    let g = motion.g[(joint * na + a) * n + s];
                    let qd = motion.tree.qd[joint * n + s];
                    e.blocks[at + a * n + s] = g * rounded_sign(qd, self.sign_width[joint])[0];
                }
            }
        }
        for column in e.blocks.chunks_exact_mut(na * n) {
            for (rows, w) in column.chunks_exact_mut(n).zip(&self.weights) {
                if *w != 1.0 {
                    rows.iter_mut().for_each(|x| *x *= w);
                }
            }
        }
        let w = MatRef::from_column_major_slice(&e.blocks, na * n, raw);
        let to = e.projected.as_mut();
        matmul(to, Accum::Replace, w, &self.transform, 1.0, Par::Seq);
        let a = e.projected.as_ref();
        let gram = e.gram.as_mut();
        matmul(gram, Accum::Replace, a.transpose(), a, 1.0, Par::Seq);
    }

    /// Derivatives of `uᵀ Λ u` by the samples, for each column `u`, into `e.task`.
    fn quadratic_gradients<'e>(
        &self,
        e: &'e mut Evaluation,
        _transform: MatRef<'_, f64>,
        vectors: MatRef<'_, f64>,
    ) -> [&'e [f64]; 3] {
        let (na, n, k) = (self.mechanism.actuators(), e.motion.count, vectors.ncols());
        let step = na * n;
        let phi = &self.transform * vectors;
        e.rates.resize(k * step, 0.0);
        let rates = MatMut::from_column_major_slice_mut(&mut e.rates, step, k);
        let a = e.projected.as_ref();
        matmul(rates, Accum::Replace, a, vectors, 2.0, Par::Seq);
        for rates in e.rates.chunks_exact_mut(step) {
            for (rows, w) in rates.chunks_exact_mut(n).zip(&self.weights) {
                if *w != 1.0 {
                    rows.iter_mut().for_each(|x| *x *= w);
                }
            }
        }
        e.blocks.clear();
        for v in 0..k {
            e.blocks.extend((0..phi.nrows()).map(|r| phi[(r, v)]));
        }
        e.mechanism.sign_width.clone_from(&self.sign_width);
        let done = self.mechanism.gradients(
            &mut e.mechanism,
            &e.blocks,
            &e.motion,
            &e.rates,
            &mut e.task,
        );
        if done.is_err() {
            // the motion cannot be made: it has no gradient, and its value is infinite already
            let len = k * self.mechanism.freedoms() * n;
            for d in [&mut e.task.x, &mut e.task.xd, &mut e.task.xdd] {
                d.clear();
                d.resize(len, 0.0);
            }
        }
        let d = &e.task;
        [&d.x, &d.xd, &d.xdd]
    }
}
