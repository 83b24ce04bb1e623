//! What cannot be exported, and what is said then.

use super::{Folder, altered, designed};
use excite::controller::FORMATS;
use excite::trajectory::Trajectory;
use excite::trajectory::parts::Space;
use std::path::Path;
use std::process::Command;

/// Runs a line that must fail with a status and one message that holds all the words.
fn fails(folder: &Folder, trajectory: &Path, line: &str, status: i32, words: &[&str]) {
    let out = Command::new(env!("CARGO_BIN_EXE_excite"))
        .current_dir(folder.0.path())
        .arg("export")
        .arg(trajectory)
        .args(line.split_whitespace())
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(status), "{line}\n{error}");
    assert!(
        !error.contains("panicked") && out.stdout.is_empty(),
        "{line}\n{error}"
    );
    for word in words {
        assert!(error.contains(word), "{line}: no `{word}` in\n{error}");
    }
    let made = std::fs::read_dir(folder.0.path()).unwrap().count();
    assert!(made <= 1, "{line} left files behind");
}

#[test]
fn formats_are_listed_and_documented() {
    let out = Command::new(env!("CARGO_BIN_EXE_excite"))
        .args(["export", "--list"])
        .output()
        .unwrap();
    let list = String::from_utf8(out.stdout).unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let run = std::fs::read_to_string(root.join("docs/run.md")).unwrap();
    for format in FORMATS {
        let card = format.card();
        assert!(
            list.contains(&format!("{:<10} {}", card.name, card.about)),
            "{list}"
        );
        assert!(
            run.contains(&format!("`{}`", card.name)),
            "docs/run.md: {}",
            card.name
        );
    }
}

#[test]
fn options_that_make_no_sense() {
    let (folder, panda) = (Folder::new(), designed("panda"));
    let argument = |line: &str, words: &[&str]| fails(&folder, &panda, line, 2, words);
    argument("--format abb", &["abb", "urscript"]);
    argument("--format franka --rate 500", &["franka", "1000 Hz", "500"]);
    argument("--format csv --rate 0", &["--rate"]);
    argument("--format csv --rate 1e9", &["--rate"]);
    argument("--format csv --columns t", &["positions (q)"]);
    argument("--format csv --columns q,q", &["twice"]);
    argument("--format csv --columns w", &["--columns", "`w`"]);
    argument("--format ros2 --columns q,ddq", &["q,dq,ddq"]);
    argument("--format csv --unit rad,deg", &["--unit"]);
    argument("--format csv --unit turns", &["turns"]);
    argument("--format franka --unit deg", &["--unit", "franka"]);
    argument("--format c --rate 100", &["--rate"]);
    argument("--format csv --joints nobody", &["nobody", "panda_joint1"]);
    argument(
        "--format csv --joints panda_joint1,panda_joint1",
        &["twice"],
    );
    argument("--format csv --speed 2", &["--speed"]);
    argument("--format csv --periods 0", &["--periods"]);
    argument("--format csv --move-to-start", &["--move-to-start"]);
}

#[test]
fn motions_that_a_controller_cannot_play() {
    let folder = Folder::new();
    fails(
        &folder,
        &designed("panda"),
        "--format urscript",
        1,
        &["6 joints", "7", "--joints"],
    );
    fails(
        &folder,
        &designed("scara"),
        "--format kuka-rsi",
        1,
        &["joint3", "slides"],
    );
    fails(
        &folder,
        &designed("planar2"),
        "--format xarm",
        1,
        &["5 to 7"],
    );
    // starts and ends in motion
    let path = altered(&folder, "panda", |t| t.fourier.joints[2].sin[0] += 0.1);
    fails(
        &folder,
        &path,
        "--format franka",
        1,
        &["panda_joint3", "--approach", "--ends rest"],
    );
    // of a platform, no robot file names the actuators
    let path = altered(&folder, "hexapod", |t| t.robot = "mine".into());
    fails(
        &folder,
        &path,
        "--format csv",
        1,
        &["altered.json", "--robot"],
    );
    fails(
        &folder,
        &path,
        "--format csv --robot panda",
        1,
        &["altered.json"],
    );
    // whether joints turn or slide is not known
    let path = altered(&folder, "panda", |t| t.robot = "mine".into());
    fails(&folder, &path, "--format csv --unit deg", 2, &["--robot"]);
    // another robot of that name: its joints are not those
    let path = altered(&folder, "ur5e", |t| t.robot = "panda".into());
    fails(
        &folder,
        &path,
        "--format csv --robot panda",
        1,
        &["altered.json", "panda_joint1"],
    );
}

#[test]
fn files_that_are_none() {
    let folder = Folder::new();
    let path = folder.path("broken.json");
    for text in [
        "",
        "{",
        "[]",
        "{\"format\": \"excite-trajectory\", \"version\": 9}",
    ] {
        std::fs::write(&path, text).unwrap();
        fails(&folder, &path, "--format csv", 1, &["broken.json"]);
    }
    fails(
        &folder,
        Path::new("none.json"),
        "--format csv",
        1,
        &["none.json"],
    );
    let panda = designed("panda");
    let move_ = |text: &str| std::fs::write(folder.path("broken.json"), text).unwrap();
    for (text, word) in [
        ("t,q1\n0,1\n", "column q2"),
        (
            "t,q1,q2,q3,q4,q5,q6,q7,dq1,dq2,dq3,dq4,dq5,dq6,dq7,ddq1,ddq2,ddq3,ddq4,ddq5,ddq6,ddq7\n",
            "no samples",
        ),
    ] {
        move_(text);
        fails(
            &folder,
            &panda,
            "--format csv --approach broken.json",
            1,
            &["broken.json", word],
        );
    }
    // a move to another place, one that stands still in time, and one that jumps
    let header = "t,q1,q2,dq1,dq2,ddq1,ddq2\n";
    let planar = designed("planar2");
    for (rows, word) in [
        ("0,9,9,0,0,0,0\n1,9,9,0,0,0,0\n", "joint1"),
        ("1,9,9,0,0,0,0\n1,9,9,0,0,0,0\n", "does not increase"),
        ("0,0,0,0,0,0,0\n1,9,9,0,0,0,0\n", "q1 jumps"),
    ] {
        move_(&format!("{header}{rows}"));
        for option in ["approach", "return"] {
            let line = format!("--format csv --{option} broken.json");
            fails(&folder, &planar, &line, 1, &["broken.json", word]);
        }
    }
}

#[test]
fn what_exists_stays() {
    let folder = Folder::new();
    std::fs::write(folder.path("a.npz"), "mine").unwrap();
    let planar = designed("planar2");
    fails(
        &folder,
        &planar,
        "--format mujoco --output a.npz",
        1,
        &["a.npz", "--force"],
    );
    assert_eq!(folder.read("a.npz"), "mine");
    folder.export(&planar, "--format mujoco --force", "a.npz");
    // the second file is looked for as well
    std::fs::remove_file(folder.path("a.npz")).unwrap();
    let line = "--format mujoco --output a.npz";
    fails(&folder, &planar, line, 1, &["a_start.xml", "--force"]);
}

/// Numbers at the edge of what a file can hold end in a message.
#[test]
fn numbers_beyond_all_bounds() {
    let folder = Folder::new();
    type Change = fn(&mut Trajectory);
    let changes: [Change; 4] = [
        |t| t.fourier.joints[0].sin[0] = 1e308,
        |t| t.fourier.period = 1e-300,
        |t| t.fourier.period = 1e300,
        |t| t.periods = u32::MAX,
    ];
    for (k, change) in changes.into_iter().enumerate() {
        let path = altered(&folder, "planar2", change);
        for format in ["csv", "ros2", "ros2-mcap", "mujoco", "c"] {
            let out = Command::new(env!("CARGO_BIN_EXE_excite"))
                .current_dir(folder.0.path())
                .args([
                    "export",
                    "altered.json",
                    "--force",
                    "--output",
                    "x",
                    "--format",
                    format,
                ])
                .output()
                .unwrap();
            let error = String::from_utf8_lossy(&out.stderr);
            assert!(!error.contains("panicked"), "{k} {format}: {error}");
            assert!(matches!(out.status.code(), Some(0..=2)), "{k} {format}");
        }
        let _ = path;
    }
    // coordinates that contradict the robot
    let path = altered(&folder, "planar2", |t| t.space = Some(Space::Platform));
    let out = Command::new(env!("CARGO_BIN_EXE_excite"))
        .current_dir(folder.0.path())
        .args(["export", "altered.json", "--format", "csv"])
        .output()
        .unwrap();
    assert_eq!(out.status.code(), Some(1), "{}", path.display());
}
