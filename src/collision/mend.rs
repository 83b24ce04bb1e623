//! Postures without contact where random ones have none or few, as with hands and two arms: in those with the least contact
//! links are moved apart.
//!
//! A pair that has less room than it must is moved by the smallest step that its distance asks for to first order, each
//! joint measured by its range:
//!
//! ```text
//! Δq_j = s_j² (∂d/∂q_j) (need − d) / Σ_k s_k² (∂d/∂q_k)²
//! ```
//!
//! One pair after the other, clamped to the position limits, until all have room (Kaczmarz's method with bounds).

use super::scene::{Balls, Scene, poses};
use crate::robot::{Joint, Robot};
use rayon::prelude::*;

/// Free postures that are enough for a design to begin from.
pub(super) const ENOUGH: usize = 40;
/// Postures that are tried, those with the least contact first, so many at a time.
const TRIED: usize = 320;
const AT_A_TIME: usize = 32;
/// Most rounds over all pairs.
const ROUNDS: usize = 60;
/// Room beyond the margin that a mended posture is to have, m …
const ROOM: f64 = 5e-3;
/// … and least that it must have: a design keeps some of it for what lies between its instants.
pub(super) const LEAST: f64 = 3e-3;
/// Largest step of a joint for one pair, part of its range.
const STEP: f64 = 0.1;

/// A posture that came from another one by moving links apart.
#[derive(Debug, Clone)]
pub(super) struct Mended {
    /// least room of any pair that is looked at, m
    pub(super) room: f64,
    /// what is missing of it over all pairs, m
    pub(super) missing: f64,
    /// positions of all joints
    pub(super) posture: Vec<f64>,
}

impl Mended {
    /// Whether a motion can be about it.
    pub(super) fn free(&self) -> bool {
        self.room >= LEAST
    }
}

/// Mended postures in the order of those that they came from, until enough of them are free. `rooms`: of every posture, pair by pair.
pub(super) fn mended(
    scene: &Scene,
    robot: &Robot,
    postures: &[Vec<f64>],
    rooms: &[Vec<f64>],
) -> Vec<Mended> {
    let contact = |r: &Vec<f64>| -> f64 { r.iter().map(|room| (-room).max(0.0)).sum() };
    let mut order: Vec<(f64, usize)> = (rooms.iter().enumerate())
        .map(|(i, r)| (contact(r), i))
        .filter(|(size, _)| *size > 0.0)
        .collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    order.truncate(TRIED);
    let balls = Balls::new(scene);
    let mut out: Vec<Mended> = Vec::new();
    for some in order.chunks(AT_A_TIME) {
        let found: Vec<Mended> = some
            .par_iter()
            .map(|(_, i)| apart(scene, robot, &balls, &postures[*i]))
            .collect();
        out.extend(found);
        if out.iter().filter(|m| m.free()).count() >= ENOUGH {
            break;
        }
    }
    out
}

/// The posture near this one in which least room is missing.
fn apart(scene: &Scene, robot: &Robot, balls: &Balls, from: &[f64]) -> Mended {
    let ranges: Vec<[f64; 2]> = robot.joints.iter().map(Joint::range).collect();
    let width = |[low, high]: [f64; 2]| high - low;
    let (mut q, mut at, mut slope) = (from.to_vec(), Vec::new(), vec![0.0; from.len()]);
    let mut best = Mended {
        room: f64::NEG_INFINITY,
        missing: f64::INFINITY,
        posture: q.clone(),
    };
    for _ in 0..ROUNDS {
        poses(robot, &q, &mut at);
        let (mut least, mut missing, here) = (f64::INFINITY, 0.0, q.clone());
        for pair in &scene.pairs {
            let far = balls.lower_bound(pair, &at) - pair.margin;
            if far > ROOM {
                least = least.min(far);
                continue;
            }
            let separation = scene.separation(pair, &at);
            let room = separation.distance - pair.margin;
            least = least.min(room);
            if room >= ROOM {
                continue;
            }
            missing += ROOM - room;
            slope.fill(0.0);
            scene.gradient(robot, pair, &separation, &at, &mut slope);
            let scaled = |j: usize| width(ranges[j]).powi(2) * slope[j];
            let size: f64 = (0..q.len()).map(|j| scaled(j) * slope[j]).sum();
            if size <= 0.0 {
                continue;
            }
            // a little beyond, so that an end is reached
            let need = 1.2 * (ROOM - room) + 1e-4;
            for (j, q) in q.iter_mut().enumerate() {
                let most = STEP * width(ranges[j]);
                let step = (scaled(j) * need / size).max(-most).min(most);
                // no clamp: that panics where limits leave no range
                *q = (*q + step).max(ranges[j][0]).min(ranges[j][1]);
            }
        }
        if missing < best.missing {
            best = Mended {
                room: least,
                missing,
                posture: here,
            };
        }
        if missing <= 0.0 {
            break;
        }
    }
    best
}
