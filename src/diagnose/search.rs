//! Search over effects, places and shapes.

use super::catalogue::{Context, Effect, Place, Shape};
use super::column::Column;
use super::evidence::{Evidence, Fit, Projected};
use super::thresholds::THRESHOLDS as T;
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
) -> Option<(f64, Vec<f64>, Projected)> {
    let columns = effect.columns(cx, place, shape, draft);
    if columns.is_empty() || columns.iter().any(|c| c.rows.is_empty()) {
        return None;
    }
    let projected = evidence.project(&columns);
    let mut set = beside.to_vec();
    set.push(&projected);
    let fit = evidence.fit(&set);
    let eta = fit.eta[fit.eta.len() - columns.len()..].to_vec();
    let gain = fit.gain - before.gain;
    let gain = match gain.is_finite() && effect.plausible(cx, place, shape, &eta) {
        true => gain,
        false => 0.0,
    };
    Some((gain, eta, projected))
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
    let best_of = |shapes: &[Shape]| -> Option<(f64, Shape)> {
        let columns = |s: &Shape| effect.columns(cx, place, s, true);
        let sets: Vec<_> = shapes.iter().map(columns).collect();
        let empty = |s: &Vec<Column>| s.is_empty() || s.iter().any(|c| c.rows.is_empty());
        if sets.iter().any(empty) {
            return None;
        }
        let mut best: Option<(f64, Shape)> = None;
        for (projected, shape) in evidence.project_all(&sets).iter().zip(shapes) {
            let mut set = beside.to_vec();
            set.push(projected);
            let fit = evidence.fit(&set);
            let eta = &fit.eta[fit.eta.len() - projected.z.len()..];
            let gain = fit.gain - before.gain;
            if gain.is_finite()
                && effect.plausible(cx, place, shape, eta)
                && best.as_ref().is_none_or(|b| gain > b.0)
            {
                best = Some((gain, shape.clone()));
            }
        }
        best
    };
    let parts: Vec<_> = grid.par_chunks(8).with_max_len(1).map(best_of).collect();
    let better = |a: (f64, Shape), b: (f64, Shape)| if b.0 > a.0 { b } else { a };
    let best = parts.into_iter().flatten().reduce(better);
    let (gain, mut shape) = best?;
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
                            Some((gain, ..)) if gain > top * T.shapes.better => {
                                top = gain;
                                shape = next;
                            }
                            _ => break,
                        }
                    }
                }
            }
        }
    }
    let (gain, eta, projected) =
        try_shape(evidence, cx, effect, place, &shape, beside, before, false)?;
    Some(Candidate {
        effect: which,
        place: *place,
        shape,
        projected,
        gain,
        eta,
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
        .flat_map(|(e, effect)| effect.places(cx).into_iter().map(move |p| (e, p)))
        .collect();
    let mut all: Vec<Candidate> = tasks
        .par_iter()
        .with_max_len(1)
        .filter_map(|(e, place)| best_shape(evidence, cx, effects, *e, place, beside, &before))
        .collect();
    all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    all
}
