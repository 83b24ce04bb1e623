//! A hexapod with its effect, and what its loggers see.

use super::drives::Sensor;
use super::hexapod::{self, Body, Legs, Motion, Rubbing};
use super::machine::{Machine, machine};
use super::plan::Plan;
use super::sines::{self, Sine};
use crate::random::Random;
use nalgebra::{Matrix3, Rotation3, Vector3};

type V = Vector3<f64>;

/// Sampling of the logs, s.
pub const STEP: f64 = 0.004;

/// A record: its motion and how it is used.
#[derive(Clone, Debug)]
pub struct Record {
    pub name: &'static str,
    pub fit: bool,
    pub period: f64,
    pub periods: usize,
    pub sines: Vec<Sine>,
}

/// Times, positions and forces as logged.
#[derive(Clone, Debug, Default)]
pub struct Log {
    pub t: Vec<f64>,
    pub q: Vec<[f64; 6]>,
    pub force: Vec<[f64; 6]>,
}

/// A case as written.
#[derive(Clone, Debug)]
pub struct Case {
    pub plan: Plan,
    pub machine: Machine,
    /// Legs that an answer has to name; none where it is the whole machine.
    pub legs: Vec<usize>,
    /// Numbers of the effect, for the answers.
    pub size: Vec<f64>,
    /// What the effect adds to the forces, over their noise; of the worst leg.
    pub level: f64,
    pub records: Vec<Record>,
    pub logs: Vec<Log>,
    /// Whether the robot file has the legs' masses.
    pub legs_known: bool,
}

/// What is there beside the machine of the robot file.
#[derive(Clone, Default)]
struct Extra {
    load: Vec<Body>,
    delay: f64,
    /// pulses at the platform: time, width, force
    pushes: Vec<(f64, f64, V)>,
    /// oscillation of one drive: leg, frequency, force
    hum: Option<(usize, f64, f64)>,
}

/// Draws and simulates a case; fixed by seed and number.
pub fn build(seed: u64, plan: &Plan) -> Case {
    let mut rng = Random::new(seed, plan.index, 200);
    let close = matches!(
        plan.effect,
        Some("payload" | "leg_inertia" | "torque_constant")
    );
    let identified = close || rng.chance(0.5);
    let clean = machine(identified, &mut rng);
    let mut real = clean.clone();
    let mut extra = Extra::default();
    let leg = rng.index(6);
    let (mut legs, mut size) = (vec![leg], Vec::new());
    let drive = &mut real.drives[leg];
    match plan.effect {
        Some("stribeck_friction") => {
            (drive.rise, drive.rise_speed) = (rng.range(35.0, 45.0), rng.range(0.01, 0.03));
            drive.rise_power = 1.0;
            size = vec![drive.rise, drive.rise_speed];
        }
        Some("friction_asymmetry") => {
            drive.asymmetry = rng.range(0.25, 0.35) * if rng.chance(0.5) { 1.0 } else { -1.0 };
            size = vec![drive.asymmetry];
        }
        Some("torque_constant") => {
            drive.gain = rng.range(0.07, 0.09) * if rng.chance(0.5) { 1.0 } else { -1.0 };
            size = vec![drive.gain];
        }
        Some("torque_delay") => {
            extra.delay = rng.range(0.0045, 0.0055);
            legs = Vec::new();
            size = vec![extra.delay];
        }
        Some("leg_inertia") => legs = Vec::new(),
        Some("passive_joint_friction") => {
            real.rubs = Rubbing {
                dry: rng.range(0.6, 1.2),
                viscous: rng.range(0.2, 0.6),
            };
            legs = Vec::new();
            size = vec![real.rubs.dry, real.rubs.viscous];
        }
        Some(name @ ("leg_geometry" | "all_leg_geometry")) => {
            let all = name == "all_leg_geometry";
            for i in (0..6).filter(|i| all || *i == leg) {
                let mut shift = || {
                    let v = V::new(rng.normal(), rng.normal(), rng.normal()).normalize();
                    size.extend((v * 0.002).iter());
                    v * 0.002
                };
                let l = &mut real.legs[i];
                match i % 2 == 0 {
                    true => l.base += shift(),
                    false => l.platform += shift(),
                }
            }
            if all {
                legs = Vec::new();
            }
        }
        Some("payload") => {
            let mass = rng.range(3.0, 5.0);
            let at = V::new(
                rng.range(-0.05, 0.05),
                rng.range(-0.05, 0.05),
                rng.range(0.05, 0.15),
            );
            size = vec![mass, at.x, at.y, at.z];
            let turn = Rotation3::from_euler_angles(0.3, 0.2, 0.1);
            let about = V::new(0.006, 0.009, 0.012) * mass;
            extra.load.push(Body {
                mass,
                centre: at,
                tensor: turn.matrix() * Matrix3::from_diagonal(&about) * turn.matrix().transpose(),
            });
            legs = Vec::new();
        }
        Some("platform_pushed") => {
            for _ in 0..25 {
                let v = V::new(rng.normal(), rng.normal(), rng.normal()).normalize();
                let force = v * rng.range(15.0, 40.0);
                extra
                    .pushes
                    .push((rng.range(0.0, 80.0), rng.range(0.1, 0.4), force));
            }
            legs = Vec::new();
        }
        Some("unlogged_oscillation") => {
            extra.hum = Some((leg, rng.range(2.3, 3.1), rng.range(5.0, 8.0)));
        }
        _ => legs = Vec::new(),
    }
    let records = records(&mut rng);
    let mut logs = Vec::new();
    let (mut added, mut count) = ([0.0f64; 6], 0.0);
    let mut start = 0.0;
    for (k, r) in records.iter().enumerate() {
        let mut rng = Random::new(seed, plan.index, 210 + k as u64);
        let wander = sines::wandering(&mut rng);
        let log = log(&real, &extra, r, &wander, start, &mut rng);
        for i in (0..log.t.len()).step_by(5) {
            let truth = real_force(&real, &extra, r, &wander, start, log.t[i]);
            let without = match plan.effect {
                Some("leg_inertia") => without_legs(&clean, r, &wander, log.t[i]),
                _ => real_force(&clean, &Extra::default(), r, &wander, start, log.t[i]),
            };
            for (sum, (a, b)) in added.iter_mut().zip(truth.force.iter().zip(&without.force)) {
                *sum += (a - b).powi(2);
            }
            count += 1.0;
        }
        start += r.period * r.periods as f64;
        logs.push(log);
    }
    let noise = clean.noise[0].hypot(clean.noise[1]);
    let worst = added.iter().fold(0.0f64, |m, v| m.max(*v));
    // the robot file is of the machine without its effect
    Case {
        plan: plan.clone(),
        machine: clean,
        legs,
        size,
        level: (worst / count).sqrt() / noise,
        records,
        logs,
        legs_known: plan.effect != Some("leg_inertia"),
    }
}

fn records(rng: &mut Random) -> Vec<Record> {
    let list = [
        ("fit_1", true, 10.0, 3, 1.0),
        ("fit_2", true, 7.0, 3, 0.7),
        ("holdout", false, 8.0, 2, 0.85),
    ];
    let of = |(name, fit, period, periods, size)| Record {
        name,
        fit,
        period,
        periods,
        sines: sines::periodic(period, size, rng),
    };
    list.map(of).into()
}

fn motion(m: &Machine, r: &Record, wander: &[Sine], t: f64) -> Motion {
    let [mut x, mut d, mut dd] = sines::at(&r.sines, &m.home, t);
    let [e, de, dde] = sines::at(wander, &[0.0; 6], t);
    for k in 0..6 {
        x[k] += e[k];
        d[k] += de[k];
        dd[k] += dde[k];
    }
    Motion::new(&x, &d, &dd)
}

/// Lengths at a time, and forces as a sensor without noise shows them.
fn real_force(m: &Machine, extra: &Extra, r: &Record, wander: &[Sine], start: f64, t: f64) -> Legs {
    let mut bodies = vec![m.platform.clone()];
    bodies.extend(extra.load.iter().cloned());
    let t = t - extra.delay;
    let mut push = V::zeros();
    for (at, width, force) in &extra.pushes {
        let u = (start + t - at) / width;
        if u.abs() < 1.0 {
            push += force * (0.5 + 0.5 * (std::f64::consts::PI * u).cos());
        }
    }
    let mut out = hexapod::forces(&m.legs, &motion(m, r, wander, t), &bodies, m.rubs, push);
    for (j, drive) in m.drives.iter().enumerate() {
        out.force[j] = drive.logged(out.force[j], out.rate[j]);
    }
    if let Some((leg, frequency, size)) = extra.hum {
        out.force[leg] += size * (std::f64::consts::TAU * frequency * (start + t)).sin();
    }
    out
}

/// The same of a machine whose legs have no mass.
fn without_legs(m: &Machine, r: &Record, wander: &[Sine], t: f64) -> Legs {
    let mut light = m.clone();
    for leg in &mut light.legs {
        for b in [&mut leg.cylinder, &mut leg.rod] {
            b.mass = 0.0;
            b.tensor = Matrix3::zeros();
        }
    }
    real_force(&light, &Extra::default(), r, wander, 0.0, t)
}

fn log(
    m: &Machine,
    extra: &Extra,
    r: &Record,
    wander: &[Sine],
    start: f64,
    rng: &mut Random,
) -> Log {
    let count = (r.period * r.periods as f64 / STEP).round() as usize + 1;
    let mut sensors: Vec<Sensor> = (0..6)
        .map(|_| Sensor::new(m.noise[0], m.noise[1], 8.0, STEP, rng))
        .collect();
    let mut out = Log::default();
    for i in 0..count {
        let t = i as f64 * STEP;
        let force = real_force(m, extra, r, wander, start, t).force;
        // positions are not delayed
        let legs = hexapod::forces(
            &m.legs,
            &motion(m, r, wander, t),
            &[],
            Rubbing::default(),
            V::zeros(),
        );
        out.t.push(t);
        out.q.push(std::array::from_fn(|j| {
            ((legs.length[j] - m.zero[j]) / m.step).round() * m.step
        }));
        out.force
            .push(std::array::from_fn(|j| force[j] + sensors[j].next(rng)));
    }
    out
}
