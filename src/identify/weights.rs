//! Weights of the rows: covariance between joints, robust weights, noise of positions.

use super::linear::{self, Weights, inverse_root};
use super::stack::Stack;
use crate::base::BaseParameters;
use crate::error::Result;
use crate::plant::Plant;
use crate::signals::Prepared;
use faer::Mat;
use rayon::prelude::*;

/// Covariance of the residual between actuators, over all records, with the degrees of freedom that
/// the fit took. Equations that are left out do not count; the correlation of two actuators is then
/// too small by the geometric mean of what counts of both, which keeps the matrix definite.
pub fn residual_covariance(stacks: &[&Stack], pi: &[f64]) -> Mat<f64> {
    let n = stacks.first().map_or(0, |s| s.actuators);
    let residuals: Vec<Vec<f64>> = stacks.par_iter().map(|s| s.residual(pi)).collect();
    let taken = pi.len() as f64 / n.max(1) as f64;
    let freedom = |a: usize| {
        let used: usize = stacks.iter().map(|s| s.used(a)).sum();
        (used as f64 - taken).max(1.0)
    };
    Mat::from_fn(n, n, |a, b| {
        let sum: f64 = stacks
            .iter()
            .zip(&residuals)
            .map(|(s, e)| {
                (0..s.count)
                    .map(|k| e[a * s.count + k] * e[b * s.count + k])
                    .sum::<f64>()
            })
            .sum();
        sum / (freedom(a) * freedom(b)).sqrt()
    })
}

/// Covariance with noise of a millionth of the torque at least, so that a fit without residual has
/// weights too, and a prior that can be felt.
pub fn floored(c: Mat<f64>, stacks: &[&Stack]) -> Mat<f64> {
    let largest = |a: usize| {
        stacks
            .iter()
            .flat_map(|s| s.measured[a * s.count..(a + 1) * s.count].iter())
            .fold(0.0f64, |m, x| m.max(x.abs()))
    };
    let sizes: Vec<f64> = (0..c.nrows()).map(largest).collect();
    least(c, &sizes)
}

/// The same with the largest torque of each actuator.
pub fn least(mut c: Mat<f64>, sizes: &[f64]) -> Mat<f64> {
    for a in 0..c.nrows() {
        let size = sizes.get(a).copied().unwrap_or(0.0);
        let least = (1e-6 * size.max(1e-6)).powi(2);
        if c[(a, a)] < least {
            for b in 0..c.nrows() {
                c[(a, b)] = 0.0;
                c[(b, a)] = 0.0;
            }
            c[(a, a)] = least;
        }
    }
    c
}

/// Tukey's constant for 95 % efficiency with one channel; it grows with the root of the number of
/// channels that the distance is taken over.
const TUKEY: f64 = 4.685;

/// Robust weights: the whitened residual of each sample is a distance `d`; its weight is Huber's
/// `min(1, k/d)` in the first rounds and Tukey's `(1 − (d/c)²)²` in the last. Returns the weights,
/// scaled by the roots, and the share of samples with less than a tenth of their weight.
pub fn robust(stacks: &[&Stack], weights: &Weights, pi: &[f64], tukey: bool) -> (Weights, f64) {
    let n = stacks.first().map_or(0, |s| s.actuators);
    let distances: Vec<Vec<f64>> = stacks
        .par_iter()
        .enumerate()
        .map(|(r, s)| {
            let e = s.residual(pi);
            (0..s.count)
                .map(|k| {
                    let l = weights.at(r, k);
                    (0..n)
                        .map(|a| {
                            (0..=a)
                                .map(|d| l[(a, d)] * e[d * s.count + k])
                                .sum::<f64>()
                                .powi(2)
                        })
                        .sum::<f64>()
                        .sqrt()
                })
                .collect()
        })
        .collect();
    // scale by the median, which outliers do not move: the median of χ²_n is about n(1−2/9n)³
    let mut all: Vec<f64> = distances.concat();
    let middle = all.len() / 2;
    let median = match all.is_empty() {
        true => 1.0,
        false => *all.select_nth_unstable_by(middle, f64::total_cmp).1,
    };
    let expected = (n as f64 * (1.0 - 2.0 / (9.0 * n as f64)).powi(3)).sqrt();
    let scale = (median / expected).max(1e-300);
    let root = (n as f64).sqrt();
    let mut light = 0usize;
    let each = distances
        .iter()
        .enumerate()
        .map(|(r, d)| {
            d.iter()
                .enumerate()
                .map(|(k, d)| {
                    let d = d / scale;
                    let w = match tukey {
                        true => {
                            let x = d / (TUKEY * root);
                            if x < 1.0 { (1.0 - x * x).powi(2) } else { 0.0 }
                        }
                        false => (1.345 * root / d.max(1e-12)).min(1.0),
                    };
                    light += usize::from(w < 0.1);
                    let l = weights.at(r, k);
                    let f = w.sqrt() / scale;
                    Mat::from_fn(n, n, |i, j| f * l[(i, j)])
                })
                .collect()
        })
        .collect();
    (Weights::Each(each), light as f64 / all.len().max(1) as f64)
}

/// Covariances for maximum likelihood from the scatter of the periods: torque noise, plus what the
/// noise of the positions makes of the predicted torque (Swevers et al. 1997, with the noise of the
/// positions carried over to first order through `∂τ/∂(q, q̇, q̈)`).
///
/// `None` if a record has no periods.
///
/// # Errors
/// A pose of a parallel robot that cannot be reached.
pub fn maximum_likelihood(
    plant: &Plant,
    base: &BaseParameters,
    prepared: &[&Prepared],
    stacks: &[&Stack],
    pi: &[f64],
) -> Result<Option<Weights>> {
    let mut all = Vec::new();
    for (p, s) in prepared.iter().zip(stacks) {
        let Some(periods) = &p.periods else {
            return Ok(None);
        };
        let n = p.actuators;
        let count = periods.count as f64;
        // noise that passes the filter: its share of the band up to half the rate
        let pass = (2.0 * p.filter.cutoff / p.rate).min(1.0);
        let motion = p.output_motion();
        let torque = |m: &crate::dynamics::Samples| -> Result<Vec<f64>> {
            let w = plant.regressor(m)?;
            Ok((0..w.nrows())
                .map(|i| base.kept.iter().zip(pi).map(|(&c, x)| w[(i, c)] * x).sum())
                .collect())
        };
        let centre = torque(&motion)?;
        let mut covariance: Vec<Mat<f64>> = (0..s.count)
            .map(|_| &periods.torque_covariance * faer::Scale(pass / count))
            .collect();
        if p.motion.dof == n {
            for j in 0..n {
                let fc = p.position_cutoff[j];
                if !fc.is_finite() {
                    continue;
                }
                let share = (2.0 * fc / p.rate).min(1.0);
                let variance = periods.position_noise[j].powi(2) / count * share;
                let omega = 2.0 * std::f64::consts::PI * fc;
                // mean of ω² and ω⁴ over the band
                for (k, v) in [
                    variance,
                    variance * omega.powi(2) / 3.0,
                    variance * omega.powi(4) / 5.0,
                ]
                .into_iter()
                .enumerate()
                {
                    let h = v.sqrt().max(1e-9);
                    let mut moved = motion.clone();
                    let list = match k {
                        0 => &mut moved.q,
                        1 => &mut moved.qd,
                        _ => &mut moved.qdd,
                    };
                    list[j * s.count..(j + 1) * s.count]
                        .iter_mut()
                        .for_each(|x| *x += h);
                    let there = torque(&moved)?;
                    for (i, c) in covariance.iter_mut().enumerate() {
                        let d = |a: usize| {
                            // Coulomb friction that changes its sign is no derivative
                            let x = (there[a * s.count + i] - centre[a * s.count + i]) / h;
                            if x.is_finite() { x } else { 0.0 }
                        };
                        let d: Vec<f64> = (0..n).map(d).collect();
                        for a in 0..n {
                            for b in 0..n {
                                c[(a, b)] += v * d[a] * d[b];
                            }
                        }
                    }
                }
            }
        }
        all.push(
            covariance
                .iter()
                .map(|c| inverse_root(c.as_ref()))
                .collect(),
        );
    }
    Ok(Some(Weights::Each(all)))
}

/// Instrumental variables: `π = (Zᵀ W)⁻¹ Zᵀ τ` of weighted rows, `instruments` being the stacks of
/// the same records along a motion without noise.
///
/// # Errors
/// Instruments without information.
pub fn instrumental(
    stacks: &[&Stack],
    instruments: &[Stack],
    weights: &Weights,
) -> Result<Vec<f64>> {
    let b = stacks.first().map_or(0, |s| s.w.ncols());
    let mut zw = Mat::<f64>::zeros(b, b);
    let mut zt = vec![0.0; b];
    for (r, (s, z)) in stacks.iter().zip(instruments).enumerate() {
        let tau = s.tau();
        let rows = linear::weighted(s, &tau, r, weights, 0..s.count);
        let other = linear::weighted(z, &tau, r, weights, 0..s.count);
        let (w, i) = (rows.as_ref().subcols(0, b), other.as_ref().subcols(0, b));
        zw += i.transpose() * w;
        for (k, x) in zt.iter_mut().enumerate() {
            *x += (0..rows.nrows())
                .map(|q| i[(q, k)] * rows[(q, b)])
                .sum::<f64>();
        }
    }
    use faer::linalg::solvers::Solve;
    let scale: Vec<f64> = (0..b)
        .map(|k| zw[(k, k)].abs().max(1e-300).sqrt())
        .collect();
    let scaled = Mat::from_fn(b, b, |i, j| zw[(i, j)] / (scale[i] * scale[j]));
    let x = scaled
        .partial_piv_lu()
        .solve(Mat::from_fn(b, 1, |i, _| zt[i] / scale[i]));
    Ok((0..b).map(|i| x[(i, 0)] / scale[i]).collect())
}
