//! Which unknowns a robot, its postures and a measurement can tell apart.
//!
//! Singular values of the Jacobian of the whitened residuals in columns scaled by the tolerances, without any prior.
//! The null space is written with one leading unknown a direction: what it is confounded with, and how much.
//! Directions led by an unknown of the set-up are **gauge** freedoms: another choice of frames, not an error of the
//! robot. Observability indices (Borm & Menq 1991; Driels & Pathre 1990; Nahvi & Hollerbach 1996; Sun & Hollerbach
//! 2008) of the singular values `s_1 ≥ … ≥ s_r` and `n` rows:
//!
//! ```text
//! O1 = (s_1 … s_r)^(1/r) / √n    O2 = s_r / s_1    O3 = s_r    O4 = s_r² / s_1    O5 = 1 / Σ 1/s_i
//! ```

use super::fit::Plan;
use super::model::Model;
use super::unknown::Part;
use crate::error::{Error, Result};
use faer::Mat;

/// Singular values below this fraction of the largest count as zero, unless a clear gap lies elsewhere.
const ZERO: f64 = 1e-9;
/// A gap of this factor, below [`SMALL`], is the border of the rank.
const CLEAR: f64 = 1e3;
/// Fraction of the largest singular value below which a gap is looked for.
const SMALL: f64 = 1e-6;
/// Share of a confounded unknown that is worth a word.
const WORD: f64 = 0.05;

/// A direction that nothing tells.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Confounded {
    /// the leading unknown
    pub parameter: String,
    /// the others of the direction and their changes when the leading one changes by one, in their units
    pub with: Vec<(String, f64)>,
    /// whether it is a choice of frames
    pub gauge: bool,
}

/// What can be told.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Identifiability {
    /// number of independent combinations
    pub rank: usize,
    /// number of unknowns
    pub total: usize,
    /// ratio of the singular values at the border of the rank
    pub gap: f64,
    /// singular values, largest first
    pub singular_values: Vec<f64>,
    /// directions that nothing tells
    pub confounded: Vec<Confounded>,
    /// O1 to O5
    pub observability: [f64; 5],
}

impl Identifiability {
    /// Gauge freedoms in words.
    pub fn gauge(&self) -> Vec<String> {
        let apart = |name: &str| match name.rsplit_once('.') {
            Some((of, what)) => format!("{of} {what}"),
            None => name.to_string(),
        };
        let words = |c: &Confounded| {
            let name = apart(&c.parameter);
            match c.with.first() {
                Some((other, _)) => format!("{name} against {}", apart(other)),
                None => format!("{name} alone"),
            }
        };
        self.confounded
            .iter()
            .filter(|c| c.gauge)
            .map(words)
            .collect()
    }
}

/// Of the rows and unknowns of a plan, at `x`.
///
/// # Errors
/// A posture that cannot be taken, singular values that do not converge.
pub fn assess(model: &Model, plan: &Plan, x: &[f64]) -> Result<Identifiability> {
    let columns: Vec<usize> = (0..model.count()).filter(|&k| plan.free[k]).collect();
    let place: Vec<Option<usize>> = (0..model.count())
        .map(|k| columns.iter().position(|&c| c == k))
        .collect();
    let mut lines: Vec<Vec<f64>> = Vec::new();
    let mut counted = 0;
    let mut push = |b: &super::model::Block| {
        for i in 0..b.r.len() {
            let mut line = vec![0.0; columns.len()];
            for (k, &c) in b.columns.iter().enumerate() {
                if let Some(at) = place[c] {
                    line[at] += b.j[(i, k)] * model.unknowns[c].scale;
                }
            }
            lines.push(line);
        }
    };
    for i in (0..plan.weights.len()).filter(|&i| plan.weights[i] > 0.0) {
        let block = model.block(i, x).ok_or_else(|| {
            Error::Infeasible("a posture cannot be taken by the robot of the file".into())
        })?;
        push(&block);
        counted += 1;
    }
    model.distances(x).iter().for_each(&mut push);
    // no fewer lines than columns, so that the null space is complete
    while lines.len() < columns.len() {
        lines.push(vec![0.0; columns.len()]);
    }
    let j = Mat::from_fn(lines.len(), columns.len(), |i, k| lines[i][k]);
    let r = j.qr().thin_R().to_owned();
    let failed = || Error::Infeasible("singular values did not converge".into());
    let svd = r.svd().map_err(|_| failed())?;
    let s: Vec<f64> = (0..columns.len()).map(|k| svd.S()[k]).collect();
    let rank = rank(&s);
    let top = s.first().copied().unwrap_or(0.0).max(f64::MIN_POSITIVE);
    let below = s.get(rank).copied().unwrap_or(0.0).max(1e-16 * top);
    let gap = match rank {
        0 => 1.0,
        r => s[r - 1] / below,
    };
    let v = svd.V();
    let mut null: Vec<Vec<f64>> = (rank..columns.len())
        .map(|d| (0..columns.len()).map(|k| v[(k, d)]).collect())
        .collect();
    let confounded = echelon(&mut null, model, &columns);
    let kept = &s[..rank];
    let (n, r) = (counted.max(1) as f64, rank.max(1) as f64);
    let (first, last) = (top, kept.last().copied().unwrap_or(0.0));
    let logs: f64 = kept.iter().map(|s| s.ln()).sum();
    Ok(Identifiability {
        rank,
        total: columns.len(),
        gap,
        confounded,
        observability: [
            (logs / r).exp() / n.sqrt(),
            last / first,
            last,
            last * last / first,
            1.0 / kept
                .iter()
                .map(|s| 1.0 / s)
                .sum::<f64>()
                .max(f64::MIN_POSITIVE),
        ],
        singular_values: s,
    })
}

/// Rank from descending singular values.
fn rank(s: &[f64]) -> usize {
    let top = s.first().copied().unwrap_or(0.0);
    if !(top > 0.0) {
        return 0;
    }
    let below = |r: usize| s.get(r).copied().unwrap_or(0.0).max(1e-16 * top);
    (1..s.len())
        .find(|&r| below(r) <= SMALL * top && s[r - 1] / below(r) >= CLEAR)
        .unwrap_or_else(|| s.iter().filter(|v| **v > ZERO * top).count())
}

/// Which unknowns lead: the set-up first, then the robot from the tip to the base.
fn order(part: Part) -> usize {
    match part {
        Part::Camera => 0,
        Part::Target | Part::Grip => 1,
        Part::Socket | Part::Plane => 2,
        _ => 3,
    }
}

/// Reduced echelon form of the null space in scaled unknowns.
fn echelon(null: &mut [Vec<f64>], model: &Model, columns: &[usize]) -> Vec<Confounded> {
    let mut all = Vec::new();
    let mut led: Vec<usize> = Vec::new();
    for d in 0..null.len() {
        // the unknown of the first part in which this direction is more than a trace
        let mut best: Option<(usize, usize, f64)> = None;
        for o in 0..4 {
            #[allow(clippy::needless_range_loop)]
            for row in d..null.len() {
                for (k, &c) in columns.iter().enumerate() {
                    let size = null[row][k].abs();
                    let fits = order(model.unknowns[c].part) == o && !led.contains(&k);
                    if fits && size > 0.05 && best.is_none_or(|b| size > b.2 * 1.000001) {
                        best = Some((row, k, size));
                    }
                }
            }
            if best.is_some() {
                break;
            }
        }
        let Some((row, k, _)) = best else { break };
        null.swap(d, row);
        let pivot = null[d][k];
        null[d].iter_mut().for_each(|v| *v /= pivot);
        let lead = null[d].clone();
        for (other, line) in null.iter_mut().enumerate() {
            let f = line[k];
            if other != d && f != 0.0 {
                line.iter_mut().zip(&lead).for_each(|(a, b)| *a -= f * b);
            }
        }
        led.push(k);
    }
    for (line, &k) in null.iter().zip(&led) {
        let own = &model.unknowns[columns[k]];
        let mut with: Vec<(usize, f64)> = (0..columns.len())
            .filter(|&o| o != k && line[o].abs() > WORD)
            .map(|o| (o, line[o]))
            .collect();
        with.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        let name = |o: usize| model.unknowns[columns[o]].name.clone();
        all.push(Confounded {
            parameter: own.name.clone(),
            gauge: !own.of_robot(),
            with: with
                .into_iter()
                .map(|(o, f)| (name(o), f * model.unknowns[columns[o]].scale / own.scale))
                .collect(),
        });
    }
    all
}
