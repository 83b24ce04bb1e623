//! Torques in another unit, of the motor instead of the joint, or with the opposite sign.

use super::stack::Stack;
use crate::base::BaseParameters;
use crate::error::{Warning, WarningKind};
use crate::plant::Plant;

/// Warnings about torques that look as if they were in another unit: compared with the nominal model.
pub fn suspicions(plant: &Plant, base: &BaseParameters, fit: &[&Stack]) -> Vec<Warning> {
    let pi = base.project(&plant.values());
    let mut out = Vec::new();
    let predictions: Vec<Vec<f64>> = fit.iter().map(|s| s.predicted(&pi)).collect();
    for (a, joint) in plant.actuators().iter().enumerate() {
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for (s, predicted) in fit.iter().zip(&predictions) {
            let range = a * s.count..(a + 1) * s.count;
            for k in range {
                let (x, y) = (predicted[k], s.measured[k]);
                xx += x * x;
                xy += x * y;
                yy += y * y;
            }
        }
        if xx == 0.0 || yy == 0.0 {
            continue;
        }
        let (slope, alike) = (xy / xx, xy / (xx * yy).sqrt());
        let close = |x: f64, y: f64| (x / y - 1.0).abs() < 0.4;
        let gear = joint.gear_ratio.filter(|g| g.abs() > 3.0);
        let message = match gear {
            Some(g) if alike.abs() > 0.7 && close(slope.abs(), 1.0 / g.abs()) => format!(
                "its torque is {slope:.4} times the model's, which is the inverse of the gear ratio {g}: is it \
                 that of the motor?"
            ),
            _ if alike < -0.8 => {
                "its torque is the opposite of the model's: is its sign, or that of the \
                                  position, turned round?"
                    .into()
            }
            _ if alike > 0.8 && !(0.15..7.0).contains(&slope) => format!(
                "its torque is {slope:.3} times the model's: is it a current, a motor torque, or in other units?"
            ),
            _ => continue,
        };
        out.push(Warning::new(WarningKind::UnitSuspect, &joint.name, message));
    }
    out
}
