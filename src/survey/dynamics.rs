//! Joints, signs and units of columns by the torques of the robot's nominal model.

use super::claim::{Claim, Means};
use super::contradict::contradict;
use super::delay::{at_times, delays};
use super::families::{blocks, families};
use super::frame::{Frame, richest};
use super::kinematics::{Fit, Smooth, inherit, unit_factor};
use super::search::{Hypothesis, Match, Problem, Signals};
use super::units::{extent, fits};
use super::verdict::{Orientation, Verdict, explained, orientation};
use crate::dynamics::Workspace;
use crate::error::{Warning, WarningKind};
use crate::plant::Plant;
use crate::robot::Motion;
use crate::signals::butterworth::first_derivative;
use std::f64::consts::PI;

/// Samples at which hypotheses are compared.
const SAMPLES: usize = 240;
/// Cut-off of what is compared, Hz.
const CUTOFF: f64 = 8.0;
/// Roughness by which positions and torques differ where neither is named.
const GAP: f64 = 4.0;

/// Velocity of a joint, of its limit, that it does not reach.
const FAST: f64 = 1.25;
/// Random orders that are tried beside that of the columns.
const STARTS: usize = 120;
/// Least median share of the columns of torques that the best order explains, for it to be believed.
const WHOLE: f64 = 0.85;

/// Gives joints to columns, or confirms those that are stated.
pub(super) fn examine(
    frames: &[Frame],
    claims: &mut [Claim],
    plant: &Plant,
    warnings: &mut Vec<Warning>,
) {
    look(frames, claims, plant, STARTS, warnings);
}

/// Compares what is stated with what differs from it by few steps: swapped joints and turned signs.
pub(super) fn examine_stated(
    frames: &[Frame],
    claims: &mut [Claim],
    plant: &Plant,
    warnings: &mut Vec<Warning>,
) {
    look(frames, claims, plant, 0, warnings);
}

fn look(
    frames: &[Frame],
    claims: &mut [Claim],
    plant: &Plant,
    starts: usize,
    warnings: &mut Vec<Warning>,
) {
    let Some(frame) = richest(frames) else {
        return;
    };
    let n = plant.actuators().len();
    let shared = (0..plant.robot().bodies.len()).any(|b| plant.driver(b).is_none());
    if shared || n == 0 || n > 8 || frame.time.is_none() && frame.rate.is_none() {
        return;
    }
    let smooth = Smooth::new(frame, CUTOFF);
    let moving = |k: usize| !smooth.value[k].is_empty() && Some(k) != frame.time;
    if claims.iter().all(|c| c.means != Means::Position) {
        smoothest(&smooth, claims, n, &moving);
    }
    let positions: Vec<usize> = (0..claims.len())
        .filter(|&k| claims[k].means == Means::Position && claims[k].side != Some("link"))
        .collect();
    let torques: Vec<usize> = (0..claims.len())
        .filter(|&k| {
            let torque = matches!(claims[k].means, Means::Torque | Means::Current);
            moving(k) && (torque || claims[k].free())
        })
        .collect();
    if positions.len() != n || torques.is_empty() {
        return;
    }
    let scales: Vec<f64> = positions
        .iter()
        .map(|&p| scale(frames, &claims[p], p))
        .collect();
    let Some((mut signals, samples)) = signals(frame, &smooth, &positions, &scales, &torques)
    else {
        return;
    };
    let problem = Problem::new(plant, &signals);
    let joints = plant.actuators();
    let ranges: Vec<[f64; 2]> = positions
        .iter()
        .zip(&scales)
        .map(|(&p, s)| extent(frames, p).map(|x| x * s))
        .collect();
    let within = |j: usize, column: usize, sign: f64| {
        let [a, b] = ranges[column].map(|x| x * sign);
        fits(joints[j], a.min(b), a.max(b))
    };
    let allowed = |h: &Hypothesis| (0..n).all(|j| within(j, h.column[j], h.sign[j]));
    // the stated order, or that of the columns
    let stated_all = (0..n).all(|j| positions.iter().any(|&p| claims[p].at == Some(j)));
    let stated = Hypothesis {
        column: (0..n)
            .map(|j| {
                positions
                    .iter()
                    .position(|&p| claims[p].at == Some(j))
                    .filter(|_| stated_all)
                    .unwrap_or(j)
            })
            .collect(),
        sign: vec![1.0; n],
    };
    let mut found = problem.search(&stated, starts, &allowed);
    // an order that nobody stated is within the limits
    if !stated_all {
        found.retain(|(_, h)| allowed(h));
    }
    let Some((_, best)) = found.first() else {
        warnings.push(Warning::new(
            WarningKind::UnitSuspect,
            plant.name(),
            "no order of the columns of positions lies within the joints' limits: another unit, another zero or another \
             robot; the columns were not given to joints",
        ));
        positions
            .iter()
            .for_each(|&p| claims[p].confidence = claims[p].confidence.min(0.4));
        return;
    };
    // an order that explains little is a local optimum or another robot
    let shares = problem.shares(best);
    let middle = crate::median::median(shares.iter().copied());
    if !stated_all && middle < WHOLE {
        warnings.push(Warning::new(
            WarningKind::UnitSuspect,
            plant.name(),
            format!(
                "no order of the columns lets the model explain the torques (at best {:.0} % of their middle column): the \
                 columns were not given to joints",
                100.0 * middle
            ),
        ));
        for &p in &positions {
            claims[p].confidence = claims[p].confidence.min(0.4);
        }
        followers(claims, &positions);
        return;
    }
    // torques that come later than the positions
    let named = |k: &usize| matches!(claims[*k].means, Means::Torque | Means::Current);
    let named = torques.iter().any(named);
    let late: Vec<f64> = match stated_all && named {
        true => vec![0.0; torques.len()],
        false => delays(&problem, best, &smooth, &torques, &samples),
    };
    let shifted = torques.iter().zip(&late);
    let shifted = shifted.map(|(&k, d)| at_times(&smooth.value[k], &samples, d / smooth.step));
    signals.y = shifted.collect();
    let problem = Problem::new(plant, &signals);
    // an order that no joint is too fast for speaks against those that one is
    let fastest: Vec<f64> = signals
        .qd
        .iter()
        .map(|v| v.iter().fold(0.0, |m: f64, x| m.max(x.abs())))
        .collect();
    let slow =
        |h: &Hypothesis| (0..n).all(|j| fastest[h.column[j]] <= FAST * joints[j].limits.velocity);
    let limited = slow(best);
    let rival = |h: &Hypothesis| allowed(h) && (!limited || slow(h));
    let verdict = Verdict::of(&problem, best, &found, &rival, n);
    let trusted = stated_all && claims.iter().any(|c| c.named);
    let mut ws = Workspace::default();
    // columns of torques, once the positions have their joints
    let torques_too =
        |claims: &mut [Claim], of: &Hypothesis, matches: &[Vec<Match>], usual: &[Orientation]| {
            families(
                &smooth, claims, matches, &torques, plant, of, usual, &verdict, &late,
            );
            blocks(claims, plant);
        };
    if trusted {
        let holds = contradict(
            &problem, &stated, best, &verdict, claims, &positions, &torques, plant, warnings,
        );
        // columns of torques without names beside positions that have them
        if holds && !named {
            let usual: Vec<Orientation> = verdict.sign.iter().map(Orientation::stated).collect();
            let matches = problem.matches(&stated, &mut ws);
            torques_too(claims, &stated, &matches, &usual);
        }
        return;
    }
    let matches = problem.matches(best, &mut ws);
    let usual = orientation(best, &verdict, &matches, claims, &positions, &torques);
    for j in 0..n {
        let k = positions[best.column[j]];
        if !verdict.joint[j] || !usual[j].known || !explained(&matches, j, &torques) {
            claims[k].at = None;
            claims[k].joint = None;
            claims[k].confidence = 0.3;
            claims[k]
                .evidence
                .push_str("; which joint the torques do not tell");
            continue;
        }
        claims[k].at = Some(j);
        claims[k].joint = Some(joints[j].name.clone());
        claims[k].sign = usual[j].sign;
        claims[k].scale = scales[best.column[j]];
        if joints[j].motion == Motion::Revolute && (claims[k].scale - PI / 180.0).abs() < 1e-9 {
            claims[k].unit = Some("deg");
        }
        claims[k].confidence = usual[j].confidence;
        claims[k].sign_known = usual[j].told;
        claims[k].evidence.push_str(match usual[j].told {
                true => "; the joint and the sign with which the model explains the torques",
                false => {
                    "; the joint with which the model explains the torques; its sign, and those of all columns of this joint \
                     with it, the torques do not tell"
                }
            });
    }
    followers(claims, &positions);
    torques_too(claims, best, &matches, &usual);
}

/// Where no column is known to be a position: the `n` smoothest, if they stand apart from all others.
fn smoothest(smooth: &Smooth, claims: &mut [Claim], n: usize, moving: &dyn Fn(usize) -> bool) {
    let free: Vec<usize> = (0..claims.len())
        .filter(|&k| claims[k].free() && moving(k))
        .collect();
    // the same position twice: the later one is measured
    let mut twins: Vec<(usize, usize, Fit)> = Vec::new();
    for (i, &a) in free.iter().enumerate() {
        for &b in &free[i + 1..] {
            if let Some(f) = smooth.follows(&smooth.value[a], &smooth.value[b])
                && f.share > 0.995
            {
                twins.push((a, b, f));
            }
        }
    }
    let mut commands: Vec<(usize, usize, Fit)> = Vec::new();
    for (a, b, f) in twins {
        if f.delay.abs() > 0.5 * smooth.step {
            let (first, later) = if f.delay > 0.0 { (a, b) } else { (b, a) };
            commands.push((first, later, f));
        }
    }
    let mut rest: Vec<usize> = free
        .into_iter()
        .filter(|k| !commands.iter().any(|(c, ..)| c == k))
        .collect();
    rest.sort_by(|a, b| smooth.rough[*a].total_cmp(&smooth.rough[*b]));
    // where torques are named, what is left may be the positions alone
    let torque = |c: &&Claim| matches!(c.means, Means::Torque | Means::Current);
    let alone = rest.len() == n && claims.iter().filter(torque).count() == n;
    let apart = rest.len() > n && smooth.rough[rest[n]] >= GAP * smooth.rough[rest[n - 1]];
    if !alone && !apart {
        return;
    }
    for &k in &rest[..n] {
        claims[k].means = Means::Position;
        claims[k].confidence = 0.4;
        claims[k].evidence = match alone {
            true => "it is one of the columns that are left beside the torques",
            false => "it is smoother than all others, as positions are",
        }
        .into();
    }
    for (first, later, f) in commands {
        if rest[..n].contains(&later) {
            let c = &mut claims[first];
            c.means = Means::Command;
            c.commands = Some("position");
            c.of = Some(later);
            let slope = if f.delay > 0.0 {
                1.0 / f.slope
            } else {
                f.slope
            };
            c.sign = slope.signum();
            c.scale = unit_factor(slope).map_or(1.0 / slope.abs(), |(e, _)| 1.0 / e);
            c.confidence = 0.9;
            c.evidence = format!("it is {:.1} ms ahead of a position", 1e3 * f.delay.abs());
        }
    }
}

/// Factor that makes a column of positions rad or m: as claimed, or degrees where it goes beyond a turn.
fn scale(frames: &[Frame], claim: &Claim, k: usize) -> f64 {
    if claim.scale != 1.0 {
        return claim.scale;
    }
    let [low, high] = extent(frames, k);
    match low.abs().max(high.abs()) > 2.2 * PI {
        true => PI / 180.0,
        false => 1.0,
    }
}

/// Signals at samples where something moves, spread over blocks.
fn signals(
    frame: &Frame,
    smooth: &Smooth,
    positions: &[usize],
    scales: &[f64],
    torques: &[usize],
) -> Option<(Signals, Vec<usize>)> {
    let len = positions.iter().map(|&p| smooth.value[p].len()).max()?;
    let get = |k: usize, of: &[Vec<f64>]| match of[k].is_empty() {
        true => vec![0.0; len],
        false => of[k].clone(),
    };
    let qd: Vec<Vec<f64>> = positions.iter().map(|&p| get(p, &smooth.rate)).collect();
    let qdd: Vec<Vec<f64>> = qd
        .iter()
        .map(|v| first_derivative(v, smooth.step))
        .collect();
    let speed = |i: usize| -> f64 { qd.iter().zip(scales).map(|(v, s)| (v[i] * s).abs()).sum() };
    let most = (0..len).map(speed).fold(0.0, f64::max);
    let edge = len / 50;
    let moving: Vec<usize> = (edge..len - edge)
        .filter(|&i| speed(i) > 0.02 * most)
        .collect();
    if moving.len() < SAMPLES / 2 {
        return None;
    }
    let each = moving.len() as f64 / SAMPLES.min(moving.len()) as f64;
    let at: Vec<usize> = (0..SAMPLES.min(moving.len()))
        .map(|i| moving[(i as f64 * each) as usize])
        .collect();
    let pick = |y: &[f64], s: f64| at.iter().map(|&i| y[i] * s).collect::<Vec<f64>>();
    let scaled = |list: &[Vec<f64>]| list.iter().zip(scales).map(|(y, s)| pick(y, *s)).collect();
    let signals = Signals {
        q: positions
            .iter()
            .zip(scales)
            .map(|(&p, s)| match smooth.value[p].is_empty() {
                // a joint that stands still keeps its posture
                true => vec![frame.columns[p].first().map_or(0.0, |x| x * s); at.len()],
                false => pick(&smooth.value[p], *s),
            })
            .collect(),
        qd: scaled(&qd),
        qdd: scaled(&qdd),
        y: torques
            .iter()
            .map(|&k| pick(&smooth.value[k], 1.0))
            .collect(),
    };
    Some((signals, at))
}

/// What derives from positions takes their joint, sign and unit.
fn followers(claims: &mut [Claim], positions: &[usize]) {
    let sets: Vec<(usize, f64, f64)> = positions
        .iter()
        .map(|&p| (p, claims[p].sign, claims[p].scale))
        .collect();
    for k in 0..claims.len() {
        let root = claims[k].of.map(|p| claims[p].of.unwrap_or(p));
        let Some((p, sign, scale)) = root.and_then(|r| sets.iter().find(|(p, ..)| *p == r)) else {
            continue;
        };
        claims[k].sign *= sign;
        claims[k].scale *= scale;
        claims[k].sign_known = claims[*p].sign_known;
        claims[k].at = claims[*p].at;
        claims[k].joint = claims[*p].joint.clone();
        claims[k].confidence = claims[k].confidence.min(claims[*p].confidence);
    }
    inherit(claims);
}
