//! Parallel robots: closed chains from the inverse kinematics of their platform.
//!
//! A mechanism is a **tree** ([`Robot`]: all bodies, one coordinate a joint, passive ones included,
//! the platform on massless bodies that move along its task coordinates), of which some coordinates
//! are **actuated**, and a [`Geometry`] that gives all tree coordinates from the **task**
//! coordinates, `q = F(x)`. With `D = ∂q/∂x`, `D_a` its actuated rows and `D_a⁺` the inverse (or,
//! with more actuators than freedoms, the pseudo-inverse, i.e. the actuator forces of least norm):
//!
//! ```text
//! G = ∂q/∂q_a = D D_a⁺      Γ = Gᵀ Γ_tree      Y = Gᵀ Y_tree
//! ```
//!
//! (Khalil & Dombre 2002, ch. 8; principle of virtual work.) A new mechanism is one file: its
//! [`Kinematics`](parts::Kinematics) and the tree it puts together with [`tree::Builder`]; see
//! [`gough_stewart`] for an example.

// written with indices, as in the kernels: iterators over arrays of wide packs are not inlined into
// the functions that are compiled for them
#![allow(clippy::needless_range_loop)]

mod actuation;
mod actuators;
mod batch;
#[doc(hidden)]
pub mod bundled;
mod certificate;
mod closed_form;
mod deformed;
#[doc(hidden)]
pub mod delta;
pub(crate) mod dimensions;
pub(crate) mod file;
pub(crate) mod follow;
mod forward;
pub(crate) mod geometry;
#[doc(hidden)]
pub mod gough_stewart;
mod gradients;
#[doc(hidden)]
pub mod h4;
pub(crate) mod interval;
#[doc(hidden)]
pub mod loops;
pub(crate) mod margins;
mod motion;
mod motion_file;
#[doc(hidden)]
pub mod parallelogram;
pub(crate) mod parameters;
pub mod parts;
mod reach;
mod regressor;
#[doc(hidden)]
pub mod scalar;
mod singularity;
pub(crate) mod smooth;
mod source;
mod states;
pub(crate) mod stretches;
pub(crate) mod task;
mod torque;
#[doc(hidden)]
pub mod tree;

pub(crate) use certificate::MechanismCertificate;
#[doc(hidden)]
pub use certificate::PosePeak;
#[doc(hidden)]
pub use forward::Solution;
pub(crate) use geometry::Segment;
#[doc(hidden)]
pub use geometry::{Cone, Geometry, Path};
#[doc(hidden)]
pub use gradients::TaskDerivatives;
pub(crate) use gradients::rounded_sign;
#[doc(hidden)]
pub use margins::{Margins, PoseKind, PoseUse};
#[doc(hidden)]
pub use motion::MechanismMotion;
pub(crate) use motion::MechanismWorkspace;
pub(crate) use motion_file::read_joint_motion;
#[doc(hidden)]
pub use parameters::Parameters;
pub(crate) use parameters::{Group, Pattern};
#[doc(hidden)]
pub use singularity::{SINGULAR, Singularity, Spread};
pub(crate) use source::{Setup, Source};
#[doc(hidden)]
pub use task::PlatformMotion;
pub(crate) use task::Task;

use crate::dynamics::{Samples, Tree};
use crate::error::{Error, Result, Warning, WarningKind};
use crate::robot::{Column, Inertia, Joint, JointTerm, Limits, Motion, Robot};
use std::sync::Arc;

/// A closed chain. See the [module](self) documentation.
#[derive(Debug, Clone)]
pub struct Mechanism {
    /// where it comes from
    pub source: Source,
    /// the tree; its joints are all coordinates
    pub robot: Robot,
    /// actuated coordinates
    pub actuated: Vec<usize>,
    /// what the task coordinates are
    pub task: Task,
    /// names of the task coordinates
    pub task_names: Vec<String>,
    /// range, rate and acceleration of each task coordinate: the workspace box (jerk and effort are
    /// not used)
    pub workspace: Vec<Limits>,
    /// the unknowns
    pub parameters: Parameters,
    /// task coordinates of the middle of the workspace
    pub home: Vec<f64>,
    /// characteristic length, m: an angle of 1 rad counts as this much
    pub length: f64,
    /// what a motion keeps away from, beside the limits of the actuators
    pub margins: Margins,
    /// what was imperfect, a home close to a singularity among them
    pub warnings: Vec<Warning>,
    /// text of the robot file it was read from; empty where it was put together in code
    pub text: String,
    geometry: Arc<dyn Geometry>,
    tree: Tree,
}

impl Mechanism {
    /// Checks a mechanism and makes it ready for use. The workspace is a cautious box about home
    /// until [`Mechanism::workspace`] is set.
    ///
    /// # Errors
    /// Fewer actuators than freedoms, an actuator listed twice, a home that cannot be reached.
    /// A singular home and redundant actuators are warnings.
    pub fn new(setup: Setup) -> Result<Self> {
        let Setup {
            source,
            mut robot,
            actuated,
            task,
            geometry,
            groups,
            home,
            length,
        } = setup;
        let freedoms = task.count();
        let name = robot.name.clone();
        let about = |message: String| Error::Infeasible(format!("{name}: {message}"));
        if home.len() != freedoms || geometry.task() != freedoms {
            return Err(about(format!(
                "home has {} numbers, the mechanism {freedoms} freedoms",
                home.len()
            )));
        }
        if geometry.coordinates() != robot.dof() {
            return Err(about(format!(
                "the kinematics has {} coordinates, the tree {}",
                geometry.coordinates(),
                robot.dof()
            )));
        }
        for (i, a) in actuated.iter().enumerate() {
            let Some(joint) = robot.joints.get(*a) else {
                return Err(about(format!("there is no coordinate {a} to be actuated")));
            };
            if actuated[..i].contains(a) {
                return Err(about(format!("actuator `{}` is listed twice", joint.name)));
            }
        }
        for group in &groups {
            let known = |b: &usize| *b < robot.bodies.len();
            if group.bodies.is_empty() || !group.bodies.iter().all(known) {
                return Err(about(format!(
                    "the unknowns `{}` must be of bodies of the tree, not of {:?}",
                    group.name, group.bodies
                )));
            }
        }
        if actuated.len() < freedoms {
            return Err(about(format!(
                "an actuator is missing: {freedoms} freedoms but {} actuated joints",
                actuated.len()
            )));
        }
        let task_names: Vec<String> = match task {
            Task::Joints(_) => match geometry.task_joints() {
                Some(joints) => geometry_joint_names(&robot, joints, freedoms),
                None => geometry_joint_names(&robot, &actuated, freedoms),
            },
            _ => task.names().iter().map(|n| n.to_string()).collect(),
        };
        let (parameters, mut warnings) = Parameters::new(&mut robot, &groups);
        if actuated.len() > freedoms {
            warnings.push(Warning::new(
                WarningKind::RedundantActuation,
                "actuators",
                format!(
                    "{} actuators for {freedoms} freedoms: the forces are not unique; those of \
                     least norm are used",
                    actuated.len()
                ),
            ));
        }
        let workspace = (0..freedoms)
            .map(|k| {
                let slides = |j: &usize| robot.joints[*j].motion == Motion::Prismatic;
                let joint = geometry.task_joints().unwrap_or(&actuated).get(k);
                let reach = match task {
                    Task::Joints(_) if joint.is_some_and(slides) => 0.1,
                    Task::Joints(_) => 0.3,
                    _ if task.is_angle(k) => 0.25,
                    _ => 0.1,
                };
                Limits {
                    position: [home[k] - reach, home[k] + reach],
                    ..Limits::default()
                }
            })
            .collect();
        let tree = Tree::new(&robot);
        let mut mechanism = Mechanism {
            source,
            robot,
            actuated,
            task,
            task_names,
            workspace,
            parameters,
            home,
            length,
            margins: Margins::default(),
            warnings,
            text: String::new(),
            geometry: Arc::from(geometry),
            tree,
        };
        mechanism.check_home()?;
        mechanism.margins = mechanism.default_margins();
        Ok(mechanism)
    }

    /// Home must be reachable; a singular one is worth a warning.
    fn check_home(&mut self) -> Result<()> {
        if let Some(why) = self.problem(&self.home) {
            return Err(Error::Infeasible(format!(
                "{}: home cannot be reached: {why}",
                self.robot.name
            )));
        }
        let s = self.singularity(&self.home)?;
        let warnings = s.warnings(&self.robot.name, "at home");
        self.warnings.extend(warnings);
        Ok(())
    }

    /// Number of actuators: rows of the regressor a sample.
    pub fn actuators(&self) -> usize {
        self.actuated.len()
    }

    /// Number of task coordinates.
    pub fn freedoms(&self) -> usize {
        self.task.count()
    }

    /// Tree coordinates that the task coordinates are; none where they are the pose of a platform.
    pub fn task_joints(&self) -> &[usize] {
        match self.task {
            Task::Joints(m) => self.geometry.task_joints().unwrap_or(&self.actuated[..m]),
            _ => &[],
        }
    }

    /// Whether task coordinate `k` is an angle: of the platform, or of a joint that turns.
    pub fn is_angle(&self, k: usize) -> bool {
        match self.task_joints().get(k) {
            Some(&j) => self.robot.joints[j].motion == Motion::Revolute,
            None => self.task.is_angle(k),
        }
    }

    /// The tree, as the kernels read it.
    pub fn tree(&self) -> &Tree {
        &self.tree
    }

    /// The kinematics.
    pub fn geometry(&self) -> &dyn Geometry {
        self.geometry.as_ref()
    }

    /// Names of the actuators.
    pub fn actuator_names(&self) -> Vec<String> {
        self.actuated
            .iter()
            .map(|&a| self.robot.joints[a].name.clone())
            .collect()
    }

    /// Why a pose cannot be taken at all, with the number that shows it; `None` where it can.
    /// Limits of joints are not looked at.
    pub fn problem(&self, x: &[f64]) -> Option<String> {
        if x.len() != self.freedoms() || x.iter().any(|v| !v.is_finite()) {
            return Some(format!(
                "{x:?} is not a pose of {} numbers",
                self.freedoms()
            ));
        }
        self.task
            .unwritable(x)
            .or_else(|| self.geometry.unreachable(x))
    }

    /// All tree coordinates of a pose.
    ///
    /// # Errors
    /// A pose that cannot be reached, with the reason.
    pub fn inverse(&self, x: &[f64]) -> Result<Vec<f64>> {
        let samples = Samples {
            dof: self.freedoms(),
            count: 1,
            q: x.to_vec(),
            qd: vec![0.0; x.len()],
            qdd: vec![0.0; x.len()],
        };
        Ok(self.motion(&samples)?.tree.q)
    }

    /// Positions of the actuators in a pose.
    ///
    /// # Errors
    /// As [`Mechanism::inverse`].
    pub fn actuator_positions(&self, x: &[f64]) -> Result<Vec<f64>> {
        let q = self.inverse(x)?;
        Ok(self.actuated.iter().map(|&a| q[a]).collect())
    }

    /// The task coordinates as the joints of a robot without bodies, their limits the workspace
    /// box (and, where they are joints, those of their rates): what trajectories, their limits and
    /// their files are about.
    pub fn task_robot(&self) -> Robot {
        let joints = self.task_names.iter().enumerate().map(|(k, name)| {
            let motion = match self.is_angle(k) {
                true => Motion::Revolute,
                false => Motion::Prismatic,
            };
            let mut limits = self.workspace[k];
            if let Some(&j) = self.task_joints().get(k) {
                let own = self.robot.joints[j].limits;
                limits.velocity = limits.velocity.min(own.velocity);
                limits.acceleration = limits.acceleration.min(own.acceleration);
                limits.jerk = limits.jerk.min(own.jerk);
            }
            Joint {
                limits,
                ..Joint::new(name, motion)
            }
        });
        Robot {
            joints: joints.collect(),
            ..self.bodiless()
        }
    }

    /// The actuators as the joints of a robot without bodies, in the order of log columns.
    pub fn actuator_robot(&self) -> Robot {
        let joints = &self.robot.joints;
        Robot {
            joints: self.actuated.iter().map(|&a| joints[a].clone()).collect(),
            ..self.bodiless()
        }
    }

    fn bodiless(&self) -> Robot {
        Robot {
            bodies: Vec::new(),
            joints: Vec::new(),
            warnings: self.warnings.clone(),
            name: self.robot.name.clone(),
            gravity: self.robot.gravity,
            prior: self.robot.prior,
            path: self.robot.path.clone(),
            hash: self.robot.hash.clone(),
            geometry: Default::default(),
            tool: None,
        }
    }

    /// The same mechanism with other terms of its actuators as unknowns.
    pub fn with_terms(self, terms: &[JointTerm]) -> Self {
        self.identifying(&|_, _| JointTerm::mask(terms))
    }

    /// The same mechanism with these terms of each of its actuators as unknowns.
    pub(crate) fn identifying(mut self, terms: &dyn Fn(usize, &Joint) -> [bool; 4]) -> Self {
        for &a in &self.actuated {
            self.robot.joints[a].identify = terms(a, &self.robot.joints[a]);
        }
        self.parameters.set_terms(&self.robot);
        self
    }

    /// The same mechanism with the ten parameters of one body as the only unknowns beside those of its joints.
    pub(crate) fn with_unknown_body(mut self, name: &str, body: usize) -> Self {
        let groups = [Group::one(name, body, Pattern::Full)];
        // all ten of one body: nothing of its inertia changes
        self.parameters = Parameters::new(&mut self.robot, &groups).0;
        self
    }

    /// The same mechanism with a load in one of its bodies.
    pub(crate) fn carrying(mut self, body: usize, load: &Inertia) -> Self {
        let own = &mut self.robot.bodies[body].inertia;
        *own = *own + *load;
        for p in &mut self.parameters.list {
            if let Column::Inertial { body: b, k } = p.kind
                && b == body
            {
                p.value += load.0[k];
            }
        }
        self
    }

    /// The same mechanism with a workspace box around home: half widths of the task coordinates.
    ///
    /// # Panics
    /// If there is not one for each task coordinate.
    pub fn with_workspace(mut self, half: &[f64]) -> Self {
        assert_eq!(half.len(), self.freedoms(), "one for each task coordinate");
        for (k, w) in self.workspace.iter_mut().enumerate() {
            w.position = [self.home[k] - half[k], self.home[k] + half[k]];
        }
        self
    }
}

/// Names of the joints that serve as task coordinates: the first `n` of these.
fn geometry_joint_names(robot: &Robot, actuated: &[usize], n: usize) -> Vec<String> {
    actuated
        .iter()
        .take(n)
        .map(|&a| robot.joints[a].name.clone())
        .collect()
}
