//! Trees with loops: against the mechanisms in closed form, against differences, and files of them.

mod read;

use crate::common::compare::relative;
use crate::common::five_bar::URDF;
use crate::common::parallel::{check_at_100_khz, delta, h4, hexapod, reference, states};
use crate::common::rng;
use excite::Plant;
use excite::design::parts::Condition;
use excite::design::{Settings, design};
use excite::dynamics::{Isa, Samples};
use excite::identifiability::assess;
use excite::mechanism::loops::{Closure, Coincide, Frame, Loops};
use excite::mechanism::parts::MechanismWorkspace;
use excite::mechanism::{Mechanism, TaskDerivatives};
use excite::trajectory::parts::Space;
use excite::trajectory::{Trajectory, certify};
use nalgebra::{Matrix3, Vector3};
use rand::Rng;
use std::path::Path;

const HEAD: &str = "mechanism = \"loops\"\nurdf = \"five_bar.urdf\"\ngravity = [0, -9.81, 0]\n\
start = { motor_left = 2.2, elbow_left = -1.2, motor_right = 0.9, elbow_right = 1.2, pin = 0.1 }\n";

const POINT: &str = "lock = { pin = 0.0 }\nactuated = [\"motor_left\", \"motor_right\"]\n\
[[loop]]\nframes = [\"left_end\", \"right_end\"]\ncoincide = \"position\"\n";

const POSE: &str = "actuated = [\"motor_left\", \"motor_right\"]\n\
[[loop]]\nframes = [\"tip\", \"right_end\"]\ncoincide = \"pose\"\n";

const REDUNDANT: &str = "lock = { pin = 0.0 }\n\
actuated = [\"motor_left\", \"motor_right\", \"elbow_left\"]\n\
[[loop]]\nframes = [{ link = \"left2\", position = [0.3, 0, 0] }, \"right_end\"]\n\
coincide = \"position\"\n";

/// The linkage with the rest of its file.
fn five_bar(rest: &str) -> excite::Result<Mechanism> {
    let head = match rest.contains("lock") {
        true => HEAD.replace(", pin = 0.1", ""),
        false => HEAD.to_string(),
    };
    file(&format!("{head}{rest}"), URDF)
}

fn file(toml: &str, urdf: &str) -> excite::Result<Mechanism> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("robot.toml");
    std::fs::write(&path, toml).unwrap();
    std::fs::write(folder.path().join("five_bar.urdf"), urdf).unwrap();
    Ok(Mechanism::load(path.to_str().unwrap())?.unwrap())
}

fn frame(body: usize, position: Vector3<f64>) -> Frame {
    Frame {
        name: format!("body {body}"),
        body: Some(body),
        rotation: Matrix3::identity(),
        position,
    }
}

/// The tree of a mechanism in closed form, its loops closed by balls, started near home.
fn opened(m: &Mechanism, balls: Vec<[(String, Vector3<f64>); 2]>) -> Mechanism {
    let body = |name: &str| m.robot.bodies.iter().position(|b| b.name == name).unwrap();
    let closures = balls
        .into_iter()
        .map(|[a, b]| Closure {
            frames: [frame(body(&a.0), a.1), frame(body(&b.0), b.1)],
            coincide: Coincide::Position,
        })
        .collect();
    let mut start = m.inverse(&m.home).unwrap();
    for (i, q) in start.iter_mut().enumerate() {
        if !m.actuated.contains(&i) {
            *q += 0.02 * (i as f64).sin();
        }
    }
    Loops {
        robot: m.robot.clone(),
        closures,
        actuated: m.actuated.clone(),
        start,
        unknown: m.parameters.bodies.clone(),
        length: None,
    }
    .build()
    .unwrap()
}

/// Mechanisms in closed form, each beside the same one with loops.
pub(super) fn pairs() -> Vec<(Mechanism, Mechanism)> {
    let mut all = Vec::new();
    let robot = hexapod(&reference("sg").0);
    let m = robot.build().unwrap();
    let balls = (robot.legs.iter().enumerate())
        .map(|(i, leg)| {
            let rod = (format!("rod{}", i + 1), Vector3::zeros());
            [rod, ("platform".to_string(), leg.platform)]
        })
        .collect();
    let o = opened(&m, balls);
    all.push((m, o));
    let ends = |chains: &[excite::mechanism::parallelogram::Chain], h4: bool| {
        let mut balls = Vec::new();
        for (i, c) in chains.iter().enumerate() {
            for (rod, side) in [("a", 0.5), ("b", -0.5)] {
                let across = c.rotation.column(0) * (side * c.width);
                let to = match h4 {
                    true => format!("bar{}", c.hinge + 1),
                    false => "platform".to_string(),
                };
                balls.push([
                    (
                        format!("rod{}{rod}", i + 1),
                        Vector3::new(0.0, 0.0, c.rod_length),
                    ),
                    (to, c.attachment + across),
                ]);
            }
        }
        balls
    };
    let robot = h4(&reference("h4").0);
    let m = robot.build().unwrap();
    let o = opened(&m, ends(&robot.chains, true));
    all.push((m, o));
    let robot = delta(&reference("delta").0);
    let m = robot.build().unwrap();
    let o = opened(&m, ends(&robot.chains, false));
    all.push((m, o));
    all
}

/// A motion of the actuators of `m`, from random states of its platform.
fn motions(m: &Mechanism, count: usize, seed: u64) -> (Samples, Samples) {
    let x = states(m, count, seed, 8.0);
    let all = m.motion(&x).unwrap().tree;
    let take = |a: &[f64]| -> Vec<f64> {
        let rows = m.actuated.iter();
        rows.flat_map(|&j| a[j * count..(j + 1) * count].to_vec())
            .collect()
    };
    let actuators = Samples {
        dof: m.actuators(),
        count,
        q: take(&all.q),
        qd: take(&all.qd),
        qdd: take(&all.qdd),
    };
    (x, actuators)
}

#[test]
fn loops_move_as_the_closed_form_does() {
    for (closed, loops) in pairs() {
        assert_eq!(loops.freedoms(), closed.freedoms());
        let (x, actuators) = motions(&closed, 40, 3);
        let a = closed.motion(&x).unwrap().tree;
        let b = loops.motion(&actuators).unwrap().tree;
        // joints of the platform come first or last in either; they are the same tree
        let off = [
            relative(&b.q, &a.q),
            relative(&b.qd, &a.qd),
            relative(&b.qdd, &a.qdd),
            relative(
                &loops.nominal_torque(&actuators).unwrap(),
                &closed.nominal_torque(&x).unwrap(),
            ),
        ];
        println!(
            "{}: q, qd, qdd, torque off by {off:?}",
            closed.source.name()
        );
        assert!(
            off.iter().all(|o| *o < 1e-9),
            "{}: {off:?}",
            closed.source.name()
        );
        let w = loops.regressor(&actuators).unwrap();
        let v = closed.regressor(&x).unwrap();
        assert_eq!(w.ncols(), v.ncols());
        let mut off = 0.0f64;
        for c in 0..w.ncols() {
            let column = |m: &faer::Mat<f64>| (0..m.nrows()).map(|r| m[(r, c)]).collect::<Vec<_>>();
            off = off.max(relative(&column(&w), &column(&v)));
        }
        println!("{}: regressor off by {off:.1e}", closed.source.name());
        assert!(off < 1e-9);
        // the same rank over the same motions
        let (x, actuators) = motions(&closed, 300, 4);
        let count = |m: &Mechanism, x: &Samples| {
            let list = &m.parameters.list;
            let base = excite::base::BaseParameters::from_matrix(
                list.iter().map(|p| p.name.clone()).collect(),
                list.iter().map(|p| p.unit).collect(),
                m.regressor(x).unwrap().as_ref(),
            );
            base.unwrap().count()
        };
        assert_eq!(count(&loops, &actuators), count(&closed, &x));
        let own = loops.base().unwrap();
        println!(
            "{}: {} base, gap {:.1e}",
            closed.source.name(),
            own.count(),
            own.rank_gap
        );
    }
}

/// Central differences of the geometry's first outputs against its own derivatives.
fn derivatives(m: &Mechanism, seed: u64) {
    let (n, t) = (m.robot.dof(), m.freedoms());
    let r = &mut rng(seed);
    let mut x = Samples::zeros(t, 1);
    for k in 0..t {
        let [low, high] = m.workspace[k].position;
        x.q[k] = low + (high - low) * r.random_range(0.3..0.7);
        x.qd[k] = r.random_range(-1.0..1.0);
        x.qdd[k] = r.random_range(-3.0..3.0);
    }
    let u: Vec<f64> = (0..t).map(|_| r.random_range(-1.0..1.0)).collect();
    let g = m.geometry();
    let zero = || vec![0.0; n * t];
    let (mut d, mut dqd, mut dqdd, mut bend) = (zero(), zero(), zero(), zero());
    g.sensitivity(Isa::Scalar, &x, &mut d, &mut dqd, &mut dqdd);
    g.curvature(Isa::Scalar, &x, &u, &mut bend);
    let at = |k: usize, h: f64| {
        let mut moved = x.clone();
        moved.q[k] += h;
        let (mut motion, mut d) = (Samples::zeros(n, 1), zero());
        g.motion(Isa::Scalar, &moved, &mut motion, &mut d);
        (motion, d)
    };
    let mut off = [0.0f64; 4];
    for k in 0..t {
        let h = 1e-4;
        let ((a, da), (b, db)) = (at(k, h), at(k, -h));
        let ((a2, da2), (b2, db2)) = (at(k, 2.0 * h), at(k, -2.0 * h));
        // fourth order
        let diff = |p: f64, m: f64, p2: f64, m2: f64| (8.0 * (p - m) - (p2 - m2)) / (12.0 * h);
        for i in 0..n {
            let own = [
                d[i * t + k],
                dqd[i * t + k],
                dqdd[i * t + k],
                bend[i * t + k],
            ];
            let along = |d: &[f64]| (0..t).map(|l| d[i * t + l] * u[l]).sum::<f64>();
            let quotient = [
                diff(a.q[i], b.q[i], a2.q[i], b2.q[i]),
                diff(a.qd[i], b.qd[i], a2.qd[i], b2.qd[i]),
                diff(a.qdd[i], b.qdd[i], a2.qdd[i], b2.qdd[i]),
                diff(along(&da), along(&db), along(&da2), along(&db2)),
            ];
            for (o, (x, y)) in off.iter_mut().zip(own.iter().zip(quotient)) {
                *o = o.max((x - y).abs() / (1.0 + y.abs()));
            }
        }
    }
    println!(
        "{} {}: D, dqd, dqdd, curvature off by {off:?}",
        m.source.name(),
        m.robot.name
    );
    assert!(off.iter().all(|o| *o < 1e-7), "{off:?}");
}

#[test]
fn derivatives_are_those_of_differences() {
    for (closed, loops) in pairs() {
        derivatives(&loops, 11);
        let own = closed.in_actuators().unwrap();
        let half = vec![0.1; own.freedoms()];
        derivatives(&own.with_workspace(&half), 13);
    }
    for top in [POINT, POSE] {
        derivatives(&five_bar(top).unwrap(), 12);
    }
    // of a sum of torques, redundant actuators included
    for top in [POINT, REDUNDANT] {
        let m = five_bar(top).unwrap();
        let x = m.random_states(1, 5);
        let raw = m.parameters.expand(&m.parameters.values());
        let rates: Vec<f64> = (0..m.actuators()).map(|a| 0.7 - 0.4 * a as f64).collect();
        let mut out = TaskDerivatives::default();
        let ws = &mut MechanismWorkspace::default();
        m.gradients(ws, &raw, &x, &rates, &mut out).unwrap();
        let sum = |x: &Samples| -> f64 {
            let tau = m.torque(x, &m.parameters.values()).unwrap();
            tau.iter().zip(&rates).map(|(t, r)| t * r).sum()
        };
        for k in 0..m.freedoms() {
            let h = 1e-5;
            for (which, own) in [(0, &out.x), (1, &out.xd), (2, &out.xdd)] {
                let moved = |h: f64| {
                    let mut x = x.clone();
                    [&mut x.q, &mut x.qd, &mut x.qdd][which][k] += h;
                    sum(&x)
                };
                let quotient = (moved(h) - moved(-h)) / (2.0 * h);
                let off = (own[k] - quotient).abs() / (1.0 + quotient.abs());
                assert!(off < 1e-6, "{top} {which} {k}: {} {quotient}", own[k]);
            }
        }
    }
}
