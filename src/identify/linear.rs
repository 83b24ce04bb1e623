//! Least squares on whitened rows, compressed by blocks to triangular factors.
//!
//! Whitened rows are never held all at once: chunks of samples are weighted and factored on all
//! threads, and the small factors are factored together (tall-skinny QR). Of
//! `[W τ] = Q [[R, r], [0, ρ]]` the factor `[R r; 0 ρ]` says everything about the fit.

use super::stack::Stack;
use crate::error::{Error, Result};
use faer::{ColRef, Mat, MatMut, MatRef, Side};
use rayon::prelude::*;

/// How the rows of a sample are weighted.
#[derive(Debug, Clone)]
pub enum Weights {
    /// the same matrix `L⁻¹` (of the covariance `L Lᵀ`) for every sample
    Same(Mat<f64>),
    /// one for each sample of each record
    Each(Vec<Vec<Mat<f64>>>),
}

impl Weights {
    /// The matrix of a sample of a record.
    pub fn at(&self, record: usize, k: usize) -> MatRef<'_, f64> {
        match self {
            Weights::Same(m) => m.as_ref(),
            Weights::Each(all) => all[record][k].as_ref(),
        }
    }

    /// Each row alone, divided by its standard deviation.
    pub fn diagonal(sigma: &[f64]) -> Self {
        Weights::Same(Mat::from_fn(sigma.len(), sigma.len(), |i, j| {
            if i == j {
                1.0 / sigma[i].max(1e-300)
            } else {
                0.0
            }
        }))
    }

    /// From a covariance between actuators.
    pub fn covariance(c: MatRef<'_, f64>) -> Self {
        Weights::Same(inverse_root(c))
    }
}

/// `L⁻¹` of a covariance `L Lᵀ`, which is regularised where it is nearly singular.
pub fn inverse_root(c: MatRef<'_, f64>) -> Mat<f64> {
    let n = c.nrows();
    let mean = (0..n).map(|i| c[(i, i)]).sum::<f64>() / n.max(1) as f64;
    let mut l = Mat::<f64>::zeros(n, n);
    for i in 0..n {
        for j in 0..=i {
            let mut s = c[(i, j)];
            for k in 0..j {
                s -= l[(i, k)] * l[(j, k)];
            }
            if i == j {
                let least = 1e-6 * c[(i, i)].abs() + 1e-18 * mean + 1e-300;
                l[(i, i)] = s.max(least).sqrt();
            } else {
                l[(i, j)] = s / l[(j, j)];
            }
        }
    }
    // invert the lower triangle
    let mut inverse = Mat::<f64>::zeros(n, n);
    for j in 0..n {
        for i in j..n {
            let mut s = if i == j { 1.0 } else { 0.0 };
            for k in j..i {
                s -= l[(i, k)] * inverse[(k, j)];
            }
            inverse[(i, j)] = s / l[(i, i)];
        }
    }
    inverse
}

/// Weighted rows `[W τ]` of samples `from .. to` of a record, actuator-major.
pub fn weighted(
    stack: &Stack,
    tau: &[f64],
    record: usize,
    weights: &Weights,
    range: std::ops::Range<usize>,
) -> Mat<f64> {
    let (n, b, m) = (stack.actuators, stack.w.ncols(), range.len());
    let mut out = Mat::<f64>::zeros(n * m, b + 1);
    if let Weights::Same(l) = weights {
        for a in 0..n {
            let to = out.as_mut().subrows_mut(a * m, m);
            add_weighted(stack, tau, l.as_ref(), a, range.start, to);
        }
        return out;
    }
    for c in 0..=b {
        for (k, s) in range.clone().enumerate() {
            let l = weights.at(record, s);
            for a in 0..n {
                out[(a * m + k, c)] = weighted_at(stack, tau, l, [a, s, c]);
            }
        }
    }
    out
}

/// Adds the weighted rows `[W τ]` of actuator `a`, from a sample on, with one matrix for all samples.
fn add_weighted(
    stack: &Stack,
    tau: &[f64],
    l: MatRef<'_, f64>,
    a: usize,
    start: usize,
    mut to: MatMut<'_, f64>,
) {
    let (b, m) = (stack.w.ncols(), to.nrows());
    for d in (0..stack.actuators).filter(|d| l[(a, *d)] != 0.0) {
        let x = l[(a, d)];
        let from = d * stack.count + start;
        for c in 0..=b {
            let from = match c < b {
                true => stack.w.as_ref().subrows(from, m).col(c),
                false => ColRef::from_slice(&tau[from..from + m]),
            };
            let mut to = to.as_mut().col_mut(c);
            faer::zip!(&mut to, &from).for_each(|faer::unzip!(to, w)| *to += x * *w);
        }
    }
}

/// Weighted rows `[W τ]` of all samples of a record, of one actuator alone.
pub fn weighted_row(
    stack: &Stack,
    tau: &[f64],
    record: usize,
    weights: &Weights,
    a: usize,
) -> Mat<f64> {
    if let Weights::Same(l) = weights {
        let mut out = Mat::<f64>::zeros(stack.count, stack.w.ncols() + 1);
        add_weighted(stack, tau, l.as_ref(), a, 0, out.as_mut());
        return out;
    }
    Mat::from_fn(stack.count, stack.w.ncols() + 1, |s, c| {
        weighted_at(stack, tau, weights.at(record, s), [a, s, c])
    })
}

/// Column `c` of the weighted row of actuator `a` at sample `s`.
fn weighted_at(stack: &Stack, tau: &[f64], l: MatRef<'_, f64>, [a, s, c]: [usize; 3]) -> f64 {
    let mut sum = 0.0;
    for d in 0..stack.actuators {
        let x = l[(a, d)];
        if x != 0.0 {
            let row = d * stack.count + s;
            let value = match c < stack.w.ncols() {
                true => stack.w[(row, c)],
                false => tau[row],
            };
            sum += x * value;
        }
    }
    sum
}

/// `[R r; 0 ρ]` of matrices put under each other.
pub fn factor(parts: &[Mat<f64>]) -> Mat<f64> {
    let columns = parts.first().map_or(0, Mat::ncols);
    let rows: usize = parts.iter().map(Mat::nrows).sum();
    // at least square, so that the factor always has the same size
    let mut all = Mat::<f64>::zeros(rows.max(columns), columns);
    let mut at = 0;
    for p in parts {
        all.as_mut().subrows_mut(at, p.nrows()).copy_from(p);
        at += p.nrows();
    }
    all.qr().thin_R().to_owned()
}

/// Samples that are factored at once.
const CHUNK: usize = 512;

/// Factors of the records, one a fold: contiguous parts of the samples of each record, as many of
/// each as `folds`.
pub fn fold_factors(stacks: &[&Stack], weights: &Weights, folds: usize) -> Vec<Mat<f64>> {
    let right: Vec<Vec<f64>> = stacks.iter().map(|s| s.tau()).collect();
    let mut jobs = Vec::new();
    for (r, s) in stacks.iter().enumerate() {
        for f in 0..folds {
            let (from, to) = (f * s.count / folds, (f + 1) * s.count / folds);
            for start in (from..to).step_by(CHUNK) {
                jobs.push((f, r, start..(start + CHUNK).min(to)));
            }
        }
    }
    let parts: Vec<(usize, Mat<f64>)> = jobs
        .par_iter()
        .map(|(f, r, range)| {
            let rows = weighted(stacks[*r], &right[*r], *r, weights, range.clone());
            (*f, factor(&[rows]))
        })
        .collect();
    (0..folds)
        .map(|f| {
            let mine: Vec<Mat<f64>> = parts
                .iter()
                .filter(|(g, _)| *g == f)
                .map(|(_, m)| m.clone())
                .collect();
            factor(&mine)
        })
        .collect()
}

/// Solution of a factored least-squares problem.
#[derive(Debug, Clone)]
pub struct Solution {
    /// parameters
    pub pi: Vec<f64>,
    /// `R`, `b × b`
    pub r: Mat<f64>,
    /// norm of the residual of the weighted rows
    pub residual: f64,
    /// smallest over largest singular value of `R` with unit columns
    pub reciprocal_condition: f64,
    /// parameters that directions without information are made of, by their share in them
    pub weak: Vec<usize>,
}

/// Singular values below this fraction of the largest carry no information.
const SINGULAR: f64 = 1e-9;

/// Solves `R π = r`. Directions without information stay at zero, and are named.
///
/// # Errors
/// Numbers that are not finite.
pub fn solve(f: MatRef<'_, f64>) -> Result<Solution> {
    let b = f.ncols() - 1;
    let r = f.submatrix(0, 0, b, b).to_owned();
    let failed = || Error::Infeasible("the equations hold numbers that are not finite".into());
    let norms: Vec<f64> = (0..b).map(|j| r.col(j).norm_l2()).collect();
    if norms.iter().any(|x| !x.is_finite()) {
        return Err(failed());
    }
    let scale: Vec<f64> = norms
        .iter()
        .map(|x| if *x > 0.0 { *x } else { 1.0 })
        .collect();
    let scaled = Mat::from_fn(b, b, |i, j| r[(i, j)] / scale[j]);
    let sv = scaled.singular_values().map_err(|_| failed())?;
    let (top, low) = (
        sv.first().copied().unwrap_or(1.0),
        sv.last().copied().unwrap_or(1.0),
    );
    let reciprocal_condition = low / top.max(1e-300);
    let mut weak = Vec::new();
    let mut pi = vec![0.0; b];
    if reciprocal_condition > SINGULAR {
        for i in (0..b).rev() {
            let mut s = f[(i, b)];
            for j in i + 1..b {
                s -= r[(i, j)] * pi[j];
            }
            pi[i] = s / r[(i, i)];
        }
    } else {
        let gram = scaled.transpose() * &scaled;
        let eigen = gram.self_adjoint_eigen(Side::Lower).map_err(|_| failed())?;
        let (u, s) = (eigen.U(), eigen.S());
        let right: Vec<f64> = (0..b)
            .map(|j| (0..b).map(|i| scaled[(i, j)] * f[(i, b)]).sum())
            .collect();
        let mut share = vec![0.0f64; b];
        for k in 0..b {
            // the Gram matrix squares the singular values
            if s[k] > 1e-13 * top * top {
                let c = (0..b).map(|j| u[(j, k)] * right[j]).sum::<f64>() / s[k];
                (0..b).for_each(|j| pi[j] += c * u[(j, k)] / scale[j]);
            } else {
                (0..b).for_each(|j| share[j] = share[j].max(u[(j, k)].abs()));
            }
        }
        weak = (0..b).filter(|&j| share[j] > 0.2).collect();
    }
    Ok(Solution {
        pi,
        r,
        residual: f[(b, b)].abs(),
        reciprocal_condition,
        weak,
    })
}

/// `(RᵀR)⁻¹`, with nothing in directions without information.
pub fn inverse_information(r: MatRef<'_, f64>) -> Result<Mat<f64>> {
    let b = r.ncols();
    let scale: Vec<f64> = (0..b).map(|j| r.col(j).norm_l2().max(1e-300)).collect();
    let scaled = Mat::from_fn(r.nrows(), b, |i, j| r[(i, j)] / scale[j]);
    let eigen = (scaled.transpose() * &scaled)
        .self_adjoint_eigen(Side::Lower)
        .map_err(|_| Error::Infeasible("the information matrix is not finite".into()))?;
    let (u, s) = (eigen.U(), eigen.S());
    let top = (0..b).map(|k| s[k]).fold(0.0, f64::max);
    Ok(Mat::from_fn(b, b, |i, j| {
        (0..b)
            .filter(|&k| s[k] > 1e-14 * top)
            .map(|k| u[(i, k)] * u[(j, k)] / s[k])
            .sum::<f64>()
            / (scale[i] * scale[j])
    }))
}

/// Roots of the diagonal of a covariance: standard deviations.
pub fn deviations(c: &Mat<f64>) -> Vec<f64> {
    (0..c.nrows()).map(|a| c[(a, a)].max(0.0).sqrt()).collect()
}
