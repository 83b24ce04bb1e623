//! URDF: from the text of a file to a [`Robot`].
//!
//! [`Urdf::parse`] reads links and joints as they are written, with the line each stands on;
//! [`Urdf::robot`] turns them into a tree of moving bodies:
//!
//! * fixed joints, and joints held by `lock`, merge the child link into its parent: its inertia is
//!   moved there and its name kept in [`Body::merged`](super::Body::merged);
//! * a `mimic` joint moves its body with another coordinate, chains of mimics included;
//! * coordinates and bodies are numbered from the base to the tips: a parent before its children,
//!   one branch to its end before the next, branches in the order of the file;
//! * the inertia of links that do not move is ignored.
//!
//! Geometry is kept for those who ask for volumes; transmissions, sensors and simulator extensions are skipped. What is imperfect but
//! usable (no inertia, placeholder limits) becomes a [`Warning`]; what is contradictory is an
//! error with file, line, link or joint, and what to do. Angles are kept as written; what `1.5708`
//! and `-5.24e-08` mean is kept beside them, see [`meant`](super::meant).

mod drive;
mod geometry;
mod inertial;
mod limits;
mod read;
mod source;
mod tree;

pub(crate) use limits::NO_LIMIT;

use super::geometry::Form;
use super::{Inertia, Placement, Robot};
use crate::error::{Result, Warning};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Largest number of moving joints, mimic joints included.
pub const MAX_MOVING_JOINTS: usize = 128;

/// What a `robot.toml` says about the joints of its URDF.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// joints held fixed, by name: position in rad or m
    pub lock: BTreeMap<String, f64>,
    /// limits that replace those of the URDF, by joint name
    pub limits: BTreeMap<String, StatedLimits>,
}

/// Limits that replace those of the URDF; `None` keeps the URDF's.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StatedLimits {
    /// lower and upper position, rad or m
    pub position: Option<[f64; 2]>,
    /// rad/s or m/s
    pub velocity: Option<f64>,
    /// N m or N
    pub effort: Option<f64>,
    /// a velocity by position is stated beside the joint's other values
    pub by_position: bool,
}

/// A URDF as it is written: links and joints in document order, numbers checked, nothing merged.
#[derive(Debug, Clone)]
pub struct Urdf {
    /// `name` of `<robot>`; empty where it has none
    pub name: String,
    pub(crate) file: PathBuf,
    pub(crate) links: Vec<Link>,
    pub(crate) joints: Vec<UrdfJoint>,
    pub(crate) warnings: Vec<Warning>,
    /// acceleration of gravity in base axes, m/s²
    pub(crate) gravity: Vector3<f64>,
}

/// The standard gravity, m/s².
pub(crate) const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

impl Urdf {
    /// Reads the text of a URDF; `file` is what errors call it.
    ///
    /// # Errors
    /// Malformed XML, an unexpanded xacro, a root other than `<robot>`, missing or duplicate
    /// names, a joint without type, parent or child, numbers that are not finite.
    pub fn parse(text: &str, file: &Path) -> Result<Self> {
        read::read(text, file)
    }

    /// The tree of moving bodies, with the standard gravity and no joint columns to identify.
    ///
    /// # Errors
    /// Not a tree (several roots, a cycle, a link with two parents, an unknown link), a joint that
    /// cannot be represented (planar, floating), mimics in a circle, contradictory limits, no
    /// moving joint, or more than [`MAX_MOVING_JOINTS`].
    pub fn robot(&self, options: &Options) -> Result<Robot> {
        tree::build(self, options)
    }

    /// Names of all joints, in document order.
    pub fn joint_names(&self) -> impl Iterator<Item = &str> {
        self.joints.iter().map(|j| j.name.as_str())
    }

    /// Whether a joint of this name is declared `fixed`; `None` where there is no such joint.
    pub fn is_fixed(&self, joint: &str) -> Option<bool> {
        let joint = self.joints.iter().find(|j| j.name == joint)?;
        Some(joint.kind == Kind::Fixed)
    }

    /// Where a link sits on the body that carries it: the name of that body (`None`: the base) and
    /// its pose there. `is_body` tells the links that move on a joint of their own from those that
    /// are fixed, or held where `lock` says. `None` where there is no such link.
    pub fn frame(
        &self,
        link: &str,
        is_body: impl Fn(&str) -> bool,
        lock: &BTreeMap<String, f64>,
    ) -> Option<(Option<String>, Matrix3<f64>, Vector3<f64>)> {
        self.links.iter().find(|l| l.name == link)?;
        let (mut rotation, mut position) = (Matrix3::identity(), Vector3::zeros());
        let mut at = link.to_string();
        for _ in 0..=self.joints.len() {
            if is_body(&at) {
                return Some((Some(at), rotation, position));
            }
            let Some(joint) = self.joints.iter().find(|j| j.child == at) else {
                return Some((None, rotation, position));
            };
            let held = match (lock.get(&joint.name), &joint.mimic) {
                (Some(q), _) => *q,
                (None, Some(m)) => {
                    m.multiplier * lock.get(&m.joint).copied().unwrap_or(0.0) + m.offset
                }
                (None, None) => 0.0,
            };
            let (turn, slide) = match joint.kind {
                Kind::Fixed => (Matrix3::identity(), Vector3::zeros()),
                Kind::Prismatic => (Matrix3::identity(), joint.axis * held),
                _ => {
                    let axis = nalgebra::Unit::new_unchecked(joint.axis);
                    let turn = nalgebra::Rotation3::from_axis_angle(&axis, held);
                    (turn.into_inner(), Vector3::zeros())
                }
            };
            position = joint.position + joint.rotation * (slide + turn * position);
            rotation = joint.rotation * turn * rotation;
            at.clone_from(&joint.parent);
        }
        None
    }

    /// Name of the joint that carries a link.
    pub fn joint_to(&self, link: &str) -> Option<&str> {
        let joint = self.joints.iter().find(|j| j.child == link)?;
        Some(joint.name.as_str())
    }

    /// Names of all links, in document order.
    pub fn link_names(&self) -> impl Iterator<Item = &str> {
        self.links.iter().map(|l| l.name.as_str())
    }

    /// The joint that this one mimics according to the file.
    pub fn mimics(&self, joint: &str) -> Option<&str> {
        let joint = self.joints.iter().find(|j| j.name == joint)?;
        joint.mimic.as_ref().map(|m| m.joint.as_str())
    }
}

/// `<link>`.
#[derive(Debug, Clone)]
pub(crate) struct Link {
    pub(crate) name: String,
    pub(crate) line: usize,
    /// about the origin and in the axes of the link frame; `None` without `<inertial>`
    pub(crate) inertia: Option<Inertia>,
    /// geometry in its frame
    pub(crate) forms: Vec<Form>,
    /// to be reported if the link turns out to move
    pub(crate) warnings: Vec<Warning>,
}

/// `type` of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Revolute,
    Continuous,
    Prismatic,
    Fixed,
    Planar,
    Floating,
}

/// `<joint>`.
#[derive(Debug, Clone)]
pub(crate) struct UrdfJoint {
    pub(crate) name: String,
    pub(crate) line: usize,
    pub(crate) kind: Kind,
    pub(crate) parent: String,
    pub(crate) child: String,
    pub(crate) rotation: Matrix3<f64>,
    pub(crate) position: Vector3<f64>,
    /// unit length
    pub(crate) axis: Vector3<f64>,
    /// the three as they are meant
    pub(crate) meant: Placement,
    pub(crate) limit: Option<Limit>,
    pub(crate) by_position: Option<ByPosition>,
    pub(crate) mimic: Option<Mimic>,
    pub(crate) damping: f64,
    pub(crate) friction: f64,
    pub(crate) armature: f64,
}

/// `<limit>`, as written.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limit {
    pub(crate) line: usize,
    pub(crate) lower: Option<f64>,
    pub(crate) upper: Option<f64>,
    pub(crate) velocity: Option<f64>,
    pub(crate) effort: Option<f64>,
}

/// `<position_based_velocity_limits>` of Franka's robot descriptions, as written.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ByPosition {
    pub(crate) line: usize,
    pub(crate) deceleration: Option<f64>,
    pub(crate) offset: Option<f64>,
}

/// `<mimic>`: `q = multiplier · q_joint + offset`.
#[derive(Debug, Clone)]
pub(crate) struct Mimic {
    pub(crate) line: usize,
    pub(crate) joint: String,
    pub(crate) multiplier: f64,
    pub(crate) offset: f64,
}
