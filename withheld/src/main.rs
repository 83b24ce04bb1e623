//! The check of the diagnosis on withheld effects; see `docs/withheld.md`.
//!
//! `cargo run --release -p withheld -- check --seed 1 --cases 60 --output target/withheld`

mod run;

use clap::{Args, Parser, Subcommand};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use withheld::{case, closed, effects, plan, write};

#[derive(Parser)]
#[command(about = "Check the diagnosis on robots whose effect is withheld")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Write cases and, apart from them, their answers
    Generate(Set),
    /// Write cases, run the diagnosis on each and score it
    Check {
        #[command(flatten)]
        set: Set,
        #[command(flatten)]
        run: run::Options,
    },
    /// Run the diagnosis on the cases of an existing set, and score it
    Score {
        /// Folder of the set: case_* and truth.json
        set: PathBuf,
        #[command(flatten)]
        run: run::Options,
    },
    /// How often names are right that were given with some confidence, over sets that were diagnosed before
    Reliability {
        /// Folders of the sets
        #[arg(required = true)]
        sets: Vec<PathBuf>,
        /// Picture to write
        #[arg(long, default_value = "target/reliability.svg")]
        picture: PathBuf,
    },
}

#[derive(Args)]
struct Set {
    /// Seed of the set: the same seed gives the same files
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of cases of a mixed set
    #[arg(long, default_value_t = 60)]
    cases: usize,
    /// Every effect at five sizes instead of a mixed set; a comma-separated list, or `all`
    #[arg(long, value_name = "EFFECTS")]
    ladder: Option<String>,
    /// Hexapods instead of arms
    #[arg(long, conflicts_with = "ladder")]
    closed: bool,
    /// Only the cases of these numbers, separated by commas
    #[arg(long, value_delimiter = ',')]
    only: Vec<usize>,
    /// Folder of the set
    #[arg(long, default_value = "target/withheld")]
    output: PathBuf,
    /// Replace an existing set
    #[arg(long)]
    force: bool,
}

fn plans(set: &Set) -> Result<Vec<case::Plan>, String> {
    let Some(list) = &set.ladder else {
        return Ok(plan::mixed(set.seed, set.cases));
    };
    if list == "all" {
        return Ok(plan::ladder(
            &effects::CATALOGUE.iter().map(|e| e.0).collect::<Vec<_>>(),
        ));
    }
    let names: Result<Vec<&'static str>, String> = list
        .split(',')
        .map(|n| {
            effects::entry(n.trim())
                .map(|e| e.0)
                .ok_or(format!("no effect is called {n}"))
        })
        .collect();
    Ok(plan::ladder(&names?))
}

fn at(path: &Path, e: &std::io::Error) -> String {
    format!("{}: {e}", path.display())
}

/// Writes the cases of a set and `truth.json` beside them.
fn generate(set: &Set) -> Result<(), String> {
    std::fs::create_dir_all(&set.output).map_err(|e| at(&set.output, &e))?;
    let path = set.output.join("truth.json");
    if path.exists() && !set.force {
        return Err(format!(
            "{} exists; give --force to replace the set",
            path.display()
        ));
    }
    // a set that is half replaced must not be scored by the answers to the old one
    if path.exists() {
        std::fs::remove_file(&path).map_err(|e| at(&path, &e))?;
    }
    let wanted = |index: usize| set.only.is_empty() || set.only.contains(&index);
    let folder = |index: usize| set.output.join(format!("case_{index:03}"));
    let cases: Result<Vec<serde_json::Value>, String> = match set.closed {
        true => (closed::plan::mixed(set.cases).par_iter())
            .filter(|p| wanted(p.index))
            .map(|plan| {
                let (case, folder) = (closed::case::build(set.seed, plan), folder(plan.index));
                closed::files::case(&case, set.seed, &folder).map_err(|e| at(&folder, &e))?;
                Ok(closed::files::truth(&case))
            })
            .collect(),
        false => (plans(set)?.par_iter())
            .filter(|p| wanted(p.index))
            .map(|plan| {
                let (case, folder) = (case::build(set.seed, plan)?, folder(plan.index));
                write::case(&case, &folder).map_err(|e| at(&folder, &e))?;
                eprintln!(
                    "case {:3} {:8} {}",
                    plan.index,
                    plan.kind,
                    plan.effects.join(" + ")
                );
                Ok(write::truth(&case))
            })
            .collect(),
    };
    let truth = serde_json::json!({ "seed": set.seed, "cases": cases? });
    let text = serde_json::to_string_pretty(&truth).map_err(|e| e.to_string())?;
    std::fs::write(&path, text + "\n").map_err(|e| at(&path, &e))
}

fn main() -> std::process::ExitCode {
    let result = match &Cli::parse().command {
        Command::Generate(set) => generate(set),
        Command::Check { set, run } => generate(set).and_then(|()| run::score(&set.output, run)),
        Command::Score { set, run } => run::score(set, run),
        Command::Reliability { sets, picture } => run::reliability(sets, picture),
    };
    match result {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            std::process::ExitCode::FAILURE
        }
    }
}
