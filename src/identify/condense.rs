//! A record as a triangular factor that adds by QR and gives the same estimate.
//!
//! Weighted least squares asks of a record for sums of products of its equations, of one actuator and of two: those of
//! two make the covariance of the residual, which is known only when all records are there. So the equations of all
//! actuators at a sample stand side by side in one row:
//!
//! ```text
//! v_k = [w_1 τ_1 … w_n τ_n]_k        w_a: row of W_b of actuator a, its columns that are not zero
//! [v_1; v_2; …] = Q R                Σ_k v_kᵀ v_k = Rᵀ R
//! [R'; R''] = Q R                    records together
//! ```
//!
//! The rows of `R` are as good as samples: any weights, residual and base parameters that are made of sums of products
//! come out of them as of the samples. One factor for each of the contiguous parts that the cross-validation of the
//! prior leaves out in turn.

use super::breakaway;
use super::cross_validation::FOLDS;
use super::equations::{self, Equations};
use super::linear;
use super::method::{self, Estimate};
use super::settings::{Method, Settings};
use super::stack::Stack;
use super::uncertainty;
use crate::base::BaseParameters;
use crate::error::{Error, Result, Warning, WarningKind};
use crate::log::{Purpose, Record};
use crate::plant::Plant;
use faer::Mat;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// First bytes of a file.
const MAGIC: &[u8] = b"excite factor 1\n";
/// Rows that are factored at once, over the columns.
const CHUNK: usize = 4;
/// Most columns of a factor.
const MOST: usize = 20_000;

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
    /// upper triangles by purpose and fold
    folds: [Vec<Mat<f64>>; 2],
}

/// Condenses records, those for the fit and the holdout ones apart.
///
/// Joints that stand still are left out as in [`identify`](super::identify), and what goes with another joint is fitted
/// aside where these records show it. The warnings go with the factor.
///
/// # Errors
/// As [`identify`](super::identify).
pub fn condense(
    plant: &Plant,
    spec: &str,
    asked: Option<&[String]>,
    records: &[Record],
    settings: &Settings,
) -> Result<Factor> {
    let mut warnings = Vec::new();
    if !breakaway::asked(plant).is_empty() {
        warnings.push(Warning::new(
            WarningKind::NotIdentifiable,
            "breakaway friction",
            "it is asked for, but it is not linear and no factor holds it: identify it from the logs themselves",
        ));
    }
    let records = equations::usable(records, &mut warnings)?;
    let settings = equations::one_filter(&records, settings);
    of_records(
        plant,
        &plant.base()?,
        spec,
        asked,
        records,
        &settings,
        warnings,
    )
}

/// The same of records without payload, for the fit or not, with a cut-off that is chosen.
///
/// # Errors
/// As [`condense`].
pub(super) fn of_records(
    plant: &Plant,
    base: &BaseParameters,
    spec: &str,
    asked: Option<&[String]>,
    records: Vec<&Record>,
    settings: &Settings,
    mut warnings: Vec<Warning>,
) -> Result<Factor> {
    let all = Equations::new(plant, base, &settings.signals, records)?;
    warnings.extend(all.prepared.iter().flat_map(|p| p.warnings.clone()));
    let mut fitted: Vec<Stack> = Vec::new();
    let mut alone = None;
    if all.records.iter().any(|r| r.purpose == Purpose::Fit) {
        let mut fit = all.fit()?;
        warnings.extend(fit.unit_suspicions());
        fit.keep_moving(&mut warnings)?;
        let found = method::estimate(&mut fit, Method::Wls, &mut warnings)?;
        // the estimate from all records is that of the only one
        alone = (all.records.len() == 1).then_some(found);
        fitted = fit.into_stacks();
    }
    let others: Vec<Stack> = all
        .stacks
        .iter()
        .filter(|s| s.purpose != Purpose::Fit)
        .cloned()
        .collect();
    let (mut a, folds) = part(&fitted, FOLDS)?;
    for s in &fitted {
        a.inflated += s.equations() as f64 * inflation(s, alone.take())?;
    }
    let (b, tests) = part(&others, 1)?;
    let header = Header {
        robot: spec.into(),
        hash: plant.robot().hash.clone(),
        identify: asked.map(<[String]>::to_vec),
        names: (0..base.count())
            .map(|k| base.name(k).to_string())
            .collect(),
        cutoff: settings.signals.cutoff.unwrap_or(f64::NAN),
        average: settings.signals.average,
        derive: !settings.signals.measured_rates,
        warnings,
        parts: [a, b],
    };
    Ok(Factor {
        header,
        folds: [folds, tests],
    })
}

fn part(stacks: &[Stack], folds: usize) -> Result<(Part, Vec<Mat<f64>>)> {
    let n = stacks.first().map_or(0, |s| s.actuators);
    let b = stacks.first().map_or(0, |s| s.w.ncols());
    let right: Vec<Vec<f64>> = stacks.iter().map(Stack::tau).collect();
    let mut columns = Vec::new();
    for a in 0..n {
        for c in 0..b {
            let holds = |s: &Stack| (a * s.count..(a + 1) * s.count).any(|i| s.w[(i, c)] != 0.0);
            if stacks.iter().any(holds) {
                columns.push([a, c]);
            }
        }
        columns.push([a, b]);
    }
    let k = columns.len();
    let row = |r: usize, at: usize, j: usize| {
        let (s, [a, c]) = (&stacks[r], columns[j]);
        let i = a * s.count + at;
        if c < b { s.w[(i, c)] } else { right[r][i] }
    };
    let mut out = Vec::new();
    for f in 0..folds {
        let mut sum = Mat::<f64>::zeros(k, k);
        for (r, s) in stacks.iter().enumerate() {
            let (from, to) = (f * s.count / folds, (f + 1) * s.count / folds);
            for start in (from..to).step_by((CHUNK * k).max(1)) {
                let count = (CHUNK * k).min(to - start);
                let rows = Mat::from_fn(count, k, |i, j| row(r, start + i, j));
                sum = linear::factor(&[sum, rows]);
            }
        }
        out.push(sum);
    }
    let sums = |f: &dyn Fn(&Stack, usize) -> f64, join: fn(f64, f64) -> f64| -> Vec<f64> {
        let each = |a: usize| stacks.iter().map(|s| f(s, a)).fold(0.0, join);
        (0..n).map(each).collect()
    };
    let torque = |s: &Stack, a: usize| s.measured[a * s.count..(a + 1) * s.count].to_vec();
    let part = Part {
        records: stacks.iter().map(|s| s.name.clone()).collect(),
        columns,
        folds,
        used: sums(&|s, a| s.used(a) as f64, |x, y| x + y),
        largest: sums(
            &|s, a| torque(s, a).iter().fold(0.0, |m: f64, x| m.max(x.abs())),
            f64::max,
        ),
        energy: sums(&|s, a| torque(s, a).iter().map(|x| x * x).sum(), |x, y| {
            x + y
        }),
        inflated: 0.0,
    };
    Ok((part, out))
}

/// Variance through correlation in time of a record alone, whose estimate may be known.
fn inflation(stack: &Stack, known: Option<Estimate>) -> Result<f64> {
    let one = [stack];
    let estimate = match known {
        Some(estimate) => estimate,
        None => method::of_stacks(&one, Method::Wls)?,
    };
    let factor = linear::factor(&linear::fold_factors(&one, &estimate.weights, 1));
    let r = linear::solve(factor.as_ref())?.r;
    let found = uncertainty::covariance(&one, &estimate.weights, &estimate.pi, r.as_ref())?;
    Ok(found.inflation.max(1.0))
}

impl Factor {
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
        let mut folds = [Vec::new(), Vec::new()];
        for (p, out) in folds.iter_mut().enumerate() {
            let (x, y) = (&self.header.parts[p], &other.header.parts[p]);
            let mut columns: Vec<[usize; 2]> =
                x.columns.iter().chain(&y.columns).copied().collect();
            columns.sort_unstable();
            columns.dedup();
            let spread = |part: &Part, m: &Mat<f64>| {
                let at: Vec<Option<usize>> = columns
                    .iter()
                    .map(|c| part.columns.iter().position(|o| o == c))
                    .collect();
                Mat::from_fn(m.nrows(), columns.len(), |i, j| {
                    at[j].map_or(0.0, |k| m[(i, k)])
                })
            };
            for f in 0..x.folds.max(y.folds) {
                let of = |part: &Part, all: &[Mat<f64>]| all.get(f).map(|m| spread(part, m));
                let both = [of(x, &self.folds[p]), of(y, &other.folds[p])];
                let both: Vec<Mat<f64>> = both.into_iter().flatten().collect();
                out.push(linear::factor(&both));
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
        Ok(Factor { header, folds })
    }

    /// The rows of the factors as equations, fold by fold: 0 for the fit, 1 for holdout records.
    pub(super) fn stacks(&self, purpose: usize) -> Vec<Stack> {
        let part = &self.header.parts[purpose];
        let (n, b) = (part.used.len(), self.header.names.len());
        let of = |m: &Mat<f64>| {
            let count = m.nrows();
            let mut s = Stack {
                name: part.records.join(", "),
                purpose: [Purpose::Fit, Purpose::Holdout][purpose],
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
            for (j, &[a, c]) in part.columns.iter().enumerate() {
                for i in 0..count {
                    match c < b {
                        true => s.w[(a * count + i, c)] = m[(i, j)],
                        false => s.measured[a * count + i] = m[(i, j)],
                    }
                }
            }
            s
        };
        self.folds[purpose].iter().map(of).collect()
    }

    /// As bytes of a file: a line, a line of JSON, then the upper triangles row by row in little-endian doubles.
    ///
    /// # Errors
    /// Numbers that are not finite.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let mut out = MAGIC.to_vec();
        let text =
            serde_json::to_string(&self.header).map_err(|e| Error::Infeasible(e.to_string()))?;
        out.extend(text.as_bytes());
        out.push(b'\n');
        for m in self.folds.iter().flatten() {
            for i in 0..m.nrows() {
                for j in i..m.ncols() {
                    if !m[(i, j)].is_finite() {
                        return Err(Error::Infeasible(
                            "the equations hold numbers that are not finite".into(),
                        ));
                    }
                    out.extend(m[(i, j)].to_le_bytes());
                }
            }
        }
        Ok(out)
    }

    /// From the bytes of a file; `path` is what errors call it.
    ///
    /// # Errors
    /// Bytes that are no such file, cut off or damaged.
    pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<Factor> {
        let wrong = |why: &str| {
            Error::file(
                path,
                "",
                format!("{why}; write it again with `excite condense`"),
            )
        };
        let rest = bytes
            .strip_prefix(MAGIC)
            .ok_or_else(|| wrong("it is no factor of this version"))?;
        let end = rest.iter().position(|b| *b == b'\n');
        let end = end.ok_or_else(|| wrong("it is cut off"))?;
        let header: Header = serde_json::from_slice(&rest[..end])
            .map_err(|e| wrong(&format!("its header is damaged ({e})")))?;
        let b = header.names.len();
        let n = header.parts.iter().map(|p| p.used.len()).max().unwrap_or(0);
        for p in &header.parts {
            let fits = p.columns.len() <= MOST
                && p.folds <= FOLDS
                && p.columns.iter().all(|[a, c]| *a < p.used.len() && *c <= b)
                && p.columns.is_sorted()
                && [&p.largest, &p.energy]
                    .iter()
                    .all(|v| v.len() == p.used.len())
                && (p.used.is_empty() || p.used.len() == n);
            if !fits {
                return Err(wrong("its header is damaged"));
            }
        }
        let mut numbers = rest[end + 1..].chunks_exact(8).map(|c| {
            let mut bytes = [0u8; 8];
            bytes.copy_from_slice(c);
            f64::from_le_bytes(bytes)
        });
        let sizes = header
            .parts
            .iter()
            .map(|p| p.folds * p.columns.len() * (p.columns.len() + 1) / 2);
        if rest.len() - end - 1 != 8 * sizes.sum::<usize>() {
            return Err(wrong("it is cut off"));
        }
        let mut folds = [Vec::new(), Vec::new()];
        for (p, out) in header.parts.iter().zip(&mut folds) {
            let k = p.columns.len();
            for _ in 0..p.folds {
                let mut m = Mat::<f64>::zeros(k, k);
                for i in 0..k {
                    for j in i..k {
                        let x = numbers.next().filter(|x| x.is_finite());
                        m[(i, j)] = x.ok_or_else(|| wrong("a number in it is not finite"))?;
                    }
                }
                out.push(m);
            }
        }
        Ok(Factor { header, folds })
    }
}
