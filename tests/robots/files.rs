//! Robot files: every bad one ends in one message that says where and what to do.

mod toml;
mod urdf;

use excite::robot::parts::JointTerm;
use excite::robot::parts::Prior;
use excite::{Error, Robot};
use proptest::prelude::*;

const BAR: &str = r#"<inertial><mass value="2"/><inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial>"#;

/// A two-joint arm with one line per element; `edit` changes its text.
fn arm(edit: impl Fn(String) -> String) -> String {
    edit(format!(
        r#"<?xml version="1.0"?>
<robot name="arm">
<link name="base"/>
<link name="upper">{BAR}</link>
<link name="lower">{BAR}</link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="3" effort="40"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 0.4"/><axis xyz="0 1 0"/><limit lower="-1" upper="2.5" velocity="4" effort="20"/></joint>
</robot>
"#
    ))
}

fn replaced(from: &str, to: &str) -> String {
    arm(|text| {
        assert!(text.contains(from), "the test replaces nothing: {from}");
        text.replacen(from, to, 1)
    })
}

fn urdf_error(text: &str) -> String {
    match Robot::from_urdf_str(text, "arm.urdf") {
        Ok(_) => panic!("accepted:\n{text}"),
        Err(e) => {
            assert!(!e.is_argument());
            e.to_string()
        }
    }
}

#[track_caller]
fn contains_all(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
    assert!(!message.contains('\n'), "more than one line: {message}");
}

/// `links` links in a row, joined by joints of this type.
fn chain(links: usize, kind: &str) -> String {
    chain_with(links, kind, |_| String::new())
}

/// The same with more in each joint; the first is always revolute.
fn chain_with(links: usize, kind: &str, more: impl Fn(usize) -> String) -> String {
    let mut text = String::from("<robot name=\"chain\"><link name=\"l0\"/>\n");
    for i in 1..links {
        let (parent, more) = (i - 1, more(i));
        let kind = if i == 1 { "revolute" } else { kind };
        text += &format!(
            r#"<link name="l{i}"><inertial><mass value="1"/></inertial></link><joint name="j{i}" type="{kind}"><parent link="l{parent}"/><child link="l{i}"/><origin xyz="0 0 0.001"/>{more}</joint>
"#
        );
    }
    text + "</robot>"
}

#[test]
fn long_chains_neither_overflow_nor_are_accepted_silently() {
    assert_eq!(
        Robot::from_urdf_str(&chain(129, "revolute"), "c")
            .unwrap()
            .dof(),
        128
    );
    contains_all(
        &urdf_error(&chain(301, "revolute")),
        &["300 joints move", "128", "lock"],
    );
    contains_all(
        &urdf_error(&chain(100_000, "revolute")),
        &["99999 joints move"],
    );
    let merged = Robot::from_urdf_str(&chain(100_000, "fixed"), "c").unwrap();
    assert_eq!(merged.bodies.len(), 1);
    assert_eq!(merged.bodies[0].merged.len(), 99_998);
    assert!((merged.bodies[0].inertia.mass() - 99_999.0).abs() < 1e-6);
    // every joint follows the next one: resolved from the far end
    let mimics = chain_with(100_000, "revolute", |i| match i {
        99_999 => String::new(),
        _ => format!("<mimic joint=\"j{}\"/>", i + 1),
    });
    contains_all(&urdf_error(&mimics), &["99999 joints move"]);
    let deep = format!("<robot name=\"d\">{}", "<a>".repeat(50_000));
    contains_all(&urdf_error(&deep), &["malformed XML"]);
    let deep = format!(
        "<robot name=\"d\">{}{}</robot>",
        "<a>".repeat(50_000),
        "</a>".repeat(50_000)
    );
    contains_all(&urdf_error(&deep), &["no <link>"]);
}

const TOML: &str = r#"name = "test arm"
urdf = "arm.urdf"
gravity = [0, 9.81, 0.0]
prior = "identified"

[[joint]]
name = "elbow"
position = [-0.5, 1.5]
velocity = 1
acceleration = 15.0
jerk = 7500.0
effort = 87.0
torque_noise = 0.08
position_resolution = 2.4e-5
gear_ratio = 100
armature = 0.1
viscous = 0.2
coulomb = 0.3
offset = -0.4
identify = ["offset", "viscous"]
"#;

#[test]
fn loading_tells_files_bundled_names_and_nothing_apart() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).to_str().unwrap().to_string();
    let write = |name: &str, bytes: &[u8]| std::fs::write(dir.path().join(name), bytes).unwrap();
    let error = |spec: &str| Robot::load(spec).map(|r| r.name).unwrap_err();
    write("arm.urdf", arm(|t| t).as_bytes());
    write("robot.toml", TOML.as_bytes());

    let robot = Robot::load(&at("robot.toml")).unwrap();
    assert_eq!(
        robot.path.as_deref(),
        Some(dir.path().join("robot.toml").as_path())
    );
    let both = Robot::from_toml_str(TOML, &arm(|t| t), "robot.toml").unwrap();
    assert_eq!(robot.hash, both.hash);
    let bare = Robot::load(&at("arm.urdf")).unwrap();
    assert_ne!(bare.hash, robot.hash);
    assert_eq!(bare.name, "arm");
    assert_eq!(Robot::load("panda").unwrap().dof(), 7);

    write(
        "nameless.urdf",
        arm(|t| t.replace("<robot name=\"arm\">", "<robot>")).as_bytes(),
    );
    assert_eq!(Robot::load(&at("nameless.urdf")).unwrap().name, "nameless");
    write("pipe", arm(|t| t).as_bytes());
    assert_eq!(Robot::load(&at("pipe")).unwrap().dof(), 2);

    let e = error("pnada");
    assert!(e.is_argument());
    contains_all(
        &e.to_string(),
        &["`pnada`", "neither", "did you mean `panda`", "ur10e"],
    );
    assert!(!error("something_else").to_string().contains("did you mean"));
    assert!(error("").is_argument());
    assert!(matches!(error("absent.urdf"), Error::Io { .. }));
    assert!(matches!(error(&at("absent")), Error::Io { .. }));
    assert!(error("a\0b").is_argument());
    contains_all(&error(&at("")).to_string(), &["directory", "robot.toml"]);

    write("no_urdf.toml", b"name = \"x\"\n");
    contains_all(
        &error(&at("no_urdf.toml")).to_string(),
        &["no_urdf.toml", "names no URDF"],
    );
    write("lost.toml", b"\nurdf = \"lost.urdf\"\n");
    contains_all(
        &error(&at("lost.toml")).to_string(),
        &["line 2", "lost.urdf", "relative"],
    );
    write("dir.toml", b"urdf = \".\"\n");
    contains_all(
        &error(&at("dir.toml")).to_string(),
        &["line 1", "is a directory"],
    );
    write("latin.urdf", b"<robot name=\"r\">\n<!-- \xe9 -->");
    contains_all(&error(&at("latin.urdf")).to_string(), &["line 2", "UTF-8"]);
    write("notes.txt", b"hello");
    contains_all(&error(&at("notes.txt")).to_string(), &[".toml or .urdf"]);
    let huge = std::fs::File::create(dir.path().join("huge.urdf")).unwrap();
    huge.set_len(65 << 20).unwrap();
    contains_all(
        &error(&at("huge.urdf")).to_string(),
        &["huge.urdf", "64 MiB"],
    );
}

/// What stands around the robot is in the file that is written, whoever wrote the first one.
#[test]
fn the_template_keeps_the_surroundings() {
    let text = "[collision]\nfloor = true\nmargin = 0.01\nignore = [[\"forearm_link\", \"table\"]]\n\
        [[obstacle]]\nname = \"table\"\nkind = \"plane\"\nnormal = [0, 0, 1]\noffset = -0.123456789\n\
        [[obstacle]]\nname = \"post\"\nkind = \"capsule\"\nfrom = [1, 0, 0]\nto = [1, 0, 2.00001]\nradius = 0.05\n\
        [[obstacle]]\nname = \"bin\"\nkind = \"box\"\nsize = [0.3, 0.2, 0.1]\npose = [0, 1, 0.5, 0.1, 0.2, 0.3]\n\
        [[keep_in]]\nframe = \"wrist_3_link\"\nlow = [-inf, -1, 0.1]\nhigh = [inf, 1, 2]\n";
    let urdf = arm(|t| t);
    let last = Robot::from_urdf_str(&urdf, "arm.urdf").unwrap();
    let [first, tip] = [0, last.bodies.len() - 1].map(|b| last.bodies[b].name.clone());
    let text = text
        .replace("forearm_link", &first)
        .replace("wrist_3_link", &tip);
    let robot =
        Robot::from_toml_str(&format!("urdf = \"arm.urdf\"\n{text}"), &urdf, "a.toml").unwrap();
    let template = robot.to_toml_template("arm.urdf");
    let again = Robot::from_toml_str(&template, &urdf, "b.toml").unwrap();
    let (a, b) = (&robot.geometry, &again.geometry);
    assert_eq!(a.keep_in, b.keep_in, "{template}");
    assert_eq!(a.ignore, b.ignore);
    assert_eq!([a.floor, Some(true)], [b.floor, Some(true)]);
    assert_eq!(a.obstacles.len(), b.obstacles.len());
    for (x, y) in a.obstacles.iter().zip(&b.obstacles) {
        assert_eq!(x.name(), y.name());
        // angles go through a rotation and back
        let round = |o| format!("{o:.12?}");
        assert_eq!(round(x), round(y));
    }
}

#[test]
fn the_template_gives_the_same_robot() {
    let warned = arm(|t| {
        t.replace("velocity=\"3\"", "velocity=\"0\"").replace(
            "\"elbow\" type=\"revolute\"",
            "\"elbow\" type=\"prismatic\"",
        )
    });
    for (robot, urdf) in [
        (
            Robot::from_toml_str(TOML, &arm(|t| t), "robot.toml").unwrap(),
            arm(|t| t),
        ),
        (Robot::from_urdf_str(&warned, "arm.urdf").unwrap(), warned),
    ] {
        let template = robot.to_toml_template("arm \"1\".urdf");
        let again = Robot::from_toml_str(&template, &urdf, "robot.toml").unwrap();
        assert_eq!(again.name, robot.name);
        assert_eq!(again.gravity, robot.gravity);
        assert_eq!(again.prior, robot.prior);
        for (a, b) in again.joints.iter().zip(&robot.joints) {
            assert_eq!(format!("{a:?}"), format!("{b:?}"));
        }
        for joint in &robot.joints {
            assert!(template.contains(&format!("name = \"{}\"", joint.name)));
        }
        for key in [
            "lock",
            "torque_noise",
            "position_resolution",
            "gear_ratio",
            "jerk",
        ] {
            assert!(template.contains(key), "{key}");
        }
        for term in JointTerm::ALL {
            assert!(template.contains(&format!("{} = ", term.name())));
        }
    }
}

/// Any robot that is accepted has only finite numbers in its model.
fn check(result: excite::Result<Robot>) {
    if let Ok(robot) = result {
        assert!(!robot.joints.is_empty());
        for (i, body) in robot.bodies.iter().enumerate() {
            assert!(
                body.inertia
                    .0
                    .iter()
                    .chain(&body.position)
                    .all(|x| x.is_finite())
            );
            assert!((body.axis.norm() - 1.0).abs() < 1e-12);
            assert!(body.parent.is_none_or(|p| p < i));
            assert!(body.coordinate < robot.joints.len());
        }
        for joint in &robot.joints {
            assert!(joint.limits.position[0] < joint.limits.position[1]);
            assert!(joint.limits.velocity > 0.0 && joint.limits.effort > 0.0);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn damaged_files_never_panic(
        which in 0usize..3,
        cut in 0.0f64..1.0,
        flips in prop::collection::vec((0.0f64..1.0, any::<u8>()), 0..6),
        truncate in any::<bool>(),
    ) {
        let damage = |text: &str| {
            let mut bytes = text.as_bytes().to_vec();
            for (at, value) in &flips {
                let i = (at * bytes.len() as f64) as usize;
                bytes[i] = *value;
            }
            if truncate {
                bytes.truncate((cut * bytes.len() as f64) as usize);
            }
            String::from_utf8_lossy(&bytes).into_owned()
        };
        let (urdf, toml) = (arm(|t| t), TOML);
        match which {
            0 => check(Robot::from_urdf_str(&damage(&urdf), "damaged.urdf")),
            1 => check(Robot::from_toml_str(&damage(toml), &urdf, "damaged.toml")),
            _ => check(Robot::from_toml_str(toml, &damage(&urdf), "robot.toml")),
        }
    }

    #[test]
    fn garbage_never_panics(text in ".{0,200}", toml in "[a-z_=\\[\\]\"{}., 0-9\n-]{0,120}") {
        check(Robot::from_urdf_str(&text, "garbage.urdf"));
        check(Robot::from_toml_str(&text, &arm(|t| t), "garbage.toml"));
        check(Robot::from_toml_str(&toml, &arm(|t| t), "garbage.toml"));
        let unknown = Robot::load(&format!("no such robot {text}")).is_err();
        prop_assert!(unknown);
    }

    #[test]
    fn random_numbers_never_panic(
        values in prop::collection::vec(prop::num::f64::ANY, 12),
        multiplier in prop::num::f64::NORMAL | prop::num::f64::ZERO,
    ) {
        let v = |i: usize| values[i].to_string();
        let text = arm(|t| t
            .replacen("0 0 0.4", &format!("{} {} {}\" rpy=\"{} 0 {}", v(0), v(1), v(2), v(3), v(4)), 1)
            .replacen("xyz=\"0 1 0\"", &format!("xyz=\"{} {} {}\"", v(5), v(6), v(7)), 1)
            .replacen("value=\"2\"", &format!("value=\"{}\"", v(8)), 1)
            .replacen("ixx=\"0.02\"", &format!("ixx=\"{}\"", v(9)), 1)
            .replacen("lower=\"-2\"", &format!("lower=\"{}\"", v(10)), 1)
            .replacen("velocity=\"3\"", &format!("velocity=\"{}\"", v(11)), 1)
            .replacen("<child link=\"lower\"/>", &format!("<child link=\"lower\"/><mimic joint=\"shoulder\" multiplier=\"{multiplier}\"/>"), 1));
        check(Robot::from_urdf_str(&text, "numbers.urdf"));
    }
}
