//! Models written into scenes of their users, against the files that are written without one: MuJoCo's inverse dynamics
//! is the same (`PYTHON` names the interpreter; `python3` otherwise).

use super::common::python;
use excite::Plant;
use excite::export::parts::Model;
use excite::export::{Element, Remark, into_scene, write};
use excite::robot::parts::JointTerm;
use excite::robot::{Inertia, Robot};
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use std::path::Path;
use std::process::Command;

const ARM: &str = r#"<mujoco model="arm">
  <!-- the arm, as its maker gives it -->
  <compiler angle="degree" eulerseq="zyx"/>
  <default>
    <joint armature="0.02" damping="0.4"/>
    <default class="small"><joint damping="0.2" frictionloss="0.3"/></default>
  </default>
  <worldbody>
    <body name="stand" BASE>
      <geom type="box" size="0.1 0.1 0.05" contype="0" conaffinity="0"/>
      <body name="shoulder" pos="0.02 0 0.3" euler="20 0 0">
        <joint name="a" axis="0 0 1" ref="15" range="-170 170"/>
        <inertial pos="0.01 0.02 0.05" mass="4" diaginertia="0.05 0.06 0.03" quat="0.9 0.1 0.2 0.3"/>
        <body name="upper" pos="0 0.1 0.1" euler="10 40 0" childclass="small">
          <frame pos="0.01 0 0">
            <joint name="b" axis="0 1 0" pos="0.02 0 0.01"/>
          </frame>
          <geom type="capsule" size="0.04" fromto="0 0 0 0 0 0.4" contype="0" conaffinity="0"/>
          <body name="fore" pos="0 0 0.4">
            <joint name="c" axis="0 1 0" class="small"/>
            <inertial pos="0 0 0.1" mass="1.5" fullinertia="0.02 0.02 0.004 0.001 0 0"/>
            <body name="rail" pos="0 0 0.2"><joint name="d" type="slide" axis="1 0 1"/>
              <inertial pos="0 0 0.05" mass="0.8" diaginertia="0.002 0.002 0.001"/>
              <body name="hand" pos="0 0 0.1" euler="0 30 0">
                <inertial pos="0 0 0.02" mass="0.4" diaginertia="0.0004 0.0004 0.0003"/>
                <body name="finger"><joint name="grip" type="slide" axis="0 1 0" damping="1"/>
                  <inertial pos="0 0 0.05" mass="0.05" diaginertia="0.00004 0.00004 0.00003"/></body>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"#;
const SCENE: &str = r#"<mujoco model="my scene">
  <include file="parts/arm.xml"/>
  <!-- do not touch: tuned on Friday -->
  <option timestep="0.001" gravity="0 0 -9.8"/>
  <worldbody>
    <body name="cube" pos="1 1 1"><freejoint/><geom size="0.05" mass="0.2"/></body>
    <camera name="front" pos="2 0 1"/>
  </worldbody>
  <actuator>
    <motor name="ma" joint="a" gear="3" ctrlrange="-1 1"/>
    <position name="pb" joint="b" kp="100"/>
  </actuator>
  <keyframe><key name="up" qpos="10 20 30 0.1 0.01 0 0 1 1 0 0 0"/></keyframe>
</mujoco>
"#;

const COMPARE: &str = r#"
import sys, mujoco, numpy as np
models = [mujoco.MjModel.from_xml_path(p) for p in sys.argv[1:3]]
rng = np.random.default_rng(1)
names = [models[0].joint(j).name for j in range(models[0].njnt)]
for m in models:
    m.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
worst = size = 0.0
for _ in range(60):
    x = rng.normal(size=(3, len(names)))
    out = []
    for m in models:
        d = mujoco.MjData(m)
        for k, n in enumerate(names):
            j = m.joint(n)
            d.qpos[j.qposadr[0]], d.qvel[j.dofadr[0]], d.qacc[j.dofadr[0]] = x[:, k]
        mujoco.mj_inverse(m, d)
        out.append([d.qfrc_inverse[m.joint(n).dofadr[0]] for n in names])
    out = np.array(out)
    worst, size = max(worst, abs(out[0] - out[1]).max()), max(size, abs(out[0]).max())
m = models[1]
print(worst / size, m.actuator("ma").gear[0], m.actuator("pb").gainprm[0], m.nkey, m.ncam, *m.key_qpos[0][:m.nq])
"#;

/// The folder of a user whose base stands as `base` says, and the robot in it.
fn user(folder: &Path, base: &str) -> Plant {
    let parts = folder.join("parts");
    std::fs::create_dir_all(&parts).unwrap();
    let arm = |base: &str| ARM.replace(" BASE", base);
    std::fs::write(parts.join("arm.xml"), arm(base)).unwrap();
    std::fs::write(folder.join("scene.xml"), SCENE).unwrap();
    std::fs::write(folder.join("alone.xml"), arm("")).unwrap();
    std::fs::write(
        folder.join("robot.toml"),
        "urdf = \"alone.xml\"\n[lock]\ngrip = 0.0\n",
    )
    .unwrap();
    Plant::load(folder.join("robot.toml").to_str().unwrap()).unwrap()
}

fn remark(element: Element) -> Remark {
    Remark {
        effect: "test",
        place: "here".into(),
        equation: "",
        values: Vec::new(),
        held: None,
        element: Some(element),
    }
}

/// Other values everywhere.
fn better(robot: &Robot) -> Robot {
    let mut out = robot.clone();
    for (k, body) in out.bodies.iter_mut().enumerate() {
        let more = Inertia::from_com(
            0.3 + 0.1 * k as f64,
            Vector3::new(0.01, -0.02, 0.03 * k as f64),
            Matrix3::from_diagonal(&Vector3::new(0.002, 0.003, 0.0025)),
        );
        body.inertia = body.inertia + more;
    }
    for (k, joint) in out.joints.iter_mut().enumerate() {
        joint.terms[JointTerm::Armature as usize] += 0.01 * k as f64;
        joint.terms[JointTerm::Viscous as usize] *= 1.5;
        joint.terms[JointTerm::Coulomb as usize] += 0.2;
        joint.terms[JointTerm::Offset as usize] = 0.3 - 0.2 * k as f64;
    }
    let axis = Unit::new_normalize(out.bodies[1].axis);
    out.bodies[1].rotation *= Rotation3::from_axis_angle(&axis, 0.04).matrix();
    let (axis, rotation) = (out.bodies[3].axis, out.bodies[3].rotation);
    out.bodies[3].position += rotation * axis * 0.01;
    out.gravity += Vector3::new(0.2, -0.1, 0.0);
    out
}

/// Writes both files and compares them; gives what MuJoCo says of the scene.
fn compare(folder: &Path, plant: &Plant, remarks: &[Remark], python: &str) -> Vec<f64> {
    let robot = better(plant.robot());
    let model = Model {
        plant,
        robot: &robot,
        remarks,
    };
    let out = folder.join("out/deep");
    let edited = into_scene(&model, &folder.join("scene.xml"), &out).unwrap();
    for (name, text) in &edited.files {
        let path = out.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    let scene = std::fs::read_to_string(out.join("scene.xml")).unwrap();
    assert!(scene.contains("<!-- do not touch: tuned on Friday -->"));
    let arm = std::fs::read_to_string(out.join("parts/arm.xml")).unwrap();
    assert!(arm.contains("<!-- the arm, as its maker gives it -->"));
    assert!(arm.contains("mass=\"0.4\" diaginertia=\"0.0004 0.0004 0.0003\""));
    let files = write(&model);
    let (_, xml) = files.into_iter().find(|f| f.0 == "robot.xml").unwrap();
    // the base of the generated file is that of the robot
    std::fs::write(out.join("robot.xml"), xml.unwrap()).unwrap();
    let run = Command::new(python)
        .args(["-c", COMPARE])
        .args([out.join("robot.xml"), out.join("scene.xml")])
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success(), "{error}");
    let text = String::from_utf8(run.stdout).unwrap();
    println!("{text}");
    let all = text.split_whitespace().map(|x| x.parse().unwrap());
    all.collect()
}

#[test]
fn a_scene_has_the_inverse_dynamics_of_the_written_robot() {
    let Some(python) = python::with("mujoco") else {
        return;
    };
    for base in ["", " pos=\"0.3 0.2 0.1\" euler=\"90 5 0\""] {
        let folder = tempfile::tempdir().unwrap();
        let plant = user(folder.path(), base);
        let said = compare(folder.path(), &plant, &[], &python);
        assert!(said[0] < 1e-6, "{base}: off by {:e}", said[0]);
        assert_eq!(said[1..5], [3.0, 100.0, 1.0, 1.0]);
        assert_eq!(said[5..8], [10.0, 20.0, 30.0]);
    }
}

/// The same robot with the frames of its links turned, and moved along their axes.
fn in_other_frames(robot: &Robot) -> Robot {
    let mut out = robot.clone();
    let own = |b: usize| {
        let k = b as f64;
        let turn = Rotation3::from_euler_angles(0.4 + k, 0.3 * k - 1.0, 2.0 - k).into_inner();
        (turn, robot.bodies[b].axis * (0.1 - 0.03 * k))
    };
    for (b, body) in out.bodies.iter_mut().enumerate() {
        let (r, p) = own(b);
        body.position += body.rotation * p;
        body.rotation *= r;
        if let Some(parent) = body.parent {
            let (r, p) = own(parent);
            body.position = r.transpose() * (body.position - p);
            body.rotation = r.transpose() * body.rotation;
        }
        body.axis = r.transpose() * body.axis;
        body.inertia = body
            .inertia
            .in_parent(&r.transpose(), &(r.transpose() * -p));
        body.meant = None;
    }
    out
}

#[test]
fn a_scene_of_a_robot_with_other_frames() {
    let Some(python) = python::with("mujoco") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let plant = user(folder.path(), " pos=\"0 0 0.5\"");
    let robot = in_other_frames(plant.robot());
    let turned = Plant::from(&robot);
    let said = compare(folder.path(), &turned, &[], &python);
    assert!(said[0] < 1e-6, "off by {:e}", said[0]);
    // other names, the same robot: nothing to change
    let mut robot = robot;
    let other = |name: &mut String| *name = format!("arm_{name}");
    robot.joints.iter_mut().for_each(|j| other(&mut j.name));
    robot
        .bodies
        .iter_mut()
        .for_each(|b| other(&mut b.joint_name));
    let plant = Plant::from(&robot);
    let model = Model {
        plant: &plant,
        robot: &robot,
        remarks: &[],
    };
    let scene = folder.path().join("scene.xml");
    let edited = into_scene(&model, &scene, &folder.path().join("none")).unwrap();
    let said = |w: &excite::Warning| w.message.contains("arm_a is a");
    assert!(edited.warnings.iter().any(said));
    let changed = edited.changes.iter().map(|c| c.attribute.as_str());
    // the robot file has the standard gravity, and the scene another
    assert_eq!(changed.collect::<Vec<_>>(), ["gravity"]);
}

#[test]
fn effects_that_are_elements_are_in_the_scene() {
    let Some(python) = python::with("mujoco") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let plant = user(folder.path(), " pos=\"0.3 0.2 0.1\" euler=\"90 5 0\"");
    let load = Inertia::from_com(0.25, Vector3::new(0.0, 0.01, 0.05), Matrix3::zeros());
    let remarks = [
        Element::Drag {
            joint: 0,
            power: 2,
            factor: 0.3,
        },
        Element::Spring {
            joint: 1,
            coefficients: [0.5, 3.0, 0.2, 0.1],
        },
        Element::Coupling {
            joints: [1, 2],
            ratio: -0.5,
            coulomb: 0.2,
            viscous: 0.3,
            inertia: 0.05,
        },
        Element::Gain {
            joint: 0,
            error: 0.2,
        },
        Element::Gain {
            joint: 1,
            error: 0.25,
        },
        Element::Twist {
            joint: 2,
            stiffness: 300.0,
            cubic: 0.0,
            damping: 0.5,
            gap: 0.0,
        },
        Element::Base {
            stiffness: [2000.0, 3000.0],
            damping: [5.0, 6.0],
            inertia: [0.5, 0.6],
        },
        Element::Load {
            body: 3,
            inertia: load,
        },
    ]
    .map(remark);
    let said = compare(folder.path(), &plant, &remarks, &python);
    assert!(said[0] < 1e-6, "off by {:e}", said[0]);
    assert!((said[1] - 3.0 / 1.2).abs() < 1e-12 && (said[2] - 80.0).abs() < 1e-9);
    // the joints of the base, and the second one behind `c`
    assert_eq!(said[5..12], [0.0, 0.0, 10.0, 20.0, 30.0, 0.0, 0.1]);
}
