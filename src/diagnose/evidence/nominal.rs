//! The nominal model, whitened and decomposed under its prior.

use super::Evidence;
use super::algebra::dot;
use crate::diagnose::data::Data;
use faer::reborrow::Reborrow;
use faer::{Mat, Side};
use rayon::prelude::*;

/// Rows that are decomposed at a time.
const ROWS: usize = 4096;

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
        // bodies before an actuator do not show in its torque: its columns begin behind theirs
        let first: Vec<usize> = (0..n)
            .map(|j| (0..p).find(|c| data.w[j].get(*c).is_some()).unwrap_or(p))
            .collect();
        let mut w: Vec<Mat<f64>> = (0..n)
            .into_par_iter()
            .map(|j| {
                let mut out = Mat::zeros(data.rows(), p - first[j]);
                for c in first[j]..p {
                    let Some(from) = data.w[j].get(c) else {
                        continue;
                    };
                    for (i, v) in data.modelled(j, from).into_iter().enumerate() {
                        out[(i, c - first[j])] = v;
                    }
                }
                out
            })
            .collect();
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
        let grams: Vec<Mat<f64>> = w
            .par_iter()
            .map(|w| {
                let f = w.subrows(0, fitted);
                f.transpose() * f
            })
            .collect();
        // scaled by the prior, so that the matrix is 1 + something
        let mut a = Mat::<f64>::identity(p, p);
        for (g, first) in grams.iter().zip(&first) {
            for i in *first..p {
                for k in *first..p {
                    a[(i, k)] += g[(i - first, k - first)] * spread[i] * spread[k];
                }
            }
        }
        let l = match a.llt(Side::Lower) {
            Ok(f) => f.L().to_owned(),
            Err(_) => Mat::identity(p, p),
        };
        // Q = W diag(spread) L⁻ᵀ: solve L Qᵀ = (W diag(spread))ᵀ, where Q begins with the same columns of zeros
        w.par_iter_mut().zip(&first).for_each(|(w, first)| {
            let more = p - first;
            let l = l.submatrix(*first, *first, more, more);
            for c in 0..more {
                for i in 0..w.nrows() {
                    w[(i, c)] *= spread[first + c];
                }
            }
            // some rows at a time: a copy of all of them on every thread would be the most that a diagnosis holds
            for from in (0..w.nrows()).step_by(ROWS) {
                let rows = ROWS.min(w.nrows() - from);
                let mut some = w.subrows_mut(from, rows);
                let mut t = some.rb().transpose().to_owned();
                faer::linalg::triangular_solve::solve_lower_triangular_in_place(
                    l,
                    t.as_mut(),
                    faer::Par::Seq,
                );
                some.copy_from(t.transpose());
            }
        });
        let q = w;
        let mut d = vec![0.0; p];
        let mut rr = 0.0;
        for j in 0..n {
            for (c, d) in d[first[j]..].iter_mut().enumerate() {
                let column = q[j].col(c);
                let column = column.try_as_col_major().expect("column major").as_slice();
                *d += dot(&column[..fitted], &r[j][..fitted]);
            }
            rr += dot(&r[j][..fitted], &r[j][..fitted]);
        }
        let j0 = rr - dot(&d, &d);
        Evidence {
            data,
            phi,
            q,
            l,
            r,
            d,
            j0,
            spread,
        }
    }
}
