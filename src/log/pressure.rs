//! Chamber pressures of cylinders: the forces that they are, and the other way round.
//!
//! ```text
//! f = p_a A_a − p_b A_b − p_atm (A_a − A_b)
//! ```

use crate::error::{Error, Result};
use crate::log::{Experiment, Record};
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

/// Standard pressure of the air, Pa.
pub const ATMOSPHERE: f64 = 101_325.0;

/// Pressures of both chambers, of a valve that raises one as it lowers the other about `mean`, Pa; `tau` actuator-major.
///
/// # Errors
/// An actuator without piston areas, or a pressure below nothing.
pub(crate) fn of_forces(plant: &Plant, tau: &[f64], mean: f64) -> Result<[Vec<f64>; 2]> {
    let joints = plant.actuators();
    let count = tau.len() / joints.len().max(1);
    let mut out = [Vec::with_capacity(tau.len()), Vec::with_capacity(tau.len())];
    for (joint, row) in joints.iter().zip(tau.chunks_exact(count.max(1))) {
        let [a, b] = piston(&joint.name, joint.piston, "--pressures")?;
        let rest = (mean - ATMOSPHERE) * (a - b);
        for f in row {
            let half = 0.5 * (f - rest);
            let pair = [mean + half / a, mean - half / b];
            if pair.iter().any(|p| *p < 0.0) {
                return Err(Error::Infeasible(format!(
                    "--pressures: {} needs {:.0} and {:.0} Pa for {f:.1} N; a higher mean than {mean:.0} Pa gives that",
                    joint.name, pair[0], pair[1]
                )));
            }
            out[0].push(pair[0]);
            out[1].push(pair[1]);
        }
    }
    Ok(out)
}

fn piston(joint: &str, piston: Option<[f64; 2]>, record: &str) -> Result<[f64; 2]> {
    piston.ok_or_else(|| {
        Error::Infeasible(format!(
            "{record}: the log has chamber pressures, but `{joint}` no piston areas; add piston = \
             [AREA_A, AREA_B] in m^2 to [actuator] or to its [[joint]] in the robot file"
        ))
    })
}

impl Record {
    /// The record with forces from its chamber pressures, where it has no torques; `None` where it has them, or neither.
    ///
    /// # Errors
    /// A log with pressures of a robot without piston areas.
    pub fn with_forces(&self, plant: &Plant, atmosphere: f64) -> Result<Option<Record>> {
        let Some([pa, pb]) = self.pressures.as_ref().filter(|_| self.tau.is_empty()) else {
            return Ok(None);
        };
        let tau = plant
            .actuators()
            .iter()
            .zip(pa.iter().zip(pb))
            .map(|(joint, (a, b))| {
                let [area_a, area_b] = piston(&joint.name, joint.piston, &self.name)?;
                let outside = atmosphere * (area_a - area_b);
                let force = |(a, b): (&f64, &f64)| a * area_a - b * area_b - outside;
                Ok(a.iter().zip(b).map(force).collect())
            })
            .collect::<Result<Vec<Vec<f64>>>>()?;
        Ok(Some(Record {
            tau,
            ..self.clone()
        }))
    }
}

impl Experiment {
    /// Forces from the chamber pressures in all records that have those and no torques. `atmosphere` is the pressure outside
    /// of the cylinders, Pa; 0 where the logged ones are relative to it.
    ///
    /// # Errors
    /// Pressures that cannot be in Pa; a robot without piston areas.
    pub fn press(&mut self, atmosphere: f64) -> Result<()> {
        let each = |record| press(record, &self.plant, atmosphere);
        self.records.iter_mut().try_for_each(each)
    }
}

/// [`Experiment::press`] of one record.
pub(crate) fn press(record: &mut Record, plant: &Plant, atmosphere: f64) -> Result<()> {
    check(record, plant, atmosphere)?;
    if let Some(forces) = record.with_forces(plant, atmosphere)? {
        *record = forces;
    }
    Ok(())
}
