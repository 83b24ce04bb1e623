//! What the types of the [module above](super) are made of, and what their settings choose from.

pub use super::basis::Ends;
pub use super::bounds::{SampledBound, TorqueBound};
pub use super::by_position::PositionPeak;
pub use super::certificate::{JointCertificate, Peak, Proof, Range};
pub use super::file::Space;
pub use super::fourier::Series;
pub use super::grid::Grid;
pub use super::tool::ToolCertificate;
