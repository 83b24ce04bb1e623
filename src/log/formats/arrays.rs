//! Named arrays of one or two dimensions as the columns of one table.

use crate::error::{Error, Result, Warning, WarningKind};
use crate::log::Table;
use std::path::Path;

/// A matrix by columns.
pub(super) struct Array {
    /// its name
    pub name: String,
    /// number of rows
    pub rows: usize,
    /// number of columns
    pub columns: usize,
    /// numbers, column by column
    pub values: Vec<f64>,
}

impl Array {
    /// Column `k` of the matrix, or its row `k` where the samples lie along the rows.
    fn series(&self, k: usize, turned: bool) -> Vec<f64> {
        match turned {
            false => self.values[k * self.rows..(k + 1) * self.rows].to_vec(),
            true => (0..self.columns)
                .map(|c| self.values[c * self.rows + k])
                .collect(),
        }
    }
}

/// One table of all arrays that have the usual number of samples; others are named. The number of
/// samples is the length that most numbers lie along.
pub(super) fn table(arrays: Vec<Array>, path: &Path) -> Result<Table> {
    let sound = |a: &&Array| a.values.len() == a.rows * a.columns && !a.values.is_empty();
    let arrays: Vec<&Array> = arrays.iter().filter(sound).collect();
    let weight = |n: usize| {
        let along = |a: &&&Array| a.rows == n || a.columns == n;
        arrays
            .iter()
            .filter(along)
            .map(|a| a.values.len())
            .sum::<usize>()
    };
    let samples = arrays
        .iter()
        .flat_map(|a| [a.rows, a.columns])
        // a list is one column wide, and a number is no series
        .filter(|n| *n > 1)
        .max_by_key(|&n| (weight(n), n));
    let Some(samples) = samples else {
        return Err(Error::file(path, "", "it holds no array of samples"));
    };
    let mut out = Table::default();
    let mut left = Vec::new();
    for a in arrays {
        let turned = a.rows != samples;
        let (n, width) = match turned {
            false => (a.rows, a.columns),
            true => (a.columns, a.rows),
        };
        if n != samples {
            left.push(format!("{} ({} × {})", a.name, a.rows, a.columns));
            continue;
        }
        for k in 0..width {
            out.names.push(match (width, a.name.is_empty()) {
                (1, false) => a.name.clone(),
                (_, true) => (out.names.len() + 1).to_string(),
                _ => format!("{}[{k}]", a.name),
            });
            out.columns.push(a.series(k, turned));
        }
    }
    if !left.is_empty() {
        out.warnings.push(Warning::new(
            WarningKind::ColumnsIgnored,
            path.display().to_string(),
            format!(
                "arrays that are not {samples} samples long were left out: {}",
                left.join(", ")
            ),
        ));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn array(name: &str, rows: usize, columns: usize) -> Array {
        let values = (0..rows * columns).map(|i| i as f64).collect();
        Array {
            name: name.into(),
            rows,
            columns,
            values,
        }
    }

    #[test]
    fn numbers_and_lists_of_other_lengths_stand_beside_series() {
        let all = vec![
            array("fs", 1, 1),
            array("t", 100, 1),
            array("q", 100, 2),
            array("limits", 30, 1),
        ];
        let table = table(all, Path::new("log.npz")).unwrap();
        assert_eq!(table.names, ["t", "q[0]", "q[1]"]);
        assert_eq!(table.columns[2][99], 199.0);
        assert!(
            table.warnings[0].message.contains("limits"),
            "{:?}",
            table.warnings
        );
    }
}
