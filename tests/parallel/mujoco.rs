//! MuJoCo's file of parallel robots, loaded by MuJoCo where Python has it (`PYTHON` names the interpreter; `python3`
//! otherwise): closed in every pose, the same actuator forces, and at rest under the forces that hold it.

use super::common::python;
use super::loops::pairs;
use excite::Plant;
use excite::export::parts::Model;
use excite::export::write;
use excite::mechanism::Mechanism;
use std::process::Command;

/// Gap of the loops and rate at which it opens, actuator forces from MuJoCo's inverse dynamics of the tree and its own
/// Jacobians of the loops, for states `q q̇ q̈` of all joints a line; then how far the robot falls from home in 0.1 s under
/// the forces of the last line, and how far its loops open.
const SCRIPT: &str = r#"
import sys, mujoco, numpy
model = mujoco.MjModel.from_xml_path(sys.argv[1])
data = mujoco.MjData(model)
lines = open(sys.argv[2]).read().splitlines()
names = lines[0].split()
at = [model.joint(n).qposadr[0] for n in names]
n = model.nv
pairs = [(model.eq_obj1id[e], model.eq_obj2id[e], model.eq_type[e]) for e in range(model.neq)]

def jacobian():
    rows = []
    for a, b, kind in pairs:
        ja, ra, jb, rb = (numpy.zeros((3, n)) for _ in range(4))
        mujoco.mj_jacSite(model, data, ja, ra, a)
        mujoco.mj_jacSite(model, data, jb, rb, b)
        rows.append(ja - jb)
        if kind == mujoco.mjtEq.mjEQ_WELD:
            rows.append(ra - rb)
    return numpy.vstack(rows)

def gap():
    return max(numpy.linalg.norm(data.site_xpos[a] - data.site_xpos[b]) for a, b, _ in pairs)

drives = numpy.zeros((model.nu, n))
for a in range(model.nu):
    drives[a, model.jnt_dofadr[model.actuator_trnid[a, 0]]] = 1
usual = int(model.opt.disableflags)
model.opt.disableflags = usual | int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
for line in lines[1:-1]:
    x = numpy.array([float(v) for v in line.split()])
    q, qd, qdd = numpy.split(x, 3)
    data.qpos[at], data.qvel[at], data.qacc[at] = q, qd, qdd
    mujoco.mj_inverse(model, data)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    j = jacobian()
    both = numpy.hstack([drives.T, j.T])
    solution = numpy.linalg.lstsq(both, data.qfrc_inverse, rcond=1e-10)[0]
    left = numpy.abs(both @ solution - data.qfrc_inverse).max()
    print(gap(), numpy.abs(j @ data.qvel).max(), left, *solution[:model.nu])
model.opt.disableflags = usual
mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
home = data.qpos.copy()
data.ctrl[:] = [float(v) for v in lines[-1].split()]
widest = 0
while data.time < 0.1:
    mujoco.mj_step(model, data)
    widest = max(widest, gap())
print(numpy.abs(data.qpos - home).max(), widest)
"#;

/// The same without friction, which inverse dynamics of MuJoCo counts as a constraint.
fn smooth(mut m: Mechanism) -> Mechanism {
    for joint in &mut m.robot.joints {
        joint.terms[1..].fill(0.0);
    }
    m
}

fn check(python: &str, name: &str, m: Mechanism) {
    let plant = Plant::from(smooth(m));
    let m = plant.mechanism().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let (model, file) = (
        folder.path().join("robot.xml"),
        folder.path().join("states"),
    );
    let xml = write(&Model {
        plant: &plant,
        robot: plant.robot(),
        remarks: &[],
    })
    .into_iter()
    .find(|(name, _)| *name == "robot.xml")
    .unwrap()
    .1
    .unwrap();
    assert!(xml.contains("<connect name=\"loop1\""), "{xml}");
    std::fs::write(&model, &xml).unwrap();
    let x = plant.random_states(25, 5);
    let tree = m.motion(&x).unwrap().tree;
    let mut text = plant.robot().joint_names().join(" ") + "\n";
    for s in 0..tree.count {
        for v in [&tree.q, &tree.qd, &tree.qdd] {
            (0..tree.dof).for_each(|j| text += &format!("{} ", v[j * tree.count + s]));
        }
        text += "\n";
    }
    let mut rest = plant.random_states(1, 1);
    rest.q.copy_from_slice(&m.home);
    rest.qd.fill(0.0);
    rest.qdd.fill(0.0);
    for hold in plant.nominal_torque(&rest).unwrap() {
        text += &format!("{hold} ");
    }
    std::fs::write(&file, text).unwrap();
    let out = Command::new(python)
        .args(["-c", SCRIPT])
        .arg(&model)
        .arg(&file)
        .output()
        .unwrap();
    assert!(
        out.status.success(),
        "{name}: {}",
        String::from_utf8_lossy(&out.stderr)
    );
    let text = String::from_utf8(out.stdout).unwrap();
    let lines: Vec<Vec<f64>> = text
        .lines()
        .map(|l| l.split_whitespace().map(|v| v.parse().unwrap()).collect())
        .collect();
    let ours = plant.nominal_torque(&x).unwrap();
    let size = ours.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let (mut gap, mut rate, mut left, mut off) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
    for (s, line) in lines[..x.count].iter().enumerate() {
        gap = gap.max(line[0]);
        rate = rate.max(line[1]);
        left = left.max(line[2] / size);
        for (a, theirs) in line[3..].iter().enumerate() {
            off = off.max((ours[a * x.count + s] - theirs).abs() / size);
        }
    }
    let end = &lines[x.count];
    println!(
        "{name}: loops open by {gap:.1e} m and {rate:.1e} m/s, forces off by {off:.1e} (unexplained {left:.1e}); at rest for 0.1 s it \
         moves by {:.1e}, its loops open by {:.1e} m",
        end[0], end[1]
    );
    assert!(gap < 1e-8 && rate < 1e-7, "{name}: {gap:e} {rate:e}");
    assert!(off < 1e-5 && left < 1e-5, "{name}: {off:e} {left:e}");
    assert!(end[0] < 2e-3 && end[1] < 1e-4, "{name}: {end:?}");
}

#[test]
fn mujoco_loads_every_parallel_robot_and_agrees() {
    let Some(python) = python::with("mujoco") else {
        return;
    };
    for name in ["hexapod", "h4", "delta"] {
        let plant = Plant::load(name).unwrap();
        check(&python, name, plant.mechanism().unwrap().clone());
    }
    for (_, loops) in pairs() {
        let name = format!("{} with loops", loops.robot.name);
        check(&python, &name, loops);
    }
}
