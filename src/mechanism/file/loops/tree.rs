//! The tree of a robot with loops: the URDF, with joints that stand for others replaced.

use crate::error::{Error, Result};
use crate::mechanism::loops::yaml::{self, Stand};
use crate::robot::urdf::{Options, Urdf};
use crate::robot::{Body, Inertia, Joint, Motion, Robot};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;

/// The tree of the URDF with the joints that stand for others replaced.
pub(super) fn tree(
    urdf: &Urdf,
    lock: &mut BTreeMap<String, f64>,
    listed: &yaml::Closures,
) -> Result<Robot> {
    for (name, stand) in &listed.joints {
        if *stand == Stand::Fixed {
            lock.insert(name.clone(), 0.0);
        }
    }
    let options = Options {
        lock: lock.clone(),
        ..Options::default()
    };
    let mut robot = urdf.robot(&options)?;
    for (name, stand) in &listed.joints {
        let axes: &[Vector3<f64>] = match stand {
            Stand::Fixed => continue,
            Stand::Cardan => &[
                Vector3::x_axis().into_inner(),
                Vector3::y_axis().into_inner(),
            ],
            Stand::Spherical => &[
                Vector3::x_axis().into_inner(),
                Vector3::y_axis().into_inner(),
                Vector3::z_axis().into_inner(),
            ],
        };
        split(&mut robot, name, axes).map_err(|why| {
            Error::Infeasible(format!("{}: joint_name `{name}`: {why}", robot.name))
        })?;
    }
    Ok(robot)
}

/// Replaces the joint of a body by joints about several axes, one after the other.
fn split(robot: &mut Robot, joint: &str, axes: &[Vector3<f64>]) -> Result<(), String> {
    let Some(c) = robot.joints.iter().position(|j| j.name == joint) else {
        return Err("there is no such joint that moves".into());
    };
    let mut on = robot
        .bodies
        .iter()
        .enumerate()
        .filter(|(_, b)| b.coordinate == c);
    let (Some((at, _)), None) = (on.next(), on.next()) else {
        return Err("several bodies follow it".into());
    };
    let more = axes.len() - 1;
    let old = robot.bodies[at].clone();
    for body in &mut robot.bodies {
        body.parent = body.parent.map(|p| if p >= at { p + more } else { p });
        if body.coordinate > c {
            body.coordinate += more;
        }
    }
    let names = ["_X", "_Y", "_Z"];
    let mut parent = old.parent;
    for (k, axis) in axes.iter().enumerate() {
        let last = k == more;
        let name = format!("{joint}{}", names[k]);
        let body = Body {
            name: match last {
                true => old.name.clone(),
                false => format!("{}{}", old.name, names[k]),
            },
            joint_name: name.clone(),
            parent,
            motion: Motion::Revolute,
            axis: *axis,
            rotation: if k == 0 {
                old.rotation
            } else {
                Matrix3::identity()
            },
            position: if k == 0 {
                old.position
            } else {
                Vector3::zeros()
            },
            inertia: if last {
                old.inertia
            } else {
                Inertia::default()
            },
            merged: if last { old.merged.clone() } else { Vec::new() },
            coordinate: c + k,
            ratio: 1.0,
            offset: 0.0,
            meant: None,
        };
        let coordinate = Joint {
            continuous: true,
            ..Joint::new(&name, Motion::Revolute)
        };
        if k == 0 {
            robot.bodies[at] = body;
            robot.joints[c] = coordinate;
        } else {
            robot.bodies.insert(at + k, body);
            robot.joints.insert(c + k, coordinate);
        }
        parent = Some(at + k);
    }
    Ok(())
}
