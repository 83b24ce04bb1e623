//! The robot's own controller, as far as a simulation needs it: the feedback that answers a deviation.
//!
//! A linear controller with feedforward sends `τ = u(t) + K_p e + K_d ė + K_i ∫e`, `e = q_ref − q`.
//! Under the same command another robot, at `q + δ`, is sent what was recorded less
//! `K_p δ + K_d δ̇ + K_i ∫δ`: the feedforward need not be known. The gains are fitted to the commanded
//! positions and the torques of the log, beside whatever feedforward explains:
//!
//! ```text
//! τ_j = k_p e_j + k_d ė_j + k_i ∫e_j + c₀ + c₁ q̇_r + c₂ q̈_r + c₃ sgn q̇_r + c₄ τ_rigid(q_r, q̇_r, q̈_r) + c₅ τ_g(q_r)
//! ```
//!
//! by least squares over the fitted records, all signals limited to the same band; or, for a
//! controller of the inverse-dynamics type, with `M̂(q_r) e` in the place of `e` and one set of gains for
//! all joints (Siciliano, Sciavicco, Villani & Oriolo 2009, ch. 8). Whichever leaves less is taken,
//! if it explains the torque and its gains are positive and certain.

use super::data::Data;
use super::evidence::{Fit, solve};
use super::thresholds::THRESHOLDS as T;
use super::window::sign;
use crate::dot::dot;
use crate::dynamics::Samples;
use crate::plant::Plant;
use crate::signals::wiener::limited;
use crate::simulate::Dynamics;
use crate::simulate::control::actuation;
use faer::Mat;
use nalgebra::DVector;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Natural frequency of the spring that holds the robot to the recorded motion where its own controller is not
/// known, Hz.
pub const BANDWIDTH: f64 = T.controller.bandwidth;

/// What a feedback acts on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// deviations of the actuators
    Actuators,
    /// deviations of the coordinates times the nominal mass matrix
    InverseDynamics,
}

/// An identified feedback.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Feedback {
    /// what it acts on
    pub kind: Kind,
    /// `[k_p, k_d, k_i]` by actuator in N m/rad, N m s/rad, N m/(rad s), or N/m …; of the
    /// inverse-dynamics type one for all, in 1/s², 1/s, 1/s³
    pub gains: Vec<[f64; 3]>,
    /// rms of the torque that it leaves over the rms of the torque, by actuator
    pub left: Vec<f64>,
    /// actuators whose gains are not certain: those of a soft spring stand in their place
    pub soft: Vec<usize>,
}

/// The feedback of the logs' controller.
///
/// # Errors
/// In words, why it is not known: no commanded positions, or torques that no linear feedback of the
/// tracking error explains.
pub fn identify(data: &Data, phi: &[f64]) -> Result<Feedback, String> {
    let fitted = || data.records.iter().filter(|r| r.fit);
    if !fitted().all(|r| r.reference.is_some()) {
        return Err("the logs hold no commanded positions qref1…".into());
    }
    let signals = Signals::new(data, phi).map_err(|e| e.to_string())?;
    let n = data.joints();
    let each: Vec<Fitted> = (0..n).map(|j| signals.fit(&[j], Kind::Actuators)).collect();
    let joints: Vec<usize> = (0..n).collect();
    let together = signals.fit(&joints, Kind::InverseDynamics);
    // a joint whose torque drowns in its noise does not keep the others from being known
    let unknown: Vec<usize> = joints
        .iter()
        .copied()
        .filter(|j| !each[*j].certain)
        .collect();
    let omega = TAU * BANDWIDTH;
    let gains = |(j, f): (usize, &Fitted)| match f.certain {
        true => f.gains,
        false => [
            data.inertia[j] * omega.powi(2),
            data.inertia[j] * 2.0 * omega,
            0.0,
        ],
    };
    let by_joint = (2 * unknown.len() < n).then(|| Feedback {
        kind: Kind::Actuators,
        gains: each.iter().enumerate().map(gains).collect(),
        left: each.iter().flat_map(|f| f.left.clone()).collect(),
        soft: unknown,
    });
    let together = together.certain.then_some(Feedback {
        kind: Kind::InverseDynamics,
        gains: vec![together.gains],
        left: together.left,
        soft: Vec::new(),
    });
    let badness = |f: &Feedback| -> f64 {
        let of = |(j, l): (usize, &f64)| (l * signals.rms(j) / data.noise[j].std).powi(2);
        let left: f64 = f.left.iter().enumerate().map(of).sum();
        // of two that are as good, as they are on a single axis, the plain one
        match f.kind {
            Kind::Actuators => left,
            Kind::InverseDynamics => T.controller.plain * left,
        }
    };
    let sound = |f: &Feedback| {
        let ok = |(j, l): (usize, &f64)| {
            *l < T.controller.left
                || l * signals.rms(j) < T.controller.noise * data.noise[j].std
                || f.soft.contains(&j)
        };
        f.left.iter().enumerate().all(ok)
    };
    [by_joint, together]
        .into_iter()
        .flatten()
        .filter(sound)
        .min_by(|a, b| badness(a).total_cmp(&badness(b)))
        .ok_or_else(|| {
            "no linear feedback of the tracking error qref − q explains the recorded torques".into()
        })
}

/// Gains of some joints and what they leave of each.
struct Fitted {
    gains: [f64; 3],
    /// whether they are positive and certain
    certain: bool,
    left: Vec<f64>,
}

/// Everything over the fitted rows, limited to one band.
struct Signals {
    /// torque by actuator
    tau: Vec<Vec<f64>>,
    /// feedforward terms by actuator
    ahead: Vec<Vec<Vec<f64>>>,
    /// `e`, `ė`, `∫e` by actuator
    error: Vec<[Vec<f64>; 3]>,
    /// `M̂ e`, `M̂ ė`, `M̂ ∫e` as torques of the actuators
    weighted: Vec<[Vec<f64>; 3]>,
    /// standard deviation of the torque noise by actuator
    noise: Vec<f64>,
}

impl Signals {
    fn new(data: &Data, phi: &[f64]) -> crate::error::Result<Self> {
        let n = data.joints();
        let fitted: Vec<usize> = (0..data.records.len())
            .filter(|k| data.records[*k].fit)
            .collect();
        // motion of the coordinates along the command
        let mut along = Vec::new();
        for k in &fitted {
            let r = &data.records[*k];
            let Some(actuators) = &r.reference else {
                continue;
            };
            along.push(data.plant.coordinate_motion(actuators, r.cycle)?);
        }
        // error of the coordinates and of the actuators, with derivative and integral
        let errors = |commanded: &Samples, x: &Samples, dt: f64| -> Vec<[Vec<f64>; 3]> {
            (0..x.dof)
                .map(|c| {
                    let row = c * x.count..(c + 1) * x.count;
                    let less = |a: &[f64], b: &[f64]| -> Vec<f64> {
                        a[row.clone()]
                            .iter()
                            .zip(&b[row.clone()])
                            .map(|(a, b)| a - b)
                            .collect()
                    };
                    let (e, rate) = (less(&commanded.q, &x.q), less(&commanded.qd, &x.qd));
                    let mean = e.iter().sum::<f64>() / e.len().max(1) as f64;
                    let mut sum = 0.0;
                    let integral = e
                        .iter()
                        .map(|v| {
                            sum += (v - mean) * dt;
                            sum
                        })
                        .collect();
                    [e, rate, integral]
                })
                .collect()
        };
        let coordinates: Vec<_> = fitted
            .iter()
            .zip(&along)
            .map(|(k, a)| errors(a, &data.records[*k].x, data.records[*k].dt))
            .collect();
        // torque of rigid bodies along the command, in motion or at rest
        let place = |k: usize| fitted.iter().position(|f| *f == k);
        let rigid = |moving: f64| {
            data.torque_of(phi, |_, k, x| {
                let Some(i) = place(k) else { return };
                x.q.copy_from_slice(&along[i].q);
                let scaled = |to: &mut [f64], from: &[f64]| {
                    to.iter_mut().zip(from).for_each(|(to, v)| *to = moving * v);
                };
                scaled(&mut x.qd, &along[i].qd);
                scaled(&mut x.qdd, &along[i].qdd);
            })
        };
        let (full, gravity) = (rigid(1.0)?, rigid(0.0)?);
        // D_a⁻ᵀ M̂ times the error, its rate and its integral, record after record
        let pushed = along
            .par_iter()
            .zip(&coordinates)
            .map(|(x, errors)| pushed(data.plant, x, errors))
            .collect::<crate::error::Result<Vec<_>>>()?;
        // rows of one actuator in the fitted records, each limited to the band of the positions; what
        // was not measured counts for nothing
        let in_band = |column: &dyn Fn(usize, usize) -> Vec<f64>| -> Vec<f64> {
            let each = fitted.iter().enumerate().flat_map(|(i, k)| {
                let r = &data.records[*k];
                let rows = limited(&column(i, *k), r.cycle, r.dt);
                let kept = rows.into_iter().zip(&r.measured);
                kept.map(|(x, m)| if *m { x } else { 0.0 })
                    .collect::<Vec<_>>()
            });
            each.collect()
        };
        let span = |rows: &[f64], k: usize| rows[data.span(k)].to_vec();
        let actuators: Vec<_> = fitted
            .iter()
            .map(|k| {
                let r = &data.records[*k];
                let still = Samples::zeros(n, r.count);
                errors(r.reference.as_ref().unwrap_or(&still), &r.actuators, r.dt)
            })
            .collect();
        let part = |rows: &[f64], j: usize, k: usize| -> Vec<f64> {
            let count = data.records[k].count;
            rows[j * count..(j + 1) * count].to_vec()
        };
        let empty = Samples::zeros(0, 0);
        let command = |k: usize| data.records[k].reference.as_ref().unwrap_or(&empty);
        Ok(Signals {
            tau: (0..n)
                .map(|j| in_band(&|_, k| span(&data.tau[j], k)))
                .collect(),
            ahead: (0..n)
                .map(|j| {
                    let slow = T.controller.slow * data.speed[j];
                    let sense = |k: usize| -> Vec<f64> {
                        part(&command(k).qd, j, k)
                            .into_iter()
                            .map(|v| sign(v, slow))
                            .collect()
                    };
                    vec![
                        in_band(&|_, k| vec![1.0; data.records[k].count]),
                        in_band(&|_, k| part(&command(k).qd, j, k)),
                        in_band(&|_, k| part(&command(k).qdd, j, k)),
                        in_band(&|_, k| sense(k)),
                        in_band(&|_, k| span(&full[j], k)),
                        in_band(&|_, k| span(&gravity[j], k)),
                    ]
                })
                .collect(),
            error: (0..n)
                .map(|j| [0, 1, 2].map(|part| in_band(&|i, _| actuators[i][j][part].clone())))
                .collect(),
            weighted: (0..n)
                .map(|j| [0, 1, 2].map(|part| in_band(&|i, _| pushed[i][part][j].clone())))
                .collect(),
            noise: (0..n).map(|j| data.noise[j].std).collect(),
        })
    }

    /// Root mean square of a torque.
    fn rms(&self, j: usize) -> f64 {
        rms(&self.tau[j])
    }

    /// Gains that some joints share.
    fn fit(&self, joints: &[usize], kind: Kind) -> Fitted {
        // with an integral part, and without it where that is not certain
        let (with, integral) = self.fit_parts(joints, kind, 3);
        match with.certain && integral {
            true => with,
            false => self.fit_parts(joints, kind, 2).0,
        }
    }

    /// The same with so many parts of the feedback, and whether the integral part is certain.
    fn fit_parts(&self, joints: &[usize], kind: Kind, parts: usize) -> (Fitted, bool) {
        let feedback = |j: usize| match kind {
            Kind::Actuators => &self.error[j],
            Kind::InverseDynamics => &self.weighted[j],
        };
        let terms = self.ahead[joints[0]].len();
        let unknowns = parts + terms * joints.len();
        let (mut s, mut b) = (Mat::<f64>::zeros(unknowns, unknowns), vec![0.0; unknowns]);
        let columns = |i: usize, j: usize| -> Vec<(usize, &[f64])> {
            let own = feedback(j)[..parts].iter().enumerate();
            let ahead = self.ahead[j].iter().enumerate();
            own.map(|(p, v)| (p, v.as_slice()))
                .chain(ahead.map(move |(t, v)| (parts + i * terms + t, v.as_slice())))
                .collect()
        };
        for (i, &j) in joints.iter().enumerate() {
            let weight = 1.0 / self.noise[j].powi(2).max(1e-300);
            let all = columns(i, j);
            for (a, x) in &all {
                for (c, y) in &all {
                    s[(*a, *c)] += weight * dot(x, y);
                }
                b[*a] += weight * dot(x, &self.tau[j]);
            }
        }
        let fit: Fit = solve(&s, &b);
        let residual: Vec<Vec<f64>> = joints
            .iter()
            .enumerate()
            .map(|(i, &j)| {
                let mut e = self.tau[j].clone();
                for (a, x) in columns(i, j) {
                    e.iter_mut().zip(x).for_each(|(e, x)| *e -= fit.eta[a] * x);
                }
                e.iter_mut().for_each(|e| *e /= self.noise[j]);
                e
            })
            .collect();
        let rows = residual.first().map_or(0, Vec::len);
        let scale = super::verdict::inflation(&residual, rows);
        let certain = |p: usize| {
            let std = fit.covariance[p][p].max(0.0).sqrt() * scale;
            p < parts && std > 0.0 && fit.eta[p] > T.controller.certain * std
        };
        let sure = [certain(0), certain(1), certain(2)];
        let mut gains = [0.0; 3];
        gains[..parts].copy_from_slice(&fit.eta[..parts]);
        // a controller may have no damping of its own
        if !sure[1]
            && gains[1].abs() < T.controller.certain * fit.covariance[1][1].max(0.0).sqrt() * scale
        {
            gains[1] = gains[1].max(0.0);
        }
        let left = joints
            .iter()
            .zip(&residual)
            .map(|(&j, e)| rms(e) * self.noise[j] / self.rms(j).max(1e-300))
            .collect();
        let fitted = Fitted {
            gains,
            certain: sure[0] && gains[1] >= 0.0,
            left,
        };
        (fitted, sure[2])
    }
}

/// `D_a⁻ᵀ M̂ e` of one record along the commanded motion `x` for error, rate and integral: by part, by
/// actuator, over time.
fn pushed(
    plant: &Plant,
    x: &Samples,
    errors: &[[Vec<f64>; 3]],
) -> crate::error::Result<[Vec<Vec<f64>>; 3]> {
    let m = x.dof;
    let mut nominal = Dynamics::nominal(plant);
    let rest = DVector::zeros(m);
    let mut out = [const { Vec::new() }; 3];
    for part in &mut out {
        *part = vec![Vec::with_capacity(x.count); plant.actuators().len()];
    }
    for i in 0..x.count {
        let q = DVector::from_fn(m, |c, _| x.q[c * x.count + i]);
        let terms = nominal.terms(&q, &rest)?;
        let inertia = actuation(&terms.d_a) * &terms.mass;
        let at = |part: usize| DVector::from_iterator(m, errors.iter().map(|e| e[part][i]));
        for (part, out) in out.iter_mut().enumerate() {
            let torque = &inertia * at(part);
            out.iter_mut()
                .zip(torque.iter())
                .for_each(|(o, v)| o.push(*v));
        }
    }
    Ok(out)
}

fn rms(x: &[f64]) -> f64 {
    (dot(x, x) / x.len().max(1) as f64).sqrt()
}
