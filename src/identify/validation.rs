//! Measured against predicted torque, record by record.

use super::Settings;
use super::stack::Stack;
use crate::base::BaseParameters;
use crate::error::{Result, Warning, WarningKind};
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
    /// joints whose residual goes with another joint
    pub followers: Vec<Follower>,
    /// record by record
    pub traces: Vec<Trace>,
}

/// A residual that is proportional, in part, to a function of another joint's velocity.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Follower {
    /// actuator whose residual it is
    pub actuator: usize,
    /// actuator that it goes with
    pub other: usize,
    /// function, in words
    pub what: String,
    /// share of the residual's power on the fit records
    pub share: f64,
}

/// A function of the velocities of a joint and of another.
type Function = fn(f64, f64) -> f64;

/// Looks, joint by joint, for the function of another joint's velocity that explains most of the
/// residual, beyond what functions of its own velocity do. The shares below a tenth are left out.
pub fn followers(names: &[String], traces: &[Trace]) -> Vec<Follower> {
    let sign = |x: f64| if x == 0.0 { 0.0 } else { x.signum() };
    let mut out = Vec::new();
    for a in 0..names.len() {
        let mut best: Option<Follower> = None;
        for b in (0..names.len()).filter(|b| *b != a) {
            let functions: [(String, Function); 4] = [
                (format!("the velocity of {}", names[b]), |_, y| y),
                (format!("the direction of {}", names[b]), |_, y| {
                    if y == 0.0 { 0.0 } else { y.signum() }
                }),
                (
                    format!("the direction of {} + {}", names[a], names[b]),
                    |x, y| (x + y).signum(),
                ),
                (
                    format!("the direction of {} − {}", names[a], names[b]),
                    |x, y| (x - y).signum(),
                ),
            ];
            for (what, f) in functions {
                // f and residual, both without their own velocity, direction and mean
                let (mut g, mut e, mut own) = (Vec::new(), Vec::new(), [Vec::new(), Vec::new()]);
                for t in traces.iter().filter(|t| t.purpose == Purpose::Fit) {
                    let n = t.time.len();
                    for k in 0..n {
                        let (x, y) = (t.velocity[a * n + k], t.velocity[b * n + k]);
                        g.push(f(x, y));
                        e.push(t.measured[a * n + k] - t.predicted[a * n + k]);
                        own[0].push(x);
                        own[1].push(sign(x));
                    }
                }
                let [x, s] = own;
                let power: f64 = e.iter().map(|v| v * v).sum();
                let mut list = [vec![1.0; e.len()], x, s, g];
                // Gram-Schmidt; what is left of the last explains what is left of the residual
                for i in 0..4 {
                    let (before, rest) = list.split_at_mut(i);
                    for q in before.iter() {
                        let c: f64 = q.iter().zip(&rest[0]).map(|(p, r)| p * r).sum();
                        rest[0].iter_mut().zip(q).for_each(|(r, p)| *r -= c * p);
                    }
                    let norm = rest[0].iter().map(|v| v * v).sum::<f64>().sqrt();
                    let small = norm <= 1e-6 * (e.len() as f64).sqrt();
                    rest[0]
                        .iter_mut()
                        .for_each(|r| *r = if small { 0.0 } else { *r / norm });
                }
                let c: f64 = list[3].iter().zip(&e).map(|(p, r)| p * r).sum();
                let share = c * c / power.max(1e-300);
                if share > 0.1 && best.as_ref().is_none_or(|f| share > f.share) {
                    best = Some(Follower {
                        actuator: a,
                        other: b,
                        what,
                        share,
                    });
                }
            }
        }
        out.extend(best);
    }
    out
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
    prepared: &[Prepared],
    settings: &Settings,
    pi: &[f64],
    consistent: &[f64],
    essential: &[f64],
) -> Result<Validation> {
    let names: Vec<String> = plant.actuators().iter().map(|j| j.name.clone()).collect();
    let nominal = base.project(&plant.values());
    let mut recorded = Vec::new();
    for ((r, s), q) in records.iter().zip(stacks).zip(prepared) {
        let again = settings.signals.average && signals::averaged(r).is_some();
        let whole = signals::Settings {
            average: false,
            ..settings.signals.clone()
        };
        let p = match again {
            true => Prepared::new(r, plant, &whole)?,
            false => q.clone(),
        };
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
                let range = a * s.count..(a + 1) * s.count;
                for (e, t) in e[range.clone()].iter().zip(&s.measured[range]) {
                    sum[0] += e * e;
                    sum[1] += t * t;
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
    let traces: Vec<Trace> = recorded
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
        .collect();
    Ok(Validation {
        fit: errors(Purpose::Fit, consistent).unwrap_or_else(empty),
        holdout: errors(Purpose::Holdout, consistent),
        plain: both(pi),
        essential: both(essential),
        nominal: both(&nominal),
        followers: followers(&names, &traces),
        traces,
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
        out.push(Warning::new(WarningKind::UnitSuspect, &joint.name, message));
    }
    out
}
