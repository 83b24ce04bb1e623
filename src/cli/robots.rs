//! `excite robots`.

use excite::Result;
use excite::robot::bundled;

/// List the bundled robots.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  excite robots --sources")]
pub struct Args {
    /// Also print where the figures of each robot come from
    #[arg(long)]
    sources: bool,
}

pub fn run(args: Args) -> Result<()> {
    let mut text = String::new();
    for robot in bundled::list() {
        text.push_str(&format!("{:<10} {}\n", robot.name, robot.description));
        if args.sources {
            text.push_str(&format!("{:<10} source: {}\n", "", robot.source));
        }
    }
    super::print(&text)
}
