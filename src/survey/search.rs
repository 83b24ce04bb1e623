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

use super::own::{Along, KINDS, Own, residual};
use crate::dot::dot;
use crate::dynamics::{Samples, Workspace};
use crate::plant::Plant;
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Highest share that counts, so that no column of a perfect model outweighs all others.
const MOST: f64 = 0.999;

/// What a torque without weight leaves, of what one with weight does, for weight to be missing.
const WEIGHTLESS: f64 = 0.7;

/// Starts at a time, and how many of them must end in the best order for no more to be tried.
const BATCH: usize = 24;
const AGREE: usize = 4;

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
    /// gain `c`: column for each N m; where the rigid torque explains nothing, only its sign, that of friction, counts
    pub gain: f64,
    /// whether the weight is missing in it
    pub weightless: bool,
    /// which friction there is, a number of [`KINDS`]
    kind: usize,
    /// the rigid torque, 0 as a whole, 1 without weight, and 2 none
    side: usize,
}

/// Samples with what does not depend on the hypothesis.
pub(super) struct Problem<'a> {
    plant: &'a Plant,
    phi: Vec<f64>,
    signals: &'a Signals,
    count: usize,
    /// own terms of each candidate
    own: Vec<Own>,
    /// each column of torques along them, `[candidate][column]`
    along: Vec<Vec<Along>>,
    total: Vec<f64>,
}

impl<'a> Problem<'a> {
    pub fn new(plant: &'a Plant, signals: &'a Signals) -> Self {
        let count = signals.q.first().map_or(0, Vec::len);
        // one joint alone: its inertia is the model's, which gives the gain
        let alone = signals.q.len() == 1;
        let own: Vec<Own> = signals
            .qd
            .iter()
            .zip(&signals.qdd)
            .map(|(v, a)| Own::new(v, a, alone))
            .collect();
        let total = signals.y.iter().map(|y| spread(y)).collect();
        let along = own
            .iter()
            .map(|o| signals.y.iter().map(|y| o.along(y)).collect())
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
            along,
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
                let full = &rigid[j * m..(j + 1) * m];
                let light: Vec<f64> = full
                    .iter()
                    .zip(&weight[j * m..])
                    .map(|(a, b)| a - b)
                    .collect();
                let own = &self.own[h.column[j]];
                let sides = [full, &light[..]].map(|x| (x, own.along(x)));
                (0..self.signals.y.len())
                    .map(|c| {
                        let along = &self.along[h.column[j]][c];
                        let y = (&self.signals.y[c][..], along, self.total[c]);
                        explain(own, h.sign[j], &sides, y)
                    })
                    .collect()
            })
            .collect()
    }

    /// How its best joint explains a column of torques at each of some other samples of it, `[which]`.
    pub fn shifted(&self, h: &Hypothesis, j: usize, other: &[Vec<f64>]) -> Vec<Match> {
        let m = self.count;
        let [rigid, weight] = self.torques(h, &mut Workspace::default());
        let full = &rigid[j * m..(j + 1) * m];
        let pairs = full.iter().zip(&weight[j * m..]);
        let light: Vec<f64> = pairs.map(|(a, b)| a - b).collect();
        let own = &self.own[h.column[j]];
        let sides = [full, &light[..]].map(|x| (x, own.along(x)));
        let of = |y: &Vec<f64>| {
            let y = (&y[..], &own.along(y), spread(y));
            explain(own, h.sign[j], &sides, y)
        };
        other.iter().map(of).collect()
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
    /// with coefficients from the samples of `fit`.
    pub fn losses(
        &self,
        h: &Hypothesis,
        fit: &[bool],
        of: &[usize],
        ws: &mut Workspace,
    ) -> Vec<Vec<f64>> {
        let m = self.count;
        let all = self.matches(h, ws);
        let [rigid, weight] = self.torques(h, ws);
        of.iter()
            .enumerate()
            .map(|(c, &j)| {
                let y = &self.signals.y[c];
                let found = &all[j][c];
                let full = &rigid[j * m..(j + 1) * m];
                let side: Option<Vec<f64>> = match found.side {
                    0 => Some(full.to_vec()),
                    1 => Some(
                        full.iter()
                            .zip(&weight[j * m..])
                            .map(|(a, b)| a - b)
                            .collect(),
                    ),
                    _ => None,
                };
                residual(
                    y,
                    &self.own[h.column[j]].basis(found.kind),
                    side.as_deref(),
                    fit,
                )
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
        // until several of them have ended in the best
        let mut found: Vec<(f64, Hypothesis)> = Vec::new();
        for batch in starts.chunks(BATCH) {
            found.par_extend(batch.to_vec().into_par_iter().map(|h| self.climb(h, fits)));
            let best = found.iter().map(|f| f.0).fold(f64::MIN, f64::max);
            if found.iter().filter(|f| f.0 > best - 1e-6).count() > AGREE {
                break;
            }
        }
        // what is stated may be beyond a limit; what was found may not
        found.retain(|(_, h)| fits(h) || h == stated);
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        found.dedup_by(|a, b| a.1 == b.1);
        found
    }
}

/// Squares about the mean.
pub(super) fn spread(y: &[f64]) -> f64 {
    let mean = y.iter().sum::<f64>() / y.len().max(1) as f64;
    y.iter().map(|x| (x - mean) * (x - mean)).sum()
}

/// How a joint explains a column: its own terms and sign, its rigid torque as a whole and without weight, and the column
/// with its square about the mean.
fn explain(
    own: &Own,
    sign: f64,
    sides: &[(&[f64], Along); 2],
    (values, y, total): (&[f64], &Along, f64),
) -> Match {
    let mut best = Match {
        side: 2,
        kind: KINDS.len() - 1,
        ..Match::default()
    };
    // friction and offset alone
    let mut alone = f64::INFINITY;
    for kind in 0..KINDS.len() {
        let [v, f] = own.friction(kind, y, &Along::default(), 0.0);
        let left = y.left(kind).max(0.0);
        if v * f >= 0.0 && left < alone {
            alone = left;
            best.gain = (v + f).signum() * sign * f64::MIN_POSITIVE;
            best.kind = kind;
        }
    }
    let mut left = alone;
    let mut bound = alone;
    let least = 1e-9 * sides[0].1.square();
    for (k, (side, x)) in sides.iter().enumerate() {
        let product = dot(side, values);
        for kind in 0..KINDS.len() {
            let xx = x.left(kind);
            if !(xx > least) {
                continue;
            }
            let xy = product - x.shared(y, kind);
            let gain = xy / xx;
            let after = (y.left(kind) - gain * xy).max(0.0);
            // that weight is missing must show
            if after >= left || k == 1 && after >= bound {
                continue;
            }
            // friction brakes: it has the sign of the gain
            let [v, f] = own.friction(kind, y, x, gain);
            let with = gain * sign;
            if v * with < 0.0 || f * with < 0.0 {
                continue;
            }
            left = after;
            best.gain = gain;
            best.weightless = k == 1;
            (best.kind, best.side) = (kind, k);
        }
        bound = WEIGHTLESS * left;
    }
    best.share = 1.0 - left / total.max(1e-300);
    best.rigid = 1.0 - left / alone.max(1e-300);
    best
}
