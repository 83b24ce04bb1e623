//! The result of [`identify`](super::identify).

use super::body::LoadBody;
use super::gain::Gains;
use super::one_step::OneStep;
use super::settings::Method;
use super::two_step::TwoStep;
use crate::error::{Error, Result, Warning};
use crate::plant::Plant;
use crate::robot::Robot;

/// Everything that is known of the load afterwards.
#[derive(Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Identified {
    /// robot
    pub robot: String,
    /// its actuators, in the order of the log columns
    pub joints: Vec<String>,
    /// link or platform in whose frame the load is given
    pub frame: String,
    /// all parameters at once
    pub one_step: OneStep,
    /// the published estimator, where it applies
    pub two_step: Option<TwoStep>,
    /// why the published estimator does not apply
    pub no_two_step: String,
    /// factors of the measured torques, where a known load tells them
    pub gain: Option<Gains>,
    /// estimate that counts
    pub method: Method,
    /// where the flange is in that frame, for the controllers: x y z, m, roll pitch yaw, rad
    pub flange: [f64; 6],
    /// what was found on the way
    pub warnings: Vec<Warning>,
}

impl Identified {
    /// The load by the method that counts.
    pub fn load(&self) -> &LoadBody {
        match (self.method, &self.two_step) {
            (Method::TwoStep, Some(two)) => &two.load,
            _ => &self.one_step.load,
        }
    }

    /// The robot with the load in the body that carries it; of a closed chain, whose empty platform was recorded, with the
    /// platform as it was found. Everything else is as in the robot file.
    ///
    /// # Errors
    /// A load of which not all ten parameters are known, or a frame that is not of this robot.
    pub fn loaded(&self, plant: &Plant) -> Result<Robot> {
        let load = self.load();
        let mut robot = plant.robot().clone();
        let body = robot.bodies.iter_mut().find(|b| b.name == self.frame);
        let (Some(body), true) = (body, load.known.iter().all(|k| *k)) else {
            return Err(Error::Infeasible(format!(
                "{}: this robot does not tell all ten parameters of the load, so none of its bodies can hold it",
                self.robot
            )));
        };
        let platform = self.one_step.platform.unwrap_or_default();
        for (k, value) in body.inertia.0.iter_mut().enumerate() {
            *value += platform[k] + load.inertia.0[k];
        }
        Ok(robot)
    }
}
