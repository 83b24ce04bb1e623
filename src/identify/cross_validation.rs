//! The strength of the prior, by cross-validation over contiguous parts of the fit records.

use super::consistent::{self, Prior};
use super::linear;
use crate::error::Result;
use faer::Mat;
use rayon::prelude::*;

/// Contiguous parts of each record for cross-validation.
pub const FOLDS: usize = 5;
/// Strengths of the prior that are tried.
const STRENGTHS: [f64; 8] = [1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3, 1e4, 1e5];

/// Cross-validation of one strength of the prior.
#[derive(Debug, Clone, Copy, serde::Serialize)]
#[non_exhaustive]
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

/// The strength with the smallest error.
pub fn best(trials: &[Trial]) -> f64 {
    trials
        .iter()
        .min_by(|a, b| a.error.total_cmp(&b.error))
        .map_or(1.0, |t| t.strength)
}

/// Error of each strength of the prior on contiguous parts that were left out. `folds` are the factors of
/// the parts, `inflation` the variance through correlated residuals.
///
/// # Errors
/// Numbers that are not finite.
pub fn trials(
    folds: &[Mat<f64>],
    prior: &Prior,
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
