//! What a refit of the nominal structure leaves, with the generator's own regressor: how visible an
//! effect is, and how far the gap shrinks when the true effect is known.

use crate::chain::Kinematics;
use crate::friction::SHARP;
use crate::robots::Machine;
use crate::simulate::{Log, SAMPLE};
use nalgebra::{DMatrix, DVector};

/// Half length of the low-pass filter, samples.
const HALF: usize = 16;
/// Its corner, Hz.
const CORNER: f64 = 20.0;
/// One row of the regression per this many samples.
const DECIMATE: usize = 5;

/// Filtered motion and torque on a uniform grid; joint-major.
pub struct Prepared {
    /// Regressor of each joint: `rows × columns`, in units of the joint's torque noise.
    y: Vec<DMatrix<f64>>,
    pub tau: Vec<DVector<f64>>,
}

fn filter(x: &[f64]) -> Vec<f64> {
    let taps: Vec<f64> = (-(HALF as i64)..=HALF as i64)
        .map(|i| {
            let u = std::f64::consts::TAU * CORNER * SAMPLE * i as f64;
            let sinc = if i == 0 { 1.0 } else { u.sin() / u };
            let w = std::f64::consts::PI * i as f64 / (HALF + 1) as f64;
            sinc * (0.5 + 0.5 * w.cos())
        })
        .collect();
    let sum: f64 = taps.iter().sum();
    x.windows(2 * HALF + 1)
        .map(|w| w.iter().zip(&taps).map(|(a, b)| a * b).sum::<f64>() / sum)
        .collect()
}

/// Values at `i · SAMPLE` from jittered samples.
fn uniform(t: &[f64], x: &[f64], grid: &[f64]) -> Vec<f64> {
    let mut k = 0;
    grid.iter()
        .map(|g| {
            while k + 2 < t.len() && t[k + 1] < *g {
                k += 1;
            }
            x[k] + (x[k + 1] - x[k]) * (g - t[k]) / (t[k + 1] - t[k])
        })
        .collect()
}

/// Smooth sign of a velocity, averaged as the logger averages the torque.
fn sign(v: &[f64], width: f64) -> Vec<f64> {
    let at = |i: usize, u: f64| {
        let other = if u < 0.0 {
            i.saturating_sub(1)
        } else {
            (i + 1).min(v.len() - 1)
        };
        v[i] + (v[other] - v[i]) * u.abs()
    };
    (0..v.len())
        .map(|i| {
            let parts = (-7..=7).map(|k| k as f64 / 8.0);
            parts
                .map(|u| (1.0 - u.abs()) * (at(i, u) / width).tanh())
                .sum::<f64>()
                / 8.0
        })
        .collect()
}

/// Which joint columns the nominal model has, as (joint, term).
pub fn joint_columns(machine: &Machine) -> Vec<(usize, usize)> {
    let mut out = Vec::new();
    for (j, d) in machine.nominal_drives.iter().enumerate() {
        out.extend((0..4).filter(|k| d.identify[*k]).map(|k| (j, k)));
    }
    out
}

/// Parameters of the nominal structure: bodies of `chain`, joint terms of `drives`.
pub fn parameters(machine: &Machine, nominal: bool) -> Vec<f64> {
    let (chain, drives) = if nominal {
        (&machine.nominal_chain, &machine.nominal_drives)
    } else {
        (&machine.chain, &machine.drives)
    };
    let mut out: Vec<f64> = chain
        .joints
        .iter()
        .flat_map(|j| j.body.parameters())
        .collect();
    for (j, k) in joint_columns(machine) {
        let d = &drives[j];
        out.push([d.armature, d.viscous, d.coulomb, d.offset][k]);
    }
    out
}

impl Prepared {
    pub fn new(machine: &Machine, log: &Log) -> Self {
        let n = machine.dof();
        let count = log.t.len();
        let grid: Vec<f64> = (0..count).map(|i| log.t[0] + i as f64 * SAMPLE).collect();
        let smooth = |x: &[f64]| filter(&uniform(&log.t, x, &grid));
        let q: Vec<Vec<f64>> = log.q.iter().map(|x| smooth(x)).collect();
        let tau: Vec<Vec<f64>> = log.tau.iter().map(|x| smooth(x)).collect();
        let velocity: Vec<Vec<f64>> = q
            .iter()
            .map(|x| {
                (1..x.len() - 1)
                    .map(|i| (x[i + 1] - x[i - 1]) / (2.0 * SAMPLE))
                    .collect()
            })
            .collect();
        // the torque was filtered after friction had switched: so is the column of its sign
        let dry: Vec<Vec<f64>> = (0..n)
            .map(|j| {
                let width = SHARP * machine.drives[j].velocity;
                filter(&sign(&velocity[j], width))
            })
            .collect();
        let terms = joint_columns(machine);
        let used: Vec<usize> = (0..dry[0].len()).step_by(DECIMATE).collect();
        let columns = 10 * n + terms.len();
        let mut y = vec![DMatrix::zeros(used.len(), columns); n];
        let mut out = vec![DVector::zeros(used.len()); n];
        let mut k = Kinematics::default();
        let mut block = vec![vec![0.0; 10 * n]; n];
        for (row, &i) in used.iter().enumerate() {
            let c = i + HALF;
            let at: Vec<f64> = q.iter().map(|x| x[c + 1]).collect();
            let v: Vec<f64> = velocity.iter().map(|x| x[c]).collect();
            let a: Vec<f64> = q
                .iter()
                .map(|x| (x[c + 2] - 2.0 * x[c + 1] + x[c]) / (SAMPLE * SAMPLE))
                .collect();
            machine.nominal_chain.kinematics(&at, &v, &mut k);
            machine.nominal_chain.regressor(&k, &v, &a, &mut block);
            for j in 0..n {
                let w = 1.0 / machine.drives[j].noise;
                for (c, x) in block[j].iter().enumerate() {
                    y[j][(row, c)] = w * x;
                }
                for (c, (joint, term)) in terms.iter().enumerate() {
                    if *joint == j {
                        y[j][(row, 10 * n + c)] = w * [a[j], v[j], dry[j][i], 1.0][*term];
                    }
                }
                out[j][row] = w * tau[j][c + 1];
            }
        }
        Self { y, tau: out }
    }

    /// Model torque in units of the noise.
    pub fn model(&self, parameters: &[f64]) -> Vec<DVector<f64>> {
        let p = DVector::from_column_slice(parameters);
        self.y.iter().map(|y| y * &p).collect()
    }
}

/// Least squares over several records; directions that the motion does not excite stay at zero.
pub fn solve(records: &[&Prepared], torque: &[Vec<DVector<f64>>]) -> Vec<f64> {
    let columns = records[0].y[0].ncols();
    let mut gram = DMatrix::<f64>::zeros(columns, columns);
    let mut right = DVector::<f64>::zeros(columns);
    for (r, tau) in records.iter().zip(torque) {
        for (y, tau) in r.y.iter().zip(tau) {
            gram.gemm_tr(1.0, y, y, 1.0);
            right.gemv_tr(1.0, y, tau, 1.0);
        }
    }
    let scale: Vec<f64> = (0..columns)
        .map(|i| {
            if gram[(i, i)] > 0.0 {
                gram[(i, i)].sqrt().recip()
            } else {
                0.0
            }
        })
        .collect();
    for i in 0..columns {
        right[i] *= scale[i];
        for j in 0..columns {
            gram[(i, j)] *= scale[i] * scale[j];
        }
    }
    let eigen = gram.symmetric_eigen();
    let projected = eigen.eigenvectors.tr_mul(&right);
    let cut = 1e-11 * eigen.eigenvalues.max();
    let weighted = DVector::from_fn(columns, |i, _| {
        let e = eigen.eigenvalues[i];
        if e > cut { projected[i] / e } else { 0.0 }
    });
    let x = eigen.eigenvectors * weighted;
    (0..columns).map(|i| x[i] * scale[i]).collect()
}

/// Two signals of every joint that are to agree.
pub type Pair<'a> = (&'a [DVector<f64>], &'a [DVector<f64>]);

/// Mean square of a difference, over all joints, and its root per joint; in units of the noise.
pub fn energy(pairs: &[Pair]) -> (f64, Vec<f64>) {
    let n = pairs[0].0.len();
    let mut sums = vec![(0.0, 0usize); n];
    for (a, b) in pairs {
        for j in 0..n {
            sums[j].0 += (&a[j] - &b[j]).norm_squared();
            sums[j].1 += a[j].len();
        }
    }
    let rms: Vec<f64> = sums.iter().map(|(s, c)| (s / *c as f64).sqrt()).collect();
    (rms.iter().map(|x| x * x).sum::<f64>() / n as f64, rms)
}
