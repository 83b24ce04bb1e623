//! What the records carry: exchanged records, forces in another unit.

use super::forces::Probe;
use crate::error::{Error, Result};
use crate::load::system::System;
use crate::plant::Plant;

/// Factors of the stated mass between which what an empty robot carries must lie: a model that is ten times off is none.
const ODD: [f64; 2] = [0.2, 5.0];

/// Compares what each record carries, platform included, with the robot file and with the other records.
///
/// # Errors
/// An empty robot that carries many times its platform, or next to nothing; a load that is lighter than none.
pub fn check(plant: &Plant, tool: usize, system: &System) -> Result<()> {
    let stated = plant.robot().bodies[tool].inertia.mass();
    if !system.base.kept.contains(&0) || stated <= 0.0 {
        return Ok(());
    }
    let mut carried = Vec::new();
    for (p, part) in system.parts.iter().enumerate() {
        let probe = Probe::new(plant, tool, system, p)?;
        let Some(fit) = probe.fit(&probe.torque) else {
            return Ok(());
        };
        let mass = stated + fit.mass;
        let odd = mass < ODD[0] * stated || (!part.loaded && mass > ODD[1] * stated);
        if odd {
            return Err(Error::Infeasible(format!(
                "{}: the drives carry {mass:.3} kg there, and the platform alone has {stated:.3} kg by the robot file: the \
                 forces have another unit or sign than N, or the chambers of all drives are exchanged; --unchecked goes on \
                 all the same",
                part.name
            )));
        }
        carried.push((part.loaded, mass, part.name.as_str()));
    }
    let of = |loaded: bool| carried.iter().filter(move |c| c.0 == loaded);
    let lightest = of(false).min_by(|a, b| a.1.total_cmp(&b.1));
    let heaviest = of(true).max_by(|a, b| a.1.total_cmp(&b.1));
    if let (Some(empty), Some(full)) = (lightest, heaviest)
        && full.1 < empty.1 - 0.02 * stated
    {
        return Err(Error::Infeasible(format!(
            "{} (payload = \"unknown\") carries {:.3} kg and {} (payload = \"none\") {:.3} kg, platform included ({stated:.3} kg \
             by the robot file): the records are exchanged, or their payloads are; --unchecked goes on all the same",
            full.2, full.1, empty.2, empty.1
        )));
    }
    Ok(())
}

/// Refuses a load whose mass is negative beyond its uncertainty.
///
/// # Errors
/// Such a load, with what it means.
pub fn negative(mass: f64, std: f64) -> Result<()> {
    if mass < -3.0 * std && mass < 0.0 {
        return Err(Error::Infeasible(format!(
            "the load would have a mass of {mass:.4} ± {:.4} kg (95 %): the loaded record carries less than the empty robot. \
             Exchanged records, forces with the wrong sign, exchanged chambers or a platform that the robot file makes too \
             heavy do that; --unchecked gives the nearest body that can exist all the same",
            1.96 * std
        )));
    }
    Ok(())
}
