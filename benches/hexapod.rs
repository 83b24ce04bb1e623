//! Time of the closed-chain regressor, one core: `cargo bench --bench hexapod`.

use excite::dynamics::Samples;
use excite::dynamics::parts::Workspace;
use excite::mechanism::gough_stewart::{Bodies, GoughStewart, Leg, joint_frame};
use excite::mechanism::parts::MechanismWorkspace;
use excite::mechanism::{MechanismMotion, TaskDerivatives};
use excite::robot::Inertia;
use excite::robot::parts::Limits;
use nalgebra::{Matrix3, Vector3};
use std::time::Instant;

fn main() -> excite::Result<()> {
    let legs = (0..6)
        .map(|i| {
            let (pair, side) = ((i / 2) as f64 * 2.0944, if i % 2 == 0 { -1.0 } else { 1.0 });
            let at = |r: f64, a: f64| Vector3::new(r * a.cos(), r * a.sin(), 0.0);
            let (base, platform) = (at(0.6, pair + 0.2 * side), at(0.35, pair + 0.9 * side));
            Leg {
                base,
                platform,
                rotation: joint_frame(&(platform + Vector3::new(0.0, 0.0, 0.9) - base)),
                zero: 0.0,
                limits: Limits::default(),
                terms: [0.0; 4],
                force_noise: None,
                cone: [f64::INFINITY; 2],
                cross: Inertia::default(),
                cylinder: Inertia::from_com(8.0, Vector3::z() * 0.2, Matrix3::identity() * 0.2),
                rod: Inertia::from_com(3.0, Vector3::z() * -0.2, Matrix3::identity() * 0.05),
            }
        })
        .collect();
    let mechanism = GoughStewart {
        name: "6-UPS".into(),
        legs,
        platform: Inertia::from_com(40.0, Vector3::z() * 0.05, Matrix3::identity()),
        home: [0.0, 0.0, 0.9, 0.0, 0.0, 0.0],
        gravity: Vector3::new(0.0, 0.0, -9.81),
        bodies: Bodies::Legs,
        identical: false,
        axisymmetric: false,
        spherical: false,
        identify: vec![],
    }
    .build()?;
    let count: usize = std::env::args()
        .nth(1)
        .and_then(|a| a.parse().ok())
        .unwrap_or(1000);
    let mut x = Samples::zeros(6, count);
    for k in 0..6 {
        for s in 0..count {
            let (w, t) = (1.0 + 0.3 * k as f64, 0.01 * s as f64);
            x.q[k * count + s] = mechanism.home[k] + 0.1 * (w * t).sin();
            x.qd[k * count + s] = 0.1 * w * (w * t).cos();
            x.qdd[k * count + s] = -0.1 * w * w * (w * t).sin();
        }
    }
    let best = |f: &mut dyn FnMut()| {
        let mut best = f64::INFINITY;
        for _ in 0..30 {
            let start = Instant::now();
            f();
            best = best.min(start.elapsed().as_secs_f64());
        }
        best / count as f64 * 1e6
    };
    let ws = Workspace::default();
    let columns = mechanism.parameters.raw_count();
    println!("{columns} columns, {count} samples, {:?}", ws.isa());
    let mut closed = MechanismMotion::default();
    let isa = ws.isa();
    let mut failed = Ok(());
    let kinematics = best(&mut || failed = mechanism.motion_into(isa, &x, &mut closed));
    let mut w = vec![0.0; 6 * count * columns];
    let (mut cache, part) = (MechanismWorkspace::default(), count.min(64));
    let blocks = best(&mut || {
        for from in (0..count).step_by(part) {
            failed = mechanism
                .raw_block(&mut cache, &x, from, (from + part).min(count))
                .map(|_| ());
        }
    });
    let regressor = best(&mut || failed = mechanism.regressor_into(&mut cache, &x, &mut w));
    println!("kinematics and G             {kinematics:6.2} us a sample");
    println!("with regressor, in the cache {blocks:6.2} us a sample");
    println!("with regressor, stacked as W {regressor:6.2} us a sample");
    let (mut ws, mut out) = (MechanismWorkspace::default(), TaskDerivatives::default());
    let (raw, rates) = (vec![0.1; columns], vec![0.3; 6 * count]);
    let gradient = best(&mut || failed = mechanism.gradients(&mut ws, &raw, &x, &rates, &mut out));
    println!("gradient of one quadratic form {gradient:6.2} us a sample");
    failed
}
