//! The limits as linear rows in the free numbers `x`, and the steps that keep inside them for all
//! time.
//!
//! Position, velocity, acceleration and jerk at an instant are linear in the coefficients of the
//! series, so the set of trajectories inside the limits is convex. A subproblem holds rows at a
//! uniform grid and at the exact extrema of the present trajectory. Between those instants a step
//! can exceed a limit by an amount of second order only, and does not get the chance:
//! [`Limits::pull_inside`] finds the exact extrema of the new trajectory and shrinks the motion of
//! that joint about its resting posture until they fit, so every iterate of a design is feasible
//! for all time. Velocities by position bound a convex set, too: they are cones (`by_position`) where the
//! others are rows, and shrink by the same rule.

use super::by_position::{Cone, peaks, stands};
use crate::conic::Problem;
use crate::robot::{Robot, Side};
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
    /// velocities by position
    sides: Vec<Vec<Side>>,
    omega: f64,
    /// posture of rest, where it is not the middle of the ranges
    home: Option<Vec<f64>>,
}

/// Memory for [`extrema_fast`].
#[derive(Debug, Clone, Default)]
pub struct ExtremaWork {
    samples: Vec<f64>,
    found: Vec<Extremum>,
    both: [Vec<f64>; 2],
}

/// Rows and cones of a subproblem.
#[derive(Debug, Clone, Default)]
pub struct Rows {
    /// linear
    pub linear: Vec<Row>,
    /// second order
    pub cones: Vec<Cone>,
}

impl Rows {
    /// Writes them for scaled steps of `m` free numbers a joint.
    pub fn write(&self, p: &mut Problem, m: usize, scale: &[f64]) {
        for cone in &self.cones {
            cone.write(p, cone.joint * m, scale[cone.joint]);
        }
        for row in &self.linear {
            let s = scale[row.joint];
            let entries = row.row.iter().enumerate();
            p.inequality(entries.map(|(k, r)| (row.joint * m + k, r * s)), row.slack);
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.linear.len() + self.cones.len()
    }
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

/// Cones, which cost more than rows, stand at instants that use more than this of a velocity by position; what
/// another instant breaks is cut.
const NEAR_CONE: f64 = 0.8;

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
                let turns = l.velocity_by_position.map(|v| v.range());
                let mut bands = Vec::new();
                if low.is_finite() || high.is_finite() {
                    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
                    let (low, high) = match half.is_finite() {
                        true => (middle - half * derate, middle + half * derate),
                        false => (low, high),
                    };
                    // a motion that keeps its velocity by position stays between these
                    let [a, b] = turns.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
                    bands.push(Band {
                        order: 0,
                        low: low.max(a),
                        high: high.min(b),
                    });
                } else if let Some([low, high]) = turns {
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
        let sides = robot
            .joints
            .iter()
            .map(|j| {
                let Some(v) = j.limits.derated(derate).velocity_by_position else {
                    return Vec::new();
                };
                let room = v.position[1] - v.position[0];
                let inner = |s: Side| Side {
                    end: s.end - MARGIN * room,
                    ..s
                };
                v.sides().map(inner).to_vec()
            })
            .collect();
        Limits {
            sides,
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
    pub fn rows(&self, x: &[f64], near: f64, work: &mut ExtremaWork) -> Rows {
        let m = self.basis.free();
        let (mut rows, mut cones) = (Vec::new(), Vec::new());
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
            let near = near.max(NEAR_CONE);
            for side in &self.sides[j] {
                for rows in self.grid[0].iter().zip(&self.grid[1]) {
                    self.cone(j, side, [rows.0, rows.1], x_j, near, &mut cones);
                }
                let both = &mut work.both;
                for (t, _) in peaks(&self.table, &series, side, self.rest(j), near, both) {
                    let rows = [self.row(0, t), self.row(1, t)];
                    self.cone(j, side, [&rows[0], &rows[1]], x_j, near, &mut cones);
                }
            }
        }
        Rows {
            linear: rows,
            cones,
        }
    }

    /// Adds the cone of one instant where it is near the limit.
    fn cone(
        &self,
        j: usize,
        side: &Side,
        rows: [&[f64]; 2],
        x_j: &[f64],
        near: f64,
        cones: &mut Vec<Cone>,
    ) {
        let [q, v] = rows.map(|row| row.iter().zip(x_j).map(|(r, x)| r * x).sum::<f64>());
        let state = [side.sign * (q + self.basis.offset[j][0]), side.sign * v];
        if stands(side, side.sign * self.rest(j), state, near) {
            cones.push(Cone::new(j, side, rows, state));
        }
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
    pub fn cut(&self, x: &[f64], next: &[f64], rows: &mut Rows, work: &mut ExtremaWork) {
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
                            &mut rows.linear,
                        );
                    }
                }
            }
            for side in &self.sides[j] {
                let both = &mut work.both;
                for (t, _) in peaks(&self.table, &series, side, self.rest(j), 1.001, both) {
                    let at = [self.row(0, t), self.row(1, t)];
                    let near = f64::NEG_INFINITY;
                    self.cone(j, side, [&at[0], &at[1]], x_j, near, &mut rows.cones);
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
        for side in &self.sides[j] {
            let both = &mut work.both;
            for (_, value) in peaks(&self.table, &series, side, self.rest(j), worst, both) {
                worst = worst.max(value);
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
