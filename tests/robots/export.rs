//! Robot files of every bundled serial robot, loaded by MuJoCo where Python has it (`PYTHON` names the
//! interpreter; `python3` otherwise).

use super::common::python;
use excite::Plant;
use excite::export::parts::Model;
use excite::export::{Remark, write};
use excite::robot::Robot;
use std::path::Path;
use std::process::Command;

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
    let Some(python) = python::with("mujoco") else {
        return;
    };
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
    let Some(python) = python::with("mujoco") else {
        return;
    };
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

/// A format that is written on demand.
fn demanded(plant: &Plant, name: &str, remarks: &[Remark]) -> String {
    let model = Model {
        plant,
        robot: plant.robot(),
        remarks,
    };
    let format = excite::export::further(&[name.to_string()], plant).unwrap()[0];
    format.write(&model).unwrap()
}

#[test]
fn sdf_has_the_numbers_of_the_robot() {
    for name in ["scara", "panda", "ur5e"] {
        let plant = Plant::load(name).unwrap();
        let text = demanded(&plant, "sdf", &[]);
        let all = roxmltree::Document::parse(&text).unwrap();
        let under = |node: roxmltree::Node, path: &[&str]| -> Vec<f64> {
            let mut at = node;
            for tag in path {
                at = at.children().find(|c| c.has_tag_name(*tag)).unwrap();
            }
            let text = at.text().unwrap_or_default();
            text.split_whitespace()
                .map(|x| x.parse().unwrap())
                .collect()
        };
        let find = |tag: &str, name: &str| {
            let mut nodes = all.descendants().filter(|n| n.has_tag_name(tag));
            nodes.find(|n| n.attribute("name") == Some(name)).unwrap()
        };
        for body in &plant.robot().bodies {
            let link = find("link", &body.name);
            let pose = under(link, &["pose"]);
            let turn = nalgebra::Rotation3::from_euler_angles(pose[3], pose[4], pose[5]);
            assert!((turn.matrix() - body.rotation).norm() < 1e-12);
            assert!((nalgebra::Vector3::from_row_slice(&pose[..3]) - body.position).norm() < 1e-12);
            assert!((under(link, &["inertial", "mass"])[0] - body.inertia.mass()).abs() < 1e-12);
            let moment = under(link, &["inertial", "inertia", "ixy"])[0];
            assert!((moment - body.inertia.tensor_com().m12).abs() < 1e-9);
            let joint = &plant.robot().joints[body.coordinate];
            let node = find("joint", &body.joint_name);
            if joint.name == body.joint_name {
                let damping = under(node, &["axis", "dynamics", "damping"])[0];
                assert_eq!(damping, joint.terms[1]);
            }
        }
    }
}

const USD: &str = r#"
import sys
from pxr import Usd, UsdGeom, UsdPhysics, Gf
stage = Usd.Stage.Open(sys.argv[1])
mass, joints = 0.0, 0
at = lambda p: UsdGeom.XformCache().GetLocalToWorldTransform(stage.GetPrimAtPath(p))
for prim in stage.Traverse():
    if prim.HasAPI(UsdPhysics.MassAPI):
        mass += UsdPhysics.MassAPI(prim).GetMassAttr().Get()
    for kind in (UsdPhysics.RevoluteJoint, UsdPhysics.PrismaticJoint):
        if prim.IsA(kind):
            joint = kind(prim)
            joints += 1
            assert joint.GetAxisAttr().Get() == "X"
            ends = []
            for k in (0, 1):
                body = getattr(joint, f"GetBody{k}Rel")().GetTargets()[0]
                p = getattr(joint, f"GetLocalPos{k}Attr")().Get()
                r = Gf.Rotation(Gf.Quatd(getattr(joint, f"GetLocalRot{k}Attr")().Get()))
                ends.append(Gf.Matrix4d(r, Gf.Vec3d(p)) * at(body))
            for i in range(4):
                for j in range(4):
                    assert abs(ends[0][i][j] - ends[1][i][j]) < 1e-5, (prim, ends)
print(mass, joints)
"#;

#[test]
fn usd_is_read_by_its_own_library() {
    // of the package usd-core
    let Some(python) = python::with("pxr") else {
        return;
    };
    for name in ["scara", "panda", "ur5e"] {
        let plant = Plant::load(name).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("robot.usda");
        std::fs::write(&path, demanded(&plant, "usd", &[])).unwrap();
        let out = run(&python, USD, &[&path]);
        let said: Vec<f64> = out.split_whitespace().map(|x| x.parse().unwrap()).collect();
        let mass: f64 = plant.robot().bodies.iter().map(|b| b.inertia.mass()).sum();
        // the base has a kilogram
        assert!((said[0] - 1.0 - mass).abs() < 1e-4, "{name}: {out}");
        assert_eq!(said[1] as usize, plant.robot().bodies.len());
    }
}

const ISAAC: &str = r#"
import sys, types, re
class Cfg:
    def __init__(self, **keys): self.__dict__.update(keys)
module = types.ModuleType("isaaclab.actuators")
module.ImplicitActuatorCfg = module.DelayedPDActuatorCfg = Cfg
sys.modules["isaaclab"], sys.modules["isaaclab.actuators"] = types.ModuleType("isaaclab"), module
space = {}
exec(open(sys.argv[1]).read(), space)
for name, cfg in space["ACTUATORS"].items():
    assert re.fullmatch(cfg.joint_names_expr[0], name)
    print(name, cfg.armature, cfg.viscous_friction, cfg.friction, getattr(cfg, "max_delay", 0))
"#;

#[test]
fn isaac_lab_has_the_terms_of_the_joints() {
    let Some(python) = python::with("sys") else {
        return;
    };
    let plant = Plant::load("planar2").unwrap();
    let late = Remark {
        effect: "torque_delay",
        place: "joint \"1\"".into(),
        equation: "",
        values: Vec::new(),
        held: None,
        element: Some(excite::export::Element::Delay {
            joints: vec![1],
            seconds: -0.02,
        }),
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("actuators.py");
    std::fs::write(&path, demanded(&plant, "isaac-lab", &[late])).unwrap();
    let out = run(&python, ISAAC, &[&path]);
    let lines: Vec<&str> = out.lines().collect();
    assert_eq!(lines.len(), 2);
    for (k, (line, joint)) in lines.iter().zip(&plant.robot().joints).enumerate() {
        let said: Vec<f64> = line
            .split(' ')
            .skip(1)
            .map(|x| x.parse().unwrap())
            .collect();
        assert_eq!(said[..3], [joint.terms[0], joint.terms[1], joint.terms[2]]);
        assert_eq!(said[3], [0.0, 4.0][k]);
    }
    assert!(excite::export::further(&["webots".into()], &plant).is_err());
}
