//! Parallel robots against reference numbers of three independent implementations. The full set is
//! read from the folder named by `EXCITE_CHECKS` (or beside the project), a few cases of each come
//! with the tests.

mod common;

use common::parallel::{checks, delta, h4, hexapod, matrix, numbers, reference, vector};
use excite::base::BaseParameters;
use excite::dynamics::Samples;
use excite::mechanism::gough_stewart::{Bodies, GoughStewart};
use excite::mechanism::h4::Model;
use excite::mechanism::parallelogram;
use excite::mechanism::{Mechanism, PlatformMotion, Task};
use excite::robot::JointTerm;
use nalgebra::DMatrix;
use rand::Rng;
use serde_json::Value;

const WITHIN: f64 = 1e-9;

fn one(x: &[Vec<f64>; 3]) -> Samples {
    Samples::from_rows(x[0].len(), &[&x[0]], &[&x[1]], &[&x[2]])
}

/// Largest deviation, which must be below 1e-9.
fn deviation(what: &str, ours: &[f64], theirs: &[f64]) -> f64 {
    assert_eq!(ours.len(), theirs.len());
    let d = ours
        .iter()
        .zip(theirs)
        .fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
    assert!(d < WITHIN, "{what}: {d:e}\n{ours:?}\n{theirs:?}");
    d
}

#[test]
fn hexapod_lengths_rates_angles_jacobian_and_forces() {
    let (model, cases) = reference("sg");
    let mechanism = hexapod(&model).build().unwrap();
    let mut worst = [0.0f64; 3];
    for case in &cases {
        let motion = PlatformMotion {
            position: vector(&case["p"]),
            rotation: matrix(&case["R"]),
            velocity: vector(&case["v"]),
            omega: vector(&case["w"]),
            acceleration: vector(&case["vd"]),
            alpha: vector(&case["wd"]),
        };
        let x = Task::Pose.from_motion(&motion).unwrap();
        let closed = mechanism.motion(&one(&x)).unwrap();
        for (key, a) in [
            ("L", &closed.tree.q),
            ("Ld", &closed.tree.qd),
            ("Ldd", &closed.tree.qdd),
        ] {
            worst[0] = worst[0].max(deviation(key, &a[..6], &numbers(&case[key])));
        }
        for (k, key) in ["alpha", "beta"].iter().enumerate() {
            let ours: Vec<f64> = (0..6).map(|i| closed.tree.q[6 + 2 * i + k]).collect();
            worst[0] = worst[0].max(deviation(key, &ours, &numbers(&case[*key])));
        }
        let mut j = mechanism.actuation_jacobian(&x[0]).unwrap();
        j.columns_mut(3, 3).scale_mut(mechanism.length);
        let theirs: Vec<f64> = case["Jacobian_Ldot_from_vw"]
            .as_array()
            .unwrap()
            .iter()
            .flat_map(numbers)
            .collect();
        let theirs = DMatrix::from_row_slice(6, 6, &theirs);
        worst[1] = worst[1].max(deviation("J", j.as_slice(), theirs.as_slice()));
        let f = mechanism.nominal_torque(&one(&x)).unwrap();
        worst[2] = worst[2].max(deviation("f", &f, &numbers(&case["f_numpy"])));
    }
    println!(
        "hexapod, {} cases: kinematics {:.1e}, Jacobian {:.1e}, forces {:.1e} N",
        cases.len(),
        worst[0],
        worst[1],
        worst[2]
    );
}

fn parallelogram_cases(name: &str, mechanism: &Mechanism, cases: &[Value]) {
    let n = mechanism.actuators();
    let mut worst = [0.0f64; 3];
    for case in cases {
        let x = ["x", "xd", "xdd"].map(|k| numbers(&case[k]));
        let closed = mechanism.motion(&one(&x)).unwrap();
        for (key, a) in [
            ("q", &closed.tree.q),
            ("qd", &closed.tree.qd),
            ("qdd", &closed.tree.qdd),
        ] {
            worst[0] = worst[0].max(deviation(key, &a[..n], &numbers(&case[key])));
        }
        let theirs: Vec<f64> = case["Jq_qdot_from_xdot"]
            .as_array()
            .unwrap()
            .iter()
            .flat_map(numbers)
            .collect();
        let ours: Vec<f64> = closed.d[..n * n].to_vec();
        worst[1] = worst[1].max(deviation("J", &ours, &theirs));
        let tau = mechanism.nominal_torque(&one(&x)).unwrap();
        worst[2] = worst[2].max(deviation("tau", &tau, &numbers(&case["tau_numpy"])));
    }
    println!(
        "{name}, {} cases: kinematics {:.1e}, Jacobian {:.1e}, torques {:.1e} N m",
        cases.len(),
        worst[0],
        worst[1],
        worst[2]
    );
}

#[test]
fn h4_angles_jacobian_and_torques() {
    let (model, cases) = reference("h4");
    parallelogram_cases("H4", &h4(&model).build().unwrap(), &cases);
}

#[test]
fn delta_angles_jacobian_and_torques() {
    let (model, cases) = reference("delta");
    parallelogram_cases("Delta", &delta(&model).build().unwrap(), &cases);
}

#[test]
fn lumped_h4_torques() {
    let (model, cases) = reference("h4");
    let mut robot = h4(&model);
    robot.model = Model::LumpedGravity;
    let mechanism = robot.build().unwrap();
    assert_eq!(mechanism.parameters.list.len(), 10);
    for case in &cases {
        let x = one(&["x", "xd", "xdd"].map(|k| numbers(&case[k])));
        let tau = mechanism.nominal_torque(&x).unwrap();
        deviation("lumped", &tau, &numbers(&case["tau_lumped_model"]));
    }
}

/// Base parameters over random motions in a box about home.
fn base(mechanism: &Mechanism) -> BaseParameters {
    let m = mechanism.freedoms();
    let r = &mut common::rng(7);
    let count = 60 + 3 * mechanism.parameters.list.len() / m;
    let mut x = Samples::zeros(m, count);
    for k in 0..m {
        let [low, high] = mechanism.workspace[k].position;
        for s in 0..count {
            x.q[k * count + s] = r.random_range(low..high);
            x.qd[k * count + s] = r.random_range(-1.5..1.5);
            x.qdd[k * count + s] = r.random_range(-8.0..8.0);
        }
    }
    let w = mechanism.regressor(&x).unwrap();
    let list = &mechanism.parameters.list;
    let b = BaseParameters::from_matrix(
        list.iter().map(|p| p.name.clone()).collect(),
        list.iter().map(|p| p.unit).collect(),
        w.as_ref(),
    )
    .unwrap();
    println!(
        "{:>4} raw {:>3} base, gap {:.1e}",
        list.len(),
        b.count(),
        b.rank_gap
    );
    b
}

/// A hexapod with the symmetric points of which the reference model is a disturbed copy.
fn regular(model: &Value) -> GoughStewart {
    let mut robot = hexapod(model);
    for (i, leg) in robot.legs.iter_mut().enumerate() {
        let pair = (i as f64 / 2.0).floor() * std::f64::consts::TAU / 3.0;
        let side = if i % 2 == 0 { -1.0 } else { 1.0 };
        let at = |radius: f64, angle: f64| {
            nalgebra::Vector3::new(radius * angle.cos(), radius * angle.sin(), 0.0)
        };
        leg.base = at(0.6, pair + side * 0.2085);
        leg.platform = at(0.35, pair + side * 0.88);
        let along = nalgebra::Vector3::new(0.0, 0.0, 0.9) + leg.platform - leg.base;
        leg.rotation = excite::mechanism::gough_stewart::joint_frame(&along);
    }
    robot
}

#[test]
fn base_parameter_counts() {
    let (model, _) = reference("sg");
    // known counts; where the file is at hand each of its lines is looked up
    let file: Option<Value> = checks().map(|f| {
        let text = std::fs::read_to_string(f.join("base_parameter_counts.json")).unwrap();
        serde_json::from_str(&text).unwrap()
    });
    let mut seen = 0;
    let mut expect = |line: &str, count: usize, known: usize| {
        println!("{line}: {count}");
        assert_eq!(count, known, "{line}");
        if let Some(file) = &file {
            assert_eq!(file[line].as_u64(), Some(known as u64), "{line}");
            seen += 1;
        }
    };
    use JointTerm::{Armature, Coulomb, Viscous};
    for (kind, robot) in [("irregular", hexapod(&model)), ("regular", regular(&model))] {
        let count = |change: &dyn Fn(&mut GoughStewart)| {
            let mut robot = robot.clone();
            change(&mut robot);
            base(&robot.build().unwrap()).count()
        };
        let name = |what: &str| format!("SG 6-UPS {kind}{what}");
        expect(&name(" A,B,P (130 raw)"), count(&|_| ()), 82);
        expect(
            &name(" with U-cross bodies (190 raw)"),
            count(&|r| r.bodies = Bodies::Cross),
            88,
        );
        expect(
            &name(" + rotor/ball-screw inertia (6)"),
            count(&|r| {
                r.bodies = Bodies::Cross;
                r.identify = vec![Armature];
            }),
            94,
        );
        expect(
            &name(" + 12 friction"),
            count(&|r| {
                r.bodies = Bodies::Cross;
                r.identify = vec![Armature, Viscous, Coulomb];
            }),
            106,
        );
        expect(
            &name(" platform only"),
            count(&|r| r.bodies = Bodies::Platform),
            10,
        );
        // the reference counts the crosses of the joints among a leg's bodies here: without them
        // one combination fewer (82 = 6 · 12 + 10 against 88 = 6 · 13 + 10)
        expect(
            &name(" identical legs"),
            count(&|r| {
                r.bodies = Bodies::Cross;
                r.identical = true;
            }),
            23,
        );
        assert_eq!(count(&|r| r.identical = true), 22);
        expect(
            &name(" identical axisymmetric legs"),
            count(&|r| {
                r.identical = true;
                r.axisymmetric = true;
            }),
            14,
        );
        expect(
            &name(" individual axisymmetric legs"),
            count(&|r| r.axisymmetric = true),
            34,
        );
    }
    let (model, _) = reference("h4");
    let h4_count = |change: &dyn Fn(&mut excite::mechanism::h4::H4)| {
        let mut robot = h4(&model);
        change(&mut robot);
        base(&robot.build().unwrap()).count()
    };
    expect("H4-like bodies", h4_count(&|_| ()), 48);
    expect(
        "H4-like + motor inertia",
        h4_count(&|r| r.identify = vec![Armature]),
        48,
    );
    expect(
        "H4-like + friction",
        h4_count(&|r| r.identify = vec![Armature, Viscous, Coulomb]),
        56,
    );
    expect(
        "H4-like platform",
        h4_count(&|r| r.bodies = parallelogram::Bodies::Platform),
        4,
    );
    expect(
        "H4-like identical chains",
        h4_count(&|r| r.identical = true),
        15,
    );
    let (model, _) = reference("delta");
    let delta_count = |change: &dyn Fn(&mut excite::mechanism::delta::Delta)| {
        let mut robot = delta(&model);
        change(&mut robot);
        base(&robot.build().unwrap()).count()
    };
    expect("Delta bodies", delta_count(&|_| ()), 34);
    expect(
        "Delta + motor inertia",
        delta_count(&|r| r.identify = vec![Armature]),
        34,
    );
    expect(
        "Delta + friction",
        delta_count(&|r| r.identify = vec![Armature, Viscous, Coulomb]),
        40,
    );
    expect(
        "Delta platform",
        delta_count(&|r| r.bodies = parallelogram::Bodies::Platform),
        1,
    );
    expect(
        "Delta identical chains",
        delta_count(&|r| r.identical = true),
        12,
    );
    if let Some(file) = file {
        assert_eq!(seen, file.as_object().unwrap().len(), "lines of the file");
    }
}
