//! What columns mean: logs whose columns are shuffled, renamed, scaled, turned and delayed.
//!
//! `EXCITE_BLIND=50 cargo test --release --test records blind -- --nocapture` makes 50 of each set instead of two, and
//! prints how many columns were exactly right and how many claims were wrong.

use crate::common::{rng, shared::shared};
use excite::dynamics::Samples;
use excite::log::Table;
use excite::regressor::nominal_torque;
use excite::survey::{Means, check, survey};
use excite::{Plant, WarningKind};
use rand::Rng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// A column and what it truly means.
struct Column {
    means: Means,
    joint: usize,
    values: Vec<f64>,
}

fn column(means: Means, joint: usize, values: Vec<f64>) -> Column {
    Column {
        means,
        joint,
        values,
    }
}

/// The columns of a log with our names.
fn named(path: &Path) -> Vec<Column> {
    let table = Table::read(path, &|_| true).unwrap();
    table
        .names
        .iter()
        .zip(table.columns)
        .map(|(name, values)| {
            let digits = name.trim_start_matches(|c: char| !c.is_ascii_digit());
            let joint = digits.parse().unwrap_or(1) - 1;
            let means = match &name[..name.len() - digits.len()] {
                "q" => Means::Position,
                "dq" => Means::Velocity,
                "tau" => Means::Torque,
                "qref" => Means::Command,
                _ => Means::Time,
            };
            column(means, joint, values)
        })
        .collect()
}

/// A motion of a bundled robot, with friction and noise.
fn simulated(plant: &Plant, seed: u64) -> Vec<Column> {
    let (robot, r) = (plant.robot(), &mut rng(seed));
    let (n, count, step) = (robot.dof(), 4000, 0.004);
    let mut motion = Samples::zeros(n, count);
    for (j, joint) in robot.joints.iter().enumerate() {
        let [low, high] = joint.limits.position.map(|x| x.clamp(-3.0, 3.0));
        let (middle, reach) = (0.5 * (low + high), 0.12 * (high - low));
        let waves: Vec<[f64; 3]> = (1..=4)
            .map(|h| {
                [
                    f64::from(h) * 0.8,
                    r.random_range(-1.0..1.0),
                    r.random_range(-1.0..1.0),
                ]
            })
            .collect();
        for i in 0..count {
            let t = i as f64 * step;
            let k = j * count + i;
            motion.q[k] = middle;
            for [w, a, b] in &waves {
                let (s, c) = (w * t).sin_cos();
                motion.q[k] += reach * (a * s + b * c);
                motion.qd[k] += reach * w * (a * c - b * s);
                motion.qdd[k] -= reach * w * w * (a * s + b * c);
            }
        }
    }
    let mut tau = nominal_torque(robot, plant.tree(), &motion);
    for j in 0..n {
        let rows = j * count..(j + 1) * count;
        let size = (tau[rows.clone()].iter().map(|x| x * x).sum::<f64>() / count as f64).sqrt();
        for i in rows {
            tau[i] += 0.1 * size * motion.qd[i].signum() + 0.02 * size * r.random_range(-1.7..1.7);
            motion.q[i] += 2e-5 * r.random_range(-1.0..1.0);
            motion.qd[i] += 1e-3 * r.random_range(-1.0..1.0);
        }
    }
    let mut out = vec![column(
        Means::Time,
        0,
        (0..count).map(|i| i as f64 * step).collect(),
    )];
    for j in 0..n {
        let part = |y: &[f64]| y[j * count..(j + 1) * count].to_vec();
        out.push(column(Means::Position, j, part(&motion.q)));
        out.push(column(Means::Velocity, j, part(&motion.qd)));
        out.push(column(Means::Torque, j, part(&tau)));
    }
    out
}

/// Shuffles, renames, scales, turns and delays columns; returns how many were right, wrong, and all.
fn scramble(columns: &[Column], plant: &Plant, r: &mut ChaCha8Rng, folder: &Path) -> [usize; 3] {
    let joints: Vec<String> = plant.actuators().iter().map(|j| j.name.clone()).collect();
    let degrees = r.random_bool(0.3) && joints.len() > 1;
    let mut made: Vec<(usize, f64, Vec<f64>)> = Vec::new();
    for (k, c) in columns.iter().enumerate() {
        let motion = matches!(c.means, Means::Position | Means::Velocity);
        let mut factor = match c.means {
            Means::Torque if r.random_bool(0.3) => 1e3,
            _ if motion && degrees => 180.0 / std::f64::consts::PI,
            _ => 1.0,
        };
        if c.means != Means::Time && r.random_bool(0.25) {
            factor = -factor;
        }
        let late = if c.means == Means::Torque {
            r.random_range(0..4usize)
        } else {
            0
        };
        let n = c.values.len();
        let values = (0..n)
            .map(|i| factor * c.values[i.saturating_sub(late)])
            .collect();
        made.push((k, factor, values));
    }
    made.shuffle(r);
    let mut text = String::new();
    for k in 0..made.len() {
        let _ = write!(text, "{}c{k}", if k > 0 { "," } else { "" });
    }
    for i in 0..columns[0].values.len() {
        text.push('\n');
        for (k, (_, _, y)) in made.iter().enumerate() {
            let _ = write!(text, "{}{}", if k > 0 { "," } else { "" }, y[i]);
        }
    }
    let path: PathBuf = folder.join("blind.csv");
    std::fs::write(&path, text).unwrap();
    let found = survey(&[path], Some(plant)).unwrap();
    let (mut right, mut wrong) = (0, 0);
    for (claim, (k, factor, _)) in found.claims.iter().zip(&made) {
        if claim.means == Means::Other || claim.confidence < 0.5 {
            continue;
        }
        let truth = &columns[*k];
        let exact = claim.means == truth.means
            && (truth.means == Means::Time
                || claim.joint.as_ref() == Some(&joints[truth.joint])
                    && (claim.factor() * factor - 1.0).abs() < 0.05);
        if exact {
            right += 1;
        } else {
            wrong += 1;
            eprintln!(
                "{:?} of joint {}, factor {factor}: {claim:?}",
                truth.means,
                truth.joint + 1
            );
        }
    }
    [right, wrong, columns.len()]
}

fn times() -> usize {
    std::env::var("EXCITE_BLIND")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(2)
}

/// Sums over scrambles of one set: right, wrong, all.
fn blind(name: &str, columns: &[Column], plant: &Plant, seed: u64) -> [usize; 3] {
    let dir = tempfile::tempdir().unwrap();
    let r = &mut rng(seed);
    let mut sum = [0; 3];
    for _ in 0..times() {
        let one = scramble(columns, plant, r, dir.path());
        (0..3).for_each(|k| sum[k] += one[k]);
    }
    eprintln!(
        "{name}: {} of {} columns exactly right, {} claims wrong",
        sum[0], sum[2], sum[1]
    );
    sum
}

#[test]
fn blind_columns_of_simulated_robots() {
    for robot in ["planar2", "ur5e", "panda"] {
        let plant = Plant::load(robot).unwrap();
        let [right, wrong, all] = blind(robot, &simulated(&plant, 3), &plant, 11);
        // a claim that is wrong in a sign alone is one that only its being usual spoke for
        assert!(20 * wrong <= all, "{robot}: {wrong} of {all}");
        assert!(2 * right > all, "{robot}: {right} of {all}");
    }
}

#[test]
fn blind_columns_of_real_robots() {
    for (name, robot) in [("tx40", ""), ("panda", "panda"), ("emps", "")] {
        let Some(folder) = shared(&format!("data/{name}")) else {
            return;
        };
        let spec = match robot {
            "" => folder.join("robot.toml").display().to_string(),
            bundled => bundled.into(),
        };
        let plant = Plant::load(&spec).unwrap();
        let [_, wrong, all] = blind(name, &named(&folder.join("fit_1.csv")), &plant, 5);
        assert!(20 * wrong <= all, "{name}: {wrong} of {all}");
    }
}

/// What is stated wrongly is said before a model is identified.
#[test]
fn wrong_statements_are_named_before_a_model_is_made() {
    let plant = Plant::load("ur5e").unwrap();
    let columns = simulated(&plant, 4);
    let n = 6;
    let of = |means: Means| -> Vec<Vec<f64>> {
        (0..n)
            .map(|j| {
                columns
                    .iter()
                    .find(|c| c.means == means && c.joint == j)
                    .unwrap()
                    .values
                    .clone()
            })
            .collect()
    };
    let (q, tau) = (of(Means::Position), of(Means::Torque));
    let record = |q: Vec<Vec<f64>>, tau: Vec<Vec<f64>>| {
        let channels = excite::log::Channels {
            t: columns[0].values.clone(),
            q,
            tau,
            qref: None,
        };
        excite::log::Record::from_channels("log", channels, &plant, excite::log::Purpose::Fit, None)
            .unwrap()
    };
    assert_eq!(
        check(&plant, &[record(q.clone(), tau.clone())]).unwrap(),
        []
    );
    // swapped joints
    let mut swapped = q.clone();
    swapped.swap(1, 2);
    let said = check(&plant, &[record(swapped, tau.clone())]).unwrap();
    assert!(
        said.iter()
            .any(|w| w.kind == WarningKind::UnitSuspect && w.message.contains("swapped")),
        "{said:?}"
    );
    // the positions of one joint turned, and the torques of another
    let mut turned = q.clone();
    turned[1].iter_mut().for_each(|x| *x = -*x);
    let said = check(&plant, &[record(turned, tau.clone())]).unwrap();
    assert!(
        said.iter()
            .any(|w| w.subject.contains("shoulder_lift") && w.message.contains("turned")),
        "{said:?}"
    );
    let mut against = tau.clone();
    against[2].iter_mut().for_each(|x| *x = -*x);
    let said = check(&plant, &[record(q.clone(), against)]).unwrap();
    assert!(
        said.iter()
            .any(|w| w.subject.contains("tau3") && w.message.contains("sign is turned")),
        "{said:?}"
    );
    // degrees are refused
    let degrees = q
        .iter()
        .map(|y| y.iter().map(|x| x.to_degrees()).collect())
        .collect();
    let e = check(&plant, &[record(degrees, tau)])
        .unwrap_err()
        .to_string();
    assert!(e.contains("deg"), "{e}");
}

/// The size of a load is no torque.
#[test]
fn a_robot_without_torques_is_said_to_have_none() {
    let Some(folder) = shared("data/so101/chirp_sweep") else {
        return;
    };
    let files = ["state_motor.csv", "control.csv"].map(|f| folder.join(f));
    let found = survey(&files, None).unwrap();
    let count = |m: Means| {
        found
            .claims
            .iter()
            .filter(|c| c.means == m && c.confidence >= 0.5)
            .count()
    };
    assert_eq!(
        [
            count(Means::Position),
            count(Means::Command),
            count(Means::Torque)
        ],
        [6, 6, 0]
    );
    assert!(
        found
            .warnings
            .iter()
            .any(|w| w.message.contains("There is no torque here"))
    );
}
