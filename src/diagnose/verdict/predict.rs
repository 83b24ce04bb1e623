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

/// An effect beside others of a set, and what it gains there.
pub struct Alike<'a> {
    pub columns: &'a [Column],
    /// information on its coefficients a priori
    pub prior: f64,
    /// the others
    pub beside: &'a [&'a Projected],
    /// gain of all
    pub together: f64,
    /// its own gain
    pub own: f64,
}

impl Alike<'_> {
    /// What it gains from coefficients of its own in every fitted record, beyond what so many freedoms gain from noise, over what it
    /// gains with the same in all: near 0 for one that is the same machine in every record. `None` with one record.
    pub fn unsteady(&self, evidence: &Evidence) -> Option<f64> {
        let data = evidence.data;
        let fitted = (0..data.records.len()).filter(|k| data.records[*k].fit);
        self.apart(evidence, &fitted.collect::<Vec<_>>(), |column, k| {
            let rows = column.rows.iter().map(|(j, v)| {
                let mut part = vec![0.0; v.len()];
                part[data.span(k)].copy_from_slice(&v[data.span(k)]);
                (*j, part)
            });
            rows.collect()
        })
    }

    /// The same with coefficients of its own on every actuator.
    pub fn uneven(&self, evidence: &Evidence) -> Option<f64> {
        let joints: Vec<usize> = (0..evidence.data.joints()).collect();
        self.apart(evidence, &joints, |column, j| {
            let own = column.rows.iter().filter(|(i, _)| *i == j);
            own.cloned().collect()
        })
    }

    /// What parts with coefficients of their own gain beyond the whole; `rows` are those of a column in one of them.
    fn apart(
        &self,
        evidence: &Evidence,
        parts: &[usize],
        rows: impl Fn(&Column, usize) -> Vec<(usize, Vec<f64>)>,
    ) -> Option<f64> {
        if parts.len() < 2 {
            return None;
        }
        let of = |k: &usize| -> Vec<Column> {
            let columns = self.columns.iter();
            columns.map(|c| Column { rows: rows(c, *k) }).collect()
        };
        let apart: Vec<Vec<Column>> = parts.iter().map(of).collect();
        let mut projected = evidence.project_all(&apart);
        projected.iter_mut().for_each(|p| p.prior = self.prior);
        let mut set = self.beside.to_vec();
        set.extend(&projected);
        let freedoms = ((parts.len() - 1) * self.columns.len()) as f64;
        let more = evidence.fit(&set).gain - self.together - T.confidence.freedom * freedoms;
        Some(more.max(0.0) / self.own.max(1e-9))
    }
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
