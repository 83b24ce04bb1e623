//! Recordings of a real arm, as its controller wrote them: standstill at both ends, a person who pushes, a load.

use crate::common::shared::shared;
use excite::diagnose::parts::Verdict;
use excite::diagnose::{Diagnosis, Settings, json, of_logs, page};
use excite::export::parts::Model;
use excite::export::write;
use excite::identify;
use excite::load;
use excite::log::{Experiment, Record};
use excite::plant::Plant;
use excite::robot::parts::JointTerm;
use excite::robot::parts::Prior;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Drive gains of the UR10e, N m/A.
const GAINS: [f64; 6] = [14.87, 13.26, 11.13, 10.62, 11.03, 11.47];

/// A folder of its own for a test.
fn folder(name: &str) -> PathBuf {
    let dir = std::env::temp_dir().join(format!("excite-real-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&dir).expect("a temporary folder");
    dir
}

/// Rows of a raw file of the UR10e (t, six positions, six velocities, six currents, …) in our log format, between two
/// times.
fn converted(raw: &Path, to: &Path, [from, until]: [f64; 2]) {
    let text = std::fs::read_to_string(raw).expect("a recording");
    let mut out = String::from("t,q1,q2,q3,q4,q5,q6,tau1,tau2,tau3,tau4,tau5,tau6\n");
    let (mut last, mut begin) = (f64::NEG_INFINITY, None);
    for line in text.lines() {
        let v: Vec<f64> = line.split(',').filter_map(|x| x.parse().ok()).collect();
        // corrupt stamps and rows
        if v.len() != 31 || v.iter().any(|x| !x.is_finite() || x.abs() > 1e6) || v[0] <= last {
            continue;
        }
        last = v[0];
        let t = v[0] - *begin.get_or_insert(v[0]);
        if t < from || t > until {
            continue;
        }
        let _ = write!(out, "{t:.4}");
        for j in 0..6 {
            let _ = write!(out, ",{:.6}", v[1 + j]);
        }
        for j in 0..6 {
            let _ = write!(out, ",{:.6}", GAINS[j] * v[13 + j]);
        }
        out.push('\n');
    }
    std::fs::write(to, out).expect("a log");
}

/// All rows.
const WHOLE: [f64; 2] = [0.0, f64::INFINITY];

/// An experiment of these logs: name, use, payload.
fn records(dir: &Path, robot: &str, all: &[(&str, &str, &str)]) -> Experiment {
    let mut text = format!("robot = \"{robot}\"\n");
    for (log, purpose, payload) in all {
        let _ = writeln!(
            text,
            "[[record]]\nlog = \"{log}.csv\"\nuse = \"{purpose}\"\n{payload}"
        );
    }
    let file = dir.join("experiment.toml");
    std::fs::write(&file, text).expect("an experiment");
    Experiment::read(&file).expect("a sound experiment")
}

fn diagnosed(plant: &Plant, logs: &[Record]) -> Diagnosis {
    let settings = Settings::default().with(|set| set.next = false);
    of_logs(plant, logs, &settings, &|_| {}).expect("a diagnosis")
}

#[test]
fn a_person_who_pushes_a_standing_arm_is_no_effect() {
    let Some(raw) = shared("data/ur10e_raw") else {
        return;
    };
    let dir = folder("push");
    converted(
        &raw.join("ur-20_01_22-push_pose_1.csv"),
        &dir.join("push.csv"),
        WHOLE,
    );
    let e = records(&dir, "ur10e", &[("push", "fit", "")]);
    let d = diagnosed(&e.plant, &e.records);
    assert_eq!(d.verdict, Verdict::Unknown);
    assert!(d.findings.iter().all(|f| !f.is_claim()), "{:?}", d.findings);
    assert!(!d.moves && d.at_rest.len() == 1 && d.at_rest[0].all);
    // what the person did is said to be that
    let pushed: Vec<&str> = d.at_rest[0].pushed.iter().map(|p| p.0.as_str()).collect();
    assert!(pushed.contains(&"shoulder_lift_joint"), "{pushed:?}");
    let said = page::sentence(&d).1;
    assert!(said.contains("nothing moves"), "{said}");
    let json = json::json(&d, 0.0);
    assert!(json["holdout_shrink"].is_null() && json["gap"]["any_function_of_the_state"].is_null());
    assert_eq!(json["at_rest"][0]["all"], true);
}

/// The robot file that `identify` writes from the empty arm.
fn identified(dir: &Path) -> Plant {
    let e = records(dir, "ur10e", &[("unload", "fit", "payload = \"none\"")]);
    let terms = [JointTerm::Viscous, JointTerm::Coulomb, JointTerm::Offset];
    let plant = e.plant.with_terms(&terms);
    let found = identify::identify(&plant, &e.records, &identify::Settings::default());
    let mut robot = plant.with_values(&found.expect("a model").phi);
    robot.prior = Prior::Identified;
    let model = Model {
        plant: &plant,
        robot: &robot,
        remarks: &[],
    };
    for (name, text) in write(&model) {
        std::fs::write(dir.join(name), text.expect("a file")).expect("a file");
    }
    let read = Plant::load(dir.join("robot.toml").to_str().expect("a path")).expect("a robot");
    assert_eq!(read.prior(), Prior::Identified);
    read
}

#[test]
fn a_load_is_named_whichever_record_is_held_out() {
    let Some(raw) = shared("data/ur10e_raw") else {
        return;
    };
    let dir = folder("load");
    for name in ["load", "unload"] {
        let raw = raw.join(format!("ur-20_01_31-{name}.csv"));
        converted(&raw, &dir.join(format!("{name}.csv")), WHOLE);
        // without the standstill at its ends
        converted(&raw, &dir.join(format!("{name}_cut.csv")), [5.0, 24.0]);
    }
    let plant = identified(&dir);
    let (none, unknown) = ("payload = \"none\"", "payload = \"unknown\"");
    let both = [("unload", "fit", none), ("load", "fit", unknown)];
    let both = records(&dir, "robot.toml", &both);
    let weighed = load::identify(&both, &load::Settings::default()).expect("a load");
    let mass = weighed.load().inertia.mass();
    for all in [
        vec![("load", "fit", "")],
        vec![("load", "fit", ""), ("unload", "holdout", "")],
        vec![("unload", "fit", ""), ("load", "holdout", "")],
        vec![("load_cut", "fit", "")],
        vec![("unload_cut", "fit", ""), ("load_cut", "holdout", "")],
    ] {
        let e = records(&dir, "robot.toml", &all);
        let d = diagnosed(&plant, &e.records);
        let none = || panic!("{all:?}: nothing is found");
        let first = d.findings.first().unwrap_or_else(none);
        let named = first.effect == "payload" && first.is_claim();
        assert!(named, "{all:?}: {first:?}");
        let found = first.values.iter().find(|v| v.name == "mass");
        let found = found.map_or(0.0, |v| v.value);
        let near = (found / mass - 1.0).abs() < 0.1;
        assert!(near, "{all:?}: {found} kg, load says {mass}");
        let explained = matches!(d.verdict, Verdict::Explained | Verdict::PartlyExplained);
        assert!(explained, "{all:?}: {:?}", d.verdict);
        println!(
            "{all:?}: {found:.3} kg ({:.2}), load says {mass:.3}",
            first.confidence
        );
    }
}
