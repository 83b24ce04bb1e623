//! The tracking controller of the simulated robot: feedforward along the reference and a
//! proportional-derivative feedback of the tracking error `e = x_r − x` with a stated bandwidth.
//!
//! ```text
//! τ = τ_ff(t) + D_a⁻ᵀ M̂(x_r) (ω² e + 2 ζ ω ė)
//! ```
//!
//! `τ_ff` is the nominal inverse dynamics of the reference (`feedforward`) or its gravity alone
//! (`pd`), `M̂` the nominal mass matrix along the reference: the error dynamics are those of a
//! second-order system of natural frequency `ω` in all coordinates as long as the model is right.
//! The controller does not know the effects. Coulomb friction is fed forward with
//! `tanh(q̇_r / v_0)`, `v_0` 2 % of the joint's fastest reference velocity, so that the command does
//! not jump.

use super::dynamics::Dynamics;
use crate::dynamics::Samples;
use crate::error::Result;
use crate::plant::Plant;
use crate::trajectory::Fourier;
use nalgebra::{DMatrix, DVector};

/// Which controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Controller {
    /// nominal inverse dynamics along the reference, and feedback
    #[default]
    Feedforward,
    /// gravity along the reference, and feedback
    Pd,
}

/// Points a period at which the feedback's inertia is evaluated.
const SCHEDULE: usize = 256;

/// The controller along one periodic reference.
pub struct Tracker<'a> {
    fourier: &'a Fourier,
    omega: f64,
    damping: f64,
    effort: Vec<f64>,
    /// feedforward at equidistant points of a period, point after point
    ahead: Vec<DVector<f64>>,
    /// `D_a⁻ᵀ M̂` at equidistant points of a period
    inertia: Vec<DMatrix<f64>>,
    x: DVector<f64>,
    xd: DVector<f64>,
}

impl<'a> Tracker<'a> {
    /// With natural frequency `bandwidth` (Hz) and damping ratio; the feedforward is tabulated at
    /// `step` or finer.
    ///
    /// # Errors
    /// A reference that the plant cannot take.
    pub fn new(
        plant: &Plant,
        fourier: &'a Fourier,
        kind: Controller,
        bandwidth: f64,
        damping: f64,
        step: f64,
    ) -> Result<Self> {
        let count = ((fourier.period / step).ceil() as usize).max(SCHEDULE);
        let sampled = fourier.sample(count);
        let mut motion = Samples::zeros(fourier.dof(), count);
        for j in 0..fourier.dof() {
            for i in 0..count {
                motion.q[j * count + i] = sampled.q[(j, i)];
                if kind == Controller::Feedforward {
                    motion.qd[j * count + i] = sampled.qd[(j, i)];
                    motion.qdd[j * count + i] = sampled.qdd[(j, i)];
                }
            }
        }
        let mut ahead = plant.nominal_torque(&motion)?;
        let actuators = plant.actuators();
        let moved = plant.actuator_motion(&motion)?;
        for (a, joint) in actuators.iter().enumerate() {
            let coulomb = joint.terms[2];
            let qd = &moved.qd[a * count..(a + 1) * count];
            let slow = 0.02 * qd.iter().fold(0.0f64, |m, v| m.max(v.abs()));
            if joint.dry() != 0.0 && slow > 0.0 {
                for (tau, &v) in ahead[a * count..].iter_mut().zip(qd) {
                    let sign = if v == 0.0 { 0.0 } else { v.signum() };
                    *tau += (coulomb + joint.stribeck.level(v)) * ((v / slow).tanh() - sign);
                }
            }
        }
        let na = actuators.len();
        let ahead = (0..count)
            .map(|i| DVector::from_fn(na, |a, _| ahead[a * count + i]))
            .collect();
        let mut nominal = Dynamics::nominal(plant);
        let zero = DVector::zeros(fourier.dof());
        let mut inertia = Vec::with_capacity(SCHEDULE);
        let mut x = vec![0.0; fourier.dof()];
        for i in 0..SCHEDULE {
            let t = fourier.period * i as f64 / SCHEDULE as f64;
            fourier.evaluate(t, [&mut x]);
            let terms = nominal.terms(&DVector::from_column_slice(&x), &zero)?;
            inertia.push(actuation(&terms.d_a) * &terms.mass);
        }
        Ok(Tracker {
            fourier,
            omega: std::f64::consts::TAU * bandwidth,
            damping,
            effort: actuators.iter().map(|j| j.limits.effort).collect(),
            ahead,
            inertia,
            x: zero.clone(),
            xd: zero,
        })
    }

    /// Torque at time `t`, and whether a limit of the effort cut it.
    pub fn torque(&mut self, t: f64, x: &DVector<f64>, xd: &DVector<f64>) -> (DVector<f64>, bool) {
        let (xr, xdr) = (self.x.as_mut_slice(), self.xd.as_mut_slice());
        self.fourier.evaluate(t, [xr, xdr]);
        let phase = (t / self.fourier.period).rem_euclid(1.0);
        let command = (&self.x - x) * self.omega.powi(2)
            + (&self.xd - xd) * (2.0 * self.damping * self.omega);
        let n = self.inertia.len();
        let at = phase * n as f64;
        let (k, f) = (at as usize % n, at.fract());
        let inertia = &self.inertia[k] * (1.0 - f) + &self.inertia[(k + 1) % n] * f;
        let mut tau = cubic(&self.ahead, phase) + inertia * command;
        let mut cut = false;
        for (t, &limit) in tau.iter_mut().zip(&self.effort) {
            if t.abs() > limit {
                *t = t.clamp(-limit, limit);
                cut = true;
            }
        }
        (tau, cut)
    }
}

/// `D_a⁻ᵀ`, or its pseudo-inverse with more actuators than freedoms (forces of least norm).
pub(crate) fn actuation(d_a: &DMatrix<f64>) -> DMatrix<f64> {
    let top = d_a.norm();
    let zero = || DMatrix::zeros(d_a.nrows(), d_a.ncols());
    if !top.is_finite() {
        return zero();
    }
    d_a.transpose()
        .pseudo_inverse(1e-13 * top)
        .unwrap_or_else(|_| zero())
}

/// Periodic cubic interpolation (Catmull-Rom, third order) of equidistant points of a period.
fn cubic(points: &[DVector<f64>], phase: f64) -> DVector<f64> {
    let n = points.len();
    let at = phase * n as f64;
    let (k, u) = (at as usize % n, at.fract());
    let p = |i: usize| &points[(k + n + i - 1) % n];
    let (u2, u3) = (u * u, u * u * u);
    p(0) * (0.5 * (-u3 + 2.0 * u2 - u))
        + p(1) * (0.5 * (3.0 * u3 - 5.0 * u2 + 2.0))
        + p(2) * (0.5 * (-3.0 * u3 + 4.0 * u2 + u))
        + p(3) * (0.5 * (u3 - u2))
}
