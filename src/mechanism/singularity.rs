//! How far a pose is from the two kinds of singularity.
//!
//! **Actuation.** `J = D_a` maps task rates to actuator rates; angles are counted as lengths on a
//! circle of the characteristic length, and rates of roll, pitch and yaw are turned into the
//! angular velocity first, so that `σ_min` and the condition number are those of the classical
//! Jacobian (Merlet 2006, ch. 5) with lengths scaled. Rows of rotary actuators are multiplied by
//! the characteristic length. `σ_min → 0`: the platform moves while the actuators stand still;
//! `σ_max → ∞`: the actuators cannot move it that way.
//!
//! **Constraint.** The block of conditions that hold what the platform must *not* do (the tilts of
//! a Delta or H4): when it is singular, the passive joints let the platform tilt although every
//! actuator is held. A mechanism can pass the first test and fail the second.

use super::Mechanism;
use super::task::{Task, rates_to_omega};
use crate::dynamics::Samples;
use crate::error::{Result, Warning, WarningKind};
use crate::robot::Motion;
use nalgebra::{DMatrix, Vector3};

/// Below this smallest singular value (dimensionless, of matrices whose rows are of size one) a
/// mechanism counts as singular.
pub const SINGULAR: f64 = 1e-3;

/// Smallest and largest singular value of a block.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Spread {
    /// smallest singular value
    pub sigma_min: f64,
    /// largest singular value
    pub sigma_max: f64,
}

impl Spread {
    /// Of a matrix; both not a number where it is not finite.
    pub fn of(m: &DMatrix<f64>) -> Self {
        if m.is_empty() || m.iter().any(|x| !x.is_finite()) {
            return Spread {
                sigma_min: f64::NAN,
                sigma_max: f64::NAN,
            };
        }
        let sv = m.clone().svd(false, false).singular_values;
        // fewer rows than columns: something is not held at all
        let smallest = if m.nrows() < m.ncols() { 0.0 } else { sv.min() };
        Spread {
            sigma_min: smallest,
            sigma_max: sv.max(),
        }
    }

    /// Condition number; infinite for a singular block.
    pub fn condition(&self) -> f64 {
        match self.sigma_min > 0.0 {
            true => self.sigma_max / self.sigma_min,
            false => f64::INFINITY,
        }
    }

    /// Whether the smallest singular value is below [`SINGULAR`] (or not a number).
    pub fn is_singular(&self) -> bool {
        self.sigma_min.is_nan() || self.sigma_min < SINGULAR
    }
}

/// Both measures in one pose.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Singularity {
    /// of the actuation Jacobian, lengths scaled
    pub actuation: Spread,
    /// of the constraint block; `None` where the tree leaves nothing out
    pub constraint: Option<Spread>,
}

impl Singularity {
    /// Whether either is singular.
    pub fn is_singular(&self) -> bool {
        self.actuation.is_singular() || self.constraint.is_some_and(|c| c.is_singular())
    }

    /// One warning for each that is.
    pub fn warnings(&self, name: &str, place: &str) -> Vec<Warning> {
        let mut all = Vec::new();
        if self.actuation.is_singular() {
            all.push(Warning::new(WarningKind::Singular,
                name,
                format!(
                    "singular {place}: the actuators do not hold the platform (actuation Jacobian \
                     with lengths scaled: smallest singular value {:.1e}, condition {:.1e}); change \
                     the layout of the actuators or the home pose",
                    self.actuation.sigma_min,
                    self.actuation.condition()
                ),
            ));
        }
        if let Some(c) = self.constraint.filter(Spread::is_singular) {
            all.push(Warning::new(WarningKind::Singular,
                name,
                format!(
                    "singular {place}: the passive joints do not hold the platform's other \
                     freedoms (constraint block: smallest singular value {:.1e}, condition {:.1e}); \
                     change the layout of the chains or the home pose",
                    c.sigma_min,
                    c.condition()
                ),
            ));
        }
        all
    }
}

impl Mechanism {
    /// The actuation Jacobian of a pose with lengths scaled: actuator rates from the velocity and,
    /// times the characteristic length, the angular velocity of the platform.
    ///
    /// # Errors
    /// A pose that cannot be reached.
    pub fn actuation_jacobian(&self, x: &[f64]) -> Result<DMatrix<f64>> {
        let m = self.freedoms();
        let samples = Samples {
            dof: m,
            count: 1,
            q: x.to_vec(),
            qd: vec![0.0; m],
            qdd: vec![0.0; m],
        };
        if let Some(why) = self.problem(x) {
            return Err(crate::error::Error::Infeasible(format!(
                "{}: the pose cannot be taken: {why}",
                self.robot.name
            )));
        }
        let n = self.robot.dof();
        let mut tree = Samples::zeros(n, 1);
        let mut d = vec![0.0; n * m];
        self.geometry
            .motion(crate::dynamics::Isa::Scalar, &samples, &mut tree, &mut d);
        let mut j = DMatrix::from_fn(self.actuators(), m, |a, k| d[self.actuated[a] * m + k]);
        let l = self.length;
        match self.task {
            Task::Joints(_) => return Ok(j),
            Task::Pose => {
                let e = rates_to_omega(&Vector3::new(x[3], x[4], x[5]));
                if let Some(inverse) = e.try_inverse() {
                    let turned = j.columns(3, 3) * inverse;
                    j.columns_mut(3, 3).copy_from(&turned);
                }
                j.columns_mut(3, 3).scale_mut(1.0 / l);
            }
            Task::Schoenflies => j.column_mut(3).scale_mut(1.0 / l),
            Task::Translation => {}
        }
        for (a, &c) in self.actuated.iter().enumerate() {
            if self.robot.joints[c].motion == Motion::Revolute {
                j.row_mut(a).scale_mut(l);
            }
        }
        Ok(j)
    }

    /// Distance from both kinds of singularity.
    ///
    /// # Errors
    /// A pose that cannot be reached.
    pub fn singularity(&self, x: &[f64]) -> Result<Singularity> {
        if let Some(platform) = self.follows() {
            return platform.singularity(&platform.forward(x, &platform.home)?.x);
        }
        Ok(Singularity {
            actuation: Spread::of(&self.actuation_jacobian(x)?),
            constraint: self
                .geometry
                .constraint_block(x)
                .map(|block| Spread::of(&block)),
        })
    }
}
