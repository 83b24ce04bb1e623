//! How close an identified model is to its robot: estimated from the records themselves.
//!
//! A robot file with `prior = "identified"` may be off by a percent or by a tenth of one. Were the
//! looser figure taken for both, effects that a refit absorbs (a payload, the gain of a drive, a zero
//! of an encoder) would pass as ordinary errors of a model that has none. So the deviations of the
//! prior are scaled by factors `s ≤ 1`, one for masses, first moments and rotors and one for tensors,
//! that the data find likeliest (empirical Bayes; MacKay 1992). In units of the prior, with
//! `Λ = WᵀW`, `b = Wᵀr` and `A = 1 + diag(s) Λ diag(s)`,
//!
//! ```text
//! −2 ln p(r | s, e) = rᵀr − bᵀ diag(s) A⁻¹ diag(s) b − gain(e) + ln det A + k_e ln N
//! ```
//!
//! is least over `s` *and* over the effects `e` that a refit may absorb, or none: an effect that is
//! there makes parameters seem off, and would pass for a model that is not close. Friction and offsets
//! keep their deviations, as they change from day to day. Of the factors that are nearly as likely as the
//! likeliest the loosest are taken. Energies are divided by what the refitted
//! model leaves per row, so that a gap for which no effect stands does not count as precision.

use super::catalogue::{Context, Effect, Place, Shape};
use super::data::Data;
use super::evidence::Evidence;
use super::prior::{Closeness, factors};
use super::thresholds::THRESHOLDS as T;
use crate::plant::{self, Parameter};
use crate::robot::{JointTerm, Prior};
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use rayon::prelude::*;

/// Sets of columns that are projected at once.
const AT_ONCE: usize = 8;

/// Residual, model and one set of columns as the parameters see them, in units of the prior.
struct Reduced {
    /// `Λ`
    gram: Mat<f64>,
    /// `b`
    pull: Mat<f64>,
    /// of every effect: `WᵀZ`, `ZᵀZ`, `Zᵀr`
    effects: Vec<[Mat<f64>; 3]>,
}

impl Reduced {
    /// Adds as effects that sets of parameters are anything.
    fn release(&mut self, sets: &[Vec<usize>]) {
        let (gram, pull) = (&self.gram, &self.pull);
        let of = |set: &Vec<usize>| {
            let k = set.len();
            [
                Mat::from_fn(gram.nrows(), k, |i, c| gram[(i, set[c])]),
                Mat::from_fn(k, k, |a, c| gram[(set[a], set[c])]),
                Mat::from_fn(k, 1, |c, _| pull[(set[c], 0)]),
            ]
        };
        let all: Vec<_> = sets.iter().map(of).collect();
        self.effects.extend(all);
    }
}

/// Scales the prior of a model that claims to be identified by the factors that the records find
/// likeliest.
///
/// # Errors
/// Poses that cannot be reached.
pub fn tighten(data: &mut Data, effects: &[Box<dyn Effect>]) -> crate::error::Result<()> {
    if data.plant.prior() == Prior::Identified {
        let evidence = Evidence::new(data, 1.0);
        let phi = evidence.parameters(&[], &evidence.fit(&[]));
        let closeness = estimate(&evidence, &Context::new(data, phi)?, effects);
        drop(evidence);
        data.tighten(closeness);
    }
    Ok(())
}

/// The factors that the records find likeliest.
fn estimate(evidence: &Evidence, cx: &Context, effects: &[Box<dyn Effect>]) -> Closeness {
    let data = evidence.data;
    let hidden = effects.iter().filter(|e| e.hides());
    let (reduced, price) = reduced(evidence, cx, hidden);
    let scales = T.closeness.scales;
    let pairs: Vec<Closeness> = scales
        .iter()
        .flat_map(|a| scales.iter().map(move |b| [*a, *b]))
        .filter(|[a, b]| a.max(*b) < T.closeness.apart * a.min(*b))
        .collect();
    let costs: Vec<f64> = pairs
        .par_iter()
        .map(|c| cost(&reduced, &factors(&data.parameters, *c), price))
        .collect();
    // the loosest that are nearly as likely: robots of few joints say little about it
    let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
    let likely = (0..pairs.len()).filter(|i| costs[*i] <= least + T.closeness.likely);
    let product = |i: &usize| pairs[*i][0] * pairs[*i][1];
    let loosest = likely.max_by(|a, b| product(a).total_cmp(&product(b)));
    loosest.map_or([1.0; 2], |i| pairs[i])
}

/// Whether some terms of joints are off: whether the records are likelier with them as unknowns than with the values of the robot file, the
/// best effect beside either that a refit may absorb, or none. They are not for what a sound model leaves. That one term is off, or
/// those of one joint, is an effect, too.
///
/// # Errors
/// Poses that cannot be reached.
pub fn are_off(
    data: &Data,
    terms: &[JointTerm],
    effects: &[Box<dyn Effect>],
) -> crate::error::Result<bool> {
    let evidence = Evidence::new(data, 1.0);
    let phi = evidence.parameters(&[], &evidence.fit(&[]));
    let cx = Context::new(data, phi)?;
    let absorbed = effects.iter().filter(|e| e.hides() || e.is_alike());
    let (mut reduced, price) = reduced(&evidence, &cx, absorbed);
    let joint_of = |p: &Parameter| match p.kind {
        plant::Column::Term { joint, term } if terms.contains(&term) => Some(joint),
        _ => None,
    };
    let of: Vec<Option<usize>> = data.parameters.iter().map(joint_of).collect();
    let with = |reduced: &Reduced, known: f64| {
        let s = of.iter().map(|j| if j.is_some() { known } else { 1.0 });
        cost(reduced, &s.collect::<Vec<_>>(), price)
    };
    let each = (0..of.len()).filter(|i| of[*i].is_some());
    let mut sets: Vec<Vec<usize>> = each.clone().map(|i| vec![i]).collect();
    for j in 0..data.plant.robot().joints.len() {
        let own: Vec<usize> = each.clone().filter(|i| of[*i] == Some(j)).collect();
        sets.extend((own.len() > 1).then_some(own));
    }
    reduced.release(&sets);
    let slack = T.gap.slack * (data.fitted * data.joints()) as f64;
    Ok(with(&reduced, 1.0) + slack < with(&reduced, 0.0))
}

/// Products of the columns of effects, of all shapes at all sites, with those of the model; and what a coefficient costs.
fn reduced<'e>(
    evidence: &Evidence,
    cx: &Context,
    effects: impl Iterator<Item = &'e Box<dyn Effect>>,
) -> (Reduced, f64) {
    let data = evidence.data;
    let tasks: Vec<(&dyn Effect, Place, Shape)> = effects
        .flat_map(|e| {
            e.sites(cx).into_iter().flat_map(move |place| {
                let shapes = e.shapes(cx, &place);
                shapes.into_iter().map(move |s| (e.as_ref(), place, s))
            })
        })
        .collect();
    let samples = (data.fitted * data.joints()) as f64;
    let level = (evidence.j0 / samples).max(1.0);
    // a few at a time, and no longer than their products are wanted: columns are large
    let seen = |tasks: &[(&dyn Effect, Place, Shape)]| -> Vec<[Mat<f64>; 3]> {
        let of = |(e, place, s): &(&dyn Effect, Place, Shape)| {
            let columns = e.columns(cx, place, s, true);
            let empty = columns.is_empty() || columns.iter().any(|c| c.rows.is_empty());
            (!empty).then_some((e.prior(), columns))
        };
        let (priors, sets): (Vec<f64>, Vec<_>) = tasks.iter().filter_map(of).unzip();
        let projected = evidence.project_all(&sets).into_iter().zip(priors);
        projected
            .map(|(mut p, prior)| {
                p.prior = prior;
                evidence.as_seen(&p).map(|m| m * (1.0 / level))
            })
            .collect()
    };
    let each = tasks.par_chunks(AT_ONCE).with_max_len(1).map(seen);
    let each: Vec<Vec<[Mat<f64>; 3]>> = each.collect();
    let [gram, pull] = evidence.normal_equations();
    let reduced = Reduced {
        gram: gram * (1.0 / level),
        pull: pull * (1.0 / level),
        effects: each.into_iter().flatten().collect(),
    };
    (reduced, samples.ln())
}

/// `−2 ln p` less what does not depend on the factors, with the best effect or none.
fn cost(reduced: &Reduced, s: &[f64], price: f64) -> f64 {
    let p = s.len();
    let a = Mat::from_fn(p, p, |i, k| {
        reduced.gram[(i, k)] * s[i] * s[k] + f64::from(u8::from(i == k))
    });
    let Ok(factor) = a.llt(Side::Lower) else {
        return f64::INFINITY;
    };
    let l = factor.L();
    let log_det: f64 = (0..p).map(|i| 2.0 * l[(i, i)].ln()).sum();
    let scaled = |m: &Mat<f64>| Mat::from_fn(p, m.ncols(), |i, k| s[i] * m[(i, k)]);
    let pull = scaled(&reduced.pull);
    let fitted = factor.solve(&pull);
    let plain: f64 = (0..p).map(|i| pull[(i, 0)] * fitted[(i, 0)]).sum();
    let gain = |[seen, own, with]: &[Mat<f64>; 3]| -> f64 {
        let seen = scaled(seen);
        let left = own - seen.transpose() * factor.solve(&seen);
        let b = with - seen.transpose() * &fitted;
        let b: Vec<f64> = (0..b.nrows()).map(|i| b[(i, 0)]).collect();
        super::evidence::solve(&left, &b).gain - price * b.len() as f64
    };
    let best = reduced.effects.iter().map(gain).fold(0.0, f64::max);
    log_det - plain - best
}
