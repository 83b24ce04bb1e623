//! The limits as linear rows in the free numbers `x`, and the steps that keep inside them for all
//! time.
//!
//! Position, velocity, acceleration and jerk at an instant are linear in the coefficients of the
//! series, so the set of trajectories inside the limits is convex. A subproblem holds rows at a
//! uniform grid and at the exact extrema of the present trajectory. Between those instants a step
//! can exceed a limit by an amount of second order only, and does not get the chance:
//! [`Limits::pull_inside`] finds the exact extrema of the new trajectory and shrinks the motion of
//! that joint about its resting posture until they fit, so every iterate of a design is feasible
//! for all time.

use crate::robot::Robot;
use crate::trajectory::{Basis, Extremum, Series, Table, extrema_fast};

/// Bounds of one derivative of one joint.
#[derive(Debug, Clone, Copy)]
struct Band {
    order: u32,
    low: f64,
    high: f64,
}

/// The limits of all joints in the coordinates of a basis.
#[derive(Debug, Clone)]
pub struct Limits {
    basis: Basis,
    table: Table,
    /// rows of the basis at the grid, per order: `rows[order][i]`, `m` numbers each
    grid: Vec<Vec<Vec<f64>>>,
    bands: Vec<Vec<Band>>,
    omega: f64,
    /// posture of rest, where it is not the middle of the ranges
    home: Option<Vec<f64>>,
}

/// Memory for [`extrema_fast`].
#[derive(Debug, Clone, Default)]
pub struct ExtremaWork {
    samples: Vec<f64>,
    found: Vec<Extremum>,
}

/// One linear constraint `row · δ_j ≤ slack` of joint `joint`.
#[derive(Debug, Clone)]
pub struct Row {
    /// joint
    pub joint: usize,
    /// coefficients of the free numbers of that joint
    pub row: Vec<f64>,
    /// room left
    pub slack: f64,
}

/// Fraction of every limit that the optimiser leaves free, so that rounding in the coefficients
/// cannot break one.
const MARGIN: f64 = 1e-11;

impl Limits {
    /// Limits of a robot, times `derate` (positions keep the middle of their range).
    pub fn new(robot: &Robot, basis: &Basis, period: f64, derate: f64) -> Self {
        let most = basis.harmonics.iter().copied().max().unwrap_or(1) as usize;
        let table = Table::new(period, &basis.harmonics, 24 * most);
        let coarse = Table::new(period, &basis.harmonics, 4 * most);
        let grid = (0..4)
            .map(|order| {
                let d = coarse.design(order) * &basis.map;
                (0..coarse.len())
                    .map(|i| d.row(i).iter().copied().collect())
                    .collect()
            })
            .collect();
        let bands = robot
            .joints
            .iter()
            .map(|j| {
                let l = &j.limits;
                let [low, high] = l.position;
                let mut bands = Vec::new();
                if low.is_finite() || high.is_finite() {
                    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
                    let (low, high) = match half.is_finite() {
                        true => (middle - half * derate, middle + half * derate),
                        false => (low, high),
                    };
                    bands.push(Band {
                        order: 0,
                        low,
                        high,
                    });
                }
                for (order, limit) in [(1, l.velocity), (2, l.acceleration), (3, l.jerk)] {
                    if limit.is_finite() {
                        bands.push(Band {
                            order,
                            low: -limit * derate,
                            high: limit * derate,
                        });
                    }
                }
                for b in &mut bands {
                    let size = (b.high - b.low).abs();
                    let size = if size.is_finite() {
                        size
                    } else {
                        b.low.abs().min(b.high.abs())
                    };
                    b.low += MARGIN * size;
                    b.high -= MARGIN * size;
                }
                bands
            })
            .collect();
        Limits {
            omega: std::f64::consts::TAU / period,
            basis: basis.clone(),
            table,
            grid,
            bands,
            home: None,
        }
    }

    /// These limits about another posture of rest, where it lies inside the ranges.
    pub fn resting(mut self, home: &[f64]) -> Self {
        let inside = |(j, x): (usize, &f64)| {
            let mut bands = self.bands[j].iter().filter(|b| b.order == 0);
            bands.all(|b| *x > b.low && *x < b.high)
        };
        if home.len() == self.bands.len() && home.iter().enumerate().all(inside) {
            self.home = Some(home.to_vec());
        }
        self
    }

    /// Series of joint `j`.
    pub fn series(&self, j: usize, x_j: &[f64]) -> Series {
        Series::from_coefficients(self.basis.coefficients(j, x_j).as_slice())
    }

    /// Row of the basis for a derivative at time `t`.
    fn row(&self, order: u32, t: f64) -> Vec<f64> {
        let h = self.basis.harmonics.len();
        let mut c = vec![0.0; 2 * h + 1];
        c[0] = if order == 0 { 1.0 } else { 0.0 };
        for (k, &n) in self.basis.harmonics.iter().enumerate() {
            let w = f64::from(n) * self.omega;
            let (s, co) = (w * t).sin_cos();
            let f = w.powi(order as i32);
            let (ds, dc) = match order % 4 {
                0 => (s, co),
                1 => (co, -s),
                2 => (-s, -co),
                _ => (-co, s),
            };
            c[1 + k] = f * ds;
            c[1 + h + k] = f * dc;
        }
        let map = &self.basis.map;
        (0..map.ncols())
            .map(|m| (0..c.len()).map(|i| c[i] * map[(i, m)]).sum())
            .collect()
    }

    /// Rows for a subproblem around `x`: at the exact extrema and at the grid, those instants that
    /// use more than `near` of a limit (measured from the rest posture).
    pub fn rows(&self, x: &[f64], near: f64, work: &mut ExtremaWork) -> Vec<Row> {
        let m = self.basis.free();
        let mut rows = Vec::new();
        for (j, bands) in self.bands.iter().enumerate() {
            let x_j = &x[j * m..(j + 1) * m];
            let series = self.series(j, x_j);
            for b in bands {
                for row in &self.grid[b.order as usize] {
                    self.push(j, b, row, x_j, near, &mut rows);
                }
                extrema_fast(
                    &self.table,
                    &series,
                    b.order,
                    &mut work.samples,
                    &mut work.found,
                );
                for e in &work.found {
                    self.push(j, b, &self.row(b.order, e.time), x_j, near, &mut rows);
                }
            }
        }
        rows
    }

    /// Adds the row of one instant where it is near a limit.
    fn push(&self, j: usize, b: &Band, row: &[f64], x_j: &[f64], near: f64, rows: &mut Vec<Row>) {
        let constant = if b.order == 0 {
            self.basis.offset[j][0]
        } else {
            0.0
        };
        let value = constant + row.iter().zip(x_j).map(|(r, x)| r * x).sum::<f64>();
        let rest = if b.order == 0 { self.rest(j) } else { 0.0 };
        if value - rest > near * (b.high - rest) {
            rows.push(Row {
                joint: j,
                row: row.to_vec(),
                slack: (b.high - value).max(0.0),
            });
        }
        if rest - value > near * (rest - b.low) {
            let row = row.iter().map(|r| -r).collect();
            rows.push(Row {
                joint: j,
                row,
                slack: (value - b.low).max(0.0),
            });
        }
    }

    /// Adds the instants at which `next` leaves a limit by more than a thousandth of it, as rows
    /// around `x`.
    pub fn cut(&self, x: &[f64], next: &[f64], rows: &mut Vec<Row>, work: &mut ExtremaWork) {
        let m = self.basis.free();
        for (j, bands) in self.bands.iter().enumerate() {
            let x_j = &x[j * m..(j + 1) * m];
            let series = self.series(j, &next[j * m..(j + 1) * m]);
            for b in bands {
                let rest = if b.order == 0 { self.rest(j) } else { 0.0 };
                extrema_fast(
                    &self.table,
                    &series,
                    b.order,
                    &mut work.samples,
                    &mut work.found,
                );
                for e in &work.found {
                    let over = (e.value - rest) / (b.high - rest);
                    let under = (rest - e.value) / (rest - b.low);
                    if over > 1.001 || under > 1.001 {
                        self.push(
                            j,
                            b,
                            &self.row(b.order, e.time),
                            x_j,
                            f64::NEG_INFINITY,
                            rows,
                        );
                    }
                }
            }
        }
    }

    /// Posture that joint `j` rests in when its motion is shrunk to nothing: the start posture
    /// where one is fixed, the middle of the range where there is one.
    pub fn rest(&self, j: usize) -> f64 {
        if let Some(start) = &self.basis.start {
            return start[j];
        }
        if let Some(home) = &self.home {
            return home[j];
        }
        match self.bands[j].iter().find(|b| b.order == 0) {
            Some(b) if b.low.is_finite() && b.high.is_finite() => 0.5 * (b.low + b.high),
            Some(b) if b.low.is_finite() => b.low + 1.0,
            Some(b) => b.high - 1.0,
            None => 0.0,
        }
    }

    /// Free numbers of joint `j` at rest.
    pub fn rest_parameters(&self, j: usize) -> Vec<f64> {
        let mut c = vec![0.0; 2 * self.basis.harmonics.len() + 1];
        c[0] = self.rest(j);
        self.basis.parameters(j, &c).as_slice().to_vec()
    }

    /// Gauge of the motion of joint `j` about its rest: the factor by which it exceeds its limits
    /// at its exact extrema, at most 1 inside.
    pub fn gauge(&self, j: usize, x_j: &[f64], work: &mut ExtremaWork) -> f64 {
        let series = self.series(j, x_j);
        let mut worst: f64 = 0.0;
        for b in &self.bands[j] {
            let rest = if b.order == 0 { self.rest(j) } else { 0.0 };
            extrema_fast(
                &self.table,
                &series,
                b.order,
                &mut work.samples,
                &mut work.found,
            );
            for e in &work.found {
                worst = worst.max((e.value - rest) / (b.high - rest).max(1e-300));
                worst = worst.max((rest - e.value) / (rest - b.low).max(1e-300));
            }
        }
        worst
    }

    /// Shrinks the motion of every joint that leaves its limits at some time about its rest until
    /// it touches them.
    pub fn pull_inside(&self, x: &mut [f64], work: &mut ExtremaWork) {
        let m = self.basis.free();
        for j in 0..self.bands.len() {
            let x_j = &mut x[j * m..(j + 1) * m];
            let gauge = self.gauge(j, x_j, work);
            if gauge > 1.0 {
                let rest = self.rest_parameters(j);
                x_j.iter_mut()
                    .zip(rest)
                    .for_each(|(x, r)| *x = r + (*x - r) / gauge);
            }
        }
    }
}
