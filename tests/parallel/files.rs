//! Robot files of parallel robots: what they say is what the mechanism does, through the program,
//! and mistakes in them are named.

mod refused;

use crate::common;
use crate::common::compare::{difference, largest};
use crate::common::shared::checks;

use assert_cmd::Command;
use common::parallel::{matrix, numbers, reference};
use common::parallel_toml::{chains, hexapod};
use excite::Plant;
use excite::mechanism::{Mechanism, bundled};
use nalgebra::{Rotation3, UnitQuaternion};
use serde_json::Value;
use std::path::Path;

/// `excite torque` of a robot file and a motion.
fn torque(folder: &Path, toml: &str, csv: &str) -> Vec<Vec<f64>> {
    std::fs::write(folder.join("robot.toml"), toml).unwrap();
    std::fs::write(folder.join("motion.csv"), csv).unwrap();
    let out = Command::cargo_bin("excite")
        .unwrap()
        .current_dir(folder)
        .args(["torque", "robot.toml", "motion.csv"])
        .output()
        .unwrap();
    let text = String::from_utf8(out.stdout).unwrap();
    let error = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{error}");
    let mut lines = text.lines();
    assert!(lines.next().unwrap().starts_with("t,tau1,tau2,tau3"));
    lines
        .map(|l| l.split(',').skip(1).map(|x| x.parse().unwrap()).collect())
        .collect()
}

/// A CSV with one line a case.
fn csv(names: &str, rows: impl Iterator<Item = Vec<f64>>) -> String {
    let mut text = format!("t,{}\n", names.replace(' ', ","));
    for (i, row) in rows.enumerate() {
        let row: Vec<String> = row.iter().map(|x| format!("{x:?}")).collect();
        text += &format!("{i},{}\n", row.join(","));
    }
    text
}

fn compare(what: &str, ours: &[Vec<f64>], cases: &[Value], key: &str) {
    assert_eq!(ours.len(), cases.len());
    let mut worst = 0.0f64;
    for (ours, case) in ours.iter().zip(cases) {
        let theirs = numbers(&case[key]);
        assert_eq!(ours.len(), theirs.len());
        for (a, b) in ours.iter().zip(&theirs) {
            worst = worst.max((a - b).abs());
        }
    }
    println!("{what}: {} cases, {worst:.1e}", cases.len());
    assert!(worst < 1e-9, "{what}: {worst:e}");
}

const POSE: &str = "x y z qw qx qy qz vx vy vz wx wy wz ax ay az alx aly alz";

#[test]
fn hexapod_forces_of_the_reference_cases() {
    let (model, cases) = reference("sg");
    let folder = tempfile::tempdir().unwrap();
    let rows = cases.iter().map(|c| {
        let r = Rotation3::from_matrix_unchecked(matrix(&c["R"]));
        let q = UnitQuaternion::from_rotation_matrix(&r).into_inner();
        [
            numbers(&c["p"]),
            vec![q.w, q.i, q.j, q.k],
            numbers(&c["v"]),
            numbers(&c["w"]),
            numbers(&c["vd"]),
            numbers(&c["wd"]),
        ]
        .concat()
    });
    let toml = hexapod(&model, "", "");
    let ours = torque(folder.path(), &toml, &csv(POSE, rows));
    compare("hexapod", &ours, &cases, "f_numpy");
}

#[test]
fn h4_and_delta_torques_of_the_reference_cases() {
    let folder = tempfile::tempdir().unwrap();
    let names = "x y z theta dx dy dz dtheta ddx ddy ddz ddtheta";
    let (model, cases) = reference("h4");
    let row = |c: &Value| ["x", "xd", "xdd"].map(|k| numbers(&c[k])).concat();
    let table = csv(names, cases.iter().map(row));
    let toml = chains(&model, "h4", "", "");
    let ours = torque(folder.path(), &toml, &table);
    compare("H4", &ours, &cases, "tau_numpy");
    let toml = chains(&model, "h4", "model = \"lumped-gravity\"", "");
    let ours = torque(folder.path(), &toml, &table);
    compare("H4 lumped", &ours, &cases, "tau_lumped_model");
    // the same motion as a pose
    let as_pose = cases.iter().map(|c| {
        let [x, xd, xdd] = ["x", "xd", "xdd"].map(|k| numbers(&c[k]));
        let half = 0.5 * x[3];
        [
            x[0],
            x[1],
            x[2],
            half.cos(),
            0.0,
            0.0,
            half.sin(),
            xd[0],
            xd[1],
            xd[2],
            0.0,
            0.0,
            xd[3],
            xdd[0],
            xdd[1],
            xdd[2],
            0.0,
            0.0,
            xdd[3],
        ]
        .to_vec()
    });
    let toml = chains(&model, "h4", "", "");
    let ours = torque(folder.path(), &toml, &csv(POSE, as_pose));
    compare("H4 by pose", &ours, &cases, "tau_numpy");

    let (model, cases) = reference("delta");
    let toml = chains(&model, "delta", "", "");
    let table = csv("x y z dx dy dz ddx ddy ddz", cases.iter().map(row));
    let ours = torque(folder.path(), &toml, &table);
    compare("Delta", &ours, &cases, "tau_numpy");
    let as_pose = cases.iter().map(|c| {
        let mut row = numbers(&c["x"]);
        row.extend([1.0, 0.0, 0.0, 0.0]);
        row.extend(numbers(&c["xd"]));
        row.extend([0.0; 3]);
        row.extend(numbers(&c["xdd"]));
        row.extend([0.0; 3]);
        row
    });
    let ours = torque(folder.path(), &toml, &csv(POSE, as_pose));
    compare("Delta by pose", &ours, &cases, "tau_numpy");
}

/// Base parameters of a file, through the loader that all commands use.
fn count(toml: &str) -> usize {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("robot.toml");
    std::fs::write(&path, toml).unwrap();
    let plant = Plant::load(path.to_str().unwrap()).unwrap();
    plant.base().unwrap().count()
}

#[test]
fn base_parameter_counts_of_robot_files() {
    let counts: Option<Value> = checks("counts as known").map(|f| {
        let text = std::fs::read_to_string(f.join("base_parameter_counts.json")).unwrap();
        serde_json::from_str(&text).unwrap()
    });
    let expect = |line: &str, ours: usize, known: usize| {
        let theirs = counts
            .as_ref()
            .map_or(known as u64, |c| c[line].as_u64().unwrap());
        println!("{line}: {ours}");
        assert_eq!((ours as u64, known as u64), (theirs, theirs), "{line}");
    };
    let (model, _) = reference("sg");
    let motor = "identify = [\"armature\"]";
    let all = "identify = [\"armature\", \"viscous\", \"coulomb\"]";
    for (line, top, actuator, known) in [
        (" A,B,P (130 raw)", "", "", 82),
        (
            " with U-cross bodies (190 raw)",
            "bodies = \"cross\"",
            "",
            88,
        ),
        (
            " + rotor/ball-screw inertia (6)",
            "bodies = \"cross\"",
            motor,
            94,
        ),
        (" + 12 friction", "bodies = \"cross\"", all, 106),
        (" platform only", "bodies = \"platform\"", "", 10),
        (
            " identical legs",
            "bodies = \"cross\"\nidentical = true",
            "",
            23,
        ),
        (
            " identical axisymmetric legs",
            "identical = true\naxisymmetric = true",
            "",
            14,
        ),
        (
            " individual axisymmetric legs",
            "axisymmetric = true",
            "",
            34,
        ),
    ] {
        let irregular = hexapod(&model, top, actuator);
        expect(
            &format!("SG 6-UPS irregular{line}"),
            count(&irregular),
            known,
        );
        // the same bodies on two rings
        let mut kept = String::new();
        for l in irregular.lines() {
            let key = l.split(" = ").next().unwrap_or("");
            if !matches!(key, "base" | "platform" | "rotation") {
                kept += l;
                kept.push('\n');
            }
        }
        let rings = |radius: f64, half: f64| {
            let angles: Vec<f64> = (0..6)
                .map(|i| {
                    let pair = f64::from(i / 2) * std::f64::consts::TAU / 3.0;
                    pair + if i % 2 == 0 { -half } else { half }
                })
                .collect();
            format!("{{ radius = {radius:?}, angles = {angles:?} }}")
        };
        let regular = kept.replace(
            "[legs]\n",
            &format!(
                "[legs]\nbase = {}\nplatform = {}\n",
                rings(0.6, 0.2085),
                rings(0.35, 0.88)
            ),
        );
        expect(&format!("SG 6-UPS regular{line}"), count(&regular), known);
    }
    for (kind, name, known) in [
        ("h4", "H4-like", [48, 48, 56, 4, 15]),
        ("delta", "Delta", [34, 34, 40, 1, 12]),
    ] {
        let (model, _) = reference(kind);
        for ((line, top, actuator), known) in [
            (" bodies", "", ""),
            (" + motor inertia", "", motor),
            (" + friction", "", all),
            (" platform", "bodies = \"platform\"", ""),
            (" identical chains", "identical = true", ""),
        ]
        .into_iter()
        .zip(known)
        {
            let toml = chains(&model, kind, top, actuator);
            expect(&format!("{name}{line}"), count(&toml), known);
        }
    }
}

#[test]
fn bundled_robots_are_sound_in_their_whole_workspace() {
    for b in bundled::list() {
        let m = b.load().unwrap();
        assert!(m.warnings.is_empty(), "{}: {:?}", b.name, m.warnings);
        assert_eq!(m.robot.name, b.name);
        let states = m.random_states(300, 5);
        let motion = m.motion(&states).unwrap();
        let (mut worst, mut cone) = (f64::INFINITY, 0.0f64);
        let mut reach = vec![[f64::INFINITY, f64::NEG_INFINITY]; m.actuators()];
        for s in 0..states.count {
            let x: Vec<f64> = (0..m.freedoms())
                .map(|k| states.q[k * states.count + s])
                .collect();
            let singularity = m.singularity(&x).unwrap();
            worst = worst.min(singularity.actuation.sigma_min);
            if let Some(c) = singularity.constraint {
                worst = worst.min(c.sigma_min);
            }
            for c in m.geometry().cones(&x) {
                cone = cone.max(c.angle / c.limit);
            }
            for (r, &a) in reach.iter_mut().zip(&m.actuated) {
                let q = motion.tree.q[a * states.count + s];
                *r = [r[0].min(q), r[1].max(q)];
            }
        }
        println!(
            "{}: sigma_min {worst:.3}, cones {cone:.2}, reach {reach:.3?}",
            b.name
        );
        assert!(worst > 0.1, "{}: {worst}", b.name);
        assert!(cone < 1.0);
        // home reads inside the limits with room to either side
        let home = m.actuator_positions(&m.home).unwrap();
        for (q, &a) in home.iter().zip(&m.actuated) {
            let [low, high] = m.robot.joints[a].limits.position;
            assert!(q - low > 0.2 * (high - low) && high - q > 0.2 * (high - low));
        }
        let mut at_home = excite::dynamics::Samples::zeros(m.freedoms(), 1);
        at_home.q.copy_from_slice(&m.home);
        let hold = m.nominal_torque(&at_home).unwrap();
        println!("{}: holds itself with {hold:.2?}", b.name);
        for (tau, &a) in hold.iter().zip(&m.actuated) {
            assert!(tau.abs() < 0.5 * m.robot.joints[a].limits.effort);
        }
    }
    let out = Command::cargo_bin("excite")
        .unwrap()
        .args(["robots", "--sources"])
        .output()
        .unwrap();
    let text = String::from_utf8(out.stdout).unwrap();
    for b in bundled::list() {
        assert!(text.contains(b.name) && text.contains(b.description));
    }
}

/// Other values written to a robot file are the values that are read from it.
#[test]
fn an_identified_mechanism_is_written_and_read() {
    use excite::export::mechanism;
    use rand::Rng;
    let [hexapod, h4, delta] = ["hexapod", "h4", "delta"].map(|n| bundled::find(n).unwrap().toml);
    let terms = "identify = [\"armature\", \"viscous\", \"coulomb\", \"offset\"]";
    let usual = "identify = [\"viscous\", \"coulomb\"]";
    let apart = |text: &str| text.replace("identical = true", "identical = false");
    let files = [
        hexapod.to_string(),
        hexapod.replace(usual, terms),
        apart(hexapod),
        apart(hexapod).replace("axisymmetric = true", "axisymmetric = false"),
        hexapod.replace(
            "axisymmetric = true",
            "axisymmetric = true\nspherical = true",
        ),
        hexapod.replace("bodies = \"legs\"", "bodies = \"platform\""),
        h4.to_string(),
        apart(h4).replace(usual, terms),
        h4.replace("model = \"rods\"", "model = \"lumped\""),
        h4.replace("model = \"rods\"", "model = \"lumped-gravity\""),
        delta.to_string(),
        apart(delta).replace(usual, terms),
        format!(
            "{delta}\n[[joint]]\nname = \"rod2a_gamma\"\nviscous = 0.01\nidentify = [\"viscous\"]\n"
        ),
    ];
    for (i, text) in files.iter().enumerate() {
        let m = Mechanism::from_toml_str(text, "robot.toml").unwrap();
        let plant = Plant::from(m);
        let m = plant.mechanism().unwrap();
        // every body by a factor of its own, so that it stays one that can exist
        let r = &mut common::rng(i as u64);
        let mut factor = std::collections::HashMap::new();
        let phi: Vec<f64> = (m.parameters.list.iter())
            .map(|p| {
                let of = p.name.split('.').next().unwrap().to_string();
                p.value * *factor.entry(of).or_insert_with(|| r.random_range(0.8..1.2))
            })
            .collect();
        let tree = plant.with_values(&phi);
        let toml = mechanism::toml(m, &tree, "robot.urdf").unwrap();
        let again = match Mechanism::from_toml_str(&toml, "robot.toml") {
            Ok(again) => again,
            Err(e) => panic!("{e}\n{toml}"),
        };
        assert_eq!(again.warnings, m.warnings, "{i}\n{toml}");
        assert_eq!(again.margins, m.margins);
        let names = |m: &Mechanism| -> Vec<String> {
            m.parameters.list.iter().map(|p| p.name.clone()).collect()
        };
        assert_eq!(names(&again), names(m));
        let x = m.random_states(50, 9);
        let (a, b) = (
            plant.torque(&x, &phi).unwrap(),
            again.nominal_torque(&x).unwrap(),
        );
        let (size, off) = (largest(&a), difference(&a, &b));
        println!("{i}: off by {:.1e}", off / size);
        assert!(off < 1e-12 * size, "{i}: {off:e}\n{toml}");
    }
    // what a file cannot carry is said
    let plant = Plant::from(bundled::find("delta").unwrap().load().unwrap());
    let mut phi = plant.values();
    phi[0] = -0.1;
    let tree = plant.with_values(&phi);
    let m = plant.mechanism().unwrap();
    let e = mechanism::toml(m, &tree, "robot.urdf")
        .unwrap_err()
        .to_string();
    assert!(e.contains("arm1") && e.contains("-0.1 kg"), "{e}");
}
