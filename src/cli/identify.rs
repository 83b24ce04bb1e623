//! `excite identify EXPERIMENT`.

use super::{Folder, into, outside, pretty, print, unwritten, warn};
use excite::export;
use excite::export::parts::Model;
use excite::identify::page;
use excite::identify::parts::{Consistency, Method};
use excite::identify::{Identification, Settings, condense_parts, identify, identify_parts, json};
use excite::log::{Outline, Record};
use excite::robot::parts::JointTerm;
use excite::{Plant, Result, Warning, WarningKind, survey};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

/// Rows of a part of a log that is read in parts.
const PART: usize = 240_000;

/// Identify the model from recorded runs.
#[derive(clap::Args)]
#[command(
    long_about = "Identify the model from recorded runs: base parameters with honest uncertainty, and standard \
                  parameters that a robot can have, validated on records that were not fitted.\n\nWrites \
                  model.json, robot.urdf (identified inertia and friction), robot.xml (the same for MuJoCo; \
                  serial robots), robot.toml, report.json and report.html.",
    after_help = "Examples:\n  excite identify experiment.toml\n  excite identify experiment.toml --output run1 \
                  --method robust --cutoff 20\n  excite identify experiment.toml --identify none --prior 100"
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
    /// Write the model for these, too: sdf (Gazebo), usd, isaac-lab
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    also: Vec<String>,
    /// MJCF or URDF of the same robot, of which a copy with the result is written into the directory: only what
    /// differs is changed, comments and order stay
    #[arg(long, value_name = "SCENE")]
    into: Option<PathBuf>,
    /// Estimator of the base parameters: ols, wls (full covariance between joints), robust (Huber,
    /// Tukey), ml (maximum likelihood from the scatter of periods), iv (instrumental variables
    /// from the commanded motion)
    #[arg(long, value_name = "NAME", default_value = "wls", value_parser = ["ols", "wls", "robust", "ml", "iv"])]
    method: String,
    /// Physical consistency: entropic (distance from the nominal bodies by log-determinant), lmi
    /// (semidefinite program, quadratic distance), free (none)
    #[arg(long, value_name = "NAME", default_value = "entropic", value_parser = ["entropic", "lmi", "free"])]
    consistency: String,
    /// Strength of the prior: 4 for nominal values good to 50 %, 100 for 10 % [default: by
    /// cross-validation]
    #[arg(long, value_name = "STRENGTH")]
    prior: Option<f64>,
    /// Cut-off of the filter that torque and regressor pass, Hz [default: ten times the bandwidth
    /// of the motion]
    #[arg(long, value_name = "HZ")]
    cutoff: Option<f64>,
    /// Cut-off of the positions, Hz [default: from their spectrum]
    #[arg(long, value_name = "HZ")]
    position_cutoff: Option<f64>,
    /// Do not average the periods of motion that repeats
    #[arg(long)]
    no_average: bool,
    /// Derive velocities and accelerations from positions even where the log has them
    #[arg(long)]
    derive: bool,
    /// Joint columns beside the ten of each link, for all joints: armature, viscous, coulomb,
    /// offset, stribeck (breakaway friction and its speed; beside coulomb), or none; of a parallel robot for all actuators [default: as in the robot file; viscous,
    /// coulomb and offset where that of a serial one lists none for any joint]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    identify: Option<Vec<String>>,
    /// Read the logs in parts of so many rows, and hold a few of them at a time; 0 reads them whole [default:
    /// 240000 where a CSV has more than 100 MB or a bag more than 50 MB, else 0]
    #[arg(long, value_name = "N")]
    rows: Option<usize>,
    /// Pressure outside of the cylinders, Pa, for logs with chamber pressures in place of forces; 0 where those are
    /// relative to it
    #[arg(long, value_name = "PA", default_value_t = 101_325.0)]
    atmosphere: f64,
    /// Print report.json to standard output instead of a summary
    #[arg(long)]
    json: bool,
}

/// Physical consistency by its name on the command line.
pub(super) fn consistency(name: &str) -> Consistency {
    match name {
        "lmi" => Consistency::Lmi,
        "free" => Consistency::Free,
        _ => Consistency::Entropic,
    }
}

pub fn run(args: Args) -> Result<()> {
    let begin = Instant::now();
    let outline = Outline::read(&args.experiment)?.pressed(outside(args.atmosphere)?);
    let asked = args.identify.as_deref();
    let mut notes = Vec::new();
    let plant = columns(outline.plant.clone(), asked, &mut notes)?;
    let plant = &plant;
    let mut settings = Settings {
        method: match args.method.as_str() {
            "ols" => Method::Ols,
            "robust" => Method::Robust,
            "ml" => Method::Ml,
            "iv" => Method::Iv,
            _ => Method::Wls,
        },
        consistency: consistency(&args.consistency),
        prior_strength: args.prior,
        ..Settings::default()
    };
    settings.signals.cutoff = args.cutoff;
    settings.signals.position_cutoff = args.position_cutoff;
    settings.signals.average = !args.no_average;
    settings.signals.measured_rates = !args.derive;
    let mut names = vec!["model.json", "report.json", "report.html"];
    names.extend(export::files(plant));
    let further = export::further(&args.also, plant)?;
    names.extend(further.iter().map(|f| f.file()));
    let scene = into::planned(plant, args.into.as_deref(), &args.output)?;
    names.extend(scene.iter().map(String::as_str));
    let folder = Folder::new(&args.output, &names, args.force)?;

    let rows = args.rows.unwrap_or(match outline.is_long() {
        true => PART,
        false => 0,
    });
    let mut id = match rows {
        0 => {
            let mut experiment = outline.whole()?;
            // what only a diagnosis asks for
            for record in &mut experiment.records {
                record.written = None;
            }
            notes.splice(0..0, survey::check(&experiment.plant, &experiment.records)?);
            identify(plant, &experiment.records, &settings)?
        }
        rows => {
            let check = |part: &Record| survey::check(&outline.plant, std::slice::from_ref(part));
            let condensed = condense_parts(&outline, plant, asked, rows, &settings, &check)?;
            identify_parts(plant, condensed)?
        }
    };
    id.warnings.splice(0..0, notes);
    let robot = id.robot(plant);
    let model = Model {
        plant,
        robot: &robot,
        remarks: &[],
    };
    let mut texts = export::write(&model);
    texts.extend(further.iter().map(|f| (f.file(), f.write(&model))));
    id.scene = into::edit(&model, args.into.as_deref(), &args.output, &mut texts)?;
    id.warnings.extend(into::warnings(id.scene.as_ref()));
    id.warnings.extend(model.warnings());
    id.warnings.extend(unwritten(&texts, "model.json"));
    warn(&id.warnings);
    let (_, verdict) = page::verdict(plant, &id);
    let report = json::report(
        plant,
        &id,
        &settings,
        &verdict,
        begin.elapsed().as_secs_f64(),
    );
    let mut written = vec![folder.write("model.json", &pretty(&json::model(plant, &id)))?];
    written.extend(folder.robot(texts)?);
    written.extend(into::save(&folder, id.scene.as_ref())?);
    written.push(folder.write("report.json", &pretty(&report))?);
    written.push(folder.write("report.html", &page::html(plant, &id, &settings))?);
    match args.json {
        true => print(&pretty(&report)),
        false => {
            let mut out = summary(&id, &verdict, &written, begin.elapsed().as_secs_f64());
            out += &into::summary(id.scene.as_ref());
            print(&out)
        }
    }
}

/// The joint columns: those asked for, those of the file, or the usual ones where it lists none.
///
/// # Errors
/// A name that there is not.
pub fn columns(plant: Plant, asked: Option<&[String]>, notes: &mut Vec<Warning>) -> Result<Plant> {
    // breakaway friction is no column
    let breakaway = asked.map(|names| names.iter().any(|n| n == "stribeck"));
    let linear = asked.map(|names| -> Vec<String> {
        names.iter().filter(|n| *n != "stribeck").cloned().collect()
    });
    let plant = match breakaway {
        Some(fit) => plant.fitting_stribeck(fit),
        None => plant,
    };
    let asked = linear.as_deref();
    let terms = super::terms(asked.unwrap_or_default())?;
    // the file of a parallel robot says what its unknowns are; those of its actuators can be chosen
    if plant.closed() && asked.is_none() {
        return Ok(plant);
    }
    let none = plant
        .actuators()
        .iter()
        .all(|j| !j.identify.contains(&true));
    match asked {
        Some(_) => Ok(plant.with_terms(&terms)),
        None if none => {
            notes.push(Warning::new(
                WarningKind::JointTermsAssumed,
                plant.name(),
                "its file lists no joint terms to identify; viscous and Coulomb friction and offset were \
                 identified for every joint (--identify none leaves them out)",
            ));
            Ok(plant.with_terms(&[JointTerm::Viscous, JointTerm::Coulomb, JointTerm::Offset]))
        }
        None => Ok(plant),
    }
}

fn summary(id: &Identification, verdict: &str, files: &[PathBuf], seconds: f64) -> String {
    let v = &id.validation;
    let percent = |x: f64| format!("{:.2} %", 100.0 * x);
    let mut out = String::new();
    let mut width = 0;
    for word in verdict.split(' ') {
        if width + word.chars().count() > 79 {
            out.push('\n');
            width = 0;
        }
        out.push_str(word);
        out.push(' ');
        width += word.chars().count() + 1;
    }
    out.push('\n');
    let pair = |name: &str, fit: f64, holdout: Option<f64>| {
        format!(
            "  {name:<28} fit {:>9}   holdout {:>9}\n",
            percent(fit),
            holdout.map_or("none".into(), percent)
        )
    };
    out.push_str("torque error\n");
    out += &pair("nominal", v.nominal.0, v.nominal.1);
    out += &pair("least squares alone", v.plain.0, v.plain.1);
    out += &pair("essential parameters alone", v.essential.0, v.essential.1);
    out += &pair(
        "this model",
        v.fit.relative_error,
        v.holdout.as_ref().map(|h| h.relative_error),
    );
    let _ = writeln!(
        out,
        "{} base parameters, {} essential; condition number {:.1}; prior strength {}",
        id.base.count(),
        id.essential.kept.len(),
        id.condition,
        id.prior_strength
    );
    if let Some(p) = id.prepared.first() {
        let _ = writeln!(
            out,
            "filtered at {:.2} Hz, {:.1} equations a second and joint; done in {seconds:.2} s",
            p.filter.cutoff,
            p.output_rate()
        );
    }
    for f in files {
        let _ = writeln!(out, "wrote {}", f.display());
    }
    out
}
