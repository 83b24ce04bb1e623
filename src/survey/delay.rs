//! How much later than the positions a torque was measured.

use super::kinematics::Smooth;
use super::search::{Hypothesis, Problem};
use crate::dynamics::Workspace;

/// Delays that are tried, s: a torque comes no earlier than the positions.
const FROM: f64 = -0.004;
const STEP: f64 = 0.004;
const COUNT: usize = 18;
/// Least share that a joint explains of a column whose delay is looked for, and that the bodies explain of the rest.
const SHARE: f64 = 0.8;
const RIGID: f64 = 0.4;
/// Nats for each sample by which a delay must be better than none.
const CLEAR: f64 = 0.05;
/// … and one beyond so many seconds that most columns do not share: friction that the model lacks in one joint goes with it a
/// little better.
const ALONE: f64 = 0.35;
const FAR: f64 = 0.02;

/// A signal between its samples, `late` samples after each of `at`.
pub(super) fn at_times(y: &[f64], at: &[usize], late: f64) -> Vec<f64> {
    let last = y.len().saturating_sub(1) as i64;
    let get = |i: i64| y[i.clamp(0, last) as usize];
    at.iter()
        .map(|&i| {
            let x = i as f64 + late;
            let (k, u) = (x.floor() as i64, x - x.floor());
            let [a, b, c, d] = [get(k - 1), get(k), get(k + 1), get(k + 2)];
            // a cubic through the points with the slopes of their neighbours
            let (p, q) = (0.5 * (c - a), 0.5 * (d - b));
            let (e, f) = (2.0 * (b - c) + p + q, 3.0 * (c - b) - 2.0 * p - q);
            ((e * u + f) * u + p) * u + b
        })
        .collect()
}

/// The delay of each column of torques with which its joint explains it best, s; none where that is not clear.
pub(super) fn delays(
    problem: &Problem,
    h: &Hypothesis,
    smooth: &Smooth,
    torques: &[usize],
    at: &[usize],
) -> Vec<f64> {
    let of = problem.best_joints(h, &mut Workspace::default());
    let found: Vec<Option<(f64, f64)>> = torques
        .iter()
        .zip(of)
        .map(|(&k, j)| {
            let lag = |i: f64| (FROM + i * STEP) / smooth.step;
            let other: Vec<Vec<f64>> = (0..COUNT)
                .map(|i| at_times(&smooth.value[k], at, lag(i as f64)))
                .collect();
            let found = problem.shifted(h, j, &other);
            let left: Vec<f64> = found.iter().map(|m| (1.0 - m.share).max(1e-9)).collect();
            let best = (0..COUNT).min_by(|a, b| left[*a].total_cmp(&left[*b]))?;
            let none = (-FROM / STEP).round() as usize;
            let enough = found[best].share > SHARE && found[best].rigid > RIGID;
            let gain = 0.5 * (left[none] / left[best]).ln();
            if !enough || gain <= CLEAR || best == 0 || best + 1 == COUNT {
                return None;
            }
            let (a, b, c) = (left[best - 1], left[best], left[best + 1]);
            let bend = a - 2.0 * b + c;
            let between = if bend > 0.0 {
                0.5 * (a - c) / bend
            } else {
                0.0
            };
            Some((FROM + STEP * (best as f64 + between.clamp(-0.5, 0.5)), gain))
        })
        .collect();
    let alike = |late: f64| {
        let close = found.iter().flatten().filter(|f| (f.0 - late).abs() < STEP);
        2 * close.count() > found.len()
    };
    let clear = |&(late, gain): &(f64, f64)| late < FAR || gain > ALONE || alike(late);
    let of = |f: &Option<(f64, f64)>| f.filter(clear).map_or(0.0, |(late, _)| late);
    found.iter().map(of).collect()
}
