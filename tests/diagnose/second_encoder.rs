//! What a second encoder shows, on a pendulum that is simulated here: a motor, what lies between, a link. Nothing of the
//! library's dynamics is used.

use excite::Plant;
use excite::diagnose::{prepare, second_encoder};
use excite::log::Record;
use excite::log::parts::Purpose;
use std::f64::consts::TAU;
use std::fmt::Write;

const MASS: f64 = 6.0;
const REACH: f64 = 0.35;
const TENSOR: f64 = 0.09;
const ROTOR: f64 = 0.6;
const GEAR: f64 = 100.0;

/// What lies between motor and link, and at the encoders.
#[derive(Clone, Copy)]
struct Between {
    stiffness: f64,
    play: f64,
    /// twice a turn of the motor
    error: f64,
    eccentricity: f64,
    delay: f64,
    /// position about which it swings
    about: f64,
    /// step of both encoders
    step: f64,
}

const STIFF: Between = Between {
    stiffness: 4e6,
    play: 0.0,
    error: 0.0,
    eccentricity: 0.0,
    delay: 0.0,
    about: 0.0,
    step: 2e-6,
};

fn urdf(gear: bool) -> (String, String) {
    let tensor = TENSOR;
    let urdf = format!(
        r#"<robot name="pendulum"><link name="base"/><joint name="shoulder" type="revolute"><parent link="base"/>
<child link="arm"/><origin rpy="1.5707963267948966 0 0"/><axis xyz="0 0 1"/>
<limit lower="-2.5" upper="2.5" velocity="4" effort="60"/></joint><link name="arm"><inertial><origin xyz="{REACH} 0 0"/>
<mass value="{MASS}"/><inertia ixx="{tensor}" ixy="0" ixz="0" iyy="{tensor}" iyz="0" izz="{tensor}"/></inertial></link></robot>"#
    );
    let gear = if gear {
        format!("gear_ratio = {GEAR}\n")
    } else {
        String::new()
    };
    let toml = format!(
        "urdf = \"robot.urdf\"\nprior = \"identified\"\n[[joint]]\nname = \"shoulder\"\narmature = {ROTOR}\nviscous = 2.0\ncoulomb = 1.0\n{gear}"
    );
    (urdf, toml)
}

/// A run of two periods: semi-implicit Euler at 20 kHz under a PD controller of the motor, logged at 250 Hz.
fn run(b: Between, phase: f64, second: bool) -> String {
    let h = 5e-5;
    let inertia = TENSOR + MASS * REACH * REACH;
    let weight = |q: f64| MASS * 9.81 * REACH * q.cos();
    let want = |t: f64| {
        let w = TAU / 10.0;
        b.about
            + 0.5 * (w * t + phase).sin()
            + 0.35 * (3.0 * w * t + 2.0 * phase).sin()
            + 0.15 * (7.0 * w * t).cos()
    };
    let spring = |twist: f64| {
        let open = 0.5 * b.play;
        b.stiffness * (twist.abs() - open).max(0.0) * twist.signum()
    };
    let damping = 2.0 * 0.03 * (b.stiffness * inertia * ROTOR / (inertia + ROTOR)).sqrt();
    let slope = |t: f64| (want(t + 1e-5) - want(t - 1e-5)) / 2e-5;
    let [mut qm, mut vm] = [want(0.0), slope(0.0)];
    let [mut ql, mut vl] = [want(0.0) - weight(want(0.0)) / b.stiffness, slope(0.0)];
    let mut out = String::from(if second {
        "t,q1,tau1,ql1\n"
    } else {
        "t,q1,tau1\n"
    });
    let round = |x: f64| (x / b.step).round() * b.step;
    let mut sum = 0.0;
    let per = 80;
    for i in 0..(20.1 / h) as usize {
        let t = i as f64 * h;
        let tau = 9000.0 * (want(t) - qm) + 260.0 * (slope(t) - vm);
        let error = b.error * (2.0 * GEAR * qm).sin();
        let twist = qm + error - ql;
        let touching = f64::from(u8::from(twist.abs() >= 0.5 * b.play));
        let through = spring(twist) + touching * damping * (vm - vl);
        vm += h * (tau - through - 2.0 * vm - 1.0 * (vm / 0.01).tanh()) / ROTOR;
        vl += h * (through - weight(ql)) / inertia;
        qm += h * vm;
        ql += h * vl;
        sum += tau;
        if i % per == 0 && i > 0 {
            let shown = ql - b.delay * vl + b.eccentricity * (ql + 0.7).cos();
            let _ = write!(out, "{t:.5},{:.8},{:.5}", round(qm), sum / per as f64);
            if second {
                let _ = write!(out, ",{:.8}", round(shown));
            }
            out.push('\n');
            sum = 0.0;
        }
    }
    out
}

fn look(b: Between, gear: bool) -> second_encoder::SecondEncoder {
    let dir = tempfile::tempdir().expect("a folder");
    let (urdf, toml) = urdf(gear);
    std::fs::write(dir.path().join("robot.urdf"), urdf).expect("write");
    std::fs::write(dir.path().join("robot.toml"), toml).expect("write");
    let plant =
        Plant::load(dir.path().join("robot.toml").to_str().expect("a path")).expect("a robot");
    let record = |name: &str, phase: f64, purpose| {
        let path = dir.path().join(name);
        std::fs::write(&path, run(b, phase, true)).expect("write");
        Record::read(&path, &plant, purpose, Some(10.0)).expect("a log")
    };
    let logs = [
        record("a.csv", 0.3, Purpose::Fit),
        record("b.csv", 1.9, Purpose::Holdout),
    ];
    let data = prepare(&plant, &logs).expect("data");
    let found = second_encoder::find(&data, &plant.values()).expect("reachable");
    assert_eq!(found.len(), 1);
    found.into_iter().next().expect("one joint")
}

fn names(s: &second_encoder::SecondEncoder) -> Vec<&'static str> {
    s.seen.iter().map(|e| e.effect).collect()
}

#[track_caller]
fn near(value: f64, want: f64, share: f64) {
    assert!(
        (value / want - 1.0).abs() < share,
        "{value} instead of {want}"
    );
}

#[test]
fn elasticity_is_seen_with_its_stiffness() {
    let s = look(
        Between {
            stiffness: 8e3,
            ..STIFF
        },
        true,
    );
    assert_eq!(s.seen.len(), 1, "{:?}", s.seen);
    assert_eq!(s.seen[0].effect, "joint_elasticity");
    near(s.seen[0].value, 8e3, 0.03);
    assert!(s.holdout.is_some_and(|h| h > 0.95), "{:?}", s.seen);
}

#[test]
fn play_is_seen_beside_elasticity() {
    let s = look(
        Between {
            stiffness: 2.5e4,
            play: 1.5e-3,
            about: -1.3,
            ..STIFF
        },
        true,
    );
    let play = s
        .seen
        .iter()
        .find(|e| e.effect == "backlash")
        .expect("play");
    near(play.value, 1.5e-3, 0.03);
    let spring = s
        .seen
        .iter()
        .find(|e| e.effect == "joint_elasticity")
        .expect("a spring");
    near(spring.value, 2.5e4, 0.15);
}

#[test]
fn errors_of_the_transmission_are_seen_where_the_gear_is_known() {
    let b = Between {
        error: 2e-4,
        ..STIFF
    };
    let s = look(b, true);
    assert_eq!(s.seen.len(), 1, "{:?}", s.seen);
    assert_eq!(s.seen[0].effect, "transmission_error");
    near(s.seen[0].value, 2e-4, 0.1);
    let s = look(b, false);
    assert!(s.seen.is_empty(), "{:?}", s.seen);
    assert!(
        s.unasked.iter().any(|w| w.contains("gear_ratio")),
        "{:?}",
        s.seen
    );
}

#[test]
fn eccentricity_is_seen_and_a_delay_is_no_effect() {
    let s = look(
        Between {
            eccentricity: 3e-4,
            delay: 2e-3,
            ..STIFF
        },
        true,
    );
    assert_eq!(s.seen[0].effect, "encoder_eccentricity", "{:?}", s.seen);
    near(s.delay[0], 2e-3, 0.1);
    assert_eq!(s.seen.len(), 1, "{:?}", s.seen);
}

/// However stiff a joint is, an encoder that is fine enough sees how much; one that is not says nothing.
#[test]
fn what_the_encoders_do_not_resolve_is_not_named() {
    let s = look(STIFF, true);
    assert_eq!(names(&s), ["joint_elasticity"]);
    near(s.seen[0].value, STIFF.stiffness, 0.05);
    let s = look(
        Between {
            step: 1e-4,
            ..STIFF
        },
        true,
    );
    assert!(names(&s).is_empty(), "{:?}", s.seen);
}

/// What the torques are taken for, and what the second encoder says, are held against each other.
#[test]
fn a_claim_that_the_second_encoder_contradicts_is_warned_of() {
    let s = look(
        Between {
            eccentricity: 3e-4,
            ..STIFF
        },
        true,
    );
    let claim = |effect| [(effect, vec!["shoulder".to_string()])];
    let told = second_encoder::warnings(std::slice::from_ref(&s), &claim("joint_elasticity"));
    assert!(told[0].message.contains("does not show it"), "{told:?}");
    assert!(second_encoder::warnings(&[s], &claim("torque_delay")).is_empty());
}

/// The command reads the column, also where only some joints have one, and writes what it shows.
#[test]
fn the_command_writes_what_the_second_encoder_shows() {
    let dir = tempfile::tempdir().expect("a folder");
    let (urdf, toml) = urdf(true);
    let b = Between {
        stiffness: 8e3,
        ..STIFF
    };
    for (name, text) in [
        ("robot.urdf", urdf),
        ("robot.toml", toml),
        ("a.csv", run(b, 0.3, true)),
        // without one
        ("b.csv", run(b, 1.9, false)),
        (
            "experiment.toml",
            "robot = \"robot.toml\"\n[[record]]\nlog = \"a.csv\"\nuse = \"fit\"\nperiod = 10.0\n\
             [[record]]\nlog = \"b.csv\"\nuse = \"holdout\"\nperiod = 10.0\n"
                .into(),
        ),
    ] {
        std::fs::write(dir.path().join(name), text).expect("write");
    }
    let out = dir.path().join("out");
    assert_cmd::Command::cargo_bin("excite")
        .expect("the program")
        .args(["diagnose", "experiment.toml", "--no-next", "--output"])
        .arg(&out)
        .current_dir(&dir)
        .assert()
        .success();
    let text = std::fs::read_to_string(out.join("diagnosis.json")).expect("a diagnosis");
    let d: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let s = &d["second_encoder"][0];
    assert_eq!(s["joint"], "shoulder");
    assert_eq!(s["effects"][0]["effect"], "joint_elasticity");
    assert!(s["holdout"].is_null());
    let page = std::fs::read_to_string(out.join("report.html")).expect("a report");
    assert!(page.contains("What the second encoders show"));
}
