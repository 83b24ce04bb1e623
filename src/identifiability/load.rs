//! How well a motion will tell a load, before the run.
//!
//! Empty and loaded robot make the same motion. The columns are those that `excite load` estimates: deviations of the
//! empty robot, which drop out of the difference of the two records, the ten of the load, Coulomb and viscous friction of
//! every drive in every record, and its constant, shared by the records or free:
//!
//! ```text
//! Cov φ_l = 2 [(Wᵀ Σ⁻¹ W)⁻¹]_ll        W = [ Y_t  F_c  F_v (1) ]
//! ```
//!
//! at white noise. Drive gains are no column: without a known load nothing tells them. What a gain error of one percent
//! in each drive, independent of the others, makes of the load stands beside the noise.

use crate::design::question::felt;
use crate::dynamics::Samples;
use crate::error::{Error, Result};
use crate::plant::Plant;
use crate::regressor::term_factor;
use crate::robot::inertia::Quantities;
use crate::robot::{Inertia, JointTerm};
use crate::trajectory::{Trajectory, sample_period};
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

/// Error of the gain of each drive that is looked at.
pub const GAIN: f64 = 0.01;
/// What keeps the information matrix regular where a friction column does not act, of its diagonal of ones.
const RIDGE: f64 = 1e-12;
/// Standard deviation, in the load's own size, from which nothing is known of it.
const LOST: f64 = 10.0;

/// Standard deviations of mass, centre of mass and tensor about it; `None` where the robot does not tell them.
pub type Spread = [Option<f64>; 10];

/// How well a motion tells a load.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct LoadAccuracy {
    /// the load: mass, centre of mass, tensor about it
    pub payload: Quantities,
    /// whether it was named; an ordinary one otherwise
    pub named: bool,
    /// the body that carries it
    pub body: String,
    /// length of each of the two records, s
    pub seconds: f64,
    /// standard deviations where the constants of the drives are the same in both records
    pub shared: Spread,
    /// … and where each record has its own
    pub free: Spread,
    /// what gains of the drives that are off by [`GAIN`] each add, one standard deviation
    pub gains: Spread,
    /// the limit that the loaded robot breaks, in words
    pub broken: Option<String>,
}

impl LoadAccuracy {
    /// Along a trajectory of this plant.
    ///
    /// # Errors
    /// No body that could carry a load; a motion that the robot cannot make.
    pub fn of(plant: &Plant, trajectory: &Trajectory, load: &Inertia, named: bool) -> Result<Self> {
        let plant = &plant.clone().in_space(trajectory.space)?;
        let Some(tool) = plant.tool() else {
            return Err(Error::Infeasible(format!(
                "{}: it has no body that could carry a load",
                plant.name()
            )));
        };
        let columns = Columns::new(plant, tool, &sample_period(&trajectory.fourier))?;
        let periods = f64::from(trajectory.periods);
        let shared = columns.covariance(false, periods);
        let free = columns.covariance(true, periods);
        let gains = shared.as_ref().map(|c| columns.gains(c, periods, load));
        let known = columns.known();
        let spread = |c: &Option<Mat<f64>>| spread(c.as_ref(), &columns.kept, known, load);
        let certified = plant.carrying(load).certify(&trajectory.fourier, 1.0)?;
        Ok(LoadAccuracy {
            payload: load.quantities(),
            named,
            body: plant.robot().bodies[tool].name.clone(),
            seconds: trajectory.duration(),
            shared: spread(&shared),
            free: spread(&free),
            gains: spread(&gains),
            broken: certified.broken(),
        })
    }

    /// Mass, centre of mass (largest of three) and tensor (largest of six, of `√(I_ii I_jj)`) of a spread, in kg, m and
    /// as a fraction: the three numbers that a user asks for.
    pub fn in_short(&self, spread: &Spread) -> [Option<f64>; 3] {
        let q = &self.payload;
        let worst = |list: &[Option<f64>]| -> Option<f64> {
            list.iter().try_fold(0.0f64, |m, v| v.map(|v| m.max(v)))
        };
        let pairs = [(4, 4), (4, 7), (4, 9), (7, 7), (7, 9), (9, 9)];
        let tensor: Vec<Option<f64>> = pairs
            .iter()
            .enumerate()
            .map(|(k, &(a, b))| {
                let size = (q[a] * q[b]).sqrt();
                spread[4 + k].filter(|_| size > 0.0).map(|s| s / size)
            })
            .collect();
        [spread[0], worst(&spread[1..4]), worst(&tensor)]
    }
}

/// The columns of the drives and of the load along one period, over the noise of the drives.
struct Columns {
    /// parameters of the ten that the drives feel
    kept: Vec<usize>,
    /// whether each of the ten is felt alone
    alone: [bool; 10],
    /// load, Coulomb and viscous friction of each drive, constant of each drive
    rows: Mat<f64>,
    /// of these, the constants
    constants: usize,
    /// samples of each drive
    count: usize,
}

impl Columns {
    fn new(plant: &Plant, tool: usize, motion: &Samples) -> Result<Self> {
        let felt = felt(plant, tool)?;
        let ten = plant.body_columns(tool, motion)?;
        let moved = plant.actuator_motion(motion)?;
        let noise = plant.torque_noise().0;
        let (na, count) = (noise.len(), motion.count);
        let n = felt.kept.len();
        let terms = JointTerm::FRICTION;
        let rows = Mat::from_fn(na * count, n + terms.len() * na, |r, c| {
            let (a, s) = (r / count, r % count);
            let value = match c.checked_sub(n) {
                None => ten[(r, felt.kept[c])],
                Some(d) if d % na == a => term_factor(terms[d / na], moved.at(a, s)),
                Some(_) => 0.0,
            };
            value / noise[a]
        });
        let alone = std::array::from_fn(|k| {
            let row = felt.kept.iter().position(|&x| x == k);
            row.is_some_and(|row| (0..felt.dropped.len()).all(|d| felt.k[(row, d)].abs() < 1e-9))
        });
        Ok(Columns {
            kept: felt.kept,
            alone,
            rows,
            constants: na,
            count,
        })
    }

    /// Which of mass, centre of mass and tensor follow from the parameters that are felt alone.
    fn known(&self) -> [bool; 10] {
        let all = self.alone.iter().all(|a| *a);
        std::array::from_fn(|k| match k {
            0 => self.alone[0],
            1..=3 => self.alone[0] && self.alone[k],
            _ => all,
        })
    }

    /// Covariance of all columns from two records of so many periods; with or without free constants. `None` where the
    /// motion does not tell the columns apart.
    fn covariance(&self, free: bool, periods: f64) -> Option<Mat<f64>> {
        let n = self.rows.ncols() - if free { 0 } else { self.constants };
        let rows = self.rows.subcols(0, n);
        let information = rows.transpose() * rows;
        let scale: Vec<f64> = (0..n)
            .map(|k| match information[(k, k)] {
                d if d > 0.0 => 1.0 / d.sqrt(),
                _ => 1.0,
            })
            .collect();
        let unit = Mat::from_fn(n, n, |i, j| {
            information[(i, j)] * scale[i] * scale[j] + if i == j { RIDGE } else { 0.0 }
        });
        let factor = unit.llt(Side::Lower).ok()?;
        let inverse = factor.solve(Mat::<f64>::identity(n, n));
        Some(Mat::from_fn(n, n, |i, j| {
            2.0 / periods * inverse[(i, j)] * scale[i] * scale[j]
        }))
    }

    /// Covariance that gains which are off by [`GAIN`] give to the load: the shift of the estimate where the force of one
    /// drive that the load needs counts so much more, drive by drive.
    fn gains(&self, covariance: &Mat<f64>, periods: f64, load: &Inertia) -> Mat<f64> {
        let n = self.kept.len();
        let mut out = Mat::<f64>::zeros(n, n);
        for a in 0..self.constants {
            let own = a * self.count..(a + 1) * self.count;
            let force: Vec<f64> = own
                .clone()
                .map(|r| {
                    (0..n)
                        .map(|c| self.rows[(r, c)] * load.0[self.kept[c]])
                        .sum()
                })
                .collect();
            let right: Vec<f64> = (0..covariance.ncols())
                .map(|c| {
                    own.clone()
                        .zip(&force)
                        .map(|(r, f)| self.rows[(r, c)] * f)
                        .sum()
                })
                .collect();
            // of one record: the difference of two has twice the noise and the same estimate
            let shift: Vec<f64> = (0..n)
                .map(|i| {
                    let all = right.iter().enumerate();
                    all.map(|(c, v)| 0.5 * periods * covariance[(i, c)] * v)
                        .sum::<f64>()
                        * GAIN
                })
                .collect();
            for i in 0..n {
                for j in 0..n {
                    out[(i, j)] += shift[i] * shift[j];
                }
            }
        }
        out
    }
}

/// Standard deviations of the quantities from the covariance of the columns.
fn spread(
    covariance: Option<&Mat<f64>>,
    kept: &[usize],
    known: [bool; 10],
    load: &Inertia,
) -> Spread {
    let Some(covariance) = covariance else {
        return [None; 10];
    };
    let slopes = load.quantity_slopes();
    let lost = covariance[(0, 0)].sqrt() > LOST * load.mass() && kept.first() == Some(&0);
    std::array::from_fn(|q| {
        let mut variance = 0.0;
        for (i, &a) in kept.iter().enumerate() {
            for (j, &b) in kept.iter().enumerate() {
                variance += slopes[q][a] * covariance[(i, j)] * slopes[q][b];
            }
        }
        (known[q] && !lost && variance.is_finite()).then(|| variance.max(0.0).sqrt())
    })
}
