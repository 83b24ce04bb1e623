//! Files for controllers: each is read back, by what its users read it with where that is there, and has the samples of
//! the series in it. `PYTHON` names the interpreter, `python3` otherwise.

mod bag;
mod deviation;
mod outside;
mod refused;

use excite::trajectory::samples::{read_columns, times};
use excite::trajectory::{Fourier, Trajectory};
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

/// Half of the ninth decimal, and what degrees add to it.
const NINE: f64 = 1e-9;

fn designed(robot: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    root.join(format!("trajectories/{robot}/trajectory.json"))
}

/// An empty folder in which the program runs.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Folder(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Exports a motion into `name`; what the program prints.
    fn export(&self, trajectory: &Path, line: &str, name: &str) -> String {
        let out = Command::new(env!("CARGO_BIN_EXE_excite"))
            .current_dir(self.0.path())
            .arg("export")
            .arg(trajectory)
            .args(line.split_whitespace())
            .args(["--output", name])
            .output()
            .unwrap();
        let error = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.success(), "{line}: {error}");
        String::from_utf8(out.stdout).unwrap()
    }

    fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    fn columns(&self, name: &str, names: &[&str]) -> Vec<Vec<f64>> {
        let names: Vec<String> = names.iter().map(|n| n.to_string()).collect();
        read_columns(self.path(name), &names).unwrap()
    }
}

fn motion(robot: &str) -> Fourier {
    Trajectory::read(designed(robot)).unwrap().fourier
}

/// Positions, velocities and accelerations at a time.
fn state(f: &Fourier, t: f64) -> [Vec<f64>; 3] {
    let zero = || vec![0.0; f.dof()];
    let [mut q, mut dq, mut ddq] = [zero(), zero(), zero()];
    f.evaluate(t, [&mut q, &mut dq, &mut ddq]);
    [q, dq, ddq]
}

/// Compares rows of positions with the series at the times of a rate.
fn compare(rows: &[Vec<f64>], f: &Fourier, rate: f64, within: f64) {
    let times = times(f.period, rate).unwrap();
    assert_eq!(rows.len(), times.len());
    for (row, t) in rows.iter().zip(times) {
        let [q, ..] = state(f, t);
        assert_eq!(row.len(), q.len());
        for (a, b) in row.iter().zip(q) {
            assert!((a - b).abs() <= within, "{t} s: {a}, not {b}");
        }
    }
}

/// Numbers between brackets of the lines that begin so.
fn bracketed(text: &str, begin: &str) -> Vec<Vec<f64>> {
    let lines = text.lines().filter_map(|l| l.trim().strip_prefix(begin));
    let inside = lines.filter_map(|l| l.split(']').next());
    let numbers =
        |l: &str| -> Vec<f64> { l.split(',').map(|x| x.trim().parse().unwrap()).collect() };
    inside.map(numbers).collect()
}

/// Rows of columns.
fn rows(columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = columns.first().map_or(0, Vec::len);
    (0..n)
        .map(|i| columns.iter().map(|c| c[i]).collect())
        .collect()
}

/// A second trajectory beside the designed ones: the same with another end, name or number of periods.
fn altered(folder: &Folder, robot: &str, change: impl Fn(&mut Trajectory)) -> PathBuf {
    let mut trajectory = Trajectory::read(designed(robot)).unwrap();
    change(&mut trajectory);
    let path = folder.path("altered.json");
    trajectory.write(&path, true).unwrap();
    path
}

#[test]
fn plain_csv_has_the_bits_of_the_series() {
    let (folder, f) = (Folder::new(), motion("panda"));
    let said = folder.export(&designed("panda"), "--format csv --rate 200", "a.csv");
    assert!(
        said.contains("7 joints, 2001 samples at 200 Hz, 10 s"),
        "{said}"
    );
    let bytes = folder.read("a.csv").len();
    assert!(said.contains(&format!("a.csv ({bytes} bytes)")), "{said}");
    let names: Vec<String> = ["q", "dq", "ddq"]
        .iter()
        .flat_map(|n| (1..=7).map(move |j| format!("{n}{j}")))
        .collect();
    let names: Vec<&str> = std::iter::once("t")
        .chain(names.iter().map(String::as_str))
        .collect();
    let columns = folder.columns("a.csv", &names);
    for (i, t) in columns[0].iter().enumerate() {
        let [q, dq, ddq] = state(&f, *t);
        for (k, value) in [q, dq, ddq].concat().into_iter().enumerate() {
            assert_eq!(columns[1 + k][i].to_bits(), value.to_bits());
        }
    }
}

#[test]
fn plain_csv_in_another_order_and_unit() {
    let (folder, f) = (Folder::new(), motion("scara"));
    let line = "--format csv --rate 50 --columns q,t --unit deg,mm --joints joint3,joint1";
    folder.export(&designed("scara"), line, "a.csv");
    let text = folder.read("a.csv");
    assert!(text.starts_with("q3,q1,t\n"), "{}", &text[..40]);
    let columns = folder.columns("a.csv", &["t", "q1", "q3"]);
    for (i, &t) in columns[0].iter().enumerate() {
        let [q, ..] = state(&f, t);
        assert!((columns[1][i] - q[0].to_degrees()).abs() < 1e-12);
        // the third joint slides
        assert!((columns[2][i] - 1000.0 * q[2]).abs() < 1e-12);
    }
}

#[test]
fn franka_and_fri_tables() {
    let folder = Folder::new();
    folder.export(&designed("panda"), "--format franka", "f.csv");
    let q: Vec<String> = (1..=7).map(|j| format!("q{j}")).collect();
    let q: Vec<&str> = q.iter().map(String::as_str).collect();
    compare(
        &rows(&folder.columns("f.csv", &q)),
        &motion("panda"),
        1000.0,
        0.0,
    );
    let dq = folder.columns("f.csv", &["t", "dq7"]);
    for (t, v) in dq[0].iter().zip(&dq[1]) {
        assert_eq!(*v, state(&motion("panda"), *t)[1][6]);
    }
    folder.export(&designed("iiwa14"), "--format kuka-fri --rate 200", "i.csv");
    compare(
        &rows(&folder.columns("i.csv", &q)),
        &motion("iiwa14"),
        200.0,
        0.0,
    );
}

#[test]
fn a_program_for_universal_robots() {
    let (folder, f) = (Folder::new(), motion("ur5e"));
    let said = folder.export(
        &designed("ur5e"),
        "--format urscript --rate 500",
        "a.script",
    );
    assert!(said.contains("straight lines"), "{said}");
    let text = folder.read("a.script");
    compare(&bracketed(&text, "servoj(["), &f, 500.0, NINE);
    assert_eq!(text.matches("], 0, 0, 0.002, 0.1, 300)\n").count(), 5001);
    // the start is compared with where the arm is before anything moves, and nothing else moves it
    let start = bracketed(&text, "start = [");
    assert!(compare_one(&start[0], &state(&f, 0.0)[0]));
    let check = text.find("get_actual_joint_positions").unwrap();
    assert!(check < text.find("halt").unwrap() && text.find("halt") < text.find("servoj"));
    assert!(!text.contains("movej") && text.is_ascii());
    // every block that is opened is closed
    let words = |w: &str| text.lines().filter(|l| l.trim().starts_with(w)).count();
    let ends = text.lines().filter(|l| l.trim() == "end").count();
    assert_eq!(words("def ") + words("while ") + words("if "), ends);
    folder.export(
        &designed("ur5e"),
        "--format urscript --rate 125 --move-to-start",
        "b.script",
    );
    let text = folder.read("b.script");
    assert!(text.find("movej(start").unwrap() < text.find("get_actual").unwrap());
    compare(&bracketed(&text, "servoj(["), &f, 125.0, NINE);
}

fn compare_one(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= NINE)
}

#[test]
fn telegrams_for_kuka() {
    let (folder, f) = (Folder::new(), motion("ur5e"));
    for (rate, cycle) in [("250", "0.004"), ("83.333", "0.012")] {
        let name = format!("{rate}.xml");
        folder.export(
            &designed("ur5e"),
            &format!("--format kuka-rsi --rate {rate}"),
            &name,
        );
        let text = folder.read(&name);
        let document = roxmltree::Document::parse(&text).unwrap();
        let root = document.root_element();
        assert_eq!(root.attribute("Cycle"), Some(cycle));
        let axes = |node: roxmltree::Node| -> Vec<f64> {
            let one = |j: usize| {
                node.attribute(format!("A{j}").as_str())?
                    .parse::<f64>()
                    .ok()
            };
            (1..=6).map(|j| one(j).unwrap()).collect()
        };
        let find = |name: &'static str| root.descendants().filter(move |n| n.has_tag_name(name));
        let start = axes(find("AIPos").next().unwrap());
        let away: Vec<Vec<f64>> = find("AK").map(axes).collect();
        assert_eq!(away[0], [0.0; 6]);
        let absolute: Vec<Vec<f64>> = away
            .iter()
            .map(|row| {
                row.iter()
                    .zip(&start)
                    .map(|(a, s)| (a + s).to_radians())
                    .collect()
            })
            .collect();
        compare(
            &absolute,
            &f,
            if rate == "250" { 250.0 } else { 250.0 / 3.0 },
            NINE,
        );
        assert_eq!(find("IPOC").count(), away.len());
    }
}

#[test]
fn a_message_in_yaml() {
    let (folder, f) = (Folder::new(), motion("panda"));
    folder.export(&designed("panda"), "--format ros2 --rate 100", "a.yaml");
    let text = folder.read("a.yaml");
    for (k, name) in ["- positions: [", "velocities: [", "accelerations: ["]
        .iter()
        .enumerate()
    {
        let rows = bracketed(&text, name);
        assert_eq!(rows.len(), 1001);
        for (i, row) in rows.iter().enumerate() {
            assert_eq!(row, &state(&f, i as f64 / 100.0)[k]);
        }
    }
    assert!(text.contains("\n  time_from_start: {sec: 2, nanosec: 430000000}\n"));
    // fewer derivatives: the controller interpolates otherwise, and the program says so
    let said = folder.export(&designed("panda"), "--format ros2 --columns q,dq", "b.yaml");
    assert!(said.contains("cubics") && !folder.read("b.yaml").contains("accelerations"));
}

#[test]
fn periods_and_speed() {
    let (folder, f) = (Folder::new(), motion("planar2"));
    let line = "--format csv --rate 40 --periods 3 --speed 0.5";
    folder.export(&designed("planar2"), line, "a.csv");
    let columns = folder.columns("a.csv", &["t", "q2", "dq2", "ddq2"]);
    assert_eq!((columns[0].len(), columns[0][2400]), (2401, 60.0));
    for (i, &t) in columns[0].iter().enumerate() {
        let [q, dq, ddq] = state(&f, 0.5 * t);
        assert!((columns[1][i] - q[1]).abs() < 1e-12);
        assert!((columns[2][i] - 0.5 * dq[1]).abs() < 1e-11);
        assert!((columns[3][i] - 0.25 * ddq[1]).abs() < 1e-10);
    }
}

/// What the actuators of a parallel robot do while its platform moves, from the same kinematics as in `samples.csv`.
#[test]
fn a_platforms_actuators_are_sent() {
    for robot in ["hexapod", "delta"] {
        let folder = Folder::new();
        let plant = excite::Plant::load(robot).unwrap();
        let actuators = plant.actuators().len();
        let said = folder.export(&designed(robot), "--format csv --rate 100", "a.csv");
        assert!(said.contains("not proven"), "{said}");
        let reference = folder.path("reference.csv");
        plant
            .write_motion(&reference, false, &motion(robot), 1, 100.0)
            .unwrap();
        let names: Vec<String> = ["q", "dq", "ddq"]
            .iter()
            .flat_map(|n| (1..=actuators).map(move |j| format!("{n}{j}")))
            .collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let (a, b) = (
            folder.columns("a.csv", &names),
            folder.columns("reference.csv", &names),
        );
        for (a, b) in a.iter().zip(&b) {
            assert!(crate::common::compare::difference(a, b) < 1e-9);
        }
    }
}
