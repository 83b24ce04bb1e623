//! What the types of the [module above](super) are made of, and what their settings choose from.

pub use super::breakaway::Breakaway;
pub use super::cross_validation::Trial;
pub use super::essential::Essential;
pub use super::merge::Merged;
pub use super::settings::{Consistency, Method};
pub use super::validation::{Errors, JointError, Validation};
