//! What can be claimed, and what cannot.

use super::linear::Bed;
use super::problem::{Member, Solved};
use super::search::{Search, Set};
use crate::calibrate::model::Model;
use crate::error::{Result, Warning, WarningKind};

/// Rounds of making linear and searching.
const ROUNDS: usize = 4;
/// From this confidence on an effect is claimed.
pub const CLAIM: f64 = 0.5;
/// Confidence of an effect that does not lower the error of rows held out.
const NOT_HELD: f64 = 0.4;
/// A rival explains the rows as well if the odds against it are below this, natural logarithm.
const AS_WELL: f64 = 3.0;
/// In a gap that is not explained, an effect must explain this part of its share on rows held out, too.
const AGREES: f64 = 0.67;
/// Share of the gap that may be left in a gap that is explained.
const LITTLE: f64 = 0.15;
/// Mean square of a stray row, by that of the gap, up to which it may be a part of it.
const STRAYS: f64 = 9.0;
/// Mean square of residuals of noise that is stated 12 % too small.
const KNOWN: f64 = 1.25;
/// Standard deviations of the mean square from which on it is no accident.
const SURE: f64 = 4.0;

/// A number of an effect.
#[derive(Debug, Clone)]
pub struct Value {
    /// its name
    pub name: String,
    /// value
    pub value: f64,
    /// standard deviation
    pub std: f64,
    /// unit
    pub unit: &'static str,
}

/// An effect that may be missing.
#[derive(Debug, Clone)]
pub struct Finding {
    /// name
    pub effect: &'static str,
    /// joints
    pub joints: Vec<String>,
    /// joint, leg, hinge or group; several where the rows do not tell which
    pub places: Vec<String>,
    /// 0 to 1
    pub confidence: f64,
    /// share of the gap that it explains
    pub explains: f64,
    /// its 95 % interval
    pub interval: [f64; 2],
    /// share of the gap on rows held out
    pub holdout: Option<f64>,
    /// share of the effect that set-up and the other findings cannot imitate
    pub visibility: f64,
    /// its numbers
    pub values: Vec<Value>,
    /// other effects, with their places, that explain the rows as well
    pub rivals: Vec<(&'static str, String)>,
    /// index of its place
    pub(super) place: usize,
}

/// What came out.
#[derive(Debug)]
pub struct Found {
    /// `no_gap`, `explained`, `partly_explained` or `unknown`
    pub verdict: &'static str,
    /// by confidence
    pub findings: Vec<Finding>,
    /// share of the gap that is left
    pub unexplained: f64,
    /// share of the gap on rows held out that is gone
    pub holdout: Option<f64>,
    /// mean square of the whitened residuals without and with the effects, in the stated noise
    pub squares: [f64; 2],
    /// the set
    pub(super) set: Set,
    /// unknowns with it
    pub(super) x: Vec<f64>,
}

/// The best set, its members' confidence, and the verdict.
pub(super) fn found(bed: &mut Bed, stated: bool, warnings: &mut Vec<Warning>) -> Result<Found> {
    bed.x = bed.fitted(&Set::new())?;
    let empty = bed.x.clone();
    let cost_empty = bed.cost(&empty);
    let held_empty = held_out(&bed.model, &empty);
    let mut set = Set::new();
    let mut problem = bed.problem()?;
    for round in 0..ROUNDS {
        let search = Search {
            problem: &problem,
            places: bed.places,
        };
        let new = search.best();
        bed.fit(&new, &problem)?;
        problem = bed.problem()?;
        let same = new.iter().map(|m| m.0).eq(set.iter().map(|m| m.0));
        set = new;
        if same && round > 0 {
            break;
        }
    }
    for _ in 0..ROUNDS {
        let search = Search {
            problem: &problem,
            places: bed.places,
        };
        let Some(other) = search.aside(&set) else {
            break;
        };
        bed.fit(&other, &problem)?;
        problem = bed.problem()?;
        set = other;
    }
    let x = bed.x.clone();
    let cost = bed.cost(&x);
    let search = Search {
        problem: &problem,
        places: bed.places,
    };
    let solved = search.solve(&set);
    let decided = solved.as_ref().map_or(0.0, |s| s.decided);
    let free = |taken: f64| (problem.count as f64 - problem.set_up as f64 - taken).max(1.0);
    let unit = match stated {
        true => bed.model.noise.powi(2),
        false => 1.0,
    };
    // strays that are no larger than the gap are a part of it
    let more = bed.strays(&empty, STRAYS * cost_empty / free(0.0));
    let square = |x: &[f64], cost: f64, taken: f64| {
        let (extra, count) = bed.misfit(&more, x);
        (cost + extra) * unit / (free(taken) + count)
    };
    let squares = [square(&empty, cost_empty, 0.0), square(&x, cost, decided)];
    // the noise that is stated is known to a tenth or so
    let limit = |taken: f64| KNOWN + SURE * (2.0 / free(taken)).sqrt();
    let is_gap = squares[0] > limit(0.0) || !set.is_empty();
    let total = (cost_empty - free(0.0)).max(1e-9);
    let held = held_out(&bed.model, &x);
    let held_gap = held_empty.as_ref().map(|h| (h.mean - 1.0).max(1e-9));
    let left = match squares[1] > limit(decided) {
        true => ((squares[1] - 1.0) / (squares[0] - 1.0).max(1e-9)).clamp(0.0, 1.0),
        false => 0.0,
    };
    let mut findings = Vec::new();
    if let Some(solved) = &solved {
        for k in 0..set.len() {
            let mut f = finding(bed, &search, &set, solved, k, total);
            let mut rest = set.clone();
            rest.remove(k);
            let place = &bed.places[set[k].0];
            // a moved base is in the cameras
            let without = match place.effect {
                "base_pose" if !bed.judged(place) => None,
                "base_pose" => {
                    let (model, x) = bed.unmoved(place, &rest)?;
                    held_out(&model, &x)
                }
                _ => held_out(&bed.model, &bed.fitted(&rest)?),
            };
            let mut helps = true;
            if let (Some(with), Some(gap), Some(without)) = (&held, held_gap, &without) {
                f.holdout = Some(((without.mean - with.mean) / gap).clamp(-1.0, 1.0));
                helps = with.better_than(without);
            }
            // what is left is no noise: fitted rows alone prove nothing, and an effect that is smaller than it may be
            // a part of it
            let enough = if left > LITTLE {
                AGREES * f.explains
            } else {
                0.0
            };
            let small = left > LITTLE && f.explains < left;
            if small || !helps || f.holdout.map_or(left > LITTLE, |h| h <= enough) {
                f.confidence = f.confidence.min(NOT_HELD);
            }
            findings.push(f);
        }
    }
    findings.sort_by(|a, b| {
        let by = b.confidence.total_cmp(&a.confidence);
        by.then(b.explains.total_cmp(&a.explains))
    });
    let claims = findings.iter().filter(|f| f.confidence >= CLAIM).count();
    let verdict = match (is_gap, claims) {
        (false, _) => "no_gap",
        (true, 0) => "unknown",
        _ if left <= LITTLE => "explained",
        _ if left < 1.0 - LITTLE => "partly_explained",
        _ => "unknown",
    };
    if left > 0.0 && !set.is_empty() {
        warnings.push(Warning::new(
            WarningKind::NotIdentifiable,
            "gap",
            "more than the stated noise is left: an effect that the catalogue lacks, or noise larger than stated",
        ));
    }
    let holdout = held
        .zip(held_gap)
        .zip(held_empty)
        .map(|((h, gap), e)| ((e.mean - h.mean) / gap).clamp(-1.0, 1.0));
    Ok(Found {
        verdict,
        findings,
        unexplained: if is_gap { left } else { 0.0 },
        holdout,
        squares,
        set,
        x,
    })
}

/// Rows held out.
struct Held {
    /// mean square of the whitened residuals, by row; not a number of fitted rows and where a posture cannot be taken
    squares: Vec<f64>,
    /// their mean over the lower nine tenths, which strays do not reach
    mean: f64,
}

impl Held {
    /// Whether these rows are nearer than without an effect, and by more than a standard error.
    fn better_than(&self, without: &Held) -> bool {
        let both = self.squares.iter().zip(&without.squares);
        let mut all: Vec<(f64, f64)> = both
            .filter(|(w, o)| w.is_finite() && o.is_finite())
            .map(|(w, o)| (*w, o - w))
            .collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all.truncate((KEPT * all.len() as f64).ceil() as usize);
        let n = (all.len() as f64).max(1.0);
        let mean = all.iter().map(|a| a.1).sum::<f64>() / n;
        let spread = all.iter().map(|a| (a.1 - mean).powi(2)).sum::<f64>() / n;
        mean > (spread / n).sqrt()
    }
}

/// Share of the rows held out that counts: strays do not reach it.
const KEPT: f64 = 0.9;

/// What rows held out leave; `None` of fewer than three.
fn held_out(model: &Model, x: &[f64]) -> Option<Held> {
    let rows = &model.input.rows;
    let square = |i: usize| match model.block(i, x).filter(|_| !rows[i].fit) {
        Some(b) => b.r.norm_squared() / b.r.len() as f64,
        None => f64::NAN,
    };
    let squares: Vec<f64> = (0..rows.len()).map(square).collect();
    let mut kept: Vec<f64> = squares.iter().copied().filter(|s| s.is_finite()).collect();
    kept.sort_by(f64::total_cmp);
    kept.truncate((KEPT * kept.len() as f64).ceil() as usize);
    let n = kept.len() as f64;
    let mean = kept.iter().sum::<f64>() / n;
    (n >= 3.0).then_some(Held { squares, mean })
}

fn finding(
    bed: &Bed,
    search: &Search,
    set: &Set,
    solved: &Solved,
    k: usize,
    total: f64,
) -> Finding {
    let own = set[k].0;
    let place = &bed.places[own];
    let first: usize = set[..k].iter().map(|m| bed.places[m.0].columns.len()).sum();
    let value = |(i, &c): (usize, &usize)| {
        let (name, unit) = bed.name(c);
        Value {
            name,
            value: solved.mean[first + i] * bed.scale(c),
            std: solved.std(first + i) * bed.scale(c),
            unit,
        }
    };
    let best = solved.evidence - search.price(set);
    let mut rest = set.clone();
    rest.remove(k);
    // others in its place, none, and the best explanation without it
    let mut others: Vec<(f64, Vec<usize>)> = (0..bed.places.len())
        .filter(|p| !set.iter().any(|m| m.0 == *p))
        .map(|p| (search.with(&rest, p).0, vec![p]))
        .collect();
    others.push((search.score(&rest), Vec::new()));
    let (score, other) = search.climb(rest.clone(), &[own]);
    let new: Vec<usize> = other
        .iter()
        .map(|m| m.0)
        .filter(|p| !set.iter().any(|m| m.0 == *p))
        .collect();
    if new.len() > 1 {
        others.push((score, new));
    }
    let odds = |score: f64| (score - best).min(30.0).exp();
    let same = |new: &[usize]| {
        !new.is_empty() && new.iter().all(|p| bed.places[*p].effect == place.effect)
    };
    let all: f64 = others.iter().map(|o| odds(o.0)).sum();
    let elsewhere: f64 = others
        .iter()
        .filter(|o| same(&o.1))
        .map(|o| odds(o.0))
        .sum();
    let there = 1.0 / (1.0 + all);
    let anywhere = (1.0 + elsewhere) / (1.0 + all);
    let tied: Vec<usize> = others
        .iter()
        .filter(|o| best - o.0 < AS_WELL)
        .flat_map(|o| o.1.iter().copied())
        .collect();
    let mut joints = place.joints.clone();
    let mut places = vec![place.name.clone()];
    if there < CLAIM && anywhere >= CLAIM {
        for &p in tied
            .iter()
            .filter(|p| bed.places[**p].effect == place.effect)
        {
            if places.contains(&bed.places[p].name) {
                continue;
            }
            joints.extend(bed.places[p].joints.iter().cloned());
            places.push(bed.places[p].name.clone());
        }
    }
    let mut rivals: Vec<(&'static str, String)> = tied
        .iter()
        .map(|p| (bed.places[*p].effect, bed.places[*p].name.clone()))
        .filter(|(e, n)| !(*e == place.effect && places.contains(n)))
        .collect();
    rivals.dedup();
    let members: Vec<Member> = rest
        .iter()
        .map(|m| (bed.places[m.0].columns.as_slice(), m.1))
        .collect();
    let at = solved.mean.rows(first, place.columns.len()).into_owned();
    let energy = search
        .problem
        .beside(&place.columns, &members)
        .map_or(0.0, |m| at.dot(&(m * &at)).max(0.0));
    let alone = search.problem.information(&place.columns);
    let whole = at.dot(&(alone * &at)).max(f64::MIN_POSITIVE);
    let share = |e: f64| (e / total).clamp(0.0, 1.0);
    let root = energy.sqrt();
    Finding {
        effect: place.effect,
        joints,
        places,
        confidence: there.max(anywhere),
        explains: share(energy),
        interval: [
            share((root - 1.96).max(0.0).powi(2)),
            share((root + 1.96).powi(2)),
        ],
        holdout: None,
        visibility: (energy / whole).clamp(0.0, 1.0),
        values: place.columns.iter().enumerate().map(value).collect(),
        rivals,
        place: own,
    }
}
