//! Torque of rigid bodies alone, the inertia that an actuator accelerates, and how easily it is moved.

use crate::dynamics::Samples;
use crate::error::Result;
use crate::plant::Plant;
use crate::robot::Joint;
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

/// Inertia about each actuator, `√Σ_k M_jk²`, in the mean over points of a motion, kg m² or kg.
///
/// # Errors
/// Poses that cannot be reached.
pub fn inertia(plant: &Plant, record: &Series) -> Result<Vec<f64>> {
    let actuators = plant.actuators();
    let m = plant.coordinates();
    const POINTS: usize = 8;
    let at = |i: usize| i * (record.count - 1) / (POINTS - 1);
    let mut x = Samples::zeros(m, POINTS);
    for k in 0..m {
        for i in 0..POINTS {
            x.q[k * POINTS + i] = record.x.q[k * record.count + at(i)];
        }
    }
    let masses = masses(plant, &plant.values(), None, &x)?;
    let squared = |j: usize, k: usize| -> f64 {
        masses.iter().map(|mass| mass[(j, k)].powi(2)).sum::<f64>() / POINTS as f64
    };
    let of =
        |(j, a): (usize, &&Joint)| (0..m).map(|k| squared(j, k)).sum::<f64>().sqrt() + a.terms[0];
    Ok(actuators.iter().enumerate().map(of).collect())
}

/// Acceleration of each actuator by a unit of its torque where all positions are zero, `(M⁻¹)_jj`, with a load or
/// none: from it MuJoCo takes how soft its dry friction is (`dof_invweight0`). 0 where there are not as many actuators as
/// coordinates.
///
/// # Errors
/// As [`rigid`].
pub fn mobility(plant: &Plant, phi: &[f64], load: Option<&[f64; 10]>) -> Result<Vec<f64>> {
    let actuators = plant.actuators();
    let n = actuators.len();
    let x = Samples::zeros(plant.coordinates(), 1);
    let mut mass = masses(plant, phi, load, &x)?.swap_remove(0);
    if !mass.is_square() {
        return Ok(vec![0.0; n]);
    }
    (0..n).for_each(|j| mass[(j, j)] += actuators[j].terms[0]);
    let inverse = mass.try_inverse();
    Ok(inverse.map_or(vec![0.0; n], |inverse| {
        (0..n).map(|j| inverse[(j, j)].max(0.0)).collect()
    }))
}

/// Mass matrix at each sample of a motion without velocity, without rotors: a row for each actuator, a column for each
/// coordinate.
fn masses(
    plant: &Plant,
    phi: &[f64],
    load: Option<&[f64; 10]>,
    x: &Samples,
) -> Result<Vec<DMatrix<f64>>> {
    let (n, m, count) = (plant.actuators().len(), plant.coordinates(), x.count);
    let rest = rigid(plant, phi, load, x)?;
    let mut masses = vec![DMatrix::<f64>::zeros(n, m); count];
    for k in 0..m {
        let mut y = x.clone();
        y.qdd[k * count..(k + 1) * count].fill(1.0);
        let tau = rigid(plant, phi, load, &y)?;
        for j in 0..n {
            for i in 0..count {
                masses[i][(j, k)] = tau[j * count + i] - rest[j * count + i];
            }
        }
    }
    Ok(masses)
}
