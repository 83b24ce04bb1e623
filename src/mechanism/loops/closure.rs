//! Frames that coincide, and what keeps them from it.

use crate::dynamics::Tree;
use crate::mechanism::scalar::{Dual, Pack, Scalar};
use crate::robot::{Motion, Robot};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// A frame on a body of the tree.
#[derive(Debug, Clone)]
pub struct Frame {
    /// name, for messages
    pub name: String,
    /// the body; `None`: the base
    pub body: Option<usize>,
    /// `R_BF`
    pub rotation: Matrix3<f64>,
    /// origin in the body's frame, m
    pub position: Vector3<f64>,
}

/// What of two frames coincides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Coincide {
    /// their origins: a ball joint, three conditions
    Position,
    /// origins and axes: a weld, six conditions
    Pose,
}

/// Two frames that coincide.
#[derive(Debug, Clone)]
pub struct Closure {
    /// the frames
    pub frames: [Frame; 2],
    /// in what
    pub coincide: Coincide,
}

impl Closure {
    /// Number of conditions.
    pub fn rows(&self) -> usize {
        match self.coincide {
            Coincide::Position => 3,
            Coincide::Pose => 6,
        }
    }

    /// `a - b`.
    pub fn name(&self) -> String {
        format!("{} - {}", self.frames[0].name, self.frames[1].name)
    }
}

type Rotation<S> = [[S; 3]; 3];

/// The tree and its closures.
#[derive(Debug, Clone)]
pub(super) struct Chain {
    pub tree: Tree,
    pub closures: Vec<Closure>,
    /// characteristic length, m: a rotation of 1 rad counts as this much
    pub length: f64,
    /// names of the bodies
    pub names: Vec<String>,
    /// bodies on the way to a closure
    needed: Vec<bool>,
    /// length for sliding coordinates, 1 for turning ones
    columns: Vec<f64>,
}

impl Chain {
    pub fn new(tree: Tree, robot: &Robot, closures: Vec<Closure>, length: Option<f64>) -> Self {
        let mut needed = vec![false; tree.nodes.len()];
        let mut size = 0.0f64;
        for frame in closures.iter().flat_map(|c| &c.frames) {
            size = size.max(frame.position.norm());
            for &b in frame.body.map_or(&[][..], |b| &tree.chains[b]) {
                needed[b] = true;
                size = size.max(Vector3::from(tree.nodes[b].position).norm());
            }
        }
        let length = length.unwrap_or(if size > 1e-6 { size } else { 1.0 });
        let columns = robot
            .joints
            .iter()
            .map(|j| match j.motion {
                Motion::Revolute => 1.0,
                Motion::Prismatic => length,
            })
            .collect();
        Chain {
            tree,
            closures,
            length,
            names: robot.bodies.iter().map(|b| b.name.clone()).collect(),
            needed,
            columns,
        }
    }

    /// Number of conditions.
    pub fn rows(&self) -> usize {
        self.closures.iter().map(Closure::rows).sum()
    }

    /// Poses of the bodies on the way to a closure.
    fn poses<S: Scalar>(&self, q: &[S], every: bool) -> Vec<(Rotation<S>, [S; 3])> {
        let zero = S::constant(0.0);
        let still = ([[zero; 3]; 3], [zero; 3]);
        let mut poses = vec![still; self.tree.nodes.len()];
        for (b, node) in self.tree.nodes.iter().enumerate() {
            if !(every || self.needed[b]) {
                continue;
            }
            let at = q[node.coordinate] * node.ratio + node.offset;
            let mut r = [[zero; 3]; 3];
            let mut p = node.position.map(S::constant);
            match node.motion {
                Motion::Revolute => {
                    let (s, c) = at.sin_cos();
                    for i in 0..3 {
                        for k in 0..3 {
                            r[i][k] = s * node.rs[i][k] + c * node.rc[i][k] + node.r0[i][k];
                        }
                    }
                }
                Motion::Prismatic => {
                    r = node.r0.map(|row| row.map(S::constant));
                    for i in 0..3 {
                        p[i] = at * node.slide[i] + p[i];
                    }
                }
            }
            if let Some(parent) = node.parent {
                let (rp, pp) = poses[parent];
                let mut product = [[zero; 3]; 3];
                for i in 0..3 {
                    for k in 0..3 {
                        product[i][k] =
                            rp[i][0] * r[0][k] + rp[i][1] * r[1][k] + rp[i][2] * r[2][k];
                    }
                }
                p = std::array::from_fn(|i| {
                    rp[i][0] * p[0] + rp[i][1] * p[1] + rp[i][2] * p[2] + pp[i]
                });
                r = product;
            }
            poses[b] = (r, p);
        }
        poses
    }

    /// `Φ`: differences of the origins in base axes, m, and sines of the angles between the axes
    /// times the characteristic length.
    pub fn residual<S: Scalar>(&self, q: &[S]) -> Vec<S> {
        let poses = self.poses(q, false);
        let mut out = Vec::with_capacity(self.rows());
        for closure in &self.closures {
            let [a, b] = [0, 1].map(|k| placed(&closure.frames[k], &poses));
            for i in 0..3 {
                out.push(a.1[i] - b.1[i]);
            }
            if closure.coincide == Coincide::Pose {
                // E = R_aᵀ R_b; its antisymmetric part is the axis times the sine of the angle
                let e = |i: usize, k: usize| {
                    a.0[0][i] * b.0[0][k] + a.0[1][i] * b.0[1][k] + a.0[2][i] * b.0[2][k]
                };
                let half = 0.5 * self.length;
                out.push((e(2, 1) - e(1, 2)) * half);
                out.push((e(0, 2) - e(2, 0)) * half);
                out.push((e(1, 0) - e(0, 1)) * half);
            }
        }
        out
    }

    /// `Φ` of numbers.
    pub fn residual_of(&self, q: &[f64]) -> DVector<f64> {
        let q: Vec<_> = q.iter().map(|&x| Pack(x)).collect();
        DVector::from_iterator(self.rows(), self.residual(&q).into_iter().map(|x| x.0))
    }

    /// `Φ_q = ∂Φ/∂q`.
    pub fn jacobian(&self, q: &[f64]) -> DMatrix<f64> {
        const AT_ONCE: usize = 4;
        let mut j = DMatrix::zeros(self.rows(), q.len());
        let mut x: Vec<Dual<Pack<f64>, AT_ONCE>> =
            q.iter().map(|&v| Dual::<_, AT_ONCE>::constant(v)).collect();
        for first in (0..q.len()).step_by(AT_ONCE) {
            let last = (first + AT_ONCE).min(q.len());
            for i in first..last {
                x[i] = Dual::variable(Pack(q[i]), i - first);
            }
            for (row, r) in self.residual(&x).into_iter().enumerate() {
                for i in first..last {
                    j[(row, i)] = r.d[i - first].0;
                }
            }
            for i in first..last {
                x[i] = Dual::constant(q[i]);
            }
        }
        j
    }

    /// `Φ_q` without dimension: rows in characteristic lengths, columns in radians or characteristic
    /// lengths.
    pub fn scaled(&self, j: &DMatrix<f64>) -> DMatrix<f64> {
        let mut scaled = j / self.length;
        for (i, s) in self.columns.iter().enumerate() {
            scaled.column_mut(i).scale_mut(*s);
        }
        scaled
    }

    /// What one unit of each coordinate is: 1 rad or the characteristic length.
    pub fn units(&self) -> &[f64] {
        &self.columns
    }

    /// By how much the worst loop is open, m (rotations times the characteristic length), and
    /// which it is.
    pub fn open(&self, q: &[f64]) -> (f64, String) {
        let packs: Vec<_> = q.iter().map(|&x| Pack(x)).collect();
        let poses = self.poses(&packs, false);
        let mut worst = (-1.0, String::new());
        for closure in &self.closures {
            let [a, b] = [0, 1].map(|k| placed(&closure.frames[k], &poses));
            let mut off = (0..3)
                .map(|i| (a.1[i].0 - b.1[i].0).powi(2))
                .sum::<f64>()
                .sqrt();
            if closure.coincide == Coincide::Pose {
                // a turn by π has no sine, too
                let matrix = |r: &Rotation<Pack<f64>>| Matrix3::from_fn(|i, k| r[i][k].0);
                let e = matrix(&a.0).transpose() * matrix(&b.0);
                let turn = (e - Matrix3::identity()).norm() / 2f64.sqrt();
                off = off.max(turn * self.length);
            }
            if off > worst.0 || off.is_nan() {
                worst = (off, closure.name());
            }
        }
        worst
    }

    /// Origins of all bodies, base axes.
    pub fn origins(&self, q: &[f64]) -> Vec<Vector3<f64>> {
        let packs: Vec<_> = q.iter().map(|&x| Pack(x)).collect();
        let poses = self.poses(&packs, true);
        let point = |p: &[Pack<f64>; 3]| Vector3::new(p[0].0, p[1].0, p[2].0);
        poses.iter().map(|(_, p)| point(p)).collect()
    }

    /// Origins of the frames of a closure, base axes.
    pub fn ends(&self, q: &[f64], closure: &Closure) -> [Vector3<f64>; 2] {
        let packs: Vec<_> = q.iter().map(|&x| Pack(x)).collect();
        let poses = self.poses(&packs, false);
        [0, 1].map(|k| {
            let (_, p) = placed(&closure.frames[k], &poses);
            Vector3::new(p[0].0, p[1].0, p[2].0)
        })
    }
}

/// A frame in base axes.
fn placed<S: Scalar>(frame: &Frame, poses: &[(Rotation<S>, [S; 3])]) -> (Rotation<S>, [S; 3]) {
    let (r, p) = (&frame.rotation, &frame.position);
    let Some(b) = frame.body else {
        return (
            std::array::from_fn(|i| std::array::from_fn(|k| S::constant(r[(i, k)]))),
            std::array::from_fn(|i| S::constant(p[i])),
        );
    };
    let (rb, pb) = &poses[b];
    (
        std::array::from_fn(|i| {
            std::array::from_fn(|k| {
                rb[i][0] * r[(0, k)] + rb[i][1] * r[(1, k)] + rb[i][2] * r[(2, k)]
            })
        }),
        std::array::from_fn(|i| rb[i][0] * p[0] + rb[i][1] * p[1] + rb[i][2] * p[2] + pb[i]),
    )
}
