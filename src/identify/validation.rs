//! Measured against predicted torque, record by record.

use super::equations::Equations;
use super::followers::{Follower, followers};
use super::stack::Stack;
use super::trace::Trace;
use crate::error::Result;
use crate::log::Purpose;
use crate::signals::{self, Prepared};
use std::borrow::Cow;

/// Residual of one joint.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
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
#[non_exhaustive]
pub struct Errors {
    /// norm of the residual over that of the measured torque, all joints
    pub relative_error: f64,
    /// joint by joint
    pub joints: Vec<JointError>,
}

/// All of it.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
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

/// Predicts every record as recorded (periods are not averaged) and compares. `models` are base parameters:
/// of the method alone, of the consistent model, of the essential parameters.
///
/// # Errors
/// A pose of a parallel robot that cannot be reached.
pub fn validate(equations: &Equations, models: [&[f64]; 3]) -> Result<Validation> {
    let Equations { plant, base, .. } = *equations;
    let [pi, consistent, essential] = models;
    let names: Vec<String> = plant.actuators().iter().map(|j| j.name.clone()).collect();
    let nominal = base.project(&plant.values());
    let pairs = equations.stacks.iter().zip(&equations.prepared);
    let mut recorded = Vec::new();
    for (r, (s, q)) in equations.records.iter().zip(pairs) {
        let again = equations.signals.average && signals::averaged(r).is_some();
        let whole = signals::Settings {
            average: false,
            ..equations.signals.clone()
        };
        let p = match again {
            true => Cow::Owned(Prepared::new(r, plant, &whole)?),
            false => Cow::Borrowed(q),
        };
        let stack = match again {
            true => Cow::Owned(Stack::new(plant, base, &p)?),
            false => Cow::Borrowed(s),
        };
        let velocity = plant.actuator_motion(&p.output_motion())?.qd;
        recorded.push((stack, velocity));
    }
    let errors = |purpose: Purpose, pi: &[f64]| -> Option<Errors> {
        let mine: Vec<&Stack> = recorded
            .iter()
            .map(|(s, _)| s.as_ref())
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
        .map(|(s, velocity)| Trace::new(s, consistent, velocity.clone()))
        .collect();
    Ok(Validation {
        fit: errors(Purpose::Fit, consistent).unwrap_or_else(empty),
        holdout: errors(Purpose::Holdout, consistent),
        plain: both(pi),
        essential: both(essential),
        nominal: both(&nominal),
        followers: followers(&names, &traces, |_| true),
        traces,
    })
}
