//! What to run next: the motion that tells two effects apart, or that shows one.
//!
//! Two effects look alike where their projected columns point the same way. With the effect `A` that is
//! believed, `a = Π^½ Z_A η_A`, and the columns `B` of its rival, the share of `A` that `B` can imitate is
//!
//! ```text
//! overlap = bᵀ Λ_B⁻¹ b / aᵀa,   b = Z_Bᵀ Π Z_A η_A
//! ```
//!
//! The distinguishable part, `(1 − overlap) aᵀa`, is the non-centrality of the test between the two:
//! the criterion of T-optimal design (Atkinson & Fedorov 1975). Where the nominal model itself absorbs an
//! effect, it is the rival, and `overlap = 1 − visibility` (Ds-optimal design: the effect with the nominal
//! parameters as nuisance). Motions come from the program's own optimiser with several grids and seeds,
//! each also run slower, and from random series; the best is improved by random steps of its coefficients
//! and its period that keep inside all limits. All is limited by counts: the same seed gives the same
//! motion whatever the number of threads.

mod motions;
mod trial;

use super::catalogue::{Context, Effect, Place};
use super::data::Data;
use super::evidence::Evidence;
use super::finding::Finding;
use super::search::Candidate;
use super::settings::Settings;
use super::thresholds::THRESHOLDS as T;
use crate::trajectory::Trajectory;
use motions::Motions;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use trial::{COARSE, FINE, Placed, Target, Trial};

/// Name of the nominal model where it stands in the place of a rival.
pub const NOMINAL: &str = "nominal_model";
/// Visibility below which an effect is invisible in a motion.
pub const INVISIBLE: f64 = T.next.invisible;
/// Random steps that are judged side by side.
const BATCH: usize = 8;

/// The next experiment.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Proposal {
    /// the two effects; an effect and [`NOMINAL`] where it is invisible in the records at hand
    pub separates: Vec<&'static str>,
    /// the motion, of the joints of a serial robot or the platform of a parallel one
    pub trajectory: Trajectory,
    /// units of its coordinates
    pub units: Vec<&'static str>,
    /// overlap in the records at hand, and predicted for the motion
    pub overlap: [f64; 2],
    /// why this pair
    pub why: String,
}

/// Designs the next motion, where the first findings are not told apart or an effect is invisible in
/// the records at hand. `None` where there is nothing to separate, or no motion that does.
pub fn propose(
    evidence: &Evidence,
    cx: &Context,
    effects: &[Box<dyn Effect>],
    list: &[Candidate],
    findings: &[Finding],
    settings: &Settings,
) -> Option<Proposal> {
    let mut targets = pairs(effects, findings);
    let first_hidden = targets.len();
    targets.extend(hidden(evidence, cx, effects, list, findings));
    let mut now: Vec<f64> = targets
        .par_iter()
        .with_max_len(1)
        .map(|t| t.overlap(evidence, cx, FINE.shapes).unwrap_or(1.0))
        .collect();
    // a pair that the records tell apart needs no motion; invisible with one shape only is not invisible
    let open = |(i, (_, now)): &(usize, (_, f64))| match *i < first_hidden {
        true => *now > T.next.apart,
        false => *now > 1.0 - INVISIBLE,
    };
    let kept: Vec<(usize, (Target, f64))> = std::iter::zip(targets, now)
        .enumerate()
        .filter(open)
        .collect();
    let first_hidden = kept.iter().filter(|(i, _)| *i < first_hidden).count();
    (targets, now) = kept.into_iter().map(|(_, both)| both).unzip();
    if targets.is_empty() {
        return None;
    }
    let data = evidence.data;
    let trial = Trial { data, phi: &cx.phi };
    let motions = Motions::new(data);
    let mut rng = ChaCha8Rng::seed_from_u64(settings.seed);
    let choice = motions.first(settings.seed, &mut rng);
    let all: Vec<&Target> = targets.iter().collect();
    let judged: Vec<Vec<Option<f64>>> = choice
        .par_iter()
        .with_max_len(1)
        .map(|t| trial.overlaps(&t.fourier, COARSE, &all))
        .collect();
    // the lowest overlap of every target, and in which motion
    let lowest: Vec<Option<(f64, usize)>> = (0..targets.len())
        .map(|i| {
            let seen = judged.iter().enumerate();
            let seen = seen.filter_map(|(m, row)| Some((row[i]?, m)));
            seen.min_by(|a, b| a.0.total_cmp(&b.0))
        })
        .collect();
    let helps = |i: &usize| lowest[*i].is_some_and(|(o, _)| o < T.next.alias);
    let shows = |i: &usize| lowest[*i].is_some_and(|(o, _)| o < 1.0 - 2.0 * INVISIBLE);
    // pairs in their order, then what can be shown best
    let mut order: Vec<usize> = (0..first_hidden).filter(helps).collect();
    let mut rest: Vec<usize> = (first_hidden..targets.len()).filter(shows).collect();
    let overlap = |i: usize| lowest[i].map_or(1.0, |(o, _)| o);
    rest.sort_by(|a, b| overlap(*a).total_cmp(&overlap(*b)));
    order.extend(rest.first());
    let tries = settings.next_tries / order.len().max(1);
    for i in order {
        let (overlap, m) = lowest[i]?;
        let begin = (overlap, choice[m].clone());
        let best = improved(&trial, &motions, &targets[i], begin, tries, &mut rng);
        // predicted at the rate of the records
        let mut of = vec![&targets[i]];
        of.extend(&targets[first_hidden..]);
        let predicted = trial.overlaps(&best.fourier, FINE, &of);
        let Some(overlap) = predicted[0].filter(|o| *o < T.next.better * now[i]) else {
            continue;
        };
        let also = (first_hidden..targets.len()).zip(&predicted[1..]);
        let also: Vec<&Target> = also
            .filter(|(k, o)| *k != i && o.is_some_and(|o| o < 1.0 - 2.0 * INVISIBLE))
            .map(|(k, _)| &targets[k])
            .collect();
        let overlap = [now[i], overlap];
        return Some(Proposal {
            separates: names(&targets[i]),
            why: why(&targets[i], &also, overlap, data),
            trajectory: best,
            units: motions.units(),
            overlap,
        });
    }
    None
}

/// The effect that is believed most with each of its rivals.
fn pairs<'a>(effects: &'a [Box<dyn Effect>], findings: &'a [Finding]) -> Vec<Target<'a>> {
    let Some(main) = findings
        .iter()
        .find(|f| f.member && f.confidence > T.next.believed)
    else {
        return Vec::new();
    };
    // a rival of another finding says nothing of this one
    let robot = |f: &Finding| f.place == Place::Robot;
    let there = |f: &Finding| robot(f) || robot(main) || f.place.meets(&main.place);
    let near = |f: &&Finding| {
        let believed = f.confidence > T.next.near * main.confidence;
        !f.member && f.effect != main.effect && believed && there(f)
    };
    let placed = |f: &'a Finding| Placed::of_finding(effects, f);
    findings
        .iter()
        .filter(near)
        .take(T.next.rivals)
        .filter_map(|rival| Some(Target::Pair(placed(main)?, placed(rival)?)))
        .collect()
}

/// Effects that the nominal model absorbs: members that show in nothing but its parameters, then those
/// of the catalogue at the place where they come nearest to the gap.
fn hidden<'a>(
    evidence: &Evidence,
    cx: &Context,
    effects: &'a [Box<dyn Effect>],
    list: &'a [Candidate],
    findings: &'a [Finding],
) -> Vec<Target<'a>> {
    let shown = |placed: Placed<'a>| {
        let seen = placed.visible(evidence, cx)?;
        Some(Target::Hidden(placed, seen))
    };
    let invisible = |f: &&Finding| f.member && f.visibility < INVISIBLE;
    let members = findings.iter().filter(invisible);
    let mut all: Vec<Target> = members
        .filter_map(|f| shown(Placed::of_finding(effects, f)?))
        .collect();
    if !all.is_empty() {
        return all;
    }
    let mut known: Vec<usize> = Vec::new();
    for c in list {
        let absorbed = c.projected.visibility(None) < INVISIBLE;
        if absorbed && !known.contains(&c.effect) && all.len() < T.next.hidden {
            known.push(c.effect);
            all.extend(shown(Placed::of_candidate(effects, c)));
        }
    }
    all
}

/// Random steps from a motion, in batches of which the best counts; steps shrink where none is better.
fn improved(
    trial: &Trial,
    motions: &Motions,
    target: &Target,
    begin: (f64, Trajectory),
    tries: usize,
    rng: &mut ChaCha8Rng,
) -> Trajectory {
    let (mut lowest, mut best) = begin;
    let [mut step, decay, smallest] = T.next.step;
    for _ in 0..tries.div_ceil(BATCH) {
        if lowest < T.next.apart {
            break;
        }
        let batch: Vec<_> = (0..BATCH)
            .map(|_| motions.changed(&best, step, rng))
            .collect();
        let found = batch
            .into_par_iter()
            .with_max_len(1)
            .filter_map(|motion| {
                // the proof of the limits takes longer
                motions.kept(motion, |f| {
                    let overlap = trial.overlaps(f, COARSE, &[target])[0];
                    overlap.filter(|o| *o < lowest)
                })
            })
            .collect::<Vec<_>>()
            .into_iter()
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match found {
            Some((o, t)) if o < lowest => (lowest, best) = (o, t),
            _ => step = smallest.max(decay * step),
        }
    }
    best
}

fn names(target: &Target) -> Vec<&'static str> {
    match target {
        Target::Pair(a, b) => vec![a.effect.card().name, b.effect.card().name],
        Target::Hidden(a, _) => vec![a.effect.card().name, NOMINAL],
    }
}

fn why(target: &Target, also: &[&Target], overlap: [f64; 2], data: &Data) -> String {
    let actuators = data.plant.actuators();
    let joints: Vec<String> = actuators.iter().map(|j| j.name.clone()).collect();
    let [now, then] = overlap.map(|o| 100.0 * o);
    let mut text = match target {
        Target::Pair(a, b) => {
            let (a, title) = (a.words(&joints), b.effect.card().title);
            format!(
                "{title} comes near {a}: it could imitate {now:.0} % of it in the records at hand, and {then:.0} % \
                 in the proposed motion"
            )
        }
        Target::Hidden(a, _) => {
            let a = a.words(&joints);
            format!(
                "{a} cannot be seen in the records at hand, where other parameters of the nominal model imitate \
                 {now:.1} % of it; in the proposed motion {then:.0} %"
            )
        }
    };
    let others: Vec<String> = also
        .iter()
        .map(|t| match t {
            Target::Pair(a, _) | Target::Hidden(a, _) => a.words(&joints),
        })
        .collect();
    if !others.is_empty() {
        text += &format!("; it would also show {}", others.join(", "));
    }
    text
}
