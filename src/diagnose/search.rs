//! Search over effects, places and shapes.

use super::catalogue::{Context, Effect, Place, Shape};
use super::column::Column;
use super::evidence::{Evidence, Fit, Projected};
use super::thresholds::THRESHOLDS as T;
use crate::report::format::significant;
use rayon::prelude::*;

/// An effect at a place with its best shape.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// index into the catalogue
    pub effect: usize,
    /// where
    pub place: Place,
    /// shape
    pub shape: Shape,
    /// columns
    pub projected: Projected,
    /// by how much `χ²` falls when it is added to what is already there
    pub gain: f64,
    /// coefficients then
    pub eta: Vec<f64>,
    /// why it is none, where its best fit is one that no machine can have, and by how much `χ²` would fall
    pub ruled_out: Option<(String, f64)>,
}

impl Candidate {
    /// Coefficients of columns that are not zero.
    pub fn live(&self) -> usize {
        let live = (0..self.eta.len()).filter(|&k| self.projected.raw[(k, k)] > 0.0);
        live.count()
    }

    /// Whether it is the same effect at the same place.
    pub fn same(&self, other: &Candidate) -> bool {
        self.effect == other.effect && self.place == other.place
    }
}

/// Gain of one shape beside a fitted set.
#[allow(clippy::too_many_arguments)]
fn try_shape(
    evidence: &Evidence,
    cx: &Context,
    effect: &dyn Effect,
    place: &Place,
    shape: &Shape,
    beside: &[&Projected],
    before: &Fit,
    draft: bool,
) -> Option<Tried> {
    let columns = effect.columns(cx, place, shape, draft);
    if columns.is_empty() || columns.iter().any(|c| c.rows.is_empty()) {
        return None;
    }
    let mut projected = evidence.project(&columns);
    projected.prior = effect.prior();
    let mut set = beside.to_vec();
    set.push(&projected);
    let fit = evidence.fit(&set);
    let eta = fit.eta[fit.eta.len() - columns.len()..].to_vec();
    let gain = fit.gain - before.gain;
    let able = gain.is_finite() && effect.plausible(cx, place, shape, &eta);
    let why = match able {
        true => impossible(cx, effect, place, shape, &eta, (!draft).then_some(&columns)),
        false => None,
    };
    Some(Tried {
        gain: if able && why.is_none() { gain } else { 0.0 },
        ruled_out: why.map(|why| (why, gain)),
        eta,
        projected,
    })
}

/// An effect with one shape, beside a set.
struct Tried {
    gain: f64,
    eta: Vec<f64>,
    projected: Projected,
    ruled_out: Option<(String, f64)>,
}

/// Why no machine has these coefficients: by the rules of the effect, or because it would need more torque than
/// its drive has. The torque is that of a sine of the same power, over the fitted rows that count.
fn impossible(
    cx: &Context,
    effect: &dyn Effect,
    place: &Place,
    shape: &Shape,
    eta: &[f64],
    columns: Option<&Vec<Column>>,
) -> Option<String> {
    let why = effect.impossible(cx, place, shape, eta);
    let (Some(columns), None) = (columns, &why) else {
        return why;
    };
    place.named().into_iter().find_map(|j| {
        let most = effect.most() * cx.effort(j)?;
        let rows = cx.data.fitted;
        let (mut power, mut count) = (0.0, 0.0f64);
        for i in (0..rows).filter(|i| cx.data.weights[j][*i] > 0.0) {
            let at = |(c, e): (&Column, &f64)| c.get(j).map_or(0.0, |v| v[i] * e);
            power += columns.iter().zip(eta).map(at).sum::<f64>().powi(2);
            count += 1.0;
        }
        let torque = (2.0 * power / count.max(1.0)).sqrt();
        (torque > most).then(|| {
            format!(
                "it would make {} {} on {}, whose drive has {}",
                significant(torque, 3),
                cx.torque_unit(j),
                cx.name(j),
                significant(cx.effort(j).unwrap_or(most), 3)
            )
        })
    })
}

/// A shape refined with the whole columns, in small steps.
fn whole(
    evidence: &Evidence,
    cx: &Context,
    effect: &dyn Effect,
    place: &Place,
    from: (Tried, Shape),
    beside: &[&Projected],
    before: &Fit,
) -> (Tried, Shape) {
    let (mut last, mut shape) = from;
    for step in T.settle.steps {
        for k in (0..shape.constants.len()).filter(|k| effect.refinable(*k)) {
            for factor in [step, 1.0 / step] {
                for _ in 0..T.settle.most {
                    let mut next = shape.clone();
                    next.constants[k] *= factor;
                    match try_shape(evidence, cx, effect, place, &next, beside, before, false) {
                        Some(t) if t.gain > last.gain * T.shapes.better => {
                            (last, shape) = (t, next);
                        }
                        _ => break,
                    }
                }
            }
        }
    }
    (last, shape)
}

/// A candidate in another context, its shape refined from where it is.
pub fn again(
    evidence: &Evidence,
    cx: &Context,
    effects: &[Box<dyn Effect>],
    c: &Candidate,
) -> Option<Candidate> {
    let (effect, none) = (effects[c.effect].as_ref(), evidence.fit(&[]));
    let first = try_shape(evidence, cx, effect, &c.place, &c.shape, &[], &none, false)?;
    let from = (first, c.shape.clone());
    let (last, shape) = whole(evidence, cx, effect, &c.place, from, &[], &none);
    Some(Candidate {
        shape,
        projected: last.projected,
        gain: last.gain,
        eta: last.eta,
        ruled_out: last.ruled_out,
        ..c.clone()
    })
}

/// The best shape of an effect at a place, beside a set.
pub fn best_shape(
    evidence: &Evidence,
    cx: &Context,
    effects: &[Box<dyn Effect>],
    which: usize,
    place: &Place,
    beside: &[&Projected],
    before: &Fit,
) -> Option<Candidate> {
    let effect = effects[which].as_ref();
    let grid = effect.shapes(cx, place);
    // the best that a machine can have, and the best that none can: by what they gain less what their columns cost, so that
    // a form with more of them takes the place of a plain one only where it has a use
    type Best = [Option<(f64, f64, Shape, Option<String>)>; 2];
    let worth = |gain: f64, projected: &Projected| {
        let live = (0..projected.z.len()).filter(|k| projected.raw[(*k, *k)] > 0.0);
        gain - T.rivals.price * live.count() as f64
    };
    let best_of = |shapes: &[Shape]| -> Option<Best> {
        let columns = |s: &Shape| effect.columns(cx, place, s, true);
        let sets: Vec<_> = shapes.iter().map(columns).collect();
        let empty = |s: &Vec<Column>| s.is_empty() || s.iter().any(|c| c.rows.is_empty());
        if sets.iter().any(empty) {
            return None;
        }
        let mut best: Best = [None, None];
        for (mut projected, shape) in evidence.project_all(&sets).into_iter().zip(shapes) {
            projected.prior = effect.prior();
            let mut set = beside.to_vec();
            set.push(&projected);
            let fit = evidence.fit(&set);
            let eta = &fit.eta[fit.eta.len() - projected.z.len()..];
            let gain = fit.gain - before.gain;
            let able = gain.is_finite() && effect.plausible(cx, place, shape, eta);
            let why = effect.impossible(cx, place, shape, eta).filter(|_| able);
            let of = &mut best[usize::from(why.is_some())];
            let worth = worth(gain, &projected);
            if able && of.as_ref().is_none_or(|b| worth > b.0) {
                *of = Some((worth, gain, shape.clone(), why));
            }
        }
        Some(best)
    };
    let parts: Vec<_> = grid.par_chunks(8).with_max_len(1).map(best_of).collect();
    let [best, none] = [0, 1].map(|which| {
        let all = parts.iter().flatten().filter_map(|b| b[which].clone());
        all.reduce(|a, b| if b.0 > a.0 { b } else { a })
    });
    // what no machine can have is kept only to be said
    let gain = best.as_ref().map_or(0.0, |b| b.1);
    let said =
        none.and_then(|(_, more, shape, why)| (more > gain).then_some(((why?, more), shape)));
    let (said, instead) = said.unzip();
    let mut shape = best.map(|b| b.2).or(instead)?;
    // between grid points
    if gain > T.shapes.refined {
        let mut top = gain;
        let constants = shape.constants.len();
        let bounds: Vec<[f64; 2]> = (0..constants)
            .map(|k| {
                let ends = grid
                    .iter()
                    .filter(|s| s.form == shape.form)
                    .map(|s| s[k])
                    .filter(|v| v.signum() == shape[k].signum());
                ends.fold([f64::INFINITY, 0.0], |[a, b]: [f64; 2], v| {
                    [a.min(v.abs()), b.max(v.abs())]
                })
            })
            .collect();
        for step in T.shapes.steps {
            for k in 0..constants {
                if !effect.refinable(k) {
                    continue;
                }
                for factor in [step, 1.0 / step] {
                    loop {
                        let mut next = shape.clone();
                        next.constants[k] *= factor;
                        if next[k].abs() < bounds[k][0] / T.shapes.below
                            || next[k].abs() > bounds[k][1] * T.shapes.above
                        {
                            break;
                        }
                        let tried =
                            try_shape(evidence, cx, effect, place, &next, beside, before, true);
                        match tried {
                            Some(t) if t.gain > top * T.shapes.better => {
                                top = t.gain;
                                shape = next;
                            }
                            _ => break,
                        }
                    }
                }
            }
        }
    }
    let last = try_shape(evidence, cx, effect, place, &shape, beside, before, false)?;
    // a draft leaves out what gravity and velocity do to a way
    let (last, shape) = match effect.sways() && last.gain > T.settle.whole {
        true => whole(evidence, cx, effect, place, (last, shape), beside, before),
        false => (last, shape),
    };
    Some(Candidate {
        effect: which,
        place: *place,
        shape,
        projected: last.projected,
        gain: last.gain,
        eta: last.eta,
        ruled_out: last.ruled_out.or(said),
    })
}

/// Every effect at every place with its best shape, beside a set; by falling gain.
pub fn singles(
    evidence: &Evidence,
    cx: &Context,
    effects: &[Box<dyn Effect>],
    beside: &[&Projected],
) -> Vec<Candidate> {
    let before = evidence.fit(beside);
    let tasks: Vec<(usize, Place)> = effects
        .iter()
        .enumerate()
        .flat_map(|(e, effect)| effect.sites(cx).into_iter().map(move |p| (e, p)))
        .collect();
    let mut all: Vec<Candidate> = tasks
        .par_iter()
        .with_max_len(1)
        .filter_map(|(e, place)| best_shape(evidence, cx, effects, *e, place, beside, &before))
        .collect();
    all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    all
}
