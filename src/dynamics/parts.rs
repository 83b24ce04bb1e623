//! What the types of the [module above](super) are made of, and what their settings choose from.

pub use super::workspace::Workspace;

/// Gradients with respect to positions, velocities and accelerations of every sample.
#[derive(Debug, Clone, Default)]
pub struct Derivatives {
    /// `∂/∂q`
    pub q: Vec<f64>,
    /// `∂/∂q̇`
    pub qd: Vec<f64>,
    /// `∂/∂q̈`
    pub qdd: Vec<f64>,
}

impl Derivatives {
    /// Sets all to `n` zeros.
    pub fn resize(&mut self, n: usize) {
        for x in [&mut self.q, &mut self.qd, &mut self.qdd] {
            x.clear();
            x.resize(n, 0.0);
        }
    }
}
