//! `excite export TRAJECTORY --format …`, and `excite export ROBOT --to …`.

use super::{Folder, into, print, unwritten, warn};
use excite::controller::{Card, Column, Course, FORMATS, Leg, Options, Playback, Unit, format};
use excite::export::parts::Model;
use excite::export::{self, write};
use excite::mechanism::bundled as parallel;
use excite::output::write_atomic;
use excite::report::format::unit_of;
use excite::robot::bundled;
use excite::robot::parts::Motion;
use excite::trajectory::Trajectory;
use excite::trajectory::certificate::Kind;
use excite::{Error, Plant, Result, Warning};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Write a trajectory in a file that the robot's controller reads, or a robot for a simulator.
#[derive(clap::Args)]
#[command(
    long_about = "Write a trajectory in a file that the robot's controller reads: ROS 2, Universal Robots, Franka, \
                  KUKA, xArm, MuJoCo, plain CSV or C (--list). docs/run.md has the program that plays each of \
                  them.\n\nBetween two points a controller interpolates. How far it may leave the trajectory there \
                  is bounded and printed. Without --rate the lowest rate of the controller is taken that keeps \
                  within 1e-5 rad or m, or within one step of the encoder.\n\nThe first run should be slow: --speed \
                  0.1 plays the same path at a tenth of the speed. Formats that are sent point by point need a \
                  motion that starts and ends at rest, or moves there and back (--approach, --return: CSV files \
                  with the columns t, q1 …, dq1 …, ddq1 … of the actuators).\n\nWith --to, a robot is written instead: \
                  mujoco (robot.xml), urdf (robot.urdf), sdf \
                  (robot.sdf), usd (robot.usda) or isaac-lab (actuators.py) into the directory of --output. With --into, a copy of \
                  your own MJCF or URDF has the values of the robot, and everything else stays as it is.",
    after_help = "Examples:\n  excite export out/trajectory.json --format urscript --speed 0.1\n  excite export \
                  out/trajectory.json --format ros2 --approach moves/approach.csv --return moves/return.csv\n  excite \
                  export out/trajectory.json --format csv --robot arm.urdf --rate 200 --unit deg --columns t,q\n  excite \
                  export --list\n  excite export out/robot.toml --to mujoco --into scene.xml --output better"
)]
pub struct Args {
    /// trajectory.json of `excite design`; with --to a bundled robot, robot.toml, URDF or MJCF
    #[arg(required_unless_present = "list")]
    trajectory: Option<PathBuf>,
    /// Format of the file, one of --list
    #[arg(short, long, value_name = "NAME", required_unless_present_any = ["list", "to"])]
    format: Option<String>,
    /// Write a robot for a simulator in place of a trajectory
    #[arg(long, value_name = "NAME", value_parser = ["mujoco", "urdf", "sdf", "usd", "isaac-lab"], conflicts_with_all = ["format", "list", "robot",
        "rate", "periods", "speed", "approach", "retreat", "joints", "columns", "unit", "move_to_start"])]
    to: Option<String>,
    /// With --to: MJCF or URDF of the same robot, of which a copy with the values of the robot is written
    #[arg(long, value_name = "SCENE", requires = "to")]
    into: Option<PathBuf>,
    /// Print the formats
    #[arg(long)]
    list: bool,
    /// Bundled robot, robot.toml or URDF: needed for the motion of a platform and for --unit [default:
    /// the bundled robot that the trajectory was designed for]
    #[arg(long)]
    robot: Option<String>,
    /// Samples a second, Hz [default: chosen so that the deviation is small enough]
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Periods of the motion [default: as in the trajectory]
    #[arg(long, value_name = "N")]
    periods: Option<u32>,
    /// Fraction of the speed of the design
    #[arg(long, value_name = "FRACTION", default_value_t = 1.0)]
    speed: f64,
    /// Move to the start, played first
    #[arg(long, value_name = "FILE.csv")]
    approach: Option<PathBuf>,
    /// Move back, played last
    #[arg(long = "return", value_name = "FILE.csv")]
    retreat: Option<PathBuf>,
    /// Joints by name, in the order of the controller [default: all, as in the robot]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    joints: Option<Vec<String>>,
    /// Columns of csv (t, q, dq, ddq), or what points of ros2 have (q, dq, ddq)
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    columns: Option<Vec<String>>,
    /// Units of csv: rad or deg, m or mm
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    unit: Vec<String>,
    /// Begin the program with a slow move to the start (urscript, xarm); nobody looks for obstacles
    #[arg(long)]
    move_to_start: bool,
    /// File to write [default: TRAJECTORY_FORMAT.EXTENSION beside the trajectory]; with --to the directory [default: out]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

pub fn run(args: Args) -> Result<()> {
    if let (Some(to), Some(spec)) = (&args.to, &args.trajectory) {
        return robot_to(&args, to, &spec.to_string_lossy());
    }
    let (Some(path), Some(name), false) = (&args.trajectory, &args.format, args.list) else {
        return print(&list());
    };
    let format = format(name)?;
    let options = Options {
        rate: args.rate,
        joints: args.joints.clone(),
        columns: match &args.columns {
            None => None,
            Some(names) => Some(
                names
                    .iter()
                    .map(|n| Column::parse(n))
                    .collect::<Result<_>>()?,
            ),
        },
        units: args
            .unit
            .iter()
            .map(|u| Unit::parse(u))
            .collect::<Result<_>>()?,
        move_to_start: args.move_to_start,
    };
    let trajectory = Trajectory::read(path)?;
    // what cannot be done is about the trajectory; what is asked for wrongly is about the options
    let about = |e: Error| match e {
        Error::Infeasible(message) => Error::file(path, "", message),
        other => other,
    };
    let plant = robot(args.robot.as_deref(), &trajectory, path)?;
    let periods = args.periods.unwrap_or(trajectory.periods);
    let mut course =
        Course::new(&trajectory, plant.as_ref(), periods, args.speed).map_err(about)?;
    for (file, first) in [(&args.approach, true), (&args.retreat, false)] {
        let Some(file) = file else { continue };
        let leg = Leg::read(file, course.joints().len())?.at_speed(args.speed);
        let joined = match first {
            true => course.after(leg),
            false => course.before(leg),
        };
        course = joined.map_err(|e| Error::file(file, "", e.to_string()))?;
    }
    let playback = Playback::new(&course, format, &options).map_err(about)?;
    warn(&playback.warnings);
    let bytes = format.write(&playback).map_err(about)?;
    let card = format.card();
    let output = args.output.clone().unwrap_or_else(|| {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        path.with_file_name(format!(
            "{stem}_{}.{}",
            card.name.replace('-', "_"),
            card.extension
        ))
    });
    let mut files = vec![(output.clone(), bytes)];
    if let Some((suffix, text)) = format.beside(&playback) {
        let stem = output.file_stem().unwrap_or_default().to_string_lossy();
        let beside = output.with_file_name(format!("{stem}{suffix}"));
        files.push((beside, text.into_bytes()));
    }
    if let Some((file, _)) = files.iter().find(|(file, _)| !args.force && file.is_file()) {
        return Err(Error::Exists(file.clone()));
    }
    if let Some(folder) = output.parent().filter(|f| !f.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, e))?;
    }
    let mut out = summary(&playback, &card);
    for (file, bytes) in &files {
        write_atomic(file, args.force, |w| w.write_all(bytes))?;
        let _ = writeln!(out, "wrote {} ({} bytes)", file.display(), bytes.len());
    }
    print(&out)
}

/// Writes a robot for a simulator.
fn robot_to(args: &Args, to: &str, spec: &str) -> Result<()> {
    let plant = Plant::load(spec)?;
    let output = args.output.clone().unwrap_or("out".into());
    let model = Model {
        plant: &plant,
        robot: plant.robot(),
        remarks: &[],
    };
    let further = !matches!(to, "mujoco" | "urdf");
    if further && args.into.is_some() {
        return Err(Error::Argument(format!(
            "--into takes an MJCF or a URDF: --to mujoco or --to urdf, not {to}"
        )));
    }
    let mut texts: Vec<(&'static str, Result<String>)> = match further {
        true => {
            let formats = export::further(&[to.to_string()], &plant)?;
            formats
                .iter()
                .map(|f| (f.file(), f.write(&model)))
                .collect()
        }
        false => {
            let file = if to == "mujoco" {
                "robot.xml"
            } else {
                "robot.urdf"
            };
            let all = write(&model).into_iter();
            all.filter(|(name, _)| *name == file).collect()
        }
    };
    let scene = into::edit(&model, args.into.as_deref(), &output, &mut texts)?;
    let names = scene.as_ref().map(|s| s.names()).unwrap_or_default();
    // a robot of the user's own file is in that file
    let texts = if scene.is_some() { Vec::new() } else { texts };
    if scene.is_none() && texts.is_empty() {
        return Err(Error::Infeasible(format!(
            "{spec}: closed chains are not written for {to}"
        )));
    }
    let mut all: Vec<&str> = names.iter().map(String::as_str).collect();
    all.extend(texts.iter().map(|(name, _)| *name));
    let mut warnings = plant.warnings().to_vec();
    warnings.extend(model.warnings());
    warnings.extend(unwritten(&texts, "the robot"));
    warnings.extend(into::warnings(scene.as_ref()));
    warn(&warnings);
    let folder = Folder::new(&output, &all, args.force)?;
    let mut written = into::save(&folder, scene.as_ref())?;
    for (name, text) in texts {
        written.push(folder.write(name, &text?)?);
    }
    let mut out = String::new();
    for c in scene.iter().flat_map(|s| &s.changes) {
        let none = "none".to_string();
        let _ = writeln!(
            out,
            "{}:{}: {} {}: {} -> {}",
            c.file,
            c.line,
            c.element,
            c.attribute,
            c.old.as_ref().unwrap_or(&none),
            c.new.as_ref().unwrap_or(&none)
        );
    }
    for file in written {
        let _ = writeln!(out, "wrote {}", file.display());
    }
    print(&out)
}

/// The robot that is named; otherwise the bundled one.
fn robot(spec: Option<&str>, trajectory: &Trajectory, path: &Path) -> Result<Option<Plant>> {
    let named = spec.map(Plant::load).transpose()?;
    let (plant, warnings) = robot_of(named, trajectory, path)?;
    warn(&warnings);
    Ok(plant)
}

/// The robot that is given, with what is imperfect in it; otherwise the bundled one that the trajectory was designed
/// for.
///
/// # Errors
/// A robot that the trajectory does not move.
pub fn robot_of(
    given: Option<Plant>,
    trajectory: &Trajectory,
    path: &Path,
) -> Result<(Option<Plant>, Vec<Warning>)> {
    let name = trajectory.robot.as_str();
    let known = bundled::find(name).is_some() || parallel::find(name).is_some();
    let stated = given.is_some();
    let plant = match given {
        Some(plant) => plant,
        None if known => Plant::load(name)?,
        None => return Ok((None, Vec::new())),
    };
    let plant = plant
        .in_space(trajectory.space)
        .map_err(|e| Error::file(path, "coordinates", e.to_string()));
    let matched = plant.and_then(|plant| match trajectory.matches(plant.moved()) {
        Ok(warning) => Ok((plant, warning)),
        Err(e) => Err(Error::file(path, "", e.to_string())),
    });
    match (stated, matched) {
        (true, Ok((plant, warning))) => {
            let warnings = plant.warnings().iter().cloned().chain(warning).collect();
            Ok((Some(plant), warnings))
        }
        (true, Err(e)) => Err(e),
        // another robot of the same name is not the one that is meant
        (false, Ok((plant, None))) => Ok((Some(plant), Vec::new())),
        (false, _) => Ok((None, Vec::new())),
    }
}

fn list() -> String {
    let mut out = String::new();
    for format in FORMATS {
        let card = format.card();
        let _ = writeln!(out, "{:<10} {}", card.name, card.about);
    }
    out
}

/// What will run: parts, samples, and what happens between them.
pub fn summary(playback: &Playback, card: &Card) -> String {
    let mut out = String::new();
    let _ = write!(out, "{}: {}, ", playback.robot, card.name);
    let _ = match card.rates.offered.is_empty() {
        true => writeln!(
            out,
            "series of {} coordinates, {} s",
            playback.fourier.dof(),
            playback.duration()
        ),
        false => writeln!(
            out,
            "{} joints, {} samples at {} Hz, {} s",
            playback.joints.len(),
            playback.len(),
            playback.rate,
            playback.duration()
        ),
    };
    let [approach, motion, retreat] = playback.parts;
    if approach + retreat > 0.0 {
        let _ = writeln!(
            out,
            "approach {approach} s, motion {motion} s, return {retreat} s"
        );
    }
    for (way, all) in &playback.deviations {
        // of joints that turn and joints that slide, the worst of each
        for motion in [Motion::Revolute, Motion::Prismatic] {
            let of = playback.joints.iter().zip(all);
            let of = of.filter(|(c, _)| c.motion.unwrap_or(Motion::Revolute) == motion);
            let Some((joint, worst)) = of.max_by(|a, b| a.1.value.total_cmp(&b.1.value)) else {
                continue;
            };
            let unit = unit_of(Kind::Position, motion);
            let proof = match worst.proven {
                true => "at most",
                false => "about, not proven,",
            };
            let _ = writeln!(
                out,
                "between the points, {}: {proof} {:.2e} {unit} off ({}; {})",
                way.name(),
                worst.value,
                joint.name,
                way.formula()
            );
        }
    }
    if !playback.is_empty() {
        let start: Vec<String> = (0..playback.joints.len())
            .map(|j| format!("{:.4}", playback.samples.q[j][0]))
            .collect();
        let _ = writeln!(out, "the first point, rad or m: {}", start.join(", "));
    }
    out
}
