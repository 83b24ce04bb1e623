//! Whole experiments through the program: design, simulate, then identify or load.

use assert_cmd::Command;
use excite::Plant;
use serde_json::Value;
use std::path::Path;

/// Runs lines of the README, each of which must succeed without a panic; returns what was printed.
fn run(folder: &Path, lines: &[&str]) -> String {
    let mut all = String::new();
    for line in lines {
        let out = Command::cargo_bin("excite")
            .unwrap()
            .current_dir(folder)
            .args(line.split_whitespace())
            .output()
            .unwrap();
        let stderr = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.success(), "{line}\n{stderr}");
        all += &String::from_utf8_lossy(&out.stdout);
        all += &stderr;
    }
    all
}

fn json(folder: &Path, name: &str) -> Value {
    let text = std::fs::read_to_string(folder.join(name)).unwrap();
    serde_json::from_str(&text).unwrap()
}

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array()
        .unwrap()
        .iter()
        .map(|x| x.as_f64().unwrap())
        .collect()
}

/// Values and standard deviations of `load.json` against the truth.
fn load_is(load: &Value, mass: [f64; 2], com: ([f64; 3], f64), inertia: Option<([f64; 6], f64)>) {
    let of = |key: &str, k: usize| {
        let value = &load[key]["value"];
        let (v, s) = match value.is_array() {
            true => (&value[k], &load[key]["std"][k]),
            false => (value, &load[key]["std"]),
        };
        assert!(s.as_f64().unwrap() >= 0.0);
        v.as_f64().unwrap()
    };
    let m = of("mass", 0);
    assert!((m - mass[0]).abs() < mass[1], "{m} kg");
    for (k, c) in com.0.iter().enumerate() {
        assert!((of("com", k) - c).abs() < com.1, "{:?}", load["com"]);
    }
    if let Some((truth, within)) = inertia {
        for (k, i) in truth.iter().enumerate() {
            assert!(
                (of("inertia_com", k) - i).abs() < within,
                "{:?}",
                load["inertia_com"]
            );
        }
    }
}

const DESIGN: &str = "--period 2 --ends free --starts 1";

#[test]
fn a_load_on_a_hexapod() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let tensor = [0.26, 0.012, -0.02, 0.29, 0.015, 0.33];
    let record = "simulate hexapod motion/trajectory.json --periods 6 --rate 500 --step 1e-3 --experiment load/experiment.toml";
    run(
        at,
        &[
            &format!("design hexapod {DESIGN} --output motion"),
            &format!("{record} --output load/empty.csv --seed 1"),
            &format!(
                "{record} --output load/loaded.csv --seed 2 --payload 22.26,0.03,-0.02,0.12,0.26,0.012,-0.02,0.29,0.015,0.33"
            ),
            "load load/experiment.toml --output load/result",
        ],
    );
    let load = json(at, "load/result/load.json");
    load_is(
        &load,
        [22.26, 0.12],
        ([0.03, -0.02, 0.12], 2e-3),
        Some((tensor, 0.03)),
    );
    assert_eq!(load["method"], "one_step");
    assert_eq!(load["frame"], "platform");
    assert_eq!(numbers(&load["inertia_com"]["value"]).len(), 6);
    assert_eq!(load["physically_consistent"], true);
    assert!(at.join("load/result/report.html").is_file());
    // the published estimator beside it, and nothing replaced without --force
    let out = run(
        at,
        &["load load/experiment.toml --method two-step --output two --json"],
    );
    let start = out.find('{').unwrap();
    let two: Value = serde_json::Deserializer::from_str(&out[start..])
        .into_iter()
        .next()
        .unwrap()
        .unwrap();
    assert_eq!(two["method"], "two_step");
    load_is(&two, [22.26, 0.2], ([0.03, -0.02, 0.12], 5e-3), None);
    Command::cargo_bin("excite")
        .unwrap()
        .current_dir(at)
        .args(["load", "load/experiment.toml", "--output", "two"])
        .assert()
        .code(1);
}

#[test]
fn a_load_on_an_arm() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let record = "simulate ur5e motion/trajectory.json --periods 4 --rate 500 --step 1e-3";
    let body = "--payload 2.5,0.02,-0.01,0.08,0.008,0,0,0.009,0,0.006";
    run(
        at,
        &[
            "design ur5e --period 5 --ends free --starts 1 --output motion",
            &format!("{record} --output empty.csv --experiment both.toml --seed 1"),
            &format!("{record} --output loaded.csv --experiment both.toml --seed 2 {body}"),
            "load both.toml --output both",
            // of the loaded record alone, the robot being as its model says
            &format!(
                "{record} --output loaded.csv --force --experiment alone.toml --seed 2 {body}"
            ),
            "load alone.toml --output alone --parameters mass-com",
        ],
    );
    let load = json(at, "both/load.json");
    load_is(&load, [2.5, 0.05], ([0.02, -0.01, 0.08], 5e-3), None);
    assert_eq!(load["method"], "one_step");
    assert!(
        load["warnings"]
            .as_array()
            .unwrap()
            .iter()
            .all(|w| w["message"].is_string())
    );
    let alone = json(at, "alone/load.json");
    load_is(&alone, [2.5, 0.05], ([0.02, -0.01, 0.08], 5e-3), None);
    // the empty robot was taken as its model says: a warning tells so
    let told = |w: &Value| w["message"].as_str().unwrap().contains("nominal");
    assert!(
        alone["warnings"].as_array().unwrap().iter().any(told),
        "{:#}",
        alone["warnings"]
    );
}

/// The robot.toml that identification writes is the model, of a parallel robot as well.
#[test]
fn a_delta_is_identified_and_written() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let record = "simulate delta motion/trajectory.json --periods 4 --rate 500 --step 1e-3 --perturb 0.1 --experiment run.toml";
    run(
        at,
        &[
            &format!("design delta {DESIGN} --output motion"),
            &format!("design delta {DESIGN} --seed 2 --output other"),
            &format!("{record} --output fit.csv"),
            &format!(
                "{} --output check.csv --use holdout",
                record.replace("motion/", "other/")
            ),
            "identify run.toml --output model",
            "identifiability model/robot.toml motion/trajectory.json --output again",
        ],
    );
    let report = json(at, "model/report.json");
    let error = |key: &str| {
        report["validation"][key]["relative_error"]
            .as_f64()
            .unwrap()
    };
    assert!(
        error("fit") < 0.05 && error("holdout") < 0.05,
        "{} {}",
        error("fit"),
        error("holdout")
    );
    let model = json(at, "model/model.json");
    let values: Vec<f64> = (model["parameters"].as_array().unwrap().iter())
        .map(|p| p["value"].as_f64().unwrap())
        .collect();
    let nominal = Plant::load("delta").unwrap();
    let written = Plant::load(at.join("model/robot.toml").to_str().unwrap()).unwrap();
    assert_eq!(written.name(), "delta");
    let x = nominal.random_states(50, 3);
    let (a, b) = (
        nominal.torque(&x, &values).unwrap(),
        written.nominal_torque(&x).unwrap(),
    );
    for (a, b) in a.iter().zip(&b) {
        assert!((a - b).abs() < 1e-9 * (1.0 + a.abs()), "{a} {b}");
    }
    // without consistency masses may be negative, which no file carries: then it is said
    let out = run(at, &["identify run.toml --output free --consistency free"]);
    let there = at.join("free/robot.toml").exists();
    assert_eq!(there, !out.contains("robot.toml: not written"), "{out}");
}
