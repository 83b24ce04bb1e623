//! The model from condensed records ([`super::condense`]).

use super::cross_validation::Trial;
use super::essential::{self, Essential};
use super::factor::{Factor, Part};
use super::identification::measured;
use super::linear::{self, Weights};
use super::normal::Normal;
use super::settings::{Method, Settings};
use super::stack::Stack;
use super::validation::{Errors, JointError};
use super::{doubts, standard, weights};
use crate::base::BaseParameters;
use crate::error::{Error, Result, Warning, WarningKind};
use crate::plant::Plant;
use crate::robot::Robot;
use faer::Mat;
use serde_json::{Value, json};

/// Rounds of the covariance between actuators, as in [`super::method`].
const COVARIANCE_ROUNDS: usize = 2;

/// A model from condensed records.
#[derive(Debug, Clone)]
pub struct Merged {
    /// base parameters of the plant
    pub base: BaseParameters,
    /// estimate of the base parameters by the method alone
    pub pi: Vec<f64>,
    /// standard deviations of it
    pub std: Vec<f64>,
    /// the whole covariance
    pub covariance: Mat<f64>,
    /// variance through correlation in time, mean of those of the records alone
    pub inflation: f64,
    /// condition number of the weighted equations
    pub condition: f64,
    /// standard parameters
    pub phi: Vec<f64>,
    /// base parameters of `phi`
    pub pi_consistent: Vec<f64>,
    /// standard deviations of `phi`: data and prior
    pub phi_std: Vec<f64>,
    /// strength of the prior
    pub prior_strength: f64,
    /// how it was chosen
    pub trials: Vec<Trial>,
    /// smallest over largest eigenvalue of any pseudo-inertia, and the body
    pub margin: Option<(f64, String)>,
    /// whether every body can exist and no friction or armature is negative
    pub consistent: bool,
    /// essential parameters
    pub essential: Essential,
    /// covariance of the residual between actuators, (N m)²
    pub residual_covariance: Mat<f64>,
    /// residuals of the filtered equations: fit and holdout, of the nominal and of this model
    pub errors: [[Option<Errors>; 2]; 2],
    /// the same of the estimate without prior and consistency, and of the essential parameters
    pub other_errors: [[Option<Errors>; 2]; 2],
    /// names of the records: fit and holdout
    pub records: [Vec<String>; 2],
    /// everything imperfect
    pub warnings: Vec<Warning>,
}

/// That factors hold the same numbers.
fn twice(factors: &[Factor]) -> Option<Warning> {
    let (k, l) = (0..factors.len())
        .flat_map(|l| (0..l).map(move |k| (k, l)))
        .find(|&(k, l)| factors[k].same(&factors[l]))?;
    Some(Warning::new(
        WarningKind::LogSuspect,
        "factors",
        format!(
            "number {} and number {} hold the same numbers: a record that counts twice makes every ± too small",
            k + 1,
            l + 1
        ),
    ))
}

/// Identifies a plant from condensed records.
///
/// # Errors
/// A robot or parameters that are not those of the factors; a method that needs the samples; as
/// [`identify`](super::identify).
pub fn merge(plant: &Plant, factors: Vec<Factor>, settings: &Settings) -> Result<Merged> {
    if !matches!(settings.method, Method::Ols | Method::Wls) {
        return Err(Error::Argument(
            "factors hold sums of products, not samples: the methods for them are ols and wls"
                .into(),
        ));
    }
    let twice = twice(&factors);
    let mut all = factors.into_iter();
    let first = all.next().ok_or_else(|| {
        Error::Argument("no factor is named; make some with `excite condense`".into())
    })?;
    let factor = all.try_fold(first, Factor::with)?;
    let base = plant.base()?;
    let header = &factor.header;
    let names: Vec<&str> = (0..base.count()).map(|k| base.name(k)).collect();
    if header.hash != plant.robot().hash || header.names != names {
        return Err(Error::Infeasible(format!(
            "the factors are of another robot than {}, or of other parameters; name the robot file that they were \
             condensed with",
            plant.name()
        )));
    }
    let mut warnings = plant.warnings().to_vec();
    warnings.extend(base.warnings.iter().cloned());
    warnings.extend(header.warnings.iter().cloned());
    warnings.extend(twice);
    let part = &header.parts[0];
    let fitted = factor.fitted();
    let rows: f64 = part.used.iter().sum();
    if rows < base.count() as f64 {
        return Err(Error::Infeasible(format!(
            "{rows} filtered equations cannot give {} base parameters: add records",
            base.count()
        )));
    }
    let Estimate { weights, alone, pi } = estimate(&fitted, part, settings.method)?;
    let of = |s: &Stack, w: &Weights| linear::factor(&linear::fold_factors(&[s], w, 1));
    let folds = factor.folds(0).iter().map(|s| of(s, &alone)).collect();
    let whole = of(&fitted, &weights);
    let solution = linear::solve(whole.as_ref())?;
    let inflation = (part.inflated / rows).max(1.0);
    let freedom = rows / (rows - base.count() as f64).max(1.0);
    let covariance =
        &linear::inverse_information(solution.r.as_ref())? * faer::Scale(inflation * freedom);
    let normal = Normal {
        folds,
        factor: whole,
        pi,
        r: solution.r,
        condition: 1.0 / solution.reciprocal_condition.max(1e-300),
        weak: solution.weak,
        covariance,
        inflation,
    };
    warnings.extend(normal.warning(&base));
    let found = standard::estimate(plant, &base, &normal, settings, &mut warnings)?;
    let essential = essential::reduce(normal.factor.as_ref(), rows as usize, inflation)?;
    let nominal = base.project(&plant.values());
    let joints: Vec<String> = plant.actuators().iter().map(|j| j.name.clone()).collect();
    let holdout = factor.folds(1);
    let errors_of = |models: [&[f64]; 2]| {
        let of = |stacks: &[Stack], part: &Part| models.map(|pi| errors(stacks, part, pi, &joints));
        let [fit, other] = &header.parts;
        [of(std::slice::from_ref(&fitted), fit), of(&holdout, other)]
    };
    let errors = errors_of([&nominal, &found.pi]);
    let other_errors = errors_of([&normal.pi, &essential.pi]);
    let of = |k: usize| errors[1][k].as_ref().map(|e: &Errors| e.relative_error);
    if let (Some(before), Some(after)) = (of(0), of(1))
        && after > before
    {
        warnings.push(doubts::worse_than_nominal(after, before));
    }
    Ok(Merged {
        residual_covariance: covariance_of(&fitted, part, &normal.pi),
        std: normal.std(),
        pi: normal.pi,
        covariance: normal.covariance,
        inflation,
        condition: normal.condition,
        phi: found.phi,
        pi_consistent: found.pi,
        phi_std: found.std,
        prior_strength: found.strength,
        trials: found.trials,
        margin: found.margin,
        consistent: found.consistent,
        essential,
        errors,
        other_errors,
        records: [0, 1].map(|p| header.parts[p].records.clone()),
        warnings,
        base,
    })
}

/// Covariance of the residual between actuators: that of the rows, with the number of equations that they stand for.
fn covariance_of(fitted: &Stack, part: &Part, pi: &[f64]) -> Mat<f64> {
    let n = part.used.len();
    let c = weights::residual_covariance(&[fitted], pi);
    let taken = pi.len() as f64 / n.max(1) as f64;
    let had = (fitted.count as f64 - taken).max(1.0);
    let freedom = |a: usize| (part.used[a] - taken).max(1.0);
    Mat::from_fn(n, n, |a, b| {
        c[(a, b)] * had / (freedom(a) * freedom(b)).sqrt()
    })
}

/// Base parameters and what they were weighted with.
pub(super) struct Estimate {
    pub weights: Weights,
    /// of each actuator alone, as the folds need them
    pub alone: Weights,
    pub pi: Vec<f64>,
}

/// As the estimators of [`super::method`], step by step.
pub(super) fn estimate(fitted: &Stack, part: &Part, method: Method) -> Result<Estimate> {
    let n = part.used.len();
    let solve = |w: &Weights| -> Result<Vec<f64>> {
        let factor = linear::factor(&linear::fold_factors(&[fitted], w, 1));
        Ok(linear::solve(factor.as_ref())?.pi)
    };
    let covariance = |pi: &[f64]| weights::least(covariance_of(fitted, part, pi), &part.largest);
    let pi = solve(&Weights::diagonal(&vec![1.0; n]))?;
    let c = covariance(&pi);
    if method == Method::Ols {
        let mean = (0..n).map(|a| c[(a, a)]).sum::<f64>() / n.max(1) as f64;
        let weights = Weights::diagonal(&vec![mean.sqrt(); n]);
        return Ok(Estimate {
            alone: weights.clone(),
            weights,
            pi,
        });
    }
    let mut alone = Weights::diagonal(&linear::deviations(&c));
    let mut weights = alone.clone();
    let mut pi = solve(&weights)?;
    for _ in 0..COVARIANCE_ROUNDS {
        let c = covariance(&pi);
        alone = Weights::diagonal(&linear::deviations(&c));
        weights = Weights::covariance(c.as_ref());
        pi = solve(&weights)?;
    }
    Ok(Estimate { weights, alone, pi })
}

fn errors(stacks: &[Stack], part: &Part, pi: &[f64], joints: &[String]) -> Option<Errors> {
    if part.records.is_empty() {
        return None;
    }
    let mut sums = vec![0.0; joints.len()];
    for s in stacks {
        let e = s.residual(pi);
        for (a, sum) in sums.iter_mut().enumerate() {
            *sum += e[a * s.count..(a + 1) * s.count]
                .iter()
                .map(|x| x * x)
                .sum::<f64>();
        }
    }
    let ratio = |e: f64, t: f64| (e / t.max(1e-300)).sqrt();
    let joint = |(a, name): (usize, &String)| JointError {
        joint: name.clone(),
        rms: (sums[a] / part.used[a].max(1.0)).sqrt(),
        relative_error: ratio(sums[a], part.energy[a]),
    };
    Some(Errors {
        relative_error: ratio(sums.iter().sum(), part.energy.iter().sum()),
        joints: joints.iter().enumerate().map(joint).collect(),
    })
}

impl Merged {
    /// The robot that was identified.
    pub fn robot(&self, plant: &Plant) -> Robot {
        measured(plant, &self.phi)
    }

    /// `merged.json`.
    pub fn json(&self, plant: &Plant) -> Value {
        let rows = |m: &Mat<f64>| -> Vec<Vec<f64>> {
            let row = |i: usize| (0..m.ncols()).map(|j| m[(i, j)]).collect();
            (0..m.nrows()).map(row).collect()
        };
        let pair = |k: usize| {
            let of = |p: usize| self.errors[p][k].as_ref().map(|e| e.relative_error);
            json!({ "fit": of(0), "holdout": of(1) })
        };
        json!({
            "robot": plant.name(),
            "robot_hash": plant.robot().hash,
            "joints": plant.actuators().iter().map(|j| j.name.as_str()).collect::<Vec<_>>(),
            "records": { "fit": self.records[0], "holdout": self.records[1] },
            "parameters": plant.parameters().iter().enumerate().map(|(u, p)| json!({
                "name": p.name, "unit": p.unit, "value": self.phi[u], "std": self.phi_std[u], "nominal": p.value,
            })).collect::<Vec<_>>(),
            "base_parameters": (0..self.base.count()).map(|a| json!({
                "name": self.base.name(a), "combination": self.base.combination(a),
                "value": self.pi_consistent[a], "unconstrained": self.pi[a], "std": self.std[a],
            })).collect::<Vec<_>>(),
            "base_covariance": rows(&self.covariance),
            "residual_covariance": rows(&self.residual_covariance),
            "condition_number": { "weighted": self.condition },
            "variance_inflation": self.inflation,
            "prior": { "strength": self.prior_strength, "cross_validation": self.trials },
            "physically_consistent": self.consistent,
            "essential_parameters": { "count": self.essential.kept.len() },
            "relative_error": { "nominal": pair(0), "model": pair(1) },
            "validation": { "fit": self.errors[0][1], "holdout": self.errors[1][1] },
            "warnings": self.warnings,
        })
    }
}
