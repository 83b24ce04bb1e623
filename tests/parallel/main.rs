//! Parallel robots: files, kinematics and dynamics, loops, design, and a mechanism of a user.

#[path = "../common/mod.rs"]
mod common;

mod answers;
mod design;
mod files;
mod identities;
mod loops;
mod mujoco;
mod new_mechanism;
mod questions;
mod reference;
mod stribeck;
