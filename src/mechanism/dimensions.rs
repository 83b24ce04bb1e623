//! Geometry of a closed chain as numbers that can be identified, with the actuators as functions of it.
//!
//! What [`Kinematics`](super::Kinematics) states for fixed dimensions is stated here once more, for one actuator and
//! any scalar in place of every dimension: with [`Dual`](super::scalar::Dual) numbers the Jacobians that a calibration
//! needs. Tests hold the two against each other.

use super::scalar::{Scalar, linear};
use nalgebra::{Matrix3, Vector3};

/// Chain of an arm and a parallelogram: nominal dimensions.
#[derive(Debug, Clone)]
pub struct ArmChain {
    /// middle of the motor axis, base axes, m
    pub motor: Vector3<f64>,
    /// `[u, y, r]`: motor axis, upwards, direction of the arm at zero
    pub rotation: Matrix3<f64>,
    /// encoder offset, rad
    pub zero: f64,
    /// arm length, m
    pub arm: f64,
    /// rod length, m
    pub rod: f64,
    /// ends of the rods from the hinge, base axes, m
    pub attachment: Vector3<f64>,
    /// hinge that it belongs to
    pub hinge: usize,
}

/// Leg of variable length: nominal dimensions.
#[derive(Debug, Clone)]
pub struct LegChain {
    /// joint at the base, base axes, m
    pub base: Vector3<f64>,
    /// joint at the platform, platform axes, m
    pub platform: Vector3<f64>,
    /// length at which the actuator reads zero, m
    pub zero: f64,
}

/// Dimensions of a mechanism.
#[derive(Debug, Clone)]
pub enum Dimensions {
    /// chains of arm and parallelogram, and the hinges of lateral bars on the platform (none: a Delta)
    Chains(Vec<ArmChain>, Vec<Vector3<f64>>),
    /// legs of variable length
    Legs(Vec<LegChain>),
}

/// Deviations of an arm chain: `motor` (3), tilts of the axis about `y` and `r`, zero, arm, rod, `attachment` (3).
pub const ARM: [&str; 11] = [
    "motor.x",
    "motor.y",
    "motor.z",
    "tilt.y",
    "tilt.r",
    "zero",
    "arm",
    "rod",
    "attachment.x",
    "attachment.y",
    "attachment.z",
];
/// Deviations of a leg.
pub const LEG: [&str; 7] = [
    "base.x",
    "base.y",
    "base.z",
    "platform.x",
    "platform.y",
    "platform.z",
    "zero",
];

impl ArmChain {
    /// Vector from the motor to the ends of the rods, in the axes `[u, y, r]` with their tilts.
    #[inline]
    fn reach<S: Scalar>(&self, e: &[S], hinge: &[S; 3], r: &[[S; 3]; 3], p: &[S; 3]) -> [S; 3] {
        let mut v = [S::constant(0.0); 3];
        for k in 0..3 {
            v[k] = p[k]
                + linear::dot(r[k], *hinge)
                + e[8 + k]
                + (-e[k])
                + (self.attachment[k] - self.motor[k]);
        }
        let v = linear::turned_back(&self.rotation, v);
        // tilts about the second axis, then about the third
        let (s1, c1) = e[3].sin_cos();
        let (s2, c2) = e[4].sin_cos();
        let a = [c1 * v[0] - s1 * v[2], v[1], s1 * v[0] + c1 * v[2]];
        [c2 * a[0] + s2 * a[1], c2 * a[1] - s2 * a[0], a[2]]
    }

    /// Rotation `[u, y, r]` with its tilts.
    pub fn tilted(&self, e: &[f64]) -> Matrix3<f64> {
        let about = |axis, angle| *nalgebra::Rotation3::from_axis_angle(&axis, angle).matrix();
        self.rotation * about(Vector3::y_axis(), e[3]) * about(Vector3::z_axis(), e[4])
    }

    /// Reading of the motor, rad, with the elbow outwards; not a number out of reach.
    pub fn reading<S: Scalar>(&self, e: &[S], hinge: &[S; 3], r: &[[S; 3]; 3], p: &[S; 3]) -> S {
        let v = self.reach(e, hinge, r, p);
        let (arm, rod) = (e[6] + self.arm, e[7] + self.rod);
        let k = (linear::dot(v, v) + arm * arm - rod * rod) / (arm * 2.0);
        let rho2 = v[1] * v[1] + v[2] * v[2];
        (-v[1]).atan2(v[2]) - (rho2 - k * k).sqrt().atan2(k) - e[5] + (-self.zero)
    }

    /// `|A B|² − l²` at a reading, m².
    pub fn closure<S: Scalar>(
        &self,
        e: &[S],
        hinge: &[S; 3],
        r: &[[S; 3]; 3],
        p: &[S; 3],
        q: S,
    ) -> S {
        let v = self.reach(e, hinge, r, p);
        let (arm, rod) = (e[6] + self.arm, e[7] + self.rod);
        let (s, c) = (q + e[5] + self.zero).sin_cos();
        let b = [v[0], v[1] + arm * s, v[2] - arm * c];
        linear::dot(b, b) - rod * rod
    }
}

impl LegChain {
    fn squared<S: Scalar>(&self, e: &[S], r: &[[S; 3]; 3], p: &[S; 3]) -> S {
        let b = [0, 1, 2].map(|k| e[3 + k] + self.platform[k]);
        let v = [0, 1, 2].map(|k| p[k] + linear::dot(r[k], b) - e[k] + (-self.base[k]));
        linear::dot(v, v)
    }

    /// Reading of the actuator, m.
    pub fn reading<S: Scalar>(&self, e: &[S], r: &[[S; 3]; 3], p: &[S; 3]) -> S {
        self.squared(e, r, p).sqrt() - e[6] + (-self.zero)
    }

    /// `|l|² − L²` at a reading, m².
    pub fn closure<S: Scalar>(&self, e: &[S], r: &[[S; 3]; 3], p: &[S; 3], q: S) -> S {
        let l = q + e[6] + self.zero;
        self.squared(e, r, p) - l * l
    }
}
