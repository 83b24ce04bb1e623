//! What the types of the [module above](super) are made of, and what their settings choose from.

pub use super::certify::Certified;
pub use super::scene::{ClearanceCertificate, PairClearance};
