//! What the types of the [module above](super) are made of, and what their settings choose from.

pub use super::control::Controller;
pub use super::effects::Field;
pub use super::record::{Measured, Sensors};
