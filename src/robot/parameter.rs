//! The unknowns of a robot: what a column of the regressor stands for, and what is said of it.

use super::JointTerm;

/// What one column of a regressor stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Column {
    /// inertial parameter `k` (see `inertia::NAMES`) of body `body`
    Inertial {
        /// index into [`Robot::bodies`](super::Robot::bodies)
        body: usize,
        /// 0..10
        k: usize,
    },
    /// joint term of coordinate `joint`
    Term {
        /// index into [`Robot::joints`](super::Robot::joints)
        joint: usize,
        /// which
        term: JointTerm,
    },
    /// nothing of the robot: a column that a fit may use within a prior, such as the rounding of
    /// friction at a reversal
    Nuisance,
}

/// One unknown: a column of a regressor.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Parameter {
    /// `link3.mz`, `leg1.viscous`
    pub name: String,
    /// SI unit
    pub unit: &'static str,
    /// nominal value
    pub value: f64,
    /// what it stands for; with bodies that share parameters, the first of them
    pub kind: Column,
    /// raw columns that it multiplies, each once: its own of a tree, those of all bodies that share
    /// it of a closed chain; none of a nuisance
    pub raw: Vec<usize>,
}
