//! The files as other programs read them: Python with PyYAML, `mcap` and `rosbags`, MuJoCo, a C compiler.

use super::{Folder, NINE, compare, designed, motion, state};
use std::io::Write;
use std::process::Command;

/// A Python that has these modules, or a word that there is none.
fn python(modules: &str) -> Option<String> {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let found = Command::new(&python)
        .args(["-c", &format!("import {modules}")])
        .output();
    let there = found.is_ok_and(|o| o.status.success());
    if !there {
        let _ = writeln!(
            std::io::stderr(),
            "skipped: {python} cannot import {modules}"
        );
    }
    there.then_some(python)
}

/// Rows of numbers that a script prints.
fn rows(folder: &Folder, python: &str, script: &str, arguments: &[&str]) -> Vec<Vec<f64>> {
    let out = Command::new(python)
        .current_dir(folder.0.path())
        .arg("-c")
        .arg(script)
        .args(arguments)
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{error}");
    let text = String::from_utf8(out.stdout).unwrap();
    let numbers = |l: &str| -> Vec<f64> { l.split(' ').map(|x| x.parse().unwrap()).collect() };
    text.lines().map(numbers).collect()
}

/// Rows `t, q…, dq…, ddq…` against the series.
fn states(rows: &[Vec<f64>], robot: &str, rate: f64) {
    let f = motion(robot);
    assert_eq!(rows.len(), (f.period * rate).round() as usize + 1);
    for row in rows {
        let expected = state(&f, row[0]).concat();
        assert_eq!(row.len(), 1 + expected.len());
        for (a, b) in row[1..].iter().zip(expected) {
            assert!((a - b).abs() < 1e-9, "{} s: {a}, not {b}", row[0]);
        }
    }
}

#[test]
fn python_reads_the_yaml() {
    let Some(python) = python("yaml") else { return };
    let folder = Folder::new();
    folder.export(&designed("panda"), "--format ros2 --rate 40", "a.yaml");
    let script = "
import sys, yaml
m = yaml.safe_load(open('a.yaml'))
assert m['joint_names'] == [f'panda_joint{i}' for i in range(1, 8)]
assert m['header'] == {'stamp': {'sec': 0, 'nanosec': 0}, 'frame_id': ''}
for p in m['points']:
    t = p['time_from_start']
    row = p['positions'] + p['velocities'] + p['accelerations']
    assert all(type(x) is float for x in row)
    print(t['sec'] + 1e-9 * t['nanosec'], *row)
";
    states(&rows(&folder, &python, script, &[]), "panda", 40.0);
}

/// With the reader of the MCAP project and its decoder of ROS 2 messages.
#[test]
fn mcap_reads_the_bag() {
    let Some(python) = python("mcap_ros2.reader") else {
        return;
    };
    let folder = Folder::new();
    folder.export(&designed("panda"), "--format ros2-mcap --rate 40", "a.mcap");
    let script = "
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
with open('a.mcap', 'rb') as file:
    reader = make_reader(file, decoder_factories=[DecoderFactory()], validate_crcs=True)
    summary = reader.get_summary()
    assert summary.statistics.message_count == 1 and len(summary.chunk_indexes) == 1
    assert reader.get_header().profile == 'ros2'
    found = list(reader.iter_decoded_messages())
assert len(found) == 1
schema, channel, message, m = found[0]
assert schema.name == 'trajectory_msgs/msg/JointTrajectory'
assert channel.topic == '/joint_trajectory_controller/joint_trajectory'
assert m.joint_names == [f'panda_joint{i}' for i in range(1, 8)]
for p in m.points:
    t = p.time_from_start
    assert len(p.effort) == 0
    print(t.sec + 1e-9 * t.nanosec, *p.positions, *p.velocities, *p.accelerations)
";
    states(&rows(&folder, &python, script, &[]), "panda", 40.0);
}

/// With another reader, which has the definition of the message from ROS itself, not from the file.
#[test]
fn rosbags_reads_the_bag() {
    let Some(python) = python("rosbags.highlevel") else {
        return;
    };
    let folder = Folder::new();
    folder.export(&designed("ur5e"), "--format ros2-mcap --rate 40", "a.mcap");
    let script = "
from pathlib import Path
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
store = get_typestore(Stores.ROS2_JAZZY)
with AnyReader([Path('a.mcap')], default_typestore=store) as reader:
    assert reader.message_count == 1
    for connection, stamp, raw in reader.messages():
        m = reader.deserialize(raw, connection.msgtype)
        again = store.deserialize_cdr(raw, 'trajectory_msgs/msg/JointTrajectory')
        assert bytes(store.serialize_cdr(again, 'trajectory_msgs/msg/JointTrajectory')) == bytes(raw)
for p in m.points:
    t = p.time_from_start
    print(t.sec + 1e-9 * t.nanosec, *p.positions, *p.velocities, *p.accelerations)
";
    states(&rows(&folder, &python, script, &[]), "ur5e", 40.0);
}

/// The program for the xArm, run against an arm that takes notes, on a clock that ticks when it is read.
#[test]
fn the_program_for_the_xarm_sends_the_points() {
    let Some(python) = python("json") else { return };
    let folder = Folder::new();
    let script = "
import importlib.util, sys
spec = importlib.util.spec_from_file_location('program', sys.argv[1])
program = importlib.util.module_from_spec(spec)
spec.loader.exec_module(program)
class Arm:
    mode, away, sent = None, float(sys.argv[2]), []
    def __init__(self): self.times = []
    def motion_enable(self, enable): return 0
    def set_mode(self, mode): self.mode = mode; return 0
    def set_state(self, state): return 0
    def set_servo_angle(self, angle, speed, mvacc, is_radian, wait):
        assert self.mode == 0 and is_radian and wait
        self.away = 0
        return 0
    def get_servo_angle(self, is_radian):
        assert is_radian
        return 0, [x + self.away for x in program.POINTS[0]] + [0.0] * (7 - len(program.POINTS[0]))
    def set_servo_angle_j(self, angles, is_radian):
        assert self.mode == 1 and is_radian
        self.sent.append(angles); self.times.append(now)
        return 0
now = 0.0
def clock():
    global now
    now += 1e-4
    return now
arm = Arm()
program.play(arm, clock, lambda seconds: None)
steps = [b - a for a, b in zip(arm.times, arm.times[1:])]
assert min(steps) > 0.9 / program.RATE and max(steps) < 1.1 / program.RATE, (min(steps), max(steps))
for row in arm.sent: print(*row)
";
    for (robot, options) in [("panda", ""), ("ur5e", "--move-to-start")] {
        let line = format!("--format xarm --rate 250 {options}");
        folder.export(&designed(robot), &line, "a.py");
        let away = if options.is_empty() { "0.001" } else { "0.5" };
        let sent = rows(&folder, &python, script, &["a.py", away]);
        compare(&sent, &motion(robot), 250.0, NINE);
        folder.export(&designed(robot), "--format xarm --force", "a.py");
        let out = Command::new(&python)
            .current_dir(folder.0.path())
            .args(["-c", script, "a.py", "0.02"])
            .output()
            .unwrap();
        let error = String::from_utf8_lossy(&out.stderr);
        assert!(
            !out.status.success() && error.contains("rad from the start"),
            "{error}"
        );
        std::fs::remove_file(folder.path("a.py")).unwrap();
    }
}

#[test]
fn numpy_reads_the_control_sequence() {
    let Some(python) = python("numpy") else {
        return;
    };
    let folder = Folder::new();
    folder.export(&designed("panda"), "--format mujoco --rate 200", "a.npz");
    let script = "
import numpy
data = numpy.load('a.npz')
assert list(data['joints']) == [f'panda_joint{i}' for i in range(1, 8)]
assert data['rate'] == 200 and numpy.all(data['t'] == numpy.arange(2001) / 200)
assert numpy.all(data['qpos'] == data['ctrl'][0])
for row in data['ctrl']: print(*map(float, row))
";
    compare(
        &rows(&folder, &python, script, &[]),
        &motion("panda"),
        200.0,
        0.0,
    );
}

/// MuJoCo starts from the keyframe, and stiff actuators follow the sequence.
#[test]
fn mujoco_plays_the_control_sequence() {
    let Some(python) = python("mujoco") else {
        return;
    };
    let folder = Folder::new();
    folder.export(&designed("planar2"), "--format mujoco", "a.npz");
    let model = "<mujoco><option timestep='0.002' integrator='implicitfast'/><include file='a_start.xml'/>
<worldbody><body><joint name='joint1' axis='0 0 1' armature='0.1' damping='1'/>
<geom type='capsule' fromto='0 0 0 .3 0 0' size='.02'/>
<body pos='.3 0 0'><joint name='joint2' axis='0 0 1' armature='0.1' damping='1'/>
<geom type='capsule' fromto='0 0 0 .3 0 0' size='.02'/></body></body></worldbody>
<actuator><position joint='joint1' kp='20000' kv='300'/><position joint='joint2' kp='20000' kv='300'/></actuator>
</mujoco>";
    std::fs::write(folder.path("model.xml"), model).unwrap();
    let script = "
import mujoco, numpy
model = mujoco.MjModel.from_xml_path('model.xml')
data = mujoco.MjData(model)
mujoco.mj_resetDataKeyframe(model, data, model.key('start').id)
sequence = numpy.load('a.npz')
assert numpy.all(data.qpos == sequence['qpos']) and numpy.all(data.ctrl == sequence['ctrl'][0])
assert abs(sequence['rate'] * model.opt.timestep - 1) < 1e-12
for row in sequence['ctrl']:
    data.ctrl[:] = row
    print(*map(float, row), *map(float, data.qpos))
    mujoco.mj_step(model, data)
";
    let all = rows(&folder, &python, script, &[]);
    let sent: Vec<Vec<f64>> = all.iter().map(|r| r[..2].to_vec()).collect();
    compare(&sent, &motion("planar2"), 500.0, 0.0);
    let worst = all.iter().fold(0.0f64, |m, r| {
        m.max((r[2] - r[0]).abs()).max((r[3] - r[1]).abs())
    });
    assert!(worst < 0.1, "the arm is {worst} rad from what is sent");
}

/// The header, compiled and run: values at many times, before zero and after the last period too.
#[test]
fn a_c_program_evaluates_the_header() {
    let compiler = std::env::var("CC").unwrap_or_else(|_| "gcc".into());
    if Command::new(&compiler).arg("--version").output().is_err() {
        let _ = writeln!(std::io::stderr(), "skipped: there is no {compiler}");
        return;
    }
    for robot in ["panda", "scara"] {
        let folder = Folder::new();
        let said = folder.export(&designed(robot), "--format c", "motion.h");
        assert!(said.contains("series of"), "{said}");
        let program = "#include <stdio.h>\n#include \"motion.h\"\nint main(void) {\n  double s[3 * \
                       EXCITE_JOINTS];\n  for (int i = -300; i <= 2700; i++) {\n    double t = i * \
                       EXCITE_DURATION / 1777;\n    excite_at(t, s, s + EXCITE_JOINTS, s + 2 * \
                       EXCITE_JOINTS);\n    printf(\"%.17g\", t);\n    for (int k = 0; k < 3 * EXCITE_JOINTS; \
                       k++) printf(\" %.17g\", s[k]);\n    printf(\"\\n\");\n  }\n  return 0;\n}\n";
        std::fs::write(folder.path("main.c"), program).unwrap();
        let built = Command::new(&compiler)
            .current_dir(folder.0.path())
            .args([
                "-std=c99",
                "-Wall",
                "-Wextra",
                "-Werror",
                "-pedantic",
                "main.c",
                "-lm",
                "-o",
                "main",
            ])
            .output()
            .unwrap();
        let error = String::from_utf8_lossy(&built.stderr);
        assert!(built.status.success(), "{error}");
        let out = Command::new(folder.path("main")).output().unwrap();
        let text = String::from_utf8(out.stdout).unwrap();
        let f = motion(robot);
        assert_eq!(text.lines().count(), 3001);
        for line in text.lines() {
            let row: Vec<f64> = line.split(' ').map(|x| x.parse().unwrap()).collect();
            for (a, b) in row[1..].iter().zip(state(&f, row[0]).concat()) {
                assert!((a - b).abs() < 1e-11, "{} s: {a}, not {b}", row[0]);
            }
        }
    }
}
