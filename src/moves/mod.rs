//! Moves to the start of a motion and back from its end, and the rehearsal of the motion itself.
//!
//! A [`Move`] leads from one [`State`] to another, for example from a posture at rest to where a
//! periodic motion begins. It is jerk-limited, all coordinates leave and arrive together, and each leg
//! of it is as fast as a stated share of the limits allows. Its positions are piecewise cubics, so that
//! its extrema are exact. Where the way is not free of collisions, a planner finds postures to go
//! through. Torques are bounded for all time; where they exceed a limit the leg is slowed down.
//!
//! | file | content |
//! |---|---|
//! | `profile` | piecewise cubics: extrema, stretching in time |
//! | `leg` | a part of a move between two states |
//! | `rest` | the fastest leg between two postures, in closed form |
//! | `moving` | legs that begin or end in motion |
//! | `limits` | what a move may use of the limits |
//! | `guard` | whether a path is free, proven |
//! | `planner` | a way round what is in the way |
//! | `plan` | all of it together |
//! | `bound` | torques, their rates and the tool point between samples |
//! | `closed` | the same of parallel robots, with the motion of the actuators |
//! | `most` | the limit that is used most |
//! | `load` | torques and their rates along a leg, sampled |
//! | `tool` | speed of the tool point, sampled |
//! | `rehearsal` | a motion at several speeds: torques, power, samples, bytes |

mod bound;
mod closed;
mod guard;
mod leg;
mod limits;
mod load;
mod most;
mod moving;
pub mod parts;
mod peaks;
mod plan;
mod planner;
mod profile;
mod rehearsal;
mod rest;
mod state;
mod tool;

pub(crate) use closed::ClosedPeaks;
pub(crate) use guard::Least;
pub(crate) use load::TorquePeak;
pub(crate) use peaks::JointPeaks;
pub use rehearsal::{Rehearsal, rehearse};
pub(crate) use state::State;
pub(crate) use tool::ToolPeak;

use crate::collision::clearance::Path;
use crate::collision::scene::Scene;
use crate::error::{Error, Result, Warning};
use crate::plant::Plant;
use crate::trajectory::Fourier;
use crate::trajectory::samples::{Samples, times};
use leg::Leg;

/// How to move.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default)]
#[non_exhaustive]
pub struct Settings {
    /// share of the limits of velocity, acceleration and jerk that is used
    pub scale: f64,
    /// most random postures that the planner tries
    pub tries: usize,
    /// seed of the planner
    pub seed: u64,
    /// samples a second, Hz, of which a move lasts a whole number: its longest leg between postures at rest
    /// is made that much slower; `None`: as fast as it can be
    pub rate: Option<f64>,
}

crate::settings::changeable!(Settings);

impl Default for Settings {
    fn default() -> Self {
        Settings {
            scale: 0.2,
            tries: 3000,
            seed: 1,
            rate: None,
        }
    }
}

/// A move from one state to another.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Move {
    /// duration, s
    pub duration: f64,
    /// where it begins
    pub from: State,
    /// where it ends
    pub to: State,
    /// postures at rest between them
    pub via: Vec<Vec<f64>>,
    /// the coordinates, all limits of which hold for all time
    pub joints: Vec<JointPeaks>,
    /// largest torque of each actuator at a sample, and its bound
    pub torques: Vec<TorquePeak>,
    /// largest speed and acceleration of the tool point at a sample, and their bounds; `None` without limits
    pub tool: Option<ToolPeak>,
    /// of a parallel robot: actuators, and limits of the pose
    pub closed: Option<ClosedPeaks>,
    /// how much slower the slowest leg is for the sake of torques and their rates, of velocities by position and
    /// of the tool point; 1: not slower
    pub slowed: f64,
    /// largest share of the limits that a leg was planned with: more than asked for only where an end in
    /// motion needs it
    pub scale: f64,
    /// least clearance over all time; `None` where collisions were not looked at
    pub clearance: Option<Least>,
    /// random postures that the planner tried
    pub tries: usize,
    /// limits that had to be assumed
    pub warnings: Vec<Warning>,
    legs: Vec<Leg>,
}

impl Move {
    /// The fastest move from one state to another within a share of the limits of velocity,
    /// acceleration and jerk, within the limits of position and torque, and, with a scene, free of
    /// collisions, for all time. Forces and poses of parallel robots have a stated bound between samples.
    ///
    /// ```
    /// use excite::Plant;
    /// use excite::moves::{Move, Settings};
    /// use excite::moves::parts::State;
    ///
    /// let plant = Plant::load("planar2")?;
    /// let (from, to) = (State::rest(&[0.0, 0.5]), State::rest(&[0.4, -0.5]));
    /// let scene = plant.scene()?; // what it must not touch, where its files say it
    /// let there = Move::plan(&plant, &from, &to, &Settings::default(), scene.as_deref())?;
    /// let samples = there.sample(1000.0)?; // columns t, q, qd, qdd
    /// assert_eq!(samples.q[1][0], 0.5);
    /// # Ok::<(), excite::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Argument`] for a state of another robot or beyond a limit, and settings that are none;
    /// [`Error::Infeasible`] where an end touches something, no way was found, or a joint cannot bear
    /// the torque, with what is in the way.
    pub fn plan(
        plant: &Plant,
        from: &State,
        to: &State,
        settings: &Settings,
        scene: Option<&Scene>,
    ) -> Result<Self> {
        plan::plan(plant, from, to, settings, scene)
    }

    /// From rest in a posture to the start of a trajectory.
    ///
    /// # Errors
    /// As [`Move::plan`].
    pub fn approach(
        plant: &Plant,
        from: &[f64],
        to: &Fourier,
        settings: &Settings,
        scene: Option<&Scene>,
    ) -> Result<Self> {
        Self::plan(
            plant,
            &State::rest(from),
            &State::start_of(to),
            settings,
            scene,
        )
    }

    /// From the end of a trajectory's period to rest in a posture.
    ///
    /// # Errors
    /// As [`Move::plan`].
    pub fn retreat(
        plant: &Plant,
        from: &Fourier,
        to: &[f64],
        settings: &Settings,
        scene: Option<&Scene>,
    ) -> Result<Self> {
        Self::plan(
            plant,
            &State::start_of(from),
            &State::rest(to),
            settings,
            scene,
        )
    }

    /// What `moves.json` has of it.
    pub fn json(&self, name: &str, file: &str, samples: usize) -> serde_json::Value {
        serde_json::json!({
            "name": name,
            "file": file,
            "samples": samples,
            "duration": self.duration,
            "scale": self.scale,
            "slowed": self.slowed,
            "from": self.from,
            "to": self.to,
            "via": self.via,
            "tries": self.tries,
            "legs": self.legs.iter().map(|leg| leg.duration).collect::<Vec<_>>(),
            "joints": self.joints,
            "torques": self.torques,
            "tool": self.tool,
            "closed": self.closed,
            "clearance": self.clearance,
        })
    }

    /// Number of coordinates.
    pub fn dof(&self) -> usize {
        self.from.q.len()
    }

    /// The leg of a time, and when it begins.
    fn leg(&self, t: f64) -> Option<(&Leg, f64)> {
        let mut start = 0.0;
        for (k, leg) in self.legs.iter().enumerate() {
            if t <= start + leg.duration || k + 1 == self.legs.len() {
                return Some((leg, start));
            }
            start += leg.duration;
        }
        None
    }

    /// Positions, velocities and accelerations at a time; before and after the move, those of its ends.
    ///
    /// # Panics
    /// If a slice does not have one entry a coordinate.
    pub fn evaluate(&self, t: f64, [q, qd, qdd]: [&mut [f64]; 3]) {
        let end = match self.leg(t) {
            _ if t <= 0.0 => &self.from,
            _ if t >= self.duration => &self.to,
            None => &self.to,
            Some((leg, start)) => {
                for (k, p) in leg.profiles.iter().enumerate() {
                    [q[k], qd[k], qdd[k]] = p.at(t - start);
                }
                return;
            }
        };
        q.copy_from_slice(&end.q);
        qd.copy_from_slice(&end.qd);
        qdd.copy_from_slice(&end.qdd);
    }

    /// Samples at `rate` hertz, from 0 to the duration, both included; the last step may be shorter.
    ///
    /// # Errors
    /// As [`times`].
    pub fn sample(&self, rate: f64) -> Result<Samples> {
        let n = self.dof();
        let times = times(self.duration, rate)?;
        let mut out = Samples::with_capacity(n, times.len());
        let (mut q, mut qd, mut qdd) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        for &t in &times {
            self.evaluate(t, [&mut q, &mut qd, &mut qdd]);
            out.push(t, &q, &qd, &qdd);
        }
        Ok(out)
    }

    /// Writes the samples with the columns of `samples.csv`. Returns how many there are.
    ///
    /// # Errors
    /// As [`times`] and [`Plant::write_along`].
    pub fn write(
        &self,
        plant: &Plant,
        path: impl AsRef<std::path::Path>,
        force: bool,
        rate: f64,
    ) -> Result<usize> {
        let times = times(self.duration, rate)?;
        let at = |t: f64, out: [&mut [f64]; 3]| self.evaluate(t, out);
        plant.write_along(path, force, &times, &at)?;
        Ok(times.len())
    }
}

impl Path for Move {
    fn position(&self, t: f64, q: &mut [f64]) {
        match self.leg(t) {
            Some((leg, start)) => leg.position(t - start, q),
            None => q.copy_from_slice(&self.from.q),
        }
    }

    fn speed(&self, from: f64, to: f64, v: &mut [f64]) {
        v.fill(0.0);
        let mut own = vec![0.0; v.len()];
        let mut start = 0.0;
        for leg in &self.legs {
            let (a, b) = ((from - start).max(0.0), (to - start).min(leg.duration));
            if a <= b {
                leg.speed(a, b, &mut own);
                v.iter_mut().zip(&own).for_each(|(v, o)| *v = v.max(*o));
            }
            start += leg.duration;
        }
    }

    fn largest(&self, joint: usize) -> f64 {
        let all = self.legs.iter().map(|leg| leg.largest(joint));
        all.fold(0.0, f64::max)
    }

    fn duration(&self) -> f64 {
        self.duration
    }
}

/// Whether settings can be used.
fn check(settings: &Settings) -> Result<()> {
    if let Some(rate) = settings.rate {
        times(0.0, rate)?;
    }
    if settings.scale > 0.0 && settings.scale <= 1.0 {
        return Ok(());
    }
    Err(Error::Argument(format!(
        "the share of the limits that a move uses is more than 0 and at most 1, not {}",
        settings.scale
    )))
}
