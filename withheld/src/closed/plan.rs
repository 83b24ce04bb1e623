//! Which cases a set of closed chains holds.

/// Effects that a hexapod can have, with two forms of a geometry that is off: one joint, and all of them.
pub const EFFECTS: [&str; 9] = [
    "stribeck_friction",
    "leg_inertia",
    "torque_delay",
    "friction_asymmetry",
    "torque_constant",
    "leg_geometry",
    "payload",
    "passive_joint_friction",
    "all_leg_geometry",
];

/// What the catalogue has no name for.
pub const OUTSIDE: [&str; 2] = ["platform_pushed", "unlogged_oscillation"];

/// What a case is to be: its number, its kind and its effect.
#[derive(Clone, Debug)]
pub struct Plan {
    pub index: usize,
    pub kind: &'static str,
    pub effect: Option<&'static str>,
}

/// Of twelve cases two have no effect, nine one of the catalogue, one another.
pub fn mixed(count: usize) -> Vec<Plan> {
    let one = |i: usize| {
        let (round, k) = (i / 12, i % 12);
        let (kind, effect) = match k {
            0 | 6 => ("clean", None),
            11 => ("outside", Some(OUTSIDE[round % OUTSIDE.len()])),
            _ => ("single", Some(EFFECTS[k - 1 - usize::from(k > 6)])),
        };
        Plan {
            index: i + 1,
            kind,
            effect,
        }
    };
    (0..count).map(one).collect()
}
