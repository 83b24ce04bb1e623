//! Actuators of Isaac Lab: a module of Python with one configuration a joint. Not run there.
//!
//! Rotor inertia is `armature`, Coulomb friction `friction` and `dynamic_friction`, viscous friction `viscous_friction` (Isaac
//! Sim 5 and later, N m and N m s/rad), torque that acts late a delay in steps of the simulation. Inertia is that of the
//! model, which is loaded from `robot.urdf` or `robot.usda`.

use super::element::py;
use super::{Element, Form, Format, Model, Part, remark};
use crate::error::Result;
use crate::robot::JointTerm;
use serde_json::json;
use std::fmt::Write;

/// Isaac Lab's configuration of actuators.
pub struct IsaacLab;

/// Step of the simulation that delays are counted in, s.
const STEP: f64 = 0.005;

impl Format for IsaacLab {
    fn name(&self) -> &'static str {
        "Isaac Lab"
    }

    fn file(&self) -> &'static str {
        "actuators.py"
    }

    fn has(&self, part: Part) -> bool {
        matches!(part, Part::Term(term) if term != JointTerm::Offset)
    }

    fn element(&self, element: &Element) -> Form {
        match element {
            Element::Delay { seconds, .. } if *seconds < 0.0 => Form::Native,
            _ => Form::None,
        }
    }

    fn write(&self, model: &Model) -> Result<String> {
        let robot = model.robot;
        let mut delays = vec![0.0; robot.dof()];
        for r in model.remarks {
            if let Some(Element::Delay { joints, seconds }) = &r.element {
                joints
                    .iter()
                    .for_each(|j| delays[*j] += (-seconds).max(0.0));
            }
        }
        let mut out = format!(
            "\"\"\"Actuators of {} for Isaac Lab, written by excite after its documentation; not run there.\n\n\
             SI units. friction, dynamic_friction and viscous_friction are torques in Isaac Sim 5 and later.\n",
            robot.name.replace(['"', '\\', '\n', '\r'], " ")
        );
        for joint in &robot.joints {
            let offset = joint.terms[JointTerm::Offset as usize];
            if offset != 0.0 {
                let _ = writeln!(
                    out,
                    "Not in it: torque offset of {}: {offset}",
                    joint.name.replace(['"', '\\'], " ")
                );
            }
        }
        for text in remark::lines(model.remarks, self) {
            let _ = writeln!(out, "{}", text.replace(['"', '\\', '\n', '\r'], " "));
        }
        let late = delays.iter().any(|d| *d > 0.0);
        out += "\"\"\"\n\nfrom isaaclab.actuators import ";
        out += if late {
            "DelayedPDActuatorCfg, ImplicitActuatorCfg\n\n"
        } else {
            "ImplicitActuatorCfg\n\n"
        };
        if late {
            let _ = writeln!(
                out,
                "# step of the simulation that the delays are counted in, s\nSTEP = {}\n",
                py(STEP)
            );
        }
        out += "ACTUATORS = {\n";
        for (joint, delay) in robot.joints.iter().zip(&delays) {
            let term = |t: JointTerm| py(joint.terms[t as usize].max(0.0));
            let name = json!(joint.name).to_string();
            // a name stands for itself, not for a pattern
            let pattern = json!(escaped(&joint.name)).to_string();
            let class = if *delay > 0.0 {
                "DelayedPDActuatorCfg"
            } else {
                "ImplicitActuatorCfg"
            };
            let _ = writeln!(
                out,
                "    {name}: {class}(\n        joint_names_expr=[{pattern}],"
            );
            for (key, x) in [
                ("effort_limit_sim", joint.limits.effort),
                ("velocity_limit_sim", joint.limits.velocity),
            ] {
                if x.is_finite() {
                    let _ = writeln!(out, "        {key}={},", py(x));
                }
            }
            let _ = writeln!(
                out,
                "        stiffness=0.0,\n        damping=0.0,\n        armature={},\n        friction={},\n        \
                 dynamic_friction={},\n        viscous_friction={},",
                term(JointTerm::Armature),
                term(JointTerm::Coulomb),
                term(JointTerm::Coulomb),
                term(JointTerm::Viscous)
            );
            if *delay > 0.0 {
                let steps = format!("round({} / STEP)", py(*delay));
                let _ = writeln!(
                    out,
                    "        min_delay={steps},\n        max_delay={steps},"
                );
            }
            out += "    ),\n";
        }
        Ok(out + "}\n")
    }
}

/// A name as a regular expression.
fn escaped(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        if !(c.is_alphanumeric() || c == '_') {
            out.push('\\');
        }
        out.push(c);
    }
    out
}
