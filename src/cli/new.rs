//! `excite new FILE.urdf`.

use excite::{Error, Result, Robot};

/// Print a commented robot.toml for a URDF.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  excite new arm.urdf > robot.toml")]
pub struct Args {
    /// URDF file
    urdf: String,
}

pub fn run(args: Args) -> Result<()> {
    if !args.urdf.ends_with(".urdf") {
        return Err(Error::Argument(format!(
            "`{}` is not a .urdf file; `excite new` writes the robot.toml that goes with one",
            args.urdf
        )));
    }
    let robot = Robot::load(&args.urdf)?;
    super::warn(&robot.warnings);
    super::print(&robot.to_toml_template(&args.urdf))
}
