//! What a robot must not touch: itself and what stands around it.
//!
//! | file | content |
//! |---|---|
//! | [`scene`] | volumes and obstacles of a robot, pairs of them, gradients |
//! | [`build`] | the scene of a robot file: volumes, floor, obstacles, pairs that matter |
//! | `srdf` | pairs that an SRDF file disables |
//! | [`clearance`] | least clearance of a motion over all time |

pub mod build;
pub mod clearance;
mod matter;
pub mod scene;
mod srdf;

pub use clearance::Clearance;
pub(crate) use matter::in_words;
pub use scene::{Obstacle, Pair, Partner, Scene, Volume};
