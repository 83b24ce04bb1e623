//! Recordings of real robots.

use super::*;

fn recorded(name: &str) -> Option<Experiment> {
    let folder = shared(&format!("data/{name}"))?;
    Some(Experiment::read(folder.join("experiment.toml")).unwrap())
}

/// Without the recordings a test passes, and is not silent: the line is there although nothing asks for the output.
#[test]
fn a_test_without_its_recordings_says_so() {
    let nothing = tempfile::tempdir().unwrap();
    let out = std::process::Command::new(std::env::current_exe().unwrap())
        .args([
            "identify::recorded::emps_gives_the_published_values",
            "--exact",
        ])
        .env("EXCITE_SHARED", nothing.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{said}");
    assert!(said.contains("skipped: ../shared/data/emps"), "{said}");
}

#[test]
fn emps_gives_the_published_values() {
    let Some(e) = recorded("emps") else { return };
    // a strength at which the prior, which holds the published values, does nothing
    let settings = Settings::default().with(|set| set.prior_strength = Some(1e-2));
    let id = identify(&e.plant, &e.records, &settings).unwrap();
    for (name, value) in [
        ("carriage.m", 95.1),
        ("slide.viscous", 203.5),
        ("slide.coulomb", 20.4),
        ("slide.offset", -3.16),
    ] {
        let k = (0..id.base.count())
            .find(|&k| id.base.name(k) == name)
            .unwrap();
        for x in [id.pi[k], id.pi_consistent[k]] {
            assert!((x / value - 1.0).abs() < 0.01, "{name}: {x}");
        }
    }
    let v = &id.validation;
    println!(
        "emps: fit {:.4}, holdout {:?}",
        v.fit.relative_error, v.plain.1
    );
    assert!(v.fit.relative_error < 0.0408 && v.plain.1.unwrap() < 0.046);
    // the published 2475 samples of 24.75 s hold a band of 50 Hz
    let mut settings = settings;
    settings.signals.cutoff = Some(50.0);
    let id = identify(&e.plant, &e.records, &settings).unwrap();
    let error = id.validation.fit.relative_error;
    println!("emps, 50 Hz: fit {error:.4}");
    assert!((error - 0.0408).abs() < 0.0005, "{error}");
}

#[test]
fn panda_predicts_its_second_half() {
    let Some(e) = recorded("panda") else { return };
    let terms = [JointTerm::Viscous, JointTerm::Coulomb, JointTerm::Offset];
    let plant = e.plant.with_terms(&terms);
    let id = identify(&plant, &e.records, &Settings::default()).unwrap();
    let h = id.validation.holdout.as_ref().unwrap().relative_error;
    println!(
        "panda: fit {:.4} holdout {h:.4}, plain {:?}",
        id.validation.fit.relative_error, id.validation.plain
    );
    assert!(h < 0.015 && id.consistent);
}

#[test]
fn tx40_is_better_than_plain_least_squares_and_says_what_is_left() {
    let Some(e) = recorded("tx40") else { return };
    let id = identify(&e.plant, &e.records, &Settings::default()).unwrap();
    let v = &id.validation;
    let h = v.holdout.as_ref().unwrap().relative_error;
    println!(
        "tx40: fit {:.4} holdout {h:.4}, plain {:?}, {:?}",
        v.fit.relative_error, v.plain, v.followers
    );
    assert!(h < 0.155 && id.consistent);
    // the coupled wrist: the residual of axis 5 goes with axis 6
    assert!(
        v.followers
            .iter()
            .any(|f| f.actuator == 4 && f.what.contains("joint_6")),
        "{:?}",
        v.followers
    );
}
