//! debug
use excite::diagnose::record::Raw;
use excite::{Error, Result};
use std::path::PathBuf;

/// Diagnose the gap between a model and its robot.
#[derive(clap::Args)]
pub struct Args {
    /// experiment
    experiment: PathBuf,
}

pub fn run(args: Args) -> Result<()> {
    let text = std::fs::read_to_string(&args.experiment).map_err(|e| Error::io(&args.experiment, e))?;
    let table: toml::Table = toml::from_str(&text).unwrap();
    let dir = args.experiment.parent().unwrap();
    let plant = excite::plant::Plant::load(dir.join(table["robot"].as_str().unwrap()).to_str().unwrap())?;
    let mut raws = Vec::new();
    for r in table["record"].as_array().unwrap() {
        let path = dir.join(r["log"].as_str().unwrap());
        let mut reader = csv::Reader::from_path(&path).unwrap();
        let head: Vec<String> = reader.headers().unwrap().iter().map(String::from).collect();
        let n = plant.actuators().len();
        let mut raw = Raw { name: r["log"].as_str().unwrap().to_string(), fit: r["use"].as_str() == Some("fit"), period: r.get("period").and_then(|p| p.as_float()), t: vec![], q: vec![vec![]; n], tau: vec![vec![]; n] };
        for row in reader.records() {
            let row = row.unwrap();
            for (h, v) in head.iter().zip(row.iter()) {
                let v: f64 = v.parse().unwrap();
                if h == "t" { raw.t.push(v) }
                for j in 0..n {
                    if *h == format!("q{}", j + 1) { raw.q[j].push(v) }
                    if *h == format!("tau{}", j + 1) { raw.tau[j].push(v) }
                }
            }
        }
        raws.push(raw);
    }
    excite::diagnose::explore(&plant, &raws)
}
