//! What was recorded: an `experiment.toml` and the logs that it names.
//!
//! ```toml
//! robot = "robot.toml"
//! [[record]]
//! log = "fit_1.csv"
//! use = "fit"            # or "holdout"
//! period = 5.0           # s, when the motion repeats
//! payload = "unknown"    # or "none", or { mass = 2.0, com = [0, 0, 0.05] }
//! ```
//!
//! A [`Record`] is a log on an even time grid with everything that was wrong with it said
//! ([`Record::warnings`]) and, where that is safe, repaired: see `clock` for the time stamps and
//! `channels` for what cannot have been measured. Samples that were not measured (gaps, dropped
//! or stuck or saturated channels) are interpolated where they must be, and marked in
//! [`Record::valid`].

mod abreast;
pub(crate) mod channels;
pub(crate) mod clock;
mod experiment;
pub(crate) mod formats;
pub(crate) mod layout;
pub(crate) mod merge;
pub(crate) mod names;
pub(crate) mod number;
pub(crate) mod outline;
pub mod parts;
pub(crate) mod place;
mod pose_check;
pub(crate) mod pressure;
pub(crate) mod record;
pub(crate) mod resample;
pub(crate) mod table;
pub(crate) mod turns;
mod unit;
mod written;

pub use experiment::Experiment;
pub(crate) use experiment::warnings_of;
#[doc(hidden)]
pub use outline::Outline;
pub(crate) use parts::{Payload, Purpose};
#[doc(hidden)]
pub use table::Table;
#[doc(hidden)]
pub use written::{Channels, Written};

use crate::error::Warning;
use std::path::PathBuf;

/// One log on an even time grid. Channels are lists of one list an actuator, in the order of the
/// robot file.
#[derive(Debug, Clone)]
pub struct Record {
    /// name of the log without folder and extension
    pub name: String,
    /// file of the log
    pub path: PathBuf,
    /// what it is for
    pub purpose: Purpose,
    /// period of the motion, s, where it repeats
    pub period: Option<f64>,
    /// what the robot carried
    pub payload: Payload,
    /// time step, s; with a period, a whole number of steps is a period
    pub step: f64,
    /// time of the samples, s, from that of the first on
    pub t: Vec<f64>,
    /// whether a sample was measured in all channels
    pub valid: Vec<bool>,
    /// positions, rad or m
    pub q: Vec<Vec<f64>>,
    /// torques or forces, N m or N; empty where the log has pressures instead
    pub tau: Vec<Vec<f64>>,
    /// measured velocities
    pub dq: Option<Vec<Vec<f64>>>,
    /// measured accelerations
    pub ddq: Option<Vec<Vec<f64>>>,
    /// commanded positions
    pub qref: Option<Vec<Vec<f64>>>,
    /// link-side positions; an empty list for an actuator without a second encoder
    pub ql: Option<Vec<Vec<f64>>>,
    /// pose of platform or tool: `x y z qw qx qy qz`
    pub pose: Option<Vec<Vec<f64>>>,
    /// pressures of both chambers of every cylinder, Pa
    pub pressures: Option<[Vec<Vec<f64>>; 2]>,
    /// whether the samples were interpolated to an even grid
    pub resampled: bool,
    /// the samples before that; see [`Record::as_written`]
    pub written: Option<Written>,
    /// what was found, and repaired
    pub warnings: Vec<Warning>,
}

impl Record {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }

    /// Number of actuators.
    pub fn actuators(&self) -> usize {
        self.q.len()
    }

    /// Samples a second.
    pub fn rate(&self) -> f64 {
        1.0 / self.step
    }

    /// Samples of one period, and whole periods in the record.
    pub fn periods(&self) -> Option<(usize, usize)> {
        let each = (self.period? / self.step).round() as usize;
        (each > 0).then(|| (each, self.len() / each))
    }
}
