//! What stays, what changes, and what is refused, without a simulator.

use super::*;
use crate::plant::Plant;
use crate::robot::{JointTerm, Robot};

/// An arm of two joints with everything that must stay.
const SCENE: &str = r#"<mujoco model="two">
  <!-- our arm -->
  <compiler angle="degree"  meshdir='meshes'/>
  <default><default class="arm"><joint damping="0.5" armature="0.01"/></default></default>
  <asset><mesh name="m" file="a.stl"/></asset>
  <worldbody>
    <light pos="0 0 3"/> <!-- a light -->
    <body name="cube"><freejoint/><geom size="0.1"/></body>
    <body name="upper" childclass="arm" pos="0 0 1">
      <joint name="one"  axis="0 1 0" range='-90 90'/>
      <inertial mass='2' pos="0 0 0.1"  diaginertia="0.02 0.02 0.01"/>
      <body name="lower" pos="0 0 0.4"><joint name="two" axis="0 1 0" frictionloss="0.1"/>
        <geom type="capsule" size="0.03" fromto="0 0 0 0 0 0.3"/>
        <body name="tool" pos="0 0 0.3"><inertial pos="0 0 0" mass="0.3" diaginertia="0.001 0.001 0.001"/></body>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="m1" joint="one" gear="2"/></actuator>
  <keyframe><key name="home" qpos="0 0 0 1 0 0 0 10 20"/></keyframe>
</mujoco>
"#;

fn folder() -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let scene = dir.path().join("scene.xml");
    std::fs::write(&scene, SCENE).unwrap();
    (dir, scene)
}

/// The arm without the cube.
fn plant() -> Plant {
    let at = SCENE.find("    <body name=\"cube\"").unwrap();
    let end = at + SCENE[at..].find('\n').unwrap();
    let text = format!("{}{}", &SCENE[..at], &SCENE[end..]);
    Plant::from(Robot::from_urdf_str(&text, "two.xml").unwrap())
}

fn written(robot: &Robot) -> (Edited, String) {
    let (dir, scene) = folder();
    let plant = plant();
    let model = Model {
        plant: &plant,
        robot,
        remarks: &[],
    };
    let edited = into_scene(&model, &scene, &dir.path().join("out")).unwrap();
    let text = edited.files.last().unwrap().1.clone();
    (edited, text)
}

#[test]
fn the_same_model_changes_nothing_but_the_way_to_the_meshes() {
    let (edited, text) = written(plant().robot());
    assert_eq!(text, SCENE.replace("'meshes'", "'../meshes'"));
    assert_eq!(edited.changes.len(), 1);
    assert_eq!(edited.changes[0].attribute, "meshdir");
    assert!(edited.left_out.is_empty(), "{:?}", edited.left_out);
}

/// A folder of meshes whose name has to be quoted.
#[test]
fn names_of_folders_are_quoted() {
    let dir = tempfile::tempdir().unwrap();
    let home = dir.path().join("R&D 'lab'");
    std::fs::create_dir(&home).unwrap();
    let scene = home.join("scene.xml");
    let text = SCENE.replace("  meshdir='meshes'", "");
    for text in [
        text.clone(),
        text.replace("<compiler angle=\"degree\"/>", ""),
    ] {
        std::fs::write(&scene, &text).unwrap();
        let at = text.find("    <body name=\"cube\"").unwrap();
        let end = at + text[at..].find('\n').unwrap();
        let own = format!("{}{}", &text[..at], &text[end..]);
        let plant = Plant::from(Robot::from_urdf_str(&own, "two.xml").unwrap());
        let model = Model {
            plant: &plant,
            robot: plant.robot(),
            remarks: &[],
        };
        let edited = into_scene(&model, &scene, &dir.path().join("out")).unwrap();
        let written = roxmltree::Document::parse(&edited.files[0].1).unwrap();
        let mut compilers = written.descendants().filter(|n| n.has_tag_name("compiler"));
        let meshes = compilers.next().unwrap().attribute("meshdir");
        assert_eq!(meshes, Some("../R&D 'lab'"));
    }
}

#[test]
fn what_changes_is_said_and_all_else_stays() {
    let mut robot = plant().robot().clone();
    robot.joints[0].terms[JointTerm::Viscous as usize] = 0.7;
    robot.joints[1].terms[JointTerm::Coulomb as usize] = 0.25;
    let (edited, text) = written(&robot);
    let expected = SCENE
        .replace("'meshes'", "'../meshes'")
        .replace("range='-90 90'/>", "range='-90 90' damping=\"0.7\"/>")
        .replace(
            "frictionloss=\"0.1\"/>",
            "frictionloss=\"0.25\" solreffriction=\"0.0001 1\" solimpfriction=\"0.99 0.99 0.001\"/>",
        );
    assert_eq!(text, expected);
    let damping = edited.changes.iter().find(|c| c.attribute == "damping");
    let damping = damping.unwrap();
    assert_eq!(
        (damping.old.as_deref(), damping.new.as_deref()),
        (Some("0.5"), Some("0.7"))
    );
    assert_eq!((damping.file.as_str(), damping.line), ("scene.xml", 10));
    assert_eq!(damping.element, "joint one");
}

/// Reads what was written as a robot.
fn again(text: &str) -> Robot {
    let at = text.find("    <body name=\"cube\"").unwrap();
    let end = at + text[at..].find('\n').unwrap();
    Robot::from_urdf_str(&format!("{}{}", &text[..at], &text[end..]), "again.xml").unwrap()
}

#[test]
fn bodies_with_welded_parts_and_bodies_of_geoms() {
    let mut robot = plant().robot().clone();
    for (body, factor) in robot.bodies.iter_mut().zip([1.2, 1.5]) {
        body.inertia.0.iter_mut().for_each(|x| *x *= factor);
    }
    let (edited, text) = written(&robot);
    let read = again(&text);
    for (a, b) in robot.bodies.iter().zip(&read.bodies) {
        for (x, y) in a.inertia.0.iter().zip(b.inertia.0) {
            assert!((x - y).abs() < 1e-12, "{}: {x} {y}", a.name);
        }
    }
    // the tool is as it was, the geoms too
    assert!(text.contains("mass=\"0.3\" diaginertia=\"0.001 0.001 0.001\""));
    assert!(text.contains("<geom type=\"capsule\" size=\"0.03\""));
    assert!(
        edited
            .changes
            .iter()
            .any(|c| c.element == "body lower inertial")
    );
    // lighter than its tool: the tool gives way
    let mut light = plant().robot().clone();
    light.bodies[1].inertia.0.iter_mut().for_each(|x| *x *= 0.2);
    let (_, text) = written(&light);
    let read = again(&text);
    for (x, y) in light.bodies[1]
        .inertia
        .0
        .iter()
        .zip(read.bodies[1].inertia.0)
    {
        assert!((x - y).abs() < 1e-12, "{x} {y}");
    }
}

#[test]
fn a_scene_of_another_robot_is_refused_with_the_joint() {
    let (dir, scene) = folder();
    let out = dir.path().join("out");
    let plant = plant();
    let ask = |text: &str, word: &str| {
        std::fs::write(&scene, text).unwrap();
        let model = Model {
            plant: &plant,
            robot: plant.robot(),
            remarks: &[],
        };
        let error = into_scene(&model, &scene, &out).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    };
    ask(
        &SCENE.replace("\"two\" axis", "\"three\" axis"),
        "joint `two`",
    );
    ask(
        &SCENE.replace("name=\"two\" axis=\"0 1 0\"", "name=\"two\" axis=\"1 0 0\""),
        "joint `two`",
    );
    ask(&SCENE.replace("0 0 0.4", "0 0 0.5"), "joint `two`");
    ask(
        &SCENE.replace("\"two\" axis", "\"two\" type=\"slide\" axis"),
        "joint `two`",
    );
    ask("<mujoco><worldbody/></mujoco>", "joint `one`");
    let model = Model {
        plant: &plant,
        robot: plant.robot(),
        remarks: &[],
    };
    std::fs::write(&scene, SCENE).unwrap();
    assert!(into_scene(&model, &scene, dir.path()).is_err());
}

const URDF: &str = r#"<?xml version="1.0"?>
<!-- mine -->
<robot name="one">
  <link name="base"/>
  <link name="arm"> <!-- heavy -->
    <inertial><origin xyz="0 0 0.1" rpy="0.3 0 0"/><mass value="2"/>
      <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/></inertial>
    <visual><geometry><mesh filename="meshes/a.stl"/></geometry></visual>
  </link>
  <link name="tool"><inertial><mass value="0.5"/><inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial></link>
  <joint name="fix" type="fixed"><parent link="arm"/><child link="tool"/><origin xyz="0 0 0.3"/></joint>
  <joint name="j" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" velocity="2" effort="30"/></joint>
</robot>
"#;

#[test]
fn a_urdf_keeps_what_it_has() {
    let dir = tempfile::tempdir().unwrap();
    let scene = dir.path().join("one.urdf");
    std::fs::write(&scene, URDF).unwrap();
    let plant = Plant::load(scene.to_str().unwrap()).unwrap();
    let mut robot = plant.robot().clone();
    let out = dir.path().join("out");
    let write = |robot: &Robot| {
        let model = Model {
            plant: &plant,
            robot,
            remarks: &[],
        };
        into_scene(&model, &scene, &out).unwrap()
    };
    let same = write(&robot);
    assert_eq!(
        same.files[0].1,
        URDF.replace("meshes/a.stl", "../meshes/a.stl")
    );
    robot.bodies[0].inertia.0.iter_mut().for_each(|x| *x *= 1.3);
    robot.joints[0].terms = [0.2, 1.5, 0.7, 0.0];
    let edited = write(&robot);
    let text = &edited.files[0].1;
    assert!(text.contains("<!-- mine -->") && text.contains("<!-- heavy -->"));
    assert!(text.contains("<dynamics damping=\"1.5\" friction=\"0.7\"/>"));
    assert!(edited.left_out.iter().any(|l| l.contains("rotor inertia")));
    let read = Robot::from_urdf_str(text, "again").unwrap();
    for (x, y) in robot.bodies[0]
        .inertia
        .0
        .iter()
        .zip(read.bodies[0].inertia.0)
    {
        assert!((x - y).abs() < 1e-12, "{x} {y}");
    }
    assert_eq!(read.joints[0].terms, [0.0, 1.5, 0.7, 0.0]);
    assert_eq!(read.joints[0].limits.effort, 30.0);
}
