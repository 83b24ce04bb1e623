//! Covariance of base parameters when residuals are correlated in time.
//!
//! Filtering makes neighbouring residuals alike, and so does everything that the model lacks. With
//! `Λ = Σ W̃ᵀW̃` of the weighted rows the estimate has the covariance
//!
//! ```text
//! C = Λ⁻¹ B Λ⁻¹,     B = Σ_a (1/m) Σ_f S_a(f) w̃_a(f)ᴴ w̃_a(f)
//! ```
//!
//! where `w̃_a(f)` is the discrete Fourier transform of the weighted rows of channel `a` and `S_a` the
//! spectrum of its residual, smoothed over neighbouring frequencies. This is the sandwich of Newey &
//! West (1987) with the lag window replaced by its spectral counterpart and the residual taken as
//! stationary, which halves its small-sample bias; for white residuals of unit variance `B = Λ`.

use super::linear::{self, Weights, inverse_information, weighted_row};
use super::stack::Stack;
use crate::error::Result;
use crate::plant::Plant;
use crate::signals::fourier::Plan;
use faer::{Mat, MatRef};
use rayon::prelude::*;

/// Covariance of the estimate, and how much the correlation in time costs.
#[derive(Debug, Clone)]
pub struct Covariance {
    /// `b × b`
    pub matrix: Mat<f64>,
    /// `tr(Λ⁻¹B)/b`: variance relative to white unit residuals
    pub inflation: f64,
}

/// Spectrum of a residual of which `used` samples are not left out (zero), 1 for white noise of unit
/// variance, smoothed over about `√m` bins.
fn smooth_spectrum(plan: &Plan, e: Vec<f64>, used: usize) -> Vec<f64> {
    let m = e.len();
    let raw: Vec<f64> = (plan.spectrum(e).iter())
        .map(|c| c.norm_sqr() / used.max(1) as f64)
        .collect();
    let half = raw.len();
    let wide = ((m as f64).sqrt() / 4.0).ceil().max(2.0) as isize;
    (0..half as isize)
        .map(|k| {
            let (mut sum, mut weight) = (0.0, 0.0);
            for d in -wide..=wide {
                // the spectrum of a real signal goes on mirrored; the mean itself was fitted away
                let i = (k + d).unsigned_abs();
                let i = if i >= half {
                    2 * (half - 1) - i.min(2 * (half - 1))
                } else {
                    i
                };
                if i == 0 {
                    continue;
                }
                let w = 1.0 - d.unsigned_abs() as f64 / (wide + 1) as f64;
                sum += w * raw[i];
                weight += w;
            }
            sum / weight.max(1e-300)
        })
        .collect()
}

/// Covariance of the weighted least-squares estimate `pi` with triangular factor `r`.
///
/// # Errors
/// Numbers that are not finite.
pub fn covariance(
    stacks: &[&Stack],
    weights: &Weights,
    pi: &[f64],
    r: MatRef<'_, f64>,
) -> Result<Covariance> {
    covariance_within(stacks, weights, pi, r, |count| count)
}

/// [`covariance`] with the spectra of the first samples of each record, as many as `within` says of its number: these stand for
/// all of them.
///
/// # Errors
/// Numbers that are not finite.
pub(super) fn covariance_within(
    stacks: &[&Stack],
    weights: &Weights,
    pi: &[f64],
    r: MatRef<'_, f64>,
    within: fn(usize) -> usize,
) -> Result<Covariance> {
    let b = pi.len();
    let rows: usize = stacks.iter().map(|s| s.equations()).sum();
    let freedom = rows as f64 / (rows.saturating_sub(b)).max(1) as f64;
    let mut jobs = Vec::new();
    let right: Vec<Vec<f64>> = stacks.iter().map(|s| s.tau()).collect();
    let plans: Vec<(usize, Plan)> = (stacks.iter().map(|s| within(s.count)))
        .map(|count| (count, Plan::new(count)))
        .collect();
    for (i, s) in stacks.iter().enumerate() {
        jobs.extend((0..s.actuators).map(|a| (i, a)));
    }
    let parts: Vec<Mat<f64>> = jobs
        .par_iter()
        .map(|&(i, a)| {
            let (m, ref plan) = plans[i];
            // of one actuator at a time: all of them would be as large as the equations
            let block = weighted_row(stacks[i], &right[i], i, weights, a);
            let column = |c: usize| -> Vec<f64> { (0..m).map(|k| block[(k, c)]).collect() };
            let residual: Vec<f64> = (0..m)
                .map(|k| block[(k, b)] - (0..b).map(|c| block[(k, c)] * pi[c]).sum::<f64>())
                .collect();
            let density = smooth_spectrum(plan, residual, stacks[i].used_within(a, m));
            let weight = |(k, density): (usize, &f64)| {
                // frequencies between 0 and the highest stand for their mirror image too
                let twice = if k == 0 || (2 * k == m) { 1.0 } else { 2.0 };
                let stands_for = stacks[i].count as f64 / m as f64;
                (twice * density * stands_for / m as f64).sqrt()
            };
            let of_each: Vec<f64> = density.iter().enumerate().map(weight).collect();
            let mut z = Mat::<f64>::zeros(2 * of_each.len(), b);
            for c in 0..b {
                let spectrum = plan.spectrum(column(c));
                for (k, (x, w)) in spectrum.iter().zip(&of_each).enumerate() {
                    z[(2 * k, c)] = w * x.re;
                    z[(2 * k + 1, c)] = w * x.im;
                }
            }
            z.transpose() * &z
        })
        .collect();
    let mut middle = Mat::<f64>::zeros(b, b);
    for p in &parts {
        middle += p;
    }
    let inverse = inverse_information(r)?;
    let half = &inverse * &middle;
    let inflation = freedom * (0..b).map(|i| half[(i, i)]).sum::<f64>() / b.max(1) as f64;
    let matrix = &half * &inverse * faer::Scale(freedom);
    Ok(Covariance { matrix, inflation })
}

/// Standard deviations that the stated torque noise promises: white, every recorded sample counted.
///
/// # Errors
/// Numbers that are not finite.
pub fn predicted(plant: &Plant, fit: &[&Stack]) -> Result<Vec<f64>> {
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
    let inverse = inverse_information(linear::factor(&parts).as_ref())?;
    Ok(linear::deviations(&inverse))
}
