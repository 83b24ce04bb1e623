//! `excite log FILE…`.

use super::{Folder, pretty, print, warn};
use excite::survey::{self, json, page};
use excite::{Plant, Result};
use std::path::PathBuf;

/// Say what is in a log of any format, and what its columns mean.
#[derive(clap::Args)]
#[command(
    long_about = "Say what is in a log, as it was recorded: CSV of any layout (RTDE, libfranka and Kortex among \
                  them), rosbag2 (.db3, .mcap), NumPy (.npz), MATLAB (.mat, up to -v7).\n\nSeveral files with the same \
                  columns are records of their own; files with different columns hold a quantity each of one record. \
                  With a robot, the columns are given to its joints, and what its nominal model says of their numbers is \
                  compared with what their names say.\n\nWrites log.json, experiment.toml (for `excite identify`, with \
                  every decision in it) and report.html. The files stay as they are.",
    after_help = "Examples:\n  excite log run.csv\n  excite log bag.mcap --robot panda --output log\n  excite log \
                  state.csv control.csv --robot robot.toml"
)]
pub struct Args {
    /// Files of any format
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// The robot: a robot.toml, a URDF, or the name of a bundled one
    #[arg(long, value_name = "ROBOT")]
    robot: Option<String>,
    /// Directory for the results
    #[arg(short, long, default_value = "out")]
    output: PathBuf,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// Read the log in parts of so many rows, and hold a few of them at a time; 0 reads it whole [default: 400000, or fewer of
    /// more than 20 columns, where it has more than 500 MB, else 0]
    #[arg(long, value_name = "N")]
    rows: Option<usize>,
    /// Print log.json to standard output instead of a summary
    #[arg(long)]
    json: bool,
}

pub fn run(args: Args) -> Result<()> {
    let robot = args.robot.as_deref().map(Plant::load).transpose()?;
    let found = survey::survey_in_parts(&args.files, robot.as_ref(), args.rows)?;
    let folder = Folder::new(
        &args.output,
        &["log.json", "experiment.toml", "report.html"],
        args.force,
    )?;
    warn(&found.warnings);
    let value = json::json(&found);
    let experiment = survey::experiment(&found, args.robot.as_deref(), &args.output);
    let written = vec![
        folder.write("log.json", &pretty(&value))?,
        folder.write("experiment.toml", &experiment)?,
        folder.write("report.html", &page::html(&found))?,
    ];
    match args.json {
        true => print(&pretty(&value)),
        false => print(&survey::summary(&found, &written)),
    }
}
