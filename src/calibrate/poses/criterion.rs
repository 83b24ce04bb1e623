//! How well the tool is known after some of the candidates were measured.

use super::Candidate;
use crate::calibrate::kind::Kind;
use crate::calibrate::model::Model;
use crate::error::{Error, Result};
use nalgebra::{DMatrix, Vector3};
use rand::seq::index::sample;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Candidates looked at for one place.
const LOOK: usize = 400;
/// Rounds of exchange.
const ROUNDS: usize = 2;

/// Information and what is predicted, in scaled unknowns.
pub struct Problem<'a> {
    model: &'a Model<'a>,
    rows: Vec<DMatrix<f64>>,
    prior: DMatrix<f64>,
    /// `Lᵀ L / K`
    weight: DMatrix<f64>,
}

/// Postures that were chosen.
pub struct Chosen {
    /// indices of the candidates
    pub rows: Vec<usize>,
    jacobians: Vec<DMatrix<f64>>,
}

impl<'a> Problem<'a> {
    /// Of all rows of a model; `view` are those that the tool is predicted in.
    ///
    /// # Errors
    /// A candidate that cannot be taken.
    pub fn new(model: &'a Model<'a>, view: &[usize], kind: Kind) -> Result<Self> {
        let n = model.count();
        let rows: Option<Vec<DMatrix<f64>>> = (0..model.input.rows.len())
            .into_par_iter()
            .map(|i| jacobian(model, i))
            .collect();
        let rows = rows.ok_or_else(|| Error::Infeasible("a candidate cannot be taken".into()))?;
        let mut prior = DMatrix::zeros(n, n);
        for (k, u) in model.unknowns.iter().enumerate() {
            // what nothing is known of is a little known, so that few postures have a value, too
            prior[(k, k)] = (u.scale / u.prior).powi(2).max(1e-4);
        }
        let weight = predicted(model, view, kind)?;
        Ok(Problem {
            model,
            rows,
            prior,
            weight,
        })
    }

    fn information(&self, chosen: &[DMatrix<f64>]) -> DMatrix<f64> {
        let mut m = self.prior.clone();
        for j in chosen {
            m += j.tr_mul(j);
        }
        m
    }

    fn inverse(&self, information: DMatrix<f64>) -> Option<DMatrix<f64>> {
        Some(information.cholesky()?.inverse())
    }

    /// Standard deviation of the tool for an information matrix, m.
    fn of(&self, information: DMatrix<f64>) -> f64 {
        match self.inverse(information) {
            Some(c) => c.component_mul(&self.weight).sum().max(0.0).sqrt(),
            None => f64::NAN,
        }
    }

    /// Of these candidates.
    pub fn value(&self, rows: &[usize]) -> f64 {
        let chosen: Vec<DMatrix<f64>> = rows.iter().map(|&i| self.rows[i].clone()).collect();
        self.of(self.information(&chosen))
    }

    /// Of what is chosen now.
    pub fn now(&self, chosen: &Chosen) -> f64 {
        self.of(self.information(&chosen.jacobians))
    }

    /// With one posture, two, ….
    pub fn course(&self, rows: &[usize]) -> Vec<f64> {
        (1..=rows.len()).map(|k| self.value(&rows[..k])).collect()
    }

    /// The best of some candidates beside a covariance: by how much `tr(W Σ)` falls.
    fn best(&self, covariance: &DMatrix<f64>, look: &[usize]) -> Option<(f64, usize)> {
        let moved = covariance * &self.weight * covariance;
        let gain = |i: usize| {
            let j = &self.rows[i];
            let jc = j * covariance;
            let inner = DMatrix::identity(j.nrows(), j.nrows()) + &jc * j.transpose();
            let gain = j * &moved * j.transpose();
            Some((inner.cholesky()?.solve(&gain).trace(), i))
        };
        let all: Vec<(f64, usize)> = look.par_iter().filter_map(|&i| gain(i)).collect();
        all.into_iter()
            .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))
    }

    fn look(&self, rng: &mut ChaCha8Rng, taken: &[usize]) -> Vec<usize> {
        let count = self.rows.len();
        let all = sample(rng, count, LOOK.min(count)).into_vec();
        all.into_iter().filter(|i| !taken.contains(i)).collect()
    }

    /// One after another.
    pub fn greedy(&self, count: usize, rng: &mut ChaCha8Rng) -> Chosen {
        let mut chosen = Chosen {
            rows: Vec::new(),
            jacobians: Vec::new(),
        };
        while chosen.rows.len() < count {
            let look = self.look(rng, &chosen.rows);
            let covariance = self.inverse(self.information(&chosen.jacobians));
            let found = covariance.and_then(|c| self.best(&c, &look));
            let next = found
                .map(|f| f.1)
                .or_else(|| (0..self.rows.len()).find(|i| !chosen.rows.contains(i)));
            let Some(i) = next else { break };
            chosen.rows.push(i);
            chosen.jacobians.push(self.rows[i].clone());
        }
        chosen
    }

    /// Each of the chosen against others, as long as that helps.
    pub fn exchange(&self, chosen: &mut Chosen, rng: &mut ChaCha8Rng) {
        for _ in 0..ROUNDS {
            let mut changed = false;
            for k in 0..chosen.rows.len() {
                let mut look = self.look(rng, &chosen.rows);
                look.push(chosen.rows[k]);
                let mut rest = self.information(&chosen.jacobians);
                let own = &chosen.jacobians[k];
                rest -= own.tr_mul(own);
                let Some((_, i)) = self.inverse(rest).and_then(|c| self.best(&c, &look)) else {
                    continue;
                };
                if i != chosen.rows[k] {
                    chosen.rows[k] = i;
                    chosen.jacobians[k] = self.rows[i].clone();
                    changed = true;
                }
            }
            if !changed {
                break;
            }
        }
    }

    /// Puts another posture in place of one, if that is better.
    pub fn replace(&mut self, chosen: &mut Chosen, k: usize, by: &Candidate) -> bool {
        let Some(j) = self.other(chosen.rows[k], by) else {
            return false;
        };
        let before = self.now(chosen);
        let old = std::mem::replace(&mut chosen.jacobians[k], j);
        let better = self.now(chosen) < before;
        if !better {
            chosen.jacobians[k] = old;
        }
        better
    }

    /// Jacobian of a posture that is no candidate, measured as `row` is.
    fn other(&self, row: usize, by: &Candidate) -> Option<DMatrix<f64>> {
        let mut model = self.model.clone();
        let mut rows = crate::calibrate::Calibration {
            path: Default::default(),
            robot: String::new(),
            frame: None,
            gravity: None,
            effects: None,
            other: None,
            measurements: self.model.input.measurements.clone(),
            distances: Vec::new(),
            rows: vec![self.model.input.rows[row].clone()],
            prior: self.model.input.prior,
            noise_stated: true,
            warnings: Vec::new(),
        };
        rows.rows[0].q.clone_from(&by.q);
        let nominal = [Some(by.frame)];
        model.rates = vec![Vec::new()];
        let model = Model {
            input: &rows,
            nominal: &nominal,
            kin: model.kin,
            features: Vec::new(),
            rates: model.rates,
            unknowns: model.unknowns,
            of_robot: model.of_robot,
            layout: model.layout,
            start: model.start,
            noise: model.noise,
            settings: model.settings,
            consistent: true,
            even: false,
        };
        jacobian(&model, 0)
    }
}

/// Whitened Jacobian of a row in scaled unknowns, all columns.
fn jacobian(model: &Model, row: usize) -> Option<DMatrix<f64>> {
    let x = vec![0.0; model.count()];
    let b = model.block(row, &x)?;
    let mut j = DMatrix::zeros(b.r.len(), model.count());
    for (k, &c) in b.columns.iter().enumerate() {
        for i in 0..b.r.len() {
            j[(i, c)] += b.j[(i, k)] * model.unknowns[c].scale;
        }
    }
    Some(j)
}

/// `Lᵀ L / K` of the tool's position over some rows.
fn predicted(model: &Model, view: &[usize], kind: Kind) -> Result<DMatrix<f64>> {
    let n = model.count();
    let x = vec![0.0; n];
    let mut seen = Vec::with_capacity(view.len());
    for &row in view {
        if kind.is_loop() {
            // what two arms tell is how they meet
            let b = (model.block(row, &x))
                .ok_or_else(|| Error::Infeasible("a candidate cannot be taken".into()))?;
            let std = model.input.measurements[model.input.rows[row].measurement].std[0];
            seen.push((Vector3::zeros(), b.columns, b.j * (std * model.noise)));
            continue;
        }
        let posed = model.posed(row, &x)?;
        seen.push(match kind {
            Kind::Pose | Kind::Position => model.seen_at(row, &posed, &x),
            _ => (posed.frame.p, (0..model.of_robot).collect(), posed.jacobian),
        });
    }
    let mut l = DMatrix::zeros(3 * seen.len(), n);
    let mut rigid = DMatrix::zeros(3 * seen.len(), 6);
    for (v, (p, columns, j)) in seen.iter().enumerate() {
        for (k, &c) in columns.iter().enumerate() {
            for i in 0..3 {
                l[(3 * v + i, c)] = j[(i, k)] * model.unknowns[c].scale;
            }
        }
        for k in 0..3 {
            rigid[(3 * v + k, k)] = 1.0;
            let mut axis = Vector3::zeros();
            axis[k] = 1.0;
            let swing = axis.cross(p);
            for i in 0..3 {
                rigid[(3 * v + i, 3 + k)] = swing[i];
            }
        }
    }
    if !matches!(kind, Kind::Pose | Kind::Position) && !kind.is_loop() {
        let q = rigid.qr().q();
        l -= &q * q.tr_mul(&l);
    }
    Ok(l.tr_mul(&l) / seen.len().max(1) as f64)
}
