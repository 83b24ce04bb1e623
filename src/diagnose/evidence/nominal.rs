//! The nominal model, whitened and decomposed under its prior.

use super::algebra::{dot, forwards};
use super::{Basis, Evidence};
use crate::diagnose::data::Data;
use faer::linalg::triangular_solve;
use faer::{Mat, Par, Side};
use rayon::prelude::*;

/// Rows that are decomposed at a time.
const ROWS: usize = 4096;

/// What a column of the nominal model must add to others of an actuator in all its rows together, for one deviation of the prior.
/// Unit: deviations of the noise.
const ADDS: f64 = 1e-4;

impl<'a> Evidence<'a> {
    /// With the prior of the data, its deviations multiplied by `loosen`.
    pub fn new(data: &'a Data<'a>, loosen: f64) -> Self {
        let n = data.joints();
        let p = data.parameters.len();
        let fitted = data.fitted;
        let phi = data.values();
        // a parameter that is exactly zero a priori must still be able to move
        let floor = 1e-9;
        let spread: Vec<f64> = data
            .spread
            .iter()
            .map(|s| (s * loosen).max(floor))
            .collect();
        // bodies before an actuator do not show in its torque, nor does friction of others: columns that are not zero
        let shown = |j: usize| (0..p).filter_map(move |c| Some((c, data.w[j].get(c)?)));
        let whitened = |j: usize| -> (Vec<usize>, Mat<f64>) {
            let (at, from): (Vec<usize>, Vec<&[f64]>) = shown(j).unzip();
            let mut w = Mat::zeros(data.rows(), at.len());
            for (k, (c, from)) in at.iter().zip(from).enumerate() {
                for (i, v) in data.modelled(j, from).into_iter().enumerate() {
                    w[(i, k)] = spread[*c] * v;
                }
            }
            (at, w)
        };
        let nominal = data.model_torque(&phi);
        let r: Vec<Vec<f64>> = (0..n)
            .into_par_iter()
            .map(|j| {
                let model = data.shown(j, &nominal[j]);
                let measured = data.torque(j);
                let raw: Vec<f64> = measured.iter().zip(&model).map(|(a, b)| a - b).collect();
                data.whiten(j, &raw)
            })
            .collect();
        // scaled by the prior, so that the matrix is 1 + something
        let parts: Vec<(Vec<usize>, Mat<f64>, Basis)> = (0..n)
            .into_par_iter()
            .map(|j| {
                let (at, w) = whitened(j);
                let f = w.subrows(0, fitted);
                let gram = f.transpose() * f;
                let basis = Basis::of(&at, &w, p);
                (at, gram, basis)
            })
            .collect();
        let mut a = Mat::<f64>::identity(p, p);
        for (at, gram, _) in &parts {
            for (i, row) in at.iter().enumerate() {
                for (k, column) in at.iter().enumerate() {
                    a[(*row, *column)] += gram[(i, k)];
                }
            }
        }
        let l = match a.llt(Side::Lower) {
            Ok(f) => f.L().to_owned(),
            Err(_) => Mat::identity(p, p),
        };
        let w: Vec<Basis> = parts.into_iter().map(|(_, _, basis)| basis).collect();
        let mut pull = Mat::zeros(p, 1);
        let mut rr = 0.0;
        for (w, r) in w.iter().zip(&r) {
            let own = faer::ColRef::from_slice(&r[..fitted]);
            pull += w.r.transpose() * (w.b.subrows(0, fitted).transpose() * own.as_mat());
            rr += dot(&r[..fitted], &r[..fitted]);
        }
        forwards(&l, &mut pull);
        let d: Vec<f64> = (0..p).map(|i| pull[(i, 0)]).collect();
        Evidence {
            data,
            phi,
            w,
            l,
            r,
            j0: rr - dot(&d, &d),
            d,
            spread,
        }
    }
}

impl Basis {
    /// Of columns `w` that belong `at` these of `count` parameters.
    fn of(at: &[usize], w: &Mat<f64>, count: usize) -> Basis {
        // pivots of the triangle are those of the columns; that of zeros alone has none
        let triangle = (!at.is_empty()).then(|| triangle(w));
        let Some(triangle) = triangle.filter(|t| t.norm_max() >= ADDS) else {
            let (b, r) = (Mat::zeros(w.nrows(), 0), Mat::zeros(0, count));
            return Basis { b, r };
        };
        let pivoted = triangle.col_piv_qr();
        let (triangle, order) = (pivoted.thin_R(), pivoted.P().arrays().0);
        let all = triangle.nrows();
        let rank = (0..all).find(|k| triangle[(*k, *k)].abs() < ADDS);
        let rank = rank.unwrap_or(all);
        // R₁₁ X = [R₁₁ R₁₂]
        let mut shares = triangle.subrows(0, rank).to_owned();
        triangular_solve::solve_upper_triangular_in_place(
            triangle.submatrix(0, 0, rank, rank),
            shares.as_mut(),
            Par::Seq,
        );
        let mut r = Mat::zeros(rank, count);
        for (k, from) in order.iter().enumerate() {
            r.col_mut(at[*from]).copy_from(shares.col(k));
        }
        let b = Mat::from_fn(w.nrows(), rank, |i, k| w[(i, order[k])]);
        Basis { b, r }
    }
}

/// `R` of the decomposition `w = Q R`. Some rows at a time: a copy of all of them on every thread would be the most that a diagnosis
/// holds.
fn triangle(w: &Mat<f64>) -> Mat<f64> {
    let columns = w.ncols();
    let mut r = Mat::zeros(0, columns);
    for from in (0..w.nrows()).step_by(ROWS) {
        let rows = ROWS.min(w.nrows() - from);
        let above = r.nrows();
        let mut both = Mat::zeros(above + rows, columns);
        both.submatrix_mut(0, 0, above, columns).copy_from(&r);
        let mut below = both.submatrix_mut(above, 0, rows, columns);
        below.copy_from(w.subrows(from, rows));
        r = both.qr().thin_R().to_owned();
    }
    r
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns that depend on others, that are zero, or all of them, are made from those that are kept.
    #[test]
    fn kept_columns_make_all() {
        let wave = |i: usize, f: f64| (f * i as f64).sin();
        let columns = |i: usize, k: usize| match k {
            0 => wave(i, 0.3),
            1 => 0.0,
            2 => 1e4 * wave(i, 0.5),
            3 => wave(i, 0.3) - 2e3 * wave(i, 0.5),
            _ => 5.0 * wave(i, 0.9) + wave(i, 0.3),
        };
        let at = [1, 2, 4, 5, 7];
        for rows in [60, ROWS + 60] {
            let w = Mat::from_fn(rows, 5, columns);
            let basis = Basis::of(&at, &w, 9);
            assert_eq!(basis.b.ncols(), 3);
            let made = &basis.b * &basis.r;
            let want =
                |i: usize, c: usize| at.iter().position(|a| *a == c).map_or(0.0, |k| w[(i, k)]);
            let left = made - Mat::from_fn(rows, 9, want);
            assert!(left.norm_max() < 1e-8, "{}", left.norm_max());
        }
        let none = Basis::of(&[3, 4], &Mat::zeros(60, 2), 9);
        assert_eq!((none.b.ncols(), none.r.shape()), (0, (0, 9)));
        assert_eq!(Basis::of(&[], &Mat::zeros(60, 0), 9).b.ncols(), 0);
    }
}
