//! Rehearsals: a motion is designed, a robot follows it in simulation, and its sensors are read.

use excite::design::parts::Condition;
use excite::design::{Settings as Design, design};
use excite::log::parts::Purpose;
use excite::log::{Channels, Record};
use excite::plant::Plant;
use excite::simulate::record::{Sensors, measure};
use excite::simulate::{Effects, Settings as Simulation, simulate};
use excite::trajectory::Fourier;
use excite::trajectory::parts::{Ends, Grid};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock};

/// A designed motion of a bundled robot: three odd harmonics of five seconds. One is designed for each robot, and
/// shared by the tests of a binary.
pub fn motion(robot: &str) -> Fourier {
    static DESIGNED: Mutex<BTreeMap<String, Arc<OnceLock<Fourier>>>> = Mutex::new(BTreeMap::new());
    let mut all = DESIGNED
        .lock()
        .expect("no design panics while it is locked");
    let cell = all.entry(robot.into()).or_default().clone();
    drop(all);
    cell.get_or_init(|| {
        let settings = Design::default().with(|set| {
            set.harmonics = 3;
            set.period = 5.0;
            set.grid = Grid::Odd;
            set.ends = Ends::Free;
            set.condition = Condition::Normalised;
            set.starts = Some(1);
        });
        let plant = Plant::load(robot).unwrap();
        let found = design(&plant, &settings).unwrap();
        found.trajectory.fourier
    })
    .clone()
}

/// The same motion in another time.
pub fn within(motion: &Fourier, period: f64) -> Fourier {
    Fourier {
        period,
        ..motion.clone()
    }
}

/// A simulation of a drive of 30 Hz, logged at 200 Hz.
pub fn simulation(effects: Effects) -> Simulation {
    Simulation::default().with(|set| {
        set.rate = 200.0;
        set.step = 2.5e-3;
        set.bandwidth = 30.0;
        set.seed = 1;
        set.effects = effects;
    })
}

/// A record of these channels.
pub fn record(plant: &Plant, period: f64, fit: bool, channels: Channels) -> Record {
    let name = format!("{period:.2} s");
    let purpose = if fit { Purpose::Fit } else { Purpose::Holdout };
    Record::from_channels(&name, channels, plant, purpose, Some(period)).unwrap()
}

/// What a robot did.
pub struct Log {
    pub record: Record,
    /// positions of the actuators without their sensors, one actuator after the other
    pub truth: Vec<f64>,
}

/// Log of three periods of a motion; `noise` in units of what the robot file states, drawn from `seed`.
pub fn log(
    plant: &Plant,
    motion: &Fourier,
    fit: bool,
    settings: &Simulation,
    noise: f64,
    seed: u64,
) -> Log {
    let run = simulate(plant, motion, 3, settings, &|_| {}).unwrap();
    let sensors = Sensors::new(plant, noise).0;
    let seen = measure(&run, &sensors, &settings.effects, seed);
    let columns = |x: &[f64]| x.chunks(run.t.len()).map(<[f64]>::to_vec).collect();
    let channels = Channels {
        q: columns(&seen.q),
        tau: columns(&seen.tau),
        qref: Some(columns(&run.reference)),
        t: run.t,
    };
    Log {
        record: record(plant, motion.period, fit, channels),
        truth: run.actuators.q,
    }
}

/// A log without the commands: nothing is known of the controller.
pub fn without_commands(log: Log) -> Record {
    let mut record = log.record;
    record.qref = None;
    if let Some(written) = &mut record.written {
        written.qref = None;
    }
    record
}
