//! Where something stands on a link, and a joint there.

use super::xml::Node;
use crate::robot::urdf::{Kind, UrdfJoint};
use crate::robot::{Placement, meant};
use nalgebra::{Matrix3, Vector3};

/// Where something stands on a link.
#[derive(Clone, Copy)]
pub(super) struct Frame {
    pub rotation: Matrix3<f64>,
    pub position: Vector3<f64>,
}

impl Frame {
    /// The frame of the link itself.
    pub const ZERO: Frame = Frame {
        rotation: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        position: Vector3::new(0.0, 0.0, 0.0),
    };

    pub fn then(&self, rotation: &Matrix3<f64>, position: &Vector3<f64>) -> Frame {
        Frame {
            rotation: self.rotation * rotation,
            position: self.position + self.rotation * position,
        }
    }
}

pub(super) fn joint_of(
    name: String,
    kind: Kind,
    node: &Node,
    parent: String,
    child: String,
    at: Frame,
) -> UrdfJoint {
    let axis = Vector3::z();
    UrdfJoint {
        name,
        line: node.line as usize,
        kind,
        parent,
        child,
        rotation: at.rotation,
        position: at.position,
        axis,
        meant: Placement {
            axis,
            rotation: at.rotation,
            position: meant::position(&at.position, 1.0),
        },
        limit: None,
        by_position: None,
        mimic: None,
        damping: 0.0,
        friction: 0.0,
        armature: 0.0,
    }
}
