//! How sure it is which joint a column belongs to, and with which sign.

use super::claim::Claim;
use super::search::{Hypothesis, Match, Problem};
use crate::dynamics::Workspace;

/// Blocks of the record, every other one fitted.
const BLOCKS: usize = 16;
/// Standard errors by which an alternative must be worse on held-out blocks.
const SURE: f64 = 3.0;
/// … and nats.
const CLEAR: f64 = 6.0;
/// … for what is stated to be contradicted.
const CONTRADICTS: f64 = 60.0;
/// … and what is then left of some column, in what the statement leaves.
pub(super) const MATERIAL: f64 = 0.5;
/// Least share of a torque column that its joint explains.
pub(super) const SHARE: f64 = 0.5;

/// How sure a hypothesis is, joint by joint.
pub(super) struct Verdict {
    /// whether no other column comes near
    pub joint: Vec<bool>,
    /// whether the turned sign does not, either
    pub sign: Vec<bool>,
    /// signs of all joints that come near, with what speaks against them, nats
    near: Vec<(Vec<f64>, f64)>,
    /// whether all hypotheses that come near give a column of torques to the same joint
    pub torque: Vec<bool>,
}

/// Nats by which a hypothesis may be behind and still be looked at on held-out blocks.
const NEAR: f64 = 60.0;
/// Most of them.
const NEAREST: usize = 48;

/// Hypotheses with any other signs whose score comes near.
fn turned(problem: &Problem, best: &Hypothesis) -> Vec<Hypothesis> {
    let mut ws = Workspace::default();
    let score = problem.score(best, &mut ws);
    let mut near: Vec<(f64, Hypothesis)> = (1..1usize << best.sign.len())
        .map(|bits| {
            let mut h = best.clone();
            for (j, s) in h.sign.iter_mut().enumerate() {
                if bits >> j & 1 == 1 {
                    *s = -*s;
                }
            }
            (problem.score(&h, &mut ws), h)
        })
        .filter(|(s, _)| *s > score - NEAR)
        .collect();
    near.sort_by(|a, b| b.0.total_cmp(&a.0));
    near.truncate(NEAREST);
    near.into_iter().map(|(_, h)| h).collect()
}

impl Verdict {
    /// Compares `best` with its neighbours and with all other optima, on blocks that were not fitted.
    pub fn of(
        problem: &Problem,
        best: &Hypothesis,
        found: &[(f64, Hypothesis)],
        allowed: &dyn Fn(&Hypothesis) -> bool,
        n: usize,
    ) -> Self {
        let mut rivals: Vec<Hypothesis> = Problem::neighbours(best)
            .into_iter()
            .map(|(_, h)| h)
            .filter(|h| allowed(h))
            .collect();
        rivals.extend(found.iter().skip(1).map(|(_, h)| h.clone()));
        // many signs at once: an arm and its mirror image have the same torques
        rivals.extend(turned(problem, best).into_iter().filter(|h| allowed(h)));
        let mut ws = Workspace::default();
        let of = problem.best_joints(best, &mut ws);
        let mut out = Verdict {
            joint: vec![true; n],
            sign: vec![true; n],
            near: vec![(best.sign.clone(), 0.0)],
            torque: vec![true; of.len()],
        };
        for rival in rivals {
            let [gain, error] = margin(problem, best, &rival);
            if clear(gain, error) {
                continue;
            }
            if rival.column == best.column {
                let behind = (gain / error.max(1e-9)).clamp(0.0, 4.0);
                out.near.push((rival.sign.clone(), 0.5 * behind * behind));
            }
            let other = problem.best_joints(&rival, &mut ws);
            for (c, same) in out.torque.iter_mut().enumerate() {
                *same &= other[c] == of[c];
            }
            for j in 0..n {
                out.joint[j] &= rival.column[j] == best.column[j];
                out.sign[j] &= rival.sign[j] == best.sign[j];
            }
        }
        out
    }

    pub fn sure(&self, j: usize) -> bool {
        self.joint[j] && self.sign[j]
    }
}

/// Whether a gain on held-out blocks is beyond doubt.
fn clear(gain: f64, error: f64) -> bool {
    gain > CLEAR && gain > SURE * error
}

/// … and so clearly that `b`, which somebody stated, is contradicted.
pub(super) fn contradicts(problem: &Problem, a: &Hypothesis, b: &Hypothesis) -> bool {
    // friction that is not quite that of the model leaves more than noise, which any hypothesis may fit a little better:
    // a column must be explained far better
    let mut ws = Workspace::default();
    let mut left = |h: &Hypothesis| -> Vec<f64> {
        let all = problem.matches(h, &mut ws);
        let columns = all.first().map_or(0, Vec::len);
        (0..columns)
            .map(|c| 1.0 - all.iter().map(|row| row[c].share).fold(0.0, f64::max))
            .collect()
    };
    let (la, lb) = (left(a), left(b));
    let [gain, error] = margin(problem, a, b);
    la.iter().zip(&lb).any(|(a, b)| *a < MATERIAL * b)
        && gain > CONTRADICTS
        && gain > 2.0 * SURE * error
}

/// Nats by which `a` predicts held-out blocks better than `b`, and their standard error.
fn margin(problem: &Problem, a: &Hypothesis, b: &Hypothesis) -> [f64; 2] {
    let mut ws = Workspace::default();
    let gains: Vec<Vec<f64>> = [false, true]
        .into_iter()
        .map(|odd| {
            let count = problem.count();
            let block = |i: usize| i * BLOCKS / count.max(1);
            let fit: Vec<bool> = (0..count).map(|i| (block(i) % 2 == 1) == odd).collect();
            let side = |h: &Hypothesis, ws: &mut Workspace| {
                let of = problem.best_joints(h, ws);
                problem.losses(h, &fit, &of, ws)
            };
            let (la, lb) = (side(a, &mut ws), side(b, &mut ws));
            let mut out = vec![0.0; BLOCKS];
            for (ra, rb) in la.iter().zip(&lb) {
                let fitted = |r: &Vec<f64>| {
                    r.iter()
                        .zip(&fit)
                        .filter(|(_, f)| **f)
                        .map(|(x, _)| x)
                        .sum::<f64>()
                        / fit.iter().filter(|f| **f).count().max(1) as f64
                };
                // the variance of the better of both on the fitted blocks
                let variance = fitted(ra).min(fitted(rb)).max(1e-300);
                for i in (0..count).filter(|&i| !fit[i]) {
                    // a bounded loss: no single sample decides
                    out[block(i)] +=
                        0.5 * ((rb[i] / variance).min(100.0) - (ra[i] / variance).min(100.0));
                }
            }
            out
        })
        .collect();
    let per: Vec<f64> = (0..BLOCKS).map(|k| gains[0][k] + gains[1][k]).collect();
    let sum: f64 = per.iter().sum();
    let mean = sum / BLOCKS as f64;
    let spread = per.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (BLOCKS - 1) as f64;
    let error = (spread * BLOCKS as f64).sqrt();
    [sum, error]
}

/// One column in as many is turned.
const TURNED: f64 = 5.0;
/// Highest confidence of a sign that the torques do not tell beyond doubt.
const LIKELY_SIGN: f64 = 0.85;

/// Which way a joint's column of positions counts.
pub(super) struct Orientation {
    /// whether the joint is told
    pub known: bool,
    /// whether the torques tell the sign
    pub told: bool,
    pub sign: f64,
    pub confidence: f64,
}

impl Orientation {
    /// That of a column which is named; `told`: the torques tell it as well.
    pub fn stated(told: &bool) -> Self {
        Orientation {
            known: true,
            told: *told,
            sign: 1.0,
            confidence: 0.9,
        }
    }
}

/// The sign of each joint: by the model, or, where turning the positions and the torques together changes nothing that is
/// seen, the one with which fewer columns are turned. Joints that only turn together, as those of an arm and its mirror
/// image, are turned together.
pub(super) fn orientation(
    best: &Hypothesis,
    verdict: &Verdict,
    matches: &[Vec<Match>],
    claims: &[Claim],
    positions: &[usize],
    torques: &[usize],
) -> Vec<Orientation> {
    let n = best.column.len();
    // how many more columns of a joint are as they stand than turned, with its position as it stands
    let usual: Vec<f64> = (0..n)
        .map(|j| {
            let p = positions[best.column[j]];
            let rates = claims.iter().filter(|c| c.of == Some(p)).map(|c| c.sign);
            let mine = (0..torques.len()).filter(|&c| {
                let share = matches[j][c].share;
                share > SHARE && share >= matches.iter().map(|r| r[c].share).fold(0.0, f64::max)
            });
            let gains = mine.map(|c| (matches[j][c].gain * best.sign[j]).signum());
            rates.chain(gains).sum::<f64>() + 1.0
        })
        .collect();
    let odds: Vec<f64> = verdict
        .near
        .iter()
        .map(|(signs, behind)| {
            let turned: f64 = signs.iter().zip(&usual).map(|(s, u)| s * u).sum();
            0.5 * turned * (TURNED - 1.0).ln() - behind
        })
        .collect();
    let most = odds.iter().copied().fold(f64::MIN, f64::max);
    let chosen = odds.iter().position(|o| *o >= most).unwrap_or(0);
    let chosen = &verdict.near[chosen].0;
    (0..n)
        .map(|j| {
            let (mut same, mut all) = (0.0, 0.0);
            for ((signs, _), o) in verdict.near.iter().zip(&odds) {
                let weight = (o - most).exp();
                all += weight;
                same += if signs[j] == chosen[j] { weight } else { 0.0 };
            }
            let told = verdict.sign[j];
            Orientation {
                known: verdict.joint[j],
                told,
                sign: chosen[j],
                confidence: match told {
                    true => 0.95,
                    false => (same / all).clamp(0.5, LIKELY_SIGN),
                },
            }
        })
        .collect()
}

/// Whether some column of torques is explained by a joint.
pub(super) fn explained(matches: &[Vec<Match>], j: usize, torques: &[usize]) -> bool {
    (0..torques.len()).any(|c| {
        matches[j][c].share > SHARE
            && matches[j][c].share >= matches.iter().map(|r| r[c].share).fold(0.0, f64::max)
    })
}
