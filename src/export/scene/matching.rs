//! Which body of a scene is which of a robot: by the names of their joints, checked by their motion.
//!
//! ```text
//! X_i = T_scene,i(q)⁻¹ X_0 T_robot,i(q)      the same for all q, where joint i is the same joint
//! ```

use crate::error::{Error, Result};
use crate::robot::{Motion, Robot};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use std::path::Path;

/// By how much frames may differ over all postures, rad or m: more than the rounding of files, less than another joint.
const SAME: f64 = 1e-3;
/// Postures at which they are compared.
const POSTURES: usize = 12;

pub(super) type Pose = Isometry3<f64>;

pub(super) fn pose(rotation: &Matrix3<f64>, position: &Vector3<f64>) -> Pose {
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(rotation));
    Isometry3::from_parts(Translation3::from(*position), rotation)
}

/// Bodies of a scene beside those of a robot.
pub(super) struct Matched {
    /// frame of the robot's body in that of the scene's
    pub(super) at: Vec<Pose>,
    /// base of the robot in the world of the scene
    pub(super) base: Pose,
}

/// The joint of a scene that a robot's joint is: of the same name, or of one that differs by a prefix only, if there is
/// one such joint alone.
pub(super) fn joint_in<'a>(name: &str, scene: &[&'a str]) -> Option<&'a str> {
    if let Some(same) = scene.iter().find(|s| **s == name) {
        return Some(same);
    }
    let behind = |long: &str, short: &str| {
        let front = long.strip_suffix(short);
        front.is_some_and(|f| f.ends_with(['_', '/', '-', ':', '.']))
    };
    let mut all = scene.iter().filter(|s| behind(name, s) || behind(s, name));
    match (all.next(), all.next()) {
        (Some(one), None) => Some(one),
        _ => None,
    }
}

/// Poses of all bodies, each at a position of its own joint.
fn poses(robot: &Robot, position: &[f64]) -> Vec<Pose> {
    let mut out: Vec<Pose> = Vec::with_capacity(robot.bodies.len());
    for (body, q) in robot.bodies.iter().zip(position) {
        let moved = match body.motion {
            Motion::Revolute => {
                let turn = UnitQuaternion::from_axis_angle(&Unit::new_normalize(body.axis), *q);
                Isometry3::from_parts(Translation3::identity(), turn)
            }
            Motion::Prismatic => {
                Isometry3::translation(body.axis.x * q, body.axis.y * q, body.axis.z * q)
            }
        };
        let parent = body.parent.map_or(Pose::identity(), |p| out[p]);
        out.push(parent * pose(&body.rotation, &body.position) * moved);
    }
    out
}

/// How far two poses are from one another, rad or m.
fn apart(a: &Pose, b: &Pose) -> f64 {
    let d = a.inverse() * b;
    d.translation.vector.norm().max(d.rotation.angle())
}

/// Compares the bodies of a scene, `body[b]` for each of the robot, at many postures; `bases` are where the base may stand.
///
/// # Errors
/// A joint of the scene that does not move as that of the robot.
pub(super) fn matched(
    robot: &Robot,
    scene: &Robot,
    body: &[usize],
    bases: &[Pose],
    file: &Path,
) -> Result<Matched> {
    let postures: Vec<Vec<f64>> = (0..POSTURES)
        .map(|k| {
            let of = |j: usize| match k {
                0 => 0.0,
                // no two joints and no two postures alike
                _ => 1.1 * (1.7 * k as f64 + 2.3 * (j as f64 + 1.0) * k as f64).sin(),
            };
            let all = robot.bodies.iter();
            all.map(|b| b.ratio * of(b.coordinate) + b.offset).collect()
        })
        .collect();
    let theirs = |position: &[f64]| {
        let mut q = vec![0.0; scene.bodies.len()];
        body.iter().zip(position).for_each(|(s, p)| q[*s] = *p);
        poses(scene, &q)
    };
    let all: Vec<[Vec<Pose>; 2]> = postures
        .iter()
        .map(|q| [poses(robot, q), theirs(q)])
        .collect();
    let frame = |base: &Pose, k: usize, b: usize| {
        let [ours, theirs] = &all[k];
        theirs[body[b]].inverse() * base * ours[b]
    };
    let off = |base: &Pose, b: usize| {
        let first = frame(base, 0, b);
        let each = (1..POSTURES).map(|k| apart(&first, &frame(base, k, b)));
        each.fold(0.0, f64::max)
    };
    // the first joint that does not fit, the later the better the base
    let fits = |base: &Pose| (0..body.len()).find(|b| off(base, *b) > SAME);
    let best = bases
        .iter()
        .max_by_key(|base| fits(base).unwrap_or(usize::MAX));
    let Some(&base) = best else {
        return Err(Error::file(file, "", "no body in it is that of the robot"));
    };
    if let Some(b) = fits(&base) {
        return Err(Error::file(
            file,
            format!("joint `{}`", scene.bodies[body[b]].joint_name),
            format!(
                "it does not move as joint `{}` of the robot: their frames come {:.2e} rad or m apart; the scene has \
                 another axis, zero or length there, or its robot stands elsewhere; name the scene of this robot, or \
                 identify with the model of this scene",
                robot.bodies[b].joint_name,
                off(&base, b)
            ),
        ));
    }
    Ok(Matched {
        at: (0..body.len()).map(|b| frame(&base, 0, b)).collect(),
        base,
    })
}
