//! What a joint does beside turning by its reading, as one column that is linear in one number.

use super::unknown::{Part, Unknown};

/// How `z` depends on the posture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// torque that gravity puts on the joint, N m or N
    Torque,
    /// `sin q`
    Sine,
    /// `cos q`
    Cosine,
    /// its values are given with it, row by row
    Given,
    /// displacement by which the link before the joint bends under gravity
    Bend,
    /// sign of the torque that gravity puts on the joint; soft within [`Feature::soft`]
    Sign,
}

/// Value of a column in one posture.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Rate {
    /// change of the joint's position per unit, rad or m
    pub turn: f64,
    /// change of the joint's frame per unit, as its six errors: of a link that bends
    pub place: Option<[f64; 6]>,
}

impl Rate {
    /// Of a joint.
    pub fn turn(turn: f64) -> Self {
        Rate { turn, place: None }
    }
}

/// One column: `z` of one joint.
#[derive(Debug, Clone)]
pub struct Feature {
    /// index of the joint among those that are measured; of a link that bends, of the joint at its end in the chain
    pub joint: usize,
    /// what it stands for
    pub part: Part,
    /// its course
    pub shape: Shape,
    /// torque below which the side of the play is not decided, N m or N
    pub soft: f64,
    /// the unknown
    pub unknown: Unknown,
}

impl Feature {
    /// The turn of a joint itself.
    pub fn turn(joint: usize) -> Self {
        Feature {
            joint,
            part: Part::Geometry,
            shape: Shape::Torque,
            soft: 1.0,
            unknown: Unknown::new(String::new(), "rad", Part::Geometry, 1.0),
        }
    }
}
