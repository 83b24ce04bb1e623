//! Limits of a closed chain along a motion of its platform: position, velocity, acceleration, jerk
//! and force of the actuators, cones of the passive joints, margins from both singularities,
//! distances between legs. Along a motion of its actuators, whose own limits are those of their
//! series ([`Limits`](super::limits::Limits)): forces, the workspace box of the platform, and the same
//! limits of its pose.
//!
//! ```text
//! q = F(x)    q̇ = D ẋ    q̈ = D ẍ + F_xx[ẋ, ẋ]
//! ∂q̇/∂x, ∂q̈/∂x: Geometry::sensitivity    ∂q̇/∂ẋ = ∂q̈/∂ẍ = D    ∂q̈/∂ẋ = 2 ∂q̇/∂x
//! ```
//!
//! are linearised exactly, forces by the adjoint product of the mechanism, jerk as the difference
//! of accelerations at neighbouring samples, and what depends on the pose alone by central
//! differences.

use super::information::{Evaluation, Information};
use super::path::{PathLimits, PathMemory, PathRow, ROOM};
use crate::dynamics::Samples;
use crate::mechanism::Mechanism;

/// Room kept at the samples for what happens between them, as a fraction of the limit.
const BETWEEN: f64 = 0.006;
/// Step of the central differences of a pose, m or rad.
const STEP: f64 = 1e-6;
/// A row is kept where a use peaks in time, and wherever it is above this.
const TIGHT: f64 = 0.96;

/// A limit of a coordinate of the tree on its position, velocity, acceleration or jerk, or of an
/// actuator on its force.
#[derive(Debug, Clone, Copy)]
struct Band {
    /// coordinate of the tree
    joint: usize,
    /// the actuator that it is, of a force
    actuator: usize,
    /// 0 position, 1 velocity, 2 acceleration, 3 jerk, 4 force
    order: usize,
    /// `use = |value − middle| / half`
    middle: f64,
    half: f64,
}

/// The limits of a mechanism.
pub(super) struct MechanismLimits<'a> {
    mechanism: &'a Mechanism,
    bands: Vec<Band>,
    /// coordinates of the tree that are the pose, where the series are not those of the pose
    platform: Vec<usize>,
    pairs: Vec<(usize, usize)>,
    /// time between samples, s
    step: f64,
    /// what may be used of a pose's limits
    derate: f64,
}

impl<'a> MechanismLimits<'a> {
    /// Limits times `derate` (positions keep the middle of their range), at `count` samples of a
    /// period.
    pub fn new(mechanism: &'a Mechanism, derate: f64, period: f64, count: usize) -> Self {
        let mut bands = Vec::new();
        let platform = match mechanism.follows() {
            Some(_) => mechanism.platform_rows(),
            None => Vec::new(),
        };
        let given = mechanism.task_joints();
        let box_of = &mechanism.platform().workspace;
        let limits = |&j: &usize| mechanism.robot.joints[j].limits;
        let actuators = mechanism.actuated.iter().map(|j| (*j, limits(j)));
        let follows = platform.iter().zip(box_of).map(|(j, l)| (*j, *l));
        for (i, (joint, l)) in actuators.chain(follows).enumerate() {
            let [low, high] = l.position;
            let series = given.iter().position(|&j| j == joint);
            // the series keeps its own limits for all time
            let kept = |order: usize| {
                series.is_some_and(|k| {
                    let [from, to] = mechanism.workspace[k].position;
                    (1..4).contains(&order) || order == 0 && low <= from && to <= high
                })
            };
            let mut add = |order: usize, middle: f64, half: f64| {
                if half.is_finite() && middle.is_finite() && !kept(order) {
                    let half = half * derate * (1.0 - BETWEEN);
                    bands.push(Band {
                        joint,
                        actuator: i,
                        order,
                        middle,
                        half,
                    });
                }
            };
            // a range with one end is a range of 100 m or rad
            let (low, high) = match (low.is_finite(), high.is_finite()) {
                (true, false) => (low, low + 100.0),
                (false, true) => (high - 100.0, high),
                _ => (low, high),
            };
            add(0, 0.5 * (low + high), 0.5 * (high - low));
            for (order, limit) in [
                (1, l.velocity),
                (2, l.acceleration),
                (3, l.jerk),
                (4, l.effort),
            ] {
                add(order, 0.0, limit);
            }
        }
        MechanismLimits {
            mechanism,
            bands,
            platform,
            pairs: mechanism.pairs(),
            step: period / count as f64,
            derate,
        }
    }

    /// Value of a band at every sample; `memory` holds the motion and the forces.
    fn values(&self, band: &Band, memory: &PathMemory, out: &mut Vec<f64>) {
        let tree = &memory.mechanism.motion.tree;
        let n = tree.count;
        let at = band.joint * n;
        out.clear();
        match band.order {
            0 => out.extend_from_slice(&tree.q[at..at + n]),
            1 => out.extend_from_slice(&tree.qd[at..at + n]),
            2 => out.extend_from_slice(&tree.qdd[at..at + n]),
            3 => out.extend(
                (0..n).map(|s| (tree.qdd[at + (s + 1) % n] - tree.qdd[at + s]) / self.step),
            ),
            _ => {
                let at = band.actuator * n;
                let half = memory.tau.len() / 2;
                // Coulomb friction with whichever sign is worse
                out.extend((at..at + n).map(|k| {
                    let tau = memory.tau[k];
                    tau + tau.signum() * memory.tau[half + k]
                }));
            }
        }
    }

    /// Motion and forces of all samples into the memory; false where the motion cannot be made.
    fn evaluate(&self, motion: &Samples, memory: &mut PathMemory) -> bool {
        if self
            .mechanism
            .evaluate_motion(&mut memory.mechanism, motion)
            .is_err()
        {
            return false;
        }
        if self.bands.iter().any(|b| b.order == 4) {
            self.mechanism
                .smooth_force(&mut memory.mechanism, &mut memory.tau);
        }
        true
    }

    /// Pose at sample `s` of a motion that is in the memory.
    fn pose(&self, motion: &Samples, memory: &PathMemory, s: usize) -> Vec<f64> {
        let n = motion.count;
        match self.platform.is_empty() {
            true => (0..motion.dof).map(|k| motion.q[k * n + s]).collect(),
            false => {
                let tree = &memory.mechanism.motion.tree;
                self.platform.iter().map(|j| tree.q[j * n + s]).collect()
            }
        }
    }

    /// Uses of all limits of the pose at sample `s`.
    fn pose_uses(&self, x: &[f64]) -> Vec<f64> {
        let uses = self.mechanism.platform().pose_uses(x, &self.pairs);
        let room = self.derate * (1.0 - BETWEEN);
        uses.iter().map(|u| u.used() / room).collect()
    }

    /// Rows of the actuators.
    fn band_rows(
        &self,
        info: &Information,
        motion: &Samples,
        memory: &mut PathMemory,
        from: f64,
        rows: &mut Vec<PathRow>,
    ) {
        let (n, m) = (motion.count, motion.dof);
        let na = self.mechanism.actuators();
        let near: Vec<Vec<(usize, f64)>> = {
            let mut values = Vec::new();
            self.bands
                .iter()
                .map(|b| {
                    self.values(b, memory, &mut values);
                    let signed = values.iter().map(|v| (v - b.middle) / b.half);
                    peaks(&signed.collect::<Vec<_>>(), from)
                })
                .collect()
        };
        if near.iter().all(Vec::is_empty) {
            return;
        }
        let dof = self.mechanism.robot.dof();
        let size = dof * m * n;
        let [mut d, mut dqd, mut dqdd] = [vec![0.0; size], vec![0.0; size], vec![0.0; size]];
        let isa = memory.mechanism.tree.isa();
        let any = |force: bool| {
            let mut all = self.bands.iter().zip(&near);
            all.any(|(b, near)| (b.order == 4) == force && !near.is_empty())
        };
        if any(false) {
            self.mechanism
                .geometry()
                .sensitivity(isa, motion, &mut d, &mut dqd, &mut dqdd);
        }
        if any(true) {
            // one vector for each actuator, with a unit rate of it
            let mut rates = vec![0.0; na * na * n];
            for a in 0..na {
                rates[(a * na + a) * n..(a * na + a + 1) * n].fill(1.0);
            }
            let done = self.mechanism.nominal_gradients(
                &mut memory.mechanism,
                na,
                motion,
                &rates,
                &mut memory.task,
            );
            if done.is_err() {
                return;
            }
        }
        let row = |a: &[f64], j: usize, s: usize, f: f64| -> Vec<f64> {
            (0..m).map(|k| f * a[(j * m + k) * n + s]).collect()
        };
        let none = vec![0.0; m];
        let acceleration = |j: usize, s: usize| {
            let (x, xd) = (row(&dqdd, j, s, 1.0), row(&dqd, j, s, 2.0));
            info.pull_back(s, [&x, &xd, &row(&d, j, s, 1.0)])
        };
        for (band, near) in self.bands.iter().zip(near) {
            let j = band.joint;
            for (s, signed) in near {
                let mut gradient = match band.order {
                    0 => info.pull_back(s, [&row(&d, j, s, 1.0), &none, &none]),
                    1 => {
                        let x = row(&dqd, j, s, 1.0);
                        info.pull_back(s, [&x, &row(&d, j, s, 1.0), &none])
                    }
                    2 => acceleration(j, s),
                    3 => {
                        let mut next = acceleration(j, (s + 1) % n);
                        let here = acceleration(j, s);
                        next.iter_mut()
                            .zip(here)
                            .for_each(|(a, b)| *a = (*a - b) / self.step);
                        next
                    }
                    _ => {
                        let t = &memory.task;
                        let at = |g: &[f64]| -> Vec<f64> {
                            (0..m).map(|k| g[(band.actuator * m + k) * n + s]).collect()
                        };
                        info.pull_back(s, [&at(&t.x), &at(&t.xd), &at(&t.xdd)])
                    }
                };
                let f = signed.signum() / band.half;
                gradient.iter_mut().for_each(|g| *g *= f);
                rows.push(PathRow {
                    gradient,
                    slack: 1.0 - ROOM - signed.abs(),
                });
            }
        }
    }

    /// Rows of what depends on the pose alone.
    fn pose_rows(
        &self,
        info: &Information,
        motion: &Samples,
        memory: &PathMemory,
        from: f64,
        rows: &mut Vec<PathRow>,
    ) {
        let (n, m) = (motion.count, motion.dof);
        let uses: Vec<Vec<f64>> = (0..n)
            .map(|s| self.pose_uses(&self.pose(motion, memory, s)))
            .collect();
        let kinds = uses.first().map_or(0, Vec::len);
        let mut wanted: Vec<Vec<usize>> = vec![Vec::new(); n];
        for k in 0..kinds {
            let along: Vec<f64> = uses.iter().map(|u| u[k]).collect();
            for (s, _) in peaks(&along, from) {
                wanted[s].push(k);
            }
        }
        let none = vec![0.0; m];
        for (s, wanted) in wanted.iter().enumerate() {
            if wanted.is_empty() {
                continue;
            }
            let x = self.pose(motion, memory, s);
            let mut slopes = vec![vec![0.0; m]; kinds];
            for k in 0..m {
                let shifted = |h: f64| {
                    let mut y = x.clone();
                    y[k] += h;
                    self.pose_uses(&y)
                };
                let (up, down) = (shifted(STEP), shifted(-STEP));
                for (slope, (u, d)) in slopes.iter_mut().zip(up.iter().zip(&down)) {
                    slope[k] = (u - d) / (2.0 * STEP);
                }
            }
            if !self.platform.is_empty() {
                // ∂x/∂q_a: rows of D
                let d = &memory.mechanism.motion.d;
                for slope in &mut slopes {
                    let along = |i: usize| {
                        let rows = self.platform.iter().zip(slope.iter());
                        rows.map(|(j, g)| g * d[(j * m + i) * n + s]).sum()
                    };
                    *slope = (0..m).map(along).collect();
                }
            }
            for &k in wanted {
                if slopes[k].iter().all(|g| g.is_finite()) {
                    rows.push(PathRow {
                        gradient: info.pull_back(s, [&slopes[k], &none, &none]),
                        slack: 1.0 - ROOM - uses[s][k],
                    });
                }
            }
        }
    }

    /// Largest use of a band by the motion in the memory, and which.
    fn bands_used(&self, memory: &PathMemory) -> (f64, usize) {
        let mut most = (0.0, 0);
        let mut values = Vec::new();
        for (i, band) in self.bands.iter().enumerate() {
            self.values(band, memory, &mut values);
            for v in &values {
                let used = (v - band.middle).abs() / band.half;
                if used > most.0 {
                    most = (used, i);
                }
            }
        }
        most
    }

    /// Largest use, and of what.
    fn worst(&self, motion: &Samples, memory: &mut PathMemory) -> (f64, String) {
        if !self.evaluate(motion, memory) {
            let why = self.mechanism.motion(motion).err();
            return (f64::INFINITY, why.map_or(String::new(), |e| e.to_string()));
        }
        let (used, at) = self.bands_used(memory);
        let mut worst = (used, String::new());
        if let Some(band) = self.bands.get(at) {
            const WHAT: [&str; 5] = ["position", "velocity", "acceleration", "jerk", "force"];
            let joint = &self.mechanism.robot.joints[band.joint];
            worst.1 = format!("{} of {}", WHAT[band.order], joint.name);
        }
        for s in 0..motion.count {
            let x = self.pose(motion, memory, s);
            for (k, used) in self.pose_uses(&x).into_iter().enumerate() {
                if used > worst.0 || used.is_nan() {
                    let uses = self.mechanism.platform().pose_uses(&x, &self.pairs);
                    worst = (used, uses[k].name.clone());
                }
            }
        }
        worst
    }
}

/// Where the magnitude of a use peaks in (cyclic) time above `from`, or is nearly 1: sample and
/// use.
fn peaks(used: &[f64], from: f64) -> Vec<(usize, f64)> {
    let n = used.len();
    (0..n)
        .filter(|&s| {
            let u = used[s].abs();
            let (before, after) = (used[(s + n - 1) % n].abs(), used[(s + 1) % n].abs());
            u > from && (u > TIGHT || (u >= before && u >= after))
        })
        .map(|s| (s, used[s]))
        .collect()
}

impl PathLimits for MechanismLimits<'_> {
    fn used(
        &self,
        _info: &Information,
        _: &[f64],
        motion: &Samples,
        memory: &mut PathMemory,
    ) -> f64 {
        if !self.evaluate(motion, memory) {
            return f64::INFINITY;
        }
        let mut most = self.bands_used(memory).0;
        if most > 1.0 {
            return most;
        }
        for s in 0..motion.count {
            for used in self.pose_uses(&self.pose(motion, memory, s)) {
                most = most.max(used);
            }
        }
        most
    }

    fn rows(&self, info: &Information, _: &[f64], e: &mut Evaluation, from: f64) -> Vec<PathRow> {
        let mut memory = PathMemory::default();
        let mut rows = Vec::new();
        if !self.evaluate(&e.motion, &mut memory) {
            return rows;
        }
        let from = from.min(0.7);
        self.band_rows(info, &e.motion, &mut memory, from, &mut rows);
        self.pose_rows(info, &e.motion, &memory, from, &mut rows);
        rows
    }

    fn broken(&self, _info: &Information, _: &[f64], motion: &Samples) -> String {
        match self.worst(motion, &mut PathMemory::default()) {
            (used, why) if used.is_infinite() => why,
            (used, what) if used > 1.0 => {
                format!("{what} is at {:.0} % of its limit", 100.0 * used)
            }
            _ => String::new(),
        }
    }
}
