//! How well the model will know torques that the motion did not visit.

use super::json::INFINITE;
use crate::base::BaseParameters;
use crate::error::Result;
use crate::plant::Plant;
use faer::Mat;

/// States of the workspace that are looked at.
const STATES: usize = 400;
/// Their seed: another than those that the base parameters were found with.
const SEED: u64 = 0x70_2905;

/// Torque uncertainty left over the workspace: at random states inside the limits, with `Y_b` the regressor of the
/// base parameters there and `C` their predicted covariance, `√(mean diag(Y_b C Y_bᵀ))` for each actuator.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct TorqueUncertainty {
    /// predicted standard deviation of the torque of each actuator, N m or N
    pub std: Vec<f64>,
    /// root mean square of the nominal torque there, N m or N
    pub rms: Vec<f64>,
    /// random states looked at
    pub states: usize,
}

impl TorqueUncertainty {
    /// Of parameters with a covariance.
    pub(super) fn of(plant: &Plant, base: &BaseParameters, covariance: &Mat<f64>) -> Result<Self> {
        // series of the actuators follow a platform from one sample to the next: its poses are drawn
        let plant = plant.by_platform();
        let states = plant.random_states(STATES, SEED);
        let rows = base.select(plant.regressor(&states)?.as_ref());
        let torque = plant.nominal_torque(&states)?;
        let spread = &rows * covariance;
        let actuators = plant.actuated().len();
        let count = states.count.max(1);
        let mean = |j: usize, of: &dyn Fn(usize) -> f64| {
            let sum: f64 = (j * count..(j + 1) * count).map(of).sum();
            // from a covariance that does not exist: nothing is known
            match sum.is_nan() {
                true => INFINITE,
                false => (sum / count as f64).max(0.0).sqrt().min(INFINITE),
            }
        };
        let variance = |i: usize| -> f64 {
            let each = (0..rows.ncols()).map(|k| spread[(i, k)] * rows[(i, k)]);
            each.sum()
        };
        Ok(TorqueUncertainty {
            std: (0..actuators).map(|j| mean(j, &variance)).collect(),
            rms: (0..actuators)
                .map(|j| mean(j, &|i| torque[i].powi(2)))
                .collect(),
            states: states.count,
        })
    }

    /// All actuators together: standard deviation over nominal torque, each in units of the torque noise so that
    /// forces and torques add.
    pub fn relative(&self, noise: &[f64]) -> f64 {
        let norm = |v: &[f64]| -> f64 {
            let each = v.iter().zip(noise).map(|(x, n)| (x / n).powi(2));
            each.sum::<f64>().sqrt()
        };
        norm(&self.std) / norm(&self.rms).max(f64::MIN_POSITIVE)
    }
}
