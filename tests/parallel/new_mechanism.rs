//! A new mechanism in one file, by the public interface alone: a five-bar linkage in the plane whose
//! coordinates are its two motors, with its elbows in closed form. What follows (regressor, base
//! parameters, design, limits) is the library's; that it is right is checked against the same tree
//! closed as a loop by Newton's method.

use crate::common::compare::difference;
use excite::design::parts::Condition;
use excite::design::{Settings, design};
use excite::dynamics::Samples;
use excite::identifiability::assess;
use excite::mechanism::loops::{Closure, Coincide, Frame, Loops};
use excite::mechanism::parts::{
    ClosedForm, Group, MechanismWorkspace, Pattern, Segment, Source, Task,
};
use excite::mechanism::parts::{Coordinates, Kinematics, Setup};
use excite::mechanism::scalar::{Pack, Scalar};
use excite::mechanism::tree::{Builder, Place};
use excite::mechanism::{Mechanism, TaskDerivatives};
use excite::robot::parts::Motion;
use excite::robot::parts::{JointTerm, Limits};
use excite::robot::{Inertia, Joint};
use excite::{Plant, Result};
use nalgebra::{Matrix3, Vector3};

/// Distance of the motors, lengths of the driven and of the distal links, m.
const BASE: f64 = 0.15;
const DRIVEN: f64 = 0.2;
const DISTAL: f64 = 0.3;

/// Coordinates: `motor1 motor2 elbow1 elbow2`; angles of the motors from the x axis, of the elbows
/// from the driven link.
#[derive(Debug)]
struct FiveBar;

impl FiveBar {
    /// The elbows and the tip, above the line that joins them.
    #[inline(always)]
    fn points<S: Scalar>(x: &[S]) -> [[S; 2]; 3] {
        let elbow = |k: usize| {
            let (sin, cos) = x[k].sin_cos();
            [cos * DRIVEN + BASE * k as f64, sin * DRIVEN]
        };
        let [a, b] = [elbow(0), elbow(1)];
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let square = dx * dx + dy * dy;
        // height of the tip over the distance of the elbows
        let up = (S::constant(DISTAL * DISTAL) / square + (-0.25)).sqrt();
        let tip = [(a[0] + b[0]) * 0.5 - dy * up, (a[1] + b[1]) * 0.5 + dx * up];
        [a, b, tip]
    }

    fn at(x: &[f64]) -> [[f64; 2]; 3] {
        FiveBar::points(&[Pack(x[0]), Pack(x[1])]).map(|p| p.map(|v| v.0))
    }
}

impl Kinematics for FiveBar {
    fn coordinates(&self) -> usize {
        4
    }

    #[inline(always)]
    fn inverse<S: Scalar, C: Coordinates<S> + ?Sized>(&self, x: &[S], q: &mut C) {
        let [a, b, tip] = FiveBar::points(x);
        for (k, elbow) in [a, b].into_iter().enumerate() {
            q.put(k, x[k]);
            let (sin, cos) = x[k].sin_cos();
            let (dx, dy) = (tip[0] - elbow[0], tip[1] - elbow[1]);
            q.put(2 + k, (dy * cos - dx * sin).atan2(dx * cos + dy * sin));
        }
    }

    fn unreachable(&self, x: &[f64]) -> Option<String> {
        let [a, b, _] = FiveBar::at(x);
        let apart = (a[0] - b[0]).hypot(a[1] - b[1]);
        (apart >= 2.0 * DISTAL).then(|| format!("the elbows are {apart:.3} m apart"))
    }

    fn segments(&self, x: &[f64]) -> Vec<Segment> {
        let [a, b, tip] = FiveBar::at(x).map(|p| Vector3::new(p[0], p[1], 0.0));
        let foot = [Vector3::zeros(), Vector3::new(BASE, 0.0, 0.0)];
        let line = |name: &str, ends| Segment {
            name: name.into(),
            ends,
        };
        vec![
            line("driven1", [foot[0], a]),
            line("driven2", [foot[1], b]),
            line("distal1", [a, tip]),
            line("distal2", [b, tip]),
        ]
    }
}

fn five_bar() -> Result<Mechanism> {
    Mechanism::new(five_bar_setup())
}

fn five_bar_setup() -> Setup {
    let mut tree = Builder::default();
    for k in 1..=2 {
        let mut motor = Joint::new(&format!("motor{k}"), Motion::Revolute);
        motor.limits = Limits {
            position: [-1.0, 4.0],
            velocity: 8.0,
            acceleration: 60.0,
            jerk: 3000.0,
            effort: 12.0,
            ..Limits::default()
        };
        motor.torque_noise = Some(0.02);
        motor.terms = [0.0, 0.05, 0.0, 0.0];
        motor.identify = JointTerm::ALL.map(|t| t == JointTerm::Viscous);
        tree.add(motor);
    }
    for k in 1..=2 {
        tree.coordinate(&format!("elbow{k}"), Motion::Revolute);
    }
    let mut groups = Vec::new();
    for k in 0..2 {
        let foot = Place {
            parent: None,
            rotation: Matrix3::identity(),
            position: Vector3::new(BASE * k as f64, 0.0, 0.0),
        };
        let name = format!("driven{}", k + 1);
        let driven = tree.body(&name, foot, k, Vector3::z());
        groups.push(Group::one(&name, driven, Pattern::Full));
        let elbow = Place::at(driven, Vector3::new(DRIVEN, 0.0, 0.0));
        let name = format!("distal{}", k + 1);
        let distal = tree.body(&name, elbow, 2 + k, Vector3::z());
        groups.push(Group::one(&name, distal, Pattern::Full));
        for (body, mass, at) in [(driven, 0.5, 0.1), (distal, 0.3, 0.14)] {
            let com = Vector3::new(at, 0.01 * (1.0 - 2.0 * k as f64), 0.005);
            let tensor = Matrix3::from_diagonal(&Vector3::new(0.0004, 0.003, 0.0032));
            tree.set(body, Inertia::from_com(mass, com, tensor));
        }
    }
    Setup {
        source: Source::Code("five-bar".into()),
        robot: tree.robot("five-bar", Vector3::new(0.0, -9.81, 0.0)),
        actuated: vec![0, 1],
        task: Task::Joints(2),
        geometry: Box::new(ClosedForm::<_, 2>(FiveBar)),
        groups,
        home: vec![2.2, 0.9],
        length: DRIVEN,
    }
}

/// The same tree, its distal links joined by Newton's method.
fn closed_by_newton(m: &Mechanism) -> Result<Mechanism> {
    let end = |name: &str| Frame {
        name: name.into(),
        body: m.robot.bodies.iter().position(|b| b.name == name),
        rotation: Matrix3::identity(),
        position: Vector3::new(DISTAL, 0.0, 0.0),
    };
    Loops {
        robot: m.robot.clone(),
        closures: vec![Closure {
            frames: [end("distal1"), end("distal2")],
            coincide: Coincide::Position,
        }],
        actuated: m.actuated.clone(),
        start: m.inverse(&m.home)?,
        unknown: m.parameters.bodies.clone(),
        length: None,
    }
    .build()
}

#[test]
fn it_moves_and_weighs_as_the_loop_does() {
    let m = five_bar().unwrap();
    let newton = closed_by_newton(&m).unwrap();
    let x = m.random_states(200, 3);
    let (a, b) = (m.motion(&x).unwrap().tree, newton.motion(&x).unwrap().tree);
    for (a, b) in [(&a.q, &b.q), (&a.qd, &b.qd), (&a.qdd, &b.qdd)] {
        assert!(difference(a, b) < 1e-8, "{:e}", difference(a, b));
    }
    let tau = m.nominal_torque(&x).unwrap();
    let other = newton.nominal_torque(&x).unwrap();
    assert!(difference(&tau, &other) < 1e-8);
    // torques are linear in the parameters, τ = Y φ
    let w = m.regressor(&x).unwrap();
    let phi = m.parameters.values();
    let linear: Vec<f64> = (0..w.nrows())
        .map(|r| (0..phi.len()).map(|c| w[(r, c)] * phi[c]).sum())
        .collect();
    assert!(difference(&tau, &linear) < 1e-11);
}

#[test]
fn its_gradients_are_those_of_differences() {
    let m = five_bar().unwrap();
    let x = m.random_states(1, 8);
    let rates = [0.7, -0.4];
    let values = m.parameters.values();
    let mut out = TaskDerivatives::default();
    let ws = &mut MechanismWorkspace::default();
    let raw = m.parameters.expand(&values);
    m.gradients(ws, &raw, &x, &rates, &mut out).unwrap();
    let sum = |x: &Samples| -> f64 {
        let tau = m.torque(x, &values).unwrap();
        tau.iter().zip(rates).map(|(t, r)| t * r).sum()
    };
    for k in 0..2 {
        for (which, own) in [(0, &out.x), (1, &out.xd), (2, &out.xdd)] {
            let moved = |h: f64| {
                let mut x = x.clone();
                [&mut x.q, &mut x.qd, &mut x.qdd][which][k] += h;
                sum(&x)
            };
            let quotient = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            assert!((own[k] - quotient).abs() < 1e-6 * (1.0 + quotient.abs()));
        }
    }
}

#[test]
fn it_is_judged_and_designed_like_those_that_come_with_the_program() {
    let m = five_bar().unwrap();
    let newton = closed_by_newton(&m).unwrap();
    let base = m.base().unwrap();
    assert_eq!(base.count(), newton.base().unwrap().count());
    assert!(base.rank_gap > 1e6, "{:e}", base.rank_gap);
    let settings = Settings::default().with(|set| {
        set.starts = Some(2);
        set.harmonics = 4;
        set.period = 3.0;
        set.condition = Condition::Normalised;
    });
    let design = design(&Plant::from(&m), &settings).unwrap();
    let plant = Plant::from(m);
    let alone = assess(&plant, None).unwrap();
    assert_eq!(alone.headline, Condition::Normalised);
    assert_eq!(alone.base.count(), base.count());
    let a = assess(&plant, Some(&design.trajectory)).unwrap();
    let e = a.excitation.unwrap();
    assert!(e.certificate.satisfied, "{:?}", e.certificate.worst);
    println!("{} base parameters, {:?}", base.count(), e.condition);
    assert!(e.condition.normalised < 100.0);
    let p = e.platform.unwrap();
    assert!(p.certificate.proven() && p.poses.len() == 3);
}

#[test]
fn a_mechanism_of_user_code_is_not_written_as_another_kind() {
    let mut m = five_bar().unwrap();
    // as if it had been read from a file
    m.text = "mechanism = \"loops\"".into();
    let error = excite::export::mechanism::toml(&m, &m.robot, "five_bar.urdf").unwrap_err();
    assert!(error.to_string().contains("five-bar"), "{error}");
}

#[test]
fn unknowns_of_no_body_are_refused() {
    for bodies in [vec![], vec![99]] {
        let mut setup = five_bar_setup();
        setup
            .groups
            .push(Group::shared("rod", &bodies, Pattern::Full));
        let error = Mechanism::new(setup).unwrap_err();
        assert!(error.to_string().contains("`rod`"), "{error}");
    }
}
