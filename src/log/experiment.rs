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
        let mut all = self.plant.warnings().to_vec();
        all.extend(warnings_of(&self.records));
        all
    }
}

/// What was found in logs, each once: parts of one file share what was found in it.
pub(crate) fn warnings_of(records: &[Record]) -> Vec<Warning> {
    let mut out: Vec<Warning> = Vec::new();
    for warning in records.iter().flat_map(|r| &r.warnings) {
        if !out.contains(warning) {
            out.push(warning.clone());
        }
    }
    out
}
