//! Essential parameters: those too uncertain are removed one by one (Khalil & Dombre 2002, ch. 12).

use super::linear;
use crate::error::Result;
use faer::{Mat, MatRef};

/// One removal.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Removal {
    /// base parameter
    pub parameter: usize,
    /// its relative standard deviation when it was removed, percent
    pub relative_std_percent: f64,
    /// norm of the weighted residual after it, relative to that with all parameters
    pub loss: f64,
}

/// What is left, and what it cost.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Essential {
    /// base parameters that stay
    pub kept: Vec<usize>,
    /// base parameters with the removed ones at zero
    pub pi: Vec<f64>,
    /// what was removed, in order
    pub removed: Vec<Removal>,
}

/// Largest relative standard deviation of an essential parameter, percent.
pub const UNCERTAIN: f64 = 30.0;
/// Growth of the residual norm at which removal ends.
pub const LOSS: f64 = 0.005;

/// Removes, one by one, the parameter with the largest relative standard deviation, until all are
/// better than [`UNCERTAIN`] or the residual has grown by [`LOSS`]. `factor` is `[R r; 0 ρ]`,
/// `inflation` that of the variance through correlated residuals.
///
/// # Errors
/// Numbers that are not finite.
pub fn reduce(factor: MatRef<'_, f64>, rows: usize, inflation: f64) -> Result<Essential> {
    let b = factor.ncols() - 1;
    let mut kept: Vec<usize> = (0..b).collect();
    let full = linear::solve(factor)?;
    let all = full.residual.max(1e-300);
    let mut pi = full.pi;
    let mut removed = Vec::new();
    while kept.len() > 1 {
        let part = reduced(factor, &kept);
        let fit = linear::solve(part.as_ref())?;
        let inverse = linear::inverse_information(fit.r.as_ref())?;
        let variance = fit.residual.powi(2) / (rows.saturating_sub(kept.len())).max(1) as f64;
        let relative = |i: usize| {
            100.0 * (inflation.max(1.0) * variance * inverse[(i, i)]).sqrt()
                / fit.pi[i].abs().max(1e-300)
        };
        let Some((worst, percent)) = (0..kept.len())
            .map(|i| (i, relative(i)))
            .max_by(|a, b| a.1.total_cmp(&b.1))
        else {
            break;
        };
        pi = vec![0.0; b];
        kept.iter().zip(&fit.pi).for_each(|(&k, x)| pi[k] = *x);
        if percent < UNCERTAIN {
            break;
        }
        let mut next = kept.clone();
        let parameter = next.remove(worst);
        let smaller = linear::solve(reduced(factor, &next).as_ref())?;
        let loss = smaller.residual / all;
        if loss > 1.0 + LOSS {
            break;
        }
        removed.push(Removal {
            parameter,
            relative_std_percent: percent,
            loss,
        });
        kept = next;
    }
    Ok(Essential { kept, pi, removed })
}

/// Factor of the equations with only these columns.
fn reduced(factor: MatRef<'_, f64>, kept: &[usize]) -> Mat<f64> {
    let b = factor.ncols() - 1;
    let part = Mat::from_fn(factor.nrows(), kept.len() + 1, |i, j| {
        factor[(i, kept.get(j).copied().unwrap_or(b))]
    });
    linear::factor(&[part])
}
