//! Serial and parallel robots behind one face.

use crate::common;
use crate::common::compare::largest;

use common::parallel;
use excite::Plant;
use excite::robot::Robot;

fn plants() -> Vec<Plant> {
    let (model, _) = parallel::reference("sg");
    let (h4, _) = parallel::reference("h4");
    let mut hexapod = parallel::hexapod(&model);
    hexapod.identify = vec![excite::robot::JointTerm::Viscous];
    for leg in &mut hexapod.legs {
        leg.terms = [0.4, 30.0, 12.0, 1.0];
    }
    vec![
        Plant::Serial(Robot::load("panda").unwrap()),
        Plant::Parallel(Box::new(hexapod.build().unwrap())),
        Plant::Parallel(Box::new(parallel::h4(&h4).build().unwrap())),
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
