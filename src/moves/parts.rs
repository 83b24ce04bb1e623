//! What the types of the [module above](super) are made of, and what their settings choose from.

pub use super::closed::ClosedPeaks;
pub use super::guard::Least;
pub use super::load::TorquePeak;
pub use super::peaks::{JointPeaks, Peaks};
pub use super::rehearsal::{Load, Speed};
pub use super::state::State;
pub use super::tool::ToolPeak;
