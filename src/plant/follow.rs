//! Coordinates from what a log holds: positions and rates of the actuators, or a measured pose.

use super::Plant;
use crate::dynamics::Samples;
use crate::error::{Error, Result};
use crate::mechanism::{Mechanism, follow};

use std::borrow::Cow;

pub use crate::mechanism::follow::Rates;

impl Plant {
    /// Coordinates from positions of the actuators, one list each: the same for a tree, by forward
    /// kinematics from home for a closed chain.
    ///
    /// # Errors
    /// Positions that no pose of the assembly mode gives: the sample and the actuators.
    pub fn coordinates_of<'a>(&self, q: &'a [Vec<f64>]) -> Result<Cow<'a, [Vec<f64>]>> {
        match self.mechanism() {
            None => Ok(Cow::Borrowed(q)),
            Some(mechanism) => Ok(Cow::Owned(lists(follow::forward(mechanism, q)?, q))),
        }
    }

    /// Coordinates from measured pose columns `x y z qw qx qy qz`, one list each.
    ///
    /// # Errors
    /// A robot without a platform, or a quaternion that is none.
    pub fn coordinates_of_pose(&self, pose: &[Vec<f64>]) -> Result<Vec<Vec<f64>>> {
        Ok(lists(follow::from_pose(self.platform()?, pose)?, pose))
    }

    /// Measured pose columns of a motion of the coordinates: the inverse of [`Plant::coordinates_of_pose`].
    ///
    /// # Errors
    /// A robot without a platform; a pose that cannot be reached.
    pub fn pose_columns(&self, x: &Samples) -> Result<Vec<Vec<f64>>> {
        follow::to_pose(self.platform()?, x)
    }

    fn platform(&self) -> Result<&Mechanism> {
        self.mechanism().ok_or_else(|| {
            Error::Argument(format!(
                "{} has no platform whose pose could be measured; that is for parallel robots",
                self.name()
            ))
        })
    }

    /// Velocities of the coordinates, and accelerations where there are any, from measured ones of
    /// the actuators along positions `x` of the coordinates: `ẋ = D_a⁺ q̇_a`.
    ///
    /// # Errors
    /// A pose that cannot be reached.
    pub fn rates_of(
        &self,
        x: &[Vec<f64>],
        dq: &[Vec<f64>],
        ddq: Option<&[Vec<f64>]>,
    ) -> Result<Rates> {
        match self.mechanism() {
            None => Ok(Rates {
                velocity: dq.to_vec(),
                acceleration: ddq.map(<[_]>::to_vec),
            }),
            Some(mechanism) => follow::rates(mechanism, x, dq, ddq),
        }
    }

    /// Motion of the coordinates that goes with a motion of the actuators. Of a motion that repeats
    /// after `cycle` samples one period is followed.
    ///
    /// # Errors
    /// As [`Plant::coordinates_of`] and [`Plant::rates_of`].
    pub fn coordinate_motion(&self, moved: &Samples, cycle: Option<usize>) -> Result<Samples> {
        if self.mechanism().is_none() {
            return Ok(moved.clone());
        }
        let count = cycle.unwrap_or(moved.count);
        let once = |x: &[f64]| -> Vec<Vec<f64>> {
            let rows = x.chunks_exact(moved.count);
            rows.map(|row| row[..count].to_vec()).collect()
        };
        let q = once(&moved.q);
        let x = self.coordinates_of(&q)?;
        let rates = self.rates_of(&x, &once(&moved.qd), Some(&once(&moved.qdd)))?;
        let again = |rows: &[Vec<f64>]| -> Vec<f64> {
            let all = rows.iter();
            all.flat_map(|r| r.iter().copied().cycle().take(moved.count))
                .collect()
        };
        Ok(Samples {
            dof: x.len(),
            count: moved.count,
            q: again(&x),
            qd: again(&rates.velocity),
            qdd: again(&rates.acceleration.unwrap_or_default()),
        })
    }
}

/// A list for each coordinate, as long as those of `like`.
fn lists(flat: Vec<f64>, like: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let count = like.first().map_or(1, Vec::len).max(1);
    flat.chunks_exact(count).map(<[f64]>::to_vec).collect()
}
