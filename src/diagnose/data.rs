//! All records side by side.

// several arrays share the index of an actuator
#![allow(clippy::needless_range_loop)]

use super::column::{Column, Columns};
use super::noise::{Noise, ORDER};
use super::prior::{self, Closeness, factors};
use super::rigid::{self, rigid};
use super::window::{averaged, fine};
use crate::dynamics::Samples;
use crate::error::Result;
use crate::plant::{self, Parameter, Plant};
use crate::signals::series::Series;
use rayon::prelude::*;

/// The records of an experiment with everything that does not depend on an effect.
#[derive(Clone)]
pub struct Data<'a> {
    /// the robot
    pub plant: &'a Plant,
    /// records, fitted ones first
    pub records: Vec<Series>,
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
    pub w: Vec<Columns>,
    /// torque that no parameter stands for, by actuator
    pub known: Vec<Vec<f64>>,
    /// measured torque, by actuator
    pub tau: Vec<Vec<f64>>,
    /// noise by actuator
    pub noise: Vec<Noise>,
    /// weight of every row by actuator: 1 away from reversals, 0 where a drive may stick and where
    /// nothing was measured
    pub weights: Vec<Vec<f64>>,
    /// inertia that an actuator accelerates, about the middle of the motion, kg m² or kg
    pub inertia: Vec<f64>,
    /// deceleration that its dry friction alone gives an actuator where all positions are zero, rad/s² or m/s²; of trees
    pub stops: Vec<f64>,
    /// variance of the window over which the torque channel averages, beyond plus and minus one
    /// sample, in samples squared; negative where it takes the torque at an instant
    pub window: f64,
    /// time by which dry friction reverses before the velocity does, s: a simulator that regularises friction by a
    /// velocity and an acceleration, `sgn(q̇ + T q̈)`; 0 for a machine
    pub lead: f64,
    /// whether a lead shows that the records are not sure of
    pub perhaps_early: bool,
    /// largest speed of each actuator in the fitted records
    pub speed: Vec<f64>,
    /// lowest and highest position of each actuator in the fitted records
    pub range: Vec<[f64; 2]>,
    /// ten columns of a load on the rows of the records that carry one; empty where none does
    pub tool: Vec<Column>,
    /// first of the ten parameters of the unknown load of each record
    pub free_load: Vec<Option<usize>>,
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

    /// Parameters of the nominal model.
    pub fn values(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.value).collect()
    }

    /// Whether anything moves in the fitted records.
    pub fn moves(&self) -> bool {
        self.records.iter().any(|r| r.fit && r.moves())
    }

    /// Whether there is a record to predict in which anything moves.
    pub fn predicts(&self) -> bool {
        self.records.iter().any(|r| !r.fit && r.moves())
    }

    /// Rows of record `k`.
    pub fn span(&self, k: usize) -> std::ops::Range<usize> {
        self.start[k]..self.start[k + 1]
    }

    /// Brings records together: fits first; regressor, noise and scales.
    ///
    /// # Errors
    /// Poses that cannot be reached.
    pub fn new(plant: &'a Plant, records: Vec<Series>) -> Result<Self> {
        Self::with_noise(plant, records, None)
    }

    /// The same with a noise that is known (for a motion that was not run yet).
    ///
    /// # Errors
    /// As [`Data::new`].
    pub fn with_noise(
        plant: &'a Plant,
        mut records: Vec<Series>,
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
        let mut w: Vec<Columns> = (0..n).map(|_| Columns::new(rows, p)).collect();
        let mut known = vec![vec![0.0; rows]; n];
        let mut tau = vec![vec![0.0; rows]; n];
        // one record after another: a regressor with all its zeros is large
        for (k, r) in records.iter().enumerate() {
            let (y, rest) = (plant.regressor(&r.x)?, plant.known_torque(&r.x)?);
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
                    averaged(&from, &mut w[j].write(c)[start[k]..start[k + 1]]);
                }
            }
        }
        let fit = |r: &&Series| r.fit;
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
            inertia: rigid::inertia(plant, &records[0])?,
            stops: vec![0.0; n],
            free_load: vec![None; records.len()],
            records,
            window: 0.0,
            lead: 0.0,
            perhaps_early: false,
            speed,
            range,
            tool: Vec::new(),
        };
        data.coulomb();
        data.noise = match noise {
            Some(noise) => noise,
            None => (0..n).map(|j| data.first_noise(j)).collect(),
        };
        data.spread = prior::spread(plant, &data.parameters, &data.noise, &data.speed);
        data.weights = (0..n).map(|j| data.counted(j)).collect();
        Ok(data)
    }

    /// Weights of the rows of an actuator by what they say: 0 where a sample was not measured or the actuator
    /// stood still, and where the whitening filters still feel it; 1 elsewhere.
    pub fn counted(&self, j: usize) -> Vec<f64> {
        self.each(|r, _| {
            let counted = r.counted(j);
            let mut weights = vec![1.0; r.count];
            for i in (0..r.count).filter(|i| !counted[*i]) {
                weights[i..(i + ORDER + 1).min(r.count)].fill(0.0);
            }
            weights
        })
    }

    /// How many of these rows have a weight, in the mean of the actuators.
    pub fn weighted(&self, rows: std::ops::Range<usize>) -> f64 {
        let of = |w: &Vec<f64>| w[rows.clone()].iter().filter(|w| **w > 0.0).count();
        self.weights.iter().map(of).sum::<usize>() as f64 / self.joints() as f64
    }

    /// Residuals of all records, actuator by actuator, with zeros where nothing was measured or the actuator
    /// stood still.
    pub fn silenced(&self, mut residual: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        for (j, row) in residual.iter_mut().enumerate() {
            for (k, r) in self.records.iter().enumerate() {
                let counted = r.counted(j);
                let of = row[self.span(k)].iter_mut().zip(counted.iter());
                of.filter(|(_, m)| !**m).for_each(|(v, _)| *v = 0.0);
            }
        }
        residual
    }

    /// Measured torque less a model's, as the torque channel would show it.
    pub fn gap_to(&self, model: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let of = |j: usize| {
            let model = self.shown(j, &model[j]);
            let measured = self.torque(j);
            measured.iter().zip(&model).map(|(a, b)| a - b).collect()
        };
        self.told(self.silenced((0..self.joints()).map(of).collect()))
    }

    /// The same with zeros where drives of a closed chain may stick, as the residuals of fits have them: these rows say
    /// nothing about any model.
    pub fn gap_that_counts(&self, model: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut gap = self.gap_to(model);
        if self.sticks() {
            for (row, weights) in gap.iter_mut().zip(&self.weights) {
                let rows = row.iter_mut().zip(weights);
                rows.filter(|(_, w)| **w == 0.0).for_each(|(v, _)| *v = 0.0);
            }
        }
        gap
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
    pub fn each(&self, f: impl Fn(&Series, usize) -> Vec<f64>) -> Vec<f64> {
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

    /// Scales the prior by what the records say of how close the model is.
    pub fn tighten(&mut self, closeness: Closeness) {
        let factors = factors(&self.parameters, closeness);
        self.spread
            .iter_mut()
            .zip(factors)
            .for_each(|(s, f)| *s *= f);
        self.closeness = closeness;
    }

    /// Adds columns that every model may use within a prior: ordinary imperfections, each with its name
    /// and its standard deviation.
    pub(super) fn add_nuisances(&mut self, all: &[(&str, Column, f64)]) {
        self.w.par_iter_mut().enumerate().for_each(|(j, w)| {
            for (_, column, _) in all {
                w.push(column.get(j).map(<[f64]>::to_vec));
            }
        });
        for (name, _, spread) in all {
            self.parameters.push(Parameter {
                name: (*name).to_string(),
                unit: "",
                value: 0.0,
                // not an unknown of the nominal model
                kind: plant::Column::Nuisance,
                raw: Vec::new(),
            });
            self.spread.push(*spread);
        }
    }

    /// Torque of the nominal model with parameters `phi`, by actuator, over all records.
    pub fn model_torque(&self, phi: &[f64]) -> Vec<Vec<f64>> {
        (0..self.joints())
            .map(|j| {
                let mut y = self.w[j].times(phi);
                y.iter_mut().zip(&self.known[j]).for_each(|(y, k)| *y += k);
                y
            })
            .collect()
    }

    /// Torque of rigid bodies alone with parameters `phi`, loads included.
    pub fn rigid_torque(&self, phi: &[f64]) -> Vec<Vec<f64>> {
        let bodies: Vec<f64> = self
            .parameters
            .iter()
            .zip(phi)
            .map(|(p, v)| match p.kind {
                plant::Column::Inertial { .. } => *v,
                plant::Column::Term { .. } | plant::Column::Nuisance => 0.0,
            })
            .collect();
        let mut torque: Vec<Vec<f64>> = (0..self.joints())
            .map(|j| self.w[j].times(&bodies))
            .collect();
        for k in 0..self.records.len() {
            let Some(load) = self.load(k, phi) else {
                continue;
            };
            for (column, value) in self.tool.iter().zip(load) {
                for (j, rows) in &column.rows {
                    for i in self.span(k) {
                        torque[*j][i] += value * rows[i];
                    }
                }
            }
        }
        torque
    }

    /// Rigid-body torque with parameters `phi` of another motion of the coordinates for every
    /// record; `change` alters the motion.
    ///
    /// # Errors
    /// Poses that cannot be reached.
    pub fn torque_of(
        &self,
        phi: &[f64],
        change: impl Fn(&Series, usize, &mut Samples) + Sync,
    ) -> Result<Vec<Vec<f64>>> {
        let n = self.joints();
        let parts: Vec<Result<Vec<f64>>> = (0..self.records.len())
            .into_par_iter()
            .map(|k| {
                let r = &self.records[k];
                let mut x = r.x.clone();
                change(r, k, &mut x);
                let load = self.load(k, phi);
                rigid(self.plant, phi, load.as_ref(), &x)
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
