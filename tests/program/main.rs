//! The program: its commands, its reports, and whole experiments.

#[path = "../common/mod.rs"]
mod common;

mod cli;
mod controller;
mod dependencies;
mod documents;
mod mutations;
mod pose_check;
mod rehearsal;
mod report;
mod surface;
mod view;
