//! Memory of one evaluation of an information matrix.

use crate::dynamics::{Derivatives, Samples, Workspace};
use crate::mechanism::{MechanismWorkspace, TaskDerivatives};
use faer::Mat;

/// Memory of one evaluation; grows once.
#[derive(Clone)]
pub struct Evaluation {
    /// the motion at the samples
    pub motion: Samples,
    /// `Λ`, lower triangle and upper
    pub gram: Mat<f64>,
    pub(super) ws: Workspace,
    pub(super) blocks: Vec<f64>,
    pub(super) full: Mat<f64>,
    pub(super) rates: Vec<f64>,
    pub(super) phi: Vec<f64>,
    pub(super) derivatives: Derivatives,
    /// of closed chains
    pub(super) mechanism: MechanismWorkspace,
    pub(super) task: TaskDerivatives,
    pub(super) projected: Mat<f64>,
}

impl Default for Evaluation {
    fn default() -> Self {
        Evaluation {
            motion: Samples::default(),
            gram: Mat::new(),
            ws: Workspace::default(),
            blocks: Vec::new(),
            full: Mat::new(),
            rates: Vec::new(),
            phi: Vec::new(),
            derivatives: Derivatives::default(),
            mechanism: MechanismWorkspace::default(),
            task: TaskDerivatives::default(),
            projected: Mat::new(),
        }
    }
}
