//! Which effects of the joints stand beside the geometry.
//!
//! An effect is kept if it predicts rows that were not fitted better: groups of the fitted rows are left out in turn
//! (without groups, every fifth row), and the errors of the rows left out are compared pairwise. Rows held out
//! take no part.

use super::feature::Feature;
use super::file::Calibration;
use super::fit::Plan;
use super::judge;
use super::model::Model;
use super::unknown::Part;
use crate::error::Result;

/// One effect that was tried.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Trial {
    /// its name
    pub effect: &'static str,
    /// mean error of the rows that were left out without it, m
    pub without: f64,
    /// and with it, m
    pub with: f64,
    /// mean of the improvement by its standard error
    pub significance: f64,
    /// natural logarithm of how many times more likely all fitted rows are with it
    pub evidence: f64,
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

/// Effects that are tried; how links bend must be asked for.
const TRIED: [&str; 3] = ["joint_compliance", "encoder_eccentricity", "backlash"];
/// An effect must lower the error of rows left out by this fraction.
const WORTH: f64 = 0.02;
/// And by this many standard errors, …
const SURE: f64 = 3.0;
/// … or the fitted rows must be that much more likely with it (natural logarithm; "very strong" by Kass & Raftery 1995):
/// few groups leave few to compare.
const EVIDENCE: f64 = 5.0;
/// Parts of the rows where there are no groups to leave out.
const FOLDS: usize = 5;

fn part(effect: &str) -> Part {
    match effect {
        "joint_compliance" => Part::Compliance,
        "backlash" => Part::Backlash,
        "link_compliance" => Part::Bending,
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
    if TRIED.iter().all(|e| columns(e).is_empty()) {
        return Ok(Chosen::default());
    }
    let folds = folds(input);
    let search = Search {
        make,
        columns: &columns,
        folds: &folds,
    };
    let mut kept: Vec<&'static str> = Vec::new();
    let mut trials = Vec::new();
    let Some(mut base) = search.errors(&kept)? else {
        return Ok(Chosen::default());
    };
    for effect in TRIED {
        if columns(effect).is_empty() {
            continue;
        }
        let more: Vec<&'static str> = kept.iter().copied().chain([effect]).collect();
        let Some(errors) = search.errors(&more)? else {
            continue;
        };
        let mut trial = search.compare(effect, [&kept, &more], &base, &errors)?;
        let rival = effect == "backlash" && kept.contains(&"joint_compliance");
        trial.kept = trial.better() && !rival;
        if trial.kept {
            kept = more;
            base = errors;
        } else if rival {
            // what gives way and what has play both follow the load: the better of the two
            let other: Vec<&'static str> = kept
                .iter()
                .map(|e| if *e == "joint_compliance" { effect } else { e })
                .collect();
            if let Some(errors) = search.errors(&other)? {
                let swap = search.compare(effect, [&kept, &other], &base, &errors)?;
                if swap.better() {
                    trial = Trial { kept: true, ..swap };
                    trials.iter_mut().for_each(|t: &mut Trial| {
                        t.kept &= t.effect != "joint_compliance";
                    });
                    kept = other;
                    base = errors;
                }
            }
        }
        trials.push(trial);
    }
    Ok(Chosen {
        features: kept.iter().flat_map(|e| columns(e)).collect(),
        trials,
    })
}

/// Tries sets of effects.
struct Search<'s, 'a> {
    make: &'s dyn Fn(Vec<Feature>) -> Model<'a>,
    columns: &'s dyn Fn(&str) -> Vec<Feature>,
    folds: &'s [Option<usize>],
}

impl Search<'_, '_> {
    /// Errors of all fitted rows, each predicted by the others; `None` where a part cannot be left out. Noise and
    /// strays are those of a fit to all of them, from which the fits to parts start.
    fn errors(&self, effects: &[&'static str]) -> Result<Option<Outcome>> {
        let features: Vec<Feature> = effects.iter().flat_map(|e| (self.columns)(e)).collect();
        let mut model = (self.make)(features);
        let of = |keep: &dyn Fn(usize) -> bool| -> Vec<f64> {
            let weight = |(i, f): (usize, &Option<usize>)| match f {
                Some(f) if keep(*f) && model.nominal[i].is_some() => 1.0,
                _ => 0.0,
            };
            self.folds.iter().enumerate().map(weight).collect()
        };
        let mut whole = Plan {
            weights: of(&|_| true),
            free: Vec::new(),
            robust: true,
        };
        whole.free = super::robust::seen(&model, &whole);
        let parts: Vec<Vec<f64>> = (0..self.folds.iter().flatten().max().map_or(0, |m| m + 1))
            .map(|fold| of(&|f| f != fold))
            .collect();
        let x = vec![0.0; model.count()];
        let start = super::robust::robustly(&mut model, &mut whole, &x)?;
        let mut out = vec![f64::NAN; self.folds.len()];
        for (fold, weights) in parts.iter().enumerate() {
            let weights: Vec<f64> = weights
                .iter()
                .zip(&whole.weights)
                .map(|(a, b)| a * b)
                .collect();
            if weights.iter().sum::<f64>() < 6.0 {
                return Ok(None);
            }
            let mut plan = Plan {
                weights,
                free: Vec::new(),
                robust: true,
            };
            plan.free = super::robust::seen(&model, &plan);
            let fit = super::fit::solve(&model, &plan, &start.x)?;
            let x = super::robust::set_up_rest(&model, &plan, &fit.x)?;
            let errors = judge::errors(&model, &x);
            for (i, f) in self.folds.iter().enumerate() {
                if *f == Some(fold) {
                    out[i] = errors.robust[i];
                }
            }
        }
        Ok(Some(Outcome {
            errors: out,
            noise: model.noise,
            weights: whole.weights,
        }))
    }

    /// Logarithm of the evidence (Laplace), up to a constant, with noise and strays of an outcome:
    /// `−½ (misfit + prior) − ½ ln det(P Λ)`.
    fn evidence(&self, effects: &[&'static str], of: &Outcome) -> Result<f64> {
        let features: Vec<Feature> = effects.iter().flat_map(|e| (self.columns)(e)).collect();
        let mut model = (self.make)(features);
        model.noise = of.noise;
        let mut plan = Plan {
            weights: of.weights.clone(),
            free: Vec::new(),
            robust: true,
        };
        plan.free = super::robust::seen(&model, &plan);
        let fit = super::fit::solve(&model, &plan, &vec![0.0; model.count()])?;
        let Some(at) = super::fit::normal(&model, &plan, &fit.x, true) else {
            return Ok(f64::NAN);
        };
        let n = model.count();
        let matrix = nalgebra::DMatrix::from_fn(n, n, |i, k| at.matrix[(i, k)]);
        let Some(factor) = matrix.cholesky() else {
            return Ok(f64::NAN);
        };
        let half_ln_det: f64 = factor.l().diagonal().iter().map(|d| d.ln()).sum();
        Ok(-0.5 * at.cost - half_ln_det)
    }

    /// A trial: sets of effects without and with it, and what came out.
    fn compare(
        &self,
        effect: &'static str,
        [without, with]: [&[&'static str]; 2],
        base: &Outcome,
        new: &Outcome,
    ) -> Result<Trial> {
        let mut trial = compare(effect, &base.errors, &new.errors);
        trial.evidence = self.evidence(with, base)? - self.evidence(without, base)?;
        Ok(trial)
    }
}

/// What a set of effects gives.
struct Outcome {
    /// errors of the rows that were left out, m
    errors: Vec<f64>,
    /// factor on the noise
    noise: f64,
    /// 0 for strays
    weights: Vec<f64>,
}

impl Trial {
    /// Rows left out are predicted better, and that is no accident.
    fn better(&self) -> bool {
        let sure = self.significance > SURE || self.evidence > EVIDENCE;
        self.with < (1.0 - WORTH) * self.without && sure
    }
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
    let each = |(i, r): (usize, &super::row::Row)| match (r.fit, by_group) {
        (false, _) => None,
        (true, true) => used.iter().position(|&g| g == groups[i]),
        (true, false) => Some(i % FOLDS),
    };
    input.rows.iter().enumerate().map(each).collect()
}

/// Pairwise; rows that are far off either way do not decide.
fn compare(effect: &'static str, without: &[f64], with: &[f64]) -> Trial {
    let typical = crate::median::median(without.iter().copied());
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
        evidence: 0.0,
        kept: false,
    }
}
