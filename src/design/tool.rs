//! Limits of the speed and acceleration of the tool point, linearised.
//!
//! A row of the subproblem is `|v| + v̂ᵀ ∂v δ` with the unit vector `v̂` along the velocity: the norm is convex in
//! `v`, so the row is no more than it.

use super::information::{Evaluation, Information};
use super::path::{PathLimits, PathMemory, PathRow, ROOM};
use super::torque::BETWEEN;
use crate::dynamics::Samples;
use crate::dynamics::point::{Point, PointMotion};
use crate::robot::Robot;

/// Limits of a robot's tool point.
pub struct ToolLimits<'a> {
    point: Point<'a>,
    frame: String,
    /// of speed and acceleration, infinite where there is none
    room: [f64; 2],
}

impl<'a> ToolLimits<'a> {
    /// The limits times `derate`; `None` where the robot states none.
    pub fn new(robot: &'a Robot, derate: f64) -> Option<Self> {
        let tool = robot.tool.as_ref()?;
        let room = [tool.speed, tool.acceleration].map(|l| l * derate * (1.0 - BETWEEN));
        Some(ToolLimits {
            point: Point::of(robot, tool),
            frame: tool.frame.clone(),
            room,
        })
    }

    /// The motion of the point at a sample.
    fn at(&self, motion: &Samples, i: usize, state: &mut [Vec<f64>; 3], out: &mut PointMotion) {
        for (k, list) in state.iter_mut().enumerate() {
            list.clear();
            list.extend((0..motion.dof).map(|j| motion.at(j, i)[k]));
        }
        self.point.at(&state[0], &state[1], &state[2], out);
    }

    /// Largest shares of speed and acceleration.
    fn worst(&self, motion: &Samples) -> [f64; 2] {
        let (mut state, mut at) = (Default::default(), PointMotion::default());
        let mut worst = [0.0_f64; 2];
        for i in 0..motion.count {
            self.at(motion, i, &mut state, &mut at);
            let now = [at.velocity.norm(), at.acceleration.norm()];
            for (w, (x, room)) in worst.iter_mut().zip(now.iter().zip(&self.room)) {
                *w = w.max(x / room);
            }
        }
        worst
    }
}

impl PathLimits for ToolLimits<'_> {
    fn used(&self, _: &Information, _: &[f64], motion: &Samples, _: &mut PathMemory) -> f64 {
        let [speed, acceleration] = self.worst(motion);
        speed.max(acceleration)
    }

    fn broken(&self, _: &Information, _: &[f64], motion: &Samples) -> String {
        let [speed, acceleration] = self.worst(motion);
        let (used, what) = match speed > acceleration {
            true => (speed, "speed"),
            false => (acceleration, "acceleration"),
        };
        match used > 1.0 {
            true => format!(
                "the tool point {} is at {:.0} % of its limit of {what}",
                self.frame,
                100.0 * used
            ),
            false => String::new(),
        }
    }

    fn rows(&self, info: &Information, _: &[f64], e: &mut Evaluation, from: f64) -> Vec<PathRow> {
        let motion = &e.motion;
        let n = motion.dof;
        let (mut state, mut at) = (Default::default(), PointMotion::default());
        let mut rows = Vec::new();
        for i in 0..motion.count {
            self.at(motion, i, &mut state, &mut at);
            for (k, room) in self.room.into_iter().enumerate() {
                let vector = [at.velocity, at.acceleration][k];
                let size = vector.norm();
                if !(size > from * room) {
                    continue;
                }
                let along = vector / size;
                let (mut q, mut qd, mut qdd) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
                match k {
                    0 => self.point.velocity_gradient(&at, &along, [&mut q, &mut qd]),
                    _ => {
                        let out = [&mut q[..], &mut qd[..], &mut qdd[..]];
                        self.point.acceleration_gradient(&at, &along, out);
                    }
                }
                rows.push(PathRow {
                    gradient: info.pull_back(i, [&q, &qd, &qdd]),
                    slack: (1.0 - ROOM) * room - size,
                });
            }
        }
        rows
    }
}
