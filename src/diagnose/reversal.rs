//! What a log of any robot may have without being at odds with its model: reversals of friction that are
//! not perfectly sharp, and a motion close to them that friction bends faster than positions show.

// several arrays share the index of an actuator or a sample
#![allow(clippy::needless_range_loop)]

use super::column::Column;
use super::data::Data;
use super::window::sign;

/// Widths over which dry friction may change its sign, shares of the largest speed.
const ROUNDED: [f64; 3] = [2e-3, 4e-3, 8e-3];
/// Share of the dry friction by which a model may be off close to a reversal.
const BENT: f64 = 0.1;
/// How long that lasts to either side, s.
const NEAR: f64 = 0.012;
/// Part of its fastest speed below which a drive of a closed chain may stand.
const STANDS: f64 = 0.01;
/// Time by which velocities from positions are blurred, s.
const BLUR: f64 = 0.015;

impl Data<'_> {
    /// What a log of any robot may have without being at odds with its model: reversals of friction
    /// that are not perfectly sharp, and a motion close to them that friction bends faster than
    /// positions show.
    pub fn ordinary(&mut self) {
        if self.plant.redundant() {
            return;
        }
        let mut nuisances = Vec::new();
        let measured = self.measured();
        for (j, actuator) in self.plant.actuators().into_iter().enumerate() {
            let coulomb = actuator.terms[2].abs();
            if coulomb == 0.0 {
                continue;
            }
            self.weights[j] = match self.plant.mechanism() {
                None => self.doubt(j, coulomb),
                Some(_) => self.sticking(j),
            };
            let kept = self.weights[j].iter_mut().zip(&measured);
            kept.for_each(|(w, m)| *w *= m);
            let sharp = 1e-3 * self.speed[j];
            // tanh of three widths: any rounding in between is close to a sum of them
            for wide in ROUNDED.map(|w| w * self.speed[j]) {
                let column = self.own(j, |_, v| sign(v, wide) - sign(v, sharp));
                nuisances.push(("reversal", Column::on(j, column), 0.5 * coulomb));
            }
        }
        self.add_nuisances(&nuisances);
    }

    /// Weights `1/√(1 + (κ F_c/σ)² b)` of the rows of an actuator: where its velocity changes sign
    /// (`b = 1` within [`NEAR`], 0 from twice that on), friction bends the motion faster than the
    /// positions show, and the model is off by a share `κ` of the friction.
    fn doubt(&self, j: usize, coulomb: f64) -> Vec<f64> {
        let doubt = (BENT * coulomb / self.noise[j].std.max(1e-300)).powi(2);
        self.each(|r, _| {
            let v = r.state(j).1;
            let mut away = vec![f64::INFINITY; v.len()];
            let crossed = |i: usize| i + 1 < v.len() && v[i] * v[i + 1] <= 0.0;
            for i in (0..v.len()).filter(|i| crossed(*i)) {
                let reach = (2.0 * NEAR / r.dt) as usize + 1;
                for k in i.saturating_sub(reach)..(i + reach + 2).min(v.len()) {
                    let distance = (k as f64 - i as f64 - 0.5).abs() * r.dt;
                    away[k] = away[k].min(distance);
                }
            }
            let b = away.iter().map(|d| (2.0 - d / NEAR).clamp(0.0, 1.0));
            b.map(|b| 1.0 / (1.0 + doubt * b).sqrt()).collect()
        })
    }

    /// Weights of the rows of an actuator of a closed chain: 0 where it may stick and up to [`BLUR`]
    /// about there, 1 elsewhere. A drive at rest holds any torque within its friction, so such rows
    /// say nothing about the model.
    fn sticking(&self, j: usize) -> Vec<f64> {
        self.each(|r, _| {
            let v = r.state(j).1;
            let half = (BLUR / r.dt).round() as usize;
            let mut weights = vec![1.0; v.len()];
            for i in (0..v.len()).filter(|i| v[*i].abs() < STANDS * self.speed[j]) {
                weights[i.saturating_sub(half)..(i + half + 1).min(v.len())].fill(0.0);
            }
            weights
        })
    }
}
