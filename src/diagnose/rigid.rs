//! Torque of rigid bodies alone, and the inertia that an actuator accelerates.

use crate::dynamics::Samples;
use crate::error::Result;
use crate::plant::Plant;
use crate::signals::series::Series;

/// Rigid-body torque of a motion with a load or none, actuator-major, N m or N; `phi` may go on beyond the
/// parameters of the plant.
///
/// # Errors
/// Poses that cannot be reached.
pub fn rigid(
    plant: &Plant,
    phi: &[f64],
    load: Option<&[f64; 10]>,
    x: &Samples,
) -> Result<Vec<f64>> {
    let mut tau = plant.rigid_torque(x, &phi[..plant.parameters().len()])?;
    if let (Some(load), Some(tool)) = (load, plant.tool()) {
        let more = plant.body_columns(tool, x)? * faer::ColRef::from_slice(load);
        tau.iter_mut().enumerate().for_each(|(i, t)| *t += more[i]);
    }
    Ok(tau)
}

/// Inertia about each actuator: `√Σ_k M_jk²` about the middle of a motion.
pub fn inertia(plant: &Plant, record: &Series) -> Result<Vec<f64>> {
    let n = plant.actuators().len();
    let phi = plant.values();
    let m = plant.coordinates();
    const POINTS: usize = 8;
    let mut out = vec![0.0f64; n];
    let at = |i: usize| i * (record.count - 1) / (POINTS - 1);
    let mut x = Samples::zeros(m, POINTS);
    for k in 0..m {
        for i in 0..POINTS {
            x.q[k * POINTS + i] = record.x.q[k * record.count + at(i)];
        }
    }
    let rest = rigid(plant, &phi, None, &x)?;
    for k in 0..m {
        let mut y = x.clone();
        y.qdd[k * POINTS..(k + 1) * POINTS].fill(1.0);
        let tau = rigid(plant, &phi, None, &y)?;
        for j in 0..n {
            for i in 0..POINTS {
                out[j] += (tau[j * POINTS + i] - rest[j * POINTS + i]).powi(2) / POINTS as f64;
            }
        }
    }
    let actuators = plant.actuators();
    Ok((0..n)
        .map(|j| out[j].sqrt() + actuators[j].terms[0])
        .collect())
}
