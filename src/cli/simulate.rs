//! `excite simulate ROBOT TRAJECTORY`.

use super::{pretty, print, warn, write};
use clap::ValueEnum;
use excite::plant::Plant;
use excite::report::format::unit_of;
use excite::simulate::effects::parse_payload;
use excite::simulate::monte_carlo::{MonteCarlo, monte_carlo};
use excite::simulate::parts::{Controller, Field};
use excite::simulate::record::{Columns, Sensors, measure, write_log};
use excite::simulate::{Run, Settings, simulate};
use excite::trajectory::Trajectory;
use excite::trajectory::certificate::Kind;
use excite::{Error, Result};
use std::fmt::Write as _;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};

/// Rehearse an experiment: simulate the robot under a controller and write a log.
#[derive(clap::Args)]
#[command(
    long_about = "Rehearse an experiment: forward dynamics of the robot under a tracking controller \
                  with the friction, encoder steps and torque noise of the robot file, and with \
                  deviations from the nominal model where asked. Writes a log CSV (t, q1…, tau1…, \
                  qref1…) that every command reads which reads logs of the real robot.\n\nFriction \
                  sticks and slides exactly; the integrator is a Runge-Kutta method of fourth order \
                  whose steps are cut where a joint stops. The controller is continuous and knows \
                  the nominal model only.\n\nEffects have the names of the catalogue of `excite diagnose`. \
                  An effect `[JOINT=]VALUE` without a joint is meant for all actuators; the option can \
                  be given several times.",
    after_help = "Examples:\n  excite simulate panda out/trajectory.json --output fit.csv\n  excite \
                  simulate panda out/trajectory.json --output fit.csv --experiment experiment.toml\n  \
                  excite simulate hexapod out/trajectory.json --output loaded.csv \\\n      --payload \
                  22.26,0.03,-0.02,0.12,0.26,0.012,-0.02,0.29,0.015,0.33 --stribeck-friction 15,0.01\n  excite \
                  simulate ur5e out/trajectory.json --output log.csv --monte-carlo 100"
)]
pub struct Args {
    /// Bundled robot, robot.toml or URDF
    robot: String,
    /// trajectory.json of `excite design`
    trajectory: PathBuf,
    /// Log to write
    #[arg(short, long, value_name = "FILE.csv", default_value = "log.csv")]
    output: PathBuf,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// Also write an experiment.toml for this log; one that exists and names the same robot gets
    /// one more record
    #[arg(long, value_name = "FILE.toml")]
    experiment: Option<PathBuf>,
    /// What the record of --experiment is for
    #[arg(long = "use", value_enum, default_value = "fit")]
    purpose: Use,
    /// Periods to log [default: as in the trajectory]
    #[arg(long, value_name = "N")]
    periods: Option<u32>,
    /// Periods run before the log begins
    #[arg(long, value_name = "N", default_value_t = 1)]
    lead_in: u32,
    /// Samples a second, Hz
    #[arg(long, value_name = "HZ", default_value_t = 1000.0)]
    rate: f64,
    /// Largest step of the integrator, s
    #[arg(long, value_name = "SECONDS", default_value_t = 2.5e-4)]
    step: f64,
    /// Controller: nominal inverse dynamics along the reference and feedback, or gravity along the
    /// reference and feedback
    #[arg(long, value_enum, default_value = "feedforward")]
    controller: Control,
    /// Natural frequency of the tracking error, Hz
    #[arg(long, value_name = "HZ", default_value_t = 10.0)]
    bandwidth: f64,
    /// Damping ratio of the tracking error
    #[arg(long, value_name = "RATIO", default_value_t = 1.0)]
    damping: f64,
    /// Factor on the torque noise of the robot file; 0: ideal sensors, without encoder steps either
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    noise: f64,
    /// Seed of everything random
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Also log true velocities and accelerations, dq and ddq
    #[arg(long)]
    derivatives: bool,
    /// Also log the true pose of the platform, x y z qw qx qy qz (parallel robots)
    #[arg(long)]
    pose: bool,
    /// Log the pressures of both chambers of every cylinder, pa and pb, in place of forces: mean of the two, Pa (robots
    /// with `piston`)
    #[arg(long, value_name = "PA")]
    pressures: Option<f64>,
    /// Load on the last body or platform: kg, centre of mass (m), tensor about the centre of mass
    /// (kg m²)
    #[arg(
        long,
        value_name = "MASS,X,Y,Z[,Ixx,Ixy,Ixz,Iyy,Iyz,Izz]",
        allow_hyphen_values = true
    )]
    payload: Option<String>,
    /// Stribeck friction: breakaway force beyond Coulomb friction, N m or N, and velocity at which
    /// it has fallen to 1/e, rad/s or m/s
    #[arg(long, value_name = "[JOINT=]EXTRA,VELOCITY")]
    stribeck_friction: Vec<String>,
    /// Friction C v |v|
    #[arg(long, value_name = "[JOINT=]C")]
    nonlinear_viscous_friction: Vec<String>,
    /// Difference of the Coulomb friction between the directions, N m or N
    #[arg(long, value_name = "[JOINT=]DIFFERENCE", allow_hyphen_values = true)]
    friction_asymmetry: Vec<String>,
    /// Friction BETA |torque| sign(v)
    #[arg(long, value_name = "[JOINT=]BETA")]
    load_dependent_friction: Vec<String>,
    /// Factor on the measured torque: error of the torque constant
    #[arg(long, value_name = "[JOINT=]FACTOR")]
    torque_constant: Vec<String>,
    /// Added to the measured position, rad or m
    #[arg(long, value_name = "[JOINT=]OFFSET", allow_hyphen_values = true)]
    joint_offset: Vec<String>,
    /// Delay of the measured torque, s
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
    torque_delay: f64,
    /// Rotation of the base about its x and y axes that the model does not know, rad
    #[arg(long, value_name = "RX,RY", allow_hyphen_values = true)]
    gravity_direction: Option<String>,
    /// Random deviation of all bodies and joint terms from the nominal model, up to this fraction
    #[arg(long, value_name = "FRACTION", default_value_t = 0.0)]
    perturb: f64,
    /// Rehearse so many times and compare predicted with achieved spread of the base parameters;
    /// writes FILE_monte_carlo.json and .csv beside the log
    #[arg(long, value_name = "N")]
    monte_carlo: Option<usize>,
}

#[derive(Clone, Copy, ValueEnum)]
enum Use {
    Fit,
    Holdout,
}

#[derive(Clone, Copy, ValueEnum)]
enum Control {
    Feedforward,
    Pd,
}

pub fn run(args: Args) -> Result<()> {
    let trajectory = Trajectory::read(&args.trajectory)?;
    let plant = Plant::load(&args.robot)?
        .in_space(trajectory.space)
        .map_err(|e| Error::file(&args.trajectory, "coordinates", e.to_string()))?;
    let names = plant.coordinate_names();
    if trajectory.joints != names {
        return Err(Error::file(
            &args.trajectory,
            "joints",
            format!(
                "the trajectory moves {}, {} has {}; use the robot it was designed for ({})",
                trajectory.joints.join(", "),
                plant.name(),
                names.join(", "),
                trajectory.robot
            ),
        ));
    }
    let settings = settings(&args, &plant)?;
    let beside = |suffix: &str| {
        let stem = args.output.file_stem().unwrap_or_default();
        let name = format!("{}_monte_carlo.{suffix}", stem.to_string_lossy());
        args.output.with_file_name(name)
    };
    let (json, csv) = (beside("json"), beside("csv"));
    let mut files = vec![&args.output];
    if args.monte_carlo.is_some() {
        files.extend([&json, &csv]);
    }
    for file in files {
        if !args.force && file.symlink_metadata().is_ok() {
            return Err(Error::Exists(file.clone()));
        }
    }
    // before the work, so that nothing is lost to a folder that is not there
    for file in [Some(&args.output), args.experiment.as_ref()]
        .into_iter()
        .flatten()
    {
        if let Some(folder) = file.parent().filter(|f| !f.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, e))?;
        }
    }
    if !(args.noise >= 0.0 && args.noise.is_finite()) {
        return Err(Error::Argument(format!(
            "--noise is a factor of 0 or more, not {}",
            args.noise
        )));
    }
    if args.monte_carlo.is_some() && args.noise == 0.0 {
        return Err(Error::Argument(
            "--monte-carlo needs noise: --noise must not be 0".into(),
        ));
    }
    let (sensors, more) = Sensors::new(&plant, args.noise);
    let mut warnings = plant.warnings().to_vec();
    warnings.extend(more);
    let periods = args.periods.unwrap_or(trajectory.periods);
    let list = |path: &PathBuf| experiment(path, &args, trajectory.fourier.period, periods);
    let listed = args.experiment.as_ref().map(list).transpose()?;
    let bar = std::io::stderr().is_terminal().then(|| {
        let bar = indicatif::ProgressBar::new(1000);
        bar.set_style(
            indicatif::ProgressStyle::with_template("simulate {wide_bar} {percent:>3} %")
                .unwrap_or_else(|_| indicatif::ProgressStyle::default_bar()),
        );
        bar
    });
    let run = simulate(&plant, &trajectory.fourier, periods, &settings, &|done| {
        if let Some(bar) = &bar {
            bar.set_position((1000.0 * done) as u64);
        }
    })?;
    if let Some(bar) = &bar {
        bar.finish_and_clear();
    }
    warnings.extend(run.warnings.iter().cloned());
    warn(&warnings);
    if let Some(mean) = args.pressures
        && !(mean > 0.0 && mean.is_finite())
    {
        return Err(Error::Argument(format!(
            "--pressures is a mean pressure in Pa, not {mean}"
        )));
    }
    let measured = measure(&run, &sensors, &settings.effects, settings.seed);
    let columns = Columns {
        derivatives: args.derivatives,
        pose: args.pose,
        pressures: args.pressures,
    };
    write_log(&args.output, args.force, &plant, &run, &measured, columns)?;
    let mut out = summary(&plant, &run, &args, periods, trajectory.fourier.period);
    if let (Some(path), Some(text)) = (&args.experiment, &listed) {
        write(path, true, text)?;
        let _ = writeln!(out, "wrote {}", path.display());
    }
    if let Some(n) = args.monte_carlo {
        let result = monte_carlo(&plant, &trajectory.fourier, &run, &settings, &sensors, n)?;
        let value = serde_json::to_value(&result)
            .map_err(|e| Error::Infeasible(format!("monte_carlo.json: {e}")))?;
        write(&json, args.force, &pretty(&value))?;
        write(&csv, args.force, &table(&result))?;
        out.push_str(&spread(&result));
        let _ = writeln!(out, "wrote {}\nwrote {}", json.display(), csv.display());
    }
    print(&out)
}

fn settings(args: &Args, plant: &Plant) -> Result<Settings> {
    let mut settings = Settings {
        rate: args.rate,
        step: args.step,
        lead_in: args.lead_in,
        controller: match args.controller {
            Control::Feedforward => Controller::Feedforward,
            Control::Pd => Controller::Pd,
        },
        bandwidth: args.bandwidth,
        damping: args.damping,
        seed: args.seed,
        ..Settings::default()
    };
    let effects = &mut settings.effects;
    for (field, texts) in [
        (Field::Stribeck, &args.stribeck_friction),
        (Field::Quadratic, &args.nonlinear_viscous_friction),
        (Field::Asymmetry, &args.friction_asymmetry),
        (Field::LoadFriction, &args.load_dependent_friction),
        (Field::TorqueGain, &args.torque_constant),
        (Field::PositionOffset, &args.joint_offset),
    ] {
        for text in texts {
            effects.set(plant, field, text)?;
        }
    }
    effects.payload = args.payload.as_deref().map(parse_payload).transpose()?;
    effects.torque_delay = args.torque_delay;
    effects.perturb = args.perturb;
    if let Some(text) = &args.gravity_direction {
        let v: Vec<f64> = text
            .split(',')
            .filter_map(|x| x.trim().parse().ok())
            .collect();
        effects.tilt = match v[..] {
            [x, y] if x.abs() < 1.6 && y.abs() < 1.6 => [x, y],
            _ => {
                return Err(Error::Argument(format!(
                    "--gravity-direction takes RX,RY in rad (below a right angle), not `{text}`"
                )));
            }
        };
    }
    Ok(settings)
}

fn summary(plant: &Plant, run: &Run, args: &Args, periods: u32, period: f64) -> String {
    let mut out = String::new();
    let count = run.t.len();
    let _ = writeln!(
        out,
        "{}: {periods} periods of {period} s at {} Hz, {count} samples",
        plant.name(),
        args.rate
    );
    let mut worst = (0.0f64, 0);
    for a in 0..run.actuators.dof {
        for k in 0..count {
            let e = (run.actuators.q[a * count + k] - run.reference[a * count + k]).abs();
            if e > worst.0 {
                worst = (e, a);
            }
        }
    }
    let joints = plant.actuators();
    if let Some(joint) = joints.get(worst.1) {
        let unit = unit_of(Kind::Position, joint.motion);
        let _ = writeln!(
            out,
            "largest tracking error {:.3e} {unit} ({})",
            worst.0, joint.name
        );
    }
    let _ = writeln!(out, "wrote {}", args.output.display());
    out
}

/// The experiment with the record of this run: a new text, or the one that stands there with one more record.
///
/// # Errors
/// A file that cannot be read or is of another robot, or has this log with another use, period or payload.
fn experiment(path: &Path, args: &Args, period: f64, periods: u32) -> Result<String> {
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let relative = |file: &Path| -> String {
        let absolute = std::path::absolute(file).unwrap_or_else(|_| file.to_path_buf());
        let base = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
        match absolute.strip_prefix(&base) {
            Ok(inside) => inside.to_string_lossy().into_owned(),
            Err(_) => absolute.to_string_lossy().into_owned(),
        }
    };
    let robot = match Path::new(&args.robot).is_file() {
        true => relative(Path::new(&args.robot)),
        false => args.robot.clone(),
    };
    let log = relative(&args.output);
    let mut record = toml::Table::new();
    let mut set = |key: &str, value: toml::Value| record.insert(key.into(), value);
    set("log", log.clone().into());
    set(
        "use",
        match args.purpose {
            Use::Fit => "fit".into(),
            Use::Holdout => "holdout".into(),
        },
    );
    if periods > 1 {
        set("period", period.into());
    }
    if args.payload.is_some() {
        set("payload", "unknown".into());
    }
    let quoted = |text: &str| toml::Value::String(text.into()).to_string();
    let mut text = match std::fs::read_to_string(path) {
        Ok(old) => old,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            format!("robot = {}\n", quoted(&robot))
        }
        Err(e) => return Err(Error::io(path, e)),
    };
    let whole: toml::Table = text
        .parse()
        .map_err(|e: toml::de::Error| Error::file(path, "", e.message()))?;
    if whole.get("robot").and_then(toml::Value::as_str) != Some(&robot) {
        let message = format!("is of another robot than {robot}; choose another --experiment");
        return Err(Error::file(path, "", message));
    }
    let records = whole.get("record").and_then(toml::Value::as_array);
    let mut records = records.into_iter().flatten().filter_map(|r| r.as_table());
    match records.find(|r| r.get("log").and_then(toml::Value::as_str) == Some(&log)) {
        Some(old) => {
            let value = |of: &toml::Table, key: &str| {
                let value = of.get(key)?.clone();
                // 5 is 5.0
                Some(value.as_integer().map_or(value, |x| (x as f64).into()))
            };
            let differs = |key: &&&str| value(old, key) != value(&record, key);
            if let Some(key) = ["use", "period", "payload"].iter().find(differs) {
                let shown = |r: &toml::Table| r.get(*key).map_or("none".into(), |v| v.to_string());
                let message = format!(
                    "has a record of {log} whose {key} is {}, not {}: remove that record, or choose another --output or \
                     --experiment",
                    shown(old),
                    shown(&record)
                );
                return Err(Error::file(path, "", message));
            }
        }
        None => {
            text.push_str("\n[[record]]\n");
            for key in ["log", "use", "period", "payload"] {
                if let Some(value) = record.get(key) {
                    let _ = writeln!(text, "{key} = {value}");
                }
            }
        }
    }
    Ok(text)
}

/// The table that is printed.
fn spread(m: &MonteCarlo) -> String {
    let mut out = format!(
        "{} rehearsals, cut-off {:.1} Hz: achieved over predicted spread, median {:.2}\n",
        m.rehearsals, m.cutoff, m.median_ratio
    );
    let _ = writeln!(
        out,
        "{:<24} {:>12} {:>11} {:>11} {:>7} {:>11}",
        "base parameter", "value", "predicted", "achieved", "ratio", "bias"
    );
    for p in &m.parameters {
        let name: String = p.parameter.chars().take(24).collect();
        let _ = writeln!(
            out,
            "{name:<24} {:>12.4e} {:>11.2e} {:>11.2e} {:>7.2} {:>11.2e}",
            p.truth,
            p.predicted,
            p.achieved,
            p.achieved / p.predicted,
            p.bias
        );
    }
    out
}

fn table(m: &MonteCarlo) -> String {
    let mut out = String::from("parameter,unit,value,predicted_std,achieved_std,bias\n");
    for p in &m.parameters {
        let _ = writeln!(
            out,
            "{},{},{},{},{},{}",
            p.parameter, p.unit, p.truth, p.predicted, p.achieved, p.bias
        );
    }
    out
}
