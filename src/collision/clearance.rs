//! Least clearance of a motion over all time.
//!
//! Between two instants no point of a body moves relative to another body faster than
//!
//! ```text
//! L = Σ_j v̄_j ρ_j
//! ```
//!
//! over the joints between the two bodies, with `v̄_j` a bound of the joint's speed on that stretch and
//! `ρ_j` the furthest that the volume can lie from the axis of joint `j` (1 for a joint that slides).
//! The distance of a pair changes no faster than that, so over a stretch `h` with distances `d₀`, `d₁`
//! at its ends
//!
//! ```text
//! d(t) ≥ (d₀ + d₁ − L h) / 2                            for all t of the stretch
//! ```
//!
//! Stretches where that is not enough are halved.

use super::scene::{Pair, Partner, Scene, poses};
use crate::robot::{Motion, Robot};

/// What a motion must offer: its positions, and a bound on every joint's speed over a stretch of time.
pub trait Path {
    /// positions at `t`, one a coordinate
    fn position(&self, t: f64, q: &mut [f64]);
    /// bound on the magnitude of every coordinate's speed over `[from, to]`
    fn speed(&self, from: f64, to: f64, v: &mut [f64]);
    /// end of the motion, s; it starts at 0
    fn duration(&self) -> f64;
}

/// What was found out about one pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clearance {
    /// index of the pair
    pub pair: usize,
    /// least distance that was met at an instant, m
    pub met: f64,
    /// when, s
    pub time: f64,
    /// the distance is at no time less than this, m
    pub bound: f64,
}

/// Reach of each joint on each pair: `ρ_j` by coordinate, for the joints between its two bodies.
pub fn reaches(robot: &Robot, scene: &Scene, pair: &Pair) -> Vec<f64> {
    let mut out = vec![0.0; robot.joints.len()];
    let chain = |body: Option<usize>| {
        let mut list = Vec::new();
        let mut at = body;
        while let Some(b) = at {
            list.push(b);
            at = robot.bodies[b].parent;
        }
        list
    };
    let first = &scene.volumes[pair.volume];
    let (a, b) = (
        chain(first.body),
        match pair.partner {
            Partner::Volume(v) => chain(scene.volumes[v].body),
            Partner::Obstacle(_) => Vec::new(),
        },
    );
    let mut add = |list: &[usize], common: &[usize], shape_reach: f64| {
        // from the volume towards the base: how far it can lie from the origin of each body
        let mut reach = shape_reach;
        for &k in list.iter().take_while(|k| !common.contains(k)) {
            let body = &robot.bodies[k];
            let rho = match body.motion {
                Motion::Revolute => reach,
                Motion::Prismatic => 1.0,
            };
            out[body.coordinate] += body.ratio.abs() * rho;
            reach += body.position.norm();
            if body.motion == Motion::Prismatic {
                let [lo, hi] = robot.joints[body.coordinate].limits.position;
                let most = lo.abs().max(hi.abs());
                reach += body.ratio.abs() * most + body.offset.abs();
            }
        }
    };
    add(&a, &b, first.shape.reach());
    if let Partner::Volume(v) = pair.partner {
        add(&b, &a, scene.volumes[v].shape.reach());
    }
    out
}

/// Least clearance of every pair over the whole motion; a stretch is halved until its bound is within
/// `tolerance` of what is met, or until it is shorter than `shortest`.
pub fn clearances(
    robot: &Robot,
    scene: &Scene,
    path: &dyn Path,
    instants: usize,
    tolerance: f64,
    shortest: f64,
) -> Vec<Clearance> {
    let n = robot.joints.len();
    let (mut q, mut v, mut at) = (vec![0.0; n], vec![0.0; n], Vec::new());
    let mut distance = |pair: &Pair, t: f64| {
        path.position(t, &mut q);
        poses(robot, &q, &mut at);
        scene.separation(pair, &at).distance
    };
    let step = path.duration() / instants.max(1) as f64;
    let mut out = Vec::new();
    for (index, pair) in scene.pairs.iter().enumerate() {
        let rho = reaches(robot, scene, pair);
        let samples: Vec<f64> = (0..=instants)
            .map(|k| distance(pair, k as f64 * step))
            .collect();
        let least = (0..samples.len()).min_by(|a, b| samples[*a].total_cmp(&samples[*b]));
        let k = least.unwrap_or(0);
        let mut found = Clearance {
            pair: index,
            met: samples[k],
            time: k as f64 * step,
            bound: f64::INFINITY,
        };
        let mut stretches: Vec<(f64, f64, f64, f64)> = (0..instants)
            .map(|k| (k as f64 * step, step, samples[k], samples[k + 1]))
            .collect();
        while let Some((from, h, d0, d1)) = stretches.pop() {
            path.speed(from, from + h, &mut v);
            let rate: f64 = v.iter().zip(&rho).map(|(v, r)| v * r).sum();
            let bound = 0.5 * (d0 + d1 - rate * h);
            if bound >= found.met - tolerance || h <= shortest {
                found.bound = found.bound.min(bound);
                continue;
            }
            let middle = from + 0.5 * h;
            let d = distance(pair, middle);
            if d < found.met {
                found.met = d;
                found.time = middle;
            }
            stretches.push((from, 0.5 * h, d0, d));
            stretches.push((middle, 0.5 * h, d, d1));
        }
        found.bound = found.bound.min(found.met);
        out.push(found);
    }
    out
}
