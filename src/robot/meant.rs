//! What the rounded numbers of a URDF mean, for the one question that they would decide wrongly.
//!
//! Files are printed with few digits: `1.5708` stands for a right angle, `-5.24e-08` for zero. The
//! dynamics take them as written. Which parameters can be identified is another matter: axes that
//! are parallel, at right angles or meet leave some parameters without any effect, and an error of
//! 1e-7 rad in the file gives them an effect of 1e-7. Such parameters exist by rounding only. So
//! [`BaseParameters`](crate::base::BaseParameters) looks at the placement that is meant:
//!
//! * an angle within [`ANGLE`] of a multiple of a right angle, zero included, is that multiple;
//! * so is one that is its rounding, or its beginning, to the digits written, two decimals at
//!   least: `3.14`, `1.571`. A warning asks to write all digits;
//! * a component of a unit axis below [`ANGLE`], and a coordinate of an origin below [`ANGLE`]
//!   of the longest one of the file (of 1 m, where that is less), is zero.

use super::Robot;
use nalgebra::{Matrix3, Rotation3, Vector3};
use std::f64::consts::FRAC_PI_2;

/// What no drawing states and few machines keep, rad: 2 seconds of arc, 10 µm on a metre.
pub const ANGLE: f64 = 1e-5;
/// What is less than this is exact already: rounding of the arithmetic.
const EXACT: f64 = 1e-10;

/// Where a body sits on its parent, and how it moves: see the fields of [`Body`](super::Body).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// unit axis, in the axes of the body frame
    pub axis: Vector3<f64>,
    /// rotation at zero joint position
    pub rotation: Matrix3<f64>,
    /// position in the parent's frame at zero joint position, m
    pub position: Vector3<f64>,
}

impl Placement {
    /// Whether the two differ by more than the rounding of the arithmetic.
    pub(super) fn differs(&self, other: &Placement) -> bool {
        (self.axis - other.axis).amax() > EXACT
            || (self.rotation - other.rotation).amax() > EXACT
            || (self.position - other.position).amax() > 1e-3 * EXACT
    }
}

impl Robot {
    /// The same robot with every body where the file means it; `None` where that is where it says.
    pub fn as_meant(&self) -> Option<Robot> {
        if self.bodies.iter().all(|b| b.meant.is_none()) {
            return None;
        }
        let mut robot = self.clone();
        for body in &mut robot.bodies {
            if let Some(meant) = body.meant.take() {
                body.axis = meant.axis;
                body.rotation = meant.rotation;
                body.position = meant.position;
            }
        }
        Some(robot)
    }
}

/// An angle as it is meant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Angle {
    /// rad
    pub value: f64,
    /// it was written with so few digits that a reader must be told what it was taken for
    pub coarse: bool,
}

/// The angle (rad) that is meant by a number as written.
pub(super) fn angle(text: &str, value: f64) -> Angle {
    let turns = (value / FRAC_PI_2).round();
    let exact = turns * FRAC_PI_2;
    let off = (value - exact).abs();
    let as_written = Angle {
        value,
        coarse: false,
    };
    if !off.is_finite() || off <= EXACT {
        return as_written;
    }
    if off <= ANGLE {
        return Angle {
            value: exact,
            coarse: false,
        };
    }
    let Some(unit) = last_digit(text) else {
        return as_written;
    };
    let rounded = off <= 0.5 * unit * (1.0 + 1e-9);
    let cut = value.abs() < exact.abs() && off < unit;
    match turns != 0.0 && unit < 0.011 && (rounded || cut) {
        true => Angle {
            value: exact,
            coarse: true,
        },
        false => as_written,
    }
}

/// Value of one unit in the last digit written: `3.14` gives 0.01, `31.4e-1` as well. `None` for
/// what is not a plain decimal number.
fn last_digit(text: &str) -> Option<f64> {
    let text = text.trim().trim_start_matches(['+', '-']);
    let (mantissa, exponent) = match text.split_once(['e', 'E']) {
        Some((m, e)) => (m, e.parse::<i32>().ok()?),
        None => (text, 0),
    };
    let decimals = mantissa
        .split_once('.')
        .map_or(0, |(_, decimals)| decimals.len());
    let decimals = i32::try_from(decimals).ok()?;
    Some(10f64.powi(exponent.checked_sub(decimals)?))
}

/// The rotation of roll, pitch and yaw, as URDF defines them.
pub(super) fn rotation(rpy: &Vector3<f64>) -> Matrix3<f64> {
    match *rpy == Vector3::zeros() {
        true => Matrix3::identity(),
        false => Rotation3::from_euler_angles(rpy.x, rpy.y, rpy.z).into(),
    }
}

/// A unit axis without the components that are zero but for rounding.
pub(super) fn axis(unit: &Vector3<f64>) -> Vector3<f64> {
    let near = |x: &f64| *x != 0.0 && x.abs() < ANGLE;
    match unit.iter().any(near) {
        true => unit.map(|x| if near(&x) { 0.0 } else { x }).normalize(),
        false => *unit,
    }
}

/// An origin (m) without the coordinates that are zero but for rounding, in a file whose largest
/// coordinate is `largest`.
pub(super) fn position(written: &Vector3<f64>, largest: f64) -> Vector3<f64> {
    let smallest = ANGLE * largest.min(1.0);
    written.map(|x| if x.abs() < smallest { 0.0 } else { x })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn meant(text: &str) -> (f64, bool) {
        let a = angle(text, text.parse().unwrap());
        (a.value, a.coarse)
    }

    #[test]
    fn rounded_right_angles_are_right_angles() {
        assert_eq!(meant("-5.24e-08"), (0.0, false));
        assert_eq!(meant("1.5708"), (FRAC_PI_2, false));
        assert_eq!(meant("-1.570796"), (-FRAC_PI_2, false));
        assert_eq!(meant("3.14159"), (PI, false));
        assert_eq!(meant("3.14"), (PI, true));
        assert_eq!(meant("+31.4e-1"), (PI, true));
        assert_eq!(meant("-3.1415"), (-PI, true));
        assert_eq!(meant("1.571"), (FRAC_PI_2, true));
        assert_eq!(meant("4.71"), (1.5 * PI, true));
    }

    #[test]
    fn other_angles_stay() {
        for text in [
            "1.6",
            "3",
            "3.1",
            "1.58",
            "1.569",
            "0.7854",
            "0.0001",
            "-0.01",
            "1.5709",
            "3.1417",
            "1.5707963267948966",
            "1.570796326795",
        ] {
            assert_eq!(meant(text), (text.parse().unwrap(), false), "{text}");
        }
    }

    #[test]
    fn small_components_are_zero() {
        let a = axis(&Vector3::new(5e-8, 0.0, 1.0));
        assert_eq!(a, Vector3::z());
        let p = position(&Vector3::new(1.2e-9, 0.05, -2e-5), 0.2);
        assert_eq!(p, Vector3::new(0.0, 0.05, -2e-5));
        // a micrometre counts on a robot of a millimetre
        let p = position(&Vector3::new(1e-6, 0.0, 1e-3), 1e-3);
        assert_eq!(p.x, 1e-6);
    }
}
