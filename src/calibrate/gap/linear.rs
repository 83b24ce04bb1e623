//! Rows made linear about an explanation.

use super::catalogue::{Catalogue, Place};
use super::problem::{Lines, Problem};
use super::search::{Search, Set};
use crate::calibrate::fit::{self, Plan};
use crate::calibrate::frame::Frame;
use crate::calibrate::model::{Block, Model};
use crate::calibrate::robust;
use crate::calibrate::row::Row;
use crate::error::{Error, Result};
use nalgebra::{DMatrix, DVector};

/// A model with the columns of all effects, and where it stands.
pub struct Bed<'a> {
    /// robot, rows, columns
    pub model: Model<'a>,
    /// rows that count
    pub weights: Vec<f64>,
    /// effects at places
    pub places: &'a [Place],
    /// groups whose base may have moved
    bases: &'a [usize],
    /// expected size of the base's six numbers
    size: [f64; 2],
    /// cameras without a moved base
    cameras: Vec<Frame>,
    /// unknowns of the model
    pub x: Vec<f64>,
    /// moves of the bases
    pub moved: Vec<f64>,
}

/// An effect of its expected size that makes less than this many standard deviations is not seen.
const SEEN: f64 = 3.0;

impl<'a> Bed<'a> {
    /// Of a model, with nothing explained.
    pub fn new(
        model: Model<'a>,
        weights: Vec<f64>,
        catalogue: &'a Catalogue,
        size: [f64; 2],
        x: Vec<f64>,
    ) -> Self {
        Bed {
            cameras: model.start.camera.clone(),
            places: &catalogue.places,
            bases: &catalogue.bases,
            moved: vec![0.0; 6 * catalogue.bases.len()],
            model,
            weights,
            size,
            x,
        }
    }

    /// Scale of a column: of an unknown, or of a base.
    pub fn scale(&self, column: usize) -> f64 {
        match self.model.unknowns.get(column) {
            Some(u) => u.scale,
            None => self.size[usize::from((column - self.model.count()) % 6 >= 3)],
        }
    }

    /// Name and unit of a column.
    pub fn name(&self, column: usize) -> (String, &'static str) {
        match self.model.unknowns.get(column) {
            Some(u) => {
                let short = u.name.split_once('.').map_or(u.name.as_str(), |n| n.1);
                (short.to_string(), u.unit)
            }
            None => {
                let k = (column - self.model.count()) % 6;
                let name = ["x", "y", "z", "rx", "ry", "rz"][k];
                (name.to_string(), if k < 3 { "m" } else { "rad" })
            }
        }
    }

    /// Value of a column.
    fn value(&self, column: usize) -> f64 {
        match self.x.get(column) {
            Some(v) => *v,
            None => self.moved[column - self.x.len()],
        }
    }

    /// A row with its columns, those of its group's base among them, scaled; residuals where all columns are zero.
    fn line(&self, block: &Block, row: Option<usize>) -> (DVector<f64>, Vec<usize>, DMatrix<f64>) {
        let input = self.model.input;
        let mut columns = block.columns.clone();
        let mut from: Vec<usize> = (0..columns.len()).collect();
        if let Some(row) = row.map(|i| &input.rows[i])
            && let Some(camera) = self.model.layout.camera[row.measurement]
            && let Some(b) = self.bases.iter().position(|&g| g == input.group_of(row))
            && let Some(at) = block.columns.iter().position(|&c| c == camera)
        {
            for k in 0..6 {
                columns.push(self.model.count() + 6 * b + k);
                from.push(at + k);
            }
        }
        let scaled = |c: usize, k: usize| block.j.column(from[k]) * self.scale(c);
        let mut j = DMatrix::zeros(block.r.len(), columns.len());
        let mut r = block.r.clone();
        for (k, &c) in columns.iter().enumerate() {
            j.set_column(k, &scaled(c, k));
            r -= block.j.column(from[k]) * self.value(c);
        }
        (r, columns, j)
    }

    /// All rows that count.
    pub fn lines(&self) -> Result<Lines> {
        let n = self.model.count() + self.moved.len();
        let mut all = Lines {
            gram: DMatrix::zeros(n, n),
            rhs: DVector::zeros(n),
            count: 0,
        };
        let mut add = |(r, columns, j): (DVector<f64>, Vec<usize>, DMatrix<f64>)| {
            let jtj = j.tr_mul(&j);
            let jtr = j.tr_mul(&r);
            for (a, &ca) in columns.iter().enumerate() {
                all.rhs[ca] -= jtr[a];
                for (b, &cb) in columns.iter().enumerate() {
                    all.gram[(ca, cb)] += jtj[(a, b)];
                }
            }
            all.count += r.len();
        };
        for i in (0..self.weights.len()).filter(|&i| self.weights[i] > 0.0) {
            let block = self.model.block(i, &self.x).ok_or_else(|| {
                Error::Infeasible("a posture cannot be taken by the robot of the file".into())
            })?;
            add(self.line(&block, Some(i)));
        }
        for block in self.model.distances(&self.x) {
            add(self.line(&block, None));
        }
        Ok(all)
    }

    /// The problem in the columns of effects.
    pub fn problem(&self) -> Result<Problem> {
        let set_up: Vec<usize> = (self.model.of_robot..self.model.count())
            .filter(|&k| !self.model.unknowns[k].held)
            .collect();
        let precision = |k: &usize| {
            let u = &self.model.unknowns[*k];
            (u.scale / u.prior).powi(2).max(1e-9)
        };
        let weights: Vec<f64> = set_up.iter().map(precision).collect();
        Problem::new(&self.lines()?, &set_up, &weights).ok_or_else(|| {
            Error::Infeasible("the rows do not tell where camera, target or sockets are".into())
        })
    }

    /// Fits a set to the rows as they are: moves of bases from the linear problem, the rest by Gauss-Newton.
    pub fn fit(&mut self, set: &Set, problem: &Problem) -> Result<()> {
        let search = Search {
            problem,
            places: self.places,
        };
        self.moved.fill(0.0);
        let count = self.model.count();
        if let Some(solved) = search.solve(set) {
            let columns = set.iter().flat_map(|(p, _)| self.places[*p].columns.iter());
            for (&c, v) in columns.zip(solved.mean.iter()) {
                if c >= count {
                    self.moved[c - count] = v * self.scale(c);
                }
            }
        }
        let mut start = self.model.start.clone();
        for (m, camera) in start.camera.iter_mut().enumerate() {
            *camera = self.cameras[m];
            let group = &self.model.input.measurements[m].group;
            let groups = self.model.input.groups();
            let at = self.bases.iter().position(|&g| groups[g] == group);
            if let Some(b) = at {
                *camera = camera.then(&Frame::small(&self.moved[6 * b..6 * b + 6]));
            }
        }
        self.model.start = start;
        self.x = self.fitted(set)?;
        Ok(())
    }

    /// Unknowns of a set, with what only held-out rows see.
    pub fn fitted(&self, set: &Set) -> Result<Vec<f64>> {
        self.fitted_in(self.model.clone(), set)
    }

    /// The model in which the base of a place has not moved, and the unknowns of the other places in it.
    pub fn unmoved(&self, place: &Place, rest: &Set) -> Result<(Model<'a>, Vec<f64>)> {
        let mut model = self.model.clone();
        let own = |k: usize| place.columns.contains(&(self.model.count() + 6 * k));
        let groups = model.input.groups();
        for (m, measured) in model.input.measurements.iter().enumerate() {
            let of = |b: &usize| groups[self.bases[*b]] == measured.group;
            if (0..self.bases.len()).any(|b| of(&b) && own(b)) {
                model.start.camera[m] = self.cameras[m];
            }
        }
        let x = self.fitted_in(model.clone(), rest)?;
        Ok((model, x))
    }

    /// Whether rows held out are seen by the instrument of a group's base.
    pub fn judged(&self, place: &Place) -> bool {
        let input = self.model.input;
        let seen = |fit: bool, row: &Row| {
            let m = &input.measurements[row.measurement];
            (row.fit == fit && (!fit || m.group == place.name)).then_some(&m.instrument)
        };
        let all = |fit| input.rows.iter().filter_map(move |r| seen(fit, r));
        all(true)
            .next()
            .is_some_and(|own| all(false).any(|i| i == own))
    }

    fn fitted_in(&self, mut model: Model, set: &Set) -> Result<Vec<f64>> {
        let mut plan = Plan {
            weights: self.weights.clone(),
            free: Vec::new(),
            robust: false,
        };
        plan.free = robust::seen(&model, &plan);
        plan.free[..model.of_robot].fill(false);
        let mut x = self.x.clone();
        for (p, size) in set {
            for &c in self.places[*p].columns.iter().filter(|c| **c < x.len()) {
                plan.free[c] = true;
                model.unknowns[c].prior *= size;
            }
        }
        let robot = x.iter_mut().zip(&plan.free).take(model.of_robot);
        robot
            .filter(|(_, free)| !**free)
            .for_each(|(v, _)| *v = 0.0);
        let x = fit::solve(&model, &plan, &x)?.x;
        robust::set_up_rest(&model, &plan, &x)
    }

    /// Misfit of the rows that count.
    pub fn cost(&self, x: &[f64]) -> f64 {
        let rows = (0..self.weights.len()).filter(|&i| self.weights[i] > 0.0);
        rows.filter_map(|i| Some(self.model.block(i, x)?.r.norm_squared()))
            .sum()
    }

    /// Fitted rows that do not count, with a mean square up to a limit.
    pub fn strays(&self, x: &[f64], limit: f64) -> Vec<usize> {
        let rows = &self.model.input.rows;
        let own = (0..rows.len()).filter(|&i| rows[i].fit && !(self.weights[i] > 0.0));
        own.filter(|&i| {
            let (cost, count) = self.misfit(&[i], x);
            count > 0.0 && cost <= limit * count
        })
        .collect()
    }

    /// Misfit of some rows, and the number of their residuals.
    pub fn misfit(&self, rows: &[usize], x: &[f64]) -> (f64, f64) {
        let blocks = rows.iter().filter_map(|&i| self.model.block(i, x));
        blocks.fold((0.0, 0.0), |(cost, count), b| {
            (cost + b.r.norm_squared(), count + b.r.len() as f64)
        })
    }

    /// Effects at places that these rows do not show.
    pub fn untestable(&self) -> Result<Vec<(&'static str, String)>> {
        let problem = self.problem()?;
        let unseen = |p: &&Place| {
            let eigen = problem.information(&p.columns).symmetric_eigen();
            !(eigen.eigenvalues.max() > SEEN * SEEN)
        };
        // one effect at one place may have several columns: that one shows is enough
        let own = |p: &Place| (p.effect, p.name.clone());
        let (hidden, shown): (Vec<&Place>, Vec<&Place>) = self.places.iter().partition(unseen);
        let shown: Vec<_> = shown.into_iter().map(own).collect();
        let mut all: Vec<_> = hidden.into_iter().map(own).collect();
        all.retain(|p| !shown.contains(p));
        all.dedup();
        Ok(all)
    }
}
