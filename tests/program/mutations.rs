//! Mutated input: whatever stands in a file, the program ends with status 0, 1 or 2 and a reason, in
//! bounded time and memory.
//!
//! Files of every kind that is read are changed in a few places (numbers by hostile ones, bytes,
//! lines) and given to the commands that read them, as processes of their own with a limit of address
//! space, so that a panic, an abort by memory and a hang are all seen. The seed is fixed. The
//! environment variable `EXCITE_MUTATIONS` sets how many mutations are tried and
//! `EXCITE_MUTATIONS_SEED` other ones; what fails is kept under `target/tmp/mutations`.
#![cfg(unix)]

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Numbers that break what does not expect them.
const NUMBERS: [&str; 20] = [
    "1e9",
    "-1e9",
    "1e300",
    "-1e300",
    "1e308",
    "NaN",
    "inf",
    "-inf",
    "0",
    "-0",
    "-1",
    "1e-300",
    "1e-9",
    "1e15",
    "1000000",
    "4294967295",
    "18446744073709551615",
    "3.14",
    "0.5",
    "",
];
/// Address space of a run, KiB. The program itself and its threads need a fifth of it.
const SPACE: u64 = 3 << 20;
/// Longest run.
const PATIENCE: Duration = Duration::from_secs(60);
/// Mutations of the usual run, which ends after [`USUAL`] at the latest.
const COUNT: usize = 120;
const USUAL: Duration = Duration::from_secs(40);

/// Files, and the commands that read each.
const TARGETS: [(&str, &[&str]); 33] = [
    (
        "arm.urdf",
        &[
            "identifiability arm.toml --output o --force",
            "design arm.toml --starts 1 --harmonics 2 --time-limit 2 --rate 50 --threads 1 --output o --force",
            "torque arm.toml samples.csv",
            "new arm.urdf",
            "identify experiment.toml --output o --force",
        ],
    ),
    (
        "arm.toml",
        &[
            "identifiability arm.toml --output o --force",
            "design arm.toml --starts 1 --harmonics 2 --time-limit 2 --rate 50 --threads 1 --output o --force",
            "torque arm.toml samples.csv",
            "simulate arm.toml trajectory.json --rate 50 --step 1e-3 --output s.csv --force",
            "identify experiment.toml --output o --force",
        ],
    ),
    (
        "fit.csv",
        &[
            "identify experiment.toml --output o --force",
            "diagnose experiment.toml --no-next --output o --force",
            "load load.toml --output o --force",
        ],
    ),
    (
        "check.csv",
        &[
            "identify experiment.toml --output o --force",
            "diagnose experiment.toml --no-next --output o --force",
        ],
    ),
    (
        "experiment.toml",
        &[
            "identify experiment.toml --output o --force",
            "diagnose experiment.toml --no-next --output o --force",
        ],
    ),
    ("load.toml", &["load load.toml --output o --force"]),
    (
        "trajectory.json",
        &[
            "identifiability arm.toml trajectory.json --output o --force",
            "simulate arm.toml trajectory.json --rate 50 --step 1e-3 --output s.csv --force",
            "export trajectory.json --format ros2-mcap --output e.mcap --force",
            "export trajectory.json --format csv --robot arm.toml --unit deg --output e.csv --force",
        ],
    ),
    (
        "samples.csv",
        &[
            "torque arm.toml samples.csv",
            "export trajectory.json --format ros2 --approach samples.csv --output e.yaml --force",
        ],
    ),
    ("platform.csv", &["torque delta.toml platform.csv"]),
    (
        "delta.toml",
        &[
            "identifiability delta.toml --output o --force",
            "design delta.toml --starts 1 --harmonics 2 --time-limit 2 --rate 50 --threads 1 --output o --force",
            "torque delta.toml platform.csv",
            "identify delta_experiment.toml --output o --force",
        ],
    ),
    ("h4.toml", &["identifiability h4.toml --output o --force"]),
    (
        "hexapod.toml",
        &["identifiability hexapod.toml --output o --force"],
    ),
    (
        "five.toml",
        &[
            "identifiability five.toml --output o --force",
            "design five.toml --starts 1 --harmonics 2 --period 4 --time-limit 1 --rate 50 --threads 1 --output o --force",
        ],
    ),
    (
        "five_bar.urdf",
        &["identifiability five.toml --output o --force"],
    ),
    (
        "platform.json",
        &[
            "identifiability delta.toml platform.json --output o --force",
            "simulate delta.toml platform.json --rate 50 --step 1e-3 --output s.csv --force",
            "export platform.json --format csv --robot delta.toml --output e.csv --force",
        ],
    ),
    (
        "delta.csv",
        &[
            "identify delta_experiment.toml --output o --force",
            "diagnose delta_experiment.toml --no-next --output o --force",
        ],
    ),
    // logs of others
    ("foreign.csv", FOREIGN),
    ("two_none.mcap", FOREIGN),
    ("two_zstd.mcap", FOREIGN),
    ("two_lz4.mcap", FOREIGN),
    ("two.db3", FOREIGN),
    ("two.mat", FOREIGN),
    ("two.npz", FOREIGN),
    ("two_packed.npz", FOREIGN),
    ("foreign.jsonl", FOREIGN),
    ("columns.json", FOREIGN),
    (
        "foreign.toml",
        &[
            "identify foreign.toml --output o --force",
            "diagnose foreign.toml --no-next --output o --force",
        ],
    ),
    (
        "day.factor",
        &["merge day.factor --robot arm.toml --output o --force"],
    ),
    (
        "arm.xml",
        &[
            "identifiability arm.xml --output o --force",
            "torque arm.xml samples.csv",
            "identify experiment.toml --into arm.xml --output o --force",
        ],
    ),
    (
        "calibration.toml",
        &[
            "calibrate calibration.toml --output o --force",
            "diagnose calibration.toml --output o --force",
        ],
    ),
    (
        "measured.csv",
        &[
            "calibrate calibration.toml --output o --force",
            "diagnose calibration.toml --output o --force",
        ],
    ),
    (
        "boxed.urdf",
        &[
            "move boxed.urdf trajectory.json --from 0,0 --tries 20 --rate 50 --output o --force",
            "poses boxed.urdf --count 12 --output o --force",
            "design boxed.urdf --starts 1 --harmonics 2 --time-limit 2 --rate 50 --threads 1 --output o --force",
        ],
    ),
    (
        "box.stl",
        &["move boxed.urdf trajectory.json --from 0,0 --tries 20 --rate 50 --output o --force"],
    ),
];

/// `FILE` stands for the mutated file.
const FOREIGN: &[&str] = &[
    "log FILE --output o --force",
    "log FILE --robot arm.toml --output o --force",
    "log FILE --robot arm.toml --rows 64 --output o --force",
    "condense FILE --robot arm.toml --cutoff 10 --output c.factor --force",
];

/// Runs the program with a limit of memory and time; status (`None`: it was killed) and messages.
fn run(folder: &Path, line: &str) -> (Option<i32>, String) {
    let messages = folder.join(".stderr");
    let program = assert_cmd::cargo::cargo_bin("excite");
    let mut child = Command::new("sh")
        .args(["-c", &format!("ulimit -v {SPACE}; exec \"$0\" \"$@\"")])
        .arg(program)
        .args(line.split_whitespace())
        .current_dir(folder)
        .env("RAYON_NUM_THREADS", "1")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(std::fs::File::create(&messages).unwrap())
        .spawn()
        .unwrap();
    let begin = Instant::now();
    let status = loop {
        match child.try_wait().unwrap() {
            Some(status) => break status.code(),
            None if begin.elapsed() > PATIENCE => {
                child.kill().unwrap();
                child.wait().unwrap();
                std::fs::write(&messages, format!("no end after {PATIENCE:?}")).unwrap();
                break None;
            }
            None => std::thread::sleep(Duration::from_millis(2)),
        }
    };
    let text = std::fs::read(&messages).unwrap();
    (status, String::from_utf8_lossy(&text).into_owned())
}

/// The files as they should be.
fn prepare(folder: &Path) {
    let arm = excite::robot::bundled::find("planar2").unwrap();
    std::fs::write(folder.join("arm.urdf"), arm.urdf).unwrap();
    let toml = r#"
name = "arm"
urdf = "arm.urdf"
gravity = [0.0, 0.0, -9.81]
prior = "cad"
[[joint]]
name = "joint1"
position = [-3.0, 3.0]
velocity = 3.0
acceleration = 15.0
jerk = 1500.0
effort = 60.0
torque_noise = 0.2
position_resolution = 1e-5
gear_ratio = 50.0
armature = 0.01
viscous = 0.1
coulomb = 0.2
identify = ["viscous", "coulomb", "offset"]
[[joint]]
name = "joint2"
acceleration = 20.0
jerk = 2000.0
torque_noise = 0.1
"#;
    std::fs::write(folder.join("arm.toml"), toml).unwrap();
    std::fs::write(folder.join("five_bar.urdf"), crate::common::five_bar::URDF).unwrap();
    let toml = r#"
mechanism = "loops"
urdf = "five_bar.urdf"
gravity = [0, -9.81, 0]
start = { motor_left = 2.2, elbow_left = -1.2, motor_right = 0.9, elbow_right = 1.2 }
lock = { pin = 0.0 }
actuated = ["motor_left", "motor_right"]
[[loop]]
frames = ["left_end", "right_end"]
coincide = "position"
"#;
    std::fs::write(folder.join("five.toml"), toml).unwrap();
    for b in excite::mechanism::bundled::list() {
        std::fs::write(folder.join(format!("{}.toml", b.name)), b.toml).unwrap();
    }
    let simulate =
        "simulate arm.toml trajectory.json --rate 50 --step 1e-3 --experiment experiment.toml";
    for line in [
        "design arm.toml --starts 1 --harmonics 2 --period 4 --rate 50 --output a".to_string(),
        format!("{simulate} --periods 3 --output fit.csv"),
        format!("{simulate} --periods 2 --seed 1 --output check.csv --use holdout"),
        "design delta.toml --starts 1 --harmonics 2 --period 2 --rate 50 --output d".into(),
        "simulate delta.toml platform.json --periods 2 --rate 50 --step 1e-3 --output delta.csv --experiment delta_experiment.toml".into(),
        "identify experiment.toml --output i".into(),
        "condense experiment.toml --cutoff 10 --output day.factor".into(),
        "poses arm.toml --count 24 --kind position --rehearse 1 --output p".into(),
    ] {
        let (status, messages) = run(folder, &line);
        assert_eq!(status, Some(0), "{line}\n{messages}");
        for (from, to) in [
            ("a/trajectory.json", "trajectory.json"),
            ("a/samples.csv", "samples.csv"),
            ("d/trajectory.json", "platform.json"),
            ("d/samples.csv", "platform.csv"),
            ("i/robot.xml", "arm.xml"),
            ("p/calibration.toml", "calibration.toml"),
            ("p/measured.csv", "measured.csv"),
        ] {
            let _ = std::fs::copy(folder.join(from), folder.join(to));
        }
    }
    let experiment = std::fs::read_to_string(folder.join("experiment.toml")).unwrap();
    let load = experiment.replacen("use = \"fit\"", "use = \"fit\"\npayload = \"unknown\"", 1);
    std::fs::write(folder.join("load.toml"), load).unwrap();
    logs_of_others(folder);
    // a body with a mesh, and one with a box
    let urdf = std::fs::read_to_string(folder.join("arm.urdf")).unwrap();
    let volumes = [
        r#"<mesh filename="box.stl"/>"#,
        r#"<box size="0.1 0.05 0.05"/>"#,
    ];
    let ends: Vec<&str> = urdf.split("</link>").collect();
    let [first, second, rest] = ends[..] else {
        panic!("two links: {urdf}")
    };
    let [first, second] = [(first, volumes[0]), (second, volumes[1])].map(|(link, volume)| {
        format!("{link}<collision><geometry>{volume}</geometry></collision></link>")
    });
    let with = format!("{first}{second}{rest}");
    std::fs::write(folder.join("boxed.urdf"), with).unwrap();
    std::fs::write(folder.join("box.stl"), tetrahedron()).unwrap();
}

/// Bags and arrays as they are tested elsewhere, and a table without our names.
fn logs_of_others(folder: &Path) {
    let logs = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/logs");
    for entry in std::fs::read_dir(logs).unwrap() {
        let from = entry.unwrap().path();
        std::fs::copy(&from, folder.join(from.file_name().unwrap())).unwrap();
    }
    let ours = std::fs::read_to_string(folder.join("fit.csv")).unwrap();
    let header = ours.lines().next().unwrap();
    let others = header
        .replace("dq", "velocity_")
        .replace("qref", "target_")
        .replace("tau", "effort_")
        .replace('q', "position_")
        .replacen("t,", "stamp [s],", 1);
    let table = ours.replacen(header, &others, 1).replace(',', "; ");
    std::fs::write(folder.join("foreign.csv"), table).unwrap();
    let columns: Vec<&str> = others.split(',').collect();
    let cells = |line: &str| line.split(',').map(String::from).collect::<Vec<_>>();
    let rows: Vec<Vec<String>> = ours.lines().skip(1).take(400).map(cells).collect();
    let objects = rows.iter().map(|row| {
        let members = columns.iter().zip(row);
        let members: Vec<String> = members.map(|(c, x)| format!("\"{c}\": {x}")).collect();
        format!("{{{}}}\n", members.join(", "))
    });
    std::fs::write(folder.join("foreign.jsonl"), objects.collect::<String>()).unwrap();
    let lists = columns.iter().enumerate().map(|(k, c)| {
        let list: Vec<&str> = rows.iter().map(|row| &row[k][..]).collect();
        format!("\"{c}\": [{}]", list.join(", "))
    });
    let lists: Vec<String> = lists.collect();
    std::fs::write(
        folder.join("columns.json"),
        format!("{{{}}}", lists.join(",\n")),
    )
    .unwrap();
    let line = "log foreign.csv --robot arm.toml --output f";
    let (status, messages) = run(folder, line);
    assert_eq!(status, Some(0), "{line}\n{messages}");
    let toml = std::fs::read_to_string(folder.join("f/experiment.toml")).unwrap();
    std::fs::write(folder.join("foreign.toml"), toml.replace("../", "")).unwrap();
    let line = "identify foreign.toml --output f --force";
    let (status, messages) = run(folder, line);
    assert_eq!(status, Some(0), "{line}\n{messages}\n{toml}");
}

/// A solid of four triangles, 0.1 m.
fn tetrahedron() -> Vec<u8> {
    let corners = [
        [0.0f32, 0.0, 0.0],
        [0.1, 0.0, 0.0],
        [0.0, 0.1, 0.0],
        [0.0, 0.0, 0.1],
    ];
    let mut file = vec![b' '; 80];
    file.extend(4u32.to_le_bytes());
    for triangle in [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] {
        file.extend([0; 12]);
        let points = triangle.iter().flat_map(|k| corners[*k]);
        file.extend(points.flat_map(f32::to_le_bytes));
        file.extend([0; 2]);
    }
    file
}

/// Where the numbers of a text stand.
fn numbers(text: &[u8]) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut i = 0;
    while i < text.len() {
        let begins = text[i].is_ascii_digit()
            && (i == 0 || !(text[i - 1].is_ascii_alphanumeric() || text[i - 1] == b'_'));
        if !begins {
            i += 1;
            continue;
        }
        let from = if i > 0 && text[i - 1] == b'-' {
            i - 1
        } else {
            i
        };
        while i < text.len()
            && (text[i].is_ascii_alphanumeric() || matches!(text[i], b'.' | b'+' | b'-'))
        {
            i += 1;
        }
        found.push((from, i));
    }
    found
}

/// The text with one to three changes.
fn mutated(text: &[u8], r: &mut ChaCha8Rng) -> Vec<u8> {
    let mut text = text.to_vec();
    let binary = std::str::from_utf8(&text).is_err() || text.contains(&0);
    for _ in 0..[1, 1, 1, 2, 3][r.random_range(0..5)] {
        // of a binary file, bytes are changed rather than numbers
        let least = if binary { 12 } else { 0 };
        let kind = r.random_range(least..20);
        let at = r
            .random_range(0..text.len().max(1))
            .min(text.len().saturating_sub(1));
        if kind < 12 {
            let places = numbers(&text);
            if !places.is_empty() {
                let (from, to) = places[r.random_range(0..places.len())];
                let number = NUMBERS[r.random_range(0..NUMBERS.len())];
                text.splice(from..to, number.bytes());
            }
        } else if kind < 14 && !text.is_empty() {
            text[at] = r.random_range(0..=255u8);
        } else if kind == 14 {
            text.truncate(at);
        } else {
            let mut lines: Vec<Vec<u8>> = text.split(|b| *b == b'\n').map(<[u8]>::to_vec).collect();
            let (i, j) = (
                r.random_range(0..lines.len()),
                r.random_range(0..lines.len()),
            );
            match r.random_range(0..6) {
                0 => lines.insert(i, lines[j].clone()),
                1 => drop(lines.remove(i)),
                2 => lines.swap(i, j),
                3 => {
                    let keep = r.random_range(0..=lines[i].len());
                    lines[i].truncate(keep);
                }
                4 => {
                    // two columns change places in a line
                    let mut cells: Vec<Vec<u8>> =
                        lines[i].split(|b| *b == b',').map(<[u8]>::to_vec).collect();
                    let (a, b) = (
                        r.random_range(0..cells.len()),
                        r.random_range(0..cells.len()),
                    );
                    cells.swap(a, b);
                    lines[i] = cells.join(&b',');
                }
                _ => {
                    let part: Vec<Vec<u8>> = lines[i..(i + 4).min(lines.len())].to_vec();
                    for _ in 0..r.random_range(1..5) {
                        lines.splice(i..i, part.clone());
                    }
                }
            }
            text = lines.join(&b'\n');
        }
    }
    text
}

/// What ended the program, without the numbers in it, so that the same fault counts once.
fn fault(messages: &str) -> String {
    let line = messages
        .lines()
        .find(|l| {
            l.contains("panicked at") || l.contains("memory allocation") || l.contains("no end")
        })
        .unwrap_or("killed without a word");
    match line.contains("memory allocation") {
        true => "memory allocation failed".into(),
        // without the number of the thread
        false => line.split("panicked").last().unwrap_or(line).to_string(),
    }
}

#[test]
fn no_file_makes_the_program_panic_abort_or_hang() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    prepare(folder);
    let number = |name: &str| std::env::var(name).ok().and_then(|v| v.parse::<u64>().ok());
    let asked = number("EXCITE_MUTATIONS");
    let seed = number("EXCITE_MUTATIONS_SEED").unwrap_or(1);
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join("mutations");
    let mut r = ChaCha8Rng::seed_from_u64(seed);
    let mut faults: std::collections::BTreeMap<String, (usize, String)> = Default::default();
    let begin = Instant::now();
    let mut tried = 0;
    for k in 0..asked.unwrap_or(COUNT as u64) {
        if asked.is_none() && begin.elapsed() > USUAL {
            break;
        }
        let (file, commands) = TARGETS[r.random_range(0..TARGETS.len())];
        let command = commands[r.random_range(0..commands.len())].replace("FILE", file);
        let command = command.as_str();
        let good = std::fs::read(folder.join(file)).unwrap();
        let bad = mutated(&good, &mut r);
        std::fs::write(folder.join(file), &bad).unwrap();
        let (status, messages) = run(folder, command);
        tried += 1;
        if !matches!(status, Some(0..=2)) || (status != Some(0) && messages.trim().is_empty()) {
            let what = format!(
                "{}: {}",
                command.split(' ').next().unwrap(),
                fault(&messages)
            );
            let entry = faults.entry(what.clone()).or_insert_with(|| {
                std::fs::create_dir_all(&kept).unwrap();
                let copy = kept.join(format!("{seed}_{k}_{file}"));
                std::fs::write(&copy, &bad).unwrap();
                let shown = format!("`{command}` with {}", copy.display());
                println!("{k}: {what}: {shown}");
                (0, shown)
            });
            entry.0 += 1;
        }
        std::fs::write(folder.join(file), good).unwrap();
    }
    println!("{tried} mutations, {} faults", faults.len());
    assert!(faults.is_empty(), "{faults:#?}");
    assert!(tried > 5, "the machine is too slow: only {tried} mutations");
}
