//! Feasible starts: random ones, and disturbed copies of the best so far.

use super::information::Evaluation;
use super::limits::ExtremaWork;
use super::path::PathMemory;
use super::restore::restore;
use super::solve::Task;
use crate::dynamics::Samples;
use crate::error::Result;
use crate::robot::{Motion, Robot};
use crate::trajectory::Basis;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Size of a unit step of each joint in `x`: the amplitude that the position range or the
/// velocity limit allows at the base frequency, whichever is less.
pub fn scales(robot: &Robot, period: f64) -> Vec<f64> {
    let omega = std::f64::consts::TAU / period;
    robot
        .joints
        .iter()
        .map(|j| {
            let [low, high] = j.limits.position;
            let free = if j.motion == Motion::Revolute {
                std::f64::consts::PI
            } else {
                0.5
            };
            let half = 0.5 * (high - low);
            let half = if half.is_finite() {
                half.min(2.0 * free)
            } else {
                free
            };
            half.min(j.limits.velocity / omega).max(1e-6)
        })
        .collect()
}

/// Where starts come from. Each has a number, and with it its own stream of random numbers.
pub struct Source<'a> {
    /// the robot
    pub robot: &'a Robot,
    /// parametrisation
    pub basis: &'a Basis,
    /// the problem
    pub task: &'a Task<'a>,
    /// seed of the design
    pub seed: u64,
    /// the first feasible start and the first phase will do
    pub rough: bool,
    /// postures to move about, the more spacious ones first; see [`holding`]
    pub postures: Vec<Vec<f64>>,
}

/// Free numbers of a motion that stands still in a posture.
pub fn standing(basis: &Basis, posture: &[f64]) -> Vec<f64> {
    let h = basis.harmonics.len();
    let each = posture.iter().enumerate();
    each.flat_map(|(j, &q)| basis.parameters(j, &constant(q, h)).as_slice().to_vec())
        .collect()
}

/// Of the postures that the limits along the path know, moved inside the limits of the joints: those in which all limits hold at
/// rest, so that the drives bear the robot there, too. All of them where there is none; none where the start is prescribed.
pub fn holding(task: &Task, basis: &Basis) -> Vec<Vec<f64>> {
    let Some(limits) = task.path.filter(|_| basis.start.is_none()) else {
        return Vec::new();
    };
    let inside = |work: &mut ExtremaWork, posture: &[f64]| -> Vec<f64> {
        let each = posture.iter().enumerate();
        each.map(|(j, &q)| {
            let still = basis.parameters(j, &constant(q, basis.harmonics.len()));
            let used = task.limits.gauge(j, still.as_slice(), work) / INSIDE;
            let rest = task.limits.rest(j);
            rest + (q - rest) / used.max(1.0)
        })
        .collect()
    };
    type Memory = (Samples, PathMemory, ExtremaWork);
    let looked_at = |memory: &mut Memory, posture: &Vec<f64>| {
        let posture = inside(&mut memory.2, posture);
        let still = standing(basis, &posture);
        task.info.sample(&still, &mut memory.0);
        let used = limits.used(task.info, &still, &memory.0, &mut memory.1);
        (used <= 1.0, posture)
    };
    let (mut kept, mut other) = (Vec::new(), Vec::new());
    for some in limits.postures().chunks(KEPT) {
        let found: Vec<(bool, Vec<f64>)> = some
            .par_iter()
            .map_init(Memory::default, looked_at)
            .collect();
        for (holds, posture) in found {
            match holds {
                true => kept.push(posture),
                false => other.push(posture),
            }
        }
        if kept.len() >= KEPT {
            break;
        }
    }
    if kept.is_empty() {
        kept = other;
    }
    kept.truncate(KEPT);
    kept
}

/// Postures to move about that are kept.
const KEPT: usize = 400;
/// A posture uses no more than this of the limits of a joint, so that it can move there.
const INSIDE: f64 = 0.98;

/// Coefficients of a joint that stands still.
fn constant(position: f64, harmonics: usize) -> Vec<f64> {
    let mut c = vec![0.0; 2 * harmonics + 1];
    c[0] = position;
    c
}

impl Source<'_> {
    fn stream(&self, number: usize) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(number as u64 + 1);
        rng
    }

    /// The best of several random trajectories; `None` where none is feasible.
    ///
    /// # Errors
    /// Only when numbers are not finite.
    pub fn random(
        &self,
        number: usize,
        candidates: usize,
        halt: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<Vec<f64>>> {
        let mut rng = self.stream(number);
        let mut e = Evaluation::default();
        let mut best: Option<(f64, Vec<f64>)> = None;
        for _ in 0..candidates {
            if best.is_some() && (self.rough || halt()) {
                break;
            }
            let (x, rest) = self.candidate(&mut rng);
            let moved = match self.crowded() {
                true => restore(self.task, &x, halt)?,
                false => None,
            };
            let Some(x) = moved.or_else(|| self.fit_path(&x, &rest)) else {
                continue;
            };
            let value = self.task.objective.evaluate(self.task.info, &x, &mut e);
            if best.as_ref().is_none_or(|b| value < b.0) {
                best = Some((value, x));
            }
        }
        Ok(best.map(|b| b.1))
    }

    /// A disturbed copy of a feasible trajectory, feasible too.
    ///
    /// # Errors
    /// Only when numbers are not finite.
    pub fn disturbed(
        &self,
        x: &[f64],
        number: usize,
        halt: &(dyn Fn() -> bool + Sync),
    ) -> Result<Vec<f64>> {
        let mut rng = self.stream(number);
        let m = self.basis.free();
        let size = rng.random_range(0.05..0.35);
        let mut next: Vec<f64> = x
            .iter()
            .enumerate()
            .map(|(k, x)| x + size * self.task.scale[k / m] * rng.random_range(-1.0..1.0))
            .collect();
        self.task
            .limits
            .pull_inside(&mut next, &mut ExtremaWork::default());
        let moved = match self.crowded() {
            true => restore(self.task, &next, halt)?,
            false => None,
        };
        let found = moved.or_else(|| self.fit_path(&next, x));
        Ok(found.unwrap_or_else(|| x.to_vec()))
    }

    /// A random trajectory inside the limits of the joints, and the posture that it moves about.
    ///
    /// Amplitudes fall with the harmonic, the middle of the motion lies near the middle of the
    /// range, and the motion of each joint is scaled to the limit that it meets first, times a
    /// random factor.
    fn candidate(&self, rng: &mut ChaCha8Rng) -> (Vec<f64>, Vec<f64>) {
        let (basis, limits) = (self.basis, self.task.limits);
        let (m, h) = (basis.free(), basis.harmonics.len());
        let mut work = ExtremaWork::default();
        let mut x = Vec::with_capacity(self.task.info.len());
        let mut rest = Vec::with_capacity(self.task.info.len());
        let centre = self.centre(rng);
        for (j, joint) in self.robot.joints.iter().enumerate() {
            let scale = self.task.scale[j];
            let half = match joint.limits.position {
                [low, high] if high - low < f64::INFINITY => 0.5 * (high - low),
                _ => scale,
            };
            let mut c = vec![0.0; 2 * h + 1];
            c[0] = match centre {
                Some(posture) => posture[j],
                None => limits.rest(j) + half * rng.random_range(-0.3..0.3),
            };
            for k in 0..h {
                let weight = 1.0 / f64::from(basis.harmonics[k]).sqrt();
                for at in [1 + k, 1 + h + k] {
                    c[at] = scale * weight * rng.random_range(-1.0..1.0);
                }
            }
            let full = basis.parameters(j, &c);
            if centre.is_some() {
                let still = basis.parameters(j, &constant(c[0], h));
                // some joints may move little, so that others have room
                let mut factor = rng.random_range(0.25..0.98);
                let mut own: Vec<f64>;
                loop {
                    own = (0..m)
                        .map(|k| still[k] + factor * (full[k] - still[k]))
                        .collect();
                    if limits.gauge(j, &own, &mut work) <= 1.0 || factor < 1e-6 {
                        break;
                    }
                    factor *= 0.85;
                }
                x.extend(own);
                rest.extend(still.iter());
                continue;
            }
            let gauge = limits.gauge(j, full.as_slice(), &mut work);
            let factor = rng.random_range(0.6..0.98) / gauge.max(1e-9);
            let still = limits.rest_parameters(j);
            x.extend((0..m).map(|k| still[k] + factor * (full[k] - still[k])));
            rest.extend(still);
        }
        (x, rest)
    }

    /// Whether there is anything to touch.
    pub fn crowded(&self) -> bool {
        self.task.path.is_some_and(|p| !p.postures().is_empty())
    }

    /// A posture to move about, where the limits along the path know some; the more spacious ones more often.
    fn centre(&self, rng: &mut ChaCha8Rng) -> Option<&[f64]> {
        let free = &self.postures;
        if free.is_empty() {
            return None;
        }
        let at = rng.random_range(0.0..1.0_f64).powi(2) * free.len() as f64;
        Some(&free[(at as usize).min(free.len() - 1)])
    }

    /// The largest of a few steps from a feasible trajectory towards another that keeps the limits along the path.
    fn fit_path(&self, x: &[f64], from: &[f64]) -> Option<Vec<f64>> {
        let Some(limits) = self.task.path else {
            return Some(x.to_vec());
        };
        let (mut motion, mut memory) = (Samples::default(), PathMemory::default());
        let mut fraction = 1.0;
        for attempt in 0..30 {
            let trial: Vec<f64> = x
                .iter()
                .zip(from)
                .map(|(x, r)| r + fraction * (x - r))
                .collect();
            self.task.info.sample(&trial, &mut motion);
            if limits.used(self.task.info, &trial, &motion, &mut memory) <= 1.0 {
                return Some(trial);
            }
            fraction = if attempt == 28 { 0.0 } else { fraction * 0.8 };
        }
        None
    }
}
