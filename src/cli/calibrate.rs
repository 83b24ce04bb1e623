//! `excite calibrate CALIBRATION`.

use super::{Folder, pretty, print, warn};
use clap::ValueEnum;
use excite::Result;
use excite::calibrate::parts::{Algorithm, Stats};
use excite::calibrate::{self, Calibrated, Settings, json, page, write};
use std::fmt::Write as _;
use std::path::PathBuf;

/// Identify the geometry of a robot from what was seen or touched.
#[derive(clap::Args)]
#[command(
    long_about = "Identify the geometry of a robot from joint readings and what a camera, a tracker, a ball in \
                  sockets, a plane or a dial gauge says of its tool.\n\nCALIBRATION is a calibration.toml: the robot, \
                  files of joint readings with what was measured, known distances, tolerances. Rows with use = \
                  \"holdout\" judge the result and take no part in it.\n\nWrites calibration.json, report.html and \
                  the robot with the calibrated geometry: robot.urdf, and robot.toml where the robot was read from \
                  one.",
    after_help = "Examples:\n  excite calibrate calibration.toml --output calibrated\n  excite calibrate \
                  calibration.toml --json\n  excite design calibrated/robot.urdf"
)]
pub struct Args {
    /// calibration.toml
    calibration: PathBuf,
    /// Directory for the files
    #[arg(short, long, default_value = "out")]
    output: PathBuf,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// How poses of a parallel robot enter the fit: measured readings against the inverse model at the measured pose,
    /// the closure of the chains there, or the measured pose against the forward model
    #[arg(long, value_enum, default_value = "inverse")]
    algorithm: How,
    /// Let the measured orientation of a parallel robot be one that it cannot take, as the published algorithms do
    #[arg(long)]
    no_orientation: bool,
    /// Print calibration.json to standard output instead of a summary
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum How {
    Inverse,
    Implicit,
    Forward,
}

pub fn run(args: Args) -> Result<()> {
    let settings = Settings {
        algorithm: match args.algorithm {
            How::Inverse => Algorithm::Inverse,
            How::Implicit => Algorithm::Implicit,
            How::Forward => Algorithm::Forward,
        },
        orientation: !args.no_orientation,
    };
    let (input, opened) = calibrate::read(&args.calibration)?;
    let names = ["calibration.json", "report.html", write::URDF, write::TOML];
    let folder = Folder::new(&args.output, &names, args.force)?;
    let found = calibrate::calibrate(&input, &opened, settings)?;
    warn(&found.warnings);
    let value = json::json(&found);
    let mut files = vec![
        folder.write("calibration.json", &pretty(&value))?,
        folder.write("report.html", &page::html(&found))?,
    ];
    for name in [write::URDF, write::TOML] {
        match found.files.iter().find(|f| f.0 == name) {
            Some((_, text)) => files.push(folder.write(name, text)?),
            None => folder.remove(name)?,
        }
    }
    match args.json {
        true => print(&pretty(&value)),
        false => print(&summary(&found, &files)),
    }
}

/// Outliers that the summary names; all are in `calibration.json`.
const NAMED: usize = 6;

fn summary(found: &Calibrated, files: &[PathBuf]) -> String {
    let mut out = String::new();
    let i = &found.identifiability;
    let _ = writeln!(
        out,
        "{}: {} of {} unknowns can be told apart from {} rows",
        found.robot,
        i.rank,
        i.total,
        found.rows.iter().filter(|r| r.fit).count()
    );
    for (fit, name) in [(true, "fit"), (false, "holdout")] {
        let [before, after] = found.errors(fit, true).map(|e| Stats::of(&e));
        let strays = found.rows.iter().any(|r| r.fit == fit && r.outlier);
        let sound = Stats::of(&found.errors(fit, false)[1]).filter(|_| strays);
        if let (Some(a), Some(b)) = (before, after) {
            let _ = writeln!(
                out,
                "  {name}: mean error {:.3} mm before, {:.3} mm after (95 % {:.3}, maximum {:.3}){}",
                1e3 * a.mean,
                1e3 * b.mean,
                1e3 * b.p95,
                1e3 * b.max,
                sound.map_or(String::new(), |s| format!(
                    ", {:.3} without outliers",
                    1e3 * s.mean
                ))
            );
        }
    }
    if found.groups.len() > 1 {
        for g in &found.groups {
            let mean = |s: Option<Stats>| 1e3 * s.map_or(f64::NAN, |s| s.mean);
            let _ = writeln!(
                out,
                "  {:<20} {:<8} {:>8.3} -> {:.3} mm{}",
                g.name,
                if g.fit { "fit" } else { "holdout" },
                mean(g.before),
                mean(g.after),
                match (g.spoiled, g.outliers) {
                    (true, _) => "  spoiled".to_string(),
                    (_, 0) => String::new(),
                    (_, n) => format!("  {n} outliers, {:.3} without", mean(g.sound)),
                }
            );
        }
    }
    if !found.outliers.is_empty() {
        let named = found
            .outliers
            .iter()
            .take(NAMED)
            .map(|o| match o.note.as_str() {
                "" => format!("{} line {}", o.file, o.line),
                note => format!("{} line {} ({note})", o.file, o.line),
            });
        let _ = writeln!(
            out,
            "  {} of {} rows do not belong: {}{}",
            found.outliers.len(),
            found.rows.len(),
            named.collect::<Vec<_>>().join(", "),
            if found.outliers.len() > NAMED {
                ", …"
            } else {
                ""
            }
        );
    }
    for t in &found.trials {
        let _ = writeln!(
            out,
            "  {}: {:.4} -> {:.4} mm on rows left out, {}",
            t.effect,
            1e3 * t.without,
            1e3 * t.with,
            if t.kept { "kept" } else { "left out" }
        );
    }
    for f in files {
        let _ = writeln!(out, "wrote {}", f.display());
    }
    out
}
