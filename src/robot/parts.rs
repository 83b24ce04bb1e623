//! What the types of the [module above](super) are made of, and what their settings choose from.

pub use super::joint::{JointTerm, Limits, Motion, Prior};
pub use super::parameter::{Column, Parameter};
pub use super::stribeck::Stribeck;
pub use super::tool::Tool;
pub use super::velocity_by_position::VelocityByPosition;
