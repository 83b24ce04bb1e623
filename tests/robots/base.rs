//! Base parameters: known ranks, independence of the states and of rounding, readable output.

use crate::common;

use excite::base::parts::Identifiability;
use excite::base::{BaseParameters, random_states};
use excite::regressor::Regressor;
use excite::robot::Robot;
use excite::robot::parts::JointTerm;
use rand::Rng;

const FRICTION: [JointTerm; 3] = [JointTerm::Armature, JointTerm::Viscous, JointTerm::Coulomb];

#[test]
fn known_ranks() {
    for (name, rigid, friction) in [("panda", 43, 62), ("ur10", 36, 52), ("iiwa14", 43, 62)] {
        let robot = Robot::load(name).unwrap();
        let base = BaseParameters::new(&robot).unwrap();
        assert_eq!(base.count(), rigid, "{name}");
        assert!(
            base.rank_gap > 1e10 && base.warnings.is_empty(),
            "{name} {}",
            base.rank_gap
        );
        assert_eq!(
            BaseParameters::new(&robot.with_terms(&FRICTION))
                .unwrap()
                .count(),
            friction
        );
    }
}

/// The choice of columns and the combinations do not depend on the states they came from.
#[test]
fn other_states_give_the_same_base_parameters() {
    for name in ["panda", "ur10e", "scara", "puma560"] {
        let robot = Robot::load(name).unwrap().with_terms(&JointTerm::ALL);
        let reference = BaseParameters::new(&robot).unwrap();
        for seed in 1..5 {
            let states = random_states(&robot, 150, seed);
            let w = Regressor::new(&robot, &states);
            let n = reference.names.len();
            let other =
                BaseParameters::from_matrix(reference.names.clone(), vec![""; n], w.mat()).unwrap();
            assert_eq!(reference.kept, other.kept, "{name} {seed}");
            for a in 0..reference.count() {
                for d in 0..reference.dropped.len() {
                    assert!(
                        (reference.k[(a, d)] - other.k[(a, d)]).abs() < 1e-8,
                        "{name} {seed}"
                    );
                }
            }
        }
    }
}

/// `W φ` depends on the base parameters only, on random trees with mimic joints.
#[test]
fn torques_depend_on_base_parameters_alone() {
    for seed in 0..25 {
        let robot = common::robot(seed, 2 + seed as usize % 6, seed % 2 == 0).with_terms(&FRICTION);
        let base = BaseParameters::new(&robot).unwrap();
        let r = &mut common::rng(seed + 5);
        let phi: Vec<f64> = (0..robot.parameter_count())
            .map(|_| r.random_range(-1.0..1.0))
            .collect();
        let pi = base.project(&phi);
        let w = Regressor::new(&robot, &common::samples(seed + 9, robot.dof(), 20));
        let kept = base.select(w.mat());
        for i in 0..kept.nrows() {
            let full: f64 = (0..phi.len()).map(|c| w.mat()[(i, c)] * phi[c]).sum();
            let reduced: f64 = (0..pi.len()).map(|a| kept[(i, a)] * pi[a]).sum();
            assert!(
                (full - reduced).abs() < 1e-8 * (1.0 + full.abs()),
                "seed {seed}"
            );
        }
    }
}

/// Right angles written as 1.5708 must not make a parameter.
#[test]
fn rounded_right_angles_keep_the_rank() {
    for name in ["panda", "ur10e", "iiwa14"] {
        let urdf = excite::robot::bundled::find(name).unwrap().urdf;
        for digits in [4, 5, 6] {
            let half = format!("{:.digits$}", std::f64::consts::FRAC_PI_2);
            let text = urdf
                .replace("1.5707963267948966", &half)
                .replace("1.570796326794897", &half)
                .replace("1.57079632679", &half);
            assert_ne!(text, urdf, "{name} has right angles");
            let robot = Robot::from_urdf_str(&text, name).unwrap();
            let exact = BaseParameters::new(&Robot::load(name).unwrap()).unwrap();
            assert_eq!(
                BaseParameters::new(&robot).unwrap().count(),
                exact.count(),
                "{name} {half}"
            );
        }
    }
}

#[test]
fn classes_and_reasons() {
    let robot = Robot::load("panda").unwrap().with_terms(&FRICTION);
    let base = BaseParameters::new(&robot).unwrap();
    let of = |name: &str| base.standard.iter().find(|s| s.name == name).unwrap();
    let first = of("panda_link1.m");
    assert_eq!(first.identifiability, Identifiability::None);
    assert!(
        first.reason.contains("parallel to gravity"),
        "{}",
        first.reason
    );
    assert_eq!(
        of("panda_link1.Izz").identifiability,
        Identifiability::Combination
    );
    assert!(
        of("panda_joint1.armature")
            .reason
            .contains("panda_link1.Izz")
    );
    assert_eq!(
        of("panda_joint4.viscous").identifiability,
        Identifiability::Alone
    );
    assert_eq!(of("panda_link7.mx").identifiability, Identifiability::Alone);
    let kept = (0..base.count())
        .find(|&a| base.name(a) == "panda_link1.Izz")
        .unwrap();
    assert!(base.combination(kept).contains("panda_joint1.armature"));
}
