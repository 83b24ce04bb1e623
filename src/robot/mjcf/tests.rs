//! What is read, against hand-made numbers, and what is refused.

use crate::Robot;

fn read(text: &str) -> crate::error::Result<Robot> {
    Robot::from_urdf_str(text, "model.xml")
}

fn around(inside: &str) -> String {
    format!("<mujoco><worldbody>{inside}</worldbody></mujoco>")
}

#[test]
fn a_pendulum_of_geoms_with_classes() {
    let robot = read(
        "<?xml version='1.0'?><!-- a model --><mujoco model='p'><compiler angle='radian'/>\
         <default><joint damping='0.5'/><default class='big'><joint armature='0.2' damping='0.7'/></default></default>\
         <option gravity='0 0 -9'/><worldbody><body name='rod' pos='0 0 1' childclass='big'>\
         <joint name='swing' axis='0 2 0' range='-1 2' pos='0 0 0.1'/>\
         <geom type='box' size='0.1 0.2 0.3' mass='3'/></body></worldbody>\
         <actuator><motor joint='swing' gear='50' ctrlrange='-2 2'/></actuator></mujoco>",
    )
    .unwrap();
    let (body, joint) = (&robot.bodies[0], &robot.joints[0]);
    assert_eq!(robot.gravity.z, -9.0);
    assert_eq!(joint.limits.position, [-1.0, 2.0]);
    assert_eq!(joint.limits.effort, 100.0);
    assert_eq!(joint.terms, [0.2, 0.7, 0.0, 0.0]);
    assert_eq!(body.axis.y, 1.0);
    // the frame is that of the joint
    assert!((body.position.z - 1.1).abs() < 1e-12);
    assert!((body.inertia.com().unwrap().z + 0.1).abs() < 1e-12);
    let own = 3.0 / 3.0 * (0.01 + 0.09);
    assert!((body.inertia.tensor_com().m22 - own).abs() < 1e-12);
}

#[test]
fn joints_of_one_body_are_a_chain() {
    let robot = read(&around(
        "<body name='b'><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/><joint name='x' axis='1 0 0'/>\
         <joint name='y' axis='0 1 0'/><joint name='s' type='slide' ref='0.5'/></body>",
    ))
    .unwrap();
    let masses: Vec<f64> = robot.bodies.iter().map(|b| b.inertia.mass()).collect();
    assert_eq!(masses, [0.0, 0.0, 1.0]);
    assert_eq!(robot.bodies[2].parent, Some(1));
    assert!((robot.bodies[2].position.z + 0.5).abs() < 1e-12);
}

#[test]
fn what_is_not_read_is_refused_with_its_line() {
    let inertial = "<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>";
    let hinge = format!("<body name='a'>{inertial}<joint name='j'/></body>");
    for (text, word) in [
        (around("<body><freejoint/></body>"), "floats"),
        (around("<body><joint type='ball'/></body>"), "ball"),
        (
            around("<body><joint/><geom type='mesh' mesh='m'/></body>"),
            "mesh",
        ),
        (around("<body><joint class='none'/></body>"), "class"),
        (around("<body><joint axis='0 0'/></body>"), "3 numbers"),
        (around("<body><joint axis='0 0 x'/></body>"), "finite"),
        (around("<body><joint axis='0 0 0'/></body>"), "direction"),
        (around("<body><joint/><geom size='-1'/></body>"), "positive"),
        (around("<replicate count='3'/>"), "mj_saveLastXML"),
        (around("<include/>"), "file"),
        (around(&format!("{hinge}{hinge}")), "name"),
        (around(""), "no joint moves"),
        (
            format!(
                "<mujoco><worldbody>{hinge}</worldbody><equality><weld body1='a'/></equality></mujoco>"
            ),
            "loop",
        ),
        (
            format!(
                "<mujoco><worldbody>{hinge}</worldbody><actuator><motor joint='q'/></actuator></mujoco>"
            ),
            "",
        ),
        ("<mujoco><worldbody>".into(), "malformed"),
        ("<mujoco/>".into(), "worldbody"),
    ] {
        match read(&text) {
            Ok(_) => assert!(word.is_empty(), "{text} was read"),
            Err(e) => assert!(e.to_string().contains(word), "{text}: {e}"),
        }
    }
}
