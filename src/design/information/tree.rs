//! Information matrix of a tree: only the bodies that a joint moves have entries in its rows.

use super::memory::Evaluation;
use super::model::{Model, sign_width};
use crate::dynamics::Tree;
use crate::plant::Plant;
use crate::regressor::term_factor;
use crate::robot::{Column, JointTerm};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};

/// A serial or tree robot.
#[derive(Debug, Clone)]
pub(super) struct TreeModel {
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

impl TreeModel {
    /// `torque_noise`: standard deviations, where rows are to be weighted.
    pub fn new(plant: &Plant, torque_noise: Option<&[f64]>) -> Self {
        let (robot, tree) = (plant.robot(), plant.tree());
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
                _ => None,
            })
            .collect();
        TreeModel {
            columns: robot.parameter_count(),
            terms,
            active,
            weights: match torque_noise {
                Some(s) => s.iter().map(|s| 1.0 / (s * s)).collect(),
                None => vec![1.0; dof],
            },
            sign_width: sign_width(robot),
            tree: tree.clone(),
        }
    }

    /// Factor of a joint column, with the sign function rounded so that it has a derivative.
    fn factor(&self, joint: usize, term: JointTerm, state: [f64; 3]) -> f64 {
        match term {
            JointTerm::Coulomb => {
                let s = self.sign_width[joint];
                state[1] / (state[1] * state[1] + s * s).sqrt()
            }
            _ => term_factor(term, state),
        }
    }
}

impl Model for TreeModel {
    fn evaluate(&self, e: &mut Evaluation, transform: MatRef<'_, f64>) {
        let (n, p, c) = (e.motion.count, self.columns, e.motion.dof);
        e.blocks.resize(n * p * c, 0.0);
        self.tree
            .regressor_blocks(&mut e.ws, &e.motion, &mut e.blocks, p);
        for &(column, joint, term) in &self.terms {
            let at = (joint * p + column) * n;
            for i in 0..n {
                e.blocks[at + i] = self.factor(joint, term, e.motion.at(joint, i));
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
            let (from, to) = (10 * self.active[j].0, 10 * self.active[j].1);
            let bodies = block.subcols(from, to - from);
            let w = self.weights[j];
            let size = to - from;
            let target = e.full.as_mut().submatrix_mut(from, from, size, size);
            matmul(target, Accum::Add, bodies.transpose(), bodies, w, Par::Seq);
            let own = self.terms.iter().filter(|t| t.1 == j);
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
        let half = &e.full * transform;
        e.gram = transform.transpose() * half;
    }

    fn quadratic_gradients<'e>(
        &self,
        e: &'e mut Evaluation,
        transform: MatRef<'_, f64>,
        vectors: MatRef<'_, f64>,
    ) -> [&'e [f64]; 3] {
        let (n, p, k) = (e.motion.count, self.columns, vectors.ncols());
        let step = n * e.motion.dof;
        let phi = transform * vectors;
        e.rates.resize(k * step, 0.0);
        for j in 0..e.motion.dof {
            let block =
                MatRef::from_column_major_slice(&e.blocks[j * p * n..(j + 1) * p * n], n, p);
            let (from, to) = (10 * self.active[j].0, 10 * self.active[j].1);
            let at = &mut e.rates[j * n..];
            let out = MatMut::from_column_major_slice_with_stride_mut(at, n, k, step);
            let (w, bodies) = (2.0 * self.weights[j], block.subcols(from, to - from));
            matmul(
                out,
                Accum::Replace,
                bodies,
                phi.subrows(from, to - from),
                w,
                Par::Seq,
            );
            for &(column, ..) in self.terms.iter().filter(|t| t.1 == j) {
                for v in 0..k {
                    let f = w * phi[(column, v)];
                    for i in 0..n {
                        e.rates[v * step + j * n + i] += f * block[(i, column)];
                    }
                }
            }
        }
        let inertial = 10 * self.tree.bodies();
        e.phi.clear();
        for v in 0..k {
            e.phi.extend((0..inertial).map(|c| phi[(c, v)]));
        }
        self.tree
            .gradients(&mut e.ws, &e.phi, &e.motion, &e.rates, &mut e.derivatives);
        for &(column, joint, term) in &self.terms {
            for v in 0..k {
                let f = phi[(column, v)];
                let at = v * step + joint * n;
                for i in 0..n {
                    let r = f * e.rates[at + i];
                    match term {
                        JointTerm::Armature => e.derivatives.qdd[at + i] += r,
                        JointTerm::Viscous => e.derivatives.qd[at + i] += r,
                        JointTerm::Coulomb => {
                            let s = self.sign_width[joint];
                            let v = e.motion.qd[joint * n + i];
                            e.derivatives.qd[at + i] += r * s * s / (v * v + s * s).powf(1.5);
                        }
                        JointTerm::Offset => {}
                    }
                }
            }
        }
        let d = &e.derivatives;
        [&d.q, &d.qd, &d.qdd]
    }
}
