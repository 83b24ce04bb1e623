//! What a format is asked.

use super::Model;
use super::element::{Element, Form};
use crate::error::Result;
use crate::plant::Plant;
use crate::robot::JointTerm;

/// A part of a model, in which an effect may be held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub enum Part {
    /// inertia of bodies
    Bodies,
    /// a term of joints
    Term(JointTerm),
    /// acceleration of gravity
    Gravity,
    /// where the frames of bodies are
    Frames,
}

impl Part {
    /// What MuJoCo's file says of it.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Part::Bodies => "inertial of the bodies",
            Part::Term(JointTerm::Armature) => "armature",
            Part::Term(JointTerm::Viscous) => "damping",
            Part::Term(JointTerm::Coulomb) => "frictionloss",
            Part::Term(JointTerm::Offset) => "a far spring",
            Part::Gravity => "gravity",
            Part::Frames => "pos and quat of the bodies",
        }
    }
}

/// A file format.
pub trait Format: Sync {
    /// Name, by which effects know it.
    fn name(&self) -> &'static str;
    /// Name of the file.
    fn file(&self) -> &'static str;
    /// Whether it can hold robots of this kind: mostly serial and tree robots.
    fn holds(&self, plant: &Plant) -> bool {
        !plant.closed()
    }
    /// Whether it has this part of a model.
    fn has(&self, part: Part) -> bool;
    /// How it holds an element.
    fn element(&self, _element: &Element) -> Form {
        Form::None
    }
    /// Whether a model has anything for it.
    fn needed(&self, _model: &Model) -> bool {
        true
    }
    /// Text of the file.
    ///
    /// # Errors
    /// A model that it cannot hold.
    fn write(&self, model: &Model) -> Result<String>;
}
