//! What a posture does to the joints: torques of gravity, levers of rods, and the side that each joint came from.

use crate::calibrate::bench::Bench;
use crate::calibrate::bend::Bends;
use crate::calibrate::file::Calibration;
use crate::calibrate::kin::Kin;
use crate::calibrate::open::Opened;
use crate::calibrate::parallel::Parallel;
use crate::dynamics::Samples;
use crate::mechanism::dimensions::Dimensions;

/// Smallest move of a joint that has a direction, rad or m.
const MOVED: f64 = 1e-4;
/// Index of the length of the rod among the dimensions of a chain.
const ROD: usize = 7;

/// By row and joint.
#[derive(Debug, Clone, Default)]
pub struct Conditions {
    /// readings, rad or m
    pub q: Vec<Vec<f64>>,
    /// torque or force of gravity on the joint, N m or N
    pub torque: Option<Vec<Vec<f64>>>,
    /// change of the reading by the length of the rod, rad/m; chains of arm and rod alone
    pub lever: Option<Vec<Vec<f64>>>,
    /// how links bend under gravity, per unit of flexibility; serial robots and trees alone
    pub bends: Option<Bends>,
    /// side that the joint came from: 1 where its reading rose
    pub approach: Vec<Vec<f64>>,
}

impl Conditions {
    /// Of the rows of a calibration.
    pub fn of(input: &Calibration, opened: &Opened, bench: &Bench) -> Self {
        let q: Vec<Vec<f64>> = input.rows.iter().map(|r| r.q.clone()).collect();
        let stated = input.rows.iter().any(|r| !r.approach.is_empty());
        let approach = match stated {
            true => stated_sides(input, opened.joints.len()),
            false => sides_in_order(input, opened.joints.len()),
        };
        let mut all = Conditions {
            torque: bench.torques().map(<[Vec<f64>]>::to_vec),
            bends: bench.bends().cloned(),
            approach,
            q,
            ..Conditions::default()
        };
        all.statics(opened);
        all
    }

    /// Torques and levers of a parallel robot.
    pub fn statics(&mut self, opened: &Opened) {
        if let Kin::Parallel(p) = &opened.kin {
            self.torque = loads(opened, p, &self.q);
            self.lever = levers(p, &self.q);
        }
    }
}

fn stated_sides(input: &Calibration, joints: usize) -> Vec<Vec<f64>> {
    let side = |r: &crate::calibrate::row::Row| match r.approach.len() == joints {
        true => r.approach.iter().map(|a| a.clamp(-1.0, 1.0)).collect(),
        false => vec![0.0; joints],
    };
    input.rows.iter().map(side).collect()
}

/// Rows of one file are taken to stand in the order in which they were recorded.
fn sides_in_order(input: &Calibration, joints: usize) -> Vec<Vec<f64>> {
    let mut all: Vec<Vec<f64>> = Vec::with_capacity(input.rows.len());
    for (i, r) in input.rows.iter().enumerate() {
        let before = i
            .checked_sub(1)
            .filter(|&b| input.rows[b].measurement == r.measurement);
        let side = |k: usize| match before {
            None => 0.0,
            Some(b) => {
                let d = r.q[k] - input.rows[b].q[k];
                match d.abs() > MOVED {
                    true => d.signum(),
                    false => all[b][k],
                }
            }
        };
        let own = (0..joints).map(side).collect();
        all.push(own);
    }
    all
}

/// Forces of gravity on the actuators: minus what holds the robot. `None` without mass.
fn loads(opened: &Opened, p: &Parallel, q: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let m = &p.mechanism;
    let poses: Vec<Option<Vec<f64>>> = q
        .iter()
        .map(|q| Some(m.forward(q, &m.home).ok()?.x))
        .collect();
    let mut motion = Samples::zeros(m.home.len(), q.len());
    for (s, pose) in poses.iter().enumerate() {
        let x = pose.as_ref().unwrap_or(&m.home);
        for (k, v) in x.iter().enumerate() {
            motion.q[k * q.len() + s] = *v;
        }
    }
    let held = opened.plant.nominal_torque(&motion).ok()?;
    let n = opened.joints.len();
    if held.len() != n * q.len() || !held.iter().any(|t| t.abs() > 1e-6) {
        return None;
    }
    let row = |s: usize| (0..n).map(|a| -held[a * q.len() + s]).collect();
    Some((0..q.len()).map(row).collect())
}

fn levers(p: &Parallel, q: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let Dimensions::Chains(..) = &p.dimensions else {
        return None;
    };
    let zeros = vec![0.0; p.errors()];
    let own = crate::mechanism::dimensions::ARM.len();
    let n = p.actuators();
    let row = |q: &Vec<f64>| match p.nominal(q) {
        Ok(at) => {
            let a = p.actuators_at(&at, q, &zeros, false);
            (0..n).map(|i| a.by_errors[(i, own * i + ROD)]).collect()
        }
        Err(_) => vec![0.0; n],
    };
    Some(q.iter().map(row).collect())
}
