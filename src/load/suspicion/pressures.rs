//! Chamber pressures: units other than Pa, and pressures relative to the air.

use crate::error::{Error, Result};
use crate::log::Record;
use crate::plant::Plant;

/// Pressures below this are no absolute pressures of a cylinder that works, Pa.
const VACUUM: f64 = 2e4;

/// Units in which pressures are logged, Pa.
const UNITS: [(&str, f64); 4] = [("bar", 1e5), ("kPa", 1e3), ("MPa", 1e6), ("psi", 6894.757)];

/// Pressure of an ordinary supply, Pa: between these lies the largest of a log.
const SUPPLY: [f64; 2] = [1.5e5, 4e7];

/// Checks the pressures of a record against the air outside; `atmosphere` as it is set, Pa.
///
/// # Errors
/// Pressures that cannot be absolute and in Pa.
pub fn check(record: &Record, plant: &Plant, atmosphere: f64) -> Result<()> {
    let Some([pa, pb]) = record.pressures.as_ref().filter(|_| record.tau.is_empty()) else {
        return Ok(());
    };
    let all = || {
        pa.iter()
            .chain(pb)
            .flatten()
            .copied()
            .filter(|p| p.is_finite())
    };
    let most = all().fold(f64::NEG_INFINITY, f64::max);
    let least = all().fold(f64::INFINITY, f64::min);
    let mean = all().sum::<f64>() / all().count().max(1) as f64;
    let joints = plant.actuators();
    if most < VACUUM {
        let other = UNITS
            .iter()
            .find(|(_, factor)| (SUPPLY[0]..SUPPLY[1]).contains(&(most * factor)));
        let guess = match other {
            Some((unit, factor)) => format!("they look like {unit}: multiply them by {factor}"),
            None => "write them in Pa".into(),
        };
        return Err(Error::file(
            &record.path,
            "",
            format!(
                "the chamber pressures go up to {most:.4} only, which is next to nothing in Pa; {guess}"
            ),
        ));
    }
    if atmosphere > 0.0 && least < 0.0 {
        let low = |p: &[f64]| p.iter().any(|p| *p < 0.0);
        let drive = (0..joints.len()).find(|&j| low(&pa[j]) || low(&pb[j]));
        let name = drive.map_or("a drive", |j| joints[j].name.as_str());
        return Err(Error::file(
            &record.path,
            "",
            format!(
                "a chamber of {name} goes down to {least:.0} Pa and all are {mean:.0} Pa on average: absolute pressures are \
                 never negative; where they are relative to the air, say --atmosphere 0"
            ),
        ));
    }
    Ok(())
}
