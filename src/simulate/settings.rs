//! How to simulate: rate, step, controller, deviations.

use super::control::Controller;
use super::effects::Effects;
use crate::error::{Error, Result};

/// How to simulate.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Settings {
    /// samples a second of the log, Hz
    pub rate: f64,
    /// largest step of the integrator, s
    pub step: f64,
    /// periods run before the log begins
    pub lead_in: u32,
    /// controller
    pub controller: Controller,
    /// natural frequency of the tracking error, Hz
    pub bandwidth: f64,
    /// damping ratio of the tracking error
    pub damping: f64,
    /// what the robot does that its model does not
    pub effects: Effects,
    /// of everything random
    pub seed: u64,
}

crate::settings::changeable!(Settings);

impl Default for Settings {
    fn default() -> Self {
        Settings {
            rate: 1000.0,
            step: 2.5e-4,
            lead_in: 1,
            controller: Controller::Feedforward,
            bandwidth: 10.0,
            damping: 1.0,
            effects: Effects::default(),
            seed: 0,
        }
    }
}

impl Settings {
    /// Refuses what cannot be.
    ///
    /// # Errors
    /// [`Error::Argument`] with the option and what it may be.
    pub fn check(&self) -> Result<()> {
        let positive = [
            ("rate", self.rate),
            ("step", self.step),
            ("bandwidth", self.bandwidth),
            ("damping", self.damping),
        ];
        for (name, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::Argument(format!(
                    "--{name} must be a positive number, not {value}"
                )));
            }
        }
        if std::f64::consts::TAU * self.bandwidth * self.damping * self.step > 0.5 {
            return Err(Error::Argument(format!(
                "a bandwidth of {} Hz needs a smaller --step than {} s",
                self.bandwidth, self.step
            )));
        }
        if !(0.0..1.0).contains(&self.effects.perturb) {
            return Err(Error::Argument(format!(
                "--perturb is a fraction from 0 to below 1, not {}",
                self.effects.perturb
            )));
        }
        if !(self.effects.torque_delay >= 0.0 && self.effects.torque_delay < 1.0) {
            return Err(Error::Argument(format!(
                "--torque-delay must be from 0 to below 1 s, not {}",
                self.effects.torque_delay
            )));
        }
        Ok(())
    }
}
