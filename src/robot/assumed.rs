//! Limits that a design needs and a robot does not state.

use super::{Motion, Robot};
use crate::error::{Warning, WarningKind, number};

impl Robot {
    /// Fills in limits that a robot does not state, each with a warning: ±π or ±0.5 m, 1 rad/s or
    /// 0.25 m/s, five times the velocity per second. Jerk and effort stay unlimited.
    pub fn with_assumed_limits(&self) -> Robot {
        let mut robot = self.clone();
        for joint in &mut robot.joints {
            let l = &mut joint.limits;
            let mut assumed = Vec::new();
            let (reach, speed, unit) = match joint.motion {
                Motion::Revolute => (std::f64::consts::PI, 1.0, "rad"),
                Motion::Prismatic => (0.5, 0.25, "m"),
            };
            let [low, high] = l.position;
            if !low.is_finite() || !high.is_finite() {
                l.position = match (low.is_finite(), high.is_finite()) {
                    (true, _) => [low, low + 2.0 * reach],
                    (_, true) => [high - 2.0 * reach, high],
                    _ => [-reach, reach],
                };
                assumed.push(format!(
                    "position {:.4} to {:.4} {unit}",
                    l.position[0], l.position[1]
                ));
            }
            if !l.velocity.is_finite() {
                l.velocity = speed;
                assumed.push(format!("velocity {speed} {unit}/s"));
            }
            if !l.acceleration.is_finite() {
                l.acceleration = 5.0 * l.velocity;
                assumed.push(format!(
                    "acceleration {} {unit}/s^2",
                    number(l.acceleration)
                ));
            }
            if !assumed.is_empty() {
                robot.warnings.push(Warning::new(
                    WarningKind::LimitsMissing,
                    joint.name.clone(),
                    format!(
                        "limits not stated, assumed for the design: {}",
                        assumed.join(", ")
                    ),
                ));
            }
            if !joint.limits.effort.is_finite() {
                robot.warnings.push(Warning::new(
                    WarningKind::LimitsMissing,
                    joint.name.clone(),
                    "no effort limit stated: its torque is not limited in the design",
                ));
            }
        }
        robot
    }
}
