//! Random robots of seven usual structures, and nominal models that are wrong in the ordinary way.

use crate::chain::{Body, Chain, Joint, rpy};
use crate::random::Random;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::FRAC_PI_2 as H;

/// What a joint has beside its bodies.
#[derive(Clone, Debug)]
pub struct Drive {
    pub name: String,
    pub range: [f64; 2],
    pub velocity: f64,
    pub acceleration: f64,
    pub effort: f64,
    pub noise: f64,
    pub resolution: f64,
    pub gear: f64,
    pub armature: f64,
    pub viscous: f64,
    pub coulomb: f64,
    pub offset: f64,
    /// Joint columns of the nominal model: armature, viscous, Coulomb, offset.
    pub identify: [bool; 4],
}

#[derive(Clone, Debug)]
pub struct Machine {
    pub family: &'static str,
    /// Whether the nominal values come from an earlier identification.
    pub identified: bool,
    pub chain: Chain,
    pub drives: Vec<Drive>,
    pub nominal_chain: Chain,
    pub nominal_drives: Vec<Drive>,
    /// Lengths of the links, m: where lumps and loads sit.
    pub reach: f64,
}

impl Machine {
    pub fn dof(&self) -> usize {
        self.drives.len()
    }
}

/// One joint of a structure: roll, pitch, yaw and place in the parent (in units of its length scale),
/// home angle, half range, share of the largest speed.
struct Plan {
    rpy: [f64; 3],
    xyz: [f64; 3],
    home: f64,
    half: f64,
    speed: f64,
    prismatic: bool,
}

const fn plan(rpy: [f64; 3], xyz: [f64; 3], home: f64, half: f64, speed: f64) -> Plan {
    Plan {
        rpy,
        xyz,
        home,
        half,
        speed,
        prismatic: false,
    }
}

fn structure(family: usize) -> (&'static str, Vec<Plan>) {
    match family {
        0 => (
            "elbow6",
            vec![
                plan([0.0; 3], [0.0, 0.0, 0.3], 0.0, 1.6, 0.7),
                plan([-H, 0.0, 0.0], [0.12, 0.0, 0.25], -0.6, 0.9, 0.65),
                plan([0.0; 3], [0.6, 0.0, 0.0], 0.6, 1.0, 0.7),
                plan([0.0, H, 0.0], [0.25, -0.04, 0.0], 0.0, 2.0, 1.0),
                plan([-H, 0.0, 0.0], [0.0, 0.0, 0.4], 0.5, 1.4, 1.0),
                plan([H, 0.0, 0.0], [0.0, -0.1, 0.0], 0.0, 2.5, 1.2),
            ],
        ),
        1 => (
            "cobot7",
            vec![
                plan([0.0; 3], [0.0, 0.0, 0.2], 0.0, 1.5, 0.8),
                plan([-H, 0.0, 0.0], [0.0, 0.0, 0.16], 0.3, 1.0, 0.8),
                plan([H, 0.0, 0.0], [0.0, -0.35, 0.0], 0.0, 1.4, 0.8),
                plan([H, 0.0, 0.0], [0.06, 0.0, 0.0], -1.4, 1.0, 0.8),
                plan([-H, 0.0, 0.0], [-0.06, 0.35, 0.0], 0.0, 1.5, 1.0),
                plan([H, 0.0, 0.0], [0.0; 3], 1.3, 1.1, 1.0),
                plan([H, 0.0, 0.0], [0.07, 0.0, 0.0], 0.0, 1.7, 1.0),
            ],
        ),
        2 => (
            "parallel6",
            vec![
                plan([0.0; 3], [0.0, 0.0, 0.14], 0.0, 2.0, 0.8),
                plan([H, 0.0, 0.0], [0.0, -0.1, 0.0], 0.8, 1.1, 0.8),
                plan([0.0; 3], [0.5, 0.0, 0.02], -0.9, 1.2, 0.9),
                plan([0.0; 3], [0.45, 0.0, 0.08], -0.6, 1.6, 1.0),
                plan([H, 0.0, 0.0], [0.0, -0.09, 0.0], 0.9, 1.6, 1.0),
                plan([-H, 0.0, 0.0], [0.0, 0.08, 0.0], 0.0, 2.0, 1.0),
            ],
        ),
        3 => (
            "arm3",
            vec![
                plan([0.0; 3], [0.0, 0.0, 0.3], 0.0, 1.6, 0.8),
                plan([-H, 0.0, 0.0], [0.05, 0.0, 0.1], -0.4, 1.0, 0.8),
                plan([0.0; 3], [0.5, 0.0, 0.0], 0.7, 1.3, 1.0),
            ],
        ),
        4 => (
            "scara4",
            vec![
                plan([0.0; 3], [0.0, 0.0, 0.4], 0.0, 1.8, 0.8),
                plan([0.0; 3], [0.4, 0.0, 0.0], 0.3, 1.7, 1.0),
                Plan {
                    prismatic: true,
                    ..plan([0.0; 3], [0.35, 0.0, -0.1], 0.0, 0.12, 0.15)
                },
                plan([0.0; 3], [0.0, 0.0, -0.1], 0.0, 2.6, 1.2),
            ],
        ),
        5 => (
            "arm5",
            vec![
                plan([0.0; 3], [0.0, 0.0, 0.2], 0.0, 1.7, 0.8),
                plan([-H, 0.0, 0.0], [0.03, 0.0, 0.12], -0.7, 1.0, 0.8),
                plan([0.0; 3], [0.35, 0.0, 0.0], 0.9, 1.1, 0.9),
                plan([0.0; 3], [0.3, 0.0, 0.0], 0.4, 1.4, 1.0),
                plan([0.0, H, 0.0], [0.08, 0.0, 0.0], 0.0, 2.2, 1.2),
            ],
        ),
        _ => (
            "arm4",
            vec![
                plan([0.0; 3], [0.0, 0.0, 0.25], 0.0, 1.7, 0.8),
                plan([-H, 0.0, 0.0], [0.0, 0.0, 0.15], -0.5, 1.0, 0.8),
                plan([0.0, H, 0.0], [0.3, 0.0, 0.0], 0.0, 1.6, 1.0),
                plan([-H, 0.0, 0.0], [0.0, 0.0, 0.2], 0.6, 1.3, 1.0),
            ],
        ),
    }
}

/// A lump of mass that a body is made of.
struct Lump {
    mass: f64,
    com: Vector3<f64>,
    tensor: Matrix3<f64>,
}

/// A tube towards the next joint, a motor there, and a housing at the joint itself.
fn lumps(next: Vector3<f64>, mass: f64, size: f64, rng: &mut Random) -> Vec<Lump> {
    let length = next.norm().max(0.3 * size);
    let along = if next.norm() > 1e-9 {
        next.normalize()
    } else {
        Vector3::z()
    };
    let aa = along * along.transpose();
    let r2 = (0.3 * size).powi(2);
    let shares = [
        rng.range(0.35, 0.5),
        rng.range(0.2, 0.35),
        rng.range(0.15, 0.3),
    ];
    let mut off = |k: f64| {
        Vector3::new(
            k * size * rng.normal(),
            k * size * rng.normal(),
            k * size * rng.normal(),
        )
    };
    let tube = Lump {
        mass: mass * shares[0],
        com: along * (0.5 * length) + off(0.05),
        tensor: (Matrix3::identity() - aa)
            * (mass * shares[0] * (3.0 * r2 + length * length) / 12.0)
            + aa * (mass * shares[0] * r2 * 0.5),
    };
    let ball = |m: f64, com: Vector3<f64>| Lump {
        mass: m,
        com,
        tensor: Matrix3::identity() * (0.4 * m * r2),
    };
    let motor = ball(mass * shares[1], next * 0.9 + off(0.12));
    let housing = ball(mass * shares[2], off(0.12));
    vec![tube, motor, housing]
}

fn assemble(lumps: &[Lump]) -> Body {
    let mut body = Body::default();
    for l in lumps {
        body.add(l.mass, l.com, l.tensor);
    }
    body
}

/// Each lump heavier or lighter and displaced: the body stays possible.
fn perturbed(lumps: &[Lump], std: f64, size: f64, rng: &mut Random) -> Body {
    let mut body = Body::default();
    for l in lumps {
        let f = rng.factor(std);
        let d = Vector3::new(rng.normal(), rng.normal(), rng.normal()) * (0.1 * std * size);
        body.add(l.mass * f, l.com + d, l.tensor * f * rng.factor(std));
    }
    body
}

/// A robot of structure `family` (0 to 6). Efforts, friction and noise follow from its weight.
pub fn machine(family: usize, identified: bool, rng: &mut Random) -> Machine {
    let (name, plans) = structure(family);
    let scale = rng.log_range(0.7, 1.9);
    let mass = rng.range(7.0, 13.0) * scale.powf(2.2);
    let error = if identified { 0.002 } else { 0.1 };
    let mut joints = Vec::new();
    let mut nominal = Vec::new();
    for (i, p) in plans.iter().enumerate() {
        let size = 0.25 * scale * 0.88f64.powi(i as i32);
        let next = plans
            .get(i + 1)
            .map_or(Vector3::zeros(), |p| Vector3::from(p.xyz) * scale);
        let parts = lumps(next, mass * 0.62f64.powi(i as i32), size, rng);
        let position = Vector3::from(p.xyz).map(|x| x * scale);
        let rotation = rpy(p.rpy[0], p.rpy[1], p.rpy[2]);
        let joint = |body| Joint {
            prismatic: p.prismatic,
            rotation,
            position,
            body,
        };
        joints.push(joint(assemble(&parts)));
        nominal.push(joint(perturbed(&parts, error, size, rng)));
    }
    let gravity = Vector3::new(0.0, 0.0, -9.81);
    let chain = Chain { joints, gravity };
    let home: Vec<f64> = plans.iter().map(|p| p.home).collect();
    let weight = holding(&chain, &home, &plans);
    let inertia = chain.own_inertia(&home);
    let heaviest = inertia.iter().copied().fold(0.0, f64::max);
    let strongest = weight.iter().copied().fold(0.0, f64::max);
    let quick = rng.range(1.6, 3.0) / scale.sqrt();
    let drives: Vec<Drive> = plans
        .iter()
        .enumerate()
        .map(|(j, p)| {
            let velocity = quick * p.speed;
            let acceleration = velocity * rng.range(4.0, 6.0);
            // the smallest motors are not as small as the smallest links
            let armature = inertia[j] * rng.range(0.15, 0.5)
                + if p.prismatic {
                    0.0
                } else {
                    heaviest * rng.range(0.004, 0.012)
                };
            let peak = weight[j] + 0.7 * (inertia[j] + armature) * acceleration;
            let effort =
                peak * rng.range(1.5, 2.2) + if p.prismatic { 0.0 } else { 0.008 * strongest };
            let half = p.half
                * if p.prismatic {
                    scale
                } else {
                    rng.range(0.8, 1.0)
                };
            Drive {
                name: format!("axis_{}", j + 1),
                range: [p.home - half, p.home + half],
                velocity,
                acceleration,
                effort,
                noise: effort * rng.log_range(0.0025, 0.006),
                resolution: [0.6e-5, 1.2e-5, 2.4e-5][rng.index(3)]
                    * if p.prismatic { 0.1 } else { 1.0 },
                gear: [50.0, 66.0, 80.0, 100.0, 101.0, 121.0, 160.0][rng.index(7)],
                armature,
                viscous: effort * rng.range(0.015, 0.05) / velocity,
                coulomb: effort * rng.range(0.02, 0.05),
                offset: effort * rng.range(-0.006, 0.006),
                identify: [true; 4],
            }
        })
        .collect();
    let small = if identified { 0.004 } else { 1.0 };
    let nominal_drives = drives
        .iter()
        .map(|d| Drive {
            armature: d.armature * rng.factor(0.12 * small),
            viscous: d.viscous * rng.factor(0.25 * small),
            coulomb: d.coulomb * rng.factor(0.2 * small),
            offset: if identified {
                d.offset * rng.factor(0.02)
            } else {
                0.0
            },
            ..d.clone()
        })
        .collect();
    Machine {
        family: name,
        identified,
        nominal_chain: Chain {
            joints: nominal,
            gravity,
        },
        chain,
        drives,
        nominal_drives,
        reach: scale,
    }
}

/// Largest gravity torque of each joint over the corners of the range.
fn holding(chain: &Chain, home: &[f64], plans: &[Plan]) -> Vec<f64> {
    let n = home.len();
    let zero = vec![0.0; n];
    let mut out = vec![0.0f64; n];
    let mut k = crate::chain::Kinematics::default();
    let mut tau = vec![0.0; n];
    for corner in 0..1usize << n {
        let q: Vec<f64> = (0..n)
            .map(|j| home[j] + plans[j].half * if corner >> j & 1 == 1 { 0.8 } else { -0.8 })
            .collect();
        chain.kinematics(&q, &zero, &mut k);
        chain.inverse(&k, &zero, &zero, &mut tau);
        for (o, t) in out.iter_mut().zip(&tau) {
            *o = o.max(t.abs());
        }
    }
    out
}
