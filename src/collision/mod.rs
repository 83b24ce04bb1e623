//! What a robot must not touch: itself and what stands around it.
//!
//! | file | content |
//! |---|---|
//! | [`scene`] | volumes and obstacles of a robot, pairs of them, gradients |
//! | [`build`] | the scene of a robot file: volumes, floor, obstacles, pairs that matter |
//! | `matter` | pairs that can come near and can be kept apart; postures that are free |
//! | `mend` | links moved apart where no posture is free |
//! | `srdf` | pairs that an SRDF file disables |
//! | [`clearance`] | least clearance of a motion over all time |

pub mod build;
pub mod clearance;
mod matter;
mod mend;
pub mod scene;
mod srdf;

pub use clearance::Clearance;
pub(crate) use matter::in_words;
pub use scene::{Obstacle, Pair, Partner, Scene, Volume};
