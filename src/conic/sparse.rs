//! Sparse rows as they are pushed, and the compressed columns that clarabel takes.

use clarabel::algebra::CscMatrix;

/// Sparse rows `r` of `s = b − A x`, one after the other.
#[derive(Debug, Clone, Default)]
pub(super) struct Rows {
    /// entry after the last of each row
    pub end: Vec<usize>,
    pub entries: Vec<(usize, f64)>,
    pub b: Vec<f64>,
}

impl Rows {
    pub fn len(&self) -> usize {
        self.b.len()
    }

    pub fn clear(&mut self) {
        self.end.clear();
        self.entries.clear();
        self.b.clear();
    }

    pub fn push(&mut self, terms: impl IntoIterator<Item = (usize, f64)>, b: f64) {
        self.entries.extend(terms);
        self.end.push(self.entries.len());
        self.b.push(b);
    }

    /// The entries as (row, column, value), row by row.
    pub fn triplets(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        let starts = std::iter::once(0).chain(self.end.iter().copied());
        starts
            .zip(&self.end)
            .enumerate()
            .flat_map(move |(row, (start, &end))| {
                self.entries[start..end]
                    .iter()
                    .map(move |&(column, value)| (row, column, value))
            })
    }
}

/// What is wrong with a row of `n` variables, if anything.
pub(super) fn flaw(
    n: usize,
    terms: impl IntoIterator<Item = (usize, f64)>,
    constant: f64,
) -> Option<String> {
    if !constant.is_finite() {
        return Some(format!("the constant is {constant}; it must be finite"));
    }
    terms.into_iter().find_map(|(k, value)| {
        if k >= n {
            Some(format!("there is no variable {k}, the problem has {n}"))
        } else if !value.is_finite() {
            Some(format!(
                "the coefficient of variable {k} is {value}; it must be finite"
            ))
        } else {
            None
        }
    })
}

/// Compressed columns of the entries (row, column, value), which come by rising row within each
/// column. Duplicates are summed, zeros left out. O(entries + columns).
pub(super) fn compress<I>(rows: usize, columns: usize, entries: impl Fn() -> I) -> CscMatrix<f64>
where
    I: Iterator<Item = (usize, usize, f64)>,
{
    let mut next = vec![0; columns + 1];
    entries().for_each(|(_, column, _)| next[column + 1] += 1);
    for column in 0..columns {
        next[column + 1] += next[column];
    }
    let starts = next.clone();
    let mut sorted = vec![(0, 0.0); starts[columns]];
    for (row, column, value) in entries() {
        sorted[next[column]] = (row, value);
        next[column] += 1;
    }
    let mut pointers = Vec::with_capacity(columns + 1);
    let (mut indices, mut values) = (
        Vec::with_capacity(sorted.len()),
        Vec::with_capacity(sorted.len()),
    );
    pointers.push(0);
    for column in starts.windows(2) {
        for same in sorted[column[0]..column[1]].chunk_by(|a, b| a.0 == b.0) {
            let sum: f64 = same.iter().map(|entry| entry.1).sum();
            if sum != 0.0 {
                indices.push(same[0].0);
                values.push(sum);
            }
        }
        pointers.push(indices.len());
    }
    CscMatrix::new(rows, columns, pointers, indices, values)
}
