//! Measured poses of a platform beside what its actuators read.

use crate::cli::Test;

/// `identify` of a hexapod whose log has the poses of the true machine.
#[test]
fn poses_that_the_geometry_contradicts_are_warned_of() {
    let t = Test::new();
    let run = |line: &str| {
        let out = t.run(line);
        assert_eq!(out.status, 0, "{line}: {}", out.stderr);
        out
    };
    run("new hexapod --output true");
    let text = std::fs::read_to_string(t.path().join("true/robot.toml")).unwrap();
    // 2 mm of the platform's radius, and 2 mm of every zero
    let off = (text.replacen("{ radius = 0.35,", "{ radius = 0.352,", 1)).replacen(
        "zero = 0.69 ",
        "zero = 0.692 ",
        1,
    );
    assert_ne!(text, off);
    std::fs::create_dir(t.path().join("off")).unwrap();
    std::fs::write(t.path().join("off/robot.toml"), off).unwrap();
    run("design true/robot.toml --starts 1 --harmonics 3 --no-collision --output d");
    for (log, seed) in [("empty", 1), ("holdout", 2)] {
        run(&format!(
            "simulate true/robot.toml d/trajectory.json --periods 2 --rate 100 --pose --seed {seed} --output {log}.csv"
        ));
    }
    let warned = |robot: &str| {
        let file = format!(
            "robot = \"{robot}/robot.toml\"\n[[record]]\nlog = \"empty.csv\"\nuse = \"fit\"\n[[record]]\nlog = \"holdout.csv\"\nuse = \"holdout\"\n"
        );
        std::fs::write(t.path().join(format!("{robot}.toml")), file).unwrap();
        run(&format!("identify {robot}.toml --output i_{robot}"));
        let report = t.json(&format!("i_{robot}/report.json"));
        let warnings = report["warnings"].as_array().unwrap().clone();
        let of = |w: &&serde_json::Value| w["kind"] == "pose_contradicts";
        let mine: Vec<String> = (warnings.iter().filter(of))
            .map(|w| w["message"].as_str().unwrap().to_owned())
            .collect();
        mine
    };
    assert!(warned("true").is_empty());
    let said = warned("off");
    assert_eq!(said.len(), 2, "{said:?}");
    for message in said {
        // the actuator, how much, and what to do
        assert!(
            message.contains("leg") && message.contains("2.3") && message.contains("mm"),
            "{message}"
        );
        assert!(message.contains("excite calibrate"), "{message}");
    }
}
