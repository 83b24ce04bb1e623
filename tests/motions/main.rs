//! Designed motions: the optimiser, its cone solver, and the proof of limits.

#[path = "../common/mod.rs"]
mod common;

mod conic;
mod design;
mod trajectory;
