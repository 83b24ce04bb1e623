//! Loops through two arms: Jacobians, what can be told, and a calibration without any instrument.

use super::*;
use crate::calibrate::closed;
use crate::calibrate::frame::{Frame, exp};
use crate::calibrate::kin::Kin;
use crate::calibrate::layout::Start;
use crate::calibrate::model::{Model, Settings};
use crate::calibrate::poses;
use crate::calibrate::row::Value;
use crate::error::Error;
use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::PathBuf;

/// A column that turns, two arms of six joints, a tool each.
const ROBOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/two_arms.urdf");

fn two_arms() -> Opened {
    open_pair(ROBOT, Some("left_tool"), "right_tool").unwrap()
}

#[test]
fn jacobians_of_loops_are_those_of_differences() {
    let opened = two_arms();
    assert_eq!(opened.joints.len(), 13);
    let r = &mut ChaCha8Rng::seed_from_u64(5);
    for kind in [Kind::Loop, Kind::Ball] {
        let rows = (0..4).map(|_| {
            let q = (0..13).map(|_| r.random_range(-1.0..1.0)).collect();
            row(0, q, Value::Contact, true)
        });
        let rows = rows.collect();
        let c = input(
            vec![measurement(kind, "held", "held", [1e-3, 1e-3])],
            rows,
            [0.002, 0.005],
        );
        let poses = nominal(&opened, &c);
        let mut start = Start::none(1);
        (start.grip[0], start.ball[0]) = closed::start(&c, &opened.kin, 0, &poses);
        let model = Model::new(
            &c,
            &opened.kin,
            Vec::new(),
            None,
            start,
            &poses,
            Settings::default(),
        );
        let x: Vec<f64> = (0..model.count())
            .map(|_| 0.003 * r.random_range(-1.0..1.0))
            .collect();
        for i in 0..4 {
            let b = model.block(i, &x).unwrap();
            for (k, &column) in b.columns.iter().enumerate() {
                let h = 1e-6;
                let at = |d: f64| {
                    let mut x = x.clone();
                    x[column] += d;
                    model.block(i, &x).unwrap().r
                };
                let off = ((at(h) - at(-h)) / (2.0 * h) - b.j.column(k)).norm();
                let name = &model.unknowns[column].name;
                assert!(off < 1e-4 * (1.0 + b.j.column(k).norm()), "{name}: {off}");
            }
        }
    }
}

/// A file whose rows close the loop of a robot with errors.
fn rehearsed(seed: u64, spoil: usize) -> (PathBuf, Opened) {
    let opened = two_arms();
    let request = poses::Request {
        count: 40,
        kind: Kind::Loop,
        points: Vec::new(),
        grip: Some(Frame::at([0.0, 0.0, 0.15], [0.0, 0.0, 3.0])),
        region: None,
        sight: None,
        std: [5e-5, 1e-4],
        tolerances: Tolerances {
            length: 0.001,
            angle: 0.003,
            ..Tolerances::default()
        },
        candidates: 150,
        seed: 1,
    };
    static CHOSEN: std::sync::OnceLock<poses::Poses> = std::sync::OnceLock::new();
    let chosen = CHOSEN.get_or_init(|| poses::choose(&opened, &request).unwrap());
    assert!(chosen.predicted < 0.9 * chosen.random_middle());
    let mut text = poses::rehearse(&opened, &request, chosen, seed).unwrap();
    if spoil > 0 {
        let r = &mut ChaCha8Rng::seed_from_u64(9);
        let mut lines: Vec<String> = text.lines().map(str::to_string).collect();
        for line in lines.iter_mut().skip(1).take(spoil) {
            let mut cells: Vec<String> = line.split(',').map(str::to_string).collect();
            let q: f64 = cells[3].parse().unwrap();
            cells[3] = (q + 0.05 + 0.01 * normal(r)).to_string();
            *line = cells.join(",");
        }
        text = lines.join("\n");
    }
    let folder =
        std::env::temp_dir().join(format!("excite_loop_{}_{seed}_{spoil}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("calibration.toml");
    let frames = [Some("left_tool"), Some("right_tool")];
    std::fs::write(folder.join("held.csv"), text).unwrap();
    std::fs::write(&file, poses::toml(ROBOT, frames, &request, "held.csv")).unwrap();
    (file, opened)
}

#[test]
fn two_arms_calibrate_each_other() {
    let (file, _) = rehearsed(3, 0);
    let (input, opened) = read(&file).unwrap();
    let found = calibrate(&input, &opened, Settings::default()).unwrap();
    let [before, after] = found.errors(false, true).map(|e| Stats::of(&e).unwrap());
    // the loop is a loose bound of the tool: about 10 mm by the file, to the noise afterwards
    assert!(before.mean > 2e-3, "{before:?}");
    assert!(after.mean < 1e-4 && after.max < 4e-4, "{after:?}");
    let i = &found.identifiability;
    // waist and base of both arms (6 and what the waist adds), the size of everything, and the grip against both tools
    assert!(i.rank < i.total && i.gap > 1e3, "{} {}", i.rank, i.gap);
    assert!(i.gauge().iter().any(|g| g.contains("held.csv")));
    assert!(found.outliers.is_empty(), "{:?}", found.outliers);
    // the file that is written closes the loops as the fit does
    let folder = file.parent().unwrap();
    let urdf = folder.join("robot.urdf");
    std::fs::write(&urdf, &found.files[0].1).unwrap();
    let again = open_pair(urdf.to_str().unwrap(), Some("left_tool"), "right_tool").unwrap();
    let relative: Vec<Frame> = (input.rows.iter().filter(|r| !r.fit))
        .map(|r| {
            let a = again.kin.nominal(&r.q).unwrap();
            a.inverse().then(&again.kin.nominal_other(&r.q).unwrap())
        })
        .collect();
    let mean = relative.iter().map(|f| f.p).sum::<Vector3<f64>>() / relative.len() as f64;
    let off = relative.iter().map(|f| (f.p - mean).norm());
    assert!(off.sum::<f64>() / (relative.len() as f64) < 1.5e-4);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn loops_that_slipped_are_named() {
    let (file, _) = rehearsed(4, 6);
    let (input, opened) = read(&file).unwrap();
    let found = calibrate(&input, &opened, Settings::default()).unwrap();
    let [_, after] = found.errors(false, true).map(|e| Stats::of(&e).unwrap());
    assert!(after.mean < 1.5e-4, "{after:?}");
    let rows: Vec<usize> = found.outliers.iter().map(|o| o.row).collect();
    assert_eq!(rows, (0..6).collect::<Vec<_>>());
    std::fs::remove_dir_all(file.parent().unwrap()).unwrap();
}

#[test]
fn a_ball_between_two_arms_and_a_known_grip() {
    let opened = two_arms();
    let Kin::Arm(arm) = &opened.kin else { panic!() };
    let r = &mut ChaCha8Rng::seed_from_u64(6);
    let unknowns = opened.kin.unknowns([0.001, 0.003]);
    let truth: Vec<f64> = unknowns.iter().map(|u| u.prior * normal(r)).collect();
    let (z, c) = (Vector3::new(0.02, 0.0, 0.1), Vector3::new(0.0, 0.03, 0.08));
    let mut rows = Vec::new();
    while rows.len() < 60 {
        let mut q: Vec<f64> = (0..13).map(|_| r.random_range(-1.2..1.2)).collect();
        // any turn of the second arm about the ball
        let turn = exp(&Vector3::from_fn(|_, _| r.random_range(-1.0..1.0)));
        let grip = Frame::at(z.into(), [0.0, 0.0, 3.0]).then(&Frame::at([0.0; 3], [0.0; 3]));
        let grip = Frame {
            r: grip.r * turn,
            p: z - grip.r * turn * c,
        };
        let wanted = poses::Wanted::Grip(grip);
        if poses::reach(arm, &mut q, &truth, &wanted).is_some() {
            let fit = rows.len() < 40;
            rows.push(row(0, q, Value::Contact, fit));
        }
    }
    let measured = measurement(Kind::Ball, "held", "held", [5e-5, f64::NAN]);
    let c = input(vec![measured], rows, [0.001, 0.003]);
    let found = calibrate(&c, &opened, Settings::default()).unwrap();
    let [before, after] = found.errors(false, true).map(|e| Stats::of(&e).unwrap());
    assert!(
        before.mean > 1e-3 && after.mean < 1e-4,
        "{before:?} {after:?}"
    );
}

#[test]
fn frames_that_make_no_loop_are_errors() {
    let message = |e: Result<Opened, Error>| e.err().map(|e| e.to_string()).unwrap_or_default();
    let pair = |a, b| message(open_pair(ROBOT, Some(a), b));
    assert!(pair("left_tool", "left_6").contains("no moving joint between"));
    assert!(pair("left_tool", "left_3").contains("in one chain"));
    assert!(pair("left_tool", "rigth_tool").contains("right_tool"));
    assert!(pair("left_tool", "base").contains("does not move"));
    assert!(message(open_pair(ROBOT, None, "right_tool")).contains("2 tips"));
    assert!(message(open_pair("h4", None, "x")).contains("one platform"));
    let folder = std::env::temp_dir().join(format!("excite_no_loop_{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let zeros = "0,".repeat(12) + "0\n";
    std::fs::write(folder.join("held.csv"), zeros.repeat(4)).unwrap();
    let file = folder.join("calibration.toml");
    let robot = format!("robot = {ROBOT:?}\nframe = \"left_tool\"\n");
    let held = "[[measurement]]\nkind = \"loop\"\nfile = \"held.csv\"\n";
    let other = "other = \"right_tool\"\n";
    for (text, part) in [
        (format!("{robot}{held}"), "other = \"LINK\""),
        (
            format!("{robot}{other}[[measurement]]\nkind = \"point\"\nfile = \"held.csv\"\n"),
            "there is none",
        ),
        (
            format!("{robot}{other}{held}hold = \"ball\"\ngrip = [0, 0, 0, 1, 0, 0, 0]\n"),
            "rigid hold",
        ),
        (
            format!("{robot}{other}{held}grip = [0, 0, 0, 2, 0, 0, 0]\n"),
            "of length 1",
        ),
        (
            format!("{robot}{other}{held}grip_std = [1e-4, 1e-4]\n"),
            "there is none",
        ),
    ] {
        std::fs::write(&file, text).unwrap();
        let said = read(&file).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(said.contains(part), "{said}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}
