//! Parallel robots from the JSON of reference models, and where those lie.
#![allow(dead_code)]

use super::shared::checks;
use excite::dynamics::Samples;
use excite::mechanism::Mechanism;
use excite::mechanism::delta::Delta;
use excite::mechanism::gough_stewart::{self, GoughStewart, Leg};
use excite::mechanism::h4::{H4, Model};
use excite::mechanism::parallelogram::{self, Chain, motor_frame};
use excite::robot::Inertia;
use excite::robot::parts::Limits;
use excite::trajectory::Fourier;
use nalgebra::{Matrix3, Vector3};
use rand::Rng;
use serde_json::Value;
use std::path::PathBuf;

/// Model and cases of `sg`, `h4` or `delta`: the full set, or the few that come with the tests.
pub fn reference(name: &str) -> (Value, Vec<Value>) {
    let read = |path: PathBuf| -> Value {
        serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap()
    };
    match checks("only the cases in tests/data") {
        Some(folder) => {
            let cases = read(folder.join(format!("{name}_cases.json")));
            let model = read(folder.join(format!("{name}_model.json")));
            (model, cases["cases"].as_array().unwrap().clone())
        }
        None => {
            let own =
                read(PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/parallel.json"));
            (
                own[name]["model"].clone(),
                own[name]["cases"].as_array().unwrap().clone(),
            )
        }
    }
}

pub fn numbers(v: &Value) -> Vec<f64> {
    v.as_array()
        .unwrap()
        .iter()
        .map(|x| x.as_f64().unwrap())
        .collect()
}
pub fn vector(v: &Value) -> Vector3<f64> {
    Vector3::from_column_slice(&numbers(v))
}
pub fn matrix(v: &Value) -> Matrix3<f64> {
    let rows: Vec<f64> = v.as_array().unwrap().iter().flat_map(numbers).collect();
    Matrix3::from_row_slice(&rows)
}
pub fn body(v: &Value) -> Inertia {
    Inertia::from_com(v["m"].as_f64().unwrap(), vector(&v["c"]), matrix(&v["Ic"]))
}

pub fn hexapod(model: &Value) -> GoughStewart {
    let legs = model["legs"]
        .as_array()
        .unwrap()
        .iter()
        .map(|l| Leg {
            base: vector(&l["a"]),
            platform: vector(&l["b"]),
            rotation: matrix(&l["R0"]),
            zero: 0.0,
            limits: Limits::default(),
            terms: [0.0; 4],
            force_noise: None,
            cone: [f64::INFINITY; 2],
            cross: Inertia::default(),
            cylinder: body(&l["A"]),
            rod: body(&l["B"]),
        })
        .collect();
    GoughStewart {
        name: "sg".into(),
        legs,
        platform: body(&model["platform"]),
        home: [
            0.0,
            0.0,
            model["neutral_height"].as_f64().unwrap(),
            0.0,
            0.0,
            0.0,
        ],
        gravity: vector(&model["g"]),
        bodies: gough_stewart::Bodies::Legs,
        identical: false,
        axisymmetric: false,
        spherical: false,
        identify: vec![],
    }
}

pub fn chains(model: &Value) -> Vec<Chain> {
    let number = |k: &str| model[k].as_f64().unwrap();
    model["chains"]
        .as_array()
        .unwrap()
        .iter()
        .map(|c| Chain {
            motor: vector(&c["P"]),
            rotation: motor_frame(c["azimuth"].as_f64().unwrap()),
            arm_length: number("L"),
            rod_length: number("l"),
            width: number("w"),
            zero: 0.0,
            attachment: vector(&c["beta"]),
            hinge: c["plate"].as_u64().unwrap() as usize,
            limits: Limits::default(),
            terms: [c["armature"].as_f64().unwrap(), 0.0, 0.0, 0.0],
            torque_noise: None,
            arm: body(&c["arm"]),
            rods: [body(&c["rods"][0]), body(&c["rods"][1])],
        })
        .collect()
}

pub fn h4(model: &Value) -> H4 {
    H4 {
        name: "h4".into(),
        chains: chains(model),
        hinges: [vector(&model["hinges"][0]), vector(&model["hinges"][1])],
        platform: body(&model["D"]),
        bars: [body(&model["bars"][0]), body(&model["bars"][1])],
        home: [0.0, 0.0, -0.45, 0.0],
        gravity: vector(&model["g"]),
        model: Model::Rods,
        bodies: parallelogram::Bodies::Rods,
        identical: false,
        identify: vec![],
    }
}

pub fn delta(model: &Value) -> Delta {
    Delta {
        name: "delta".into(),
        chains: chains(model),
        platform: body(&model["D"]),
        home: [0.0, 0.0, -0.45],
        gravity: vector(&model["g"]),
        bodies: parallelogram::Bodies::Rods,
        identical: false,
        identify: vec![],
    }
}

/// The motion at uniform instants, in pieces.
fn pieces(fourier: &Fourier, count: usize, mut see: impl FnMut(usize, &Samples)) {
    let dof = fourier.dof();
    for from in (0..count).step_by(1000) {
        let n = 1000.min(count - from);
        let mut s = Samples::zeros(dof, n);
        let (mut q, mut qd, mut qdd) = (vec![0.0; dof], vec![0.0; dof], vec![0.0; dof]);
        for i in 0..n {
            let t = (from + i) as f64 * fourier.period / count as f64;
            fourier.evaluate(t, [&mut q[..], &mut qd, &mut qdd]);
            for k in 0..dof {
                s.q[k * n + i] = q[k];
                s.qd[k * n + i] = qd[k];
                s.qdd[k * n + i] = qdd[k];
            }
        }
        see(from, &s);
    }
}

/// Nothing exceeds its bound at 100 kHz, and the bounds are close.
pub fn check_at_100_khz(mechanism: &Mechanism, fourier: &Fourier) {
    let c = mechanism.certify(fourier, 1.0).unwrap();
    assert!(c.proven());
    let count = (fourier.period * 1e5) as usize;
    let na = mechanism.actuators();
    let mut most = vec![[0.0f64; 4]; na];
    let mut range = vec![[f64::INFINITY, f64::NEG_INFINITY]; na];
    let mut last: Option<Vec<f64>> = None;
    let platform = mechanism.platform();
    let pairs = platform.pairs();
    let mut boxed = vec![[0.0f64; 3]; platform.freedoms()];
    let mut worst = vec![f64::NEG_INFINITY; c.pose.len()];
    pieces(fourier, count, |_, s| {
        let motion = mechanism.motion(s).unwrap().tree;
        let tau = mechanism.nominal_torque(s).unwrap();
        let n = s.count;
        for (a, &j) in mechanism.actuated.iter().enumerate() {
            for i in 0..n {
                let q = motion.q[j * n + i];
                range[a] = [range[a][0].min(q), range[a][1].max(q)];
                let m = &mut most[a];
                m[0] = m[0].max(motion.qd[j * n + i].abs());
                m[1] = m[1].max(motion.qdd[j * n + i].abs());
                let before = match (i, &last) {
                    (0, Some(last)) => last[a],
                    (0, None) => motion.qdd[j * n],
                    _ => motion.qdd[j * n + i - 1],
                };
                m[2] = m[2].max((motion.qdd[j * n + i] - before).abs() * 1e5);
                m[3] = m[3].max(tau[a * n + i].abs());
            }
        }
        last = Some(
            mechanism
                .actuated
                .iter()
                .map(|&j| motion.qdd[j * n + n - 1])
                .collect(),
        );
        let pose = mechanism.platform_motion(s).unwrap();
        for (k, (most, limits)) in boxed.iter_mut().zip(&platform.workspace).enumerate() {
            let [low, high] = limits.position;
            let off = |q: f64| (q - 0.5 * (low + high)).abs() / (0.5 * (high - low));
            for i in k * n..(k + 1) * n {
                most[0] = most[0].max(off(pose.q[i]));
                most[1] = most[1].max(pose.qd[i].abs() / limits.velocity);
                most[2] = most[2].max(pose.qdd[i].abs() / limits.acceleration);
            }
        }
        // poses at 10 kHz are slow enough to look at
        for i in (0..n).step_by(10) {
            let x: Vec<f64> = (0..s.dof).map(|k| pose.q[k * n + i]).collect();
            for (w, u) in worst.iter_mut().zip(platform.pose_uses(&x, &pairs)) {
                *w = w.max(u.used());
            }
        }
    });
    for (a, joint) in c.actuators.joints.iter().enumerate() {
        let p = &joint.position;
        assert!(range[a][0] >= p.bounds[0] && range[a][1] <= p.bounds[1]);
        let width = p.bounds[1] - p.bounds[0];
        assert!(
            width < 1.02 * (range[a][1] - range[a][0]) + 1e-6,
            "{}",
            joint.joint
        );
        for (k, peak) in [&joint.velocity, &joint.acceleration, &joint.jerk]
            .into_iter()
            .enumerate()
        {
            let rounding = if k == 2 { 1e-6 } else { 0.0 };
            assert!(
                most[a][k] <= peak.bound * (1.0 + rounding) + rounding,
                "{} order {}: {} beyond {}",
                joint.joint,
                k + 1,
                most[a][k],
                peak.bound
            );
        }
        let force = joint.torque.as_ref().unwrap();
        assert!(
            most[a][3] <= force.bound() * (1.0 + 1e-9),
            "{}",
            joint.joint
        );
    }
    for (p, worst) in c.pose.iter().zip(worst) {
        let bound = match p.kind {
            excite::mechanism::PoseKind::PassiveJoint => p.bound / p.limit,
            _ => p.limit / p.bound,
        };
        assert!(worst <= bound * (1.0 + 1e-9), "{}: {worst} {bound}", p.name);
    }
    for (most, joint) in boxed.iter().zip(&c.platform.joints) {
        let within = |used: f64| used < 1.0 + 1e-9;
        assert!(most.iter().all(|u| within(*u)), "{}: {most:?}", joint.joint);
        for (most, peak) in most[1..].iter().zip([&joint.velocity, &joint.acceleration]) {
            let limit = peak.limit.unwrap_or(f64::INFINITY);
            assert!(
                *most <= (1.0 + 1e-9) * peak.bound / limit,
                "{}",
                joint.joint
            );
        }
    }
}

/// Random poses in the workspace of a mechanism, rates up to one and accelerations up to `acceleration`.
pub fn states(m: &Mechanism, count: usize, seed: u64, acceleration: f64) -> Samples {
    let r = &mut super::rng(seed);
    let mut x = Samples::zeros(m.freedoms(), count);
    for k in 0..m.freedoms() {
        let [low, high] = m.workspace[k].position;
        for s in 0..count {
            x.q[k * count + s] = r.random_range(low..high);
            x.qd[k * count + s] = r.random_range(-1.0..1.0);
            x.qdd[k * count + s] = r.random_range(-acceleration..acceleration);
        }
    }
    x
}
