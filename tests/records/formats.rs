//! Logs as others write them: every format, every layout, and what an experiment states about columns.

mod tables;

use crate::common::parts;
use crate::common::shared::shared;
use excite::Plant;
use excite::log::parts::Purpose;
use excite::log::{Experiment, Record};
use std::f64::consts::PI;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

const ROBOT: &str = r#"<robot name="two">
<link name="base"/>
<link name="a"><inertial><mass value="2"/><origin xyz="0.2 0 0"/><inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="b"><inertial><mass value="1"/><origin xyz="0.1 0 0"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="arm_wrist_a" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" velocity="5" effort="50"/></joint>
<joint name="arm_wrist_b" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" velocity="5" effort="50"/></joint>
</robot>"#;

const STEP: f64 = 0.01;
const COUNT: usize = 200;

/// Positions and torques of `wrist_b` and `wrist_a`, as `tests/data/make_logs.py` makes them.
fn state(t: f64) -> ([f64; 2], [f64; 2]) {
    let q = [
        0.5 * (3.0 * t).sin() + 0.2 * (5.0 * t).cos(),
        0.4 * (4.0 * t).cos() + 0.1 * (7.0 * t).sin(),
    ];
    (q, [3.0 * (2.0 * t + 0.3).sin(), 2.0 * (3.0 * t).sin()])
}

fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("two.urdf"), ROBOT).unwrap();
    dir
}

/// Reads a record whose entry has these lines beside `use`.
fn read(dir: &Path, entry: &str) -> excite::Result<Record> {
    let path = dir.join("experiment.toml");
    let text = format!("robot = \"two.urdf\"\n[[record]]\nuse = \"fit\"\n{entry}\n");
    std::fs::write(&path, text).unwrap();
    Ok(Experiment::read(&path)?.records.remove(0))
}

fn error(dir: &Path, entry: &str) -> String {
    read(dir, entry).unwrap_err().to_string()
}

/// Whether a record holds the motion: `first` and `second` are the columns of our joints 1 and 2.
fn holds(r: &Record, [first, second]: [usize; 2], tolerance: f64, what: &str) {
    assert_eq!(r.len(), COUNT, "{what}");
    for (i, &t) in r.t.iter().enumerate() {
        let (q, tau) = state(i as f64 * STEP);
        assert!(
            (t - r.t[0] - i as f64 * STEP).abs() < 1e-6,
            "{what}: time {t}"
        );
        for (j, k) in [first, second].into_iter().enumerate() {
            assert!(
                (r.q[j][i] - q[k]).abs() < tolerance,
                "{what}: q{} at {i}: {} {}",
                j + 1,
                r.q[j][i],
                q[k]
            );
            assert!(
                (r.tau[j][i] - tau[k]).abs() < 10.0 * tolerance,
                "{what}: tau{} at {i}",
                j + 1
            );
        }
    }
}

fn data(name: &str) -> String {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data/logs")
        .join(name);
    format!("log = {:?}", path.display().to_string())
}

/// Bags: joints by name, in whatever order the messages have them.
#[test]
fn bags_are_read_by_the_names_of_the_joints() {
    let dir = folder();
    for name in ["two.db3", "two_none.mcap", "two_zstd.mcap", "two_lz4.mcap"] {
        let topic = if name == "two.db3" {
            "\ntopic = \"/joint_states\""
        } else {
            ""
        };
        let r = read(dir.path(), &format!("{}{topic}", data(name))).unwrap();
        holds(&r, [1, 0], 1e-9, name);
        assert!(r.dq.is_some(), "{name}");
    }
    let two = data("two.db3");
    for topic in ["/controller/state", "/dynamic"] {
        let entry = format!("{two}\ntopic = \"{topic}\"");
        let mut r = read(dir.path(), &entry).unwrap();
        if topic == "/controller/state" {
            assert!((r.qref.as_ref().unwrap()[0][5] - r.q[0][5] - 0.001).abs() < 1e-9);
        }
        r.qref = None;
        holds(&r, [1, 0], 1e-9, topic);
    }
    let entry = format!(
        "{two}\ntopic = \"/array\"\nformat = \"db3\"\n[record.columns]\nq = [\"data[1]\", \"data[0]\"]\ntau = [\"data[3]\", \"data[2]\"]"
    );
    holds(&read(dir.path(), &entry).unwrap(), [1, 0], 1e-9, "array");
    // what was chosen and left out is said
    let r = read(dir.path(), &format!("{two}\ntopic = \"/joint_states\"")).unwrap();
    let all: Vec<String> = r.warnings.iter().map(ToString::to_string).collect();
    assert!(
        all.iter()
            .any(|w| w.contains("20 messages") && w.contains("finger")),
        "{all:#?}"
    );
    let e = error(dir.path(), &format!("{two}\ntopic = \"/nothing\""));
    assert!(
        e.contains("/nothing") && e.contains("/dynamic (control_msgs"),
        "{e}"
    );
    let e = error(dir.path(), &format!("{two}\nformat = \"mcap\""));
    assert!(e.contains("db3"), "{e}");
}

/// A log that is read in parts is the same log: no message is lost or comes twice, whatever the format.
#[test]
fn bags_and_tables_come_in_parts_as_they_come_whole() {
    let dir = folder();
    let plant = Plant::load(dir.path().join("two.urdf").to_str().unwrap()).unwrap();
    let stored = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/logs");
    table(
        dir.path(),
        "time_ms;q_1;q_0;torque_1;torque_0\n",
        |t, q, tau| format!("{};{};{};{};{}", 1000.0 * t, q[0], q[1], tau[0], tau[1]),
    );
    let bags = ["two.db3", "two_none.mcap", "two_zstd.mcap", "two_lz4.mcap"];
    let mut paths: Vec<PathBuf> = bags.iter().map(|name| stored.join(name)).collect();
    paths.push(dir.path().join("log.txt"));
    for path in paths {
        let whole = Record::read(&path, &plant, Purpose::Fit, None).unwrap();
        for rows in [64, 90, 150, 1000] {
            let parts = parts::read(&path, &plant, rows);
            let sizes: Vec<usize> = parts.iter().map(Record::len).collect();
            let what = format!("{} in parts of {rows}: {sizes:?}", path.display());
            assert_eq!(sizes.iter().sum::<usize>(), whole.len(), "{what}");
            assert!(
                sizes
                    .iter()
                    .all(|n| 2 * n >= rows.min(whole.len()) && 2 * n < 3 * rows),
                "{what}"
            );
            parts::hold(&parts, &whole, &what);
        }
    }
}

#[test]
fn arrays_of_numpy_and_matlab_are_read() {
    let dir = folder();
    for (name, columns) in [
        (
            "two.npz",
            "q = [\"q[0]\", \"q[1]\"]\ntau = [\"tau[0]\", \"tau[1]\"]",
        ),
        (
            "two_packed.npz",
            "time = { column = \"t\", unit = \"ns\" }\nq = [\"q[0]\", \"q[1]\"]\ntau = [\"tau[0]\", \"tau[1]\"]",
        ),
        (
            "two.mat",
            "time = \"log.t\"\nq = [\"log.q[0]\", \"log.q[1]\"]\ntau = [\"log.tau[0]\", \"log.tau[1]\"]",
        ),
        (
            "two_big.mat",
            "q = [\"q[0]\", \"q[1]\"]\ntau = [\"tau[0]\", \"tau[1]\"]",
        ),
    ] {
        let r = read(
            dir.path(),
            &format!("{}\n[record.columns]\n{columns}", data(name)),
        )
        .unwrap();
        holds(&r, [0, 1], 1e-9, name);
        // and by their names alone
        let r = read(dir.path(), &data(name)).unwrap();
        holds(&r, [0, 1], 1e-9, name);
    }
}

/// A file that is cut anywhere, or of which a byte is another, is an error or is read: never a panic.
#[test]
fn damaged_files_do_not_end_the_program() {
    let dir = folder();
    for name in [
        "two.db3",
        "two_zstd.mcap",
        "two_lz4.mcap",
        "two_packed.npz",
        "two.mat",
    ] {
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
            .join("tests/data/logs")
            .join(name);
        let whole = std::fs::read(path).unwrap();
        let mut state = 1u64;
        let mut random = |n: usize| {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 33) as usize % n
        };
        for k in 0..60 {
            let mut bytes = whole.clone();
            match k % 3 {
                0 => bytes.truncate(random(whole.len())),
                1 => (0..20).for_each(|_| bytes[random(whole.len())] = random(256) as u8),
                _ => bytes[random(600)] ^= 1 << random(8),
            }
            std::fs::write(dir.path().join("damaged.bin"), bytes).unwrap();
            let _ = read(dir.path(), "log = \"damaged.bin\"");
        }
    }
}

/// A zero within the name of a joint: such messages are damaged, whatever else is wrong.
#[test]
fn names_with_zeros_are_damaged_messages() {
    let dir = folder();
    let logs = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/logs");
    let mut bag = std::fs::read(logs.join("two_none.mcap")).unwrap();
    let name = b"wrist_a";
    let places: Vec<usize> = (0..bag.len() - name.len())
        .filter(|&i| bag[i..].starts_with(name))
        .collect();
    assert!(places.len() > 10, "{}", places.len());
    places.iter().for_each(|i| bag[i + 3] = 0);
    std::fs::write(dir.path().join("zeros.mcap"), bag).unwrap();
    let e = error(dir.path(), "log = \"zeros.mcap\"");
    assert!(e.contains("no messages"), "{e}");
}

/// A table in some layout: a line before the rows, one row, what stands between.
fn table(dir: &Path, head: &str, row: impl Fn(f64, [f64; 2], [f64; 2]) -> String) {
    let mut text = String::from(head);
    for i in 0..COUNT {
        let t = i as f64 * STEP;
        let (q, tau) = state(t);
        let _ = writeln!(text, "{}", row(t, q, tau));
    }
    std::fs::write(dir.join("log.txt"), text).unwrap();
}

/// The recordings of real robots: the same numbers from every container, joints by name.
#[test]
fn recorded_bags_are_read() {
    let Some(bags) = shared("data/bags") else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("experiment.toml");
    for (robot, files, rows) in [
        ("panda", ["panda.db3", "panda_zstd.mcap"], 727),
        ("ur10", ["ur10.db3", "ur10_lz4.mcap"], 3441),
    ] {
        let read = |file: &str| {
            let log = bags.join(file);
            let text = format!(
                "robot = \"{robot}\"\n[[record]]\nlog = {:?}\nuse = \"fit\"\n",
                log.display().to_string()
            );
            std::fs::write(&path, text).unwrap();
            Experiment::read(&path).unwrap().records.remove(0)
        };
        // and surveyed, with the robot's joints by their names
        let plant = Plant::load(robot).unwrap();
        for file in files {
            let found = excite::survey::survey(&[bags.join(file)], Some(&plant)).unwrap();
            for joint in plant.actuators() {
                let own = |c: &&excite::survey::Claim| c.joint.as_ref() == Some(&joint.name);
                let of = |means| {
                    found
                        .claims
                        .iter()
                        .filter(own)
                        .filter(move |c| c.means == means)
                };
                assert_eq!(
                    of(excite::survey::Means::Position).count(),
                    1,
                    "{}",
                    joint.name
                );
            }
        }
        let (a, b) = (read(files[0]), read(files[1]));
        assert!(a.len().abs_diff(rows) < 3, "{robot}: {}", a.len());
        assert_eq!(a.len(), b.len());
        for j in 0..a.q.len() {
            for i in 0..a.len() {
                assert!(
                    (a.q[j][i] - b.q[j][i]).abs() < 1e-6,
                    "{robot} q{} at {i}",
                    j + 1
                );
            }
        }
    }
}
