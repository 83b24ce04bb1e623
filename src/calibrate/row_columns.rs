//! Which column of a file of readings is what.

use super::kind::Kind;
use super::row::Source;
use crate::error::{Error, Result};

/// Indices of columns.
pub struct Columns {
    /// name of each column
    pub names: Vec<String>,
    /// readings of the joints
    pub q: Vec<usize>,
    /// what was measured, in the order of [`Kind::columns`]
    pub value: Vec<usize>,
    /// sides that the joints came from; none, or one a joint
    pub approach: Vec<usize>,
    /// `fit` or `holdout`
    pub purpose: Option<usize>,
    /// 6 × 6 by rows
    pub covariance: Option<Vec<usize>>,
}

/// Columns of a kind of measurement.
fn wanted(source: &Source) -> Vec<String> {
    match source.optics {
        Some(o) => o.columns(),
        None => source
            .kind
            .columns()
            .iter()
            .map(|c| c.to_string())
            .collect(),
    }
}

/// `q1`, `q2` …
fn usual(source: &Source) -> Vec<String> {
    (1..=source.joints.len()).map(|k| format!("q{k}")).collect()
}

/// A column that is not there.
fn missing(source: &Source, name: &str) -> Error {
    let kind = match source.optics {
        Some(_) => "pixels",
        None => source.kind.name(),
    };
    let mut all = usual(source);
    all.extend(wanted(source));
    source.bad(
        1,
        format!(
            "column `{name}` is missing; a measurement of kind \"{kind}\" has {}",
            all.join(", ")
        ),
    )
}

impl Columns {
    /// From the first line, and whether that is a header.
    ///
    /// # Errors
    /// Columns that are missing, or are too many for the joints that lead to the frame.
    pub fn of(source: &Source, first: Vec<String>) -> Result<(Self, bool)> {
        let header = first.iter().any(|c| c.parse::<f64>().is_err());
        let names = match header {
            true => first,
            false => unnamed(source, first.len())?,
        };
        let find = |name: &str| names.iter().position(|c| c == name);
        let column = |name: &str| find(name).ok_or_else(|| missing(source, name));
        let n = source.joints.len();
        let mut q = Vec::with_capacity(n);
        for (joint, usual) in source.joints.iter().zip(usual(source)) {
            q.push(match find(joint) {
                Some(at) => at,
                None => column(&usual)?,
            });
        }
        if find(&format!("q{}", n + 1)).is_some() {
            let message = format!(
                "there is a column q{}, but {n} joints lead to the frame: {}",
                n + 1,
                source.joints.join(", ")
            );
            return Err(source.bad(1, message));
        }
        let value = wanted(source)
            .iter()
            .map(|c| column(c))
            .collect::<Result<_>>()?;
        let named: Vec<Option<usize>> = (0..36)
            .map(|k| find(&format!("cov_{}{}", k / 6 + 1, k % 6 + 1)))
            .collect();
        let covariance: Option<Vec<usize>> = named.iter().copied().collect();
        if source.kind == Kind::Pose && covariance.is_none() && named.iter().any(Option::is_some) {
            let message = "some of cov_11 … cov_66 are missing; give all 36 or none";
            return Err(source.bad(1, message));
        }
        let sides: Vec<Option<usize>> = (1..=n).map(|k| find(&format!("approach{k}"))).collect();
        let approach: Vec<usize> = sides.iter().flatten().copied().collect();
        if !approach.is_empty() && approach.len() < n {
            let message =
                format!("some of approach1 … approach{n} are missing; give one a joint or none");
            return Err(source.bad(1, message));
        }
        let purpose = find("use");
        let columns = Columns {
            names,
            q,
            value,
            approach,
            purpose,
            covariance,
        };
        Ok((columns, header))
    }
}

/// Names of the columns of a file without a header.
fn unnamed(source: &Source, count: usize) -> Result<Vec<String>> {
    let mut all = usual(source);
    all.extend(wanted(source));
    if count == all.len() {
        return Ok(all);
    }
    let message = format!(
        "{count} numbers a line and no header; expected are {} ({} joints: {})",
        all.join(", "),
        source.joints.len(),
        source.joints.join(", ")
    );
    Err(source.bad(1, message))
}
