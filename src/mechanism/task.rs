//! Task coordinates: how the pose of the platform is written.
//!
//! **The convention for orientation** is that of the whole project: roll, pitch and yaw with
//! `R = Rz(yaw) Ry(pitch) Rx(roll)` (`R` turns platform axes into base axes), and
//!
//! ```text
//! ω = E(r) ṙ      E = [ Rz Ry e_x | Rz e_y | e_z ]      ω̇ = E r̈ + Ė ṙ
//! ```
//!
//! in base axes, `r = (roll, pitch, yaw)`. `det E = cos pitch`: exact and regular over the workspace
//! of any platform that tilts less than a right angle; poses closer than [`PITCH_MARGIN`] to it are
//! refused. A yaw of any size is welcome.

use crate::error::{Error, Result};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// Distance from `|pitch| = π/2` that a pose must keep, rad.
pub const PITCH_MARGIN: f64 = 0.05;

/// What the task coordinates are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Task {
    /// `x, y, z, roll, pitch, yaw` of the platform
    Pose,
    /// `x, y, z, theta`: translations and a rotation about the vertical
    Schoenflies,
    /// `x, y, z`
    Translation,
    /// independent joints of a general closed chain
    Joints(usize),
}

/// Motion of a rigid platform: pose, twist and acceleration of its origin, base axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlatformMotion {
    /// origin, m
    pub position: Vector3<f64>,
    /// turns platform axes into base axes
    pub rotation: Matrix3<f64>,
    /// velocity of the origin, m/s
    pub velocity: Vector3<f64>,
    /// angular velocity, rad/s
    pub omega: Vector3<f64>,
    /// acceleration of the origin (without gravity), m/s²
    pub acceleration: Vector3<f64>,
    /// angular acceleration, rad/s²
    pub alpha: Vector3<f64>,
}

/// `R = Rz(yaw) Ry(pitch) Rx(roll)`.
pub fn rotation(rpy: &Vector3<f64>) -> Matrix3<f64> {
    *Rotation3::from_euler_angles(rpy.x, rpy.y, rpy.z).matrix()
}

/// `E(r)`: angular velocity in base axes from the rates of roll, pitch and yaw.
pub fn rates_to_omega(rpy: &Vector3<f64>) -> Matrix3<f64> {
    let (sp, cp) = rpy.y.sin_cos();
    let (sy, cy) = rpy.z.sin_cos();
    Matrix3::new(cy * cp, -sy, 0.0, sy * cp, cy, 0.0, -sp, 0.0, 1.0)
}

/// `Ė(r, ṙ)`.
pub fn rates_to_omega_rate(rpy: &Vector3<f64>, rate: &Vector3<f64>) -> Matrix3<f64> {
    let (sp, cp) = rpy.y.sin_cos();
    let (sy, cy) = rpy.z.sin_cos();
    let (p, y) = (rate.y, rate.z);
    Matrix3::new(
        -sy * y * cp - cy * sp * p,
        -cy * y,
        0.0,
        cy * y * cp - sy * sp * p,
        -sy * y,
        0.0,
        -cp * p,
        0.0,
        0.0,
    )
}

/// Roll, pitch and yaw of a rotation; pitch in ±π/2, roll and yaw in ±π.
pub fn rpy(r: &Matrix3<f64>) -> Vector3<f64> {
    Vector3::new(
        r.m32.atan2(r.m33),
        (-r.m31).atan2(r.m11.hypot(r.m21)),
        r.m21.atan2(r.m11),
    )
}

/// Rotation of a quaternion with the scalar first; its length does not matter.
///
/// # Errors
/// A quaternion without length.
pub fn from_quaternion(wxyz: [f64; 4]) -> Result<Matrix3<f64>> {
    let q = nalgebra::Quaternion::new(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
    match UnitQuaternion::try_new(q, 1e-6) {
        Some(q) => Ok(*q.to_rotation_matrix().matrix()),
        None => Err(Error::Argument(format!(
            "the quaternion (w, x, y, z) = {wxyz:?} has no direction; write a unit quaternion, \
             scalar first"
        ))),
    }
}

impl Task {
    /// How many coordinates there are.
    pub fn count(self) -> usize {
        match self {
            Task::Pose => 6,
            Task::Schoenflies => 4,
            Task::Translation => 3,
            Task::Joints(n) => n,
        }
    }

    /// Names of the coordinates of a platform; those of joints are the joints' own.
    pub fn names(self) -> &'static [&'static str] {
        match self {
            Task::Pose => &["x", "y", "z", "roll", "pitch", "yaw"],
            Task::Schoenflies => &["x", "y", "z", "theta"],
            Task::Translation => &["x", "y", "z"],
            Task::Joints(_) => &[],
        }
    }

    /// Whether coordinate `k` of a platform is an angle.
    pub fn is_angle(self, k: usize) -> bool {
        !matches!(self, Task::Joints(_)) && k >= 3
    }

    /// Why a pose cannot be written in these coordinates.
    pub fn unwritable(self, x: &[f64]) -> Option<String> {
        let limit = std::f64::consts::FRAC_PI_2 - PITCH_MARGIN;
        match (self, x.get(4)) {
            (Task::Pose, Some(&pitch)) if pitch.abs() > limit => Some(format!(
                "pitch is {pitch:.3} rad; roll, pitch and yaw need |pitch| below {limit:.3} rad \
                 (turn the base or platform frame)"
            )),
            _ => None,
        }
    }

    /// Coordinates and their two derivatives of a platform motion.
    ///
    /// # Errors
    /// A motion outside what these coordinates can write: a tilt of a Schoenflies robot, a pitch
    /// of a right angle, joints in place of a platform.
    pub fn from_motion(self, m: &PlatformMotion) -> Result<[Vec<f64>; 3]> {
        let r = rpy(&m.rotation);
        let (mut x, mut xd, mut xdd) = (
            m.position.as_slice().to_vec(),
            m.velocity.as_slice().to_vec(),
            m.acceleration.as_slice().to_vec(),
        );
        let tilt = |what: &str, v: f64, unit: &str| {
            Error::Argument(format!(
                "the platform cannot do this motion: {what} of {v:.3e} {unit}; it moves in {} only",
                self.names().join(", ")
            ))
        };
        match self {
            Task::Pose => {
                let probe = [0.0, 0.0, 0.0, r.x, r.y, r.z];
                if let Some(why) = self.unwritable(&probe) {
                    return Err(Error::Infeasible(why));
                }
                let e = rates_to_omega(&r);
                let Some(inverse) = e.try_inverse() else {
                    return Err(Error::Infeasible("pitch is a right angle".into()));
                };
                let rate = inverse * m.omega;
                let second = inverse * (m.alpha - rates_to_omega_rate(&r, &rate) * rate);
                x.extend(r.iter());
                xd.extend(rate.iter());
                xdd.extend(second.iter());
            }
            Task::Schoenflies | Task::Translation => {
                let turning = if self == Task::Translation { 3 } else { 2 };
                for (v, unit) in [(r, "rad"), (m.omega, "rad/s"), (m.alpha, "rad/s^2")] {
                    for k in 0..turning {
                        if v[k].abs() > 1e-6 {
                            return Err(tilt("a rotation", v[k], unit));
                        }
                    }
                }
                if self == Task::Schoenflies {
                    x.push(r.z);
                    xd.push(m.omega.z);
                    xdd.push(m.alpha.z);
                }
            }
            Task::Joints(_) => {
                return Err(Error::Argument(
                    "this mechanism has no platform: give a motion of its joints".into(),
                ));
            }
        }
        Ok([x, xd, xdd])
    }

    /// The platform motion that coordinates and their derivatives stand for; `None` for joints.
    pub fn motion(self, x: &[f64], xd: &[f64], xdd: &[f64]) -> Option<PlatformMotion> {
        let angles = |a: &[f64]| match self {
            Task::Pose => Vector3::new(a[3], a[4], a[5]),
            Task::Schoenflies => Vector3::new(0.0, 0.0, a[3]),
            _ => Vector3::zeros(),
        };
        if matches!(self, Task::Joints(_)) || [x, xd, xdd].iter().any(|a| a.len() != self.count()) {
            return None;
        }
        let (r, rd, rdd) = (angles(x), angles(xd), angles(xdd));
        let e = rates_to_omega(&r);
        Some(PlatformMotion {
            position: Vector3::new(x[0], x[1], x[2]),
            rotation: rotation(&r),
            velocity: Vector3::new(xd[0], xd[1], xd[2]),
            omega: e * rd,
            acceleration: Vector3::new(xdd[0], xdd[1], xdd[2]),
            alpha: e * rdd + rates_to_omega_rate(&r, &rd) * rd,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angular_velocity_and_acceleration_are_exact() {
        let (r0, v, a) = (
            Vector3::new(0.4, -0.6, 2.0),
            Vector3::new(0.7, -1.1, 0.3),
            Vector3::new(-2.0, 0.9, 1.7),
        );
        let at = |s: f64| rotation(&(r0 + v * s + a * (0.5 * s * s)));
        let omega = |s: f64| {
            let h = 1e-5;
            let skew = (at(s + h) - at(s - h)) / (2.0 * h) * at(s).transpose();
            Vector3::new(skew.m32, skew.m13, skew.m21)
        };
        let x = [&[0.1, 0.2, 0.3], r0.as_slice()].concat();
        let xd = [&[0.0; 3], v.as_slice()].concat();
        let xdd = [&[0.0; 3], a.as_slice()].concat();
        let m = Task::Pose.motion(&x, &xd, &xdd).unwrap();
        assert!((m.omega - omega(0.0)).norm() < 1e-9);
        let alpha = (omega(1e-4) - omega(-1e-4)) / 2e-4;
        assert!((m.alpha - alpha).norm() < 1e-5);
        let back = Task::Pose.from_motion(&m).unwrap();
        for (a, b) in back.iter().zip([&x, &xd, &xdd]) {
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-13));
        }
        assert!(Task::Schoenflies.from_motion(&m).is_err());
        assert!(Task::Translation.from_motion(&m).is_err());
    }

    #[test]
    fn pitch_near_a_right_angle_is_refused_with_the_number() {
        let why = Task::Pose.unwritable(&[0.0, 0.0, 0.0, 0.0, 1.55, 0.0]);
        assert!(why.unwrap().contains("1.550"));
        assert!(from_quaternion([0.0; 4]).is_err());
    }
}
