//! Logs that are wrong in one way each: refused with the drive and the reason.

use crate::common::noise::normal;
use excite::dynamics::Samples;

use excite::load::{Settings, identify};
use excite::log::Experiment;
use excite::plant::Plant;
use excite::robot::Inertia;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::fmt::Write as _;

/// Areas of the pistons, m².
const AREAS: [f64; 2] = [1.96e-3, 1.65e-3];
/// Air outside, and pressure of the chambers on the rod side, Pa.
const AIR: f64 = 101_325.0;
const ROD_SIDE: f64 = 3.5e5;
/// Samples of a period of 5 s.
const COUNT: usize = 500;

/// One record: positions, forces and chamber pressures, drive by drive.
#[derive(Clone)]
struct Table {
    q: Vec<Vec<f64>>,
    tau: Vec<Vec<f64>>,
    pa: Vec<Vec<f64>>,
    pb: Vec<Vec<f64>>,
}

impl Table {
    /// Two periods of the same motion, with or without a load of 12 kg.
    fn new(plant: &Plant, loaded: bool, seed: u64) -> Table {
        let mut x = Samples::zeros(6, COUNT);
        let home = plant.home().unwrap();
        for (j, home) in home.iter().enumerate() {
            let size = if j < 3 { 0.03 } else { 0.1 };
            for i in 0..COUNT {
                x.q[j * COUNT + i] = *home;
                for h in [1, 2 + j % 3, 5] {
                    let w = std::f64::consts::TAU * h as f64 / 5.0;
                    let angle = w * i as f64 * 0.01 + (3 * j + 7 * h) as f64;
                    let a = size / (h as f64).sqrt();
                    x.q[j * COUNT + i] += a * angle.sin();
                    x.qd[j * COUNT + i] += a * w * angle.cos();
                    x.qdd[j * COUNT + i] -= a * w * w * angle.sin();
                }
            }
        }
        let mut tau = plant.nominal_torque(&x).unwrap();
        if loaded {
            let load = [12.0, 0.02, -0.03, 0.1, 0.12, 0.0, 0.0, 0.14, 0.0, 0.1];
            let load = Inertia::from_quantities(&load);
            let w = plant.body_columns(plant.tool().unwrap(), &x).unwrap();
            for (i, t) in tau.iter_mut().enumerate() {
                *t += (0..10).map(|k| w[(i, k)] * load.0[k]).sum::<f64>();
            }
        }
        let moved = plant.actuator_motion(&x).unwrap();
        let mut r = ChaCha8Rng::seed_from_u64(seed);
        let twice = |a: usize, f: &mut dyn FnMut(usize) -> f64| -> Vec<f64> {
            (0..2 * COUNT).map(|i| f(a * COUNT + i % COUNT)).collect()
        };
        let all = 0..6;
        let tau: Vec<Vec<f64>> = all
            .clone()
            .map(|a| {
                let sticking = 10.0;
                twice(a, &mut |i| {
                    let v = moved.qd[i];
                    let peak = sticking * (-(v / 0.01).powi(2)).exp() * v.signum();
                    tau[i] + 2.0 * a as f64 - 5.0 + peak + 2.0 * normal(&mut r)
                })
            })
            .collect();
        let outside = AIR * (AREAS[0] - AREAS[1]);
        let pa = |f: &f64| (f + ROD_SIDE * AREAS[1] + outside) / AREAS[0];
        Table {
            q: all.map(|a| twice(a, &mut |i| moved.q[i])).collect(),
            pa: tau.iter().map(|t| t.iter().map(pa).collect()).collect(),
            pb: vec![vec![ROD_SIDE; 2 * COUNT]; 6],
            tau,
        }
    }

    fn csv(&self, pressures: bool) -> String {
        let mut groups = vec![("q", &self.q)];
        match pressures {
            true => groups.extend([("pa", &self.pa), ("pb", &self.pb)]),
            false => groups.push(("tau", &self.tau)),
        }
        let mut out = String::from("t");
        for (name, columns) in &groups {
            for j in 0..columns.len() {
                let _ = write!(out, ",{name}{}", j + 1);
            }
        }
        out.push('\n');
        for i in 0..2 * COUNT {
            let _ = write!(out, "{:.3}", i as f64 * 0.01);
            for (_, columns) in &groups {
                for column in *columns {
                    let _ = write!(out, ",{:.8}", column[i]);
                }
            }
            out.push('\n');
        }
        out
    }

    fn each(columns: &mut [Vec<f64>], f: impl Fn(usize, f64) -> f64) {
        for (j, column) in columns.iter_mut().enumerate() {
            column.iter_mut().for_each(|x| *x = f(j, *x));
        }
    }
}

/// Runs `load` on the two records after a change of both; the mass, or the error.
fn run(
    pressures: bool,
    payloads: [&str; 2],
    settings: &Settings,
    change: impl Fn(&mut Table),
) -> Result<f64, String> {
    let plant = Plant::load("hexapod").unwrap();
    let dir = tempfile::tempdir().unwrap();
    let text = include_str!("../../src/mechanism/bundled/hexapod.toml");
    let piston = format!("[actuator]\npiston = [{}, {}]", AREAS[0], AREAS[1]);
    let robot = text.replace("[actuator]", &piston);
    std::fs::write(dir.path().join("robot.toml"), robot).unwrap();
    let mut experiment = String::from("robot = \"robot.toml\"\n");
    for (k, name) in ["empty", "loaded"].into_iter().enumerate() {
        let mut table = Table::new(&plant, k == 1, k as u64);
        change(&mut table);
        let log = format!("{name}.csv");
        std::fs::write(dir.path().join(&log), table.csv(pressures)).unwrap();
        let _ = write!(
            experiment,
            "[[record]]\nlog = \"{log}\"\nuse = \"fit\"\nperiod = 5.0\npayload = \"{}\"\n",
            payloads[k]
        );
    }
    let path = dir.path().join("experiment.toml");
    std::fs::write(&path, experiment).unwrap();
    let experiment = Experiment::read(&path).map_err(|e| e.to_string())?;
    let found = identify(&experiment, settings).map_err(|e| e.to_string())?;
    let suspect = found
        .warnings
        .iter()
        .find(|w| w.kind.code() == "log_suspect");
    match suspect {
        Some(w) => Err(format!("warning: {w}")),
        None => Ok(found.load().values()[0]),
    }
}

const RIGHT: [&str; 2] = ["none", "unknown"];

/// Asserts that a change is refused with these words.
fn refused(pressures: bool, words: &[&str], change: impl Fn(&mut Table)) {
    let said = run(pressures, RIGHT, &Settings::default(), change).unwrap_err();
    println!("{said}");
    assert!(words.iter().all(|w| said.contains(w)), "{words:?}: {said}");
}

#[test]
fn right_logs_pass() {
    for pressures in [false, true] {
        let mass = run(pressures, RIGHT, &Settings::default(), |_| ()).unwrap();
        assert!((mass - 12.0).abs() < 0.1, "{mass}");
    }
}

#[test]
fn chambers_of_one_drive_are_exchanged() {
    refused(true, &["chambers a and b of leg3 exchanged"], |t| {
        let Table { pa, pb, .. } = t;
        std::mem::swap(&mut pa[2], &mut pb[2]);
    });
}

#[test]
fn chambers_of_all_drives_are_exchanged() {
    refused(true, &["chambers a and b of all drives exchanged"], |t| {
        std::mem::swap(&mut t.pa, &mut t.pb);
    });
}

#[test]
fn pressures_in_bar() {
    refused(true, &["they look like bar"], |t| {
        Table::each(&mut t.pa, |_, p| p * 1e-5);
        Table::each(&mut t.pb, |_, p| p * 1e-5);
    });
}

#[test]
fn records_are_exchanged() {
    let turned = ["unknown", "none"];
    let said = run(false, turned, &Settings::default(), |_| ()).unwrap_err();
    assert!(said.contains("the records are exchanged"), "{said}");
    assert!(said.contains("empty (payload") && said.contains("loaded (payload"));
    // who wants to go on can
    let on = Settings::default().with(|set| set.checked = false);
    assert!(run(false, turned, &on, |_| ()).is_ok());
}

#[test]
fn lengths_of_legs_for_strokes() {
    refused(false, &["lengths of the legs, not strokes", "leg1"], |t| {
        Table::each(&mut t.q, |_, q| q + 0.69);
    });
}

#[test]
fn millimetres() {
    refused(false, &["millimetres", "leg1"], |t| {
        Table::each(&mut t.q, |_, q| 1e3 * q);
    });
}

#[test]
fn legs_are_misnumbered() {
    refused(
        false,
        &["leg2 and leg5 exchanged, positions and forces alike"],
        |t| {
            t.q.swap(1, 4);
            t.tau.swap(1, 4);
        },
    );
}

#[test]
fn forces_of_two_legs_are_exchanged() {
    refused(false, &["the forces of leg2 and leg5 exchanged"], |t| {
        t.tau.swap(1, 4);
    });
}

#[test]
fn positions_of_two_legs_are_exchanged() {
    refused(false, &["the positions of leg3 and leg4 exchanged"], |t| {
        t.q.swap(2, 3);
    });
}

#[test]
fn drives_of_the_wrong_sign() {
    refused(false, &["the sign of the force of leg4 turned"], |t| {
        Table::each(&mut t.tau, |j, x| if j == 3 { -x } else { x });
    });
    refused(false, &["leg2 turned", "leg6 turned"], |t| {
        Table::each(&mut t.tau, |j, x| if j % 4 == 1 { -x } else { x });
    });
    refused(false, &["the signs of all forces turned"], |t| {
        Table::each(&mut t.tau, |_, x| -x);
    });
    refused(false, &["the positions of leg3 have the wrong sign"], |t| {
        Table::each(&mut t.q, |j, x| if j == 2 { -x } else { x });
    });
}

#[test]
fn forces_in_another_unit() {
    refused(false, &["the forces have another unit or sign"], |t| {
        Table::each(&mut t.tau, |_, x| 1e-3 * x);
    });
}

#[test]
fn degrees() {
    let plant = Plant::load("delta").unwrap();
    let dir = tempfile::tempdir().unwrap();
    let mut csv = String::from("t,q1,q2,q3,tau1,tau2,tau3\n");
    let home = plant.home().unwrap();
    let mut x = Samples::zeros(home.len(), 400);
    for (j, h) in home.iter().enumerate() {
        for i in 0..400 {
            x.q[j * 400 + i] = h + 0.05 * (0.05 * i as f64 + j as f64).sin();
        }
    }
    let moved = plant.actuator_motion(&x).unwrap();
    for i in 0..400 {
        let _ = write!(csv, "{:.3}", 0.01 * i as f64);
        for a in 0..3 {
            let _ = write!(csv, ",{:.6}", moved.q[a * 400 + i].to_degrees());
        }
        csv.push_str(",1,1,1\n");
    }
    std::fs::write(dir.path().join("loaded.csv"), csv).unwrap();
    let text = "robot = \"delta\"\n[[record]]\nlog = \"loaded.csv\"\nuse = \"fit\"\npayload = \"unknown\"\n";
    let path = dir.path().join("experiment.toml");
    std::fs::write(&path, text).unwrap();
    let said = Experiment::read(&path)
        .and_then(|e| identify(&e, &Settings::default()).map(|_| ()))
        .unwrap_err()
        .to_string();
    assert!(said.contains("degrees"), "{said}");
}
