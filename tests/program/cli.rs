//! The program as a user runs it: results, exit status, messages, and nothing lost.

mod motions;
mod refused;
mod words;

use assert_cmd::Command;
use std::path::Path;
use tempfile::TempDir;

/// One run in an empty directory of its own.
pub struct Test {
    dir: TempDir,
}

pub struct Outcome {
    pub status: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Test {
    pub fn new() -> Self {
        Test {
            dir: tempfile::tempdir().unwrap(),
        }
    }

    pub fn file(self, name: &str, content: impl AsRef<[u8]>) -> Self {
        std::fs::write(self.dir.path().join(name), content).unwrap();
        self
    }

    pub fn path(&self) -> &Path {
        self.dir.path()
    }

    pub fn run(&self, line: &str) -> Outcome {
        let out = Command::cargo_bin("excite")
            .unwrap()
            .current_dir(self.path())
            .args(line.split_whitespace())
            .timeout(std::time::Duration::from_secs(120))
            .output()
            .unwrap();
        Outcome {
            status: out.status.code().unwrap_or(-1),
            stdout: String::from_utf8_lossy(&out.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&out.stderr).into_owned(),
        }
    }

    /// Runs a line that must fail with this status and one message that holds all the words.
    pub fn fails(&self, line: &str, status: i32, words: &[&str]) {
        let out = self.run(line);
        assert_eq!(out.status, status, "{line}\n{}", out.stderr);
        assert!(!out.stderr.contains("panicked"), "{line}\n{}", out.stderr);
        assert!(out.stdout.is_empty(), "{line} printed {}", out.stdout);
        for word in words {
            assert!(
                out.stderr.contains(word),
                "{line}: no `{word}` in\n{}",
                out.stderr
            );
        }
    }

    pub fn json(&self, name: &str) -> serde_json::Value {
        let text = std::fs::read_to_string(self.path().join(name)).unwrap();
        serde_json::from_str(&text).unwrap()
    }
}

fn planar() -> &'static str {
    excite::robot::bundled::find("planar2").unwrap().urdf
}

#[test]
fn design_writes_everything_and_replaces_nothing() {
    let t = Test::new();
    let line = "design planar2 --starts 2 --rate 100 --periods 2 --output results";
    let out = t.run(line);
    assert_eq!(out.status, 0, "{}", out.stderr);
    assert!(
        out.stderr.is_empty(),
        "no progress outside a terminal: {}",
        out.stderr
    );
    assert!(
        out.stdout.contains("all hold for all time"),
        "{}",
        out.stdout
    );
    assert!(
        out.stdout.lines().all(|l| l.chars().count() <= 80),
        "{}",
        out.stdout
    );

    let report = t.json("results/report.json");
    assert_eq!(report["robot"], "planar2");
    assert_eq!(report["base_parameters"], 6);
    assert_eq!(report["joints"].as_array().unwrap().len(), 2);
    for key in ["invariant", "raw", "normalised", "weighted"] {
        assert!(
            report["condition_number"][key].as_f64().unwrap() >= 1.0,
            "{key}"
        );
    }
    assert!(report["rank_gap"].as_f64().unwrap() > 1e6);
    assert!(report["log_det"].is_f64() && report["seconds"].is_f64());
    assert_eq!(report["limits"]["satisfied"], true);
    assert!(report["limits"]["worst"]["used"].as_f64().unwrap() <= 1.0);
    assert!(report["limits"]["worst"]["joint"].is_string());
    assert!(report["limits"]["worst"]["kind"].is_string());
    assert_eq!(report["relative_std"].as_array().unwrap().len(), 6);
    assert!(report["relative_std"][0]["combination"].is_string());

    let samples = std::fs::read_to_string(t.path().join("results/samples.csv")).unwrap();
    let mut lines = samples.lines();
    assert_eq!(lines.next().unwrap(), "t,q1,q2,dq1,dq2,ddq1,ddq2,tau1,tau2");
    assert_eq!(lines.count(), 2001);
    let html = std::fs::read_to_string(t.path().join("results/report.html")).unwrap();
    assert!(html.contains("<svg") && html.len() < 2_000_000);

    // the torques of the file are those of `torque`
    let torque = t.run("torque planar2 results/samples.csv");
    assert_eq!(torque.status, 0, "{}", torque.stderr);
    for (a, b) in samples
        .lines()
        .zip(torque.stdout.lines())
        .skip(1)
        .step_by(97)
    {
        let a: Vec<f64> = a.split(',').map(|x| x.parse().unwrap()).collect();
        let b: Vec<f64> = b.split(',').map(|x| x.parse().unwrap()).collect();
        assert!(
            (a[7] - b[1]).abs() < 1e-9 && (a[8] - b[2]).abs() < 1e-9,
            "{a:?} {b:?}"
        );
    }

    let before = std::fs::read(t.path().join("results/trajectory.json")).unwrap();
    t.fails(line, 1, &["exists", "--force"]);
    assert_eq!(
        before,
        std::fs::read(t.path().join("results/trajectory.json")).unwrap()
    );
    assert_eq!(t.run(&format!("{line} --force --seed 2")).status, 0);
    assert_ne!(
        before,
        std::fs::read(t.path().join("results/trajectory.json")).unwrap()
    );

    // the trajectory goes through `identifiability` and gets the same numbers
    let out = t.run("identifiability planar2 results/trajectory.json --output check");
    assert_eq!(out.status, 0, "{}", out.stderr);
    let again = t.json("results/report.json");
    let check = t.json("check/report.json");
    assert_eq!(again["condition_number"], check["condition_number"]);
}

#[test]
fn robots_and_new() {
    let t = Test::new().file("arm.urdf", planar());
    let out = t.run("robots");
    assert_eq!(out.status, 0);
    assert!(out.stdout.contains("panda") && out.stdout.contains("scara"));
    let out = t.run("new arm.urdf");
    assert_eq!(out.status, 0, "{}", out.stderr);
    let t = t.file("robot.toml", &out.stdout);
    let out = t.run("identifiability robot.toml --json --output r");
    assert_eq!(out.status, 0, "{}", out.stderr);
    let json: serde_json::Value = serde_json::from_str(&out.stdout).unwrap();
    assert_eq!(json["base_parameters"], 6);
}

/// A bare URDF without limits, inertia or meshes that exist: warnings, and all commands work.
#[test]
fn a_urdf_from_the_wild() {
    let urdf = r#"<robot name="wild">
      <link name="base"/>
      <link name="a"><inertial><mass value="2"/><origin xyz="0 0.1 0.2"/>
        <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
        <visual><geometry><mesh filename="package://nowhere/a.stl"/></geometry></visual></link>
      <link name="b"/>
      <link name="finger"><inertial><mass value="0.1"/>
        <inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="j1" type="continuous"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/></joint>
      <joint name="j2" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 0.4"/>
        <axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="0" velocity="0"/></joint>
      <joint name="j3" type="prismatic"><parent link="b"/><child link="finger"/><axis xyz="0 0 1"/>
        <limit lower="0" upper="0.04" effort="20" velocity="0.2"/></joint>
    </robot>"#;
    let t = Test::new().file("wild.urdf", urdf);
    let out = t.run("identifiability wild.urdf --output r");
    assert_eq!(out.status, 0, "{}", out.stderr);
    assert!(out.stderr.contains("warning"), "{}", out.stderr);
    let report = t.json("r/report.json");
    let warnings = report["warnings"].as_array().unwrap();
    for kind in ["limits_missing", "inertia_missing", "torque_noise_assumed"] {
        assert!(
            warnings.iter().any(|w| w["kind"] == kind),
            "{kind}: {warnings:#?}"
        );
    }
    let whole = |w: &serde_json::Value| {
        w["kind"].is_string() && w["subject"].is_string() && w["message"].is_string()
    };
    assert!(warnings.iter().all(whole), "{warnings:#?}");
    let out = t.run("design wild.urdf --starts 1 --output d");
    assert_eq!(out.status, 0, "{}", out.stderr);
    assert!(out.stderr.contains("assumed"), "{}", out.stderr);
    assert_eq!(t.json("d/report.json")["limits"]["satisfied"], true);
    let html = std::fs::read_to_string(t.path().join("d/report.html")).unwrap();
    assert!(html.contains("assumed for the design"));
}

/// Ctrl-C keeps the best trajectory found so far.
#[cfg(unix)]
#[test]
fn interrupt_keeps_the_best() {
    let t = Test::new();
    let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin("excite"))
        .current_dir(t.path())
        .args(["design", "planar2", "--starts", "1000000", "--output", "i"])
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_millis(1500));
    let killed = std::process::Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(killed.success());
    let status = child.wait().unwrap();
    assert_eq!(status.code(), Some(0));
    assert_eq!(t.json("i/report.json")["limits"]["satisfied"], true);
    assert_eq!(t.json("i/report.json")["status"], "interrupted");
}

/// The template can be used where it was written, as it is and with its lock.
#[test]
fn a_new_robot_file_works_where_it_was_written() {
    let t = Test::new();
    std::fs::create_dir_all(t.path().join("description/arms")).unwrap();
    std::fs::create_dir_all(t.path().join("else/where")).unwrap();
    std::fs::write(t.path().join("description/arms/two.urdf"), planar()).unwrap();
    let out = t.run("new description/arms/two.urdf --output robots/two.toml");
    assert_eq!(out.status, 0, "{}", out.stderr);
    t.fails(
        "new description/arms/two.urdf --output robots/two.toml",
        1,
        &["--force"],
    );
    // as a shell does with `>`
    let file = std::fs::File::create(t.path().join("else/where/two.toml")).unwrap();
    let done = std::process::Command::new(assert_cmd::cargo::cargo_bin("excite"))
        .current_dir(t.path())
        .args(["new", "description/arms/two.urdf"])
        .stdout(file)
        .status()
        .unwrap();
    assert!(done.success());
    for (k, robot) in ["robots/two.toml", "else/where/two.toml"]
        .into_iter()
        .enumerate()
    {
        let text = std::fs::read_to_string(t.path().join(robot)).unwrap();
        if k == 0 || cfg!(target_os = "linux") {
            assert!(text.contains("/description/arms/two.urdf\""), "{text}");
            let out = t.run(&format!("identifiability {robot} --output free{k}"));
            assert_eq!(out.status, 0, "{}", out.stderr);
        }
    }
    // its lock line, as it stands there
    let text = std::fs::read_to_string(t.path().join("robots/two.toml")).unwrap();
    let locked = text.replacen("# lock = ", "lock = ", 1);
    assert_ne!(text, locked);
    std::fs::write(t.path().join("robots/locked.toml"), locked).unwrap();
    let out = t.run("identifiability robots/locked.toml --output locked");
    assert_eq!(out.status, 0, "{}", out.stderr);
    assert!(!out.stderr.contains("lock"), "{}", out.stderr);
    assert_eq!(
        t.json("locked/report.json")["joints"],
        serde_json::json!(["joint1"])
    );
    // out of the range of the pipes: the working directory
    let out = t.run("new description/arms/two.urdf");
    assert!(
        out.stdout.contains("\"description/arms/two.urdf\""),
        "{}",
        out.stdout
    );
}

/// A header of other names is shown, with what is expected.
#[test]
fn a_log_with_other_names_is_named() {
    let t = Test::new()
        .file(
            "e.toml",
            "robot = \"planar2\"\n[[record]]\nlog = \"a.csv\"\nuse = \"fit\"\n",
        )
        .file(
            "a.csv",
            "time,alpha,beta,gamma,delta\n0,0,0,0,0\n0.01,0,0,0,0\n",
        );
    let words = [
        "a.csv",
        "positions of joint1, joint2",
        "[record.columns]",
        "excite log",
    ];
    for command in ["identify", "diagnose", "load"] {
        t.fails(&format!("{command} e.toml --output o"), 1, &words);
    }
}

#[test]
fn a_new_parallel_robot_has_a_campaign() {
    for name in ["hexapod", "h4", "delta"] {
        let t = Test::new();
        let out = t.run(&format!("new {name} --output machine"));
        assert_eq!(out.status, 0, "{}", out.stderr);
        t.fails(
            &format!("new {name} --output machine"),
            1,
            &["robot.toml", "--force"],
        );
        let text = std::fs::read_to_string(t.path().join("machine/robot.toml")).unwrap();
        assert!(text.starts_with("# To be filled in"), "{text}");
        assert_eq!(text.contains("piston"), name == "hexapod");
        // the same machine as the bundled one, but for its comments
        let ours: toml::Table = toml::from_str(&text).unwrap();
        let bundled = excite::mechanism::bundled::find(name).unwrap();
        assert_eq!(ours, toml::from_str::<toml::Table>(bundled.toml).unwrap());
        let design = "design machine/robot.toml --for load --starts 1 --harmonics 4 --no-collision --output d";
        let out = t.run(design);
        assert_eq!(out.status, 0, "{}", out.stderr);
        for (log, more) in [
            ("empty", ""),
            ("holdout", " --seed 2"),
            (
                "loaded",
                " --seed 3 --payload 1,0,0,0.02,0.001,0,0,0.001,0,0.001",
            ),
        ] {
            let out = t.run(&format!("simulate machine/robot.toml d/trajectory.json --periods 2 --rate 200 --output machine/{log}.csv{more}"));
            assert_eq!(out.status, 0, "{}", out.stderr);
        }
        // every command reads it
        let out = t.run("load machine/experiment.toml --output l");
        assert_eq!(out.status, 0, "{}", out.stderr);
        let out =
            t.run("identify machine/experiment.toml --identify viscous,coulomb,offset --output i");
        assert_eq!(out.status, 0, "{}", out.stderr);
        let report = t.json("i/report.json");
        let names: Vec<&str> = report["parameters"]
            .as_array()
            .unwrap()
            .iter()
            .map(|p| p["name"].as_str().unwrap())
            .collect();
        assert!(names.iter().any(|n| n.ends_with(".offset")), "{names:?}");
        let less = t.run("identify machine/experiment.toml --identify none --output n");
        assert_eq!(less.status, 0, "{}", less.stderr);
        let report = t.json("n/report.json");
        let terms = report["parameters"]
            .as_array()
            .unwrap()
            .iter()
            .filter(|p| p["kind"] == "joint")
            .count();
        assert_eq!(terms, 0);
    }
    let t = Test::new();
    t.fails("new hexapod --output robot.toml", 2, &["folder"]);
}

#[test]
fn a_folder_of_its_name_does_not_hide_a_bundled_robot() {
    let test = Test::new();
    let lines = [
        "poses h4 --count 20 --rehearse 1 --output h4",
        "calibrate h4/calibration.toml --output h4/calibrated",
        "design hexapod --for load --starts 1 --harmonics 3 --no-collision --output hexapod",
    ];
    for line in lines {
        let out = test.run(line);
        assert_eq!(out.status, 0, "{line}\n{}", out.stderr);
    }
    for (file, robot) in [
        ("h4/calibration.toml", "h4"),
        ("hexapod/experiment.toml", "hexapod"),
    ] {
        let text = std::fs::read_to_string(test.path().join(file)).unwrap();
        let wanted = format!("robot = \"{robot}\"");
        assert!(text.lines().any(|l| l.trim() == wanted), "{file}:\n{text}");
    }
    // nor does a folder beside the file that names the robot
    let text = std::fs::read_to_string(test.path().join("h4/calibration.toml")).unwrap();
    let beside = test.file(
        "beside.toml",
        text.replace("measured.csv", "h4/measured.csv"),
    );
    let out = beside.run("calibrate beside.toml --output beside");
    assert_eq!(out.status, 0, "{}", out.stderr);
}

/// A file of the user is never taken for no file, and a record is what it says.
#[test]
fn simulate_leaves_an_experiment_as_it_is() {
    let t = Test::new().file("kept.toml", b"robot = \"planar2\" # caf\xe9\n");
    let line = "design planar2 --starts 1 --harmonics 2 --period 4 --rate 50 --output d";
    assert_eq!(t.run(line).status, 0);
    let run = "simulate planar2 d/trajectory.json --rate 50 --step 1e-3";
    t.fails(
        &format!("{run} --output a.csv --experiment kept.toml"),
        1,
        &["kept.toml"],
    );
    let kept = std::fs::read(t.path().join("kept.toml")).unwrap();
    assert!(kept.ends_with(b"caf\xe9\n"));
    assert!(!t.path().join("a.csv").exists());
    // a comment makes no other robot
    let t = t.file("e.toml", "robot = \"planar2\"   # mine\n");
    let first = format!("{run} --output b.csv --experiment e.toml");
    assert_eq!(t.run(&first).status, 0);
    assert_eq!(t.run(&format!("{first} --force")).status, 0);
    let text = std::fs::read_to_string(t.path().join("e.toml")).unwrap();
    assert_eq!(text.matches("[[record]]").count(), 1, "{text}");
    for (more, word) in [("--use holdout", "use"), ("--payload 1,0,0,0", "payload")] {
        t.fails(&format!("{first} --force {more}"), 1, &["b.csv", word]);
    }
    assert_eq!(
        text,
        std::fs::read_to_string(t.path().join("e.toml")).unwrap()
    );
}

/// One log that is fitted and held out tests nothing, and one record counts once.
#[test]
fn a_record_that_counts_twice_is_named() {
    let t = Test::new();
    for line in [
        "design planar2 --starts 1 --harmonics 2 --period 4 --rate 50 --output d",
        "simulate planar2 d/trajectory.json --rate 50 --step 1e-3 --output a.csv --experiment e.toml",
        "condense e.toml --cutoff 10 --output a.factor",
    ] {
        let out = t.run(line);
        assert_eq!(out.status, 0, "{line}\n{}", out.stderr);
    }
    let out = t.run("merge a.factor a.factor --output m");
    assert!(
        out.stderr.contains("hold the same numbers"),
        "{}",
        out.stderr
    );
    let text = std::fs::read_to_string(t.path().join("e.toml")).unwrap();
    let twice = format!("{text}\n[[record]]\nlog = \"a.csv\"\nuse = \"holdout\"\n");
    let t = t.file("twice.toml", twice);
    let out = t.run("identify twice.toml --output i");
    assert_eq!(out.status, 0, "{}", out.stderr);
    assert!(out.stderr.contains("fitted, too"), "{}", out.stderr);
    // a cut-off that the samples cannot have
    t.fails(
        "identify e.toml --cutoff 5000 --output j",
        2,
        &["5000", "25"],
    );
    t.fails(
        "identify e.toml --identify none,viscous --output j",
        2,
        &["none"],
    );
}

/// Other readers want velocity and effort in each limit, and take an end that is missing for 0.
#[test]
fn a_urdf_is_written_with_whole_limits() {
    let urdf = r#"<robot name="slide"><link name="base"/><link name="cart"><inertial><mass value="2"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="rail" type="prismatic"><parent link="base"/><child link="cart"/><axis xyz="1 0 0"/></joint></robot>"#;
    let t = Test::new().file("slide.urdf", urdf);
    let out = t.run("export slide.urdf --to urdf --output w");
    assert_eq!(out.status, 0, "{}", out.stderr);
    let text = std::fs::read_to_string(t.path().join("w/robot.urdf")).unwrap();
    for word in [
        "lower=\"-1000000000\"",
        "upper=\"1000000000\"",
        "velocity=",
        "effort=",
    ] {
        assert!(text.contains(word), "{word}:\n{text}");
    }
    let again = excite::Plant::load(t.path().join("w/robot.urdf").to_str().unwrap()).unwrap();
    let limits = again.actuators()[0].limits;
    assert_eq!(limits.position, [f64::NEG_INFINITY, f64::INFINITY]);
    assert!(limits.velocity.is_infinite() && limits.effort.is_infinite());
}
