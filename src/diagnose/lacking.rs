//! Friction that the robot file does not hold.
//!
//! A file from CAD often states no friction at all, that of a simulator only damping, and every machine has both in every joint. The
//! effects of the catalogue are told apart beside a model with friction; without it the first of them takes what it can of the
//! friction of all joints. So what the file states of no joint, and an offset of every joint, is fitted with the nominal model first,
//!
//! ```text
//! τ = W (φ₀ + δ) + Σ_j (F_v q̇ + F_c sgn q̇ + o)_j + ε        δ ~ N(0, P),  F_v, F_c > 0
//! ```
//!
//! with nothing known of their size. Those that stand out of their own deviation are taken into the nominal model, and the
//! effects are looked for beside them. Each is a finding: its share is what comes back when the friction of its joint is taken out of
//! a fit of all of them, of the gap that the refit without any leaves. Where the speeds do not tell viscous from Coulomb friction of a
//! joint, the better known of the two is named, and that it is not told from the other.

use super::catalogue::{Context, Effect, Place, Shape, Value};
use super::chain;
use super::channel::Assumed;
use super::data::Data;
use super::evidence::{Evidence, Fit, Projected};
use super::finding::{self, Finding, estimate};
use super::improve::Improved;
use super::payload::Loads;
use super::thresholds::THRESHOLDS as T;
use super::verdict::{State, Verdict, inflation};
use super::{catalogue, closeness, gathered, interval};
use crate::error::{Result, Warning, WarningKind};
use crate::export::{Part, Remark};
use crate::log;
use crate::plant::{self, Plant};
use crate::robot::{Joint, JointTerm, Robot};
use std::borrow::Cow;

/// What is fitted where nothing is stated, and the effect that it is.
const TERMS: [(JointTerm, &str); 3] = [
    (JointTerm::Viscous, "viscous_friction"),
    (JointTerm::Coulomb, "coulomb_friction"),
    (JointTerm::Offset, "torque_offset"),
];

/// Whether an effect is one of those that are fitted where nothing is stated.
pub fn is_term(effect: &str) -> bool {
    TERMS.iter().any(|t| t.1 == effect)
}

/// The parameter of a term of an actuator, and the name of its effect.
struct Own {
    /// place among the parameters
    at: usize,
    actuator: usize,
    term: JointTerm,
    effect: &'static str,
}

impl Own {
    /// How much of it parameters hold: friction brakes, an offset has either sign.
    fn size(&self, phi: &[f64]) -> f64 {
        match self.term {
            JointTerm::Offset => phi[self.at].abs(),
            _ => phi[self.at],
        }
    }

    fn place(&self) -> Place {
        Place::Actuator(self.actuator)
    }

    /// Whether another one stands for the same: viscous and Coulomb friction of a joint share what both explain, an offset stands for
    /// itself.
    fn shares(&self, other: &Own) -> bool {
        let offset = |own: &Own| own.term == JointTerm::Offset;
        self.actuator == other.actuator && offset(self) == offset(other)
    }
}

/// What goes with terms of a joint that share it.
struct Taken {
    /// 0 to 1: that any of them is there
    confidence: f64,
    /// share of the gap on fitted records, and its 95 % interval
    explains: f64,
    interval: [f64; 2],
    /// share on holdout records, where these show a gap
    holdout: Option<f64>,
}

/// What the file of a robot leaves out of its friction: viscous or Coulomb friction that it states of no joint, or lists of a joint to be
/// identified without a value, and an offset beside the former.
#[derive(Clone, Debug)]
pub struct Lacking {
    /// by joint, in the order of [`JointTerm::ALL`]
    of: Vec<[bool; JointTerm::ALL.len()]>,
}

impl Lacking {
    /// What the file of a tree leaves out; `None` where that is neither viscous nor Coulomb friction.
    pub fn of(plant: &Plant) -> Option<Self> {
        const FRICTION: [JointTerm; 2] = [JointTerm::Viscous, JointTerm::Coulomb];
        let robot = plant.robot();
        let of_all = |term: JointTerm| !states(robot, term);
        let offsets = FRICTION.map(of_all).contains(&true) && of_all(JointTerm::Offset);
        let lacks = |j: &Joint, term: JointTerm| match term {
            JointTerm::Armature => false,
            JointTerm::Offset => offsets,
            _ => of_all(term) || j.identify[term as usize] && j.terms[term as usize] == 0.0,
        };
        let joints = robot.joints.iter();
        let of: Vec<_> = joints
            .map(|j| JointTerm::ALL.map(|t| lacks(j, t)))
            .collect();
        let any = of.iter().flatten().any(|lacks| *lacks);
        (any && chain::may_lack_friction(plant)).then_some(Self { of })
    }

    /// The robot with it among its unknowns.
    fn opened(&self, plant: &Plant) -> Plant {
        let also = |at: usize, j: &Joint| {
            JointTerm::ALL.map(|t| j.identify[t as usize] || self.of[at][t as usize])
        };
        plant.clone().identifying(&also)
    }

    /// Its terms of all actuators among the parameters of a model.
    fn terms(&self, plant: &Plant) -> Vec<Own> {
        let actuated = plant.actuated();
        let of = |(at, p): (usize, &plant::Parameter)| match p.kind {
            plant::Column::Term { joint, term } if self.of[joint][term as usize] => Some(Own {
                at,
                actuator: actuated.iter().position(|a| *a == joint)?,
                term,
                effect: TERMS.iter().find(|t| t.0 == term)?.1,
            }),
            _ => None,
        };
        let all = plant.parameters().iter().enumerate();
        all.filter_map(of).collect()
    }

    /// Whether a robot has none of it.
    fn is_left_out(&self, robot: &Robot) -> bool {
        let terms = robot.joints.iter().flat_map(|j| j.terms);
        let mut all = terms.zip(self.of.iter().flatten());
        all.all(|(value, lacks)| !lacks || value == 0.0)
    }

    /// What the report says of it.
    pub fn warning(&self, plant: &Plant) -> Warning {
        let joints = &plant.robot().joints;
        let lacks = |term: JointTerm| -> Vec<&str> {
            let all = joints.iter().zip(&self.of);
            let lack = all.filter(|(_, lacks)| lacks[term as usize]);
            lack.map(|(j, _)| j.name.as_str()).collect()
        };
        let [viscous, coulomb, offset] = TERMS.map(|t| lacks(t.0));
        let of_all = |some: &[&str]| some.len() == joints.len();
        let (stated, fitted, alone) = match of_all(&viscous) && of_all(&coulomb) {
            true => (
                "friction".to_string(),
                "viscous and Coulomb friction",
                " of each joint",
            ),
            false => {
                let kinds = [("viscous friction", viscous), ("Coulomb friction", coulomb)];
                let of = |(kind, some): &(&str, Vec<&str>)| match of_all(some) {
                    true => kind.to_string(),
                    false => format!("{kind} of {}", some.join(", ")),
                };
                let there = kinds.iter().filter(|(_, some)| !some.is_empty());
                let stated: Vec<String> = there.map(of).collect();
                (stated.join(" and no "), "this", "")
            }
        };
        let beside = match of_all(&offset) {
            true => " and an offset of each joint",
            false => alone,
        };
        Warning::new(
            WarningKind::JointTermsAssumed,
            plant.name(),
            format!(
                "its file states no {stated}; {fitted}{beside} was fitted with its model first, and other effects were looked \
                 for beside it"
            ),
        )
    }
}

/// Whether a robot has a term in any of its joints.
fn states(robot: &Robot, term: JointTerm) -> bool {
    robot.joints.iter().any(|j| j.terms[term as usize] != 0.0)
}

/// What a file states of friction and rotors without listing it: of the file of a tree that lists nothing to be identified.
fn unlisted(plant: &Plant) -> Vec<JointTerm> {
    let listed = |j: &&Joint| j.identify.contains(&true);
    let none = chain::may_lack_friction(plant) && !plant.actuators().iter().any(listed);
    let all = JointTerm::ALL.into_iter();
    all.filter(|t| none && states(plant.robot(), *t)).collect()
}

/// The robot as it is diagnosed, and what was found: the file that the gap is counted from, and what it leaves out.
pub type AsDiagnosed<'a> = (Cow<'a, Plant>, Option<(Plant, Lacking)>);

/// The robot with the friction that its records show, where its file leaves some out. Friction and rotors that the file states, and
/// does not list, are unknowns where the records are likelier so.
///
/// # Errors
/// Poses that cannot be reached.
pub fn with_friction<'a>(plant: &'a Plant, logs: &[log::Record]) -> Result<AsDiagnosed<'a>> {
    let stated = unlisted(plant);
    let open = match stated.is_empty() {
        true => Cow::Borrowed(plant),
        false => Cow::Owned(plant.clone().with_terms(&stated)),
    };
    let found = match Lacking::of(plant) {
        Some(lacking) => fit_lacking(&open, &lacking, logs)?.map(|with| (with, lacking)),
        None => None,
    };
    let with = found.as_ref().map_or(&*open, |(with, _)| with);
    let off = !stated.is_empty() && {
        let data = gathered(with, logs, Loads::One)?.completed(Assumed::default())?;
        closeness::are_off(&data, &stated, &catalogue::all())?
    };
    // what is taken at its word is no unknown
    let known = |of: Plant| -> Plant {
        let listed = |_: usize, j: &Joint| {
            let kept = |t: JointTerm| j.identify[t as usize] && (off || !stated.contains(&t));
            JointTerm::ALL.map(kept)
        };
        of.identifying(&listed)
    };
    Ok(match found {
        Some((with, lacking)) => (
            Cow::Owned(known(with)),
            Some((known(open.into_owned()), lacking)),
        ),
        None if off => (open, None),
        None => (Cow::Borrowed(plant), None),
    })
}

/// The robot with what its file leaves out and the records show; `None` where they show none.
fn fit_lacking(plant: &Plant, lacking: &Lacking, logs: &[log::Record]) -> Result<Option<Plant>> {
    let open = lacking.opened(plant);
    let mut data = gathered(&open, logs, Loads::One)?.completed(Assumed::default())?;
    let terms = lacking.terms(&open);
    for own in &terms {
        let speed = match own.term {
            JointTerm::Viscous => data.speed[own.actuator],
            _ => 1.0,
        };
        data.spread[own.at] = data.torque_rms(own.actuator) / speed;
    }
    // one of a joint at a time is left out: what one takes makes others less known
    loop {
        let (phi, known) = fitted(&data, &terms);
        let mut out: Vec<usize> = Vec::new();
        for j in 0..data.joints() {
            let of = (0..terms.len()).filter(|i| terms[*i].actuator == j);
            let kept = of.filter(|i| data.spread[terms[*i].at] > 0.0);
            let least = kept.min_by(|a, b| known[*a].total_cmp(&known[*b]));
            out.extend(least.filter(|i| known[*i] < T.confidence.body.centre));
        }
        if out.is_empty() {
            let shown = terms.iter().any(|own| data.spread[own.at] > 0.0);
            let values = stated(&open, &terms, &data, &phi);
            return Ok(shown.then(|| open.valued(&values)));
        }
        out.iter().for_each(|i| data.spread[terms[*i].at] = 0.0);
    }
}

/// Parameters of the refit, and by how many of its deviations each of the terms stands out: friction brakes, so what is negative of
/// it does not.
fn fitted(data: &Data, terms: &[Own]) -> (Vec<f64>, Vec<f64>) {
    let evidence = Evidence::new(data, 1.0);
    let fit = evidence.fit(&[]);
    let phi = evidence.parameters(&[], &fit);
    let scale = inflation(&evidence.residual(&[], &fit), data.fitted);
    let known = |own: &Own| own.size(&phi) / (scale * evidence.std(own.at)).max(f64::MIN_POSITIVE);
    let known = terms.iter().map(known).collect();
    (phi, known)
}

/// The values of the file, with those terms that were fitted.
fn stated(plant: &Plant, terms: &[Own], data: &Data, phi: &[f64]) -> Vec<f64> {
    let mut values: Vec<f64> = plant.parameters().iter().map(|p| p.value).collect();
    let kept = terms.iter().filter(|own| data.spread[own.at] > 0.0);
    kept.for_each(|own| values[own.at] = phi[own.at]);
    values
}

/// What a search beside friction that the file does not hold has found.
pub struct Beyond<'a> {
    /// what the file leaves out
    pub lacking: &'a Lacking,
    /// the nominal model with that friction
    pub evidence: &'a Evidence<'a>,
    /// what columns are made from
    pub cx: &'a Context<'a>,
    /// the catalogue
    pub effects: &'a [Box<dyn Effect>],
    /// all that was found
    pub set: &'a [&'a Projected],
    /// its fit
    pub fit: &'a Fit,
    /// whitened residuals of the refit with the friction alone, and with all that was found
    pub left: [&'a [Vec<f64>]; 2],
    /// parameters with all that was found
    pub phi: &'a [f64],
    /// seed of the intervals
    pub seed: u64,
}

/// The gap and its explanation, counted from the file without friction.
pub struct Lacked {
    /// what the file leaves out
    pub lacking: Lacking,
    /// parameters of the file, with zeros for what was fitted later
    pub nominal: Vec<f64>,
    /// parameters of a refit without friction
    pub refit: Vec<f64>,
    /// whitened residuals of the nominal model and of that refit
    pub residuals: [Vec<Vec<f64>>; 2],
    /// the friction of each joint
    pub findings: Vec<Finding>,
    /// gap on holdout records without any of it, and with all that was found; zero where they show none
    pub holdout: [f64; 2],
    /// share of the gap that stays on fitted records
    pub unexplained: f64,
    /// share of the gap that the friction leaves to other effects, on fitted records and on those held out
    pub others: [f64; 2],
}

impl Beyond<'_> {
    /// Counts the gap from the robot file `plant`.
    pub fn lacked(&self, plant: &Plant) -> Lacked {
        let data = self.evidence.data;
        let terms = self.lacking.terms(data.plant);
        let actuators = plant.actuators();
        let mut bare = data.clone();
        for own in &terms {
            bare.parameters[own.at].value = actuators[own.actuator].terms[own.term as usize];
            bare.spread[own.at] = 0.0;
        }
        let evidence = Evidence::new(&bare, 1.0);
        let st = State::new(&evidence, self.cx, self.effects);
        let (none, residual) = st.fit(&[]);
        let gaps = |e: &[Vec<f64>]| [true, false].map(|fit| st.gap(e, fit));
        let [before, held] = gaps(&residual);
        let above = |[fit, held]: [Vec<f64>; 2]| [st.above(&fit, true), st.above(&held, false)];
        let whole = above([before.clone(), held.clone()]);
        let [with_friction, with_all] = self.left.map(|e| above(gaps(e)));
        let share = |part: f64, of: f64| (part / of.max(1e-9)).clamp(0.0, 1.0);
        let shows = st.shows_held(whole[1]);
        Lacked {
            lacking: self.lacking.clone(),
            nominal: evidence.phi.clone(),
            refit: evidence.parameters(&[], &none),
            findings: self.findings(&st, &terms, &residual, [&before, &held]),
            holdout: match shows {
                true => [whole[1], with_all[1]],
                false => [0.0; 2],
            },
            unexplained: share(with_all[0], whole[0]),
            others: [0, 1].map(|i| share(with_friction[i], whole[i])),
            residuals: [evidence.r.clone(), residual],
        }
    }

    /// A finding for each term that was fitted: shares from a fit of all of them beside the file, values from the fit of all that
    /// was found.
    fn findings(
        &self,
        st: &State,
        terms: &[Own],
        none: &[Vec<f64>],
        [before, held]: [&[f64]; 2],
    ) -> Vec<Finding> {
        let (data, evidence) = (self.evidence.data, st.evidence);
        let shown = terms
            .iter()
            .filter(|own| data.parameters[own.at].value != 0.0);
        let all: Vec<(&Own, &dyn Effect)> = shown
            .filter_map(|own| Some((own, catalogue::named(self.effects, own.effect)?)))
            .collect();
        let columns = |(own, effect): &(&Own, &dyn Effect)| {
            effect.columns(self.cx, &own.place(), &Shape::default(), false)
        };
        let sets: Vec<_> = all.iter().map(columns).collect();
        let projected = evidence.project_all(&sets);
        let left = |kept: &dyn Fn(&Own) -> bool| {
            let kept = all.iter().zip(&projected).filter(|((own, _), _)| kept(own));
            let set: Vec<&Projected> = kept.map(|(_, p)| p).collect();
            evidence.residual(&set, &evidence.fit(&set))
        };
        let with = left(&|_| true);
        let gaps = |e: &[Vec<f64>]| [true, false].map(|fit| st.gap(e, fit));
        let after = gaps(&with);
        let counted = |e: &[Vec<f64>]| evidence.as_counted(e);
        let (total, with) = (counted(none), counted(&with));
        let shows = st.shows_held(st.above(held, false));
        // what goes with terms that share it
        let taken = |of: &Own| {
            let without = left(&|other| !of.shares(other));
            let gap = gaps(&without);
            let j = of.actuator;
            let [fit, kept] = [0, 1].map(|k| {
                let gone = gap[k][j] - after[k][j];
                gone / [before, held][k][j].max(1e-9)
            });
            let repeats = match shows && held[j] > 0.0 {
                true => T.confidence.repeats.above(kept / fit.max(1e-9)),
                false => 1.0,
            };
            let explains = st.explains(&gap[0], &after[0]).clamp(0.0, 1.0);
            let without = counted(&without);
            Taken {
                confidence: T.matters.of_joints.above(fit) * repeats,
                explains,
                interval: interval::explained(data, &total, &without, &with, explains, self.seed),
                holdout: shows.then(|| {
                    let gone = st.above(&gap[1], false) - st.above(&after[1], false);
                    (gone / st.above(held, false).max(1e-9)).clamp(-1.0, 1.0)
                }),
            }
        };
        let scale = inflation(self.left[1], data.fitted);
        let std = |own: &Own| scale * self.evidence.std_beside(self.set, self.fit, own.at);
        let known = |own: &Own| own.size(self.phi) / std(own).max(f64::MIN_POSITIVE);
        let mut shared: Vec<(&Own, Taken)> = Vec::new();
        let mut out: Vec<Finding> = Vec::new();
        for ((own, effect), projected) in all.iter().zip(&projected) {
            if !shared.iter().any(|(of, _)| of.shares(own)) {
                shared.push((own, taken(own)));
            }
            let Some((_, taken)) = shared.iter().find(|(of, _)| of.shares(own)) else {
                continue;
            };
            let others: Vec<&Own> = (all.iter().map(|a| a.0))
                .filter(|other| other.at != own.at && own.shares(other))
                .collect();
            // friction that drives is none: what else was found stands for it
            if own.size(self.phi) <= 0.0 {
                continue;
            }
            // that there is friction is known before which of the two it is
            let sure = known(own);
            let first = others.iter().all(|other| known(other) < sure);
            let alone = T.confidence.body.above(sure);
            let told = alone >= T.confidence.claim;
            // of an effect, what lies beyond the nominal value
            let beyond = self.phi[own.at] - self.cx.stated(&own.place(), own.term);
            let fitted = estimate(own.place(), &Shape::default(), &[beyond], &[std(own)]);
            out.push(Finding {
                confidence: match first && !told && !others.is_empty() {
                    true => taken.confidence,
                    false => alone * taken.confidence,
                },
                explains: taken.explains,
                interval: taken.interval,
                holdout: taken.holdout,
                visibility: projected.visibility(None),
                same: match told {
                    true => Vec::new(),
                    false => others.iter().map(|other| other.effect).collect(),
                },
                ..Finding::of(self.cx, *effect, fitted)
            });
        }
        out
    }
}

impl Lacked {
    /// Says in an improved model that it holds the friction.
    pub fn remark(&self, plant: &Plant, improved: &mut Improved) {
        let claimed = self.findings.iter().filter(|f| f.is_claim());
        let remark = |f: &Finding| {
            let term = TERMS.iter().find(|t| t.1 == f.effect)?.0;
            Some(Remark {
                effect: f.effect,
                place: f.joints.join(", "),
                equation: f.equation,
                values: f.values.iter().map(Value::line).collect(),
                held: Some(Part::Term(term)),
                element: None,
            })
        };
        // a model that was left as it is in the file has none
        if self.lacking.is_left_out(&improved.robot) {
            return;
        }
        let all: Vec<Remark> = claimed.filter_map(remark).collect();
        let files = all.iter().map(|r| r.in_files(plant));
        improved.in_mujoco.splice(0..0, files);
        improved.remarks.splice(0..0, all);
    }

    /// The verdict with the friction, from that of the search beside it, and the findings of both.
    pub fn told(&self, verdict: Verdict, findings: &mut Vec<Finding>) -> Verdict {
        for f in findings.iter_mut() {
            f.explains *= self.others[0];
            f.interval = f.interval.map(|v| v * self.others[0]);
            f.holdout = f.holdout.map(|h| h * self.others[1]);
        }
        let claimed = self.findings.iter().any(Finding::is_claim);
        findings.extend(self.findings.iter().cloned());
        finding::order(findings);
        match verdict {
            Verdict::NoGap if claimed => Verdict::Explained,
            Verdict::Unknown if claimed => Verdict::PartlyExplained,
            other => other,
        }
    }
}
