//! Weighted least squares for deviations, load and friction of every record at once.

use crate::error::{Error, Result};
use crate::load::system::{Part, System};
use faer::Mat;
use faer::linalg::solvers::SolveLstsq;

/// Values of all columns, and what they leave.
pub struct Solution {
    /// deviations, load, then friction record by record
    pub values: Vec<f64>,
    /// what is left of the torques, record by record
    pub residual: Vec<Vec<f64>>,
    /// triangular factor of the weighted columns
    pub r: Mat<f64>,
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
}

/// Friction columns of an actuator in a record: Coulomb, viscous, offset, Stribeck.
const EACH: usize = 4;

impl<'a> Solver<'a> {
    pub fn new(system: &'a System, load: Vec<usize>) -> Self {
        Solver {
            system,
            load,
            shift: vec![Vec::new(); system.parts.len()],
            speeds: vec![None; system.actuators],
            peaks: system.parts.iter().map(|p| vec![0.0; p.y.len()]).collect(),
        }
    }

    fn columns(&self) -> usize {
        let friction = EACH * self.system.actuators * self.system.parts.len();
        self.system.deviations.len() + self.load.len() + friction
    }

    /// First friction column of a record.
    fn friction(&self, part: usize) -> usize {
        self.system.deviations.len() + self.load.len() + EACH * self.system.actuators * part
    }

    fn row(&self, p: usize, part: &Part, i: usize, to: &mut dyn FnMut(usize, f64)) {
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
    }

    /// Looks for Stribeck friction in the residuals of every actuator; `sigma` are their standard
    /// deviations.
    pub fn find_peaks(&mut self, s: &Solution, sigma: &[f64]) {
        for (a, sigma) in sigma.iter().enumerate() {
            if let Some(speed) = self.stribeck_speed(s, a, *sigma) {
                self.speeds[a] = speed;
            }
        }
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
                    let br: f64 = b.iter().zip(r).map(|(x, y)| x * y).sum();
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
        // a breath of regularisation for columns that the motion does not tell apart; it changes
        // the others by 1e-18 of themselves
        let mut top = 0.0f64;
        for c in 0..n {
            top = top.max(a.col(c).norm_l2());
        }
        for c in 0..n {
            let norm = a.col(c).norm_l2();
            a[(rows + c, c)] = 1e-9 * if norm > 0.0 { norm } else { top.max(1.0) };
        }
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
        let residual = self
            .system
            .parts
            .iter()
            .enumerate()
            .map(|(p, part)| {
                (0..part.y.len())
                    .map(|i| {
                        let mut rest = part.y[i] - self.shift[p].get(i).copied().unwrap_or(0.0);
                        self.row(p, part, i, &mut |c, v| rest -= values[c] * v);
                        rest
                    })
                    .collect()
            })
            .collect();
        Ok(Solution {
            values,
            residual,
            r: qr.thin_R().to_owned(),
        })
    }

    /// Coulomb, viscous, offset and Stribeck force of an actuator in a record.
    pub fn friction_of(&self, s: &Solution, part: usize, a: usize) -> [f64; EACH] {
        let first = self.friction(part) + EACH * a;
        std::array::from_fn(|f| s.values[first + f])
    }
}
