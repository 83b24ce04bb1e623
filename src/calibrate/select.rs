//! Which effects of the joints stand beside the geometry.
//!
//! An effect is kept if it predicts rows that were not fitted better: groups of the fitted rows are left out in turn
//! (without groups, every fifth row), and the errors of the rows left out are compared pairwise. Rows held out
//! take no part.

use super::effects::Feature;
use super::file::Calibration;
use super::fit::Plan;
use super::judge;
use super::model::Model;
use super::unknown::Part;
use crate::error::Result;

/// One effect that was tried.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Trial {
    /// its name
    pub effect: &'static str,
    /// mean error of the rows that were left out without it, m
    pub without: f64,
    /// and with it, m
    pub with: f64,
    /// mean of the improvement by its standard error
    pub significance: f64,
    /// whether it is part of the calibrated model
    pub kept: bool,
}

/// Effects and what was tried.
#[derive(Debug, Clone, Default)]
pub struct Chosen {
    /// columns of the model
    pub features: Vec<Feature>,
    /// in the order of the trials
    pub trials: Vec<Trial>,
}

/// An effect must lower the error of rows left out by this fraction.
const WORTH: f64 = 0.02;
/// And by this many standard errors.
const SURE: f64 = 3.0;
/// Parts of the rows where there are no groups to leave out.
const FOLDS: usize = 5;

fn part(effect: &str) -> Part {
    match effect {
        "joint_compliance" => Part::Compliance,
        "backlash" => Part::Backlash,
        _ => Part::Eccentricity,
    }
}

/// Chooses. `make` puts a model together, `columns` the features of an effect.
///
/// # Errors
/// As the fit.
pub fn choose<'a>(
    input: &'a Calibration,
    make: &dyn Fn(Vec<Feature>) -> Model<'a>,
    columns: &dyn Fn(Part) -> Vec<Feature>,
) -> Result<Chosen> {
    let columns = |effect: &str| columns(part(effect));
    if let Some(asked) = &input.effects {
        let all = super::EFFECTS
            .iter()
            .filter(|e| asked.iter().any(|a| a == *e));
        return Ok(Chosen {
            features: all.flat_map(|e| columns(e)).collect(),
            trials: Vec::new(),
        });
    }
    if super::EFFECTS.iter().all(|e| columns(e).is_empty()) {
        return Ok(Chosen::default());
    }
    let folds = folds(input);
    let mut chosen = Chosen::default();
    let base = left_out(make(chosen.features.clone()), &folds)?;
    let Some(mut base) = base else {
        return Ok(chosen);
    };
    let mut open: Vec<&'static str> = super::EFFECTS.to_vec();
    while !open.is_empty() {
        let mut best: Option<(Trial, Vec<f64>)> = None;
        let mut tried = Vec::new();
        for &effect in &open {
            let mut more = chosen.features.clone();
            let own = columns(effect);
            if own.is_empty() {
                continue;
            }
            more.extend(own);
            let Some(errors) = left_out(make(more), &folds)? else {
                continue;
            };
            let trial = compare(effect, &base, &errors);
            tried.push(trial.clone());
            if best.as_ref().is_none_or(|b| trial.with < b.0.with) {
                best = Some((trial, errors));
            }
        }
        let Some((mut trial, errors)) = best else {
            break;
        };
        let better = trial.with < (1.0 - WORTH) * trial.without && trial.significance > SURE;
        if !better {
            chosen.trials.extend(tried);
            break;
        }
        trial.kept = true;
        open.retain(|e| *e != trial.effect);
        chosen.features.extend(columns(trial.effect));
        chosen.trials.push(trial);
        base = errors;
    }
    Ok(chosen)
}

/// Which part each row belongs to; `None` for rows that are held out.
fn folds(input: &Calibration) -> Vec<Option<usize>> {
    let groups: Vec<usize> = input.rows.iter().map(|r| input.group_of(r)).collect();
    let mut used: Vec<usize> = Vec::new();
    for (r, &g) in input.rows.iter().zip(&groups) {
        if r.fit && !used.contains(&g) {
            used.push(g);
        }
    }
    let by_group = used.len() >= 3;
    let each = |(i, r): (usize, &super::rows::Row)| match (r.fit, by_group) {
        (false, _) => None,
        (true, true) => used.iter().position(|&g| g == groups[i]),
        (true, false) => Some(i % FOLDS),
    };
    input.rows.iter().enumerate().map(each).collect()
}

/// Errors of all fitted rows, each predicted by the others; `None` where a part cannot be left out.
fn left_out(fresh: Model, folds: &[Option<usize>]) -> Result<Option<Vec<f64>>> {
    let count = folds.iter().flatten().max().map_or(0, |m| m + 1);
    let mut out = vec![f64::NAN; folds.len()];
    for fold in 0..count {
        let weights: Vec<f64> = folds
            .iter()
            .map(|f| f64::from(u8::from(f.is_some_and(|f| f != fold))))
            .collect();
        if weights.iter().sum::<f64>() < 6.0 {
            return Ok(None);
        }
        let mut model = fresh.clone();
        let mut plan = Plan {
            weights,
            free: Vec::new(),
            robust: true,
        };
        plan.free = super::seen(&model, &plan);
        let x = vec![0.0; model.count()];
        let fit = super::robustly(&mut model, &mut plan, &x)?;
        let x = super::set_up_rest(&model, &plan, &fit.x)?;
        let errors = judge::errors(&model, &x);
        for (i, f) in folds.iter().enumerate() {
            if *f == Some(fold) {
                out[i] = errors.robust[i];
            }
        }
    }
    Ok(Some(out))
}

/// Pairwise; rows that are far off either way do not decide.
fn compare(effect: &'static str, without: &[f64], with: &[f64]) -> Trial {
    let typical = judge::middle(without);
    let pairs: Vec<(f64, f64)> = without
        .iter()
        .zip(with)
        .map(|(a, b)| (*a, *b))
        .filter(|(a, b)| a.is_finite() && b.is_finite() && a.min(*b) < 4.0 * typical)
        .collect();
    let n = pairs.len().max(1) as f64;
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(f).sum::<f64>() / n;
    let gain = mean(&|p| p.0 - p.1);
    let spread = mean(&|p| (p.0 - p.1 - gain).powi(2)).sqrt();
    Trial {
        effect,
        without: mean(&|p| p.0),
        with: mean(&|p| p.1),
        significance: gain / (spread / n.sqrt()).max(f64::MIN_POSITIVE),
        kept: false,
    }
}
