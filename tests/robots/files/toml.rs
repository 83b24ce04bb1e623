//! robot.toml: what it sets, and its mistakes.

use super::*;

#[test]
fn a_robot_toml_sets_what_it_states() {
    let robot = Robot::from_toml_str(TOML, &arm(|t| t), "robot.toml").unwrap();
    assert_eq!(robot.name, "test arm");
    assert_eq!(robot.gravity.as_slice(), [0.0, 9.81, 0.0]);
    assert_eq!(robot.prior, Prior::Identified);
    let elbow = &robot.joints[1];
    assert_eq!(elbow.limits.position, [-0.5, 1.5]);
    let l = &elbow.limits;
    assert_eq!(
        [l.velocity, l.acceleration, l.jerk, l.effort],
        [1.0, 15.0, 7500.0, 87.0]
    );
    assert_eq!(elbow.torque_noise, Some(0.08));
    assert_eq!(elbow.position_resolution, Some(2.4e-5));
    assert_eq!(elbow.gear_ratio, Some(100.0));
    assert_eq!(elbow.terms, [0.1, 0.2, 0.3, -0.4]);
    assert_eq!(elbow.identify, [false, true, false, true]);
    assert_eq!(robot.joints[0].limits.position, [-2.0, 2.0]);
    assert_eq!(robot.joints[0].identify, [false; 4]);
    assert!(robot.warnings.is_empty(), "{:?}", robot.warnings);
}

#[test]
fn a_robot_toml_replaces_missing_and_contradictory_limits() {
    let limit = r#"<limit lower="-1" upper="2.5" velocity="4" effort="20"/>"#;
    for bad in [
        "",
        "<limit lower=\"3\" upper=\"2\" velocity=\"-1\" effort=\"-1\"/>",
    ] {
        let robot = Robot::from_toml_str(TOML, &replaced(limit, bad), "robot.toml").unwrap();
        assert_eq!(robot.joints[1].limits.position, [-0.5, 1.5]);
        assert!(robot.warnings.is_empty(), "{:?}", robot.warnings);
    }
}

#[test]
fn toml_errors_say_where_and_what_to_do() {
    let edit = |from: &str, to: &str| {
        assert!(TOML.contains(from), "the test replaces nothing: {from}");
        TOML.replacen(from, to, 1)
    };
    let cases: Vec<(String, &[&str])> = vec![
        ("name = ".into(), &["line 1"]),
        (edit("jerk", "jrek"), &["line 11", "`jrek`", "`jerk`"]),
        (edit("gravity", "gravty"), &["line 3", "`gravty`"]),
        (
            edit("prior", "mechanism"),
            &["mechanism", "works with serial and tree robots only"],
        ),
        (
            edit("\"identified\"", "\"guess\""),
            &["line 4", "guess", "cad"],
        ),
        (
            edit("\"elbow\"", "\"elbov\""),
            &["line 7", "`elbov`", "did you mean `elbow`", "shoulder"],
        ),
        (edit("name = \"elbow\"\n", ""), &["line 6", "name"]),
        (
            format!("{TOML}[[joint]]\nname = \"elbow\"\n"),
            &["line 22", "`elbow`", "two"],
        ),
        (
            edit("[-0.5, 1.5]", "[1.5, -0.5]"),
            &["line 8", "`elbow`", "lower < upper"],
        ),
        (edit("[-0.5, 1.5]", "[1.5, 1.5]"), &["lower < upper"]),
        (edit("[-0.5, 1.5]", "[nan, 1.5]"), &["lower < upper"]),
        (edit("[-0.5, 1.5]", "[0.5]"), &["line 8", "two numbers"]),
        (edit("[-0.5, 1.5]", "0.5"), &["line 8"]),
        (
            edit("[-0.5, 1.5]", "[0.5, 1.0, 2.0]"),
            &["line 8", "two numbers"],
        ),
        (
            edit("velocity = 1", "velocity = -1"),
            &["line 9", "velocity = -1", "positive"],
        ),
        (
            edit("velocity = 1", "velocity = nan"),
            &["velocity = NaN", "positive"],
        ),
        (edit("velocity = 1", "velocity = \"1\""), &["line 9"]),
        (
            edit("acceleration = 15.0", "acceleration = 0"),
            &["line 10", "acceleration", "positive"],
        ),
        (edit("jerk = 7500.0", "jerk = -1"), &["jerk", "positive"]),
        (
            edit("effort = 87.0", "effort = -1"),
            &["effort", "positive"],
        ),
        (
            edit("torque_noise = 0.08", "torque_noise = inf"),
            &["line 13", "torque_noise", "finite"],
        ),
        (edit("2.4e-5", "0"), &["position_resolution", "positive"]),
        (
            edit("gear_ratio = 100", "gear_ratio = 0"),
            &["gear_ratio", "not 0"],
        ),
        (
            edit("armature = 0.1", "armature = nan"),
            &["armature", "finite"],
        ),
        (
            edit("\"viscous\"]", "\"viscosity\"]"),
            &["line 20", "`viscosity`", "armature, viscous"],
        ),
        (
            edit("[0, 9.81, 0.0]", "[0, 9.81]"),
            &["line 3", "three finite numbers"],
        ),
        (
            edit("[0, 9.81, 0.0]", "[0, 9.81, 0, 0]"),
            &["line 3", "three finite numbers"],
        ),
        (
            edit("[0, 9.81, 0.0]", "[0, 9.81, inf]"),
            &["line 3", "gravity", "finite"],
        ),
        (
            edit("prior = \"identified\"", "lock = { wrist = 0.0 }"),
            &["line 4", "lock", "`wrist`", "elbow"],
        ),
        (
            edit("prior = \"identified\"", "lock = { shoulder = nan }"),
            &["line 4", "lock", "finite"],
        ),
        (
            edit(
                "prior = \"identified\"",
                "lock = { elbow = 0, shoulder = 0 }",
            ),
            &["no joint moves"],
        ),
    ];
    for (toml, parts) in cases {
        match Robot::from_toml_str(&toml, &arm(|t| t), "robot.toml") {
            Ok(_) => panic!("accepted:\n{toml}"),
            Err(e) => contains_all(&e.to_string(), parts),
        }
    }
    let fixed = arm(|t| t.replacen("\"elbow\" type=\"revolute\"", "\"elbow\" type=\"fixed\"", 1));
    let e = Robot::from_toml_str(TOML, &fixed, "robot.toml").unwrap_err();
    contains_all(&e.to_string(), &["robot.toml", "line 7", "fixed", "remove"]);
    let mimic = arm(|t| t.replacen("0.4\"/>", "0.4\"/><mimic joint=\"shoulder\"/>", 1));
    let e = Robot::from_toml_str(TOML, &mimic, "robot.toml").unwrap_err();
    contains_all(&e.to_string(), &["line 7", "mimics `shoulder`"]);
}
