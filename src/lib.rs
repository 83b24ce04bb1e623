//! Exciting trajectories for robots: designed, proven inside the limits before the run.
// (crate documentation is completed as the pieces land)
#![warn(missing_docs)]

pub mod base;
pub mod design;
pub mod dynamics;
pub mod error;
pub mod identifiability;
pub mod mechanism;
pub mod output;
pub mod regressor;
pub mod robot;
pub mod trajectory;

pub use error::{Error, Result, Warning};
pub use robot::Robot;
