//! From links and joints to moving bodies: merging, locking, mimics, order; the bundled robots.

mod arms;

use excite::Robot;
use excite::robot::parts::Motion;
use excite::robot::{Inertia, bundled};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::{FRAC_PI_2, PI};

fn inertial(mass: f64, com: [f64; 3], rpy: [f64; 3], d: [f64; 3]) -> String {
    format!(
        r#"<inertial><origin xyz="{} {} {}" rpy="{} {} {}"/><mass value="{mass}"/><inertia ixx="{}" ixy="0" ixz="0" iyy="{}" iyz="0" izz="{}"/></inertial>"#,
        com[0], com[1], com[2], rpy[0], rpy[1], rpy[2], d[0], d[1], d[2]
    )
}

fn joint(name: &str, kind: &str, parent: &str, child: &str, rest: &str) -> String {
    let limit = match kind {
        "fixed" => "",
        "continuous" => r#"<limit velocity="2" effort="10"/>"#,
        _ => r#"<limit lower="-1" upper="2" velocity="2" effort="10"/>"#,
    };
    format!(
        r#"<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{rest}{limit}</joint>"#
    )
}

fn robot(parts: &[String]) -> Robot {
    let text = format!("<robot name=\"r\">{}</robot>", parts.concat());
    Robot::from_urdf_str(&text, "r.urdf").unwrap()
}

fn with_toml(toml: &str, parts: &[String]) -> Robot {
    let text = format!("<robot name=\"r\">{}</robot>", parts.concat());
    Robot::from_toml_str(toml, &text, "robot.toml").unwrap()
}

fn link(name: &str, inertial: &str) -> String {
    format!("<link name=\"{name}\">{inertial}</link>")
}

/// A link of 1 kg that nothing is wrong with.
fn plain(name: &str) -> String {
    link(name, &inertial(1.0, [0.0; 3], [0.0; 3], [0.01; 3]))
}

#[track_caller]
fn close(a: &[f64], b: &[f64]) {
    assert_eq!(a.len(), b.len());
    let scale = b.iter().fold(1.0f64, |s, x| s.max(x.abs()));
    for (x, y) in a.iter().zip(b) {
        assert!((x - y).abs() <= 1e-12 * scale, "{a:?} is not {b:?}");
    }
}

#[test]
fn fixed_links_add_their_inertia_by_hand_calculation() {
    // a point of 2 kg and one of 3 kg; the second sits at (0, 0, 0.5) turned by 90° about x, its
    // mass 0.2 along its own z, which is -y of the first link
    let r = robot(&[
        link("base", ""),
        link("arm", &inertial(2.0, [0.1, 0.0, 0.0], [0.0; 3], [0.0; 3])),
        link("tool", &inertial(3.0, [0.0, 0.0, 0.2], [0.0; 3], [0.0; 3])),
        link("tip", ""),
        joint("j", "revolute", "base", "arm", r#"<axis xyz="0 0 2"/>"#),
        joint(
            "f",
            "fixed",
            "arm",
            "tool",
            &format!(r#"<origin xyz="0 0 0.5" rpy="{FRAC_PI_2} 0 0"/>"#),
        ),
        joint("g", "fixed", "tool", "tip", ""),
    ]);
    assert_eq!(r.bodies.len(), 1);
    assert_eq!(r.bodies[0].merged, ["tool", "tip"]);
    let (x, y, z): (f64, f64, f64) = (0.1, -0.2, 0.5);
    close(
        &r.bodies[0].inertia.0,
        &[
            5.0,
            2.0 * x,
            3.0 * y,
            3.0 * z,
            3.0 * (y * y + z * z),
            0.0,
            0.0,
            2.0 * x * x + 3.0 * z * z,
            -3.0 * y * z,
            2.0 * x * x + 3.0 * y * y,
        ],
    );
    assert_eq!(r.bodies[0].axis, Vector3::z());
}

#[test]
fn rotated_inertial_frames_are_turned_into_link_axes() {
    let r = robot(&[
        link("base", ""),
        link(
            "arm",
            &inertial(
                2.0,
                [0.0, 0.3, 0.0],
                [0.0, 0.0, FRAC_PI_2],
                [0.03, 0.04, 0.05],
            ),
        ),
        joint("j", "revolute", "base", "arm", ""),
    ]);
    close(
        &r.bodies[0].inertia.0,
        &[
            2.0,
            0.0,
            0.6,
            0.0,
            0.04 + 0.18,
            0.0,
            0.0,
            0.03,
            0.0,
            0.05 + 0.18,
        ],
    );
    // URDF's default axis
    assert_eq!(r.bodies[0].axis, Vector3::x());
    // roll, pitch, yaw: Rz(y) Ry(p) Rx(r)
    let (a, b, c): (f64, f64, f64) = (0.3, -0.8, 1.1);
    let rx = Matrix3::new(1.0, 0.0, 0.0, 0.0, a.cos(), -a.sin(), 0.0, a.sin(), a.cos());
    let ry = Matrix3::new(b.cos(), 0.0, b.sin(), 0.0, 1.0, 0.0, -b.sin(), 0.0, b.cos());
    let rz = Matrix3::new(c.cos(), -c.sin(), 0.0, c.sin(), c.cos(), 0.0, 0.0, 0.0, 1.0);
    let r = robot(&[
        plain("base"),
        plain("arm"),
        joint(
            "j",
            "revolute",
            "base",
            "arm",
            &format!(r#"<origin rpy="{a} {b} {c}"/>"#),
        ),
    ]);
    close(r.bodies[0].rotation.as_slice(), (rz * ry * rx).as_slice());
}

#[test]
fn fixed_links_before_the_first_joint_only_move_it() {
    let r = robot(&[
        plain("world"),
        plain("stand"),
        plain("arm"),
        joint(
            "mount",
            "fixed",
            "world",
            "stand",
            &format!(r#"<origin xyz="1 2 3" rpy="0 0 {FRAC_PI_2}"/>"#),
        ),
        joint(
            "j",
            "prismatic",
            "stand",
            "arm",
            r#"<origin xyz="0.5 0 0"/><axis xyz="3 0 4"/>"#,
        ),
    ]);
    assert_eq!(r.bodies[0].parent, None);
    close(r.bodies[0].position.as_slice(), &[1.0, 2.5, 3.0]);
    close(r.bodies[0].axis.as_slice(), &[0.6, 0.0, 0.8]);
    assert_eq!(r.bodies[0].inertia.mass(), 1.0);
    assert_eq!(r.joints[0].motion, Motion::Prismatic);
    assert!(r.warnings.is_empty());
}

#[test]
fn coordinates_and_bodies_go_from_the_base_to_the_tips() {
    // the file lists the joints of a branched tree from the tips to the base
    let r = robot(&[
        plain("c"),
        plain("b2"),
        plain("b"),
        plain("a"),
        plain("base"),
        joint("tip", "revolute", "b", "c", ""),
        joint("branch", "continuous", "a", "b2", ""),
        joint("middle", "prismatic", "a", "b", ""),
        joint("first", "revolute", "base", "a", ""),
    ]);
    assert_eq!(r.joint_names(), ["first", "branch", "middle", "tip"]);
    let bodies: Vec<_> = r
        .bodies
        .iter()
        .map(|b| (b.name.as_str(), b.parent, b.coordinate))
        .collect();
    assert_eq!(
        bodies,
        [
            ("a", None, 0),
            ("b2", Some(0), 1),
            ("b", Some(0), 2),
            ("c", Some(2), 3)
        ]
    );
    assert!(
        r.joints[1].continuous && r.joints[1].limits.position == [f64::NEG_INFINITY, f64::INFINITY]
    );
    assert!(!r.joints[0].continuous);
}

#[test]
fn mimic_joints_follow_through_chains() {
    let mimic = |joint: &str, ratio: f64, offset: f64, rest: &str| {
        format!(r#"<mimic joint="{joint}" multiplier="{ratio}" offset="{offset}"/>{rest}"#)
    };
    let r = robot(&[
        plain("base"),
        plain("a"),
        plain("b"),
        plain("c"),
        plain("d"),
        // the last of the chain comes first in the file
        joint(
            "third",
            "prismatic",
            "b",
            "c",
            &mimic("second", -0.5, 0.1, ""),
        ),
        joint(
            "second",
            "revolute",
            "a",
            "b",
            &mimic(
                "lead",
                2.0,
                0.3,
                r#"<dynamics damping="0.5" friction="0.2"/>"#,
            ),
        ),
        joint(
            "lead",
            "revolute",
            "base",
            "a",
            r#"<dynamics damping="1" friction="0.1"/>"#,
        ),
        joint("other", "revolute", "base", "d", ""),
    ]);
    assert_eq!(r.joint_names(), ["lead", "other"]);
    let find = |name: &str| r.bodies.iter().find(|b| b.joint_name == name).unwrap();
    assert_eq!(
        (
            find("second").coordinate,
            find("second").ratio,
            find("second").offset
        ),
        (0, 2.0, 0.3)
    );
    close(&[find("third").ratio, find("third").offset], &[-1.0, -0.05]);
    assert_eq!(find("third").motion, Motion::Prismatic);
    assert_eq!(
        (
            find("other").coordinate,
            find("other").ratio,
            find("other").offset
        ),
        (1, 1.0, 0.0)
    );
    // work of the followers' friction: viscous 1 + 2² · 0.5, Coulomb 0.1 + 2 · 0.2
    close(&r.joints[0].terms, &[0.0, 3.0, 0.5, 0.0]);
    assert_eq!(r.joints[0].identify, [false; 4]);
    // -1 ≤ 2 q + 0.3 ≤ 2 and |2 q̇| ≤ 2 bind the coordinate
    close(&r.joints[0].limits.position, &[-0.65, 0.85]);
    assert_eq!(r.joints[0].limits.velocity, 1.0);
    assert!(r.warnings.is_empty(), "{:?}", r.warnings);
}

#[test]
fn limits_of_followers_yield_to_what_is_stated() {
    let follower = |ratio: f64| {
        [
            plain("base"),
            plain("a"),
            plain("b"),
            joint("lead", "revolute", "base", "a", ""),
            joint(
                "follow",
                "revolute",
                "a",
                "b",
                &format!(r#"<mimic joint="lead" multiplier="{ratio}" offset="9"/>"#),
            ),
        ]
    };
    let toml = "urdf = \"r.urdf\"\n[[joint]]\nname = \"lead\"\nposition = [-3, 3]\nvelocity = 5\n";
    let r = with_toml(toml, &follower(2.0));
    assert_eq!(r.joints[0].limits.position, [-3.0, 3.0]);
    assert_eq!(r.joints[0].limits.velocity, 5.0);
    assert!(r.warnings.is_empty());
    // -1 ≤ 2 q + 9 ≤ 2 leaves nothing of -1 ≤ q ≤ 2
    let r = robot(&follower(2.0));
    assert_eq!(r.joints[0].limits.position, [-1.0, 2.0]);
    assert!(
        r.warnings[0].message.contains("contradict"),
        "{:?}",
        r.warnings
    );
    // a follower that cannot move is held
    let r = robot(&follower(0.0));
    assert_eq!(r.bodies.len(), 1);
    assert!(
        r.warnings[0].message.contains("held at 9"),
        "{:?}",
        r.warnings
    );
}

#[test]
fn locked_joints_merge_at_their_position_and_take_followers_along() {
    let parts = [
        plain("base"),
        plain("a"),
        link("b", &inertial(2.0, [0.0; 3], [0.0; 3], [0.01, 0.02, 0.03])),
        link("c", &inertial(3.0, [0.0; 3], [0.0; 3], [0.01, 0.02, 0.03])),
        plain("d"),
        joint("j1", "revolute", "base", "a", r#"<axis xyz="0 0 1"/>"#),
        joint(
            "j2",
            "revolute",
            "a",
            "b",
            r#"<origin xyz="1 0 0"/><axis xyz="0 0 1"/>"#,
        ),
        joint(
            "j3",
            "prismatic",
            "b",
            "c",
            r#"<mimic joint="j2" multiplier="0.5" offset="0.1"/><axis xyz="1 0 0"/>"#,
        ),
        joint(
            "j4",
            "revolute",
            "c",
            "d",
            r#"<origin xyz="0.2 0 0"/><axis xyz="0 1 0"/>"#,
        ),
    ];
    let q = FRAC_PI_2;
    let r = with_toml(
        &format!("urdf = \"r.urdf\"\nlock = {{ j2 = {q} }}\n[[joint]]\nname = \"j2\"\n"),
        &parts,
    );
    assert_eq!(r.joint_names(), ["j1", "j4"]);
    assert_eq!(r.bodies[0].merged, ["b", "c"]);
    // b sits at (1, 0, 0) turned by 90° about z; c is 0.5 q + 0.1 further along its x, i.e. our y
    let y = 0.5 * q + 0.1;
    let quarter = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let d = Matrix3::from_diagonal(&Vector3::new(0.02, 0.01, 0.03));
    let expected = Inertia::from_com(1.0, Vector3::zeros(), Matrix3::identity() * 0.01)
        + Inertia::from_com(2.0, Vector3::new(1.0, 0.0, 0.0), d)
        + Inertia::from_com(3.0, Vector3::new(1.0, y, 0.0), d);
    close(&r.bodies[0].inertia.0, &expected.0);
    assert_eq!(r.bodies[1].parent, Some(0));
    close(r.bodies[1].position.as_slice(), &[1.0, y + 0.2, 0.0]);
    close(r.bodies[1].rotation.as_slice(), quarter.as_slice());
    let said: Vec<String> = r.warnings.iter().map(|w| w.to_string()).collect();
    assert!(
        said.iter()
            .any(|w| w.contains("`j3`") && w.contains("held at")),
        "{said:?}"
    );
    // what is stated of a locked joint waits for its return, and is no matter for a warning
    assert!(
        !said.iter().any(|w| w.starts_with("joint `j2`")),
        "{said:?}"
    );

    let far = with_toml("urdf = \"r.urdf\"\nlock = { j4 = 3.0 }\n", &parts);
    assert!(
        far.warnings
            .iter()
            .any(|w| w.message.contains("outside its limits"))
    );
    let floating = |lock: &str| {
        let mut parts = parts.to_vec();
        parts[8] = parts[8].replace("\"revolute\"", "\"floating\"");
        let text = format!("<robot name=\"r\">{}</robot>", parts.concat());
        Robot::from_toml_str(
            &format!("urdf = \"r.urdf\"\nlock = {lock}\n"),
            &text,
            "robot.toml",
        )
    };
    assert_eq!(floating("{ j4 = 0.0 }").unwrap().dof(), 2);
    assert!(
        floating("{ j4 = 1.0 }")
            .unwrap_err()
            .to_string()
            .contains("only be locked at 0")
    );
}

#[test]
fn the_base_may_be_of_any_weight() {
    let with = |inertial: &str| {
        robot(&[
            link("base", inertial),
            plain("a"),
            joint("j", "revolute", "base", "a", ""),
        ])
    };
    let heavy = with(
        r#"<inertial><mass value="-3"/><inertia ixx="-1" ixy="0" ixz="0" iyy="5" iyz="0" izz="1"/></inertial>"#,
    );
    assert!(heavy.warnings.is_empty());
    assert_eq!(heavy.bodies[0].inertia, with("").bodies[0].inertia);
}
