//! Task coordinates of a closed chain along measured motions, sample by sample: from the positions of
//! its actuators, from their rates, or from a measured pose of the platform.

use super::Mechanism;
use super::task::{Task, from_quaternion, rpy};
use crate::dynamics::Samples;
use crate::error::{Error, Result};
use nalgebra::{Rotation3, UnitQuaternion};
use rayon::prelude::*;

/// Samples between the starts of pieces that are walked on different threads.
const PIECE: usize = 256;

/// Task coordinates, coordinate-major, of `q[a][i]`, by forward kinematics that starts from the
/// sample before (from home, for the first). Angles run on through whole turns.
///
/// A coarse walk gives the start of every piece; the pieces are walked in parallel.
///
/// # Errors
/// Positions that no pose of the assembly mode gives: the sample and the actuators.
pub fn forward(mechanism: &Mechanism, q: &[Vec<f64>]) -> Result<Vec<f64>> {
    let count = q.first().map_or(0, Vec::len);
    let m = mechanism.freedoms();
    let at = |i: usize| -> Vec<f64> { q.iter().map(|a| a[i]).collect() };
    let step = |i: usize, from: &[f64]| {
        mechanism
            .forward(&at(i), from)
            .map(|s| s.x)
            .map_err(|e| Error::Infeasible(format!("forward kinematics of sample {}: {e}", i + 1)))
    };
    let mut starts = vec![mechanism.home.clone()];
    for piece in 0..count.div_ceil(PIECE) {
        let x = step(piece * PIECE, &starts[piece])?;
        starts.push(x);
    }
    let pieces: Vec<Vec<f64>> = (0..count.div_ceil(PIECE))
        .into_par_iter()
        .map(|piece| {
            let mut out = Vec::with_capacity(PIECE * m);
            let mut x = starts[piece + 1].clone();
            for i in piece * PIECE..((piece + 1) * PIECE).min(count) {
                x = step(i, &x)?;
                out.extend_from_slice(&x);
            }
            Ok(out)
        })
        .collect::<Result<_>>()?;
    let mut x = vec![0.0; m * count];
    for (i, row) in pieces.iter().flat_map(|p| p.chunks_exact(m)).enumerate() {
        for k in 0..m {
            x[k * count + i] = row[k];
        }
    }
    Ok(x)
}

/// Measured rates of the coordinates, one list each.
#[derive(Debug, Clone)]
pub struct Rates {
    /// velocities
    pub velocity: Vec<Vec<f64>>,
    /// accelerations, where they were measured
    pub acceleration: Option<Vec<Vec<f64>>>,
}

/// Velocities of the coordinates, and accelerations where there are any, from measured ones of the
/// actuators along the positions `x`; one list a coordinate or actuator:
///
/// ```text
/// ẋ = D_a⁺ q̇_a        ẍ = D_a⁺ (q̈_a − F_a,xx[ẋ, ẋ])
/// ```
///
/// # Errors
/// A pose that cannot be reached.
pub fn rates(
    mechanism: &Mechanism,
    x: &[Vec<f64>],
    dq: &[Vec<f64>],
    ddq: Option<&[Vec<f64>]>,
) -> Result<Rates> {
    let (m, n) = (x.len(), mechanism.actuators());
    let mut samples = Samples::zeros(m, x.first().map_or(0, Vec::len));
    let count = samples.count;
    samples.q = x.concat();
    // `D_a⁺`, the same for both: it depends on the positions alone
    let inverse = mechanism.motion(&samples)?.a;
    let through = |of: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
        let one = |k: usize, s: usize| -> f64 {
            let terms = (0..n).map(|a| inverse[(k * n + a) * count + s] * of(a, s));
            terms.sum()
        };
        (0..m)
            .map(|k| (0..count).map(|s| one(k, s)).collect())
            .collect()
    };
    let xd = through(&|a, s| dq[a][s]);
    let Some(ddq) = ddq else {
        return Ok(Rates {
            velocity: xd,
            acceleration: None,
        });
    };
    samples.qd = xd.concat();
    let bend = mechanism.motion(&samples)?.tree.qdd;
    let at = |a: usize, s: usize| bend[mechanism.actuated[a] * count + s];
    let xdd = through(&|a, s| ddq[a][s] - at(a, s));
    Ok(Rates {
        velocity: xd,
        acceleration: Some(xdd),
    })
}

/// Task coordinates from measured pose columns `x y z qw qx qy qz`.
///
/// # Errors
/// A mechanism without a platform, or a quaternion that is none.
pub fn from_pose(mechanism: &Mechanism, pose: &[Vec<f64>]) -> Result<Vec<f64>> {
    let count = pose.first().map_or(0, Vec::len);
    let m = mechanism.freedoms();
    let mut x = vec![0.0; m * count];
    let mut last: Vec<f64> = mechanism.home.clone();
    for i in 0..count {
        let r = from_quaternion([3, 4, 5, 6].map(|k| pose[k][i]))
            .map_err(|e| Error::Infeasible(format!("pose of sample {}: {e}", i + 1)))?;
        let angles = rpy(&r);
        let mut row = vec![pose[0][i], pose[1][i], pose[2][i]];
        match mechanism.task {
            Task::Pose => row.extend([angles.x, angles.y, angles.z]),
            Task::Schoenflies => row.push(angles.z),
            Task::Translation => {}
            Task::Joints(_) => {
                return Err(Error::Argument(
                    "this mechanism has no platform whose pose could be measured".into(),
                ));
            }
        }
        for k in 0..m {
            if mechanism.task.is_angle(k) {
                let turn = 2.0 * std::f64::consts::PI;
                row[k] -= turn * ((row[k] - last[k]) / turn).round();
            }
            x[k * count + i] = row[k];
        }
        last = row;
    }
    Ok(x)
}

/// Measured pose columns `x y z qw qx qy qz` of a motion of the task coordinates: the inverse of [`from_pose`].
///
/// # Errors
/// A mechanism without a platform; a pose that cannot be reached.
pub fn to_pose(mechanism: &Mechanism, motion: &Samples) -> Result<Vec<Vec<f64>>> {
    let motion = mechanism.platform_motion(motion)?;
    let (m, count) = (motion.dof, motion.count);
    let zero = vec![0.0; m];
    let mut columns: Vec<Vec<f64>> = (0..7).map(|_| Vec::with_capacity(count)).collect();
    let mut last: Option<UnitQuaternion<f64>> = None;
    for k in 0..count {
        let x: Vec<f64> = (0..m).map(|c| motion.q[c * count + k]).collect();
        let Some(pose) = mechanism.platform().task.motion(&x, &zero, &zero) else {
            return Err(Error::Argument(
                "this mechanism has joints, not a platform, as its coordinates".into(),
            ));
        };
        let rotation = Rotation3::from_matrix_unchecked(pose.rotation);
        let mut q = UnitQuaternion::from_rotation_matrix(&rotation);
        // the sign that is nearest to the one before: no jumps in a log
        if last.is_some_and(|l| l.coords.dot(&q.coords) < 0.0) {
            q = UnitQuaternion::new_unchecked(-q.into_inner());
        }
        last = Some(q);
        let p = pose.position;
        for (column, v) in columns.iter_mut().zip([p.x, p.y, p.z, q.w, q.i, q.j, q.k]) {
            column.push(v);
        }
    }
    Ok(columns)
}
