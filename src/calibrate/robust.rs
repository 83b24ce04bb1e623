//! The order of the fits: the set-up alone, everything, what only held-out rows see; and what does not belong.

use super::fit::{self, Fit, Plan};
use super::judge;
use super::kin::Kin;
use super::kind::Kind;
use super::layout::Layout;
use super::model::{Algorithm, Model};
use super::unknown::Part;
use crate::error::Result;

/// Rounds of fitting and leaving out.
const ROUNDS: usize = 6;

/// Unknowns that some row of the plan sees.
pub(super) fn seen(model: &Model, plan: &Plan) -> Vec<bool> {
    let mut free: Vec<bool> = (0..model.count()).map(|k| k < model.of_robot).collect();
    for (i, row) in model.input.rows.iter().enumerate() {
        if plan.weights[i] > 0.0 {
            own(model, row.measurement, |k| {
                free[k] = !model.unknowns[k].held
            });
        }
    }
    free
}

/// Unknowns of the set-up of one measurement.
fn own(model: &Model, m: usize, mut each: impl FnMut(usize)) {
    let l = &model.layout;
    let last = match model.input.measurements[m].kind {
        Kind::Pose => 6,
        _ => 3,
    };
    l.camera[m]
        .into_iter()
        .flat_map(|c| c..c + 6)
        .for_each(&mut each);
    l.target[m]
        .into_iter()
        .flat_map(|t| t..t + last)
        .for_each(&mut each);
    l.contact[m]
        .into_iter()
        .flat_map(|c| c..c + Layout::width(model.input.measurements[m].kind))
        .for_each(&mut each);
}

/// The set-up alone, for the robot as it is: fitted rows first, then what only held-out rows see. What is left are errors
/// of the robot, not of the camera. Where a picture is sharp in one direction and dull in another, they would drive the
/// set-up along the dull one: the covariance of a pose counts by its size.
pub(super) fn set_up(model: &Model, plan: &Plan, x: &[f64]) -> Result<Vec<f64>> {
    let mut free = seen(model, plan);
    free[..model.of_robot].fill(false);
    let only = Plan {
        free,
        ..plan.clone()
    };
    // without it nothing holds the tilt of a camera before a robot that keeps its own
    let mut model = model.clone();
    model.settings.orientation = true;
    model.even = true;
    let x = fit::solve(&model, &only, x)?.x;
    set_up_rest(&model, plan, &x)
}

/// What only held-out rows see: their sockets and planes.
pub(super) fn set_up_rest(model: &Model, plan: &Plan, x: &[f64]) -> Result<Vec<f64>> {
    let known = seen(model, plan);
    let mut rest = Plan {
        weights: vec![0.0; plan.weights.len()],
        free: vec![false; model.count()],
        robust: true,
    };
    for (i, row) in model.input.rows.iter().enumerate() {
        let mut new = false;
        own(model, row.measurement, |k| {
            if !known[k] && !model.unknowns[k].held {
                rest.free[k] = true;
                new = true;
            }
        });
        rest.weights[i] = f64::from(u8::from(new && model.nominal[i].is_some()));
    }
    match rest.free.contains(&true) {
        true => Ok(fit::solve(model, &rest, x)?.x),
        false => Ok(x.to_vec()),
    }
}

/// Unknowns of one model as a start for another with more features.
pub(super) fn extend(from: &Model, to: &Model, x: &[f64]) -> Vec<f64> {
    let errors = from.of_robot;
    let mut out = vec![0.0; to.count()];
    out[..errors].copy_from_slice(&x[..errors]);
    let (a, b) = (from.of_robot, to.of_robot);
    out[b..].copy_from_slice(&x[a..]);
    out
}

/// Fits, estimates the noise, leaves out what does not belong, and again until nothing changes.
pub(super) fn robustly(model: &mut Model, plan: &mut Plan, x: &[f64]) -> Result<Fit> {
    let wanted = plan.weights.clone();
    let mut fit = fit::solve(model, plan, x)?;
    for _ in 0..ROUNDS {
        let lengths: Vec<Option<(f64, usize)>> = (0..wanted.len())
            .map(|i| {
                let b = model.block(i, &fit.x).filter(|_| wanted[i] > 0.0)?;
                Some((b.r.norm(), b.r.len()))
            })
            .collect();
        let scaled: Vec<f64> = lengths
            .iter()
            .flatten()
            .map(|(d, m)| d / judge::median_length(*m))
            .collect();
        let count: usize = lengths.iter().flatten().map(|l| l.1).sum();
        // parameters take their share of the residuals; where there are few rows, half at most
        let taken = plan.free.iter().filter(|f| **f).count().min(count / 2);
        let found = crate::median::median(scaled.iter().copied())
            * (count as f64 / (count - taken).max(1) as f64).sqrt();
        let before = model.noise;
        let new = (before * found).max(match model.input.noise_stated {
            true => 1.0,
            false => 1e-3,
        });
        model.noise = new;
        let ratio = before / new;
        let weights: Vec<f64> = lengths
            .iter()
            .map(|l| match l {
                Some((d, m)) => f64::from(u8::from(d * ratio <= judge::outlier(*m))),
                None => 0.0,
            })
            .collect();
        let still = weights == plan.weights && (ratio - 1.0).abs() < 0.02;
        plan.weights = weights;
        fit = fit::solve(model, plan, &fit.x)?;
        if still {
            break;
        }
    }
    Ok(fit)
}

/// Without the orientation residual, the algorithms of parallel robots do not see the tilt of camera and target against
/// a platform that keeps its own: they stay where the turns that were seen put them in closed form.
pub(super) fn hold_tilt(model: &Model, plan: &mut Plan, x: &mut [f64]) {
    let Kin::Parallel(p) = model.kin else { return };
    let seen = model.settings.orientation || model.settings.algorithm == Algorithm::Forward;
    if seen || p.held().is_empty() {
        return;
    }
    let cameras = model.layout.camera.iter().flatten().map(|c| c + 3..c + 5);
    let targets = model.layout.target.iter().flatten().map(|t| t + 3..t + 6);
    for k in cameras.chain(targets).flatten() {
        plan.free[k] = false;
        x[k] = 0.0;
    }
}

/// Links cannot bend against their load: a flexibility that came out negative is held at zero, and the fit repeated.
pub(super) fn stiff(model: &Model, plan: &mut Plan, mut fit: Fit) -> Result<Fit> {
    let bending = |k: &usize| model.unknowns[*k].part == Part::Bending;
    let all: Vec<usize> = (0..model.of_robot).filter(bending).collect();
    for _ in 0..all.len() {
        let mut x = fit.x.clone();
        let mut changed = false;
        for &k in &all {
            if x[k] < 0.0 {
                x[k] = 0.0;
                plan.free[k] = false;
                changed = true;
            }
        }
        if !changed {
            break;
        }
        fit = fit::solve(model, plan, &x)?;
    }
    Ok(fit)
}
