//! Motions for a purpose.

use super::*;

#[test]
fn diagnostic_motions_keep_the_limits_and_wait_for_logs() {
    let t = Test::new();
    let line = "design planar2 --diagnostic --starts 1 --harmonics 3 --period 4 --rate 50 --derate 0.8 --output set";
    let out = t.run(line);
    assert_eq!(out.status, 0, "{}", out.stderr);
    let report = t.json("set/report.json");
    let motions = report["motions"].as_array().unwrap();
    let of = |k: usize, key: &str| motions[k][key].as_f64().unwrap();
    assert_eq!(motions.len(), 4);
    for m in motions {
        assert_eq!(m["limits"]["satisfied"], true, "{m}");
        assert!(
            m["limits"]["worst"]["used"].as_f64().unwrap() <= 0.8 + 1e-9,
            "{m}"
        );
        assert_eq!(m["periods"], 3);
        let file = t.json(&format!("set/{}", m["file"].as_str().unwrap()));
        let lines = file["harmonics"].as_array().unwrap();
        assert!(lines.iter().all(|h| h.as_u64().unwrap() % 2 == 1), "{m}");
    }
    assert!(of(1, "period") > 1.4 * of(0, "period"));
    assert!(of(2, "reversals") > of(0, "reversals"));
    // each motion simulated and logged under the name that the experiment waits for
    for name in ["trajectory", "slow", "reversals", "holdout"] {
        let out = t.run(&format!(
            "simulate planar2 set/{name}.json --rate 100 --output set/{name}_log.csv"
        ));
        assert_eq!(out.status, 0, "{}", out.stderr);
    }
    let out = t.run("diagnose set/experiment.toml --no-next --output gap --json");
    assert_eq!(out.status, 0, "{}", out.stderr);
    let diagnosis: serde_json::Value = serde_json::from_str(&out.stdout).unwrap();
    assert_eq!(diagnosis["records"].as_array().unwrap().len(), 4);
    let simulated = &diagnosis["forward_simulation"];
    assert_eq!(simulated["records"][0]["record"], "holdout_log");
    assert!(
        simulated["records"][0]["joints"][1]["improved"]
            .as_f64()
            .is_some()
    );
    assert_eq!(simulated["not_simulated"], serde_json::json!([]));
    // a set is made whole or not at all, and not from what contradicts it
    t.fails(line, 1, &["exists"]);
    t.fails(
        "design planar2 --diagnostic --periods 2 --output b",
        2,
        &["at least 3"],
    );
    t.fails(
        "design planar2 --diagnostic --grid full --output b",
        2,
        &["--grid"],
    );
}

#[test]
fn series_of_the_actuators_are_designed_judged_and_simulated() {
    let t = Test::new();
    let out = t.run(
        "design delta --coordinates actuators --starts 1 --period 2 --harmonics 3 --rate 100 \
         --output a",
    );
    assert_eq!(out.status, 0, "{}", out.stderr);
    let file = t.json("a/trajectory.json");
    assert_eq!(file["coordinates"], "actuators");
    assert_eq!(file["joints"][2], "motor3");
    let report = t.json("a/report.json");
    assert_eq!(report["trajectory"]["coordinates"], "actuators");
    assert_eq!(report["platform"]["coordinates"][0], "x");
    assert_eq!(report["limits"]["satisfied"], true);
    let html = std::fs::read_to_string(t.path().join("a/report.html")).unwrap();
    assert!(html.contains("--coordinates actuators"));
    assert!(html.contains("follows from the series of the actuators"));
    let samples = std::fs::read_to_string(t.path().join("a/samples.csv")).unwrap();
    assert!(samples.starts_with("t,q1,q2,q3,") && samples.contains(",x,y,z,dx,"));
    // the file says how it is to be read
    let out = t.run("identifiability delta a/trajectory.json --output b");
    assert_eq!(out.status, 0, "{}", out.stderr);
    assert_eq!(
        t.json("b/report.json")["condition_number"],
        report["condition_number"]
    );
    let out = t.run("torque delta a/samples.csv");
    assert_eq!(out.status, 0, "{}", out.stderr);
    let last = |text: &str| -> f64 { text.trim_end().rsplit(',').next().unwrap().parse().unwrap() };
    let tau = samples.lines().nth(50).unwrap().split(',').nth(12).unwrap();
    let again = last(out.stdout.lines().nth(50).unwrap());
    assert!((tau.parse::<f64>().unwrap() - again).abs() < 1e-9);
    let out = t.run(
        "simulate delta a/trajectory.json --periods 3 --rate 200 --pose --output log.csv \
         --experiment experiment.toml",
    );
    assert_eq!(out.status, 0, "{}", out.stderr);
    let log = std::fs::read_to_string(t.path().join("log.csv")).unwrap();
    assert!(log.lines().next().unwrap().ends_with("x,y,z,qw,qx,qy,qz"));
    let out = t.run("identify experiment.toml --output c");
    assert_eq!(out.status, 0, "{}", out.stderr);

    t.fails(
        "design panda --coordinates platform --output d",
        2,
        &["panda", "has no platform"],
    );
    t.fails("design delta --coordinates legs", 2, &["legs", "actuators"]);
    t.fails(
        "identifiability hexapod a/trajectory.json --output e",
        1,
        &["trajectory.json", "motor1", "delta"],
    );
}

#[test]
fn a_motion_for_a_load_states_its_accuracy() {
    let t = Test::new();
    let load = "4,0.02,0,0.1,0.02,0,0,0.02,0,0.02";
    let out = t.run(&format!(
        "design delta --for load --payload {load} --starts 1 --harmonics 4 --output a"
    ));
    assert_eq!(out.status, 0, "{}", out.stderr);
    assert!(out.stdout.contains("load of 4.0000 kg"), "{}", out.stdout);
    let report = t.json("a/report.json");
    let c = &report["condition_number"];
    assert_eq!(c["headline"], "normalised");
    let headline = format!(
        "condition number of unit columns {:.3}",
        c["normalised"].as_f64().unwrap()
    );
    assert!(out.stdout.contains(&headline), "{headline}\n{}", out.stdout);
    assert_eq!(report["load"]["payload"]["mass"], 4.0);
    assert_eq!(report["verdict"]["grade"], "worthwhile");
    assert!(
        report["verdict"]["text"]
            .as_str()
            .unwrap()
            .contains("for a load")
    );
    assert_eq!(report["load"]["limits_satisfied"], true);
    assert!(report["load"]["std"]["mass"].as_f64().unwrap() > 0.0);
    // a platform that does not turn tells no tensor
    assert!(report["load"]["std"]["inertia_com"][0].is_null());
    assert_eq!(report["settings"]["for"], "load");
    // the experiment waits for its logs
    for (log, load) in [("empty", ""), ("loaded", &format!(" --payload {load}"))] {
        let line = format!(
            "simulate delta a/trajectory.json --periods 2 --rate 200 --output a/{log}.csv{load}"
        );
        let out = t.run(&line);
        assert_eq!(out.status, 0, "{}", out.stderr);
    }
    let found = t.run("load a/experiment.toml --output l");
    assert_eq!(found.status, 0, "{}", found.stderr);
    let mass = t.json("l/load.json")["mass"]["value"].as_f64().unwrap();
    assert!((mass - 4.0).abs() < 0.2, "{mass}");
    // any trajectory can be asked, and tells the same of the same load
    let again = t.run(&format!(
        "identifiability delta a/trajectory.json --payload {load} --output b"
    ));
    assert_eq!(again.status, 0, "{}", again.stderr);
    assert_eq!(t.json("b/report.json")["load"], report["load"]);
    assert!(t.run("identifiability planar2 --output c").status == 0);
    assert!(t.json("c/report.json")["load"].is_null());
}
