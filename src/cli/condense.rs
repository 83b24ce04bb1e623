//! `excite condense EXPERIMENT`.

use super::{identify::columns, outside, print, warn};
use excite::identify::{Settings, condense, condense_parts};
use excite::log::{Experiment, Outline, Record};
use excite::output::{prepare_dir, write_atomic};
use excite::survey::check;
use excite::{Error, Result};
use std::fmt::Write as _;
use std::path::PathBuf;

/// Reduce records to triangular factors, from which merge identifies.
#[derive(clap::Args)]
#[command(
    long_about = "Reduce records to triangular factors that add, from which `excite merge` identifies: about \
                  200 kB for seven joints, in place of a log of any length.\n\nOne file for all records of an experiment, with those for \
                  the fit and the holdout ones apart. Factors add where robot, columns and cut-off are the same.",
    after_help = "Examples:\n  excite condense experiment.toml --cutoff 20 --output day1.factor\n  excite condense run1.csv \
                  --robot arm.toml --period 10 --cutoff 20\n  excite condense day.csv --robot arm.toml --cutoff 20 \
                  --rows 250000\n  excite merge day1.factor day2.factor"
)]
pub struct Args {
    /// experiment.toml, or with --robot one log
    record: PathBuf,
    /// Robot of the log: bundled robot, robot.toml, URDF or MJCF
    #[arg(long)]
    robot: Option<String>,
    /// Period of the motion in the log, s
    #[arg(long, value_name = "S", requires = "robot")]
    period: Option<f64>,
    /// Cut-off of the filter that torque and regressor pass, Hz; factors with the same one add [default: ten times the
    /// bandwidth of the motion]
    #[arg(long, value_name = "HZ")]
    cutoff: Option<f64>,
    /// Read logs that are too long for the memory in parts of so many rows, each a record of its own
    #[arg(long, value_name = "N")]
    rows: Option<usize>,
    /// Do not average the periods of motion that repeats
    #[arg(long)]
    no_average: bool,
    /// Derive velocities and accelerations from positions even where the log has them
    #[arg(long)]
    derive: bool,
    /// Joint columns beside the ten of each link, as of `excite identify`
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    identify: Option<Vec<String>>,
    /// Pressure outside of the cylinders, Pa
    #[arg(long, value_name = "PA", default_value_t = 101_325.0)]
    atmosphere: f64,
    /// File to write [default: RECORD with the ending .factor]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Replace the file if it exists
    #[arg(long)]
    force: bool,
}

pub fn run(args: Args) -> Result<()> {
    let output = args.output.unwrap_or(args.record.with_extension("factor"));
    let (folder, name) = (output.parent(), output.file_name());
    let name = name.ok_or_else(|| Error::Argument("--output names no file".into()))?;
    let folder = folder.filter(|f| !f.as_os_str().is_empty());
    prepare_dir(
        folder.unwrap_or(std::path::Path::new(".")),
        &[&name.to_string_lossy()],
        args.force,
    )?;
    let mut settings = Settings::default();
    settings.signals.cutoff = args.cutoff;
    settings.signals.average = !args.no_average;
    settings.signals.measured_rates = !args.derive;
    let asked = args.identify.as_deref();
    let outline = match &args.robot {
        Some(robot) => Outline::of_log(&args.record, robot, args.period)?,
        None => Outline::read(&args.record)?,
    }
    .pressed(outside(args.atmosphere)?);
    let mut notes = Vec::new();
    let plant = columns(outline.plant.clone(), asked, &mut notes)?;
    let mut factor = match args.rows {
        Some(rows) => {
            let check = |part: &Record| check(&outline.plant, std::slice::from_ref(part));
            condense_parts(&outline, &plant, asked, rows, &settings, &check)?.factor
        }
        None => {
            let Experiment {
                spec,
                plant: stated,
                records,
                ..
            } = outline.whole()?;
            notes.splice(0..0, check(&stated, &records)?);
            condense(&plant, &spec, asked, &records, &settings)?
        }
    };
    factor.header.warnings.splice(0..0, notes);
    warn(&factor.header.warnings);
    let bytes = factor.to_bytes()?;
    write_atomic(&output, args.force, |w| w.write_all(&bytes))?;
    let mut out = String::new();
    for (part, what) in factor.header.parts.iter().zip(["fit", "holdout"]) {
        if !part.records.is_empty() {
            let _ = writeln!(
                out,
                "{what}: {} equations of {}, {} columns",
                part.used.iter().sum::<f64>(),
                part.records.join(", "),
                part.columns.len()
            );
        }
    }
    let _ = writeln!(
        out,
        "wrote {} ({} kB, cut-off {} Hz)",
        output.display(),
        bytes.len().div_ceil(1000),
        factor.header.cutoff
    );
    print(&out)
}
