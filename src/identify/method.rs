//! The estimators of the base parameters: each gives `π̂` and the weights of its rows.
//!
//! Ordinary least squares comes first; its residual gives the covariance `Σ` between actuators, which
//! weighted least squares refines twice. The other methods start from there.

use super::equations::Fit;
use super::linear::{self, Weights};
use super::settings::Method;
use super::stack::Stack;
use super::weights;
use crate::error::{Error, Result, Warning};
use crate::signals::Prepared;
use faer::Mat;

/// Rounds of robust weights: Huber's, then Tukey's.
const ROBUST_ROUNDS: [usize; 2] = [4, 4];
/// Rounds of the covariance between actuators.
const COVARIANCE_ROUNDS: usize = 2;

/// Base parameters by a method alone.
pub struct Estimate {
    /// weights that the rows have at the end
    pub weights: Weights,
    /// `π̂`
    pub pi: Vec<f64>,
    /// share of the samples that the robust method set aside
    pub outliers: Option<f64>,
}

/// Estimates the base parameters. What follows another joint is then fitted aside, so that friction does
/// not take it up, and the estimate repeated.
///
/// # Errors
/// Records that lack what the method needs; a pose of a parallel robot that cannot be reached.
pub fn estimate(fit: &mut Fit, method: Method, warnings: &mut Vec<Warning>) -> Result<Estimate> {
    let first = by(fit, method)?;
    match fit.set_aside(&first.pi, warnings)? {
        true => by(fit, method),
        false => Ok(first),
    }
}

/// Ordinary or weighted least squares of equations alone.
///
/// # Errors
/// Numbers that are not finite.
pub fn of_stacks(stacks: &[&Stack], method: Method) -> Result<Estimate> {
    match method {
        Method::Ols => ordinary(stacks),
        _ => weighted(stacks),
    }
}

fn by(fit: &Fit, method: Method) -> Result<Estimate> {
    let stacks = fit.stacks();
    match method {
        Method::Ols => ordinary(&stacks),
        Method::Wls => weighted(&stacks),
        Method::Robust => robust(&stacks, weighted(&stacks)?),
        Method::Ml => maximum_likelihood(fit, weighted(&stacks)?),
        Method::Iv => instrumental(fit, weighted(&stacks)?),
    }
}

fn least_squares(fit: &[&Stack], weights: &Weights) -> Result<Vec<f64>> {
    let factor = linear::factor(&linear::fold_factors(fit, weights, 1));
    Ok(linear::solve(factor.as_ref())?.pi)
}

/// Least squares with these weights, as an estimate.
fn with(fit: &[&Stack], weights: Weights) -> Result<Estimate> {
    Ok(Estimate {
        pi: least_squares(fit, &weights)?,
        weights,
        outliers: None,
    })
}

fn unweighted(fit: &[&Stack]) -> Result<Vec<f64>> {
    least_squares(fit, &Weights::diagonal(&vec![1.0; fit[0].actuators]))
}

fn covariance(fit: &[&Stack], pi: &[f64]) -> Mat<f64> {
    weights::floored(weights::residual_covariance(fit, pi), fit)
}

/// All rows alike, with one scale for all, so that variances come out in units of the residual.
fn ordinary(fit: &[&Stack]) -> Result<Estimate> {
    let n = fit[0].actuators;
    let pi = unweighted(fit)?;
    let c = covariance(fit, &pi);
    let mean = (0..n).map(|a| c[(a, a)]).sum::<f64>() / n as f64;
    Ok(Estimate {
        weights: Weights::diagonal(&vec![mean.sqrt(); n]),
        pi,
        outliers: None,
    })
}

/// Weighted by the covariance of the residual between actuators. Variances alone come first: a covariance
/// of residuals that are far off is of no use.
fn weighted(fit: &[&Stack]) -> Result<Estimate> {
    let pi = unweighted(fit)?;
    let sigma = linear::deviations(&covariance(fit, &pi));
    let mut out = with(fit, Weights::diagonal(&sigma))?;
    for _ in 0..COVARIANCE_ROUNDS {
        let c = covariance(fit, &out.pi);
        out = with(fit, Weights::covariance(c.as_ref()))?;
    }
    Ok(out)
}

/// Huber's, then Tukey's weights, relative to those of `start`.
fn robust(fit: &[&Stack], start: Estimate) -> Result<Estimate> {
    let plain = start.weights.clone();
    let mut out = start;
    let [huber, tukey] = ROBUST_ROUNDS;
    for round in 0..huber + tukey {
        let (weights, light) = weights::robust(fit, &plain, &out.pi, round >= huber);
        out = with(fit, weights)?;
        out.outliers = Some(light);
    }
    Ok(out)
}

/// Weights from the scatter of the periods (Swevers et al. 1997).
fn maximum_likelihood(fit: &Fit, start: Estimate) -> Result<Estimate> {
    let stacks = fit.stacks();
    let weights =
        weights::maximum_likelihood(fit.plant, fit.base, &fit.prepared, &stacks, &start.pi)?;
    match weights {
        Some(w) => with(&stacks, w),
        None => Err(Error::Infeasible(
            "maximum likelihood needs the scatter of repeated periods: state `period` of every fit \
             record, with two whole periods or more, or use --method wls"
                .into(),
        )),
    }
}

/// The regressor along the commanded motion as instruments (IDIM-IV, Janot, Vandanjon & Gautier 2014).
fn instrumental(fit: &Fit, start: Estimate) -> Result<Estimate> {
    let mut instruments = Vec::new();
    for (p, r) in fit.prepared.iter().zip(&fit.records) {
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
        let mut s = fit.signals.clone();
        s.position_cutoff = p
            .position_cutoff
            .iter()
            .cloned()
            .reduce(f64::max)
            .filter(|f| f.is_finite());
        let q = Prepared::new(&command, fit.plant, &s)?;
        instruments.push(Stack::with_motion(fit.plant, fit.base, p, &q.motion)?);
    }
    Ok(Estimate {
        pi: weights::instrumental(&fit.stacks(), &instruments, &start.weights)?,
        ..start
    })
}
