//! The model with what was found: `robot.toml`, URDF and MuJoCo terms.

use super::Diagnosis;
use crate::identify::robot as files;
use crate::plant::Plant;
use crate::robot::Robot;
use std::fmt::Write;

/// The robot with its parameters refitted beside the effects; what `robot.toml` can hold of the claimed
/// effects (armature, viscous and Coulomb friction, offset, payload) is added to them.
pub fn robot(plant: &Plant, d: &Diagnosis) -> Robot {
    let mut robot = files::with_values(plant, &d.phi);
    let actuated = plant.actuated();
    for f in d
        .findings
        .iter()
        .filter(|f| f.member && f.confidence >= 0.5)
    {
        let term = match f.effect {
            "rotor_inertia" => 0,
            "viscous_friction" => 1,
            "coulomb_friction" => 2,
            "torque_offset" => 3,
            "payload" | "link_inertia" => {
                if let Some(j) = f.place.first()
                    && let Some(b) = robot.bodies.iter().rposition(|b| b.coordinate == *j)
                {
                    for (k, v) in f.eta.iter().take(10).enumerate() {
                        robot.bodies[b].inertia.0[k] += v;
                    }
                    // what was fitted is a mass and its moments; its inertia is that of a point
                    if f.effect == "payload" && f.eta.len() == 4 && f.eta[0] > 0.0 {
                        let m = f.eta[0];
                        let c = nalgebra::Vector3::new(f.eta[1], f.eta[2], f.eta[3]) / m;
                        let i = m
                            * (nalgebra::Matrix3::identity() * c.norm_squared()
                                - c * c.transpose());
                        for (k, v) in [i.m11, i.m12, i.m13, i.m22, i.m23, i.m33]
                            .into_iter()
                            .enumerate()
                        {
                            robot.bodies[b].inertia.0[4 + k] += v;
                        }
                    }
                }
                continue;
            }
            "joint_coupling" => {
                // its diagonal part; the rest has no place in a robot.toml
                continue;
            }
            _ => continue,
        };
        if let (Some(j), Some(v)) = (f.place.first(), f.eta.first()) {
            robot.joints[actuated[*j]].terms[term] = *v;
            robot.joints[actuated[*j]].identify[term] = true;
        }
    }
    robot
}

/// `robot.toml` with the parameters refitted, and the effects that it has no keys for as comments that
/// say what a simulator must add.
pub fn toml(robot: &Robot, d: &Diagnosis, urdf: &str) -> String {
    let mut out = robot.to_toml_template(urdf);
    let claims: Vec<_> = d
        .findings
        .iter()
        .filter(|f| f.member && f.confidence >= 0.5)
        .collect();
    if !claims.is_empty() {
        out.push_str("\n# Effects found by `excite diagnose`:\n");
    }
    for f in claims {
        let place = match f.joints.is_empty() {
            true => "whole robot".to_string(),
            false => f.joints.join(", "),
        };
        let _ = writeln!(out, "# {} ({place}): {}", f.effect, f.equation);
        for v in &f.values {
            let _ = writeln!(out, "#   {} = {:.6} {}", v.name, v.value, v.unit);
        }
    }
    out
}

/// MuJoCo's XML: damping, frictionloss and armature of every joint; stiffness, reference and offsets of
/// the claimed effects where MuJoCo has a term for them, in comments otherwise.
pub fn mujoco(robot: &Robot, d: &Diagnosis) -> String {
    let mut out = files::mujoco(robot);
    let mut notes = String::new();
    for f in d
        .findings
        .iter()
        .filter(|f| f.member && f.confidence >= 0.5)
    {
        let at = f.joints.join(" ");
        let value = |name: &str| f.values.iter().find(|v| v.name == name).map(|v| v.value);
        let line = match f.effect {
            "cable_spring" => value("stiffness").map(|k| {
                let half = f.values.iter().find(|v| v.name == "torque_at_middle").map_or(0.0, |v| v.value);
                format!("joint \"{at}\": stiffness=\"{k:.6}\" springref at the position where the pull vanishes (torque at the middle of the range {half:.6})")
            }),
            "joint_elasticity" => value("stiffness").map(|k| {
                format!("joint \"{at}\": split it into motor and link joint with stiffness=\"{k:.6}\" between them")
            }),
            "joint_offset" => value("offset").map(|o| format!("joint \"{at}\": ref=\"{o:.6}\"")),
            "backlash" => value("gap").map(|b| {
                format!("joint \"{at}\": a joint of range=\"{:.6} {:.6}\" in series", -b / 2.0, b / 2.0)
            }),
            "torque_delay" => value("delay").map(|s| format!("actuators: delay of {s:.6} s (dyntype filter or a buffer)")),
            "torque_constant" => value("gain_error").map(|g| format!("actuator \"{at}\": gainprm=\"{:.6}\"", 1.0 / (1.0 + g))),
            "gravity_direction" => match (value("tilt_x"), value("tilt_y")) {
                (Some(x), Some(y)) => Some(format!("worldbody: euler=\"{x:.6} {y:.6} 0\" of the base")),
                _ => None,
            },
            _ => None,
        };
        if let Some(line) = line {
            let _ = writeln!(notes, "  {}: {line}", f.effect);
        }
    }
    if !notes.is_empty() {
        let comment = format!(
            "<!-- found by excite diagnose\n{}-->\n",
            notes.replace("--", "- -")
        );
        out = format!("{comment}{out}");
    }
    out
}
