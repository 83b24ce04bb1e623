//! SDFormat, which Gazebo reads. Not run in a simulator: what is written follows the specification of version 1.11.
//!
//! Friction and a straight spring stand in `<dynamics>`; rotor inertia, offsets and effects have no element there.

use super::{
    Element, Form, Format, Model, Part, base_name, escape, named_moments, possible, remark, rpy,
    xml_comment,
};
use crate::error::Result;
use crate::robot::{Body, JointTerm, Motion, Robot};
use nalgebra::{Matrix3, Vector3};
use std::fmt::Write;

/// SDFormat.
pub struct Sdf;

impl Format for Sdf {
    fn name(&self) -> &'static str {
        "SDF"
    }

    fn file(&self) -> &'static str {
        "robot.sdf"
    }

    fn has(&self, part: Part) -> bool {
        match part {
            Part::Bodies | Part::Frames => true,
            Part::Term(term) => matches!(term, JointTerm::Viscous | JointTerm::Coulomb),
            Part::Gravity => false,
        }
    }

    fn element(&self, element: &Element) -> Form {
        match straight(element) {
            Some(_) => Form::Native,
            None => Form::None,
        }
    }

    fn write(&self, model: &Model) -> Result<String> {
        let robot = model.robot;
        let mut lines = vec![
            "Written by excite after the specification of SDFormat 1.11; not run in Gazebo."
                .to_string(),
            format!(
                "Gravity of the model, which belongs to the world: {} {} {} m/s^2",
                robot.gravity.x, robot.gravity.y, robot.gravity.z
            ),
        ];
        for joint in &robot.joints {
            for (term, what) in [
                (JointTerm::Armature, "rotor inertia"),
                (JointTerm::Offset, "torque offset"),
            ] {
                let value = joint.terms[term as usize];
                if value != 0.0 {
                    lines.push(format!(
                        "No element of SDFormat holds the {what} of {}: {value}",
                        joint.name
                    ));
                }
            }
        }
        lines.extend(remark::lines(model.remarks, self));
        let base = base_name(robot);
        let mut out = format!(
            "<?xml version=\"1.0\"?>\n{}<sdf version=\"1.11\">\n  <model name=\"{}\">\n    <link name=\"{}\"/>\n    \
             <joint name=\"{}\" type=\"fixed\"><parent>world</parent><child>{}</child></joint>\n",
            xml_comment(&lines),
            escape(&robot.name),
            escape(&base),
            escape(&format!("{base}_to_world")),
            escape(&base),
        );
        for body in &robot.bodies {
            link(robot, body, &base, &mut out);
            joint(model, body, &base, &mut out);
        }
        Ok(out + "  </model>\n</sdf>\n")
    }
}

/// Coordinate, stiffness and rest of a spring whose torque is a straight line.
fn straight(element: &Element) -> Option<(usize, f64, f64)> {
    match element {
        Element::Spring {
            joint,
            coefficients: [c, k, 0.0, 0.0],
        } if *k > 0.0 => Some((*joint, *k, -c / k)),
        _ => None,
    }
}

fn pose(position: &Vector3<f64>, rotation: &Matrix3<f64>) -> String {
    let [r, p, y] = rpy(rotation);
    format!("{} {} {} {r} {p} {y}", position.x, position.y, position.z)
}

fn link(robot: &Robot, body: &Body, base: &str, out: &mut String) {
    let parent = body.parent.map_or(base, |p| &robot.bodies[p].name);
    let _ = writeln!(
        out,
        "    <link name=\"{}\">\n      <pose relative_to=\"{}\">{}</pose>",
        escape(&body.name),
        escape(parent),
        pose(&body.position, &body.rotation)
    );
    let inertia = possible(&body.inertia);
    if let Some(c) = inertia.com() {
        let moments = named_moments(&inertia.tensor_com())
            .map(|(k, v)| format!("<{k}>{v}</{k}>"))
            .concat();
        let _ = writeln!(
            out,
            "      <inertial>\n        <pose>{}</pose>\n        <mass>{}</mass>\n        <inertia>{moments}</inertia>\n      \
             </inertial>",
            pose(&c, &Matrix3::identity()),
            inertia.mass()
        );
    }
    *out += "    </link>\n";
}

fn joint(model: &Model, body: &Body, base: &str, out: &mut String) {
    let robot = model.robot;
    let joint = &robot.joints[body.coordinate];
    let leads = body.joint_name == joint.name;
    let kind = match body.motion {
        Motion::Revolute => "revolute",
        Motion::Prismatic => "prismatic",
    };
    let parent = body.parent.map_or(base, |p| &robot.bodies[p].name);
    let _ = writeln!(
        out,
        "    <joint name=\"{}\" type=\"{kind}\">\n      <parent>{}</parent>\n      <child>{}</child>\n      <axis>\n        \
         <xyz>{} {} {}</xyz>",
        escape(&body.joint_name),
        escape(parent),
        escape(&body.name),
        body.axis.x,
        body.axis.y,
        body.axis.z
    );
    if leads {
        let l = &joint.limits;
        let mut limits = String::new();
        for (name, x) in [
            ("lower", l.position[0]),
            ("upper", l.position[1]),
            ("effort", l.effort),
            ("velocity", l.velocity),
        ] {
            if x.is_finite() {
                let _ = write!(limits, "<{name}>{x}</{name}>");
            }
        }
        let mut dynamics = format!(
            "<damping>{}</damping><friction>{}</friction>",
            joint.terms[JointTerm::Viscous as usize].max(0.0),
            joint.terms[JointTerm::Coulomb as usize].max(0.0)
        );
        let elements = model.remarks.iter().filter_map(|r| r.element.as_ref());
        for (_, k, rest) in elements
            .filter_map(straight)
            .filter(|s| s.0 == body.coordinate)
        {
            let _ = write!(
                dynamics,
                "<spring_reference>{rest}</spring_reference><spring_stiffness>{k}</spring_stiffness>"
            );
        }
        let _ = writeln!(
            out,
            "        <limit>{limits}</limit>\n        <dynamics>{dynamics}</dynamics>"
        );
    } else {
        let _ = writeln!(
            out,
            "        <mimic joint=\"{}\"><multiplier>{}</multiplier><offset>{}</offset><reference>0</reference></mimic>",
            escape(&joint.name),
            body.ratio,
            body.offset
        );
    }
    *out += "      </axis>\n    </joint>\n";
}
