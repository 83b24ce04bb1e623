//! The report before the run: what it says, that it stands alone, and that it never breaks.

use excite::design::Settings;
use excite::design::record::{Record, Status};
use excite::identifiability::json::json;
use excite::identifiability::page::{Grade, html, verdict};
use excite::identifiability::{Assessment, Excitation, assess};
use excite::robot::bundled;
use excite::robot::parts::JointTerm;
use excite::trajectory::parts::{Ends, Grid};
use excite::trajectory::{Basis, Fourier, Trajectory, certify};
use excite::{Plant, Robot};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

fn load(name: &str) -> Robot {
    bundled::find(name)
        .expect("bundled")
        .load()
        .expect("readable")
}

/// A random motion of which position, velocity, acceleration and jerk take `size` of their limits.
fn motion(robot: &Robot, size: f64) -> Trajectory {
    let n = robot.dof();
    let harmonics = [1, 2, 3, 4, 5];
    let basis = Basis::new(&harmonics, Ends::Rest, n, None).expect("a basis");
    let mut r = ChaCha8Rng::seed_from_u64(7);
    let x: Vec<f64> = (0..basis.len())
        .map(|_| r.random_range(-1.0..1.0))
        .collect();
    let mut fourier: Fourier = basis.fourier(10.0, &x);
    for (joint, series) in robot.joints.iter().zip(&mut fourier.joints) {
        let [low, high] = joint.limits.position;
        let middle = 0.5 * (low + high);
        series.constant = if middle.is_finite() { middle } else { 0.0 };
    }
    // the motion about the middle is linear in its coefficients
    let certificate = certify(robot, &fourier).expect("a certificate");
    for (series, c) in fourier.joints.iter_mut().zip(&certificate.joints) {
        let used = [
            c.position.used,
            c.velocity.used,
            c.acceleration.used,
            c.jerk.used,
        ];
        let most = used.into_iter().flatten().fold(1e-3, f64::max);
        for value in series.sin.iter_mut().chain(&mut series.cos) {
            *value *= size / most;
        }
    }
    Trajectory {
        robot: robot.name.clone(),
        robot_hash: robot.hash.clone(),
        joints: robot.joint_names(),
        kind: Default::default(),
        space: None,
        fourier,
        periods: 3,
        ends: Ends::Rest,
        grid: Grid::Full,
        settings: serde_json::json!({ "seed": 42 }),
        excite_version: "0.1.0".into(),
    }
}

fn record() -> Record {
    serde_json::from_value(serde_json::json!({
        "settings": Settings::default().with(|set| set.seed = 42),
        "status": Status::Converged,
        "starts": [
            { "number": 0, "history": [900.0, 40.0, 12.0, 8.5], "converged": true },
            { "number": 2, "history": [1200.0, 30.0, 9.0, 7.321], "converged": true },
        ],
        "best": 2,
        "seconds": 1.5,
    }))
    .expect("a record")
}

fn panda() -> Assessment {
    let robot = load("panda");
    let plant = Plant::from(&robot).without_collisions();
    assess(&plant, Some(&motion(&robot, 0.8))).expect("an assessment")
}

fn excitation(a: &mut Assessment) -> &mut Excitation {
    a.excitation.as_mut().expect("a trajectory was given")
}

/// Nothing is fetched, nothing runs but a view, every figure is well-formed XML.
fn stands_alone(page: &str) {
    let mut bare = page.replace("http://www.w3.org/2000/svg", "");
    for kind in ["<script type=\"application/json\">", "<script>"] {
        bare = bare.replacen(kind, "", 1);
    }
    for forbidden in [
        "http://", "https://", "<script", "<link", "<img", "@import", "url(", "src=",
    ] {
        assert!(!bare.contains(forbidden), "{forbidden}");
    }
    for part in page.split("<svg").skip(1) {
        let end = part.find("</svg>").expect("a closed figure");
        roxmltree::Document::parse(&format!("<svg{}</svg>", &part[..end])).expect("a figure");
    }
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>"));
    assert!(page.len() < 2_000_000, "{} bytes", page.len());
}

/// Every number is finite, and nothing is null but what may be.
fn check_json(value: &Value, place: &str, may_be_null: &[&str]) {
    match value {
        Value::Number(x) => assert!(x.as_f64().is_some_and(f64::is_finite), "{place}"),
        Value::Null => assert!(
            place.starts_with(".clearance")
                || [
                    ".known_to_10_percent",
                    ".torque_uncertainty",
                    ".limits.tool",
                    ".load",
                    ".settings.question",
                    ".settings.payload",
                ]
                .contains(&place)
                || [".torque_rate", ".velocity_by_position"]
                    .iter()
                    .any(|k| place.ends_with(k))
                || may_be_null
                    .iter()
                    .any(|k| place.ends_with(&format!(".{k}"))),
            "{place} is null"
        ),
        Value::Array(all) => all.iter().for_each(|v| check_json(v, place, may_be_null)),
        Value::Object(map) => map
            .iter()
            .for_each(|(k, v)| check_json(v, &format!("{place}.{k}"), may_be_null)),
        _ => {}
    }
}

#[test]
fn a_good_trajectory_is_reported_in_full() {
    let a = panda();
    let page = html(&a, Some(&record()));
    stands_alone(&page);
    let v = verdict(&a);
    assert!(matches!(v.grade, Grade::Worthwhile | Grade::Weak));
    assert!(v.text.starts_with("Inside its limits"), "{}", v.text);
    assert!(
        v.text.contains(
            "Collisions of the robot with itself and with its surroundings were not checked"
        ),
        "{}",
        v.text
    );
    assert!(v.text.contains("43\u{a0}base parameters"), "{}", v.text);
    assert!(page.contains(&v.text));
    let e = a.excitation.as_ref().expect("a trajectory");
    let worst = e.certificate.worst.as_ref().expect("panda has limits");
    assert!(v.text.contains(&worst.joint));
    for expected in [
        "Motion and limits",
        "How much of each limit is used",
        "Predicted uncertainty",
        "Singular values",
        "How the design went",
        "Which standard parameters are identifiable",
        "To reproduce this",
        "excite design panda",
        "--seed 42",
        "7.321",
        &a.robot.hash,
        &e.predictions[0].combination,
    ] {
        assert!(page.contains(expected), "{expected}");
    }
    for name in a.robot.joint_names() {
        assert!(page.contains(&name));
    }
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    assert_eq!(
        html(&panda(), Some(&record())),
        html(&panda(), Some(&record()))
    );
    // how long it took is for machines only
    let mut slow = record();
    slow.seconds = 99.0;
    let a = panda();
    assert_eq!(html(&a, Some(&record())), html(&a, Some(&slow)));
}

#[test]
fn limits_that_do_not_hold_come_first() {
    let robot = load("panda");
    let a = assess(
        &Plant::from(&robot).without_collisions(),
        Some(&motion(&robot, 1.25)),
    )
    .expect("an assessment");
    let v = verdict(&a);
    assert_eq!(v.grade, Grade::Unsafe);
    assert!(v.text.starts_with("Do not run: "), "{}", v.text);
    assert!(v.text.contains("limit of") && v.text.contains("at t ="));
    let worst = excitation(&mut a.clone()).certificate.worst.clone();
    assert!(v.text.contains(&worst.expect("there are limits").joint));
    assert!(v.text.contains("more limits do not hold"), "{}", v.text);
    let page = html(&a, None);
    stands_alone(&page);
    assert!(page.contains("verdict bad") && page.contains("125.0\u{a0}%"));
    let j = json(&a, None, 1.0);
    assert_eq!(j["limits"]["satisfied"], false);
    assert!(
        j["limits"]["violations"]
            .as_array()
            .is_some_and(|v| v.len() > 2)
    );
}

#[test]
fn a_motion_that_excites_nothing_is_called_so() {
    let robot = load("panda");
    let mut t = motion(&robot, 0.5);
    // only the last joint moves
    for series in &mut t.fourier.joints[..6] {
        series.sin.fill(0.0);
        series.cos.fill(0.0);
    }
    let plant = Plant::from(&robot).without_collisions();
    let a = assess(&plant, Some(&t)).expect("an assessment");
    let v = verdict(&a);
    assert_eq!(v.grade, Grade::Unexciting);
    assert!(
        v.text.contains("not every parameter is excited"),
        "{}",
        v.text
    );
    stands_alone(&html(&a, None));
    check_json(
        &json(&a, None, 0.0),
        "",
        &["status", "starts", "percent", "platform"],
    );
}

#[test]
fn the_json_has_its_keys_and_finite_numbers() {
    let a = panda();
    let j = json(&a, Some(&record()), 2.9);
    check_json(&j, "", &["percent", "start", "platform"]);
    assert_eq!(j["robot"], "panda");
    assert_eq!(j["joints"][0], "panda_joint1");
    assert_eq!(j["base_parameters"], 43);
    assert_eq!(j["seconds"], 2.9);
    assert_eq!(j["status"], "converged");
    assert_eq!(j["seed"], 42);
    assert!(j["rank_gap"].as_f64().is_some_and(|x| x > 1e3));
    for kind in ["invariant", "raw", "normalised", "weighted"] {
        assert!(
            j["condition_number"][kind]
                .as_f64()
                .is_some_and(|x| x > 1.0)
        );
    }
    assert!(j["log_det"].is_f64());
    let std = j["relative_std"].as_array().expect("a list");
    assert_eq!(std.len(), 43);
    for key in ["parameter", "combination", "unit"] {
        assert!(std[0][key].is_string());
    }
    assert_eq!(j["limits"]["satisfied"], true);
    let worst = &j["limits"]["worst"];
    assert!(worst["joint"].is_string() && worst["kind"].is_string());
    assert!(worst["used"].as_f64().is_some_and(|u| u <= 1.0));
    let joints = j["limits"]["joints"].as_array().expect("a list");
    assert_eq!(joints.len(), 7);
    assert!(joints[6]["torque"]["bound"].is_f64());
    assert_eq!(j["standard_parameters"].as_array().map(Vec::len), Some(70));
    assert_eq!(j["standard_parameters"][0]["identifiability"], "none");
    assert_eq!(j["starts"]["history"].as_array().map(Vec::len), Some(4));
    assert!(j["version"].is_string() && j["robot_hash"].is_string());
    assert_eq!(j["torque_noise"].as_array().map(Vec::len), Some(7));
    for key in ["random_states", "trajectory"] {
        assert!(j["singular_values"][key].is_array());
    }
}

#[test]
fn every_bundled_robot_alone_has_a_report() {
    for robot in bundled::list() {
        let a = assess(&Plant::from(load(robot.name)), None).expect("an assessment");
        let page = html(&a, None);
        stands_alone(&page);
        let v = verdict(&a);
        assert_eq!(v.grade, Grade::RobotAlone);
        assert!(page.contains(&v.text) && page.contains(&a.base.combination(0)));
        assert!(!page.contains("Motion and limits") && !page.contains("How the design went"));
        let j = json(&a, None, 0.1);
        let absent = [
            "condition_number",
            "log_det",
            "limits",
            "trajectory",
            "settings",
            "seed",
            "status",
            "starts",
            "platform",
            "std",
            "percent",
        ];
        check_json(&j, "", &absent);
        assert_eq!(j["base_parameters"], a.base.count());
    }
}

#[test]
fn joint_terms_have_their_own_table_and_sliding_joints_their_units() {
    let robot = load("scara").with_terms(&JointTerm::ALL);
    let a = assess(&Plant::from(&robot), Some(&motion(&robot, 0.7))).expect("an assessment");
    let page = html(&a, None);
    stands_alone(&page);
    for expected in ["Joint terms", "joint3.viscous", "m/s²", "Torque or force"] {
        assert!(page.contains(expected), "{expected}");
    }
}

#[test]
fn names_from_files_are_escaped() {
    let mut robot = load("planar2");
    robot.name = "<h1>&\"'".into();
    robot.joints[0].name = "<b onload='x'>".into();
    robot.bodies[1].name = "<u>&".into();
    let a = assess(&Plant::from(&robot), Some(&motion(&robot, 0.5))).expect("an assessment");
    let page = html(&a, None);
    stands_alone(&page);
    for raw in ["<b ", "<u>", "<h1>&"] {
        assert!(!page.contains(raw), "{raw}");
    }
    assert!(page.contains("&lt;b onload="));
}

#[test]
fn numbers_that_are_not_finite_break_nothing() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, 1e308] {
        let mut a = panda();
        a.base.rank_gap = bad;
        a.base.singular_values[3] = bad;
        a.torque_noise[0] = bad;
        let e = excitation(&mut a);
        e.condition.invariant = bad;
        e.log_det = bad;
        e.singular_values[0] = bad;
        e.torque[17] = bad;
        e.motion.q[5] = bad;
        e.predictions[0].percent = Some(bad);
        e.predictions[1].std = bad;
        e.predictions[2].nominal = bad;
        let c = &mut e.certificate.joints[2];
        c.velocity.value = bad;
        c.velocity.time = bad;
        c.velocity.used = Some(bad);
        c.position.max.value = bad;
        if let Some(t) = &mut c.torque {
            t.between_grid_bound = bad;
        }
        let mut record = record();
        record.starts[1].history[2] = bad;
        stands_alone(&html(&a, Some(&record)));
        check_json(
            &json(&a, Some(&record), bad),
            "",
            &["percent", "start", "platform"],
        );
    }
    let mut a = panda();
    let e = excitation(&mut a);
    e.motion.q.clear();
    e.torque.clear();
    e.certificate.joints.clear();
    e.predictions.clear();
    e.singular_values.clear();
    stands_alone(&html(&a, None));
}
