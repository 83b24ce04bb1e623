//! Files that controllers read: a trajectory, with the way there and back, at the rate of the controller.
//!
//! ```text
//! Course      approach, periodic motion, return, as a function of time
//! Playback    its samples, and how far the controller leaves it between them
//! Format      a file that a controller, a simulator or a program reads
//! ```
//!
//! A new format is one file with an implementation of [`Format`], and one line in [`FORMATS`].

mod c_header;
mod cdr;
mod course;
mod deviation;
mod franka;
mod kuka_fri;
mod kuka_rsi;
mod leg;
mod mcap;
mod mujoco;
mod options;
mod playback;
mod ros2;
mod table;
mod text;
mod urscript;
mod xarm;
mod zip;

pub use course::{AIM, Channel, Course};
pub use deviation::{Deviation, Interpolation};
pub use leg::Leg;
pub use options::{Column, Options, Unit};
pub use playback::Playback;

use crate::error::{Error, Result};

/// Which columns a user may choose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    /// none: the format has its own
    None,
    /// which derivatives the points have; the controller interpolates by what it gets
    Derivatives,
    /// any, in any order and unit
    Columns,
}

/// Rates of a controller, Hz.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rates {
    /// those that are tried, from the lowest to the highest; empty for a format without samples
    pub offered: &'static [f64],
    /// no other rate is taken
    pub only: bool,
}

/// What there is to know of a format.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Card {
    /// its name on the command line
    pub name: &'static str,
    /// what it is, in one line
    pub about: &'static str,
    /// extension of its files
    pub extension: &'static str,
    /// least and largest number of joints, all of which turn; any where absent
    pub joints: Option<(usize, usize)>,
    /// rates that it takes
    pub rates: Rates,
    /// what the controller does between two points
    pub between: Interpolation,
    /// which columns can be chosen
    pub choice: Choice,
    /// it is played point by point, so that it must start and end at rest
    pub rest: bool,
    /// it is a program that can move to the start
    pub moves: bool,
}

/// Rates of a file for any controller, Hz.
const COMMON: &[f64] = &[
    10.0, 20.0, 25.0, 50.0, 100.0, 125.0, 200.0, 250.0, 500.0, 1000.0,
];

impl Card {
    /// A format of any joints, at any rate, without choice.
    const fn new(name: &'static str, extension: &'static str, about: &'static str) -> Self {
        Card {
            name,
            about,
            extension,
            joints: None,
            rates: Rates {
                offered: COMMON,
                only: false,
            },
            between: Interpolation::Linear,
            choice: Choice::None,
            rest: false,
            moves: false,
        }
    }
}

/// A file format.
pub trait Format: Sync {
    /// What there is to know of it.
    fn card(&self) -> Card;

    /// The file.
    ///
    /// # Errors
    /// A playback that it cannot hold.
    fn write(&self, playback: &Playback) -> Result<Vec<u8>>;

    /// A second file that goes with it: what is put behind its name, and its text.
    fn beside(&self, _playback: &Playback) -> Option<(&'static str, String)> {
        None
    }
}

/// All formats.
pub const FORMATS: [&dyn Format; 10] = [
    &ros2::Yaml,
    &ros2::Mcap,
    &urscript::UrScript,
    &franka::Franka,
    &kuka_fri::KukaFri,
    &kuka_rsi::KukaRsi,
    &xarm::XArm,
    &table::Csv,
    &mujoco::Control,
    &c_header::CHeader,
];

/// The format of this name.
///
/// # Errors
/// [`Error::Argument`] with the names there are.
pub fn format(name: &str) -> Result<&'static dyn Format> {
    let found = FORMATS.into_iter().find(|f| f.card().name == name);
    found.ok_or_else(|| {
        let names: Vec<&str> = FORMATS.iter().map(|f| f.card().name).collect();
        Error::Argument(format!(
            "there is no format `{name}`; there are {}",
            names.join(", ")
        ))
    })
}
