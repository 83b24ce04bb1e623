//! Result of a diagnosis.

use super::at_rest::AtRest;
use super::catalogue::Effect;
use super::data::Data;
use super::evidence::Evidence;
use super::finding::Finding;
use super::forward::Forward;
use super::gap::{self, JointGap, Shares};
use super::improve::Improved;
use super::lacking;
use super::next::{INVISIBLE, Proposal};
use super::noise::Source;
use super::posterior::Posterior;
use super::prior::Closeness;
use super::search::Candidate;
use super::second_encoder::SecondEncoder;
use super::thresholds::THRESHOLDS as T;
use super::traces::Trace;
use super::verdict::Verdict;
use crate::error::Warning;
use crate::signals::series::Series;

/// Energy of the gap in one record before and after the set, in units of the noise variance a sample.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct RecordGap {
    /// name
    pub name: String,
    /// whether it was fitted to
    pub fit: bool,
    /// by actuator: frozen, refitted, with the effects
    pub joints: Vec<[f64; 3]>,
    /// whether periods repeat
    pub repeats: bool,
    /// remarks
    pub remarks: Vec<String>,
}

/// Result of a diagnosis.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Diagnosis {
    /// robot
    pub robot: String,
    /// names of the actuators
    pub joints: Vec<String>,
    /// units of their torques
    pub units: Vec<&'static str>,
    /// verdict
    pub verdict: Verdict,
    /// effects by falling confidence
    pub findings: Vec<Finding>,
    /// gap of the frozen model, fitted records
    pub frozen: Vec<JointGap>,
    /// gap after a refit under the prior
    pub refit: Vec<JointGap>,
    /// gap with the effects
    pub explained: Vec<JointGap>,
    /// odd, even, non-periodic
    pub shares: Shares,
    /// records
    pub records: Vec<RecordGap>,
    /// gap energy on holdout before and after; `None` without a holdout record in which anything moves
    pub holdout: Option<[f64; 2]>,
    /// whether anything moves in the fitted records
    pub moves: bool,
    /// records in which the robot stands for a while, or all the time
    pub at_rest: Vec<AtRest>,
    /// what second encoders show of the joints that have one
    pub second_encoder: Vec<SecondEncoder>,
    /// whether a refit of the nominal parameters leaves more on a joint than a sound model does
    pub stands_out: bool,
    /// share of the gap that stays
    pub unexplained: f64,
    /// joints whose own gap stays for the most part; beside friction that the file leaves out, what that friction leaves of it
    pub stays_on: Vec<String>,
    /// share of the gap that any function of the state could explain, by cross-validation between
    /// periods of state bins; `None` where there is nothing to explain, or no record repeats
    pub bound: Option<f64>,
    /// figures
    pub traces: Vec<Trace>,
    /// where the noise floor comes from
    pub noise_source: String,
    /// effects that this motion cannot show: name, joint, visibility
    pub untestable: Vec<(&'static str, String, f64)>,
    /// effects that fit with values that no machine can have
    pub ruled_out: Vec<RuledOut>,
    /// parameters of the nominal model as fitted beside the effects
    pub phi: Vec<f64>,
    /// the model with the effects that were claimed
    pub improved: Improved,
    /// robots that the records do not exclude; `None` where none were asked for
    pub posterior: Option<Posterior>,
    /// proposal for the next experiment
    pub next: Option<Proposal>,
    /// the robot simulated under the recorded torques, before and after
    pub forward: Forward,
    /// warnings
    pub warnings: Vec<Warning>,
    /// threshold and scale: penalty of the prior before and after
    pub surprise: [f64; 2],
    /// factors on the deviations of the prior that the records find likeliest
    pub closeness: Closeness,
    /// window of the torque channel, samples squared beyond ±1 sample
    pub window: f64,
    /// time by which the dry friction of the model reverses before the velocity does, s
    pub lead: f64,
    /// whether the robot file states no friction and the records show some, which is among the findings
    pub friction_found: bool,
    /// whether a small share of such friction counts as no gap, for how it turns is known in part only
    pub turns_in_part: bool,
}

impl Diagnosis {
    /// Whether friction that the robot file does not state is all that is claimed.
    pub(super) fn friction_alone(&self) -> bool {
        let claims = || self.findings.iter().filter(|f| f.is_claim());
        self.friction_found && claims().all(|f| lacking::is_term(f.effect))
    }

    /// Share of the gap on holdout records that vanishes with what was found, where they show one.
    pub(super) fn shrink(&self) -> Option<f64> {
        let shown = self.holdout.filter(|[before, _]| *before > 0.0);
        shown.map(|[before, after]| 1.0 - after / before)
    }
}

/// Energies of the gap record by record from residuals in N m or N, and whitened: of the frozen model, refitted, and with the
/// effects, which goes with the parameters `phi`.
pub fn record_gaps(
    evidence: &Evidence,
    phi: &[f64],
    residuals: [&[Vec<f64>]; 3],
    whitened: [&[Vec<f64>]; 3],
) -> Vec<RecordGap> {
    let data = evidence.data;
    let all = residuals.map(|e| gap::scaled(data, e));
    let above = |k: usize, r: &Series, j: usize, i: usize| {
        let rows = r.counts(j).max(1) as f64;
        match data.counts_whitened(j) {
            true => evidence.beyond(j, &whitened[i][j], k) / rows,
            false => {
                let (a, b) = gap::excess(r, j, &all[i][j][data.span(k)]);
                (a + b) / rows - data.noise[j].excess
            }
        }
    };
    let remarks = |k: usize, r: &Series| {
        let load = data.free_load_in_words(k, phi);
        r.remarks.iter().cloned().chain(load).collect()
    };
    data.records
        .iter()
        .enumerate()
        .map(|(k, r)| RecordGap {
            name: r.name.clone(),
            fit: r.fit,
            joints: (0..data.joints())
                .map(|j| std::array::from_fn(|i| above(k, r, j, i).max(0.0)))
                .collect(),
            repeats: r.cycle.is_some(),
            remarks: remarks(k, r),
        })
        .collect()
}

/// An effect that would explain the records best with values that no machine can have.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct RuledOut {
    /// name, as in `formats.md`
    pub effect: &'static str,
    /// name in sentences
    pub title: &'static str,
    /// names of the actuators; empty for the whole robot
    pub joints: Vec<String>,
    /// why no machine has it
    pub why: String,
}

/// Effects that were ruled out, the ones that would explain most first: those that gain as much as an effect
/// must, and at least a tenth of the best.
pub fn ruled_out(data: &Data, list: &[Candidate], effects: &[Box<dyn Effect>]) -> Vec<RuledOut> {
    let best = list.iter().map(|c| c.gain).fold(0.0, f64::max);
    let least = (T.search.worth_a_word * best).max(T.entry.gain * data.fitted as f64);
    let mut all: Vec<(&Candidate, &String, f64)> = list
        .iter()
        .filter_map(|c| c.ruled_out.as_ref().map(|(why, gain)| (c, why, *gain)))
        .filter(|(.., gain)| *gain > least)
        .collect();
    all.sort_by(|a, b| b.2.total_cmp(&a.2));
    let names = data.plant.actuators();
    let one = |(c, why, _): &(&Candidate, &String, f64)| {
        let card = effects[c.effect].card();
        let named = c.place.named().into_iter();
        RuledOut {
            effect: card.name,
            title: card.title,
            joints: named.map(|j| names[j].name.clone()).collect(),
            why: (*why).clone(),
        }
    };
    all.iter().take(T.search.words).map(one).collect()
}

/// Effects that the nominal model absorbs to more than 99 % in this motion.
pub fn untestable(
    data: &Data,
    list: &[Candidate],
    effects: &[Box<dyn Effect>],
) -> Vec<(&'static str, String, f64)> {
    let names = data.plant.actuators();
    let mut out = Vec::new();
    for c in list {
        let visibility = c.projected.visibility(None);
        if visibility < INVISIBLE {
            let named = c.place.named().into_iter();
            let place: Vec<&str> = named.map(|j| names[j].name.as_str()).collect();
            out.push((effects[c.effect].card().name, place.join(", "), visibility));
        }
    }
    out
}

/// Where the noise floor comes from, in words.
pub fn noise_source(data: &Data) -> String {
    let from = match data.noise[0].source {
        Source::Periods => "the scatter between repeated periods",
        Source::HighBand => {
            "the residual above the band of the motion (no record repeats, so that noise below it is \
             assumed to be as high)"
        }
    };
    let whitened = match (0..data.joints()).any(|j| data.counts_whitened(j)) {
        true => {
            "; behind coarse encoders what they cannot resolve is taken off, too, frequency by frequency"
        }
        false => "",
    };
    format!("{from}{whitened}")
}
