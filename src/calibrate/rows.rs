//! Files of readings: CSV with or without a header.
//!
//! Without a header the columns are the joint readings, then those of [`Kind::columns`].

use super::cells::{lines, split};
use super::frame::Frame;
use super::kind::{Kind, Purpose};
use super::pixels::Solved;
use super::row::{Row, Source, Value};
use super::row_columns::Columns;
use super::row_doubts::Tally;
use crate::error::{Error, Result, Warning, number};
use nalgebra::{Matrix6, Quaternion, UnitQuaternion, Vector3};

/// A quaternion whose length differs from one by more was not normalised.
const QUATERNION: f64 = 1e-3;

/// Reads a file.
///
/// # Errors
/// No such file, no rows, cells that are no numbers, columns that are missing: with the line.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Vec<Row>> {
    let path = source.path;
    let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
    let mut lines = lines(&text).peekable();
    let Some((_, first)) = lines.peek() else {
        let empty = "the file is empty; it holds one posture a line";
        return Err(Error::file(path, "", empty));
    };
    let (columns, header) = Columns::of(source, split(first))?;
    if header {
        lines.next();
    }
    let mut rows = Vec::new();
    let mut tally = Tally::default();
    for (line, text) in lines {
        let cells = split(text);
        let row = Cells::new(source, &columns, line, &cells)?;
        rows.extend(row.read(&mut tally)?);
    }
    tally.judge(source, &rows, warnings)?;
    Ok(rows)
}

/// One line of a file.
struct Cells<'a> {
    source: &'a Source<'a>,
    columns: &'a Columns,
    line: usize,
    cells: &'a [String],
}

impl<'a> Cells<'a> {
    fn new(
        source: &'a Source,
        columns: &'a Columns,
        line: usize,
        cells: &'a [String],
    ) -> Result<Self> {
        let expected = columns.names.len();
        if cells.len() != expected {
            let message = format!("{} cells, the first line has {expected}", cells.len());
            return Err(source.bad(line, message));
        }
        Ok(Cells {
            source,
            columns,
            line,
            cells,
        })
    }

    fn bad(&self, message: impl Into<String>) -> Error {
        self.source.bad(self.line, message)
    }

    fn number(&self, at: usize) -> Result<f64> {
        match self.cells[at].parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(x),
            _ => Err(self.bad(format!(
                "`{}` in column {} is not a finite number",
                self.cells[at], self.columns.names[at]
            ))),
        }
    }

    fn numbers(&self, at: &[usize]) -> Result<Vec<f64>> {
        at.iter().map(|&at| self.number(at)).collect()
    }

    /// What was measured; points of a target that no picture shows are not numbers.
    fn measured(&self) -> Result<Vec<f64>> {
        let unseen = |at: usize| {
            self.source.optics.is_some() && matches!(self.cells[at].as_str(), "" | "nan" | "NaN")
        };
        let at = self.columns.value.iter();
        at.map(|&at| {
            if unseen(at) {
                Ok(f64::NAN)
            } else {
                self.number(at)
            }
        })
        .collect()
    }

    /// The posture; `None` if its picture tells no pose.
    fn read(&self, tally: &mut Tally) -> Result<Option<Row>> {
        let q = self.numbers(&self.columns.q)?;
        let v = self.measured()?;
        let solved = match self.source.optics.map(|o| o.solve(&v)) {
            None => None,
            Some(Ok(pose)) => Some(pose),
            Some(Err(why)) => {
                tally.lost.push((self.line, why));
                return Ok(None);
            }
        };
        if let Some(s) = solved {
            tally.mistaken += s.left_out;
            tally.rough.push(s.rms);
        }
        Ok(Some(Row {
            measurement: self.source.measurement,
            line: self.line,
            q,
            value: self.value(&v, solved, tally)?,
            covariance: self.covariance(solved)?,
            approach: self.numbers(&self.columns.approach)?,
            fit: self.purpose()? == Purpose::Fit,
        }))
    }

    fn value(&self, v: &[f64], solved: Option<Solved>, tally: &mut Tally) -> Result<Value> {
        Ok(match (self.source.kind, solved) {
            (Kind::Point | Kind::Plane | Kind::Loop | Kind::Ball, _) => Value::Contact,
            (Kind::Gauge, _) => Value::Reading(v[0]),
            (Kind::Position, _) => Value::Position(Vector3::new(v[0], v[1], v[2])),
            (Kind::Pose, Some(s)) => Value::Pose(s.pose),
            (Kind::Pose, None) => {
                let quaternion = Quaternion::new(v[3], v[4], v[5], v[6]);
                let length = quaternion.norm();
                if !(0.5..2.0).contains(&length) {
                    return Err(self.bad(format!(
                        "the quaternion (qw, qx, qy, qz) has length {}; it must be 1",
                        number(length)
                    )));
                }
                tally.unnormalised += usize::from((length - 1.0).abs() > QUATERNION);
                Value::Pose(Frame {
                    p: Vector3::new(v[0], v[1], v[2]),
                    r: *UnitQuaternion::from_quaternion(quaternion)
                        .to_rotation_matrix()
                        .matrix(),
                })
            }
        })
    }

    fn covariance(&self, solved: Option<Solved>) -> Result<Option<Matrix6<f64>>> {
        match (&self.columns.covariance, solved) {
            (_, Some(s)) => Ok(Some(s.covariance)),
            (Some(at), None) if self.source.kind == Kind::Pose => {
                let m = Matrix6::from_row_slice(&self.numbers(at)?);
                if (m - m.transpose()).amax() > 1e-6 * m.amax() || m.cholesky().is_none() {
                    return Err(self.bad(
                        "cov_11 … cov_66 are no covariance: not symmetric, or not positive definite",
                    ));
                }
                Ok(Some(m))
            }
            _ => Ok(None),
        }
    }

    /// What the row is for: as it says, else as its measurement says, else for the fit.
    fn purpose(&self) -> Result<Purpose> {
        match self.columns.purpose.map(|at| self.cells[at].as_str()) {
            None => Ok(self.source.purpose.unwrap_or(Purpose::Fit)),
            Some("fit") => Ok(Purpose::Fit),
            Some("holdout") => Ok(Purpose::Holdout),
            Some(other) => Err(self.bad(format!("use is `{other}`; it can be fit or holdout"))),
        }
    }
}
