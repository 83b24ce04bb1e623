//! Accuracies that are asked for: a criterion of what a user counts, and not of eigenvalues.
//!
//! With `a_i` the standard deviation of parameter `i` that is good enough, `s_i` what is known of it before the run, and
//! `C = (κ Λ + diag(s_i)⁻²)⁻¹` its covariance after an experiment of `κ` times the samples of `Λ`, `ρ_i² = C_ii / a_i²`.
//! Two criteria are made of these, with weights `w_i` that are zero for what must be estimated along and is not asked for:
//!
//! | | `f` | |
//! |---|---|---|
//! | count | `ln Σ w_i ρ_i⁴/(1 + ρ_i⁴)` | parameters that will not be known |
//! | sum | `½ ln Σ w_i ρ_i²` | mean square of the standard deviations |
//!
//! The count is soft: it gains nothing where a parameter is known (`ρ_i ≪ 1`) or out of reach, and most where the motion
//! decides. So flat a function leads nowhere from afar: the first phase of a start minimises
//! `½ Σ w_i ln(1 + ρ_i²) / Σ w_i` instead.

/// A base parameter counts as known from this standard deviation, relative to its nominal value.
pub const TARGET: f64 = 0.1;
/// Standard deviation of the nominal values before the run, relative to them: a parameter that the motion cannot
/// tell keeps it, and does not count as a loss that could be mended.
const PRIOR: f64 = 1.0;
/// A nominal value below this share of the largest of its unit is judged as if it were that large.
const SMALLEST: f64 = 1e-3;
/// Exponents of the smoothing from which the count counts.
const COUNTED: f64 = 20.0;

/// What is done with the `ρ_i²`.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Count,
    Sum,
}

/// Accuracies that are asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Targets {
    /// `a_i √κ`
    pub(super) scale: Vec<f64>,
    /// `(a_i/s_i)²`
    pub(super) prior: Vec<f64>,
    /// `w_i`
    weight: Vec<f64>,
    kind: Kind,
}

/// What values of these units are judged as: their size, or a small share of the largest of the unit; 1 where all of a
/// unit are 0.
pub(super) fn sizes(nominal: &[f64], units: &[&str]) -> Vec<f64> {
    let largest = |unit: &str| {
        let same = nominal.iter().zip(units).filter(|(_, u)| **u == unit);
        same.fold(0.0_f64, |m, (v, _)| m.max(v.abs()))
    };
    let size = |(value, unit): (&f64, &&str)| {
        let size = value.abs().max(SMALLEST * largest(unit));
        if size > 0.0 { size } else { 1.0 }
    };
    nominal.iter().zip(units).map(size).collect()
}

impl Targets {
    /// Counts parameters known to [`TARGET`] of their nominal value; `κ` samples of the experiment for each of the
    /// optimiser's.
    pub fn new(nominal: &[f64], units: &[&str], kappa: f64) -> Self {
        let scale = sizes(nominal, units);
        let n = scale.len();
        Targets {
            scale: scale.iter().map(|s| TARGET * s * kappa.sqrt()).collect(),
            prior: vec![(TARGET / PRIOR).powi(2); n],
            weight: vec![1.0; n],
            kind: Kind::Count,
        }
    }

    /// Adds squares of standard deviations: of each parameter `(a_i, s_i, w_i)`.
    pub(super) fn sum(each: &[(f64, f64, f64)], kappa: f64) -> Self {
        Targets {
            scale: each.iter().map(|(a, _, _)| a * kappa.sqrt()).collect(),
            prior: each.iter().map(|(a, s, _)| (a / s).powi(2)).collect(),
            weight: each.iter().map(|(_, _, w)| *w).collect(),
            kind: Kind::Sum,
        }
    }

    /// The same for some of the parameters; the others are estimated along.
    pub(super) fn only(mut self, wanted: impl Fn(usize) -> bool) -> Self {
        for (i, w) in self.weight.iter_mut().enumerate() {
            if !wanted(i) {
                *w = 0.0;
            }
        }
        self
    }

    fn over(&self, variances: &[f64], f: impl Fn(f64) -> f64) -> f64 {
        let each = self.weight.iter().zip(variances);
        each.map(|(w, v)| if *w == 0.0 { 0.0 } else { w * f(*v) })
            .sum()
    }

    /// The criterion, of the `ρ²`.
    pub(super) fn value(&self, variances: &[f64]) -> f64 {
        match self.kind {
            Kind::Count => self
                .over(variances, |v| v * v / (1.0 + v * v))
                .max(1e-300)
                .ln(),
            Kind::Sum => 0.5 * self.over(variances, |v| v).max(1e-300).ln(),
        }
    }

    /// What leads there, at exponent `p` of the smoothing.
    pub(super) fn smooth_value(&self, variances: &[f64], p: f64) -> f64 {
        match self.kind {
            Kind::Count if p < COUNTED => {
                0.5 * self.over(variances, f64::ln_1p) / self.over(variances, |_| 1.0)
            }
            _ => self.value(variances),
        }
    }

    /// Derivatives of [`Targets::smooth_value`] by the `ρ²`.
    pub(super) fn slopes(&self, variances: &[f64], p: f64) -> Vec<f64> {
        let count = self.over(variances, |_| 1.0);
        let missed = self.over(variances, |v| v * v / (1.0 + v * v)).max(1e-300);
        let total = self.over(variances, |v| v).max(1e-300);
        let slope = |(w, v): (&f64, &f64)| match self.kind {
            Kind::Count if p < COUNTED => 0.5 * w / (count * (1.0 + v)),
            Kind::Count => 2.0 * w * v / ((1.0 + v * v).powi(2) * missed),
            Kind::Sum => 0.5 * w / total,
        };
        self.weight.iter().zip(variances).map(slope).collect()
    }
}
