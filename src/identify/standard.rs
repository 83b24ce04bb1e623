//! From base parameters to standard parameters: all ten of each body, friction and armature.

use super::consistent::{self, Prior};
use super::cross_validation::{self, Trial};
use super::normal::Normal;
use super::settings::{Consistency, Settings};
use super::{linear, lmi};
use crate::base::BaseParameters;
use crate::error::{Error, Result, Warning};
use crate::plant::Plant;
use faer::Mat;

/// Strength of the prior where it only keeps the problem solvable.
const FAINT: f64 = 1e-2;

/// Standard parameters, and how near they are to what cannot exist.
pub struct Standard {
    /// standard parameters
    pub phi: Vec<f64>,
    /// standard deviations: data and prior
    pub std: Vec<f64>,
    /// base parameters of `phi`
    pub pi: Vec<f64>,
    /// strength of the prior that was used
    pub strength: f64,
    /// how it was chosen
    pub trials: Vec<Trial>,
    /// smallest over largest eigenvalue of any pseudo-inertia, and the body
    pub margin: Option<(f64, String)>,
    /// whether every body can exist and no friction or armature is negative
    pub consistent: bool,
}

/// The standard parameters that are nearest to the estimate and to the prior ([`consistent`]).
///
/// # Errors
/// A strength that is not positive; numbers that are not finite.
pub fn estimate(
    plant: &Plant,
    base: &BaseParameters,
    normal: &Normal,
    settings: &Settings,
    warnings: &mut Vec<Warning>,
) -> Result<Standard> {
    let estimate_of = |u: usize| {
        let kept = base.kept.iter().position(|&k| k == u);
        kept.map(|a| normal.pi[a])
    };
    let prior = Prior::new(plant, &estimate_of);
    warnings.extend(prior.warnings.iter().cloned());
    let projection = projection(base);
    let (strength, trials) = strength(normal, &prior, &projection, settings)?;
    let (c, d) = normal.whitened(&projection);
    let entropic = consistent::solve(c.as_ref(), &d, &prior, strength, None)?;
    let phi = match settings.consistency {
        Consistency::Entropic => entropic.phi,
        Consistency::Lmi => lmi::solve(c.as_ref(), &d, &prior, strength)?,
        Consistency::Free => nearest(base, &normal.pi, &plant.values()),
    };
    let inverse = linear::inverse_information(root(&entropic.hessian)?.as_ref())?;
    let margin = prior.margin(&phi).map(|(m, name)| (m, name.to_string()));
    let consistent = margin.as_ref().is_none_or(|m| m.0 > 0.0)
        && prior.terms.iter().all(|t| phi[t.unknown] >= 0.0);
    Ok(Standard {
        std: linear::deviations(&inverse),
        pi: base.project(&phi),
        phi,
        strength,
        trials,
        margin,
        consistent,
    })
}

/// The strength that the settings give, or the best of a cross-validation.
fn strength(
    normal: &Normal,
    prior: &Prior,
    projection: &Mat<f64>,
    settings: &Settings,
) -> Result<(f64, Vec<Trial>)> {
    match settings.prior_strength {
        Some(s) if s > 0.0 && s.is_finite() => Ok((s, Vec::new())),
        Some(s) => Err(Error::Argument(format!(
            "a prior strength of {s}: it must be positive; 4 stands for a prior good to 50 %, 100 to 10 %"
        ))),
        None if settings.consistency == Consistency::Free => Ok((FAINT, Vec::new())),
        None => {
            let trials =
                cross_validation::trials(&normal.folds, prior, projection, normal.inflation)?;
            Ok((cross_validation::best(&trials), trials))
        }
    }
}

/// Square root of a Hessian, as a triangular factor.
fn root(h: &Mat<f64>) -> Result<Mat<f64>> {
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

/// `T_b`: `π_b = T_b φ`.
fn projection(base: &BaseParameters) -> Mat<f64> {
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
