//! What a log of any robot may have without being at odds with its model: reversals of friction that are
//! not perfectly sharp, and a motion close to them that friction bends faster than positions show.

// several arrays share the index of an actuator or a sample
#![allow(clippy::needless_range_loop)]

use super::column::Column;
use super::data::Data;
use super::noise::ORDER;
use super::rigid::mobility;
use super::thresholds::THRESHOLDS as T;
use super::window::{fine, sign};
use crate::error::Result;
use crate::plant;
use crate::robot::JointTerm;

/// Names of the nuisance columns: of reversals, and of the velocity within a step.
const REVERSAL: &str = "reversal";
const STEP: &str = "step";

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
            self.weights[j] = match self.sticks() {
                false => self.doubt(j, coulomb),
                true => self.sticking(j),
            };
            let counted = self.counted(j);
            let kept = self.weights[j].iter_mut().zip(&counted);
            kept.for_each(|(w, m)| *w *= m);
            for column in self.rounded(j) {
                let spread = T.reversals.rounding * coulomb;
                nuisances.push((REVERSAL, Column::on(j, column), spread));
            }
        }
        nuisances.extend(self.between_samples());
        self.add_nuisances(&nuisances);
    }

    /// A log without noise is a simulator's: its damping takes a velocity from within a step, its log one at the end.
    fn between_samples(&self) -> Vec<(&'static str, Column, f64)> {
        let actuators = self.plant.actuators().into_iter().enumerate();
        let damped = actuators.filter(|(j, a)| self.noise[*j].assumed && a.terms[1] != 0.0);
        damped
            .map(|(j, a)| {
                let change = self.each(|r, _| {
                    let step = T.window.within * r.dt * a.terms[1];
                    r.acceleration(j).iter().map(|v| step * v).collect()
                });
                (STEP, Column::on(j, change), 1.0)
            })
            .collect()
    }

    /// Parameters without what a log is allowed for, as files have them.
    pub(super) fn without_allowance(&self, phi: &[f64]) -> Vec<f64> {
        let allowed = |name: &str| [REVERSAL, STEP].contains(&name);
        let all = phi.iter().zip(&self.parameters);
        all.map(|(x, p)| if allowed(&p.name) { 0.0 } else { *x })
            .collect()
    }

    /// What a less sharp reversal changes of the sign of the friction of actuator `j`: tanh of three widths, as any
    /// rounding in between is close to a sum of them.
    fn rounded(&self, j: usize) -> [Vec<f64>; 3] {
        let sharp = T.reversals.sharp * self.speed[j];
        T.reversals.rounded.map(|w| {
            let wide = w * self.speed[j];
            self.led(j, self.lead, |_, v| sign(v, wide) - sign(v, sharp))
        })
    }

    /// What the dry friction of actuator `j` of another simulator may be off by about reversals, by newton metre or newton
    /// of friction, and how far each is expected to go: from the sign of the velocity at a sample to its mean over the
    /// samples beside it, as torque is logged, and what else this file allows for. Nothing where there is no dry friction
    /// of the actuator's own.
    pub(super) fn at_reversals(&self, j: usize) -> Option<([Vec<f64>; 4], [f64; 4])> {
        let coulomb = self.plant.actuators()[j].terms[2].abs();
        if coulomb == 0.0 || self.plant.redundant() {
            return None;
        }
        let at_samples = self.records.iter().flat_map(|r| r.state(j).1.iter());
        let sharp = T.reversals.sharp * self.speed[j];
        let mean = self.dry_sign(j, self.lead);
        let change = mean
            .iter()
            .zip(at_samples)
            .map(|(m, v)| m - sign(*v, sharp));
        let spread = T.reversals.rounding * coulomb;
        let [a, b, c] = self.rounded(j);
        Some((
            [change.collect(), a, b, c],
            [coulomb, spread, spread, spread],
        ))
    }

    /// Coulomb columns with the sign averaged as the torque is.
    pub(super) fn coulomb(&mut self) {
        for (j, c) in self.dry_parameters() {
            let column = self.dry_sign(j, self.lead);
            self.w[j].write(c).copy_from_slice(&column);
        }
    }

    /// A function of the position of one actuator and of the velocity that friction feels which an effect adds, averaged as by
    /// [`Data::own`]: that is the velocity itself, as only the dry friction of a simulator's own constraint reverses early. Behind a coarse encoder in motions that do not repeat, that time is not told well and stands
    /// for more; there the friction of an effect shares it.
    pub fn added(&self, j: usize, f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        self.led(j, self.lead_of_effects(j), f)
    }

    /// The time by which friction that an effect adds is taken to reverse early.
    pub(super) fn lead_of_effects(&self, j: usize) -> f64 {
        let mut fitted = self.records.iter().filter(|r| r.fit);
        match fitted.all(|r| r.filter(j).is_some()) {
            true => self.lead,
            false => 0.0,
        }
    }

    /// Sign of the velocity that the dry friction of actuator `j` feels with a `lead`. A simulator's constraint gives way
    /// by a share of what friction alone decelerates, so over that times the lead its friction turns.
    pub(super) fn dry_sign(&self, j: usize, lead: f64) -> Vec<f64> {
        let sharp = T.reversals.sharp * self.speed[j];
        let soft = lead * T.reversals.soft * self.stops[j];
        self.led(j, lead, |_, v| match soft > sharp {
            true => (v / soft).clamp(-1.0, 1.0),
            false => sign(v, sharp),
        })
    }

    /// As [`Data::own`] with the velocity `q̇ + T q̈` of a `lead` `T`.
    fn led(&self, j: usize, lead: f64, f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        if lead == 0.0 {
            return self.own(j, f);
        }
        let mut out = Vec::with_capacity(self.rows());
        for r in &self.records {
            let ((q, v), a) = (r.state(j), r.acceleration(j));
            let felt: Vec<f64> = v.iter().zip(a).map(|(v, a)| v + lead * a).collect();
            fine(q, &felt, a, r.dt, &f, &mut out);
        }
        out
    }

    /// The parameters that stand for dry friction of an actuator's own, each with its actuator.
    pub(super) fn dry_parameters(&self) -> Vec<(usize, usize)> {
        let actuated = self.plant.actuated();
        let of = |c: usize| match self.parameters[c].kind {
            plant::Column::Term {
                joint,
                term: JointTerm::Coulomb,
            } => Some((actuated.iter().position(|a| *a == joint)?, c)),
            _ => None,
        };
        match self.plant.redundant() {
            // friction of one drive acts on others, too: left as it is
            true => Vec::new(),
            false => (0..self.parameters.len()).filter_map(of).collect(),
        }
    }

    /// Dry friction of every actuator's own with parameters `phi`, N m or N; 0 where one drive's acts on others.
    fn dry_friction(&self, phi: &[f64]) -> Vec<f64> {
        let actuators = self.plant.actuators();
        let mut all: Vec<f64> = match self.plant.redundant() {
            true => vec![0.0; actuators.len()],
            false => actuators.iter().map(|a| a.terms[2]).collect(),
        };
        self.dry_parameters()
            .into_iter()
            .for_each(|(j, c)| all[j] = phi[c]);
        all
    }

    /// What dry friction of parameters `phi` changes if it reverses `by` seconds earlier than it is taken to.
    pub(super) fn earlier(&self, phi: &[f64], by: f64) -> Column {
        let dry = self.dry_friction(phi).into_iter().enumerate();
        let rows = dry.filter(|(_, f)| *f != 0.0).map(|(j, friction)| {
            let change = self.change_of_sign(j, self.lead, self.lead + by);
            (j, change.map(|c| friction * c).collect())
        });
        Column {
            rows: rows.collect(),
        }
    }

    /// What the sign of the dry friction of actuator `j` changes between two leads.
    fn change_of_sign(&self, j: usize, from: f64, to: f64) -> impl Iterator<Item = f64> {
        let pairs = (self.dry_sign(j, to).into_iter()).zip(self.dry_sign(j, from));
        pairs.map(|(a, b)| a - b)
    }

    /// Takes dry friction to reverse `lead` seconds before the velocity does, and to be as large as the parameters `phi` say
    /// where it gives way.
    ///
    /// # Errors
    /// As [`super::rigid::mobility`].
    pub(super) fn reverse_early(&mut self, lead: f64, phi: &[f64]) -> Result<()> {
        let stops = self.stops(phi)?;
        if lead == self.lead && (lead == 0.0 || stops == self.stops) {
            self.stops = stops;
            return Ok(());
        }
        let fitted = self.dry_parameters();
        let stated: Vec<f64> = self.plant.actuators().iter().map(|a| a.terms[2]).collect();
        let known = |j: &usize| stated[*j] != 0.0 && fitted.iter().all(|(k, _)| k != j);
        let known: Vec<usize> = (0..self.joints()).filter(known).collect();
        let before: Vec<Vec<f64>> = known.iter().map(|j| self.dry_sign(*j, self.lead)).collect();
        self.lead = lead;
        self.stops = stops;
        for (j, before) in known.into_iter().zip(before) {
            let after = self.dry_sign(j, lead);
            let rows = self.known[j].iter_mut().zip(after.iter().zip(before));
            rows.for_each(|(k, (after, before))| *k += stated[j] * (after - before));
        }
        self.coulomb();
        let slots: Vec<usize> = (0..self.parameters.len())
            .filter(|c| self.parameters[*c].name == REVERSAL)
            .collect();
        let dry = (0..self.joints()).filter(|j| stated[*j] != 0.0);
        for (j, slots) in dry.zip(slots.chunks(T.reversals.rounded.len())) {
            for (c, column) in slots.iter().zip(self.rounded(j)) {
                self.w[j].write(*c).copy_from_slice(&column);
            }
        }
        Ok(())
    }

    /// Deceleration that its dry friction alone gives each actuator where all positions are zero, `F_c (M⁻¹)_jj`. The
    /// friction is that of `phi`: a nominal one that is 20 % off shifts the lead by 2 ms. It stays near the nominal one, as
    /// what a model lacks can look like any friction. The mass matrix is nominal: records may not tell the tensor of a last link.
    fn stops(&self, phi: &[f64]) -> Result<Vec<f64>> {
        if !self.may_lead() {
            return Ok(vec![0.0; self.joints()]);
        }
        let nominal = self.values();
        let mobility = mobility(self.plant, &nominal, self.load(0, &nominal).as_ref())?;
        let stated = self.dry_friction(&nominal).into_iter().map(f64::abs);
        let fitted = self.dry_friction(phi).into_iter().zip(stated);
        let near = |(f, stated): (f64, f64)| {
            let most = T.reversals.trusted * stated;
            f.abs().clamp(stated - most, stated + most)
        };
        Ok(fitted.map(near).zip(mobility).map(|(f, a)| f * a).collect())
    }

    /// Weights `1/√(1 + (κ F_c/σ)² b)` of the rows of an actuator: where its velocity changes sign
    /// (`b = 1` within `reversals.near` and `reversals.unseen` samples, 0 from twice that on), friction bends the motion faster than the
    /// positions show, and the model is off by a share `κ` of the friction.
    fn doubt(&self, j: usize, coulomb: f64) -> Vec<f64> {
        let noise = self.noise[j].std.max(1e-300);
        let doubt = (T.reversals.bent * coulomb / noise).powi(2);
        // where the velocity is within its noise even the sign of friction is open
        let open = (coulomb / noise).powi(2);
        self.each(|r, _| {
            let v = r.state(j).1;
            let near = T.reversals.near.max(T.reversals.unseen * r.dt);
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
                doubt * b + open * c
            };
            let mut doubts: Vec<f64> = away.iter().zip(v).map(of).collect();
            if let Some(filter) = r.filter(j) {
                // an error of one sign about a reversal, as the filter of a coarse encoder leaves it
                let roots: Vec<f64> = doubts.iter().map(|d| d.sqrt()).collect();
                let left = filter.pass(&roots);
                // the whitening filters still feel it after
                let felt = |i: usize| left[i.saturating_sub(ORDER)..=i].iter();
                doubts = (0..left.len())
                    .map(|i| felt(i).fold(0.0f64, |m, d| m.max(d * d)))
                    .collect();
            }
            doubts.iter().map(|d| 1.0 / (1.0 + d).sqrt()).collect()
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
