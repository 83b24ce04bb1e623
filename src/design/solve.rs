//! Sequential convex programming from one start.
//!
//! At a feasible `x` the criterion is modelled to first order (groups of extreme eigenvalues as
//! linear matrix inequalities, see [`criterion`](super::criterion)), the limits are rows that hold
//! exactly or to second order, torques are linearised, and the conic program
//!
//! ```text
//! minimise   gᵀδ + ½(a − b) + (1/2Δ) … over δ, a, b
//! subject to a 1 ⪰ U_0 + Σ δ_k U_k,   L_0 + Σ δ_k L_k ⪰ b 1,
//!            limits(x + δ),   |τ + ∂τ δ| ≤ τ_max,   |δ_k| ≤ Δ s_k
//! ```
//!
//! is solved by clarabel. The step is shortened joint by joint until it is inside the limits for
//! all time, tried on the true criterion, and the trust region `Δ` grows or shrinks with the ratio
//! of true to predicted decrease. Every iterate is feasible, so the best one can be returned at
//! any moment.

use super::criterion::{Cluster, Model, Objective};
use super::information::{Evaluation, Information};
use super::limits::{ExtremaWork, Limits};
use super::torque::TorqueLimits;
use crate::conic::{Problem, Settings as ConicSettings};
use crate::error::Result;
use faer::Mat;

/// One start's problem: all parts are shared between threads.
pub struct Task<'a> {
    /// information matrix and derivatives
    pub info: &'a Information,
    /// what is minimised
    pub objective: Objective,
    /// joint limits
    pub limits: &'a Limits,
    /// torque limits
    pub torque: Option<&'a TorqueLimits>,
    /// size of a unit step of each joint in `x`
    pub scale: &'a [f64],
}

/// When one start ends.
#[derive(Debug, Clone, Copy)]
pub struct Stop {
    /// most conic solves
    pub iterations: usize,
    /// ends when the last ten iterations gained less than this (logarithmic)
    pub gain: f64,
}

/// Where a start ended.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// free numbers of the best feasible trajectory
    pub x: Vec<f64>,
    /// its criterion (logarithmic)
    pub value: f64,
    /// conic solves
    pub iterations: usize,
    /// whether it stopped by itself
    pub converged: bool,
    /// trust region at the end
    pub trust: f64,
    /// criterion after each iteration
    pub history: Vec<f64>,
}

/// Largest and smallest trust region.
const TRUST: (f64, f64) = (0.6, 1e-5);

/// Improves a feasible `x` until it converges or `halt` says so.
///
/// # Errors
/// Only when the numbers are not finite.
pub fn improve(
    task: &Task,
    x: Vec<f64>,
    trust: f64,
    stop: Stop,
    halt: &(dyn Fn() -> bool + Sync),
) -> Result<Outcome> {
    let n = task.info.len();
    let m = n / task.scale.len();
    let mut e = Evaluation::default();
    let mut trial = Evaluation::default();
    let mut work = ExtremaWork::default();
    let (mut ws, mut tau) = (Default::default(), Vec::new());
    let mut problem = Problem::new(n + 2);
    let value = task.objective.evaluate(task.info, &x, &mut e);
    let mut best = Outcome { x, value, iterations: 0, converged: false, trust, history: vec![value] };
    let mut model: Option<Model> = None;
    while best.iterations < stop.iterations && !halt() {
        best.iterations += 1;
        if model.is_none() {
            task.info.evaluate(&best.x, &mut e);
            model = Some(task.objective.model(task.info, &mut e)?);
        }
        let current = model.as_ref().expect("a model was just made");
        let Some((step, predicted)) =
            subproblem(task, current, &mut e, &best.x, best.trust, &mut problem, &mut work)?
        else {
            best.trust *= 0.25;
            if best.trust < TRUST.1 {
                best.converged = true;
                break;
            }
            continue;
        };
        let mut candidate: Vec<f64> = best.x.iter().zip(&step).map(|(x, s)| x + s).collect();
        task.limits.pull_inside(&mut candidate, &mut work);
        let step: Vec<f64> = candidate.iter().zip(&best.x).map(|(c, x)| c - x).collect();
        // torques are linearised: go back along the step until the true ones fit
        if let Some(limits) = task.torque {
            let mut fraction: f64 = 1.0;
            for _ in 0..12 {
                task.info.sample(&candidate, &mut trial.motion);
                limits.torques(task.info, &trial.motion, &mut ws, &mut tau);
                if limits.worst(&tau).0 <= 1.0 {
                    break;
                }
                fraction *= 0.7;
                for k in 0..n {
                    candidate[k] = best.x[k] + fraction * step[k];
                }
            }
            if limits.worst(&tau).0 > 1.0 {
                best.trust *= 0.3;
                continue;
            }
        }
        let value = task.objective.evaluate(task.info, &candidate, &mut trial);
        let ratio = (best.value - value) / predicted.max(1e-300);
        let largest = (0..n)
            .map(|k| (candidate[k] - best.x[k]).abs() / task.scale[k / m])
            .fold(0.0, f64::max);
        if ratio < 0.2 {
            best.trust = 0.5 * best.trust.min(largest.max(TRUST.1));
        } else if ratio > 0.6 && largest > 0.8 * best.trust {
            best.trust = (1.8 * best.trust).min(TRUST.0);
        }
        if value < best.value {
            best.x = candidate;
            best.value = value;
            model = None;
        }
        best.history.push(best.value);
        let h = &best.history;
        let settled = h.len() > 10 && h[h.len() - 11] - best.value < stop.gain;
        if best.trust < TRUST.1 || settled || predicted < 1e-9 {
            best.converged = true;
            break;
        }
    }
    Ok(best)
}

/// Smooth phase: SQP with BFGS.
pub fn descend(
    task: &Task,
    x: Vec<f64>,
    p: f64,
    trust: f64,
    stop: Stop,
    halt: &(dyn Fn() -> bool + Sync),
    hessian: &mut Option<Mat<f64>>,
) -> Result<Outcome> {
    let n = task.info.len();
    let m = n / task.scale.len();
    let mut e = Evaluation::default();
    let mut trial = Evaluation::default();
    let mut work = ExtremaWork::default();
    let (mut ws, mut tau) = (Default::default(), Vec::new());
    let mut problem = Problem::new(n);
    task.info.evaluate(&x, &mut e);
    let spectrum = task.objective.spectrum(&e.gram)?;
    let value = task.objective.smooth_value(&spectrum, p);
    let scaled = |g: Vec<f64>| -> Vec<f64> { g.iter().enumerate().map(|(k, g)| g * task.scale[k / m]).collect() };
    let mut g = scaled(task.objective.smooth_gradient(task.info, &mut e, &spectrum, p));
    let mut best = Outcome { x, value, iterations: 0, converged: false, trust, history: vec![value] };
    while best.iterations < stop.iterations && !halt() {
        best.iterations += 1;
        problem.clear();
        (0..n).for_each(|k| problem.linear(k, g[k]));
        match hessian {
            Some(h) => problem.quadratic_matrix(h.as_ref()),
            None => {}
        }
        let reach: Vec<f64> = task.scale.iter().map(|s| s * best.trust).collect();
        for row in task.limits.rows(&best.x, &reach, &mut work) {
            let s = task.scale[row.joint];
            problem.inequality(
                row.row.iter().enumerate().map(|(k, r)| (row.joint * m + k, r * s)),
                row.slack,
            );
        }
        if let Some(limits) = task.torque {
            for row in limits.rows(task.info, &mut e, 0.7) {
                let sign = row.value.signum();
                problem.inequality(
                    row.gradient.iter().enumerate().map(|(k, g)| (k, sign * g * task.scale[k / m])),
                    0.997 * row.limit - row.value.abs(),
                );
            }
        }
        for k in 0..n {
            problem.bounds(k, -best.trust, best.trust);
        }
        let solution = problem.solve(&ConicSettings::fast())?;
        if !solution.status.is_solved() {
            best.trust *= 0.3;
            *hessian = None;
            if best.trust < TRUST.1 { break; }
            continue;
        }
        let step: Vec<f64> = (0..n).map(|k| solution.x[k] * task.scale[k / m]).collect();
        let mut candidate: Vec<f64> = best.x.iter().zip(&step).map(|(x, s)| x + s).collect();
        task.limits.pull_inside(&mut candidate, &mut work);
        let step: Vec<f64> = candidate.iter().zip(&best.x).map(|(c, x)| c - x).collect();
        let mut fraction = 1.0;
        if let Some(limits) = task.torque {
            for _ in 0..12 {
                task.info.sample(&candidate, &mut trial.motion);
                limits.torques(task.info, &trial.motion, &mut ws, &mut tau);
                if limits.worst(&tau).0 <= 1.0 {
                    break;
                }
                fraction *= 0.7;
                for k in 0..n {
                    candidate[k] = best.x[k] + fraction * step[k];
                }
            }
            if limits.worst(&tau).0 > 1.0 {
                best.trust *= 0.3;
                continue;
            }
        }
        task.info.evaluate(&candidate, &mut trial);
        let s = task.objective.spectrum(&trial.gram)?;
        let value = task.objective.smooth_value(&s, p);
        let ratio = (best.value - value) / (-solution.objective).max(1e-300);
        let z: Vec<f64> = (0..n).map(|k| (candidate[k] - best.x[k]) / task.scale[k / m]).collect();
        let largest = z.iter().fold(0.0f64, |m, z| m.max(z.abs()));
        if std::env::var("DBG").is_ok() {
            let lim: Vec<String> = (0..task.scale.len()).map(|j| format!("{:.0e}/{:.2}", 1.0-task.limits.gauge(j, &best.x[j*m..(j+1)*m], &mut work), (0..m).map(|k| (z[j*m+k]).powi(2)).sum::<f64>().sqrt() / (0..m).map(|k| (solution.x[j*m+k]).powi(2)).sum::<f64>().sqrt())).collect();
            println!("it {} f {:.4} new {:.4} pred {:.2e} ratio {ratio:.2} trust {:.1e} largest {largest:.1e} frac {fraction:.2} {:?} {}", best.iterations, best.value, value, -solution.objective, best.trust, solution.status, lim.join(" "));
        }
        if ratio < 0.15 {
            best.trust = 0.5 * best.trust.min(largest.max(TRUST.1));
        } else if ratio > 0.7 && largest > 0.8 * best.trust {
            best.trust = (1.8 * best.trust).min(TRUST.0);
        }
        if value.is_finite() {
            let new = scaled(task.objective.smooth_gradient(task.info, &mut trial, &s, p));
            // damped BFGS
            let y: Vec<f64> = new.iter().zip(&g).map(|(a, b)| a - b).collect();
            let zz: f64 = z.iter().map(|a| a * a).sum();
            let zy: f64 = z.iter().zip(&y).map(|(a, b)| a * b).sum();
            if zz > 1e-16 {
                let b = hessian.get_or_insert_with(|| {
                    let yy: f64 = y.iter().map(|a| a * a).sum();
                    let gamma = if zy > 0.0 { (yy / zy).clamp(1e-3, 1e3) } else { (yy / zz).sqrt() };
                    Mat::from_fn(n, n, |i, j| if i == j { gamma } else { 0.0 })
                });
                let bz: Vec<f64> = (0..n).map(|i| (0..n).map(|j| b[(i, j)] * z[j]).sum()).collect();
                let zbz: f64 = z.iter().zip(&bz).map(|(a, b)| a * b).sum();
                let theta = if zy >= 0.2 * zbz { 1.0 } else { 0.8 * zbz / (zbz - zy) };
                let r: Vec<f64> = (0..n).map(|k| theta * y[k] + (1.0 - theta) * bz[k]).collect();
                let zr: f64 = z.iter().zip(&r).map(|(a, b)| a * b).sum();
                for i in 0..n {
                    for j in 0..n {
                        b[(i, j)] += r[i] * r[j] / zr - bz[i] * bz[j] / zbz;
                    }
                }
            }
            if value < best.value {
                best.x = candidate;
                best.value = value;
                g = new;
                std::mem::swap(&mut e, &mut trial);
            }
        }
        best.history.push(best.value);
        let h = &best.history;
        let settled = h.len() > 8 && h[h.len() - 9] - best.value < stop.gain;
        if best.trust < TRUST.1 || settled || -solution.objective < 1e-7 {
            best.converged = true;
            break;
        }
    }
    Ok(best)
}

/// Solves the conic program around `x`: the step and the predicted decrease, or nothing where the
/// solver found none.
fn subproblem(
    task: &Task,
    model: &Model,
    e: &mut Evaluation,
    x: &[f64],
    trust: f64,
    problem: &mut Problem,
    work: &mut ExtremaWork,
) -> Result<Option<(Vec<f64>, f64)>> {
    let n = x.len();
    let m = n / task.scale.len();
    let scale = |k: usize| task.scale[k / m];
    // variables are z_k = δ_k / s_k, then a, b
    problem.clear();
    for (k, g) in model.gradient.iter().enumerate() {
        if *g != 0.0 {
            problem.linear(k, g * scale(k));
        }
    }
    let scales: Vec<f64> = (0..n).map(scale).collect();
    // upper: a 1 − U ⪰ 0, minimise a/2; lower: L − b 1 ⪰ 0, minimise −b/2
    match &model.upper {
        Some(c) => inequality(problem, c, &scales, n, -1.0),
        None => drop(problem.equality([(n, 1.0)], 0.0)),
    }
    match &model.lower {
        Some(c) => inequality(problem, c, &scales, n + 1, 1.0),
        None => drop(problem.equality([(n + 1, 1.0)], 0.0)),
    }
    let reach: Vec<f64> = task.scale.iter().map(|s| s * trust).collect();
    for row in task.limits.rows(x, &reach, work) {
        let s = task.scale[row.joint];
        problem.inequality(
            row.row.iter().enumerate().map(|(k, r)| (row.joint * m + k, r * s)),
            row.slack,
        );
    }
    if let Some(limits) = task.torque {
        for row in limits.rows(task.info, e, 0.7) {
            let sign = row.value.signum();
            problem.inequality(
                row.gradient.iter().enumerate().map(|(k, g)| (k, sign * g * scale(k))),
                0.997 * row.limit - row.value.abs(),
            );
        }
    }
    for k in 0..n {
        problem.bounds(k, -trust, trust);
    }
    let solution = problem.solve(&ConicSettings::fast())?;
    if !solution.status.is_solved() {
        return Ok(None);
    }
    let before = 0.5 * (f64::from(model.upper.is_some()) - f64::from(model.lower.is_some()));
    let predicted = before - solution.objective;
    let step = (0..n).map(|k| solution.x[k].clamp(-trust, trust) * scale(k)).collect();
    Ok(Some((step, predicted)))
}

/// The linear matrix inequality of a cluster: `sign (A_0 + Σ δ_k A_k − slot 1) ⪰ 0`, and its bound
/// in the objective.
fn inequality(problem: &mut Problem, cluster: &Cluster, scales: &[f64], slot: usize, sign: f64) {
    let s = cluster.values.len();
    let a0 = Mat::from_fn(s, s, |i, j| if i == j { sign * cluster.values[i] } else { 0.0 });
    let pair = |i: usize, j: usize| {
        let (i, j) = (i.min(j), i.max(j));
        &cluster.gradients[j * (j + 1) / 2 + i]
    };
    let terms: Vec<Mat<f64>> = (0..scales.len())
        .map(|k| Mat::from_fn(s, s, |i, j| sign * pair(i, j)[k] * scales[k]))
        .collect();
    let identity = Mat::from_fn(s, s, |i, j| if i == j { -sign } else { 0.0 });
    let mut list: Vec<_> = terms.iter().enumerate().map(|(k, a)| (k, a.as_ref())).collect();
    list.push((slot, identity.as_ref()));
    problem.semidefinite(a0.as_ref(), &list);
    problem.linear(slot, -0.5 * sign);
}
