//! `excite diagnose EXPERIMENT`.

mod poses;

use super::{Folder, into, outside, pretty, print, unwritten, warn};
use excite::diagnose::parts::{MOST, Posterior, TABLE};
use excite::diagnose::{Settings, diagnose, json, page};
use excite::export;
use excite::export::parts::Model;
use excite::log::Experiment;
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
                  with the improved model, and effects.py where MuJoCo has no element for an effect; next.json, the motion that tells rivals apart or shows what these records cannot, of the joints or of the platform.\n\nOf a \
                  calibration.toml it says which kinematic effect the robot file lacks, and writes diagnosis.json, report.html and \
                  next.csv, postures that tell rivals apart.",
    after_help = "Examples:\n  excite diagnose experiment.toml\n  excite diagnose experiment.toml --output gap --json\n  excite \
                  diagnose experiment.toml --no-next\n  excite diagnose calibration.toml --output gap"
)]
pub struct Args {
    /// experiment.toml: the robot and its logs; or calibration.toml: the robot and what was seen of its tool
    experiment: PathBuf,
    /// Directory for the results
    #[arg(short, long, default_value = "out")]
    output: PathBuf,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// Write the model for these, too: sdf (Gazebo), usd, isaac-lab
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    also: Vec<String>,
    /// MJCF or URDF of the same robot, of which a copy with the result is written into the directory: only what
    /// differs is changed, comments and order stay
    #[arg(long, value_name = "SCENE")]
    into: Option<PathBuf>,
    /// Do not design the next motion
    #[arg(long)]
    no_next: bool,
    /// Random steps by which the best design of that motion is improved; counted, so that the same seed
    /// gives the same motion
    #[arg(
        long,
        value_name = "N",
        help = "Random steps by which the best design of that motion is improved; counted, so that the same seed gives the same motion [default: 64]"
    )]
    next_tries: Option<usize>,
    /// Draw N robots that the records do not exclude, for what you randomise: effects and their rivals by their
    /// confidence, all values with them; writes samples.csv and a folder of robot files for each
    #[arg(long, value_name = "N")]
    samples: Option<usize>,
    /// Seed of the random starts of that design, and of the samples
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Pressure outside of the cylinders, Pa, for logs with chamber pressures in place of forces; 0 where those are
    /// relative to it [default: 101325]
    #[arg(long, value_name = "PA")]
    atmosphere: Option<f64>,
    /// Print diagnosis.json to standard output instead of a summary
    #[arg(long)]
    json: bool,
}

/// The folder of sample `k`, with nothing in the way of its files.
fn samples(args: &Args, experiment: &Experiment, k: usize) -> Result<Folder> {
    let folder = args.output.join(Posterior::folder(k));
    Folder::new(&folder, &export::files(&experiment.plant), args.force)
}

/// Removes folders of samples from number `k` on: those that were made for this run, and robot files that an earlier one left.
fn outdated(args: &Args, k: usize) -> Result<()> {
    let made = args.samples.unwrap_or(0);
    let left =
        (k..if args.force { MOST } else { made }).map(|k| args.output.join(Posterior::folder(k)));
    for dir in left.take_while(|dir| dir.is_dir()) {
        let folder = Folder::new(&dir, &[], true)?;
        folder.robot(Vec::new())?;
        // what else is in it stays
        let _ = std::fs::remove_dir(dir);
    }
    Ok(())
}

pub fn run(args: Args) -> Result<()> {
    if excite::calibrate::is_calibration(&args.experiment) {
        return poses::run(args);
    }
    let begin = Instant::now();
    let mut experiment = Experiment::read(&args.experiment)?;
    experiment.press(outside(args.atmosphere.unwrap_or(101_325.0))?)?;
    let mut names = vec!["diagnosis.json", "report.html", "next.json"];
    names.extend(export::files(&experiment.plant));
    let further = export::further(&args.also, &experiment.plant)?;
    names.extend(further.iter().map(|f| f.file()));
    let scene = into::planned(&experiment.plant, args.into.as_deref(), &args.output)?;
    names.extend(scene.iter().map(String::as_str));
    names.push(TABLE);
    let folder = Folder::new(&args.output, &names, args.force)?;
    let count = args.samples.unwrap_or(0);
    if count > MOST {
        return Err(Error::Argument(format!(
            "--samples draws at most {MOST} robots, not {count}"
        )));
    }
    let samples = (0..count)
        .map(|k| samples(&args, &experiment, k))
        .collect::<Result<Vec<_>>>()?;
    let settings = Settings {
        next: !args.no_next,
        next_tries: args.next_tries.unwrap_or(64).min(10_000),
        samples: count,
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
    let mut d = result?;
    let model = Model {
        plant: &experiment.plant,
        robot: &d.improved.robot,
        remarks: &d.improved.remarks,
    };
    let mut texts = export::write(&model);
    texts.extend(further.iter().map(|f| (f.file(), f.write(&model))));
    let scene = into::edit(&model, args.into.as_deref(), &args.output, &mut texts)?;
    let mut more = model.warnings();
    more.extend(into::warnings(scene.as_ref()));
    more.extend(unwritten(&texts, "diagnosis.json"));
    d.warnings.extend(more);
    d.improved.scene = scene;
    warn(&d.warnings);
    let report = json::json(&d, begin.elapsed().as_secs_f64());
    folder.write("diagnosis.json", &pretty(&report))?;
    folder.write("report.html", &page::html(&d))?;
    folder.robot(texts)?;
    into::save(&folder, d.improved.scene.as_ref())?;
    match &d.posterior {
        Some(p) => {
            folder.write(TABLE, &p.csv())?;
            for (k, folder) in samples.iter().enumerate().take(p.samples.len()) {
                folder.robot(p.files(&experiment.plant, k))?;
            }
        }
        None => folder.remove(TABLE)?,
    }
    outdated(&args, d.posterior.as_ref().map_or(0, |p| p.samples.len()))?;
    match &d.next {
        Some(n) => n.trajectory.write(folder.path("next.json"), args.force)?,
        None => folder.remove("next.json")?,
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
            "\n{} ({place}): confidence {}, explains {}, {}",
            f.effect,
            percent(f.confidence),
            percent(f.explains),
            match f.holdout {
                Some(h) => format!("{} on holdout", percent(h)),
                // a load that some records carry shows in their parameters
                None if !f.records.is_empty() => format!("shown by {}", f.records.join(", ")),
                None if d.holdout.is_some() => "no gap on holdout".into(),
                None => "no holdout record".into(),
            }
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
    let held = d.improved.remarks.iter().zip(&d.improved.in_mujoco);
    let changed: Vec<String> = held
        .map(|(r, files)| format!("  {} ({}): {files}", r.effect, r.place))
        .collect();
    if !changed.is_empty() {
        let _ = writeln!(out, "\nin MuJoCo\n{}", changed.join("\n"));
    }
    out += &into::summary(d.improved.scene.as_ref());
    if let Some(p) = &d.posterior {
        let _ = writeln!(
            out,
            "\nsamples: {} robots in {}{}",
            p.samples.len(),
            folder.path(TABLE).display(),
            match p.covered() {
                Some(covered) => format!(
                    " and folders; the band for 95 % covers {} of the torque on holdout",
                    percent(covered)
                ),
                None => " and folders".into(),
            }
        );
    }
    if let Some(n) = &d.next {
        let _ = writeln!(
            out,
            "\nnext: {} separates {} (overlap {} now, {} predicted)",
            folder.path("next.json").display(),
            n.separates.join(" from "),
            percent(n.overlap[0]),
            percent(n.overlap[1])
        );
    }
    let _ = writeln!(
        out,
        "\n{} in {:.1} s",
        folder.path("report.html").display(),
        begin.elapsed().as_secs_f64()
    );
    print(&out)
}
