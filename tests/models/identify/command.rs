//! What the command writes.

use super::*;

/// The program: files, exit status, nothing replaced, and a robot.toml that is the model.
#[test]
fn the_command_writes_a_model_that_is_the_model() {
    let dir = tempfile::tempdir().unwrap();
    let (plant, phi) = truth("planar2", 6);
    let run = Run {
        noise: 0.05,
        periods: 3,
        ..Run::default()
    };
    for (name, motion) in [("fit", 11), ("holdout", 12)] {
        let r = record(&plant, &phi, Purpose::Fit, &Run { motion, ..run });
        let mut text = String::from("t,q1,q2,tau1,tau2\n");
        for i in 0..r.len() {
            text += &format!(
                "{},{},{},{},{}\n",
                r.t[i], r.q[0][i], r.q[1][i], r.tau[0][i], r.tau[1][i]
            );
        }
        std::fs::write(dir.path().join(format!("{name}.csv")), text).unwrap();
    }
    let experiment = dir.path().join("experiment.toml");
    std::fs::write(
        &experiment,
        "robot = \"planar2\"\n[[record]]\nlog = \"fit.csv\"\nuse = \"fit\"\nperiod = 5.0\n[[record]]\n\
         log = \"holdout.csv\"\nuse = \"holdout\"\n",
    )
    .unwrap();
    let out = dir.path().join("out");
    let excite = |more: &[&str]| {
        let mut c = assert_cmd::Command::cargo_bin("excite").unwrap();
        c.arg("identify").arg(&experiment).arg("--output").arg(&out);
        c.args(["--identify", "armature,viscous,coulomb,offset"])
            .args(more);
        c
    };
    excite(&[]).assert().success();
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    let report: serde_json::Value = serde_json::from_str(&read("report.json")).unwrap();
    assert!(
        report["validation"]["holdout"]["relative_error"]
            .as_f64()
            .unwrap()
            < 0.01
    );
    assert_eq!(report["physically_consistent"], true);
    let base = report["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|p| p["kind"] == "base")
        .count();
    assert_eq!(report["base_parameters"], base);
    // the written robot has the torques of the model
    let model: serde_json::Value = serde_json::from_str(&read("model.json")).unwrap();
    let values: Vec<f64> = model["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| p["value"].as_f64().unwrap())
        .collect();
    let written = Plant::load(out.join("robot.toml").to_str().unwrap()).unwrap();
    let states = plant.random_states(40, 5);
    let (a, b) = (
        plant.torque(&states, &values).unwrap(),
        written.nominal_torque(&states).unwrap(),
    );
    for (a, b) in a.iter().zip(&b) {
        assert!((a - b).abs() < 1e-9 * (1.0 + a.abs()), "{a} {b}");
    }
    assert!(read("robot.xml").contains("frictionloss") && read("report.html").contains("</html>"));
    // nothing is replaced without --force
    excite(&[]).assert().code(1);
    excite(&["--force", "--method", "robust"])
        .assert()
        .success();
    excite(&["--force", "--method", "magic"]).assert().code(2);
    excite(&["--force", "--prior", "-1"]).assert().code(2);
}
