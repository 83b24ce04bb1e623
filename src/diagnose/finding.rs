//! Effects in the result: members of the set that was fitted, and what could stand in their place.

use super::carried::Carried;
use super::catalogue::{self, Context, Effect, Estimate, Place, Shape, Value, in_mujoco};
use super::evidence::{Evidence, Projected};
use super::interval;
use super::thresholds::THRESHOLDS as T;
use super::verdict::Decision;
use crate::export::Form;

/// One effect in the result.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Finding {
    /// name, as in `formats.md`
    pub effect: &'static str,
    /// name in sentences
    pub title: &'static str,
    /// equation of the catalogue
    pub equation: &'static str,
    /// what tells it apart
    pub separated_by: &'static str,
    /// names of the actuators; empty for the whole robot
    pub joints: Vec<String>,
    /// where
    pub place: Place,
    /// shape
    pub shape: Shape,
    /// names of the records that it is in; empty for all
    pub records: Vec<String>,
    /// coefficients
    pub eta: Vec<f64>,
    /// 0 to 1; see [`Finding::is_claim`]
    pub confidence: f64,
    /// share of the gap on fitted records
    pub explains: f64,
    /// 95 % interval of it
    pub interval: [f64; 2],
    /// share of the gap on holdout records, where these show one
    pub holdout: Option<f64>,
    /// share of the effect that the nominal model cannot absorb
    pub visibility: f64,
    /// the most that a decoy, the effect moved in time, gains of its own over what the effect gains; of
    /// members of the set
    pub decoys: Option<f64>,
    /// what coefficients of their own for every fitted record gain over what the effect gains; of members
    pub unsteady: Option<f64>,
    /// the same with coefficients of their own for every joint; of a delay of the whole robot
    pub uneven: Option<f64>,
    /// parameters
    pub values: Vec<Value>,
    /// effects that this data cannot tell from it
    pub same: Vec<&'static str>,
    /// how the files for MuJoCo hold it
    pub mujoco: Form,
    /// whether it is part of the set that was fitted, or only a rival
    pub member: bool,
    /// whether it shows against the prior of the parameters, not in a refitted residual
    pub frozen: bool,
}

impl Finding {
    /// Whether it is claimed: it belongs to the set, and is at least as likely there as not.
    pub fn is_claim(&self) -> bool {
        self.member && self.confidence >= T.confidence.claim
    }

    /// An effect as it was estimated, a member of the set of which nothing else is known yet.
    pub(super) fn of(cx: &Context, effect: &dyn Effect, estimated: Estimate) -> Self {
        let card = effect.card();
        Finding {
            effect: card.name,
            title: card.title,
            equation: card.equation,
            separated_by: card.separated_by,
            joints: names(cx, &estimated.place),
            records: Vec::new(),
            confidence: 0.0,
            explains: 0.0,
            interval: [0.0, 1.0],
            holdout: None,
            visibility: 1.0,
            decoys: None,
            unsteady: None,
            uneven: None,
            values: effect.values(cx, &estimated),
            same: Vec::new(),
            mujoco: in_mujoco(cx, effect, &estimated),
            member: true,
            frozen: false,
            place: estimated.place,
            shape: estimated.shape,
            eta: estimated.eta,
        }
    }
}

/// By falling confidence, none of which is above what names turned out to be right; equal ones by what they explain.
pub fn order(findings: &mut [Finding]) {
    for f in findings.iter_mut() {
        f.confidence = f.confidence.min(T.confidence.most);
    }
    findings.sort_by(|a, b| {
        let sure = b.confidence.total_cmp(&a.confidence);
        sure.then(b.explains.total_cmp(&a.explains))
    });
}

/// Members and rivals of a decision, in their [`order`]; `seed` is that of the intervals.
pub fn findings(
    evidence: &Evidence,
    cx: &Context,
    effects: &[Box<dyn Effect>],
    decision: &Decision,
    seed: u64,
) -> Vec<Finding> {
    let mut all = members(evidence, cx, effects, decision, seed);
    rivals(&mut all, cx, effects, decision);
    order(&mut all);
    all
}

/// Names of the actuators of a place; none for the whole robot.
pub(super) fn names(cx: &Context, place: &Place) -> Vec<String> {
    let actuators = cx.data.plant.actuators();
    let named = place.named().into_iter();
    named.map(|j| actuators[j].name.clone()).collect()
}

pub(super) fn estimate(place: Place, shape: &Shape, eta: &[f64], std: &[f64]) -> Estimate {
    Estimate {
        place,
        shape: shape.clone(),
        eta: eta.to_vec(),
        std: std.to_vec(),
    }
}

fn members(
    evidence: &Evidence,
    cx: &Context,
    effects: &[Box<dyn Effect>],
    decision: &Decision,
    seed: u64,
) -> Vec<Finding> {
    let data = evidence.data;
    let members = decision.projected();
    let scatter = |set: &[&Projected]| -> Vec<Vec<f64>> {
        evidence.as_counted(&evidence.residual(set, &evidence.fit(set)))
    };
    let (all, gap) = (scatter(&members), scatter(&[]));
    let mut findings = Vec::new();
    for (i, m) in decision.members.iter().enumerate() {
        let mut rest = members.clone();
        rest.remove(i);
        let total = match m.frozen {
            true => &evidence.as_counted(&evidence.r),
            false => &gap,
        };
        let without = scatter(&rest);
        let interval = interval::explained(data, total, &without, &all, m.explains, seed);
        let c = &m.candidate;
        let effect = effects[c.effect].as_ref();
        let card = effect.card();
        let mut same: Vec<&'static str> = Vec::new();
        for r in m.rivals.iter().filter(|r| r.weight > T.rivals.same) {
            let rival = effects[r.effect].card().name;
            if rival != card.name && !same.contains(&rival) {
                same.push(rival);
            }
        }
        let estimated = estimate(c.place, &c.shape, &c.eta, &m.std);
        findings.push(Finding {
            confidence: m.confidence,
            explains: m.explains,
            interval,
            holdout: m.holdout,
            visibility: m.visibility,
            decoys: m.decoys,
            unsteady: m.unsteady,
            uneven: m.uneven,
            same,
            frozen: m.frozen,
            ..Finding::of(cx, effect, estimated)
        });
    }
    findings
}

/// What could stand in the place of a member, with what is left of its confidence.
fn rivals(
    findings: &mut Vec<Finding>,
    cx: &Context,
    effects: &[Box<dyn Effect>],
    decision: &Decision,
) {
    for (m, of) in decision.members.iter().enumerate() {
        let mut seen: Vec<usize> = Vec::new();
        for r in &of.rivals {
            let (effect, card) = (effects[r.effect].as_ref(), effects[r.effect].card());
            let known = findings.iter().any(|f| f.effect == card.name);
            if seen.len() >= T.rivals.places
                || r.weight < T.rivals.listed
                || seen.contains(&r.effect)
                || known
            {
                continue;
            }
            seen.push(r.effect);
            let of_rival = estimate(r.place, &r.shape, &r.eta, &vec![0.0; r.eta.len()]);
            let main = &findings[m];
            findings.push(Finding {
                confidence: (main.confidence * r.weight).min(T.rivals.believed),
                explains: main.explains * (1.0 - r.loss).clamp(0.0, 1.0),
                interval: main.interval.map(|v| v * (1.0 - r.loss).clamp(0.0, 1.0)),
                holdout: main.holdout.map(|h| h * (1.0 - r.loss).clamp(0.0, 1.0)),
                visibility: of.visibility,
                same: if r.weight > T.rivals.same {
                    vec![main.effect]
                } else {
                    Vec::new()
                },
                member: false,
                frozen: main.frozen,
                ..Finding::of(cx, effect, of_rival)
            });
        }
    }
}

/// The loads that some records carry, with what the fit beside the effects says of them.
pub fn carried(
    evidence: &Evidence,
    cx: &Context,
    phi: &[f64],
    load: &Carried,
    effects: &[Box<dyn Effect>],
) -> Vec<Finding> {
    let mut all: Vec<usize> = evidence.data.free_load.iter().flatten().copied().collect();
    all.dedup();
    let one = |at| one_load(evidence, cx, phi, load, effects, at);
    all.into_iter().filter_map(one).collect()
}

/// That with its ten parameters from `at` on.
fn one_load(
    evidence: &Evidence,
    cx: &Context,
    phi: &[f64],
    load: &Carried,
    effects: &[Box<dyn Effect>],
    at: usize,
) -> Option<Finding> {
    let data = evidence.data;
    let effect = catalogue::named(effects, "payload")?;
    let place = *effect.sites(cx).first()?;
    let eta = phi.get(at..at + 10)?.to_vec();
    let scale = super::verdict::inflation(&evidence.residual(&[], &evidence.fit(&[])), data.fitted);
    let std: Vec<f64> = (at..at + 10).map(|i| scale * evidence.std(i)).collect();
    // a load without weight is none
    let shape = effect.shapes(cx, &place).pop()?;
    let load_of = estimate(place, &shape, &eta, &std);
    let mut of: Vec<(usize, String)> = data
        .records
        .iter()
        .zip(&data.free_load)
        .filter(|(r, own)| **own == Some(at) && load.records.contains(&r.order))
        .map(|(r, _)| (r.order, r.name.clone()))
        .collect();
    of.sort();
    Some(Finding {
        records: of.into_iter().map(|r| r.1).collect(),
        confidence: load.confidence,
        explains: load.explains,
        decoys: Some(load.decoys),
        unsteady: Some(load.unsteady),
        frozen: true,
        ..Finding::of(cx, effect, load_of)
    })
}
