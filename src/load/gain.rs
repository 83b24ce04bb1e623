//! Drive gains from a known load: errors of the torque constants told apart from errors of the model.
//!
//! A factor `k_j` of the measured torques of joint `j` cannot be told from a factor of all
//! parameters that act on it, unless something is known. With records of the empty robot and of the
//! robot with a **known** load `φ_k` (Gautier & Briot 2014),
//!
//! ```text
//! τ_j = k_j (τ_model + W δ [+ Y_t φ_k] + friction)_j
//! ```
//!
//! is solved for `k`, `δ` and friction by Gauss-Newton. The errors stay with the measured torques, so
//! that the small difference that the load makes is not attenuated, which least squares in
//! `τ_j / k_j` would do.

use super::records::Loaded;
use super::system::{Part, System};
use super::weight::inflation;
use crate::error::{Error, Result, Warning, WarningKind};
use crate::log::Payload;
use crate::plant::Plant;
use crate::robot::Inertia;
use faer::linalg::solvers::{DenseSolveCore, SolveLstsq};
use faer::{Mat, Side};
use rayon::prelude::*;

/// Factors of the measured torques.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Gains {
    /// actuators
    pub joints: Vec<String>,
    /// `k_j`: measured over true torque
    pub value: Vec<f64>,
    /// standard deviations
    pub std: Vec<f64>,
    /// whether `k_j` differs from 1 by more than three of them
    pub corrected: Vec<bool>,
    /// what the torques are divided by: `k_j` shrunk towards 1 by its uncertainty
    pub used: Vec<f64>,
    /// their standard deviations
    pub used_std: Vec<f64>,
    /// their covariance
    #[serde(skip)]
    pub covariance: Mat<f64>,
    /// what was found
    #[serde(skip)]
    pub warnings: Vec<Warning>,
}

impl Gains {
    /// Divides the measured torques by the gains.
    pub fn correct(&self, records: &mut [Loaded]) {
        divide(records, &self.used);
    }

    /// Covariance that the gains add to parameters that `estimate` finds from records whose torques are right, with
    /// these parameters: one step along every column of a root of theirs.
    ///
    /// # Errors
    /// As `estimate`.
    pub(super) fn carried_over(
        &self,
        records: &[Loaded],
        found: &[f64; 10],
        estimate: impl Fn(&[Loaded]) -> Result<[f64; 10]> + Sync,
    ) -> Result<Mat<f64>> {
        let n = self.used.len();
        let root = match self.covariance.llt(Side::Lower) {
            Ok(f) => f.L().to_owned(),
            Err(_) => Mat::from_fn(n, n, |i, k| if i == k { self.used_std[i] } else { 0.0 }),
        };
        let step = |k: usize| -> Result<[f64; 10]> {
            let off: Vec<f64> = (0..n).map(|j| 1.0 + root[(j, k)] / self.used[j]).collect();
            let mut moved = records.to_vec();
            divide(&mut moved, &off);
            let other = estimate(&moved)?;
            Ok(std::array::from_fn(|i| other[i] - found[i]))
        };
        let all: Vec<[f64; 10]> = (0..n).into_par_iter().map(step).collect::<Result<_>>()?;
        Ok(Mat::from_fn(10, 10, |i, k| {
            all.iter().map(|d| d[i] * d[k]).sum()
        }))
    }
}

/// Divides the measured torques of every actuator.
fn divide(records: &mut [Loaded], by: &[f64]) {
    for loaded in records {
        let count = loaded.record.motion.count;
        let scale = |torque: &mut [f64]| {
            for (row, by) in torque.chunks_exact_mut(count).zip(by) {
                row.iter_mut().for_each(|t| *t /= by);
            }
        };
        scale(&mut loaded.record.torque);
        if let Some(p) = &mut loaded.record.periods {
            p.torque.iter_mut().for_each(|t| scale(t));
        }
    }
}

/// Rounds of Gauss-Newton at most, and those before it may end.
const ROUNDS: [usize; 2] = [25, 2];
/// Change of the gains at which it ends.
const SETTLED: f64 = 1e-10;
/// A gain is certain where it differs from 1 by more than this many of its standard deviations.
const CERTAIN: f64 = 3.0;
/// How far the torque constant of a drive may be from its data sheet, standard deviation: a gain that the known load
/// hardly tells stays at 1.
const ORDINARY: f64 = 0.1;
/// Correction that is worth a word.
const SAID: f64 = 2e-3;

/// Estimates the gains from the records with a known load and those without a load.
///
/// # Errors
/// No record of the empty robot, or no finite solution.
pub fn estimate(plant: &Plant, tool: usize, records: &[Loaded]) -> Result<Gains> {
    let used: Vec<&Loaded> = records
        .iter()
        .filter(|r| r.payload != Payload::Unknown)
        .collect();
    if !used.iter().any(|r| r.payload == Payload::None) {
        return Err(Error::Infeasible(
            "records with a known payload tell the drive gains only together with records of the \
             empty robot (payload = \"none\")"
                .into(),
        ));
    }
    let system = System::new(plant, tool, &used, true)?;
    let known = system.parts.iter().zip(&used);
    let known = known.map(|(part, loaded)| known_torque(part, loaded));
    let weights = weights_of(&used);
    let (gain, covariance) = gauss_newton(&system, &known.collect::<Vec<_>>(), &weights)?;
    Ok(judged(plant, gain, covariance))
}

/// Of every record the place of its weight among those of which only the mass is known; weights of one mass are one.
fn weights_of(records: &[&Loaded]) -> Vec<Option<usize>> {
    let mut masses: Vec<f64> = Vec::new();
    let mut place = |payload: Payload| match payload {
        Payload::Known {
            mass, com: None, ..
        } => {
            let at = masses.iter().position(|m| *m == mass);
            Some(at.unwrap_or_else(|| {
                masses.push(mass);
                masses.len() - 1
            }))
        }
        _ => None,
    };
    records.iter().map(|r| place(r.payload)).collect()
}

/// Torque of the known load of a record.
fn known_torque(part: &Part, loaded: &Loaded) -> Vec<f64> {
    let Payload::Known { mass, com, inertia } = loaded.payload else {
        return vec![0.0; part.y.len()];
    };
    // of a weight the mass alone: where it is and how it is spread are unknowns
    let mut values = [0.0; 10];
    values[0] = mass;
    values[1..4].copy_from_slice(&com.unwrap_or_default());
    values[4..].copy_from_slice(&inertia.unwrap_or_default());
    let phi = Inertia::from_quantities(&values).0;
    (0..part.y.len())
        .map(|i| (0..10).map(|k| part.tool[(i, k)] * phi[k]).sum())
        .collect()
}

/// Gains, deviations and friction, and the noise of each joint.
struct State {
    gain: Vec<f64>,
    /// deviations, then Coulomb, viscous and constant friction of every joint in every record
    rest: Vec<f64>,
    sigma: Vec<f64>,
}

/// Gains and their covariance, by Gauss-Newton with the noise of each joint from what is left. `weights` are those of
/// [`weights_of`].
fn gauss_newton(
    system: &System,
    known: &[Vec<f64>],
    weights: &[Option<usize>],
) -> Result<(Vec<f64>, Mat<f64>)> {
    let na = system.actuators;
    let weighed = weights.iter().flatten().max().map_or(0, |last| last + 1);
    let others = system.deviations.len() + 3 * na * system.parts.len() + SPREAD * weighed;
    let mut state = State {
        gain: vec![1.0; na],
        rest: vec![0.0; others],
        sigma: vec![1.0; na],
    };
    let [most, least] = ROUNDS;
    for round in 0..most {
        let (a, y, model) = linearised(system, known, weights, &state);
        let qr = a.qr();
        let step = qr.solve_lstsq(&y);
        let mut change = 0.0f64;
        for (j, gain) in state.gain.iter_mut().enumerate() {
            *gain += step[(j, 0)];
            change = change.max(step[(j, 0)].abs());
        }
        for (c, x) in state.rest.iter_mut().enumerate() {
            *x += step[(na + c, 0)];
        }
        if state.gain.iter().any(|g| !g.is_finite()) {
            return Err(Error::Infeasible(
                "the drive gains have no finite solution; the known load may be too small to be \
                 felt"
                    .into(),
            ));
        }
        let left = residuals(system, &state.gain, &model);
        if round > least && change < SETTLED {
            let thin = qr.thin_R();
            let covariance = (thin.transpose() * thin).partial_piv_lu().inverse();
            let wider: Vec<f64> = left.iter().map(|e| inflation(e).max(0.0).sqrt()).collect();
            let own = |i: usize, k: usize| covariance[(i, k)] * wider[i] * wider[k];
            return Ok((state.gain, Mat::from_fn(na, na, own)));
        }
        for (sigma, e) in state.sigma.iter_mut().zip(&left) {
            let square = e.iter().fold(0.0, |s, e| s + e * e);
            *sigma = (square / e.len().max(1) as f64).sqrt().max(1e-12);
        }
    }
    Err(Error::Infeasible(
        "the drive gains do not converge: the known load is too small to be felt on every \
         drive"
            .into(),
    ))
}

/// Unknowns of a weight beside its mass: three first moments, six of the tensor.
const SPREAD: usize = 9;

/// Weighted rows about a state, right-hand side, and the torques without gain.
fn linearised(
    system: &System,
    known: &[Vec<f64>],
    weights: &[Option<usize>],
    state: &State,
) -> (Mat<f64>, Mat<f64>, Vec<f64>) {
    let (na, nd) = (system.actuators, system.deviations.len());
    let n = na + state.rest.len();
    let rows: usize = system.parts.iter().map(|p| p.y.len()).sum();
    let mut a = Mat::<f64>::zeros(rows + n, n);
    let mut y = Mat::<f64>::zeros(rows + n, 1);
    let mut model = Vec::with_capacity(rows);
    let mut r = 0;
    for (p, part) in system.parts.iter().enumerate() {
        for i in 0..part.y.len() {
            let j = i / part.count;
            let w = 1.0 / state.sigma[j];
            // torque without gain: rigid model, deviations, known load, friction
            let mut inner = part.torque[i] - part.y[i] + known[p][i];
            for c in 0..nd {
                inner += state.rest[c] * part.deviation[(i, c)];
                a[(r, na + c)] = w * state.gain[j] * part.deviation[(i, c)];
            }
            let first = nd + 3 * (p * na + j);
            for f in 0..3 {
                inner += state.rest[first + f] * part.friction[f][i];
                a[(r, na + first + f)] = w * state.gain[j] * part.friction[f][i];
            }
            if let Some(weight) = weights[p] {
                let first = nd + 3 * na * system.parts.len() + SPREAD * weight;
                for c in 0..SPREAD {
                    inner += state.rest[first + c] * part.tool[(i, 1 + c)];
                    a[(r, na + first + c)] = w * state.gain[j] * part.tool[(i, 1 + c)];
                }
            }
            a[(r, j)] = w * inner;
            y[(r, 0)] = w * (part.torque[i] - state.gain[j] * inner);
            model.push(inner);
            r += 1;
        }
    }
    for c in 0..n {
        let norm = a.col(c).norm_l2();
        a[(rows + c, c)] = 1e-9 * if norm > 0.0 { norm } else { 1.0 };
    }
    (a, y, model)
}

/// What is left of the measured torques, joint by joint; `model` are the torques without gain.
fn residuals(system: &System, gain: &[f64], model: &[f64]) -> Vec<Vec<f64>> {
    let mut out: Vec<Vec<f64>> = vec![Vec::new(); system.actuators];
    let mut model = model.iter();
    for part in &system.parts {
        for (i, torque) in part.torque.iter().enumerate() {
            let j = i / part.count;
            let inner = model.next().copied().unwrap_or(0.0);
            out[j].push(torque - gain[j] * inner);
        }
    }
    out
}

/// The gains as they are used. With `P = 0.1² 1` what drives ordinarily deviate by and `C` the covariance of the estimate,
/// they are `1 + P (P + C)⁻¹ (k − 1)`, with the covariance `P − P (P + C)⁻¹ P`.
fn judged(plant: &Plant, value: Vec<f64>, covariance: Mat<f64>) -> Gains {
    let joints: Vec<String> = plant.actuators().iter().map(|j| j.name.clone()).collect();
    let n = joints.len();
    let std: Vec<f64> = (0..n).map(|j| covariance[(j, j)].max(0.0).sqrt()).collect();
    let prior = ORDINARY * ORDINARY;
    let sum = Mat::from_fn(n, n, |i, k| {
        covariance[(i, k)] + if i == k { prior } else { 0.0 }
    });
    let inverse = sum.partial_piv_lu().inverse();
    let used: Vec<f64> = (0..n)
        .map(|i| {
            1.0 + (0..n)
                .map(|k| prior * inverse[(i, k)] * (value[k] - 1.0))
                .sum::<f64>()
        })
        .collect();
    let left = Mat::from_fn(n, n, |i, k| {
        let own = if i == k { prior } else { 0.0 };
        own - 0.5 * prior * prior * (inverse[(i, k)] + inverse[(k, i)])
    });
    let used_std: Vec<f64> = (0..n).map(|j| left[(j, j)].max(0.0).sqrt()).collect();
    let pairs = value.iter().zip(&std);
    let corrected = pairs.map(|(k, s)| (k - 1.0).abs() > CERTAIN * s).collect();
    let warnings = (0..n)
        .filter(|&j| (used[j] - 1.0).abs() > SAID)
        .map(|j| {
            Warning::new(
                WarningKind::DriveGainApplied,
                joints[j].clone(),
                format!(
                    "measured torques are {:.3} ± {:.3} times what the known load tells (95 %); they were divided by {:.3}, \
                     which is that drawn towards 1 by its uncertainty",
                    value[j],
                    1.96 * std[j],
                    used[j]
                ),
            )
        })
        .collect();
    Gains {
        joints,
        value,
        std,
        corrected,
        used,
        used_std,
        covariance: left,
        warnings,
    }
}
