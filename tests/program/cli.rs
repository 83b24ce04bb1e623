//! The program as a user runs it: results, exit status, messages, and nothing lost.

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

#[test]
fn unusable_arguments_have_status_2() {
    let t = Test::new();
    for (line, words) in [
        ("design", &["ROBOT"][..]),
        ("design panda --period 0", &["period"]),
        ("design panda --period nan", &["period"]),
        ("design panda --harmonics 1", &["harmonics"]),
        ("design panda --harmonics -3", &["harmonics"]),
        ("design panda --derate 2", &["derate"]),
        ("design panda --rate 0", &["rate"]),
        ("design panda --rate 1e300", &["rate"]),
        ("design panda --starts 0", &["starts"]),
        ("design panda --time-limit -1", &["time limit"]),
        ("design panda --time-limit 1e999", &["time limit"]),
        ("design panda --grid even", &["grid"]),
        ("design panda --criterion f", &["criterion"]),
        ("design panda --start 1,2", &["posture", "7"]),
        ("design panda --start 9,0,0,-1,0,1,0", &["panda_joint1"]),
        ("design panda --identify friction", &["identify", "coulomb"]),
        ("design pandaa", &["pandaa", "panda"]),
        ("rehearse panda", &["rehearse"]),
    ] {
        t.fails(line, 2, words);
    }
    assert_eq!(
        std::fs::read_dir(t.path()).unwrap().count(),
        0,
        "nothing was written"
    );
}

#[test]
fn unusable_files_have_status_1_and_name_the_place() {
    let latin = [b"<robot name=\"", &[0xff, 0xfe, 0xe9][..], b"\"/>"].concat();
    let cut = &planar()[..planar().len() / 2];
    let chain: String = (0..300)
        .map(|i| {
            format!(
                "<link name=\"l{}\"/><joint name=\"j{i}\" type=\"revolute\"><parent link=\"l{i}\"/>\
                 <child link=\"l{}\"/><limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/></joint>",
                i + 1,
                i + 1
            )
        })
        .collect();
    let cycle = "<robot name=\"c\"><link name=\"a\"/><link name=\"b\"/>\
        <joint name=\"x\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></joint>\
        <joint name=\"y\" type=\"fixed\"><parent link=\"b\"/><child link=\"a\"/></joint></robot>";
    let t = Test::new()
        .file("latin.urdf", latin)
        .file("cut.urdf", cut)
        .file(
            "long.urdf",
            format!("<robot name=\"l\"><link name=\"l0\"/>{chain}</robot>"),
        )
        .file("cycle.urdf", cycle)
        .file("empty.urdf", "")
        .file("arm.urdf", planar())
        .file("key.toml", "urdf = \"arm.urdf\"\nspeed = 3\n")
        .file(
            "joint.toml",
            "urdf = \"arm.urdf\"\n[[joint]]\nname = \"elbow\"\n",
        )
        .file(
            "negative.toml",
            "urdf = \"arm.urdf\"\n[[joint]]\nname = \"joint1\"\nvelocity = -1.0\n",
        )
        .file(
            "nan.toml",
            "urdf = \"arm.urdf\"\n[[joint]]\nname = \"joint1\"\nvelocity = nan\n",
        )
        .file("none.toml", "urdf = \"nowhere.urdf\"\n")
        .file("bad.json", "{\"format\": \"excite-trajectory\"")
        .file(
            "ragged.csv",
            "t,q1,q2,dq1,dq2,ddq1,ddq2\n0,0,0,0,0,0,0\n0.1,0,0\n",
        )
        .file("nan.csv", "t,q1,q2,dq1,dq2,ddq1,ddq2\n0,0,NaN,0,0,0,0\n")
        .file("missing.csv", "t,q1,dq1,dq2,ddq1,ddq2\n0,0,0,0,0,0\n");
    for (line, words) in [
        ("design latin.urdf", &["latin.urdf", "UTF-8"][..]),
        ("design cut.urdf", &["cut.urdf"]),
        ("design long.urdf", &["long.urdf", "128"]),
        ("design cycle.urdf", &["cycle.urdf"]),
        ("design empty.urdf", &["empty.urdf"]),
        ("design nowhere.urdf", &["nowhere.urdf"]),
        ("design key.toml", &["key.toml", "speed"]),
        ("design joint.toml", &["joint.toml", "elbow", "joint1"]),
        ("design negative.toml", &["negative.toml", "velocity"]),
        ("design nan.toml", &["nan.toml", "velocity"]),
        ("design none.toml", &["nowhere.urdf"]),
        ("identifiability arm.urdf bad.json", &["bad.json"]),
        ("identifiability arm.urdf nowhere.json", &["nowhere.json"]),
        ("torque arm.urdf ragged.csv", &["ragged.csv", "3"]),
        ("torque arm.urdf nan.csv", &["nan.csv", "q2"]),
        ("torque arm.urdf missing.csv", &["missing.csv", "q2"]),
        ("torque arm.urdf nowhere.csv", &["nowhere.csv"]),
    ] {
        t.fails(line, 1, words);
    }
    assert!(!t.path().join("out").exists(), "nothing was written");
}

/// A trajectory of another robot is refused.
#[test]
fn trajectory_of_another_robot() {
    let t = Test::new();
    assert_eq!(t.run("design planar2 --starts 1 --output p").status, 0);
    t.fails(
        "identifiability panda p/trajectory.json --output q",
        1,
        &["p/trajectory.json"],
    );
}

/// Damaged copies of a good trajectory end in a message, never in a panic.
#[test]
fn damaged_trajectories_are_refused() {
    let t = Test::new();
    assert_eq!(t.run("design planar2 --starts 1 --output p").status, 0);
    let good = std::fs::read_to_string(t.path().join("p/trajectory.json")).unwrap();
    for cut in (0..good.len()).step_by(good.len() / 12 + 1) {
        std::fs::write(t.path().join("cut.json"), &good[..cut]).unwrap();
        t.fails("identifiability planar2 cut.json", 1, &["cut.json"]);
    }
    for (from, to) in [
        ("\"period\": 10.0", "\"period\": -1.0"),
        ("\"version\": 1", "\"version\": 99"),
        ("\"harmonics\": [", "\"harmonics\": [0, "),
        ("joint1", "joint9"),
    ] {
        let bad = good.replacen(from, to, 1);
        assert_ne!(bad, good, "{from} stands in the file");
        std::fs::write(t.path().join("bad.json"), bad).unwrap();
        t.fails("identifiability planar2 bad.json", 1, &["bad.json"]);
    }
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

#[test]
fn every_command_has_help_with_an_example() {
    let t = Test::new();
    for command in [
        "design",
        "identifiability",
        "simulate",
        "identify",
        "load",
        "diagnose",
        "torque",
        "robots",
        "new",
    ] {
        let out = t.run(&format!("{command} --help"));
        assert_eq!(out.status, 0);
        assert!(out.stdout.contains("Example"), "{command}");
        assert!(
            out.stdout.contains(&format!("excite {command}")),
            "{command}"
        );
    }
}

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

/// The table of warnings in the documents is the list in the code.
#[test]
fn every_kind_of_warning_is_documented() {
    let text = include_str!("../../docs/formats.md");
    let table = text.split("## Warnings").nth(1).unwrap();
    let table = table.split("\n## ").next().unwrap();
    let written: Vec<&str> = table
        .lines()
        .filter_map(|l| l.strip_prefix("| `")?.split('`').next())
        .filter(|code| *code != "kind")
        .collect();
    let codes: Vec<&str> = excite::WarningKind::ALL.iter().map(|k| k.code()).collect();
    assert_eq!(written, codes);
}

/// Long help, with an example, for every command.
#[test]
fn every_command_explains_itself() {
    let t = Test::new();
    let list = t.run("--help").stdout;
    let commands = list.split("Commands:").nth(1).unwrap();
    let commands = commands.split("Options:").next().unwrap();
    let mut seen = Vec::new();
    for line in commands
        .lines()
        .filter(|l| l.starts_with("  ") && !l.starts_with("   "))
    {
        let mut words = line.split_whitespace();
        let name = words.next().unwrap();
        assert!(
            words.next().is_some(),
            "nothing is said of {name} in\n{list}"
        );
        if name == "help" {
            continue;
        }
        let help = t.run(&format!("{name} --help"));
        assert_eq!((help.status, help.stderr.as_str()), (0, ""), "{name}");
        assert!(
            help.stdout.contains(&format!("  excite {name}")) && help.stdout.contains("Example"),
            "no example for {name}:\n{}",
            help.stdout
        );
        // what only the long help says stands before the usage
        let about = |text: &str| text.split("Usage:").next().unwrap().trim().to_string();
        let (long, short) = (
            about(&help.stdout),
            about(&t.run(&format!("{name} -h")).stdout),
        );
        if name != "robots" {
            assert!(
                long.len() > short.len() + 40,
                "{name}: the long help is\n{long}"
            );
        }
        assert!(!short.contains('\n'), "{name}: {short}");
        seen.push(name.to_string());
    }
    assert!(seen.len() >= 9, "{seen:?}");
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

/// The options of `simulate` are called as the diagnosis calls the effects.
#[test]
fn simulated_effects_have_the_names_of_the_catalogue() {
    let t = Test::new();
    let help = t.run("simulate --help").stdout;
    for effect in [
        "payload",
        "stribeck_friction",
        "nonlinear_viscous_friction",
        "friction_asymmetry",
        "load_dependent_friction",
        "torque_constant",
        "joint_offset",
        "torque_delay",
        "gravity_direction",
    ] {
        let option = format!("--{}", effect.replace('_', "-"));
        assert!(help.contains(&option), "{option} is not in\n{help}");
    }
    for gone in [
        "quadratic",
        "load-friction",
        "torque-gain",
        "position-offset",
        "tilt",
    ] {
        t.fails(&format!("simulate planar2 t.json --{gone} 1"), 2, &[gone]);
    }
}

/// 1 for what cannot be done, 2 for arguments that cannot be used; nothing on standard output.
#[test]
fn every_command_keeps_to_the_exit_status() {
    let t = Test::new().file("arm.toml", "urdf = 3");
    for line in [
        "design none.toml",
        "design arm.toml",
        "identifiability none.urdf",
        "identifiability planar2 none.json",
        "identify none.toml",
        "diagnose none.toml",
        "condense none.toml",
        "merge none.factor",
        "merge arm.toml",
        "export planar2 --to mujoco --into none.xml",
        "export delta --to sdf",
        "load none.toml",
        "torque planar2 none.csv",
        "simulate planar2 none.json",
        "new none.urdf",
    ] {
        t.fails(line, 1, &["error: "]);
    }
    for line in [
        "design",
        "design no_such_robot",
        "design planar2 --period 0",
        "design planar2 --rate 1e300",
        "identifiability",
        "identify",
        "identify e.toml --method magic",
        "diagnose",
        "merge",
        "export planar2 --to usd --into arm.toml",
        "export planar2 --to webots",
        "load",
        "load e.toml --cutoff -1",
        "torque planar2",
        "simulate planar2",
        "new",
        "new arm.toml",
        "robots --nonsense",
        "nonsense",
    ] {
        t.fails(line, 2, &[]);
    }
    assert!(!t.path().join("out").exists(), "a failure makes no folder");
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

#[test]
fn questions_that_mean_nothing_have_status_2() {
    let t = Test::new();
    t.fails(
        "design planar2 --for platform",
        2,
        &["--for platform", "no parallel robot"],
    );
    t.fails(
        "design planar2 --for legs",
        2,
        &["--for legs", "no parallel robot"],
    );
    t.fails(
        "design planar2 --for friction --payload 1,0,0,0",
        2,
        &["--for load"],
    );
    t.fails("design planar2 --payload 1,0,0,0", 2, &["--for load"]);
    t.fails(
        "design planar2 --for load --payload -1,0,0,0",
        2,
        &["--payload"],
    );
    t.fails(
        "design planar2 --for load --criterion d",
        2,
        &["--criterion"],
    );
    t.fails("design planar2 --for wings", 2, &["load"]);
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
        "design hexapod --for load --starts 1 --output hexapod",
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
