//! Sums of products, and the solution of small systems.

use super::Fit;
use crate::diagnose::column::Column;
use faer::linalg::solvers::Solve;
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::{Mat, Par, Side};

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    // four sums: the compiler may use wide registers without reordering one sum
    let mut s = [0.0; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let tail: f64 = a8
        .remainder()
        .iter()
        .zip(b8.remainder())
        .map(|(x, y)| x * y)
        .sum();
    for (x, y) in a8.zip(b8) {
        for k in 0..8 {
            s[k] += x[k] * y[k];
        }
    }
    s.iter().sum::<f64>() + tail
}

/// Sum of products of two columns over fitted rows.
pub(super) fn overlap(a: &Column, b: &Column, fitted: usize) -> f64 {
    a.rows
        .iter()
        .filter_map(|(j, x)| Some(dot(&x[..fitted], &b.get(*j)?[..fitted])))
        .sum()
}

/// `L⁻¹` of the columns of a matrix.
pub(super) fn forwards(l: &Mat<f64>, columns: &mut Mat<f64>) {
    solve_lower_triangular_in_place(l.as_ref(), columns.as_mut(), Par::Seq);
}

/// `L⁻ᵀ` of a vector.
pub(super) fn backwards(l: &Mat<f64>, x: &[f64]) -> Mat<f64> {
    let mut out = Mat::from_fn(x.len(), 1, |i, _| x[i]);
    solve_upper_triangular_in_place(l.transpose(), out.as_mut(), Par::Seq);
    out
}

/// `S η = b` with `S` positive semi-definite, scaled to a unit diagonal first.
pub fn solve(s: &Mat<f64>, b: &[f64]) -> Fit {
    let k = b.len();
    let scale: Vec<f64> = (0..k).map(|i| 1.0 / s[(i, i)].max(1e-300).sqrt()).collect();
    let a = Mat::from_fn(k, k, |i, m| {
        s[(i, m)] * scale[i] * scale[m] + if i == m { 1e-10 } else { 0.0 }
    });
    let Ok(f) = a.llt(Side::Lower) else {
        return Fit {
            gain: 0.0,
            eta: vec![0.0; k],
            covariance: vec![vec![0.0; k]; k],
        };
    };
    let rhs = Mat::from_fn(k, 1, |i, _| b[i] * scale[i]);
    let x = f.solve(&rhs);
    let inverse = f.solve(Mat::<f64>::identity(k, k));
    let eta: Vec<f64> = (0..k).map(|i| x[(i, 0)] * scale[i]).collect();
    Fit {
        gain: eta.iter().zip(b).map(|(e, b)| e * b).sum(),
        covariance: (0..k)
            .map(|i| {
                (0..k)
                    .map(|m| inverse[(i, m)] * scale[i] * scale[m])
                    .collect()
            })
            .collect(),
        eta,
    }
}
