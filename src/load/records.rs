//! The records: with torques from chamber pressures where they have none, and with what they carried.

use super::settings::Settings;
use crate::error::{Error, Result};
use crate::log::{Experiment, Payload, Record};
use crate::plant::Plant;
use crate::signals::Prepared;

/// A record with what it carried.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// signals
    pub record: Prepared,
    /// load
    pub payload: Payload,
    /// the torques as they were if chambers a and b were exchanged, unfiltered; where they come from pressures
    pub exchanged: Option<Vec<f64>>,
}

/// Whether a platform carries the load: what its drives lack or exchange can be told by the equations, and of the empty robot
/// only the platform may deviate, since legs seldom do.
pub(super) fn of_platform(plant: &Plant) -> bool {
    plant.held_together()
}

/// The records of an experiment with their signals prepared.
///
/// # Errors
/// Signals that cannot be used; pressures of a robot without piston areas.
pub fn prepared(experiment: &Experiment, settings: &Settings) -> Result<Vec<Loaded>> {
    let plant = &experiment.plant;
    let one = |record: &Record| {
        let pressed = record.with_forces(plant, settings.atmosphere)?;
        let exchanged = match (&pressed, settings.checked && of_platform(plant)) {
            (Some(_), true) => exchanged(record, plant, settings)?,
            _ => None,
        };
        let record = pressed.as_ref().unwrap_or(record);
        Ok(Loaded {
            record: Prepared::new(record, plant, &settings.signals)?,
            payload: record.payload,
            exchanged,
        })
    };
    experiment.records.iter().map(one).collect()
}

/// Torques of a record whose chambers are exchanged.
fn exchanged(record: &Record, plant: &Plant, settings: &Settings) -> Result<Option<Vec<f64>>> {
    let turned = Record {
        pressures: (record.pressures.clone()).map(|[a, b]| [b, a]),
        ..record.clone()
    };
    let Some(forces) = turned.with_forces(plant, settings.atmosphere)? else {
        return Ok(None);
    };
    Ok(Some(
        Prepared::new(&forces, plant, &settings.signals)?.torque,
    ))
}

/// Refuses records without torques, and experiments without an unknown load.
///
/// # Errors
/// What is missing, and how to state it.
pub fn check(records: &[Loaded]) -> Result<()> {
    if let Some(r) = records.iter().find(|r| r.record.torque.is_empty()) {
        return Err(Error::Infeasible(format!(
            "{}: the log has neither torques nor pressures with piston areas",
            r.record.name
        )));
    }
    if !any(records, Payload::Unknown) {
        return Err(Error::Infeasible(
            "no record has the load that is to be identified: write payload = \"unknown\" at the \
             records of the loaded robot in the experiment (and payload = \"none\" at those of the \
             empty one)"
                .into(),
        ));
    }
    Ok(())
}

/// Whether any record carried this.
pub fn any(records: &[Loaded], payload: Payload) -> bool {
    records.iter().any(|r| r.payload == payload)
}
