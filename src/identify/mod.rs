//! Identification: from records to parameters that can be trusted.
//!
//! ```text
//! records ─ signals ─▶ W_b, τ ─ method ─▶ π̂, Λ ─ prior, consistency ─▶ φ ─▶ report
//! ```
//!
//! 1. [`stack`]: the filtered equations `W_b π = τ` of each record.
//!    Those of joints that stand still are left out of the fit ([`standstill`]).
//! 2. [`Method`]: base parameters `π̂` and their information `Λ`, from rows compressed by blocks
//!    ([`linear`]).
//! 3. [`uncertainty`]: their covariance with the residual's correlation in time.
//! 4. [`consistent`]: standard parameters that a robot can have; the strength of the prior is chosen by
//!    cross-validation over contiguous parts of the fit records.
//! 5. [`validation`]: residuals on fit and holdout records.

pub mod aside;
pub mod consistent;
pub mod essential;
pub mod json;
pub mod linear;
pub mod lmi;
pub mod page;
pub mod stack;
pub mod standstill;
pub mod uncertainty;
pub mod validation;
pub mod weights;

use crate::base::BaseParameters;
use crate::error::{Error, Result, Warning, WarningKind};
use crate::log::{Payload, Purpose, Record};
use crate::plant::Plant;
use crate::signals::{self, Prepared};
use faer::Mat;
use linear::Weights;
use rayon::prelude::*;
use stack::Stack;
use validation::Validation;

/// How base parameters are estimated from the equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// ordinary least squares: all rows alike
    Ols,
    /// weighted by the full covariance of the residual between actuators, iterated
    #[default]
    Wls,
    /// the same with Huber's, then Tukey's weights against outliers
    Robust,
    /// maximum likelihood with the noise of torques and positions from the scatter of the periods
    /// (Swevers et al. 1997)
    Ml,
    /// instrumental variables: the regressor along the commanded motion as instruments (IDIM-IV,
    /// Janot, Vandanjon & Gautier 2014)
    Iv,
}

/// How the standard parameters are kept physical.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Consistency {
    /// entropic distance from the nominal bodies
    #[default]
    Entropic,
    /// linear matrix inequalities and a quadratic distance
    Lmi,
    /// not at all: unidentifiable directions stay nominal, bodies may be impossible
    Free,
}

/// Settings of [`identify`].
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// estimator of the base parameters
    pub method: Method,
    /// what standard parameters must be
    pub consistency: Consistency,
    /// strength `γ` of the prior; `None` for cross-validation
    pub prior_strength: Option<f64>,
    /// preparation of the signals
    pub signals: signals::Settings,
}

/// Cross-validation of one strength of the prior.
#[derive(Debug, Clone, Copy, serde::Serialize)]
pub struct Trial {
    /// strength `γ`
    pub strength: f64,
    /// squared weighted residual on the parts that were left out, mean over the parts
    pub error: f64,
    /// how much it is larger than that of the best strength
    pub worse: f64,
    /// standard error of that difference over the parts
    pub chance: f64,
}

/// What identification came to.
#[derive(Debug, Clone)]
pub struct Identification {
    /// base parameters of the plant
    pub base: BaseParameters,
    /// estimate of the base parameters by the method alone
    pub pi: Vec<f64>,
    /// standard deviations of it, correlation in time included
    pub std: Vec<f64>,
    /// the whole covariance
    pub covariance: Mat<f64>,
    /// standard deviations that the robot file's torque noise promises, white
    pub predicted_std: Vec<f64>,
    /// variance through correlation in time, relative to white residuals
    pub inflation: f64,
    /// standard parameters, physically consistent unless asked otherwise
    pub phi: Vec<f64>,
    /// base parameters of `phi`
    pub pi_consistent: Vec<f64>,
    /// standard deviations of `phi`: data and prior
    pub phi_std: Vec<f64>,
    /// strength of the prior that was used
    pub prior_strength: f64,
    /// how it was chosen
    pub trials: Vec<Trial>,
    /// smallest over largest eigenvalue of any pseudo-inertia, and the body
    pub margin: Option<(f64, String)>,
    /// whether every body can exist and no friction or armature is negative
    pub consistent: bool,
    /// essential parameters
    pub essential: essential::Essential,
    /// condition number of the weighted equations
    pub condition: f64,
    /// covariance of the residual between actuators, (N m)²
    pub residual_covariance: Mat<f64>,
    /// share of the samples that the robust method set aside
    pub outliers: Option<f64>,
    /// residuals record by record, of the base estimate and of the consistent one
    pub validation: Validation,
    /// records as they were used, in the order of the experiment
    pub prepared: Vec<Prepared>,
    /// everything imperfect
    pub warnings: Vec<Warning>,
}

/// Contiguous parts of each record for cross-validation.
const FOLDS: usize = 5;
/// Strengths of the prior that are tried.
const STRENGTHS: [f64; 8] = [1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3, 1e4, 1e5];

/// Identifies a plant from records.
///
/// # Errors
/// No record for the fit, settings that cannot be, records that carry an unknown payload.
pub fn identify(plant: &Plant, records: &[Record], settings: &Settings) -> Result<Identification> {
    let mut warnings: Vec<Warning> = plant.warnings().to_vec();
    warnings.extend(records.iter().flat_map(|r| r.warnings.clone()));
    for r in records {
        if r.payload != Payload::None {
            warnings.push(Warning::new(WarningKind::RecordLeftOut,
                r.path.display().to_string(),
                "it was recorded with a payload and is left out here; `excite load` identifies payloads",
            ));
        }
        if r.tau.is_empty() {
            let message = "it has no columns tau1…, which identification needs";
            return Err(Error::file(&r.path, "line 1", message));
        }
    }
    let records: Vec<&Record> = records
        .iter()
        .filter(|r| r.payload == Payload::None)
        .collect();
    if !records.iter().any(|r| r.purpose == Purpose::Fit) {
        return Err(Error::Infeasible(
            "no record without payload is for the fit (use = \"fit\"): nothing to identify from"
                .into(),
        ));
    }
    // all records through the same filter
    let mut settings = settings.clone();
    settings.signals.cutoff.get_or_insert_with(|| {
        signals::common_cutoff(
            records
                .iter()
                .copied()
                .filter(|r| r.purpose == Purpose::Fit),
        )
    });
    let settings = &settings;
    let base = plant.base()?;
    warnings.extend(base.warnings.iter().cloned());
    let prepared = records
        .par_iter()
        .map(|r| Prepared::new(r, plant, &settings.signals))
        .collect::<Result<Vec<_>>>()?;
    warnings.extend(prepared.iter().flat_map(|p| p.warnings.clone()));
    let stacks = prepared
        .par_iter()
        .map(|p| Stack::new(plant, &base, p))
        .collect::<Result<Vec<_>>>()?;
    let fit: Vec<&Stack> = stacks
        .iter()
        .filter(|s| s.purpose == Purpose::Fit)
        .collect();
    let fit_prepared: Vec<&Prepared> = prepared
        .iter()
        .filter(|p| p.purpose == Purpose::Fit)
        .collect();
    let fit_records: Vec<&Record> = records
        .iter()
        .copied()
        .filter(|r| r.purpose == Purpose::Fit)
        .collect();
    let rows: usize = fit.iter().map(|s| s.equations()).sum();
    if rows < base.count() {
        return Err(Error::Infeasible(format!(
            "{rows} filtered equations cannot give {} base parameters: record longer, or raise the cut-off",
            base.count()
        )));
    }
    warnings.extend(validation::unit_suspicions(plant, &base, &fit));

    let (moving, note) = standstill::left_out(plant, &fit, &fit_prepared)?;
    warnings.extend(note);
    let fit: Vec<&Stack> = match &moving {
        Some(stacks) => stacks.iter().collect(),
        None => fit,
    };
    let rows: usize = fit.iter().map(|s| s.equations()).sum();

    // the method
    let first = base_estimate(plant, &base, &fit, &fit_prepared, &fit_records, settings)?;
    // what goes with another joint is fitted aside, so that friction does not take it up
    let (aside, notes) = aside::apart(plant, &fit, &fit_prepared, &first.pi)?;
    warnings.extend(notes);
    let fit: Vec<&Stack> = match &aside {
        Some(stacks) => stacks.iter().collect(),
        None => fit,
    };
    let first = match aside {
        Some(_) => base_estimate(plant, &base, &fit, &fit_prepared, &fit_records, settings)?,
        None => first,
    };
    let (weights, pi, outliers) = (first.weights, first.pi, first.outliers);
    warnings.extend(first.warnings);
    let folds = linear::fold_factors(&fit, &weights, FOLDS);
    let whole = linear::factor(&folds);
    let solution = linear::solve(whole.as_ref())?;
    if !solution.weak.is_empty() {
        let names: Vec<&str> = solution.weak.iter().map(|&k| base.name(k)).collect();
        warnings.push(Warning::new(WarningKind::NotExcited,
            "information",
            format!(
                "the motion says nothing of some combinations of {}: they keep their nominal values; \
                 excite them, or lock what does not move",
                names.join(", ")
            ),
        ));
    }
    let covariance = uncertainty::covariance(&fit, &weights, &pi, solution.r.as_ref())?;
    let inflation = covariance.inflation.max(1.0);
    let residual_covariance = weights::residual_covariance(&fit, &pi);

    // standard parameters
    let b = base.count();
    let p = base.names.len();
    let projection = projection(&base);
    let estimate_of = |u: usize| base.kept.iter().position(|&k| k == u).map(|a| pi[a]);
    let prior = consistent::Prior::new(plant, &estimate_of);
    warnings.extend(prior.warnings.iter().cloned());
    let scaled = |r: &Mat<f64>, pi: &[f64]| -> (Mat<f64>, Vec<f64>) {
        let root = 1.0 / inflation.sqrt();
        let r = Mat::from_fn(b, b, |i, j| if j >= i { root * r[(i, j)] } else { 0.0 });
        let d = (0..b)
            .map(|i| (i..b).map(|j| r[(i, j)] * pi[j]).sum())
            .collect();
        (&r * &projection, d)
    };
    let free = settings.consistency == Consistency::Free;
    let mut trials = Vec::new();
    let strength = match settings.prior_strength {
        Some(s) if s > 0.0 && s.is_finite() => s,
        Some(s) => {
            return Err(Error::Argument(format!(
                "a prior strength of {s}: it must be positive; 4 stands for a prior good to 50 %, 100 to 10 %"
            )));
        }
        None if free => 1e-2,
        None => {
            trials = cross_validate(&folds, &prior, &projection, inflation)?;
            trials
                .iter()
                .min_by(|a, b| a.error.total_cmp(&b.error))
                .map_or(1.0, |t| t.strength)
        }
    };
    let (c, d) = scaled(&solution.r, &pi);
    let entropic = consistent::solve(c.as_ref(), &d, &prior, strength, None)?;
    let phi = match settings.consistency {
        Consistency::Entropic => entropic.phi,
        Consistency::Lmi => lmi::solve(c.as_ref(), &d, &prior, strength)?,
        Consistency::Free => nearest(&base, &pi, &plant.values()),
    };
    let hessian = linear::inverse_information(entropic_root(&entropic.hessian)?.as_ref())?;
    let phi_std: Vec<f64> = (0..p).map(|i| hessian[(i, i)].max(0.0).sqrt()).collect();
    let pi_consistent = base.project(&phi);
    let margin = prior.margin(&phi).map(|(m, name)| (m, name.to_string()));
    let consistent = margin.as_ref().is_none_or(|m| m.0 > 0.0)
        && prior.terms.iter().all(|t| phi[t.unknown] >= 0.0);

    let essential = essential::reduce(whole.as_ref(), rows, inflation)?;
    let std = (0..b)
        .map(|i| covariance.matrix[(i, i)].max(0.0).sqrt())
        .collect();
    let predicted_std = predicted(plant, &fit)?;
    let validation = validation::validate(
        plant,
        &base,
        &records,
        &stacks,
        &prepared,
        settings,
        &pi,
        &pi_consistent,
        &essential.pi,
    )?;
    Ok(Identification {
        pi,
        std,
        covariance: covariance.matrix,
        predicted_std,
        inflation,
        phi,
        pi_consistent,
        phi_std,
        prior_strength: strength,
        trials,
        margin,
        consistent,
        essential,
        condition: 1.0 / solution.reciprocal_condition.max(1e-300),
        residual_covariance,
        outliers,
        validation,
        prepared,
        warnings,
        base,
    })
}

/// Square root of a Hessian, as a triangular factor.
fn entropic_root(h: &Mat<f64>) -> Result<Mat<f64>> {
    let p = h.nrows();
    let s: Vec<f64> = (0..p).map(|i| h[(i, i)].max(1e-300).sqrt()).collect();
    let scaled = Mat::from_fn(p, p, |i, j| {
        h[(i, j)] / (s[i] * s[j]) + if i == j { 1e-14 } else { 0.0 }
    });
    let factor = scaled
        .llt(faer::Side::Lower)
        .map_err(|_| Error::Infeasible("the Hessian is not positive definite".into()))?;
    let l = factor.L();
    Ok(Mat::from_fn(p, p, |i, j| l[(j, i)] * s[j]))
}

/// `P`: `π = P φ`.
pub fn projection(base: &BaseParameters) -> Mat<f64> {
    let mut p = Mat::zeros(base.count(), base.names.len());
    for a in 0..base.count() {
        p[(a, base.kept[a])] = 1.0;
        for (d, &j) in base.dropped.iter().enumerate() {
            p[(a, j)] = base.k[(a, d)];
        }
    }
    p
}

/// Standard parameters with these base parameters that differ from the nominal ones in the kept
/// columns alone.
fn nearest(base: &BaseParameters, pi: &[f64], nominal: &[f64]) -> Vec<f64> {
    let mut phi = nominal.to_vec();
    for (a, (x, y)) in pi.iter().zip(base.project(nominal)).enumerate() {
        phi[base.kept[a]] += x - y;
    }
    phi
}

struct BaseEstimate {
    weights: Weights,
    pi: Vec<f64>,
    outliers: Option<f64>,
    warnings: Vec<Warning>,
}

fn base_estimate(
    plant: &Plant,
    base: &BaseParameters,
    fit: &[&Stack],
    prepared: &[&Prepared],
    records: &[&Record],
    settings: &Settings,
) -> Result<BaseEstimate> {
    let n = fit[0].actuators;
    let least_squares = |w: &Weights| -> Result<Vec<f64>> {
        let f = linear::factor(&linear::fold_factors(fit, w, 1));
        Ok(linear::solve(f.as_ref())?.pi)
    };
    let mut out = BaseEstimate {
        weights: Weights::diagonal(&vec![1.0; n]),
        pi: Vec::new(),
        outliers: None,
        warnings: Vec::new(),
    };
    out.pi = least_squares(&out.weights)?;
    let covariance = |pi: &[f64]| weights::floored(weights::residual_covariance(fit, pi), fit);
    if settings.method == Method::Ols {
        // one scale for all, so that variances come out in units of the residual
        let c = covariance(&out.pi);
        let mean = (0..n).map(|a| c[(a, a)]).sum::<f64>() / n as f64;
        out.weights = Weights::diagonal(&vec![mean.sqrt(); n]);
        return Ok(out);
    }
    // variances alone first: a covariance of residuals that are far off is of no use
    let c = covariance(&out.pi);
    out.weights = Weights::diagonal(&weights::deviations(&c));
    out.pi = least_squares(&out.weights)?;
    for _ in 0..2 {
        out.weights = Weights::covariance(covariance(&out.pi).as_ref());
        out.pi = least_squares(&out.weights)?;
    }
    match settings.method {
        Method::Ols | Method::Wls => {}
        Method::Robust => {
            let plain = out.weights.clone();
            for round in 0..8 {
                let (w, light) = weights::robust(fit, &plain, &out.pi, round >= 4);
                out.pi = least_squares(&w)?;
                out.weights = w;
                out.outliers = Some(light);
            }
        }
        Method::Ml => match weights::maximum_likelihood(plant, base, prepared, fit, &out.pi)? {
            Some(w) => {
                out.pi = least_squares(&w)?;
                out.weights = w;
            }
            None => {
                return Err(Error::Infeasible(
                    "maximum likelihood needs the scatter of repeated periods: state `period` of every fit \
                     record, with two whole periods or more, or use --method wls"
                        .into(),
                ));
            }
        },
        Method::Iv => {
            let mut instruments = Vec::new();
            for (p, r) in prepared.iter().zip(records) {
                let Some(qref) = &r.qref else {
                    return Err(Error::file(
                        &r.path,
                        "line 1",
                        "instrumental variables need the commanded positions qref1…; use --method wls",
                    ));
                };
                let mut command = (*r).clone();
                command.q = qref.clone();
                (command.dq, command.ddq) = (None, None);
                let mut s = settings.signals.clone();
                s.position_cutoff = p
                    .position_cutoff
                    .iter()
                    .cloned()
                    .reduce(f64::max)
                    .filter(|f| f.is_finite());
                let q = Prepared::new(&command, plant, &s)?;
                instruments.push(Stack::with_motion(plant, base, p, &q.motion)?);
            }
            out.pi = weights::instrumental(fit, &instruments, &out.weights)?;
        }
    }
    Ok(out)
}

/// Error of each strength of the prior on contiguous parts that were left out.
fn cross_validate(
    folds: &[Mat<f64>],
    prior: &consistent::Prior,
    projection: &Mat<f64>,
    inflation: f64,
) -> Result<Vec<Trial>> {
    let b = projection.nrows();
    let root = 1.0 / inflation.sqrt();
    let errors: Vec<Vec<f64>> = (0..folds.len())
        .into_par_iter()
        .map(|left| {
            let others: Vec<Mat<f64>> = folds
                .iter()
                .enumerate()
                .filter(|(k, _)| *k != left)
                .map(|(_, f)| f.clone())
                .collect();
            let f = linear::factor(&others);
            let r = Mat::from_fn(b, b, |i, j| root * f[(i, j)]);
            let d: Vec<f64> = (0..b).map(|i| root * f[(i, b)]).collect();
            let c = &r * projection;
            let mut start: Option<Vec<f64>> = None;
            let mut out = vec![0.0; STRENGTHS.len()];
            for (k, &strength) in STRENGTHS.iter().enumerate().rev() {
                let e = consistent::solve(c.as_ref(), &d, prior, strength, start.as_deref())?;
                let pi: Vec<f64> = (0..b)
                    .map(|i| {
                        e.phi
                            .iter()
                            .enumerate()
                            .map(|(j, x)| projection[(i, j)] * x)
                            .sum()
                    })
                    .collect();
                let test = &folds[left];
                out[k] = (0..test.nrows())
                    .map(|i| {
                        let y: f64 = (0..b).map(|j| test[(i, j)] * pi[j]).sum();
                        (test[(i, b)] - y).powi(2)
                    })
                    .sum();
                start = Some(e.phi);
            }
            Ok(out)
        })
        .collect::<Result<_>>()?;
    let parts = folds.len() as f64;
    let mean = |k: usize| errors.iter().map(|e| e[k]).sum::<f64>() / parts;
    let best = (0..STRENGTHS.len())
        .min_by(|&a, &b| mean(a).total_cmp(&mean(b)))
        .unwrap_or(0);
    Ok(STRENGTHS
        .iter()
        .enumerate()
        .map(|(k, &strength)| {
            let worse = mean(k) - mean(best);
            let spread: f64 = errors
                .iter()
                .map(|e| (e[k] - e[best] - worse).powi(2))
                .sum();
            Trial {
                strength,
                error: mean(k),
                worse,
                chance: (spread / (parts * (parts - 1.0))).sqrt(),
            }
        })
        .collect())
}

/// Standard deviations that the stated torque noise promises: white, every recorded sample counted.
fn predicted(plant: &Plant, fit: &[&Stack]) -> Result<Vec<f64>> {
    let (sigma, _) = plant.torque_noise();
    let parts: Vec<Mat<f64>> = fit
        .par_iter()
        .map(|s| {
            let root = s.stands_for.sqrt();
            let n = s.count;
            let rows = Mat::from_fn(s.w.nrows(), s.w.ncols(), |i, j| {
                s.w[(i, j)] * root / sigma[i / n]
            });
            linear::factor(&[rows])
        })
        .collect();
    let inverse = linear::inverse_information(linear::factor(&parts).as_ref())?;
    Ok((0..inverse.nrows())
        .map(|i| inverse[(i, i)].max(0.0).sqrt())
        .collect())
}
