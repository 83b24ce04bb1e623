//! Jacobians against differences, counts against the literature, and calibrations of robots whose errors are known.

mod bad;
mod closed;
mod files;
mod known;
mod model;
mod robots;

use super::effects::features;
use super::feature::Feature;
use super::fit::Plan;
use super::frame::{Frame, exp};
use super::kin::Kin;
use super::layout::Start;
use super::model::{Algorithm, Model, Settings};
use super::parts::{Distance, Identifiability, Kind, Measurement, Part, Stats, Tolerances};
use super::row::{Row, Value};
use super::*;
use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn random(r: &mut ChaCha8Rng, s: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| r.random_range(-s..s))
}

/// Nearly normal, of variance one.
pub(super) fn normal(r: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| r.random_range(-0.5..0.5)).sum()
}

/// Postures of a robot: of an arm anywhere, of a platform in its workspace.
fn postures(opened: &Opened, r: &mut ChaCha8Rng, count: usize) -> Vec<Vec<f64>> {
    let mut all = Vec::new();
    while all.len() < count {
        match &opened.kin {
            Kin::Arm(_) => all.push(
                opened
                    .joints
                    .iter()
                    .map(|_| r.random_range(-2.0..2.0))
                    .collect(),
            ),
            Kin::Parallel(p) => {
                let draw = |w: &crate::robot::Limits| r.random_range(w.position[0]..w.position[1]);
                let x: Vec<f64> = p.mechanism.workspace.iter().map(draw).collect();
                all.extend(p.mechanism.actuator_positions(&x).ok());
            }
        }
    }
    all
}

pub(super) fn measurement(kind: Kind, file: &str, group: &str, std: [f64; 2]) -> Measurement {
    Measurement {
        kind,
        file: file.into(),
        group: group.into(),
        std,
        instrument: format!("{} instrument", kind.name()),
        grip: None,
        base_at: None,
        target_at: None,
    }
}

pub(super) fn input(
    measurements: Vec<Measurement>,
    rows: Vec<Row>,
    tolerance: [f64; 2],
) -> Calibration {
    Calibration {
        path: "calibration.toml".into(),
        robot: "robot".into(),
        frame: None,
        other: None,
        gravity: None,
        effects: None,
        measurements,
        distances: Vec::new(),
        rows,
        prior: Tolerances {
            length: tolerance[0],
            angle: tolerance[1],
            ..Tolerances::default()
        },
        noise_stated: true,
        warnings: Vec::new(),
    }
}

pub(super) fn row(measurement: usize, q: Vec<f64>, value: Value, fit: bool) -> Row {
    Row {
        measurement,
        line: 1,
        q,
        value,
        covariance: None,
        approach: Vec::new(),
        fit,
    }
}

pub(super) fn nominal(opened: &Opened, c: &Calibration) -> Vec<Option<Frame>> {
    c.rows
        .iter()
        .map(|r| opened.kin.nominal(&r.q).ok())
        .collect()
}

/// Where the base stands before the camera of [`made`], and the target on the frame.
pub(super) fn places() -> [Frame; 2] {
    let camera = Frame {
        r: exp(&Vector3::new(2.8, 0.3, -0.4)),
        p: Vector3::new(0.3, -0.4, 1.8),
    };
    let target = Frame {
        r: exp(&Vector3::new(0.1, 0.4, -0.3)),
        p: Vector3::new(0.02, 0.03, 0.06),
    };
    [camera, target]
}

/// A robot with known errors, seen by a camera or tracker with noise; rows held out are seen without.
pub(super) fn made(
    opened: &Opened,
    kind: Kind,
    std: [f64; 2],
    tolerance: [f64; 2],
    rows: [usize; 2],
    seed: u64,
    spoil: usize,
) -> Calibration {
    let r = &mut ChaCha8Rng::seed_from_u64(seed);
    let unknowns = opened.kin.unknowns(tolerance);
    let x: Vec<f64> = unknowns.iter().map(|u| u.prior * normal(r)).collect();
    let [camera, target] = places();
    let list = postures(opened, r, rows[0] + rows[1]);
    let list = list.into_iter().enumerate().map(|(i, q)| {
        let posed = opened.kin.pose(&q, &x, &[], &[], None).unwrap();
        let mut seen = camera.then(&posed.frame).then(&target);
        if i < rows[0] {
            seen.p += Vector3::from_fn(|_, _| std[0] * normal(r));
            seen.r = exp(&Vector3::from_fn(|_, _| std[1] * normal(r))) * seen.r;
        }
        if i < spoil {
            seen.p += random(r, 0.05);
        }
        let value = match kind {
            Kind::Pose => Value::Pose(seen),
            _ => Value::Position(seen.p),
        };
        row(0, q, value, i < rows[0])
    });
    input(
        vec![measurement(kind, "rows", "rows", std)],
        list.collect(),
        tolerance,
    )
}

pub(super) fn after(opened: &Opened, c: &Calibration, settings: Settings) -> (Stats, Calibrated) {
    let found = calibrate(c, opened, settings).unwrap();
    let [_, after] = found.errors(false, true);
    (Stats::of(&after).unwrap(), found)
}
