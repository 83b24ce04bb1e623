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
use crate::solid::Pose;

/// What a motion must offer: its positions, and a bound on every joint's speed over a stretch of time.
pub trait Path: Sync {
    /// positions at `t`, one a coordinate
    fn position(&self, t: f64, q: &mut [f64]);
    /// bound on the magnitude of every coordinate's speed over `[from, to]`
    fn speed(&self, from: f64, to: f64, v: &mut [f64]);
    /// bound on the magnitude of a coordinate's position
    fn largest(&self, joint: usize) -> f64;
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

/// Distances are taken to be wrong by rounding by no more than this, m.
const ROUNDING: f64 = 1e-9;

/// Reach of each joint on each pair: `ρ_j` by coordinate, for the joints between its two bodies.
pub fn reaches(robot: &Robot, scene: &Scene, pair: &Pair, largest: &[f64]) -> Vec<f64> {
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
                let most = largest[body.coordinate];
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

/// How closely [`clearances`] looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fineness {
    /// stretches to begin with
    pub stretches: usize,
    /// a stretch is halved until its bound is this close to the least that is met, m
    pub tolerance: f64,
    /// … or until it is shorter than this, s
    pub shortest: f64,
}

impl Default for Fineness {
    fn default() -> Self {
        Fineness {
            stretches: 400,
            tolerance: 2e-4,
            shortest: 1e-5,
        }
    }
}

/// Least clearance of every pair over the whole motion. The nearest pair is known to the tolerance; of pairs
/// that are farther away it is enough to know that.
pub fn clearances(robot: &Robot, scene: &Scene, path: &dyn Path, fine: Fineness) -> Vec<Clearance> {
    let n = robot.joints.len();
    let largest: Vec<f64> = (0..n).map(|j| path.largest(j)).collect();
    let (mut q, mut v, mut at) = (vec![0.0; n], vec![0.0; n], Vec::new());
    let count = fine.stretches.max(1);
    let step = path.duration() / count as f64;
    let mut grid: Vec<Vec<Pose>> = Vec::with_capacity(count + 1);
    let mut speeds: Vec<Vec<f64>> = Vec::with_capacity(count);
    for k in 0..=count {
        path.position(k as f64 * step, &mut q);
        poses(robot, &q, &mut at);
        grid.push(at.clone());
        if k < count {
            path.speed(k as f64 * step, (k + 1) as f64 * step, &mut v);
            speeds.push(v.clone());
        }
    }
    let dot = |v: &[f64], rho: &[f64]| -> f64 { v.iter().zip(rho).map(|(v, r)| v * r).sum() };
    let mut out: Vec<(Clearance, Vec<f64>, Vec<f64>)> = scene
        .pairs
        .iter()
        .enumerate()
        .map(|(index, pair)| {
            let distances: Vec<f64> = grid
                .iter()
                .map(|at| scene.separation(pair, at).distance)
                .collect();
            let least = (0..distances.len()).min_by(|a, b| distances[*a].total_cmp(&distances[*b]));
            let k = least.unwrap_or(0);
            let found = Clearance {
                pair: index,
                met: distances[k],
                time: k as f64 * step,
                bound: f64::INFINITY,
            };
            (found, distances, reaches(robot, scene, pair, &largest))
        })
        .collect();
    let room = |c: &Clearance| c.met - scene.pairs[c.pair].margin;
    out.sort_by(|a, b| {
        room(&a.0)
            .total_cmp(&room(&b.0))
            .then(a.0.pair.cmp(&b.0.pair))
    });
    let mut nearest = f64::INFINITY;
    for (found, distances, rho) in &mut out {
        let pair = scene.pairs[found.pair];
        nearest = nearest.min(room(found));
        let mut stretches: Vec<(f64, f64, f64, f64)> = (0..count)
            .map(|k| (k as f64 * step, step, distances[k], distances[k + 1]))
            .collect();
        while let Some((from, h, d0, d1)) = stretches.pop() {
            let whole = (h == step).then(|| (from / step).round() as usize);
            let rate = match whole.and_then(|k| speeds.get(k)) {
                Some(v) => dot(v, rho),
                None => {
                    path.speed(from, from + h, &mut v);
                    dot(&v, rho)
                }
            };
            let bound = 0.5 * (d0 + d1 - rate * h) - ROUNDING;
            // a pair that is farther away than the nearest one is known less closely
            let slack = fine.tolerance + 0.2 * (room(found) - nearest).max(0.0);
            if bound >= found.met - slack || h <= fine.shortest || !bound.is_finite() {
                // what is no number is no bound
                let known = if bound.is_nan() {
                    f64::NEG_INFINITY
                } else {
                    bound
                };
                found.bound = found.bound.min(known);
                continue;
            }
            let middle = from + 0.5 * h;
            path.position(middle, &mut q);
            poses(robot, &q, &mut at);
            let d = scene.separation(&pair, &at).distance;
            if d < found.met {
                found.met = d;
                found.time = middle;
                nearest = nearest.min(room(found));
            }
            stretches.push((from, 0.5 * h, d0, d));
            stretches.push((middle, 0.5 * h, d, d1));
        }
        found.bound = found.bound.min(found.met);
    }
    out.into_iter().map(|(c, _, _)| c).collect()
}
