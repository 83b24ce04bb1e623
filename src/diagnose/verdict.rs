//! From evidence to a verdict: which effects are there, how sure that is, and what they leave.
//!
//! 1. The set of effects grows forwards; each step tries every effect at every place beside those found,
//!    improves the shapes of all, and is also compared with the best of all pairs (two effects may mask
//!    each other). A step must explain a share of the gap that stands out on the records *not* fitted to.
//! 2. Every member of the set is challenged: with the others kept, each rival takes its place with its
//!    best shape. A rival that loses little more than the member is indistinguishable from it, and the
//!    two share the confidence.
//! 3. The confidence of a member is the product of what it explains of that which only it can explain on
//!    its joints, of how that holds on holdout records, and of its share against its rivals.

use super::catalogue::{Context, Effect, Place, Shape};
use super::column::Column;
use super::data::Data;
use super::decoy;
use super::evidence::{Evidence, Fit, Projected};
use super::gap;
use super::search::{Candidate, best_shape};
use rayon::prelude::*;
use std::ops::Range;

/// What became of a rival.
#[derive(Debug, Clone)]
pub struct Rival {
    /// index into the catalogue
    pub effect: usize,
    /// where
    pub place: Place,
    /// share of the member's gain that it loses
    pub loss: f64,
    /// weight relative to the member
    pub weight: f64,
    /// shape
    pub shape: Shape,
    /// coefficients
    pub eta: Vec<f64>,
}

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
    /// share of the gap on holdout records
    pub holdout: f64,
    /// share of the effect's energy that the nominal model cannot absorb
    pub visibility: f64,
    /// the most that a decoy gains of its own, over what the effect gains; not of an effect that shows in
    /// parameters alone
    pub decoys: Option<f64>,
    /// what coefficients of their own for every fitted record gain, over what the effect gains; not of an
    /// effect that remembers, nor of whole sets of inertial parameters that show in parameters alone
    pub unsteady: Option<f64>,
    /// rivals by falling weight
    pub rivals: Vec<Rival>,
    /// standard deviations of the coefficients
    pub std: Vec<f64>,
    /// whether it shows in the parameters that the nominal model would need rather than in a residual
    pub frozen: bool,
}

/// Verdict of a diagnosis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// nothing above noise and ordinary parameter errors
    NoGap,
    /// named effects explain it
    Explained,
    /// named effects explain part of it
    PartlyExplained,
    /// no effect of the catalogue explains it
    Unknown,
}

/// Result of the search.
pub struct Decision {
    /// verdict
    pub verdict: Verdict,
    /// effects by falling confidence
    pub members: Vec<Member>,
    /// fit of all of them together
    pub fit: Fit,
    /// gap energy of the refitted nominal model on fitted records, by actuator, noise variances
    pub before: Vec<f64>,
    /// the same with the set
    pub after: Vec<f64>,
    /// gap energy on holdout records before and after
    pub holdout: [f64; 2],
    /// what the prior says against the refitted parameters, before and after
    pub surprise: [f64; 2],
    /// share of the gap that stays
    pub unexplained: f64,
}

impl Decision {
    /// Columns of the members.
    pub fn projected(&self) -> Vec<&Projected> {
        let members = self.members.iter();
        members.map(|m| &m.candidate.projected).collect()
    }
}

/// Gain that an effect must bring, per row of a joint, in noise variances.
const LEAST: f64 = 0.06;
/// Gap per row below which there is none: what windows, encoders and the shape of friction at
/// reversals leave of a sound model.
const SOUND: f64 = 0.5;
/// Gap per row that a sound model leaves: shares of the gap are of what lies above.
const FLOOR: f64 = 0.25;
/// Imperfection of a sound model, per row, that counts neither for nor against an effect.
const SLACK: f64 = 0.05;
/// Share of the gap on its joints that an effect must explain.
const LEAST_SHARE: f64 = 0.05;
/// The same of the gap of all joints.
const LEAST_OF_ALL: f64 = 0.012;
/// Gap per row of a joint, in noise variances, in which an effect can be found at all.
const LEAST_GAP: f64 = 0.15;
/// The same on its own joints for an effect that rings with damping: what friction at reversals starts in the loop of
/// the controller, and positions do not resolve, rings too.
const LEAST_RINGING: f64 = SOUND;
/// Fall of the residual on holdout records over the fall that the fit predicts, at least.
const HELD: f64 = 0.5;
/// What a decoy may gain beyond what it shares with the effect, over what the effect gains.
const DECOY: f64 = 0.22;
/// What an effect must have of mattering and predicting to enter the set at all: one that could never
/// be claimed would stand in the way of others.
const ENTERS: f64 = 0.15;
/// How much more an effect must gain than another on its joint to be the cause of what that one explains.
const FAR: f64 = 5.0;
/// What coefficients of their own for every record may gain, over what the effect gains.
const UNSTEADY: f64 = 0.15;
/// Gain that a freedom may bring from noise that is not quite white.
const FREEDOM: f64 = 6.0;
/// Columns up to which an effect that hides in parameters can be compared between records.
const FEW: usize = 4;
/// Squared signal on a joint, in noise variances, below which a pair of joints is not seen on it.
const UNSEEN: f64 = 25.0;
/// Gain of prior plausibility above which parameters are not ordinary errors.
const SURPRISE: f64 = 45.0;

/// Price of a freedom that is fitted to the few parameters that a prior finds unlikely (Akaike).
const PRICE: f64 = 2.0;

struct State<'a> {
    evidence: &'a Evidence<'a>,
    cx: &'a Context<'a>,
    effects: &'a [Box<dyn Effect>],
    /// what a sound model leaves, per row
    floor: f64,
    /// gap of the refitted nominal model above that, fitted records
    total: f64,
}

impl State<'_> {
    /// By how much `J` falls with a set.
    fn gain(&self, set: &[Candidate]) -> f64 {
        let set: Vec<&Projected> = set.iter().map(|c| &c.projected).collect();
        self.evidence.fit(&set).gain
    }

    fn fit(&self, set: &[Candidate]) -> (Fit, Vec<Vec<f64>>) {
        let set: Vec<&Projected> = set.iter().map(|c| &c.projected).collect();
        let fit = self.evidence.fit(&set);
        let residual = self.evidence.residual(&set, &fit);
        (fit, residual)
    }

    /// Gap by actuator on fitted records.
    fn gap(&self, residual: &[Vec<f64>], fitted: bool) -> Vec<f64> {
        let plain = self.evidence.unwhitened(residual);
        gap::energies(self.evidence.data, &plain, |r| r.fit == fitted)
            .into_iter()
            .map(|[a, b]| a + b)
            .collect()
    }

    /// Gap of all actuators above what a sound model leaves.
    fn above(&self, gap: &[f64], fitted: bool) -> f64 {
        let data = self.evidence.data;
        let rows = match fitted {
            true => data.fitted,
            false => data.rows() - data.fitted,
        };
        gap.iter()
            .map(|v| (v - self.floor * rows as f64).max(0.0))
            .sum()
    }

    /// Penalty of the prior with a set.
    fn surprise(&self, fit: &Fit, residual: &[Vec<f64>]) -> f64 {
        let fitted = self.evidence.data.fitted;
        self.evidence.j0 - fit.gain - energy(residual, 0..fitted)
    }

    /// Whether member `i` may show in nothing but the parameters that the nominal model would need.
    /// Not where another one shows on its joints, or hides there and is far larger: what that one's
    /// formula misses moves them, too.
    fn may_hide(&self, set: &[Candidate], i: usize) -> bool {
        let hides = |c: &Candidate| self.effects[c.effect].hides();
        let larger = |c: &Candidate| !hides(c) || c.gain > FAR * set[i].gain;
        let shown = |c: &Candidate| larger(c) && c.place.meets(&set[i].place);
        hides(&set[i]) && !set.iter().any(shown)
    }

    /// Joints on whose rows an effect acts most.
    fn joints_of(&self, c: &Candidate) -> Vec<usize> {
        c.place.actuators(self.evidence.data.joints())
    }

    /// Whether an effect depends on what went on before a record began.
    fn remembers(&self, c: &Candidate) -> bool {
        self.effects[c.effect].remembers()
    }

    /// Whether an effect explains enough to be a finding, 0 to 1, from the gap by actuator without it
    /// and with it: what explains next to nothing is none; nor is anything where the gap without it is
    /// what a sound model leaves.
    fn matters(&self, c: &Candidate, without: &[f64], with: &[f64]) -> f64 {
        let rows = self.evidence.data.fitted as f64;
        let joints = self.joints_of(c);
        let over = |gap: &[f64]| -> f64 {
            let floor = self.floor * rows;
            joints.iter().map(|j| (gap[*j] - floor).max(0.0)).sum()
        };
        let seen = (over(without) - over(with)) / over(without).max(1e-9);
        let explains = (self.above(without, true) - self.above(with, true)) / self.total.max(1e-9);
        let there = without.iter().fold(0.0f64, |m, v| m.max(*v)) / rows;
        let own = joints.iter().fold(0.0f64, |m, j| m.max(without[*j])) / rows;
        let ringing = match self.effects[c.effect].rings(&c.shape) {
            true => logistic((own - LEAST_RINGING) / 0.04),
            false => 1.0,
        };
        logistic((seen - LEAST_SHARE) / 0.01)
            * logistic((explains - LEAST_OF_ALL) / 0.003)
            * logistic((there - LEAST_GAP) / 0.02)
            * ringing
    }

    /// Improves the shapes of all members in turn.
    fn polish(&self, set: &mut [Candidate]) {
        for i in 0..set.len() {
            let others: Vec<Candidate> = others(set, i);
            let beside: Vec<&Projected> = others.iter().map(|c| &c.projected).collect();
            let before = self.evidence.fit(&beside);
            let (effect, place) = (set[i].effect, set[i].place);
            let better = best_shape(
                self.evidence,
                self.cx,
                self.effects,
                effect,
                &place,
                &beside,
                &before,
            );
            if let Some(b) = better.filter(|b| b.gain > 0.0) {
                set[i] = b;
            }
        }
    }

    /// The set with one more effect, if that explains enough more. The first of several tries is
    /// also compared with the best of all pairs.
    fn grown(
        &self,
        list: &[Candidate],
        set: &[Candidate],
        candidate: Candidate,
        first: bool,
    ) -> Option<Vec<Candidate>> {
        let mut grown = set.to_vec();
        grown.push(candidate);
        if !first && !accepted(self, &grown, set.len()) {
            return None;
        }
        if first
            && grown.len() == 2
            && let Some(mut pair) = best_pair(self, list)
        {
            let gain = |s: &[Candidate]| self.gain(s);
            self.polish(&mut pair);
            let each = |i: usize| accepted(self, &pair, i);
            if gain(&pair) > gain(&grown) + 0.01 * self.total && (0..2).all(each) {
                return Some(pair);
            }
        }
        if grown.len() > 1 {
            self.polish(&mut grown);
        }
        accepted(self, &grown, set.len()).then_some(grown)
    }

    /// Rivals of a place in the set with their best shapes, by falling gain beside the others.
    fn challengers(
        &self,
        list: &[Candidate],
        beside: &[&Projected],
        most: usize,
    ) -> Vec<Candidate> {
        let before = self.evidence.fit(beside);
        let mut quick: Vec<(f64, usize)> = list
            .par_iter()
            .enumerate()
            .map(|(i, c)| {
                let mut set = beside.to_vec();
                set.push(&c.projected);
                (self.evidence.fit(&set).gain - before.gain, i)
            })
            .collect();
        quick.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        // the best places of every effect
        let mut chosen: Vec<usize> = Vec::new();
        for (_, i) in &quick {
            let same = chosen
                .iter()
                .filter(|c| list[**c].effect == list[*i].effect);
            if same.count() < 2 && chosen.len() < most {
                chosen.push(*i);
            }
        }
        let mut all: Vec<Candidate> = chosen
            .par_iter()
            .with_max_len(1)
            .filter_map(|i| {
                let c = &list[*i];
                best_shape(
                    self.evidence,
                    self.cx,
                    self.effects,
                    c.effect,
                    &c.place,
                    beside,
                    &before,
                )
            })
            .filter(|c| c.gain > 0.0)
            .collect();
        all.sort_by(|a, b| self.merit(b).total_cmp(&self.merit(a)));
        all
    }

    /// Gain less what its freedoms cost, a little more for effects that are always expected.
    fn merit(&self, c: &Candidate) -> f64 {
        self.merit_of(c, c.gain, self.price())
    }

    /// Price of a freedom that is fitted to rows: that of the Bayesian information criterion.
    fn price(&self) -> f64 {
        ((self.evidence.data.fitted * self.evidence.data.joints()) as f64).ln()
    }

    fn merit_of(&self, c: &Candidate, gain: f64, price: f64) -> f64 {
        let effect = &self.effects[c.effect];
        let freedoms = (c.live() + effect.freedoms(&c.shape)) as f64;
        (gain - price * freedoms) * (1.0 + 0.01 * effect.familiarity() - 0.003 * freedoms)
    }
}

fn others(set: &[Candidate], i: usize) -> Vec<Candidate> {
    set.iter()
        .enumerate()
        .filter(|(k, _)| *k != i)
        .map(|(_, c)| c.clone())
        .collect()
}

/// Squares of a residual on some rows of every actuator.
fn energy(residual: &[Vec<f64>], rows: Range<usize>) -> f64 {
    let of = |e: &Vec<f64>| e[rows.clone()].iter().map(|v| v * v).sum::<f64>();
    residual.iter().map(of).sum()
}

fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

/// Decides. `list` are all effects at all places with their best shapes alone.
pub fn decide(
    evidence: &Evidence,
    cx: &Context,
    effects: &[Box<dyn Effect>],
    list: &[Candidate],
    progress: &dyn Fn(&str),
) -> Decision {
    let mut st = State {
        evidence,
        cx,
        effects,
        floor: 0.0,
        total: 0.0,
    };
    let data = evidence.data;
    let rows = data.fitted as f64;
    let (none, residual) = st.fit(&[]);
    let before = st.gap(&residual, true);
    let hold_before = st.gap(&residual, false);
    let surprise = st.surprise(&none, &residual);
    let free = data.parameters.len() as f64;
    // no more than a part of a gap that is small itself
    let largest = before.iter().fold(0.0f64, |m, v| m.max(*v)) / rows;
    st.floor = FLOOR.min(0.3 * largest);
    st.total = st.above(&before, true);
    let visible = before.iter().any(|v| *v > SOUND * rows);
    let surprising = surprise > SURPRISE + 2.0 * free;
    let mut set: Vec<Candidate> = Vec::new();
    // forward steps
    while set.len() < 4 {
        progress(match set.len() {
            0 => "first effect",
            1 => "second effect",
            2 => "third effect",
            _ => "fourth effect",
        });
        let beside: Vec<&Projected> = set.iter().map(|c| &c.projected).collect();
        let mut next = st.challengers(list, &beside, 10);
        next.retain(|c| !set.iter().any(|s| s.same(c)));
        // one that gains most need not be one that holds: the others have their turn
        let tried = next.into_iter().take(5).enumerate();
        let grown = tried
            .filter_map(|(i, candidate)| st.grown(list, &set, candidate, i == 0))
            .next();
        match grown {
            Some(grown) => set = grown,
            None => break,
        }
    }
    // a rival that does better beside the others takes the place
    for _ in 0..2 {
        let mut changed = false;
        for i in 0..set.len() {
            let rest = others(&set, i);
            let beside: Vec<&Projected> = rest.iter().map(|c| &c.projected).collect();
            let best = st.challengers(list, &beside, 6).into_iter().next();
            if let Some(b) = best
                && !b.same(&set[i])
                && !rest.iter().any(|c| c.same(&b))
                && st.merit(&b) > 1.01 * gained(&st, &set, i)
            {
                let mut other = set.clone();
                other[i] = b;
                if accepted(&st, &other, i) {
                    set = other;
                    changed = true;
                }
            }
        }
        if !changed || set.len() < 2 {
            break;
        }
    }
    progress("rivals");
    let (fit, residual) = st.fit(&set);
    let after = st.gap(&residual, true);
    let hold_after = st.gap(&residual, false);
    let surprise_after = st.surprise(&fit, &residual);
    let mut members: Vec<Member> = (0..set.len())
        .into_par_iter()
        .with_max_len(1)
        .map(|i| judge(&st, list, &set, i, &after, surprise_after))
        .collect();
    // coefficients of the common fit
    let mut at = 0;
    for m in &mut members {
        let k = m.candidate.eta.len();
        m.candidate.eta = fit.eta[at..at + k].to_vec();
        let scale = inflation(&residual, data.fitted);
        m.std = (at..at + k)
            .map(|i| fit.covariance[i][i].max(0.0).sqrt() * scale)
            .collect();
        at += k;
    }
    members.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    // an effect that hides in the parameters is measured against the frozen model
    let hides = members.iter().any(|m| m.frozen);
    let whole = |fit: bool| st.above(&st.gap(&evidence.r, fit), fit);
    let [base, base_held] = match hides {
        true => [whole(true), whole(false)],
        false => [st.total, st.above(&hold_before, false)],
    };
    let unexplained = (st.above(&after, true) / base.max(1e-9)).min(1.0);
    // a set that cannot be told apart explains as well as its one right member
    let claims = members.iter().filter(|m| m.together >= 0.5).count();
    let gap_left = after.iter().any(|v| *v > SOUND * rows);
    let verdict = match (visible || surprising, claims) {
        (false, 0) => Verdict::NoGap,
        (_, 0) => Verdict::Unknown,
        _ if gap_left && unexplained > 0.15 => Verdict::PartlyExplained,
        _ => Verdict::Explained,
    };
    Decision {
        verdict,
        members,
        fit,
        before,
        after,
        holdout: [base_held, st.above(&hold_after, false)],
        surprise: [surprise, surprise_after],
        unexplained,
    }
}

/// Gain of member `i` beside the others.
fn gained(st: &State, set: &[Candidate], i: usize) -> f64 {
    st.gain(set) - st.gain(&others(set, i))
}

/// By how much coefficients are less certain than independent samples of unit noise would make them.
pub(super) fn inflation(residual: &[Vec<f64>], fitted: usize) -> f64 {
    let mut power = 0.0;
    let mut rho = 0.0;
    for e in residual {
        let e = &e[..fitted];
        power += e.iter().map(|v| v * v).sum::<f64>();
        for lag in 1..=20 {
            let c: f64 = e[lag..].iter().zip(e).map(|(a, b)| a * b).sum();
            rho += 2.0 * c.max(0.0);
        }
    }
    let n = (residual.len() * fitted) as f64;
    (power / n).max(1.0).sqrt() * (1.0 + rho / power.max(1e-300)).max(1.0).sqrt()
}

/// Whether member `i` of a set explains enough beside the others, also on holdout records.
fn accepted(st: &State, set: &[Candidate], i: usize) -> bool {
    let data = st.evidence.data;
    let rows = data.fitted as f64;
    let (f0, r0) = st.fit(&others(set, i));
    let (f1, r1) = st.fit(set);
    let fall = |rows: Range<usize>| energy(&r0, rows.clone()) - energy(&r1, rows);
    let visible = fall(0..data.fitted);
    let prior = (f1.gain - f0.gain) - visible;
    let held = data.rows() - data.fitted;
    let hold = fall(data.fitted..data.rows());
    let gap = st.gap(&r0, true);
    let there: f64 = st.joints_of(&set[i]).iter().map(|j| gap[*j].max(0.0)).sum();
    let significant = visible > LEAST * rows && visible > 0.02 * there;
    // as much a row as on the fitted records, or, where the holdout moves less, as much as predicted
    let predicted = predicts(data, &r0, &r1);
    let generalises = held == 0 || hold > 0.25 * visible * held as f64 / rows || predicted > HELD;
    if significant && generalises {
        let after = st.gap(&r1, true);
        let worth = st.matters(&set[i], &gap, &after);
        return worth > ENTERS && (st.remembers(&set[i]) || predicted > ENTERS);
    }
    st.may_hide(set, i)
        && prior > SURPRISE
        && (generalises || prior > 0.5 * visible.abs())
        && (held == 0 || hold > -0.02 * held as f64)
}

/// The two candidates that explain most together.
fn best_pair(st: &State, list: &[Candidate]) -> Option<Vec<Candidate>> {
    let mut few: Vec<&Candidate> = Vec::new();
    for c in list {
        let same = few.iter().filter(|f| f.effect == c.effect).count();
        if same < 3 && few.len() < 22 {
            few.push(c);
        }
    }
    let pairs: Vec<(usize, usize)> = (0..few.len())
        .flat_map(|a| (a + 1..few.len()).map(move |b| (a, b)))
        .collect();
    let gains: Vec<f64> = pairs
        .par_iter()
        .map(|(a, b)| {
            st.evidence
                .fit(&[&few[*a].projected, &few[*b].projected])
                .gain
        })
        .collect();
    let best = (0..pairs.len()).max_by(|a, b| gains[*a].total_cmp(&gains[*b]))?;
    let (a, b) = pairs[best];
    Some(vec![few[a].clone(), few[b].clone()])
}

/// Confidence of member `i` of a set.
fn judge(
    st: &State,
    list: &[Candidate],
    set: &[Candidate],
    i: usize,
    after: &[f64],
    surprise_after: f64,
) -> Member {
    let data = st.evidence.data;
    let rows = data.fitted as f64;
    let free = data.parameters.len() as f64;
    let c = &set[i];
    let effect = &st.effects[c.effect];
    let rest = others(set, i);
    let (f0, r0) = st.fit(&rest);
    let (f1, r1) = st.fit(set);
    let gain = f1.gain - f0.gain;
    let without = st.gap(&r0, true);
    let surprise_without = st.surprise(&f0, &r0);
    let joints = st.joints_of(c);
    let sum = |v: &[f64]| joints.iter().map(|j| v[*j].max(0.0)).sum::<f64>();
    let (w, a) = (sum(&without), sum(after));
    // of what is there without it on its joints; the least that counts is taken off
    let slack = SLACK * rows * joints.len() as f64;
    let visible = ((w - a) / (w - slack).max(w * 0.3).max(1e-9)).min(1.0);
    let fall = surprise_without - surprise_after;
    let prior = fall / (surprise_without - free).max(1.0);
    let chi_gain = gain - fall;
    // what an effect explains of the residual may be too little to judge it by, although its parameters
    // stand out
    let in_rows = logistic((chi_gain / rows - LEAST) / 0.02);
    let matters = st.matters(c, &without, after);
    let faint = in_rows * matters < 0.5;
    let frozen = st.may_hide(set, i)
        && fall > SURPRISE
        && (faint || chi_gain < (0.5 * gain).max(1.5 * LEAST * rows));
    let share = if frozen { prior } else { visible };
    let held = data.rows() - data.fitted;
    let (hw, ha) = (sum(&st.gap(&r0, false)), sum(&st.gap(&r1, false)));
    let hold_slack = SLACK * held as f64 * joints.len() as f64;
    let hold = if held == 0 || frozen {
        share
    } else {
        ((hw - ha) / (hw - hold_slack).max(hw * 0.3).max(1e-9)).min(1.0)
    };
    // what it leaves on its joints, as the tests count it
    let white: f64 = {
        let all = gap::energies(data, &r1, |r| r.fit);
        joints
            .iter()
            .map(|j| all[*j][0] + all[*j][1] + data.noise[*j].excess * rows)
            .map(|v| v.max(0.0))
            .sum()
    };
    // rivals in its place
    let beside: Vec<&Projected> = rest.iter().map(|c| &c.projected).collect();
    let own = match frozen {
        true => st.merit_of(c, fall, PRICE),
        false => st.merit_of(c, gain, st.price()),
    };
    let mut rivals: Vec<Rival> = Vec::new();
    for r in st.challengers(list, &beside, 14) {
        if r.same(c) {
            continue;
        }
        // what it gains in place of the member, not what it would gain beside it
        let mut both = set.to_vec();
        both.push(r.clone());
        let instead = r.gain - (st.gain(&both) - f1.gain);
        let other = match frozen {
            true => {
                let mut alone = rest.clone();
                alone.push(r.clone());
                let (fit, residual) = st.fit(&alone);
                let fall = surprise_without - st.surprise(&fit, &residual);
                st.merit_of(&r, fall.min(instead), PRICE)
            }
            false => st.merit_of(&r, instead, st.price()),
        };
        // what each would leave: the member what it leaves, the rival that and what it gains less
        let less = own - other;
        let left = if frozen {
            (surprise_after - free).max(0.0) + 12.0
        } else {
            white + 30.0
        };
        let loss = less / own.max(1e-9);
        // and what each explains at all
        let by_gain = (1.0 - loss).max(0.0).powi(6);
        let by_left = (left / (left + less.max(-0.5 * left))).powf(2.5);
        let weight = by_gain.min(by_left).min(1.5);
        if loss < 0.98 {
            rivals.push(Rival {
                effect: r.effect,
                place: r.place,
                loss,
                weight,
                shape: r.shape.clone(),
                eta: r.eta.clone(),
            });
        }
    }
    rivals.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    // other effects share the confidence; the same effect elsewhere makes the place uncertain
    let mut seen = vec![c.effect];
    let mut against = 0.0;
    for r in &rivals {
        if !seen.contains(&r.effect) && !exchangeable(st, c.effect, r.effect) {
            seen.push(r.effect);
            against += r.weight;
        }
    }
    let size = if frozen {
        logistic((fall - SURPRISE) / 12.0)
    } else {
        in_rows
    };
    // an effect that explains a part only is believed where nothing else comes near that part
    let best = rivals
        .iter()
        .filter(|r| r.effect != c.effect && !exchangeable(st, c.effect, r.effect))
        .fold(1.0f64, |m, r| m.min(r.loss));
    let alone = logistic((best - 0.35) / 0.04) * logistic((share - 0.15) / 0.02);
    // gain on holdout records per row against that on fitted ones: the same effect is at work there
    let kept = |e: &[Vec<f64>]| energy(e, data.fitted..data.rows());
    let repeats = match held > 0 && !frozen {
        true => (kept(&r0) - kept(&r1)) / held as f64 / (chi_gain / rows).max(1e-9),
        false => 1.0,
    };
    let all_without = st.above(&without, true);
    let all_after = st.above(after, true);
    // an effect that hides in the parameters: what the frozen model lacks
    let whole = |e: &[Vec<f64>], fit: bool| st.above(&st.gap(e, fit), fit);
    let explains = if frozen {
        1.0 - all_after / whole(&st.evidence.r, true).max(1e-9)
    } else {
        (all_without - all_after) / st.total.max(1e-9)
    };
    let hold_all = |e: &[Vec<f64>]| st.above(&st.gap(e, false), false);
    let hold_total = hold_all(&st.fit(&[]).1);
    let holdout = if held == 0 {
        explains
    } else if frozen {
        1.0 - whole(&r1, false) / whole(&st.evidence.r, false).max(1e-9)
    } else {
        (hold_all(&r0) - hold_all(&r1)) / hold_total.max(1e-9)
    };
    let predicted = match frozen || st.remembers(c) {
        true => 1.0,
        false => predicts(data, &r0, &r1),
    };
    let columns = effect.columns(st.cx, &c.place, &c.shape, false);
    // what shows in parameters alone is no signal that could be moved
    let decoys = (!frozen)
        .then(|| decoy::largest(st.evidence, (&columns, &c.projected), &c.eta, &beside, gain));
    // whole sets of inertial parameters fit anything in a single record
    let unsteady = match st.remembers(c) || frozen && columns.len() > FEW {
        true => None,
        false => unsteady(st.evidence, &columns, &beside, f1.gain, gain),
    };
    let together = size
        * shown_on_both(data, c, &r0, &r1)
        * unsteady.map_or(1.0, |u| logistic((UNSTEADY - u) / 0.02))
        * if frozen { 1.0 } else { matters }
        * logistic((predicted - HELD) / 0.05)
        * decoys.map_or(1.0, |d| logistic((DECOY - d) / 0.03))
        * match frozen {
            // nothing else may be odd about the parameters
            true => logistic((share - 0.7) / 0.05),
            false => logistic((share - 0.55) / 0.07).max(alone),
        }
        * logistic((hold - 0.3) / 0.07).max(logistic((repeats - 0.45) / 0.07));
    Member {
        candidate: c.clone(),
        confidence: together / (1.0 + against),
        together,
        explains: explains.clamp(0.0, 1.0),
        holdout: holdout.clamp(-1.0, 1.0),
        visibility: c.projected.visibility(Some(&c.eta)),
        decoys,
        unsteady,
        rivals,
        std: Vec::new(),
        frozen,
    }
}

/// By how much the residual falls on holdout records over the fall that is predicted, `‖Δ‖²` for a fit that
/// takes `Δ = r₀ − r₁` away: 1 where just this is there, `2s − 1` where `s` times as much is, negative
/// where something else is. A prediction of next to nothing is taken as kept.
fn predicts(data: &Data, r0: &[Vec<f64>], r1: &[Vec<f64>]) -> f64 {
    let rows = data.fitted..data.rows();
    if rows.is_empty() {
        return 1.0;
    }
    let nothing = 0.02 * rows.len() as f64;
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
fn unsteady(
    evidence: &Evidence,
    columns: &[Column],
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
    let projected = evidence.project_all(&apart);
    let mut set = beside.to_vec();
    set.extend(&projected);
    let freedoms = ((fitted.len() - 1) * columns.len()) as f64;
    let more = evidence.fit(&set).gain - together - FREEDOM * freedoms;
    Some(more.max(0.0) / own.max(1e-9))
}

/// Whether an effect of a pair of joints is seen on both, 0 to 1: on rows of each the residual must fall by
/// half of what the fit takes away there, as in [`predicts`]. 1 for other effects; little where one of the
/// two joints is too noisy to tell, for then the effect may as well be another one on the other joint.
fn shown_on_both(data: &Data, c: &Candidate, r0: &[Vec<f64>], r1: &[Vec<f64>]) -> f64 {
    let Place::Pair(j, k) = c.place else {
        return 1.0;
    };
    let on = |j: usize| -> f64 {
        let [taken, fall] = taken_and_fall(&r0[j..=j], &r1[j..=j], 0..data.fitted);
        match taken < UNSEEN {
            true => 0.3,
            false => logistic((fall / taken - HELD) / 0.05),
        }
    };
    on(j).min(on(k))
}

/// Effects that are the same thing by nature: an alias does not take confidence.
fn exchangeable(st: &State, a: usize, b: usize) -> bool {
    let (a, b) = (st.effects[a].card(), st.effects[b].card());
    a.aliases.contains(&b.name) || b.aliases.contains(&a.name)
}
