//! Descriptions of several files: robots of packages, and name spaces of included files. What is wanted is what the xacro of ROS
//! (2.1.1) makes of the same files.

use super::*;
use crate::robot::Robot;

const ARM: &str = r#"<?xml version="1.0"?>
<robot xmlns:xacro="http://wiki.ros.org/xacro" name="$(arg name)">
  <xacro:arg name="name" default="arm"/>
  <xacro:arg name="kind" default=""/>
  <xacro:include filename="$(find demo_description)/urdf/macros.xacro"/>
  <xacro:limits file="$(find demo_description)/config/$(arg kind)/limits.yaml"/>
  <link name="base"/>
  <xacro:cylinder name="link" mass="1.5" radius="0.1" length="0.2"><origin xyz="0 0 ${0.2/2}"/></xacro:cylinder>
  <joint name="turn" type="revolute"><parent link="base"/><child link="link"/><axis xyz="0 0 1"/>
    <limit lower="${low}" upper="${high}" velocity="${limits.velocity}" effort="${limits['effort']}"/></joint>
</robot>
"#;
const MACROS: &str = r#"<robot xmlns:xacro="http://wiki.ros.org/xacro">
  <xacro:macro name="limits" params="file">
    <xacro:property name="config" value="${xacro.load_yaml(file)}"/>
    <xacro:property name="limits" value="${config['joint_limits']['turn']}" scope="parent"/>
    <xacro:property name="low" value="${config['joint_limits']['turn']['low']}" scope="parent"/>
    <xacro:property name="high" value="${config['joint_limits']['turn']['high']}" scope="parent"/>
  </xacro:macro>
  <xacro:macro name="cylinder" params="name mass radius length *origin">
    <link name="${name}"><inertial><mass value="${mass}"/><xacro:insert_block name="origin"/>
      <inertia ixx="${1./12 * mass * (3 * radius**2 + length**2)}" iyy="${1./12 * mass * (3 * radius**2 + length**2)}"
        izz="${mass * radius * radius / 2}" ixy="0" ixz="0" iyz="0"/></inertial></link>
  </xacro:macro>
</robot>
"#;
const LIMITS: &str = "joint_limits:\n  turn: {low: !degrees -90.0, high: !degrees 180.0, velocity: 2.5, effort: 1.2e2}\n";

#[test]
fn a_description_of_several_files_is_a_robot() {
    let folder = tempfile::tempdir().unwrap();
    let package = folder.path().join("demo_description");
    for (name, text) in [
        (
            "package.xml",
            "<package><name>demo_description</name></package>",
        ),
        ("urdf/arm.urdf.xacro", ARM),
        ("urdf/macros.xacro", MACROS),
        ("config/small/limits.yaml", LIMITS),
        ("robot.toml", "urdf = \"urdf/arm.urdf.xacro kind:=small\"\n"),
    ] {
        let path = package.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    let file = package.join("urdf/arm.urdf.xacro");
    let file = file.to_str().unwrap();
    let robot = Robot::load(&format!("{file} kind:=small name:=one")).unwrap();
    assert_eq!(robot.name, "one");
    assert_eq!(robot.bodies[0].inertia.mass(), 1.5);
    let [low, high] = robot.joints[0].limits.position;
    assert!((low + std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    assert!((high - std::f64::consts::PI).abs() < 1e-12);
    assert_eq!(robot.joints[0].limits.effort, 120.0);
    let other = Robot::load(package.join("robot.toml").to_str().unwrap()).unwrap();
    assert_eq!(other.joints[0].limits.velocity, 2.5);
    let said = Robot::load(&format!("{file} kinds:=small"))
        .unwrap_err()
        .to_string();
    assert!(said.contains("limits.yaml"), "{said}");
    let said = Robot::load(&format!("{file} kind:=small nam:=x"))
        .unwrap_err()
        .to_string();
    assert!(said.contains("did you mean `name`"), "{said}");
}

const PARTS: &str = r#"<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="k" value="3"/>
  <xacro:property name="late" value="${outer + k}"/>
  <xacro:property name="up" value="${k*2}" scope="parent"/>
  <xacro:macro name="m" params="v:=${k} w:=^|7">
    <b v="${v}" k="${k}" w="${w}"/>
    <xacro:property name="stated" value="11" scope="parent"/>
  </xacro:macro>
  <xacro:macro name="n" params="*block"><xacro:m v="9"/><xacro:insert_block name="block"/></xacro:macro>
  <xacro:macro name="u"><xacro:outside/></xacro:macro>
  <xacro:include filename="inner.xacro" ns="I"/>
  <direct k="${k}"/>
</robot>
"#;
const INNER: &str = r#"<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="deep" value="1"/>
  <xacro:macro name="z"><z d="${deep}" k="${k}"/></xacro:macro>
</robot>
"#;

/// What stands in the robot, of a file that includes others.
fn body(inside: &str) -> Result<String> {
    let folder = tempfile::tempdir().unwrap();
    let text =
        format!("<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\" name=\"r\">{inside}</robot>");
    for (name, text) in [("parts.xacro", PARTS), ("inner.xacro", INNER)] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let out = expand(&text, &folder.path().join("arm.xacro"), &BTreeMap::new())?;
    let lines: Vec<&str> = out.lines().map(str::trim).collect();
    let out = lines.concat();
    let start = out.find("<robot name=\"r\">").unwrap();
    Ok(out[start..]
        .replace("<robot name=\"r\">", "")
        .replace("</robot>", ""))
}

#[test]
fn an_included_file_has_a_name_space() {
    let include = |ns: &str| format!("<xacro:include filename=\"parts.xacro\" ns=\"{ns}\"/>");
    let l = include("L");
    for (inside, wanted) in [
        (
            format!(
                "<xacro:property name=\"outer\" value=\"100\"/>{l}<x k=\"${{L.k}} ${{L['k']}}\" late=\"${{L.late}}\" up=\"${{up}}\"/>"
            ),
            "<direct k=\"3\"/><x k=\"3 3\" late=\"103\" up=\"6\"/>",
        ),
        // defaults are seen from the caller, the body from the file
        (
            format!(
                "<xacro:property name=\"k\" value=\"8\"/>{l}<xacro:L.m/><y f=\"${{stated}}\"/><xacro:L.n><p k=\"${{L.k}}\"/></xacro:L.n>"
            ),
            "<direct k=\"3\"/><b v=\"8\" k=\"3\" w=\"7\"/><y f=\"11\"/><b v=\"9\" k=\"3\" w=\"7\"/><p k=\"3\"/>",
        ),
        (
            format!(
                "<xacro:property name=\"w\" value=\"2\"/>{l}<xacro:call macro=\"L.m\" v=\"4\"/>"
            ),
            "<direct k=\"3\"/><b v=\"4\" k=\"3\" w=\"2\"/>",
        ),
        // one in the other, and one file twice
        (
            format!("{l}<xacro:L.I.z/><x d=\"${{L.I.deep}}\"/>"),
            "<direct k=\"3\"/><z d=\"1\" k=\"3\"/><x d=\"1\"/>",
        ),
        (
            format!(
                "{}{}<xacro:property name=\"k\" value=\"0\"/><xacro:A.m w=\"2\"/><x k=\"${{A.k + B.k + k}}\"/>",
                include("${'A'}"),
                include("B")
            ),
            "<direct k=\"3\"/><direct k=\"3\"/><b v=\"0\" k=\"3\" w=\"2\"/><x k=\"6\"/>",
        ),
    ] {
        assert_eq!(body(&inside).unwrap(), wanted, "{inside}");
    }
    for (inside, wanted) in [
        (format!("{l}<x k=\"${{k}}\"/>"), "`k` is not defined"),
        (format!("{l}<x k=\"${{L.zz}}\"/>"), "`zz` is not defined"),
        (format!("{l}<x k=\"${{L}}\"/>"), "name a property in it"),
        (format!("{l}<xacro:m/>"), "no macro `m`"),
        (format!("{l}<xacro:L.zz/>"), "no macro `L.zz`"),
        // macros outside are not seen from within
        (
            format!("<xacro:macro name=\"outside\"><o/></xacro:macro>{l}<xacro:L.u/>"),
            "no macro `outside`",
        ),
        // it ends with the macro that it was included in
        (
            format!(
                "<xacro:macro name=\"q\">{l}<x k=\"${{L.k}}\"/></xacro:macro><xacro:q/><x k=\"${{L.k}}\"/>"
            ),
            "`L` is not defined",
        ),
        (
            format!(
                "<xacro:macro name=\"q\">{l}<xacro:property name=\"s\" value=\"${{[L]}}\" scope=\"parent\"/></xacro:macro><xacro:q/><x k=\"${{s[0].k}}\"/>"
            ),
            "`k` is not defined",
        ),
    ] {
        let said = body(&inside).unwrap_err().to_string();
        assert!(said.contains(wanted), "{inside}: {said}");
    }
}

const DEVICE: &str = r#"<robot xmlns:xacro="http://ros.org/wiki/xacro" name="device">
  <xacro:macro name="device" params="prefix:='' limited:=false attach_to:='world'
      serial:='' tool_mass:=0.4 tool_height := 0.08">
    <xacro:include filename="$(find demo_description)/urdf/link.xacro"/>
    <xacro:inertial_file kind="six" serial="${serial}"/>
    <xacro:property name="values" value="${xacro.load_yaml('$(find demo_description)/config/' + found_file + '.yaml')}"/>
    <xacro:if value="${attach_to == 'world'}"><link name="world"/></xacro:if>
    <link name="${prefix}link"><xacro:inertial of="${values['link']}"/></link>
    <xacro:if value="${limited}"><xacro:joint parent="${attach_to}" lower="${-pi*0.5}"/></xacro:if>
    <xacro:unless value="${limited}"><xacro:joint parent="${attach_to}"/></xacro:unless>
    <xacro:tool><origin xyz="0 0 ${tool_height/2}"/></xacro:tool>
  </xacro:macro>
</robot>
"#;
const LINK: &str = r#"<robot xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:macro name="inertial" params="of rpy:='0 0 0'">
    <inertial><origin xyz="${of['origin']['x']} 0 ${of.origin.z}" rpy="${rpy}"/><mass value="${of['mass']}"/>
      <inertia ixx="${of['inertia']['ixx']}" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
  </xacro:macro>
  <xacro:macro name="joint" params="parent lower:=${-2.0 * pi}">
    <joint name="${prefix}joint" type="revolute"><parent link="${parent}"/><child link="${prefix}link"/><axis xyz="0 0 1"/>
      <limit lower="${lower}" upper="${pi}" effort="50.0" velocity="3.14"/></joint>
  </xacro:macro>
  <xacro:macro name="tool" params="*origin">
    <link name="${prefix}tool"><inertial><xacro:insert_block name="origin"/><mass value="${tool_mass}"/>
      <inertia ixx="1e-3" ixy="0" ixz="0" iyy="1e-3" iyz="0" izz="1e-3"/></inertial></link>
    <joint name="${prefix}tool_joint" type="fixed"><parent link="${prefix}link"/><child link="${prefix}tool"/></joint>
  </xacro:macro>
  <xacro:macro name="inertial_file" params="kind serial">
    <xacro:property name="file" value="${kind}_second"/>
    <xacro:if value="${len(serial) >= 10 and (serial[0] == 'A' or serial[0] == 'B')}">
      <xacro:property name="number" value="${int(serial[2:6])}"/>
      <xacro:if value="${number == 1305 and not serial[6:8] in ['12', '11']}"><xacro:property name="file" value="${kind}_first"/></xacro:if>
    </xacro:if>
    <xacro:property name="found_file" value="${file}" scope="parent"/>
  </xacro:macro>
</robot>
"#;
const MAIN: &str = r#"<robot xmlns:xacro="http://ros.org/wiki/xacro" name="arm">
  <xacro:arg name="prefix" default=""/><xacro:arg name="limited" default="false"/><xacro:arg name="serial" default=""/>
  <xacro:include filename="$(find demo_description)/urdf/device.xacro"/>
  <xacro:device prefix="$(arg prefix)" limited="$(arg limited)" serial="$(arg serial)"/>
</robot>
"#;

/// Files that are included within a macro, whose macros see what their caller has; values of YAML files chosen by a serial
/// number; parameters with expressions and blocks.
#[test]
fn macros_of_a_device_include_what_they_need() {
    let folder = tempfile::tempdir().unwrap();
    let package = folder.path().join("demo_description");
    let values = |mass: f64| {
        format!(
            "link:\n  mass: {mass}\n  origin: {{x: 0.01, y: 0, z: -2e-3}}\n  inertia: {{ixx: 0.01}}\n"
        )
    };
    for (name, text) in [
        (
            "package.xml",
            "<package><name>demo_description</name></package>",
        ),
        ("urdf/arm.urdf.xacro", MAIN),
        ("urdf/device.xacro", DEVICE),
        ("urdf/link.xacro", LINK),
        ("config/six_first.yaml", &values(2.5)),
        ("config/six_second.yaml", &values(2.0)),
    ] {
        let path = package.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    let file = package.join("urdf/arm.urdf.xacro");
    let load = |arguments: &str| {
        let spec = format!("{} {arguments}", file.display());
        Robot::load(spec.trim_end()).unwrap()
    };
    let of = |robot: &Robot| {
        let mass: f64 = robot.bodies.iter().map(|b| b.inertia.mass()).sum();
        (robot.joints[0].limits.position[0], mass)
    };
    let pi = std::f64::consts::PI;
    for (arguments, lower, mass) in [
        ("", -2.0 * pi, 2.4),
        ("serial:=AB130503193 prefix:=L_", -2.0 * pi, 2.9),
        ("serial:=AB130512193 limited:=true", -0.5 * pi, 2.4),
    ] {
        let (found, masses) = of(&load(arguments));
        assert!((found - lower).abs() < 1e-12, "{arguments}: {found}");
        assert!((masses - mass).abs() < 1e-12, "{arguments}: {masses}");
    }
    assert_eq!(load("prefix:=L_").joints[0].name, "L_joint");
}
