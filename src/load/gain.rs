//! Drive gains from a known load: errors of the torque constants told apart from errors of the model.
//!
//! A factor `k_j` of the measured torques of joint `j` cannot be told from a factor of all
//! parameters that act on it, unless something is known. With records of the empty robot and of the
//! robot with a **known** load `φ_k` (Gautier & Briot 2014),
//!
//! ```text
//! τ_j = k_j (τ_model + Z Δ [+ Y_t φ_k] + friction)_j
//! ```
//!
//! is solved for `k`, `Δ` and friction by Gauss-Newton. The errors stay with the measured torques, so
//! that the small difference that the load makes is not attenuated, which least squares in
//! `τ_j / k_j` would do.

use super::Loaded;
use super::body::from_quantities;
use super::system::System;
use super::weight::inflation;
use crate::error::{Error, Result, Warning, WarningKind};
use crate::log::Payload;
use crate::plant::Plant;
use faer::Mat;
use faer::linalg::solvers::{DenseSolveCore, SolveLstsq};

/// Factors of the measured torques.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Gains {
    /// actuators
    pub joints: Vec<String>,
    /// `k_j`: measured over true torque
    pub value: Vec<f64>,
    /// standard deviations
    pub std: Vec<f64>,
    /// whether `k_j` differs from 1 by more than three of them, and was corrected
    pub corrected: Vec<bool>,
    /// what was found
    #[serde(skip)]
    pub warnings: Vec<Warning>,
}

impl Gains {
    /// Divides the measured torques by the gains that are certain.
    pub fn correct(&self, records: &mut [Loaded]) {
        for loaded in records {
            let count = loaded.record.motion.count;
            let scale = |torque: &mut [f64]| {
                for (a, row) in torque.chunks_exact_mut(count).enumerate() {
                    if self.corrected[a] {
                        row.iter_mut().for_each(|t| *t /= self.value[a]);
                    }
                }
            };
            scale(&mut loaded.record.torque);
            if let Some(p) = &mut loaded.record.periods {
                p.torque.iter_mut().for_each(|t| scale(t));
            }
        }
    }
}

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
    let (na, nd, np) = (
        system.actuators,
        system.deviations.len(),
        system.parts.len(),
    );
    // torque of the known load, part by part
    let known: Vec<Vec<f64>> = system
        .parts
        .iter()
        .zip(&used)
        .map(|(part, loaded)| {
            let Payload::Known { mass, com, inertia } = loaded.payload else {
                return vec![0.0; part.y.len()];
            };
            let mut values = [0.0; 10];
            values[0] = mass;
            values[1..4].copy_from_slice(&com);
            values[4..].copy_from_slice(&inertia.unwrap_or_default());
            let phi = from_quantities(&values).0;
            (0..part.y.len())
                .map(|i| (0..10).map(|k| part.tool[(i, k)] * phi[k]).sum())
                .collect()
        })
        .collect();
    let n = na + nd + 3 * na * np;
    let mut gain = vec![1.0; na];
    let mut sigma = vec![1.0; na];
    let mut covariance = Mat::<f64>::zeros(n, n);
    let mut x = vec![0.0; n];
    for round in 0..25 {
        let rows: usize = system.parts.iter().map(|p| p.y.len()).sum();
        let mut a = Mat::<f64>::zeros(rows + n, n);
        let mut y = Mat::<f64>::zeros(rows + n, 1);
        let mut model = Vec::with_capacity(rows);
        let mut r = 0;
        for (p, part) in system.parts.iter().enumerate() {
            for i in 0..part.y.len() {
                let j = i / part.count;
                let w = 1.0 / sigma[j];
                // torque without gain: rigid model, deviations, known load, friction
                let mut inner = part.torque[i] - part.y[i] + known[p][i];
                for c in 0..nd {
                    inner += x[na + c] * part.deviation[(i, c)];
                    a[(r, na + c)] = w * gain[j] * part.deviation[(i, c)];
                }
                let first = na + nd + 3 * (p * na + j);
                for f in 0..3 {
                    inner += x[first + f] * part.friction[f][i];
                    a[(r, first + f)] = w * gain[j] * part.friction[f][i];
                }
                a[(r, j)] = w * inner;
                y[(r, 0)] = w * (part.torque[i] - gain[j] * inner);
                model.push(inner);
                r += 1;
            }
        }
        for c in 0..n {
            let norm = a.col(c).norm_l2();
            a[(rows + c, c)] = 1e-9 * if norm > 0.0 { norm } else { 1.0 };
        }
        let qr = a.qr();
        let step = qr.solve_lstsq(&y);
        let mut change = 0.0f64;
        for j in 0..na {
            gain[j] += step[(j, 0)];
            change = change.max(step[(j, 0)].abs());
        }
        for c in na..n {
            x[c] += step[(c, 0)];
        }
        if gain.iter().any(|g| !g.is_finite()) {
            return Err(Error::Infeasible(
                "the drive gains have no finite solution; the known load may be too small to be \
                 felt"
                    .into(),
            ));
        }
        // noise of each joint from what is left
        let mut r = 0;
        let mut square = vec![0.0; na];
        let mut count = vec![0usize; na];
        let mut rest: Vec<Vec<f64>> = vec![Vec::new(); na];
        for part in &system.parts {
            for i in 0..part.y.len() {
                let j = i / part.count;
                let e = part.torque[i] - gain[j] * model[r];
                square[j] += e * e;
                count[j] += 1;
                rest[j].push(e);
                r += 1;
            }
        }
        let worth: Vec<f64> = rest.iter().map(|e| inflation(e)).collect();
        if round > 2 && change < 1e-10 {
            let thin = qr.thin_R();
            let information = thin.transpose() * thin;
            covariance = information.partial_piv_lu().inverse();
            for j in 0..na {
                covariance[(j, j)] *= worth[j];
            }
            break;
        }
        for j in 0..na {
            sigma[j] = (square[j] / count[j].max(1) as f64).sqrt().max(1e-12);
        }
        if round == 24 {
            return Err(Error::Infeasible(
                "the drive gains do not converge: the known load is too small to be felt on every \
                 drive"
                    .into(),
            ));
        }
    }
    let joints: Vec<String> = plant.actuators().iter().map(|j| j.name.clone()).collect();
    let std: Vec<f64> = (0..na)
        .map(|j| covariance[(j, j)].max(0.0).sqrt())
        .collect();
    let corrected: Vec<bool> = (0..na)
        .map(|j| (gain[j] - 1.0).abs() > 3.0 * std[j] && std[j] < 0.2)
        .collect();
    let warnings = (0..na)
        .filter(|&j| corrected[j])
        .map(|j| {
            Warning::new(
                WarningKind::DriveGainApplied,
                joints[j].clone(),
                format!(
                    "measured torques are {:.3} ± {:.3} times what the known load tells; they were \
                     divided by it",
                    gain[j], std[j]
                ),
            )
        })
        .collect();
    Ok(Gains {
        joints,
        value: gain,
        std,
        corrected,
        warnings,
    })
}
