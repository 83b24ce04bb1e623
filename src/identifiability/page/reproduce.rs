//! What is needed to get the same again.

use crate::design::record::Record;
use crate::design::settings::Settings;
use crate::identifiability::Assessment;
use crate::report::html::Section;
use crate::trajectory::Space;
use maud::html;

/// Command, settings, seed, hash and version.
pub(super) fn section(a: &Assessment, record: Option<&Record>) -> Section {
    let robot = &a.robot;
    let file = robot
        .path
        .as_ref()
        .map_or(robot.name.clone(), |p| p.display().to_string());
    let trajectory = a.excitation.as_ref().map(|e| &e.trajectory);
    let command = match (record, trajectory) {
        (Some(r), t) => design(&file, t.and_then(|t| t.space), &r.settings),
        (None, Some(_)) => format!("excite identifiability {} trajectory.json", quoted(&file)),
        (None, None) => format!("excite identifiability {}", quoted(&file)),
    };
    let settings = settings(a, record);
    let version = trajectory
        .map(|t| t.excite_version.as_str())
        .filter(|v| !v.is_empty() && *v != env!("CARGO_PKG_VERSION"));
    let body = html! {
        pre { (command) }
        dl {
            dt { "robot" } dd { (file) @if robot.path.is_none() { " (comes with the program)" } }
            dt { "SHA-256 of its files" } dd { code { (robot.hash) } }
            @if let Some(t) = trajectory {
                @if !t.robot_hash.is_empty() && t.robot_hash != robot.hash {
                    dt { "the trajectory was designed for" } dd { code { (t.robot_hash) } }
                }
            }
            dt { "excite" } dd { (env!("CARGO_PKG_VERSION"))
                @if let Some(v) = version { " (the trajectory was made by " (v) ")" } }
            @if let Some(seed) = seed(a, record) { dt { "seed" } dd { (seed) } }
            @if let Some(t) = trajectory {
                dt { "harmonics" } dd {
                    (t.fourier.harmonics.iter().map(u32::to_string).collect::<Vec<_>>().join(", "))
                    " of 1/" (t.fourier.period) " Hz (grid " (t.grid.name()) ", ends "
                    (t.ends.name()) ")"
                }
            }
        }
        @if let Some(text) = settings { p { "Settings of the design:" } pre { (text) } }
    };
    Section::new("To reproduce this", body)
}

/// Settings of the design as text, where they are known.
fn settings(a: &Assessment, record: Option<&Record>) -> Option<String> {
    if let Some(r) = record {
        return toml::to_string(&r.settings)
            .ok()
            .map(|t| t.trim_end().to_string());
    }
    let stored = &a.excitation.as_ref()?.trajectory.settings;
    match stored {
        serde_json::Value::Object(map) if !map.is_empty() => {
            serde_json::to_string_pretty(stored).ok()
        }
        _ => None,
    }
}

/// Seed of the design, where it is known.
pub(in crate::identifiability) fn seed(a: &Assessment, record: Option<&Record>) -> Option<u64> {
    record.map(|r| r.settings.seed).or_else(|| {
        let stored = &a.excitation.as_ref()?.trajectory.settings;
        stored.get("seed")?.as_u64()
    })
}

/// The command of a design, every setting spelt out.
fn design(file: &str, space: Option<Space>, s: &Settings) -> String {
    let mut parts = vec![format!("excite design {}", quoted(file))];
    if let Some(space) = space {
        parts.push(format!("--coordinates {}", word(space)));
    }
    parts.push(format!("--harmonics {}", s.harmonics));
    parts.push(format!("--period {}", s.period));
    parts.push(format!("--periods {}", s.periods));
    parts.push(format!("--grid {}", s.grid.name()));
    parts.push(format!("--ends {}", s.ends.name()));
    match s.question {
        Some(question) => parts.push(format!("--for {}", question.name())),
        None => {
            parts.push(format!("--criterion {}", word(s.criterion)));
            parts.push(format!("--condition {}", word(s.condition)));
        }
    }
    if let Some(load) = &s.payload {
        let load: Vec<String> = load.iter().map(f64::to_string).collect();
        parts.push(format!("--payload {}", load.join(",")));
    }
    parts.push(format!("--derate {}", s.derate));
    parts.push(format!("--seed {}", s.seed));
    if let Some(start) = &s.start {
        let posture: Vec<String> = start.iter().map(f64::to_string).collect();
        parts.push(format!("--start {}", posture.join(",")));
    }
    if let Some(starts) = s.starts {
        parts.push(format!("--starts {starts}"));
    }
    if let Some(seconds) = s.time_limit {
        parts.push(format!("--time-limit {seconds}"));
    }
    parts.join(" \\\n  ")
}

/// A setting's name as files and the command line write it.
fn word(value: impl serde::Serialize) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(text)) => text,
        _ => String::new(),
    }
}

/// An argument as a shell takes it.
fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text.to_string()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_spells_out_every_setting_and_quotes_the_file() {
        let command = design(
            "my robot's.toml",
            Some(Space::Actuators),
            &Settings::default(),
        );
        assert!(command.starts_with("excite design 'my robot'\\''s.toml'"));
        for part in [
            "--coordinates actuators",
            "--harmonics 5",
            "--period 10",
            "--grid full",
            "--ends rest",
            "--criterion condition",
            "--condition invariant",
            "--seed 1",
        ] {
            assert!(command.contains(part), "{part}: {command}");
        }
        assert_eq!(quoted("a/b-1.toml"), "a/b-1.toml");
    }
}
