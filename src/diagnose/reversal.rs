//! What a log of any robot may have without being at odds with its model: reversals of friction that are
//! not perfectly sharp, and a motion close to them that friction bends faster than positions show.

// several arrays share the index of an actuator or a sample
#![allow(clippy::needless_range_loop)]

use super::column::Column;
use super::data::Data;
use super::thresholds::THRESHOLDS as T;
use super::window::sign;

impl Data<'_> {
    /// What a log of any robot may have without being at odds with its model: reversals of friction
    /// that are not perfectly sharp, and a motion close to them that friction bends faster than
    /// positions show.
    pub fn ordinary(&mut self) {
        if self.plant.redundant() {
            return;
        }
        let mut nuisances = Vec::new();
        for (j, actuator) in self.plant.actuators().into_iter().enumerate() {
            let coulomb = actuator.terms[2].abs();
            if coulomb == 0.0 {
                continue;
            }
            self.weights[j] = match self.plant.closed() {
                false => self.doubt(j, coulomb),
                true => self.sticking(j),
            };
            let counted = self.counted(j);
            let kept = self.weights[j].iter_mut().zip(&counted);
            kept.for_each(|(w, m)| *w *= m);
            let sharp = T.reversals.sharp * self.speed[j];
            // tanh of three widths: any rounding in between is close to a sum of them
            for wide in T.reversals.rounded.map(|w| w * self.speed[j]) {
                let column = self.own(j, |_, v| sign(v, wide) - sign(v, sharp));
                nuisances.push((
                    "reversal",
                    Column::on(j, column),
                    T.reversals.rounding * coulomb,
                ));
            }
        }
        self.add_nuisances(&nuisances);
    }

    /// Weights `1/√(1 + (κ F_c/σ)² b)` of the rows of an actuator: where its velocity changes sign
    /// (`b = 1` within `reversals.near`, 0 from twice that on), friction bends the motion faster than the
    /// positions show, and the model is off by a share `κ` of the friction.
    fn doubt(&self, j: usize, coulomb: f64) -> Vec<f64> {
        let near = T.reversals.near;
        let noise = self.noise[j].std.max(1e-300);
        let doubt = (T.reversals.bent * coulomb / noise).powi(2);
        // where the velocity is within its noise even the sign of friction is open
        let open = (coulomb / noise).powi(2);
        self.each(|r, _| {
            let v = r.state(j).1;
            let mut away = vec![f64::INFINITY; v.len()];
            let crossed = |i: usize| i + 1 < v.len() && v[i] * v[i + 1] <= 0.0;
            for i in (0..v.len()).filter(|i| crossed(*i)) {
                let reach = (2.0 * near / r.dt) as usize + 1;
                for k in i.saturating_sub(reach)..(i + reach + 2).min(v.len()) {
                    let distance = (k as f64 - i as f64 - 0.5).abs() * r.dt;
                    away[k] = away[k].min(distance);
                }
            }
            let blind = T.reversals.blind * r.velocity_noise(j);
            let of = |(d, v): (&f64, &f64)| {
                let b = (2.0 - d / near).clamp(0.0, 1.0);
                let c = (2.0 - v.abs() / blind.max(1e-300)).clamp(0.0, 1.0);
                1.0 / (1.0 + doubt * b + open * c).sqrt()
            };
            away.iter().zip(v).map(of).collect()
        })
    }

    /// Weights of the rows of an actuator of a closed chain: 0 where it may stick and up to
    /// `reversals.blur` about there, 1 elsewhere. A drive at rest holds any torque within its friction, so such rows
    /// say nothing about the model.
    fn sticking(&self, j: usize) -> Vec<f64> {
        self.each(|r, _| {
            let v = r.state(j).1;
            let half = (T.reversals.blur / r.dt).round() as usize;
            let mut weights = vec![1.0; v.len()];
            for i in (0..v.len()).filter(|i| v[*i].abs() < T.reversals.stands * self.speed[j]) {
                weights[i.saturating_sub(half)..(i + half + 1).min(v.len())].fill(0.0);
            }
            weights
        })
    }
}
