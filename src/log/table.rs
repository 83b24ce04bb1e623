//! Columns of numbers with names.

use super::formats::csv;
use crate::error::{Result, Warning};
use std::path::Path;

/// Columns of numbers with names.
#[derive(Debug, Clone, Default)]
pub struct Table {
    /// names in the order of the file
    pub names: Vec<String>,
    /// one column a name; NaN where a value was dropped
    pub columns: Vec<Vec<f64>>,
    /// columns of texts that hold the same one throughout: their names, and what they hold
    pub labels: Vec<[String; 2]>,
    /// rows of the file that come before the first; not zero in a part of a long log
    pub before: usize,
    /// what was imperfect
    pub warnings: Vec<Warning>,
}

impl Table {
    /// Reads a CSV file of any layout; columns for which `wanted` is false are not kept (their column is
    /// empty). Lines that are no rows are left out, with a warning that names them.
    ///
    /// # Errors
    /// A file that cannot be read, without lines of numbers, or of which most lines are no rows.
    pub fn read(path: impl AsRef<Path>, wanted: &dyn Fn(&str) -> bool) -> Result<Self> {
        Ok(csv::read(path.as_ref(), wanted, &|_| Ok(()))?.0)
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.iter().map(Vec::len).max().unwrap_or(0)
    }

    /// Index of the column of this name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }
}
