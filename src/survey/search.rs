//! Which column is which joint's, by the torques of the nominal model.
//!
//! A **hypothesis** gives each joint a column of positions and a sign. It predicts the rigid torques `τ_j` and the weight
//! alone `g_j` of every joint at some samples. A column `y` of torques or currents of that joint is then
//!
//! ```text
//! y = c (τ_j + I_a q̈_j + F_v q̇_j + F_c sign q̇_j + o) + noise      or the same without g_j
//! ```
//!
//! with a gain `c` of either sign, and friction that never drives: `F_v, F_c` have the sign of `c`. The **score** of a
//! hypothesis is the sum over columns of `−K/2 ln(1 − R²)` of the joint that explains each best. Swaps of two joints and
//! turned signs are tried until none is better, from the stated order and from random ones.

use crate::dynamics::{Samples, Workspace};
use crate::plant::Plant;
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Unknowns beside the gain: offset, inertia of the rotor, viscous and Coulomb friction.
const OWN: usize = 4;
/// Highest share that counts, so that no column of a perfect model outweighs all others.
const MOST: f64 = 0.999;

/// Signals at some samples: `[column][sample]`.
pub(super) struct Signals {
    /// positions of the candidates in rad or m, their velocities and accelerations
    pub q: Vec<Vec<f64>>,
    pub qd: Vec<Vec<f64>>,
    pub qdd: Vec<Vec<f64>>,
    /// columns of torques or currents
    pub y: Vec<Vec<f64>>,
}

/// Each joint's column of positions and its sign.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Hypothesis {
    pub column: Vec<usize>,
    pub sign: Vec<f64>,
}

/// How a joint explains a column of torques.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Match {
    /// share explained, of the column's variance
    pub share: f64,
    /// share that the rigid torque explains of what friction and offset leave
    pub rigid: f64,
    /// gain `c`: column for each N m
    pub gain: f64,
    /// whether the weight is missing in it
    pub weightless: bool,
}

/// Samples with what does not depend on the hypothesis.
pub(super) struct Problem<'a> {
    plant: &'a Plant,
    phi: Vec<f64>,
    signals: &'a Signals,
    count: usize,
    /// orthonormal columns of the own terms of each candidate
    own: Vec<Vec<Vec<f64>>>,
    /// what they leave of each column of torques, `[candidate][column]`, and the sign of the friction in it
    rest: Vec<Vec<(Vec<f64>, f64, f64)>>,
    total: Vec<f64>,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn without(x: &[f64], basis: &[Vec<f64>]) -> Vec<f64> {
    let mut out = x.to_vec();
    for b in basis {
        let c = dot(&out, b);
        out.iter_mut().zip(b).for_each(|(o, b)| *o -= c * b);
    }
    out
}

impl<'a> Problem<'a> {
    pub fn new(plant: &'a Plant, signals: &'a Signals) -> Self {
        let count = signals.q.first().map_or(0, Vec::len);
        let mut own = Vec::new();
        for p in 0..signals.q.len() {
            let v = &signals.qd[p];
            let usual = (dot(v, v) / count.max(1) as f64).sqrt();
            let columns: [Vec<f64>; OWN] = [
                vec![1.0; count],
                signals.qdd[p].clone(),
                v.clone(),
                // friction turns over smoothly where the sign of a filtered velocity is not known
                v.iter()
                    .map(|x| (x / (0.05 * usual).max(1e-12)).tanh())
                    .collect(),
            ];
            let mut basis: Vec<Vec<f64>> = Vec::new();
            // one joint alone: its inertia is the model's, which gives the gain
            let alone = signals.q.len() == 1;
            for (which, c) in columns.into_iter().enumerate() {
                if alone && which == 1 {
                    continue;
                }
                let rest = without(&without(&c, &basis), &basis);
                let (norm, whole) = (dot(&rest, &rest).sqrt(), dot(&c, &c).sqrt());
                if norm > 1e-9 * whole.max(1e-300) {
                    basis.push(rest.iter().map(|x| x / norm).collect());
                }
            }
            own.push(basis);
        }
        let mean = vec![vec![1.0 / (count.max(1) as f64).sqrt(); count]];
        let total = signals
            .y
            .iter()
            .map(|y| {
                let r = without(y, &mean);
                dot(&r, &r)
            })
            .collect();
        let rest = own
            .iter()
            .enumerate()
            .map(|(p, basis)| {
                signals
                    .y
                    .iter()
                    .map(|y| {
                        // drag: how the column goes with the velocity
                        let v = without(&signals.qd[p], &mean);
                        let drag = dot(y, &v);
                        let size = (dot(&v, &v) * dot(y, y)).sqrt();
                        (without(y, basis), drag, drag.abs() / size.max(1e-300))
                    })
                    .collect()
            })
            .collect();
        Problem {
            phi: plant
                .robot()
                .bodies
                .iter()
                .flat_map(|b| b.inertia.0)
                .collect(),
            plant,
            signals,
            count,
            own,
            rest,
            total,
        }
    }

    /// The motion that a hypothesis says, and the torques of the model: rigid, and weight alone.
    fn torques(&self, h: &Hypothesis, ws: &mut Workspace) -> [Vec<f64>; 2] {
        let (n, m) = (h.column.len(), self.count);
        let mut motion = Samples::zeros(n, m);
        for j in 0..n {
            let (p, s) = (h.column[j], h.sign[j]);
            for i in 0..m {
                motion.q[j * m + i] = s * self.signals.q[p][i];
                motion.qd[j * m + i] = s * self.signals.qd[p][i];
                motion.qdd[j * m + i] = s * self.signals.qdd[p][i];
            }
        }
        let mut rigid = vec![0.0; n * m];
        self.plant
            .tree()
            .inverse_dynamics(ws, &self.phi, &motion, &mut rigid);
        motion.qd.fill(0.0);
        motion.qdd.fill(0.0);
        let mut weight = vec![0.0; n * m];
        self.plant
            .tree()
            .inverse_dynamics(ws, &self.phi, &motion, &mut weight);
        [rigid, weight]
    }

    /// How every joint explains every column, `[joint][column]`.
    pub fn matches(&self, h: &Hypothesis, ws: &mut Workspace) -> Vec<Vec<Match>> {
        let m = self.count;
        let [rigid, weight] = self.torques(h, ws);
        (0..h.column.len())
            .map(|j| {
                let p = h.column[j];
                let full = &rigid[j * m..(j + 1) * m];
                let light: Vec<f64> = full
                    .iter()
                    .zip(&weight[j * m..])
                    .map(|(a, b)| a - b)
                    .collect();
                let sides = [without(full, &self.own[p]), without(&light, &self.own[p])];
                (0..self.signals.y.len())
                    .map(|c| {
                        let (rest, drag, share_drag) = &self.rest[p][c];
                        let left = dot(rest, rest);
                        // what friction and offset explain alone, with the sign with which they brake
                        let mut best = Match {
                            share: 1.0 - left / self.total[c].max(1e-300),
                            gain: drag * h.sign[j],
                            ..Match::default()
                        };
                        for (k, side) in sides.iter().enumerate() {
                            let (xx, xy) = (dot(side, side), dot(side, rest));
                            if !(xx > 1e-9 * dot(full, full)) || !(left > 0.0) {
                                continue;
                            }
                            let gain = xy / xx;
                            // friction that drives is none: with this sign the column is not explained
                            let drives = gain * h.sign[j] * drag < 0.0 && *share_drag > 0.2;
                            let rigid = if drives { 0.0 } else { xy * xy / (xx * left) };
                            if rigid > best.rigid {
                                best = Match {
                                    share: 1.0 - left * (1.0 - rigid) / self.total[c].max(1e-300),
                                    rigid,
                                    gain,
                                    weightless: k == 1,
                                };
                            }
                        }
                        best
                    })
                    .collect()
            })
            .collect()
    }

    /// Share of each column that its best joint explains.
    pub fn shares(&self, h: &Hypothesis) -> Vec<f64> {
        let all = self.matches(h, &mut Workspace::default());
        (0..self.signals.y.len())
            .map(|c| all.iter().map(|row| row[c].share).fold(0.0, f64::max))
            .collect()
    }

    /// Number of samples.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The joint that explains each column best.
    pub fn best_joints(&self, h: &Hypothesis, ws: &mut Workspace) -> Vec<usize> {
        let all = self.matches(h, ws);
        (0..self.signals.y.len())
            .map(|c| {
                (0..all.len())
                    .max_by(|a, b| all[*a][c].share.total_cmp(&all[*b][c].share))
                    .unwrap_or(0)
            })
            .collect()
    }

    /// Score of a hypothesis, nats.
    pub fn score(&self, h: &Hypothesis, ws: &mut Workspace) -> f64 {
        let all = self.matches(h, ws);
        (0..self.signals.y.len())
            .map(|c| {
                let best = all.iter().map(|row| row[c].share).fold(0.0, f64::max);
                -0.5 * self.count as f64 * (1.0 - best.min(MOST)).ln()
            })
            .sum()
    }

    /// What one sample-wise loss each column leaves under a hypothesis: the squares of the residual of the best joint,
    /// with coefficients from the samples of `fit`, relative to the variance there.
    pub fn losses(
        &self,
        h: &Hypothesis,
        fit: &[bool],
        of: &[usize],
        ws: &mut Workspace,
    ) -> Vec<Vec<f64>> {
        let m = self.count;
        let [rigid, weight] = self.torques(h, ws);
        of.iter()
            .enumerate()
            .map(|(c, &j)| {
                let p = h.column[j];
                let y = &self.signals.y[c];
                let full = &rigid[j * m..(j + 1) * m];
                let light: Vec<f64> = full
                    .iter()
                    .zip(&weight[j * m..])
                    .map(|(a, b)| a - b)
                    .collect();
                [full, &light[..]]
                    .into_iter()
                    .map(|side| residual(y, &self.own[p], side, fit))
                    .min_by(|a, b| {
                        let sum = |r: &Vec<f64>| {
                            r.iter()
                                .zip(fit)
                                .filter(|(_, f)| **f)
                                .map(|(x, _)| x * x)
                                .sum::<f64>()
                        };
                        sum(a).total_cmp(&sum(b))
                    })
                    .unwrap_or_default()
                    .into_iter()
                    .map(|x| x * x)
                    .collect()
            })
            .collect()
    }

    /// Hypotheses that differ from `h` by one step: a sign, or two joints changed for one another with any signs.
    pub fn neighbours(h: &Hypothesis) -> Vec<(Vec<usize>, Hypothesis)> {
        let n = h.column.len();
        let mut out = Vec::new();
        for i in 0..n {
            let mut one = h.clone();
            one.sign[i] = -one.sign[i];
            out.push((vec![i], one));
            for j in 0..i {
                for (a, b) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
                    let mut two = h.clone();
                    two.column.swap(i, j);
                    two.sign[i] = a;
                    two.sign[j] = b;
                    out.push((vec![i, j], two));
                }
            }
        }
        out
    }

    /// Climbs to a hypothesis that no neighbour betters.
    fn climb(
        &self,
        mut h: Hypothesis,
        fits: &(dyn Fn(&Hypothesis) -> bool + Sync),
    ) -> (f64, Hypothesis) {
        let mut ws = Workspace::default();
        let mut score = self.score(&h, &mut ws);
        for _ in 0..60 {
            let next = Self::neighbours(&h)
                .into_iter()
                .filter(|(_, n)| fits(n))
                .map(|(_, n)| (self.score(&n, &mut ws), n))
                .max_by(|a, b| a.0.total_cmp(&b.0));
            match next {
                Some((s, n)) if s > score + 1e-9 => (score, h) = (s, n),
                _ => break,
            }
        }
        (score, h)
    }

    /// The best hypothesis that `fits` allows, from `stated` and from random orders; all local optima with their scores.
    pub fn search(
        &self,
        stated: &Hypothesis,
        random_starts: usize,
        fits: &(dyn Fn(&Hypothesis) -> bool + Sync),
    ) -> Vec<(f64, Hypothesis)> {
        let mut starts = vec![stated.clone()];
        let mut random = ChaCha8Rng::seed_from_u64(7);
        for _ in 0..random_starts {
            let mut h = stated.clone();
            h.column.shuffle(&mut random);
            h.sign
                .iter_mut()
                .for_each(|s| *s = if random.random_bool(0.5) { 1.0 } else { -1.0 });
            starts.push(h);
        }
        let mut found: Vec<(f64, Hypothesis)> = starts
            .into_par_iter()
            .map(|h| self.climb(h, fits))
            .collect();
        // what is stated may be beyond a limit; what was found may not
        found.retain(|(_, h)| fits(h) || h == stated);
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        found.dedup_by(|a, b| a.1 == b.1);
        found
    }
}

/// What own terms and a rigid torque leave of a column, with coefficients from the samples of `fit`.
fn residual(y: &[f64], own: &[Vec<f64>], side: &[f64], fit: &[bool]) -> Vec<f64> {
    let mask = |x: &[f64]| -> Vec<f64> {
        x.iter()
            .zip(fit)
            .map(|(x, f)| if *f { *x } else { 0.0 })
            .collect()
    };
    // Gram-Schmidt on the fitted samples, carried along on all
    let mut basis: Vec<(Vec<f64>, Vec<f64>)> = Vec::new();
    let columns = own.iter().map(Vec::as_slice).chain([side]);
    for column in columns {
        let mut whole = column.to_vec();
        for _ in 0..2 {
            let part = mask(&whole);
            for (b, all) in &basis {
                let c = dot(&part, b);
                whole.iter_mut().zip(all).for_each(|(w, a)| *w -= c * a);
            }
        }
        let part = mask(&whole);
        let norm = dot(&part, &part).sqrt();
        if norm > 1e-9 * dot(column, column).sqrt().max(1e-300) {
            basis.push((
                part.iter().map(|x| x / norm).collect(),
                whole.iter().map(|x| x / norm).collect(),
            ));
        }
    }
    let mut rest = y.to_vec();
    for (b, all) in &basis {
        let c = dot(&mask(&rest), b);
        rest.iter_mut().zip(all).for_each(|(r, a)| *r -= c * a);
    }
    rest
}
