//! What happened during a design: for the report and for reproducing it.

use super::settings::Settings;

/// How a design ended. The result is feasible in every case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// all starts were followed to their end
    Converged,
    /// the time limit came first
    TimeLimit,
    /// interrupted by the user
    Interrupted,
}

/// One start of the optimiser.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Start {
    /// number of the start, from 0
    pub number: usize,
    /// criterion after each iteration, the start itself first (for the condition number: the
    /// number itself; for D, A and E the exponential of the criterion in
    /// [`criterion`](super::criterion))
    pub history: Vec<f64>,
    /// whether it was followed to its end
    pub converged: bool,
}

/// Record of a design.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct Record {
    /// settings as used
    pub settings: Settings,
    /// how it ended
    pub status: Status,
    /// starts that were followed, in order of their number
    pub starts: Vec<Start>,
    /// number of the start that gave the result
    pub best: usize,
    /// wall clock of the optimisation, s
    pub seconds: f64,
}
