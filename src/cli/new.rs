//! `excite new FILE.urdf`.

use excite::{Result, Robot};

/// Print a commented robot.toml for a URDF.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  excite new arm.urdf > robot.toml")]
pub struct Args {
    /// URDF file
    urdf: String,
}

pub fn run(args: Args) -> Result<()> {
    let robot = Robot::load(&args.urdf)?;
    super::warn(&robot.warnings);
    super::print(&robot.to_toml_template(&args.urdf))
}
