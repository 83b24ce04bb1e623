//! Measured against predicted torque, record by record.

use super::Settings;
use super::stack::Stack;
use crate::base::BaseParameters;
use crate::error::{Result, Warning};
use crate::log::{Purpose, Record};
use crate::plant::Plant;
use crate::signals::{self, Prepared};

/// Residual of one joint.
#[derive(Debug, Clone, serde::Serialize)]
pub struct JointError {
    /// name
    pub joint: String,
    /// rms of the residual, N m or N
    pub rms: f64,
    /// norm of the residual over that of the measured torque
    pub relative_error: f64,
}

/// Residuals of the records for one purpose.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Errors {
    /// norm of the residual over that of the measured torque, all joints
    pub relative_error: f64,
    /// joint by joint
    pub joints: Vec<JointError>,
}

/// Residuals of one record, for figures: actuator-major over the filtered samples.
#[derive(Debug, Clone)]
pub struct Trace {
    /// name of the record
    pub name: String,
    /// what it is for
    pub purpose: Purpose,
    /// s
    pub time: Vec<f64>,
    /// Hz
    pub rate: f64,
    /// measured torque, filtered
    pub measured: Vec<f64>,
    /// predicted torque of the consistent model
    pub predicted: Vec<f64>,
    /// velocities of the actuators
    pub velocity: Vec<f64>,
}

/// All of it.
#[derive(Debug, Clone)]
pub struct Validation {
    /// of the model that is written, on the fit records
    pub fit: Errors,
    /// on the holdout records, where there are any
    pub holdout: Option<Errors>,
    /// of the base estimate without prior and consistency: fit and holdout
    pub plain: (f64, Option<f64>),
    /// of the essential parameters: fit and holdout
    pub essential: (f64, Option<f64>),
    /// of the nominal model: fit and holdout
    pub nominal: (f64, Option<f64>),
    /// record by record
    pub traces: Vec<Trace>,
}

/// Predicts every record as recorded (periods are not averaged) and compares.
///
/// # Errors
/// A pose of a parallel robot that cannot be reached.
#[allow(clippy::too_many_arguments)]
pub fn validate(
    plant: &Plant,
    base: &BaseParameters,
    records: &[&Record],
    stacks: &[Stack],
    settings: &Settings,
    pi: &[f64],
    consistent: &[f64],
    essential: &[f64],
) -> Result<Validation> {
    let names: Vec<String> = plant.actuators().iter().map(|j| j.name.clone()).collect();
    let nominal = base.project(&plant.values());
    let mut recorded = Vec::new();
    for (r, s) in records.iter().zip(stacks) {
        let again = match r.periods() {
            Some((_, count)) if settings.signals.average && count >= 2 => true,
            _ => false,
        };
        let whole = signals::Settings {
            average: false,
            ..settings.signals.clone()
        };
        let p = Prepared::new(r, plant, &whole)?;
        let stack = match again {
            true => Stack::new(plant, base, &p)?,
            false => s.clone(),
        };
        let velocity = plant.actuator_motion(&p.output_motion())?.qd;
        recorded.push((stack, velocity));
    }
    let errors = |purpose: Purpose, pi: &[f64]| -> Option<Errors> {
        let mine: Vec<&Stack> = recorded
            .iter()
            .map(|(s, _)| s)
            .filter(|s| s.purpose == purpose)
            .collect();
        if mine.is_empty() {
            return None;
        }
        let mut sums = vec![[0.0; 3]; names.len()];
        for s in mine {
            let e = s.residual(pi);
            for (a, sum) in sums.iter_mut().enumerate() {
                for k in a * s.count..(a + 1) * s.count {
                    sum[0] += e[k] * e[k];
                    sum[1] += s.measured[k] * s.measured[k];
                    sum[2] += 1.0;
                }
            }
        }
        let ratio = |e: f64, t: f64| (e / t.max(1e-300)).sqrt();
        Some(Errors {
            relative_error: ratio(
                sums.iter().map(|s| s[0]).sum(),
                sums.iter().map(|s| s[1]).sum(),
            ),
            joints: names
                .iter()
                .zip(&sums)
                .map(|(joint, s)| JointError {
                    joint: joint.clone(),
                    rms: (s[0] / s[2].max(1.0)).sqrt(),
                    relative_error: ratio(s[0], s[1]),
                })
                .collect(),
        })
    };
    let both = |pi: &[f64]| {
        let one = |p| errors(p, pi).map(|e: Errors| e.relative_error);
        (one(Purpose::Fit).unwrap_or(f64::NAN), one(Purpose::Holdout))
    };
    let empty = || Errors {
        relative_error: f64::NAN,
        joints: Vec::new(),
    };
    Ok(Validation {
        fit: errors(Purpose::Fit, consistent).unwrap_or_else(empty),
        holdout: errors(Purpose::Holdout, consistent),
        plain: both(pi),
        essential: both(essential),
        nominal: both(&nominal),
        traces: recorded
            .iter()
            .map(|(s, velocity)| Trace {
                name: s.name.clone(),
                purpose: s.purpose,
                time: s.time.clone(),
                rate: s.rate,
                measured: s.measured.clone(),
                predicted: s.predicted(consistent),
                velocity: velocity.clone(),
            })
            .collect(),
    })
}

/// Torques that look as if they were in another unit: compared with the nominal model.
pub fn unit_suspicions(plant: &Plant, base: &BaseParameters, fit: &[&Stack]) -> Vec<Warning> {
    let pi = base.project(&plant.values());
    let mut out = Vec::new();
    for (a, joint) in plant.actuators().iter().enumerate() {
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for s in fit {
            let predicted = s.predicted(&pi);
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
        out.push(Warning::new(&joint.name, message));
    }
    out
}
