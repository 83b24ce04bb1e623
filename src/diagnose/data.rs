//! All records side by side, and the columns that live on them.

// several arrays share the index of an actuator
#![allow(clippy::needless_range_loop)]

use super::closeness::{Closeness, factors};
use super::noise::{LINES, Noise, between_periods, spectrum};
use super::record::Record;
use crate::dynamics::Samples;
use crate::error::Result;
use crate::plant::{Kind, Parameter, Plant};
use crate::robot::{JointTerm, Prior};
use faer::Mat;
use rayon::prelude::*;

/// Sub-steps of a sampling interval over which what is not smooth is averaged.
pub const FINE: usize = 4;

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

/// A column of a linear model: values on the rows of some actuators, all records one after another
/// (the fitted ones first).
#[derive(Debug, Clone, Default)]
pub struct Column {
    /// actuator and its values; actuators that are missing have zeros
    pub rows: Vec<(usize, Vec<f64>)>,
}

impl Column {
    /// A column on one actuator.
    pub fn on(joint: usize, values: Vec<f64>) -> Self {
        Column {
            rows: vec![(joint, values)],
        }
    }

    /// Values on an actuator.
    pub fn get(&self, joint: usize) -> Option<&[f64]> {
        self.rows
            .iter()
            .find(|(j, _)| *j == joint)
            .map(|(_, v)| v.as_slice())
    }
}

/// The records of an experiment with everything that does not depend on an effect.
pub struct Data<'a> {
    /// the robot
    pub plant: &'a Plant,
    /// records, fitted ones first
    pub records: Vec<Record>,
    /// where each record starts; one more at the end
    pub start: Vec<usize>,
    /// rows of an actuator that are fitted to
    pub fitted: usize,
    /// unknowns of the nominal model
    pub parameters: Vec<Parameter>,
    /// their standard deviations a priori
    pub spread: Vec<f64>,
    /// factors on them that were estimated
    pub closeness: Closeness,
    /// regressor by actuator, rows of all records × parameters
    pub w: Vec<Mat<f64>>,
    /// torque that no parameter stands for, by actuator
    pub known: Vec<Vec<f64>>,
    /// measured torque, by actuator
    pub tau: Vec<Vec<f64>>,
    /// noise by actuator
    pub noise: Vec<Noise>,
    /// weight of every row by actuator: 1 away from reversals, 0 where a drive may stick
    pub weights: Vec<Vec<f64>>,
    /// inertia that an actuator accelerates, about the middle of the motion, kg m² or kg
    pub inertia: Vec<f64>,
    /// variance of the window over which the torque channel averages, beyond plus and minus one
    /// sample, in samples squared
    pub window: f64,
    /// largest speed of each actuator in the fitted records
    pub speed: Vec<f64>,
    /// lowest and highest position of each actuator in the fitted records
    pub range: Vec<[f64; 2]>,
}

impl<'a> Data<'a> {
    /// Number of actuators.
    pub fn joints(&self) -> usize {
        self.tau.len()
    }

    /// Rows of an actuator in all records.
    pub fn rows(&self) -> usize {
        self.start[self.records.len()]
    }

    /// Rows of record `k`.
    pub fn span(&self, k: usize) -> std::ops::Range<usize> {
        self.start[k]..self.start[k + 1]
    }

    /// Brings records together: fits first; regressor, noise and scales.
    ///
    /// # Errors
    /// Poses that cannot be reached.
    pub fn new(plant: &'a Plant, records: Vec<Record>) -> Result<Self> {
        Self::with_noise(plant, records, None)
    }

    /// The same with a noise that is known (for a motion that was not run yet).
    ///
    /// # Errors
    /// As [`Data::new`].
    pub fn with_noise(
        plant: &'a Plant,
        mut records: Vec<Record>,
        noise: Option<Vec<Noise>>,
    ) -> Result<Self> {
        for (k, r) in records.iter_mut().enumerate() {
            r.order = k;
        }
        records.sort_by_key(|r| !r.fit);
        let n = plant.actuators().len();
        let mut start = vec![0];
        for r in &records {
            start.push(start[start.len() - 1] + r.count);
        }
        let fitted = records.iter().filter(|r| r.fit).map(|r| r.count).sum();
        let rows = start[records.len()];
        let parameters = plant.parameters().to_vec();
        let p = parameters.len();
        let mut w: Vec<Mat<f64>> = (0..n).map(|_| Mat::zeros(rows, p)).collect();
        let mut known = vec![vec![0.0; rows]; n];
        let mut tau = vec![vec![0.0; rows]; n];
        let models: Vec<_> = records
            .par_iter()
            .map(|r| Ok((plant.regressor(&r.x)?, plant.known_torque(&r.x)?)))
            .collect::<Result<_>>()?;
        for (k, (r, (y, rest))) in records.iter().zip(models).enumerate() {
            for j in 0..n {
                let at = j * r.count;
                tau[j][start[k]..start[k + 1]].copy_from_slice(r.torque(j));
                averaged(
                    &rest[at..at + r.count],
                    &mut known[j][start[k]..start[k + 1]],
                );
                for c in 0..p {
                    let from = y.col(c);
                    let from: Vec<f64> = (at..at + r.count).map(|i| from[i]).collect();
                    if from.iter().all(|v| *v == 0.0) {
                        continue;
                    }
                    let to = w[j].col_mut(c);
                    let to = to.try_as_col_major_mut().expect("column major");
                    averaged(&from, &mut to.as_slice_mut()[start[k]..start[k + 1]]);
                }
            }
        }
        let fit = |r: &&Record| r.fit;
        let speed = (0..n)
            .map(|j| {
                let all = records.iter().filter(fit).flat_map(|r| r.state(j).1.iter());
                all.fold(0.0f64, |m, v| m.max(v.abs())).max(1e-9)
            })
            .collect();
        let range = (0..n)
            .map(|j| {
                let all = records.iter().filter(fit).flat_map(|r| r.state(j).0.iter());
                all.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| {
                    [a.min(*v), b.max(*v)]
                })
            })
            .collect();
        let mut data = Data {
            plant,
            start,
            fitted,
            spread: Vec::new(),
            closeness: [1.0; 2],
            parameters,
            w,
            known,
            tau,
            noise: Vec::new(),
            weights: vec![vec![1.0; rows]; n],
            inertia: inertia(plant, &records[0])?,
            records,
            window: 0.0,
            speed,
            range,
        };
        data.coulomb();
        data.noise = match noise {
            Some(noise) => noise,
            None => (0..n).map(|j| data.first_noise(j)).collect(),
        };
        data.spread = data.prior();
        Ok(data)
    }

    /// Coulomb columns with the sign averaged as the torque is.
    fn coulomb(&mut self) {
        let actuated = self.plant.actuated();
        for c in 0..self.parameters.len() {
            let Kind::Term {
                joint,
                term: JointTerm::Coulomb,
            } = self.parameters[c].kind
            else {
                continue;
            };
            let Some(j) = actuated.iter().position(|a| *a == joint) else {
                continue;
            };
            if self.plant.redundant() {
                // friction of one drive acts on others, too: left as it is
                continue;
            }
            let column = self.own(j, |_, v| sign(v, 1e-3 * self.speed[j]));
            let to = self.w[j].col_mut(c);
            let to = to.try_as_col_major_mut().expect("column major");
            to.as_slice_mut().copy_from_slice(&column);
        }
    }

    /// A function of the position and velocity of one actuator, averaged over the triangle of plus
    /// and minus one sample over which controllers average torque.
    pub fn own(&self, j: usize, f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let mut out = Vec::with_capacity(self.rows());
        for r in &self.records {
            let (q, v) = r.state(j);
            fine(q, v, r.acceleration(j), r.dt, &f, &mut out);
        }
        out
    }

    /// A signal of every record, all one after another.
    pub fn each(&self, f: impl Fn(&Record, usize) -> Vec<f64>) -> Vec<f64> {
        let mut out = Vec::with_capacity(self.rows());
        for (k, r) in self.records.iter().enumerate() {
            out.extend(f(r, k));
        }
        out
    }

    /// A signal of all records, whitened and weighted as actuator `j` is.
    pub fn whiten(&self, j: usize, x: &[f64]) -> Vec<f64> {
        let mut out = Vec::with_capacity(x.len());
        for k in 0..self.records.len() {
            self.noise[j].whiten(&x[self.span(k)], &mut out);
        }
        out.iter_mut()
            .zip(&self.weights[j])
            .for_each(|(x, w)| *x *= w);
        out
    }

    /// A whitened and weighted signal of all records as it was before, in units of the noise.
    pub fn unwhiten(&self, j: usize, x: &[f64]) -> Vec<f64> {
        let plain: Vec<f64> = x
            .iter()
            .zip(&self.weights[j])
            .map(|(x, w)| if *w > 0.0 { x / w } else { 0.0 })
            .collect();
        let mut out = Vec::with_capacity(x.len());
        for k in 0..self.records.len() {
            self.noise[j].unwhiten(&plain[self.span(k)], &mut out);
        }
        out
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

    /// A modelled signal of all records as the torque channel would show it, whitened.
    pub fn modelled(&self, j: usize, x: &[f64]) -> Vec<f64> {
        if self.window <= 0.0 {
            return self.whiten(j, x);
        }
        self.whiten(j, &self.windowed(x))
    }

    /// A modelled signal of all records as the torque channel would show it: passes of the kernel
    /// `[c/2, 1 − c, c/2]` until their variances sum to the window's.
    pub fn windowed(&self, x: &[f64]) -> Vec<f64> {
        let passes = (self.window / 0.3).ceil() as usize;
        let mut x = x.to_vec();
        if passes == 0 {
            return x;
        }
        let half = 0.5 * self.window / passes as f64;
        for _ in 0..passes {
            for k in 0..self.records.len() {
                let x = &mut x[self.span(k)];
                let last = x.len() - 1;
                let mut before = x[0];
                for i in 0..=last {
                    let (here, after) = (x[i], x[(i + 1).min(last)]);
                    x[i] = here + half * (before - 2.0 * here + after);
                    before = here;
                }
            }
        }
        x
    }

    /// Second differences of a modelled torque: what a wider window would change.
    pub fn curvature(&self, model: &[Vec<f64>]) -> Column {
        let rows = model.iter().enumerate().map(|(j, model)| {
            let mut out = vec![0.0; self.rows()];
            for k in 0..self.records.len() {
                let span = self.span(k);
                for i in span.start + 1..span.end - 1 {
                    out[i] = 0.5 * (model[i - 1] - 2.0 * model[i] + model[i + 1]);
                }
            }
            (j, out)
        });
        Column {
            rows: rows.collect(),
        }
    }

    fn first_noise(&self, j: usize) -> Noise {
        // holdout records may hold what the fitted ones do not: only where those do not repeat
        let repeats = self.records.iter().any(|r| r.fit && r.cycle.is_some());
        let parts: Vec<(Vec<f64>, f64)> = self
            .records
            .iter()
            .filter(|r| r.fit || !repeats)
            .filter_map(|r| Some((between_periods(r, r.torque(j))?, r.dt)))
            .collect();
        if !parts.is_empty() {
            let mut noise = Noise::from_periods(&parts);
            noise.limit(self.plant.actuators()[j].torque_noise);
            let excess = self.position_excess(j);
            noise.with_excess(&excess);
            return noise;
        }
        // without repetition: the torque above the band of the motion
        let longest = self.records.iter().max_by_key(|r| r.count);
        let r = longest.expect("there are records");
        Noise::from_residual(r.torque(j), r.dt, 2.0 * r.band)
    }

    /// Spectrum of the torque that unresolved acceleration makes.
    fn position_excess(&self, j: usize) -> Vec<f64> {
        let mut out = vec![0.0; LINES + 1];
        let repeats = self.records.iter().any(|r| r.fit && r.cycle.is_some());
        let counts = |r: &&Record| r.cycle.is_some() && (r.fit || !repeats);
        let records: Vec<&Record> = self.records.iter().filter(counts).collect();
        for r in &records {
            let variance = (self.inertia[j] * r.position_noise[j]).powi(2) / records.len() as f64;
            for (l, out) in out.iter_mut().enumerate() {
                let f = l as f64 / (2.0 * r.dt * LINES as f64);
                *out += variance * (2.0 * std::f64::consts::PI * f.min(60.0)).powi(4);
            }
        }
        out
    }

    /// The same limited by what a residual shows.
    pub fn limit_excess(&mut self, residual: &[Vec<f64>]) {
        for j in 0..self.joints() {
            if self.noise[j].source != super::noise::Source::Periods {
                let r = &self.records[0];
                let (dt, band) = (r.dt, 2.0 * r.band);
                self.noise[j] = Noise::from_residual(&residual[j][..self.fitted], dt, band);
                continue;
            }
            let mut seen = vec![0.0; LINES + 1];
            let mut weight = 0.0;
            for k in 0..self.records.len() {
                if !self.records[k].fit {
                    continue;
                }
                let piece = &residual[j][self.span(k)];
                for (s, v) in seen.iter_mut().zip(spectrum(piece)) {
                    *s += v * piece.len() as f64;
                }
                weight += piece.len() as f64;
            }
            let possible = self.position_excess(j);
            let excess: Vec<f64> = (0..=LINES)
                .map(|l| {
                    // median of neighbours: a line of its own is a gap, not noise
                    let (lo, hi) = (l.saturating_sub(5), (l + 5).min(LINES));
                    let mut near: Vec<f64> = seen[lo..=hi].iter().map(|v| v / weight).collect();
                    near.sort_by(f64::total_cmp);
                    let seen = near[near.len() / 2] - self.noise[j].torque[l];
                    possible[l].min(seen.max(0.0))
                })
                .collect();
            self.noise[j].with_excess(&excess);
        }
    }

    /// Standard deviations of the parameters a priori: what is ordinary for a model of this origin.
    fn prior(&self) -> Vec<f64> {
        let robot = self.plant.robot();
        let identified = self.plant.prior() == Prior::Identified;
        let heaviest = robot
            .bodies
            .iter()
            .map(|b| b.inertia.mass())
            .fold(0.0, f64::max);
        let actuated = self.plant.actuated();
        let size = |b: usize| -> f64 {
            // length of a link: where the next one starts, its centre of mass, its radius of gyration
            let body = &robot.bodies[b];
            let next = robot
                .bodies
                .iter()
                .filter(|c| c.parent == Some(b))
                .map(|c| c.position.norm())
                .fold(0.0, f64::max);
            let m = body.inertia.mass().max(1e-9);
            let about = (body.inertia.tensor().trace().max(0.0) / (2.0 * m)).sqrt();
            next.max(about).max(0.03)
        };
        self.parameters
            .iter()
            .map(|p| match p.kind {
                Kind::Inertial { body, k } => {
                    let m = robot.bodies[body]
                        .inertia
                        .mass()
                        .max(0.02 * heaviest)
                        .max(1e-3);
                    let l = size(body);
                    let [mass, first, second] = match identified {
                        true => [0.015, 0.006, 0.008],
                        false => [0.2, 0.1, 0.12],
                    };
                    match k {
                        0 => mass * m,
                        1..=3 => first * m * l,
                        _ => second * m * l * l,
                    }
                }
                Kind::Term { joint, term } => {
                    let terms = robot.joints[joint].terms;
                    let value = p.value.abs();
                    let j = actuated.iter().position(|a| *a == joint);
                    let noise = j.map_or(0.0, |j| self.noise[j].std);
                    let speed = j.map_or(1.0, |j| self.speed[j]);
                    let friction = terms[2].abs() + 0.3 * terms[1].abs() * speed;
                    match (term, identified) {
                        (JointTerm::Armature, true) => 0.06 * value,
                        (JointTerm::Armature, false) => 0.3 * value,
                        (JointTerm::Viscous, true) => 0.15 * value,
                        (JointTerm::Viscous, false) => 0.4 * value,
                        (JointTerm::Coulomb, true) => 0.06 * value,
                        (JointTerm::Coulomb, false) => 0.35 * value,
                        (JointTerm::Offset, true) => (0.04 * friction).max(0.3 * noise),
                        (JointTerm::Offset, false) => (0.2 * friction).max(noise),
                    }
                    .max(0.02 * noise)
                }
                // each states its own
                Kind::Nuisance => 0.0,
            })
            .collect()
    }

    /// Scales the prior by what the records say of how close the model is.
    pub fn tighten(&mut self, closeness: Closeness) {
        let factors = factors(self, closeness);
        self.spread
            .iter_mut()
            .zip(factors)
            .for_each(|(s, f)| *s *= f);
        self.closeness = closeness;
    }

    /// Adds columns that every model may use within a prior: ordinary imperfections, each with its name
    /// and its standard deviation.
    fn add_nuisances(&mut self, all: &[(&str, Column, f64)]) {
        self.w.par_iter_mut().enumerate().for_each(|(j, w)| {
            let (rows, p) = (w.nrows(), w.ncols());
            w.resize_with(rows, p + all.len(), |i, c| {
                all[c - p].1.get(j).map_or(0.0, |values| values[i])
            });
        });
        for (name, _, spread) in all {
            self.parameters.push(Parameter {
                name: (*name).to_string(),
                unit: "",
                value: 0.0,
                // not an unknown of the nominal model
                kind: Kind::Nuisance,
                raw: Vec::new(),
            });
            self.spread.push(*spread);
        }
    }

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
            self.weights[j] = match self.plant.mechanism() {
                None => self.doubt(j, coulomb),
                Some(_) => self.sticking(j),
            };
            let sharp = 1e-3 * self.speed[j];
            // tanh of three widths: any rounding in between is close to a sum of them
            for wide in ROUNDED.map(|w| w * self.speed[j]) {
                let column = self.own(j, |_, v| sign(v, wide) - sign(v, sharp));
                nuisances.push(("reversal", Column::on(j, column), 0.5 * coulomb));
            }
        }
        self.add_nuisances(&nuisances);
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

    /// Torque of the nominal model with parameters `phi`, by actuator, over all records.
    pub fn model_torque(&self, phi: &[f64]) -> Vec<Vec<f64>> {
        (0..self.joints())
            .map(|j| {
                let y = &self.w[j] * faer::ColRef::from_slice(phi);
                (0..self.rows()).map(|i| y[i] + self.known[j][i]).collect()
            })
            .collect()
    }

    /// Torque of rigid bodies alone with parameters `phi`.
    pub fn rigid_torque(&self, phi: &[f64]) -> Vec<Vec<f64>> {
        let bodies: Vec<f64> = self
            .parameters
            .iter()
            .zip(phi)
            .map(|(p, v)| match p.kind {
                Kind::Inertial { .. } => *v,
                Kind::Term { .. } | Kind::Nuisance => 0.0,
            })
            .collect();
        (0..self.joints())
            .map(|j| {
                let y = &self.w[j] * faer::ColRef::from_slice(&bodies);
                (0..self.rows()).map(|i| y[i]).collect()
            })
            .collect()
    }

    /// Rigid-body torque with parameters `phi` of another motion of the coordinates for every
    /// record; `change` alters the motion.
    ///
    /// # Errors
    /// Poses that cannot be reached.
    pub fn torque_of(
        &self,
        phi: &[f64],
        change: impl Fn(&Record, usize, &mut Samples) + Sync,
    ) -> Result<Vec<Vec<f64>>> {
        let n = self.joints();
        let parts: Vec<Result<Vec<f64>>> = (0..self.records.len())
            .into_par_iter()
            .map(|k| {
                let r = &self.records[k];
                let mut x = r.x.clone();
                change(r, k, &mut x);
                rigid(self.plant, phi, &x)
            })
            .collect();
        let mut out = vec![Vec::with_capacity(self.rows()); n];
        for (k, part) in parts.into_iter().enumerate() {
            let part = part?;
            let count = self.records[k].count;
            for (j, out) in out.iter_mut().enumerate() {
                let from = &part[j * count..(j + 1) * count];
                let at = out.len();
                out.resize(at + count, 0.0);
                averaged(from, &mut out[at..]);
            }
        }
        Ok(out)
    }
}

/// Rigid-body torque of a motion, actuator-major.
///
/// # Errors
/// Poses that cannot be reached.
pub fn rigid(plant: &Plant, phi: &[f64], x: &Samples) -> Result<Vec<f64>> {
    plant.rigid_torque(x, &phi[..plant.parameters().len()])
}

/// Smooth sign.
pub fn sign(v: f64, width: f64) -> f64 {
    (v / width).clamp(-20.0, 20.0).tanh()
}

/// A smooth signal averaged over a triangle of plus and minus one sample: `x + Δ² ẍ / 12`.
pub fn averaged(x: &[f64], out: &mut [f64]) {
    let last = x.len() - 1;
    for i in 0..=last {
        out[i] = if i == 0 || i == last {
            x[i]
        } else {
            (x[i - 1] + 10.0 * x[i] + x[i + 1]) / 12.0
        };
    }
}

/// A function of position and velocity on sub-steps, averaged over a triangle of plus and minus one
/// sample; the motion between samples is the Hermite polynomial of positions and velocities.
pub fn fine(
    q: &[f64],
    v: &[f64],
    a: &[f64],
    dt: f64,
    f: impl Fn(f64, f64) -> f64,
    out: &mut Vec<f64>,
) {
    let values = fine_values(q, v, a, dt, |q, v, _| f(q, v));
    from_fine(&values, q.len(), out);
}

/// Values of a function on the sub-steps: `FINE` a sample, from the first sample to the last; the
/// function sees them in order of time (position, velocity, time).
pub fn fine_values(
    q: &[f64],
    v: &[f64],
    a: &[f64],
    dt: f64,
    mut f: impl FnMut(f64, f64, f64) -> f64,
) -> Vec<f64> {
    let n = q.len();
    let mut values = Vec::with_capacity((n - 1) * FINE + 1);
    for i in 0..n {
        values.push(f(q[i], v[i], i as f64 * dt));
        if i + 1 == n {
            break;
        }
        for s in 1..FINE {
            let h = s as f64 / FINE as f64;
            // position: cubic Hermite; velocity: cubic Hermite of its own
            let hermite = |p0: f64, m0: f64, p1: f64, m1: f64| {
                let (h2, h3) = (h * h, h * h * h);
                (2.0 * h3 - 3.0 * h2 + 1.0) * p0
                    + (h3 - 2.0 * h2 + h) * dt * m0
                    + (3.0 * h2 - 2.0 * h3) * p1
                    + (h3 - h2) * dt * m1
            };
            let position = hermite(q[i], v[i], q[i + 1], v[i + 1]);
            let velocity = hermite(v[i], a[i], v[i + 1], a[i + 1]);
            values.push(f(position, velocity, (i as f64 + h) * dt));
        }
    }
    values
}

/// Triangular average of values on sub-steps, one a sample.
pub fn from_fine(values: &[f64], count: usize, out: &mut Vec<f64>) {
    let w = FINE as isize;
    let last = values.len() as isize - 1;
    for i in 0..count as isize {
        let at = i * w;
        let mut sum = 0.0;
        for k in 1 - w..w {
            sum += (w - k.abs()) as f64 * values[(at + k).clamp(0, last) as usize];
        }
        out.push(sum / (w * w) as f64);
    }
}

/// Inertia about each actuator: `√Σ_k M_jk²` about the middle of a motion.
fn inertia(plant: &Plant, record: &Record) -> Result<Vec<f64>> {
    let n = plant.actuators().len();
    let phi = plant.values();
    let m = plant.coordinates();
    const POINTS: usize = 8;
    let mut out = vec![0.0f64; n];
    let at = |i: usize| i * (record.count - 1) / (POINTS - 1);
    let mut x = Samples::zeros(m, POINTS);
    for k in 0..m {
        for i in 0..POINTS {
            x.q[k * POINTS + i] = record.x.q[k * record.count + at(i)];
        }
    }
    let rest = rigid(plant, &phi, &x)?;
    for k in 0..m {
        let mut y = x.clone();
        y.qdd[k * POINTS..(k + 1) * POINTS].fill(1.0);
        let tau = rigid(plant, &phi, &y)?;
        for j in 0..n {
            for i in 0..POINTS {
                out[j] += (tau[j * POINTS + i] - rest[j * POINTS + i]).powi(2) / POINTS as f64;
            }
        }
    }
    let actuators = plant.actuators();
    Ok((0..n)
        .map(|j| out[j].sqrt() + actuators[j].terms[0])
        .collect())
}
