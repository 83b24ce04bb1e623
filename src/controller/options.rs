//! What may be chosen for a file, and whether its format has such a choice.

use super::course::Channel;
use super::{Choice, Format};
use crate::error::{Error, Result};
use crate::robot::Motion;
use std::f64::consts::PI;

/// A column, or one for each joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Column {
    /// time, s
    T,
    /// positions
    Q,
    /// velocities
    Dq,
    /// accelerations
    Ddq,
}

impl Column {
    /// All, in the usual order.
    pub const ALL: [Column; 4] = [Column::T, Column::Q, Column::Dq, Column::Ddq];

    /// As on the command line and in headers.
    pub fn name(self) -> &'static str {
        match self {
            Column::T => "t",
            Column::Q => "q",
            Column::Dq => "dq",
            Column::Ddq => "ddq",
        }
    }

    /// The column of this name.
    ///
    /// # Errors
    /// [`Error::Argument`] with the names there are.
    pub fn parse(name: &str) -> Result<Self> {
        let found = Column::ALL.into_iter().find(|c| c.name() == name);
        found.ok_or_else(|| {
            Error::Argument(format!("--columns knows t, q, dq and ddq, not `{name}`"))
        })
    }
}

/// A unit of joints that turn, or of joints that slide.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// radian
    Rad,
    /// degree
    Deg,
    /// metre
    M,
    /// millimetre
    Mm,
}

impl Unit {
    /// The unit of this name.
    ///
    /// # Errors
    /// [`Error::Argument`] with the names there are.
    pub fn parse(name: &str) -> Result<Self> {
        match name {
            "rad" => Ok(Unit::Rad),
            "deg" => Ok(Unit::Deg),
            "m" => Ok(Unit::M),
            "mm" => Ok(Unit::Mm),
            _ => Err(Error::Argument(format!(
                "--unit knows rad, deg, m and mm, not `{name}`"
            ))),
        }
    }
}

/// What may be chosen.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// samples a second; chosen from the deviation where absent
    pub rate: Option<f64>,
    /// names of the joints to be sent, in this order; all in the robot's order where absent
    pub joints: Option<Vec<String>>,
    /// columns, in this order; all where absent
    pub columns: Option<Vec<Column>>,
    /// units; rad and m where absent
    pub units: Vec<Unit>,
    /// a program begins with a slow move to the start
    pub move_to_start: bool,
}

pub(super) fn unknown(format: &dyn Format, option: &str) -> Error {
    Error::Argument(format!(
        "{option} means nothing to the format {}; leave it out",
        format.card().name
    ))
}

/// The joints that are sent, and their places among all.
pub(super) fn select(
    all: &[Channel],
    names: Option<&[String]>,
) -> Result<(Vec<Channel>, Vec<usize>)> {
    let Some(names) = names else {
        return Ok((all.to_vec(), (0..all.len()).collect()));
    };
    let mut order = Vec::new();
    for name in names {
        let Some(at) = all.iter().position(|c| c.name == *name) else {
            let list: Vec<&str> = all.iter().map(|c| c.name.as_str()).collect();
            return Err(Error::Argument(format!(
                "--joints: there is no joint `{name}`; there are {}",
                list.join(", ")
            )));
        };
        if order.contains(&at) {
            return Err(Error::Argument(format!(
                "--joints: `{name}` is there twice"
            )));
        }
        order.push(at);
    }
    Ok((order.iter().map(|&j| all[j].clone()).collect(), order))
}

/// Whether the controller has such joints.
pub(super) fn fits(format: &dyn Format, joints: &[Channel]) -> Result<()> {
    let card = format.card();
    let Some((least, most)) = card.joints else {
        return Ok(());
    };
    if !(least..=most).contains(&joints.len()) {
        let wanted = match least == most {
            true => format!("{least}"),
            false => format!("{least} to {most}"),
        };
        let names: Vec<&str> = joints.iter().map(|c| c.name.as_str()).collect();
        return Err(Error::Infeasible(format!(
            "{} takes {wanted} joints, the motion has {} ({}); name those of the arm with --joints, or use \
             another format",
            card.name,
            joints.len(),
            names.join(", ")
        )));
    }
    match joints.iter().find(|c| c.motion == Some(Motion::Prismatic)) {
        Some(joint) => Err(Error::Infeasible(format!(
            "{} takes joints that turn, {} slides; use another format",
            card.name, joint.name
        ))),
        None => Ok(()),
    }
}

pub(super) fn columns(format: &dyn Format, options: &Options) -> Result<Vec<Column>> {
    let choice = format.card().choice;
    let Some(columns) = &options.columns else {
        return Ok(Column::ALL.to_vec());
    };
    if choice == Choice::None {
        return Err(unknown(format, "--columns"));
    }
    if (1..columns.len()).any(|i| columns[..i].contains(&columns[i])) {
        return Err(Error::Argument("--columns: a column is there twice".into()));
    }
    let has = |c| columns.contains(&c);
    if !has(Column::Q) || (choice == Choice::Derivatives && has(Column::Ddq) && !has(Column::Dq)) {
        return Err(Error::Argument(match choice {
            Choice::Derivatives => "--columns: positions (q), with velocities (q,dq), or with \
                                    accelerations too (q,dq,ddq)"
                .into(),
            _ => "--columns: positions (q) are needed".into(),
        }));
    }
    Ok(columns.clone())
}

/// Factors from rad or m to the units that are asked for.
pub(super) fn scales(format: &dyn Format, joints: &[Channel], units: &[Unit]) -> Result<Vec<f64>> {
    if !units.is_empty() && format.card().choice != Choice::Columns {
        return Err(unknown(format, "--unit"));
    }
    let has = |u| units.contains(&u);
    if (has(Unit::Rad) && has(Unit::Deg)) || (has(Unit::M) && has(Unit::Mm)) {
        return Err(Error::Argument(
            "--unit: one of rad and deg, and one of m and mm".into(),
        ));
    }
    let other = has(Unit::Deg) || has(Unit::Mm);
    let one = |joint: &Channel| match joint.motion {
        Some(Motion::Revolute) if has(Unit::Deg) => Ok(180.0 / PI),
        Some(Motion::Prismatic) if has(Unit::Mm) => Ok(1000.0),
        None if other => Err(Error::Argument(format!(
            "--unit: whether {} turns or slides stands in the robot file; name it with --robot",
            joint.name
        ))),
        _ => Ok(1.0),
    };
    joints.iter().map(one).collect()
}
