//! The gap to a model whose torque was computed elsewhere, in a simulator say, measured as the gap of the diagnosis is.

use nalgebra::{Matrix4, Vector4};

use super::data::Data;
use super::gap;

/// Energy of the gap above the noise by record and actuator, in units of the noise variance a sample. `model` is the
/// torque by actuator on the rows of all records, N m or N. Reversals of dry friction that are sharper or rounder in the
/// model than in the log do not count, as in the diagnosis.
///
/// # Panics
/// If there is not one number for each row.
pub fn energies(data: &Data, model: &[Vec<f64>]) -> Vec<Vec<f64>> {
    assert!(model.len() == data.joints() && model.iter().all(|m| m.len() == data.rows()));
    let scaled = gap::scaled(data, &allowed(data, model));
    let of = |k: usize, j: usize| {
        let r = &data.records[k];
        let (a, b) = gap::excess(r, j, &scaled[j][data.span(k)]);
        ((a + b) / r.counts(j).max(1) as f64 - data.noise[j].excess).max(0.0)
    };
    (0..data.records.len())
        .map(|k| (0..data.joints()).map(|j| of(k, j)).collect())
        .collect()
}

/// The gap less what is allowed for about reversals: coefficients `c` of the columns `A` of an actuator that minimise
/// `|e − A c|²/σ² + Σ c²/s²` over the fitted records, with the noise `σ` and the spreads `s` that are expected.
fn allowed(data: &Data, model: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut gap = data.gap_that_counts(model);
    let of: Vec<_> = (0..data.joints()).map(|j| data.at_reversals(j)).collect();
    // columns as the gap has them: filtered like the torque, and weighted
    let shown: [Vec<Vec<f64>>; 4] = std::array::from_fn(|c| {
        let moved: Vec<Vec<f64>> = (model.iter().zip(&of))
            .map(|(tau, a)| match a {
                Some((columns, _)) => tau.iter().zip(&columns[c]).map(|(t, v)| t + v).collect(),
                None => tau.clone(),
            })
            .collect();
        let mut change = data.gap_that_counts(&moved);
        for (change, gap) in change.iter_mut().zip(&gap) {
            change.iter_mut().zip(gap).for_each(|(v, e)| *v = e - *v);
        }
        change
    });
    for (j, e) in gap.iter_mut().enumerate() {
        let Some((_, spread)) = of[j] else { continue };
        let variance = data.noise[j].std.powi(2);
        let row = |i: usize| Vector4::from_fn(|c, _| shown[c][j][i]);
        let mut a = Matrix4::from_diagonal(&Vector4::from(spread.map(|s| variance / (s * s))));
        let mut b = Vector4::zeros();
        for i in (0..data.records.len())
            .filter(|k| data.records[*k].fit)
            .flat_map(|k| data.span(k))
        {
            let v = row(i);
            a += v * v.transpose();
            b += v * e[i];
        }
        if let Some(c) = a.cholesky().map(|f| f.solve(&b)) {
            e.iter_mut()
                .enumerate()
                .for_each(|(i, e)| *e -= row(i).dot(&c));
        }
    }
    gap
}
