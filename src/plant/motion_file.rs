//! Motions as files: `samples.csv` of a robot of either kind.

use super::Plant;
use crate::dynamics::Samples;
use crate::error::Result;
use crate::mechanism::read_joint_motion;
use crate::regressor::torque_function;
use crate::trajectory::Fourier;
use crate::trajectory::samples::{StateFn, times, write_along};
use std::path::Path;

impl Plant {
    /// Writes so many periods of a motion as CSV at `rate` hertz, end point included: `t`, then `q1..`, `dq1..`,
    /// `ddq1..` and nominal `tau1..` of the actuators, then the platform where there is one. Returns the number of samples.
    ///
    /// # Errors
    /// A rate that cannot be, a pose that cannot be taken, a file that cannot be written.
    #[doc(hidden)]
    pub fn write_motion(
        &self,
        path: impl AsRef<Path>,
        force: bool,
        fourier: &Fourier,
        periods: u32,
        rate: f64,
    ) -> Result<usize> {
        let times = times(fourier.period * f64::from(periods), rate)?;
        let at = |t: f64, out: [&mut [f64]; 3]| fourier.evaluate(t, out);
        self.write_along(path, force, &times, &at)?;
        Ok(times.len())
    }

    /// Writes any motion of the coordinates at these times, as [`Plant::write_motion`] does.
    ///
    /// # Errors
    /// As [`Plant::write_motion`].
    #[doc(hidden)]
    pub fn write_along(
        &self,
        path: impl AsRef<Path>,
        force: bool,
        times: &[f64],
        along: &StateFn,
    ) -> Result<()> {
        match self.mechanism() {
            None => {
                let torque = torque_function(self.robot(), self.tree());
                write_along(path, force, self.coordinates(), times, along, Some(&torque))
            }
            Some(mechanism) => mechanism.write_along(path, force, times, along),
        }
    }

    /// Reads times and coordinates from such a file.
    ///
    /// # Errors
    /// A file that cannot be read, columns that are missing, a cell that is no number.
    #[doc(hidden)]
    pub fn read_motion(&self, path: impl AsRef<Path>) -> Result<(Vec<f64>, Samples)> {
        match self.mechanism() {
            None => read_joint_motion(path, self.coordinates()),
            Some(mechanism) => mechanism.read_motion(path),
        }
    }
}
