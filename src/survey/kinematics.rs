//! Kinematics among columns: a velocity is the derivative of a position, an acceleration that of a velocity, a command
//! is a position ahead of the measured one.
//!
//! Both columns pass the same zero-phase low-pass; the one is regressed on the derivative of the other over lags of up to
//! [`LAG`]. The share that is explained says whether they belong together, the slope gives unit and sign, the best lag
//! the delay.

use super::claim::{Claim, Means};
use super::frame::{Frame, richest};
use super::search::spread;
use super::units::{TURN, extent};
use crate::error::{Warning, WarningKind};
use crate::signals::Butterworth;
use crate::signals::butterworth::first_derivative;
use std::f64::consts::PI;

/// Longest delay between columns of one recorder, s.
const LAG: f64 = 0.06;
/// Share that must be explained for two unnamed columns to belong together.
const SURE: f64 = 0.97;
/// … and for a pair that names say belongs together.
const LIKELY: f64 = 0.8;
/// Samples that are looked at.
const SAMPLES: usize = 6000;
/// Share explained of one position by another of the same joint: a command or a second encoder.
const TWIN: f64 = 0.995;

/// Columns low-passed and thinned.
pub(super) struct Smooth {
    /// step, s
    pub step: f64,
    /// values of each column; empty where it is constant
    pub value: Vec<Vec<f64>>,
    /// their derivatives
    pub rate: Vec<Vec<f64>>,
    /// share of each column's changes that is faster than the low-pass
    pub rough: Vec<f64>,
    /// size of each column's second differences, of its spread: noise of what was measured
    pub grain: Vec<f64>,
}

/// Size of a column's second differences, of its spread; 0 where it is constant. The median: jumps of friction are no noise.
pub(super) fn grain(y: &[f64]) -> f64 {
    match spread(y) {
        whole if whole > 0.0 => grain_of(y, whole),
        _ => 0.0,
    }
}

/// The same where the squares about the mean are known.
fn grain_of(y: &[f64], whole: f64) -> f64 {
    let bends = y.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs());
    crate::median::median(bends) / (whole / y.len() as f64).sqrt()
}

/// How a column follows another.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fit {
    /// share explained
    pub share: f64,
    /// slope
    pub slope: f64,
    /// how much later it comes, s
    pub delay: f64,
    /// whether that is the first or the last lag that was tried: the best one may lie beyond
    pub at_end: bool,
}

impl Smooth {
    pub fn new(frame: &Frame, cutoff: f64) -> Self {
        let rate = 1.0 / frame.step;
        let fc = cutoff.min(0.12 * rate);
        let each = (frame.len() / SAMPLES)
            .max(1)
            .min(((rate / (8.0 * fc)) as usize).max(1));
        let filter = Butterworth::low_pass(4, fc, rate).ok();
        let mut out = Smooth {
            step: frame.step * each as f64,
            value: Vec::new(),
            rate: Vec::new(),
            rough: Vec::new(),
            grain: Vec::new(),
        };
        for y in &frame.columns {
            let whole = spread(y);
            if !(whole > 0.0) || !whole.is_finite() {
                out.value.push(Vec::new());
                out.rate.push(Vec::new());
                out.rough.push(0.0);
                out.grain.push(0.0);
                continue;
            }
            let low = match &filter {
                Some(f) => f.zero_phase(y, (3.0 * rate / fc) as usize),
                None => y.clone(),
            };
            let rest: Vec<f64> = y.iter().zip(&low).map(|(a, b)| a - b).collect();
            out.rough.push((spread(&rest) / whole).sqrt());
            out.grain.push(grain_of(y, whole));
            let slope = first_derivative(&low, frame.step);
            out.value.push(low.into_iter().step_by(each).collect());
            out.rate.push(slope.into_iter().step_by(each).collect());
        }
        out
    }

    /// How `y` follows `x`, apart from constants, over lags of up to [`LAG`].
    pub fn follows(&self, x: &[f64], y: &[f64]) -> Option<Fit> {
        let n = x.len();
        if n < 50 || y.len() != n {
            return None;
        }
        let most = ((LAG / self.step).ceil() as usize).clamp(1, n / 8);
        let score = |lag: i64| {
            // y(i + lag) against x(i), the ends left out
            let (mut sx, mut sy, mut sxx, mut sxy, mut syy, mut m) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
            for i in most..n - most {
                let (a, b) = (x[i], y[(i as i64 + lag) as usize]);
                sx += a;
                sy += b;
                sxx += a * a;
                sxy += a * b;
                syy += b * b;
                m += 1.0;
            }
            let (xx, xy, yy) = (sxx - sx * sx / m, sxy - sx * sy / m, syy - sy * sy / m);
            match xx > 0.0 && yy > 0.0 {
                true => (xy * xy / (xx * yy), xy / xx),
                false => (0.0, 0.0),
            }
        };
        // nothing that a delay could mend
        if score(0).0 < 0.3 {
            return None;
        }
        let all: Vec<(f64, f64)> = (-(most as i64)..=most as i64).map(score).collect();
        let best = (0..all.len()).max_by(|a, b| all[*a].0.total_cmp(&all[*b].0))?;
        let mut delay = best as f64 - most as f64;
        let at_end = best == 0 || best + 1 == all.len();
        if !at_end {
            let (a, b, c) = (all[best - 1].0, all[best].0, all[best + 1].0);
            let bend = a - 2.0 * b + c;
            if bend < 0.0 {
                delay += (0.5 * (a - c) / bend).clamp(-0.5, 0.5);
            }
        }
        Some(Fit {
            share: all[best].0,
            slope: all[best].1,
            delay: delay * self.step,
            at_end,
        })
    }
}

/// A factor by which units of velocity differ, near enough.
pub(super) fn unit_factor(k: f64) -> Option<(f64, &'static str)> {
    [
        (1.0, ""),
        (180.0 / PI, "deg"),
        (PI / 180.0, "rad"),
        (60.0 / (2.0 * PI), "rpm"),
        (1e3, "m"),
        (1e-3, "k"),
        (0.5 / PI, "rev"),
    ]
    .into_iter()
    .find(|(f, _)| (k.abs() / f - 1.0).abs() < 0.05)
}

/// Tests named pairs and finds unnamed ones, in the record with most motion.
pub(super) fn examine(
    frames: &[Frame],
    claims: &mut [Claim],
    robot: bool,
    warnings: &mut Vec<Warning>,
) {
    let Some(frame) = richest(frames) else {
        return;
    };
    let smooth = Smooth::new(frame, 15.0);
    let moving = |k: usize| !smooth.value[k].is_empty() && Some(k) != frame.time;
    named_pairs(&smooth, claims, &moving, warnings);
    positions_of_named(&smooth, claims, &moving);
    unnamed_pairs(&smooth, claims, &moving);
    commands(&smooth, claims, &moving);
    match robot {
        true => inherit(claims),
        false => number(claims),
    }
}

/// How far the samples a second of one joint may lie beside those of the others, and beside a whole number.
const PACE: [f64; 2] = [0.02, 3e-3];
/// Samples a second that a log has.
const RATES: std::ops::RangeInclusive<f64> = 5.0..=2e4;

/// Samples a second with which named velocities are the derivatives of named positions, where no column is a time.
pub(super) fn rate(frames: &[Frame], claims: &[Claim]) -> Option<f64> {
    let frame = richest(frames).filter(|f| f.time.is_none())?;
    // degrees beside rad/s would tell another rate
    let turns = |(k, c): (usize, &Claim)| {
        let [low, high] = extent(frames, k).map(|x| x * c.scale);
        c.means == Means::Position && low.abs().max(high.abs()) > TURN
    };
    if claims.iter().enumerate().any(turns) {
        return None;
    }
    let smooth = Smooth::new(frame, 15.0);
    let named = |means: Means| {
        let all = claims.iter().enumerate();
        all.filter(move |(_, c)| c.means == means && c.side != Some("link") && c.at.is_some())
    };
    let slopes: Vec<f64> = named(Means::Velocity)
        .filter_map(|(v, c)| {
            let (p, own) = named(Means::Position).find(|(_, o)| o.at == c.at)?;
            let f = smooth.follows(&smooth.rate[p], &smooth.value[v])?;
            let slope = f.slope * c.factor() / own.factor();
            (f.share > SURE && slope > 0.0).then_some(slope)
        })
        .collect();
    let middle = crate::median::median(slopes.iter().copied());
    let close = |x: &f64| (x / middle - 1.0).abs() < PACE[0];
    let agreed = slopes.len() > 1 && slopes.iter().all(close) && RATES.contains(&middle);
    let whole = middle.round();
    agreed.then_some(match (middle / whole - 1.0).abs() < PACE[1] {
        true => whole,
        false => middle,
    })
}

/// Velocities, accelerations and commands whose names say to which positions they belong.
fn named_pairs(
    smooth: &Smooth,
    claims: &mut [Claim],
    moving: &dyn Fn(usize) -> bool,
    warnings: &mut Vec<Warning>,
) {
    let positions: Vec<usize> = (0..claims.len())
        .filter(|&k| {
            claims[k].means == Means::Position && claims[k].side != Some("link") && moving(k)
        })
        .collect();
    for k in 0..claims.len() {
        if !matches!(claims[k].means, Means::Velocity | Means::Command)
            || claims[k].at.is_none()
            || !moving(k)
        {
            continue;
        }
        let velocity = claims[k].means == Means::Velocity;
        let fit = |p: usize| {
            let x = if velocity {
                &smooth.rate[p]
            } else {
                &smooth.value[p]
            };
            smooth.follows(x, &smooth.value[k])
        };
        let Some(own) = positions
            .iter()
            .copied()
            .find(|&p| claims[p].at == claims[k].at)
        else {
            continue;
        };
        let found = fit(own);
        let share = found.map_or(0.0, |f| f.share);
        let better = positions
            .iter()
            .copied()
            .filter(|&p| p != own)
            .filter_map(|p| Some((p, fit(p)?)))
            .max_by(|a, b| a.1.share.total_cmp(&b.1.share))
            .filter(|(_, f)| f.share > SURE && f.share > share + 0.2);
        if let Some((other, f)) = better {
            let (a, b) = (claims[k].column.clone(), claims[other].column.clone());
            warnings.push(Warning::new(
                WarningKind::UnitSuspect,
                &a,
                format!(
                    "its name says that it belongs to {}, but it follows column {b} ({:.1} % of it; {:.1} % of {})",
                    claims[own].column,
                    100.0 * f.share,
                    100.0 * share,
                    claims[own].column
                ),
            ));
            claims[k].abstain("its name and its numbers contradict each other");
            continue;
        }
        claims[k].of = Some(own);
        let Some(f) = found.filter(|f| f.share > LIKELY) else {
            continue;
        };
        // the factor between the claimed units: one where they agree
        let factor = f.slope * claims[k].factor() / claims[own].factor();
        // by how much a command is ahead is the controller's doing, and nothing to be taken out
        let mut lag = String::new();
        match velocity {
            true => claims[k].delay = delay(&f, smooth.step),
            false if f.delay < -0.5 * smooth.step => lag = ahead(&f),
            false => {}
        }
        if (factor - 1.0).abs() < 0.1 {
            if f.share > 0.95 {
                for c in [k, own] {
                    claims[c].confidence = claims[c].confidence.max(0.97);
                }
                claims[k].evidence = format!(
                    "its name; {:.1} % of it is {} {}{lag}",
                    100.0 * f.share,
                    if velocity {
                        "the derivative of"
                    } else {
                        "that of"
                    },
                    claims[own].column
                );
            }
            continue;
        }
        let text = format!(
            "it is {:.4} times {} {}: {}",
            factor,
            if velocity {
                "the derivative of"
            } else {
                "the value of"
            },
            claims[own].column,
            match (factor < 0.0, unit_factor(factor)) {
                (true, Some((_, ""))) => "it counts the other way round".to_string(),
                (_, Some((_, unit))) if !unit.is_empty() => "its unit is another".to_string(),
                _ => "its unit is another, or one of both is filtered or scaled".to_string(),
            }
        );
        warnings.push(Warning::new(
            WarningKind::UnitSuspect,
            &claims[k].column,
            text,
        ));
        let c = &mut claims[k];
        let total = c.factor() / factor;
        c.sign = total.signum();
        c.scale = total.abs();
        c.unit = None;
        c.confidence = if unit_factor(factor).is_some() {
            0.9
        } else {
            0.6
        };
        c.evidence = "its name; sign and unit from the positions".into();
    }
}

/// Positions without names, of velocities whose names say of which joint they are.
fn positions_of_named(smooth: &Smooth, claims: &mut [Claim], moving: &dyn Fn(usize) -> bool) {
    for v in 0..claims.len() {
        let (Means::Velocity, Some(joint)) = (claims[v].means, claims[v].at) else {
            continue;
        };
        let known = |c: &Claim| c.means == Means::Position && c.at == Some(joint);
        if !moving(v) || claims.iter().any(known) {
            continue;
        }
        let free = (0..claims.len()).filter(|&k| claims[k].free() && moving(k));
        let mut fits: Vec<(usize, Fit)> = free
            .filter_map(|p| Some((p, smooth.follows(&smooth.rate[p], &smooth.value[v])?)))
            .filter(|(_, f)| f.share > SURE)
            .collect();
        fits.sort_by(|a, b| b.1.share.total_cmp(&a.1.share));
        let Some(&(first, f)) = fits.first() else {
            continue;
        };
        // a command is the same position once more, ahead of it or without its noise; anything else is a rival
        let (mut own, mut other) = ((first, f), false);
        for &(k, fit) in &fits[1..] {
            let twin = smooth.follows(&smooth.value[own.0], &smooth.value[k]);
            match twin.filter(|t| t.share > TWIN) {
                Some(t) => {
                    let later = t.delay > 0.5 * smooth.step;
                    let level = t.delay.abs() <= 0.5 * smooth.step;
                    if later || level && smooth.rough[k] > smooth.rough[own.0] {
                        own = (k, fit);
                    }
                }
                None => other |= !clearly(f.share, fit.share),
            }
        }
        if other {
            continue;
        }
        let (p, f) = own;
        let factor = f.slope * claims[v].factor();
        let exact = unit_factor(factor).map(|(exact, _)| exact);
        let joint = claims[v].joint.clone();
        let evidence = format!(
            "{}, which is named, is {:.2} % its derivative",
            claims[v].column,
            100.0 * f.share
        );
        claims[v].of = Some(p);
        claims[v].delay = delay(&f, smooth.step);
        let at = claims[v].at;
        let c = &mut claims[p];
        (c.means, c.at, c.joint) = (Means::Position, at, joint);
        (c.sign, c.scale) = (factor.signum(), exact.unwrap_or(factor.abs()));
        c.confidence = if exact.is_some() { 0.9 } else { 0.6 };
        c.evidence = evidence;
    }
}

/// Whether a share explained is beyond that of a rival.
fn clearly(share: f64, rival: f64) -> bool {
    share - rival >= 0.25 * (1.0 - share).max(1e-4)
}

/// A delay that is told from none: more than a quarter of a step, and not beyond the lags that were tried.
fn delay(f: &Fit, step: f64) -> f64 {
    match f.delay.abs() > 0.25 * step && !f.at_end {
        true => f.delay,
        false => 0.0,
    }
}

/// By how much a command is ahead, in words.
fn ahead(f: &Fit) -> String {
    let more = if f.at_end { " or more" } else { "" };
    format!(", {:.1} ms{more} ahead", -1e3 * f.delay)
}

/// Positions and velocities that have no names: pairs that are best for each other.
fn unnamed_pairs(smooth: &Smooth, claims: &mut [Claim], moving: &dyn Fn(usize) -> bool) {
    let free: Vec<usize> = (0..claims.len())
        .filter(|&k| claims[k].free() && moving(k))
        .collect();
    let positions: Vec<usize> = (0..claims.len())
        .filter(|&k| claims[k].means == Means::Position && moving(k))
        .chain(free.iter().copied())
        .collect();
    let mut fits: Vec<(usize, usize, Fit)> = Vec::new();
    for &p in &positions {
        for &v in &free {
            if p == v {
                continue;
            }
            if let Some(f) = smooth.follows(&smooth.rate[p], &smooth.value[v])
                && f.share > SURE
            {
                fits.push((p, v, f));
            }
        }
    }
    // what derives from a position that is named before what derives from anything else
    let named = |f: &(usize, usize, Fit)| claims[f.0].named && claims[f.0].means == Means::Position;
    fits.sort_by(|a, b| {
        let order = named(b).cmp(&named(a));
        order.then(b.2.share.total_cmp(&a.2.share))
    });
    let mut used: Vec<usize> = Vec::new();
    let mut roots: Vec<usize> = Vec::new();
    let mut slopes: Vec<(usize, usize, f64)> = Vec::new();
    for (p, v, f) in fits.clone() {
        // a velocity has one position; what is itself a velocity has accelerations
        let root = claims[p].means == Means::Position && claims[p].of.is_none();
        if used.contains(&v) || claims[p].of == Some(v) || roots.contains(&v) && root {
            continue;
        }
        let rival = fits
            .iter()
            .filter(|(a, b, _)| *b == v && *a != p)
            .map(|(_, _, f)| f.share)
            .fold(0.0, f64::max);
        if !clearly(f.share, rival) {
            continue;
        }
        used.push(v);
        roots.push(p);
        claims[v].of = Some(p);
        claims[v].delay = delay(&f, smooth.step);
        claims[v].confidence = match unit_factor(f.slope) {
            Some(_) => 0.9,
            None => 0.7,
        };
        slopes.push((p, v, f.slope));
        claims[v].evidence = format!(
            "{:.2} % of it is the derivative of {}",
            100.0 * f.share,
            claims[p].column
        );
    }
    // sign and unit from those of what they derive from: velocities before accelerations
    slopes.sort_by_key(|(p, ..)| used.contains(p));
    for (p, v, slope) in slopes {
        like(claims, p, v, slope);
    }
    // what derives from something is a velocity, what derives from a velocity an acceleration
    for &v in &used {
        let Some(p) = claims[v].of else { continue };
        let second =
            claims[p].of.is_some_and(|root| claims[root].of.is_none()) && used.contains(&p);
        // a torque that is mostly inertia goes with an acceleration, too, but in no unit of one
        if second && claims[v].confidence < 0.9 {
            claims[v].abstain("it goes with an acceleration, but in no unit of one");
            continue;
        }
        claims[v].means = if second {
            Means::Acceleration
        } else {
            Means::Velocity
        };
        if !used.contains(&p) && claims[p].means == Means::Other {
            claims[p].means = Means::Position;
            claims[p].confidence = claims[v].confidence;
            claims[p].evidence = format!("{} is its derivative", claims[v].column);
        }
    }
}

/// Gives a column that is `slope` times what column `p` says, or its derivative, the sign and unit that follow.
fn like(claims: &mut [Claim], p: usize, k: usize, slope: f64) {
    let each = unit_factor(slope).map_or(1.0 / slope.abs(), |(exact, _)| 1.0 / exact);
    claims[k].sign = slope.signum() * claims[p].sign;
    claims[k].scale = each * claims[p].scale;
}

/// Unnamed columns that are a position of a joint once more: the command, where it is ahead.
fn commands(smooth: &Smooth, claims: &mut [Claim], moving: &dyn Fn(usize) -> bool) {
    let positions: Vec<usize> = (0..claims.len())
        .filter(|&k| claims[k].means == Means::Position && moving(k))
        .collect();
    let free: Vec<usize> = (0..claims.len())
        .filter(|&k| claims[k].free() && moving(k))
        .collect();
    for k in free {
        let best = positions
            .iter()
            .filter_map(|&p| Some((p, smooth.follows(&smooth.value[p], &smooth.value[k])?)))
            .max_by(|a, b| a.1.share.total_cmp(&b.1.share));
        let Some((p, f)) = best.filter(|(_, f)| f.share > TWIN) else {
            continue;
        };
        let leads = f.delay < -0.5 * smooth.step;
        let cleaner = smooth.rough[k] < 0.7 * smooth.rough[p];
        if leads || cleaner {
            claims[k].means = Means::Command;
            claims[k].commands = Some("position");
            claims[k].of = Some(p);
            like(claims, p, k, f.slope);
            claims[k].confidence = if leads { 0.9 } else { 0.6 };
            claims[k].evidence = format!(
                "{:.2} % of it is {}{}",
                100.0 * f.share,
                claims[p].column,
                if leads { ahead(&f) } else { String::new() }
            );
        }
    }
}

/// Joints for pairs that have none yet, where none are named: in the order of their columns.
fn number(claims: &mut [Claim]) {
    let named = claims.iter().any(|c| c.at.is_some());
    let roots: Vec<usize> = (0..claims.len())
        .filter(|&k| claims[k].means == Means::Position && claims[k].at.is_none())
        .collect();
    if named {
        return inherit(claims);
    }
    for (j, p) in roots.into_iter().enumerate() {
        claims[p].at = Some(j);
        claims[p].joint = Some(format!("joint {}", j + 1));
    }
    inherit(claims);
}

/// What derives from a position is of its joint, in its unit and sign.
pub(super) fn inherit(claims: &mut [Claim]) {
    for _ in 0..2 {
        for k in 0..claims.len() {
            if let Some(p) = claims[k].of
                && claims[k].at.is_none()
            {
                claims[k].at = claims[p].at;
                claims[k].joint = claims[p].joint.clone();
            }
        }
    }
}
