//! Limits along the motion that are not linear in the coefficients: torques of a tree, and
//! everything about the actuators of a closed chain.
//!
//! They are judged by their **use**, 1 at the limit, at the samples of a period, and enter a
//! subproblem as rows linearised there. What happens between the samples is left to the certificate
//! that ends a design.

use super::information::{Evaluation, Information};
use crate::dynamics::{Samples, Workspace};
use crate::mechanism::{MechanismWorkspace, TaskDerivatives};

/// Limits along a motion.
pub trait PathLimits: Sync {
    /// Largest use of any of the limits by a motion at the samples: at most 1 inside, infinite or
    /// not a number where the motion cannot be made.
    fn used(&self, info: &Information, motion: &Samples, memory: &mut PathMemory) -> f64;

    /// Linearised limits of which more than `from` is used, at an evaluated point.
    fn rows(&self, info: &Information, e: &mut Evaluation, from: f64) -> Vec<PathRow>;

    /// Which limit a motion breaks most, in words; empty where it breaks none.
    fn broken(&self, info: &Information, motion: &Samples) -> String;
}

/// A linearised limit: `gradient · δ ≤ slack` for a step `δ` of the free numbers.
#[derive(Debug, Clone)]
pub struct PathRow {
    /// gradient with respect to `x`
    pub gradient: Vec<f64>,
    /// room left
    pub slack: f64,
}

/// Memory for judging a motion; grows once.
#[derive(Clone, Default)]
pub struct PathMemory {
    /// of the tree's kernels
    pub workspace: Workspace,
    /// torques
    pub tau: Vec<f64>,
    /// of closed chains
    pub mechanism: MechanismWorkspace,
    /// gradients of closed chains
    pub task: TaskDerivatives,
}

/// Room that a linearised row leaves, as a fraction of the limit.
pub(super) const ROOM: f64 = 0.003;
