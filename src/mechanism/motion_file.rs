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
use crate::output::write_atomic;
use crate::trajectory::samples::{Line, StateFn, column_names, read_columns, read_samples};
use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use std::path::Path;

/// Columns of a pose with its derivatives.
const POSE: [&str; 19] = [
    "x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz", "ax", "ay", "az",
    "alx", "aly", "alz",
];

/// Times and motion of `n` joints from the columns `t`, `q1..`, `dq1..`, `ddq1..` of a CSV file.
///
/// # Errors
/// As [`read_samples`].
pub(crate) fn read_joint_motion(path: impl AsRef<Path>, n: usize) -> Result<(Vec<f64>, Samples)> {
    let read = read_samples(path, n)?;
    let motion = Samples {
        dof: n,
        count: read.len(),
        q: read.q.concat(),
        qd: read.qd.concat(),
        qdd: read.qdd.concat(),
    };
    Ok((read.t, motion))
}

impl Mechanism {
    /// Writes a motion of the task coordinates (the platform's or the actuators') at these times as CSV: `t`, then
    /// `q1.. dq1.. ddq1.. tau1..` of the actuators (nominal forces), then the platform as [`Mechanism::read_motion`] reads it.
    ///
    /// # Errors
    /// A pose that cannot be taken, and as [`write_along`](crate::trajectory::samples::write_along).
    pub fn write_along(
        &self,
        path: impl AsRef<Path>,
        force: bool,
        times: &[f64],
        along: &StateFn,
    ) -> Result<()> {
        let (m, na) = (self.freedoms(), self.actuators());
        let mut header = vec!["t".to_string()];
        for name in ["q", "dq", "ddq", "tau"] {
            header.extend((1..=na).map(|a| format!("{name}{a}")));
        }
        let platform = self.platform().task;
        match platform {
            Task::Joints(_) => {}
            Task::Pose => header.extend(POSE.iter().map(|c| c.to_string())),
            _ => {
                for prefix in ["", "d", "dd"] {
                    header.extend(platform.names().iter().map(|n| format!("{prefix}{n}")));
                }
            }
        }
        // all is evaluated before anything is written, in pieces that fit the cache
        const PIECE: usize = 1024;
        let mut rows: Vec<f64> = Vec::with_capacity(times.len() * header.len());
        for times in times.chunks(PIECE) {
            let n = times.len();
            let mut x = Samples::zeros(m, n);
            let mut state = vec![0.0; 3 * m];
            for (s, &t) in times.iter().enumerate() {
                let (q, rest) = state.split_at_mut(m);
                let (qd, qdd) = rest.split_at_mut(m);
                along(t, [q, qd, qdd]);
                for k in 0..m {
                    x.q[k * n + s] = state[k];
                    x.qd[k * n + s] = state[m + k];
                    x.qdd[k * n + s] = state[2 * m + k];
                }
            }
            let tree = self.motion(&x)?.tree;
            let tau = self.nominal_torque(&x)?;
            let x = self.platform_of(&x, &tree);
            for (s, &t) in times.iter().enumerate() {
                rows.push(t);
                for a in [&tree.q, &tree.qd, &tree.qdd] {
                    rows.extend(self.actuated.iter().map(|&j| a[j * n + s]));
                }
                rows.extend((0..na).map(|a| tau[a * n + s]));
                let at = |a: &[f64]| -> Vec<f64> { (0..m).map(|k| a[k * n + s]).collect() };
                let (q, qd, qdd) = (at(&x.q), at(&x.qd), at(&x.qdd));
                match (platform, platform.motion(&q, &qd, &qdd)) {
                    (Task::Joints(_), _) => {}
                    (Task::Pose, Some(p)) => {
                        let r = Rotation3::from_matrix_unchecked(p.rotation);
                        let r = UnitQuaternion::from_rotation_matrix(&r);
                        rows.extend(p.position.iter());
                        rows.extend([r.w, r.i, r.j, r.k]);
                        for v in [p.velocity, p.omega, p.acceleration, p.alpha] {
                            rows.extend(v.iter());
                        }
                    }
                    _ => [q, qd, qdd].iter().for_each(|a| rows.extend(a)),
                }
            }
        }
        write_atomic(path, force, |w| {
            writeln!(w, "{}", header.join(","))?;
            let mut line = Line::default();
            for row in rows.chunks_exact(header.len()) {
                line.row(w, row[0], row[1..].iter().copied())?;
            }
            Ok(())
        })
    }

    /// Times and motion of the task coordinates of a CSV file. Columns may stand in any order;
    /// others are ignored.
    ///
    /// # Errors
    /// A file that cannot be read, columns that are missing, fields that are no numbers, and
    /// motions that the platform cannot do (a tilt of a Schoenflies robot), with the line.
    pub fn read_motion(&self, path: impl AsRef<Path>) -> Result<(Vec<f64>, Samples)> {
        let path = path.as_ref();
        if let Task::Joints(n) = self.task {
            return read_joint_motion(path, n);
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
            return self.motion_of_poses(path, &read_columns(path, &names)?);
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
    fn motion_of_poses(&self, path: &Path, columns: &[Vec<f64>]) -> Result<(Vec<f64>, Samples)> {
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
