//! Equations of motion in the coordinates of a plant, from the kernels of the inverse dynamics.
//!
//! ```text
//! M(x) ẍ + b(x, ẋ) + Dᵀ f(q̇) = D_aᵀ τ          q̇ = D ẋ,  q̈ = D ẍ + Ḋ ẋ
//! M = Dᵀ (M_tree + diag I_a) D      b = Dᵀ (Γ_tree(q, q̇, Ḋ ẋ) + I_a Ḋ ẋ)
//! ```
//!
//! with `q` all joints of the tree, passive ones included, and `D = ∂q/∂x`, which is the identity
//! for a serial robot. The columns of `M_tree D` are inverse dynamics without velocity and gravity
//! (Walker & Orin 1982, method 1), which here is one batch of the vector kernels.

use crate::dynamics::{Isa, Samples, Tree, Workspace};
use crate::error::{Error, Result};
use crate::mechanism::Mechanism;
use crate::mechanism::task::PITCH_MARGIN;
use crate::plant::Plant;
use nalgebra::{DMatrix, DVector, Vector3};

/// A plant ready for forward dynamics: its tree with the parameters of the simulated robot, which
/// need not be the nominal ones.
pub struct Dynamics<'a> {
    mechanism: Option<&'a Mechanism>,
    tree: Tree,
    phi: Vec<f64>,
    armature: Vec<f64>,
    actuated: Vec<usize>,
    coordinates: usize,
    ws: Workspace,
    task: Samples,
    position: Samples,
    batch: Samples,
    gamma: Vec<f64>,
    d: Vec<f64>,
}

/// Equations of motion in one state.
#[derive(Debug, Clone)]
pub struct Terms {
    /// positions of all joints of the tree
    pub q: DVector<f64>,
    /// their velocities
    pub qd: DVector<f64>,
    /// their accelerations where `ẍ = 0`: `Ḋ ẋ`
    pub qdd_bias: DVector<f64>,
    /// `D`, joints × coordinates
    pub d: DMatrix<f64>,
    /// rows of `D` that belong to the actuators
    pub d_a: DMatrix<f64>,
    /// `M`
    pub mass: DMatrix<f64>,
    /// `h`: Coriolis, centrifugal and gravity terms
    pub bias: DVector<f64>,
    /// the part of `h` that is gravity
    pub gravity: DVector<f64>,
}

impl Terms {
    /// Kinetic energy `½ ẋᵀ M ẋ`, J.
    pub fn kinetic_energy(&self, xd: &DVector<f64>) -> f64 {
        0.5 * xd.dot(&(&self.mass * xd))
    }
}

impl<'a> Dynamics<'a> {
    /// With the plant's bodies at `phi` (ten parameters a body of the tree, in its order), the
    /// armature of all joints of the tree, kg m² or kg, and this gravity.
    ///
    /// # Panics
    /// If there are not ten parameters a body, or not one armature a joint.
    pub fn new(plant: &'a Plant, phi: Vec<f64>, armature: Vec<f64>, gravity: Vector3<f64>) -> Self {
        let robot = plant.robot();
        assert_eq!(phi.len(), 10 * robot.bodies.len(), "ten parameters a body");
        assert_eq!(armature.len(), robot.dof(), "one armature a joint");
        let mut turned = robot.clone();
        turned.gravity = gravity;
        let (n, m) = (robot.dof(), plant.coordinates());
        Dynamics {
            mechanism: plant.mechanism(),
            tree: Tree::new(&turned),
            phi,
            armature,
            actuated: plant.actuated().to_vec(),
            coordinates: m,
            ws: Workspace::default(),
            task: Samples::zeros(m, 1),
            position: Samples::zeros(n, 1),
            batch: Samples::zeros(n, m + 2),
            gamma: vec![0.0; n * (m + 2)],
            d: vec![0.0; n * m],
        }
    }

    /// With the nominal bodies of the plant.
    pub fn nominal(plant: &'a Plant) -> Self {
        let robot = plant.robot();
        let phi = robot.bodies.iter().flat_map(|b| b.inertia.0).collect();
        let armature = robot.joints.iter().map(|j| j.terms[0]).collect();
        Self::new(plant, phi, armature, robot.gravity)
    }

    /// Joints of the tree.
    pub fn joints(&self) -> usize {
        self.position.dof
    }

    /// Actuated joints, indices into those of the tree.
    pub fn actuated(&self) -> &[usize] {
        &self.actuated
    }

    /// All terms of the equations in one state.
    ///
    /// # Errors
    /// A pose that cannot be reached.
    pub fn terms(&mut self, x: &DVector<f64>, xd: &DVector<f64>) -> Result<Terms> {
        let (n, m) = (self.position.dof, self.coordinates);
        match self.mechanism {
            None => {
                self.position.q.copy_from_slice(x.as_slice());
                self.position.qd.copy_from_slice(xd.as_slice());
                self.position.qdd.fill(0.0);
            }
            Some(mechanism) => {
                self.task.q.copy_from_slice(x.as_slice());
                self.task.qd.copy_from_slice(xd.as_slice());
                let steep = mechanism.task == crate::mechanism::Task::Pose
                    && x[4].abs() > std::f64::consts::FRAC_PI_2 - PITCH_MARGIN;
                if !steep {
                    mechanism.geometry().motion(
                        Isa::Scalar,
                        &self.task,
                        &mut self.position,
                        &mut self.d,
                    );
                }
                let finite = |a: &[f64]| a.iter().all(|v| v.is_finite());
                if steep || !finite(&self.position.q) || !finite(&self.position.qdd) {
                    let why = mechanism.problem(x.as_slice());
                    return Err(Error::Infeasible(format!(
                        "{}: the simulated motion reached {}, a pose that cannot be taken: {}",
                        mechanism.robot.name,
                        mechanism.show(x.as_slice()),
                        why.unwrap_or_else(|| "it is not finite".into())
                    )));
                }
            }
        }
        let d = match self.mechanism {
            None => DMatrix::identity(n, m),
            Some(_) => DMatrix::from_row_slice(n, m, &self.d),
        };
        // sample 0: the state with ẍ = 0; 1: at rest; 2 + k: at rest with unit acceleration k
        let count = m + 2;
        for j in 0..n {
            let row = j * count;
            self.batch.q[row..row + count].fill(self.position.q[j]);
            self.batch.qd[row] = self.position.qd[j];
            self.batch.qdd[row] = self.position.qdd[j];
            for k in 0..m {
                self.batch.qdd[row + 2 + k] = d[(j, k)];
            }
        }
        self.tree
            .inverse_dynamics(&mut self.ws, &self.phi, &self.batch, &mut self.gamma);
        let qdd_bias = DVector::from_column_slice(&self.position.qdd);
        let gamma = |j: usize, s: usize| self.gamma[j * count + s];
        let bias = DVector::from_fn(n, |j, _| gamma(j, 0) + self.armature[j] * qdd_bias[j]);
        let gravity = DVector::from_fn(n, |j, _| gamma(j, 1));
        let columns = DMatrix::from_fn(n, m, |j, k| {
            gamma(j, 2 + k) - gamma(j, 1) + self.armature[j] * d[(j, k)]
        });
        let (bias, gravity, mass) = match self.mechanism {
            None => (bias, gravity, columns),
            Some(_) => (d.tr_mul(&bias), d.tr_mul(&gravity), d.tr_mul(&columns)),
        };
        let d_a = DMatrix::from_fn(self.actuated.len(), m, |a, k| d[(self.actuated[a], k)]);
        Ok(Terms {
            q: DVector::from_column_slice(&self.position.q),
            qd: DVector::from_column_slice(&self.position.qd),
            qdd_bias,
            mass: 0.5 * (&mass + mass.transpose()),
            d,
            d_a,
            bias,
            gravity,
        })
    }
}
