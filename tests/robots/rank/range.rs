//! Numbers out of range, and limits that leave no motion.

use super::*;

/// A gripper whose fingers have no mass, with a limit that their friction uses up.
fn gripper(effort: f64, friction: f64) -> String {
    let finger = |n: usize| {
        let mimic = match n {
            1 => String::new(),
            _ => "<mimic joint=\"finger1\" multiplier=\"1\"/>".to_string(),
        };
        format!(
            "<link name=\"f{n}\"/><joint name=\"finger{n}\" type=\"revolute\"><origin xyz=\"0 0.0{n} 0.1\"/>\
             <parent link=\"jaw\"/><child link=\"f{n}\"/><axis xyz=\"0 0 1\"/>\
             <limit lower=\"0\" upper=\"1\" velocity=\"2\" effort=\"{effort}\"/>\
             <dynamics friction=\"{friction}\"/>{mimic}</joint>\n"
        )
    };
    let fingers: String = (1..=4).map(finger).collect();
    hobby_arm(Numbers::Printed).replace("</robot>", &format!("{fingers}</robot>"))
}

fn designed(robot: &Robot) -> excite::Result<excite::design::Design> {
    let settings = Settings::default().with(|set| set.starts = Some(1));
    design(&Plant::from(robot.clone()), &settings)
}

/// "needs inf % of its effort limit" before, without a word on the fingers that follow.
#[test]
fn friction_of_followers_that_uses_up_the_limit_is_named() {
    let error = designed(&robot(&gripper(1.0, 0.3)))
        .unwrap_err()
        .to_string();
    assert!(!error.contains("inf"), "{error}");
    for text in [
        "finger1",
        "friction 1.2 N m",
        "3 joints which mimic it",
        "finger2",
        "limit 1 N m",
        "lock = { finger1 = 0.5 }",
    ] {
        assert!(error.contains(text), "{text} is missing: {error}");
    }
    // the line does what it promises
    let toml = "urdf = \"arm.urdf\"\nlock = { finger1 = 0.5 }\n";
    let held = Robot::from_toml_str(toml, &gripper(1.0, 0.3), "robot.toml").unwrap();
    assert_eq!(held.dof(), 6);
    assert!(designed(&held).is_ok());
}

/// A weak gripper does not stop the arm.
#[test]
fn a_weak_gripper_without_mass_is_designed_for() {
    let d = designed(&robot(&gripper(1.0, 0.05))).unwrap();
    assert!(d.value < 1e4, "{}", d.value);
}

/// Numbers that no robot has are refused by name; they went on into a panic.
#[test]
fn numbers_out_of_range_are_refused_by_name() {
    let arm = hobby_arm(Numbers::Printed);
    let cases = [
        ("xyz=\"-0.012 0.006 -0.009\"", "xyz=\"1e9 0 0\"", "1.0e9 m"),
        (
            "<mass value=\"0.08\"/>",
            "<mass value=\"1e9\"/>",
            "1.0e9 kg",
        ),
        ("ixx=\"", "ixx=\"1e9\" x=\"", "kg m^2"),
        (
            "xyz=\"0.0203 0.0187 -0.0235\"",
            "xyz=\"0.0203 1e300 0\"",
            "1.0e300 m",
        ),
    ];
    for (from, to, said) in cases {
        assert!(arm.contains(from), "{from} in {arm}");
        let text = arm.replacen(from, to, 1);
        let error = Robot::from_urdf_str(&text, "test.urdf")
            .unwrap_err()
            .to_string();
        assert!(error.contains(said) && error.contains("line "), "{error}");
    }
}

/// A torque limit that leaves no motion worth the name ended in a panic.
#[test]
fn a_load_that_leaves_no_motion_is_an_error() {
    let planar = excite::robot::bundled::find("planar2").unwrap().urdf;
    let from = planar.find("izz=\"").unwrap() + 5;
    let to = from + planar[from..].find('"').unwrap();
    for inertia in ["9e7", "1e7"] {
        let text = format!("{}{inertia}{}", &planar[..from], &planar[to..]);
        for criterion in [
            excite::design::Criterion::Condition,
            excite::design::Criterion::A,
            excite::design::Criterion::E,
        ] {
            let settings = Settings::default().with(|set| {
                set.starts = Some(1);
                set.criterion = criterion;
            });
            let robot = robot(&text);
            match design(&Plant::from(robot.clone()), &settings) {
                Ok(d) => assert!(d.value.is_finite()),
                Err(e) => assert!(e.to_string().contains("planar2"), "{e}"),
            }
        }
    }
}

/// Numbers of a `robot.toml` that no joint has are refused with their line, and limits of a URDF
/// that say "none" are taken so.
#[test]
fn numbers_out_of_range_in_robot_toml_and_limits() {
    let arm = hobby_arm(Numbers::Printed);
    for line in [
        "effort = 1e-300",
        "velocity = 1e300",
        "torque_noise = 1e-200",
        "armature = 1e200",
        "gear_ratio = 1e150",
        "position = [-1e150, 1.0]",
    ] {
        let toml = format!("urdf = \"arm.urdf\"\n[[joint]]\nname = \"gripper\"\n{line}\n");
        let error = Robot::from_toml_str(&toml, &arm, "robot.toml")
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("line 4") && error.contains("gripper"),
            "{line}: {error}"
        );
    }
    let endless = arm
        .replacen("upper=\"1.6\"", "upper=\"1e150\"", 1)
        .replacen("effort=\"3\"", "effort=\"1e-300\"", 1);
    let robot = robot(&endless);
    let gripper = robot.joints.iter().find(|j| j.name == "gripper").unwrap();
    assert_eq!(gripper.limits.position, [-1.7, f64::INFINITY]);
    assert_eq!(gripper.limits.effort, f64::INFINITY);
    assert!(
        robot
            .warnings
            .iter()
            .any(|w| w.message.contains("taken as none"))
    );
    assert!(BaseParameters::new(&robot).is_ok());
    assert!(designed(&robot).is_ok());
}
