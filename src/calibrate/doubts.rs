//! Rows that do not look like those of this robot.

use super::file::Calibration;
use super::frame::Frame;
use super::judge::Errors;
use crate::error::{Error, Result, Warning, WarningKind};

/// Rows whose joint readings no pose gives are left out, with a warning; too many of them are an error.
pub(super) fn unreached(
    input: &Calibration,
    poses: &[Option<Frame>],
    warnings: &mut Vec<Warning>,
) -> Result<()> {
    let lost: Vec<usize> = (0..poses.len()).filter(|&i| poses[i].is_none()).collect();
    let Some(&first) = lost.first() else {
        return Ok(());
    };
    let row = &input.rows[first];
    let file = &input.measurements[row.measurement].file;
    if 2 * lost.len() > poses.len() {
        return Err(Error::file(
            &input.path,
            format!("{file}, line {}", row.line),
            format!(
                "{} of {} rows have joint readings that no pose of the robot gives: are they in rad and m, in the \
                 order of the joints, and from zero where the file has it?",
                lost.len(),
                poses.len()
            ),
        ));
    }
    warnings.push(Warning::new(
        WarningKind::RowsLeftOut,
        file.clone(),
        format!(
            "{} rows have joint readings that no pose of this assembly mode gives; they were left out, the first in \
             line {}",
            lost.len(),
            row.line
        ),
    ));
    Ok(())
}

/// Warnings about rows that the nominal robot is far from.
pub(super) fn suspicious(input: &Calibration, before: &Errors, warnings: &mut Vec<Warning>) {
    for (m, measured) in input.measurements.iter().enumerate() {
        let own: Vec<f64> = input
            .rows
            .iter()
            .zip(&before.robust)
            .filter(|(r, _)| r.measurement == m)
            .map(|(_, e)| *e)
            .collect();
        let typical = crate::median::median(own.iter().copied());
        if typical > 0.05 {
            warnings.push(Warning::new(
                WarningKind::UnitSuspect,
                measured.file.clone(),
                format!(
                    "with the robot as in its file the frame is off by {} mm in the middle of its rows: are the \
                     joint readings radians, in the order of the joints, and is this the robot and the frame?",
                    crate::error::number((1e3 * typical).round())
                ),
            ));
        }
    }
}

/// Joints that hardly move from one fitted row to the next.
pub(super) fn unmoved(input: &Calibration, joints: &[String], warnings: &mut Vec<Warning>) {
    /// rad or m
    const LITTLE: f64 = 0.02;
    for (k, name) in joints.iter().enumerate() {
        let all = || input.rows.iter().filter(|r| r.fit).map(|r| r.q[k]);
        let range = all().fold(f64::NEG_INFINITY, f64::max) - all().fold(f64::INFINITY, f64::min);
        if range < LITTLE {
            warnings.push(Warning::new(
                WarningKind::JointNotMoving,
                name.clone(),
                format!(
                    "it moves by {} between the fitted rows: its errors cannot be told from those of its neighbours. \
                     Record postures that differ",
                    crate::error::number(range)
                ),
            ));
        }
    }
}
