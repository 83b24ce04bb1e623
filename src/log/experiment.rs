//! A robot and its records.

use super::{Purpose, Record};
use crate::error::Warning;
use crate::plant::Plant;
use std::path::PathBuf;

/// A robot and what was recorded of it.
#[derive(Debug)]
pub struct Experiment {
    /// the `experiment.toml`
    pub path: PathBuf,
    /// the robot as the file names it: a path (made relative to the working directory) or a
    /// bundled name
    pub spec: String,
    /// the robot
    pub plant: Plant,
    /// its records, in the order of the file
    pub records: Vec<Record>,
}

impl Experiment {
    /// Records for one purpose.
    pub fn records(&self, purpose: Purpose) -> impl Iterator<Item = &Record> {
        self.records.iter().filter(move |r| r.purpose == purpose)
    }

    /// Everything that was found in robot and logs.
    pub fn warnings(&self) -> Vec<Warning> {
        let logs = self.records.iter().flat_map(|r| r.warnings.clone());
        self.plant.warnings().iter().cloned().chain(logs).collect()
    }
}
