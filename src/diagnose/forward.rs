//! What a user of the simulator sees: the robot simulated under the torques of a log, with the
//! nominal model, with the refitted one and with the effects found.
//!
//! Where the log holds commanded positions, the simulated robot is under the **same commands**: its
//! controller sends what was recorded, less the feedback of the deviation ([`controller`](super::controller)).
//! Otherwise the recorded torque drives it; as every model drifts away on torque alone, a soft spring
//! and damper of natural frequency `ω` ([`BANDWIDTH`](super::controller::BANDWIDTH)) and ratio 1 hold it to the recorded motion
//! `x_m`. With the deviation `e = x − x_m`, friction `λ` and the torque `τ_e` of the effects:
//!
//! ```text
//! M (ẍ_m + ë) + h + Dᵀ (F_v q̇ + o + λ) = D_aᵀ (τ − τ_e) − K_p e − K_d ė − K_i ∫e      |λ_j| ≤ F_c,j
//! feedback of actuators        K_x = D_aᵀ diag(k_x) D_a
//! … of inverse dynamics        K_x = k_x M̂
//! soft spring                  K_p = ω² M,  K_d = 2 ω M,  K_i = 0
//! ```
//!
//! all of it at `x_m + e`. A model that is right stays on the recorded motion; a torque `r` that it
//! lacks moves it by about `K_p⁻¹ r` where it changes slowly, by less where it changes fast. The step is
//! implicit in the velocity (Moreau 1988), one a sample; dry friction is set-valued, from the same
//! quadratic program as in [`simulate`](crate::simulate).
//!
//! Effects act as the torque that their columns give along the recorded motion, not along the
//! simulated one. Torque noise is not taken off.

use super::catalogue::{Context, Effect, Place, Shape};
use super::controller::{Feedback, Kind as Acts};
use super::data::Data;
use super::payload::Load;
use super::thresholds::THRESHOLDS as T;
use crate::error::{Error, Result};
use crate::report::format::unit_of;
use crate::robot::Robot;
use crate::signals::series::Series;
use crate::simulate::Dynamics;
use crate::simulate::control::actuation;
use crate::simulate::friction::hold;
use crate::trajectory::certificate::Kind;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Longest part of a record that is simulated, s.
pub const LONGEST: f64 = T.forward.longest;
/// The models, in the order of every array of three.
pub const MODELS: [&str; 3] = ["nominal", "refitted", "improved"];

/// Simulation of one record with the three [`MODELS`].
#[derive(Debug, Clone, serde::Serialize)]
pub struct Simulated {
    /// name of the record
    pub record: String,
    /// whether it was fitted to
    pub fit: bool,
    /// rms of the deviation from the log by actuator, rad or m; `None` for a model that cannot be
    /// simulated
    pub rms: [Option<Vec<f64>>; 3],
    /// rms of the torque by which the controller answers the deviation, by actuator, N m or N; only under an
    /// identified controller
    pub torque: [Option<Vec<f64>>; 3],
    /// times, s
    pub t: Vec<f64>,
    /// deviation by actuator, rad or m; empty for a model that cannot be simulated
    pub deviation: [Vec<Vec<f64>>; 3],
}

/// Forward simulation of the holdout records (of the first fitted one where there is none).
#[derive(Debug, Clone, Default, serde::Serialize)]
pub struct Forward {
    /// records
    pub records: Vec<Simulated>,
    /// units of the deviations by actuator
    pub units: Vec<&'static str>,
    /// the feedback of the logs' controller, or why a soft spring stands in its place
    pub held: Option<std::result::Result<Feedback, String>>,
    /// models that could not be simulated, in words
    pub failed: Vec<String>,
}

/// Torque of effects with their coefficients along the recorded motion, by actuator over all records.
pub fn effects_torque<'e>(
    cx: &Context,
    all: impl Iterator<Item = (&'e dyn Effect, Place, &'e Shape, &'e [f64])>,
) -> Vec<Vec<f64>> {
    let data = cx.data;
    let mut torque = vec![vec![0.0; data.rows()]; data.joints()];
    for (effect, place, shape, eta) in all {
        let columns = effect.columns(cx, &place, shape, false);
        for (column, eta) in columns.iter().zip(eta) {
            column.add_to(*eta, &mut torque);
        }
    }
    torque
}

/// Simulates with the parameters of the three [`MODELS`]; the torque of the effects acts in the last.
/// `held` is the feedback that answers deviations, or why it is not known.
pub fn forward(
    data: &Data,
    phi: [&[f64]; 3],
    effects: &[Vec<f64>],
    held: std::result::Result<Feedback, String>,
) -> Forward {
    let count = data.plant.parameters().len();
    let robots = phi.map(|phi| data.plant.with_values(&phi[..count]));
    let kept: Vec<usize> = (0..data.records.len())
        .filter(|k| !data.records[*k].fit)
        .collect();
    let chosen = if kept.is_empty() { vec![0] } else { kept };
    let tasks: Vec<(usize, usize)> = chosen
        .iter()
        .flat_map(|k| (0..3).map(|m| (*k, m)))
        .collect();
    let mut runs = tasks
        .par_iter()
        .map(|(k, m)| {
            let effects = (*m == 2).then_some(effects);
            let load = data.load(*k, phi[*m]);
            run(data, *k, (&robots[*m], load), effects, held.as_ref().ok())
        })
        .collect::<Vec<_>>()
        .into_iter();
    let mut out = Forward {
        units: (0..data.joints())
            .map(|j| unit_of(Kind::Position, data.plant.actuators()[j].motion))
            .collect(),
        ..Forward::default()
    };
    for k in chosen {
        let r = &data.records[k];
        let [mut deviation, mut torque] = [const { [const { Vec::new() }; 3] }; 2];
        for (m, model) in MODELS.into_iter().enumerate() {
            match runs.next() {
                Some(Ok(of)) => [deviation[m], torque[m]] = of,
                Some(Err(e)) => out.failed.push(format!("{}, {model} model: {e}", r.name)),
                None => {}
            }
        }
        let rms = |x: &Vec<f64>| (x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64).sqrt();
        let each = |x: &Vec<Vec<f64>>| {
            let ran = x.first().is_some_and(|row| !row.is_empty());
            ran.then(|| x.iter().map(rms).collect())
        };
        out.records.push(Simulated {
            record: r.name.clone(),
            fit: r.fit,
            rms: deviation.each_ref().map(each),
            torque: torque.each_ref().map(each),
            t: (0..length(r)).map(|i| i as f64 * r.dt).collect(),
            deviation,
        });
    }
    out.held = Some(held);
    out
}

/// Samples of a record that are simulated.
fn length(r: &Series) -> usize {
    r.count.min((LONGEST / r.dt) as usize + 1)
}

/// What a feedback answers, as generalised forces: `stiff e + damping ė + slow`.
struct Answer {
    stiff: DMatrix<f64>,
    damping: DMatrix<f64>,
    slow: DVector<f64>,
}

impl Answer {
    /// Of a feedback of the actuators, with the integral of their deviation.
    fn of_actuators(gains: &[[f64; 3]], d_a: &DMatrix<f64>, sum: &DVector<f64>) -> Self {
        let (na, m) = d_a.shape();
        let of = |part: usize| {
            d_a.tr_mul(&DMatrix::from_fn(na, m, |j, c| {
                gains[j][part] * d_a[(j, c)]
            }))
        };
        Answer {
            stiff: of(0),
            damping: of(1),
            slow: d_a.tr_mul(&DVector::from_fn(na, |j, _| gains[j][2] * sum[j])),
        }
    }

    /// Of inverse dynamics, with the nominal mass matrix and the integral of the coordinates' deviation.
    fn of_inverse_dynamics(
        [kp, kd, ki]: [f64; 3],
        mass: &DMatrix<f64>,
        sum: &DVector<f64>,
    ) -> Self {
        Answer {
            stiff: mass * kp,
            damping: mass * kd,
            slow: mass * sum * ki,
        }
    }
}

/// Deviation from record `k`, run by a robot with its load, by actuator, and the torque by which the controller
/// answers it.
fn run(
    data: &Data,
    k: usize,
    (robot, load): (&Robot, Option<Load>),
    effects: Option<&[Vec<f64>]>,
    held: Option<&Feedback>,
) -> Result<[Vec<Vec<f64>>; 2]> {
    let (plant, r) = (data.plant, &data.records[k]);
    let (m, n, na) = (plant.coordinates(), robot.dof(), data.joints());
    let mut bodies: Vec<f64> = robot.bodies.iter().flat_map(|b| b.inertia.0).collect();
    if let (Some(load), Some(tool)) = (load, plant.tool()) {
        let body = bodies[10 * tool..].iter_mut().zip(load);
        body.for_each(|(b, l)| *b += l);
    }
    let armature = robot.joints.iter().map(|j| j.terms[0]).collect();
    let mut dynamics = Dynamics::new(plant, bodies, armature, robot.gravity);
    let viscous = DVector::from_fn(n, |j, _| robot.joints[j].terms[1]);
    let offset = DVector::from_fn(n, |j, _| robot.joints[j].terms[3]);
    let dry: Vec<usize> = (0..n)
        .filter(|j| robot.joints[*j].terms[2].max(0.0) + robot.joints[*j].stribeck.force > 0.0)
        .collect();

    let (h, omega) = (r.dt, TAU * super::controller::BANDWIDTH);
    let at = |rows: &[f64], i: usize| DVector::from_fn(m, |c, _| rows[c * r.count + i]);
    let span = (0..m)
        .map(|c| {
            let row = &r.x.q[c * r.count..(c + 1) * r.count];
            row.iter().fold(0.0f64, |a, v| a.max((v - row[0]).abs()))
        })
        .fold(1.0, f64::max);
    let mut nominal = Dynamics::nominal(plant);
    let (mut e, mut ed) = (DVector::zeros(m), DVector::zeros(m));
    // integral of the deviation, of the actuators or of the coordinates
    let mut sum = DVector::zeros(match held {
        Some(f) if f.kind == Acts::Actuators => na,
        _ => m,
    });
    let mut out = vec![Vec::with_capacity(length(r)); na];
    let mut torque = out.clone();
    for i in 0..length(r) {
        let (v, a) = (at(&r.x.qd, i), at(&r.x.qdd, i));
        let terms = dynamics.terms(&(at(&r.x.q, i) + &e), &(&v + &ed))?;
        let moved: DVector<f64> = &terms.d_a * &e;
        out.iter_mut()
            .zip(moved.iter())
            .for_each(|(o, x)| o.push(*x));
        let tau = DVector::from_fn(na, |j, _| {
            let row = data.start[k] + i;
            data.tau[j][row] - effects.map_or(0.0, |t| t[j][row])
        });
        let steady = &terms.d * &v;
        let opposed = terms.d.tr_mul(&(viscous.component_mul(&steady) + &offset));
        let Answer {
            stiff,
            damping,
            slow,
        } = match held {
            None => Answer {
                stiff: &terms.mass * omega.powi(2),
                damping: &terms.mass * (2.0 * omega),
                slow: DVector::zeros(m),
            },
            Some(f) => match f.kind {
                Acts::Actuators => {
                    sum += &moved * h;
                    Answer::of_actuators(&f.gains, &terms.d_a, &sum)
                }
                Acts::InverseDynamics => {
                    sum += &e * h;
                    let mass = nominal.terms(&at(&r.x.q, i), &v)?.mass;
                    Answer::of_inverse_dynamics(f.gains[0], &mass, &sum)
                }
            },
        };
        let force = terms.d_a.tr_mul(&tau) - &terms.mass * &a - &stiff * &e - &slow - &terms.bias;
        let slope = terms
            .d
            .tr_mul(&DMatrix::from_fn(n, m, |j, c| viscous[j] * terms.d[(j, c)]));
        let left = &terms.mass + (&damping + slope + &stiff * h) * h;
        let Some(left) = left.cholesky() else {
            return Err(Error::Infeasible(format!(
                "its mass matrix is not positive definite at {:.3} s: no such robot exists",
                i as f64 * r.dt
            )));
        };
        let free = left.solve(&(&terms.mass * &ed + (force - opposed) * h));
        let rows = DMatrix::from_fn(dry.len(), m, |d, c| terms.d[(dry[d], c)]);
        let spread = left.solve(&rows.transpose()) * h;
        let now: DVector<f64> = &terms.d * (&v + &ed);
        let coulomb: Vec<f64> = dry
            .iter()
            .map(|&j| robot.joints[j].terms[2].max(0.0) + robot.joints[j].stribeck.level(now[j]))
            .collect();
        let slack: Vec<f64> = coulomb.iter().map(|f| -f).collect();
        let friction = hold(
            &(&rows * &spread),
            &(&rows * (&v + &free)),
            &slack,
            &coulomb,
        );
        ed = free - spread * friction;
        if held.is_some() {
            let sent = actuation(&terms.d_a) * (&stiff * &e + &damping * &ed + &slow);
            let each = torque.iter_mut().zip(sent.iter());
            each.for_each(|(o, x)| o.push(*x));
        }
        e += &ed * h;
        if !e.iter().all(|x| x.abs() < T.forward.far * span) {
            return Err(Error::Infeasible(format!(
                "the simulated robot leaves the recorded motion at {:.3} s",
                i as f64 * r.dt
            )));
        }
    }
    Ok([out, torque])
}
