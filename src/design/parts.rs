//! What the types of the [module above](super) are made of, and what their settings choose from.

pub use super::criterion::Condition;
pub use super::purpose::Question;
pub use super::record::{Record, Status};
pub use super::result::{Control, Progress};
