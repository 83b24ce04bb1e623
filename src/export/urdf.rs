//! The Unified Robot Description Format. Friction stands in `<dynamics>`; rotor inertia, offset and gravity
//! have no place there.

use super::{
    Format, Model, Part, base_name, escape, named_moments, possible, remark, rpy, xml_comment,
};
use crate::error::Result;
use crate::robot::urdf::NO_LIMIT;
use crate::robot::{JointTerm, Motion, Robot};
use std::fmt::Write;

/// Name of the file, which `robot.toml` refers to.
pub const FILE: &str = "robot.urdf";

/// URDF.
pub struct Urdf;

impl Format for Urdf {
    fn name(&self) -> &'static str {
        "URDF"
    }

    fn file(&self) -> &'static str {
        FILE
    }

    fn holds(&self, _plant: &crate::plant::Plant) -> bool {
        true
    }

    fn has(&self, part: Part) -> bool {
        match part {
            Part::Bodies | Part::Frames => true,
            Part::Term(term) => matches!(term, JointTerm::Viscous | JointTerm::Coulomb),
            Part::Gravity => false,
        }
    }

    fn write(&self, model: &Model) -> Result<String> {
        let comment = xml_comment(&remark::lines(model.remarks, self));
        Ok(format!(
            "<?xml version=\"1.0\"?>\n{comment}{}{}</robot>\n",
            tree(model.robot),
            // a mechanism has bodies of its own in between
            match model.plant.mechanism() {
                None => fixed_links(model.robot),
                Some(_) => String::new(),
            }
        ))
    }
}

/// The robot as URDF, without its end.
fn tree(robot: &Robot) -> String {
    let mut out = String::new();
    let base = base_name(robot);
    let _ = writeln!(out, "<robot name=\"{}\">", escape(&robot.name));
    let _ = writeln!(out, "  <link name=\"{}\"/>", escape(&base));
    for body in &robot.bodies {
        let _ = writeln!(out, "  <link name=\"{}\">", escape(&body.name));
        let inertia = possible(&body.inertia);
        if let Some(c) = inertia.com() {
            let tensor = named_moments(&inertia.tensor_com())
                .map(|(k, v)| format!(" {k}=\"{v}\""))
                .concat();
            let _ = writeln!(
                out,
                "    <inertial>\n      <origin xyz=\"{} {} {}\" rpy=\"0 0 0\"/>\n      <mass value=\"{}\"/>\n      \
                 <inertia{tensor}/>\n    </inertial>",
                c.x,
                c.y,
                c.z,
                inertia.mass()
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
        let [lower, upper] = limits.position;
        let others = [limits.velocity, limits.effort];
        // readers want velocity and effort in each <limit>, and take an end that is missing for 0
        let turns = kind == "continuous";
        if !turns || others.iter().any(|x| x.is_finite()) {
            let all = [("lower", lower), ("upper", upper)];
            let ends = if turns { &[][..] } else { &all };
            let rest = [("velocity", others[0]), ("effort", others[1])];
            let mut limit = String::new();
            for (name, x) in ends.iter().chain(&rest) {
                let _ = write!(limit, " {name}=\"{}\"", x.clamp(-NO_LIMIT, NO_LIMIT));
            }
            let none = ends.iter().chain(&rest).any(|(_, x)| x.is_infinite());
            let note = match none {
                true => format!("   <!-- {NO_LIMIT} stands for none -->"),
                false => String::new(),
            };
            let _ = writeln!(out, "    <limit{limit}/>{note}");
        }
        // the element has no ends of its own: they are those of <limit>
        if let Some(v) = limits
            .velocity_by_position
            .filter(|v| body.joint_name == joint.name && v.position == limits.position)
        {
            let _ = writeln!(
                out,
                "    <position_based_velocity_limits deceleration_limit=\"{}\" velocity_offset=\"{}\"/>",
                v.deceleration, v.offset
            );
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
    out
}

/// Links that are fixed to a body or to the base, without inertia, which is in that of the body: volumes and
/// frames of `robot.toml` name them.
fn fixed_links(robot: &Robot) -> String {
    let base = &base_name(robot);
    let mut out = String::new();
    let own = |name: &str| name == base || robot.bodies.iter().any(|b| b.name == name);
    for link in robot.geometry.links.iter().filter(|l| !own(&l.name)) {
        let parent = link.body.map_or(base.as_str(), |b| &robot.bodies[b].name);
        let mut joint = format!("{}_fixed", link.name);
        while robot.bodies.iter().any(|b| b.joint_name == joint) {
            joint.push('_');
        }
        let [roll, pitch, yaw] = rpy(&link.pose.rotation);
        let p = link.pose.position;
        let _ = writeln!(
            out,
            "  <link name=\"{}\"/>\n  <joint name=\"{}\" type=\"fixed\">\n    \
             <origin xyz=\"{} {} {}\" rpy=\"{roll} {pitch} {yaw}\"/>\n    \
             <parent link=\"{}\"/>\n    <child link=\"{}\"/>\n  </joint>",
            escape(&link.name),
            escape(&joint),
            p.x,
            p.y,
            p.z,
            escape(parent),
            escape(&link.name)
        );
    }
    out
}
