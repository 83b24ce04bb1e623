//! Messages that name the same columns, as one table.

use crate::error::{Error, Result};
use crate::log::Table;
use std::path::Path;

/// Puts a table of the same columns, in any order, behind another.
pub(crate) fn append(all: &mut Table, next: Table, path: &Path) -> Result<()> {
    if all.names.is_empty() {
        *all = next;
        return Ok(());
    }
    let at: Option<Vec<usize>> = all.names.iter().map(|n| next.find(n)).collect();
    let Some(at) = at.filter(|at| at.len() == next.names.len()) else {
        let message = format!(
            "its messages name other columns further on ({} instead of {}): cut it there, or name another topic",
            next.names.join(", "),
            all.names.join(", ")
        );
        return Err(Error::file(path, "", message));
    };
    for (column, k) in all.columns.iter_mut().zip(at) {
        column.extend_from_slice(&next.columns[k]);
    }
    all.warnings.extend(next.warnings);
    Ok(())
}

/// Messages that name the same columns in the same order.
pub(super) struct Layout {
    /// all names, each behind a zero
    pub key: Vec<u8>,
    pub names: Vec<String>,
    pub columns: Vec<Vec<f64>>,
    /// stamps of the headers, s
    pub stamps: Vec<f64>,
    /// when they were recorded, s
    pub received: Vec<f64>,
}

/// Joins messages that name the same columns in another order.
pub(super) fn merge(layouts: &mut Vec<Layout>) {
    let mut k = 1;
    while k < layouts.len() {
        let order = |l: &Layout| {
            let mut names = l.names.clone();
            names.sort();
            names
        };
        let same = (0..k).find(|&j| order(&layouts[j]) == order(&layouts[k]));
        let Some(j) = same else {
            k += 1;
            continue;
        };
        let from = layouts.remove(k);
        let into = &mut layouts[j];
        for (name, column) in into.names.iter().zip(&mut into.columns) {
            if let Some(c) = from.names.iter().position(|n| n == name) {
                column.extend_from_slice(&from.columns[c]);
            }
        }
        into.stamps.extend(from.stamps);
        into.received.extend(from.received);
        let mut order: Vec<usize> = (0..into.received.len()).collect();
        order.sort_by(|a, b| into.received[*a].total_cmp(&into.received[*b]));
        let sorted = |v: &Vec<f64>| order.iter().map(|&i| v[i]).collect::<Vec<f64>>();
        into.stamps = sorted(&into.stamps);
        into.columns = into.columns.iter().map(sorted).collect();
        into.received = sorted(&into.received);
    }
}
