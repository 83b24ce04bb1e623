//! The identified robot as files: URDF, MuJoCo's XML, and a `robot.toml` beside them.

use crate::plant::{Column, Plant};
use crate::robot::{Body, JointTerm, Motion, Robot};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use std::fmt::Write;

/// The robot with other values of its unknowns (of a parallel robot: its tree).
///
/// # Panics
/// If there is not one number for each unknown.
pub fn with_values(plant: &Plant, phi: &[f64]) -> Robot {
    let mut robot = plant.robot().clone();
    let parameters = plant.parameters();
    assert_eq!(parameters.len(), phi.len(), "one number for each unknown");
    let mut raw = vec![0.0; plant.raw().len()];
    for (p, x) in parameters.iter().zip(phi) {
        p.raw.iter().for_each(|&r| raw[r] += x);
    }
    for (column, x) in plant.raw().iter().zip(raw) {
        match *column {
            Column::Inertial { body, k } => robot.bodies[body].inertia.0[k] = x,
            Column::Term { joint, term } => robot.joints[joint].terms[term as usize] = x,
            Column::Nuisance => {}
        }
    }
    robot
}

/// Text that may stand in an XML attribute.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('"', "&quot;")
}

/// Roll, pitch and yaw of a rotation.
pub(super) fn rpy(r: &Matrix3<f64>) -> [f64; 3] {
    let (roll, pitch, yaw) = Rotation3::from_matrix_unchecked(*r).euler_angles();
    [roll, pitch, yaw]
}

/// A name for the base that no link has.
pub(super) fn base_name(robot: &Robot) -> String {
    let mut name = String::from("base");
    while robot.bodies.iter().any(|b| b.name == name) {
        name.push('_');
    }
    name
}

/// The robot as URDF. Friction stands in `<dynamics>`; armature and offset have no place there.
pub fn urdf(robot: &Robot) -> String {
    let mut out = String::from("<?xml version=\"1.0\"?>\n");
    let base = base_name(robot);
    let _ = writeln!(out, "<robot name=\"{}\">", escape(&robot.name));
    let _ = writeln!(out, "  <link name=\"{base}\"/>");
    for body in &robot.bodies {
        let _ = writeln!(out, "  <link name=\"{}\">", escape(&body.name));
        if let Some(c) = body.inertia.com() {
            let i = body.inertia.tensor_com();
            let _ = writeln!(
                out,
                "    <inertial>\n      <origin xyz=\"{} {} {}\" rpy=\"0 0 0\"/>\n      <mass value=\"{}\"/>\n      \
                 <inertia ixx=\"{}\" ixy=\"{}\" ixz=\"{}\" iyy=\"{}\" iyz=\"{}\" izz=\"{}\"/>\n    </inertial>",
                c.x,
                c.y,
                c.z,
                body.inertia.mass(),
                i.m11,
                i.m12,
                i.m13,
                i.m22,
                i.m23,
                i.m33
            );
        }
        out.push_str("  </link>\n");
        let joint = &robot.joints[body.coordinate];
        let limits = &joint.limits;
        let bounded = limits.position.iter().all(|x| x.is_finite());
        let kind = match (body.motion, bounded) {
            (Motion::Prismatic, _) => "prismatic",
            (Motion::Revolute, true) => "revolute",
            (Motion::Revolute, false) => "continuous",
        };
        let parent = body.parent.map_or(base.as_str(), |p| &robot.bodies[p].name);
        let [roll, pitch, yaw] = rpy(&body.rotation);
        let p = body.position;
        let _ = writeln!(
            out,
            "  <joint name=\"{}\" type=\"{kind}\">\n    <origin xyz=\"{} {} {}\" rpy=\"{roll} {pitch} {yaw}\"/>\n    \
             <parent link=\"{}\"/>\n    <child link=\"{}\"/>\n    <axis xyz=\"{} {} {}\"/>",
            escape(&body.joint_name),
            p.x,
            p.y,
            p.z,
            escape(parent),
            escape(&body.name),
            body.axis.x,
            body.axis.y,
            body.axis.z
        );
        let mut limit = String::new();
        if bounded {
            let _ = write!(
                limit,
                " lower=\"{}\" upper=\"{}\"",
                limits.position[0], limits.position[1]
            );
        }
        for (name, x) in [("velocity", limits.velocity), ("effort", limits.effort)] {
            if x.is_finite() {
                let _ = write!(limit, " {name}=\"{x}\"");
            }
        }
        if !limit.is_empty() {
            let _ = writeln!(out, "    <limit{limit}/>");
        }
        if body.joint_name == joint.name {
            let _ = writeln!(
                out,
                "    <dynamics damping=\"{}\" friction=\"{}\"/>",
                joint.terms[JointTerm::Viscous as usize].max(0.0),
                joint.terms[JointTerm::Coulomb as usize].max(0.0)
            );
        } else {
            let _ = writeln!(
                out,
                "    <mimic joint=\"{}\" multiplier=\"{}\" offset=\"{}\"/>",
                escape(&joint.name),
                body.ratio,
                body.offset
            );
        }
        out.push_str("  </joint>\n");
    }
    out.push_str("</robot>\n");
    out
}

/// The robot as MuJoCo's XML: damping, friction loss and armature are attributes of the joints.
pub fn mujoco(robot: &Robot) -> String {
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
    if let Some(c) = body.inertia.com() {
        let i = body.inertia.tensor_com();
        let _ = writeln!(
            out,
            "{pad}  <inertial pos=\"{} {} {}\" mass=\"{}\" fullinertia=\"{} {} {} {} {} {}\"/>",
            c.x,
            c.y,
            c.z,
            body.inertia.mass(),
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
