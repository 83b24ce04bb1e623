//! A load that some records carry and others do not, although the experiment states none.
//!
//! The records are compared with each other, fitted and held out alike, for which of them is called what decides
//! nothing about what the robot carried. With `S` a single record, or all but one, and `Y_S` the columns of a mass and
//! its first moments on the rows of `S` alone,
//!
//! ```text
//! τ = W (φ₀ + δ) + Y_S (m, m c) + ε        gain(S) = χ²(nothing) − χ²(Y_S)
//! ```
//!
//! over all records. A load has a positive mass within reach of the flange, gains more than parameters do by chance, more
//! than a load in all records would, explains the larger part of what sets the records apart, is the same in both halves
//! of its records, is heavier than its uncertainty, and beats its decoys. Then the records count as carrying an unknown load
//! ([`super::payload`]), whose ten parameters are fitted beside the effects.

use super::column::Column;
use super::data::Data;
use super::decoy;
use super::evidence::{Evidence, Fit, Projected};
use super::thresholds::THRESHOLDS as T;
use crate::error::Result;
use crate::log::{self, Payload, Purpose};

/// A load that was found in some of the records.
#[derive(Debug, Clone)]
pub struct Carried {
    /// places of the records in the experiment
    pub records: Vec<usize>,
    /// 0 to 1
    pub confidence: f64,
    /// share of what sets the records apart that goes with it
    pub explains: f64,
    /// as for other effects
    pub decoys: f64,
    /// what a load of its own for either half of the records would gain, over what it gains
    pub unsteady: f64,
}

/// The load that some records carry, where there is one.
///
/// # Errors
/// Poses that cannot be reached.
pub fn find(data: &mut Data) -> Result<Option<Carried>> {
    let moving = data.records.iter().filter(|r| r.moves()).count();
    let stated = data.records.iter().any(|r| r.payload != Payload::None);
    let Some(tool) = data.plant.tool().filter(|_| !stated) else {
        return Ok(None);
    };
    if !(2..=T.carried.records).contains(&moving) {
        return Ok(None);
    }
    // every record counts alike
    let rows = data.rows();
    let fitted = std::mem::replace(&mut data.fitted, rows);
    let found = among(data, tool);
    data.fitted = fitted;
    found
}

fn among(data: &Data, tool: usize) -> Result<Option<Carried>> {
    let columns: Vec<Column> = data
        .load_columns(tool, |r| r.moves())?
        .into_iter()
        .take(4)
        .map(|rows| Column {
            rows: rows.into_iter().enumerate().collect(),
        })
        .collect();
    let moving: Vec<usize> = (0..data.records.len())
        .filter(|k| data.records[*k].moves())
        .collect();
    let mut sets: Vec<Vec<usize>> = moving.iter().map(|k| vec![*k]).collect();
    if moving.len() > 2 {
        let but = |k: &usize| moving.iter().copied().filter(|m| m != k).collect();
        sets.extend(moving.iter().map(but).collect::<Vec<Vec<usize>>>());
    }
    let evidence = Evidence::new(data, 1.0);
    let before = evidence.fit(&[]).gain;
    let try_one = |columns: &[Column]| -> (f64, Fit, Projected) {
        let projected = evidence.project(columns);
        let fit = evidence.fit(&[&projected]);
        (fit.gain - before, fit, projected)
    };
    let in_all = try_one(&columns).0;
    let mut best: Option<(f64, Fit, Projected, Vec<usize>)> = None;
    for set in sets {
        let (gain, fit, projected) = try_one(&only(data, &columns, &set));
        let eta = &fit.eta;
        let lever = (eta[1].powi(2) + eta[2].powi(2) + eta[3].powi(2)).sqrt();
        let able = eta[0] > 0.0 && lever < T.carried.reach * eta[0];
        if able && best.as_ref().is_none_or(|b| gain > b.0) {
            best = Some((gain, fit, projected, set));
        }
    }
    let Some((gain, fit, projected, set)) = best else {
        return Ok(None);
    };
    let own = only(data, &columns, &set);
    let decoys = decoy::largest(&evidence, (&own, &projected), &fit.eta, &[], gain);
    let unsteady = unsteady(data, &evidence, &own, &set, before, gain);
    let sure = fit.covariance[0][0].max(0.0).sqrt().max(1e-300);
    let explains = explained(data, &evidence, &projected, &set);
    let confidence = T.confidence.surprise.above(gain)
        * T.confidence.decoys.below(decoys)
        * T.carried.unsteady.below(unsteady)
        * T.carried.share.above(explains)
        * T.carried
            .beyond
            .above(1.0 - in_all.max(0.0) / gain.max(1e-9))
        * T.carried.mass.above(fit.eta[0] / sure);
    Ok((confidence >= T.confidence.claim).then(|| {
        let mut records: Vec<usize> = set.iter().map(|k| data.records[*k].order).collect();
        records.sort_unstable();
        Carried {
            records,
            confidence,
            explains,
            decoys,
            unsteady,
        }
    }))
}

/// Columns on the rows of some records.
fn only(data: &Data, columns: &[Column], records: &[usize]) -> Vec<Column> {
    let spans: Vec<_> = records.iter().map(|k| data.span(*k)).collect();
    masked(columns, &spans)
}

fn masked(columns: &[Column], spans: &[std::ops::Range<usize>]) -> Vec<Column> {
    let one = |column: &Column| {
        let rows = column.rows.iter().map(|(j, v)| {
            let mut part = vec![0.0; v.len()];
            for span in spans {
                part[span.clone()].copy_from_slice(&v[span.clone()]);
            }
            (*j, part)
        });
        Column {
            rows: rows.collect(),
        }
    };
    columns.iter().map(one).collect()
}

/// What a load of its own for the first and the second half of every record gains, over what one load gains.
fn unsteady(
    data: &Data,
    evidence: &Evidence,
    columns: &[Column],
    records: &[usize],
    before: f64,
    gain: f64,
) -> f64 {
    let half = |second: bool| -> Vec<Column> {
        let spans: Vec<_> = records
            .iter()
            .map(|k| {
                let span = data.span(*k);
                let middle = (span.start + span.end) / 2;
                if second {
                    middle..span.end
                } else {
                    span.start..middle
                }
            })
            .collect();
        masked(columns, &spans)
    };
    let apart = evidence.project_all(&[half(false), half(true)]);
    let set: Vec<&Projected> = apart.iter().collect();
    let freedoms = T.confidence.freedom * columns.len() as f64;
    let more = evidence.fit(&set).gain - before - gain - freedoms;
    more.max(0.0) / gain.max(1e-9)
}

/// Share of the energy above the noise of its records that goes with the load.
fn explained(data: &Data, evidence: &Evidence, load: &Projected, records: &[usize]) -> f64 {
    let energy = |set: &[&Projected]| -> f64 {
        let residual = evidence.residual(set, &evidence.fit(set));
        let all = evidence.energy(&residual);
        all.sum(|k| records.contains(&k))
    };
    let rows: f64 = records
        .iter()
        .flat_map(|k| (0..data.joints()).map(|j| data.records[*k].counts(j) as f64))
        .sum();
    let [without, with] = [energy(&[]), energy(&[load])];
    match without > rows {
        true => ((without - with) / (without - rows)).clamp(0.0, 1.0),
        false => 0.0,
    }
}

impl Carried {
    /// The logs with what was found: the records carry an unknown load, and are fitted, since nothing else tells it.
    pub fn stated(&self, logs: &[log::Record]) -> Vec<log::Record> {
        let fitted = |r: &log::Record| r.purpose == Purpose::Fit;
        let any = self.records.iter().any(|k| fitted(&logs[*k]));
        let mut logs = logs.to_vec();
        for k in &self.records {
            logs[*k].payload = Payload::Unknown;
            if !any {
                logs[*k].purpose = Purpose::Fit;
            }
        }
        logs
    }
}
