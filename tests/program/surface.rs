//! What the library shows: few modules, and results that can be serialised.

use excite::Plant;
use excite::design::{Settings, design};
use excite::identifiability::assess;
use serde_json::{Value, to_value};

/// Modules of a file that are documented: `pub mod` without `#[doc(hidden)]` in the line before.
fn shown(file: &str) -> Vec<String> {
    let path = format!("{}/src/{file}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).expect("read");
    let lines: Vec<&str> = text.lines().collect();
    (0..lines.len())
        .filter(|&i| i == 0 || lines[i - 1] != "#[doc(hidden)]")
        .filter_map(|i| lines[i].strip_prefix("pub mod ")?.strip_suffix(';'))
        .map(String::from)
        .collect()
}

/// A stage shows names, and one module `parts` of what these are made of: what a user needs is re-exported by its `mod.rs`.
#[test]
fn stages_show_names_and_no_module_but_parts() {
    let stages = shown("lib.rs");
    assert!(stages.len() < 20, "{stages:?}");
    for stage in ["design", "identify", "load", "diagnose", "simulate"] {
        assert!(stages.iter().any(|s| s == stage), "{stage} is not shown");
    }
    for stage in stages {
        let path = format!("{}/src/{stage}/mod.rs", env!("CARGO_MANIFEST_DIR"));
        if std::path::Path::new(&path).exists() {
            let modules = shown(&format!("{stage}/mod.rs"));
            assert!(
                modules.iter().all(|m| m == "parts"),
                "{stage} shows {modules:?}"
            );
        }
    }
}

/// Settings can gain a field without breaking a program that uses them: made by `default()`, changed by `with`.
#[test]
fn settings_can_grow() {
    for stage in ["design", "identify", "load", "diagnose", "simulate"] {
        let path = format!("{}/src/{stage}/settings.rs", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(path).expect("read");
        assert!(
            text.contains("#[non_exhaustive]\npub struct Settings"),
            "{stage}"
        );
    }
    let settings = Settings::default().with(|set| set.seed = 7);
    assert_eq!(settings.seed, 7);
    assert_eq!(
        settings.with(|set| set.seed = Settings::default().seed),
        Settings::default()
    );
}

#[test]
fn results_are_serialised() {
    fn serialisable<T: serde::Serialize>() {}
    serialisable::<excite::identify::Identification>();
    serialisable::<excite::load::Identified>();
    serialisable::<excite::diagnose::Diagnosis>();
    serialisable::<excite::simulate::Run>();
    serialisable::<excite::plant::parts::Certified>();

    serialisable::<excite::signals::Prepared>();

    let plant = Plant::load("planar2").unwrap();
    let written = to_value(&plant).unwrap();
    let body = &written["robot"]["bodies"][1];
    assert_eq!(body["name"], plant.robot().bodies[1].name);
    assert_eq!(body["inertia"][0], plant.robot().bodies[1].inertia.mass());
    assert_eq!(
        body["rotation"][0][0],
        plant.robot().bodies[1].rotation[(0, 0)]
    );
    assert_eq!(written["actuators"].as_array().unwrap().len(), 2);
    assert_eq!(written["mechanism"], Value::Null);
    assert_eq!(
        written["parameters"].as_array().unwrap().len(),
        plant.values().len()
    );
    let settings = Settings::default().with(|set| set.starts = Some(1));
    let found = design(&plant, &settings).unwrap();
    let designed = to_value(&found).unwrap();
    let file: Value = serde_json::from_str(&found.trajectory.to_json().unwrap()).unwrap();
    assert_eq!(designed["trajectory"], file);
    assert_eq!(designed["value"], found.value);

    let report = assess(&found.plant, Some(&found.trajectory)).unwrap();
    let assessed = to_value(&report).unwrap();
    let base = &assessed["base"];
    let k = base["k"].as_array().unwrap();
    assert_eq!(k.len(), report.base.count());
    for (i, row) in k.iter().enumerate() {
        let row = row.as_array().unwrap();
        assert_eq!(row.len(), report.base.dropped.len());
        for (j, value) in row.iter().enumerate() {
            assert_eq!(*value, report.base.k[(i, j)]);
        }
    }
    let excitation = report.excitation.unwrap();
    let of = &assessed["excitation"];
    assert_eq!(of["condition"]["invariant"], excitation.condition.invariant);
    assert_eq!(of["certificate"]["satisfied"], true);
    assert_eq!(of["trajectory"], file);
}

/// One plant for every robot: outside of `plant` and `mechanism` few lines ask whether something closes it (`docs/design.md`
/// says which and why).
#[test]
fn few_places_ask_for_the_kind_of_robot() {
    fn rust_files(folder: &std::path::Path, out: &mut Vec<std::path::PathBuf>) {
        for entry in std::fs::read_dir(folder).expect("read") {
            let path = entry.expect("read").path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            match path.is_dir() {
                true if !["plant", "mechanism", "tests"].contains(&name.as_str()) => {
                    rust_files(&path, out);
                }
                false if name.ends_with(".rs") && !name.starts_with("tests") => out.push(path),
                _ => {}
            }
        }
    }
    let mut files = Vec::new();
    let src = concat!(env!("CARGO_MANIFEST_DIR"), "/src");
    rust_files(std::path::Path::new(src), &mut files);
    assert!(files.len() > 300, "{}", files.len());
    let asks = [".mechanism()", ".closed()", ".looped()", ".space().is_"];
    let places: Vec<String> = files
        .iter()
        .flat_map(|path| {
            let text = std::fs::read_to_string(path).expect("read");
            let code = text.split("#[cfg(test)]").next().unwrap_or_default();
            let lines = code.lines().map(str::trim).enumerate();
            lines
                .filter(|(_, l)| !l.starts_with("//") && asks.iter().any(|a| l.contains(a)))
                .map(|(i, l)| format!("{}:{}: {l}", path.display(), i + 1))
                .collect::<Vec<_>>()
        })
        .collect();
    assert!(
        (8..=15).contains(&places.len()),
        "{} places:\n{}",
        places.len(),
        places.join("\n")
    );
}
