//! The program: its commands, its reports, and whole experiments.

#[path = "../common/mod.rs"]
mod common;

mod cli;
mod rehearsal;
mod report;
