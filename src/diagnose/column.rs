//! A column of a linear model on the rows of some actuators.

use std::sync::Arc;

/// A column of a linear model: values on the rows of some actuators, all records one after another
/// (the fitted ones first).
#[derive(Debug, Clone, Default)]
pub struct Column {
    /// actuator and its values; actuators that are missing have zeros
    pub rows: Vec<(usize, Vec<f64>)>,
}

impl Column {
    /// A column on one actuator.
    pub fn on(joint: usize, values: Vec<f64>) -> Self {
        Column {
            rows: vec![(joint, values)],
        }
    }

    /// The same with zeros outside of these rows.
    pub fn within(&self, spans: &[std::ops::Range<usize>]) -> Self {
        let rows = self.rows.iter().map(|(j, v)| {
            let mut part = vec![0.0; v.len()];
            for span in spans {
                part[span.clone()].copy_from_slice(&v[span.clone()]);
            }
            (*j, part)
        });
        Column {
            rows: rows.collect(),
        }
    }

    /// Adds so many times the column to rows by actuator.
    pub fn add_to(&self, factor: f64, rows: &mut [Vec<f64>]) {
        for (j, values) in &self.rows {
            let own = rows[*j].iter_mut().zip(values);
            own.for_each(|(t, v)| *t += factor * v);
        }
    }

    /// Values on an actuator.
    pub fn get(&self, joint: usize) -> Option<&[f64]> {
        self.rows
            .iter()
            .find(|(j, _)| *j == joint)
            .map(|(_, v)| v.as_slice())
    }
}

/// The columns of the nominal model on the rows of one actuator; those of zeros take no room, nor does what a clone has in common
/// with its original.
#[derive(Debug, Clone, Default)]
pub struct Columns {
    rows: usize,
    all: Vec<Option<Arc<Vec<f64>>>>,
}

impl Columns {
    /// `count` columns of zeros.
    pub fn new(rows: usize, count: usize) -> Self {
        let all = vec![None; count];
        Columns { rows, all }
    }

    /// A column, where it is not zero.
    pub fn get(&self, c: usize) -> Option<&[f64]> {
        self.all[c].as_deref().map(Vec::as_slice)
    }

    /// A column to be written.
    pub fn write(&mut self, c: usize) -> &mut [f64] {
        let zeros = || Arc::new(vec![0.0; self.rows]);
        let column: &mut Vec<f64> = Arc::make_mut(self.all[c].get_or_insert_with(zeros));
        column
    }

    /// Adds a column.
    pub fn push(&mut self, column: Option<Vec<f64>>) {
        self.all.push(column.map(Arc::new));
    }

    /// The sum of all with these coefficients.
    pub fn times(&self, coefficients: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.rows];
        for (column, x) in self.all.iter().zip(coefficients) {
            let Some(column) = column.as_ref().filter(|_| *x != 0.0) else {
                continue;
            };
            out.iter_mut()
                .zip(column.iter())
                .for_each(|(o, v)| *o += x * v);
        }
        out
    }
}
