//! The result of a simulation.

use super::simulator::Instant;
use crate::dynamics::Samples;
use crate::error::{Result, Warning};
use crate::plant::Plant;
use crate::trajectory::Fourier;
use nalgebra::DVector;

/// What really happened: the simulated motion without any sensor.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Run {
    /// times, s, from 0
    pub t: Vec<f64>,
    /// motion of the coordinates (of the platform, for parallel robots)
    pub motion: Samples,
    /// motion of the actuators
    pub actuators: Samples,
    /// torque that the drives applied, actuator-major, N m or N
    pub tau: Vec<f64>,
    /// the same as the sensor sees it: delayed where the effects say so
    pub tau_seen: Vec<f64>,
    /// commanded positions of the actuators, actuator-major
    pub reference: Vec<f64>,
    /// what went not quite as planned
    pub warnings: Vec<Warning>,
}

impl Run {
    /// Room for so many samples, a time `dt` apart.
    pub fn new(plant: &Plant, count: usize, dt: f64) -> Self {
        let (m, na) = (plant.coordinates(), plant.actuated().len());
        Run {
            t: (0..count).map(|k| k as f64 * dt).collect(),
            motion: Samples::zeros(m, count),
            actuators: Samples::zeros(na, count),
            tau: vec![0.0; na * count],
            tau_seen: vec![0.0; na * count],
            reference: vec![0.0; na * count],
            warnings: Vec::new(),
        }
    }

    /// Sets sample `k`; `actuated` are the joints that are driven, `seen` the torque that the sensor shows.
    pub(super) fn set(&mut self, k: usize, now: &Instant, seen: &DVector<f64>, actuated: &[usize]) {
        let count = self.t.len();
        for c in 0..now.x.len() {
            self.motion.q[c * count + k] = now.x[c];
            self.motion.qd[c * count + k] = now.xd[c];
            self.motion.qdd[c * count + k] = now.xdd[c];
        }
        for (a, &j) in actuated.iter().enumerate() {
            self.actuators.q[a * count + k] = now.q[j];
            self.actuators.qd[a * count + k] = now.qd[j];
            self.actuators.qdd[a * count + k] = now.qdd[j];
            self.tau[a * count + k] = now.tau[a];
            self.tau_seen[a * count + k] = seen[a];
        }
    }
}

/// Commanded positions of the actuators at times after `start`.
///
/// # Errors
/// A pose of a parallel robot that cannot be reached.
pub fn reference(plant: &Plant, fourier: &Fourier, start: f64, t: &[f64]) -> Result<Vec<f64>> {
    let (m, count) = (fourier.dof(), t.len());
    let mut motion = Samples::zeros(m, count);
    let mut x = vec![0.0; m];
    for (k, &t) in t.iter().enumerate() {
        fourier.evaluate(start + t, [&mut x]);
        for (c, v) in x.iter().enumerate() {
            motion.q[c * count + k] = *v;
        }
    }
    Ok(plant.actuator_motion(&motion)?.q)
}
