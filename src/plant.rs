//! A robot of either kind, serial or parallel, as identification and diagnosis see it: actuator
//! torques that are linear in unknown parameters,
//!
//! ```text
//! τ = Y(x, ẋ, ẍ) φ + τ_known        W: stacked actuator-major, row a·count + s
//! ```
//!
//! The **coordinates** `x` are the joint positions of a serial or tree robot, and the task
//! coordinates (pose of the platform) of a parallel one; logs and limits are about its
//! **actuators**.

use crate::base::{self, BaseParameters};
use crate::dynamics::{Samples, Tree};
use crate::error::{Error, Result, Warning};
use crate::mechanism::{Mechanism, RawColumn};
use crate::regressor::{Regressor, nominal_torque, term_factor};
use crate::robot::{Column, Joint, JointTerm, Prior, Robot};
use crate::trajectory::Space;
use faer::Mat;

/// What a parameter of a [`Plant`] is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// inertial parameter `k` (order of `docs/notation.md`) of body `body`, an index into
    /// [`Robot::bodies`]; with bodies that share parameters, the first of them
    Inertial {
        /// index into [`Robot::bodies`]
        body: usize,
        /// 0..10
        k: usize,
    },
    /// term of coordinate `joint`, an index into [`Robot::joints`]
    Term {
        /// index into [`Robot::joints`]
        joint: usize,
        /// which
        term: JointTerm,
    },
}

/// One unknown of a [`Plant`]: a column of its regressor.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// `link3.mz`, `leg1.viscous`
    pub name: String,
    /// SI unit
    pub unit: &'static str,
    /// nominal value
    pub value: f64,
    /// what it is
    pub kind: Kind,
}

/// A serial (or tree) or a parallel robot.
#[derive(Debug, Clone)]
pub enum Plant {
    /// a tree: coordinates are its joints, all of them actuated
    Serial(Robot),
    /// a closed chain: coordinates are the pose of its platform, or its actuators ([`Plant::in_space`])
    Parallel(Box<Mechanism>),
}

impl Plant {
    /// Reads a robot: the path of a `robot.toml` or `.urdf`, or the name of a bundled one.
    ///
    /// # Errors
    /// As [`Mechanism::load`] and [`Robot::load`].
    pub fn load(spec: &str) -> Result<Self> {
        match Mechanism::load(spec)? {
            Some(mechanism) => Ok(Plant::Parallel(Box::new(mechanism))),
            None => Ok(Plant::Serial(Robot::load(spec)?)),
        }
    }

    /// The same robot with other joint columns in the regressor, the same for every actuator (every
    /// joint of a tree).
    ///
    /// # Errors
    /// A mechanism that cannot be put together again.
    pub fn with_terms(self, terms: &[JointTerm]) -> Result<Self> {
        Ok(match self {
            Plant::Serial(robot) => Plant::Serial(robot.with_terms(terms)),
            Plant::Parallel(mechanism) => Plant::Parallel(Box::new(mechanism.with_terms(terms))),
        })
    }

    /// The same robot with these coordinates; with its own where none are named. Those of a serial
    /// robot, and of a closed chain without a platform, are always its actuators.
    ///
    /// # Errors
    /// A robot without a platform that is asked for one, and as [`Mechanism::in_actuators`].
    pub fn in_space(self, space: Option<Space>) -> Result<Self> {
        let mechanism = match (self, space) {
            (plant, None) => return Ok(plant),
            (Plant::Serial(robot), Some(Space::Actuators)) => return Ok(Plant::Serial(robot)),
            (Plant::Parallel(m), Some(Space::Actuators)) => m.in_actuators()?,
            (Plant::Parallel(m), _) if m.platform().space() == Space::Platform => {
                m.platform().clone()
            }
            (plant, _) => {
                return Err(Error::Argument(format!(
                    "{} has no platform: its coordinates are its actuators",
                    plant.name()
                )));
            }
        };
        Ok(Plant::Parallel(Box::new(mechanism)))
    }

    /// The bodies and joints: of a parallel robot its tree, passive joints included.
    pub fn robot(&self) -> &Robot {
        match self {
            Plant::Serial(robot) => robot,
            Plant::Parallel(mechanism) => &mechanism.robot,
        }
    }

    /// The closed chain, where it is one.
    pub fn mechanism(&self) -> Option<&Mechanism> {
        match self {
            Plant::Serial(_) => None,
            Plant::Parallel(mechanism) => Some(mechanism),
        }
    }

    /// Name of the robot.
    pub fn name(&self) -> &str {
        &self.robot().name
    }

    /// How far its nominal values can be trusted.
    pub fn prior(&self) -> Prior {
        self.robot().prior
    }

    /// What was imperfect in its file.
    pub fn warnings(&self) -> &[Warning] {
        match self {
            Plant::Serial(robot) => &robot.warnings,
            Plant::Parallel(mechanism) => &mechanism.warnings,
        }
    }

    /// Indices into [`Robot::joints`] of the actuated coordinates, in the order of log columns.
    pub fn actuated(&self) -> Vec<usize> {
        match self {
            Plant::Serial(robot) => (0..robot.dof()).collect(),
            Plant::Parallel(mechanism) => mechanism.actuated.clone(),
        }
    }

    /// The actuated joints, in the order of log columns.
    pub fn actuators(&self) -> Vec<&Joint> {
        let joints = &self.robot().joints;
        self.actuated().into_iter().map(|a| &joints[a]).collect()
    }

    /// What a trajectory moves: the robot itself, or the task coordinates of a parallel robot as the
    /// joints of a robot without bodies.
    pub fn moved(&self) -> Robot {
        match self {
            Plant::Serial(robot) => robot.clone(),
            Plant::Parallel(mechanism) => mechanism.task_robot(),
        }
    }

    /// Names of the coordinates `x`.
    pub fn coordinate_names(&self) -> Vec<String> {
        match self {
            Plant::Serial(robot) => robot.joint_names(),
            Plant::Parallel(mechanism) => mechanism.task_names.clone(),
        }
    }

    /// Number of coordinates `x`: rows of a motion.
    pub fn coordinates(&self) -> usize {
        match self {
            Plant::Serial(robot) => robot.dof(),
            Plant::Parallel(mechanism) => mechanism.freedoms(),
        }
    }

    /// The unknowns, in the order of the columns of [`Plant::regressor`].
    pub fn parameters(&self) -> Vec<Parameter> {
        match self {
            Plant::Serial(robot) => robot
                .columns()
                .into_iter()
                .zip(robot.parameters())
                .map(|(column, value)| Parameter {
                    name: robot.column_name(column),
                    unit: robot.column_unit(column),
                    value,
                    kind: match column {
                        Column::Inertial { body, k } => Kind::Inertial { body, k },
                        Column::Term { joint, term } => Kind::Term { joint, term },
                    },
                })
                .collect(),
            Plant::Parallel(mechanism) => {
                let unknowns = &mechanism.parameters;
                unknowns
                    .list
                    .iter()
                    .map(|p| Parameter {
                        name: p.name.clone(),
                        unit: p.unit,
                        value: p.value,
                        kind: match p.raw.first().and_then(|&r| unknowns.raw(r)) {
                            Some(RawColumn::Term { joint, term }) => Kind::Term { joint, term },
                            Some(RawColumn::Inertial { body, k }) => Kind::Inertial { body, k },
                            None => Kind::Inertial { body: 0, k: 0 },
                        },
                    })
                    .collect()
            }
        }
    }

    /// Nominal values of the unknowns.
    pub fn values(&self) -> Vec<f64> {
        self.parameters().into_iter().map(|p| p.value).collect()
    }

    /// The stacked regressor `W` of a motion of the coordinates, on all threads: row `a·count + s`
    /// is actuator `a` at sample `s`, columns as [`Plant::parameters`].
    ///
    /// # Errors
    /// A pose of a parallel robot that cannot be reached.
    pub fn regressor(&self, x: &Samples) -> Result<Mat<f64>> {
        match self {
            Plant::Serial(robot) => Ok(Regressor::new(robot, x).mat().to_owned()),
            Plant::Parallel(mechanism) => mechanism.regressor(x),
        }
    }

    /// Torque of the nominal model, all terms included, actuator-major, N m or N.
    ///
    /// # Errors
    /// As [`Plant::regressor`].
    pub fn nominal_torque(&self, x: &Samples) -> Result<Vec<f64>> {
        match self {
            Plant::Serial(robot) => Ok(nominal_torque(robot, &Tree::new(robot), x)),
            Plant::Parallel(mechanism) => mechanism.nominal_torque(x),
        }
    }

    /// The part of the nominal torque that no column of [`Plant::regressor`] stands for: terms of
    /// joints that are not identified, and bodies that are known.
    ///
    /// # Errors
    /// As [`Plant::regressor`].
    pub fn known_torque(&self, x: &Samples) -> Result<Vec<f64>> {
        match self {
            Plant::Serial(robot) => Ok(known_terms(robot, x)),
            Plant::Parallel(_) => self.known(x, &self.regressor(x)?),
        }
    }

    /// [`Plant::known_torque`] where the regressor of the motion is at hand.
    fn known(&self, x: &Samples, w: &Mat<f64>) -> Result<Vec<f64>> {
        let mechanism = match self {
            Plant::Serial(robot) => return Ok(known_terms(robot, x)),
            Plant::Parallel(mechanism) => mechanism,
        };
        let all = mechanism.nominal_torque(x)?;
        let phi = mechanism.parameters.values();
        let unknown = w * faer::ColRef::from_slice(&phi);
        let rest = all.iter().enumerate().map(|(i, t)| t - unknown[i]);
        Ok(rest.collect())
    }

    /// Torque with other values of the unknowns: `W φ + τ_known`.
    ///
    /// # Errors
    /// As [`Plant::regressor`].
    ///
    /// # Panics
    /// If there is not one number for each parameter.
    pub fn torque(&self, x: &Samples, phi: &[f64]) -> Result<Vec<f64>> {
        let w = self.regressor(x)?;
        assert_eq!(w.ncols(), phi.len(), "one number for each parameter");
        let mut tau = self.known(x, &w)?;
        let unknown = &w * faer::ColRef::from_slice(phi);
        tau.iter_mut()
            .enumerate()
            .for_each(|(i, t)| *t += unknown[i]);
        Ok(tau)
    }

    /// Motion of the actuators that goes with a motion of the coordinates.
    ///
    /// # Errors
    /// As [`Plant::regressor`].
    pub fn actuator_motion(&self, x: &Samples) -> Result<Samples> {
        let Plant::Parallel(mechanism) = self else {
            return Ok(x.clone());
        };
        Ok(mechanism.motion(x)?.tree.rows(&mechanism.actuated))
    }

    /// Random states inside the limits (inside the workspace box, of a parallel robot, and away
    /// from its singularities), from a fixed stream.
    pub fn random_states(&self, count: usize, seed: u64) -> Samples {
        match self {
            Plant::Serial(robot) => base::random_states(robot, count, seed),
            Plant::Parallel(mechanism) => mechanism.random_states(count, seed),
        }
    }

    /// Base parameters: rank of the regressor over random states.
    ///
    /// # Errors
    /// As [`BaseParameters::new`].
    pub fn base(&self) -> Result<BaseParameters> {
        match self {
            Plant::Serial(robot) => BaseParameters::new(robot),
            Plant::Parallel(mechanism) => mechanism.base(),
        }
    }
}

/// Torque of the terms of a tree's joints that are not identified.
fn known_terms(robot: &Robot, x: &Samples) -> Vec<f64> {
    let mut tau = vec![0.0; x.dof * x.count];
    for (j, joint) in robot.joints.iter().enumerate() {
        for term in JointTerm::ALL {
            let value = joint.terms[term as usize];
            if joint.identify[term as usize] || value == 0.0 {
                continue;
            }
            for s in 0..x.count {
                tau[j * x.count + s] += value * term_factor(term, x.at(j, s));
            }
        }
    }
    tau
}
