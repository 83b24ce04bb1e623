//! MuJoCo's file of parallel robots, loaded by MuJoCo where Python has it (`PYTHON` names the interpreter; `python3`
//! otherwise): closed in every pose, the same actuator forces, and at rest under the forces that hold it.

use super::common::python;
use super::loops::pairs;
use excite::Plant;
use excite::export::parts::Model;
use excite::export::write;
use excite::mechanism::Mechanism;
use std::process::Command;

/// A hexapod whose legs have mass and friction.
const HEXAPOD: &str = include_str!("../../src/mechanism/bundled/hexapod.toml");

/// Gap of the loops and rate at which it opens, actuator forces from MuJoCo's inverse dynamics of the tree and its own
/// Jacobians of the loops, for states `q q̇ q̈` of all joints a line; then how far the robot falls from home in 0.1 s under
/// the forces of the last line, and how far its loops open.
const SCRIPT: &str = r#"
import sys, mujoco, numpy
model = mujoco.MjModel.from_xml_path(sys.argv[1])
data = mujoco.MjData(model)
lines = open(sys.argv[2]).read().splitlines()
names = lines[0].split()
# legs without mass are tendons: they have no joints
known = [k for k, n in enumerate(names) if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, n) >= 0]
at = [model.joint(names[k]).qposadr[0] for k in known]
n = model.nv
pairs = [(model.eq_obj1id[e], model.eq_obj2id[e], model.eq_type[e]) for e in range(model.neq)]

def jacobian():
    rows = [numpy.zeros((0, n))]
    for a, b, kind in pairs:
        ja, ra, jb, rb = (numpy.zeros((3, n)) for _ in range(4))
        mujoco.mj_jacSite(model, data, ja, ra, a)
        mujoco.mj_jacSite(model, data, jb, rb, b)
        rows.append(ja - jb)
        if kind == mujoco.mjtEq.mjEQ_WELD:
            rows.append(ra - rb)
    return numpy.vstack(rows)

def gap():
    return max([0] + [numpy.linalg.norm(data.site_xpos[a] - data.site_xpos[b]) for a, b, _ in pairs])

def drives():
    rows = numpy.zeros((model.nu, n))
    for a in range(model.nu):
        on = model.actuator_trnid[a, 0]
        if model.actuator_trntype[a] == mujoco.mjtTrn.mjTRN_JOINT:
            rows[a, model.jnt_dofadr[on]] = 1
            continue
        first = model.tendon_adr[on]
        one, two = model.wrap_objid[first], model.wrap_objid[first + 1]
        ja, jb = numpy.zeros((3, n)), numpy.zeros((3, n))
        mujoco.mj_jacSite(model, data, ja, None, one)
        mujoco.mj_jacSite(model, data, jb, None, two)
        way = data.site_xpos[two] - data.site_xpos[one]
        rows[a] = way / numpy.linalg.norm(way) @ (jb - ja)
    return rows

zero = None
usual = int(model.opt.disableflags)
model.opt.disableflags = usual | int(mujoco.mjtDisableBit.mjDSBL_EQUALITY)
for line in lines[1:-1]:
    x = numpy.array([float(v) for v in line.split()])
    all_q, all_qd, _ = numpy.split(x, 3)
    q, qd, qdd = (part[known] for part in numpy.split(x, 3))
    data.qpos[at], data.qvel[at], data.qacc[at] = q, qd, qdd
    mujoco.mj_inverse(model, data)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    j, d = jacobian(), drives()
    both = numpy.hstack([d.T, j.T])
    solution = numpy.linalg.lstsq(both, data.qfrc_inverse, rcond=1e-10)[0]
    left = numpy.abs(both @ solution - data.qfrc_inverse).max()
    off, rate = gap(), numpy.abs(j @ data.qvel).max(initial=0)
    if model.ntendon:
        legs = [names.index(model.tendon(t).name) for t in range(model.ntendon)]
        mujoco.mj_tendon(model, data)
        apart = data.ten_length - all_q[legs]
        zero = apart if zero is None else zero
        off, rate = numpy.abs(apart - zero).max(), numpy.abs(d @ data.qvel - all_qd[legs]).max()
    # what a drive does without a command is not in its command
    print(off, rate, left, *(solution[:model.nu] - model.actuator_biasprm[:, 0]))
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

/// Below this velocity of an actuator, rad/s or m/s, dry friction of MuJoCo is not that of a sign.
const SLOW: f64 = 0.02;

/// The same without friction and rotors.
fn smooth(mut m: Mechanism) -> Mechanism {
    for joint in &mut m.robot.joints {
        joint.terms[1..].fill(0.0);
    }
    m
}

/// Compares a robot, which is at rest under the forces that hold it and a `push` on the first actuator, N or N m.
fn check(python: &str, name: &str, m: Mechanism, push: f64) {
    let plant = Plant::from(m);
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
    let weightless = |b: &excite::robot::Body| b.name == "rod1" && b.inertia.mass() == 0.0;
    match plant.robot().bodies.iter().any(weightless) {
        true => assert!(xml.contains("<site site=\"loop1_a\"/>"), "{xml}"),
        false => assert!(xml.contains("<connect name=\"loop1\""), "{xml}"),
    }
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
    for (a, hold) in plant.nominal_torque(&rest).unwrap().into_iter().enumerate() {
        let push = if a == 0 { push } else { 0.0 };
        text += &format!("{} ", hold + push);
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
    let mut compared = 0;
    for (s, line) in lines[..x.count].iter().enumerate() {
        gap = gap.max(line[0]);
        rate = rate.max(line[1]);
        left = left.max(line[2] / size);
        let slow = |a: &usize| tree.at(*a, s)[1].abs() < SLOW;
        if push != 0.0 && plant.actuated().iter().any(slow) {
            continue;
        }
        compared += 1;
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
    assert!(compared > 10, "{name}: {compared}");
}

#[test]
fn mujoco_loads_every_parallel_robot_and_agrees() {
    let Some(python) = python::with("mujoco") else {
        return;
    };
    for name in ["hexapod", "h4", "delta"] {
        let plant = Plant::load(name).unwrap();
        let mechanism = smooth(plant.mechanism().unwrap().clone());
        check(&python, name, mechanism, 0.0);
    }
    for (_, loops) in pairs() {
        let name = format!("{} with loops", loops.robot.name);
        check(&python, &name, smooth(loops), 0.0);
    }
}

/// On joints that move no mass by themselves MuJoCo's usual constraint of dry friction is next to none.
#[test]
fn legs_without_mass_keep_their_dry_friction_in_mujoco() {
    let Some(python) = python::with("mujoco") else {
        return;
    };
    let light = HEXAPOD
        .lines()
        .filter(|l| !l.starts_with("cylinder = ") && !l.starts_with("rod = "));
    let text = light.collect::<Vec<_>>().join("\n");
    let text = text
        .replace("bodies = \"legs\"", "bodies = \"platform\"")
        .replace(
            "coulomb = 25.0",
            "coulomb = 25.0\narmature = 3.0\noffset = 7.5",
        );
    assert!(text.contains("offset = 7.5"));
    let massless = Mechanism::from_toml_str(&text, "robot.toml").unwrap();
    let with_mass = Mechanism::from_toml_str(HEXAPOD, "robot.toml").unwrap();
    let coulomb = massless.robot.joints[massless.actuated[0]].terms[2];
    assert!(coulomb > 10.0);
    check(&python, "legs without mass", massless, 0.5 * coulomb);
    check(&python, "legs with mass", with_mass, 0.5 * coulomb);
}
