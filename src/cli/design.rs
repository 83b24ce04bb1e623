//! `excite design ROBOT`.

pub mod diagnostic;

use super::{load, pretty, print, summary::summary, warn, write};
use excite::design::diagnostic::PERIODS;
use excite::design::parts::Control;
use excite::design::parts::{Condition, Progress, Question};
use excite::design::{Criterion, Settings, design_with};
use excite::identifiability::assess;
use excite::identifiability::{json::json, page};
use excite::output::prepare_dir;
use excite::simulate::effects::parse_payload;
use excite::trajectory::Trajectory;
use excite::trajectory::parts::{Ends, Grid, Space};
use excite::{Error, Plant, Result};
use indicatif::{ProgressBar, ProgressStyle};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Design an exciting trajectory and report on it before the run.
#[derive(clap::Args)]
#[command(
    long_about = "Design an exciting trajectory: a Fourier series for each joint (for each coordinate of \
                  the platform, or each actuator, of a parallel robot) that lets most parameters become known \
                  (or minimises the condition number of the regressor), inside position, \
                  velocity, acceleration, jerk and torque limits for all time.\n\nWrites \
                  trajectory.json, samples.csv, report.json and report.html. Ctrl-C keeps the best \
                  trajectory found so far.",
    after_help = "Examples:\n  excite design panda --output out\n  excite design hexapod --output out\n  excite design delta --coordinates actuators\n  excite design robot.toml --harmonics 7 \
                  --period 20 --derate 0.8 --time-limit 60\n  excite design arm.urdf --criterion d \
                  --identify armature,viscous,coulomb\n  excite design robot.toml --diagnostic --output diagnostic"
)]
pub struct Args {
    /// Bundled robot, robot.toml or URDF
    robot: String,
    /// Directory for the results
    #[arg(short, long, default_value = "out")]
    output: PathBuf,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// What the motion is for: a load that the robot carries, the platform or the legs of a parallel robot, or friction;
    /// sets criterion, unknowns, harmonics, period and periods [default: all base parameters]
    #[arg(long = "for", value_name = "load|platform|legs|friction", value_parser = named::<Question>, conflicts_with_all = ["criterion", "condition", "diagnostic"])]
    question: Option<Question>,
    /// With --for load: the load that the accuracy is stated for and that the limits allow for: kg, centre of mass in m and
    /// tensor about it in kg m², in the frame of the last body or platform [default: a cube of water as heavy as that
    /// body, or a twentieth of all bodies where that is more]
    #[arg(
        long,
        value_name = "MASS,X,Y,Z[,Ixx,Ixy,Ixz,Iyy,Iyz,Izz]",
        allow_hyphen_values = true
    )]
    payload: Option<String>,
    /// Harmonics of the Fourier series of each joint [default: 8 for --criterion known, otherwise and
    /// with --diagnostic 5; with --for what serves it]
    #[arg(long, allow_negative_numbers = true)]
    harmonics: Option<usize>,
    /// Period in seconds [default: 10; with --for what serves it]
    #[arg(long, allow_negative_numbers = true)]
    period: Option<f64>,
    /// Periods of the experiment [default: 1; 3 with --diagnostic, which wants at least so many; with --for what gives a
    /// minute]
    #[arg(long, allow_negative_numbers = true)]
    periods: Option<u32>,
    /// Harmonics used: full (1, 2, 3, …), odd, or random-odd (odd with one in four left out)
    #[arg(long, default_value = "full")]
    grid: Grid,
    /// Also make the motions that `excite diagnose` wants, all of odd harmonics: slow.json (the same
    /// path slower), reversals.json, holdout.json, their samples, and an experiment.toml that waits
    /// for the logs
    #[arg(long, conflicts_with = "grid")]
    diagnostic: bool,
    /// Ends: rest (zero velocity and acceleration) or free
    #[arg(long, default_value = "rest")]
    ends: Ends,
    /// What the Fourier series of a parallel robot move: the coordinates of its platform, or the
    /// positions of its actuators [default: platform, where there is one]
    #[arg(long, value_name = "platform|actuators", value_parser = named::<Space>)]
    coordinates: Option<Space>,
    /// Posture at the start, rad or m, one number per joint (or coordinate) [default: free]
    #[arg(
        long,
        value_name = "Q1,Q2,…",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    start: Option<Vec<f64>>,
    /// Criterion: known (as many base parameters as can be known to 10 % of their nominal value), condition
    /// (condition number), d, a or e
    #[arg(long, default_value = "known", value_parser = named::<Criterion>)]
    criterion: Criterion,
    /// Matrix judged by the other criteria: invariant, raw, normalised or weighted [default: invariant; normalised for
    /// parallel robots, whose parameters differ by orders of magnitude in size]
    #[arg(long, value_parser = named::<Condition>)]
    condition: Option<Condition>,
    /// Fraction of every limit that may be used; the rest is for the overshoot of the controller and
    /// for what the model does not know. 1: the limits of the robot file in full
    #[arg(long, default_value_t = 0.9, allow_negative_numbers = true)]
    derate: f64,
    /// Rate of samples.csv in Hz
    #[arg(long, default_value_t = 1000.0, allow_negative_numbers = true)]
    rate: f64,
    /// Seed of the random starts
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Most starts [default: 12, or 8 from 8 harmonics on; no limit where
    /// a time limit is given]
    #[arg(long, allow_negative_numbers = true)]
    starts: Option<usize>,
    /// Wall clock of the optimisation in seconds [default: 25, or none where starts are given]
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    time_limit: Option<f64>,
    /// Threads, 0 for one per core
    #[arg(long, default_value_t = 0, allow_negative_numbers = true)]
    threads: usize,
    /// Joint columns beside the ten of each link, for all joints: armature, viscous, coulomb,
    /// offset, or none [default: as in the robot file]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    identify: Option<Vec<String>>,
    #[command(flatten)]
    collisions: super::Collisions,
    /// Print report.json to standard output instead of a summary
    #[arg(long)]
    json: bool,
}

/// A value by its name in the settings.
fn named<T: serde::de::DeserializeOwned>(text: &str) -> std::result::Result<T, String> {
    serde_json::from_value(serde_json::Value::String(text.into())).map_err(|e| e.to_string())
}

pub fn run(args: Args) -> Result<()> {
    let begin = Instant::now();
    let plant = load(&args.robot, args.identify.as_deref())?.in_space(args.coordinates)?;
    let plant = args.collisions.apply(plant);
    let mut usual = usual(args.question, args.payload.as_deref())?;
    if args.question.is_none() {
        usual.harmonics = harmonics(args.criterion, args.diagnostic);
    }
    let settings = Settings {
        harmonics: args.harmonics.unwrap_or(usual.harmonics),
        period: args.period.unwrap_or(usual.period),
        periods: match (args.question, args.periods) {
            (Some(_), None) => usual.periods,
            (_, asked) => periods(asked, args.diagnostic)?,
        },
        grid: match args.diagnostic {
            true => Grid::Odd,
            false => args.grid,
        },
        ends: args.ends,
        start: args.start,
        criterion: match args.question {
            Some(_) => usual.criterion,
            None => args.criterion,
        },
        condition: match args.question {
            Some(_) => usual.condition,
            None => args.condition.unwrap_or(Condition::usual(&plant)),
        },
        question: args.question,
        payload: usual.payload,
        derate: args.derate,
        seed: args.seed,
        starts: args.starts,
        time_limit: args.time_limit,
        threads: args.threads,
        ..Settings::default()
    };
    settings.check(plant.moved())?;
    if let Some(question) = args.question {
        question.check(&plant)?;
    }
    check_rate(args.rate, &settings)?;
    let mut names = vec![
        "trajectory.json",
        "samples.csv",
        "report.json",
        "report.html",
    ];
    if args.diagnostic {
        names.extend(diagnostic::FILES);
    }
    if args.question == Some(Question::Load) {
        names.push("experiment.toml");
    }
    let files = prepare_dir(&args.output, &names, args.force)?;

    let interrupt = Arc::new(AtomicBool::new(false));
    let flag = interrupt.clone();
    // a second Ctrl-C ends the program at once
    let handler = move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    };
    if ctrlc::set_handler(handler).is_err() {
        eprintln!("warning: Ctrl-C cannot be caught here; it will lose the trajectory");
    }
    let bar = bar(&settings);
    let progress = |p: Progress| {
        bar.set_position(match p.planned {
            Some(_) => p.starts as u64,
            None => (p.seconds * 1000.0) as u64,
        });
        bar.set_message(format!("{} starts, best {:.4}", p.starts, p.best));
    };
    let control = Control {
        cancel: &interrupt,
        progress: &progress,
    };
    let result = design_with(&plant, &settings, &control);
    bar.finish_and_clear();
    let result = result?;

    // with the limits that were assumed
    let plant = result.plant;
    let assessment = assess(&plant, Some(&result.trajectory))?;
    warn(&assessment.warnings);
    result.trajectory.write(&files[0], args.force)?;
    samples(&plant, &result.trajectory, &files[1], args.force, args.rate)?;
    let set = match args.diagnostic {
        true => diagnostic::Set::new(&plant, &result.trajectory, &settings)?,
        false => diagnostic::Set::default(),
    };
    if args.question == Some(Question::Load) {
        let robot = diagnostic::robot_from(&args.output, &args.robot);
        let text = experiment(plant.name(), &robot, result.trajectory.fourier.period);
        write(&args.output.join("experiment.toml"), args.force, &text)?;
    }
    set.write(&plant, &args.robot, &args.output, args.force, args.rate)?;
    let mut json = json(
        &assessment,
        Some(&result.record),
        begin.elapsed().as_secs_f64(),
    );
    if args.diagnostic {
        json["motions"] = set.json();
    }
    write(&files[2], args.force, &pretty(&json))?;
    write(
        &files[3],
        args.force,
        &page::html(&assessment, Some(&result.record)),
    )?;
    match args.json {
        true => print(&pretty(&json)),
        false => {
            let summary = summary(&assessment, Some(&result.record), &files);
            print(&format!("{summary}{}", set.summary()))
        }
    }
}

/// Settings where nothing else is asked for: those that serve a question, with the load that it is about.
///
/// # Errors
/// A load that cannot be, or one that no question is about.
pub fn usual(question: Option<Question>, payload: Option<&str>) -> Result<Settings> {
    let payload = payload.map(parse_payload).transpose()?;
    match (question, payload) {
        (None, None) => Ok(Settings::default()),
        (Some(Question::Load), load) => Ok(Settings {
            payload: load.map(|l| l.quantities()),
            ..Question::Load.settings()
        }),
        (Some(question), None) => Ok(question.settings()),
        (_, Some(_)) => Err(Error::Argument(
            "--payload names the load of --for load; excite identifiability --payload judges any trajectory by it".into(),
        )),
    }
}

/// Harmonics where none are asked for. The motions of a diagnostic set have odd ones only, which reach twice as far.
pub fn harmonics(criterion: Criterion, diagnostic: bool) -> usize {
    match diagnostic {
        true => Settings::default().harmonics,
        false => criterion.harmonics(),
    }
}

/// The experiment of a load that waits for its two logs.
fn experiment(name: &str, robot: &str, period: f64) -> String {
    let robot = toml::Value::String(robot.into());
    let record = |log: &str, payload: &str| {
        format!(
            "\n[[record]]\nlog = \"{log}\"\nuse = \"fit\"\nperiod = {period:?}\npayload = \"{payload}\"\n"
        )
    };
    format!(
        "# Load of {name}, made by `excite design --for load`.\n\
         # Run trajectory.json for all its periods twice, within the same hour: empty, then with the load. Save the\n\
         # logs (t, q1.., and tau1.. or pressures pa1 pb1 ..) beside this file under the names below, then\n\
         #   excite load experiment.toml\n\
         # A third record with a weight of known mass, payload = {{ mass = 5.0 }}, tells the gains of the drives.\n\
         robot = {robot}\n{}{}",
        record("empty.csv", "none"),
        record("loaded.csv", "unknown"),
    )
}

/// Refuses a rate of samples that cannot be.
///
/// # Errors
/// [`Error::Argument`] with the rate.
pub fn check_rate(rate: f64, settings: &Settings) -> Result<()> {
    let length = rate * settings.period * f64::from(settings.periods);
    match rate > 0.0 && rate.is_finite() && length <= 1e7 {
        true => Ok(()),
        false => Err(Error::Argument(format!(
            "--rate must be more than 0 and give at most 1e7 samples, not {rate}"
        ))),
    }
}

/// Periods of the motion; a diagnosis wants at least three.
///
/// # Errors
/// Fewer for a diagnosis.
pub fn periods(asked: Option<u32>, diagnostic: bool) -> Result<u32> {
    match (asked, diagnostic) {
        (None, false) => Ok(1),
        (None, true) => Ok(PERIODS),
        (Some(n), true) if n < PERIODS => Err(Error::Argument(format!(
            "--diagnostic wants at least {PERIODS} periods, not {n}: noise is told from the gap by \
             what repeats"
        ))),
        (Some(n), _) => Ok(n),
    }
}

/// Writes the samples of a motion.
///
/// # Errors
/// A rate that cannot be; a file that cannot be written; a pose that cannot be reached.
pub fn samples(
    plant: &Plant,
    trajectory: &Trajectory,
    path: &Path,
    force: bool,
    rate: f64,
) -> Result<()> {
    let (fourier, periods) = (&trajectory.fourier, trajectory.periods);
    plant.write_motion(path, force, fourier, periods, rate)?;
    Ok(())
}

fn bar(settings: &Settings) -> ProgressBar {
    let (starts, seconds) = settings.budget();
    let (length, template) = match starts {
        usize::MAX => ((seconds * 1000.0) as u64, "{bar:30} {elapsed}  {msg}"),
        n => (n as u64, "{bar:30} {pos}/{len} starts, {elapsed}  {msg}"),
    };
    let bar = ProgressBar::new(length);
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar.enable_steady_tick(std::time::Duration::from_millis(200));
    bar
}
