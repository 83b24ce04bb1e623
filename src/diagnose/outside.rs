//! The gap to a model whose torque was computed elsewhere, in a simulator say, measured as the gap of the diagnosis is.

use super::data::Data;
use super::{gap, result};

/// Energy of the gap above the noise by record and actuator, in units of the noise variance a sample. `model` is the
/// torque by actuator on the rows of all records, N m or N.
///
/// # Panics
/// If there is not one number for each row.
pub fn energies(data: &Data, model: &[Vec<f64>]) -> Vec<Vec<f64>> {
    assert!(model.len() == data.joints() && model.iter().all(|m| m.len() == data.rows()));
    let scaled = result::scaled(data, &data.gap_to(model));
    let of = |k: usize, j: usize| {
        let r = &data.records[k];
        let (a, b) = gap::excess(r, j, &scaled[j][data.span(k)]);
        ((a + b) / r.counts(j).max(1) as f64 - data.noise[j].excess).max(0.0)
    };
    (0..data.records.len())
        .map(|k| (0..data.joints()).map(|j| of(k, j)).collect())
        .collect()
}
