//! The load as robot controllers take it: Franka Desk, URScript, KUKA.
//!
//! All three want mass, centre of mass and inertia in the frame of the flange, the inertia about the centre of mass.
//! The load is identified in the frame of the last body, which [`in_flange`] turns into that of the flange.

use crate::error::{Error, Result};
use crate::robot::Inertia;
use nalgebra::{Matrix3, Rotation3, SymmetricEigen, Vector3};
use serde_json::{Value, json};

/// Where the flange is in the frame of the body that carries the load: x y z, m, roll pitch yaw, rad.
pub type Flange = [f64; 6];

/// A load in the frame of the flange: mass, centre of mass, tensor about it.
///
/// # Errors
/// A load without mass.
pub fn in_flange(load: &Inertia, flange: &Flange) -> Result<(f64, Vector3<f64>, Matrix3<f64>)> {
    let mass = load.mass();
    let Some(com) = load.com().filter(|_| mass > 0.0) else {
        return Err(Error::Infeasible(format!(
            "no controller takes a load of {mass} kg; see load.json for what was found"
        )));
    };
    let [x, y, z, roll, pitch, yaw] = *flange;
    let turn = Rotation3::from_euler_angles(roll, pitch, yaw).into_inner();
    let centre = turn.transpose() * (com - Vector3::new(x, y, z));
    Ok((mass, centre, turn.transpose() * load.tensor_com() * turn))
}

fn rounded(x: f64, digits: i32) -> f64 {
    let scale = 10f64.powi(digits);
    // no minus before a zero
    (x * scale).round() / scale + 0.0
}

/// `endeffector-config.json` of an archive for Franka Desk: the tensor and the transformation are lists by columns; the
/// frame of the end effector is left at the flange.
///
/// # Errors
/// As [`in_flange`].
pub fn franka(load: &Inertia, flange: &Flange) -> Result<Value> {
    let (mass, com, tensor) = in_flange(load, flange)?;
    let list = |x: &[f64]| -> Vec<f64> { x.iter().map(|v| rounded(*v, 6)).collect() };
    Ok(json!({
        "id": "identified-load",
        "name": "Identified load",
        "color": "#808080",
        "mass": rounded(mass, 4),
        "centerOfMass": list(com.as_slice()),
        "transformation": nalgebra::Matrix4::<f64>::identity().as_slice(),
        "inertia": list(tensor.as_slice()),
    }))
}

/// A line of URScript: kg, m, and the tensor about the centre of mass as xx, yy, zz, xy, xz, yz.
///
/// # Errors
/// As [`in_flange`].
pub fn urscript(load: &Inertia, flange: &Flange) -> Result<String> {
    let (mass, c, i) = in_flange(load, flange)?;
    Ok(format!(
        "set_target_payload({:.4}, [{:.5}, {:.5}, {:.5}], [{:.6}, {:.6}, {:.6}, {:.6}, {:.6}, {:.6}])\n",
        mass, c.x, c.y, c.z, i.m11, i.m22, i.m33, i.m12, i.m13, i.m23
    ))
}

/// The assignment of KUKA load data: kg, mm, degrees of the principal axes (A about z, B about the new y, C about the new
/// x), principal moments, kg m².
///
/// # Errors
/// As [`in_flange`].
pub fn kuka(load: &Inertia, flange: &Flange) -> Result<String> {
    let (mass, c, tensor) = in_flange(load, flange)?;
    let (moments, [a, b, g]) = principal(&tensor);
    Ok(format!(
        "LOAD_DATA[1]={{M {:.4},CM {{X {:.2},Y {:.2},Z {:.2},A {:.3},B {:.3},C {:.3}}},J {{X {:.6},Y {:.6},Z {:.6}}}}}\n",
        mass,
        1e3 * c.x,
        1e3 * c.y,
        1e3 * c.z,
        a.to_degrees(),
        b.to_degrees(),
        g.to_degrees(),
        moments.x,
        moments.y,
        moments.z
    ))
}

/// Principal moments and the angles of their axes, `R = R_z(A) R_y(B) R_x(C)`; the axes in the order that turns least.
fn principal(tensor: &Matrix3<f64>) -> (Vector3<f64>, [f64; 3]) {
    let eigen = SymmetricEigen::new(*tensor);
    let (values, axes) = (eigen.eigenvalues, eigen.eigenvectors);
    const ORDERS: [[usize; 3]; 6] = [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ];
    let mut best: Option<(f64, Matrix3<f64>, [usize; 3])> = None;
    for order in ORDERS {
        let mut turn = Matrix3::from_columns(&order.map(|k| axes.column(k).into_owned()));
        // each axis towards its own direction, then right-handed
        for k in 0..3 {
            if turn[(k, k)] < 0.0 {
                turn.column_mut(k).neg_mut();
            }
        }
        if turn.determinant() < 0.0 {
            let least = (0..3).min_by(|a, b| turn[(*a, *a)].total_cmp(&turn[(*b, *b)]));
            turn.column_mut(least.unwrap_or(0)).neg_mut();
        }
        let near = turn.trace();
        if best.as_ref().is_none_or(|b| near > b.0) {
            best = Some((near, turn, order));
        }
    }
    let (_, turn, order) = best.unwrap_or((0.0, Matrix3::identity(), [0, 1, 2]));
    let (c, b, a) = Rotation3::from_matrix_unchecked(turn).euler_angles();
    (Vector3::from(order.map(|k| values[k])), [a, b, c])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load() -> Inertia {
        let turn = Rotation3::from_euler_angles(0.3, -0.2, 0.5).into_inner();
        let tensor =
            turn * Matrix3::from_diagonal(&Vector3::new(0.01, 0.02, 0.025)) * turn.transpose();
        Inertia::from_com(2.0, Vector3::new(0.01, -0.02, 0.06), tensor)
    }

    #[test]
    fn principal_axes_give_the_tensor_back() {
        let tensor = load().tensor_com();
        let (moments, [a, b, c]) = principal(&tensor);
        let turn = Rotation3::from_euler_angles(c, b, a).into_inner();
        let again = turn * Matrix3::from_diagonal(&moments) * turn.transpose();
        assert!((again - tensor).norm() < 1e-12);
    }

    #[test]
    fn all_three_say_the_same() {
        let flange = [0.0, 0.0, 0.107, 0.0, 0.0, std::f64::consts::FRAC_PI_2];
        let (mass, com, tensor) = in_flange(&load(), &flange).unwrap();
        assert_eq!(mass, 2.0);
        // a quarter turn about z: x of the flange is y of the body
        assert!((com - Vector3::new(-0.02, -0.01, -0.047)).norm() < 1e-12);
        assert!((tensor[(0, 0)] - load().tensor_com()[(1, 1)]).abs() < 1e-12);
        let franka = franka(&load(), &flange).unwrap();
        assert_eq!(franka["inertia"].as_array().unwrap().len(), 9);
        assert_eq!(franka["transformation"][15], 1.0);
        let script = urscript(&load(), &flange).unwrap();
        assert!(
            script.starts_with("set_target_payload(2.0000, [-0.02000, -0.01000, -0.04700], ["),
            "{script}"
        );
        let kuka = kuka(&load(), &flange).unwrap();
        assert!(
            kuka.starts_with("LOAD_DATA[1]={M 2.0000,CM {X -20.00,Y -10.00,Z -47.00,"),
            "{kuka}"
        );
        assert!(urscript(&Inertia([0.0; 10]), &flange).is_err());
    }
}
