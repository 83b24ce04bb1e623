//! A hobby arm: encoders of 12 bits, dry friction near the resolution of its torques, and the plain log of a simulator that
//! shares nothing with the library: torques at an instant, damping that is integrated implicitly, dry friction that
//! reverses before the velocity does, motions that do not repeat.

use excite::diagnose::parts::Verdict;
use excite::diagnose::{Diagnosis, Settings, of_logs};
use excite::log::parts::Purpose;
use excite::log::{Channels, Record};
use excite::plant::Plant;
use excite::robot::Robot;
use std::f64::consts::PI;

const STEP: f64 = 0.002;
const ARMATURE: f64 = 0.028;
const VISCOUS: f64 = 0.6;
const COULOMB: f64 = 0.05;

/// Two links in an upright plane: length of the first, masses, distances of their centres, inertia about these.
const LENGTH: f64 = 0.12;
const MASS: [f64; 2] = [0.15, 0.2];
const CENTRE: [f64; 2] = [0.06, 0.08];
const INERTIA: f64 = 3e-4;

fn arm() -> Plant {
    let link = |name: &str, k: usize| {
        format!(
            "<link name=\"{name}\"><inertial><origin xyz=\"{} 0 0\"/><mass value=\"{}\"/><inertia ixx=\"1e-5\" \
             iyy=\"{INERTIA}\" izz=\"{INERTIA}\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>",
            CENTRE[k], MASS[k]
        )
    };
    let joint = |name: &str, parent: &str, child: &str, x: f64| {
        format!(
            "<joint name=\"{name}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/>\
             <origin xyz=\"{x} 0 0\"/><axis xyz=\"0 1 0\"/>\
             <limit lower=\"-3\" upper=\"3\" velocity=\"8\" effort=\"3.3\"/></joint>"
        )
    };
    let urdf = format!(
        "<robot name=\"hobby\"><link name=\"base\"/>{}{}{}{}</robot>",
        link("upper", 0),
        link("lower", 1),
        joint("j1", "base", "upper", 0.0),
        joint("j2", "upper", "lower", LENGTH),
    );
    let mut toml = "name = \"hobby\"\nurdf = \"hobby.urdf\"\n".to_string();
    for name in ["j1", "j2"] {
        toml += &format!(
            "[[joint]]\nname = \"{name}\"\narmature = {ARMATURE}\nviscous = {VISCOUS}\ncoulomb = {COULOMB}\n"
        );
    }
    Plant::from(Robot::from_toml_str(&toml, &urdf, "hobby").expect("a sound robot"))
}

/// What the simulated arm has and its model has not.
#[derive(Clone, Copy, Default)]
struct Hidden {
    /// dry friction of the second joint, N m
    coulomb: f64,
    /// stiffness of a spring on the second joint, N m/rad
    spring: f64,
    /// inertia of a rotor on the first joint, kg m²
    armature: f64,
    /// steps by which a torque acts late
    late: usize,
    /// part of the torque of the second joint that does not arrive
    lost: f64,
}

/// What the controller asks for: sums of sines whose periods have nothing in common.
fn asked(run: usize, t: f64) -> ([f64; 2], [f64; 2]) {
    let (mut q, mut v) = ([0.0; 2], [0.0; 2]);
    for j in 0..2 {
        for h in 0..4 {
            let k = (4 * (2 * run + j) + h) as f64;
            let w = 2.0 * PI * (0.11 + 0.23 * h as f64 + 0.017 * (7.3 * k).sin());
            let (size, phase) = (0.75 / (1.0 + h as f64), 2.9 * k);
            q[j] += size * (w * t + phase).sin();
            v[j] += size * w * (w * t + phase).cos();
        }
    }
    (q, v)
}

/// A log of so many seconds.
fn log(plant: &Plant, hidden: Hidden, run: usize, seconds: f64) -> Record {
    let count = (seconds / STEP) as usize;
    let (mut q, mut v) = asked(run, 0.0);
    let mut a = [0.0; 2];
    let mut raw = Channels {
        t: (0..count).map(|i| i as f64 * STEP).collect(),
        q: vec![Vec::new(); 2],
        tau: vec![Vec::new(); 2],
        qref: None,
    };
    let mut sent: Vec<[f64; 2]> = Vec::new();
    let tick = 2.0 * PI / 4096.0;
    for i in 0..count {
        let (qr, vr) = asked(run, i as f64 * STEP);
        let tau = [0, 1].map(|j| (18.0 * (qr[j] - q[j]) + 1.1 * (vr[j] - v[j])).clamp(-3.3, 3.3));
        for j in 0..2 {
            raw.q[j].push((q[j] / tick).round() * tick);
            raw.tau[j].push((tau[j] * 1e4).round() * 1e-4);
        }
        sent.push(tau);
        let mut acts = sent[i.saturating_sub(hidden.late)];
        acts[1] *= 1.0 - hidden.lost;
        let (c2, s2) = (q[1].cos(), q[1].sin());
        let [m1, m2] = MASS;
        let [l1, l2] = CENTRE;
        let rotor = [ARMATURE + hidden.armature, ARMATURE];
        let m22 = INERTIA + m2 * l2 * l2;
        let m12 = m22 + m2 * LENGTH * l2 * c2;
        let m11 = INERTIA + m1 * l1 * l1 + m22 + m2 * LENGTH * (LENGTH + 2.0 * l2 * c2);
        let h = m2 * LENGTH * l2 * s2;
        let bent = [-h * (2.0 * v[0] * v[1] + v[1] * v[1]), h * v[0] * v[0]];
        let g = 9.81;
        let outer = -m2 * g * l2 * (q[0] + q[1]).cos();
        let weight = [-g * (m1 * l1 + m2 * LENGTH) * q[0].cos() + outer, outer];
        let dry = [COULOMB, COULOMB + hidden.coulomb];
        let free = [0, 1].map(|j| {
            let friction = dry[j] * ((v[j] + 0.0095 * a[j]) / 0.01).clamp(-1.0, 1.0);
            let spring = if j == 1 { hidden.spring * q[1] } else { 0.0 };
            acts[j] - bent[j] - weight[j] - friction - spring - VISCOUS * v[j]
        });
        // damping at the end of the step
        let d = STEP * VISCOUS;
        let (a11, a22) = (m11 + rotor[0] + d, m22 + rotor[1] + d);
        let det = a11 * a22 - m12 * m12;
        a = [
            (a22 * free[0] - m12 * free[1]) / det,
            (a11 * free[1] - m12 * free[0]) / det,
        ];
        for j in 0..2 {
            v[j] += STEP * a[j];
            q[j] += STEP * v[j];
        }
    }
    let purpose = if run == 2 {
        Purpose::Holdout
    } else {
        Purpose::Fit
    };
    Record::from_channels(&format!("run {run}"), raw, plant, purpose, None).expect("a log")
}

fn diagnosed(hidden: Hidden) -> Diagnosis {
    let plant = arm();
    let logs: Vec<Record> = [21.0, 24.0, 18.0]
        .iter()
        .enumerate()
        .map(|(run, seconds)| log(&plant, hidden, run, *seconds))
        .collect();
    let settings = Settings::default().with(|set| set.next = false);
    of_logs(&plant, &logs, &settings, &|_| {}).expect("a diagnosis")
}

/// Effects that are claimed, with their joints.
fn claims(d: &Diagnosis) -> Vec<(&str, Vec<usize>)> {
    let sure = d.findings.iter().filter(|f| f.is_claim());
    sure.map(|f| (f.effect, f.place.named())).collect()
}

#[test]
fn a_plain_log_of_a_sound_model_has_no_gap() {
    let d = diagnosed(Hidden::default());
    assert_eq!(d.verdict, Verdict::NoGap, "{:?}", claims(&d));
    assert!(claims(&d).is_empty(), "{:?}", claims(&d));
}

/// The one claim of a diagnosis.
fn named(hidden: Hidden, name: &str, joints: &[usize]) {
    let d = diagnosed(hidden);
    assert_eq!(claims(&d), [(name, joints.to_vec())], "{:?}", d.verdict);
    let explained = [Verdict::Explained, Verdict::PartlyExplained];
    assert!(explained.contains(&d.verdict), "{:?}", d.verdict);
}

#[test]
fn friction_of_one_joint_is_named_and_nothing_else() {
    let hidden = Hidden {
        coulomb: 0.075,
        ..Hidden::default()
    };
    named(hidden, "coulomb_friction", &[1]);
}

#[test]
fn a_spring_is_named_and_no_load() {
    let hidden = Hidden {
        spring: 0.6,
        ..Hidden::default()
    };
    named(hidden, "cable_spring", &[1]);
}

#[test]
fn a_rotor_is_named_and_nothing_else() {
    let hidden = Hidden {
        armature: 0.028,
        ..Hidden::default()
    };
    named(hidden, "rotor_inertia", &[0]);
}

#[test]
fn a_delay_of_four_steps_is_named_and_nothing_else() {
    let hidden = Hidden {
        late: 4,
        ..Hidden::default()
    };
    named(hidden, "torque_delay", &[]);
}

#[test]
fn a_gain_comes_first_and_nothing_else_is_claimed() {
    // of a joint that friction holds most, little tells a gain from more friction
    let d = diagnosed(Hidden {
        lost: 0.2,
        ..Hidden::default()
    });
    let first = d.findings.first().map(|f| (f.effect, f.place.named()));
    assert_eq!(first, Some(("torque_constant", vec![1])));
    assert!(
        claims(&d).iter().all(|c| c.0 == "torque_constant"),
        "{:?}",
        claims(&d)
    );
}
