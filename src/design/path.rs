//! Limits along the motion that are not linear in the coefficients: torques and clearances of a tree, and
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
    fn used(&self, info: &Information, x: &[f64], motion: &Samples, memory: &mut PathMemory)
    -> f64;

    /// Linearised limits of which more than `from` is used, at an evaluated point.
    fn rows(&self, info: &Information, x: &[f64], e: &mut Evaluation, from: f64) -> Vec<PathRow>;

    /// More rows around `x`, for what the step to `next` would break.
    fn cuts(&self, _: &Information, _x: &[f64], _next: &[f64]) -> Vec<PathRow> {
        Vec::new()
    }

    /// Postures that are inside these limits at rest, where they are not to be found otherwise.
    fn postures(&self) -> &[Vec<f64>] {
        &[]
    }

    /// Which limit a motion breaks most, in words; empty where it breaks none.
    fn broken(&self, info: &Information, x: &[f64], motion: &Samples) -> String;
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
    /// the pair that came too near last
    pub pair: usize,
}

/// Room that a linearised row leaves, as a fraction of the limit.
pub(super) const ROOM: f64 = 0.003;

/// Several limits along the path as one.
pub(super) struct All<'a>(pub Vec<Box<dyn PathLimits + 'a>>);

impl PathLimits for All<'_> {
    fn used(
        &self,
        info: &Information,
        x: &[f64],
        motion: &Samples,
        memory: &mut PathMemory,
    ) -> f64 {
        let mut most: f64 = 0.0;
        for limits in &self.0 {
            let used = limits.used(info, x, motion, memory);
            // the rest cannot mend it
            if !(used <= 1.0) {
                return used;
            }
            most = most.max(used);
        }
        most
    }

    fn rows(&self, info: &Information, x: &[f64], e: &mut Evaluation, from: f64) -> Vec<PathRow> {
        let mut rows = Vec::new();
        for limits in &self.0 {
            rows.append(&mut limits.rows(info, x, e, from));
        }
        rows
    }

    fn cuts(&self, info: &Information, x: &[f64], next: &[f64]) -> Vec<PathRow> {
        let each = self.0.iter();
        each.flat_map(|l| l.cuts(info, x, next)).collect()
    }

    fn postures(&self) -> &[Vec<f64>] {
        let mut each = self.0.iter().map(|l| l.postures());
        each.find(|p| !p.is_empty()).unwrap_or_default()
    }

    fn broken(&self, info: &Information, x: &[f64], motion: &Samples) -> String {
        let mut each = self.0.iter().map(|l| l.broken(info, x, motion));
        each.find(|b| !b.is_empty()).unwrap_or_default()
    }
}
