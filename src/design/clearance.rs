//! Clearances of a tree at samples of a period, and their linearisation.
//!
//! A pair of volumes with margin `m` keeps `d(q(t)) ≥ m`. Around a motion `x̄` the row of a pair at an instant is
//!
//! ```text
//! d̄ + Σ_j (∂d/∂q_j) B_j(t) δ_j ≥ m + ε            ∂d/∂q_j = nᵀ (∂b/∂q_j − ∂a/∂q_j)
//! ```
//!
//! with the exact gradient at the nearest points, and `ε` for what happens between the samples; the certificate
//! that ends a design proves the rest. Samples at which a pair cannot be near, because it was far from it a
//! moment ago, are passed over.

use super::information::{Evaluation, Information};
use super::path::{PathLimits, PathMemory, PathRow};
use crate::collision::Scene;
use crate::collision::clearance::reaches;
use crate::collision::scene::{Balls, append_poses};
use crate::dynamics::Samples;
use crate::robot::Robot;
use crate::solid::{Pose, Separation};
use crate::trajectory::{Basis, Table};
use nalgebra::Vector3;
use std::sync::Arc;

/// Samples a period for each harmonic.
const SAMPLES: usize = 80;
/// Room kept for what happens between the samples, m.
const BETWEEN: f64 = 2e-3;
/// Pairs nearer than this beyond their margin get rows, m.
const NEAR: f64 = 0.04;
/// … and a row at every few samples where they are nearer than this, m.
const TIGHT: f64 = 0.012;
/// Samples between two rows of that kind.
const SPACING: usize = 8;
/// Of this many samples the first look takes one.
const COARSE: usize = 10;
/// A use of `1 + 1` stands for this much too near, m.
const UNIT: f64 = 0.05;

/// Clearances of a tree.
pub(super) struct ClearanceLimits<'a> {
    scene: Arc<Scene>,
    balls: Balls,
    /// pairs of the same two links
    groups: Vec<Vec<usize>>,
    /// pairs whose exact distance is expensive
    iterates: Vec<bool>,
    robot: &'a Robot,
    /// `N × m`: positions at the samples from the free numbers of a joint, sample by sample
    rows: Vec<f64>,
    free: usize,
    count: usize,
    rest: Vec<f64>,
    /// largest change of the distance of each pair between two samples, m
    change: Vec<f64>,
    /// least distance of each pair, m
    need: Vec<f64>,
}

/// Indices of the pairs of the same two names.
fn groups(scene: &Scene) -> Vec<Vec<usize>> {
    let mut by_names: std::collections::BTreeMap<[&str; 2], Vec<usize>> = Default::default();
    for (p, pair) in scene.pairs.iter().enumerate() {
        by_names.entry(scene.names(pair)).or_default().push(p);
    }
    by_names.into_values().collect()
}

/// A pair at an instant.
struct Instant {
    pair: usize,
    sample: usize,
    separation: Separation,
}

impl<'a> ClearanceLimits<'a> {
    /// Of a robot with finite limits; `tighter` below 1 asks for more room.
    pub fn new(
        scene: Arc<Scene>,
        robot: &'a Robot,
        basis: &Basis,
        period: f64,
        tighter: f64,
    ) -> Self {
        let most = basis.harmonics.iter().copied().max().unwrap_or(1) as usize;
        let count = (SAMPLES * most).clamp(200, 4000);
        let table = Table::new(period, &basis.harmonics, count);
        let design = table.design(0) * &basis.map;
        let free = basis.free();
        let rows = (0..count)
            .flat_map(|i| (0..free).map(move |k| (i, k)))
            .map(|at| design[at])
            .collect();
        let largest: Vec<f64> = (robot.joints.iter())
            .map(|j| j.limits.position[0].abs().max(j.limits.position[1].abs()))
            .collect();
        let step = period / count as f64;
        let change = scene.pairs.iter().map(|pair| {
            let rho = reaches(robot, &scene, pair, &largest);
            let joints = robot.joints.iter().zip(rho);
            let moving = joints.filter(|(_, r)| *r > 0.0);
            step * moving.map(|(j, r)| j.limits.velocity * r).sum::<f64>()
        });
        let change = change.collect();
        let extra = BETWEEN + 0.05 * (1.0 - tighter);
        // no more than half of what a pair can have: one that turns about a vertical axis keeps its height
        let more = |p: usize| scene.most.get(p).map_or(extra, |m| extra.min(0.5 * m));
        let need = scene.pairs.iter().enumerate();
        let need = need.map(|(p, pair)| pair.margin + more(p)).collect();
        ClearanceLimits {
            robot,
            rows,
            free,
            count,
            rest: basis.offset.iter().map(|o| o[0]).collect(),
            change,
            need,
            balls: Balls::new(&scene),
            groups: groups(&scene),
            iterates: scene.pairs.iter().map(|p| scene.iterates(p)).collect(),
            scene,
        }
    }

    fn row(&self, sample: usize) -> &[f64] {
        &self.rows[sample * self.free..(sample + 1) * self.free]
    }

    /// Poses of all bodies at every `stride`-th sample, sample by sample.
    fn along(&self, x: &[f64], stride: usize) -> Vec<Pose> {
        let mut q = vec![0.0; self.rest.len()];
        let mut out = Vec::with_capacity(self.count * self.robot.bodies.len());
        for i in (0..self.count).step_by(stride) {
            let row = self.row(i);
            for (j, q) in q.iter_mut().enumerate() {
                let own = &x[j * self.free..(j + 1) * self.free];
                *q = self.rest[j] + row.iter().zip(own).map(|(r, x)| r * x).sum::<f64>();
            }
            append_poses(self.robot, &q, &mut out);
        }
        out
    }

    fn at<'p>(&self, along: &'p [Pose], sample: usize) -> &'p [Pose] {
        let n = self.robot.bodies.len();
        &along[sample * n..(sample + 1) * n]
    }

    /// Room of a pair at a sample, or a lower bound of it that is more than `far`; `axis` is the direction along
    /// which the two were last found apart.
    fn room(&self, p: usize, at: &[Pose], far: f64, axis: &mut Vector3<f64>) -> f64 {
        let pair = &self.scene.pairs[p];
        let need = self.need[p];
        let bound = self.balls.lower_bound(pair, at) - need;
        if bound > far {
            return bound;
        }
        if !self.iterates[p] {
            return self.scene.separation(pair, at).distance - need;
        }
        if *axis != Vector3::zeros() {
            let bound = self.scene.gap_along(pair, at, axis) - need;
            if bound > far {
                return bound;
            }
        }
        let found = self.scene.separation(pair, at);
        *axis = found.normal;
        found.distance - need
    }

    /// Least room over all pairs and samples, where it is negative, else something positive; ends at the first
    /// that is below `enough`. Pairs are looked at from `first` on.
    fn least(&self, along: &[Pose], enough: f64, first: usize) -> (f64, usize, usize) {
        let pairs = self.scene.pairs.len();
        let samples = along.len() / self.robot.bodies.len().max(1);
        // of every so many samples one
        let stride = (self.count / samples.max(1)).max(1);
        let mut least = (f64::INFINITY, 0, 0);
        for k in 0..pairs {
            let p = (first + k) % pairs;
            let mut axis = Vector3::zeros();
            let mut i = 0;
            while i < samples {
                let room = self.room(p, self.at(along, i), 0.0, &mut axis);
                if room < least.0 {
                    least = (room, p, i * stride);
                    if room < enough {
                        return least;
                    }
                }
                i += self.skip(p, room).div_ceil(stride);
            }
        }
        least
    }

    /// Samples after which the room of a pair can be gone.
    fn skip(&self, pair: usize, room: f64) -> usize {
        let change = self.change[pair];
        match room > 0.0 && change > 0.0 {
            true => ((room / change) as usize).clamp(1, self.count),
            false if change == 0.0 => self.count,
            false => 1,
        }
    }

    /// Pairs at the instants where they are near: local minima over time of the nearest volumes of two links, and
    /// some of the instants where these are very near.
    fn near(&self, along: &[Pose], from: f64, tight: f64) -> Vec<Instant> {
        let mut out = Vec::new();
        let mut rooms = vec![(f64::INFINITY, 0); self.count];
        for group in &self.groups {
            rooms.fill((f64::INFINITY, 0));
            for &p in group {
                let mut axis = Vector3::zeros();
                let mut i = 0;
                while i < self.count {
                    let room = self.room(p, self.at(along, i), from, &mut axis);
                    if room < rooms[i].0 {
                        rooms[i] = (room, p);
                    }
                    i += self.skip(p, room - from);
                }
            }
            let mut last = usize::MAX;
            for i in 0..self.count {
                let (here, pair) = rooms[i];
                let before = rooms[(i + self.count - 1) % self.count].0;
                let after = rooms[(i + 1) % self.count].0;
                let lowest = here <= before && here < after;
                let spaced = last == usize::MAX || i >= last + SPACING;
                if here < from && (lowest || here < tight && spaced) {
                    last = i;
                    let separation = self
                        .scene
                        .separation(&self.scene.pairs[pair], self.at(along, i));
                    out.push(Instant {
                        pair,
                        sample: i,
                        separation,
                    });
                }
            }
        }
        out
    }

    /// `∂d/∂x` of an instant.
    fn gradient(&self, at: &Instant, poses: &[Pose]) -> Vec<f64> {
        let mut by_joint = vec![0.0; self.rest.len()];
        let pair = &self.scene.pairs[at.pair];
        self.scene
            .gradient(self.robot, pair, &at.separation, poses, &mut by_joint);
        let row = self.row(at.sample);
        by_joint
            .iter()
            .flat_map(|g| row.iter().map(move |r| g * r))
            .collect()
    }
}

impl PathLimits for ClearanceLimits<'_> {
    fn used(&self, _: &Information, x: &[f64], _: &Samples, memory: &mut PathMemory) -> f64 {
        let mut room = 0.0;
        // a few samples show most of what is broken, and the pair that was in the way is so again
        for stride in [COARSE, 1] {
            let (least, pair, _) = self.least(&self.along(x, stride), 0.0, memory.pair);
            room = least;
            if room < 0.0 {
                memory.pair = pair;
                break;
            }
        }
        1.0 - room / UNIT
    }

    fn rows(&self, _: &Information, x: &[f64], _: &mut Evaluation, _: f64) -> Vec<PathRow> {
        let along = self.along(x, 1);
        let near = self.near(&along, NEAR, TIGHT);
        near.iter()
            .map(|at| PathRow {
                gradient: self
                    .gradient(at, self.at(&along, at.sample))
                    .iter()
                    .map(|g| -g)
                    .collect(),
                slack: at.separation.distance - self.need[at.pair],
            })
            .collect()
    }

    fn cuts(&self, _: &Information, x: &[f64], next: &[f64]) -> Vec<PathRow> {
        let along = self.along(next, 1);
        let broken = self.near(&along, 0.0, 0.0);
        broken
            .iter()
            .map(|at| {
                // around the step that is refused: d̄ + g·(x + δ − x̄) ≥ need
                let g = self.gradient(at, self.at(&along, at.sample));
                let moved: f64 = (g.iter().zip(x).zip(next))
                    .map(|((g, x), n)| g * (x - n))
                    .sum();
                PathRow {
                    slack: at.separation.distance - self.need[at.pair] + moved,
                    gradient: g.iter().map(|g| -g).collect(),
                }
            })
            .collect()
    }

    fn broken(&self, _: &Information, x: &[f64], _: &Samples) -> String {
        let (room, pair, _) = self.least(&self.along(x, 1), f64::NEG_INFINITY, 0);
        let pair = &self.scene.pairs[pair.min(self.scene.pairs.len() - 1)];
        match room < 0.0 {
            true => {
                let [a, b] = self.scene.names(pair);
                format!(
                    "{a} and {b} are {:.3} m closer than the margin of {} m allows",
                    -room, pair.margin
                )
            }
            false => String::new(),
        }
    }

    fn postures(&self) -> &[Vec<f64>] {
        &self.scene.free
    }
}
