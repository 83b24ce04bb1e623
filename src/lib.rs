//! Exciting trajectories for robots: designed, proven inside the limits before the run.
// (crate documentation is completed as the pieces land)
#![warn(missing_docs)]

pub mod conic;
pub mod error;
pub mod robot;

pub use error::{Error, Result, Warning};
pub use robot::Robot;
