//! Designed motions: the optimiser, its cone solver, the proof of limits, and the moves to them.

#[path = "../common/mod.rs"]
mod common;

mod clear;
mod conic;
mod controller_limits;
mod design;
mod moves;
mod rates_and_tool;
mod said;
mod trajectory;
