//! A log before it is put on a grid: made in memory, or as it was written.

use super::clock::Clock;
use super::record::check_names;
use super::resample::{Order, interpolate};
use super::{Purpose, Record, Table};
use crate::error::{Error, Result};
use crate::plant::Plant;
use rayon::prelude::*;
use std::path::Path;

/// The samples of a log before they were put on an even grid.
///
/// Stamps that jitter about a clock need not be believed, and interpolation to an even grid smooths
/// a torque for good. With these samples a stage can choose for itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Written {
    /// time stamps, s
    pub t: Vec<f64>,
    /// whether a sample was measured in all channels
    pub valid: Vec<bool>,
    /// positions, rad or m
    pub q: Vec<Vec<f64>>,
    /// torques or forces, N m or N
    pub tau: Vec<Vec<f64>>,
    /// commanded positions
    pub qref: Option<Vec<Vec<f64>>>,
}

/// Channels of a log that was not read from a file: one list an actuator.
#[derive(Debug, Clone, Default)]
pub struct Channels {
    /// time stamps, s
    pub t: Vec<f64>,
    /// positions, rad or m
    pub q: Vec<Vec<f64>>,
    /// torques or forces, N m or N
    pub tau: Vec<Vec<f64>>,
    /// commanded positions
    pub qref: Option<Vec<Vec<f64>>>,
}

impl Record {
    /// A log that was made in memory, as if it had been read from a file called `name`.
    ///
    /// # Errors
    /// As [`Record::read`].
    pub fn from_channels(
        name: &str,
        channels: Channels,
        plant: &Plant,
        purpose: Purpose,
        period: Option<f64>,
    ) -> Result<Record> {
        let mut table = Table {
            names: vec!["t".into()],
            columns: vec![channels.t],
            ..Table::default()
        };
        for (group, columns) in [
            ("q", channels.q),
            ("tau", channels.tau),
            ("qref", channels.qref.unwrap_or_default()),
        ] {
            for (k, column) in columns.into_iter().enumerate() {
                if column.len() != table.columns[0].len() {
                    let message = format!(
                        "{group}{}: {} samples beside {} time stamps",
                        k + 1,
                        column.len(),
                        table.columns[0].len()
                    );
                    return Err(Error::file(name, "", message));
                }
                table.names.push(format!("{group}{}", k + 1));
                table.columns.push(column);
            }
        }
        Self::from_table(name, table, plant, purpose, period, [None; 2])
    }

    /// A log that was made in memory, with columns of the names of a log; `part` is what counts of it, s from its
    /// start.
    ///
    /// # Errors
    /// As [`Record::read`]; columns of different lengths.
    #[doc(hidden)]
    pub fn from_table(
        name: &str,
        mut table: Table,
        plant: &Plant,
        purpose: Purpose,
        period: Option<f64>,
        part: [Option<f64>; 2],
    ) -> Result<Record> {
        let path = Path::new(name);
        let rows = table.rows();
        if table.names.len() != table.columns.len() || table.columns.iter().any(|c| c.len() != rows)
        {
            return Err(Error::file(path, "", "its columns differ in length"));
        }
        let unknown = check_names(&table, &plant.actuators(), path)?;
        table.warnings.extend(unknown);
        let mut record = Self::of_table(table, path, plant, purpose, period, part)?;
        record.name = name.into();
        Ok(record)
    }

    /// The samples before they were put on the grid, where they came from a clock that left none
    /// out and every stamp lies within half a step of it. `None` too where the channels were
    /// changed since: then they count as they are now.
    pub fn as_written(&self) -> Option<&Written> {
        let w = self.written.as_ref()?;
        let same = |from: &[Vec<f64>], to: &[Vec<f64>], order: Order| {
            from.len() == to.len()
                && from
                    .par_iter()
                    .zip(to)
                    .all(|(from, to)| match self.resampled {
                        true => interpolate(&w.t, from, &self.t, order) == *to,
                        false => from == to,
                    })
        };
        let reference = match (&w.qref, &self.qref) {
            (Some(a), Some(b)) => same(a, b, Order::Cubic),
            (a, b) => a.is_none() && b.is_none(),
        };
        let all = reference
            && same(&w.q, &self.q, Order::Cubic)
            && same(&w.tau, &self.tau, Order::Linear);
        all.then_some(w)
    }

    /// The channels before [`Record::resample`], where no row was left out and the clock is regular.
    pub(super) fn before_grid(&self, clock: &Clock) -> Option<Written> {
        let (t, n) = (&clock.t, clock.t.len());
        let mean = (t[n - 1] - t[0]) / (n - 1) as f64;
        let regular = t
            .iter()
            .enumerate()
            .all(|(i, v)| (v - t[0] - i as f64 * mean).abs() < 0.5 * mean);
        (clock.keep.is_none() && regular).then(|| Written {
            t: t.clone(),
            valid: self.valid.clone(),
            q: self.q.clone(),
            tau: self.tau.clone(),
            qref: self.qref.clone(),
        })
    }
}
