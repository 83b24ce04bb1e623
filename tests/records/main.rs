//! Records: logs, signals, and the simulator that writes them.

#[path = "../common/mod.rs"]
mod common;

mod blind;
mod formats;
mod layouts;
mod log;
mod signals;
mod simulate;
mod survey;
