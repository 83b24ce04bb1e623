//! Settings of a design: one struct for library, command line and report.

use super::criterion::{Condition, Criterion};
use super::purpose::{Question, ordinary_load};
use crate::error::{Error, Result};
use crate::plant::Plant;
use crate::robot::inertia::Quantities;
use crate::robot::{Inertia, Robot};
use crate::trajectory::{Ends, Grid};

/// Settings of a design. Every field has a default that suits most arms.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct Settings {
    /// harmonics of the Fourier series of each joint
    pub harmonics: usize,
    /// period, s
    pub period: f64,
    /// periods of the experiment
    pub periods: u32,
    /// which harmonics: all, odd only, or odd with random ones left out
    pub grid: Grid,
    /// `rest`: zero velocity and acceleration at both ends; `free`
    pub ends: Ends,
    /// posture at the start, rad or m per joint, where it is prescribed
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<Vec<f64>>,
    /// what is minimised
    pub criterion: Criterion,
    /// of which matrix
    pub condition: Condition,
    /// what the motion is for; `None`: all base parameters
    #[serde(rename = "for", skip_serializing_if = "Option::is_none")]
    pub question: Option<Question>,
    /// the load that it is for: mass, centre of mass, tensor about it (xx, xy, xz, yy, yz, zz); `None`: an ordinary one
    #[serde(skip_serializing_if = "Option::is_none")]
    pub payload: Option<Quantities>,
    /// fraction of every limit that may be used
    pub derate: f64,
    /// seed of the random starts
    pub seed: u64,
    /// most starts; where neither this nor a time limit is given, 12 within 25 s, from 8 harmonics on 8
    #[serde(skip_serializing_if = "Option::is_none")]
    pub starts: Option<usize>,
    /// wall clock of the optimisation, s; given alone, starts go on until it ends
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_limit: Option<f64>,
    /// threads; 0 for one per core (not written to files: the result does not depend on it)
    #[serde(skip_serializing)]
    pub threads: usize,
    /// the first feasible start and its first phase, for a motion that others begin from
    #[serde(skip)]
    pub(crate) rough: bool,
}

crate::settings::changeable!(Settings);

impl Default for Settings {
    fn default() -> Self {
        Settings {
            harmonics: 5,
            period: 10.0,
            periods: 1,
            grid: Grid::Full,
            ends: Ends::Rest,
            start: None,
            criterion: Criterion::Condition,
            condition: Condition::Invariant,
            question: None,
            payload: None,
            derate: 1.0,
            seed: 1,
            starts: None,
            time_limit: None,
            threads: 0,
            rough: false,
        }
    }
}

impl Settings {
    /// Most starts and seconds, with the defaults filled in.
    pub fn budget(&self) -> (usize, f64) {
        match (self.starts, self.time_limit) {
            // more harmonics make a start longer
            (None, None) if self.harmonics >= 8 => (8, 25.0),
            (None, None) => (12, 25.0),
            (Some(starts), None) => (starts, f64::INFINITY),
            (None, Some(seconds)) => (usize::MAX, seconds),
            (Some(starts), Some(seconds)) => (starts, seconds),
        }
    }

    /// The load that the motion is for.
    pub fn load(&self, plant: &Plant) -> Inertia {
        match &self.payload {
            Some(q) => Inertia::from_quantities(q),
            None => ordinary_load(plant),
        }
    }

    /// Checks the settings against each other and against the robot.
    ///
    /// # Errors
    /// [`Error::Argument`] that names the setting and says what it must be.
    pub fn check(&self, robot: &Robot) -> Result<()> {
        let bad = |what: String| Err(Error::Argument(what));
        let least = if self.ends == Ends::Rest { 2 } else { 1 };
        if self.harmonics < least || self.harmonics > 200 {
            return bad(format!(
                "harmonics must be between {least} and 200, not {}: with ends at rest two of the \
                 coefficients of each joint are spent on them",
                self.harmonics
            ));
        }
        if !((1e-3..=1e5).contains(&self.period)) {
            return bad(format!(
                "period must be between 1e-3 and 1e5 s, not {}",
                self.period
            ));
        }
        if self.periods == 0 || self.periods > 10_000 {
            return bad(format!(
                "periods must be between 1 and 10000, not {}",
                self.periods
            ));
        }
        if !(self.derate > 0.0 && self.derate <= 1.0) {
            return bad(format!(
                "derate must be more than 0 and at most 1, not {}",
                self.derate
            ));
        }
        if self.starts.is_some_and(|s| s == 0 || s > 1_000_000) {
            return bad("starts must be between 1 and 1000000".into());
        }
        if let Some(t) = self.time_limit
            && !(t > 0.0 && t <= 1e7)
        {
            return bad(format!(
                "time limit must be more than 0 and at most 1e7 s, not {t}"
            ));
        }
        if self.threads > 1024 {
            return bad(format!(
                "threads must be at most 1024, not {}",
                self.threads
            ));
        }
        if let Some(q) = &self.payload
            && !(q.iter().all(|v| v.is_finite()) && q[0] > 0.0)
        {
            return bad(format!(
                "the payload must have a mass above 0, not {} kg",
                q[0]
            ));
        }
        if let Some(start) = &self.start {
            if start.len() != robot.dof() {
                return bad(format!(
                    "the start posture has {} numbers, {} has {} joints",
                    start.len(),
                    robot.name,
                    robot.dof()
                ));
            }
            for (q, joint) in start.iter().zip(&robot.joints) {
                let [low, high] = joint.limits.position;
                let (middle, half) = (0.5 * (low + high), 0.5 * (high - low) * self.derate);
                let (low, high) = match half.is_finite() {
                    true => (middle - half, middle + half),
                    false => (low, high),
                };
                // beyond these no motion can begin that keeps its velocity by position
                let (low, high) = match joint.limits.velocity_by_position.map(|v| v.range()) {
                    Some([a, b]) => (low.max(a), high.min(b)),
                    None => (low, high),
                };
                if !q.is_finite() || *q <= low || *q >= high {
                    return bad(format!(
                        "the start posture puts {} at {q}, outside its range {low:.4} to {high:.4}",
                        joint.name
                    ));
                }
            }
        }
        Ok(())
    }
}

impl Question {
    /// Settings that serve it.
    pub fn settings(self) -> Settings {
        let (harmonics, period, periods) = self.motion();
        Settings {
            harmonics,
            period,
            periods,
            question: Some(self),
            criterion: self.criterion(),
            condition: Condition::Weighted,
            ..Settings::default()
        }
    }
}
