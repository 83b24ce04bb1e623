//! One record: a controller drives the plant along its reference, a logger writes what it sees.

use crate::chain::Kinematics;
use crate::disturb::Disturbance;
use crate::motion::Record;
use crate::plant::{Plant, STEP};
use crate::random::Random;
use crate::robots::Machine;
use std::f64::consts::TAU;

/// Sampling interval of the log, s.
pub const SAMPLE: f64 = 0.004;
/// Samples before the first and after the last one of the log that the filters may use.
pub const MARGIN: usize = 20;
/// Steps of the simulation between two updates of the controller.
const CONTROL: usize = 6;

/// What a record yields; joint-major.
#[derive(Clone, Debug, Default)]
pub struct Log {
    pub t: Vec<f64>,
    pub q: Vec<Vec<f64>>,
    pub tau: Vec<Vec<f64>>,
}

/// Encoder positions and logged torques of every step.
pub struct Raw {
    start: f64,
    q: Vec<Vec<f64>>,
    tau: Vec<Vec<f64>>,
}

/// Runs a record; none where the machine gets away from its reference.
pub fn run(
    machine: &Machine,
    plant: &mut Plant,
    record: &Record,
    outer: &Disturbance,
    bandwidth: f64,
) -> Option<Raw> {
    let n = machine.dof();
    let start = lead(record);
    let count = ((record.duration() + MARGIN as f64 * SAMPLE - start) / STEP).ceil() as usize + 1;
    let home: Vec<f64> = (0..n).map(|j| record.series[j].0).collect();
    let inertia = machine.chain.own_inertia(&home);
    let gains: Vec<[f64; 2]> = (0..n)
        .map(|j| {
            let m = inertia[j] + machine.drives[j].armature;
            let w = TAU * bandwidth;
            [w * w * m, 1.6 * w * m]
        })
        .collect();
    let state = |t: f64| -> [Vec<f64>; 3] {
        let x: Vec<[f64; 3]> = (0..n).map(|j| record.at(j, t)).collect();
        [0, 1, 2].map(|d| x.iter().map(|x| x[d]).collect())
    };
    let [q, v, _] = state(start);
    plant.place(&q, &v);
    let mut raw = Raw {
        start,
        q: vec![Vec::with_capacity(count); n],
        tau: vec![Vec::with_capacity(count); n],
    };
    let mut k = Kinematics::default();
    let mut command = vec![0.0; n];
    for i in 0..count {
        let t = start + i as f64 * STEP;
        if i % CONTROL == 0 {
            let [q, v, a] = state(t);
            machine.nominal_chain.kinematics(&q, &v, &mut k);
            machine.nominal_chain.inverse(&k, &v, &a, &mut command);
            for j in 0..n {
                let d = &machine.nominal_drives[j];
                let (shown, rate) = plant.encoder(j);
                command[j] += d.armature * a[j]
                    + d.viscous * v[j]
                    + d.coulomb * (v[j] / (0.005 * d.velocity)).tanh()
                    + gains[j][0] * (q[j] - shown)
                    + gains[j][1] * (v[j] - rate);
                if !(shown - q[j]).is_finite() || (shown - q[j]).abs() > 0.35 {
                    return None;
                }
            }
        }
        for j in 0..n {
            raw.q[j].push(plant.encoder(j).0);
        }
        let log = plant.step(&command, outer, t, i as f64 * STEP);
        for (all, x) in raw.tau.iter_mut().zip(log) {
            all.push(x);
        }
    }
    Some(raw)
}

/// Time at which the simulation of a record starts: transients die before its log does.
pub fn lead(record: &Record) -> f64 {
    -(record.period.min(4.0)) - MARGIN as f64 * SAMPLE
}

impl Raw {
    /// Noise-free positions at the times `t` and torques averaged over one sample to either side with
    /// a triangular weight.
    pub fn sample(&self, t: &[f64]) -> Log {
        let read = |x: &[f64], t: f64| {
            let u = (t - self.start) / STEP;
            let i = (u as usize).min(x.len() - 2);
            x[i] + (x[i + 1] - x[i]) * (u - i as f64)
        };
        let average = |x: &[f64], t: f64| {
            // a command holds over its whole step
            let u = (t - self.start) / STEP - 0.5;
            let width = SAMPLE / STEP;
            let (mut sum, mut weight) = (0.0, 0.0);
            let first = (u - width).ceil().max(0.0) as usize;
            let last = ((u + width) as usize).min(x.len() - 1);
            for (i, x) in x.iter().enumerate().take(last + 1).skip(first) {
                let w = 1.0 - (i as f64 - u).abs() / width;
                sum += w * x;
                weight += w;
            }
            sum / weight
        };
        Log {
            t: t.to_vec(),
            q: self
                .q
                .iter()
                .map(|x| t.iter().map(|t| read(x, *t)).collect())
                .collect(),
            tau: self
                .tau
                .iter()
                .map(|x| t.iter().map(|t| average(x, *t)).collect())
                .collect(),
        }
    }
}

/// Sample times of a record's log, with the margin of `extra` samples at either end.
pub fn times(record: &Record, extra: usize) -> Vec<f64> {
    let n = (record.duration() / SAMPLE).round() as i64;
    let m = extra as i64;
    (-m..=n + m).map(|i| i as f64 * SAMPLE).collect()
}

/// The log as written: jitter in the sample times, encoder steps, white and coloured torque noise.
pub fn measure(
    raw: &Raw,
    machine: &Machine,
    record: &Record,
    jitter: f64,
    rng: &mut Random,
) -> (Log, Log) {
    let mut t = times(record, 0);
    for (i, t) in t.iter_mut().enumerate() {
        // the written time is the true one
        if i > 0 {
            *t += jitter * rng.normal().clamp(-3.0, 3.0);
        }
        *t = (*t * 1e5).round() / 1e5;
    }
    let clean = raw.sample(&t);
    let mut log = clean.clone();
    for (j, d) in machine.drives.iter().enumerate() {
        for q in &mut log.q[j] {
            *q = (*q / d.resolution).round() * d.resolution;
        }
        let (share, pole) = (0.4f64, 0.9f64);
        let mut coloured = rng.normal();
        for tau in &mut log.tau[j] {
            coloured = pole * coloured + (1.0 - pole * pole).sqrt() * rng.normal();
            let white = rng.normal();
            *tau += d.noise * (share.sqrt() * coloured + (1.0 - share).sqrt() * white);
        }
    }
    (log, clean)
}
