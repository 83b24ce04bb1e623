//! What the types of the [module above](super) are made of, and what their settings choose from.

pub use super::effects::functions;
pub use super::format::{Format, Part};
pub use super::model::Model;
pub use super::scene::{Change, Edited};
