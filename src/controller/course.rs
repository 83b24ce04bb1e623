//! What runs, as a function of time: a move to the start, the periodic motion, a move back.

mod between;

pub use between::AIM;

use super::leg::Leg;
use crate::dynamics;
use crate::error::{Error, Result};
use crate::plant::Plant;
use crate::robot::Motion;
use crate::trajectory::{Fourier, Samples, Space, Trajectory};

/// How far position, velocity and acceleration of two parts may differ where they meet.
const MEET: [f64; 3] = [1e-6, 1e-5, 1e-3];

/// A joint that is commanded.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// its name
    pub name: String,
    /// its number in the robot's order, from 1
    pub number: usize,
    /// turns or slides; `None` where no robot file says so
    pub motion: Option<Motion>,
    /// step of its encoder, rad or m
    pub resolution: Option<f64>,
}

/// How positions of the actuators follow from the series.
#[derive(Debug, Clone)]
enum Way<'a> {
    /// they are the series
    Series,
    /// by inverse kinematics of a closed chain
    Kinematics(&'a Plant),
}

/// Approach, periodic motion and return.
#[derive(Debug, Clone)]
pub struct Course<'a> {
    robot: String,
    fourier: Fourier,
    periods: u32,
    joints: Vec<Channel>,
    series: Vec<String>,
    way: Way<'a>,
    approach: Option<Leg>,
    retreat: Option<Leg>,
}

impl<'a> Course<'a> {
    /// The periodic motion of a trajectory at a fraction of its speed. The robot tells what the joints are; a motion of
    /// a platform cannot do without one, as it is the actuators that are commanded. It must be the trajectory's, in
    /// the trajectory's coordinates ([`Plant::in_space`]).
    ///
    /// # Errors
    /// [`Error::Argument`] if the fraction is not above 0 and at most 1; [`Error::Infeasible`] for a motion of a platform
    /// without a robot.
    pub fn new(
        trajectory: &Trajectory,
        plant: Option<&'a Plant>,
        periods: u32,
        speed: f64,
    ) -> Result<Self> {
        if !(speed > 0.0 && speed <= 1.0) {
            return Err(Error::Argument(format!(
                "--speed is a fraction above 0 and at most 1 of the speed of the design, not {speed}"
            )));
        }
        if periods == 0 {
            return Err(Error::Argument("--periods must be at least 1".into()));
        }
        let named = |name: &String| (name.clone(), None, None);
        let closed = plant.filter(|p| {
            let actuators: Vec<&str> = p.actuators().iter().map(|j| j.name.as_str()).collect();
            p.coordinate_names() != actuators
        });
        let joints: Vec<(String, Option<Motion>, Option<f64>)> = match plant {
            Some(plant) => {
                let actuators = plant.actuators().into_iter();
                actuators
                    .map(|j| (j.name.clone(), Some(j.motion), j.position_resolution))
                    .collect()
            }
            None if trajectory.space == Some(Space::Platform) => {
                return Err(Error::Infeasible(
                    "it moves a platform, a controller moves actuators: name the robot with --robot, so \
                     that their positions can be computed"
                        .into(),
                ));
            }
            None => trajectory.joints.iter().map(named).collect(),
        };
        let mut fourier = trajectory.fourier.clone();
        fourier.period /= speed;
        Ok(Course {
            robot: trajectory.robot.clone(),
            fourier,
            periods,
            joints: joints
                .into_iter()
                .enumerate()
                .map(|(j, (name, motion, resolution))| Channel {
                    name,
                    number: j + 1,
                    motion,
                    resolution,
                })
                .collect(),
            series: trajectory.joints.clone(),
            way: closed.map_or(Way::Series, Way::Kinematics),
            approach: None,
            retreat: None,
        })
    }

    /// The same with a move to the start in front of it.
    ///
    /// # Errors
    /// [`Error::Infeasible`] if it has another number of joints, or does not end as the motion starts.
    pub fn after(mut self, approach: Leg) -> Result<Self> {
        let start = self.periodic(&[0.0])?;
        self.meet(&approach, approach.len() - 1, &start, "ends", "starts")?;
        self.approach = Some(approach);
        Ok(self)
    }

    /// The same with a move away behind it.
    ///
    /// # Errors
    /// [`Error::Infeasible`] if it has another number of joints, or does not start as the motion ends.
    pub fn before(mut self, retreat: Leg) -> Result<Self> {
        let end = self.periodic(&[0.0])?;
        self.meet(&retreat, 0, &end, "starts", "ends")?;
        self.retreat = Some(retreat);
        Ok(self)
    }

    fn meet(&self, leg: &Leg, row: usize, state: &Samples, it: &str, motion: &str) -> Result<()> {
        if leg.dof() != self.joints.len() {
            return Err(Error::Infeasible(format!(
                "the move has {} joints, the motion {}",
                leg.dof(),
                self.joints.len()
            )));
        }
        for (j, joint) in self.joints.iter().enumerate() {
            let here = leg.row(row, j);
            let there = [state.q[j][0], state.qd[j][0], state.qdd[j][0]];
            for (k, what) in ["position", "velocity", "acceleration"].iter().enumerate() {
                if (here[k] - there[k]).abs() > MEET[k] * there[k].abs().max(1.0) {
                    return Err(Error::Infeasible(format!(
                        "the move {it} at {what} {} of {}, the motion {motion} at {}; compute the move for \
                         this trajectory, at its full speed",
                        here[k], joint.name, there[k]
                    )));
                }
            }
        }
        Ok(())
    }

    /// Name of the robot.
    pub fn robot(&self) -> &str {
        &self.robot
    }

    /// The series of the periodic motion, at the speed that is asked for.
    pub fn fourier(&self) -> &Fourier {
        &self.fourier
    }

    /// How many periods run.
    pub fn periods(&self) -> u32 {
        self.periods
    }

    /// The joints that are commanded.
    pub fn joints(&self) -> &[Channel] {
        &self.joints
    }

    /// Names of what the series move: the joints, or the coordinates of a platform.
    pub fn series(&self) -> &[String] {
        &self.series
    }

    /// Whether the series are those of the joints, and not of a platform.
    pub fn is_of_joints(&self) -> bool {
        matches!(self.way, Way::Series)
    }

    /// Durations of approach, periodic motion and return, s; 0 where there is none.
    pub fn parts(&self) -> [f64; 3] {
        let leg = |leg: &Option<Leg>| leg.as_ref().map_or(0.0, Leg::duration);
        let motion = self.fourier.period * f64::from(self.periods);
        [leg(&self.approach), motion, leg(&self.retreat)]
    }

    /// Duration of all of it, s.
    pub fn duration(&self) -> f64 {
        self.parts().iter().sum()
    }

    /// States of the joints at times from 0 to the duration.
    ///
    /// # Errors
    /// A pose that a platform cannot take; [`Error::Infeasible`] if a number is not finite.
    pub fn sample(&self, times: &[f64]) -> Result<Samples> {
        let [before, motion, _] = self.parts();
        let n = self.joints.len();
        let mut out = Samples::with_capacity(n, times.len());
        let first = times.partition_point(|&t| t < before);
        let last = times.partition_point(|&t| t <= before + motion);
        let inner: Vec<f64> = times[first..last].iter().map(|t| t - before).collect();
        let inner = self.periodic(&inner)?;
        let mut state = vec![[0.0; 3]; n];
        for (i, &t) in times.iter().enumerate() {
            for (j, state) in state.iter_mut().enumerate() {
                *state = match (&self.approach, &self.retreat) {
                    (Some(leg), _) if i < first => leg.at(t, j),
                    (_, Some(leg)) if i >= last => leg.at(t - before - motion, j),
                    _ => {
                        // rounding may put the last instant behind the motion
                        let k = (i.max(first) - first).min(inner.len().max(1) - 1);
                        let at = |c: &[Vec<f64>]| c[j].get(k).copied().unwrap_or(f64::NAN);
                        [at(&inner.q), at(&inner.qd), at(&inner.qdd)]
                    }
                };
            }
            let of = |k: usize| state.iter().map(|s| s[k]).collect::<Vec<f64>>();
            let (q, qd, qdd) = (of(0), of(1), of(2));
            if [&q, &qd, &qdd]
                .iter()
                .any(|v| v.iter().any(|x| !x.is_finite()))
            {
                return Err(Error::Infeasible(format!(
                    "a number that is not finite came up at t = {t} s"
                )));
            }
            out.push(t, &q, &qd, &qdd);
        }
        Ok(out)
    }

    /// States of the joints at times of the periodic motion.
    fn periodic(&self, times: &[f64]) -> Result<Samples> {
        // pieces fit the cache
        const PIECE: usize = 1024;
        let (m, n) = (self.fourier.dof(), self.joints.len());
        let mut out = Samples::with_capacity(n, times.len());
        let mut state = vec![0.0; 3 * m];
        for times in times.chunks(PIECE) {
            let count = times.len();
            let mut x = dynamics::Samples::zeros(m, count);
            for (s, &t) in times.iter().enumerate() {
                let (q, rest) = state.split_at_mut(m);
                let (qd, qdd) = rest.split_at_mut(m);
                self.fourier.evaluate(t, [q, qd, qdd]);
                for k in 0..m {
                    x.q[k * count + s] = state[k];
                    x.qd[k * count + s] = state[m + k];
                    x.qdd[k * count + s] = state[2 * m + k];
                }
            }
            let rows: Vec<usize> = match &self.way {
                Way::Series => (0..n).collect(),
                Way::Kinematics(plant) => {
                    x = plant.joint_motion(&x)?.into_owned();
                    plant.actuated().to_vec()
                }
            };
            out.t.extend(times);
            for (to, from) in [
                (&mut out.q, &x.q),
                (&mut out.qd, &x.qd),
                (&mut out.qdd, &x.qdd),
            ] {
                for (column, &row) in to.iter_mut().zip(&rows) {
                    column.extend(&from[row * count..(row + 1) * count]);
                }
            }
        }
        Ok(out)
    }
}
