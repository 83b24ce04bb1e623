//! The confidence of a member: a product of conditions, shared with its rivals.

use super::super::catalogue::Place;
use super::super::decoy;
use super::super::search::Candidate;
use super::super::thresholds::THRESHOLDS as T;
use super::beside::Beside;
use super::predict::{Alike, predicts, shown_on_both};
use super::rivals::{Rival, against, least_loss, rivals};
use super::state::{State, others};

/// One effect of the set.
#[derive(Debug, Clone)]
pub struct Member {
    /// effect, place, shape
    pub candidate: Candidate,
    /// 0 to 1
    pub confidence: f64,
    /// the same of the member or one of its rivals, 0 to 1
    pub together: f64,
    /// share of the gap on fitted records
    pub explains: f64,
    /// share of the gap on holdout records, where these show one
    pub holdout: Option<f64>,
    /// share of the effect's energy that the nominal model cannot absorb
    pub visibility: f64,
    /// the most that a decoy gains of its own, over what the effect gains; not of an effect that shows in
    /// parameters alone
    pub decoys: Option<f64>,
    /// what coefficients of their own for every fitted record gain, over what the effect gains; not of an
    /// effect that remembers, nor of whole sets of inertial parameters that show in parameters alone
    pub unsteady: Option<f64>,
    /// the same with coefficients of their own for every actuator, of an effect that should be the same on all
    pub uneven: Option<f64>,
    /// rivals by falling weight
    pub rivals: Vec<Rival>,
    /// standard deviations of the coefficients
    pub std: Vec<f64>,
    /// whether it shows in the parameters that the nominal model would need rather than in a residual
    pub frozen: bool,
}

/// Judges member `i` of a set; `after` is the gap by actuator with the set, `surprise_after` the penalty of the
/// prior.
pub fn judge(
    st: &State,
    list: &[Candidate],
    set: &[Candidate],
    i: usize,
    after: &[f64],
    surprise_after: f64,
) -> Member {
    let m = Beside::new(st, set, i, after, surprise_after);
    let (c, evidence) = (m.member, st.evidence);
    let rivals = rivals(&m, list);
    let effect = &st.effects[c.effect];
    let columns = effect.columns(st.cx, &c.place, &c.shape, false);
    let beside = m.beside();
    // what shows in parameters alone is no signal that could be moved
    let decoys = (!m.frozen).then(|| {
        let moved = (columns.as_slice(), &c.projected);
        decoy::largest(evidence, moved, &c.eta, &beside, m.gain)
    });
    let alike = Alike {
        columns: &columns,
        prior: effect.prior(),
        beside: &beside,
        together: m.with.gain,
        own: m.gain,
    };
    // whole sets of inertial parameters fit anything in a single record
    let unsteady = match st.remembers(c) || m.frozen && columns.len() > T.hidden.columns {
        true => None,
        false => alike.unsteady(evidence),
    };
    let uneven = match c.place == Place::Robot && effect.is_alike() {
        true => alike.uneven(evidence),
        false => None,
    };
    let [eta, std] = m.coefficients();
    let known = known_by_itself(&m, &eta, &std);
    let steady = unsteady.map_or(1.0, |u| T.confidence.unsteady.below(u))
        * uneven.map_or(1.0, |u| T.confidence.uneven.below(u));
    // where holdout records do not show it, fitted ones must agree on it
    let agreed = m.unseen().then(|| alike.unsteady(evidence)).flatten();
    let holds = holds(&m).max(agreed.map_or(0.0, |u| T.confidence.unsteady.below(u)));
    let together = known * steady * holds * together(&m, &rivals, decoys);
    Member {
        candidate: Candidate { eta, ..c.clone() },
        confidence: together / (1.0 + against(st, c.effect, &rivals)),
        together,
        explains: m.explains().clamp(0.0, 1.0),
        holdout: m.explains_held().map(|h| h.clamp(-1.0, 1.0)),
        visibility: c.projected.visibility(Some(&c.eta)),
        decoys,
        unsteady,
        uneven,
        rivals,
        std,
        frozen: m.frozen,
    }
}

/// The product of all conditions but those on how steady it is and on holdout records, 0 to 1: that the member is there, or one of its rivals.
fn together(m: &Beside, rivals: &[Rival], decoys: Option<f64>) -> f64 {
    let data = m.st.evidence.data;
    let [r0, r1] = &m.residual;
    let predicted = match m.frozen || m.st.remembers(m.member) {
        true => 1.0,
        false => predicts(data, r0, r1),
    };
    m.size()
        * shown_on_both(data, m.member, r0, r1)
        * if m.frozen { 1.0 } else { m.matters }
        * T.confidence.predicts.above(predicted)
        * T.confidence.exceeds.below(predicted)
        * decoys.map_or(1.0, |d| T.confidence.decoys.below(d))
        * explains_enough(m, rivals)
        * beside_larger(m)
        * ahead_of_friction(m)
}

/// Whether a member takes away enough of the gap on its joints.
fn explains_enough(m: &Beside, rivals: &[Rival]) -> f64 {
    let share = m.share();
    // nothing else may be odd about the parameters
    if m.frozen {
        return T.confidence.parameters.above(share);
    }
    let whole = T.confidence.share.above(share);
    if !m.st.effects[m.member.effect].of_a_part(&m.member.shape) {
        return whole;
    }
    // an effect that explains a part only is believed where nothing else comes near that part
    let best = least_loss(m.st, m.member.effect, rivals);
    let alone = T.confidence.alone.above(best) * T.confidence.alone_share.above(share);
    whole.max(alone)
}

/// Whether a member is large enough beside a larger one of the same joint, where it may be what the formula of that one
/// misses: friction about reversals, or a late torque, beside such friction, and torque ahead of the positions beside anything.
fn beside_larger(m: &Beside) -> f64 {
    let effects = m.st.effects;
    let reverses = |c: &Candidate| effects[c.effect].at_reversals(&c.shape);
    let effect = &effects[m.member.effect];
    let left = !effect.of_a_part(&m.member.shape);
    // dry friction that reverses late moves as a late torque does
    let follows = reverses(m.member) || effect.late();
    let misses = |c: &Candidate| {
        let alike = follows && reverses(c);
        !c.same(m.member) && c.place == m.member.place && (left || alike)
    };
    let gained = |i: usize| m.with.gain - m.st.gain(&others(m.set, i));
    let larger = (0..m.set.len()).filter(|i| misses(&m.set[*i])).map(gained);
    let largest = larger.fold(0.0, f64::max);
    match largest > m.gain {
        true => T.confidence.beside.above(m.gain / largest),
        false => 1.0,
    }
}

/// Whether torque that is ahead of the positions is farther ahead than dry friction that reverses early can have it.
fn ahead_of_friction(m: &Beside) -> f64 {
    let within = m.st.evidence.data.early_friction_within();
    let effect = &m.st.effects[m.member.effect];
    match effect.ahead(&m.member.shape, &m.member.eta) {
        Some(time) if within > 0.0 => T.confidence.ahead.above(time / within),
        _ => 1.0,
    }
}

/// Whether a body that shows in the parameters alone has a mass or first moments that are known, or a tensor that stands out
/// still more. What the formula of another effect misses moves parameters that only together are known, and ten of any link can
/// follow them.
fn known_by_itself(m: &Beside, eta: &[f64], std: &[f64]) -> f64 {
    let moments = m.st.effects[m.member.effect].moments();
    if !m.frozen || moments == 0 {
        return 1.0;
    }
    let all = eta.iter().zip(std).map(|(x, s)| (x / s).abs());
    let largest = |m: f64, t: f64| m.max(t);
    let first = all.clone().take(moments).fold(0.0, largest);
    let tensor = all.skip(moments).fold(0.0, largest);
    let known = first.max(tensor / T.confidence.tensor);
    T.confidence.body.above(known)
}

/// Whether it does so on holdout records.
fn holds(m: &Beside) -> f64 {
    let share = T.confidence.holdout.above(m.share_held());
    share.max(T.confidence.repeats.above(m.repeats()))
}
