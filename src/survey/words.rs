//! What is printed.

use super::claim::Means;
use super::{Survey, file_name};
use crate::error::counted;
use std::fmt::Write as _;
use std::path::PathBuf;

/// The summary of a survey, 80 columns wide.
pub fn summary(survey: &Survey, files: &[PathBuf]) -> String {
    let mut out = String::new();
    let topic = survey
        .topic
        .as_ref()
        .map_or(String::new(), |t| format!(", topic {t}"));
    let _ = writeln!(out, "format {}{topic}", survey.format.name());
    for (f, courses) in survey.frames.iter().zip(&survey.courses) {
        let names: Vec<String> = f.paths.iter().map(|p| file_name(p)).collect();
        let _ = writeln!(
            out,
            "{}: {} rows, {:.2} s at {} ({}), {}",
            names.join(" + "),
            f.rows,
            f.duration(),
            f.pace(),
            f.clock(),
            counted(f.gaps.len(), "gap")
        );
        for (name, c) in survey.joints.iter().zip(courses) {
            let range = c
                .range
                .map_or("no position".into(), |[a, b]| format!("{a:8.3} to {b:8.3}"));
            let moves: f64 = c.moves.iter().map(|m| m[1] - m[0]).sum();
            let when = match (c.range, c.moves.first(), c.moves.last()) {
                (None, ..) => String::new(),
                (_, Some(a), Some(b)) => {
                    format!("moves {moves:.1} s between {:.1} and {:.1} s", a[0], b[1])
                }
                _ => "stands still".into(),
            };
            let saturated = match c.saturated {
                0 => String::new(),
                n => format!(", {} saturated", counted(n, "sample")),
            };
            let _ = writeln!(out, "  {name:<22} {range}  {when}{saturated}");
        }
    }
    let _ = writeln!(out, "columns");
    for line in groups(survey) {
        let _ = writeln!(out, "  {line}");
    }
    for f in files {
        let _ = writeln!(out, "wrote {}", f.display());
    }
    out
}

/// One line for each kind of column.
fn groups(survey: &Survey) -> Vec<String> {
    let mut out = Vec::new();
    for (means, name) in [
        (Means::Time, "time"),
        (Means::Position, "positions"),
        (Means::Velocity, "velocities"),
        (Means::Acceleration, "accelerations"),
        (Means::Torque, "torques"),
        (Means::Current, "currents"),
        (Means::Command, "commands"),
        (Means::Other, "not known"),
    ] {
        let list: Vec<_> = survey
            .claims
            .iter()
            .filter(|c| {
                c.means == means && (means == Means::Other || c.confidence >= 0.5)
                    || means == Means::Other && c.confidence < 0.5
            })
            .collect();
        if list.is_empty() {
            continue;
        }
        let least = list.iter().map(|c| c.confidence).fold(1.0, f64::min);
        let names: Vec<&str> = list.iter().take(8).map(|c| c.column.as_str()).collect();
        let more = if list.len() > 8 {
            format!(", and {} more", list.len() - 8)
        } else {
            String::new()
        };
        let sure = match means {
            Means::Other => String::new(),
            _ => format!(" (confidence {least:.2} or more)"),
        };
        out.push(format!("{name}: {}{more}{sure}", names.join(", ")));
    }
    out
}
