//! Kinematic effects that may be missing, and where they can sit.

use super::conditions::Conditions;
use crate::calibrate::bend;
use crate::calibrate::effects::{PLAY, RUN_OUT, SAG, SOFT};
use crate::calibrate::feature::{Feature, Rate, Shape};
use crate::calibrate::file::Calibration;
use crate::calibrate::kin::Kin;
use crate::calibrate::open::Opened;
use crate::calibrate::unknown::{Part, Unknown};
use crate::mechanism::dimensions::Dimensions;
use crate::robot::Motion;

/// What the catalogue says of an effect.
#[derive(Debug, Clone, Copy)]
pub struct Effect {
    /// name
    pub name: &'static str,
    /// equation
    pub equation: &'static str,
    /// what would tell it from others
    pub separated_by: &'static str,
}

/// The effects.
pub const EFFECTS: [Effect; 10] = [
    Effect {
        name: "joint_offset",
        equation: "q + η",
        separated_by: "postures in which the joint turns over most of its range",
    },
    Effect {
        name: "link_geometry",
        equation: "X E(η), six errors of the frame of a joint",
        separated_by: "postures in which the joints before and behind it turn over most of their range",
    },
    Effect {
        name: "encoder_eccentricity",
        equation: "q + η1 sin q + η2 cos q",
        separated_by: "postures over a whole turn of the joint",
    },
    Effect {
        name: "joint_compliance",
        equation: "q + η τ_g(q)",
        separated_by: "the same postures with another load, and postures in which gravity pulls either way",
    },
    Effect {
        name: "link_compliance",
        equation: "X E(η b_g(q)), b_g the bend of a beam under gravity, η = 1/(E I) > 0",
        separated_by: "the same postures with another load, and postures in which the link stands upright and lies",
    },
    Effect {
        name: "backlash",
        equation: "q + η sign(τ_g), or q + η s with the side s that the joint came from, or q + η sign(τ_g − f s) with friction f",
        separated_by: "the same postures approached from either side",
    },
    Effect {
        name: "base_pose",
        equation: "T_cb E(η) in one group",
        separated_by: "a mark on the base that the instrument sees in every group",
    },
    Effect {
        name: "leg_geometry",
        equation: "ξ + η, dimensions of one chain, leg or hinge",
        separated_by: "poses over the whole workspace, with turns of the platform",
    },
    Effect {
        name: "leg_compliance",
        equation: "l + η f_g, f_g the force of gravity along the leg or rod",
        separated_by: "the same poses with another load on the platform",
    },
    Effect {
        name: "joint_clearance",
        equation: "l + η sign(f_g)",
        separated_by: "poses in which the force along the leg changes its sign",
    },
];

/// What is said of an effect.
pub fn effect(name: &str) -> Effect {
    let found = EFFECTS.iter().find(|e| e.name == name);
    found.copied().unwrap_or(EFFECTS[0])
}

/// An effect at a place.
#[derive(Debug, Clone)]
pub struct Place {
    /// name of the effect
    pub effect: &'static str,
    /// joints it sits at; none for a hinge of the platform or a group
    pub joints: Vec<String>,
    /// joint, leg, hinge or group
    pub name: String,
    /// indices of its columns: unknowns of the model, then those of the base by group
    pub columns: Vec<usize>,
    /// whether its one number cannot be negative
    pub positive: bool,
}

/// Columns and places.
#[derive(Debug, Default)]
pub struct Catalogue {
    /// effects at places
    pub places: Vec<Place>,
    /// columns beside the dimensions
    pub features: Vec<Feature>,
    /// their values, by row
    pub rates: Vec<Vec<Rate>>,
    /// groups whose base may have moved
    pub bases: Vec<usize>,
}

/// Sides of a play that gravity and friction close together, `tanh((τ_g / max τ_g − f s) / w)`: name, `f`. Where
/// friction holds more than gravity pulls, the play stays on the side the joint came from. That side is one where a drive
/// turns the joint, and the other where the arm is led by hand.
const CLOSED: [(&str, f64); 4] = [
    ("play_light_friction", 0.2),
    ("play_heavy_friction", 0.5),
    ("play_light_friction_led", -0.2),
    ("play_heavy_friction_led", -0.5),
];

/// Whether a number depends on the side that the joint came from.
pub fn by_approach(name: &str) -> bool {
    let closed = CLOSED.iter().any(|c| c.0 == name);
    closed || name == "play_by_approach"
}

/// One column that is to be added.
struct Column {
    name: &'static str,
    unit: &'static str,
    prior: f64,
    part: Part,
    values: Vec<f64>,
}

impl Catalogue {
    /// Of a robot in these conditions.
    pub fn new(opened: &Opened, c: &Conditions, tolerance: [f64; 2]) -> Self {
        let mut all = Catalogue {
            rates: vec![Vec::new(); c.q.len()],
            ..Catalogue::default()
        };
        all.geometry(opened);
        let motions = opened.kin.motions(opened.joints.len());
        for (joint, motion) in motions.into_iter().enumerate() {
            all.joint(opened, c, joint, motion, tolerance);
        }
        all.links(opened, c);
        all
    }

    /// Base by group: the last columns.
    pub fn add_bases(&mut self, input: &Calibration, unknowns: usize) {
        let groups = input.groups();
        let fitted = |g: usize| {
            let own = |r: &&crate::calibrate::row::Row| r.fit && input.group_of(r) == g;
            let seen = input.rows.iter().filter(own);
            seen.filter(|r| input.measurements[r.measurement].kind.has_instrument())
                .count()
        };
        let all: Vec<usize> = (0..groups.len()).filter(|&g| fitted(g) >= 3).collect();
        if all.len() < 2 {
            return;
        }
        for g in all {
            let first = unknowns + 6 * self.bases.len();
            self.bases.push(g);
            self.places.push(Place {
                effect: "base_pose",
                joints: Vec::new(),
                name: groups[g].to_string(),
                columns: (first..first + 6).collect(),
                positive: false,
            });
        }
    }

    /// The dimensions that the model has.
    fn geometry(&mut self, opened: &Opened) {
        let mut place = |effect, joints: Vec<String>, name: &str, columns| {
            self.places.push(Place {
                effect,
                joints,
                name: name.to_string(),
                columns,
                positive: false,
            });
        };
        match &opened.kin {
            Kin::Arm(arm) => {
                for (i, n) in arm.places().into_iter().enumerate() {
                    let columns = (6 * i..6 * i + 6).collect();
                    place("link_geometry", vec![n.to_string()], n, columns);
                }
            }
            Kin::Parallel(p) => {
                let (own, what) = match &p.dimensions {
                    Dimensions::Chains(..) => (crate::mechanism::dimensions::ARM.len(), "chain"),
                    Dimensions::Legs(_) => (crate::mechanism::dimensions::LEG.len(), "leg"),
                };
                let n = p.actuators();
                for (i, joint) in opened.joints.iter().enumerate().take(n) {
                    let columns = (own * i..own * i + own).collect();
                    let name = format!("{what}{}", i + 1);
                    place("leg_geometry", vec![joint.clone()], &name, columns);
                }
                for (k, at) in (own * n..p.errors()).step_by(3).enumerate() {
                    let name = format!("hinge{}", k + 1);
                    place("leg_geometry", Vec::new(), &name, (at..at + 3).collect());
                }
            }
        }
    }

    /// What one joint or actuator may do.
    fn joint(
        &mut self,
        opened: &Opened,
        c: &Conditions,
        joint: usize,
        motion: Motion,
        [length, angle]: [f64; 2],
    ) {
        let turns = motion == Motion::Revolute;
        let q: Vec<f64> = c.q.iter().map(|q| q[joint]).collect();
        let unit = if turns { "rad" } else { "m" };
        let mut add = |effect, positive, columns: Vec<Column>| {
            self.add(opened, joint, effect, positive, columns);
        };
        let offset = Column {
            name: "offset",
            unit,
            prior: if turns { angle } else { length },
            part: Part::Offset,
            values: vec![1.0; q.len()],
        };
        add("joint_offset", false, vec![offset]);
        if turns {
            let wave = |name, f: fn(f64) -> f64| Column {
                name,
                unit: "rad",
                prior: RUN_OUT,
                part: Part::Eccentricity,
                values: q.iter().map(|q| f(*q)).collect(),
            };
            let both = vec![wave("sin", f64::sin), wave("cos", f64::cos)];
            add("encoder_eccentricity", false, both);
        }
        let play = if turns { PLAY } else { length };
        let came: Vec<f64> = c.approach.iter().map(|a| a[joint]).collect();
        if came.iter().any(|s| *s != came[0]) {
            let column = Column {
                name: "play_by_approach",
                unit,
                prior: play,
                part: Part::Backlash,
                values: came.clone(),
            };
            add("backlash", false, vec![column]);
        }
        let Some(loads) = &c.torque else { return };
        let load: Vec<f64> = loads.iter().map(|t| t[joint]).collect();
        let top = |v: &[f64]| v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let most = loads.iter().fold(0.0f64, |m, t| m.max(top(t)));
        let largest = top(&load);
        if !(largest > 1e-3 * most) {
            return;
        }
        let side = |v: &[f64]| -> Vec<f64> {
            let soft = SOFT * top(v);
            v.iter().map(|x| (x / soft).tanh()).collect()
        };
        let one = |name, unit, prior, part, values: Vec<f64>| {
            vec![Column {
                name,
                unit,
                prior,
                part,
                values,
            }]
        };
        let by_load = if turns { "rad/(N m)" } else { "m/N" };
        let varies = |v: &[f64]| v.iter().any(|x| (x - v[0]).abs() > 0.5);
        let sides = side(&load);
        let legs =
            matches!(&opened.kin, Kin::Parallel(p) if matches!(p.dimensions, Dimensions::Legs(_)));
        let sag = if turns { SAG } else { length } / most;
        let soft = one("compliance", by_load, sag, Part::Compliance, load.clone());
        if legs {
            add("leg_compliance", true, soft);
            if varies(&sides) {
                let clearance = one("clearance", unit, play, Part::Backlash, sides);
                add("joint_clearance", true, clearance);
            }
            return;
        }
        add("joint_compliance", true, soft);
        if varies(&sides) {
            let load_play = one("play", unit, play, Part::Backlash, sides);
            add("backlash", true, load_play);
        }
        if matches!(opened.kin, Kin::Arm(_)) {
            for (name, friction) in CLOSED {
                let closed = |(t, s): (&f64, &f64)| ((t / largest - friction * s) / SOFT).tanh();
                let sides: Vec<f64> = load.iter().zip(&came).map(closed).collect();
                let own = came.iter().any(|s| *s != came[0]);
                if own && varies(&sides) {
                    add(
                        "backlash",
                        true,
                        one(name, unit, play, Part::Backlash, sides),
                    );
                }
            }
        }
        if let Some(levers) = &c.lever {
            // by virtual work the force along the rod is the torque times the lever ∂q/∂l
            let lever: Vec<f64> = levers.iter().map(|l| l[joint]).collect();
            let force: Vec<f64> = loads
                .iter()
                .zip(&lever)
                .map(|(t, l)| t[joint] * l)
                .collect();
            let stretch: Vec<f64> = force.iter().zip(&lever).map(|(f, l)| f * l).collect();
            let expected = length / top(&force).max(f64::MIN_POSITIVE);
            let column = one("compliance", "m/N", expected, Part::Compliance, stretch);
            add("leg_compliance", true, column);
            let sides = side(&force);
            if varies(&sides) {
                let shift = sides.iter().zip(&lever).map(|(s, l)| s * l).collect();
                let column = one("clearance", "m", length, Part::Backlash, shift);
                add("joint_clearance", true, column);
            }
        }
    }

    /// Links that bend.
    fn links(&mut self, opened: &Opened, c: &Conditions) {
        let (Kin::Arm(arm), Some(bends)) = (&opened.kin, &c.bends) else {
            return;
        };
        for feature in bend::features(&arm.names(), bends) {
            let link = &arm.links[feature.joint];
            self.places.push(Place {
                effect: "link_compliance",
                joints: vec![link.body.joint_name.clone()],
                name: link.body.joint_name.clone(),
                columns: vec![opened.kin.errors() + self.features.len()],
                positive: true,
            });
            for (row, bends) in self.rates.iter_mut().zip(bends) {
                row.push(Rate {
                    turn: 0.0,
                    place: bends[feature.joint],
                });
            }
            self.features.push(feature);
        }
    }

    fn add(
        &mut self,
        opened: &Opened,
        joint: usize,
        effect: &'static str,
        positive: bool,
        columns: Vec<Column>,
    ) {
        let name = &opened.joints[joint];
        let first = opened.kin.errors() + self.features.len();
        self.places.push(Place {
            effect,
            joints: vec![name.clone()],
            name: name.clone(),
            columns: (first..first + columns.len()).collect(),
            positive,
        });
        for c in columns {
            let unknown = Unknown::new(format!("{name}.{}", c.name), c.unit, c.part, c.prior);
            self.features.push(Feature {
                joint,
                part: c.part,
                shape: Shape::Given,
                soft: 1.0,
                unknown,
            });
            for (row, v) in self.rates.iter_mut().zip(c.values) {
                row.push(Rate::turn(v));
            }
        }
    }
}
