//! What the robot carried in each record.
//!
//! A load is ten more parameters `π` of the body that carries it, so its torque is `Y_tool(x, ẋ, ẍ) π`.
//! A load that is known is part of the nominal model of its records: mass and centre of mass as the
//! experiment states them, a point mass where it states no inertia. Records with an unknown load share
//! one load, or each has its own where the load was mounted again in between ([`super::carried`]). The ten parameters of each are
//! free, with columns that are zero on all other records. So both kinds of record are one robot, and no effect can stand in
//! the place of the load.

use super::column::Column;
use super::data::Data;
use super::thresholds::THRESHOLDS as T;
use super::window::averaged;
use crate::error::{Error, Result, Warning, WarningKind};
use crate::log::{self, Payload, Purpose};
use crate::plant::Plant;
use crate::robot::Inertia;
use crate::signals::series::Series;
use nalgebra::Matrix3;

/// Ten parameters of a load about the origin of the frame of the body that carries it.
pub type Load = [f64; 10];

/// How many unknown loads there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loads {
    /// one, which all records with an unknown load carry
    One,
    /// one in each of these records
    ByRecord,
}

/// Names of the free parameters.
const NAMES: [&str; 10] = [
    "load.m", "load.mx", "load.my", "load.mz", "load.xx", "load.xy", "load.xz", "load.yy",
    "load.yz", "load.zz",
];

/// Whether the loads of these records can be honoured.
///
/// # Errors
/// A load on a robot without bodies; an unknown load that only holdout records carry, which nothing
/// can tell.
pub fn check(plant: &Plant, logs: &[log::Record]) -> Result<()> {
    let Some(loaded) = logs.iter().find(|r| r.payload != Payload::None) else {
        return Ok(());
    };
    if plant.tool().is_none() {
        return Err(Error::Infeasible(format!(
            "{}: it states a payload, but {} has no body that could carry one",
            loaded.name,
            plant.name()
        )));
    }
    let free: Vec<&log::Record> = logs.iter().filter(|r| is_free(r.payload)).collect();
    if let Some(other) = free.iter().find(|r| r.payload != free[0].payload) {
        return Err(Error::Infeasible(format!(
            "{} and {}: they carry different loads that are not known in full, and a diagnosis estimates one; state mass \
             and com of one of them (excite load tells them)",
            free[0].name, other.name
        )));
    }
    let unknown = |r: &&log::Record| is_free(r.payload);
    let fitted = |r: &log::Record| r.purpose == Purpose::Fit;
    match logs.iter().find(unknown) {
        Some(held) if !logs.iter().filter(unknown).any(fitted) => Err(Error::Infeasible(format!(
            "{}: its payload is unknown, and no record with use = \"fit\" carries it, so its torque cannot be \
             predicted; state it as payload = {{ mass = …, com = […] }}, or fit to a record with it",
            held.name
        ))),
        _ => Ok(()),
    }
}

/// What the payloads leave open.
pub fn warnings(logs: &[log::Record]) -> Vec<Warning> {
    let open = |r: &log::Record| is_free(r.payload);
    match logs.iter().any(open) && !logs.iter().any(|r| r.payload == Payload::None) {
        true => vec![Warning::new(
            WarningKind::NominalModelAssumed,
            "payload",
            "there is no record of the empty robot (payload = \"none\"): the unknown load takes up every \
             error of the mass and inertia of the last body",
        )],
        false => Vec::new(),
    }
}

/// Whether a load is estimated: all of it, or where its mass is and how it is spread.
pub fn is_free(payload: Payload) -> bool {
    matches!(payload, Payload::Unknown | Payload::Known { com: None, .. })
}

/// The load that a payload states.
fn stated(payload: Payload) -> Option<Load> {
    let Payload::Known {
        mass,
        com: Some(com),
        inertia,
    } = payload
    else {
        return None;
    };
    let [xx, xy, xz, yy, yz, zz] = inertia.unwrap_or_default();
    let tensor = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    Some(Inertia::from_com(mass, com.into(), tensor).0)
}

impl Data<'_> {
    /// Takes the loads of the records in: torques of known ones, and free parameters of the unknown one, or of one for
    /// each record that carries one.
    ///
    /// # Errors
    /// Poses that cannot be reached.
    pub fn carry(&mut self, loads: Loads) -> Result<()> {
        let none = |r: &Series| r.payload == Payload::None;
        let Some(tool) = self.plant.tool().filter(|_| !self.records.iter().all(none)) else {
            return Ok(());
        };
        let columns = self.load_columns(tool, |r| !none(r))?;
        for k in 0..self.records.len() {
            let Some(load) = stated(self.records[k].payload) else {
                continue;
            };
            for (column, value) in columns.iter().zip(load) {
                for (known, row) in self.known.iter_mut().zip(column) {
                    for i in self.start[k]..self.start[k + 1] {
                        known[i] += value * row[i];
                    }
                }
            }
        }
        self.tool = columns
            .iter()
            .map(|rows| Column {
                rows: rows.iter().cloned().enumerate().collect(),
            })
            .collect();
        let unknown: Vec<usize> = (0..self.records.len())
            .filter(|k| is_free(self.records[*k].payload))
            .collect();
        let groups: Vec<Vec<usize>> = match loads {
            _ if unknown.is_empty() => Vec::new(),
            Loads::One => vec![unknown],
            Loads::ByRecord => unknown.into_iter().map(|k| vec![k]).collect(),
        };
        for records in groups {
            let spans: Vec<_> = records.iter().map(|k| self.span(*k)).collect();
            let bodies = self.plant.robot().bodies.iter();
            let mass: f64 = bodies.map(|b| b.inertia.mass()).sum();
            let size = |c: usize| {
                let moment = match c {
                    0 => 0,
                    1..=3 => 1,
                    _ => 2,
                };
                mass.max(T.load.lightest) * T.load.lever.powi(moment)
            };
            let free = NAMES.iter().zip(&self.tool).enumerate();
            let free = free.map(|(c, (name, column))| (*name, column.within(&spans), size(c)));
            let free: Vec<_> = free.collect();
            let at = self.parameters.len();
            for k in records {
                self.free_load[k] = Some(at);
            }
            self.add_nuisances(&free);
        }
        Ok(())
    }

    /// First of the parameters of unknown loads, which follow those of the robot.
    pub fn first_free_load(&self) -> Option<usize> {
        self.free_load.iter().flatten().copied().min()
    }

    /// Torques of the ten parameters of a load on body `tool`, by parameter and actuator, on the rows of the records
    /// that `carry` it.
    ///
    /// # Errors
    /// Poses that cannot be reached.
    pub(super) fn load_columns(
        &self,
        tool: usize,
        carry: impl Fn(&Series) -> bool,
    ) -> Result<Vec<Vec<Vec<f64>>>> {
        let mut columns = vec![vec![vec![0.0; self.rows()]; self.joints()]; 10];
        for (k, r) in self.records.iter().enumerate().filter(|(_, r)| carry(r)) {
            let w = self.plant.body_columns(tool, &r.x)?;
            for (c, column) in columns.iter_mut().enumerate() {
                for (j, row) in column.iter_mut().enumerate() {
                    let tau: Vec<f64> = (0..r.count).map(|i| w[(j * r.count + i, c)]).collect();
                    averaged(&tau, &mut row[self.start[k]..self.start[k + 1]]);
                }
            }
        }
        Ok(columns)
    }

    /// Starts from the load that a fit has found in the place of none, so that the gap of the model as it
    /// is does not contain it.
    pub fn start_from_load(&mut self, phi: &[f64]) {
        for at in self.free_load.iter().flatten() {
            let load = self.parameters[*at..].iter_mut().zip(&phi[*at..]);
            load.take(10).for_each(|(p, v)| p.value = *v);
        }
    }

    /// What the robot carries in record `k`, with the parameters `phi`.
    pub fn load(&self, k: usize, phi: &[f64]) -> Option<Load> {
        match self.records[k].payload {
            Payload::None => None,
            free if is_free(free) => {
                let at = self.free_load[k]?;
                phi.get(at..at + 10)?.try_into().ok()
            }
            known => stated(known),
        }
    }

    /// The unknown load of record `k` of a fit, in words.
    pub fn free_load_in_words(&self, k: usize, phi: &[f64]) -> Option<String> {
        let at = self.free_load[k]?;
        let others = self.free_load.iter().flatten();
        let own = match others.clone().any(|o| *o != at) {
            true => " of its own",
            false => "",
        };
        let m = phi[at];
        Some(match m.abs() > T.load.least {
            true => format!(
                "it carries an unknown load{own}, estimated beside the effects: {m:.3} kg at ({:.3}, {:.3}, {:.3}) m",
                phi[at + 1] / m,
                phi[at + 2] / m,
                phi[at + 3] / m
            ),
            false => "it carries an unknown load, of which this motion shows nothing".into(),
        })
    }
}
