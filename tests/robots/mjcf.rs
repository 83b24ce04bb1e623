//! MJCF files against MuJoCo's own inverse dynamics, where Python has it (`PYTHON` names the interpreter; `python3`
//! otherwise).

use super::common::python;
use excite::Plant;
use std::process::Command;

/// Everything that is read: classes, frames, an include, all forms of orientation, geoms of all kinds, several joints
/// in a body, references, slides, inertia that is bounded and scaled.
const MODEL: &str = r#"<mujoco model="all">
  <compiler angle="degree" eulerseq="zYx" balanceinertia="true" boundmass="0.01" boundinertia="0.0001"
    settotalmass="20"/>
  <option gravity="0.3 -1 -9"/>
  <default>
    <joint damping="0.3" armature="0.02"/>
    <geom density="700"/>
    <default class="heavy"><geom density="2000"/><joint axis="0 1 0" range="-90 90"/>
      <default class="quick"><joint damping="0.1"/></default></default>
  </default>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="a" pos="0.1 0.2 0.3" euler="20 30 40" childclass="heavy">
      <joint name="a1" pos="0.02 0.03 0.04" ref="15"/>
      <joint name="a2" axis="1 0 1" class="quick"/>
      <geom type="capsule" size="0.05" fromto="0 0 0 0.1 0.2 0.3"/>
      <frame pos="0.1 0 0" axisangle="1 1 0 50">
        <geom type="ellipsoid" size="0.1 0.05 0.08" quat="0.3 0.1 0.9 0.2"/>
        <body name="b" zaxis="0.3 0.2 0.8">
          <joint name="b1" type="slide" axis="0 1 1" range="-1 1" ref="0.1"/>
          <inertial pos="0.01 0.02 0.03" mass="1.2" fullinertia="0.02 0.03 0.025 0.001 0.002 -0.003"/>
          <include file="more.xml"/>
        </body>
      </frame>
      <body name="thin" xyaxes="0 1 0 -1 0 0.2" pos="0 0 0.3">
        <geom type="cylinder" size="0.03 0.2" mass="0.4"/>
        <geom type="box" size="0.1 0.2 0.05" pos="0.1 0 0" class="main"/>
        <body name="tip" pos="0 0.1 0">
          <joint name="t1" class="quick"/>
          <inertial pos="0 0 0" mass="0.001" diaginertia="0.00001 0.00002 0.1" euler="10 0 5"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>"#;
const MORE: &str = r#"<mujocoinclude>
  <body name="c" pos="0 0.1 0.1"><joint name="c1" damping="0.7" pos="0 0 0.1"/><geom size="0.06"/></body>
</mujocoinclude>"#;

const INVERSE: &str = r#"
import sys, mujoco, numpy
model = mujoco.MjModel.from_xml_path(sys.argv[1])
model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
data = mujoco.MjData(model)
print(*[model.joint(j).name for j in range(model.njnt)])
for line in open(sys.argv[2]):
    x = numpy.array([float(v) for v in line.split()]).reshape(3, -1)
    data.qpos[:], data.qvel[:], data.qacc[:] = x
    mujoco.mj_inverse(model, data)
    print(*data.qfrc_inverse)
"#;

#[test]
fn an_mjcf_has_the_inverse_dynamics_of_mujoco() {
    let folder = tempfile::tempdir().unwrap();
    let [model, more, states] = ["model.xml", "more.xml", "states"].map(|n| folder.path().join(n));
    std::fs::write(&model, MODEL).unwrap();
    std::fs::write(&more, MORE).unwrap();
    let plant = Plant::load(model.to_str().unwrap()).unwrap();
    let names: Vec<&str> = plant
        .robot()
        .joints
        .iter()
        .map(|j| j.name.as_str())
        .collect();
    assert_eq!(names, ["a1", "a2", "b1", "c1", "t1"]);
    let Some(python) = python::with("mujoco") else {
        return;
    };
    let x = plant.random_states(50, 3);
    let mut text = String::new();
    for s in 0..x.count {
        for rows in [&x.q, &x.qd, &x.qdd] {
            for j in 0..x.dof {
                text += &format!("{:e} ", rows[j * x.count + s]);
            }
        }
        text.push('\n');
    }
    std::fs::write(&states, text).unwrap();
    let out = Command::new(&python)
        .args(["-c", INVERSE])
        .args([&model, &states])
        .output()
        .unwrap();
    assert!(
        out.status.success(),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    let out = String::from_utf8(out.stdout).unwrap();
    let mut lines = out.lines();
    assert_eq!(lines.next().unwrap(), names.join(" "));
    let ours = plant.nominal_torque(&x).unwrap();
    let size = ours.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    for (s, line) in lines.enumerate() {
        for (j, theirs) in line.split_whitespace().enumerate() {
            let theirs: f64 = theirs.parse().unwrap();
            let off = (ours[j * x.count + s] - theirs).abs() / size;
            assert!(off < 1e-9, "{} at state {s}: off by {off:e}", names[j]);
        }
    }
}
