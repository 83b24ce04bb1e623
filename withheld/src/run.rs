//! Runs the diagnosis as its user does, on robot file and logs alone, and only then opens the answers.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;
use withheld::score::{self, Judged};
use withheld::{reliability, table};

#[derive(clap::Args)]
pub struct Options {
    /// The `excite` program; otherwise the one that was built beside this
    #[arg(long)]
    excite: Option<PathBuf>,
    /// Folder for diagnoses and results; otherwise `results` in the folder of the set
    #[arg(long)]
    results: Option<PathBuf>,
    /// Keep diagnoses that are there already
    #[arg(long)]
    keep: bool,
}

/// The program beside this one: `target/release/excite`.
fn program(options: &Options) -> Result<PathBuf, String> {
    if let Some(p) = &options.excite {
        return Ok(p.clone());
    }
    let own = std::env::current_exe().map_err(|e| e.to_string())?;
    let near = own.parent().map(|d| d.join("excite"));
    near.filter(|p| p.exists()).ok_or_else(|| {
        "no `excite` beside this program; build it (cargo build --release) or name it by --excite".into()
    })
}

fn read(path: &Path) -> Result<Value, String> {
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))
}

/// Cases that were judged, and those whose diagnosis failed with the reason.
type Scored = (Vec<Judged>, Vec<(String, String)>);

/// Diagnoses every case of `set`, then scores; tables go to standard output and to files.
pub fn score(set: &Path, options: &Options) -> Result<(), String> {
    let results = options
        .results
        .clone()
        .unwrap_or_else(|| set.join("results"));
    let (folders, seconds) = diagnoses(set, &results, options)?;
    let (judged, failed) = judge(set, &results, &folders, &seconds)?;
    let text = table::markdown(&judged, &failed);
    let write = |name: &str, text: &str| {
        let path = results.join(name);
        std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))
    };
    write("cases.csv", &table::csv(&judged))?;
    write("confusion.csv", &table::confusion(&judged))?;
    write("results.md", &text)?;
    print!("{text}");
    Ok(())
}

/// How often names are right that are given with some confidence, over sets that were diagnosed.
pub fn reliability(sets: &[PathBuf], picture: &Path) -> Result<(), String> {
    let mut all = Vec::new();
    for set in sets {
        let results = set.join("results");
        let mut folders = folders(set)?;
        folders.retain(|f| {
            let case = f.file_name().unwrap_or_default();
            results.join(case).join("diagnosis.json").exists()
        });
        let seconds = vec![0.0; folders.len()];
        let (judged, _) = judge(set, &results, &folders, &seconds)?;
        eprintln!("{}: {} cases", set.display(), judged.len());
        all.extend(judged);
    }
    print!("{}", reliability::table(&all));
    reliability::picture(&all, picture)
}

/// The cases of a set.
fn folders(set: &Path) -> Result<Vec<PathBuf>, String> {
    let mut folders: Vec<PathBuf> = std::fs::read_dir(set)
        .map_err(|e| format!("{}: {e}", set.display()))?
        .filter_map(|e| e.ok().map(|e| e.path()))
        .filter(|p| p.join("experiment.toml").exists())
        .collect();
    folders.sort();
    Ok(folders)
}

/// Diagnoses the cases of a set; the folders of the cases and how long each took, s.
fn diagnoses(
    set: &Path,
    results: &Path,
    options: &Options,
) -> Result<(Vec<PathBuf>, Vec<f64>), String> {
    let folders = folders(set)?;
    let mut seconds = Vec::new();
    for folder in &folders {
        let name = folder.file_name().unwrap_or_default();
        let out = results.join(name);
        let clock = Instant::now();
        let done = out.join("diagnosis.json").exists() && options.keep;
        if !done {
            diagnose(&program(options)?, folder, &out);
            eprintln!(
                "{} diagnosed in {:.1} s",
                name.to_string_lossy(),
                clock.elapsed().as_secs_f64()
            );
        }
        seconds.push(clock.elapsed().as_secs_f64());
    }
    Ok((folders, seconds))
}

/// Opens the answers, which nothing has read before.
fn judge(
    set: &Path,
    results: &Path,
    folders: &[PathBuf],
    seconds: &[f64],
) -> Result<Scored, String> {
    let truth = read(&set.join("truth.json"))?;
    let answers = truth["cases"]
        .as_array()
        .ok_or("truth.json has no `cases`")?;
    let mut judged: Vec<Judged> = Vec::new();
    let mut failed = Vec::new();
    for (folder, &seconds) in folders.iter().zip(seconds) {
        let name = folder
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .to_string();
        let Some(answer) = answers.iter().find(|a| a["case"].as_str() == Some(&name)) else {
            eprintln!("{name} is of another set (truth.json has no entry for it): left out");
            continue;
        };
        let result = read(&results.join(&name).join("diagnosis.json"))
            .and_then(|d| score::judge(answer, &d, seconds));
        match result {
            Ok(j) => judged.push(j),
            Err(e) => {
                // a diagnosis that fails has found nothing; it has given no false name either
                let nothing = serde_json::json!({ "verdict": "failed", "findings": [] });
                let lost = score::judge(answer, &nothing, seconds)?;
                if !lost.outcomes.is_empty() {
                    judged.push(lost);
                }
                failed.push((name, e));
            }
        }
    }
    Ok((judged, failed))
}

/// A failure leaves no `diagnosis.json` and is counted by the scorer.
fn diagnose(program: &Path, folder: &Path, out: &Path) {
    let _ = std::fs::create_dir_all(out);
    let _ = std::fs::remove_file(out.join("diagnosis.json"));
    let run = Command::new(program)
        .arg("diagnose")
        .arg(folder.join("experiment.toml"))
        .arg("--output")
        .arg(out)
        .arg("--force")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .output();
    let message = match run {
        Ok(o) if o.status.success() => return,
        Ok(o) => String::from_utf8_lossy(&o.stderr).into_owned(),
        Err(e) => format!("{}: {e}", program.display()),
    };
    eprintln!("{}: {}", folder.display(), message.trim());
}
