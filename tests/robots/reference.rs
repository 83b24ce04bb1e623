//! Figures that others computed: torques, regressors, ranks and condition numbers of Pinocchio
//! (`tests/data/*.json`, written by `tests/data/make_reference.py`), and the regressor of the
//! two-link arm from the textbook.

use crate::common::compare::largest;
use excite::Robot;
use excite::base::BaseParameters;
use excite::dynamics::parts::Workspace;
use excite::dynamics::{Isa, Samples, Tree};
use excite::identifiability::condition_numbers;
use excite::regressor::Regressor;
use excite::trajectory::parts::Series;
use excite::trajectory::{Fourier, sample_period};
use nalgebra::Vector3;
use serde::Deserialize;
use std::path::Path;

/// Ten numbers of each body, `None` where all are zero.
type Row = Vec<Option<[f64; 10]>>;

#[derive(Deserialize)]
struct State {
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
    tau: Vec<f64>,
    regressor: Option<Vec<Row>>,
}

#[derive(Deserialize)]
struct Motion {
    period: f64,
    harmonics: Vec<u32>,
    joints: Vec<Series>,
}

#[derive(Deserialize)]
struct Reference {
    gravity: [f64; 3],
    coordinates: Vec<String>,
    bodies: Vec<String>,
    states: Vec<State>,
    rank: usize,
    trajectory: Option<Motion>,
    invariant: Option<f64>,
}

const NAMES: [&str; 10] = [
    "panda", "ur10", "ur10e", "ur5e", "iiwa14", "puma560", "scara", "planar2", "tree", "fr3",
];

/// A robot and the figures for it; its coordinates are in the order of the file.
fn load(name: &str) -> (Robot, Reference) {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let text = std::fs::read_to_string(data.join(format!("{name}.json"))).unwrap();
    let reference: Reference = serde_json::from_str(&text).unwrap();
    let robot = if name == "tree" {
        let mut robot = Robot::load(data.join("tree.urdf").to_str().unwrap()).unwrap();
        robot.gravity = Vector3::from(reference.gravity);
        robot
    } else {
        Robot::load(name).unwrap()
    };
    assert_eq!(robot.gravity, Vector3::from(reference.gravity));
    assert_eq!(robot.joint_names(), reference.coordinates, "{name}");
    (robot, reference)
}

/// All states of a reference as one motion.
fn motion(robot: &Robot, reference: &Reference) -> Samples {
    let part =
        |f: fn(&State) -> &Vec<f64>| -> Vec<&Vec<f64>> { reference.states.iter().map(f).collect() };
    Samples::from_rows(
        robot.dof(),
        &part(|s| &s.q),
        &part(|s| &s.qd),
        &part(|s| &s.qdd),
    )
}

#[test]
fn torques_are_those_of_pinocchio() {
    for name in NAMES {
        let (robot, reference) = load(name);
        let (tree, motion) = (Tree::new(&robot), motion(&robot, &reference));
        let mut tau = vec![0.0; robot.dof() * motion.count];
        for isa in Isa::available() {
            let ws = &mut Workspace::with_isa(isa);
            tree.inverse_dynamics(ws, &robot.parameters(), &motion, &mut tau);
            for (i, state) in reference.states.iter().enumerate() {
                let scale = largest(&state.tau);
                for (j, expected) in state.tau.iter().enumerate() {
                    let found = tau[j * motion.count + i];
                    assert!(
                        (found - expected).abs() <= 1e-12 * scale,
                        "{name} {isa:?} state {i} joint {j}: {found} is not {expected}"
                    );
                }
            }
        }
    }
}

#[test]
fn regressors_are_those_of_pinocchio() {
    for name in NAMES {
        let (robot, reference) = load(name);
        let motion = motion(&robot, &reference);
        let regressor = Regressor::new(&robot, &motion);
        let w = regressor.mat();
        assert_eq!(w.ncols(), 10 * reference.bodies.len(), "{name}");
        let mut compared = 0;
        for (i, state) in reference.states.iter().enumerate() {
            let Some(rows) = &state.regressor else {
                continue;
            };
            let scale = largest(rows.iter().flatten().flatten().flatten());
            for (j, row) in rows.iter().enumerate() {
                for (joint_name, block) in reference.bodies.iter().zip(row) {
                    let body = |b: &excite::robot::Body| b.joint_name == *joint_name;
                    let b = robot.bodies.iter().position(body).unwrap();
                    for (k, expected) in block.unwrap_or_default().into_iter().enumerate() {
                        let found = w[(j * motion.count + i, 10 * b + k)];
                        assert!(
                            (found - expected).abs() <= 1e-12 * scale,
                            "{name} state {i} joint {j} {joint_name} {k}: \
                             {found} is not {expected}"
                        );
                        compared += 1;
                    }
                }
            }
        }
        assert_eq!(compared, 2 * robot.dof() * w.ncols(), "{name}");
    }
}

#[test]
fn ranks_are_those_of_numpy() {
    for name in NAMES {
        let (robot, reference) = load(name);
        let base = BaseParameters::new(&robot).unwrap();
        assert_eq!(base.count(), reference.rank, "{name}");
    }
}

#[test]
fn condition_numbers_are_those_of_numpy() {
    for name in ["panda", "ur10"] {
        let (robot, reference) = load(name);
        let Motion {
            period,
            harmonics,
            joints,
        } = reference.trajectory.unwrap();
        let fourier = Fourier::new(period, harmonics, joints).unwrap();
        let w = Regressor::new(&robot, &sample_period(&fourier));
        let base = BaseParameters::new(&robot).unwrap();
        let noise = vec![1.0; robot.dof()];
        let (condition, singular_values, _) = condition_numbers(&base, w.mat(), &noise).unwrap();
        assert_eq!(singular_values.len(), reference.rank, "{name}");
        let (found, expected) = (condition.invariant, reference.invariant.unwrap());
        assert!(
            (found / expected - 1.0).abs() <= 1e-8,
            "{name}: {found} is not {expected}"
        );
    }
}

/// Two-link arm in a vertical plane, the second link hinged at `l` along the first, angles from
/// the horizontal, first moments in the axes of the links (Lagrange's equations; with the centres
/// of mass on the links' lines, Craig 2005, eq. 6.58).
#[test]
fn the_two_link_arm_has_its_textbook_regressor() {
    const MX: usize = 1;
    const MZ: usize = 3;
    const IYY: usize = 7;
    let (robot, _) = load("planar2");
    let (l, g) = (robot.bodies[1].position.x, -robot.gravity.z);
    let mut state = [0.4, -1.1, 0.9, -1.7, 5.0, -3.0];
    for round in 0..50 {
        let [q1, q2, v1, v2, a1, a2] = state;
        let motion = Samples::from_rows(2, &[[q1, q2]], &[[v1, v2]], &[[a1, a2]]);
        let regressor = Regressor::new(&robot, &motion);
        let w = regressor.mat();
        let (s2, c2) = q2.sin_cos();
        let (s1, c1) = q1.sin_cos();
        let (s12, c12) = (q1 + q2).sin_cos();
        let mut expected = [[0.0; 20]; 2];
        // first link about the fixed hinge
        expected[0][MX] = g * c1;
        expected[0][MZ] = -g * s1;
        expected[0][IYY] = a1;
        // second link: its hinge is carried round by the first
        expected[0][10] = l * l * a1 + g * l * c1;
        let coriolis = v2 * (2.0 * v1 + v2);
        expected[0][10 + MX] = l * (c2 * (2.0 * a1 + a2) - s2 * coriolis) + g * c12;
        expected[0][10 + MZ] = l * (-s2 * (2.0 * a1 + a2) - c2 * coriolis) - g * s12;
        expected[1][10 + MX] = l * (c2 * a1 + s2 * v1 * v1) + g * c12;
        expected[1][10 + MZ] = l * (-s2 * a1 + c2 * v1 * v1) - g * s12;
        expected[0][10 + IYY] = a1 + a2;
        expected[1][10 + IYY] = a1 + a2;
        for (j, row) in expected.iter().enumerate() {
            for (c, y) in row.iter().enumerate() {
                let found = w[(j, c)];
                assert!(
                    (found - y).abs() <= 1e-13 * (1.0 + y.abs()),
                    "round {round}, joint {j}, column {c}: {found} is not {y}"
                );
            }
        }
        // anywhere else, without repeating
        for (k, x) in state.iter_mut().enumerate() {
            *x = 3.0 * (*x + 1.3 * k as f64 + 0.7).sin();
        }
    }
}
