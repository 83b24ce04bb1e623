//! What tests share: random robots and motions, comparisons, noise, rehearsals, and data from elsewhere.
#![allow(dead_code, clippy::needless_range_loop)]

pub mod compare;
pub mod five_bar;
pub mod noise;
pub mod parallel;
pub mod parallel_toml;
pub mod parts;
pub mod python;
pub mod rehearse;
pub mod shared;
pub mod tripod;

use excite::dynamics::Samples;
use excite::robot::parts::Limits;
use excite::robot::parts::{Motion, Prior};
use excite::robot::{Body, Inertia, Joint, Robot};
use nalgebra::{Matrix3, Rotation3, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

pub fn vector(r: &mut impl Rng, s: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| r.random_range(-s..s))
}

pub fn rotation(r: &mut impl Rng) -> Matrix3<f64> {
    *Rotation3::from_scaled_axis(vector(r, 2.0)).matrix()
}

/// Inertia of a random cloud of four point masses: always one that a body can have.
pub fn inertia(r: &mut impl Rng) -> Inertia {
    let mut sum = Inertia::default();
    for _ in 0..4 {
        let m = r.random_range(0.2..2.0);
        sum = sum + Inertia::from_com(m, vector(r, 0.3), Matrix3::zeros());
    }
    sum
}

pub fn joint(name: &str, motion: Motion) -> Joint {
    Joint {
        limits: Limits {
            position: [-2.5, 2.5],
            velocity: 2.0,
            acceleration: 10.0,
            jerk: 500.0,
            effort: 200.0,
            ..Limits::default()
        },
        torque_noise: Some(0.1),
        ..Joint::new(name, motion)
    }
}

/// A random tree of `n` bodies with revolute and prismatic joints, branches, arbitrary axes and
/// placements, and, where asked, a mimic joint.
pub fn robot(seed: u64, n: usize, mimic: bool) -> Robot {
    let r = &mut rng(seed);
    let mut bodies: Vec<Body> = Vec::new();
    let mut joints = Vec::new();
    for i in 0..n {
        let parent = match i {
            0 => None,
            _ if r.random_bool(0.15) => None,
            _ => Some(if r.random_bool(0.7) {
                i - 1
            } else {
                r.random_range(0..i)
            }),
        };
        let follow = mimic && i == n - 1 && n > 1;
        let motion = match (follow, r.random_bool(0.75)) {
            (true, _) => bodies[0].motion,
            (_, true) => Motion::Revolute,
            (_, false) => Motion::Prismatic,
        };
        if !follow {
            joints.push(joint(&format!("j{i}"), motion));
        }
        bodies.push(Body {
            name: format!("b{i}"),
            joint_name: format!("j{i}"),
            parent,
            motion,
            axis: vector(r, 1.0).normalize(),
            rotation: rotation(r),
            position: vector(r, 0.5),
            inertia: inertia(r),
            merged: vec![],
            coordinate: if follow { 0 } else { joints.len() - 1 },
            ratio: if follow { -0.7 } else { 1.0 },
            offset: if follow { 0.2 } else { 0.0 },
            meant: None,
        });
    }
    Robot {
        name: format!("random{seed}"),
        bodies,
        joints,
        gravity: Vector3::new(0.7, -1.1, -9.7),
        prior: Prior::Cad,
        warnings: vec![],
        path: None,
        hash: String::new(),
        geometry: Default::default(),
        tool: None,
    }
}

/// Random positions, velocities and accelerations.
pub fn samples(seed: u64, dof: usize, count: usize) -> Samples {
    let r = &mut rng(seed);
    let mut s = Samples::zeros(dof, count);
    for x in s.q.iter_mut() {
        *x = r.random_range(-3.0..3.0);
    }
    for x in s.qd.iter_mut().chain(s.qdd.iter_mut()) {
        *x = r.random_range(-4.0..4.0);
    }
    s
}

/// Pose of every body in the base frame, `(R_WB, p_WB_W)`, written independently of the kernels.
pub fn poses(robot: &Robot, q: &[f64]) -> Vec<(Matrix3<f64>, Vector3<f64>)> {
    let mut all: Vec<(Matrix3<f64>, Vector3<f64>)> = Vec::new();
    for b in &robot.bodies {
        let (rp, pp) = b
            .parent
            .map_or((Matrix3::identity(), Vector3::zeros()), |p| all[p]);
        let x = b.ratio * q[b.coordinate] + b.offset;
        let (turn, slide) = match b.motion {
            Motion::Revolute => (
                *Rotation3::from_scaled_axis(b.axis * x).matrix(),
                Vector3::zeros(),
            ),
            Motion::Prismatic => (Matrix3::identity(), b.axis * x),
        };
        all.push((
            rp * b.rotation * turn,
            pp + rp * (b.position + b.rotation * slide),
        ));
    }
    all
}
