//! MuJoCo's XML. Friction, rotor inertia and springs are attributes of the joints, gravity is an option, drives are
//! actuators; what has no element there is in [`effects`](super::effects).
//!
//! Dry friction is a constraint that takes the sign of `q̈ + b q̇`: with the stiffest reference that a step allows,
//! `b = 1 / timestep`, it is that of `q̇` down to `q̈ / b`. A constant torque is a spring so far away that its force
//! does not change.

pub(super) mod body;
pub(super) mod joint;

use body::{kind, open};
pub(super) use joint::{OnJoint, spring};

use super::element::{Element, Form, Kind};
use super::{
    Format, LEAST, Model, Part, bounded, breakaway, escape, possible, remark, xml_comment,
};
use crate::error::Result;
use crate::robot::{Body, Inertia, JointTerm, Robot};
use std::fmt::Write;

/// MuJoCo's XML.
pub struct Mujoco;

/// Step of the simulation, s.
const STEP: f64 = 1e-3;
/// The shortest reference of dry friction; the engine raises it to two steps where a scene has longer ones.
pub(super) const STIFF: [(&str, &str); 2] = [
    ("solreffriction", "0.0001 1"),
    ("solimpfriction", "0.99 0.99 0.001"),
];
/// Least dry friction of a joint whose level a function sets, N m or N: the constraint is there from above zero on.
pub(super) const SOME_FRICTION: f64 = 1e-9;

impl Format for Mujoco {
    fn name(&self) -> &'static str {
        "MuJoCo"
    }

    fn file(&self) -> &'static str {
        "robot.xml"
    }

    fn has(&self, _part: Part) -> bool {
        true
    }

    fn element(&self, element: &Element) -> Form {
        let native = match element {
            Element::Drag { .. } | Element::Spring { .. } => true,
            Element::Gain { .. } | Element::Base { .. } | Element::Load { .. } => true,
            Element::Coupling { coulomb, .. } => *coulomb >= 0.0,
            // an actuator can act late; what is reported late is no part of the machine
            Element::Delay { seconds, .. } => *seconds < 0.0,
            Element::Twist { gap, .. } => *gap == 0.0,
            Element::Function(_) => false,
        };
        if native { Form::Native } else { Form::None }
    }

    fn write(&self, model: &Model) -> Result<String> {
        let mut lines = remark::lines(model.remarks, self);
        let parts = Parts::of(model);
        lines.extend(parts.versions());
        lines.extend(parts.left_out(model.robot));
        lines.extend(breakaway(model.robot));
        Ok(format!(
            "{}{}",
            xml_comment(&lines),
            parts.text(model.robot)
        ))
    }
}

/// The attributes of [`STIFF`].
pub(super) fn stiff() -> String {
    STIFF
        .map(|(name, value)| format!("{name}=\"{value}\""))
        .join(" ")
}

/// Name of the joint by which the link of a joint stands behind a spring.
pub(crate) fn twist_joint(robot: &Robot, joint: usize) -> String {
    free_name(robot, format!("{}_twist", robot.joints[joint].name))
}

/// Names of the joints by which a base tilts about x and y.
pub(crate) fn base_joints(robot: &Robot) -> [String; 2] {
    ["base_tilt_x", "base_tilt_y"].map(|name| free_name(robot, name.into()))
}

/// A name that no joint and no body has.
pub(super) fn free_name(robot: &Robot, mut name: String) -> String {
    let taken = |name: &str| {
        robot
            .bodies
            .iter()
            .any(|b| b.joint_name == name || b.name == name)
    };
    while taken(&name) {
        name.push('_');
    }
    name
}

/// A body that MuJoCo takes: it refuses bodies without mass or with a principal moment of zero, and compares moments
/// without tolerance. One without mass becomes a milligram of a millimetre, a point or thin rod 0.03 mm thick.
pub(super) fn solid(inertia: &Inertia) -> Inertia {
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

/// A model in the elements of MuJoCo.
pub(super) struct Parts<'a> {
    pub(super) joints: Vec<OnJoint>,
    pub(super) couplings: Vec<&'a Element>,
    pub(super) base: Option<&'a Element>,
    /// bodies that hang on others: the body they hang on, and they
    pub(super) loads: Vec<(usize, Inertia)>,
}

impl<'a> Parts<'a> {
    pub(super) fn of(model: &Model<'a>) -> Self {
        let plain = |j: &crate::robot::Joint| OnJoint {
            armature: j.terms[JointTerm::Armature as usize],
            damping: [j.terms[JointTerm::Viscous as usize], 0.0, 0.0],
            coulomb: j.terms[JointTerm::Coulomb as usize],
            spring: [j.terms[JointTerm::Offset as usize], 0.0, 0.0, 0.0],
            gain: 1.0,
            ..OnJoint::default()
        };
        let mut out = Parts {
            joints: model.robot.joints.iter().map(plain).collect(),
            couplings: Vec::new(),
            base: None,
            loads: Vec::new(),
        };
        for element in model.remarks.iter().filter_map(|r| r.element.as_ref()) {
            let joints = &mut out.joints;
            match element {
                Element::Drag {
                    joint,
                    power,
                    factor,
                } => {
                    joints[*joint].damping[usize::from(*power) - 1] += factor;
                }
                Element::Spring {
                    joint,
                    coefficients,
                } => {
                    let sum = joints[*joint].spring.iter_mut().zip(coefficients);
                    sum.for_each(|(s, c)| *s += c);
                }
                Element::Coupling { .. } => {
                    if Mujoco.element(element) == Form::Native {
                        out.couplings.push(element);
                    }
                }
                Element::Gain { joint, error } => joints[*joint].gain /= 1.0 + error,
                Element::Delay {
                    joints: of,
                    seconds,
                } => {
                    of.iter()
                        .for_each(|j| joints[*j].delay += (-seconds).max(0.0));
                }
                Element::Twist {
                    joint,
                    stiffness,
                    cubic,
                    damping,
                    gap,
                } => {
                    // a gap is a function
                    let spring = [*stiffness, *cubic, *damping];
                    joints[*joint].twist = Some(if *gap > 0.0 { [0.0; 3] } else { spring });
                }
                Element::Base { .. } => out.base = Some(element),
                // in the inertia of the body already
                Element::Load { body, inertia } => out.loads.push((*body, *inertia)),
                Element::Function(f) => {
                    if matches!(f.kind, Kind::Torque | Kind::Memory) {
                        let dry = &mut joints[f.joint].coulomb;
                        *dry = dry.max(SOME_FRICTION);
                    }
                }
            }
        }
        out
    }

    /// Which versions of MuJoCo read this file.
    pub(super) fn versions(&self) -> Vec<String> {
        let curved = |j: &OnJoint| {
            j.damping[1..]
                .iter()
                .chain(&j.spring[2..])
                .any(|x| *x != 0.0)
                || j.twist.is_some_and(|t| t[1] != 0.0)
        };
        let mut out = Vec::new();
        if self.joints.iter().any(curved) {
            out.push("Polynomials of damping and stiffness need MuJoCo 3.7.0 or later.".into());
        }
        if self.joints.iter().any(|j| j.delay > 0.0) {
            out.push("Delays of actuators need MuJoCo 3.5.0 or later.".into());
        }
        if !self.couplings.is_empty() {
            out.push("The inertia of tendons needs MuJoCo 3.3.1 or later.".into());
        }
        out
    }

    /// What is not in the file, nor elsewhere.
    pub(super) fn left_out(&self, robot: &Robot) -> Vec<String> {
        let below = |(j, on): (usize, &OnJoint)| {
            (on.coulomb < 0.0).then(|| {
                format!(
                    "Coulomb friction of {} on {} is not written: MuJoCo has none below zero",
                    on.coulomb, robot.joints[j].name
                )
            })
        };
        let restless = |(j, on): (usize, &OnJoint)| {
            on.never_rests().then(|| {
                format!(
                    "The spring on {} is not written: its torque is zero nowhere",
                    robot.joints[j].name
                )
            })
        };
        let all = || self.joints.iter().enumerate();
        let below = all().filter_map(below);
        below.chain(all().filter_map(restless)).collect()
    }

    fn text(&self, robot: &Robot) -> String {
        let mut out = String::new();
        let g = robot.gravity;
        let _ = writeln!(
            out,
            "<mujoco model=\"{}\">\n  <compiler angle=\"radian\" autolimits=\"true\"/>\n  \
             <option timestep=\"{STEP}\" gravity=\"{} {} {}\"/>",
            escape(&robot.name),
            g.x,
            g.y,
            g.z
        );
        if self.joints.iter().any(|j| j.coulomb > 0.0) || !self.couplings.is_empty() {
            let stiff = stiff();
            let _ = writeln!(
                out,
                "  <default>\n    <joint {stiff}/>\n    <tendon {stiff}/>\n  </default>"
            );
        }
        out += "  <worldbody>\n";
        let roots = || (0..robot.bodies.len()).filter(|&b| robot.bodies[b].parent.is_none());
        match self.base {
            Some(Element::Base {
                stiffness,
                damping,
                inertia,
            }) => {
                let name = free_name(robot, "base_tilt".into());
                let stand = body::tilting(inertia);
                let _ = writeln!(out, "    <body name=\"{name}\">\n      {stand}");
                let names = base_joints(robot);
                // about y first, then about x
                for (axis, direction) in [(1, "0 1 0"), (0, "1 0 0")] {
                    if stiffness[axis].is_finite() {
                        let _ = writeln!(
                            out,
                            "      <joint name=\"{}\" type=\"hinge\" axis=\"{direction}\" stiffness=\"{}\" \
                             damping=\"{}\"/>",
                            names[axis], stiffness[axis], damping[axis]
                        );
                    }
                }
                roots().for_each(|b| self.body(robot, b, 3, &mut out));
                out += "    </body>\n";
            }
            _ => roots().for_each(|b| self.body(robot, b, 2, &mut out)),
        }
        out += "  </worldbody>\n";
        self.tendons(robot, &mut out);
        followers(robot, &mut out);
        self.actuators(robot, &mut out);
        out += "</mujoco>\n";
        out
    }

    fn body(&self, robot: &Robot, index: usize, depth: usize, out: &mut String) {
        let body = &robot.bodies[index];
        let pad = "  ".repeat(depth);
        open(out, &pad, body, &body.position, &body.rotation);
        let joint = &robot.joints[body.coordinate];
        let leads = body.joint_name == joint.name;
        let kind = kind(body);
        let axis = format!("{} {} {}", body.axis.x, body.axis.y, body.axis.z);
        let mut attributes = String::new();
        if leads && joint.limits.position.iter().all(|x| x.is_finite()) {
            let [low, high] = joint.limits.position;
            let _ = write!(attributes, " range=\"{low} {high}\"");
        }
        if leads {
            attributes += &self.joints[body.coordinate].attributes();
        }
        let _ = writeln!(
            out,
            "{pad}  <joint name=\"{}\" type=\"{kind}\" axis=\"{axis}\"{attributes}/>",
            escape(&body.joint_name),
        );
        if let Some([stiffness, cubic, damping]) =
            self.joints[body.coordinate].twist.filter(|_| leads)
        {
            let name = twist_joint(robot, body.coordinate);
            let spring = match (stiffness, cubic) {
                (0.0, 0.0) => String::new(),
                (k, 0.0) => format!(" stiffness=\"{k}\" damping=\"{damping}\""),
                (k, c) => format!(" stiffness=\"{k} 0 {c}\" damping=\"{damping}\""),
            };
            let _ = writeln!(
                out,
                "{pad}  <joint name=\"{}\" type=\"{kind}\" axis=\"{axis}\"{spring}/>",
                escape(&name),
            );
        }
        for child in (0..robot.bodies.len()).filter(|&c| robot.bodies[c].parent == Some(index)) {
            self.body(robot, child, depth + 1, out);
        }
        let _ = writeln!(out, "{pad}</body>");
    }

    /// What two joints share: a tendon over both.
    fn tendons(&self, robot: &Robot, out: &mut String) {
        if self.couplings.is_empty() {
            return;
        }
        *out += "  <tendon>\n";
        for c in &self.couplings {
            let Element::Coupling {
                joints,
                ratio,
                coulomb,
                viscous,
                inertia,
            } = c
            else {
                continue;
            };
            let mut attributes = String::new();
            for (name, x) in [
                ("damping", viscous),
                ("frictionloss", coulomb),
                ("armature", inertia),
            ] {
                if *x != 0.0 {
                    let _ = write!(attributes, " {name}=\"{x}\"");
                }
            }
            let [a, b] = joints.map(|j| &robot.joints[j].name);
            let _ = writeln!(
                out,
                "    <fixed{attributes}>\n      <joint joint=\"{}\" coef=\"1\"/>\n      \
                 <joint joint=\"{}\" coef=\"{ratio}\"/>\n    </fixed>",
                escape(a),
                escape(b)
            );
        }
        *out += "  </tendon>\n";
    }

    /// The drives: told a torque or force, they make it.
    fn actuators(&self, robot: &Robot, out: &mut String) {
        *out += "  <actuator>\n";
        for (joint, on) in robot.joints.iter().zip(&self.joints) {
            let name = escape(&joint.name);
            let mut attributes = String::new();
            if on.gain != 1.0 {
                let _ = write!(attributes, " gainprm=\"{}\"", on.gain);
            }
            let effort = joint.limits.effort;
            if effort.is_finite() && effort > 0.0 {
                let _ = write!(attributes, " forcerange=\"-{effort} {effort}\"");
            }
            if on.delay > 0.0 {
                let samples = (on.delay / STEP).ceil() as usize + 1;
                let _ = write!(attributes, " delay=\"{}\" nsample=\"{samples}\"", on.delay);
            }
            let _ = writeln!(
                out,
                "    <general name=\"{name}\" joint=\"{name}\"{attributes}/>"
            );
        }
        *out += "  </actuator>\n";
    }
}

/// Joints that follow others.
pub(super) fn followers(robot: &Robot, out: &mut String) {
    let followers: Vec<&Body> = robot
        .bodies
        .iter()
        .filter(|b| b.joint_name != robot.joints[b.coordinate].name)
        .collect();
    if followers.is_empty() {
        return;
    }
    *out += "  <equality>\n";
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
    *out += "  </equality>\n";
}
