//! How well a motion will tell a load, before the run.
//!
//! Empty and loaded robot make the same motion. The columns are those that `excite load` estimates: deviations of the
//! empty robot, which drop out of the difference of the two records, the ten of the load, Coulomb and viscous friction of
//! every drive in every record, and its constant, shared by the records or free:
//!
//! ```text
//! Cov φ_l = 2 [(Wᵀ Σ⁻¹ W)⁻¹]_ll        W = [ Y_t  F_c  F_v (F_s) (1) ]
//! ```
//!
//! at white noise. `F_s` is breakaway friction where the robot file states it; its speed is shared by the records and drops
//! out of the difference, too. Drive gains are no column: without a known load nothing tells them. What a gain error of one percent
//! in each drive, independent of the others, makes of the load stands beside the noise.

use super::columns::Columns;
use super::spread::{Felt, Spread, spread};
use crate::error::{Error, Result};
use crate::plant::Plant;
use crate::robot::Inertia;
use crate::robot::inertia::Quantities;
use crate::trajectory::{Trajectory, sample_period};
use faer::Mat;

/// Error of the gain of each drive that is looked at.
pub const GAIN: f64 = 0.01;
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
        let felt = Felt::of(plant, tool)?;
        let motion = sample_period(&trajectory.fourier);
        let ten = felt.columns(plant, tool, &motion)?;
        let columns = Columns::new(plant, ten.as_ref(), &motion, false)?;
        let periods = f64::from(trajectory.periods);
        // the difference of two records has twice the noise
        let shared = columns.covariance(false, 0.5 * periods);
        let free = columns.covariance(true, 0.5 * periods);
        let gains = shared
            .as_ref()
            .map(|c| of_gains(&columns, &felt, c, periods, load));
        let spread = |c: &Option<Mat<f64>>| spread(c.as_ref(), &felt, load);
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

/// Covariance that gains which are off by [`GAIN`] give to the load: the shift of the estimate where the force of one
/// drive that the load needs counts so much more, drive by drive.
fn of_gains(
    columns: &Columns,
    felt: &Felt,
    covariance: &Mat<f64>,
    periods: f64,
    load: &Inertia,
) -> Mat<f64> {
    let n = felt.kept.len();
    let mut out = Mat::<f64>::zeros(n, n);
    for a in 0..columns.actuators {
        let own = a * columns.count..(a + 1) * columns.count;
        let force: Vec<f64> = own
            .clone()
            .map(|r| {
                (0..n)
                    .map(|c| columns.rows[(r, c)] * load.0[felt.kept[c]])
                    .sum()
            })
            .collect();
        let right: Vec<f64> = (0..covariance.ncols())
            .map(|c| {
                own.clone()
                    .zip(&force)
                    .map(|(r, f)| columns.rows[(r, c)] * f)
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
