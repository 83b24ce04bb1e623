//! `effects.py`: what a model has and MuJoCo has no element for, as functions of state and time step.
//!
//! Joints of a closed chain are its drives, and inverse dynamics is that of the tree with the forces in the loops.
//!
//! The file needs NumPy, and MuJoCo where it is installed in a model; nothing of excite. Its functions are pure,
//! and take the array module (NumPy, JAX, Torch) as an argument.

use super::element::{Element, FUNCTIONS, Function, Kind, py};
use super::mujoco::{base_joints, twist_joint};
use super::{Form, Format, Model, Part, Remark, closed, simulator};
use crate::error::Result;
use crate::plant::Plant;
use crate::robot::{Joint, Motion, Robot};
use serde_json::json;
use std::fmt::Write;

/// Speed over which the sign of a velocity turns where no effect says it, over the largest speed.
const SHARP: f64 = 1e-3;

/// What is the same in every file.
const RUNTIME: &str = include_str!("runtime.py");
/// What is the same in the files of serial and tree robots.
const OPEN: &str = include_str!("open.py");
/// What is the same in the files of closed chains.
const CLOSED: &str = include_str!("closed.py");

/// The file of functions beside MuJoCo's XML.
pub struct Effects;

impl Format for Effects {
    fn name(&self) -> &'static str {
        FUNCTIONS
    }

    fn file(&self) -> &'static str {
        FUNCTIONS
    }

    fn holds(&self, plant: &Plant) -> bool {
        simulator::of(plant).is_some()
    }

    fn has(&self, _part: Part) -> bool {
        false
    }

    fn element(&self, element: &Element) -> Form {
        match element.is_function() {
            true => Form::Callback,
            false => Form::None,
        }
    }

    fn needed(&self, model: &Model) -> bool {
        let elements = model.remarks.iter().filter_map(|r| r.element.as_ref());
        elements.into_iter().any(Element::is_function)
    }

    fn write(&self, model: &Model) -> Result<String> {
        functions(model)
    }
}

/// Tables that the functions stand in, line by line.
#[derive(Default)]
struct Tables {
    added: Vec<String>,
    remembered: Vec<String>,
    lasting: Vec<String>,
    displaced: Vec<String>,
    drives: Vec<String>,
    delayed: Vec<String>,
    free: Vec<String>,
    widths: Vec<Option<f64>>,
    loaded: bool,
}

/// The file of a model whether it has effects or not: what `effects.py` has beside them serves any model.
///
/// # Errors
/// A closed chain whose loops cannot be written.
pub fn functions(model: &Model) -> Result<String> {
    let (robot, zeros) = (model.robot, closed::zeros(model)?);
    let chain = zeros.is_some();
    let drives: Vec<&Joint> = model
        .plant
        .actuated()
        .iter()
        .map(|&a| &robot.joints[a])
        .collect();
    let along = match chain {
        true => {
            "effects.inverse(model, qpos, qvel, qacc, dt)  # torque along a motion (samples, drives)"
        }
        false => {
            "effects.inverse(model, q, dq, ddq, dt)  # torque along a motion (samples, joints)"
        }
    };
    let mut out = format!(
        "\"\"\"Effects of {} that MuJoCo has no element for, found by `excite diagnose`; belongs to robot.xml.\n\n    \
         import mujoco, effects\n    model = mujoco.MjModel.from_xml_path(\"robot.xml\")\n    \
         effects.install(model)                      # mj_step {} them now\n    tau = {along}\n\n\
         SI units. The functions are pure: arrays in, arrays out, of NumPy, JAX or Torch (`xp`).\n\n",
        one_line(&robot.name),
        if chain { "has" } else { "and mj_inverse have" }
    );
    let mut functions = String::new();
    let mut tables = Tables {
        widths: vec![None; drives.len()],
        ..Tables::default()
    };
    for (k, remark) in model.remarks.iter().enumerate() {
        let Some(element) = &remark.element else {
            continue;
        };
        if Effects.element(element) == Form::None {
            continue;
        }
        let _ = writeln!(
            out,
            "{} ({}): {}\n    {}",
            remark.effect,
            one_line(&remark.place),
            remark.equation,
            remark.values.join("\n    ")
        );
        let name = format!("{}_{}", remark.effect, k + 1);
        add(
            &name,
            remark,
            element,
            (robot, &drives),
            &mut functions,
            &mut tables,
        );
    }
    out += "\"\"\"\n\nimport numpy as np\n\n";
    let names: Vec<String> = drives.iter().map(|j| json!(j.name).to_string()).collect();
    let width = |(w, j): (&Option<f64>, &&Joint)| {
        let top = j.limits.velocity;
        py(w.unwrap_or(if top.is_finite() { SHARP * top } else { SHARP }))
    };
    let widths: Vec<String> = tables.widths.iter().zip(&drives).map(width).collect();
    let _ = writeln!(
        out,
        "# the {}, in the order of all arrays",
        if chain { "drives" } else { "joints" }
    );
    let _ = writeln!(out, "JOINTS = [{}]", names.join(", "));
    let _ = writeln!(
        out,
        "# speed over which the sign of a velocity turns in `torque`, rad/s or m/s"
    );
    let _ = writeln!(out, "WIDTH = [{}]", widths.join(", "));
    if let Some(zeros) = zeros {
        let _ = writeln!(
            out,
            "# length of each leg that is a tendon less the position of its drive, m"
        );
        let zeros: Vec<String> = zeros.into_iter().map(py).collect();
        let _ = writeln!(out, "ZERO = np.array([{}])", zeros.join(", "));
        let _ = writeln!(
            out,
            "# whether a function asks for the torque of the rigid bodies"
        );
        let _ = writeln!(
            out,
            "LOADED = {}",
            if tables.loaded { "True" } else { "False" }
        );
    }
    out += &functions;
    out += "\n\n";
    // neither is known of closed chains
    let open = |name: &str| !matches!(name, "DISPLACED" | "FREE");
    for (what, name, rows) in [
        ("joint, function of the state", "ADDED", &tables.added),
        (
            "joint, function of the state and a memory, its key, its start",
            "REMEMBERED",
            &tables.remembered,
        ),
        (
            "keys of memories that go on from one record to the next, share that does",
            "LASTING",
            &tables.lasting,
        ),
        (
            "joint, way of the joint beyond what its encoder reads",
            "DISPLACED",
            &tables.displaced,
        ),
        (
            "joint, what its drive reports, whether the actuator in robot.xml has it",
            "DRIVES",
            &tables.drives,
        ),
        (
            "joint, s by which what its drive reports is late",
            "DELAYED",
            &tables.delayed,
        ),
        (
            "joints of robot.xml without a drive, the force on them",
            "FREE",
            &tables.free,
        ),
    ]
    .into_iter()
    .filter(|(_, name, _)| !chain || open(name))
    {
        let _ = writeln!(out, "# {what}\n{name} = [{}]", rows.join(", "));
    }
    Ok(out + RUNTIME + if chain { CLOSED } else { OPEN })
}

/// Text that stands in a documentation string on one line.
fn one_line(text: &str) -> String {
    text.replace(['\n', '\r'], " ")
        .replace('\\', "/")
        .replace('"', "'")
}

fn add(
    name: &str,
    remark: &Remark,
    element: &Element,
    (robot, drives): (&Robot, &[&Joint]),
    functions: &mut String,
    tables: &mut Tables,
) {
    let head = |arguments: &str| {
        let turning = match element {
            Element::Function(f) => drives[f.joint].motion == Motion::Revolute,
            _ => true,
        };
        let [force, way] = if turning { ["N m", "rad"] } else { ["N", "m"] };
        format!(
            "\n\ndef {name}({arguments}):\n    \"\"\"{} ({}): {}; {force}, {way}, s.\"\"\"\n",
            remark.effect,
            one_line(&remark.place),
            remark.equation
        )
    };
    let body =
        |lines: &[String]| -> String { lines.iter().map(|l| format!("    {l}\n")).collect() };
    match element {
        Element::Function(Function {
            kind,
            joint,
            width,
            body: lines,
            start,
            lasts,
        }) => {
            let arguments = match kind {
                Kind::Torque => "q, dq, load, xp=np",
                Kind::Memory => "q, dq, load, dt, memory, xp=np",
                Kind::Displacement => "q, dq, ddq, xp=np",
                Kind::Drive => "tau, xp=np",
            };
            *functions += &head(arguments);
            *functions += &body(lines);
            let asks = matches!(kind, Kind::Torque | Kind::Memory);
            tables.loaded |= asks && lines.iter().any(|l| l.contains("load"));
            if *lasts > 0.0 {
                tables.lasting.push(format!("(\"{name}\", {})", py(*lasts)));
            }
            match kind {
                Kind::Torque => tables.added.push(format!("({joint}, {name})")),
                Kind::Memory => tables.remembered.push(format!(
                    "({joint}, {name}, \"{name}\", lambda q, xp: {})",
                    start.as_deref().unwrap_or("0.0 * q")
                )),
                Kind::Displacement => tables.displaced.push(format!("({joint}, {name})")),
                Kind::Drive => tables.drives.push(format!("({joint}, {name}, False)")),
            }
            if asks {
                let w = tables.widths[*joint].unwrap_or(f64::INFINITY);
                tables.widths[*joint] = Some(w.min(*width));
            }
        }
        Element::Gain { joint, error } => {
            *functions += &head("tau, xp=np");
            *functions += &format!("    return {} * tau\n", py(1.0 + error));
            tables.drives.push(format!("({joint}, {name}, True)"));
        }
        Element::Delay { joints, seconds } => {
            let rows = joints.iter().map(|j| format!("({j}, {})", py(*seconds)));
            tables.delayed.extend(rows);
        }
        Element::Twist {
            joint,
            stiffness,
            cubic,
            damping,
            gap,
        } => {
            let force = match *gap > 0.0 {
                false => "None",
                true => {
                    *functions += &head("x, v, xp=np");
                    let (k, k3, d, half) =
                        (py(*stiffness), py(*cubic), py(*damping), py(0.5 * gap));
                    *functions += &body(&[
                        format!("beyond = x - xp.clip(x, -{half}, {half})"),
                        format!("spring = -{k} * beyond - {k3} * beyond**3"),
                        "# flanks push only while they touch".into(),
                        format!("damped = spring - {d} * v * (beyond != 0.0)"),
                        "return xp.where(damped * spring > 0.0, damped, 0.0 * x)".into(),
                    ]);
                    name
                }
            };
            let free = twist_joint(robot, *joint);
            tables.free.push(format!("({}, {force})", json!(free)));
        }
        Element::Base { stiffness, .. } => {
            for (axis, name) in base_joints(robot).iter().enumerate() {
                if stiffness[axis].is_finite() {
                    tables.free.push(format!("({}, None)", json!(name)));
                }
            }
        }
        Element::Drag { .. }
        | Element::Spring { .. }
        | Element::Coupling { .. }
        | Element::Load { .. } => {}
    }
}
