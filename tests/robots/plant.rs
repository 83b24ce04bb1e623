//! Serial and parallel robots behind one face.

use crate::common;
use crate::common::compare::largest;

use common::parallel;
use excite::Plant;
use excite::design::{Settings, design};
use excite::robot::Robot;
use excite::robot::parts::Column;
use excite::trajectory::Fourier;
use excite::trajectory::parts::Series;
use excite::trajectory::parts::{Proof, Space};

fn plants() -> Vec<Plant> {
    let (model, _) = parallel::reference("sg");
    let (h4, _) = parallel::reference("h4");
    let mut hexapod = parallel::hexapod(&model);
    hexapod.identify = vec![excite::robot::parts::JointTerm::Viscous];
    for leg in &mut hexapod.legs {
        leg.terms = [0.4, 30.0, 12.0, 1.0];
    }
    vec![
        Plant::from(Robot::load("panda").unwrap()),
        Plant::from(hexapod.build().unwrap()),
        Plant::from(parallel::h4(&h4).build().unwrap()),
    ]
}

#[test]
fn regressor_and_known_part_give_the_nominal_torque() {
    for plant in plants() {
        let x = plant.random_states(20, 3);
        let tau = plant.torque(&x, &plant.values()).unwrap();
        let nominal = plant.nominal_torque(&x).unwrap();
        let size = largest(&nominal);
        for (a, b) in tau.iter().zip(&nominal) {
            assert!((a - b).abs() < 1e-10 * size, "{}: {a} {b}", plant.name());
        }
        assert_eq!(tau.len(), plant.actuators().len() * x.count);
    }
}

#[test]
fn base_parameters_carry_the_whole_torque() {
    for plant in plants() {
        let base = plant.base().unwrap();
        let x = plant.random_states(15, 8);
        let w = plant.regressor(&x).unwrap();
        let values = plant.values();
        let all = &w * faer::ColRef::from_slice(&values);
        let projected = base.project(&values);
        let kept = base.select(w.as_ref()) * faer::ColRef::from_slice(&projected);
        let size = (0..all.nrows()).fold(0.0f64, |m, i| m.max(all[i].abs()));
        for i in 0..all.nrows() {
            assert!((all[i] - kept[i]).abs() < 1e-8 * size, "{}", plant.name());
        }
    }
}

#[test]
fn actuators_move_as_the_inverse_kinematics_says() {
    for plant in plants() {
        let x = plant.random_states(6, 1);
        let m = plant.actuator_motion(&x).unwrap();
        assert_eq!(m.dof, plant.actuators().len());
        let Some(mechanism) = plant.mechanism() else {
            assert_eq!(m, x);
            continue;
        };
        for s in 0..x.count {
            let pose: Vec<f64> = (0..x.dof).map(|k| x.q[k * x.count + s]).collect();
            let q = mechanism.actuator_positions(&pose).unwrap();
            for (a, q) in q.iter().enumerate() {
                assert_eq!(*q, m.q[a * x.count + s]);
            }
        }
    }
}

#[test]
fn every_parameter_stands_for_a_column_of_the_robot() {
    for plant in plants() {
        for p in plant.parameters() {
            assert_eq!(p.kind, plant.raw()[p.raw[0]], "{}", p.name);
            assert_ne!(p.kind, Column::Nuisance, "{}", p.name);
            let value = match p.kind {
                Column::Inertial { body, k } => plant.robot().bodies[body].inertia.0[k],
                Column::Term { joint, term } => plant.robot().joints[joint].terms[term as usize],
                Column::Nuisance => 0.0,
            };
            assert_eq!(p.value, value, "{}", p.name);
        }
    }
}

#[test]
fn ten_columns_of_a_body_are_those_of_its_unknowns() {
    for plant in plants() {
        let x = plant.random_states(5, 2);
        let w = plant.regressor(&x).unwrap();
        for body in 0..plant.robot().bodies.len() {
            let ten = plant.body_columns(body, &x).unwrap();
            for (u, p) in plant.parameters().iter().enumerate() {
                if let (Column::Inertial { body: b, k }, [_]) = (p.kind, p.raw.as_slice())
                    && b == body
                {
                    for r in 0..w.nrows() {
                        assert!((w[(r, u)] - ten[(r, k)]).abs() < 1e-12 * (1.0 + w[(r, u)].abs()));
                    }
                }
            }
        }
    }
}

#[test]
fn a_certificate_says_how_it_is_known() {
    let still = |plant: &Plant| {
        let states = plant.random_states(1, 4);
        let middle = plant.home().map_or(states.q, <[f64]>::to_vec);
        let series = |constant: f64| Series {
            constant,
            sin: vec![1e-4],
            cos: vec![0.0],
        };
        Fourier::new(4.0, vec![1], middle.into_iter().map(series).collect()).unwrap()
    };
    let hexapod = plants().remove(1);
    let actuators = hexapod.clone().in_space(Some(Space::Actuators)).unwrap();
    for (plant, proof) in [
        (plants().remove(0), Proof::Exact),
        (hexapod, Proof::Enclosed),
        (actuators, Proof::Exact),
    ] {
        let c = plant.certify(&still(&plant), 1.0).unwrap();
        assert_eq!(c.proof, proof, "{}", plant.name());
        assert_eq!(c.mechanism.is_some(), plant.space().is_some());
        assert_eq!(c.actuators.joints.len(), plant.actuators().len());
    }
}

#[test]
fn a_design_for_a_part_of_the_limits_keeps_that_part() {
    let plant = Plant::load("planar2").unwrap();
    let settings = Settings::default().with(|set| {
        set.starts = Some(1);
        set.derate = 0.8;
    });
    let motion = design(&plant, &settings).unwrap().trajectory.fourier;
    let used = |derate: f64| {
        let c = plant.certify(&motion, derate).unwrap();
        (c.satisfied(), c.actuators.worst.unwrap().used)
    };
    let (whole, part) = (used(1.0), used(0.8));
    assert!(whole.0 && part.0, "{whole:?} {part:?}");
    assert!(part.1 > 0.9 && whole.1 < 0.9, "{whole:?} {part:?}");
}
