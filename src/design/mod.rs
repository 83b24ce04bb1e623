//! Design of exciting trajectories.
pub mod criterion;
pub mod information;
pub mod limits;
pub mod solve;
pub mod start;
pub mod torque;
