//! Robot files of every bundled serial robot, loaded by MuJoCo where Python has it (`PYTHON` names the
//! interpreter; `python3` otherwise).

use excite::Plant;
use excite::export::{Model, Remark, write};
use excite::robot::Robot;
use std::path::Path;
use std::process::Command;

/// A Python with MuJoCo, or a word that there is none.
fn python() -> Option<String> {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let found = Command::new(&python).args(["-c", "import mujoco"]).output();
    match found.is_ok_and(|o| o.status.success()) {
        true => Some(python),
        false => {
            println!("skipped: {python} has no module mujoco");
            None
        }
    }
}

/// Output of a script with arguments.
fn run(python: &str, script: &str, arguments: &[&Path]) -> String {
    let out = Command::new(python)
        .arg("-c")
        .arg(script)
        .args(arguments)
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{error}");
    String::from_utf8(out.stdout).unwrap()
}

fn xml(plant: &Plant, robot: &Robot, remarks: &[Remark]) -> String {
    let model = Model {
        plant,
        robot,
        remarks,
    };
    let files = write(&model);
    let text = files.into_iter().find(|(name, _)| *name == "robot.xml");
    text.unwrap().1.unwrap()
}

/// Joint torques of a MuJoCo model for states `q q̇ q̈` a line, friction and damping left out.
const INVERSE: &str = r#"
import sys, mujoco, numpy
model = mujoco.MjModel.from_xml_path(sys.argv[1])
model.dof_frictionloss[:] = 0
model.dof_damping[:] = 0
model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
data = mujoco.MjData(model)
n = model.nv
for line in open(sys.argv[2]):
    x = numpy.array([float(v) for v in line.split()])
    data.qpos[:], data.qvel[:], data.qacc[:] = x[:n], x[n:2*n], x[2*n:]
    mujoco.mj_inverse(model, data)
    print(*data.qfrc_inverse)
"#;

/// Largest difference between torques of MuJoCo and of a serial robot at states shifted by `shift` in the
/// position of joint 0, with `extra` on it, over the largest torque.
fn differs(python: &str, xml: &str, robot: &Robot, shift: f64, extra: impl Fn(f64) -> f64) -> f64 {
    let folder = tempfile::tempdir().unwrap();
    let (model, states) = (
        folder.path().join("robot.xml"),
        folder.path().join("states"),
    );
    std::fs::write(&model, xml).unwrap();
    let mut bare = robot.clone();
    bare.joints.iter_mut().for_each(|j| j.terms[1..].fill(0.0));
    let plant = Plant::from(bare);
    let mut x = plant.random_states(40, 5);
    let (n, count) = (x.dof, x.count);
    let mut text = String::new();
    for s in 0..count {
        let row =
            |v: &[f64]| -> String { (0..n).map(|j| format!("{} ", v[j * count + s])).collect() };
        text += &format!("{}{}{}\n", row(&x.q), row(&x.qd), row(&x.qdd));
    }
    std::fs::write(&states, text).unwrap();
    let out = run(python, INVERSE, &[&model, &states]);
    let theirs: Vec<Vec<f64>> = out
        .lines()
        .map(|l| l.split_whitespace().map(|v| v.parse().unwrap()).collect())
        .collect();
    let more: Vec<f64> = x.q[..count].iter().map(|q| extra(*q)).collect();
    x.q[..count].iter_mut().for_each(|q| *q += shift);
    let ours = plant.nominal_torque(&x).unwrap();
    let size = ours.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let mut worst = 0.0f64;
    for (s, theirs) in theirs.iter().enumerate() {
        for (j, theirs) in theirs.iter().enumerate() {
            let ours = ours[j * count + s] + if j == 0 { more[s] } else { 0.0 };
            worst = worst.max((ours - theirs).abs());
        }
    }
    worst / size
}

#[test]
fn mujoco_loads_every_serial_robot_and_agrees() {
    let Some(python) = python() else { return };
    for name in ["planar2", "scara", "puma560", "panda", "iiwa14", "ur5e"] {
        let plant = Plant::load(name).unwrap();
        let off = differs(
            &python,
            &xml(&plant, plant.robot(), &[]),
            plant.robot(),
            0.0,
            |_| 0.0,
        );
        println!("{name}: off by {off:.1e}");
        assert!(off < 1e-6, "{name}: {off:e}");
    }
}

/// The XML with the attributes of a note on joint 0.
fn noted(plant: &Plant, attributes: &str) -> String {
    let text = xml(plant, plant.robot(), &[]);
    let name = format!("<joint name=\"{}\"", plant.robot().joints[0].name);
    assert!(text.contains(&name));
    text.replace(&name, &format!("{name} {attributes}"))
}

#[test]
fn signs_of_springs_and_references_are_those_of_mujoco() {
    let Some(python) = python() else { return };
    let plant = Plant::load("planar2").unwrap();
    let robot = plant.robot();
    // the diagnosis adds k (q − q₀) to the torque, and τ(q + δ) − τ(q) for an offset δ
    let (k, rest, offset) = (3.0, 0.4, 0.05);
    let spring = noted(&plant, &format!("stiffness=\"{k}\" springref=\"{rest}\""));
    let off = differs(&python, &spring, robot, 0.0, |q| k * (q - rest));
    assert!(off < 1e-6, "{off:e}");
    let turned = noted(&plant, &format!("ref=\"{}\"", -offset));
    let off = differs(&python, &turned, robot, offset, |_| 0.0);
    assert!(off < 1e-6, "{off:e}");
}
