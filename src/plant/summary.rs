//! A plant in serialised results.

use super::{Parameter, Plant};
use crate::robot::{Joint, Robot};
use serde::{Serialize, Serializer};

/// What is written of a plant: what it is made of, without what follows from it.
#[derive(Serialize)]
struct Summary<'a> {
    /// bodies and joints, passive ones included
    robot: &'a Robot,
    /// names of the actuated joints, in the order of log columns
    actuators: Vec<&'a str>,
    /// what a trajectory moves, with its limits
    coordinates: &'a [Joint],
    /// the unknowns
    parameters: &'a [Parameter],
    /// kind of closed chain; none of a tree
    mechanism: Option<&'a str>,
    /// coordinates of the middle of the workspace
    home: Option<&'a [f64]>,
}

/// A summary: `robot`, names of `actuators`, `coordinates` with their limits, `parameters`, and of a
/// closed chain the kind of `mechanism` and `home`. Kinematics are code and not part of it, so a
/// plant cannot be read back; for that there are robot files ([`export`](crate::export)).
///
/// ```
/// let plant = excite::Plant::load("delta")?;
/// let written = serde_json::to_value(&plant).expect("a summary");
/// assert_eq!(written["mechanism"], "delta");
/// assert_eq!(written["actuators"].as_array().map(Vec::len), Some(plant.actuators().len()));
/// # Ok::<(), excite::Error>(())
/// ```
impl Serialize for Plant {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Summary {
            robot: self.robot(),
            actuators: self
                .actuators()
                .into_iter()
                .map(|j| j.name.as_str())
                .collect(),
            coordinates: &self.moved().joints,
            parameters: self.parameters(),
            mechanism: self.mechanism().map(|m| m.source.name()),
            home: self.home(),
        }
        .serialize(serializer)
    }
}
