//! Measured and predicted torque of a record over time, for figures and for what residuals follow.

use super::stack::Stack;
use crate::log::Purpose;

/// Measured and predicted torque of one record: actuator-major over the filtered samples.
#[derive(Debug, Clone, serde::Serialize)]
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
    /// predicted torque of a model
    pub predicted: Vec<f64>,
    /// velocities of the actuators
    pub velocity: Vec<f64>,
}

impl Trace {
    /// Of the equations of a record, with base parameters `pi` and the velocities of the actuators.
    pub fn new(stack: &Stack, pi: &[f64], velocity: Vec<f64>) -> Self {
        Trace {
            name: stack.name.clone(),
            purpose: stack.purpose,
            time: stack.time.clone(),
            rate: stack.rate,
            measured: stack.measured.clone(),
            predicted: stack.predicted(pi),
            velocity,
        }
    }
}
