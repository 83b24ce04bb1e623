//! The command line. Exit status: 0 done, 1 could not do it (the reason on standard error), 2
//! unusable arguments. Nothing but results goes to standard output.

mod calibrate;
mod condense;
pub mod design;
mod diagnose;
pub mod export;
mod identifiability;
pub mod identify;
mod into;
mod load;
mod log;
mod merge;
mod moves;
mod new;
mod poses;
mod rehearse;
mod robots;
mod simulate;
mod summary;
mod torque;

use clap::{Parser, Subcommand};
use excite::robot::parts::JointTerm;
use excite::{Error, Plant, Result, Warning, WarningKind};
use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Exciting trajectories for robots: designed, and proven inside the limits, before the run.
#[derive(Parser)]
#[command(
    name = "excite",
    version,
    max_term_width = 90,
    arg_required_else_help = true
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    // what each does stands at its `Args`: a comment here would replace the long help there
    Design(design::Args),
    Identifiability(identifiability::Args),
    Identify(identify::Args),
    Condense(condense::Args),
    Merge(merge::Args),
    Torque(torque::Args),
    Diagnose(diagnose::Args),
    Move(moves::Args),
    Rehearse(rehearse::Args),
    Simulate(simulate::Args),
    Export(export::Args),
    Load(load::Args),
    Poses(poses::Args),
    Calibrate(calibrate::Args),
    Log(log::Args),
    Robots(robots::Args),
    New(new::Args),
}

/// Runs the program.
pub fn main() -> ExitCode {
    excite::heap::share();
    ExitCode::from(run(std::env::args_os()))
}

/// Runs the program with these arguments, the first of which is its name; gives the exit status.
pub fn run(args: impl IntoIterator<Item = OsString>) -> u8 {
    let cli = match Cli::try_parse_from(args) {
        Ok(cli) => cli,
        Err(e) => {
            // help and version are no mistakes; where nobody reads, nothing can be said
            let _ = e.print();
            return u8::try_from(e.exit_code()).unwrap_or(2);
        }
    };
    let done = match cli.command {
        Command::Design(a) => design::run(a),
        Command::Identifiability(a) => identifiability::run(a),
        Command::Identify(a) => identify::run(a),
        Command::Condense(a) => condense::run(a),
        Command::Merge(a) => merge::run(a),
        Command::Torque(a) => torque::run(a),
        Command::Diagnose(a) => diagnose::run(a),
        Command::Move(a) => moves::run(a),
        Command::Rehearse(a) => rehearse::run(a),
        Command::Simulate(a) => simulate::run(a),
        Command::Export(a) => export::run(a),
        Command::Load(a) => load::run(a),
        Command::Poses(a) => poses::run(a),
        Command::Calibrate(a) => calibrate::run(a),
        Command::Log(a) => log::run(a),
        Command::Robots(a) => robots::run(a),
        Command::New(a) => new::run(a),
    };
    match done {
        Ok(()) => 0,
        Err(e) => {
            eprintln!("error: {e}");
            if e.is_argument() { 2 } else { 1 }
        }
    }
}

/// Prints to standard output; a reader that went away (`| head`) ends the program quietly.
fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => std::process::exit(0),
        other => other.map_err(|e| Error::io("standard output", e)),
    }
}

/// Prints warnings to standard error, the first few in full.
fn warn(warnings: &[Warning]) {
    const MOST: usize = 12;
    for w in warnings.iter().take(MOST) {
        eprintln!("warning: {w}");
    }
    if warnings.len() > MOST {
        eprintln!(
            "warning: and {} more, all of them in the report",
            warnings.len() - MOST
        );
    }
}

/// A robot, with other joint columns where the command line asks for them.
fn load(spec: &str, identify: Option<&[String]>) -> Result<Plant> {
    let plant = Plant::load(spec)?;
    let Some(names) = identify else {
        return Ok(plant);
    };
    Ok(plant.with_terms(&terms(names)?))
}

/// Joint columns by their names.
///
/// # Errors
/// A name that there is not.
pub fn terms(names: &[String]) -> Result<Vec<JointTerm>> {
    if names.len() > 1 && names.iter().any(|n| n == "none") {
        return Err(Error::Argument(
            "--identify is either none or a list of columns, not both".into(),
        ));
    }
    let mut terms = Vec::new();
    for name in names.iter().filter(|n| n.as_str() != "none") {
        match JointTerm::ALL.into_iter().find(|t| t.name() == name) {
            Some(t) => terms.push(t),
            None => {
                return Err(Error::Argument(format!(
                    "--identify knows armature, viscous, coulomb, offset and none, not `{name}`"
                )));
            }
        }
    }
    Ok(terms)
}

/// How collisions are looked at.
#[derive(clap::Args)]
struct Collisions {
    /// Look at no collisions: neither of the robot with itself nor with what stands around it
    #[arg(long)]
    no_collision: bool,
    /// Folder in which package:// meshes are looked for, before the robot file's own and
    /// ROS_PACKAGE_PATH; may be given several times
    #[arg(long, value_name = "FOLDER")]
    meshes: Vec<PathBuf>,
}

impl Collisions {
    fn apply(&self, plant: Plant) -> Plant {
        match self.no_collision {
            true => plant.without_collisions(),
            false => plant.with_meshes(&self.meshes),
        }
    }
}

/// The directory that a run writes its files to.
struct Folder {
    dir: PathBuf,
    force: bool,
}

impl Folder {
    /// Makes it; nothing in it is in the way of files of these names.
    fn new(dir: &Path, names: &[&str], force: bool) -> Result<Self> {
        excite::output::prepare_dir(dir, names, force)?;
        Ok(Folder {
            dir: dir.to_path_buf(),
            force,
        })
    }

    /// Path of a file in it.
    fn path(&self, name: &str) -> PathBuf {
        self.dir.join(name)
    }

    fn write(&self, name: &str, text: &str) -> Result<PathBuf> {
        let path = self.path(name);
        write(&path, self.force, text)?;
        Ok(path)
    }

    /// Removes what an earlier run left under a name that this run does not write.
    fn remove(&self, name: &str) -> Result<()> {
        let path = self.path(name);
        match self.force && path.is_file() {
            true => std::fs::remove_file(&path).map_err(|e| Error::io(path, e)),
            false => Ok(()),
        }
    }

    /// The robot files of a model: those that can be written, with warnings about the others.
    fn robot(&self, texts: Vec<(&'static str, Result<String>)>) -> Result<Vec<PathBuf>> {
        let mut written = Vec::new();
        // what this model needs no more
        for name in excite::export::all() {
            if !texts.iter().any(|(n, _)| *n == name) {
                self.remove(name)?;
            }
        }
        for (name, text) in texts {
            match text {
                Ok(text) => written.push(self.write(name, &text)?),
                Err(_) => self.remove(name)?,
            }
        }
        Ok(written)
    }
}

/// Warnings about robot files that cannot be written; `values` names the file that has their numbers.
pub fn unwritten(texts: &[(&'static str, Result<String>)], values: &str) -> Vec<Warning> {
    let failed = texts
        .iter()
        .filter_map(|(name, text)| Some((name, text.as_ref().err()?)));
    failed
        .map(|(name, e)| {
            Warning::new(
                WarningKind::FileNotWritten,
                *name,
                format!("not written: {e}; the values are in {values}"),
            )
        })
        .collect()
}

/// The pressure of `--atmosphere`.
fn outside(pressure: f64) -> Result<f64> {
    match pressure >= 0.0 && pressure.is_finite() {
        true => Ok(pressure),
        false => Err(Error::Argument(format!(
            "--atmosphere is a pressure in Pa, not {pressure}"
        ))),
    }
}

/// Writes a text file into a prepared directory.
fn write(path: &Path, force: bool, text: &str) -> Result<()> {
    excite::output::write_atomic(path, force, |w| w.write_all(text.as_bytes()))
}

/// JSON with a newline at the end.
pub fn pretty(value: &serde_json::Value) -> String {
    format!("{value:#}\n")
}
