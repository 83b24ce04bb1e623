//! Before a model is identified: do positions and torques fit the robot as they are stated?

use super::claim::{Claim, Means};
use super::dynamics;
use super::frame::Frame;
use super::units::{TURN, fits};
use crate::error::{Error, Result, Warning};
use crate::extremes::extremes;
use crate::log::{Purpose, Record};
use crate::plant::Plant;
use crate::robot::Motion;
use std::f64::consts::PI;

/// Looks at the longest record of `records` that is fitted and carries nothing: positions in degrees are an error;
/// joints that are swapped, and turned signs, are warnings with the evidence.
///
/// # Errors
/// Positions that are degrees by the limits of the joints, with the remedy.
pub fn check(plant: &Plant, records: &[Record]) -> Result<Vec<Warning>> {
    let joints = plant.actuators();
    let mut warnings = Vec::new();
    for record in records {
        let range = |j: usize| extremes(&record.q[j]);
        let turns = |j: usize| joints[j].motion == Motion::Revolute;
        let count = joints.len().min(record.q.len());
        let far = (0..count).find(|&j| {
            let [a, b] = range(j);
            turns(j) && a.abs().max(b.abs()) > TURN && !fits(joints[j], a, b)
        });
        let degrees = (0..count).filter(|&j| turns(j)).all(|j| {
            let [a, b] = range(j).map(|x| x * PI / 180.0);
            fits(joints[j], a, b)
        });
        if let (Some(j), true) = (far, degrees) {
            let [a, b] = range(j);
            let message = format!(
                "the positions of {} go from {a:.3} to {b:.3}, far beyond its limits in rad and within them in degrees, as \
                 all others are: state unit = \"deg\" for q in [record.columns] (`excite log` writes such an experiment)",
                joints[j].name
            );
            return Err(Error::file(&record.path, "", message));
        }
    }
    let longest = records
        .iter()
        .filter(|r| {
            r.purpose == Purpose::Fit && r.payload == crate::log::Payload::None && !r.tau.is_empty()
        })
        .max_by_key(|r| r.len());
    if let Some(record) = longest {
        let (frame, mut claims) = frame(record, plant);
        dynamics::examine_stated(&[frame], &mut claims, plant, &mut warnings);
        for w in &mut warnings {
            w.subject = format!("{}: {}", record.path.display(), w.subject);
        }
    }
    Ok(warnings)
}

/// A record as the survey looks at it.
fn frame(record: &Record, plant: &Plant) -> (Frame, Vec<Claim>) {
    let mut frame = Frame {
        paths: vec![record.path.clone()],
        rows: record.len(),
        labels: Vec::new(),
        names: vec!["t".into()],
        time: Some(0),
        rate: None,
        time_unit: "s",
        step: record.step,
        start: 0.0,
        length: record.step * record.len().saturating_sub(1) as f64,
        stamps: [0.0; 2],
        factor: 1.0,
        columns: vec![record.t.clone()],
        gaps: Vec::new(),
        silent: Vec::new(),
        warnings: Vec::new(),
    };
    let mut claims = vec![Claim {
        means: Means::Time,
        ..Claim::none("t")
    }];
    for (group, means, columns) in [
        ("q", Means::Position, &record.q),
        ("tau", Means::Torque, &record.tau),
    ] {
        for (j, (column, joint)) in columns.iter().zip(plant.actuators()).enumerate() {
            let name = format!("{group}{}", j + 1);
            claims.push(Claim {
                means,
                at: Some(j),
                joint: Some(joint.name.clone()),
                confidence: 0.8,
                evidence: "its name".into(),
                named: true,
                ..Claim::none(&name)
            });
            frame.names.push(name);
            frame.columns.push(column.clone());
        }
    }
    (frame, claims)
}
