//! Predicted against achieved spread of the base parameters over many rehearsals.
//!
//! The motion is simulated once; every rehearsal measures it with other torque noise and another
//! position of the encoder steps, and identifies the base parameters from the measurement alone:
//! periods averaged, positions and torques limited to the band below the cut-off by their Fourier
//! coefficients (which also gives velocities and accelerations), the regressor filtered alike, and
//! weighted least squares. The prediction is that of the report before the run,
//! `C = (W_bᵀ Σ⁻¹ W_b)⁻¹` over the *commanded* motion, for as many samples as the log has.

use super::record::{Measured, Sensors, measure};
use super::{Run, Settings};
use crate::base::BaseParameters;
use crate::dynamics::Samples;
use crate::error::{Error, Result};
use crate::plant::{Column, Plant};
use crate::trajectory::Fourier;
use faer::linalg::solvers::{Solve, SolveLstsq};
use faer::{Mat, Side};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// One base parameter over all rehearsals.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Spread {
    /// name of its kept column
    pub parameter: String,
    /// SI unit
    pub unit: String,
    /// value of the simulated robot, where it is one of the model's parameters alone
    pub truth: f64,
    /// standard deviation predicted from the commanded motion and the stated noise
    pub predicted: f64,
    /// standard deviation over the rehearsals
    pub achieved: f64,
    /// mean over the rehearsals minus the truth
    pub bias: f64,
}

/// Result of [`monte_carlo`].
#[derive(Debug, Clone, serde::Serialize)]
pub struct MonteCarlo {
    /// rehearsals
    pub rehearsals: usize,
    /// cut-off of positions and torques, Hz
    pub cutoff: f64,
    /// base parameters
    pub parameters: Vec<Spread>,
    /// median over the base parameters of achieved over predicted standard deviation
    pub median_ratio: f64,
}

/// Parameters of the simulated robot in the order of [`Plant::parameters`].
pub fn true_parameters(plant: &Plant, settings: &Settings) -> Vec<f64> {
    let phi = settings.effects.inertia(plant, settings.seed);
    let terms = settings.effects.terms(plant, settings.seed);
    let one = |kind: Column| match kind {
        Column::Inertial { body, k } => phi[10 * body + k],
        Column::Term { joint, term } => terms[joint][term as usize],
        Column::Nuisance => 0.0,
    };
    plant.parameters().iter().map(|p| one(p.kind)).collect()
}

/// Orthonormal trigonometric basis of one period: `rows` equidistant points, `1, cos, sin …` up to
/// harmonic `k`; `order` of the time derivative.
fn basis(rows: usize, k: usize, period: f64, order: u32) -> Mat<f64> {
    Mat::from_fn(rows, 2 * k + 1, |i, c| {
        let h = c.div_ceil(2);
        let angle = TAU * ((h * i) % rows) as f64 / rows as f64;
        let w = (h as f64 * TAU / period).powi(order as i32);
        if c == 0 {
            return if order == 0 { 1.0 } else { 0.0 };
        }
        // cos at odd columns, sin at even ones, turned by a quarter an order
        let quarter = f64::from(order) * 0.25 * TAU;
        match c % 2 {
            1 => w * (angle + quarter).cos(),
            _ => w * (angle + quarter).sin(),
        }
    })
}

/// Fourier coefficients of `signal` (one period, equidistant) up to harmonic `k`.
fn coefficients(signal: &[f64], k: usize) -> Vec<f64> {
    let n = signal.len();
    let cos: Vec<f64> = (0..n).map(|i| (TAU * i as f64 / n as f64).cos()).collect();
    let sin: Vec<f64> = (0..n).map(|i| (TAU * i as f64 / n as f64).sin()).collect();
    (0..2 * k + 1)
        .map(|c| {
            let h = c.div_ceil(2);
            let table = if c % 2 == 1 || c == 0 { &cos } else { &sin };
            let sum: f64 = signal
                .iter()
                .enumerate()
                .map(|(i, v)| v * table[(h * i) % n])
                .sum();
            sum / n as f64 * if c == 0 { 1.0 } else { 2.0 }
        })
        .collect()
}

/// Mean period of actuator-major signals.
fn average(signal: &[f64], count: usize, periods: usize) -> Vec<f64> {
    let n = count / periods;
    signal
        .chunks_exact(count)
        .flat_map(|row| {
            (0..n).map(move |i| (0..periods).map(|p| row[p * n + i]).sum::<f64>() / periods as f64)
        })
        .collect()
}

/// What all rehearsals share.
struct Setup<'a> {
    plant: &'a Plant,
    base: BaseParameters,
    sensors: &'a Sensors,
    period: f64,
    periods: usize,
    harmonics: usize,
    start: Vec<f64>,
}

impl Setup<'_> {
    /// Base parameters from one measurement.
    fn estimate(&self, measured: &Measured, count: usize) -> Result<Vec<f64>> {
        let na = self.sensors.torque_noise.len();
        let n = count / self.periods;
        let k = self.harmonics;
        let q = average(&measured.q, count, self.periods);
        let tau = average(&measured.tau, count, self.periods);
        let x = self.plant.coordinates_from(&self.start, &q, n)?;
        let m = x.len() / n;
        let dense = (16 * k).clamp(800, 20_000);
        let mut motion = Samples::zeros(m, dense);
        for order in 0..3 {
            let b = basis(dense, k, self.period, order);
            for c in 0..m {
                let coefficients = coefficients(&x[c * n..(c + 1) * n], k);
                let values = &b * faer::ColRef::from_slice(&coefficients);
                let to = match order {
                    0 => &mut motion.q,
                    1 => &mut motion.qd,
                    _ => &mut motion.qdd,
                };
                for i in 0..dense {
                    to[c * dense + i] = values[i];
                }
            }
        }
        let w = self.plant.regressor(&motion)?;
        let w = self.base.select(w.as_ref());
        let known = self.plant.known_torque(&motion)?;
        // the band of the torques, as coefficients: white again
        let rows = 2 * k + 1;
        let project = Mat::from_fn(rows, dense, |c, i| {
            let h = c.div_ceil(2);
            let angle = TAU * ((h * i) % dense) as f64 / dense as f64;
            let value = if c % 2 == 1 || c == 0 {
                angle.cos()
            } else {
                angle.sin()
            };
            value / dense as f64 * if c == 0 { 1.0 } else { 2.0f64.sqrt() }
        });
        let b = self.base.count();
        let mut a = Mat::<f64>::zeros(na * rows, b);
        let mut y = Mat::<f64>::zeros(na * rows, 1);
        for j in 0..na {
            let noise = self.sensors.torque_noise[j].max(f64::MIN_POSITIVE);
            let weight = if noise > 1e-300 { 1.0 / noise } else { 1.0 };
            let part = &project * w.subrows(j * dense, dense);
            let own = coefficients(&tau[j * n..(j + 1) * n], k);
            let model = &project * faer::ColRef::from_slice(&known[j * dense..(j + 1) * dense]);
            for r in 0..rows {
                let scale = if r == 0 { 1.0 } else { 0.5f64.sqrt() };
                y[(j * rows + r, 0)] = weight * (own[r] * scale - model[r]);
                for c in 0..b {
                    a[(j * rows + r, c)] = weight * part[(r, c)];
                }
            }
        }
        let solution = a.qr().solve_lstsq(&y);
        Ok((0..b).map(|c| solution[(c, 0)]).collect())
    }
}

/// Most rehearsals.
const MOST: usize = 100_000;

/// Measures and identifies `rehearsals` times.
///
/// # Errors
/// [`Error::Argument`]: fewer than two rehearsals, or a log whose period is not a whole number of
/// samples; otherwise as the functions it calls.
pub fn monte_carlo(
    plant: &Plant,
    fourier: &Fourier,
    run: &Run,
    settings: &Settings,
    sensors: &Sensors,
    rehearsals: usize,
) -> Result<MonteCarlo> {
    let count = run.t.len();
    let n = (fourier.period * settings.rate).round() as usize;
    let whole = (fourier.period * settings.rate - n as f64).abs() < 1e-6 * n as f64;
    if !(2..=MOST).contains(&rehearsals) {
        return Err(Error::Argument(format!(
            "--monte-carlo takes from 2 to {MOST} rehearsals, not {rehearsals}"
        )));
    }
    if !whole || n == 0 || !count.is_multiple_of(n) {
        return Err(Error::Argument(format!(
            "--monte-carlo averages periods: the period of {} s must be a whole number of samples; \
             change --rate from {} Hz",
            fourier.period, settings.rate
        )));
    }
    let base = plant.base()?;
    // as wide as the excitation and the friction's corners need, as narrow as the noise allows
    let highest = fourier.harmonic_max() as usize;
    let harmonics = (4 * highest + 10).min((n.saturating_sub(1) / 4).max(1));
    let setup = Setup {
        plant,
        base,
        sensors,
        period: fourier.period,
        periods: count / n,
        harmonics,
        start: (0..run.motion.dof)
            .map(|c| run.motion.q[c * count])
            .collect(),
    };
    let estimates = (0..rehearsals as u64)
        .into_par_iter()
        .map(|r| {
            let seed = settings.seed.wrapping_add(0x1_0000 + r);
            let measured = measure(run, sensors, &settings.effects, seed);
            setup.estimate(&measured, count)
        })
        .collect::<Result<Vec<_>>>()?;
    let truth = setup.base.project(&true_parameters(plant, settings));
    let predicted = predict(&setup, fourier, count)?;
    let parameters: Vec<Spread> = (0..setup.base.count())
        .map(|c| {
            let values: Vec<f64> = estimates.iter().map(|e| e[c]).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let variance =
                values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64;
            Spread {
                parameter: setup.base.name(c).to_string(),
                unit: setup.base.units[setup.base.kept[c]].to_string(),
                truth: truth[c],
                predicted: predicted[c],
                achieved: variance.sqrt(),
                bias: mean - truth[c],
            }
        })
        .collect();
    let mut ratios: Vec<f64> = parameters
        .iter()
        .map(|p| p.achieved / p.predicted)
        .filter(|r| r.is_finite())
        .collect();
    ratios.sort_by(f64::total_cmp);
    Ok(MonteCarlo {
        rehearsals,
        cutoff: harmonics as f64 / fourier.period,
        median_ratio: ratios.get(ratios.len() / 2).copied().unwrap_or(f64::NAN),
        parameters,
    })
}

/// Standard deviations from the commanded motion, as the report before the run predicts them, for
/// `count` samples.
fn predict(setup: &Setup, fourier: &Fourier, count: usize) -> Result<Vec<f64>> {
    let motion = crate::trajectory::sample_period(fourier);
    let w = setup.plant.regressor(&motion)?;
    let mut w = setup.base.select(w.as_ref());
    for c in 0..w.ncols() {
        for r in 0..w.nrows() {
            w[(r, c)] /= setup.sensors.torque_noise[r / motion.count].max(1e-300);
        }
    }
    let information = w.transpose() * &w;
    let b = setup.base.count();
    let scale = motion.count as f64 / count as f64;
    Ok(match information.llt(Side::Lower) {
        Ok(llt) => {
            let covariance = llt.solve(Mat::<f64>::identity(b, b));
            (0..b)
                .map(|c| (covariance[(c, c)] * scale).sqrt())
                .collect()
        }
        Err(_) => vec![f64::INFINITY; b],
    })
}
