//! Torque noise of the actuators: stated, or assumed with a warning.

use super::Plant;
use crate::error::{Warning, WarningKind};

/// Torque noise assumed where a robot file states none, as a fraction of the effort limit (or of
/// 100 N m where there is none either).
pub const DEFAULT_NOISE: f64 = 0.01;

impl Plant {
    /// Torque noise of each actuator (standard deviation, N m or N), and a warning for those that
    /// had to be assumed.
    pub fn torque_noise(&self) -> (Vec<f64>, Vec<Warning>) {
        let mut missing = Vec::new();
        let noise = self
            .actuators()
            .into_iter()
            .map(|j| {
                j.torque_noise.unwrap_or_else(|| {
                    missing.push(j.name.as_str());
                    let effort = j.limits.effort;
                    DEFAULT_NOISE * if effort.is_finite() { effort } else { 100.0 }
                })
            })
            .collect();
        if missing.is_empty() {
            return (noise, Vec::new());
        }
        let warning = Warning::new(
            WarningKind::TorqueNoiseAssumed,
            "torque_noise",
            format!(
                "not stated for {}: taken as {} % of the effort limit; state `torque_noise` for \
                 predictions that can be trusted",
                missing.join(", "),
                100.0 * DEFAULT_NOISE
            ),
        );
        (noise, vec![warning])
    }
}
