//! What a motion can be for, and the load that it is for where none is named.

use super::criterion::Criterion;
use crate::error::{Error, Result};
use crate::plant::Plant;
use crate::robot::{Column, Inertia};
use nalgebra::{Matrix3, Vector3};

/// Density of the load that is assumed where none is named, kg/m³.
pub const DENSITY: f64 = 1000.0;
/// Least mass of that load, of the bodies that move.
const LEAST: f64 = 0.05;

/// What a motion is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Question {
    /// mass, centre of mass and tensor of a load
    Load,
    /// those of the platform of a parallel robot
    Platform,
    /// the other bodies of a parallel robot
    Legs,
    /// friction of the drives
    Friction,
}

impl Question {
    /// `load`, `platform`, `legs`, `friction`.
    pub fn name(self) -> &'static str {
        match self {
            Question::Load => "load",
            Question::Platform => "platform",
            Question::Legs => "legs",
            Question::Friction => "friction",
        }
    }

    /// Harmonics, period (s) and periods that serve it, where nothing else is asked for.
    pub fn motion(self) -> (usize, f64, u32) {
        match self {
            Question::Load | Question::Platform => (9, 5.0, 12),
            Question::Legs => (9, 10.0, 6),
            Question::Friction => (7, 20.0, 3),
        }
    }

    /// The criterion that it is judged by.
    pub fn criterion(self) -> Criterion {
        match self {
            Question::Legs => Criterion::Known,
            _ => Criterion::A,
        }
    }

    /// Refuses a robot of which it cannot be asked.
    ///
    /// # Errors
    /// [`Error::Argument`] with the reason and what can be asked instead.
    pub fn check(self, plant: &Plant) -> Result<()> {
        let no = |why: &str| {
            Err(Error::Argument(format!(
                "--for {}: {} {why}",
                self.name(),
                plant.name()
            )))
        };
        let tool = plant.tool();
        // a platform is moved by all actuators together
        let named = |t| plant.driver(t).is_none() && plant.robot().bodies[t].name == "platform";
        let platform = tool.is_some_and(named);
        match self {
            Question::Load if tool.is_none() => no("has no body that could carry a load"),
            Question::Platform | Question::Legs if !platform => no(
                "is no parallel robot with a platform on legs, for it has no body called `platform`; --for load asks for what \
                 its last body carries, --for friction for its drives, and without --for for all of its bodies",
            ),
            Question::Legs if !plant.parameters().iter().any(|p| of_legs(plant, p.kind)) => no(
                "has no unknowns of its legs: its file takes them as known; set `bodies = \"legs\"`",
            ),
            _ => Ok(()),
        }
    }
}

/// Whether a column is one of a body other than that which carries a load.
pub(crate) fn of_legs(plant: &Plant, column: Column) -> bool {
    matches!(column, Column::Inertial { body, .. } if plant.tool() != Some(body))
}

/// The load that counts where none is named: a cube of water that stands on the `x`-`y` plane of the body that carries
/// it, as heavy as that body, or a twentieth of all bodies where that is more.
pub fn ordinary_load(plant: &Plant) -> Inertia {
    let bodies = &plant.robot().bodies;
    let all: f64 = bodies.iter().map(|b| b.inertia.mass()).sum();
    let own = plant.tool().map_or(0.0, |t| bodies[t].inertia.mass());
    let mass = match own.max(LEAST * all) {
        m if m > 0.0 => m,
        _ => 1.0,
    };
    let side = (mass / DENSITY).cbrt();
    let tensor = Matrix3::identity() * (mass * side * side / 6.0);
    Inertia::from_com(mass, Vector3::new(0.0, 0.0, 0.5 * side), tensor)
}
