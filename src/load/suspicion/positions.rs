//! Positions of the drives: millimetres, degrees, lengths of legs instead of strokes, turned signs.

use crate::error::{Error, Result};
use crate::extremes::extremes;
use crate::log::Record;
use crate::mechanism::dimensions::Dimensions;
use crate::plant::Plant;
use crate::robot::{Joint, Motion};
use std::f64::consts::PI;

/// Part of its range by which an actuator may be beyond a limit before its unit is doubted.
const SLACK: f64 = 0.5;

/// How a position may be meant otherwise: a factor and a constant for every actuator, and words.
struct Reading {
    factor: f64,
    added: Vec<f64>,
    says: &'static str,
    remedy: &'static str,
}

/// Compares the positions with the limits of the actuators.
///
/// # Errors
/// Positions that lie far beyond the limits and within them if they are read otherwise.
pub fn check(record: &Record, plant: &Plant) -> Result<()> {
    let joints = plant.actuators();
    let n = joints.len();
    if record.q.len() != n || joints.iter().any(|j| !bounded(j)) {
        return Ok(());
    }
    let ranges: Vec<[f64; 2]> = record.q.iter().map(|q| extremes(q)).collect();
    let beyond: Vec<usize> = (0..n).filter(|&j| !fits(joints[j], ranges[j])).collect();
    let Some(&first) = beyond.first() else {
        return Ok(());
    };
    let linear = joints.iter().all(|j| j.motion == Motion::Prismatic);
    let mut readings = Vec::new();
    if let Some(Dimensions::Legs(legs)) = plant.dimensions() {
        let zero: Vec<f64> = legs.iter().map(|l| -l.zero).collect();
        readings.push(Reading {
            factor: 1.0,
            added: zero.clone(),
            says: "lengths of the legs, not strokes",
            remedy: "subtract the length at zero of the robot file (`zero`), or state zero = 0 and limits of the length there",
        });
        readings.push(Reading {
            factor: 1e-3,
            added: zero,
            says: "lengths of the legs in millimetres",
            remedy: "write strokes in m, from the length at zero of the robot file (`zero`) on",
        });
    }
    let (factor, says, remedy) = match linear {
        true => (
            1e-3,
            "millimetres",
            "state unit = \"mm\" for q in [record.columns], or write them in m",
        ),
        false => (
            PI / 180.0,
            "degrees",
            "state unit = \"deg\" for q in [record.columns]",
        ),
    };
    readings.push(Reading {
        factor,
        added: vec![0.0; n],
        says,
        remedy,
    });
    let [low, high] = joints[first].limits.position;
    let [a, b] = ranges[first];
    let stated = format!(
        "{} reads {a:.4} to {b:.4}, its limits are [{low}, {high}]",
        joints[first].name
    );
    let turned: Vec<&str> = beyond
        .iter()
        .filter(|&&j| ranges[j][1] <= 0.0 && fits(joints[j], [-ranges[j][1], -ranges[j][0]]))
        .map(|&j| joints[j].name.as_str())
        .collect();
    if turned.len() == beyond.len() {
        let message = format!(
            "the positions of {} have the wrong sign: {stated}, and it fits with the other sign; state sign = -1 for q in \
             [record.columns]",
            turned.join(", ")
        );
        return Err(Error::file(&record.path, "", message));
    }
    for r in &readings {
        let all = (0..n).all(|j| {
            let read = ranges[j].map(|x| r.factor * x + r.added[j]);
            fits(joints[j], read) && moves(joints[j], read)
        });
        if all {
            let message = format!(
                "the positions are {}: {stated}, and all {n} drives fit theirs if they are read so; {}",
                r.says, r.remedy
            );
            return Err(Error::file(&record.path, "", message));
        }
    }
    Ok(())
}

fn bounded(joint: &Joint) -> bool {
    joint.limits.position.iter().all(|x| x.is_finite())
}

/// Whether a range is within the limits of an actuator, but for [`SLACK`].
fn fits(joint: &Joint, [a, b]: [f64; 2]) -> bool {
    let [low, high] = joint.limits.position;
    let slack = SLACK * (high - low);
    a >= low - slack && b <= high + slack
}

/// Whether a range is a motion that such an actuator makes, and not a unit that is read too small.
fn moves(joint: &Joint, [a, b]: [f64; 2]) -> bool {
    /// Least part of its limits that an actuator uses in a motion for a load.
    const USED: f64 = 0.01;
    let [low, high] = joint.limits.position;
    b - a >= USED * (high - low)
}
