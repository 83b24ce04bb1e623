//! Design of exciting trajectories: the criterion, the limits, and the sequential convex programs
//! that bring them together.

pub mod criterion;
pub mod information;
pub mod limits;
pub mod record;
pub mod settings;
pub mod start;
pub mod torque;
