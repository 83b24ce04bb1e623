//! Condensed records that add: what they share, and their triangles.
//!
//! Weights between actuators ask for all columns together, in one triangle of all records for the fit. The errors of
//! holdout records, and the folds of the cross-validation, ask for those of each actuator alone: a sixth of the numbers.

use super::linear;
use super::stack::Stack;
use crate::error::{Error, Result, Warning};
use crate::log::Purpose;
use faer::Mat;
use serde::{Deserialize, Serialize};

/// What factors that add must share, and what adds besides the factors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// the robot as it was named
    pub robot: String,
    /// SHA-256 of its files
    pub hash: String,
    /// joint columns that were asked for in place of those of the file
    pub identify: Option<Vec<String>>,
    /// names of the base parameters
    pub names: Vec<String>,
    /// cut-off of the filter, Hz
    pub cutoff: f64,
    /// whether periods were averaged, and velocities derived even where they were logged
    pub average: bool,
    #[allow(missing_docs)]
    pub derive: bool,
    /// what is imperfect in the records
    pub warnings: Vec<Warning>,
    /// by purpose: records for the fit, records that are only predicted
    pub parts: [Part; 2],
}

/// The records for one purpose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// names of the records
    pub records: Vec<String>,
    /// `[actuator, base parameter]` of each column; behind the last base parameter stands the torque
    pub columns: Vec<[usize; 2]>,
    /// number of factors, one a fold
    pub folds: usize,
    /// equations that count, by actuator
    pub used: Vec<f64>,
    /// largest measured torque, by actuator, N m or N
    pub largest: Vec<f64>,
    /// sum of the squares of the measured torque, by actuator
    pub energy: Vec<f64>,
    /// sum over the records of equations times variance through correlation in time
    pub inflated: f64,
}

/// Condensed records.
#[derive(Debug, Clone)]
pub struct Factor {
    /// all but the numbers
    pub header: Header,
    /// upper triangle of all columns of the records for the fit
    pub(super) together: Mat<f64>,
    /// by purpose and fold: upper triangles of the columns of each actuator
    pub(super) alone: [Vec<Vec<Mat<f64>>>; 2],
}

/// The columns of each actuator.
pub(super) fn columns_of(part: &Part, m: &Mat<f64>) -> Vec<Mat<f64>> {
    let of = |a: usize| {
        let mine: Vec<usize> = part.places(a).collect();
        Mat::from_fn(m.nrows(), mine.len(), |i, j| m[(i, mine[j])])
    };
    (0..part.used.len()).map(of).collect()
}

impl Part {
    /// Where the columns of an actuator stand.
    fn places(&self, actuator: usize) -> impl Iterator<Item = usize> {
        (0..self.columns.len()).filter(move |j| self.columns[*j][0] == actuator)
    }

    /// Number of columns of each actuator.
    pub(super) fn widths(&self) -> Vec<usize> {
        (0..self.used.len())
            .map(|a| self.places(a).count())
            .collect()
    }
}

/// A matrix with columns of `part` put among those of `all`, which has them and others, of one actuator or of all.
fn spread(m: &Mat<f64>, part: &[[usize; 2]], all: &[[usize; 2]]) -> Mat<f64> {
    let at: Vec<Option<usize>> = all
        .iter()
        .map(|c| part.iter().position(|o| o == c))
        .collect();
    Mat::from_fn(m.nrows(), all.len(), |i, j| {
        at[j].map_or(0.0, |k| m[(i, k)])
    })
}

/// Columns of one actuator.
fn only(columns: &[[usize; 2]], actuator: usize) -> Vec<[usize; 2]> {
    columns
        .iter()
        .copied()
        .filter(|c| c[0] == actuator)
        .collect()
}

impl Factor {
    /// Whether it holds the numbers of another.
    pub(super) fn same(&self, other: &Factor) -> bool {
        self.together.ncols() > 0 && self.together == other.together && self.alone == other.alone
    }

    /// Both together, as parts of one log: the first one's name stands for both. Of a warning that both have in other
    /// words the first one's are kept, which then says so.
    ///
    /// # Errors
    /// As [`Factor::with`].
    pub fn and_then(self, next: Factor) -> Result<Factor> {
        const LIKEWISE: &str = " (so in a part of the log, and likewise in others)";
        let first = self.header.warnings.len();
        let names = self.header.parts.each_ref().map(|p| p.records.clone());
        let mut both = self.with(next)?;
        let all = &mut both.header.warnings;
        for w in all.split_off(first) {
            let known = all[..first]
                .iter_mut()
                .find(|k| k.kind == w.kind && k.subject == w.subject);
            match known {
                None => all.push(w),
                Some(k) if k.message == w.message || k.message.ends_with(LIKEWISE) => {}
                Some(k) => k.message += LIKEWISE,
            }
        }
        for (part, names) in both.header.parts.iter_mut().zip(names) {
            if !names.is_empty() {
                part.records = names;
            }
        }
        Ok(both)
    }

    /// Both together.
    ///
    /// # Errors
    /// Factors of other robots, columns or filters.
    pub fn with(self, other: Factor) -> Result<Factor> {
        let (a, b) = (&self.header, &other.header);
        let differ = |what: &str, remedy: &str| {
            Err(Error::Infeasible(format!(
                "factors of {} and {} do not add: {what}; {remedy}",
                a.parts[0].records.join(", "),
                b.parts[0].records.join(", ")
            )))
        };
        if a.hash != b.hash || a.names != b.names {
            return differ(
                "they are of other robots or other parameters",
                "condense all with one robot file and one --identify",
            );
        }
        if a.cutoff != b.cutoff || a.average != b.average || a.derive != b.derive {
            return differ(
                &format!(
                    "their filters are at {} and {} Hz, or other settings differ",
                    a.cutoff, b.cutoff
                ),
                "condense all with one --cutoff",
            );
        }
        let mut header = self.header.clone();
        header
            .warnings
            .extend(other.header.warnings.iter().cloned());
        let mut alone = [Vec::new(), Vec::new()];
        for (p, out) in alone.iter_mut().enumerate() {
            let (x, y) = (&self.header.parts[p], &other.header.parts[p]);
            let mut columns: Vec<[usize; 2]> =
                x.columns.iter().chain(&y.columns).copied().collect();
            columns.sort_unstable();
            columns.dedup();
            for f in 0..x.folds.max(y.folds) {
                let of = |a: usize| {
                    let all = only(&columns, a);
                    let one = |part: &Part, each: &[Vec<Mat<f64>>]| {
                        let m = each.get(f)?.get(a)?;
                        Some(spread(m, &only(&part.columns, a), &all))
                    };
                    let both = [one(x, &self.alone[p]), one(y, &other.alone[p])];
                    linear::factor(&both.into_iter().flatten().collect::<Vec<_>>())
                };
                out.push((0..x.used.len().max(y.used.len())).map(of).collect());
            }
            let join = |x: &[f64], y: &[f64], f: fn(f64, f64) -> f64| -> Vec<f64> {
                let at = |v: &[f64], k: usize| v.get(k).copied().unwrap_or(0.0);
                (0..x.len().max(y.len()))
                    .map(|k| f(at(x, k), at(y, k)))
                    .collect()
            };
            let plus: fn(f64, f64) -> f64 = |x, y| x + y;
            header.parts[p] = Part {
                records: x.records.iter().chain(&y.records).cloned().collect(),
                folds: x.folds.max(y.folds),
                used: join(&x.used, &y.used, plus),
                largest: join(&x.largest, &y.largest, f64::max),
                energy: join(&x.energy, &y.energy, plus),
                inflated: x.inflated + y.inflated,
                columns,
            };
        }
        let columns = &header.parts[0].columns;
        let both = [(a, &self.together), (b, &other.together)]
            .map(|(h, m)| spread(m, &h.parts[0].columns, columns));
        Ok(Factor {
            together: linear::factor(&both),
            header,
            alone,
        })
    }

    /// The triangle of all records for the fit, as equations.
    pub(super) fn fitted(&self) -> Stack {
        self.equations(0, &columns_of(&self.header.parts[0], &self.together))
    }

    /// The triangles of each actuator alone, as equations by fold: 0 for the fit, 1 for holdout records. Rows of two
    /// actuators do not belong together.
    pub(super) fn folds(&self, purpose: usize) -> Vec<Stack> {
        let folds = &self.alone[purpose];
        folds.iter().map(|f| self.equations(purpose, f)).collect()
    }

    fn equations(&self, purpose: usize, of: &[Mat<f64>]) -> Stack {
        let known = self.header.names.len();
        let part = &self.header.parts[purpose];
        equations(part, [Purpose::Fit, Purpose::Holdout][purpose], known, of)
    }
}

/// Rows of each actuator of a part, with zeros below where others have more, for so many base parameters.
pub(super) fn equations(part: &Part, purpose: Purpose, b: usize, of: &[Mat<f64>]) -> Stack {
    let n = part.used.len();
    let count = of.iter().map(Mat::nrows).max().unwrap_or(0);
    let mut s = Stack {
        name: part.records.join(", "),
        purpose,
        actuators: n,
        count,
        rate: 0.0,
        stands_for: 1.0,
        time: Vec::new(),
        w: Mat::zeros(n * count, b),
        measured: vec![0.0; n * count],
        known: vec![0.0; n * count],
        left_out: vec![false; n * count],
    };
    for (a, m) in of.iter().enumerate() {
        for (j, [_, c]) in only(&part.columns, a).into_iter().enumerate() {
            for i in 0..m.nrows() {
                match c < b {
                    true => s.w[(a * count + i, c)] = m[(i, j)],
                    false => s.measured[a * count + i] = m[(i, j)],
                }
            }
        }
    }
    s
}
