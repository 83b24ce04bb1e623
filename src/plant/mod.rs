//! A robot as every stage sees it: actuator torques that are linear in unknown parameters,
//!
//! ```text
//! τ = Y(x, ẋ, ẍ) φ + τ_known        W: stacked actuator-major, row a·count + s
//! Y = Gᵀ Y_tree E                    G = ∂q/∂q_a
//! ```
//!
//! A plant is a tree of bodies, some of whose joints are actuated, and, where the tree is closed to
//! a chain, the [`Mechanism`] that gives all joints `q` from the coordinates `x`. A serial or tree
//! robot has nothing to close: `q = x`, `G = 1`, all joints are actuated, `E = 1`; the kernels then
//! skip the products with ones.
//!
//! The **coordinates** `x` are the joint positions of a tree, and the task coordinates (pose of the
//! platform, or actuators) of a closed chain; logs and limits are about its **actuators**.

mod certify;
mod follow;
mod kind;
mod motion_file;
mod noise;
pub mod parts;
mod scene;
mod summary;
mod torque;
mod values;

pub(crate) use crate::robot::{Column, Parameter};
#[doc(hidden)]
pub use follow::Rates;
#[doc(hidden)]
pub use noise::DEFAULT_NOISE;
#[doc(hidden)]
pub use scene::SeriesPath;
pub(crate) use scene::{ClearanceCertificate, PairClearance};

use crate::base::{self, BaseParameters};
use crate::collision::Scene;
use crate::dynamics::{Samples, Tree};
use crate::error::{Error, Result, Warning};
use crate::mechanism::Mechanism;
use crate::mechanism::dimensions::Dimensions;
use crate::robot::{Joint, JointTerm, Prior, Robot};
use crate::trajectory::Space;
use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

/// A robot: a tree, its actuated joints, its unknowns, and what closes it. See the
/// [module](self) documentation.
///
/// ```
/// use excite::Plant;
///
/// let arm = Plant::load("ur5e")?;
/// let delta = Plant::load("delta")?;
/// assert_eq!(arm.actuators().len(), arm.coordinates());
/// assert!(delta.robot().dof() > delta.actuators().len()); // passive joints
/// # Ok::<(), excite::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Plant {
    robot: Robot,
    tree: Tree,
    actuated: Vec<usize>,
    moved: Robot,
    parameters: Vec<Parameter>,
    raw: Vec<Column>,
    mechanism: Option<Arc<Mechanism>>,
    /// whether collisions are looked at
    collisions: bool,
    /// what [`Plant::scene`] found, or why there is none
    scene: Arc<OnceLock<Result<Option<Arc<Scene>>>>>,
}

impl From<Robot> for Plant {
    /// A tree: all joints are actuated, nothing is closed.
    fn from(robot: Robot) -> Self {
        Plant {
            tree: Tree::new(&robot),
            actuated: (0..robot.dof()).collect(),
            moved: robot.clone(),
            parameters: robot.unknowns(),
            raw: robot.columns(),
            mechanism: None,
            collisions: true,
            scene: Arc::default(),
            robot,
        }
    }
}

impl From<&Robot> for Plant {
    fn from(robot: &Robot) -> Self {
        robot.clone().into()
    }
}

impl From<Mechanism> for Plant {
    /// A closed chain in its task coordinates.
    fn from(mechanism: Mechanism) -> Self {
        let unknowns = &mechanism.parameters;
        Plant {
            robot: mechanism.robot.clone(),
            tree: mechanism.tree().clone(),
            actuated: mechanism.actuated.clone(),
            moved: mechanism.task_robot(),
            parameters: unknowns.list.clone(),
            raw: (0..unknowns.raw_count())
                .map(|c| unknowns.raw(c).unwrap_or(Column::Nuisance))
                .collect(),
            mechanism: Some(Arc::new(mechanism)),
            collisions: true,
            scene: Arc::default(),
        }
    }
}

impl From<&Mechanism> for Plant {
    fn from(mechanism: &Mechanism) -> Self {
        mechanism.clone().into()
    }
}

impl Plant {
    /// Reads a robot: the path of a `robot.toml`, a `.urdf` or an MJCF, or the name of a bundled one.
    ///
    /// # Errors
    /// As [`Mechanism::load`] and [`Robot::load`].
    pub fn load(spec: &str) -> Result<Self> {
        Ok(match Mechanism::load(spec)? {
            Some(mechanism) => mechanism.into(),
            None => Robot::load(spec)?.into(),
        })
    }

    /// The same robot with other joint columns in the regressor, the same for every actuator.
    pub fn with_terms(self, terms: &[JointTerm]) -> Self {
        self.identifying(&|_, _| JointTerm::mask(terms))
    }

    /// The same robot with these terms of each of its actuators as columns.
    pub(crate) fn identifying(self, terms: &dyn Fn(usize, &Joint) -> [bool; 4]) -> Self {
        let collisions = self.collisions;
        let other: Plant = match self.mechanism {
            None => self.robot.identifying(terms).into(),
            Some(mechanism) => Arc::unwrap_or_clone(mechanism).identifying(terms).into(),
        };
        Plant {
            collisions,
            scene: self.scene,
            ..other
        }
    }

    /// Another plant of the same links, with what this one says and knows of collisions.
    fn amid(&self, other: Plant) -> Self {
        Plant {
            collisions: self.collisions,
            scene: self.scene.clone(),
            ..other
        }
    }

    /// The same robot with these coordinates; with its own where none are named. Those of a tree,
    /// and of a closed chain without a platform, are always its actuators.
    ///
    /// # Errors
    /// A robot without a platform that is asked for one, and as [`Mechanism::in_actuators`].
    pub fn in_space(self, space: Option<Space>) -> Result<Self> {
        let other: Plant = match (&self.mechanism, space) {
            (_, None) | (None, Some(Space::Actuators)) => return Ok(self),
            (Some(m), Some(Space::Actuators)) => m.in_actuators()?.into(),
            (Some(m), _) if m.platform().space() == Space::Platform => m.platform().into(),
            _ => {
                return Err(Error::Argument(format!(
                    "{} has no platform: its coordinates are its actuators",
                    self.name()
                )));
            }
        };
        Ok(self.amid(other))
    }

    /// The same robot with the limits filled in that a design needs and a tree does not state
    /// ([`Robot::with_assumed_limits`]). The workspace of a closed chain is always stated.
    pub fn with_assumed_limits(self) -> Self {
        match self.mechanism {
            // the postures of its scene have these limits already
            None => self.amid(self.robot.with_assumed_limits().into()),
            Some(_) => self,
        }
    }

    /// The bodies and joints, passive ones included.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// The bodies and joints as the kernels read them.
    pub fn tree(&self) -> &Tree {
        &self.tree
    }

    /// What closes the tree to a chain, where something does.
    pub fn mechanism(&self) -> Option<&Mechanism> {
        self.mechanism.as_deref()
    }

    /// Name of the robot.
    pub fn name(&self) -> &str {
        &self.robot.name
    }

    /// How far its nominal values can be trusted.
    pub fn prior(&self) -> Prior {
        self.robot.prior
    }

    /// What was imperfect in its file.
    pub fn warnings(&self) -> &[Warning] {
        &self.moved.warnings
    }

    /// Indices into [`Robot::joints`] of the actuated coordinates, in the order of log columns.
    pub fn actuated(&self) -> &[usize] {
        &self.actuated
    }

    /// The actuated joints, in the order of log columns.
    pub fn actuators(&self) -> Vec<&Joint> {
        let joints = &self.robot.joints;
        self.actuated.iter().map(|&a| &joints[a]).collect()
    }

    /// Whether there are more actuators than freedoms, so that their torques are not unique.
    pub fn redundant(&self) -> bool {
        self.actuated.len() > self.coordinates()
    }

    /// What a trajectory moves, with its limits: a tree itself, or the task coordinates of a closed
    /// chain as the joints of a robot without bodies.
    pub fn moved(&self) -> &Robot {
        &self.moved
    }

    /// The actuators as the joints of a robot: a tree itself, or a robot without bodies.
    pub fn actuator_robot(&self) -> Robot {
        match self.mechanism() {
            None => self.robot.clone(),
            Some(mechanism) => mechanism.actuator_robot(),
        }
    }

    /// What the coordinates of a closed chain are; nothing to choose for a tree.
    pub fn space(&self) -> Option<Space> {
        self.mechanism().map(Mechanism::space)
    }

    /// Coordinates of the middle of the workspace, where a file states them.
    pub fn home(&self) -> Option<&[f64]> {
        self.mechanism().map(|m| m.home.as_slice())
    }

    /// Names of the coordinates `x`.
    pub fn coordinate_names(&self) -> Vec<String> {
        self.moved.joint_names()
    }

    /// A parallel robot with the pose of its platform as coordinates, whatever its series are of; any other as it is.
    pub(crate) fn by_platform(&self) -> Cow<'_, Plant> {
        match self.mechanism() {
            Some(m) => Cow::Owned(m.platform().into()),
            None => Cow::Borrowed(self),
        }
    }

    /// Dimensions of a mechanism that has any.
    pub(crate) fn dimensions(&self) -> Option<Dimensions> {
        self.mechanism().and_then(|m| m.geometry().dimensions())
    }

    /// Number of coordinates `x`: rows of a motion.
    pub fn coordinates(&self) -> usize {
        self.moved.dof()
    }

    /// The body that carries a load: the platform, or the last body of a tree.
    pub fn tool(&self) -> Option<usize> {
        let bodies = &self.robot.bodies;
        let platform = self
            .mechanism()
            .and_then(|_| bodies.iter().position(|b| b.name == "platform"));
        platform.or_else(|| bodies.len().checked_sub(1))
    }

    /// The unknowns, in the order of the columns of [`Plant::regressor`].
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// What the raw columns stand for that the unknowns are sums of ([`Parameter::raw`]): those of
    /// a tree are its unknowns.
    pub fn raw(&self) -> &[Column] {
        &self.raw
    }

    /// Nominal values of the unknowns.
    pub fn values(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.value).collect()
    }

    /// Random states inside the limits (of a closed chain inside its workspace box and away from
    /// its singularities), from a fixed stream.
    pub fn random_states(&self, count: usize, seed: u64) -> Samples {
        match self.mechanism() {
            None => base::random_states(&self.robot, count, seed),
            Some(mechanism) => mechanism.random_states(count, seed),
        }
    }

    /// Base parameters: rank of the regressor over random states.
    ///
    /// ```
    /// let base = excite::Plant::load("planar2")?.base()?;
    /// assert!(base.count() > 0 && base.count() < base.names.len());
    /// for a in 0..base.count() {
    ///     println!("{}", base.combination(a));
    /// }
    /// # Ok::<(), excite::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`BaseParameters::new`].
    pub fn base(&self) -> Result<BaseParameters> {
        match self.mechanism() {
            None => BaseParameters::new(&self.robot),
            Some(mechanism) => mechanism.base(),
        }
    }
}
