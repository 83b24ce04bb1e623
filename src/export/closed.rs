//! MuJoCo's XML of parallel robots: the tree, and what closes it as equality constraints between sites.
//!
//! A platform hangs on its task coordinates, whose joints have no drive and whose carriers weigh a milligram; legs and rods
//! hang on the base. Where the end of a leg or rod meets the platform, a `connect` holds two sites together; the closures of
//! `loops` are `connect` (position) and `weld` (pose); `legs` without mass are tendons. Sites, because a point of the second
//! body would follow from the posture at zero, in which the loops are open; the keyframe `home` closes them.
//!
//! Where a rod ends is found from the model itself: the point of its axis that stays where it is in the frame of the
//! platform, or of one of its bars, while these move.

mod legs;

use super::element::{Element, Form, Kind};
use super::mujoco::body::{kind, open, placement};
use super::mujoco::joint::OnJoint;
use super::mujoco::{SOME_FRICTION, followers, stiff};
use super::{Format, Model, Part, breakaway, escape, remark, xml_comment};
use crate::collision::scene::poses;
use crate::error::{Error, Result};
use crate::mechanism::loops::{Closure, Coincide};
use crate::mechanism::{Mechanism, Source};
use crate::plant::Plant;
use crate::robot::{JointTerm, Motion, Robot};
use crate::solid::shape::Pose;
use legs::Legs;
use nalgebra::{Matrix3, Rotation3, Unit, UnitQuaternion, Vector3};
use std::fmt::Write;

/// MuJoCo's XML of closed chains.
pub struct Closed;

/// Step of the simulation, s: loops are stiff.
const STEP: f64 = 5e-4;
/// Stiffness and damping ratio of the constraints: the shortest time that the step allows.
const REFERENCE: &str = "solref=\"0.001 1\" solimp=\"0.999 0.9999 0.0001\"";
/// How far a point of a rod may move in the frame of what it is fixed to, of the robot's size.
const FIXED: f64 = 1e-7;
/// How far home is left to see what moves with what, m and rad.
const ASIDE: f64 = 0.02;

impl Format for Closed {
    fn name(&self) -> &'static str {
        "MuJoCo"
    }

    fn file(&self) -> &'static str {
        "robot.xml"
    }

    fn holds(&self, plant: &Plant) -> bool {
        closed(plant).is_some_and(|m| !matches!(m.source, Source::Code(_)))
    }

    fn has(&self, _part: Part) -> bool {
        true
    }

    fn element(&self, element: &Element) -> Form {
        match element {
            Element::Gain { .. } | Element::Load { .. } => Form::Native,
            _ => Form::None,
        }
    }

    fn write(&self, model: &Model) -> Result<String> {
        let Some(mechanism) = closed(model.plant) else {
            return Err(Error::Infeasible(
                "nothing closes this robot to a chain".into(),
            ));
        };
        let joins = joins(mechanism)?;
        let mut lines = remark::lines(model.remarks, self);
        lines.extend(breakaway(model.robot));
        let legs = Legs::of(mechanism, model.robot, &joins);
        lines.push(match legs {
            None => "Loops are closed by equality constraints between sites; they hold in the keyframe `home`.".into(),
            Some(_) => "Legs without mass are tendons: forces along the line between their joints.".into(),
        });
        // what stands on a drive beside the values of the model
        let (mut robot, mut gains) = (model.robot.clone(), vec![1.0; mechanism.actuated.len()]);
        for element in model.remarks.iter().filter_map(|r| r.element.as_ref()) {
            match element {
                Element::Gain { joint, error } => gains[*joint] /= 1.0 + error,
                Element::Function(f) if matches!(f.kind, Kind::Torque | Kind::Memory) => {
                    let terms = &mut robot.joints[mechanism.actuated[f.joint]].terms;
                    let dry = &mut terms[JointTerm::Coulomb as usize];
                    *dry = dry.max(SOME_FRICTION);
                }
                _ => {}
            }
        }
        Ok(format!(
            "{}{}",
            xml_comment(&lines),
            text(mechanism, &robot, &joins, legs.as_ref(), &gains)
        ))
    }
}

/// Length less the position of its drive of each leg that is a tendon, m; 0 for drives on joints. `None`: no closed chain.
///
/// # Errors
/// Rods that end on nothing.
pub(super) fn zeros(model: &Model) -> Result<Option<Vec<f64>>> {
    let Some(mechanism) = closed(model.plant) else {
        return Ok(None);
    };
    let legs = Legs::of(mechanism, model.robot, &joins(mechanism)?);
    let zero = |a: &usize| legs.as_ref().map_or(0.0, |l| l.zero(*a));
    Ok(Some(mechanism.actuated.iter().map(zero).collect()))
}

/// The mechanism with the pose of its platform as coordinates.
fn closed(plant: &Plant) -> Option<&Mechanism> {
    plant.mechanism().map(|m| m.platform())
}

/// A frame on a body; `None`: the base.
struct Site {
    body: Option<usize>,
    position: Vector3<f64>,
    rotation: Matrix3<f64>,
}

/// Two sites that coincide.
struct Join {
    sites: [Site; 2],
    whole: bool,
}

/// What closes the tree.
///
/// # Errors
/// Rods that end on nothing.
fn joins(mechanism: &Mechanism) -> Result<Vec<Join>> {
    match &mechanism.source {
        Source::Loops(closures) => Ok(closures.iter().map(closure).collect()),
        _ => ends(mechanism),
    }
}

fn closure(c: &Closure) -> Join {
    let site = |k: usize| Site {
        body: c.frames[k].body,
        position: c.frames[k].position,
        rotation: c.frames[k].rotation,
    };
    Join {
        sites: [site(0), site(1)],
        whole: c.coincide == Coincide::Pose,
    }
}

/// Where the rods end: the last bodies of all chains that hang on the base, against the bodies that hang on the task
/// coordinates.
fn ends(mechanism: &Mechanism) -> Result<Vec<Join>> {
    let robot = &mechanism.robot;
    let has_child = |b: usize| robot.bodies.iter().any(|x| x.parent == Some(b));
    let platform = robot.bodies.iter().position(|b| b.name == "platform");
    let Some(platform) = platform else {
        return Err(Error::Infeasible(format!(
            "{}: no body is called `platform`, so nothing is known of what closes it",
            robot.name
        )));
    };
    let carried = |mut b: usize| loop {
        match robot.bodies[b].parent {
            _ if b == platform => return true,
            Some(p) => b = p,
            None => return false,
        }
    };
    let moved: Vec<usize> = (0..robot.bodies.len()).filter(|&b| carried(b)).collect();
    let rods = (0..robot.bodies.len()).filter(|&b| !carried(b) && !has_child(b));
    let posture = |aside: f64| -> Result<Vec<Pose>> {
        let x: Vec<f64> = mechanism
            .home
            .iter()
            .enumerate()
            .map(|(k, h)| h + aside * (1.0 + 0.3 * k as f64))
            .collect();
        let mut out = Vec::new();
        poses(robot, &mechanism.inverse(&x)?, &mut out);
        Ok(out)
    };
    let at = [posture(0.0)?, posture(ASIDE)?];
    rods.map(|rod| {
        let best = moved
            .iter()
            .map(|&b| {
                let seen = at.each_ref().map(|poses| {
                    let back = poses[b].rotation.transpose();
                    let origin = back * (poses[rod].position - poses[b].position);
                    (origin, back * (poses[rod].rotation * Vector3::z()))
                });
                let (first, axis) = (seen[0].0 - seen[1].0, seen[0].1 - seen[1].1);
                let along = match axis.norm_squared() {
                    s if s > 1e-12 => -first.dot(&axis) / s,
                    _ => 0.0,
                };
                let off = (first + axis * along).norm();
                (off, b, along, seen[0].0 + seen[0].1 * along)
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match best {
            Some((off, b, along, point)) if off < FIXED * mechanism.length.max(0.01) => Ok(Join {
                sites: [
                    Site {
                        body: Some(rod),
                        position: Vector3::new(0.0, 0.0, along),
                        rotation: Matrix3::identity(),
                    },
                    Site {
                        body: Some(b),
                        position: point,
                        rotation: Matrix3::identity(),
                    },
                ],
                whole: false,
            }),
            _ => Err(Error::Infeasible(format!(
                "{}: no point of {} stays in place on the platform, so MuJoCo's file cannot be closed",
                robot.name, robot.bodies[rod].name
            ))),
        }
    })
    .collect()
}

fn text(
    mechanism: &Mechanism,
    robot: &Robot,
    joins: &[Join],
    legs: Option<&Legs>,
    gains: &[f64],
) -> String {
    let mut out = String::new();
    let (g, dry) = (robot.gravity, stiff());
    let _ = writeln!(
        out,
        "<mujoco model=\"{}\">\n  <compiler angle=\"radian\" autolimits=\"true\"/>\n  \
         <option timestep=\"{STEP}\" gravity=\"{} {} {}\" integrator=\"implicitfast\"/>\n  <default>\n    \
         <joint {dry}/>\n    {}\n  </default>",
        escape(&robot.name),
        g.x,
        g.y,
        g.z,
        match legs {
            None => format!("<equality {REFERENCE}/>"),
            Some(_) => format!("<tendon {dry}/>"),
        }
    );
    out += "  <worldbody>\n";
    sites(joins, None, "    ", &mut out);
    for b in (0..robot.bodies.len()).filter(|&b| robot.bodies[b].parent.is_none()) {
        match legs.and_then(|l| l.begins(b)) {
            None => body(mechanism, robot, joins, b, 2, &mut out),
            Some(leg) => {
                let p = robot.bodies[b].position;
                let (x, y, z) = (p.x, p.y, p.z);
                let _ = writeln!(
                    out,
                    "    <site name=\"loop{}_a\" pos=\"{x} {y} {z}\" size=\"0.005\"/>",
                    leg + 1
                );
            }
        }
    }
    out += "  </worldbody>\n";
    match legs {
        None => closures(joins, &mut out),
        Some(legs) => legs.write(robot, &mut out),
    }
    followers(robot, &mut out);
    out += "  <actuator>\n";
    for (&a, gain) in mechanism.actuated.iter().zip(gains) {
        let joint = &robot.joints[a];
        let name = escape(&joint.name);
        let at = legs.map_or(format!("joint=\"{name}\""), |l| l.drive(robot, a));
        let effort = joint.limits.effort;
        let range = match effort.is_finite() && effort > 0.0 {
            true => format!(" forcerange=\"-{effort} {effort}\""),
            false => String::new(),
        };
        let gain = match *gain == 1.0 {
            true => String::new(),
            false => format!(" gainprm=\"{gain}\""),
        };
        let _ = writeln!(out, "    <general name=\"{name}\" {at}{gain}{range}/>");
    }
    out += "  </actuator>\n";
    if let Ok(q) = mechanism.inverse(&mechanism.home) {
        let written = order(robot).into_iter();
        let all: Vec<String> = written
            .filter(|b| legs.is_none_or(|l| !l.has(robot, *b)))
            .map(|b| {
                let body = &robot.bodies[b];
                match leads(robot, b) {
                    true => q[body.coordinate].to_string(),
                    false => (body.ratio * q[body.coordinate] + body.offset).to_string(),
                }
            })
            .collect();
        let _ = writeln!(
            out,
            "  <keyframe>\n    <key name=\"home\" qpos=\"{}\"/>\n  </keyframe>",
            all.join(" ")
        );
    }
    out += "</mujoco>\n";
    out
}

/// What closes the loops.
fn closures(joins: &[Join], out: &mut String) {
    *out += "  <equality>\n";
    for (i, join) in joins.iter().enumerate() {
        let kind = if join.whole { "weld" } else { "connect" };
        let _ = writeln!(
            out,
            "    <{kind} name=\"loop{0}\" site1=\"loop{0}_a\" site2=\"loop{0}_b\"/>",
            i + 1
        );
    }
    *out += "  </equality>\n";
}

/// Bodies as MuJoCo orders them: each before its children, whole branches one after the other.
fn order(robot: &Robot) -> Vec<usize> {
    fn below(robot: &Robot, parent: Option<usize>, out: &mut Vec<usize>) {
        for b in (0..robot.bodies.len()).filter(|&b| robot.bodies[b].parent == parent) {
            out.push(b);
            below(robot, Some(b), out);
        }
    }
    let mut out = Vec::new();
    below(robot, None, &mut out);
    out
}

/// Whether a body's joint is the coordinate itself, and not one that follows it.
fn leads(robot: &Robot, body: usize) -> bool {
    let b = &robot.bodies[body];
    b.joint_name == robot.joints[b.coordinate].name
}

/// Sites of the loops on a body.
fn sites(joins: &[Join], on: Option<usize>, pad: &str, out: &mut String) {
    for (i, join) in joins.iter().enumerate() {
        for (site, end) in join.sites.iter().zip(["a", "b"]) {
            if site.body != on {
                continue;
            }
            let at = placement(&site.position, &UnitQuaternion::from_matrix(&site.rotation));
            let _ = writeln!(
                out,
                "{pad}<site name=\"loop{}_{end}\" {at} size=\"0.005\"/>",
                i + 1
            );
        }
    }
}

fn body(
    mechanism: &Mechanism,
    robot: &Robot,
    joins: &[Join],
    index: usize,
    depth: usize,
    out: &mut String,
) {
    let body = &robot.bodies[index];
    let joint = &robot.joints[body.coordinate];
    let leads = leads(robot, index);
    let pad = "  ".repeat(depth);
    // where the coordinate is zero the joint of a leg stands at its offset
    let (mut position, mut rotation) = (body.position, body.rotation);
    if leads && body.offset != 0.0 {
        match body.motion {
            Motion::Prismatic => position += rotation * body.axis * body.offset,
            Motion::Revolute => {
                let axis = Unit::new_normalize(body.axis);
                rotation *= Rotation3::from_axis_angle(&axis, body.offset).into_inner();
            }
        }
    }
    open(out, &pad, body, &position, &rotation);
    let kind = kind(body);
    let mut attributes = String::new();
    if leads {
        let actuated = mechanism.actuated.contains(&body.coordinate);
        if actuated && joint.limits.position.iter().all(|x| x.is_finite()) {
            let [low, high] = joint.limits.position;
            let _ = write!(attributes, " range=\"{low} {high}\"");
        }
        let term = |t: JointTerm| joint.terms[t as usize];
        let on = OnJoint {
            armature: term(JointTerm::Armature),
            damping: [term(JointTerm::Viscous), 0.0, 0.0],
            coulomb: term(JointTerm::Coulomb),
            spring: [term(JointTerm::Offset), 0.0, 0.0, 0.0],
            gain: 1.0,
            ..OnJoint::default()
        };
        attributes += &on.attributes();
    }
    let _ = writeln!(
        out,
        "{pad}  <joint name=\"{}\" type=\"{kind}\" axis=\"{} {} {}\"{attributes}/>",
        escape(&body.joint_name),
        body.axis.x,
        body.axis.y,
        body.axis.z
    );
    sites(joins, Some(index), &format!("{pad}  "), out);
    for child in (0..robot.bodies.len()).filter(|&c| robot.bodies[c].parent == Some(index)) {
        self::body(mechanism, robot, joins, child, depth + 1, out);
    }
    let _ = writeln!(out, "{pad}</body>");
}
