//! The normal equations of the weighted rows: what the fit says of `π`, compressed.
//!
//! ```text
//! [W̃ τ̃] = Q [R r; 0 ρ],   Λ = RᵀR / inflation
//! ```

use super::cross_validation::FOLDS;
use super::equations::Fit;
use super::linear;
use super::method::Estimate;
use super::uncertainty;
use crate::base::BaseParameters;
use crate::error::{Result, Warning, WarningKind};
use faer::Mat;

/// Factors of the weighted rows, and the covariance of the estimate.
pub struct Normal {
    /// factors of contiguous parts of the records, for cross-validation
    pub folds: Vec<Mat<f64>>,
    /// `[R r; 0 ρ]` of all rows
    pub factor: Mat<f64>,
    /// `π̂` of the method
    pub pi: Vec<f64>,
    /// `R`, `b × b`
    pub r: Mat<f64>,
    /// condition number of `R` with unit columns
    pub condition: f64,
    /// base parameters that directions without information are made of
    pub weak: Vec<usize>,
    /// covariance of `π̂`, correlation in time included
    pub covariance: Mat<f64>,
    /// variance through correlation in time, relative to white residuals; at least 1
    pub inflation: f64,
}

impl Normal {
    /// Factors the rows with the weights of an estimate.
    ///
    /// # Errors
    /// Numbers that are not finite.
    pub fn new(fit: &Fit, estimate: &Estimate) -> Result<Self> {
        let stacks = fit.stacks();
        let folds = linear::fold_factors(&stacks, &estimate.weights, FOLDS);
        let factor = linear::factor(&folds);
        let solution = linear::solve(factor.as_ref())?;
        let (weights, pi) = (&estimate.weights, estimate.pi.clone());
        let covariance = uncertainty::covariance(&stacks, weights, &pi, solution.r.as_ref())?;
        Ok(Normal {
            folds,
            factor,
            pi,
            r: solution.r,
            condition: 1.0 / solution.reciprocal_condition.max(1e-300),
            weak: solution.weak,
            covariance: covariance.matrix,
            inflation: covariance.inflation.max(1.0),
        })
    }

    /// Names the parameters that the motion says nothing of.
    pub fn warning(&self, base: &BaseParameters) -> Option<Warning> {
        let names: Vec<&str> = self.weak.iter().map(|&k| base.name(k)).collect();
        (!names.is_empty()).then(|| {
            Warning::new(
                WarningKind::NotExcited,
                "information",
                format!(
                    "the motion says nothing of some combinations of {}: they keep their nominal values; \
                     excite them, or lock what does not move",
                    names.join(", ")
                ),
            )
        })
    }

    /// `C` and `d` with `‖C φ − d‖² = (P φ − π̂)ᵀ Λ (P φ − π̂)`; `projection` is `P`.
    pub fn whitened(&self, projection: &Mat<f64>) -> (Mat<f64>, Vec<f64>) {
        let b = self.pi.len();
        let root = 1.0 / self.inflation.sqrt();
        let upper = |i, j| if j >= i { root * self.r[(i, j)] } else { 0.0 };
        let r = Mat::from_fn(b, b, upper);
        let d = (0..b)
            .map(|i| (i..b).map(|j| r[(i, j)] * self.pi[j]).sum())
            .collect();
        (&r * projection, d)
    }

    /// Standard deviations of `π̂`.
    pub fn std(&self) -> Vec<f64> {
        linear::deviations(&self.covariance)
    }
}
