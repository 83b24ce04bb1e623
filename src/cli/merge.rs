//! `excite merge FACTOR…`.

use super::identify::{columns, consistency};
use super::{Folder, into, pretty, print, unwritten, warn};
use excite::export;
use excite::export::parts::Model;
use excite::identify::parts::Method;
use excite::identify::{Factor, Settings, merge};
use excite::report::format::percent;
use excite::{Error, Plant, Result};
use std::fmt::Write as _;
use std::path::PathBuf;

/// Identify the model from condensed records.
#[derive(clap::Args)]
#[command(
    long_about = "Identify the model from any number of condensed records: the same base parameters as `excite identify` \
                  finds from all logs at once with the same --cutoff.\n\nWrites merged.json, report.html, robot.urdf, \
                  robot.xml (serial robots) and robot.toml.",
    after_help = "Examples:\n  excite merge day1.factor day2.factor --output fleet\n  excite merge *.factor --robot arm.toml \
                  --prior 4 --json"
)]
pub struct Args {
    /// Files of `excite condense`
    #[arg(required = true)]
    factors: Vec<PathBuf>,
    /// The robot [default: as it was named to condense]
    #[arg(long)]
    robot: Option<String>,
    /// Estimator of the base parameters
    #[arg(long, value_name = "NAME", default_value = "wls", value_parser = ["ols", "wls"])]
    method: String,
    /// Physical consistency, as of `excite identify`
    #[arg(long, value_name = "NAME", default_value = "entropic", value_parser = ["entropic", "lmi", "free"])]
    consistency: String,
    /// Strength of the prior [default: by cross-validation]
    #[arg(long, value_name = "STRENGTH")]
    prior: Option<f64>,
    /// Directory for the results
    #[arg(short, long, default_value = "out")]
    output: PathBuf,
    /// MJCF or URDF of the same robot, of which a copy with the result is written into the directory
    #[arg(long, value_name = "SCENE")]
    into: Option<PathBuf>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// Print merged.json to standard output instead of a summary
    #[arg(long)]
    json: bool,
}

pub fn run(args: Args) -> Result<()> {
    let mut factors = Vec::new();
    for path in &args.factors {
        let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
        factors.push(Factor::from_bytes(&bytes, path)?);
    }
    let Some(header) = factors.first().map(|f| f.header.clone()) else {
        return Err(Error::Argument("no factor is named".into()));
    };
    let spec = args.robot.as_deref().unwrap_or(&header.robot);
    // said when the records were condensed
    let mut said = Vec::new();
    let plant = columns(Plant::load(spec)?, header.identify.as_deref(), &mut said)?;
    let settings = Settings {
        method: match args.method.as_str() {
            "ols" => Method::Ols,
            _ => Method::Wls,
        },
        consistency: consistency(&args.consistency),
        prior_strength: args.prior,
        ..Settings::default()
    };
    let mut names = vec!["merged.json", "report.html"];
    names.extend(export::files(&plant));
    let scene = into::planned(&plant, args.into.as_deref(), &args.output)?;
    names.extend(scene.iter().map(String::as_str));
    let folder = Folder::new(&args.output, &names, args.force)?;
    let mut found = merge(&plant, factors, &settings)?;
    let robot = found.robot(&plant);
    let model = Model {
        plant: &plant,
        robot: &robot,
        remarks: &[],
    };
    let mut texts = export::write(&model);
    let scene = into::edit(&model, args.into.as_deref(), &args.output, &mut texts)?;
    found.warnings.extend(model.warnings());
    found.warnings.extend(unwritten(&texts, "merged.json"));
    found.warnings.extend(into::warnings(scene.as_ref()));
    warn(&found.warnings);
    let mut json = found.json(&plant);
    if let Some(scene) = &scene {
        json["into"] = serde_json::json!(scene);
    }
    let mut written = vec![folder.write("merged.json", &pretty(&json))?];
    written.push(folder.write("report.html", &found.html(&plant))?);
    written.extend(folder.robot(texts)?);
    written.extend(into::save(&folder, scene.as_ref())?);
    if args.json {
        return print(&pretty(&json));
    }
    let mut out = format!(
        "{} records for the fit, {} to predict only; {} base parameters, condition number {:.1}, prior strength {}\n",
        found.records[0].len(),
        found.records[1].len(),
        found.base.count(),
        found.condition,
        found.prior_strength
    );
    for (what, errors) in ["fit", "holdout"].iter().zip(&found.errors) {
        if let [Some(before), Some(after)] = errors {
            let _ = writeln!(
                out,
                "torque error, {what}: nominal {}, this model {}",
                percent(before.relative_error),
                percent(after.relative_error)
            );
        }
    }
    for file in written {
        let _ = writeln!(out, "wrote {}", file.display());
    }
    out += &into::summary(scene.as_ref());
    print(&out)
}
