//! Torque noise of the actuators: stated, or assumed with a warning.

use super::Plant;
use crate::error::{Warning, WarningKind};

/// Torque noise assumed where a robot file states none, as a fraction of the effort limit (or of
/// 100 N m where there is none either).
pub const DEFAULT_NOISE: f64 = 0.01;
/// Effort that stands for a limit where there is none, N m or N.
const NO_EFFORT: f64 = 100.0;

impl Plant {
    /// Torque noise of each actuator (standard deviation, N m or N), and a warning for those that
    /// had to be assumed.
    pub fn torque_noise(&self) -> (Vec<f64>, Vec<Warning>) {
        let (mut missing, mut free) = (Vec::new(), Vec::new());
        let noise = self
            .actuators()
            .into_iter()
            .map(|j| {
                j.torque_noise.unwrap_or_else(|| {
                    let effort = j.limits.effort;
                    let stated = effort.is_finite();
                    if stated { &mut missing } else { &mut free }.push(j.name.as_str());
                    DEFAULT_NOISE * if stated { effort } else { NO_EFFORT }
                })
            })
            .collect();
        let mut taken = Vec::new();
        if !missing.is_empty() {
            taken.push(format!(
                "not stated for {}: taken as {} % of the effort limit",
                missing.join(", "),
                100.0 * DEFAULT_NOISE
            ));
        }
        if !free.is_empty() {
            taken.push(format!(
                "not stated for {}, and no effort limit either: taken as {}",
                free.join(", "),
                DEFAULT_NOISE * NO_EFFORT
            ));
        }
        if taken.is_empty() {
            return (noise, Vec::new());
        }
        let warning = Warning::new(
            WarningKind::TorqueNoiseAssumed,
            "torque_noise",
            format!(
                "{}; state `torque_noise` for predictions that can be trusted",
                taken.join("; ")
            ),
        );
        (noise, vec![warning])
    }
}
