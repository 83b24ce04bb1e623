//! Rivals: what could stand in the place of a member, and how much of its confidence they take.

use super::super::catalogue::{Place, Shape};
use super::super::evidence::Projected;
use super::super::search::{Candidate, Task};
use super::super::thresholds::THRESHOLDS as T;
use super::beside::Beside;
use super::state::State;
use rayon::prelude::*;

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

/// Rivals of a place in the set with their best shapes, by falling gain beside the others.
pub fn challengers(
    st: &State,
    list: &[Candidate],
    beside: &[&Projected],
    most: usize,
) -> Vec<Candidate> {
    let beside = st.evidence.set(beside);
    let with = |(i, c): (usize, &Candidate)| (beside.with(&c.projected).gain, i);
    let mut quick: Vec<(f64, usize)> = list.par_iter().enumerate().map(with).collect();
    quick.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    // the best places of every effect
    let mut chosen: Vec<usize> = Vec::new();
    for (_, i) in &quick {
        let same = chosen
            .iter()
            .filter(|c| list[**c].effect == list[*i].effect);
        if same.count() < T.search.places && chosen.len() < most {
            chosen.push(*i);
        }
    }
    let tasks = chosen.iter().map(|i| (list[*i].effect, list[*i].place));
    let tasks: Vec<Task> = tasks.collect();
    let mut all = st.finder(&beside).best_shapes(&tasks);
    all.retain(|c| c.gain > 0.0);
    all.sort_by(|a, b| merit(st, b).total_cmp(&merit(st, a)));
    all
}

/// Gain less what its freedoms cost, a little more for effects that are always expected.
pub fn merit(st: &State, c: &Candidate) -> f64 {
    merit_of(st, c, c.gain, price(st))
}

/// Price of a freedom that is fitted to rows: that of the Bayesian information criterion.
fn price(st: &State) -> f64 {
    ((st.evidence.data.fitted * st.evidence.data.joints()) as f64).ln()
}

/// The same with another gain, and another price of a freedom.
fn merit_of(st: &State, c: &Candidate, gain: f64, price: f64) -> f64 {
    let effect = &st.effects[c.effect];
    let freedoms = (c.live() + effect.freedoms(&c.shape)) as f64;
    (gain - price * freedoms)
        * (1.0 + T.rivals.familiar * effect.familiarity() - T.rivals.parsimony * freedoms)
}

/// The rivals of a member by falling weight.
pub fn rivals(m: &Beside, list: &[Candidate]) -> Vec<Rival> {
    let st = m.st;
    let beside = m.beside();
    let own = match m.frozen {
        true => merit_of(st, m.member, m.fall, T.rivals.price),
        false => merit_of(st, m.member, m.gain, price(st)),
    };
    // what the member leaves
    let left = match m.frozen {
        true => m.unlikely_left() + T.rivals.left_hidden,
        false => m.energy_left() + T.rivals.left,
    };
    let mut rivals: Vec<Rival> = Vec::new();
    for r in challengers(st, list, &beside, T.search.judged) {
        if r.same(m.member) {
            continue;
        }
        // the rival leaves that and what it gains less
        let less = own - merit_instead(m, &r);
        let loss = less / own.max(1e-9);
        // and what each explains at all
        let by_gain = (1.0 - loss).max(0.0).powi(T.rivals.by_gain);
        let least = -T.rivals.better * left;
        let by_left = (left / (left + less.max(least))).powf(T.rivals.by_left);
        if loss < T.rivals.loss {
            let by_rows = in_rows(m, &r).unwrap_or(f64::INFINITY);
            rivals.push(Rival {
                effect: r.effect,
                place: r.place,
                loss,
                weight: by_gain.min(by_left).min(by_rows).min(T.rivals.most),
                shape: r.shape.clone(),
                eta: r.eta.clone(),
            });
        }
    }
    rivals.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    rivals
}

/// Weight of a rival of an effect that shows in the parameters of a closed chain by what it leaves of the residual: a body
/// anywhere may stand for the parameters, and leave what moves otherwise.
fn in_rows(m: &Beside, r: &Candidate) -> Option<f64> {
    let st = m.st;
    if !(m.frozen && st.evidence.data.shared()) {
        return None;
    }
    let mut both = m.set.to_vec();
    both.push(r.clone());
    let instead = r.gain - (st.gain(&both) - m.with.gain);
    let own = merit_of(st, m.member, m.gain, price(st));
    let less = own - merit_of(st, r, instead, price(st));
    let left = m.energy_left() + T.rivals.left;
    let least = -T.rivals.better * left;
    Some((left / (left + less.max(least))).powf(T.rivals.by_left))
}

/// Merit of a rival by what it gains in place of the member, not what it would gain beside it.
fn merit_instead(m: &Beside, r: &Candidate) -> f64 {
    let st = m.st;
    let mut both = m.set.to_vec();
    both.push(r.clone());
    let instead = r.gain - (st.gain(&both) - m.with.gain);
    match m.frozen {
        true => {
            let mut alone = m.rest.clone();
            alone.push(r.clone());
            let (fit, residual) = st.fit(&alone);
            let fall = m.surprise_without - st.surprise(&fit, &residual);
            merit_of(st, r, fall.min(instead), T.rivals.price)
        }
        false => merit_of(st, r, instead, price(st)),
    }
}

/// Weight of the other effects, which share the confidence. The same effect elsewhere makes the place
/// uncertain, and takes nothing.
pub fn against(st: &State, effect: usize, rivals: &[Rival]) -> f64 {
    let mut seen = vec![effect];
    let mut against = 0.0;
    for r in rivals {
        if !seen.contains(&r.effect) && !exchangeable(st, effect, r.effect) {
            seen.push(r.effect);
            against += r.weight;
        }
    }
    against
}

/// Loss of the other effect that comes nearest, of those that a part of a gap can be given to.
pub fn least_loss(st: &State, effect: usize, rivals: &[Rival]) -> f64 {
    rivals
        .iter()
        .filter(|r| r.effect != effect && !exchangeable(st, effect, r.effect))
        .filter(|r| st.effects[r.effect].of_a_part(&r.shape))
        .fold(1.0f64, |m, r| m.min(r.loss))
}

/// Effects that are the same thing by nature: an alias does not take confidence.
fn exchangeable(st: &State, a: usize, b: usize) -> bool {
    let (a, b) = (st.effects[a].card(), st.effects[b].card());
    a.aliases.contains(&b.name) || b.aliases.contains(&a.name)
}
