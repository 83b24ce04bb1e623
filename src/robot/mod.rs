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
mod joint;
pub(crate) mod meant;
pub(crate) mod mjcf;
mod parameter;
pub mod parts;
mod stribeck;
pub(crate) mod tool;
pub(crate) mod urdf;
mod velocity_by_position;
pub(crate) mod xacro;
pub(crate) mod xml_error;

#[doc(hidden)]
pub use file::holds_robot;
pub use inertia::Inertia;
pub use joint::Joint;
pub(crate) use joint::{JointTerm, Limits, Motion, Prior, plain};
#[doc(hidden)]
pub use meant::Placement;
pub(crate) use parameter::{Column, Parameter};
pub(crate) use stribeck::Stribeck;
pub(crate) use tool::Tool;
pub(crate) use velocity_by_position::Side;
pub(crate) use velocity_by_position::VelocityByPosition;

use crate::error::Warning;
use nalgebra::{Matrix3, Vector3};
use std::path::PathBuf;

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
    pub fn with_terms(self, terms: &[JointTerm]) -> Self {
        self.identifying(&|_, _| JointTerm::mask(terms))
    }

    /// The same robot with these columns of each joint in the regressor.
    pub(crate) fn identifying(mut self, terms: &dyn Fn(usize, &Joint) -> [bool; 4]) -> Self {
        for (at, joint) in self.joints.iter_mut().enumerate() {
            joint.identify = terms(at, joint);
        }
        self
    }
}
