//! The diagnosis: what it finds, on arms and parallel robots, the controller it reads, and the next motion.

#[path = "../common/mod.rs"]
mod common;

mod coarse;
mod controller;
mod findings;
mod friction;
mod next;
mod parallel;
mod poses;
mod real;
mod second_encoder;
mod simulators;
mod thresholds;
