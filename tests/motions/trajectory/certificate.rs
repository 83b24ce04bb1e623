//! Certificates of known motions.

use super::*;

/// One joint, one harmonic: `q = 0.5 + 2 sin(π t)`.
fn swing() -> Fourier {
    let series = Series {
        constant: 0.5,
        sin: vec![2.0],
        cos: vec![0.0],
    };
    Fourier::new(2.0, vec![1], vec![series]).unwrap()
}

fn one_joint(limits: Limits) -> Robot {
    robot(
        vec![body(None, Motion::Revolute, 0)],
        vec![joint("j", Motion::Revolute, limits)],
    )
}

#[test]
fn certificate_of_a_known_motion() {
    let pi = std::f64::consts::PI;
    let limits = Limits {
        position: [-2.0, 4.0],
        velocity: 8.0,
        jerk: 100.0,
        ..Limits::default()
    };
    let c = certify(&one_joint(limits), &swing()).unwrap();
    let j = &c.joints[0];
    assert!((j.position.max.value - 2.5).abs() < 1e-14 && (j.position.max.time - 0.5).abs() < 1e-9);
    assert!((j.position.min.value + 1.5).abs() < 1e-14 && (j.position.min.time - 1.5).abs() < 1e-9);
    // middle 1, half range 3: the lower end is 2.5 away
    assert!((j.position.used.unwrap() - 2.5 / 3.0).abs() < 1e-14);
    assert!((j.position.margin.unwrap() - 0.5).abs() < 1e-14);
    assert!((j.velocity.value - 2.0 * pi).abs() < 1e-13);
    assert!((j.velocity.used.unwrap() - 2.0 * pi / 8.0).abs() < 1e-14);
    assert!((j.acceleration.value - 2.0 * pi * pi).abs() < 1e-12);
    assert_eq!((j.acceleration.limit, j.acceleration.used), (None, None));
    assert!((j.jerk.margin.unwrap() - 100.0 + 2.0 * pi.powi(3)).abs() < 1e-11);
    assert!(c.satisfied);
    let worst = c.worst.unwrap();
    assert_eq!((worst.joint.as_str(), worst.kind), ("j", Kind::Position));
}

#[test]
fn limits_hold_to_a_billionth_of_their_range_and_no_further() {
    let pi = std::f64::consts::PI;
    let satisfied = |limits: Limits| certify(&one_joint(limits), &swing()).unwrap().satisfied;
    let free = Limits::default();
    for (change, holds) in [(0.0, true), (-0.9e-9, true), (-1.2e-9, false)] {
        let f = 1.0 + change;
        assert_eq!(
            satisfied(Limits {
                velocity: 2.0 * pi * f,
                ..free
            }),
            holds
        );
        assert_eq!(
            satisfied(Limits {
                acceleration: 2.0 * pi * pi * f,
                ..free
            }),
            holds
        );
        assert_eq!(
            satisfied(Limits {
                jerk: 2.0 * pi.powi(3) * f,
                ..free
            }),
            holds
        );
        assert_eq!(
            satisfied(Limits {
                position: [-1.5, 2.5 + 4.0 * change],
                ..free
            }),
            holds
        );
        let lower = [-1.5 - 1.5 * change, f64::INFINITY];
        assert_eq!(
            satisfied(Limits {
                position: lower,
                ..free
            }),
            holds
        );
    }
    assert!(!satisfied(Limits {
        velocity: 0.0,
        ..free
    }));
}

#[test]
fn certificate_with_torque() {
    // a rotor: torque = 0.5 q'' and Coulomb friction 1; q'' peaks at 2π²
    let mut robot = one_joint(Limits {
        effort: 12.0,
        ..Limits::default()
    });
    robot.joints[0].terms = [0.5, 0.0, 1.0, 0.0];
    let smooth =
        |q: &[f64], qd: &[f64], qdd: &[f64], tau: &mut [f64]| torque(&robot, q, qd, qdd, tau);
    let peak = std::f64::consts::PI.powi(2);
    let bounds = torque_certificate(&robot, &swing(), 200_000, &smooth).unwrap();
    assert!(bounds[0].max_on_grid <= peak * (1.0 + 1e-12));
    assert!(bounds[0].max_on_grid + bounds[0].between_grid_bound >= peak);
    assert!(bounds[0].between_grid_bound <= 0.002 * 12.0 * 1.01);
    let c = certify(&robot, &swing()).unwrap();
    assert!(c.worst.is_none());
    let c = c.with_torque(bounds);
    assert!(c.satisfied && c.worst.unwrap().kind == Kind::Torque);
    robot.joints[0].limits.effort = 10.0;
    let smooth =
        |q: &[f64], qd: &[f64], qdd: &[f64], tau: &mut [f64]| torque(&robot, q, qd, qdd, tau);
    let bounds = torque_certificate(&robot, &swing(), 200_000, &smooth).unwrap();
    assert!(
        !certify(&robot, &swing())
            .unwrap()
            .with_torque(bounds)
            .satisfied
    );
}

#[test]
fn a_trajectory_of_another_robot_or_a_torque_that_is_no_number() {
    let robot = arm();
    assert!(certify(&robot, &swing()).unwrap_err().is_argument());
    let nan = |_: &[f64], _: &[f64], _: &[f64], tau: &mut [f64]| tau.fill(f64::NAN);
    let error = torque_certificate(&robot, &random_motion(1, 7, 1.0, false), 100, &nan);
    assert!(error.unwrap_err().to_string().contains("joint1"));
}
