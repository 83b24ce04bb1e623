//! What the types of the [module above](super) are made of, and what their settings choose from.

pub use super::body::LoadBody;
pub use super::gain::Gains;
pub use super::one_step::OneStep;
pub use super::settings::{Method, Parameters};
pub use super::two_step::TwoStep;
