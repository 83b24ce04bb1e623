//! URDF: mistakes with their line, and what is read all the same.

use super::*;

#[test]
fn the_unedited_arm_is_read_without_warning() {
    let robot = Robot::from_urdf_str(&arm(|t| t), "arm.urdf").unwrap();
    assert_eq!(robot.name, "arm");
    assert_eq!(robot.joint_names(), ["shoulder", "elbow"]);
    assert_eq!(robot.joints[1].limits.position, [-1.0, 2.5]);
    assert_eq!(robot.joints[0].limits.velocity, 3.0);
    assert_eq!(robot.joints[0].limits.effort, 40.0);
    assert!(robot.joints[0].limits.acceleration.is_infinite());
    assert_eq!(robot.gravity.as_slice(), [0.0, 0.0, -9.81]);
    assert_eq!(robot.prior, Prior::Cad);
    assert!(robot.warnings.is_empty(), "{:?}", robot.warnings);
    assert_eq!(robot.hash.len(), 64);
    assert!(robot.path.is_none());
}

#[test]
fn urdf_errors_say_where_and_what_to_do() {
    let limit = r#"<limit lower="-2" upper="2" velocity="3" effort="40"/>"#;
    let axis = r#"<axis xyz="0 1 0"/>"#;
    let mimic = |joint: &str| format!(r#"{axis}<mimic joint="{joint}"/>"#);
    let cases: Vec<(String, &[&str])> = vec![
        (String::new(), &["arm.urdf", "empty"]),
        (" \n ".into(), &["empty"]),
        ("hello".into(), &["not XML", "<robot"]),
        (
            "<sdf version=\"1.6\"/>".into(),
            &["line 1", "<robot>", "SDF", "convert"],
        ),
        ("<html></html>".into(), &["<html>", "<robot>"]),
        ("<robot name=\"r\"/>".into(), &["no <link>"]),
        (
            "<robot name=\"r\"><link name=\"a\"/></robot>".into(),
            &["no joint moves", "revolute"],
        ),
        (replaced("</robot>", ""), &["malformed XML", "breaks off"]),
        (
            "<robot name=\"r\">\n<link name=\"a\"/>\n<link name=\"b\"".into(),
            &["line 3", "malformed XML", "breaks off"],
        ),
        (
            replaced("<link name=\"upper\">", "<link name=upper>"),
            &["line 4", "malformed XML"],
        ),
        (
            replaced("<robot", "<!DOCTYPE robot [<!ENTITY a \"b\">]><robot"),
            &["DOCTYPE"],
        ),
        (
            replaced("<link name=\"base\"/>", "<xacro:macro name=\"m\"/>"),
            &["xacro", "xmlns"],
        ),
        (
            replaced(
                "<robot name=\"arm\">",
                "<robot name=\"arm\" xmlns:xacro=\"http://wiki.ros.org/xacro\"><xacro:property name=\"l\" value=\"1\"/>",
            ),
            &["line 2", "xacro"],
        ),
        (
            replaced("value=\"2\"", "value=\"${m}\""),
            &["line 4", "xacro"],
        ),
        (
            replaced("link name=\"base\"", "link"),
            &["line 3", "<link>", "`name`"],
        ),
        (
            replaced("name=\"lower\"", "name=\"upper\""),
            &["line 5", "link `upper`", "line 4", "rename"],
        ),
        (
            replaced("name=\"elbow\"", "name=\"shoulder\""),
            &["line 7", "joint `shoulder`", "rename"],
        ),
        (
            replaced("type=\"revolute\"", ""),
            &["line 6", "joint `shoulder`", "no `type`", "revolute"],
        ),
        (
            replaced("type=\"revolute\"", "type=\"hinge\""),
            &["`hinge`", "prismatic"],
        ),
        (
            replaced("\"revolute\"", "\"planar\""),
            &["`shoulder`", "planar", "lock"],
        ),
        (
            replaced("\"revolute\"", "\"floating\""),
            &["`shoulder`", "floating", "lock"],
        ),
        (
            replaced("<parent link=\"base\"/>", ""),
            &["`shoulder`", "no parent", "<parent link"],
        ),
        (
            replaced("<child link=\"lower\"/>", "<child/>"),
            &["`elbow`", "no child"],
        ),
        (
            replaced("<child link=\"lower\"/>", "<child link=\"lover\"/>"),
            &["line 7", "`lover`", "does not exist"],
        ),
        (
            replaced("<parent link=\"upper\"/>", "<parent link=\"lower\"/>"),
            &["`elbow`", "same link"],
        ),
        (
            replaced("<child link=\"lower\"/>", "<child link=\"upper\"/>"),
            &["`elbow`", "same link"],
        ),
        (
            replaced(
                "</robot>",
                "<joint name=\"loop\" type=\"fixed\"><parent link=\"base\"/><child link=\"lower\"/></joint></robot>",
            ),
            &["line 8", "`loop`", "`lower`", "`elbow`", "tree"],
        ),
        (
            replaced("</robot>", "<link name=\"x\"/></robot>"),
            &["2 links", "`base`", "`x` (line 8)", "fixed"],
        ),
        (
            replaced(
                "</robot>",
                "<joint name=\"back\" type=\"fixed\"><parent link=\"lower\"/><child link=\"base\"/></joint></robot>",
            ),
            &["cycle"],
        ),
        (
            replaced(
                "</robot>",
                "<link name=\"x\"/><link name=\"y\"/><joint name=\"a\" type=\"fixed\"><parent link=\"x\"/><child link=\"y\"/></joint><joint name=\"b\" type=\"fixed\"><parent link=\"y\"/><child link=\"x\"/></joint></robot>",
            ),
            &["line 8", "`x`", "cycle", "`base`"],
        ),
        (
            replaced(axis, "<axis xyz=\"0 0 0\"/>"),
            &["line 6", "`shoulder`", "axis is zero"],
        ),
        (
            replaced(axis, "<axis xyz=\"0 1\"/>"),
            &["`xyz=\"0 1\"`", "three finite numbers"],
        ),
        (
            replaced(axis, "<axis xyz=\"0 1 0 0\"/>"),
            &["three finite numbers"],
        ),
        (
            replaced(axis, "<axis xyz=\"0, 1, 0\"/>"),
            &["three finite numbers", "spaces"],
        ),
        (
            replaced(axis, "<axis xyz=\"0 nan 0\"/>"),
            &["three finite numbers"],
        ),
        (
            replaced("0 0 0.4", "0 0 inf"),
            &["`elbow`", "<origin>", "three finite numbers"],
        ),
        (
            replaced("xyz=\"0 0 0.4\"", "rpy=\"0 0\""),
            &["`rpy=\"0 0\"`", "three finite numbers"],
        ),
        (
            replaced("value=\"2\"", "value=\"NaN\""),
            &["line 4", "link `upper`", "not finite"],
        ),
        (
            replaced("value=\"2\"", "value=\"two\""),
            &["`value=\"two\"`", "not a number"],
        ),
        (
            replaced("ixx=\"0.02\"", "ixx=\"1e999\""),
            &["link `upper`", "not finite"],
        ),
        (
            replaced(
                "value=\"2\"/>",
                "value=\"1e300\"/><origin xyz=\"1e300 0 0\"/>",
            ),
            &["link `upper`", "is the most that is read"],
        ),
        (
            replaced("velocity=\"3\"", "velocity=\"-3\""),
            &["line 6", "velocity", "-3", "sign"],
        ),
        (
            replaced("effort=\"40\"", "effort=\"-40\""),
            &["effort", "-40", "sign"],
        ),
        (
            replaced("effort=\"40\"", "effort=\"lots\""),
            &["<limit>", "not a number"],
        ),
        (
            replaced("lower=\"-2\"", "lower=\"3\""),
            &["`shoulder`", "3 is above", "2", "position"],
        ),
        (
            replaced("lower=\"-2\"", "lower=\"2\""),
            &["`shoulder`", "cannot move", "lock"],
        ),
        (
            replaced(axis, &format!("{axis}<mimic/>")),
            &["`shoulder`", "<mimic>", "joint="],
        ),
        (
            replaced(axis, &mimic("wrist")),
            &["`shoulder`", "`wrist`", "does not exist"],
        ),
        (
            replaced(axis, &mimic("shoulder")),
            &["`shoulder`", "mimics itself"],
        ),
        (
            replaced(axis, &mimic("elbow"))
                .replace("0.4\"/><axis", "0.4\"/><mimic joint=\"shoulder\"/><axis"),
            &["mimics itself", "circle"],
        ),
        (
            replaced(
                axis,
                &format!("{axis}<mimic joint=\"elbow\" multiplier=\"inf\"/>"),
            ),
            &["multiplier", "not finite"],
        ),
        (
            arm(|t| t.replace("\"revolute\"", "\"fixed\"")),
            &["no joint moves"],
        ),
    ];
    assert!(arm(|t| t).contains(limit));
    for (text, parts) in cases {
        let message = urdf_error(&text);
        contains_all(&message, parts);
        contains_all(&message, &["arm.urdf"]);
    }
}

#[test]
fn imperfect_urdfs_are_read_with_a_warning() {
    let limit = r#"<limit lower="-2" upper="2" velocity="3" effort="40"/>"#;
    let inertia = r#"<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/>"#;
    let cases: Vec<(String, &str, &[&str])> = vec![
        (
            replaced(limit, ""),
            "joint `shoulder`",
            &["position, velocity, effort", "unlimited"],
        ),
        (
            replaced(limit, "<limit/>"),
            "joint `shoulder`",
            &["position, velocity, effort"],
        ),
        (
            replaced(
                limit,
                "<limit lower=\"0\" upper=\"0\" velocity=\"0\" effort=\"0\"/>",
            ),
            "joint `shoulder`",
            &["position, velocity, effort", "absent, 0"],
        ),
        (
            replaced("velocity=\"3\"", "velocity=\"0\""),
            "joint `shoulder`",
            &["limit of velocity in"],
        ),
        (
            replaced("lower=\"-2\" ", ""),
            "joint `shoulder`",
            &["no lower position", "0"],
        ),
        (
            replaced(BAR, ""),
            "link `upper`",
            &["no <inertial>", "massless"],
        ),
        (
            replaced(BAR, "<inertial><mass value=\"0\"/></inertial>"),
            "link `upper`",
            &["<inertial> is zero"],
        ),
        (replaced(inertia, ""), "link `upper`", &["point mass"]),
        (
            replaced("<mass value=\"2\"/>", ""),
            "link `upper`",
            &["no <mass"],
        ),
        (
            replaced("value=\"2\"", "value=\"0\""),
            "link `upper`",
            &["no mass", "cannot exist"],
        ),
        (
            replaced("value=\"2\"", "value=\"-2\""),
            "link `upper`",
            &["-2 kg"],
        ),
        (
            replaced("ixx=\"0.02\"", "ixx=\"-0.02\""),
            "link `upper`",
            &["negative principal moment"],
        ),
        (
            replaced("ixx=\"0.02\"", "ixx=\"0.05\""),
            "link `upper`",
            &["exceeds the sum", "20.0 %"],
        ),
        (replaced("ixy=\"0\" ", ""), "link `upper`", &["lacks ixy"]),
        (
            replaced("<axis", "<dynamics damping=\"-1\"/><axis"),
            "joint `shoulder`",
            &["negative damping"],
        ),
        (
            replaced("<axis", "<axis xyz=\"1 0 0\"/><axis"),
            "joint `shoulder`",
            &["<axis> is given twice"],
        ),
    ];
    for (text, subject, parts) in cases {
        let robot = Robot::from_urdf_str(&text, "arm.urdf").unwrap();
        let warning = robot
            .warnings
            .iter()
            .find(|w| w.subject == subject && parts.iter().all(|p| w.message.contains(p)));
        assert!(warning.is_some(), "{parts:?} not in {:?}", robot.warnings);
    }
    // the rounding of published figures is not worth a word
    let robot = Robot::from_urdf_str(&replaced("ixx=\"0.02\"", "ixx=\"0.04001\""), "a").unwrap();
    assert!(robot.warnings.is_empty(), "{:?}", robot.warnings);
}

#[test]
fn what_is_not_needed_is_skipped_silently() {
    let extra = r#"<gazebo reference="upper"><selfCollide>true</selfCollide></gazebo>
<transmission name="t"><joint name="shoulder"/><actuator name="m"/></transmission>
<material name="grey"><color rgba="1 1 1 1"/></material></robot>"#;
    let visual = r#"<link name="upper"><visual><geometry><mesh filename="package://a/b.stl"/></geometry><origin xyz="a b c"/></visual>"#;
    let text = arm(|t| {
        t.replace("</robot>", extra)
            .replace("<link name=\"upper\">", visual)
    });
    let expanded = text.replace(
        "name=\"arm\"",
        "name=\"arm\" xmlns:xacro=\"http://wiki.ros.org/xacro\"",
    );
    let robot =
        Robot::from_urdf_str(&format!("\u{feff}{}", expanded.trim_start()), "arm.urdf").unwrap();
    assert_eq!(robot.dof(), 2);
    assert!(robot.warnings.is_empty(), "{:?}", robot.warnings);
}
