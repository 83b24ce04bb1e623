//! Levenberg-Marquardt on whitened residuals with a Gaussian prior and a robust loss.
//!
//! ```text
//! minimise  Σ_rows w ρ(|r|)  +  Σ_distances r²  +  Σ (x/σ)²        ρ of Huber, on the length of a row's residuals
//! (Jᵀ W J + P⁻¹ + λ D) dx = −(Jᵀ W r + P⁻¹ x)                   in columns scaled by the size of each unknown
//! ```

use super::model::{Block, Model};
use crate::error::{Error, Result};
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use rayon::prelude::*;

/// Largest number of steps.
const STEPS: usize = 60;
/// A step that lowers the misfit by less than this fraction ends the iteration.
const ENOUGH: f64 = 1e-10;

/// What is fitted to what.
#[derive(Debug, Clone)]
pub struct Plan {
    /// weight of each row; 0 leaves it out
    pub weights: Vec<f64>,
    /// unknowns that may change
    pub free: Vec<bool>,
    /// whether large residuals count less
    pub robust: bool,
}

/// Result of a fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// unknowns
    pub x: Vec<f64>,
    /// steps taken
    pub steps: usize,
    /// whether it came to rest
    pub converged: bool,
}

/// Length of `m` whitened residuals from which on they count less.
pub fn huber(m: usize) -> f64 {
    (m as f64).sqrt() + 0.8
}

/// Loss of a squared length, and its weight.
fn loss(d2: f64, m: usize, robust: bool) -> (f64, f64) {
    let (d, k) = (d2.sqrt(), huber(m));
    match robust && d > k {
        true => (2.0 * k * d - k * k, k / d),
        false => (d2, 1.0),
    }
}

/// Normal equations in scaled unknowns.
pub struct Normal {
    /// `S Jᵀ W J S` with the prior
    pub matrix: Mat<f64>,
    /// gradient
    pub gradient: Vec<f64>,
    /// misfit
    pub cost: f64,
}

/// All blocks that count; `None` where a posture cannot be taken.
fn blocks(model: &Model, plan: &Plan, x: &[f64]) -> Option<Vec<(f64, Block)>> {
    let rows: Vec<usize> = (0..plan.weights.len())
        .filter(|&i| plan.weights[i] > 0.0)
        .collect();
    let each: Option<Vec<(f64, Block)>> = rows
        .par_iter()
        .map(|&i| model.block(i, x).map(|b| (plan.weights[i], b)))
        .collect();
    each
}

/// Normal equations at `x`.
pub fn normal(model: &Model, plan: &Plan, x: &[f64], with_prior: bool) -> Option<Normal> {
    let n = model.count();
    let blocks = blocks(model, plan, x)?;
    let mut matrix = Mat::<f64>::zeros(n, n);
    let mut gradient = vec![0.0; n];
    let mut cost = 0.0;
    let scale: Vec<f64> = model.unknowns.iter().map(|u| u.scale).collect();
    let mut add = |weight: f64, b: &Block| {
        let k = b.columns.len();
        let jtj = b.j.tr_mul(&b.j) * weight;
        let jtr = b.j.tr_mul(&b.r) * weight;
        for a in 0..k {
            let ca = b.columns[a];
            gradient[ca] += jtr[a] * scale[ca];
            for c in 0..k {
                let cc = b.columns[c];
                matrix[(ca, cc)] += jtj[(a, c)] * scale[ca] * scale[cc];
            }
        }
    };
    for (weight, b) in &blocks {
        let (value, factor) = loss(b.r.norm_squared(), b.r.len(), plan.robust);
        cost += weight * value;
        add(weight * factor, b);
    }
    for b in model.distances(x) {
        cost += b.r.norm_squared();
        add(1.0, &b);
    }
    if with_prior {
        for (k, u) in model.unknowns.iter().enumerate() {
            let p = u.scale / u.prior;
            matrix[(k, k)] += p * p;
            gradient[k] += p * p * x[k] / u.scale;
            cost += (x[k] / u.prior).powi(2);
        }
    }
    for k in (0..n).filter(|&k| !plan.free[k]) {
        for c in 0..n {
            matrix[(k, c)] = 0.0;
            matrix[(c, k)] = 0.0;
        }
        matrix[(k, k)] = 1.0;
        gradient[k] = 0.0;
    }
    // an unknown that no row sees and no prior holds stays where it is
    for k in 0..n {
        if matrix[(k, k)] <= 0.0 {
            matrix[(k, k)] = 1.0;
        }
    }
    Some(Normal {
        matrix,
        gradient,
        cost,
    })
}

/// Misfit at `x`; infinite where a posture cannot be taken.
fn cost(model: &Model, plan: &Plan, x: &[f64]) -> f64 {
    let Some(blocks) = blocks(model, plan, x) else {
        return f64::INFINITY;
    };
    let rows: f64 = blocks
        .iter()
        .map(|(w, b)| w * loss(b.r.norm_squared(), b.r.len(), plan.robust).0)
        .sum();
    let distances: f64 = model.distances(x).iter().map(|b| b.r.norm_squared()).sum();
    let prior: f64 = model
        .unknowns
        .iter()
        .zip(x)
        .map(|(u, x)| (x / u.prior).powi(2))
        .sum();
    rows + distances + prior
}

/// Fits from `x`.
///
/// # Errors
/// A start that cannot be taken, or equations that have no solution.
pub fn solve(model: &Model, plan: &Plan, x: &[f64]) -> Result<Fit> {
    let mut x = x.to_vec();
    let mut lambda = 1e-4;
    let lost = || {
        Error::Infeasible(
            "the fit cannot start: a posture of the file cannot be taken by the robot of the file"
                .into(),
        )
    };
    let mut at = normal(model, plan, &x, true).ok_or_else(lost)?;
    let mut converged = false;
    let mut steps = 0;
    while steps < STEPS && !converged {
        steps += 1;
        let mut improved = false;
        for _ in 0..12 {
            let mut a = at.matrix.clone();
            for k in 0..a.nrows() {
                a[(k, k)] *= 1.0 + lambda;
            }
            let Ok(factor) = a.llt(Side::Lower) else {
                lambda = (lambda * 10.0).max(1e-9);
                continue;
            };
            let rhs = Mat::from_fn(a.nrows(), 1, |i, _| -at.gradient[i]);
            let dz = factor.solve(&rhs);
            let next: Vec<f64> = (0..x.len())
                .map(|k| x[k] + dz[(k, 0)] * model.unknowns[k].scale)
                .collect();
            let new = cost(model, plan, &next);
            if new <= at.cost * (1.0 + 1e-14) {
                converged = at.cost - new <= ENOUGH * (1.0 + at.cost);
                x = next;
                lambda = (lambda * 0.2).max(1e-12);
                improved = true;
                break;
            }
            lambda = (lambda * 8.0).max(1e-9);
        }
        if !improved {
            converged = true;
            break;
        }
        at = normal(model, plan, &x, true).ok_or_else(lost)?;
    }
    Ok(Fit {
        x,
        steps,
        converged,
    })
}

/// Covariance of the unknowns, in their units.
pub fn covariance(model: &Model, plan: &Plan, x: &[f64]) -> Option<Mat<f64>> {
    let at = normal(model, plan, x, true)?;
    let n = model.count();
    let factor = at.matrix.llt(Side::Lower).ok()?;
    let mut c = factor.solve(&Mat::<f64>::identity(n, n));
    for i in 0..n {
        for j in 0..n {
            let held = !(plan.free[i] && plan.free[j]);
            c[(i, j)] *= match held {
                true => 0.0,
                false => model.unknowns[i].scale * model.unknowns[j].scale,
            };
        }
    }
    Some(c)
}
