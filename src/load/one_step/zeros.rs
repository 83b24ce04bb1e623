//! Constant forces of the drives, decided by the data: shared by all records, drifting from one to the next, or free.
//!
//! The fit has an offset `o_{a,r}` of every actuator `a` in every record `r`. Six constants along the legs of a hexapod
//! imitate a weight, so that much of the load is lost where they are free; but zeros do move. Between records they walk,
//!
//! ```text
//! d_{a,r} = o_{a,r+1} − o_{a,r} ~ N(0, τ²)
//! ```
//!
//! The estimates `d̂` of the free fit, with their covariance `V`, are all that the records tell of `τ`:
//! `d̂ ~ N(0, V + τ²)`, the restricted likelihood, in which the load is no longer present. It is averaged over a grid of
//! `τ`, half of whose weight lies at zero before the data are seen. A drive whose change the others do not lead to expect
//! is left free. With the changes `A β` of all parameters `β` of the fit and their covariance `C`, each `τ` gives
//!
//! ```text
//! β_τ = β̂ − C Aᵀ (V + τ²)⁻¹ d̂        C_τ = C − C Aᵀ (V + τ²)⁻¹ A C        V = A C Aᵀ
//! ```
//!
//! and the result is their mean by likelihood; its covariance counts their spread, too.

use super::solver::{Solution, Solver};
use faer::Mat;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// What the records say of the constant force of one actuator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Zero {
    /// the same in all records
    Shared,
    /// walks from record to record like those of the others
    Drifting,
    /// changed by more than the others lead to expect: one constant for each record
    Free,
}

impl Zero {
    /// In a word.
    pub fn word(self) -> &'static str {
        match self {
            Zero::Shared => "shared",
            Zero::Drifting => "drifting",
            Zero::Free => "free",
        }
    }
}

/// The decision for one actuator.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Decision {
    /// what was decided
    pub kind: Zero,
    /// standard deviation of the change between records that counts, N m or N; `None` where it is free
    pub drift: Option<f64>,
    /// change from each record to the next as it would be with free offsets, N m or N
    pub changes: Vec<f64>,
    /// standard deviations of these
    pub changes_std: Vec<f64>,
}

/// Points of the grid of `τ` beside zero, each a factor of [`FINE`] above the one before.
const POINTS: i32 = 30;
/// Least `τ` of the grid, in smallest standard deviations of `d̂`.
const LEAST: f64 = 0.1;
/// Step of the grid.
const FINE: f64 = 1.4;
/// A change is not like the others' beyond this many standard deviations.
const UNLIKE: f64 = 4.0;

/// Changes that were seen, and how they depend on the parameters.
struct Changes {
    /// `d̂`
    seen: DVector<f64>,
    /// `V`
    spread: DMatrix<f64>,
    /// actuator of each
    actuator: Vec<usize>,
    /// `τ` of the grid
    grid: Vec<f64>,
}

/// A value of `τ` with the changes that it is for.
struct Hypothesis {
    tau: f64,
    likelihood: f64,
    factor: Cholesky<f64, Dyn>,
}

impl Changes {
    /// Likelihood of every `τ` for the changes in `rows`; `None` where the covariance is none.
    fn hypotheses(&self, rows: &[usize]) -> Option<Vec<Hypothesis>> {
        let n = rows.len();
        let seen = DVector::from_fn(n, |i, _| self.seen[rows[i]]);
        let mut out = Vec::new();
        for &tau in &self.grid {
            let sum = DMatrix::from_fn(n, n, |i, j| {
                self.spread[(rows[i], rows[j])] + if i == j { tau * tau } else { 0.0 }
            });
            let factor = sum.cholesky()?;
            let log_det: f64 = factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
            let cost = log_det + 0.5 * seen.dot(&factor.solve(&seen));
            let before = match tau == 0.0 {
                true => 0.5,
                false => 0.5 / f64::from(POINTS),
            };
            out.push(Hypothesis {
                tau,
                likelihood: f64::ln(before) - cost,
                factor,
            });
        }
        let most = out
            .iter()
            .map(|h| h.likelihood)
            .fold(f64::NEG_INFINITY, f64::max);
        out.iter_mut()
            .for_each(|h| h.likelihood = (h.likelihood - most).exp());
        let sum: f64 = out.iter().map(|h| h.likelihood).sum();
        out.iter_mut().for_each(|h| h.likelihood /= sum);
        sum.is_finite().then_some(out)
    }

    /// How far the changes of an actuator are from what those of the others lead to expect, in standard deviations.
    fn unlike(&self, rows: &[usize], actuator: usize) -> Option<f64> {
        let (own, others): (Vec<usize>, Vec<usize>) =
            rows.iter().partition(|&&r| self.actuator[r] == actuator);
        if others.len() < 2 {
            return None;
        }
        let all = self.hypotheses(&others)?;
        let n = others.len();
        let seen = DVector::from_fn(n, |i, _| self.seen[others[i]]);
        let mut furthest = 0.0f64;
        for r in own {
            let cross = DVector::from_fn(n, |i, _| self.spread[(others[i], r)]);
            let (mut mean, mut square) = (0.0, 0.0);
            for h in &all {
                let gain = h.factor.solve(&cross);
                let m = gain.dot(&seen);
                let v = self.spread[(r, r)] + h.tau * h.tau - gain.dot(&cross);
                mean += h.likelihood * m;
                square += h.likelihood * (m * m + v);
            }
            let std = (square - mean * mean).max(1e-300).sqrt();
            furthest = furthest.max((self.seen[r] - mean).abs() / std);
        }
        Some(furthest)
    }
}

/// Changes of the offsets between records, from the free fit; `None` with a single record, or where nothing is known.
fn changes(solver: &Solver, s: &Solution, c: &Mat<f64>) -> Option<(Changes, DMatrix<f64>)> {
    let (records, na) = (solver.system.parts.len(), solver.system.actuators);
    if records < 2 {
        return None;
    }
    let pairs: Vec<[usize; 3]> = (0..na)
        .flat_map(|a| (1..records).map(move |r| [a, solver.offset(r - 1, a), solver.offset(r, a)]))
        .collect();
    let (n, m) = (s.values.len(), pairs.len());
    let seen = DVector::from_fn(m, |i, _| s.values[pairs[i][2]] - s.values[pairs[i][1]]);
    // C Aᵀ
    let ca = DMatrix::from_fn(n, m, |r, i| c[(r, pairs[i][2])] - c[(r, pairs[i][1])]);
    let spread = DMatrix::from_fn(m, m, |i, j| {
        let one = |j: usize, i: usize| ca[(pairs[i][2], j)] - ca[(pairs[i][1], j)];
        0.5 * (one(j, i) + one(i, j))
    });
    let least = spread
        .clone()
        .symmetric_eigenvalues()
        .iter()
        .fold(f64::INFINITY, |a, b| a.min(*b));
    if !(least > 0.0) || !seen.iter().all(|x| x.is_finite()) {
        return None;
    }
    let mut grid = vec![0.0];
    grid.extend((0..POINTS).map(|k| LEAST * least.sqrt() * FINE.powi(k)));
    Some((
        Changes {
            seen,
            spread,
            actuator: pairs.iter().map(|p| p[0]).collect(),
            grid,
        },
        ca,
    ))
}

/// Decides for every actuator and moves the solution and its covariance accordingly. Empty with a single record.
pub fn decide(solver: &Solver, s: &mut Solution, c: &mut Mat<f64>) -> Vec<Decision> {
    let na = solver.system.actuators;
    let Some((changes, ca)) = changes(solver, s, c) else {
        return Vec::new();
    };
    let m = changes.seen.len();
    let mut rows: Vec<usize> = (0..m).collect();
    let mut free = vec![false; na];
    // at most half of the drives are unlike the rest
    for _ in 0..na / 2 {
        let furthest = (0..na)
            .filter(|&a| !free[a])
            .filter_map(|a| Some((changes.unlike(&rows, a)?, a)))
            .max_by(|x, y| x.0.total_cmp(&y.0));
        match furthest {
            Some((far, a)) if far > UNLIKE => {
                free[a] = true;
                rows.retain(|&r| changes.actuator[r] != a);
            }
            _ => break,
        }
    }
    let Some(all) = changes.hypotheses(&rows) else {
        return Vec::new();
    };
    apply(s, c, &changes, &ca, &rows, &all);
    s.residual = solver.residual(&s.values);
    let square: f64 = all.iter().map(|h| h.likelihood * h.tau * h.tau).sum();
    let shared = all[0].likelihood >= 0.5;
    (0..na)
        .map(|a| {
            let own = (0..m).filter(|&i| changes.actuator[i] == a);
            Decision {
                kind: match (free[a], shared) {
                    (true, _) => Zero::Free,
                    (_, true) => Zero::Shared,
                    _ => Zero::Drifting,
                },
                drift: (!free[a]).then_some(square.sqrt()),
                changes: own.clone().map(|i| changes.seen[i]).collect(),
                changes_std: own.map(|i| changes.spread[(i, i)].sqrt()).collect(),
            }
        })
        .collect()
}

/// Mean over `τ`, and the covariance with the spread of the means.
fn apply(
    s: &mut Solution,
    c: &mut Mat<f64>,
    changes: &Changes,
    ca: &DMatrix<f64>,
    rows: &[usize],
    all: &[Hypothesis],
) {
    let (n, k) = (s.values.len(), rows.len());
    let seen = DVector::from_fn(k, |i, _| changes.seen[rows[i]]);
    let ca = DMatrix::from_fn(n, k, |r, i| ca[(r, rows[i])]);
    let steps: Vec<DVector<f64>> = all.iter().map(|h| -(&ca * h.factor.solve(&seen))).collect();
    let mut mean = DVector::<f64>::zeros(n);
    for (h, step) in all.iter().zip(&steps) {
        mean += h.likelihood * step;
    }
    let mut change = DMatrix::<f64>::zeros(n, n);
    for (h, step) in all.iter().zip(&steps) {
        let away = step - &mean;
        change.ger(h.likelihood, &away, &away, 1.0);
        let gain = h.factor.solve(&ca.transpose());
        change.gemm(-h.likelihood, &ca, &gain, 1.0);
    }
    for (value, step) in s.values.iter_mut().zip(mean.iter()) {
        *value += step;
    }
    for i in 0..n {
        for j in 0..n {
            c[(i, j)] += 0.5 * (change[(i, j)] + change[(j, i)]);
        }
    }
}
