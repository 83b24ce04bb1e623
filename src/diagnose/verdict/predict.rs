//! Whether what a fit takes away is there: on holdout records, in every record, on both joints of a pair.

use super::super::catalogue::Place;
use super::super::column::Column;
use super::super::data::Data;
use super::super::evidence::{Evidence, Projected};
use super::super::search::Candidate;
use super::super::thresholds::THRESHOLDS as T;
use super::state::energy;
use std::ops::Range;

/// By how much the residual falls on holdout records over the fall that is predicted, `‖Δ‖²` for a fit that
/// takes `Δ = r₀ − r₁` away: 1 where just this is there, `2s − 1` where `s` times as much is, negative
/// where something else is. A prediction of next to nothing is taken as kept.
pub fn predicts(data: &Data, r0: &[Vec<f64>], r1: &[Vec<f64>]) -> f64 {
    let rows = data.fitted..data.rows();
    if rows.is_empty() {
        return 1.0;
    }
    let nothing = T.entry.negligible * rows.len() as f64;
    let [taken, fall] = taken_and_fall(r0, r1, rows);
    (fall + nothing) / (taken + nothing)
}

/// `‖Δ‖²` of what a fit takes away, `Δ = r₀ − r₁`, and by how much the residual falls, on some rows of actuators.
fn taken_and_fall(r0: &[Vec<f64>], r1: &[Vec<f64>], rows: Range<usize>) -> [f64; 2] {
    let pairs = r0.iter().zip(r1);
    let taken = pairs
        .flat_map(|(a, b)| a[rows.clone()].iter().zip(&b[rows.clone()]))
        .map(|(a, b)| (a - b) * (a - b))
        .sum();
    [taken, energy(r0, rows.clone()) - energy(r1, rows)]
}

/// What an effect gains from coefficients of its own in every fitted record, beyond what so many freedoms gain
/// from noise, over what it gains (`own`) with the same in all: near 0 for one that is the same machine
/// in every record. `None` with one record.
pub fn unsteady(
    evidence: &Evidence,
    (columns, prior): (&[Column], f64),
    beside: &[&Projected],
    together: f64,
    own: f64,
) -> Option<f64> {
    let data = evidence.data;
    let fitted: Vec<usize> = (0..data.records.len())
        .filter(|k| data.records[*k].fit)
        .collect();
    if fitted.len() < 2 {
        return None;
    }
    let only = |column: &Column, k: usize| {
        let rows = column.rows.iter().map(|(j, v)| {
            let mut part = vec![0.0; v.len()];
            part[data.span(k)].copy_from_slice(&v[data.span(k)]);
            (*j, part)
        });
        Column {
            rows: rows.collect(),
        }
    };
    let apart: Vec<Vec<Column>> = fitted
        .iter()
        .map(|k| columns.iter().map(|c| only(c, *k)).collect())
        .collect();
    let mut projected = evidence.project_all(&apart);
    projected.iter_mut().for_each(|p| p.prior = prior);
    let mut set = beside.to_vec();
    set.extend(&projected);
    let freedoms = ((fitted.len() - 1) * columns.len()) as f64;
    let more = evidence.fit(&set).gain - together - T.confidence.freedom * freedoms;
    Some(more.max(0.0) / own.max(1e-9))
}

/// Whether an effect of a pair of joints is seen on both, 0 to 1: on rows of each the residual must fall by
/// half of what the fit takes away there, as in [`predicts`]. 1 for other effects; little where one of the
/// two joints is too noisy to tell, for then the effect may as well be another one on the other joint.
pub fn shown_on_both(data: &Data, c: &Candidate, r0: &[Vec<f64>], r1: &[Vec<f64>]) -> f64 {
    let Place::Pair(j, k) = c.place else {
        return 1.0;
    };
    let on = |j: usize| -> f64 {
        let [taken, fall] = taken_and_fall(&r0[j..=j], &r1[j..=j], 0..data.fitted);
        match taken < T.confidence.unseen {
            true => T.confidence.not_seen,
            false => T.confidence.on_both.above(fall / taken),
        }
    };
    on(j).min(on(k))
}
