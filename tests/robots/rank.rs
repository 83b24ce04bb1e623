//! The rank where a file is rounded, where singular values fall smoothly, and what a user is told:
//! a hobby arm as its CAD program writes it, and a humanoid with fingers that follow one motor.

mod range;

use excite::base::{BaseParameters, CLEAR};
use excite::design::{Settings, design};
use excite::identifiability::{assess, json, page};
use excite::plant::Plant;
use excite::robot::Robot;

/// Numbers as the file prints them, or what they stand for.
#[derive(Clone, Copy, PartialEq)]
enum Numbers {
    Printed,
    Exact,
}

/// Three numbers of an `rpy`, right angles and zeros exact where asked for.
fn rpy(numbers: Numbers, text: &str) -> String {
    let half = std::f64::consts::FRAC_PI_2;
    let each = |t: &str| {
        let x: f64 = t.parse().unwrap();
        // plus zero: no -0.0
        let exact = (x / half).round() * half + 0.0;
        match numbers == Numbers::Exact && (x - exact).abs() < 1e-5 {
            true => format!("{exact:?}"),
            false => t.to_string(),
        }
    };
    text.split_whitespace()
        .map(each)
        .collect::<Vec<_>>()
        .join(" ")
}

fn xyz(numbers: Numbers, text: &str) -> String {
    let each = |t: &str| match numbers == Numbers::Exact && t.parse::<f64>().unwrap().abs() < 1e-6 {
        true => "0".to_string(),
        false => t.to_string(),
    };
    text.split_whitespace()
        .map(each)
        .collect::<Vec<_>>()
        .join(" ")
}

/// Five joints and a gripper, printed with six digits, the tip first.
fn hobby_arm(numbers: Numbers) -> String {
    let links = [
        ("shoulder", 0.11, 0.03),
        ("upper_arm", 0.1, 0.06),
        ("lower_arm", 0.1, 0.06),
        ("wrist", 0.08, 0.03),
        ("hand", 0.09, 0.03),
        ("jaw", 0.013, 0.02),
    ];
    let joints = [
        (
            "gripper",
            "hand",
            "jaw",
            "0.0203 0.0187 -0.0235",
            "1.5708 -5.24e-08 -1.33e-07",
        ),
        (
            "wrist_roll",
            "wrist",
            "hand",
            "5.6e-09 -0.0612 0.0183",
            "1.5708 0.0487 3.14159",
        ),
        (
            "wrist_flex",
            "lower_arm",
            "wrist",
            "-0.1352 0.0053 3.6e-17",
            "4.02e-08 -8.67e-08 -1.5708",
        ),
        (
            "elbow_flex",
            "upper_arm",
            "lower_arm",
            "-0.1124 -0.0281 2.17e-09",
            "-3.63e-16 5.24e-08 1.5708",
        ),
        (
            "shoulder_lift",
            "shoulder",
            "upper_arm",
            "-0.0305 -0.0181 -0.0543",
            "-1.5708 -1.5708 0",
        ),
        (
            "shoulder_pan",
            "base",
            "shoulder",
            "0.0389 -8.98e-09 0.0626",
            "3.14159 4.19e-17 -3.14159",
        ),
    ];
    let mut text = String::from("<robot name=\"hobby\">\n<link name=\"base\"/>\n");
    for (name, m, l) in links {
        let (x, y, z) = (-0.4 * l, 0.2 * l, -0.3 * l);
        let i = m * l * l;
        text += &format!(
            "<link name=\"{name}\"><inertial><origin xyz=\"{x} {y} {z}\"/><mass value=\"{m}\"/>\
             <inertia ixx=\"{}\" ixy=\"0\" ixz=\"0\" iyy=\"{}\" iyz=\"0\" izz=\"{}\"/></inertial></link>\n",
            i / 3.0,
            i / 4.0,
            i / 5.0
        );
    }
    for (name, parent, child, at, angles) in joints {
        text += &format!(
            "<joint name=\"{name}\" type=\"revolute\"><origin xyz=\"{}\" rpy=\"{}\"/>\
             <parent link=\"{parent}\"/><child link=\"{child}\"/><axis xyz=\"0 0 1\"/>\
             <limit lower=\"-1.7\" upper=\"1.6\" velocity=\"6\" effort=\"3\"/></joint>\n",
            xyz(numbers, at),
            rpy(numbers, angles)
        );
    }
    text + "</robot>"
}

/// Builds a URDF link by link.
struct Builder(String);

impl Builder {
    fn link(&mut self, name: &str, m: f64, l: f64) {
        let (x, y, z, i) = (0.1 * l, -0.05 * l, -0.5 * l, m * l * l);
        self.0 += &format!(
            "<link name=\"{name}\"><inertial><origin xyz=\"{x} {y} {z}\"/><mass value=\"{m}\"/>\
             <inertia ixx=\"{}\" ixy=\"0\" ixz=\"0\" iyy=\"{}\" iyz=\"0\" izz=\"{}\"/></inertial></link>\n",
            i / 10.0,
            i / 11.0,
            i / 40.0
        );
    }

    /// A joint named after its link; `rest` is its limit and whatever else belongs inside.
    fn joint(
        &mut self,
        name: &str,
        [parent, child]: [&str; 2],
        at: [f64; 3],
        angles: [f64; 3],
        axis: char,
        rest: &str,
    ) {
        let axis = match axis {
            'x' => "1 0 0",
            'y' => "0 1 0",
            _ => "0 0 1",
        };
        self.0 += &format!(
            "<joint name=\"{name}\" type=\"revolute\">\
             <origin xyz=\"{:.6} {:.6} {:.6}\" rpy=\"{:.6} {:.6} {:.6}\"/>\
             <parent link=\"{parent}\"/><child link=\"{child}\"/><axis xyz=\"{axis}\"/>{rest}</joint>\n",
            at[0], at[1], at[2], angles[0], angles[1], angles[2]
        );
    }

    /// A chain of links from `parent`; returns the last.
    fn chain(
        &mut self,
        side: &str,
        parent: &str,
        links: &[(&str, char, [f64; 3], f64, f64)],
    ) -> String {
        let limit = r#"<limit lower="-1.2" upper="1.2" velocity="4" effort="80"/>"#;
        let mut parent = parent.to_string();
        for &(name, axis, at, m, l) in links {
            let child = format!("{side}{name}");
            self.link(&child, m, l);
            let joint = format!("{child}_joint");
            self.joint(&joint, [&parent, &child], at, [0.0; 3], axis, limit);
            parent = child;
        }
        parent
    }
}

/// 33 joints: legs, waist, neck, arms and two hands whose four fingers of two phalanges (a gram
/// or ten each) follow one joint. Numbers printed with six decimals.
fn humanoid() -> String {
    let mut b = Builder(String::from(
        "<robot name=\"humanoid\">\n<link name=\"pelvis\"/>\n",
    ));
    for (side, y) in [("left_", 1.0), ("right_", -1.0)] {
        let leg = [
            ("hip_roll", 'x', [0.0, 0.1 * y, -0.02], 1.2, 0.08),
            ("hip_yaw", 'z', [0.0, 0.0, -0.06], 1.5, 0.1),
            ("hip_pitch", 'y', [0.0, 0.0, -0.05], 5.2, 0.36),
            ("knee", 'y', [0.0, 0.0, -0.36], 2.8, 0.34),
            ("ankle_pitch", 'y', [0.0, 0.0, -0.34], 0.3, 0.04),
            ("ankle_roll", 'x', [0.0; 3], 0.9, 0.12),
        ];
        b.chain(side, "pelvis", &leg);
    }
    let waist = [
        ("waist_yaw", 'z', [0.0, 0.0, 0.05], 1.1, 0.08),
        ("waist_pitch", 'y', [0.0, 0.0, 0.06], 0.7, 0.06),
        ("waist_roll", 'x', [0.0, 0.0, 0.01], 9.5, 0.4),
    ];
    let chest = b.chain("", "pelvis", &waist);
    let neck = [
        ("neck_yaw", 'z', [0.0, 0.0, 0.38], 0.3, 0.05),
        ("neck_pitch", 'y', [0.0, 0.0, 0.05], 1.4, 0.18),
    ];
    b.chain("", &chest, &neck);
    for (side, y) in [("left_", 1.0), ("right_", -1.0)] {
        let arm = [
            ("shoulder_pitch", 'y', [0.0, 0.16 * y, 0.3], 0.9, 0.08),
            ("shoulder_roll", 'x', [0.0, 0.05 * y, 0.0], 1.0, 0.08),
            ("shoulder_yaw", 'z', [0.0, 0.0, -0.1], 1.1, 0.15),
            ("elbow", 'y', [0.0, 0.0, -0.14], 0.7, 0.1),
            ("wrist_yaw", 'z', [0.0, 0.0, -0.1], 0.6, 0.12),
            ("wrist_roll", 'x', [0.0, 0.0, -0.13], 0.05, 0.02),
            ("wrist_pitch", 'y', [0.0; 3], 0.5, 0.09),
        ];
        let hand = b.chain(side, &chest, &arm);
        for i in 0..4 {
            let mut parent = hand.clone();
            let n = i as f64;
            for k in 0..2 {
                let child = format!("{side}finger{i}_{k}");
                let l = 0.04 - 0.003 * n - 0.008 * k as f64;
                b.link(&child, 0.012 - 0.001 * n - 0.003 * k as f64, l);
                let (at, angles) = match k {
                    0 => (
                        [0.02 * (n - 1.5), 0.01 * y, -0.09],
                        [0.1, 0.25 * n - 0.4, 0.15 * n * y],
                    ),
                    _ => ([0.0, 0.0, -(l + 0.01)], [0.0; 3]),
                };
                let limit = r#"<limit lower="0" upper="1" velocity="3" effort="2"/>"#;
                let leader = format!("{side}hand_joint");
                let (name, rest) = match (i, k) {
                    (0, 0) => (leader, limit.to_string()),
                    _ => (
                        format!("{child}_joint"),
                        format!("{limit}<mimic joint=\"{leader}\"/>"),
                    ),
                };
                b.joint(&name, [&parent, &child], at, angles, 'y', &rest);
                parent = child;
            }
        }
    }
    b.0 + "</robot>"
}

fn robot(text: &str) -> Robot {
    Robot::from_urdf_str(text, "test.urdf").unwrap()
}

/// 38 before: two parameters that only `-5.24e-08` and `1.5708` made. An independent program
/// (Pinocchio's regressor and numpy's singular values) finds 36 for the exact numbers, and for the
/// printed ones singular values of 3e-2, then 2e-7.
#[test]
fn no_parameter_exists_by_rounding() {
    let printed = BaseParameters::new(&robot(&hobby_arm(Numbers::Printed))).unwrap();
    let exact = BaseParameters::new(&robot(&hobby_arm(Numbers::Exact))).unwrap();
    assert_eq!(exact.count(), 36);
    assert_eq!(printed.count(), 36);
    assert_eq!(printed.kept, exact.kept);
    for a in 0..36 {
        for d in 0..exact.dropped.len() {
            let (x, y) = (printed.k[(a, d)], exact.k[(a, d)]);
            assert!((x - y).abs() < 1e-6, "{} {x} {y}", printed.name(a));
        }
    }
    for base in [&printed, &exact] {
        assert!(
            base.singular_value_above > 1e-3,
            "{}",
            base.singular_value_above
        );
        assert!(
            base.singular_value_below < 1e-12,
            "{}",
            base.singular_value_below
        );
        assert!(base.rank_gap > 1e9 && base.warnings.is_empty());
    }
}

/// The dynamics stay as written: only the rank looks at what is meant.
#[test]
fn what_is_meant_does_not_change_the_dynamics() {
    let printed = robot(&hobby_arm(Numbers::Printed));
    let exact = robot(&hobby_arm(Numbers::Exact));
    let upper = |r: &Robot| r.bodies[1].rotation;
    assert_ne!(upper(&printed), upper(&exact));
    let meant = printed.as_meant().expect("something is rounded");
    for (a, b) in meant.bodies.iter().zip(&exact.bodies) {
        assert!((a.rotation - b.rotation).amax() < 1e-15, "{}", a.name);
        assert_eq!(a.position, b.position, "{}", a.name);
    }
    assert!(exact.as_meant().is_none());
    for bundled in excite::robot::bundled::list() {
        assert!(
            bundled.load().unwrap().as_meant().is_none(),
            "{}",
            bundled.name
        );
    }
}

/// The design of the printed arm was spent on the two: condition number 671226 instead of 5.4.
#[test]
fn a_rounded_arm_is_excited_as_well_as_an_exact_one() {
    let settings = Settings::default().with(|set| set.starts = Some(1));
    let condition = |numbers| {
        let robot = robot(&hobby_arm(numbers));
        let d = design(&Plant::from(robot.clone()), &settings).unwrap();
        d.value
    };
    let (printed, exact) = (condition(Numbers::Printed), condition(Numbers::Exact));
    assert!(exact < 20.0, "{exact}");
    assert!((printed / exact).ln().abs() < 0.4, "{printed} {exact}");
}

/// 301 before. An independent program finds 307, the smallest at 1.7e-7 of the largest, then 6e-16.
#[test]
fn no_parameter_is_lost_where_singular_values_fall_smoothly() {
    let robot = robot(&humanoid());
    assert_eq!(robot.dof(), 33);
    let base = BaseParameters::new(&robot).unwrap();
    assert_eq!(base.count(), 307);
    assert_eq!(base.kept.len(), 307);
    assert!(
        base.singular_value_above < 1e-5,
        "{}",
        base.singular_value_above
    );
    assert!(
        base.singular_value_below < 1e-14,
        "{}",
        base.singular_value_below
    );
    assert!(base.rank_gap > CLEAR && base.warnings.is_empty());
    // and the columns kept span all: every dropped one is made of them
    for d in 0..base.dropped.len() {
        for a in 0..base.count() {
            assert!(base.k[(a, d)].is_finite());
        }
    }
}

/// Both sides of the gap are shown.
#[test]
fn the_report_shows_both_sides_of_the_gap() {
    let assessment = assess(&Plant::from(robot(&hobby_arm(Numbers::Printed))), None).unwrap();
    let report = json::json(&assessment, None, 0.0);
    let border = &report["rank_border"];
    assert!(border["above"].as_f64().unwrap() > 1e-3, "{border}");
    assert!(border["below"].as_f64().unwrap() < 1e-12, "{border}");
    let page = page::html(&assessment, None);
    assert!(page.contains("the largest that does not is"), "no border");
    assert!(
        page.contains("q1 = shoulder_pan, q2 = shoulder_lift"),
        "no order"
    );
}

/// `3.14` is taken for pi, and the user is told.
#[test]
fn a_coarse_right_angle_is_reported() {
    let coarse = hobby_arm(Numbers::Printed)
        .replace("3.14159", "3.14")
        .replace("1.5708", "1.57");
    let robot = robot(&coarse);
    let warnings: Vec<String> = robot.warnings.iter().map(|w| w.to_string()).collect();
    let about = |joint: &str, text: &str| {
        warnings
            .iter()
            .any(|w| w.contains(&format!("`{joint}`")) && w.contains(text))
    };
    assert!(about("wrist_roll", "3.14, taken for pi"), "{warnings:?}");
    assert!(
        about("shoulder_lift", "-1.57, taken for -pi/2"),
        "{warnings:?}"
    );
    assert!(about("wrist_roll", "line "), "{warnings:?}");
    assert_eq!(BaseParameters::new(&robot).unwrap().count(), 36);
    let printed = self::robot(&hobby_arm(Numbers::Printed));
    assert!(
        !printed
            .warnings
            .iter()
            .any(|w| w.message.contains("taken for"))
    );
}

/// A real tilt of the first axis against gravity, larger than any rounding, keeps what it makes
/// identifiable.
#[test]
fn a_real_tilt_counts() {
    let tilted = hobby_arm(Numbers::Exact).replace(
        "rpy=\"3.141592653589793 0.0 -3.141592653589793\"",
        "rpy=\"3.141592653589793 0.002 -3.141592653589793\"",
    );
    assert_ne!(tilted, hobby_arm(Numbers::Exact));
    assert_eq!(BaseParameters::new(&robot(&tilted)).unwrap().count(), 38);
}

/// From the base to the tip, whatever the order in the file.
#[test]
fn joints_are_numbered_from_base_to_tip() {
    let robot = robot(&hobby_arm(Numbers::Printed));
    let order = [
        "shoulder_pan",
        "shoulder_lift",
        "elbow_flex",
        "wrist_flex",
        "wrist_roll",
        "gripper",
    ];
    assert_eq!(robot.joint_names(), order);
    for (body, joint) in robot.bodies.iter().zip(&robot.joints) {
        assert_eq!(body.joint_name, joint.name);
    }
    // branches in the order of the file, one to its end before the next
    let names = self::robot(&humanoid()).joint_names();
    let at = |name: &str| names.iter().position(|n| n == name).unwrap();
    assert_eq!(at("left_hip_roll_joint"), 0);
    assert_eq!(at("left_ankle_roll_joint"), 5);
    assert_eq!(at("right_hip_roll_joint"), 6);
    assert_eq!(at("neck_yaw_joint"), 15);
    assert_eq!(at("left_hand_joint"), 24);
    assert_eq!(at("right_hand_joint"), 32);
}
