//! The result of [`identify`](super::identify).

use super::breakaway::Breakaway;
use super::cross_validation::Trial;
use super::essential::Essential;
use super::validation::Validation;
use crate::base::BaseParameters;
use crate::error::Warning;
use crate::plant::Plant;
use crate::robot::{Prior, Robot};
use crate::signals::Prepared;
use faer::Mat;

/// How a record was read that came in parts.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Share {
    /// name of the record
    pub record: String,
    /// rows that were used
    pub rows: usize,
    /// parts in which they were read
    pub parts: usize,
    /// rows that figures show
    pub shown: usize,
}

/// What identification came to.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Identification {
    /// a file of the user with the model in it
    pub scene: Option<crate::export::Edited>,
    /// base parameters of the plant
    pub base: BaseParameters,
    /// estimate of the base parameters by the method alone
    pub pi: Vec<f64>,
    /// standard deviations of it, correlation in time included
    pub std: Vec<f64>,
    /// the whole covariance
    #[serde(serialize_with = "crate::output::rows")]
    pub covariance: Mat<f64>,
    /// standard deviations that the robot file's torque noise promises, white
    pub predicted_std: Vec<f64>,
    /// variance through correlation in time, relative to white residuals
    pub inflation: f64,
    /// standard parameters, physically consistent unless asked otherwise
    pub phi: Vec<f64>,
    /// base parameters of `phi`
    pub pi_consistent: Vec<f64>,
    /// standard deviations of `phi`: data and prior
    pub phi_std: Vec<f64>,
    /// strength of the prior that was used
    pub prior_strength: f64,
    /// how it was chosen
    pub trials: Vec<Trial>,
    /// smallest over largest eigenvalue of any pseudo-inertia, and the body
    pub margin: Option<(f64, String)>,
    /// whether every body can exist and no friction or armature is negative
    pub consistent: bool,
    /// essential parameters
    pub essential: Essential,
    /// condition number of the weighted equations
    pub condition: f64,
    /// covariance of the residual between actuators, (N m)²
    #[serde(serialize_with = "crate::output::rows")]
    pub residual_covariance: Mat<f64>,
    /// share of the samples that the robust method set aside
    pub outliers: Option<f64>,
    /// breakaway friction of the drives of which it was asked for and found
    pub breakaway: Vec<Breakaway>,
    /// residuals record by record, of the base estimate and of the consistent one
    pub validation: Validation,
    /// how records were read that came in parts
    pub in_parts: Vec<Share>,
    /// records as they were used, in the order of the experiment; not serialised
    #[serde(skip)]
    pub prepared: Vec<Prepared>,
    /// everything imperfect
    pub warnings: Vec<Warning>,
}

impl Identification {
    /// The robot that was identified: its values, its breakaway friction, and that they come from measurements.
    pub fn robot(&self, plant: &Plant) -> Robot {
        let mut robot = measured(plant, &self.phi);
        for b in &self.breakaway {
            let own = &mut robot.joints[plant.actuated()[b.actuator]].stribeck;
            (own.force, own.velocity) = (b.force, b.velocity);
        }
        robot
    }
}

/// A robot with these values. They come from measurements, whatever the nominal ones came from.
pub(super) fn measured(plant: &Plant, phi: &[f64]) -> Robot {
    let mut robot = plant.with_values(phi);
    robot.prior = Prior::Identified;
    robot
}
