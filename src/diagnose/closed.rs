//! Motion of the platform of a parallel robot from the measured motion of its actuators.

use crate::dynamics::Samples;
use crate::error::Result;
use crate::plant::Plant;

/// Task coordinates at every sample, by forward kinematics from the home pose onwards; velocities
/// and accelerations from `ẋ = D_a⁺ q̇_a` through central differences of the pose, which is as smooth
/// as the actuator motion it comes from.
/// Of a motion that repeats after `cycle` samples one period is solved.
///
/// # Errors
/// Actuator positions that no pose near the one before gives.
pub fn coordinates(plant: &Plant, actuators: &Samples, cycle: Option<usize>) -> Result<Samples> {
    let Some(mechanism) = plant.mechanism() else {
        return Ok(actuators.clone());
    };
    let (m, n) = (mechanism.freedoms(), actuators.dof);
    let count = cycle.unwrap_or(actuators.count);
    let mut out = Samples::zeros(m, count);
    let mut from = mechanism.home.clone();
    let mut q = vec![0.0; n];
    for i in 0..count {
        for (j, q) in q.iter_mut().enumerate() {
            *q = actuators.q[j * actuators.count + i];
        }
        from = mechanism.forward(&q, &from)?.x;
        for (k, x) in from.iter().enumerate() {
            out.q[k * count + i] = *x;
        }
    }
    // ẋ and ẍ from the actuators: with x(q_a) smooth, differentiate along the motion by a step in
    // time of the actuator motion itself, q(t ± h) ≈ q ± h q̇ + h² q̈ / 2
    const H: f64 = 1e-4;
    for i in 0..count {
        let here: Vec<f64> = (0..m).map(|k| out.q[k * count + i]).collect();
        let mut sides = Vec::with_capacity(2);
        for sign in [-1.0, 1.0] {
            for (j, q) in q.iter_mut().enumerate() {
                let [p, v, a] = actuators.at(j, i);
                *q = p + sign * H * v + 0.5 * H * H * a;
            }
            sides.push(mechanism.forward(&q, &here)?.x);
        }
        for k in 0..m {
            out.qd[k * count + i] = (sides[1][k] - sides[0][k]) / (2.0 * H);
            out.qdd[k * count + i] = (sides[1][k] - 2.0 * here[k] + sides[0][k]) / (H * H);
        }
    }
    if count == actuators.count {
        return Ok(out);
    }
    let repeated = |rows: &[f64]| -> Vec<f64> {
        let row =
            |r: &[f64]| -> Vec<f64> { r.iter().copied().cycle().take(actuators.count).collect() };
        rows.chunks_exact(count).flat_map(row).collect()
    };
    Ok(Samples {
        dof: m,
        count: actuators.count,
        q: repeated(&out.q),
        qd: repeated(&out.qd),
        qdd: repeated(&out.qdd),
    })
}
