//! The generator of withheld effects (`withheld/`): its physics, its agreement with the
//! library that it does not call, its files, and the scorer.

use excite::Robot;
use excite::dynamics::{Samples, Tree};
use excite::regressor::nominal_torque;
use serde_json::json;
use withheld::chain::{Chain, Kinematics};
use withheld::random::Random;
use withheld::{case, disturb, motion, plant, robots, score, simulate, write};

fn torque(chain: &Chain, q: &[f64], v: &[f64], a: &[f64]) -> Vec<f64> {
    let mut k = Kinematics::default();
    chain.kinematics(q, v, &mut k);
    let mut tau = vec![0.0; q.len()];
    chain.inverse(&k, v, a, &mut tau);
    tau
}

/// Kinetic energy from the mass matrix, potential energy from the heights of the centres.
fn total_energy(chain: &Chain, q: &[f64], v: &[f64]) -> f64 {
    let zero = vec![0.0; q.len()];
    let (moved, still) = (torque(chain, q, &zero, v), torque(chain, q, &zero, &zero));
    let kinetic: f64 = (0..q.len())
        .map(|i| 0.5 * v[i] * (moved[i] - still[i]))
        .sum();
    let mut k = Kinematics::default();
    chain.kinematics(q, v, &mut k);
    let potential: f64 = (chain.joints.iter().enumerate())
        .map(|(i, j)| -j.body.mass * chain.gravity.dot(&k.point(i, &j.body.com())))
        .sum();
    kinetic + potential
}

#[test]
fn a_free_arm_keeps_its_energy() {
    for family in 0..7 {
        let m = robots::machine(family, false, &mut Random::new(5, family, 0));
        let n = m.dof();
        let (mut q, mut v) = (vec![0.3; n], vec![0.5; n]);
        let before = total_energy(&m.chain, &q, &v);
        let (tau, h) = (vec![0.0; n], 2e-5);
        let mut k = Kinematics::default();
        let mut swing = 0.0f64;
        for _ in 0..10_000 {
            let mut a = vec![0.0; n];
            m.chain.kinematics(&q, &v, &mut k);
            m.chain.forward(&k, &v, &tau, &tau, &[], &mut a);
            for i in 0..n {
                v[i] += h * a[i];
                q[i] += h * v[i];
                swing = swing.max(v[i].abs());
            }
        }
        let drift = (total_energy(&m.chain, &q, &v) - before).abs();
        let kinetic = total_energy(&m.chain, &q, &v) - total_energy(&m.chain, &q, &vec![0.0; n]);
        assert!(
            swing > 0.5 && drift < 5e-3 * kinetic,
            "{}: {drift} of {kinetic}",
            m.family
        );
    }
}

#[test]
fn forward_undoes_inverse_dynamics() {
    let m = robots::machine(1, false, &mut Random::new(2, 0, 0));
    let n = m.dof();
    let mut rng = Random::new(3, 0, 0);
    let mut draw = || (0..n).map(|_| rng.range(-2.0, 2.0)).collect::<Vec<f64>>();
    let (q, v, a) = (draw(), draw(), draw());
    let tau = torque(&m.chain, &q, &v, &a);
    let mut k = Kinematics::default();
    m.chain.kinematics(&q, &v, &mut k);
    let mut back = vec![0.0; n];
    m.chain.forward(&k, &v, &tau, &vec![0.0; n], &[], &mut back);
    for (x, y) in a.iter().zip(&back) {
        assert!((x - y).abs() < 1e-8, "{x} {y}");
    }
}

/// The library's robot of a machine whose nominal model is the true one.
fn library_robot(machine: &mut robots::Machine) -> (tempfile::TempDir, Robot) {
    machine.nominal_chain = machine.chain.clone();
    machine.nominal_drives = machine.drives.clone();
    let folder = tempfile::tempdir().expect("temporary folder");
    std::fs::write(
        folder.path().join("robot.urdf"),
        write::urdf(machine, "truth"),
    )
    .expect("urdf");
    let toml = folder.path().join("robot.toml");
    std::fs::write(&toml, write::toml(machine, "truth")).expect("toml");
    let robot = Robot::load(&toml.to_string_lossy()).expect("the library reads it");
    (folder, robot)
}

#[test]
fn library_and_generator_agree_on_the_dynamics() {
    for family in 0..7 {
        let mut m = robots::machine(family, false, &mut Random::new(9, family, 0));
        let (_folder, robot) = library_robot(&mut m);
        let n = m.dof();
        let mut rng = Random::new(4, family, 1);
        let mut draw = || (0..n).map(|_| rng.range(-1.5, 1.5)).collect::<Vec<f64>>();
        let (q, v, a) = (draw(), draw(), draw());
        let theirs = nominal_torque(
            &robot,
            &Tree::new(&robot),
            &Samples::from_rows(n, &[&q], &[&v], &[&a]),
        );
        for (j, own) in torque(&m.chain, &q, &v, &a).iter().enumerate() {
            let d = &m.drives[j];
            let own =
                own + d.armature * a[j] + d.viscous * v[j] + d.coulomb * v[j].signum() + d.offset;
            assert!(
                (own - theirs[j]).abs() < 1e-5 * d.effort,
                "{} {j}: {own} {}",
                m.family,
                theirs[j]
            );
        }
    }
}

/// Simulated torque of an ordinary machine against the library's inverse dynamics of its motion.
#[test]
fn a_simulated_record_obeys_the_library_model() {
    let mut m = robots::machine(0, false, &mut Random::new(11, 0, 0));
    let (_folder, robot) = library_robot(&mut m);
    let n = m.dof();
    let record = motion::records(&m, false, &mut Random::new(11, 1, 0)).remove(0);
    let mut plant = plant::Plant::new(&m, &[]);
    let outer = disturb::Disturbance::new(&[], &m, -5.0, 20.0, &mut Random::new(11, 2, 0));
    let raw = simulate::run(&m, &mut plant, &record, &outer, 12.0).expect("follows its reference");
    let log = raw.sample(&simulate::times(&record, 1));
    let (count, dt) = (log.t.len() - 2, simulate::SAMPLE);
    let rate = |x: &Vec<f64>, i: usize| (x[i + 1] - x[i - 1]) / (2.0 * dt);
    let bend = |x: &Vec<f64>, i: usize| (x[i + 1] - 2.0 * x[i] + x[i - 1]) / (dt * dt);
    let column = |f: &dyn Fn(&Vec<f64>, usize) -> f64| -> Vec<f64> {
        log.q
            .iter()
            .flat_map(|x| (1..=count).map(|i| f(x, i)).collect::<Vec<_>>())
            .collect()
    };
    let motion = Samples {
        dof: n,
        count,
        q: column(&|x, i| x[i]),
        qd: column(&rate),
        qdd: column(&bend),
    };
    let tau = nominal_torque(&robot, &Tree::new(&robot), &motion);
    for j in 0..n {
        let d = &m.drives[j];
        // the model's sign of friction is sharp, the machine's is not: leave reversals out
        let errors: Vec<f64> = (0..count)
            .filter(|i| motion.qd[j * count + i].abs() > 0.03 * d.velocity)
            .map(|i| (tau[j * count + i] - log.tau[j][i + 1]) / d.noise)
            .collect();
        let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
        assert!(
            errors.len() > count / 2 && rms < 0.3,
            "joint {j}: {rms} of the noise"
        );
    }
}

fn small(kind: &'static str, effects: Vec<&'static str>) -> case::Plan {
    case::Plan {
        index: 3,
        kind,
        effects,
        target: 4.0,
    }
}

#[test]
fn a_case_is_deterministic_readable_and_visible() {
    let plan = small("single", vec!["position_dependent_friction"]);
    let case = case::build(21, &plan).expect("a case");
    let folder = tempfile::tempdir().expect("temporary folder");
    write::case(&case, folder.path()).expect("written");
    let robot = Robot::load(&folder.path().join("robot.toml").to_string_lossy()).expect("robot");
    assert_eq!(robot.dof(), case.machine.dof());
    let text = std::fs::read_to_string(folder.path().join("fit_1.csv")).expect("log");
    let mut lines = text.lines();
    assert_eq!(
        lines.next().map(|h| h.split(',').count()),
        Some(1 + 2 * robot.dof())
    );
    let t: Vec<f64> = lines
        .filter_map(|l| l.split(',').next()?.parse().ok())
        .collect();
    assert_eq!(t.len(), 3751);
    assert!(t.windows(2).all(|w| w[1] > w[0]));
    let answer = write::truth(&case);
    let level = answer["effects"][0]["level"].as_f64().expect("level");
    assert!(level > 1.0, "visible at {level}");
    // knowing the effect removes most of what a refit leaves
    let shrink = answer["oracle"]["holdout"]["shrink_refit"]
        .as_f64()
        .expect("shrink");
    assert!(shrink > 0.6, "possible shrink {shrink}");
    // nothing of the answer is in what the diagnosis may see
    for file in ["robot.toml", "robot.urdf", "experiment.toml"] {
        let seen = std::fs::read_to_string(folder.path().join(file)).expect("file");
        assert!(!seen.contains("position_dependent"), "{file}");
    }
    let again = case::build(21, &plan).expect("a case");
    assert_eq!(case.logs[1].tau, again.logs[1].tau);
    assert_eq!(write::truth(&again), answer);
}

#[test]
fn a_clean_case_leaves_nothing_above_the_noise() {
    let case = case::build(22, &small("clean", vec![])).expect("a case");
    let worst = case.figures.refit.iter().copied().fold(0.0, f64::max);
    assert!(worst < 1.0, "{:?}", case.figures.refit);
}

fn finding(effect: &str, joints: &[&str], confidence: f64) -> serde_json::Value {
    json!({ "effect": effect, "joints": joints, "confidence": confidence, "holdout_shrink": 0.9,
            "indistinguishable_from": ["torque_delay"] })
}

#[test]
fn the_scorer_counts_what_it_says() {
    let truth = |kind: &str, name: &str| {
        let effects = if name.is_empty() {
            json!([])
        } else {
            json!([{ "name": name, "joints": ["a"], "equivalent": [name], "tolerated": [],
                     "judged": "visible", "level": 3.0 }])
        };
        json!({ "case": "case_001", "kind": kind, "effects": effects, "nuisance": ["link_inertia"],
                "oracle": { "holdout": { "shrink_refit": 0.95, "shrink_frozen": 0.99 } } })
    };
    let said = |list: Vec<serde_json::Value>| json!({ "verdict": "explained", "findings": list });
    // an ordinary parameter error before the right name neither helps nor hurts
    let d = said(vec![
        finding("link_inertia", &["b"], 0.99),
        finding("backlash", &["a"], 0.9),
    ]);
    let j = score::judge(&truth("single", "backlash"), &d, 1.0).expect("judged");
    assert_eq!(
        (j.outcomes[0].rank, j.outcomes[0].joint, j.wrong.len()),
        (Some(0), Some(true), 0)
    );
    assert!((j.outcomes[0].shrink.expect("shrink") - 0.9 / 0.95).abs() < 1e-12);
    // a right name in the wrong joint, behind a confident wrong one; the set of the first holds neither
    let d = said(vec![
        finding("cogging", &["a"], 0.95),
        finding("backlash", &["b"], 0.4),
    ]);
    let j = score::judge(&truth("single", "backlash"), &d, 1.0).expect("judged");
    let o = &j.outcomes[0];
    assert_eq!(
        (o.rank, o.claimed, o.in_set, o.joint),
        (Some(1), false, false, Some(false))
    );
    assert_eq!(j.wrong, ["cogging"]);
    // the set of a finding counts apart
    let j = score::judge(&truth("single", "torque_delay"), &d, 1.0).expect("judged");
    assert_eq!((j.outcomes[0].rank, j.outcomes[0].in_set), (None, true));
    // clean data and effects without a name: every claim is wrong, what is no claim is not
    let d = said(vec![
        finding("cogging", &["a"], 0.6),
        finding("backlash", &["a"], 0.3),
    ]);
    assert_eq!(
        score::judge(&truth("clean", ""), &d, 1.0)
            .expect("judged")
            .wrong,
        ["cogging"]
    );
    let j = score::judge(&truth("outside", "slipping_belt"), &d, 1.0).expect("judged");
    assert_eq!((j.wrong.len(), j.outcomes.len()), (1, 0));
    assert!(score::judge(&truth("clean", ""), &json!({}), 1.0).is_err());
}

/// Forces by partial velocities against the library's, which come from a tree of bodies.
#[test]
fn a_hexapod_agrees_with_the_library() {
    use withheld::closed::{files, hexapod, machine, sines};
    let mut rng = Random::new(11, 1, 0);
    let mut m = machine::machine(true, &mut rng);
    for d in &mut m.drives {
        (d.dry, d.offset) = (0.0, 0.0);
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("robot.toml");
    std::fs::write(&path, files::robot(&m, true, 0.0, &mut rng)).unwrap();
    let plant = excite::plant::Plant::load(path.to_str().unwrap()).unwrap();
    let motion = sines::periodic(10.0, 1.0, &mut rng);
    let count = 200;
    let mut x = Samples::zeros(6, count);
    let mut own = vec![0.0; 6 * count];
    let mut size = 0.0f64;
    for s in 0..count {
        let [q, d, dd] = sines::at(&motion, &m.home, 0.05 * s as f64);
        for k in 0..6 {
            let at = k * count + s;
            (x.q[at], x.qd[at], x.qdd[at]) = (q[k], d[k], dd[k]);
        }
        let state = hexapod::Motion::new(&q, &d, &dd);
        let body = std::slice::from_ref(&m.platform);
        let rest = (hexapod::Rubbing::default(), nalgebra::Vector3::zeros());
        let legs = hexapod::forces(&m.legs, &state, body, rest.0, rest.1);
        for j in 0..6 {
            own[j * count + s] = m.drives[j].logged(legs.force[j], legs.rate[j]);
            size = size.max(own[j * count + s].abs());
        }
    }
    let theirs = plant.nominal_torque(&x).unwrap();
    let worst = own.iter().zip(&theirs);
    let worst = worst.fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
    // the file has nine decimals
    assert!(worst < 1e-6 * size, "{worst} N of {size} N");
}
