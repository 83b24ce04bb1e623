//! What the types of the [module above](super) are made of, and what their settings choose from.

pub use super::file::{Distance, Measurement, Tolerances};
pub use super::frame::Frame;
pub use super::identifiable::{Confounded, Identifiability};
pub use super::judge::{Errors, Stats};
pub use super::kind::Kind;
pub use super::model::Algorithm;
pub use super::open::Opened;
pub use super::result::{DistanceResult, GroupResult, Identified, Outlier, RowResult};
pub use super::select::Trial;
pub use super::unknown::{Part, Unknown};
