//! Rows that do not look like those of this robot.

use super::file::Calibration;
use super::fit::Fit;
use super::frame::Frame;
use super::identifiable::Identifiability;
use super::judge::Errors;
use super::model::Model;
use super::open::Opened;
use super::result::{GroupResult, RowResult};
use crate::error::{Error, Result, Warning, WarningKind, agreeing, number};
use faer::Mat;

/// Warnings of the robot and of the files. What a calibration does not use is not worth a word.
pub(super) fn carried(input: &Calibration, opened: &Opened) -> Vec<Warning> {
    let used = |w: &&Warning| {
        !matches!(
            w.kind,
            WarningKind::InertiaMissing | WarningKind::LimitsMissing
        )
    };
    let of_robot = opened.plant.warnings().iter().filter(used);
    of_robot.chain(&input.warnings).cloned().collect()
}

/// Fewer than three rows for the fit are an error.
pub(super) fn too_few(input: &Calibration) -> Result<()> {
    let fitted = input.rows.iter().filter(|r| r.fit).count();
    if fitted >= 3 {
        return Ok(());
    }
    let message = format!(
        "{fitted} rows are for the fit; at least 3 are needed, and several times the unknowns are good"
    );
    Err(Error::file(&input.path, "", message))
}

/// A blurred border between what can be told and what cannot; fewer numbers than unknowns.
pub(super) fn determined(model: &Model, known: &Identifiability, warnings: &mut Vec<Warning>) {
    if known.gap < 1e3 && known.rank < known.total {
        let message = format!(
            "the border between what can be told and what cannot is blurred (gap {})",
            number(known.gap)
        );
        let kind = WarningKind::RankGap;
        warnings.push(Warning::new(kind, "identifiability", message));
    }
    let rows = &model.input.rows;
    let fitted = (0..rows.len()).filter(|&i| rows[i].fit);
    let residuals: usize = fitted.map(|i| model.residuals(i)).sum();
    if residuals < known.total {
        let message = format!(
            "{residuals} numbers were measured for {} unknowns; tolerances decide the rest. Record more postures",
            known.total
        );
        warnings.push(Warning::new(WarningKind::NotExcited, "rows", message));
    }
}

/// A fit that was still moving when it was ended.
pub(super) fn unsettled(fit: &Fit, warnings: &mut Vec<Warning>) {
    if !fit.converged {
        let message = format!(
            "it did not come to rest within {} steps; the result is where it stood",
            fit.steps
        );
        warnings.push(Warning::new(WarningKind::NotExcited, "fit", message));
    }
}

/// Standard deviations that cannot be had.
pub(super) fn uncertain(covariance: Option<&Mat<f64>>, warnings: &mut Vec<Warning>) {
    if covariance.is_none() {
        warnings.push(Warning::new(
            WarningKind::NotIdentifiable,
            "uncertainty",
            "the information matrix has no inverse; standard deviations are not known",
        ));
    }
}

/// Groups that were spoiled while they were recorded.
pub(super) fn spoiled(groups: &[GroupResult], warnings: &mut Vec<Warning>) {
    for g in groups.iter().filter(|g| g.spoiled) {
        let message = format!(
            "its errors are out of proportion to those of all other groups (mean {} mm): it was spoiled while it \
             was recorded, a socket or camera moved, say. It is not counted among the sound ones",
            number(1e3 * g.after.map_or(f64::NAN, |s| s.mean))
        );
        let kind = WarningKind::RecordLeftOut;
        warnings.push(Warning::new(kind, g.name.clone(), message));
    }
}

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
                 order of the joints, from zero where the file has it, and is this the assembly mode of the robot?",
                lost.len(),
                poses.len()
            ),
        ));
    }
    warnings.push(Warning::new(
        WarningKind::RowsLeftOut,
        file.clone(),
        format!(
            "{} joint readings that no pose of this assembly mode gives: left out, the first in line {}",
            agreeing(lost.len(), "row has", "rows have"),
            row.line
        ),
    ));
    Ok(())
}

/// Errors that stay in the middle of the rows of a file, m, from which on nothing was identified,
const HOPELESS: f64 = 0.05;
/// unless so many standard deviations of the stated noise are more.
const NOISY: f64 = 3.0;

/// Rows that no geometry near that of the file explains are an error: what would be written is no robot.
pub(super) fn hopeless(input: &Calibration, after: &Errors) -> Result<()> {
    for (m, measured) in input.measurements.iter().enumerate() {
        let rows = input.rows.iter().zip(&after.robust);
        let own: Vec<f64> = rows
            .filter(|(r, _)| r.measurement == m && r.fit)
            .map(|(_, e)| *e)
            .collect();
        let typical = crate::median::median(own.iter().copied());
        let stated = match input.noise_stated {
            true => NOISY * measured.std[0],
            false => 0.0,
        };
        if typical > HOPELESS.max(stated) {
            return Err(Error::file(
                &input.path,
                measured.file.clone(),
                format!(
                    "no geometry near that of the robot file explains these rows: {} mm are left in the middle of them. Are the \
                     joint readings in rad and in the order of the joints, is a target or an axis mirrored, and is this the robot, \
                     its assembly mode, and the frame?",
                    number((1e3 * typical).round())
                ),
            ));
        }
    }
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

/// Sound rows from which on their middle says which robot is the better one.
const ENOUGH: usize = 5;

/// A robot that fits its rows no better than that of the file.
pub(super) fn worse(rows: &[RowResult], warnings: &mut Vec<Warning>) {
    for (fit, name) in [(true, "rows that were fitted"), (false, "rows held out")] {
        let own = || rows.iter().filter(|r| r.fit == fit && !r.outlier);
        if own().count() < ENOUGH {
            continue;
        }
        let [before, after] = [
            crate::median::median(own().map(|r| r.before)),
            crate::median::median(own().map(|r| r.after)),
        ];
        if after > before {
            let message = format!(
                "the calibrated robot is no better here than that of the file: {} mm in the middle of them, {} mm before. \
                 Keep that of the file. Postures are too few or too alike, or rows are not what they are said to be",
                number((1e6 * after).round() / 1e3),
                number((1e6 * before).round() / 1e3)
            );
            warnings.push(Warning::new(WarningKind::NotExcited, name, message));
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
