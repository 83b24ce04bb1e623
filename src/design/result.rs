//! What a design gives, and what it tells while it runs.

use super::record::Record;
use crate::plant::Plant;
use crate::trajectory::Trajectory;
use std::sync::atomic::AtomicBool;

/// A designed trajectory and how it came about.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Design {
    /// the robot, with the limits that were assumed where it states none; not serialised, it is a file
    /// of its own
    #[serde(skip)]
    pub plant: Plant,
    /// the trajectory, inside all limits for all time
    pub trajectory: Trajectory,
    /// criterion of the result (see [`Start::history`](super::record::Start::history) for what it is)
    pub value: f64,
    /// what happened
    pub record: Record,
}

/// Where a design stands.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Progress {
    /// starts done
    pub starts: usize,
    /// starts planned; `None` while only time ends the run
    pub planned: Option<usize>,
    /// best criterion so far
    pub best: f64,
    /// wall clock, s
    pub seconds: f64,
}

/// What a design tells while it runs, and what ends it early.
pub struct Control<'a> {
    /// ends the run when set; the best feasible trajectory so far is the result
    pub cancel: &'a AtomicBool,
    /// called after every finished start
    pub progress: &'a (dyn Fn(Progress) + Sync),
}

impl Default for Control<'_> {
    /// Never cancelled, and silent.
    fn default() -> Self {
        static NEVER: AtomicBool = AtomicBool::new(false);
        fn silent(_: Progress) {}
        Control {
            cancel: &NEVER,
            progress: &silent,
        }
    }
}
