//! Where a mechanism comes from.

use super::Mechanism;
use super::loops::Closure;

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
