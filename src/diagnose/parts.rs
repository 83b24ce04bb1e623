//! What the types of the [module above](super) are made of, and what their settings choose from.

pub use super::at_rest::AtRest;
pub use super::catalogue::{Place, Shape, Value};
pub use super::gap::JointGap;
pub use super::improve::Improved;
pub use super::next::Proposal;
pub use super::posterior::{Band, MOST, Posterior, Sample, TABLE};
pub use super::result::{RecordGap, RuledOut};
pub use super::verdict::Verdict;
