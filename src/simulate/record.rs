//! What the sensors make of a run, and the log that is written.

use super::{Effects, Run};
use crate::error::{Result, Warning};
use crate::log::{Payload, Purpose, Record, pressure};
use crate::output::write_atomic;
use crate::plant::Plant;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fmt::Write as _;
use std::path::Path;

/// The sensors of a robot.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Sensors {
    /// standard deviation of the torque, actuator by actuator, N m or N
    pub torque_noise: Vec<f64>,
    /// step of the position sensors, rad or m; 0 for none
    pub resolution: Vec<f64>,
}

crate::settings::changeable!(Sensors);

impl Sensors {
    /// As the robot file states them, the noise times `scale` (0: ideal sensors). Torque noise that
    /// is not stated is assumed, with a warning; position steps that are not stated are 0.
    pub fn new(plant: &Plant, scale: f64) -> (Self, Vec<Warning>) {
        let joints = plant.actuators();
        let (noise, assumed) = plant.torque_noise();
        let torque_noise = noise.iter().map(|n| scale * n).collect();
        let resolution = joints
            .iter()
            .map(|j| match scale > 0.0 {
                true => j.position_resolution.unwrap_or(0.0),
                false => 0.0,
            })
            .collect();
        let warnings = if scale == 0.0 { vec![] } else { assumed };
        let sensors = Sensors {
            torque_noise,
            resolution,
        };
        (sensors, warnings)
    }
}

/// Measured positions and torques, actuator-major.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Measured {
    /// positions, rad or m
    pub q: Vec<f64>,
    /// torques or forces, N m or N
    pub tau: Vec<f64>,
}

/// A standard normal number (Box & Muller 1958).
pub fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let u: f64 = 1.0 - rng.random::<f64>();
    let v: f64 = rng.random();
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// Measures a run: positions rounded to the encoder's step, white noise on the torques.
pub fn measure(run: &Run, sensors: &Sensors, effects: &Effects, seed: u64) -> Measured {
    let count = run.t.len();
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x5e_4502);
    let (mut q, mut tau) = (run.actuators.q.clone(), run.tau_seen.clone());
    for (a, (&noise, &step)) in sensors
        .torque_noise
        .iter()
        .zip(&sensors.resolution)
        .enumerate()
    {
        let effect = effects.joint(a);
        // where the steps of the encoder lie is chance, another one in every rehearsal
        let phase: f64 = rng.random();
        for v in &mut q[a * count..(a + 1) * count] {
            *v += effect.position_offset;
            if step > 0.0 {
                *v = ((*v / step + phase).round() - phase) * step;
            }
        }
        for v in &mut tau[a * count..(a + 1) * count] {
            *v *= effect.torque_gain;
            if noise > 0.0 {
                *v += noise * normal(&mut rng);
            }
        }
    }
    Measured { q, tau }
}

/// A measured run as the record that reading its log gives, without a file: `t`, `q`, `tau` and
/// `qref`; `period` is that of the motion, s.
///
/// # Panics
/// If the run has fewer than two samples.
pub fn to_record(run: &Run, measured: &Measured, purpose: Purpose, period: f64) -> Record {
    let count = run.t.len();
    let rows = |list: &[f64]| list.chunks_exact(count).map(<[f64]>::to_vec).collect();
    Record {
        name: format!("{purpose:?}").to_lowercase(),
        path: "simulated".into(),
        purpose,
        period: Some(period),
        payload: Payload::None,
        step: run.t[1] - run.t[0],
        t: run.t.clone(),
        valid: vec![true; count],
        q: rows(&measured.q),
        tau: rows(&measured.tau),
        qref: Some(rows(&run.reference)),
        dq: None,
        ddq: None,
        ql: None,
        pose: None,
        pressures: None,
        resampled: false,
        written: None,
        warnings: Vec::new(),
    }
}

/// Which columns a log has beside `t`, `q`, `tau` and `qref`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Columns {
    /// true velocities and accelerations of the actuators, `dq`, `ddq`
    pub derivatives: bool,
    /// true pose of the platform, `x y z qw qx qy qz`
    pub pose: bool,
    /// mean of the chamber pressures, Pa, which stand in place of the forces
    pub pressures: Option<f64>,
}

/// Writes a log as `docs/formats.md` describes it.
///
/// # Errors
/// A pose of a robot without platform; otherwise as [`write_atomic`].
pub fn write_log(
    path: impl AsRef<Path>,
    force: bool,
    plant: &Plant,
    run: &Run,
    measured: &Measured,
    columns: Columns,
) -> Result<()> {
    let count = run.t.len();
    let na = run.actuators.dof;
    let mut head = String::from("t");
    let mut data: Vec<&[f64]> = Vec::new();
    let mut add = |name: &str, values: &'_ [f64]| {
        for a in 0..na {
            let _ = write!(head, ",{name}{}", a + 1);
        }
        debug_assert_eq!(values.len(), na * count);
    };
    add("q", &measured.q);
    let pressures = match columns.pressures {
        Some(mean) => Some(pressure::of_forces(plant, &measured.tau, mean)?),
        None => None,
    };
    match &pressures {
        Some([a, b]) => {
            add("pa", a);
            add("pb", b);
        }
        None => add("tau", &measured.tau),
    }
    add("qref", &run.reference);
    let mut sources = vec![&measured.q];
    match &pressures {
        Some([a, b]) => sources.extend([a, b]),
        None => sources.push(&measured.tau),
    }
    sources.push(&run.reference);
    if columns.derivatives {
        add("dq", &run.actuators.qd);
        add("ddq", &run.actuators.qdd);
        sources.extend([&run.actuators.qd, &run.actuators.qdd]);
    }
    for source in sources {
        data.extend(source.chunks_exact(count));
    }
    let pose = match columns.pose {
        true => plant.pose_columns(&run.motion)?,
        false => Vec::new(),
    };
    if columns.pose {
        head.push_str(",x,y,z,qw,qx,qy,qz");
    }
    data.extend(pose.iter().map(Vec::as_slice));
    head.push('\n');
    write_atomic(path, force, |w| {
        w.write_all(head.as_bytes())?;
        let mut line = String::new();
        for k in 0..count {
            line.clear();
            let _ = write!(line, "{}", run.t[k]);
            for column in &data {
                let _ = write!(line, ",{}", column[k]);
            }
            line.push('\n');
            w.write_all(line.as_bytes())?;
        }
        Ok(())
    })
}
