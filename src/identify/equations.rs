//! From records to the filtered equations of all of them, and those that are fitted.

use super::settings::Settings;
use super::stack::Stack;
use super::{aside, standstill, torque_units};
use crate::base::BaseParameters;
use crate::error::{Error, Result, Warning, WarningKind};
use crate::log::{Payload, Purpose, Record, warnings_of};
use crate::plant::Plant;
use crate::signals::{self, Prepared};
use rayon::prelude::*;
use std::borrow::Cow;

/// The records that identification can use: those without payload. The others are named in `warnings`.
///
/// # Errors
/// A record without torques; no record for the fit.
pub fn usable<'a>(records: &'a [Record], warnings: &mut Vec<Warning>) -> Result<Vec<&'a Record>> {
    let used = without_payload(records, warnings)?;
    match used.iter().any(|r| r.purpose == Purpose::Fit) {
        true => Ok(used),
        false => Err(nothing_to_fit()),
    }
}

pub(super) fn nothing_to_fit() -> Error {
    Error::Infeasible(
        "no record without payload is for the fit (use = \"fit\"): nothing to identify from".into(),
    )
}

/// The same, whether a record is for the fit or not.
///
/// # Errors
/// A record without torques.
pub(super) fn without_payload<'a>(
    records: &'a [Record],
    warnings: &mut Vec<Warning>,
) -> Result<Vec<&'a Record>> {
    warnings.extend(warnings_of(records));
    for r in records {
        if r.payload != Payload::None {
            warnings.push(Warning::new(
                WarningKind::RecordLeftOut,
                r.path.display().to_string(),
                "it was recorded with a payload and is left out here; `excite load` identifies payloads",
            ));
        }
        if r.tau.is_empty() {
            let message = "it has no columns tau1…, which identification needs";
            return Err(Error::file(&r.path, "line 1", message));
        }
    }
    let used = records.iter().filter(|r| r.payload == Payload::None);
    Ok(used.collect())
}

/// The settings with the cut-off that all records share, chosen from the fit records where none is given.
pub fn one_filter(records: &[&Record], settings: &Settings) -> Settings {
    let mut settings = settings.clone();
    let fit = records.iter().copied();
    let fit = fit.filter(|r| r.purpose == Purpose::Fit);
    let cutoff = &mut settings.signals.cutoff;
    cutoff.get_or_insert_with(|| signals::common_cutoff(fit));
    settings
}

/// The filtered equations of all records, in their order.
pub struct Equations<'a> {
    /// plant
    pub plant: &'a Plant,
    /// its base parameters
    pub base: &'a BaseParameters,
    /// how signals are prepared
    pub signals: &'a signals::Settings,
    /// records as logged
    pub records: Vec<&'a Record>,
    /// records as prepared
    pub prepared: Vec<Prepared>,
    /// `W_b π = τ` of each
    pub stacks: Vec<Stack>,
}

impl<'a> Equations<'a> {
    /// Prepares the records and stacks their equations.
    ///
    /// # Errors
    /// Signals that cannot be used; a pose of a parallel robot that cannot be reached.
    pub fn new(
        plant: &'a Plant,
        base: &'a BaseParameters,
        signals: &'a signals::Settings,
        records: Vec<&'a Record>,
    ) -> Result<Self> {
        let prepared = records
            .par_iter()
            .map(|r| Prepared::new(r, plant, signals))
            .collect::<Result<Vec<_>>>()?;
        let stacks = prepared
            .par_iter()
            .map(|p| Stack::new(plant, base, p))
            .collect::<Result<Vec<_>>>()?;
        Ok(Equations {
            plant,
            base,
            signals,
            records,
            prepared,
            stacks,
        })
    }

    /// The records that are fitted.
    ///
    /// # Errors
    /// Fewer equations than base parameters.
    pub fn fit(&self) -> Result<Fit<'_>> {
        let fitted = self.stacks.iter().filter(|s| s.purpose == Purpose::Fit);
        self.fit_of(fitted.map(Cow::Borrowed).collect())
    }

    /// The same with their equations, in the order of the records, which were taken out of `stacks`.
    ///
    /// # Errors
    /// As [`Equations::fit`].
    pub fn fit_of<'b>(&'b self, stacks: Vec<Cow<'b, Stack>>) -> Result<Fit<'b>> {
        let chosen: Vec<usize> = (0..self.records.len())
            .filter(|&k| self.records[k].purpose == Purpose::Fit)
            .collect();
        let fit = Fit {
            plant: self.plant,
            base: self.base,
            signals: self.signals,
            records: chosen.iter().map(|&k| self.records[k]).collect(),
            prepared: chosen.iter().map(|&k| &self.prepared[k]).collect(),
            stacks,
        };
        let rows = fit.equations();
        if rows < self.base.count() {
            return Err(Error::Infeasible(format!(
                "{rows} filtered equations cannot give {} base parameters: record longer, or raise the cut-off",
                self.base.count()
            )));
        }
        Ok(fit)
    }
}

/// The records that are fitted, with equations left out or freed of what the model has no term for.
pub struct Fit<'a> {
    /// plant
    pub plant: &'a Plant,
    /// its base parameters
    pub base: &'a BaseParameters,
    /// how signals are prepared
    pub signals: &'a signals::Settings,
    /// records as logged
    pub records: Vec<&'a Record>,
    /// records as prepared
    pub prepared: Vec<&'a Prepared>,
    stacks: Vec<Cow<'a, Stack>>,
}

impl Fit<'_> {
    /// The equations, record by record.
    pub fn stacks(&self) -> Vec<&Stack> {
        self.stacks.iter().map(Cow::as_ref).collect()
    }

    /// Number of equations that count.
    pub fn equations(&self) -> usize {
        self.stacks.iter().map(|s| s.equations()).sum()
    }

    /// Torques that look as if they were in another unit.
    pub fn unit_suspicions(&self) -> Vec<Warning> {
        torque_units::suspicions(self.plant, self.base, &self.stacks())
    }

    /// Leaves the equations of joints that stand still out ([`standstill`]).
    ///
    /// # Errors
    /// A pose of a parallel robot that cannot be reached.
    pub fn keep_moving(&mut self, warnings: &mut Vec<Warning>) -> Result<()> {
        let note = standstill::leave_out(self.plant, &mut self.stacks, &self.prepared)?;
        warnings.extend(note);
        Ok(())
    }

    /// Frees the equations of what follows another joint ([`aside`]), judged by the residual of `pi`.
    /// Returns whether there was anything.
    ///
    /// # Errors
    /// A pose of a parallel robot that cannot be reached.
    pub fn set_aside(&mut self, pi: &[f64], warnings: &mut Vec<Warning>) -> Result<bool> {
        let (freed, notes) = aside::apart(self.plant, &self.stacks(), &self.prepared, pi)?;
        warnings.extend(notes);
        let Some(stacks) = freed else {
            return Ok(false);
        };
        self.stacks = stacks.into_iter().map(Cow::Owned).collect();
        Ok(true)
    }
}
