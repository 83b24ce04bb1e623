//! MuJoCo's XML. Viscous and Coulomb friction and rotor inertia are attributes of the joints, gravity is an
//! option; torque offsets have no place there.

use super::{Format, LEAST, Model, Part, bounded, escape, possible, remark, xml_comment};
use crate::error::Result;
use crate::plant::Plant;
use crate::robot::{Body, Inertia, JointTerm, Motion, Robot};
use nalgebra::UnitQuaternion;
use std::fmt::Write;

/// MuJoCo's XML.
pub struct Mujoco;

impl Format for Mujoco {
    fn name(&self) -> &'static str {
        "MuJoCo"
    }

    fn file(&self) -> &'static str {
        "robot.xml"
    }

    fn holds(&self, plant: &Plant) -> bool {
        !plant.closed()
    }

    fn has(&self, part: Part) -> bool {
        part != Part::Term(JointTerm::Offset)
    }

    fn write(&self, model: &Model) -> Result<String> {
        let comment = xml_comment(&remark::lines(model.remarks, self));
        Ok(format!("{comment}{}", mujoco(model.robot)))
    }
}

/// A body that MuJoCo takes: it refuses bodies without mass or with a principal moment of zero, and compares
/// principal moments without tolerance. One without mass becomes a milligram of a millimetre, one without
/// moments (a point, a thin rod) gets a radius of 0.03 mm.
fn solid(inertia: &Inertia) -> Inertia {
    let able = possible(inertia);
    match able.mass() == 0.0 {
        true => bounded(
            &Inertia::from_com(1e-6, Default::default(), Default::default()),
            0.0,
            1e-12,
        ),
        false => bounded(&able, LEAST, 1e-9 * able.mass()),
    }
}

/// The robot as MuJoCo's XML: damping, friction loss and armature are attributes of the joints.
fn mujoco(robot: &Robot) -> String {
    let mut out = String::new();
    let g = robot.gravity;
    let _ = writeln!(
        out,
        "<mujoco model=\"{}\">\n  <compiler angle=\"radian\" autolimits=\"true\"/>\n  <option gravity=\"{} {} {}\"/>\n  \
         <worldbody>",
        escape(&robot.name),
        g.x,
        g.y,
        g.z
    );
    for b in (0..robot.bodies.len()).filter(|&b| robot.bodies[b].parent.is_none()) {
        mujoco_body(robot, b, 2, &mut out);
    }
    out.push_str("  </worldbody>\n");
    let followers: Vec<&Body> = robot
        .bodies
        .iter()
        .filter(|b| b.joint_name != robot.joints[b.coordinate].name)
        .collect();
    if !followers.is_empty() {
        out.push_str("  <equality>\n");
        for b in followers {
            let _ = writeln!(
                out,
                "    <joint joint1=\"{}\" joint2=\"{}\" polycoef=\"{} {} 0 0 0\"/>",
                escape(&b.joint_name),
                escape(&robot.joints[b.coordinate].name),
                b.offset,
                b.ratio
            );
        }
        out.push_str("  </equality>\n");
    }
    out.push_str("</mujoco>\n");
    out
}

fn mujoco_body(robot: &Robot, index: usize, depth: usize, out: &mut String) {
    let body = &robot.bodies[index];
    let pad = "  ".repeat(depth);
    let q = UnitQuaternion::from_matrix(&body.rotation);
    let p = body.position;
    let _ = writeln!(
        out,
        "{pad}<body name=\"{}\" pos=\"{} {} {}\" quat=\"{} {} {} {}\">",
        escape(&body.name),
        p.x,
        p.y,
        p.z,
        q.w,
        q.i,
        q.j,
        q.k
    );
    let inertia = solid(&body.inertia);
    if let Some(c) = inertia.com() {
        let i = inertia.tensor_com();
        let _ = writeln!(
            out,
            "{pad}  <inertial pos=\"{} {} {}\" mass=\"{}\" fullinertia=\"{} {} {} {} {} {}\"/>",
            c.x,
            c.y,
            c.z,
            inertia.mass(),
            i.m11,
            i.m22,
            i.m33,
            i.m12,
            i.m13,
            i.m23
        );
    }
    let joint = &robot.joints[body.coordinate];
    let kind = match body.motion {
        Motion::Revolute => "hinge",
        Motion::Prismatic => "slide",
    };
    let mut attributes = String::new();
    if joint.limits.position.iter().all(|x| x.is_finite()) && body.joint_name == joint.name {
        let _ = write!(
            attributes,
            " range=\"{} {}\"",
            joint.limits.position[0], joint.limits.position[1]
        );
    }
    if body.joint_name == joint.name {
        for (name, term) in [
            ("damping", JointTerm::Viscous),
            ("frictionloss", JointTerm::Coulomb),
            ("armature", JointTerm::Armature),
        ] {
            let x = joint.terms[term as usize];
            if x > 0.0 {
                let _ = write!(attributes, " {name}=\"{x}\"");
            }
        }
    }
    let _ = writeln!(
        out,
        "{pad}  <joint name=\"{}\" type=\"{kind}\" axis=\"{} {} {}\"{attributes}/>",
        escape(&body.joint_name),
        body.axis.x,
        body.axis.y,
        body.axis.z
    );
    for child in (0..robot.bodies.len()).filter(|&c| robot.bodies[c].parent == Some(index)) {
        mujoco_body(robot, child, depth + 1, out);
    }
    let _ = writeln!(out, "{pad}</body>");
}
