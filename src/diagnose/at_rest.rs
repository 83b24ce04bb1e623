//! What the records show while nothing moves. It says nothing about a model: friction at rest holds any torque
//! up to break-away, and so does whatever pushes the robot, a brake or its controller. So those rows are left
//! out, and what happened in them is said to be that.

use super::data::Data;
use super::thresholds::THRESHOLDS as T;
use crate::error::{Warning, WarningKind};
use crate::report::format::significant;

/// A record in which the whole robot stands for a while.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct AtRest {
    /// name of the record
    pub record: String,
    /// whether it is fitted to
    pub fit: bool,
    /// whether nothing moves in it at any time
    pub all: bool,
    /// time at which no joint moves, s
    pub seconds: f64,
    /// length of the record, s
    pub of: f64,
    /// joints whose torque changes meanwhile by more than noise: name, standard deviation, unit
    pub pushed: Vec<(String, f64, &'static str)>,
}

/// The records in which the whole robot stands, in the order of the data. `units` are those of the torques.
pub fn find(data: &Data, units: &[&'static str]) -> Vec<AtRest> {
    let names = data.plant.actuators();
    let mut out = Vec::new();
    for (k, r) in data.records.iter().enumerate() {
        if r.standing.is_empty() {
            continue;
        }
        let stands = |i: usize| (0..data.joints()).all(|j| r.standing[j * r.count + i]);
        let rows: Vec<usize> = (0..r.count).filter(|i| stands(*i)).collect();
        if (rows.len() as f64) * r.dt < T.rest.least {
            continue;
        }
        let pushed = (0..data.joints()).filter_map(|j| {
            let tau = r.torque(j);
            let mean = rows.iter().map(|i| tau[*i]).sum::<f64>() / rows.len() as f64;
            let square = rows.iter().map(|i| (tau[*i] - mean).powi(2)).sum::<f64>();
            let std = (square / rows.len() as f64).sqrt();
            // what it needs to move at all, where that is known
            let friction = names[j].terms[2].abs();
            let much = std > T.rest.pushed * data.noise[j].std && std > 0.5 * friction;
            much.then(|| (names[j].name.clone(), std, units[j]))
        });
        out.push(AtRest {
            record: data.records[k].name.clone(),
            fit: r.fit,
            all: !r.moves(),
            seconds: rows.len() as f64 * r.dt,
            of: r.count as f64 * r.dt,
            // between postures the torque of gravity changes: only where it stood all the time
            pushed: match r.moves() {
                true => Vec::new(),
                false => pushed.collect(),
            },
        });
    }
    out
}

/// Them in words.
pub fn warnings(all: &[AtRest]) -> Vec<Warning> {
    let one = |r: &AtRest| {
        let times = [r.seconds, r.of].map(|s| significant(s, 3));
        let why = "at rest a joint holds any torque up to its break-away friction";
        if !r.all {
            return Warning::new(
                WarningKind::StandstillLeftOut,
                r.record.clone(),
                format!(
                    "the robot stands for {} of its {} s; these rows were left out, because {why}",
                    times[0], times[1]
                ),
            );
        }
        let pushed: Vec<String> = r
            .pushed
            .iter()
            .map(|(joint, std, unit)| format!("{joint} by {} {unit}", significant(*std, 2)))
            .collect();
        let meanwhile = match pushed.is_empty() {
            true => String::new(),
            false => format!(
                "; while it stood its torques changed (standard deviation: {}): something pushed or held it, and no \
                 effect of motion can be read from that",
                pushed.join(", ")
            ),
        };
        Warning::new(
            WarningKind::RecordLeftOut,
            r.record.clone(),
            format!("nothing moves in it, so it was left out: {why}{meanwhile}"),
        )
    };
    all.iter().map(one).collect()
}
