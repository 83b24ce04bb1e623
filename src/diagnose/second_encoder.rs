//! What a second encoder shows: the deflection `d = q_l − q` between the link and the motor of a joint, both in units of the
//! joint.
//!
//! ```text
//! d = zero (record) + delay q̇ + scale q                       always estimated along
//!   − τ_l / k                                                  joint_elasticity
//!   − (b/2) sgn τ_l                                            backlash
//!   + Σ_n a_n cos(n N q) + b_n sin(n N q),  n = 1, 2            transmission_error, N = gear_ratio
//!   + a cos q + b sin q                                        encoder_eccentricity
//! ```
//!
//! `τ_l` is the torque that the joint transmits, of the bodies beyond it. While it is small the side on which play is
//! closed is not known, and those samples are left out. An effect enters where it predicts blocks of the
//! records that it was not fitted to, by more than chance and by a share that matters, with a sign that a machine can have.
//! The gap in torque plays no part here.

mod gram;

use super::data::Data;
use super::thresholds::THRESHOLDS as T;
use crate::error::{Result, Warning, WarningKind};
use crate::report::format::{percent, significant};
use crate::robot::Motion;
use gram::Blocks;

/// An effect that the deflection of a joint shows.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Seen {
    /// name, as in the catalogue
    pub effect: &'static str,
    /// stiffness, play or amplitude
    pub value: f64,
    /// its standard deviation, by leaving out blocks
    pub std: f64,
    /// its unit
    pub unit: &'static str,
    /// what it takes off the mean square of the deflection, on blocks left out
    pub share: f64,
    /// effects that could stand in its place
    pub same: Vec<&'static str>,
}

/// What the second encoder of one joint shows.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct SecondEncoder {
    /// index of the actuator
    pub index: usize,
    /// its name
    pub joint: String,
    /// rad or m
    pub unit: &'static str,
    /// root mean square of the deflection without zeros, delay and scale
    pub rms: f64,
    /// what the effects leave of it
    pub left: f64,
    /// delay of the second encoder against the first, s, and its standard deviation
    pub delay: [f64; 2],
    /// proportion of the two positions beyond 1, and its standard deviation
    pub scale: [f64; 2],
    /// effects
    pub seen: Vec<Seen>,
    /// what could not be asked, and why
    pub unasked: Vec<String>,
    /// share of the deflection of holdout records that the effects predict; `None` without such a record
    pub holdout: Option<f64>,
    /// transmitted torque, deflection and what the effects leave of it, thinned for a plot
    #[serde(skip)]
    pub points: Vec<[f64; 3]>,
}

/// Columns that stand for one effect.
struct Group {
    effect: &'static str,
    columns: Vec<usize>,
    /// coefficients that a machine has are not negative
    positive: bool,
}

/// Looks at the joints with a second encoder; `phi` are the parameters that the transmitted torque is of.
///
/// # Errors
/// Poses that cannot be reached.
pub fn find(data: &Data, phi: &[f64]) -> Result<Vec<SecondEncoder>> {
    if data.records.iter().all(|r| r.deflection.is_none()) {
        return Ok(Vec::new());
    }
    let torque = data.torque_of(phi, |_, _, _| ())?;
    let all = (0..data.joints()).filter_map(|j| look(data, j, &torque[j]));
    Ok(all.collect())
}

/// Samples of record `k` that are looked at, one in so many.
fn rows(data: &Data, k: usize, j: usize, every: usize) -> Vec<usize> {
    let r = &data.records[k];
    let Some(d) = &r.deflection else {
        return Vec::new();
    };
    let sound = |i: &usize| r.measured[*i] && d[j * r.count + i].is_finite();
    (0..r.count).step_by(every).filter(sound).collect()
}

fn look(data: &Data, j: usize, torque: &[f64]) -> Option<SecondEncoder> {
    let actuators = data.plant.actuators();
    let joint = actuators[j];
    let turns = joint.motion == Motion::Revolute;
    let total: usize = (0..data.records.len())
        .map(|k| rows(data, k, j, 1).len())
        .sum();
    let every = total.div_ceil(T.second.rows).max(1);
    let fitted: Vec<usize> = (0..data.records.len())
        .filter(|k| data.records[*k].fit && !rows(data, *k, j, every).is_empty())
        .collect();
    let power: f64 = fitted
        .iter()
        .flat_map(|k| &torque[data.span(*k)])
        .map(|t| t * t)
        .sum();
    let count: usize = fitted.iter().map(|k| data.records[*k].count).sum();
    let closed = T.second.closed * (power / count.max(1) as f64).sqrt();
    let mut unasked = Vec::new();
    // columns behind the zeros of the records
    let mut names: Vec<(&'static str, usize, bool)> = Vec::new();
    match closed > 0.0 {
        true => names.extend([("joint_elasticity", 1, true), ("backlash", 1, true)]),
        false => {
            unasked.push("the joint carries no torque: its elasticity and play do not show".into())
        }
    }
    let gear = joint.gear_ratio.map(f64::abs).filter(|_| turns);
    match (gear, turns) {
        (Some(_), _) => names.push(("transmission_error", 4, false)),
        (None, true) => unasked.push(
            "errors of the transmission repeat with the turn of the motor: state gear_ratio in robot.toml to have them \
             looked for"
                .into(),
        ),
        (None, false) => (),
    }
    if turns {
        names.push(("encoder_eccentricity", 2, false));
    }
    let zeros = fitted.len();
    let mut groups = Vec::new();
    let mut next = zeros + 2;
    for (effect, width, positive) in &names {
        groups.push(Group {
            effect,
            columns: (next..next + width).collect(),
            positive: *positive,
        });
        next += width;
    }
    let kept = |k: usize| -> Vec<usize> {
        let mut at = rows(data, k, j, every);
        at.retain(|i| torque[data.start[k] + i].abs() >= closed);
        at
    };
    let row = |k: usize, i: usize, zero: Option<usize>| -> Vec<f64> {
        let r = &data.records[k];
        let ((q, v), tau) = (r.state(j), torque[data.start[k] + i]);
        let (q, v) = (q[i], v[i]);
        let mut a = vec![0.0; zeros];
        if let Some(z) = zero {
            a[z] = 1.0;
        }
        a.extend([v, q]);
        if closed > 0.0 {
            a.extend([-tau, -0.5 * tau.signum()]);
        }
        if let Some(gear) = gear {
            let at = gear * q;
            a.extend([at.cos(), at.sin(), (2.0 * at).cos(), (2.0 * at).sin()]);
        }
        if turns {
            a.extend([q.cos(), q.sin()]);
        }
        a
    };
    let deflection = |k: usize, i: usize| {
        let r = &data.records[k];
        r.deflection
            .as_ref()
            .map_or(f64::NAN, |d| d[j * r.count + i])
    };
    let seconds: f64 = fitted
        .iter()
        .map(|k| data.records[*k].count as f64 * data.records[*k].dt)
        .sum();
    // short records are cut finer
    let length = T.second.block.min(0.5 * seconds / T.second.blocks as f64);
    let mut blocks = Blocks::new(next);
    for (z, &k) in fitted.iter().enumerate() {
        let at = kept(k);
        let step = data.records[k].dt * every as f64;
        let long = (length / step).ceil().max(1.0);
        for part in at.chunks(long as usize) {
            let a: Vec<f64> = part.iter().flat_map(|i| row(k, *i, Some(z))).collect();
            let d: Vec<f64> = part.iter().map(|i| deflection(k, *i)).collect();
            blocks.add(&a, &d);
        }
    }
    if blocks.len() < T.second.blocks {
        return None;
    }
    let base: Vec<usize> = (0..zeros + 2).collect();
    let chosen = choose(&blocks, &base, &groups)?;
    let set = joined(&base, &groups, &chosen);
    let (x, std) = blocks.estimate(&set)?;
    let mean = |set: &[usize]| -> Option<f64> {
        let all = blocks.left_out(set)?;
        Some(all.iter().sum::<f64>() / blocks.rows() as f64)
    };
    let (before, after) = (mean(&base)?, mean(&set)?);
    let base_x = blocks.fit(&base, None)?;
    let mut seen = Vec::new();
    for &c in &chosen {
        let others: Vec<usize> = chosen.iter().copied().filter(|o| *o != c).collect();
        let without = joined(&base, &groups, &others);
        let same = groups
            .iter()
            .enumerate()
            .filter(|(o, _)| !chosen.contains(o));
        let same = same.filter(|(o, g)| {
            let mut instead = without.clone();
            instead.extend(&groups[*o].columns);
            let (Some(a), Some(b)) = (blocks.left_out(&set), blocks.left_out(&instead)) else {
                return false;
            };
            possible(&blocks, &instead, g) && over(&b, &a) < T.second.rival
        });
        let at = position(&set, &groups[c]);
        let (value, std, unit) = stated(&groups[c], &x[at.clone()], &std[at], turns);
        seen.push(Seen {
            effect: groups[c].effect,
            value,
            std,
            unit,
            share: (mean(&without)? - after) / before,
            same: same.map(|(_, g)| g.effect).collect(),
        });
    }
    seen.sort_by(|a, b| b.share.total_cmp(&a.share));
    let model = |k: usize, i: usize, of: &[usize], x: &[f64], zero: Option<usize>| -> f64 {
        let a = row(k, i, zero);
        of.iter().zip(x).map(|(c, x)| a[*c] * x).sum()
    };
    let holdout = {
        let [mut nuisance, mut all] = [0.0, 0.0];
        let held = (0..data.records.len()).filter(|k| !data.records[*k].fit);
        for k in held {
            let at = kept(k);
            let rest = |of: &[usize], x: &[f64]| -> f64 {
                let e: Vec<f64> = at
                    .iter()
                    .map(|i| deflection(k, *i) - model(k, *i, of, x, None))
                    .collect();
                let zero = e.iter().sum::<f64>() / e.len().max(1) as f64;
                e.iter().map(|v| (v - zero).powi(2)).sum()
            };
            nuisance += rest(&base, &base_x);
            all += rest(&set, &x);
        }
        (nuisance > 0.0).then(|| 1.0 - all / nuisance)
    };
    let mut points = Vec::new();
    for (z, &k) in fitted.iter().enumerate() {
        let at = kept(k);
        for &i in at
            .iter()
            .step_by((at.len() * zeros).div_ceil(POINTS).max(1))
        {
            let nuisance: f64 = {
                let a = row(k, i, Some(z));
                set.iter()
                    .zip(&x)
                    .take(zeros + 2)
                    .map(|(c, x)| a[*c] * x)
                    .sum()
            };
            points.push([
                torque[data.start[k] + i],
                deflection(k, i) - nuisance,
                deflection(k, i) - model(k, i, &set, &x, Some(z)),
            ]);
        }
    }
    Some(SecondEncoder {
        index: j,
        joint: joint.name.clone(),
        unit: if turns { "rad" } else { "m" },
        rms: before.sqrt(),
        left: after.sqrt(),
        delay: [-x[zeros], std[zeros]],
        scale: [x[zeros + 1], std[zeros + 1]],
        seen,
        unasked,
        holdout,
        points,
    })
}

/// Points of a plot.
const POINTS: usize = 1200;

/// Mean of the differences `a − b` over their standard error.
fn over(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len() as f64;
    let each = || a.iter().zip(b).map(|(a, b)| a - b);
    let mean = each().sum::<f64>() / n;
    let variance = each().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0);
    mean / (variance / n).sqrt().max(1e-300)
}

fn joined(base: &[usize], groups: &[Group], chosen: &[usize]) -> Vec<usize> {
    let more = chosen.iter().flat_map(|c| groups[*c].columns.iter());
    base.iter().chain(more).copied().collect()
}

/// Where the columns of a group stand in a set.
fn position(set: &[usize], group: &Group) -> std::ops::Range<usize> {
    let first = set.iter().position(|c| *c == group.columns[0]).unwrap_or(0);
    first..first + group.columns.len()
}

/// Whether a machine can have the coefficients of a group that is part of a set.
fn possible(blocks: &Blocks, set: &[usize], group: &Group) -> bool {
    let at = position(set, group);
    let fits = |x: Vec<f64>| !group.positive || x[at].iter().all(|v| *v > 0.0);
    blocks.fit(set, None).is_some_and(fits)
}

/// Groups that enter, in that order; `None` where not even the zeros can be told.
fn choose(blocks: &Blocks, base: &[usize], groups: &[Group]) -> Option<Vec<usize>> {
    let start: f64 = blocks.left_out(base)?.iter().sum();
    let mut chosen: Vec<usize> = Vec::new();
    loop {
        let set = joined(base, groups, &chosen);
        let now = blocks.left_out(&set)?;
        let mut best: Option<(f64, usize)> = None;
        for (c, group) in groups
            .iter()
            .enumerate()
            .filter(|(c, _)| !chosen.contains(c))
        {
            let mut with = set.clone();
            with.extend(&group.columns);
            let Some(then) = blocks.left_out(&with) else {
                continue;
            };
            let gain = now.iter().sum::<f64>() - then.iter().sum::<f64>();
            let enough = gain > T.second.share * start && over(&now, &then) > T.second.gain;
            // what was chosen before must stay what a machine can have
            let sound = chosen
                .iter()
                .chain([&c])
                .all(|k| possible(blocks, &with, &groups[*k]));
            if enough && sound && best.is_none_or(|(g, _)| gain > g) {
                best = Some((gain, c));
            }
        }
        match best {
            Some((_, c)) => chosen.push(c),
            None => break,
        }
    }
    // what the later ones have made needless goes
    let mut k = 0;
    while k < chosen.len() {
        let others: Vec<usize> = chosen.iter().copied().filter(|o| *o != chosen[k]).collect();
        let with = blocks.left_out(&joined(base, groups, &chosen))?;
        let without = blocks.left_out(&joined(base, groups, &others))?;
        let gain = without.iter().sum::<f64>() - with.iter().sum::<f64>();
        match gain > T.second.share * start && over(&without, &with) > T.second.gain {
            true => k += 1,
            false => chosen = others,
        }
    }
    Some(chosen)
}

/// The number of an effect, its standard deviation and unit.
fn stated(group: &Group, x: &[f64], std: &[f64], turns: bool) -> (f64, f64, &'static str) {
    if group.effect == "joint_elasticity" {
        let unit = if turns { "N m/rad" } else { "N/m" };
        return (1.0 / x[0], std[0] / (x[0] * x[0]), unit);
    }
    let unit = if turns { "rad" } else { "m" };
    let size = x.iter().map(|v| v * v).sum::<f64>().sqrt();
    let along: f64 = x.iter().zip(std).map(|(x, s)| (x * s).powi(2)).sum();
    (size, along.sqrt() / size.max(1e-300), unit)
}

/// Effects of the catalogue that a second encoder sees at its joint.
const DIRECT: [&str; 3] = ["joint_elasticity", "backlash", "transmission_error"];

/// Where a second encoder contradicts what the torques were taken for, and where its scale is doubtful. `claims` are
/// effects and the actuators that they name.
pub fn warnings(all: &[SecondEncoder], claims: &[(&'static str, Vec<String>)]) -> Vec<Warning> {
    let mut out = Vec::new();
    for s in all {
        let [scale, std] = s.scale;
        if scale.abs() > T.second.scale && scale.abs() > T.second.gain * std {
            out.push(Warning::new(
                WarningKind::LogSuspect,
                s.joint.clone(),
                format!(
                    "ql and q are not in proportion 1 but {}: check the gear of ql in [record.columns]",
                    significant(1.0 + scale, 5)
                ),
            ));
        }
        for (effect, joints) in claims {
            let sees = s
                .seen
                .iter()
                .any(|e| e.effect == *effect || e.same.contains(effect));
            let could = s.unasked.is_empty() || *effect != "transmission_error";
            if DIRECT.contains(effect) && joints.contains(&s.joint) && could && !sees {
                out.push(Warning::new(
                    WarningKind::LogSuspect,
                    s.joint.clone(),
                    format!(
                        "the torques look like {}, but the second encoder of this joint does not show it (what it shows: \
                         {}); do not rely on that name",
                        effect.replace('_', " "),
                        words(s)
                    ),
                ));
            }
        }
    }
    out
}

/// What one joint shows, in words.
pub fn words(s: &SecondEncoder) -> String {
    if s.seen.is_empty() {
        return format!(
            "a deflection of {} {} rms that no effect predicts",
            significant(s.rms, 2),
            s.unit
        );
    }
    let one = |e: &Seen| {
        let or = match e.same.is_empty() {
            true => String::new(),
            false => format!(" or {}", e.same.join(" or ").replace('_', " ")),
        };
        format!(
            "{}{or}, {} of the deflection",
            e.effect.replace('_', " "),
            percent(e.share)
        )
    };
    s.seen.iter().map(one).collect::<Vec<_>>().join("; ")
}
