//! Sampled motions of a platform as CSV.
//!
//! Columns `t`, then either the pose with twist and acceleration of the platform's origin in base
//! axes, `x y z qw qx qy qz vx vy vz wx wy wz ax ay az alx aly alz`, or the task coordinates with
//! their derivatives, `x y z theta dx dy dz dtheta ddx ddy ddz ddtheta` (likewise for `x y z` and
//! for `x y z roll pitch yaw`). Mechanisms without a platform have joints: `q1.. dq1.. ddq1..`.

use super::Mechanism;
use super::task::{PlatformMotion, Task, from_quaternion};
use crate::dynamics::Samples;
use crate::error::{Error, Result};
use crate::trajectory::samples::{column_names, read_columns, read_samples};
use nalgebra::Vector3;
use std::path::Path;

/// Columns of a pose with its derivatives.
const POSE: [&str; 19] = [
    "x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz", "ax", "ay", "az",
    "alx", "aly", "alz",
];

impl Mechanism {
    /// Times and motion of the task coordinates of a CSV file. Columns may stand in any order;
    /// others are ignored.
    ///
    /// # Errors
    /// A file that cannot be read, columns that are missing, fields that are no numbers, and
    /// motions that the platform cannot do (a tilt of a Schoenflies robot), with the line.
    pub fn read_motion(&self, path: impl AsRef<Path>) -> Result<(Vec<f64>, Samples)> {
        let path = path.as_ref();
        if let Task::Joints(n) = self.task {
            let read = read_samples(path, n)?;
            let motion = Samples {
                dof: n,
                count: read.len(),
                q: read.q.concat(),
                qd: read.qd.concat(),
                qdd: read.qdd.concat(),
            };
            return Ok((read.t, motion));
        }
        let header = column_names(path)?;
        let has = |name: &str| header.iter().any(|h| h == name);
        let mut coordinates = vec!["t".to_string()];
        for prefix in ["", "d", "dd"] {
            coordinates.extend(self.task.names().iter().map(|n| format!("{prefix}{n}")));
        }
        if POSE.iter().any(|c| c.len() > 1 && has(c)) {
            let names: Vec<String> = std::iter::once("t")
                .chain(POSE)
                .map(str::to_string)
                .collect();
            return self.from_poses(path, &read_columns(path, &names)?);
        }
        if !has("x") && has("q1") {
            return Err(Error::file(
                path,
                "",
                format!(
                    "it has joint columns; the motion of a platform is needed: {}, or {}",
                    coordinates.join(" "),
                    POSE.join(" ")
                ),
            ));
        }
        let mut columns = read_columns(path, &coordinates)?;
        let t = columns.remove(0);
        let m = self.freedoms();
        let motion = Samples {
            dof: m,
            count: t.len(),
            q: columns[..m].concat(),
            qd: columns[m..2 * m].concat(),
            qdd: columns[2 * m..].concat(),
        };
        Ok((t, motion))
    }

    /// Task coordinates of poses: `t`, then the columns of [`POSE`].
    fn from_poses(&self, path: &Path, columns: &[Vec<f64>]) -> Result<(Vec<f64>, Samples)> {
        let t = &columns[0];
        let mut motion = Samples::zeros(self.freedoms(), t.len());
        for s in 0..t.len() {
            let at = |k: usize| columns[1 + k][s];
            let vector = |k: usize| Vector3::new(at(k), at(k + 1), at(k + 2));
            let line = |e: Error| Error::file(path, format!("line {}", s + 2), e.to_string());
            let wxyz = [at(3), at(4), at(5), at(6)];
            let norm = wxyz.iter().map(|x| x * x).sum::<f64>().sqrt();
            if (norm - 1.0).abs() > 1e-3 {
                return Err(line(Error::Infeasible(format!(
                    "the quaternion (w, x, y, z) = {wxyz:?} has length {norm:.4}; write a unit \
                     quaternion, scalar first"
                ))));
            }
            let rotation = from_quaternion(wxyz).map_err(line)?;
            let state = PlatformMotion {
                position: vector(0),
                rotation,
                velocity: vector(7),
                omega: vector(10),
                acceleration: vector(13),
                alpha: vector(16),
            };
            let x = self.task.from_motion(&state).map_err(line)?;
            for k in 0..motion.dof {
                motion.q[k * t.len() + s] = x[0][k];
                motion.qd[k * t.len() + s] = x[1][k];
                motion.qdd[k * t.len() + s] = x[2][k];
            }
        }
        Ok((t.clone(), motion))
    }
}
