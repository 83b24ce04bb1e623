//! `excite diagnose EXPERIMENT`.

use super::{pretty, print, warn, write};
use excite::diagnose::{Settings, diagnose, improve, json, page};
use excite::identify::robot::urdf;
use excite::log::Experiment;
use excite::output::prepare_dir;
use excite::report::format::{percent, significant};
use excite::{Error, Result};
use indicatif::{ProgressBar, ProgressStyle};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Diagnose the gap between a model and its robot.
#[derive(clap::Args)]
#[command(
    long_about = "Diagnose the gap between a model and its robot: where it lies, which effect causes it, how far it shrinks \
                  once that effect is added, and what to run next.\n\nReads experiment.toml (robot, logs, which are fitted and \
                  which only predicted). Writes diagnosis.json and report.html; robot.toml, robot.urdf and robot.xml (MuJoCo) \
                  with the improved model; next.json, the motion that tells rivals apart or shows what these records cannot, of the joints or of the platform.",
    after_help = "Examples:\n  excite diagnose experiment.toml\n  excite diagnose experiment.toml --output gap --json\n  excite \
                  diagnose experiment.toml --no-next"
)]
pub struct Args {
    /// experiment.toml: the robot and its logs
    experiment: PathBuf,
    /// Directory for the results
    #[arg(short, long, default_value = "out")]
    output: PathBuf,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// Do not design the next motion
    #[arg(long)]
    no_next: bool,
    /// Random steps by which the best design of that motion is improved; counted, so that the same seed
    /// gives the same motion
    #[arg(long, value_name = "N", default_value_t = 64)]
    next_tries: usize,
    /// Seed of the random starts of that design
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Print diagnosis.json to standard output instead of a summary
    #[arg(long)]
    json: bool,
}

pub fn run(args: Args) -> Result<()> {
    let begin = Instant::now();
    let experiment = Experiment::read(&args.experiment)?;
    let serial = experiment.plant.mechanism().is_none();
    let mut names = vec!["diagnosis.json", "report.html", "robot.urdf", "next.json"];
    if serial {
        names.extend(["robot.toml", "robot.xml"]);
    }
    let paths = prepare_dir(&args.output, &names, args.force)?;
    let settings = Settings {
        next: !args.no_next,
        next_tries: args.next_tries.min(10_000),
        seed: args.seed,
    };
    // drawn only where standard error is a terminal
    let bar = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(120));
    let result = diagnose(&experiment, &settings, &|step| {
        bar.set_message(step.to_string())
    });
    bar.finish_and_clear();
    let d = result?;
    warn(&d.warnings);
    let report = json::json(&d, begin.elapsed().as_secs_f64());
    write(&paths[0], args.force, &pretty(&report))?;
    write(&paths[1], args.force, &page::html(&d))?;
    let robot = improve::robot(&experiment.plant, &d);
    write(&paths[2], args.force, &urdf(&robot))?;
    if serial {
        write(
            &paths[4],
            args.force,
            &improve::toml(&robot, &d, "robot.urdf"),
        )?;
        write(&paths[5], args.force, &improve::mujoco(&robot, &d))?;
    }
    match &d.next {
        Some(n) => n.trajectory.write(&paths[3], args.force)?,
        // that of an earlier diagnosis, which --force replaces
        None if args.force && paths[3].is_file() => {
            std::fs::remove_file(&paths[3]).map_err(|e| Error::io(&paths[3], e))?;
        }
        None => {}
    }
    if args.json {
        return print(&pretty(&report));
    }
    let mut out = format!("{}\n", page::sentence(&d).1);
    for f in d.findings.iter().filter(|f| f.member) {
        let place = match f.joints.is_empty() {
            true => "whole robot".to_string(),
            false => f.joints.join(", "),
        };
        let _ = writeln!(
            out,
            "\n{} ({place}): confidence {}, explains {}, {} on holdout",
            f.effect,
            percent(f.confidence),
            percent(f.explains),
            percent(f.holdout)
        );
        for v in &f.values {
            let _ = match v.std {
                Some(s) => writeln!(
                    out,
                    "  {:<26} {} ± {} {}",
                    v.name,
                    significant(v.value, 4),
                    significant(1.96 * s, 2),
                    v.unit
                ),
                None => writeln!(
                    out,
                    "  {:<26} {} {}",
                    v.name,
                    significant(v.value, 4),
                    v.unit
                ),
            };
        }
        if !f.same.is_empty() {
            let _ = writeln!(out, "  not told from {}", f.same.join(", "));
        }
    }
    if let Some(n) = &d.next {
        let _ = writeln!(
            out,
            "\nnext: {} separates {} (overlap {} now, {} predicted)",
            paths[3].display(),
            n.separates.join(" from "),
            percent(n.overlap[0]),
            percent(n.overlap[1])
        );
    }
    let _ = writeln!(
        out,
        "\n{} in {:.1} s",
        paths[1].display(),
        begin.elapsed().as_secs_f64()
    );
    print(&out)
}
