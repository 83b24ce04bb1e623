//! What can be wrong with a machine: the names of `docs/formats.md`, where each effect may sit, which
//! names count as the same answer, and effects that have no name there.

use crate::random::Random;
use crate::robots::Machine;

/// An effect in a plant. The formulas are in `plant.rs` and `friction.rs`.
#[derive(Clone, Debug)]
pub struct Effect {
    pub name: &'static str,
    /// Joint it sits in; the second for what two joints share.
    pub joint: usize,
    /// Size: 1 is strong but possible.
    pub strength: f64,
    /// Uniform random numbers that fix its shape.
    pub shape: [f64; 6],
}

/// Effects of the catalogue that a serial robot can have. The second entry says that a refit of the
/// nominal parameters absorbs it (it is judged by the frozen model, whose values are then close), the
/// third whether a slow record belongs to its case.
pub const CATALOGUE: &[(&str, bool, bool)] = &[
    ("payload", true, false),
    ("link_inertia", true, false),
    ("gravity_direction", true, false),
    ("rotor_inertia", true, false),
    ("viscous_friction", false, false),
    ("coulomb_friction", false, false),
    ("torque_offset", false, false),
    ("friction_asymmetry", false, false),
    ("nonlinear_viscous_friction", false, false),
    ("stribeck_friction", false, true),
    ("presliding_hysteresis", false, true),
    ("load_dependent_friction", false, false),
    ("position_dependent_friction", false, false),
    ("thermal_friction", false, false),
    ("torque_constant", true, false),
    ("torque_saturation", false, false),
    ("cogging", false, true),
    ("transmission_error", false, true),
    ("joint_elasticity", false, false),
    ("backlash", false, false),
    ("base_compliance", false, false),
    ("torque_delay", false, false),
    ("cable_spring", false, false),
    ("counterbalance", true, false),
    ("joint_coupling", false, false),
    ("joint_offset", true, false),
    ("encoder_eccentricity", false, false),
];

/// Effects without a name in the catalogue.
pub const OUTSIDE: &[&str] = &[
    "contact_bursts",
    "slipping_belt",
    "sloshing_load",
    "unlogged_oscillation",
    "impulses",
    "sensor_crosstalk",
    "dragging_brake",
    "drifting_tool_force",
];

pub fn entry(name: &str) -> Option<&'static (&'static str, bool, bool)> {
    CATALOGUE.iter().find(|e| e.0 == name)
}

/// Names that are as right as the effect's own: aliases that no motion of this robot separates.
pub fn equivalents(effect: &Effect, machine: &Machine) -> Vec<&'static str> {
    let last = machine.dof() - 1;
    let mut names = vec![effect.name];
    match effect.name {
        "payload" => names.push("link_inertia"),
        "link_inertia" if effect.joint == last => names.push("payload"),
        // about a fixed axis a rotor and a link turn alike
        "rotor_inertia" if effect.joint == 0 => names.push("link_inertia"),
        "cogging" => names.push("transmission_error"),
        "transmission_error" => names.push("cogging"),
        "cable_spring" => names.push("counterbalance"),
        "counterbalance" => names.push("cable_spring"),
        "torque_offset" => names.push("friction_asymmetry"),
        _ => {}
    }
    names
}

/// Names that are neither right nor wrong where an effect outside the catalogue resembles them.
pub fn tolerated(name: &str) -> Vec<&'static str> {
    match name {
        // the mean of a moving or a slow tool force is one
        "sloshing_load" => vec!["payload", "link_inertia"],
        "transmission_error" => vec!["joint_elasticity"],
        "backlash" => vec!["joint_elasticity"],
        // a bristle that breaks away late in a slow record
        "stribeck_friction" => vec!["presliding_hysteresis"],
        // the hose has friction with a memory of its own
        "cable_spring" => vec!["presliding_hysteresis"],
        _ => Vec::new(),
    }
}

/// Joints that an answer has to name; none where the effect is not tied to one.
pub fn joints(effect: &Effect, machine: &Machine) -> Vec<usize> {
    match effect.name {
        "gravity_direction" | "base_compliance" => Vec::new(),
        "torque_delay" if effect.shape[0] < 0.5 => Vec::new(),
        "payload" => vec![machine.dof() - 1],
        "joint_coupling" => vec![effect.joint, effect.joint + 1],
        "contact_bursts" | "sloshing_load" | "drifting_tool_force" => Vec::new(),
        _ => vec![effect.joint],
    }
}

/// An effect of strength 1 in a joint where it can sit.
pub fn place(name: &'static str, machine: &Machine, rng: &mut Random) -> Effect {
    let n = machine.dof();
    let weak = |j: usize| machine.chain.joints[j].prismatic;
    let joint = match name {
        "payload" => n - 1,
        "counterbalance" => 1,
        "joint_coupling" => n - 2,
        // a tilt or an offset of the first vertical axis changes nothing
        "joint_offset" | "encoder_eccentricity" | "link_inertia" | "rotor_inertia" => {
            1 + rng.index(n - 1)
        }
        // where there is a load
        "load_dependent_friction" | "torque_saturation" if rng.chance(0.7) => 1 + rng.index(2),
        _ => rng.index(n),
    };
    let mut joint = joint;
    let turning = matches!(
        name,
        "cogging"
            | "transmission_error"
            | "encoder_eccentricity"
            | "joint_offset"
            | "counterbalance"
            | "position_dependent_friction"
            | "cable_spring"
            | "torque_saturation"
            | "torque_constant"
    );
    if turning && weak(joint) {
        joint = 1;
    }
    // joints of a SCARA do not feel gravity: an offset of the second is seen through inertia alone
    Effect {
        name,
        joint,
        strength: 1.0,
        shape: std::array::from_fn(|_| rng.range(0.0, 1.0)),
    }
}

/// Whether an effect can show at all on this structure.
pub fn possible(name: &str, machine: &Machine) -> bool {
    let scara = machine.family == "scara4";
    match name {
        "gravity_direction"
        | "base_compliance"
        | "counterbalance"
        | "joint_offset"
        | "torque_saturation"
        | "encoder_eccentricity"
        | "load_dependent_friction" => !scara,
        "joint_coupling" => machine.dof() >= 4 && !scara,
        _ => true,
    }
}
