//! Weighted least squares for deviations, load and friction of every record at once.

use super::spectrum::{self, Rest};
use crate::dot::dot;
use crate::error::{Error, Result};
use crate::load::system::{Part, System};
use faer::Mat;
use faer::linalg::solvers::SolveLstsq;
use nalgebra::{DMatrix, DVector};

/// Values of all columns, and what they leave.
pub struct Solution {
    /// deviations, load, then friction record by record
    pub values: Vec<f64>,
    /// what is left of the torques, record by record
    pub residual: Vec<Vec<f64>>,
    /// triangular factor of the weighted columns
    pub r: Mat<f64>,
}

/// Deviations of the legs that are unknowns.
pub struct Geometry {
    /// their columns, record by record
    pub columns: Vec<Mat<f64>>,
    /// standard deviation of each before the records are seen, m
    pub spread: f64,
}

/// The system with weights.
pub struct Solver<'a> {
    /// rows
    pub system: &'a System,
    /// unknown parameters of the load, of ten
    pub load: Vec<usize>,
    /// what is subtracted from the torques of loaded records, part by part
    pub shift: Vec<Vec<f64>>,
    /// Stribeck speed of each actuator, where its residual shows one
    pub speeds: Vec<Option<f64>>,
    /// Stribeck factors, part by part
    pub peaks: Vec<Vec<f64>>,
    /// what a change of the Stribeck speed does, part by part; zero where that is not an unknown
    pub slopes: Vec<Vec<f64>>,
    /// standard deviation of the Stribeck forces of each actuator before the records are seen, N m or N
    pub breakaway: Vec<f64>,
    /// deviations of the legs, where the records show them
    pub geometry: Option<Geometry>,
}

/// Friction columns of an actuator in a record: Coulomb, viscous, offset, Stribeck.
const EACH: usize = 4;

/// Largest step of a Stribeck speed, of itself.
const STRIDE: f64 = 0.3;

impl<'a> Solver<'a> {
    pub fn new(system: &'a System, load: Vec<usize>) -> Self {
        Solver {
            system,
            load,
            shift: vec![Vec::new(); system.parts.len()],
            speeds: vec![None; system.actuators],
            peaks: system.parts.iter().map(|p| vec![0.0; p.y.len()]).collect(),
            slopes: system.parts.iter().map(|p| vec![0.0; p.y.len()]).collect(),
            breakaway: vec![f64::INFINITY; system.actuators],
            geometry: None,
        }
    }

    fn columns(&self) -> usize {
        let deviations = self.geometry.as_ref().map(|g| &g.columns[0]);
        self.first_deviation() + deviations.map_or(0, |c| c.ncols())
    }

    /// Column of the first deviation of the legs.
    fn first_deviation(&self) -> usize {
        self.speed(self.system.actuators)
    }

    /// First friction column of a record.
    fn friction(&self, part: usize) -> usize {
        self.system.deviations.len() + self.load.len() + EACH * self.system.actuators * part
    }

    /// Column of the constant force of an actuator in a record.
    pub fn offset(&self, part: usize, a: usize) -> usize {
        self.friction(part) + EACH * a + 2
    }

    /// Column of the Stribeck speed of an actuator, which all records share.
    pub fn speed(&self, a: usize) -> usize {
        self.friction(self.system.parts.len()) + a
    }

    /// Row `i` of a record: its columns with their factors.
    pub fn row(&self, p: usize, part: &Part, i: usize, to: &mut dyn FnMut(usize, f64)) {
        let nd = self.system.deviations.len();
        for c in 0..nd {
            to(c, part.deviation[(i, c)]);
        }
        if part.loaded {
            for (c, &k) in self.load.iter().enumerate() {
                to(nd + c, part.tool[(i, k)]);
            }
        }
        let first = self.friction(p) + EACH * (i / part.count);
        for (f, column) in part.friction.iter().enumerate() {
            to(first + f, column[i]);
        }
        to(first + 3, self.peaks[p][i]);
        to(self.speed(i / part.count), self.slopes[p][i]);
        if let Some(g) = &self.geometry {
            for c in 0..g.columns[p].ncols() {
                to(self.first_deviation() + c, g.columns[p][(i, c)]);
            }
        }
    }

    /// Looks for Stribeck friction in the residuals of every actuator; `sigma` are their standard
    /// deviations.
    pub fn find_peaks(&mut self, s: &Solution, sigma: &[f64]) {
        for (a, sigma) in sigma.iter().enumerate() {
            if let Some(speed) = self.stribeck_speed(s, a, *sigma) {
                self.speeds[a] = speed;
            }
        }
        self.set_peaks();
    }

    /// Stribeck factors of the speeds that are set.
    fn set_peaks(&mut self) {
        for (p, part) in self.system.parts.iter().enumerate() {
            for (a, speed) in self.speeds.iter().enumerate() {
                let to = &mut self.peaks[p][a * part.count..(a + 1) * part.count];
                match speed {
                    Some(v) => to.copy_from_slice(&part.stribeck(a, *v)),
                    None => to.fill(0.0),
                }
            }
        }
    }

    /// Makes the Stribeck speeds unknowns: their columns, about the forces of a solution. What the solution has found of
    /// them is put into effect first, at most [`STRIDE`] of each.
    pub fn linearise(&mut self, s: &Solution) {
        for a in 0..self.system.actuators {
            let step = s.values[self.speed(a)];
            if let Some(v) = &mut self.speeds[a] {
                *v += step.clamp(-STRIDE * *v, STRIDE * *v);
            }
        }
        self.set_peaks();
        for (p, part) in self.system.parts.iter().enumerate() {
            for (a, speed) in self.speeds.iter().enumerate() {
                let Some(speed) = speed else { continue };
                let force = s.values[self.friction(p) + EACH * a + 3];
                let to = &mut self.slopes[p][a * part.count..(a + 1) * part.count];
                for (to, slope) in to.iter_mut().zip(part.stribeck_slope(a, *speed)) {
                    *to = force * slope;
                }
            }
        }
    }

    /// The speed `v_s` of an actuator whose factor explains most of its residuals, one force a record.
    /// It is kept where it explains more than chance would (BIC). `None` where nothing can be said.
    fn stribeck_speed(&self, s: &Solution, a: usize, sigma: f64) -> Option<Option<f64>> {
        // residuals without the Stribeck force found so far
        let rest: Vec<Vec<f64>> = self
            .system
            .parts
            .iter()
            .enumerate()
            .map(|(p, part)| {
                let force = s.values[self.friction(p) + EACH * a + 3];
                (a * part.count..(a + 1) * part.count)
                    .map(|i| s.residual[p][i] + force * self.peaks[p][i])
                    .collect()
            })
            .collect();
        let total: f64 = rest.iter().flatten().map(|r| r * r).sum();
        let n: usize = rest.iter().map(Vec::len).sum();
        let explained = |speed: f64| -> f64 {
            self.system
                .parts
                .iter()
                .zip(&rest)
                .map(|(part, r)| {
                    let b = part.stribeck(a, speed);
                    let bb: f64 = b.iter().map(|x| x * x).sum();
                    let br = dot(&b, r);
                    if bb > 1e-9 { br * br / bb } else { 0.0 }
                })
                .sum()
        };
        let fastest = self
            .system
            .parts
            .iter()
            .flat_map(|p| &p.speed[a * p.count..(a + 1) * p.count])
            .fold(0.0f64, |m, v| m.max(v.abs()));
        // a grid, then the golden section about its best point
        const STEP: f64 = 1.35;
        let grid = (0..15).map(|k| 0.005 * fastest * STEP.powi(k));
        let best = grid
            .map(|v| (explained(v), v))
            .max_by(|x, y| x.0.total_cmp(&y.0));
        let (_, centre) = best.filter(|b| b.0.is_finite() && b.1 > 0.0)?;
        let (mut low, mut high) = ((centre / STEP).ln(), (centre * STEP).ln());
        for _ in 0..12 {
            let (u, v) = (low + 0.382 * (high - low), high - 0.382 * (high - low));
            if explained(u.exp()) > explained(v.exp()) {
                high = v;
            } else {
                low = u;
            }
        }
        let speed = (0.5 * (low + high)).exp();
        let left = (total - explained(speed)).max(n as f64 * (1e-6 * sigma).powi(2));
        let gain = n as f64 * (total / left).ln();
        let price = 2.0 * (self.system.parts.len() + 1) as f64 * (n as f64).ln();
        Some((gain > price && total > 0.0).then_some(speed))
    }

    /// Weighted least squares; `deviation(p, i)` is the standard deviation of row `i` of record `p`.
    pub fn solve(&self, deviation: &dyn Fn(usize, usize) -> f64) -> Result<Solution> {
        Ok(self.solve_with(deviation, false)?.0)
    }

    /// The same, with the covariance of all columns that counts the power of what is left over frequency (see
    /// [`spectrum`]): rows that are not white are worth less.
    ///
    /// # Errors
    /// Signals that are not finite.
    pub fn solve_coloured(
        &self,
        deviation: &dyn Fn(usize, usize) -> f64,
    ) -> Result<(Solution, Mat<f64>)> {
        let (solution, covariance, _) = self.solve_with(deviation, true)?;
        Ok((solution, covariance))
    }

    fn solve_with(
        &self,
        deviation: &dyn Fn(usize, usize) -> f64,
        coloured: bool,
    ) -> Result<(Solution, Mat<f64>, Vec<Rest>)> {
        let (a, y) = self.rows(deviation, coloured);
        let n = a.ncols();
        let qr = a.qr();
        let values: Vec<f64> = {
            let x = qr.solve_lstsq(&y);
            (0..n).map(|c| x[(c, 0)]).collect()
        };
        if values.iter().any(|v| !v.is_finite()) {
            return Err(Error::Infeasible(
                "the least-squares problem of the load has no finite solution: the logs hold \
                 numbers that are not finite, or the robot does not move"
                    .into(),
            ));
        }
        let r = qr.thin_R().to_owned();
        let (mut covariance, mut rests) = (Mat::zeros(0, 0), Vec::new());
        if coloured {
            let q = qr.compute_thin_Q();
            rests = self.rests(&a, &y, &values, &q);
            let power: Vec<_> = rests.iter().map(Rest::power).collect();
            covariance = self.sandwich(q, &r, &power);
        }
        let solution = Solution {
            residual: self.residual(&values),
            values,
            r,
        };
        Ok((solution, covariance, rests))
    }

    /// Weighted rows and right-hand side, with those of the regularisation; turned into those of single frequencies or not.
    fn rows(&self, deviation: &dyn Fn(usize, usize) -> f64, turned: bool) -> (Mat<f64>, Mat<f64>) {
        let n = self.columns();
        let rows: usize = self.system.parts.iter().map(|p| p.y.len()).sum();
        let mut a = Mat::<f64>::zeros(rows + n, n);
        let mut y = Mat::<f64>::zeros(rows + n, 1);
        let mut r = 0;
        for (p, part) in self.system.parts.iter().enumerate() {
            for i in 0..part.y.len() {
                let w = 1.0 / deviation(p, i);
                self.row(p, part, i, &mut |c, v| a[(r, c)] = w * v);
                let shift = self.shift[p].get(i).copied().unwrap_or(0.0);
                y[(r, 0)] = w * (part.y[i] - shift);
                r += 1;
            }
        }
        if turned {
            // least squares do not change where the rows are turned into those of single frequencies
            self.turn(&mut a);
            self.turn(&mut y);
        }
        self.regularise(&mut a, rows);
        (a, y)
    }

    /// Power over frequency of what a fit leaves, actuator by actuator in record by record.
    ///
    /// # Errors
    /// Signals that are not finite.
    pub fn power(&self, deviation: &dyn Fn(usize, usize) -> f64) -> Result<Vec<Vec<f64>>> {
        Ok(self.left(deviation)?.iter().map(Rest::power).collect())
    }

    /// What a fit leaves, actuator by actuator in record by record, in rows of single frequencies.
    ///
    /// # Errors
    /// Signals that are not finite.
    pub fn left(&self, deviation: &dyn Fn(usize, usize) -> f64) -> Result<Vec<Rest>> {
        Ok(self.solve_with(deviation, true)?.2)
    }

    /// What the residual of the fit tells of other columns, those of each record: `G⊥ᵀ S⁻¹ G⊥` and `G⊥ᵀ S⁻¹ e`, where the fit
    /// has taken its own out of them. Of the power over frequency `S`.
    ///
    /// # Errors
    /// Signals that are not finite.
    pub fn beside(
        &self,
        deviation: &dyn Fn(usize, usize) -> f64,
        others: &[Mat<f64>],
        power: &[Vec<f64>],
    ) -> Result<(DMatrix<f64>, DVector<f64>)> {
        let (a, y) = self.rows(deviation, true);
        let rows = self.system.parts.iter().map(|p| p.y.len()).sum();
        let mut all = Mat::<f64>::zeros(a.nrows(), others[0].ncols() + 1);
        let mut r = 0;
        for (p, part) in self.system.parts.iter().enumerate() {
            for i in 0..part.y.len() {
                let w = 1.0 / deviation(p, i);
                for c in 0..others[p].ncols() {
                    all[(r, c)] = w * others[p][(i, c)];
                }
                r += 1;
            }
        }
        self.turn(&mut all);
        let last = all.ncols() - 1;
        for r in 0..y.nrows() {
            all[(r, last)] = y[(r, 0)];
        }
        let q = a.qr().compute_thin_Q();
        let taken = q.transpose() * &all;
        all -= &q * taken;
        let roots = power.iter().flatten().map(|s| s.sqrt());
        for (r, root) in (0..rows).zip(roots) {
            for c in 0..=last {
                all[(r, c)] /= root;
            }
        }
        let rows = all.subrows(0, rows);
        let gram = rows.transpose() * rows;
        if (0..=last).any(|c| !gram[(c, c)].is_finite()) {
            return Err(Error::Infeasible(
                "what a change of the geometry does to the forces is not finite".into(),
            ));
        }
        Ok((
            DMatrix::from_fn(last, last, |i, k| gram[(i, k)]),
            DVector::from_fn(last, |i, _| gram[(i, last)]),
        ))
    }

    /// What the unweighted fit makes of other torques, one set a column: values of all columns.
    pub fn respond(&self, torques: &Mat<f64>) -> Mat<f64> {
        let (a, _) = self.rows(&|_, _| 1.0, false);
        let (n, rows) = (a.ncols(), torques.nrows());
        let padded = Mat::from_fn(rows + n, torques.ncols(), |i, k| match i < rows {
            true => torques[(i, k)],
            false => 0.0,
        });
        let x = a.qr().solve_lstsq(&padded);
        Mat::from_fn(n, torques.ncols(), |i, k| x[(i, k)])
    }

    /// A breath of regularisation for columns that the motion does not tell apart, which changes the others by 1e-18 of
    /// themselves; and what is known of the size of Stribeck forces.
    fn regularise(&self, a: &mut Mat<f64>, rows: usize) {
        let norms: Vec<f64> = (0..a.ncols()).map(|c| a.col(c).norm_l2()).collect();
        for (c, value) in self.ridge(&norms).into_iter().enumerate() {
            a[(rows + c, c)] = value;
        }
    }

    /// The diagonal of that, from the norms of the weighted columns.
    pub fn ridge(&self, norms: &[f64]) -> Vec<f64> {
        let top = norms.iter().fold(1.0f64, |m, v| m.max(*v));
        let breath = |norm: &f64| 1e-9 * if *norm > 0.0 { *norm } else { top };
        let mut out: Vec<f64> = norms.iter().map(breath).collect();
        for p in 0..self.system.parts.len() {
            for (k, force) in self.breakaway.iter().enumerate() {
                let c = self.friction(p) + EACH * k + 3;
                out[c] = out[c].max(1.0 / force);
            }
        }
        if let Some(g) = &self.geometry {
            out[self.first_deviation()..].fill(1.0 / g.spread);
        }
        out
    }

    /// First row and number of rows of every actuator in every record.
    fn blocks(&self) -> Vec<[usize; 2]> {
        let mut first = 0;
        let mut out = Vec::new();
        for part in &self.system.parts {
            for _ in 0..self.system.actuators {
                out.push([first, part.count]);
                first += part.count;
            }
        }
        out
    }

    /// Turns the rows of every actuator in every record into those of single frequencies.
    fn turn(&self, m: &mut Mat<f64>) {
        let blocks = self.blocks();
        for c in 0..m.ncols() {
            for &[first, count] in &blocks {
                let own: Vec<f64> = (first..first + count).map(|r| m[(r, c)]).collect();
                if own.iter().all(|v| *v == 0.0) {
                    continue;
                }
                for (k, v) in spectrum::rows(&own).into_iter().enumerate() {
                    m[(first + k, c)] = v;
                }
            }
        }
    }

    /// What is left, actuator by actuator in record by record, from turned rows.
    fn rests(&self, a: &Mat<f64>, y: &Mat<f64>, values: &[f64], q: &Mat<f64>) -> Vec<Rest> {
        let mut out = Vec::new();
        for [first, count] in self.blocks() {
            let (mut e, mut h) = (Vec::with_capacity(count), Vec::with_capacity(count));
            for row in first..first + count {
                let fit: f64 = (0..a.ncols()).map(|c| a[(row, c)] * values[c]).sum();
                e.push(y[(row, 0)] - fit);
                h.push((0..q.ncols()).map(|c| q[(row, c)] * q[(row, c)]).sum());
            }
            out.push(Rest {
                rows: e,
                leverage: h,
            });
        }
        out
    }

    /// Covariance of the least-squares solution of rows with this power: `R⁻¹ (Qᵀ diag(S) Q) R⁻ᵀ`.
    fn sandwich(&self, mut q: Mat<f64>, r: &Mat<f64>, power: &[Vec<f64>]) -> Mat<f64> {
        for ([first, _], power) in self.blocks().into_iter().zip(power) {
            for (k, s) in power.iter().enumerate() {
                for c in 0..q.ncols() {
                    q[(first + k, c)] *= s.sqrt();
                }
            }
        }
        let mut root = q.transpose().to_owned();
        faer::linalg::triangular_solve::solve_upper_triangular_in_place(
            r.as_ref(),
            root.as_mut(),
            faer::get_global_parallelism(),
        );
        &root * root.transpose()
    }

    /// What these values leave of the torques, record by record.
    pub fn residual(&self, values: &[f64]) -> Vec<Vec<f64>> {
        let left = |(p, part): (usize, &Part)| {
            (0..part.y.len())
                .map(|i| {
                    let mut rest = part.y[i] - self.shift[p].get(i).copied().unwrap_or(0.0);
                    self.row(p, part, i, &mut |c, v| rest -= values[c] * v);
                    rest
                })
                .collect()
        };
        self.system.parts.iter().enumerate().map(left).collect()
    }

    /// Coulomb, viscous, offset and Stribeck force of an actuator in a record.
    pub fn friction_of(&self, s: &Solution, part: usize, a: usize) -> [f64; EACH] {
        let first = self.friction(part) + EACH * a;
        std::array::from_fn(|f| s.values[first + f])
    }

    /// Friction of row `i` of a record by these values, Stribeck force included.
    pub fn friction_at(&self, values: &[f64], p: usize, i: usize) -> f64 {
        let part = &self.system.parts[p];
        let first = self.friction(p) + EACH * (i / part.count);
        let three = part.friction.iter().enumerate();
        let three: f64 = three.map(|(f, column)| values[first + f] * column[i]).sum();
        three + values[first + 3] * self.peaks[p][i]
    }

    /// What the deviations of the legs make of row `i` of a record by these values.
    pub fn geometry_at(&self, values: &[f64], p: usize, i: usize) -> f64 {
        let Some(g) = &self.geometry else { return 0.0 };
        let own = values[self.first_deviation()..].iter().enumerate();
        own.map(|(c, v)| v * g.columns[p][(i, c)]).sum()
    }

    /// Their standard deviations, and that of the Stribeck speed, from the covariance of all columns.
    pub fn friction_stds(&self, c: &Mat<f64>, part: usize, a: usize) -> [f64; EACH + 1] {
        let first = self.friction(part) + EACH * a;
        std::array::from_fn(|f| {
            let k = if f < EACH { first + f } else { self.speed(a) };
            c[(k, k)].max(0.0).sqrt()
        })
    }
}
