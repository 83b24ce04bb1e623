//! Units of positions from the limits of the robot's joints.

use super::claim::{Claim, Means};
use super::frame::Frame;
use crate::error::{Warning, WarningKind};
use crate::extremes::extremes;
use crate::log::turns;
use crate::plant::Plant;
use crate::robot::{Joint, Motion};
use std::f64::consts::PI;

/// Part of its range by which a joint may exceed it.
const SLACK: f64 = 0.03;
/// Range of a joint without limits, rad to either side.
const FREE: f64 = 4.0 * PI;

/// Positions beyond this are no radians of a joint that turns about once to either side.
pub(super) const TURN: f64 = 2.5 * PI;

/// Whether positions between `low` and `high` are within the limits of a joint.
pub(super) fn fits(joint: &Joint, low: f64, high: f64) -> bool {
    let [mut a, mut b] = joint.limits.position;
    if joint.motion == Motion::Revolute {
        a = a.max(-FREE);
        b = b.min(FREE);
    }
    let slack = SLACK * (b - a).min(2.0 * FREE);
    low >= a - slack && high <= b + slack
}

/// Least and largest value of a column in all records.
pub(super) fn extent(frames: &[Frame], k: usize) -> [f64; 2] {
    let each = frames.iter().filter_map(|f| f.columns.get(k));
    let each = each.map(|column| extremes(column));
    each.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], [c, d]| {
        [a.min(c), b.max(d)]
    })
}

/// A claim in another unit, which the limits of its joint tell: of a position, a velocity and an acceleration.
fn restate(claim: &mut Claim, factor: f64, units: [&'static str; 3], name: &str) {
    claim.scale *= factor;
    claim.unit = Some(match claim.means {
        Means::Velocity => units[1],
        Means::Acceleration => units[2],
        _ => units[0],
    });
    claim.evidence += &format!("; {name}, by the limits of the joint");
}

/// Tests the claimed positions of each joint; where they fit in degrees and not as they are stated, they are degrees.
pub(super) fn examine(
    frames: &[Frame],
    claims: &mut [Claim],
    plant: &Plant,
    warnings: &mut Vec<Warning>,
) {
    let joints = plant.actuators();
    let columns: Vec<usize> = (0..claims.len())
        .filter(|&k| {
            matches!(claims[k].means, Means::Position | Means::Command) && claims[k].at.is_some()
        })
        .collect();
    let within = |claims: &[Claim], k: usize, more: f64| {
        let [low, high] = extent(frames, k);
        let f = claims[k].factor() * more;
        let joint = claims[k].at.and_then(|j| joints.get(j))?;
        Some(fits(
            joint,
            (low * f).min(high * f),
            (low * f).max(high * f),
        ))
    };
    let moves = |claim: &Claim, motion: Motion| {
        let joint = claim.at.and_then(|j| joints.get(j));
        joint.is_some_and(|j| j.motion == motion)
    };
    let mut far = columns.clone();
    far.retain(|&k| within(claims, k, 1.0) == Some(false));
    // a joint that slides and fits its limits in millimetres
    for &k in &far {
        let slides = moves(&claims[k], Motion::Prismatic);
        if !slides || within(claims, k, 1e-3) != Some(true) {
            continue;
        }
        warnings.push(Warning::new(
            WarningKind::UnitSuspect,
            &claims[k].column,
            format!(
                "as the position of {} in m it is beyond its limits, and within them in mm: it was taken as millimetres",
                claims[k].joint.clone().unwrap_or_default()
            ),
        ));
        let derived = |c: &Claim| c.of == Some(k) && c.means != Means::Command;
        for (_, c) in (claims.iter_mut().enumerate()).filter(|(l, c)| *l == k || derived(c)) {
            restate(c, 1e-3, ["mm", "mm/s", "mm/s^2"], "millimetres");
        }
    }
    far.retain(|&k| within(claims, k, 1.0) == Some(false));
    if far.is_empty() {
        return;
    }
    let turns = |k: &usize| {
        let [low, high] = extent(frames, *k);
        let large = low.abs().max(high.abs()) * claims[*k].scale > TURN;
        moves(&claims[*k], Motion::Revolute) && large
    };
    let all = far.iter().any(turns)
        && columns.iter().all(|&k| {
            within(claims, k, PI / 180.0) == Some(true) || moves(&claims[k], Motion::Prismatic)
        });
    let [low, high] = extent(frames, far[0]);
    if all {
        warnings.push(Warning::new(
            WarningKind::UnitSuspect,
            &claims[far[0]].column,
            format!(
                "it goes from {low:.3} to {high:.3}, beyond the limits of {} in rad and within them in degrees: it and \
                 the other positions were taken as degrees",
                claims[far[0]].joint.clone().unwrap_or_default()
            ),
        ));
        let derived =
            |c: &Claim| c.of.is_some_and(|p| columns.contains(&p)) && c.means != Means::Command;
        for (k, c) in claims.iter_mut().enumerate() {
            if (columns.contains(&k) || derived(c)) && moves(c, Motion::Revolute) {
                restate(c, PI / 180.0, ["deg", "deg/s", "deg/s^2"], "degrees");
            }
        }
        return;
    }
    for k in far {
        let f = claims[k].factor();
        let [low, high] = extent(frames, k).map(|x| x * f);
        let range = [low.min(high), low.max(high)];
        if let Some(j) = claims[k].at.and_then(|j| joints.get(j))
            && turns::to_add(j, range) != 0.0
        {
            warnings.push(Warning::new(
                WarningKind::TurnsCounted,
                &claims[k].column,
                format!(
                    "it goes from {:.3} to {:.3}, beyond the limits of {} and within them in another turn: it is taken so",
                    range[0], range[1], j.name
                ),
            ));
            continue;
        }
        warnings.push(Warning::new(
            WarningKind::UnitSuspect,
            &claims[k].column,
            format!(
                "as the position of {} it goes from {:.3} to {:.3}, beyond the limits of the robot file: another unit, another \
                 zero, another joint, or limits that are narrower than the robot's",
                claims[k].joint.clone().unwrap_or_default(),
                range[0],
                range[1]
            ),
        ));
        // a little beyond is more likely a limit of the file that is not the machine's
        let width = joints[claims[k].at.unwrap_or(0)].limits.position;
        if range[1] - range[0] > 1.5 * (width[1] - width[0]) {
            claims[k].confidence = 0.4;
        }
    }
}
