//! What is in a log that nobody described: `excite log`.
//!
//! Reads files of any format ([`crate::log`]), says what each column means and how sure that is, when which joint
//! moves, and what is wrong; and writes an `experiment.toml` with every decision in it.
//!
//! A column's meaning comes from three places. Its **name** is a statement. The **kinematics** among columns test it:
//! a velocity is the derivative of a position, a command leads it. With a **robot**, the torques of its nominal model
//! tell which joint a column belongs to, its sign and its unit. A claim has a confidence of at least 0.5; everything
//! else is left as `other`.

mod check;
mod claim;
mod contradict;
mod delay;
mod dynamics;
mod experiment;
mod families;
mod frame;
pub mod json;
mod kinematics;
mod long;
mod own;
pub mod page;
mod search;
mod stated;
mod units;
mod verdict;
mod words;

pub use check::check;
pub use claim::{Claim, Means};
pub use experiment::experiment;
pub use frame::{Course, Frame};
pub use words::summary;

use crate::error::{Result, Warning};
use crate::log::formats::{self, Format, Request};
use crate::log::merge;
use crate::plant::Plant;
use std::path::{Path, PathBuf};

/// What was found in files.
#[derive(Debug)]
pub struct Survey {
    /// format of the files
    pub format: Format,
    /// topic of a bag
    pub topic: Option<String>,
    /// one record a file, or one of all files where each holds a quantity
    pub frames: Vec<Frame>,
    /// what each column means, in the order of the file
    pub claims: Vec<Claim>,
    /// names of the joints: the robot's, or those of the file
    pub joints: Vec<String>,
    /// what each joint does in each record
    pub courses: Vec<Vec<Course>>,
    /// what was found and is wrong or doubtful
    pub warnings: Vec<Warning>,
}

/// Reads files and finds out what they say.
///
/// # Errors
/// Files that cannot be read, or hold nothing that can be sampled signals.
pub fn survey(files: &[PathBuf], robot: Option<&Plant>) -> Result<Survey> {
    survey_in_parts(files, robot, None)
}

/// The same of one file in parts of so many rows, of which a few are held, where 0 reads it whole; [`survey`] reads it in
/// parts where it is long. Text and bags come in parts; several files are held as a whole. What the columns mean is found in the
/// part in which they change most; what the joints do, gaps and what is wrong are of all.
///
/// # Errors
/// As [`survey`].
pub fn survey_in_parts(
    files: &[PathBuf],
    robot: Option<&Plant>,
    rows: Option<usize>,
) -> Result<Survey> {
    let (mut frames, mut warnings) = (Vec::new(), Vec::new());
    let (mut format, mut topic) = (Format::Csv, None);
    let long = match files {
        [path] => match rows.map_or_else(|| long::rows(path), Ok)? {
            0 => None,
            rows => long::liveliest(path, rows, &mut warnings)?,
        },
        _ => None,
    };
    let each = long.as_ref().map(|part| part.rows);
    if let Some(part) = long {
        (format, topic) = (part.format, part.topic);
        frames.push(part.frame);
    }
    let mut parts = Vec::new();
    for path in files.iter().filter(|_| each.is_none()) {
        let request = Request {
            skip: None,
            format: None,
            topic: None,
            wanted: &|_| true,
        };
        parts.push((path.clone(), formats::read(path, &request)?));
    }
    merge::call_by_files(&mut parts, robot.map(|r| r.actuators().len()));
    topic = topic.or_else(|| parts.iter().find_map(|(_, r)| r.topic.clone()));
    let same = parts
        .windows(2)
        .all(|w| w[0].1.table.names == w[1].1.table.names);
    if same {
        format = parts.first().map_or(format, |(_, r)| r.format);
        for (path, read) in parts {
            frames.push(Frame::new(vec![path], read.table, format, None)?);
        }
    } else {
        let paths: Vec<PathBuf> = parts.iter().map(|(p, _)| p.clone()).collect();
        let (table, kind) = merge::merge(parts)?;
        format = kind;
        frames.push(Frame::new(paths, table, format, None)?);
    }
    for f in &mut frames {
        warnings.append(&mut f.warnings);
        warnings.extend(f.unrecorded());
    }
    let mut claims = stated::claims(&frames, format, robot, &mut warnings);
    let rate = kinematics::rate(&frames, &claims);
    warnings.extend(frames.iter_mut().filter_map(|f| f.paced(rate)));
    for (k, claim) in claims.iter_mut().enumerate() {
        if !frames.is_empty() && frames.iter().all(|f| f.silent.contains(&k)) {
            claim.abstain("it holds no number at all: the channel was not recorded");
        }
    }
    kinematics::examine(&frames, &mut claims, robot.is_some(), &mut warnings);
    if let Some(plant) = robot {
        units::examine(&frames, &mut claims, plant, &mut warnings);
        dynamics::examine(&frames, &mut claims, plant, &mut warnings);
    }
    let joints = match robot {
        Some(plant) => plant.actuators().iter().map(|j| j.name.clone()).collect(),
        None => stated::joints(&claims),
    };
    let courses = match (&frames[..], each) {
        ([part], Some(rows)) => {
            let n = joints.len();
            vec![long::courses(part, (format, rows), &claims, n, robot)?]
        }
        _ => {
            let courses = |f: &Frame| f.courses(&claims, joints.len(), robot, &[]);
            frames.iter().map(courses).collect()
        }
    };
    Ok(Survey {
        format,
        topic,
        frames,
        claims,
        joints,
        courses,
        warnings: shorten(warnings),
    })
}

/// Like warnings as one: the first in full, with the number of the others.
pub fn shorten(warnings: Vec<Warning>) -> Vec<Warning> {
    const MOST: usize = 4;
    let mut out: Vec<(Warning, usize)> = Vec::new();
    for w in warnings {
        let alike = out.iter().filter(|(o, _)| o.kind == w.kind).count();
        match out.iter_mut().rev().find(|(o, _)| o.kind == w.kind) {
            Some((_, more)) if alike >= MOST => *more += 1,
            _ => out.push((w, 0)),
        }
    }
    out.into_iter()
        .map(|(mut w, more)| {
            if more > 0 {
                w.message = format!("{} (and {more} more of this kind)", w.message);
            }
            w
        })
        .collect()
}

/// A file's name for messages.
fn file_name(path: &Path) -> String {
    path.file_name().map_or(path.display().to_string(), |n| {
        n.to_string_lossy().into_owned()
    })
}
