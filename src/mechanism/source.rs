//! Where a mechanism comes from, and what it is put together from.

use super::loops::Closure;
use super::{Geometry, Group, Mechanism, Task};
use crate::robot::Robot;

/// Where a mechanism comes from: what a writer of robot files must know of it.
#[derive(Debug, Clone)]
pub enum Source {
    /// `mechanism = "gough-stewart"`
    GoughStewart,
    /// `mechanism = "h4"`
    H4,
    /// `mechanism = "delta"`
    Delta,
    /// `mechanism = "loops"`: a tree with these closures
    Loops(Vec<Closure>),
    /// this mechanism, its actuators in place of its platform ([`Mechanism::in_actuators`])
    InActuators(Box<Mechanism>),
    /// kinematics in code, with a name for messages: no file format stands for it
    Code(String),
}

impl Source {
    /// `gough-stewart`, `h4`, `delta`, `loops`, or the name of what was written in code.
    pub fn name(&self) -> &str {
        match self {
            Source::GoughStewart => "gough-stewart",
            Source::H4 => "h4",
            Source::Delta => "delta",
            Source::Loops(_) => "loops",
            Source::InActuators(platform) => platform.source.name(),
            Source::Code(name) => name,
        }
    }
}

/// What a mechanism is put together from.
#[derive(Debug)]
pub struct Setup {
    /// where it comes from
    pub source: Source,
    /// the tree
    pub robot: Robot,
    /// indices of the actuated coordinates, in the order of the columns of logs
    pub actuated: Vec<usize>,
    /// what the task coordinates are
    pub task: Task,
    /// kinematics
    pub geometry: Box<dyn Geometry>,
    /// unknown bodies; bodies in no group keep their inertia as known
    pub groups: Vec<Group>,
    /// task coordinates of the middle of the workspace
    pub home: Vec<f64>,
    /// characteristic length by which angles are turned into lengths, m
    pub length: f64,
}
