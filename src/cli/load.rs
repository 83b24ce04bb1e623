//! `excite load EXPERIMENT`.

use super::{Folder, outside, pretty, print, unwritten, warn, write};
use clap::ValueEnum;
use excite::export;
use excite::export::parts::Model;
use excite::load::parts::{Method, Parameters};
use excite::load::{self, Identified, Settings};
use excite::log::Experiment;
use excite::output::prepare_dir;
use excite::{Error, Result};
use std::fmt::Write as _;
use std::path::PathBuf;

/// Identify the load that a robot carries.
#[derive(clap::Args)]
#[command(
    long_about = "Identify the load that a robot carries: mass, centre of mass and inertia, from logs \
                  of its drives.\n\nEXPERIMENT is an experiment.toml. Records with payload = \
                  \"unknown\" carry the load, records with \"none\" are of the empty robot; without \
                  the latter the nominal model is subtracted. Records with a known payload, { mass, \
                  com, inertia }, identify the gains of the drives first. The motions may \
                  differ.\n\nWrites load.json and report.html.",
    after_help = "Examples:\n  excite load experiment.toml --output load\n  excite load \
                  experiment.toml --parameters mass-com\n  excite load experiment.toml --method \
                  two-step --json"
)]
pub struct Args {
    /// experiment.toml
    experiment: PathBuf,
    /// Directory for load.json and report.html
    #[arg(short, long, default_value = "out")]
    output: PathBuf,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// Unknowns: all ten parameters, or mass and centre of mass of a point mass
    #[arg(long, value_enum, default_value = "full")]
    parameters: What,
    /// Estimate that load.json holds: all parameters at once, or the two steps of Schulte & Gerland
    /// (platforms); the report shows both
    #[arg(long, value_enum, default_value = "one-step")]
    method: How,
    /// Do not take weight from samples near standstill
    #[arg(long)]
    unweighted: bool,
    /// Give the estimate as it is, even if no rigid body could have it
    #[arg(long)]
    unconstrained: bool,
    /// Go on where the log fits the robot only if it is read otherwise than stated: another unit or sign, exchanged
    /// legs, chambers or records
    #[arg(long)]
    unchecked: bool,
    /// Mean speed of the actuators at which samples begin to count in the two steps, rad/s or m/s
    /// [default: a fifth of its root mean square]
    #[arg(long, value_name = "SPEED")]
    standstill: Option<f64>,
    /// Pressure outside of the cylinders, Pa, for logs with chamber pressures; 0 where those are
    /// relative to it
    #[arg(long, value_name = "PA", default_value_t = 101_325.0)]
    atmosphere: f64,
    /// Cut-off of the positions before they are differentiated, Hz [default: from the data]
    #[arg(long, value_name = "HZ")]
    position_cutoff: Option<f64>,
    /// Cut-off of the filter that torques and model pass, Hz; inf for none [default: from the data]
    #[arg(long, value_name = "HZ")]
    cutoff: Option<f64>,
    /// Write the robot with the load, too: robot.toml and the other robot files
    #[arg(long)]
    robot: bool,
    /// Write the load for a controller, too: franka (endeffector-config.json for Desk), ur (set_target_payload.script),
    /// kuka (load_data.dat)
    #[arg(
        long = "for",
        value_enum,
        value_name = "CONTROLLER",
        value_delimiter = ','
    )]
    controllers: Vec<Controller>,
    /// Where the flange is in the frame of the body that carries the load, for the controllers: x,y,z in m and
    /// roll,pitch,yaw in rad
    #[arg(
        long,
        value_name = "POSE",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    flange: Option<Vec<f64>>,
    /// Print load.json to standard output instead of a summary
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum What {
    Full,
    MassCom,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Controller {
    Franka,
    Ur,
    Kuka,
}

impl Controller {
    fn file(self) -> &'static str {
        match self {
            Controller::Franka => "endeffector-config.json",
            Controller::Ur => "set_target_payload.script",
            Controller::Kuka => "load_data.dat",
        }
    }

    fn text(self, found: &Identified) -> Result<String> {
        let (load, flange) = (&found.load().inertia, &found.flange);
        match self {
            Controller::Franka => Ok(pretty(&load::controller::franka(load, flange)?)),
            Controller::Ur => load::controller::urscript(load, flange),
            Controller::Kuka => load::controller::kuka(load, flange),
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum How {
    OneStep,
    TwoStep,
}

pub fn run(args: Args) -> Result<()> {
    let atmosphere = outside(args.atmosphere)?;
    for (name, value) in [
        ("standstill", args.standstill),
        ("position-cutoff", args.position_cutoff),
        ("cutoff", args.cutoff),
    ] {
        if let Some(v) = value
            && (v.is_nan() || v <= 0.0)
        {
            return Err(Error::Argument(format!(
                "--{name} must be positive, not {v}"
            )));
        }
    }
    let mut settings = Settings {
        parameters: match args.parameters {
            What::Full => Parameters::Full,
            What::MassCom => Parameters::MassCom,
        },
        method: match args.method {
            How::OneStep => Method::OneStep,
            How::TwoStep => Method::TwoStep,
        },
        weighted: !args.unweighted,
        consistent: !args.unconstrained,
        checked: !args.unchecked,
        standstill: args.standstill,
        atmosphere,
        ..Settings::default()
    };
    if let Some(pose) = &args.flange {
        settings.flange = pose
            .as_slice()
            .try_into()
            .map_err(|_| Error::Argument("--flange is six numbers: x,y,z,roll,pitch,yaw".into()))?;
        if settings.flange.iter().any(|x| !x.is_finite()) {
            return Err(Error::Argument(
                "--flange holds a number that is not finite".into(),
            ));
        }
    }
    settings.signals.position_cutoff = args.position_cutoff;
    settings.signals.cutoff = args.cutoff;
    let experiment = Experiment::read(&args.experiment)?;
    let mut names = vec!["load.json", "report.html"];
    names.extend(args.controllers.iter().map(|c| c.file()));
    let own = names.len();
    if args.robot {
        names.extend(export::files(&experiment.plant));
    }
    let mut files = prepare_dir(&args.output, &names, args.force)?;
    files.truncate(own);
    let mut found = load::identify(&experiment, &settings)?;
    let texts = match args.robot {
        true => {
            let robot = found.loaded(&experiment.plant)?;
            let model = Model {
                plant: &experiment.plant,
                robot: &robot,
                remarks: &[],
            };
            found.warnings.extend(model.warnings());
            let texts = export::write(&model);
            found.warnings.extend(unwritten(&texts, "load.json"));
            texts
        }
        false => Vec::new(),
    };
    warn(&found.warnings);
    let json = load::json::json(&found);
    write(&files[0], args.force, &pretty(&json))?;
    write(&files[1], args.force, &load::page::html(&found))?;
    for (controller, file) in args.controllers.iter().zip(&files[2..]) {
        write(file, args.force, &controller.text(&found)?)?;
    }
    files.extend(Folder::new(&args.output, &[], args.force)?.robot(texts)?);
    match args.json {
        true => print(&pretty(&json)),
        false => print(&summary(&found, &files)),
    }
}

fn summary(found: &Identified, files: &[PathBuf]) -> String {
    let mut out = String::new();
    let mut line = |name: &str, body: &load::LoadBody| {
        let (v, s) = (body.values(), body.stds());
        let sure = load::json::determined(body);
        if !sure[0] {
            let _ = writeln!(
                out,
                "{name}: mass not determined ({:.3} ± {:.3} kg at 95 %)",
                v[0],
                1.96 * s[0]
            );
            return;
        }
        let _ = writeln!(
            out,
            "{name}: mass {:.4} ± {:.4} kg (95 %)",
            v[0],
            1.96 * s[0]
        );
        let _ = writeln!(
            out,
            "  centre of mass ({:.2}, {:.2}, {:.2}) ± ({:.2}, {:.2}, {:.2}) mm",
            1e3 * v[1],
            1e3 * v[2],
            1e3 * v[3],
            1.96e3 * s[1],
            1.96e3 * s[2],
            1.96e3 * s[3]
        );
        if body.known.iter().all(|k| *k) {
            let names = ["xx", "xy", "xz", "yy", "yz", "zz"];
            let entry = |k: usize| match sure[4 + k] {
                true => format!("{} {:.4} ± {:.4}", names[k], v[4 + k], 1.96 * s[4 + k]),
                false => format!("{} not determined", names[k]),
            };
            let all: Vec<String> = (0..6).map(entry).collect();
            let _ = writeln!(out, "  inertia about it: {} kg m²", all.join(", "));
        }
    };
    line(&format!("{}, one step", found.frame), &found.one_step.load);
    if let Some(two) = &found.two_step {
        line(&format!("{}, two steps", found.frame), &two.load);
    }
    for f in files {
        let _ = writeln!(out, "wrote {}", f.display());
    }
    out
}
