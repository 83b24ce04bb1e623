//! Wrong logs, refused by what they would need: units of positions and pressures, drives of the wrong sign, chambers and
//! legs that are exchanged, records that are.
//!
//! A load has ten parameters and a robot as many friction terms again: they explain a part of almost any log. So what a
//! log is stated to be is compared with what it would have to be ([`forces`]), and what it carries with what the robot
//! weighs ([`carried`]). Each suspicion names the drive, the evidence and the remedy.

mod carried;
mod forces;
mod positions;

pub(super) use carried::negative;
pub(super) use forces::check as forces;

use super::records::of_platform;
use super::system::System;
use crate::error::{Result, Warning};
use crate::log::{Experiment, pressure};
use crate::plant::Plant;

/// Before the signals are prepared: units of positions and pressures.
///
/// # Errors
/// Positions or pressures that cannot be in the units that they should have.
pub fn raw(experiment: &Experiment, atmosphere: f64) -> Result<()> {
    for record in &experiment.records {
        positions::check(record, &experiment.plant)?;
        pressure::check(record, &experiment.plant, atmosphere)?;
    }
    Ok(())
}

/// Where the records are equations: drives, legs and records that are exchanged or turned. Closed chains only; what a
/// serial robot's joints are told by is looked at with its log.
///
/// # Errors
/// A log that fits the robot only if it is read otherwise than stated.
pub fn prepared(plant: &Plant, tool: usize, system: &System) -> Result<Vec<Warning>> {
    if !of_platform(plant) {
        return Ok(Vec::new());
    }
    let warnings = forces(plant, tool, system)?;
    carried::check(plant, tool, system)?;
    Ok(warnings)
}
