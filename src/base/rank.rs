//! The rank of a regressor, the columns that are kept for it, and what they leave.

use crate::dot::dot;
use crate::error::{Error, Result};
use faer::{Mat, MatRef};

/// Factor between two neighbouring singular values that makes a border of the rank.
#[doc(hidden)]
pub const CLEAR: f64 = 1e3;

/// Largest singular value below the border, relative to the largest of all: what is more is never
/// dropped at the first gap.
#[doc(hidden)]
pub const NEGLIGIBLE: f64 = 1e-6;

/// Rounding of the arithmetic, relative to the largest singular value.
const ROUNDING: f64 = 1e-15;

/// Residual of a unit column that counts, unless a wider gap lies elsewhere in [`WINDOW`].
const TOLERANCE: f64 = 3e-5;

/// Where the residual of a unit column that counts is first looked for.
const WINDOW: [f64; 2] = [1e-6, 1e-3];

/// Residuals (of unit columns) that closed chains ask of a column, one pass over the columns each:
/// two of one pass differ by little, what is left for the last is nearly dependent.
pub(super) const PASSES: [f64; 8] = [0.43, 0.21, 0.11, 0.053, 0.027, 0.013, 0.0067, 0.0033];

/// Singular values, largest first, relative to the largest.
pub(super) fn relative_singular_values(m: MatRef<'_, f64>) -> Result<Vec<f64>> {
    // R of a plain QR has the singular values of the whole and is small
    let r = m.qr().thin_R().to_owned();
    let sv = r
        .singular_values()
        .map_err(|_| Error::Infeasible("singular values did not converge".into()))?;
    let top = sv.first().copied().unwrap_or(0.0).max(f64::MIN_POSITIVE);
    Ok(sv.iter().map(|s| s / top).collect())
}

/// Rank from relative singular values (descending): the first gap of [`CLEAR`] that ends below
/// [`NEGLIGIBLE`]; where there is none, the widest.
pub(super) fn rank(sv: &[f64]) -> usize {
    let below = |r: usize| sv.get(r).copied().unwrap_or(0.0).max(ROUNDING);
    let gap = |r: usize| sv[r - 1] / below(r);
    let counted = sv.iter().take_while(|s| **s > ROUNDING).count();
    (1..=counted)
        .find(|&r| below(r) <= NEGLIGIBLE && gap(r) >= CLEAR)
        .or_else(|| (1..=counted).max_by(|&a, &b| gap(a).total_cmp(&gap(b))))
        .unwrap_or(0)
}

/// Residual that a unit column must leave to count: the widest gap of the singular values of the
/// unit columns (relative, descending) whose border lies inside [`WINDOW`]; where that contradicts
/// the rank, the middle of the border of the rank.
pub(super) fn tolerance(sv: &[f64], rank: usize) -> f64 {
    let [low, high] = WINDOW;
    let mut best = (0.0, 0, TOLERANCE);
    for r in 1..=sv.len() {
        let above = sv[r - 1].min(high);
        let below = sv.get(r).copied().unwrap_or(0.0).max(low);
        let gap = above / below;
        if gap > best.0 {
            best = (gap, r, (above * below).sqrt());
        }
    }
    match rank.checked_sub(1).and_then(|k| sv.get(k)) {
        Some(above) if best.1 != rank => {
            let below = sv.get(rank).copied().unwrap_or(0.0).max(ROUNDING);
            (above.max(ROUNDING) * below).sqrt()
        }
        _ => best.2,
    }
}

/// Keeps `rank` independent columns of the upper triangular `R` and expresses all columns in them:
/// returns their indices, ascending, and `K` (`rank × columns`).
///
/// Gram-Schmidt with reorthogonalisation. Each pass over the columns keeps those that leave a
/// residual of more than its threshold, first come first kept; the threshold of the last pass
/// starts at the rank tolerance and is adapted until the count is the rank.
pub(super) fn keep(
    r: &Mat<f64>,
    rank: usize,
    tolerance: f64,
    passes: &[f64],
) -> (Vec<usize>, Mat<f64>) {
    let n = r.ncols();
    let choose = |last: f64| -> Vec<usize> {
        let mut q: Vec<Vec<f64>> = Vec::new();
        let mut kept: Vec<usize> = Vec::new();
        for &threshold in passes.iter().filter(|t| **t > last).chain([&last]) {
            for j in 0..n {
                if kept.contains(&j) {
                    continue;
                }
                let mut x: Vec<f64> = (0..r.nrows()).map(|i| r[(i, j)]).collect();
                for _ in 0..2 {
                    for e in &q {
                        let s = dot(e, &x);
                        x.iter_mut().zip(e).for_each(|(x, e)| *x -= s * e);
                    }
                }
                let norm = x.iter().map(|v| v * v).sum::<f64>().sqrt();
                if norm > threshold {
                    x.iter_mut().for_each(|v| *v /= norm);
                    q.push(x);
                    kept.push(j);
                }
            }
        }
        kept
    };
    let mut threshold = tolerance;
    let mut kept = choose(threshold);
    for _ in 0..60 {
        if kept.len() == rank {
            break;
        }
        threshold *= if kept.len() > rank { 1.5 } else { 1.0 / 1.6 };
        kept = choose(threshold);
    }
    kept.sort_unstable();
    let basis = Mat::from_fn(r.nrows(), kept.len(), |i, a| r[(i, kept[a])]);
    use faer::linalg::solvers::SolveLstsq;
    let k = basis.qr().solve_lstsq(r);
    let k = Mat::from_fn(kept.len(), n, |i, j| k[(i, j)]);
    (kept, k)
}

/// Orthonormal basis of the range of `[1; Kᵀ]` in the order of the columns.
pub(super) fn row_space(p: usize, kept: &[usize], dropped: &[usize], k: &Mat<f64>) -> Mat<f64> {
    let mut m = Mat::zeros(p, kept.len());
    for (a, &j) in kept.iter().enumerate() {
        m[(j, a)] = 1.0;
        for (d, &j) in dropped.iter().enumerate() {
            m[(j, a)] = k[(a, d)];
        }
    }
    m.qr().compute_thin_Q()
}

/// Whether changing parameter `j` can be undone by others: whether it takes part in a null vector
/// `[−K e_d; e_d]`, measured in units of the columns it moves.
pub(super) fn touches_null_space(
    j: usize,
    kept: &[usize],
    dropped: &[usize],
    k: &Mat<f64>,
    norms: &[f64],
) -> bool {
    match kept.binary_search(&j) {
        Err(_) => true,
        Ok(a) => dropped
            .iter()
            .enumerate()
            .any(|(d, &i)| norms[i] > 0.0 && (k[(a, d)] * norms[j] / norms[i]).abs() > 1e-5),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rank_ends_at_a_clear_gap() {
        assert_eq!(rank(&[1.0, 0.1, 2e-3, 1e-16]), 3);
        assert_eq!(rank(&[1.0, 1e-4, 1e-15]), 2);
        assert_eq!(rank(&[1.0, 0.5]), 2);
        assert_eq!(rank(&[]), 0);
        // two parameters that exist by rounding
        assert_eq!(rank(&[1.0, 6e-2, 4e-7, 3e-8, 1e-16]), 2);
        // small, but no border before the rounding of the arithmetic
        let smooth: Vec<f64> = (0..30).map(|k| 0.55f64.powi(k)).collect();
        let all = [&smooth[..], &[2e-16, 1e-16]].concat();
        assert_eq!(rank(&all), 30);
        // a slow joint beside fast ones
        assert_eq!(rank(&[1.0, 0.5, 3e-4, 1e-4, 1e-15]), 4);
    }
}
