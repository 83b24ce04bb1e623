//! What is written can exist, on the digits as they are written.

use super::*;
use crate::robot::Inertia;

/// Numbers of an attribute.
fn numbers(xml: &str, attribute: &str) -> Vec<Vec<f64>> {
    let key = format!(" {attribute}=\"");
    let values = xml.split(&key).skip(1).filter_map(|s| s.split('"').next());
    values
        .map(|v| v.split(' ').map(|x| x.parse().unwrap()).collect())
        .collect()
}

fn written(robot: &Robot) -> [String; 3] {
    let plant = Plant::from(robot);
    let model = Model {
        plant: &plant,
        robot,
        remarks: &[],
    };
    let all = write(&model).into_iter().map(|(_, text)| text.unwrap());
    all.collect::<Vec<_>>().try_into().unwrap()
}

/// A bundled arm whose first body is another one.
fn with_body(inertia: Inertia) -> Robot {
    let mut robot = Robot::load("planar2").unwrap();
    robot.bodies[0].inertia = inertia;
    robot
}

#[test]
fn bodies_that_are_written_can_exist() {
    let (c, m) = (Vector3::new(0.1, -0.02, 0.3), 2.0);
    let turned = Rotation3::from_euler_angles(0.3, 0.9, -1.2).into_inner();
    let with_moments = |a: f64, b: f64, c_: f64| {
        let tensor = turned * Matrix3::from_diagonal(&Vector3::new(a, b, c_)) * turned.transpose();
        Inertia::from_com(m, c, tensor)
    };
    let all = [
        with_moments(0.1, 0.1, 0.0),
        with_moments(0.1, 0.2, 0.3),
        with_moments(0.1, 0.2, 0.5),
        with_moments(0.1, 0.2, -0.05),
        with_moments(0.0, 0.0, 0.0),
        Inertia([0.0; 10]),
        Inertia([-1.0, 0.1, 0.0, 0.0, 0.1, 0.0, 0.0, 0.1, 0.0, 0.1]),
    ];
    for inertia in all {
        let robot = with_body(inertia);
        let [urdf, xml, _] = written(&robot);
        for i in numbers(&xml, "fullinertia") {
            let tensor = Matrix3::new(i[0], i[3], i[4], i[3], i[1], i[5], i[4], i[5], i[2]);
            let moments = tensor.symmetric_eigen().eigenvalues;
            let largest = moments.max();
            // MuJoCo compares without tolerance
            assert!(
                moments.sum() - 2.0 * largest > 1e-9 * largest,
                "{inertia:?}: {moments}"
            );
            assert!(moments.min() > 1e-14);
        }
        assert!(numbers(&xml, "mass").iter().all(|m| m[0] > 0.0));
        assert_eq!(numbers(&xml, "mass").len(), robot.bodies.len());
        let again = Robot::from_urdf_str(&urdf, "again").unwrap();
        for b in &again.bodies {
            let (smallest, violated) = b.inertia.realizability();
            assert!(
                smallest > -1e-12 && violated < 1e-9,
                "{inertia:?} {smallest} {violated}"
            );
            assert!(b.inertia.mass() >= 0.0);
        }
    }
}

#[test]
fn a_body_that_can_exist_is_written_as_it_is() {
    let robot = Robot::load("panda").unwrap();
    let [urdf, ..] = written(&robot);
    let again = Robot::from_urdf_str(&urdf, "again").unwrap();
    for (a, b) in robot.bodies.iter().zip(&again.bodies) {
        for (x, y) in a.inertia.0.iter().zip(b.inertia.0) {
            assert!((x - y).abs() < 1e-12, "{}: {x} {y}", a.name);
        }
    }
}

#[test]
fn what_stands_in_comments_does_not_break_the_file() {
    let robot = Robot::load("planar2").unwrap();
    let plant = Plant::from(&robot);
    let remark = Remark {
        effect: "cogging",
        place: "a--b -->".into(),
        equation: "a sin kNq",
        values: vec!["amplitude = 1 N m".into()],
        held: None,
        element: None,
    };
    let model = Model {
        plant: &plant,
        robot: &robot,
        remarks: &[remark],
    };
    for (name, text) in write(&model) {
        let text = text.unwrap();
        assert!(
            text.contains("cogging") && text.contains("not in the values"),
            "{name}"
        );
        match name {
            "robot.toml" => assert!(toml::from_str::<toml::Table>(&text).is_ok()),
            "robot.urdf" => assert!(Robot::from_urdf_str(&text, "again").is_ok()),
            _ => assert_eq!(text.matches("-->").count(), 1),
        }
    }
}

#[test]
fn effects_of_a_closed_chain_stand_on_its_drives() {
    let plant = Plant::load("hexapod").unwrap();
    let found = |effect, element| Remark {
        effect,
        place: "leg2".into(),
        equation: "f",
        values: Vec::new(),
        held: None,
        element: Some(element),
    };
    let drag = Element::Drag {
        joint: 1,
        power: 2,
        factor: 300.0,
    };
    let gain = Element::Gain {
        joint: 1,
        error: 0.25,
    };
    let remarks = [
        found("nonlinear_viscous_friction", drag.into_function(1e-3)),
        found("torque_constant", gain),
    ];
    let model = Model {
        plant: &plant,
        robot: plant.robot(),
        remarks: &remarks,
    };
    let files: Vec<_> = write(&model).into_iter().collect();
    let text = |name: &str| {
        let file = files.iter().find(|(n, _)| *n == name);
        file.unwrap().1.as_ref().unwrap().clone()
    };
    let drive = text("robot.xml")
        .lines()
        .find(|l| l.contains("<general name=\"leg2\""))
        .unwrap()
        .to_string();
    assert!(drive.contains("gainprm=\"0.8\""), "{drive}");
    let effects = text("effects.py");
    let legs: Vec<String> = (1..=6).map(|k| format!("\"leg{k}\"")).collect();
    assert!(effects.contains(&format!("JOINTS = [{}]", legs.join(", "))));
    assert!(effects.contains("return 0.0, 300.0 * xp.abs(dq) ** 1 * dq"));
    assert!(effects.contains("ADDED = [(1, nonlinear_viscous_friction_1)]"));
    assert!(effects.contains("DRIVES = [(1, torque_constant_2, True)]"));
    assert!(effects.contains("def inverse(model, qpos, qvel, qacc, dt"));
    assert!(!effects.contains("DISPLACED") && !effects.contains("FREE"));
}
