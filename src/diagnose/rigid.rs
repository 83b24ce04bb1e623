//! Torque of rigid bodies alone, the inertia that an actuator accelerates, and how fast friction alone stops it.

use crate::dynamics::Samples;
use crate::error::Result;
use crate::plant::Plant;
use crate::signals::series::Series;
use nalgebra::DMatrix;

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

/// What the actuators have to move.
pub struct Moved {
    /// inertia about each actuator, `√Σ_k M_jk²`, kg m² or kg
    pub inertia: Vec<f64>,
    /// deceleration that its dry friction alone gives each actuator, `F_c (M⁻¹)_jj`, rad/s² or m/s²; of open chains
    pub stops: Vec<f64>,
}

/// What the actuators have to move, in the mean over points of a motion.
pub fn moved(plant: &Plant, record: &Series) -> Result<Moved> {
    let n = plant.actuators().len();
    let phi = plant.values();
    let m = plant.coordinates();
    const POINTS: usize = 8;
    let at = |i: usize| i * (record.count - 1) / (POINTS - 1);
    let mut x = Samples::zeros(m, POINTS);
    for k in 0..m {
        for i in 0..POINTS {
            x.q[k * POINTS + i] = record.x.q[k * record.count + at(i)];
        }
    }
    let rest = rigid(plant, &phi, None, &x)?;
    let mut masses = vec![DMatrix::<f64>::zeros(n, m); POINTS];
    for k in 0..m {
        let mut y = x.clone();
        y.qdd[k * POINTS..(k + 1) * POINTS].fill(1.0);
        let tau = rigid(plant, &phi, None, &y)?;
        for j in 0..n {
            for i in 0..POINTS {
                masses[i][(j, k)] = tau[j * POINTS + i] - rest[j * POINTS + i];
            }
        }
    }
    let actuators = plant.actuators();
    let squared = |j: usize, k: usize| -> f64 {
        masses.iter().map(|mass| mass[(j, k)].powi(2)).sum::<f64>() / POINTS as f64
    };
    let inertia = (0..n)
        .map(|j| (0..m).map(|k| squared(j, k)).sum::<f64>().sqrt() + actuators[j].terms[0])
        .collect();
    let mut stops = vec![0.0; n];
    for mut mass in masses.into_iter().filter(DMatrix::is_square) {
        (0..n).for_each(|j| mass[(j, j)] += actuators[j].terms[0]);
        let Some(inverse) = mass.try_inverse() else {
            continue;
        };
        let each = stops.iter_mut().zip(&actuators).enumerate();
        each.for_each(|(j, (s, a))| *s += a.terms[2].abs() * inverse[(j, j)] / POINTS as f64);
    }
    Ok(Moved { inertia, stops })
}
