//! A load that some records carry and others do not, although the experiment states none; loads that differ by record,
//! because what was one in the experiment was mounted again.
//!
//! The records are compared with each other, fitted and held out alike, for which of them is called what decides
//! nothing about what the robot carried. With `S` a single record, or all but one, and `Y_S` the columns of a mass and
//! its first moments on the rows of `S` alone,
//!
//! ```text
//! τ = W (φ₀ + δ) + Y_S (m, m c) + ε        gain(S) = χ²(nothing) − χ²(Y_S)
//! ```
//!
//! over all records. Of four records and more, `S` are also those whose own loads are heavier than their uncertainty, where
//! one record carries nothing. A load has a positive mass within reach of the flange, gains more than parameters do by chance, more
//! than a load in all records would, explains the larger part of what sets the records apart, is the same in both halves
//! of its records, is heavier than its uncertainty, and beats its decoys. Then the records count as carrying an unknown load
//! ([`super::payload`]), whose ten parameters are fitted beside the effects.
//!
//! Where `S` has more than one record, or all, a load of its own in each of them is tried, too. It must gain more than
//! the best single load does, by [`T.carried.beyond`](super::thresholds). Records that share one unknown load, found or stated, are then
//! asked once more: what does a load of its own explain of what one load leaves?

use super::catalogue::away;
use super::column::Column;
use super::data::Data;
use super::decoy;
use super::evidence::{Evidence, Fit, Projected};
use super::payload::{Loads, is_free};
use super::thresholds::THRESHOLDS as T;
use crate::error::Result;
use crate::log::{self, Payload, Purpose};

/// A load that was found in some of the records.
#[derive(Debug, Clone)]
pub struct Carried {
    /// places of the records in the experiment
    pub records: Vec<usize>,
    /// whether they carry one load, or each its own
    pub loads: Loads,
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
    all_alike(data, |data| among(data, tool))
}

/// Whether records of an unknown load carry loads of their own, because it was mounted again.
///
/// # Errors
/// Poses that cannot be reached.
pub fn remounted(data: &mut Data) -> Result<Option<Carried>> {
    let one = data.first_free_load();
    let shares = |k: &usize| data.records[*k].moves() && one.is_some() && data.free_load[*k] == one;
    let set: Vec<usize> = (0..data.records.len()).filter(shares).collect();
    let Some(tool) = data.plant.tool().filter(|_| set.len() > 1) else {
        return Ok(None);
    };
    all_alike(data, |data| {
        let trials = Trials::new(data, tool)?;
        // one load is in the model already: the first record keeps it
        let parts: Vec<Vec<usize>> = set[1..].iter().map(|k| vec![*k]).collect();
        let found = trials.run(parts);
        Ok(trials.judged(found, set.clone(), Loads::ByRecord, None))
    })
}

/// Looks at the records with every one counting alike, fitted and held out.
fn all_alike<T>(data: &mut Data, look: impl FnOnce(&Data) -> T) -> T {
    let rows = data.rows();
    let fitted = std::mem::replace(&mut data.fitted, rows);
    let found = look(data);
    data.fitted = fitted;
    found
}

fn among(data: &Data, tool: usize) -> Result<Option<Carried>> {
    let trials = Trials::new(data, tool)?;
    let moving: Vec<usize> = (0..data.records.len())
        .filter(|k| data.records[*k].moves())
        .collect();
    let mut sets: Vec<Vec<usize>> = moving.iter().map(|k| vec![*k]).collect();
    if moving.len() > 2 {
        let but = |k: &usize| moving.iter().copied().filter(|m| m != k).collect();
        sets.extend(moving.iter().map(but).collect::<Vec<Vec<usize>>>());
    }
    if moving.len() > 3 {
        sets.extend(moving.iter().map(|k| trials.loaded(*k, &moving)));
        sets.retain(|s| !s.is_empty());
        sets.sort();
        sets.dedup();
    }
    let in_all = trials.run(vec![moving.clone()]).gain;
    let mut best: Option<Found> = None;
    let keep = |best: &mut Option<Found>, trial: Trial, set: &[usize], loads: Loads| {
        if trial.able && best.as_ref().is_none_or(|b| trial.merit() > b.0.merit()) {
            *best = Some((trial, set.to_vec(), loads));
        }
    };
    for set in &sets {
        keep(&mut best, trials.run(vec![set.clone()]), set, Loads::One);
    }
    let one = best.as_ref().map_or(0.0, |b| b.0.merit());
    let least = one.max(0.0) / (1.0 - T.carried.beyond.centre);
    sets.push(moving);
    for set in sets.iter().filter(|s| s.len() > 1) {
        let own = trials.run(set.iter().map(|k| vec![*k]).collect());
        if own.merit() > least {
            keep(&mut best, own, set, Loads::ByRecord);
        }
    }
    Ok(best.and_then(|(trial, set, loads)| trials.judged(trial, set, loads, Some(in_all))))
}

/// Loads that were tried, the records that carry them, and whether it is one.
type Found = (Trial, Vec<usize>, Loads);

/// A mass and its first moments.
const LOAD: usize = 4;

/// What loads in some of the records gain.
struct Trials<'d> {
    data: &'d Data<'d>,
    evidence: Evidence<'d>,
    /// columns of a load in all records
    columns: Vec<Column>,
    /// what a fit without any gains
    before: f64,
}

/// Loads that were tried: one for each part of the records.
struct Trial {
    gain: f64,
    fit: Fit,
    own: Vec<Column>,
    projected: Projected,
    /// whether each has a positive mass within reach
    able: bool,
}

impl Trial {
    /// Its gain less what its freedoms gain by chance.
    fn merit(&self) -> f64 {
        self.gain - T.confidence.freedom * self.own.len() as f64
    }

    /// Masses of the loads over their standard deviations.
    fn masses(&self) -> impl Iterator<Item = f64> + '_ {
        let sure = |k: usize| self.fit.covariance[k][k].max(0.0).sqrt().max(1e-300);
        let all = (0..self.fit.eta.len()).step_by(LOAD);
        all.map(move |k| self.fit.eta[k] / sure(k))
    }
}

impl<'d> Trials<'d> {
    fn new(data: &'d Data<'d>, tool: usize) -> Result<Self> {
        let columns = data.load_columns(tool, |r| r.moves())?.into_iter();
        let columns = columns.take(LOAD).map(|rows| Column {
            rows: rows.into_iter().enumerate().collect(),
        });
        let evidence = Evidence::new(data, 1.0);
        Ok(Trials {
            data,
            before: evidence.fit(&[]).gain,
            evidence,
            columns: columns.collect(),
        })
    }

    /// The records that carry something, if record `empty` carries nothing.
    fn loaded(&self, empty: usize, all: &[usize]) -> Vec<usize> {
        let others: Vec<usize> = all.iter().copied().filter(|k| *k != empty).collect();
        let trial = self.run(others.iter().map(|k| vec![*k]).collect());
        let heavy = others.into_iter().zip(trial.masses());
        heavy
            .filter(|(_, m)| *m > T.carried.mass.centre)
            .map(|(k, _)| k)
            .collect()
    }

    fn run(&self, parts: Vec<Vec<usize>>) -> Trial {
        let own: Vec<Column> = parts
            .iter()
            .flat_map(|set| only(self.data, &self.columns, set))
            .collect();
        let projected = self.evidence.project(&own);
        let fit = self.evidence.fit(&[&projected]);
        let mut loads = fit.eta.chunks_exact(LOAD);
        let able = loads.all(|eta| eta[0] > 0.0 && away(eta) < T.carried.reach);
        Trial {
            gain: fit.gain - self.before,
            fit,
            own,
            projected,
            able,
        }
    }

    /// The loads, where they are sure enough. `in_all`: what one load in all records gains; `None` where one is in the model,
    /// and these are differences from it.
    fn judged(
        &self,
        found: Trial,
        set: Vec<usize>,
        loads: Loads,
        in_all: Option<f64>,
    ) -> Option<Carried> {
        let lightest = found.masses().fold(f64::INFINITY, f64::min);
        let Trial {
            gain,
            fit,
            own,
            projected,
            ..
        } = found;
        let (data, evidence) = (self.data, &self.evidence);
        let decoys = decoy::largest(evidence, (&own, &projected), &fit.eta, &[], gain);
        let unsteady = unsteady(data, evidence, &own, &set, self.before, gain);
        let explains = explained(data, evidence, &projected, &set);
        let loads_themselves = in_all.map_or(1.0, |in_all| {
            T.carried
                .beyond
                .above(1.0 - in_all.max(0.0) / gain.max(1e-9))
                * T.carried.mass.above(lightest)
        });
        let confidence = T.confidence.surprise.above(gain)
            * T.confidence.decoys.below(decoys)
            * T.carried.unsteady.below(unsteady)
            * T.carried.share.above(explains)
            * loads_themselves;
        (confidence >= T.confidence.claim).then(|| {
            let mut records: Vec<usize> = set.iter().map(|k| data.records[*k].order).collect();
            records.sort_unstable();
            Carried {
                records,
                loads,
                confidence,
                explains,
                decoys,
                unsteady,
            }
        })
    }
}

/// Columns on the rows of some records.
fn only(data: &Data, columns: &[Column], records: &[usize]) -> Vec<Column> {
    let spans: Vec<_> = records.iter().map(|k| data.span(*k)).collect();
    masked(columns, &spans)
}

fn masked(columns: &[Column], spans: &[std::ops::Range<usize>]) -> Vec<Column> {
    columns.iter().map(|c| c.within(spans)).collect()
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
    /// The logs with what was found: the records carry an unknown load, and are fitted where nothing else tells it.
    pub fn stated(&self, logs: &[log::Record]) -> Vec<log::Record> {
        let fitted = |r: &log::Record| r.purpose == Purpose::Fit;
        let told = self.loads == Loads::One;
        let any = told && self.records.iter().any(|k| fitted(&logs[*k]));
        let mut logs = logs.to_vec();
        for k in &self.records {
            // a load of known mass alone is free already, and all that are free must be stated alike
            if !is_free(logs[*k].payload) {
                logs[*k].payload = Payload::Unknown;
            }
            if !any {
                logs[*k].purpose = Purpose::Fit;
            }
        }
        logs
    }
}
