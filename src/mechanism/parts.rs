//! What the types of the [module above](super) are made of, and what their settings choose from.

pub use super::certificate::MechanismCertificate;
pub use super::closed_form::ClosedForm;
pub use super::geometry::{Coordinates, Kinematics, Segment};
pub use super::motion::MechanismWorkspace;
pub use super::parameters::{Group, Pattern};
pub use super::scalar::{Pack, Scalar};
pub use super::source::{Setup, Source};
pub use super::task::Task;
pub use super::tree::{Builder, Place};
