//! Bundled robots.

use super::*;

#[test]
fn bundled_robots_are_complete() {
    assert!(bundled::list().len() >= 8);
    for b in bundled::list() {
        let r = Robot::load(b.name).unwrap();
        assert_eq!(r.name, b.name);
        assert!(r.warnings.is_empty(), "{}: {:?}", b.name, r.warnings);
        assert!(r.path.is_none() && r.hash.len() == 64);
        assert!(!b.description.contains('\n') && b.description.len() < 80 && !b.source.is_empty());
        assert_eq!(r.bodies.len(), r.dof());
        assert_eq!(
            r.parameter_count(),
            10 * r.dof(),
            "{}: rigid bodies only",
            b.name
        );
        for j in &r.joints {
            let [lower, upper] = j.limits.position;
            assert!(
                lower.is_finite() && upper.is_finite() && lower < upper,
                "{}",
                j.name
            );
            let l = &j.limits;
            for limit in [l.velocity, l.acceleration, l.jerk, l.effort] {
                assert!(limit.is_finite() && limit > 0.0, "{} {}", b.name, j.name);
            }
            assert!(
                j.torque_noise
                    .is_some_and(|s| s > 0.0 && s < 0.05 * l.effort)
            );
            assert!(j.gear_ratio.is_some());
        }
        for body in &r.bodies {
            let (smallest, triangle) = body.inertia.realizability();
            assert!(
                smallest > 0.0 && triangle < 1e-9,
                "{} {}: {smallest} {triangle}",
                b.name,
                body.name
            );
            let j = body.inertia.pseudo_inertia();
            assert!(j.cholesky().is_some(), "{} {}", b.name, body.name);
        }
    }
}

/// Position of the origin of the last body at joint positions `q`, for serial arms.
fn last_origin(r: &Robot, q: &[f64]) -> Vector3<f64> {
    let (mut rotation, mut position) = (Matrix3::identity(), Vector3::zeros());
    for body in &r.bodies {
        position += rotation * body.position;
        rotation *= body.rotation;
        let x = body.ratio * q[body.coordinate] + body.offset;
        match body.motion {
            Motion::Revolute => {
                let axis = nalgebra::Unit::new_normalize(body.axis);
                rotation *= nalgebra::Rotation3::from_axis_angle(&axis, x)
                    .matrix()
                    .to_owned();
            }
            Motion::Prismatic => position += rotation * body.axis * x,
        }
    }
    position
}

#[test]
fn bundled_arms_reach_where_their_tables_say() {
    let reach = |name: &str, q: &[f64]| last_origin(&Robot::load(name).unwrap(), q);
    // upright Panda: joint 7 is 0.088 in front of the column of 0.333 + 0.316 + 0.384
    close(reach("panda", &[0.0; 7]).as_slice(), &[0.088, 0.0, 1.033]);
    // stretched out: a2 + a3 horizontally, d4 and d5 off the shoulder plane
    let p = reach("ur10", &[0.0; 6]);
    close(p.as_slice(), &[0.612 + 0.5723, 0.163941, 0.1273 - 0.1157]);
    let p = reach("ur10e", &[0.0; 6]);
    close(
        p.as_slice(),
        &[-0.6127 - 0.57155, -0.17415 - 0.11655, 0.1807 - 0.11985],
    );
    let p = reach("ur5e", &[0.0; 6]);
    close(
        p.as_slice(),
        &[-0.425 - 0.3922, -0.1333 - 0.0996, 0.1625 - 0.0997],
    );
    close(
        reach("iiwa14", &[0.0; 7]).as_slice(),
        &[0.0, 0.0, 0.36 + 0.42 + 0.40 + 0.081],
    );
    close(
        reach("puma560", &[0.0; 6]).as_slice(),
        &[0.4318 - 0.0203, 0.2435 - 0.0934, 0.4331],
    );
    close(
        reach("scara", &[0.0, 0.0, 0.1, 0.0]).as_slice(),
        &[0.6, 0.0, 0.40 - 0.1 - 0.12],
    );
    close(
        reach("scara", &[PI / 2.0, -PI / 2.0, 0.0, 0.0]).as_slice(),
        &[0.275, 0.325, 0.28],
    );
    close(
        reach("planar2", &[PI / 2.0, 0.0]).as_slice(),
        &[0.0, 0.0, 0.5],
    );
}
