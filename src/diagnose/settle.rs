//! The model that the columns of effects are computed from, once an effect that moves the links is found.
//!
//! A link on a spring swings under the torque of the model. Where that model was refitted to records of such a machine
//! before the spring was known, its inertia has taken over a part of the swing, and the column is that of another
//! machine. So the column is also computed from the model as it is, and from the parameters that are fitted beside the
//! effect, until it gains no more and no less.

use super::catalogue::{Context, Effect};
use super::data::Data;
use super::evidence::Evidence;
use super::search::{Candidate, Finder, singles};
use super::thresholds::THRESHOLDS as T;
use crate::error::Result;

/// Context and candidates; those that were there where no effect that moves the links gains most.
///
/// # Errors
/// Poses that cannot be reached.
pub fn settled<'a>(
    data: &'a Data<'a>,
    evidence: &Evidence,
    effects: &[Box<dyn Effect>],
    cx: Context<'a>,
    list: Vec<Candidate>,
) -> Result<(Context<'a>, Vec<Candidate>)> {
    let sways = |c: &Candidate| effects[c.effect].sways() && c.ruled_out.is_none();
    let most = list.first().map_or(0.0, |c| c.gain);
    if !list.first().is_some_and(sways) {
        return Ok((cx, list));
    }
    let none = evidence.set(&[]);
    let mut best: Option<(Context, f64)> = None;
    let near = list
        .iter()
        .filter(|c| sways(c) && c.gain > T.settle.near * most);
    for start in near.take(T.settle.tried) {
        // from the model as it is, then until parameters and column belong together: the files hold both
        let (mut c, mut phi) = (start.clone(), evidence.phi.clone());
        let mut last = None;
        for round in 0..T.settle.rounds {
            let next = Context::new(data, phi)?;
            let finder = Finder {
                cx: &next,
                effects,
                beside: &none,
            };
            let found = match round {
                0 => finder.best_shape((c.effect, c.place)),
                _ => finder.again(&c),
            };
            let Some(found) = found.filter(|f| f.ruled_out.is_none()) else {
                break;
            };
            let still = (found.gain / c.gain - 1.0).abs() < T.settle.still;
            c = found;
            last = Some((next, c.gain));
            if still {
                break;
            }
            phi = evidence.parameters(&[&c.projected], &evidence.fit(&[&c.projected]));
        }
        if let Some(found) = last
            && best.as_ref().is_none_or(|b| found.1 > b.1)
        {
            best = Some(found);
        }
    }
    let Some((next, _)) = best.filter(|b| b.1 > T.settle.least * most) else {
        return Ok((cx, list));
    };
    let anew = singles(evidence, &next, effects, None);
    match anew.first().is_some_and(sways) {
        true => Ok((next, anew)),
        false => Ok((cx, list)),
    }
}
