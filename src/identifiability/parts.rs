//! What the types of the [module above](super) are made of, and what their settings choose from.

pub use super::answer::{Answer, Expected};
pub use super::clearance::{Clearances, LinkVolumes};
pub use super::elsewhere::TorqueUncertainty;
pub use super::load::LoadAccuracy;
pub use super::numbers::{ConditionNumbers, Prediction};
pub use super::platform::Platform;
pub use super::spread::Spread;
