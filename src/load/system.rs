//! The linear system of all records: torques that the nominal model does not explain, and the
//! columns that may.

use super::records::{Loaded, of_platform};
use super::speeds::Speeds;
use crate::base::BaseParameters;
use crate::dynamics::Samples;
use crate::error::Result;
use crate::log::Payload;
use crate::plant::Plant;
use crate::regressor::term_factor;
use crate::robot::{Column, JointTerm};
use crate::signals::Decimator;
use faer::Mat;

/// Friction columns of an actuator in one record: Coulomb, viscous, offset.
pub const FRICTION: [JointTerm; 3] = JointTerm::FRICTION;

/// One record as rows of the system; all lists actuator-major over the filtered samples.
#[derive(Debug)]
pub struct Part {
    /// name of the record
    pub name: String,
    /// whether it has the unknown load
    pub loaded: bool,
    /// filtered samples
    pub count: usize,
    /// their times, s
    pub time: Vec<f64>,
    /// motion of the coordinates at them
    pub motion: Samples,
    /// velocities of the actuators at them
    pub speed: Vec<f64>,
    /// measured torque
    pub torque: Vec<f64>,
    /// measured torque minus nominal model without friction of the actuators
    pub y: Vec<f64>,
    /// measured torque with the chambers exchanged, where it comes from pressures
    pub exchanged: Option<Vec<f64>>,
    /// the same as `y` of every period, where there are periods
    pub periods: Vec<Vec<f64>>,
    /// ten columns of the body that carries the load
    pub tool: Mat<f64>,
    /// columns of the deviations of the empty robot
    pub deviation: Mat<f64>,
    /// friction factors of each actuator, `FRICTION` order
    pub friction: [Vec<f64>; 3],
    /// velocities of the actuators at full rate
    speeds: Speeds,
    filter: Decimator,
}

impl Part {
    /// Mean time from sample to sample, s; 0 of a single one.
    pub fn step(&self) -> f64 {
        match self.time.as_slice() {
            [first, .., last] => (last - first) / (self.time.len() - 1) as f64,
            _ => 0.0,
        }
    }

    /// Cut-off of the filter that torques and columns passed, Hz.
    pub fn cutoff(&self) -> f64 {
        self.filter.cutoff
    }

    /// Stribeck factor `exp(−(v/v_s)²) sign(v)` of an actuator, filtered like everything else.
    pub fn stribeck(&self, a: usize, speed: f64) -> Vec<f64> {
        self.of_speed(a, |v| (-(v / speed).powi(2)).exp() * v.signum())
    }

    /// Its derivative with respect to `v_s`: `2 v²/v_s³ exp(−(v/v_s)²) sign(v)`.
    pub fn stribeck_slope(&self, a: usize, speed: f64) -> Vec<f64> {
        self.of_speed(a, |v| {
            let u = v / speed;
            2.0 * u * u / speed * (-u * u).exp() * v.signum()
        })
    }

    /// A function of the speed of an actuator, zero at rest, filtered like everything else.
    fn of_speed(&self, a: usize, f: impl Fn(f64) -> f64) -> Vec<f64> {
        self.filter.apply(&self.speeds.of(a, f))
    }
}

/// All records.
#[derive(Debug)]
pub struct System {
    /// actuators
    pub actuators: usize,
    /// records
    pub parts: Vec<Part>,
    /// base parameters of the load's ten columns
    pub base: BaseParameters,
    /// names of the deviations
    pub deviations: Vec<String>,
}

/// Columns of what may deviate in the empty robot: all bodies and armatures of a serial robot, the
/// platform of a parallel one.
fn deviation_columns(plant: &Plant, tool: usize, x: &Samples) -> Result<(Mat<f64>, Vec<String>)> {
    if of_platform(plant) {
        let names = crate::robot::inertia::NAMES.map(|n| format!("platform.{n}"));
        return Ok((plant.body_columns(tool, x)?, names.to_vec()));
    }
    let parameters = plant.parameters();
    let wanted: Vec<usize> = (0..parameters.len())
        .filter(|&c| match parameters[c].kind {
            Column::Inertial { .. } => true,
            Column::Term { term, .. } => term == JointTerm::Armature,
            Column::Nuisance => false,
        })
        .collect();
    let names = wanted.iter().map(|&c| parameters[c].name.clone()).collect();
    let w = plant.regressor(x)?;
    let columns = Mat::from_fn(w.nrows(), wanted.len(), |r, c| w[(r, wanted[c])]);
    Ok((columns, names))
}

/// Nominal torque without viscous, Coulomb and constant terms of the actuators.
pub(super) fn rigid_torque(plant: &Plant, x: &Samples, moved: &Samples) -> Result<Vec<f64>> {
    let mut tau = plant.nominal_torque(x)?;
    for (a, joint) in plant.actuators().iter().enumerate() {
        for term in FRICTION {
            let value = joint.terms[term as usize];
            if value != 0.0 {
                for s in 0..x.count {
                    tau[a * x.count + s] -= value * term_factor(term, moved.at(a, s));
                }
            }
        }
    }
    Ok(tau)
}

impl System {
    /// Assembles the records without a known load; `deviate` for columns of the deviations.
    ///
    /// # Errors
    /// Motions that the plant cannot take.
    pub fn new(plant: &Plant, tool: usize, records: &[&Loaded], deviate: bool) -> Result<Self> {
        let states = plant.random_states(400, 0x10ad);
        let names = crate::robot::inertia::NAMES.map(|n| format!("load.{n}"));
        let over = plant.body_columns(tool, &states)?;
        let base = BaseParameters::from_matrix(names.to_vec(), units(), over.as_ref())?;
        let (kept, deviations) = match deviate {
            false => (Vec::new(), Vec::new()),
            true => {
                let (w, names) = deviation_columns(plant, tool, &states)?;
                let none = vec![""; names.len()];
                let b = BaseParameters::from_matrix(names.clone(), none, w.as_ref())?;
                let kept_names = b.kept.iter().map(|&k| names[k].clone()).collect();
                (b.kept, kept_names)
            }
        };
        let parts = records
            .iter()
            .map(|r| part(plant, tool, r, &kept))
            .collect::<Result<Vec<_>>>()?;
        Ok(System {
            actuators: plant.actuated().len(),
            parts,
            base,
            deviations,
        })
    }
}

fn units() -> Vec<&'static str> {
    crate::robot::inertia::UNITS.to_vec()
}

fn part(plant: &Plant, tool: usize, loaded: &Loaded, kept: &[usize]) -> Result<Part> {
    let record = &loaded.record;
    let x = &record.motion;
    let (n, count, na) = (record.count(), record.outputs(), record.actuators);
    let moved = plant.actuator_motion(x)?;
    let filter = |w: &Mat<f64>| {
        let columns: Vec<Vec<f64>> = (0..w.ncols())
            .map(|c| record.filtered(w.col_as_slice(c)))
            .collect();
        Mat::from_fn(na * count, w.ncols(), |r, c| columns[c][r])
    };
    let tool_full = plant.body_columns(tool, x)?;
    let deviation = match kept.is_empty() {
        true => Mat::zeros(na * count, 0),
        false => {
            let (w, _) = deviation_columns(plant, tool, x)?;
            filter(&Mat::from_fn(na * n, kept.len(), |r, c| w[(r, kept[c])]))
        }
    };
    let rigid = record.filtered(&rigid_torque(plant, x, &moved)?);
    let explain = |torque: &[f64]| -> Vec<f64> {
        let y = record.filtered(torque);
        y.iter().zip(&rigid).map(|(a, b)| a - b).collect()
    };
    let speeds = Speeds::new(moved.qd.clone(), record)?;
    let friction = FRICTION.map(|term| {
        let at = |a: usize, i: usize| term_factor(term, moved.at(a, i));
        let raw: Vec<f64> = match term {
            JointTerm::Coulomb => (0..na).flat_map(|a| speeds.of(a, f64::signum)).collect(),
            _ => (0..na * n).map(|i| at(i / n, i % n)).collect(),
        };
        record.filtered(&raw)
    });
    let speed = (0..na)
        .flat_map(|a| record.filter.at().iter().map(move |&i| (a, i)))
        .map(|(a, i)| moved.qd[a * n + i])
        .collect();
    Ok(Part {
        name: record.name.clone(),
        loaded: loaded.payload == Payload::Unknown,
        count,
        time: record.output_times(),
        motion: record.output_motion(),
        speed,
        torque: record.filtered(&record.torque),
        y: explain(&record.torque),
        exchanged: loaded.exchanged.as_ref().map(|t| record.filtered(t)),
        periods: match &record.periods {
            Some(p) => p.torque.iter().map(|t| explain(t)).collect(),
            None => Vec::new(),
        },
        tool: filter(&tool_full),
        deviation,
        friction,
        speeds,
        filter: record.filter.clone(),
    })
}
