//! The robot: a tree of rigid bodies, the joint coordinates that drive it, and their limits.
//!
//! [`Robot`] is immutable data; every computation keeps its own workspace. Fixed joints are gone
//! (their links are merged into the parent, see [`Body::merged`]), so every [`Body`] hangs on
//! exactly one moving joint. A *coordinate* is what the user commands and measures ([`Joint`]);
//! several bodies may follow one coordinate (URDF `mimic`): `q_body = ratio · q + offset`.

mod assumed;
#[doc(hidden)]
pub mod bundled;
pub(crate) mod file;
#[doc(hidden)]
pub mod geometry;
pub(crate) mod inertia;
pub(crate) mod meant;
pub(crate) mod mjcf;
mod parameter;
mod stribeck;
pub(crate) mod tool;
pub(crate) mod urdf;
mod velocity_by_position;
pub(crate) mod xacro;

#[doc(hidden)]
pub use file::holds_robot;
pub use inertia::Inertia;
#[doc(hidden)]
pub use meant::Placement;
pub use parameter::{Column, Parameter};
pub use stribeck::Stribeck;
pub use tool::Tool;
pub(crate) use velocity_by_position::Side;
pub use velocity_by_position::VelocityByPosition;

use crate::error::Warning;
use nalgebra::{Matrix3, Vector3};
use std::path::PathBuf;

/// How a body moves relative to its parent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Motion {
    /// Rotation about the axis, rad.
    Revolute,
    /// Translation along the axis, m.
    Prismatic,
}

/// One moving rigid body of the tree, with the joint that carries it.
///
/// The body frame `B` (the URDF link frame) sits in the parent's frame `P` at
/// `X_PB(q) = (rotation, position) · motion(axis, ratio·q + offset)`.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Body {
    /// name of the URDF link
    pub name: String,
    /// name of the URDF joint that carries it
    pub joint_name: String,
    /// index of the parent body, always smaller than its own; `None` for a child of the base
    pub parent: Option<usize>,
    /// kind of joint
    pub motion: Motion,
    /// unit axis, in the axes of the body frame
    #[serde(serialize_with = "crate::output::vector")]
    pub axis: Vector3<f64>,
    /// rotation `R_PB` at zero joint position
    #[serde(serialize_with = "crate::output::rotation")]
    pub rotation: Matrix3<f64>,
    /// position of the body origin in the parent's frame at zero joint position, m
    #[serde(serialize_with = "crate::output::vector")]
    pub position: Vector3<f64>,
    /// inertial parameters, including all links merged into this one
    pub inertia: Inertia,
    /// names of the links that fixed or locked joints merged into this body
    pub merged: Vec<String>,
    /// index of the coordinate that moves it
    pub coordinate: usize,
    /// joint position per coordinate; 1 except for mimic joints
    pub ratio: f64,
    /// joint position at zero coordinate; 0 except for mimic joints
    pub offset: f64,
    /// axis, rotation and position that the file means, where its rounded numbers say something
    /// else; see `meant`
    #[serde(skip)]
    pub meant: Option<Placement>,
}

/// Limits of one coordinate; infinite where there is none.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Limits {
    /// lower and upper position, rad or m
    pub position: [f64; 2],
    /// rad/s or m/s
    pub velocity: f64,
    /// rad/s² or m/s²
    pub acceleration: f64,
    /// rad/s³ or m/s³
    pub jerk: f64,
    /// torque or force, N m or N
    pub effort: f64,
    /// rate of the torque or force, N m/s or N/s
    pub effort_rate: f64,
    /// velocity that shrinks towards the ends of a range
    pub velocity_by_position: Option<VelocityByPosition>,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            position: [f64::NEG_INFINITY, f64::INFINITY],
            velocity: f64::INFINITY,
            acceleration: f64::INFINITY,
            jerk: f64::INFINITY,
            effort: f64::INFINITY,
            effort_rate: f64::INFINITY,
            velocity_by_position: None,
        }
    }
}

impl Limits {
    /// All limits times `factor`; positions keep the middle of their range, a velocity by position its ends.
    pub fn derated(&self, factor: f64) -> Self {
        let mut l = *self;
        let [low, high] = l.position;
        if low.is_finite() && high.is_finite() {
            let (middle, half) = (0.5 * (low + high), 0.5 * (high - low) * factor);
            l.position = [middle - half, middle + half];
        }
        l.velocity *= factor;
        l.acceleration *= factor;
        l.jerk *= factor;
        l.effort *= factor;
        l.effort_rate *= factor;
        l.velocity_by_position = l.velocity_by_position.map(|v| v.derated(factor));
        l
    }
}

/// Joint columns that may stand in the regressor beside the ten of each link.
///
/// The order of the variants is the order of the columns.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum JointTerm {
    /// rotor inertia reflected to the joint: `I_a q̈`
    Armature,
    /// viscous friction: `F_v q̇`
    Viscous,
    /// Coulomb friction: `F_c sign(q̇)`
    Coulomb,
    /// constant torque
    Offset,
}

impl JointTerm {
    /// All four, in the order of their columns.
    pub const ALL: [JointTerm; 4] = [
        JointTerm::Armature,
        JointTerm::Viscous,
        JointTerm::Coulomb,
        JointTerm::Offset,
    ];

    /// What a drive adds to the torque of the bodies: Coulomb and viscous friction, and a constant.
    pub const FRICTION: [JointTerm; 3] =
        [JointTerm::Coulomb, JointTerm::Viscous, JointTerm::Offset];

    /// Name as in `robot.toml`.
    pub fn name(self) -> &'static str {
        match self {
            JointTerm::Armature => "armature",
            JointTerm::Viscous => "viscous",
            JointTerm::Coulomb => "coulomb",
            JointTerm::Offset => "offset",
        }
    }

    /// Unit of the parameter for a joint of this kind.
    pub fn unit(self, motion: Motion) -> &'static str {
        match (self, motion) {
            (JointTerm::Armature, Motion::Revolute) => "kg m^2",
            (JointTerm::Armature, Motion::Prismatic) => "kg",
            (JointTerm::Viscous, Motion::Revolute) => "N m s/rad",
            (JointTerm::Viscous, Motion::Prismatic) => "N s/m",
            (_, Motion::Revolute) => "N m",
            (_, Motion::Prismatic) => "N",
        }
    }
}

/// One coordinate: what is commanded and measured.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Joint {
    /// name of the URDF joint
    pub name: String,
    /// kind of motion (decides the units)
    pub motion: Motion,
    /// `continuous` in the URDF: no position limit by nature
    pub continuous: bool,
    /// limits
    pub limits: Limits,
    /// standard deviation of the measured torque, N m or N; `None` where not stated
    pub torque_noise: Option<f64>,
    /// encoder step, rad or m
    pub position_resolution: Option<f64>,
    /// motor turns per joint turn
    pub gear_ratio: Option<f64>,
    /// areas of a pneumatic or hydraulic piston, m²: of chamber a, which extends the joint, and of
    /// chamber b
    pub piston: Option<[f64; 2]>,
    /// root mean square torque that it bears for ever, N m or N
    pub continuous_torque: Option<f64>,
    /// mean mechanical power that it bears for ever, W
    pub continuous_power: Option<f64>,
    /// values of armature, viscous, Coulomb and offset in the nominal model, in
    /// [`JointTerm::ALL`] order; always part of the torque
    pub terms: [f64; 4],
    /// breakaway friction beside them, known
    pub stribeck: Stribeck,
    /// which of them are unknowns with a column of their own
    pub identify: [bool; 4],
}

impl Joint {
    /// The same joint with all limits times `factor`, see [`Limits::derated`].
    pub fn derated(&self, factor: f64) -> Self {
        Joint {
            limits: self.limits.derated(factor),
            ..self.clone()
        }
    }

    /// How far it is taken to move to either side where its file states no end: π rad or 0.5 m.
    pub(crate) fn free_reach(&self) -> f64 {
        match self.motion {
            Motion::Revolute => std::f64::consts::PI,
            Motion::Prismatic => 0.5,
        }
    }

    /// Its position limits, an end that is not stated taken from [`Joint::free_reach`], without what lies beyond
    /// the positions at which a velocity by position makes it turn.
    pub(crate) fn range(&self) -> [f64; 2] {
        let reach = self.free_reach();
        let [low, high] = match self.limits.velocity_by_position.map(|v| v.range()) {
            Some([a, b]) => [
                self.limits.position[0].max(a),
                self.limits.position[1].min(b),
            ],
            None => self.limits.position,
        };
        match (low.is_finite(), high.is_finite()) {
            (true, true) => [low, high],
            (true, false) => [low, low + 2.0 * reach],
            (false, true) => [high - 2.0 * reach, high],
            (false, false) => [-reach, reach],
        }
    }

    /// A joint without limits and without terms.
    pub fn new(name: &str, motion: Motion) -> Self {
        Joint {
            name: name.into(),
            motion,
            continuous: false,
            limits: Limits::default(),
            torque_noise: None,
            position_resolution: None,
            gear_ratio: None,
            piston: None,
            continuous_torque: None,
            continuous_power: None,
            terms: [0.0; 4],
            stribeck: Stribeck::default(),
            identify: [false; 4],
        }
    }

    /// The most that dry friction takes, whatever the speed: Coulomb and breakaway, N m or N.
    pub fn dry(&self) -> f64 {
        self.terms[JointTerm::Coulomb as usize].abs() + self.stribeck.force.abs()
    }
}

/// How far the nominal values can be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Prior {
    /// rough
    #[default]
    Cad,
    /// from an earlier identification, close
    Identified,
}

/// A robot: bodies, coordinates, gravity. See the [module](self) documentation.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Robot {
    /// name, as printed and stored
    pub name: String,
    /// moving bodies, parents before children
    pub bodies: Vec<Body>,
    /// coordinates from the base to the tips, in the order of the joint columns of every log
    pub joints: Vec<Joint>,
    /// acceleration of gravity in base axes, m/s²
    #[serde(serialize_with = "crate::output::vector")]
    pub gravity: Vector3<f64>,
    /// trust in the nominal values
    pub prior: Prior,
    /// what was imperfect in the files it came from
    pub warnings: Vec<Warning>,
    /// the file it was read from, or `None` for a bundled robot
    pub path: Option<PathBuf>,
    /// SHA-256 (hexadecimal) of the files it was read from
    pub hash: String,
    /// volumes of its links and what stands around it; not serialised
    #[serde(skip)]
    pub geometry: geometry::Geometry,
    /// limits of its tool point
    pub tool: Option<Tool>,
}

impl Robot {
    /// Number of coordinates `n`.
    pub fn dof(&self) -> usize {
        self.joints.len()
    }

    /// Number of columns of the regressor: `10 · bodies + identified joint terms`.
    pub fn parameter_count(&self) -> usize {
        10 * self.bodies.len()
            + self
                .joints
                .iter()
                .flat_map(|j| j.identify)
                .filter(|&b| b)
                .count()
    }

    /// The columns of the regressor in order: ten per body, then, joint by joint, the terms in
    /// [`JointTerm::ALL`] order that are to be identified.
    pub fn columns(&self) -> Vec<Column> {
        let inertial = (0..self.bodies.len())
            .flat_map(|body| (0..10).map(move |k| Column::Inertial { body, k }));
        let terms = self.joints.iter().enumerate().flat_map(|(joint, j)| {
            JointTerm::ALL
                .into_iter()
                .zip(j.identify)
                .filter(|(_, wanted)| *wanted)
                .map(move |(term, _)| Column::Term { joint, term })
        });
        inertial.chain(terms).collect()
    }

    /// Name of a column: `link3.mx`, `joint2.viscous`.
    pub fn column_name(&self, column: Column) -> String {
        match column {
            Column::Inertial { body, k } => {
                format!("{}.{}", self.bodies[body].name, inertia::NAMES[k])
            }
            Column::Term { joint, term } => {
                format!("{}.{}", self.joints[joint].name, term.name())
            }
            Column::Nuisance => "nuisance".into(),
        }
    }

    /// Unit of a column's parameter.
    pub fn column_unit(&self, column: Column) -> &'static str {
        match column {
            Column::Inertial { k, .. } => inertia::UNITS[k],
            Column::Term { joint, term } => term.unit(self.joints[joint].motion),
            Column::Nuisance => "",
        }
    }

    /// Nominal values of all columns, `phi`.
    pub fn parameters(&self) -> Vec<f64> {
        self.columns()
            .into_iter()
            .map(|c| match c {
                Column::Inertial { body, k } => self.bodies[body].inertia.0[k],
                Column::Term { joint, term } => self.joints[joint].terms[term as usize],
                Column::Nuisance => 0.0,
            })
            .collect()
    }

    /// The unknowns, in the order of [`Robot::columns`].
    pub fn unknowns(&self) -> Vec<Parameter> {
        let all = self.columns().into_iter().zip(self.parameters());
        all.enumerate()
            .map(|(c, (kind, value))| Parameter {
                name: self.column_name(kind),
                unit: self.column_unit(kind),
                value,
                kind,
                raw: vec![c],
            })
            .collect()
    }

    /// Names of the coordinates.
    pub fn joint_names(&self) -> Vec<String> {
        self.joints.iter().map(|j| j.name.clone()).collect()
    }

    /// The same robot with other joint columns in the regressor, the same for every joint.
    pub fn with_terms(mut self, terms: &[JointTerm]) -> Self {
        for joint in &mut self.joints {
            joint.identify = JointTerm::ALL.map(|t| terms.contains(&t));
        }
        self
    }
}
