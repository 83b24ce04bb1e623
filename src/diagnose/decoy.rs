//! Decoys: what columns of no meaning would explain.
//!
//! The columns of an effect, moved cyclically in time within every record by a share of its length, keep
//! their size, their spectrum and their autocorrelation, and lose what ties them to the motion. Fitted in
//! the place of the effect, with the same number of coefficients and beside the same other effects, they
//! gain what any flexible enough signal gains from a residual that is not white:
//!
//! ```text
//! z_d(t) = z(t + f_d T mod T)        gain_d = χ²(others) − χ²(others, z_d),   d = 1 … D
//! ```
//!
//! Shifts near nothing and near half a record are left out: there a column of a motion of odd harmonics is
//! itself, up to its sign. This is the circular-shift null of time series (Theiler et al. 1992 call such
//! series surrogates).

use super::column::Column;
use super::data::Data;
use super::evidence::{Evidence, Projected};
use super::thresholds::THRESHOLDS as T;

/// Fractional part of the golden ratio: multiples of it fill an interval evenly.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// Shares of a record by which decoys are moved, within 0.1 to 0.4 and 0.6 to 0.9.
fn shifts() -> impl Iterator<Item = f64> {
    (0..T.decoys.count).map(|d| {
        let golden = (GOLDEN * (d as f64 + 1.0)).fract();
        let near = T.decoys.nearest + T.decoys.spread * golden;
        if d % 2 == 0 { near } else { 1.0 - near }
    })
}

/// A column moved cyclically within every record.
fn moved(data: &Data, column: &Column, share: f64) -> Column {
    let rows = column.rows.iter().map(|(j, v)| {
        let mut v = v.clone();
        for k in 0..data.records.len() {
            let piece = &mut v[data.span(k)];
            let by = (share * piece.len() as f64) as usize;
            piece.rotate_left(by);
        }
        (*j, v)
    });
    Column {
        rows: rows.collect(),
    }
}

/// The most that a decoy of an effect, its columns as they are and projected, with these coefficients
/// gains of its own, over `own`, what the effect gains beside the others:
///
/// ```text
/// max over d:  gain_d / gain − overlap_d
/// ```
///
/// A slow column resembles itself when it is moved; what its decoy takes for that reason, the overlap, is
/// no evidence against it. Near 0 for an effect that is there, 1 and more for one that is as good as any.
pub fn largest(
    evidence: &Evidence,
    (columns, projected): (&[Column], &Projected),
    eta: &[f64],
    beside: &[&Projected],
    own: f64,
) -> f64 {
    let of = |share| -> Vec<Column> {
        let of = |c| moved(evidence.data, c, share);
        columns.iter().map(of).collect()
    };
    let beside = evidence.set(beside);
    let gain = |decoy: &Projected| beside.with(decoy).gain - beside.gain();
    let excess = |d: &Projected| gain(d) / own.max(1e-9) - evidence.overlap(projected, eta, d);
    // a few at a time: decoys of many columns are large
    let all: Vec<f64> = shifts().collect();
    let some = |shifts: &[f64]| {
        let sets: Vec<Vec<Column>> = shifts.iter().map(|s| of(*s)).collect();
        let mut decoys = evidence.project_all(&sets);
        decoys.iter_mut().for_each(|d| d.prior = projected.prior);
        decoys.iter().map(excess).fold(0.0, f64::max)
    };
    all.chunks((12 / columns.len().max(1)).max(1))
        .map(some)
        .fold(0.0, f64::max)
}
