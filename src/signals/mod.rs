//! From a log to what the equations need: positions, velocities and accelerations of the
//! coordinates, and a filter that torque and regressor pass alike.
//!
//! **A motion that repeats** is averaged over its whole periods, low-passed and differentiated in the
//! frequency domain, which is exact for what lies below the cut-off; the scatter of the periods is the
//! noise, with its covariance between joints. **Any other motion** passes a zero-phase Butterworth
//! filter ([`butterworth`]) and central differences of sixth order.
//!
//! **The cut-off of the positions** is chosen for each joint from the data: it minimises the estimated
//! mean square error of the acceleration,
//!
//! ```text
//! MSE(f_c) = Σ_f [ H² S_n(f) + β (1 − H)² (S_q(f) − S_n(f)) ] ω⁴
//! ```
//!
//! with the gain `H(f)` of the filter at this cut-off (`β = 100` for the Butterworth filter, whose roll-off is
//! gradual: what it takes from the motion does not average out; 1 for whole harmonics, of which none is
//! changed),
//! the spectrum `S_q` of the positions and its noise floor `S_n`, from the scatter of the periods
//! or from the highest frequencies. The parallel filter ([`Decimator`]), which all columns of `W` and
//! `τ` pass, has its cut-off at ten times the bandwidth of the motion ([`common_cutoff`]); the
//! positions are cut off at 2.5 times that at most.
//!
//! Of a parallel robot the logged positions are those of its actuators; the coordinates are the pose of
//! its platform, from forward kinematics sample by sample ([`Plant::coordinates_of`](crate::Plant::coordinates_of)).

#[doc(hidden)]
pub mod butterworth;
#[doc(hidden)]
pub mod cutoff;
pub(crate) mod decimate;
#[doc(hidden)]
pub mod fourier;
mod grid;
mod inner;
pub mod parts;
mod prepare;
pub(crate) mod repeats;
pub(crate) mod series;
pub(crate) mod standstill;
pub(crate) mod wiener;

#[doc(hidden)]
pub use butterworth::Butterworth;
#[doc(hidden)]
pub use decimate::Decimator;
pub(crate) use parts::{Derivation, Periods, Thin};
pub(crate) use prepare::mean;
#[doc(hidden)]
pub use prepare::{averaged, common_cutoff};

use crate::dynamics::Samples;
use crate::error::Warning;
use crate::log::Purpose;

/// How signals are prepared. `None` is chosen from the data.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct Settings {
    /// cut-off of the positions before they are differentiated, Hz (all joints)
    pub position_cutoff: Option<f64>,
    /// cut-off of the filter that torque and regressor pass, Hz; infinity for none
    pub cutoff: Option<f64>,
    /// how positions are differentiated
    pub derivation: Derivation,
    /// order of one pass of the Butterworth filter
    pub order: usize,
    /// whether a motion that repeats is averaged over its periods
    pub average: bool,
    /// whether measured velocities and accelerations are used where the log has them
    pub measured_rates: bool,
    /// for long logs: whether the columns of the regressor that have no jumps are computed at fewer samples, where the
    /// low-pass of the positions leaves them nothing in between ([`Thin`]; trees), and spectra from a few windows
    pub thin: bool,
    /// whether the pose columns give the coordinates of a parallel robot, instead of its actuators
    pub measured_pose: bool,
}

crate::settings::changeable!(Settings);

impl Default for Settings {
    fn default() -> Self {
        Settings {
            position_cutoff: None,
            cutoff: None,
            derivation: Derivation::LowPass,
            order: 4,
            average: true,
            measured_rates: true,
            thin: false,
            measured_pose: false,
        }
    }
}

/// A record ready for estimation. Lists are actuator-major (`a·count + i`) like the motion's.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Prepared {
    /// name of the record
    pub name: String,
    /// what it is for
    pub purpose: Purpose,
    /// samples a second
    pub rate: f64,
    /// time, s; of one period where the periods were averaged
    pub time: Vec<f64>,
    /// positions, velocities, accelerations of the coordinates at full rate
    pub motion: Samples,
    /// measured torque at full rate, unfiltered (averaged over the periods where there are any);
    /// empty where the log has none
    pub torque: Vec<f64>,
    /// number of actuators
    pub actuators: usize,
    /// whether a sample was measured in all channels
    pub valid: Vec<bool>,
    /// set where the motion repeats and was averaged
    pub periods: Option<Periods>,
    /// cut-off of the positions of each coordinate, Hz; infinite where they were taken as they are
    pub position_cutoff: Vec<f64>,
    /// standard deviation of the velocity of each actuator, from the noise floor of its positions (of
    /// its measured velocities, where those are used), rad/s or m/s
    pub velocity_noise: Vec<f64>,
    /// why the cut-offs are what they are, in words
    pub cutoff_reason: String,
    /// the filter that torque and regressor pass
    pub filter: Decimator,
    /// the same over fewer samples, where these hold all of the motion
    #[serde(skip)]
    pub thin: Option<Thin>,
    /// what was found on the way
    pub warnings: Vec<Warning>,
}

impl Prepared {
    /// Number of samples at full rate.
    pub fn count(&self) -> usize {
        self.motion.count
    }

    /// Samples of the filtered signals.
    pub fn outputs(&self) -> usize {
        self.filter.outputs()
    }

    /// Rate of the filtered signals, Hz.
    pub fn output_rate(&self) -> f64 {
        self.rate / self.filter.factor as f64
    }

    /// Times of the filtered signals.
    pub fn output_times(&self) -> Vec<f64> {
        self.filter.at().iter().map(|&i| self.time[i]).collect()
    }

    /// Passes an actuator-major list of signals (torque, or a column of the regressor) through the
    /// filter.
    ///
    /// # Panics
    /// If it is not a whole number of signals of [`Prepared::count`] samples.
    pub fn filtered(&self, signals: &[f64]) -> Vec<f64> {
        let (n, m) = (self.count(), self.outputs());
        assert!(
            n > 0 && signals.len().is_multiple_of(n),
            "whole signals of {n} samples"
        );
        let mut out = vec![0.0; signals.len() / n * m];
        if m > 0 {
            for (from, to) in signals.chunks_exact(n).zip(out.chunks_exact_mut(m)) {
                self.filter.apply_into(from, to);
            }
        }
        out
    }

    /// The motion at the filtered samples (not filtered once more).
    pub fn output_motion(&self) -> Samples {
        let mut out = Samples::zeros(self.motion.dof, self.outputs());
        for j in 0..self.motion.dof {
            for (k, &i) in self.filter.at().iter().enumerate() {
                let [q, qd, qdd] = self.motion.at(j, i);
                let to = j * self.outputs() + k;
                (out.q[to], out.qd[to], out.qdd[to]) = (q, qd, qdd);
            }
        }
        out
    }
}
