//! `excite identifiability ROBOT [TRAJECTORY]`.

use super::{load, pretty, print, summary::summary, warn, write};
use excite::identifiability::{assess, json::json, page};
use excite::output::prepare_dir;
use excite::simulate::effects::parse_payload;
use excite::trajectory::Trajectory;
use excite::{Error, Result};
use std::path::PathBuf;
use std::time::Instant;

/// Report what a robot, and a trajectory on it, can identify.
#[derive(clap::Args)]
#[command(
    long_about = "Report what a robot can identify at all (base parameters, and which standard \
                  parameters stand alone, in combinations or not at all), and with a trajectory how \
                  well, and whether all limits hold for all time.\n\nWrites report.json and \
                  report.html.",
    after_help = "Examples:\n  excite identifiability arm.urdf\n  excite identifiability panda \
                  out/trajectory.json --output check\n  excite identifiability panda --identify \
                  armature,viscous,coulomb"
)]
pub struct Args {
    /// Bundled robot, robot.toml or URDF
    robot: String,
    /// trajectory.json of `excite design`
    trajectory: Option<PathBuf>,
    /// Directory for the report
    #[arg(short, long, default_value = "out")]
    output: PathBuf,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// Joint columns beside the ten of each link, for all joints: armature, viscous, coulomb,
    /// offset, or none [default: as in the robot file]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    identify: Option<Vec<String>>,
    /// Also say how well the trajectory tells this load: kg, centre of mass in m and tensor about it in kg m², in the frame of
    /// the last body or platform
    #[arg(
        long,
        value_name = "MASS,X,Y,Z[,Ixx,Ixy,Ixz,Iyy,Iyz,Izz]",
        allow_hyphen_values = true,
        requires = "trajectory"
    )]
    payload: Option<String>,
    #[command(flatten)]
    collisions: super::Collisions,
    /// Print report.json to standard output instead of a summary
    #[arg(long)]
    json: bool,
}

pub fn run(args: Args) -> Result<()> {
    let begin = Instant::now();
    let payload = args.payload.as_deref().map(parse_payload).transpose()?;
    let mut plant = args
        .collisions
        .apply(load(&args.robot, args.identify.as_deref())?);
    let trajectory = args.trajectory.as_ref().map(Trajectory::read).transpose()?;
    if let (Some(t), Some(path)) = (&trajectory, &args.trajectory) {
        plant = plant
            .in_space(t.space)
            .map_err(|e| Error::file(path, "coordinates", e.to_string()))?;
        t.matches(plant.moved())
            .map_err(|e| Error::file(path, "", e.to_string()))?;
    }
    let files = prepare_dir(&args.output, &["report.json", "report.html"], args.force)?;
    let mut assessment = assess(&plant, trajectory.as_ref())?;
    if let (Some(load), Some(t)) = (&payload, &trajectory) {
        assessment = assessment.with_load(&plant, t, load, true)?;
    }
    warn(&assessment.warnings);
    let json = json(&assessment, None, begin.elapsed().as_secs_f64());
    write(&files[0], args.force, &pretty(&json))?;
    write(&files[1], args.force, &page::html(&assessment, None))?;
    match args.json {
        true => print(&pretty(&json)),
        false => print(&summary(&assessment, None, &files)),
    }
}
