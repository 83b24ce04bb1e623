//! `excite robots`.

use excite::Result;
use excite::mechanism::bundled as parallel;
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
    let serial = bundled::list()
        .iter()
        .map(|b| (b.name, b.description, b.source));
    let parallel = parallel::list()
        .iter()
        .map(|b| (b.name, b.description, b.source));
    for (name, description, source) in serial.chain(parallel) {
        text.push_str(&format!("{name:<10} {description}\n"));
        if args.sources {
            text.push_str(&format!("{:<10} source: {source}\n", ""));
        }
    }
    super::print(&text)
}
