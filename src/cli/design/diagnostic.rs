//! `excite design ROBOT --diagnostic`: the set of motions, and the experiment that waits for their
//! logs.

use super::{samples, write};
use excite::design::Settings;
use excite::design::diagnostic::{Motion, diagnostic_set};
use excite::identifiability::assess;
use excite::log::parts::Purpose;
use excite::robot::holds_robot;
use excite::trajectory::Trajectory;
use excite::{Error, Plant, Result};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::{Component, Path, PathBuf};

/// Files beside those of a design.
pub const FILES: [&str; 7] = [
    "slow.json",
    "slow.csv",
    "reversals.json",
    "reversals.csv",
    "holdout.json",
    "holdout.csv",
    "experiment.toml",
];

/// The motions with what the report says of them; empty where none are asked for.
#[derive(Default)]
pub struct Set {
    motions: Vec<(Motion, Value)>,
}

impl Set {
    /// Makes and certifies the motions about the designed one.
    ///
    /// # Errors
    /// As [`diagnostic_set`].
    pub fn new(plant: &Plant, main: &Trajectory, settings: &Settings) -> Result<Self> {
        let motions = diagnostic_set(plant, main, settings)?
            .into_iter()
            .map(|m| {
                let value = judged(plant, &m)?;
                Ok((m, value))
            })
            .collect::<Result<_>>()?;
        Ok(Set { motions })
    }

    /// Writes trajectories, samples and `experiment.toml`; the first motion is there already.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn write(
        &self,
        plant: &Plant,
        spec: &str,
        folder: &Path,
        force: bool,
        rate: f64,
    ) -> Result<()> {
        for (m, _) in self.motions.iter().skip(1) {
            let file = |extension: &str| folder.join(format!("{}.{extension}", m.name));
            m.trajectory.write(file("json"), force)?;
            samples(plant, &m.trajectory, &file("csv"), force, rate)?;
        }
        if self.motions.is_empty() {
            return Ok(());
        }
        let text = self.experiment(plant.name(), &robot_from(folder, spec));
        write(&folder.join("experiment.toml"), force, &text)
    }

    /// Entry `motions` of `report.json`.
    pub fn json(&self) -> Value {
        self.motions.iter().map(|(_, v)| v.clone()).collect()
    }

    /// Lines for the summary.
    pub fn summary(&self) -> String {
        let mut out = String::new();
        for (m, v) in &self.motions {
            let used = v["limits"]["worst"]["used"].as_f64().unwrap_or(0.0);
            let _ = writeln!(
                out,
                "{:<11} {} x {:.4} s, {} reversals, limits used to {:.0} %: {}",
                m.name,
                m.trajectory.periods,
                m.trajectory.fourier.period,
                m.reversals,
                100.0 * used,
                m.about
            );
        }
        out
    }

    /// The motions, the designed one first.
    pub fn motions(&self) -> impl Iterator<Item = &Motion> {
        self.motions.iter().map(|(m, _)| m)
    }

    /// The experiment that waits for the logs of a robot called `name`, whose file is `robot`.
    pub fn experiment(&self, name: &str, robot: &str) -> String {
        let quoted = |text: &str| toml::Value::String(text.into()).to_string();
        let mut out = format!(
            "# Diagnostic experiment of {name}, made by `excite design --diagnostic`.\n\
             # Run each motion for all its periods without a pause, log t, q1.., tau1.. (and qref1.. where\n\
             # there is one) from its start, save the logs beside this file under the names below, then\n\
             #   excite diagnose experiment.toml\n\
             # fit: the model is fitted to it; holdout: it is only predicted. A record that is not there\n\
             # is left out by deleting its block; one fit record is the least.\n\
             robot = {}\n",
            quoted(robot)
        );
        for (m, _) in &self.motions {
            let purpose = match m.purpose {
                Purpose::Fit => "fit",
                Purpose::Holdout => "holdout",
            };
            let _ = write!(
                out,
                "\n# {}.json: {}, {} periods of {} s\n[[record]]\nlog = \"{}_log.csv\"\nuse = \"{purpose}\"\nperiod = {:?}\n",
                m.name,
                m.about,
                m.trajectory.periods,
                m.trajectory.fourier.period,
                m.name,
                m.trajectory.fourier.period,
            );
        }
        out
    }
}

/// What the report says of a motion.
fn judged(plant: &Plant, m: &Motion) -> Result<Value> {
    let assessment = assess(plant, Some(&m.trajectory))?;
    let Some(e) = &assessment.excitation else {
        return Err(Error::Infeasible(format!("{}: nothing moves", m.name)));
    };
    let c = &e.certificate;
    Ok(json!({
        "file": format!("{}.json", m.name),
        "about": m.about,
        "period": m.trajectory.fourier.period,
        "periods": m.trajectory.periods,
        "reversals": m.reversals,
        "condition_number": e.condition,
        "limits": {
            "satisfied": c.satisfied,
            "worst": c.worst.as_ref().map(|w| json!({
                "joint": w.joint, "kind": w.kind.name(), "used": w.used,
            })),
        },
    }))
}

/// The robot as an `experiment.toml` in `folder` names it: a file relative to that folder, any other
/// name as it is.
pub(super) fn robot_from(folder: &Path, spec: &str) -> String {
    let parts = |path: &Path| -> Vec<PathBuf> {
        let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        let plain = |c: &Component| !matches!(c, Component::CurDir);
        absolute
            .components()
            .filter(plain)
            .map(|c| PathBuf::from(c.as_os_str()))
            .collect()
    };
    let file = Path::new(spec);
    if !holds_robot(file) {
        return spec.to_string();
    }
    let (from, to) = (parts(folder), parts(file));
    let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let up = std::iter::repeat_n(PathBuf::from(".."), from.len() - common);
    let path: PathBuf = up.chain(to[common..].iter().cloned()).collect();
    path.to_string_lossy().into_owned()
}
