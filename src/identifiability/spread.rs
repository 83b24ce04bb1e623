//! Mass, centre of mass and tensor of a body from the parameters that the drives feel.

use crate::design::question::felt;
use crate::dynamics::Samples;
use crate::error::Result;
use crate::plant::Plant;
use crate::robot::Inertia;
use faer::Mat;

/// Standard deviation, in the body's own mass, from which nothing is known of it.
const LOST: f64 = 10.0;

/// Standard deviations of mass, centre of mass and tensor about it; `None` where the robot does not tell them.
pub type Spread = [Option<f64>; 10];

/// Which of the ten parameters of a body the drives feel.
pub(super) struct Felt {
    /// those that they do
    pub kept: Vec<usize>,
    /// whether mass, centre of mass and tensor follow from those that are felt alone
    known: [bool; 10],
}

impl Felt {
    pub fn of(plant: &Plant, body: usize) -> Result<Self> {
        let felt = felt(plant, body)?;
        let alone: [bool; 10] = std::array::from_fn(|k| {
            let row = felt.kept.iter().position(|&x| x == k);
            row.is_some_and(|row| (0..felt.dropped.len()).all(|d| felt.k[(row, d)].abs() < 1e-9))
        });
        let all = alone.iter().all(|a| *a);
        let known = std::array::from_fn(|k| match k {
            0 => alone[0],
            1..=3 => alone[0] && alone[k],
            _ => all,
        });
        Ok(Felt {
            kept: felt.kept,
            known,
        })
    }

    /// Their columns along a motion.
    pub fn columns(&self, plant: &Plant, body: usize, motion: &Samples) -> Result<Mat<f64>> {
        let ten = plant.body_columns(body, motion)?;
        Ok(Mat::from_fn(ten.nrows(), self.kept.len(), |r, c| {
            ten[(r, self.kept[c])]
        }))
    }
}

/// Standard deviations of the quantities from the covariance of columns whose first are those felt.
pub(super) fn spread(covariance: Option<&Mat<f64>>, felt: &Felt, body: &Inertia) -> Spread {
    let Some(covariance) = covariance else {
        return [None; 10];
    };
    let slopes = body.quantity_slopes();
    let kept = &felt.kept;
    let lost = kept.first() == Some(&0) && covariance[(0, 0)].sqrt() > LOST * body.mass();
    std::array::from_fn(|q| {
        let mut variance = 0.0;
        for (i, &a) in kept.iter().enumerate() {
            for (j, &b) in kept.iter().enumerate() {
                let factor = slopes[q][a] * slopes[q][b];
                if factor != 0.0 {
                    variance += factor * covariance[(i, j)];
                }
            }
        }
        (felt.known[q] && !lost && variance.is_finite()).then(|| variance.max(0.0).sqrt())
    })
}
