//! The set of effects: forward steps, pairs that mask each other, and exchanges.

use super::super::catalogue::Place;
use super::super::evidence::{Fit, Projected};
use super::super::search::{self, Candidate};
use super::super::thresholds::THRESHOLDS as T;
use super::predict::predicts;
use super::rivals::{challengers, merit};
use super::state::{State, energy, others};
use rayon::prelude::*;
use std::ops::Range;

/// Adds effects one by one while one can be accepted.
pub fn forwards(st: &State, list: &[Candidate], progress: &dyn Fn(&str)) -> Vec<Candidate> {
    let mut set: Vec<Candidate> = Vec::new();
    while set.len() < T.search.members {
        progress(match set.len() {
            0 => "first effect",
            1 => "second effect",
            2 => "third effect",
            _ => "fourth effect",
        });
        // where none does, those that hide in the parameters are looked at apart: others that gain more may crowd them out
        let grown = larger(st, list, &set).or_else(|| larger(st, &hiding(st, list, &set), &set));
        match grown {
            Some(grown) => set = grown,
            None => break,
        }
    }
    set
}

/// The set with the best of some candidates that can be accepted.
fn larger(st: &State, list: &[Candidate], set: &[Candidate]) -> Option<Vec<Candidate>> {
    let beside: Vec<&Projected> = set.iter().map(|c| &c.projected).collect();
    let mut next = challengers(st, list, &beside, T.search.forward);
    next.retain(|c| !set.iter().any(|s| s.same(c)));
    // one that gains most need not be one that holds: the others have their turn
    let tried = next.into_iter().take(T.search.tried).enumerate();
    tried
        .filter_map(|(i, candidate)| grown(st, list, set, candidate, i == 0))
        .next()
}

/// Candidates that hide in the parameters, where these stay farther from the robot file than a set explains.
fn hiding(st: &State, list: &[Candidate], set: &[Candidate]) -> Vec<Candidate> {
    let (fit, residual) = st.fit(set);
    let unlikely = st.surprise(&fit, &residual) > T.hidden.surprise + st.freedoms;
    let kept = list
        .iter()
        .filter(|c| unlikely && st.effects[c.effect].hides());
    kept.cloned().collect()
}

/// Lets a rival that does better beside the others take the place of a member.
pub fn exchange(st: &State, list: &[Candidate], mut set: Vec<Candidate>) -> Vec<Candidate> {
    for _ in 0..T.search.rounds {
        let mut changed = false;
        for i in 0..set.len() {
            let rest = others(&set, i);
            let beside: Vec<&Projected> = rest.iter().map(|c| &c.projected).collect();
            let best = challengers(st, list, &beside, T.search.exchange);
            if let Some(b) = best.into_iter().next()
                && !b.same(&set[i])
                && !rest.iter().any(|c| c.same(&b))
                && merit(st, &b) > T.search.exchange_margin * gained(st, &set, i)
            {
                let mut other = set.clone();
                other[i] = b;
                if accepted(st, &other, i) {
                    set = other;
                    changed = true;
                }
            }
        }
        if !changed || set.len() < 2 {
            break;
        }
    }
    set
}

/// Improves the shapes of all members in turn.
fn polish(st: &State, set: &mut [Candidate]) {
    for i in 0..set.len() {
        let others: Vec<Candidate> = others(set, i);
        let beside: Vec<&Projected> = others.iter().map(|c| &c.projected).collect();
        let beside = st.evidence.set(&beside);
        let better = st.finder(&beside).best_shape((set[i].effect, set[i].place));
        if let Some(b) = better.filter(|b| b.gain > 0.0) {
            set[i] = b;
        }
    }
}

/// The set with one more effect, if that explains enough more. The first of several tries is
/// also compared with the best of all pairs.
fn grown(
    st: &State,
    list: &[Candidate],
    set: &[Candidate],
    candidate: Candidate,
    first: bool,
) -> Option<Vec<Candidate>> {
    let mut grown = set.to_vec();
    grown.push(candidate);
    if !first && !accepted(st, &grown, set.len()) {
        return None;
    }
    if first
        && grown.len() == 2
        && let Some(mut pair) = best_pair(st, list)
    {
        let gain = |s: &[Candidate]| st.gain(s);
        polish(st, &mut pair);
        let each = |i: usize| accepted(st, &pair, i);
        if gain(&pair) > gain(&grown) + T.search.pair_margin * st.total && (0..2).all(each) {
            return Some(pair);
        }
    }
    // one that came after others may be a point of its grid
    if grown.len() > 1 || !first {
        polish(st, &mut grown);
    }
    accepted(st, &grown, set.len()).then_some(grown)
}

/// Gain of member `i` beside the others.
fn gained(st: &State, set: &[Candidate], i: usize) -> f64 {
    st.gain(set) - st.gain(&others(set, i))
}

/// Whether the friction at a place brakes with all members of a set that are there.
fn brakes(st: &State, set: &[Candidate], place: &Place, fit: &Fit) -> bool {
    let mut at = 0;
    let mut there: Vec<search::Member> = Vec::new();
    for c in set {
        let own = &fit.eta[at..at + c.eta.len()];
        at += own.len();
        if c.place == *place {
            there.push((st.effects[c.effect].as_ref(), &c.shape, own));
        }
    }
    let all = || set.iter().map(|c| &c.projected).collect::<Vec<_>>();
    search::brakes(st.cx, place, &there, || st.evidence.parameters(&all(), fit))
}

/// Whether member `i` of a set explains enough beside the others, also on holdout records.
fn accepted(st: &State, set: &[Candidate], i: usize) -> bool {
    let data = st.evidence.data;
    let rows = data.fitted as f64;
    let (f1, r1) = st.fit(set);
    if !brakes(st, set, &set[i].place, &f1) {
        return false;
    }
    let (f0, r0) = st.fit(&others(set, i));
    let fall = |rows: Range<usize>| energy(&r0, rows.clone()) - energy(&r1, rows);
    let visible = fall(0..data.fitted);
    let prior = (f1.gain - f0.gain) - visible;
    let held = data.rows() - data.fitted;
    let hold = fall(data.fitted..data.rows());
    let gap = st.gap(&r0, true);
    let there: f64 = st.joints_of(&set[i]).iter().map(|j| gap[*j].max(0.0)).sum();
    let significant =
        visible > st.scale(set.len()) * T.entry.gain * rows && visible > T.entry.of_gap * there;
    // as much a row as on the fitted records, or, where the holdout moves less, as much as predicted
    let predicted = predicts(data, &r0, &r1);
    let generalises = held == 0
        || hold > T.entry.holdout * visible * held as f64 / rows
        || predicted > T.confidence.predicts.centre
        || st.unseen(&set[i], [hold / held as f64, visible / rows]);
    if significant && generalises {
        let after = st.gap(&r1, true);
        let worth = st.matters(&set[i], set.len(), [&gap, &after], prior);
        let enters =
            worth > T.entry.claimable && (st.remembers(&set[i]) || predicted > T.entry.claimable);
        // one that lives in the parameters is judged by them, if the residual hardly shows it
        let faint = worth <= T.entry.claimable && prior > T.hidden.surprise;
        if enters || !faint {
            return enters;
        }
    }
    // what lives in the parameters takes the place of a refit: it must predict where the model as it is does not
    let held_rows = || data.fitted..data.rows();
    let follows = || {
        let frozen = energy(&st.evidence.r, held_rows());
        energy(&r1, held_rows()) < T.hidden.follows * frozen
    };
    st.may_hide(set, i)
        && prior > T.hidden.surprise
        && (generalises || prior > T.entry.prior_share * visible.abs())
        && (held == 0 || hold > -T.entry.holdout_rise * held as f64 || follows())
}

/// The two candidates that explain most together.
fn best_pair(st: &State, list: &[Candidate]) -> Option<Vec<Candidate>> {
    let mut few: Vec<&Candidate> = Vec::new();
    for c in list {
        let same = few.iter().filter(|f| f.effect == c.effect).count();
        if same < T.search.pair_places && few.len() < T.search.pairs {
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
