//! Parallel robots against reference numbers of three independent implementations. The full set is
//! read from the folder named by `EXCITE_CHECKS` (or beside the project), a few cases of each come
//! with the tests.

use crate::common;
use crate::common::compare::difference;
use crate::common::parallel::{delta, h4, hexapod, matrix, numbers, reference, vector};
use crate::common::shared::checks;
use excite::base::BaseParameters;
use excite::dynamics::Samples;
use excite::mechanism::gough_stewart::{Bodies, GoughStewart};
use excite::mechanism::h4::Model;
use excite::mechanism::parallelogram;
use excite::mechanism::parts::Task;
use excite::mechanism::{Mechanism, PlatformMotion};
use excite::robot::parts::JointTerm;
use nalgebra::DMatrix;
use rand::Rng;
use serde_json::Value;

const WITHIN: f64 = 1e-9;

fn one(x: &[Vec<f64>; 3]) -> Samples {
    Samples::from_rows(x[0].len(), &[&x[0]], &[&x[1]], &[&x[2]])
}

/// Largest deviation, which must be below 1e-9.
fn deviation(what: &str, ours: &[f64], theirs: &[f64]) -> f64 {
    let d = difference(ours, theirs);
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

/// Random states of the size of the reference cases: `x` in a box about (0, 0, −0.44, 0), up to
/// 30 m/s² and 80 rad/s² (the reference states the cases, not the box).
fn h4_states(count: usize) -> Samples {
    let r = &mut common::rng(21);
    let half = [
        [0.12, 0.12, 0.07, 0.5],
        [1.5, 1.5, 1.5, 3.5],
        [30.0, 30.0, 30.0, 80.0],
    ];
    let mut x = Samples::zeros(4, count);
    for (half, to) in half.iter().zip([&mut x.q, &mut x.qd, &mut x.qdd]) {
        for k in 0..4 {
            for v in &mut to[k * count..(k + 1) * count] {
                *v = half[k] * r.random_range(-1.0..1.0);
            }
        }
    }
    x.q[2 * count..3 * count]
        .iter_mut()
        .for_each(|z| *z -= 0.44);
    x
}

/// The torque error of the lumped model that the reference states, 6.3 %: nominal values, weight of
/// the arms counted, no friction, relative to the torques of all rods.
#[test]
fn lumped_forearms_leave_what_the_reference_states() {
    let Some(folder) = checks("skipped") else {
        return;
    };
    let text = std::fs::read_to_string(folder.join("h4_cases.json")).unwrap();
    let file: Value = serde_json::from_str(&text).unwrap();
    let stated = file["lumped_model_rel_rms_error"].as_f64().unwrap();
    let (model, cases) = reference("h4");
    let build = |model_of: Model, terms: &[JointTerm]| {
        let mut robot = h4(&model);
        robot.model = model_of;
        robot.identify = terms.to_vec();
        robot.build().unwrap()
    };
    let relative = |own: &[f64], truth: &[f64]| {
        let square = |x: f64| x * x;
        let off: f64 = own.iter().zip(truth).map(|(a, b)| square(a - b)).sum();
        (off / truth.iter().map(|t| square(*t)).sum::<f64>()).sqrt()
    };
    let rods = build(Model::Rods, &[]);
    let lumped = build(Model::LumpedGravity, &[]);
    let column = |key: &str| -> Vec<f64> { cases.iter().flat_map(|c| numbers(&c[key])).collect() };
    let of_cases = relative(&column("tau_lumped_model"), &column("tau_numpy"));
    let x = h4_states(4000);
    let truth = rods.nominal_torque(&x).unwrap();
    let of_states = relative(&lumped.nominal_torque(&x).unwrap(), &truth);
    println!(
        "nominal, with the weight of the arms: stated {stated:.4}, 12 cases {of_cases:.4}, 4000 states {of_states:.4}"
    );
    assert!((of_cases - stated).abs() < 2e-3 && (of_states - stated).abs() < 5e-3);
    // parameters identified without noise leave more (no weight of the arms) or less (with it)
    let left = [(Model::Lumped, 14), (Model::LumpedGravity, 18)].map(|(model, count)| {
        let m = build(model, &[JointTerm::Viscous, JointTerm::Coulomb]);
        assert_eq!(m.parameters.list.len(), count);
        let w = m.regressor(&x).unwrap();
        let w = DMatrix::from_fn(w.nrows(), w.ncols(), |i, k| w[(i, k)]);
        let tau = nalgebra::DVector::from_column_slice(&truth);
        let phi = w.clone().svd(true, true).solve(&tau, 1e-9).unwrap();
        relative((w * phi).as_slice(), &truth)
    });
    println!(
        "identified: 14 parameters {:.4}, 18 parameters {:.4}",
        left[0], left[1]
    );
    assert!(
        (0.09..0.13).contains(&left[0]) && left[1] < 0.03,
        "{left:?}"
    );
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
    let file: Option<Value> = checks("counts as known").map(|f| {
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
