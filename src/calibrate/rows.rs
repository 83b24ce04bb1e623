//! Files of readings: CSV with or without a header.
//!
//! Without a header the columns are the joint readings, then those of [`Kind::columns`].

use super::cells::{lines, split};
use super::frame::Frame;
use super::kind::{Kind, Purpose};
use super::pixels::Optics;
use crate::error::{Error, Result, Warning, WarningKind};
use nalgebra::{Matrix6, Quaternion, UnitQuaternion, Vector3};
use std::path::Path;

/// What an instrument said of one posture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// the robot was held by what it touched
    Contact,
    /// point in the tracker's frame, m
    Position(Vector3<f64>),
    /// target in the camera's frame
    Pose(Frame),
    /// dial gauge, m
    Reading(f64),
}

/// One posture.
#[derive(Debug, Clone)]
pub struct Row {
    /// index of its measurement
    pub measurement: usize,
    /// line in the file
    pub line: usize,
    /// joint readings, rad or m
    pub q: Vec<f64>,
    /// what was measured
    pub value: Value,
    /// of position (m) and rotation vector (rad) in the camera's axes
    pub covariance: Option<Matrix6<f64>>,
    /// whether unknowns are identified with it
    pub fit: bool,
}

/// A quaternion whose length differs from one by more was not normalised.
const QUATERNION: f64 = 1e-3;
/// Joint angles beyond this many radians are suspected to be degrees.
const TURNS: f64 = 7.0;
/// Positions beyond this many metres are suspected to be millimetres.
const FAR: f64 = 30.0;

/// Deviation that poses leave of pictures, in stated standard deviations, beyond which the camera is doubted.
const ROUGH: f64 = 2.0;

/// Reads a file.
///
/// # Errors
/// No such file, no rows, cells that are no numbers, columns that are missing: with the line.
pub fn read(
    path: &Path,
    kind: Kind,
    optics: Option<&Optics>,
    joints: &[String],
    measurement: usize,
    purpose: Option<Purpose>,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<Row>> {
    let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
    let bad = |line: usize, message: String| Error::file(path, format!("line {line}"), message);
    let mut lines = lines(&text).peekable();
    let Some((_, first)) = lines.peek() else {
        return Err(Error::file(
            path,
            "",
            "the file is empty; it holds one posture a line",
        ));
    };
    let cells = split(first);
    let header = cells.iter().any(|c| c.parse::<f64>().is_err());
    let n = joints.len();
    let wanted: Vec<String> = match optics {
        Some(o) => o.columns(),
        None => kind.columns().iter().map(|c| c.to_string()).collect(),
    };
    let usual = || (1..=n).map(|k| format!("q{k}"));
    let names: Vec<String> = match header {
        true => {
            lines.next();
            cells
        }
        false => {
            let all: Vec<String> = usual().chain(wanted.iter().cloned()).collect();
            if cells.len() != all.len() {
                return Err(bad(
                    1,
                    format!(
                        "{} numbers a line and no header; expected are {} ({} joints: {})",
                        cells.len(),
                        all.join(", "),
                        n,
                        joints.join(", ")
                    ),
                ));
            }
            all
        }
    };
    let find = |name: &str| names.iter().position(|c| c == name);
    let column = |name: &str| {
        find(name).ok_or_else(|| {
            bad(
                1,
                format!(
                    "column `{name}` is missing; a measurement of kind \"{}\" has {}{}",
                    if optics.is_some() {
                        "pixels"
                    } else {
                        kind.name()
                    },
                    usual().collect::<Vec<_>>().join(", "),
                    wanted.iter().map(|c| format!(", {c}")).collect::<String>()
                ),
            )
        })
    };
    let mut q_at = Vec::new();
    for (k, joint) in joints.iter().enumerate() {
        q_at.push(match find(joint) {
            Some(at) => at,
            None => column(&format!("q{}", k + 1))?,
        });
    }
    let extra = find(&format!("q{}", n + 1));
    if extra.is_some() {
        return Err(bad(
            1,
            format!(
                "there is a column q{}, but {n} joints lead to the frame: {}",
                n + 1,
                joints.join(", ")
            ),
        ));
    }
    let mut value_at = Vec::new();
    for c in &wanted {
        value_at.push(column(c)?);
    }
    let use_at = find("use");
    let named: Vec<Option<usize>> = (0..36)
        .map(|k| find(&format!("cov_{}{}", k / 6 + 1, k % 6 + 1)))
        .collect();
    let cov_at: Option<Vec<usize>> = named.iter().copied().collect();
    if kind == Kind::Pose && cov_at.is_none() && named.iter().any(Option::is_some) {
        return Err(bad(
            1,
            "some of cov_11 … cov_66 are missing; give all 36 or none".into(),
        ));
    }
    let mut rows = Vec::new();
    let mut unnormalised = 0;
    let (mut lost, mut mistaken, mut rough) = (Vec::new(), 0, Vec::new());
    for (line, text) in lines {
        let cells = split(text);
        if cells.len() != names.len() {
            return Err(bad(
                line,
                format!("{} cells, the first line has {}", cells.len(), names.len()),
            ));
        }
        let number = |at: usize| match cells[at].parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(x),
            _ => Err(bad(
                line,
                format!(
                    "`{}` in column {} is not a finite number",
                    cells[at], names[at]
                ),
            )),
        };
        let q = q_at
            .iter()
            .map(|&at| number(at))
            .collect::<Result<Vec<_>>>()?;
        let unseen =
            |at: usize| optics.is_some() && matches!(cells[at].as_str(), "" | "nan" | "NaN");
        let v = value_at
            .iter()
            .map(|&at| if unseen(at) { Ok(f64::NAN) } else { number(at) })
            .collect::<Result<Vec<_>>>()?;
        let solved = match optics.map(|o| o.solve(&v)) {
            None => None,
            Some(Ok(pose)) => Some(pose),
            Some(Err(why)) => {
                lost.push((line, why));
                continue;
            }
        };
        if let Some(s) = solved {
            mistaken += s.left_out;
            rough.push(s.rms);
        }
        let value = match (kind, solved) {
            (Kind::Point | Kind::Plane, _) => Value::Contact,
            (Kind::Gauge, _) => Value::Reading(v[0]),
            (Kind::Position, _) => Value::Position(Vector3::new(v[0], v[1], v[2])),
            (Kind::Pose, Some(s)) => Value::Pose(s.pose),
            (Kind::Pose, None) => {
                let quaternion = Quaternion::new(v[3], v[4], v[5], v[6]);
                let length = quaternion.norm();
                if !(0.5..2.0).contains(&length) {
                    return Err(bad(
                        line,
                        format!(
                            "the quaternion (qw, qx, qy, qz) has length {}; it must be 1",
                            crate::error::number(length)
                        ),
                    ));
                }
                unnormalised += usize::from((length - 1.0).abs() > QUATERNION);
                Value::Pose(Frame {
                    p: Vector3::new(v[0], v[1], v[2]),
                    r: *UnitQuaternion::from_quaternion(quaternion)
                        .to_rotation_matrix()
                        .matrix(),
                })
            }
        };
        let covariance = match (&cov_at, solved) {
            (_, Some(s)) => Some(s.covariance),
            (Some(at), None) if kind == Kind::Pose => {
                let c = at.iter().map(|&a| number(a)).collect::<Result<Vec<_>>>()?;
                let m = Matrix6::from_row_slice(&c);
                if (m - m.transpose()).amax() > 1e-6 * m.amax() || m.cholesky().is_none() {
                    return Err(bad(
                        line,
                        "cov_11 … cov_66 are no covariance: not symmetric, or not positive definite".into(),
                    ));
                }
                Some(m)
            }
            _ => None,
        };
        let own = match use_at.map(|at| cells[at].as_str()) {
            None => None,
            Some("fit") => Some(Purpose::Fit),
            Some("holdout") => Some(Purpose::Holdout),
            Some(other) => {
                return Err(bad(
                    line,
                    format!("use is `{other}`; it can be fit or holdout"),
                ));
            }
        };
        rows.push(Row {
            measurement,
            line,
            q,
            value,
            covariance,
            fit: own.or(purpose).unwrap_or(Purpose::Fit) == Purpose::Fit,
        });
    }
    if let (true, Some((line, why))) = (lost.len() > rows.len(), lost.first()) {
        return Err(bad(
            *line,
            format!(
                "{why}; so are {} of {} pictures: are camera, target and the order of its points right?",
                lost.len(),
                lost.len() + rows.len()
            ),
        ));
    }
    if rows.is_empty() {
        return Err(Error::file(
            path,
            "",
            "it has a header and no rows under it",
        ));
    }
    let subject = path.display().to_string();
    let mut warn =
        |kind, message: String| warnings.push(Warning::new(kind, subject.clone(), message));
    if let Some((line, why)) = lost.first() {
        warn(
            WarningKind::RowsLeftOut,
            format!(
                "{} of {} pictures tell no pose and were left out, the first in line {line}: {why}",
                lost.len(),
                lost.len() + rows.len()
            ),
        );
    }
    if let Some(o) = optics
        && crate::median::median(rough.iter().copied()) > ROUGH * o.std
    {
        warn(
            WarningKind::UnitSuspect,
            format!(
                "poses leave {} pixels of the points, {} are stated: camera or target are not quite those of the pictures, \
                 and what follows from them is worse than it says",
                crate::error::number(crate::median::median(rough.iter().copied())),
                crate::error::number(o.std)
            ),
        );
    }
    if mistaken > 0 {
        warn(
            WarningKind::RowsLeftOut,
            format!(
                "{mistaken} points of the target are seen where it has none, by more than five standard deviations; \
                 they were left out"
            ),
        );
    }
    if unnormalised > 0 {
        warn(
            WarningKind::UnitSuspect,
            format!(
                "quaternions of {unnormalised} of {} rows are not of length one; they were normalised",
                rows.len()
            ),
        );
    }
    let turned = |r: &Row| r.q.iter().any(|q| q.abs() > TURNS);
    if rows.iter().filter(|r| turned(r)).count() * 2 > rows.len() {
        warn(
            WarningKind::UnitSuspect,
            format!("joint readings go beyond {TURNS} rad; are they degrees? They are read as rad"),
        );
    }
    let far = |r: &Row| match r.value {
        Value::Position(p) => p.norm() > FAR,
        Value::Pose(f) => f.p.norm() > FAR,
        Value::Reading(x) => x.abs() > 0.1,
        Value::Contact => false,
    };
    if rows.iter().filter(|r| far(r)).count() * 2 > rows.len() {
        warn(
            WarningKind::UnitSuspect,
            "measured lengths are very large; are they millimetres? They are read as m".into(),
        );
    }
    Ok(rows)
}
