//! The set of motions that a diagnosis asks for, all of odd harmonics and run three times or more:
//! so the residual splits into what is odd, what is even and what does not repeat (Pintelon &
//! Schoukens 2012, ch. 4).
//!
//! | motion | what it tells |
//! |---|---|
//! | `trajectory` | the designed one, fast: inertia, viscous friction, elasticity |
//! | `slow` | the same path slower: what goes with speed against what goes with the pose |
//! | `reversals` | equal velocity in many harmonics: friction at reversals, hysteresis, backlash |
//! | `holdout` | another path that nothing is fitted to |
//!
//! The last two are random series about the middle of the designed motion, as large as the limits
//! allow.

use super::settings::Settings;
use crate::dynamics::Samples;
use crate::error::{Error, Result};
use crate::log::Purpose;
use crate::plant::Plant;
use crate::robot::Robot;
use crate::trajectory::{Basis, Fourier, Grid, Trajectory};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Fewest periods: with three the scatter between them is an estimate.
pub const PERIODS: u32 = 3;
/// Factors on the period of the slow copy, the first that keeps the limits.
const SLOWER: [f64; 4] = [4.0, 3.0, 2.0, 1.5];
/// Random paths of which the one with most reversals is taken.
const DRAWS: usize = 8;
/// Samples of a period at which a path is judged before it is certified.
const SAMPLES: usize = 400;
/// Smallest part of the first try to which a random path is shrunk.
const SMALLEST: f64 = 1e-3;

/// One motion of the set.
#[derive(Debug, Clone)]
pub struct Motion {
    /// stem of its files
    pub name: &'static str,
    /// what it is for, in words
    pub about: &'static str,
    /// what its record is for
    pub purpose: Purpose,
    /// changes of the sign of the velocity of all actuators in a period
    pub reversals: usize,
    /// the motion
    pub trajectory: Trajectory,
}

/// The set about a designed motion, inside the limits times [`Settings::derate`].
///
/// # Errors
/// [`Error::Infeasible`] where no motion of the set keeps the limits.
pub fn diagnostic_set(
    plant: &Plant,
    main: &Trajectory,
    settings: &Settings,
) -> Result<Vec<Motion>> {
    let limits = Checker::new(plant, settings.derate);
    let motion = |name, about, purpose, trajectory: Trajectory| -> Result<Motion> {
        Ok(Motion {
            name,
            about,
            purpose,
            reversals: reversals(plant, &trajectory.fourier)?,
            trajectory,
        })
    };
    let with = |fourier: Fourier| Trajectory {
        fourier,
        ..main.clone()
    };
    let path = |harmonics: usize, seed: u64| random_path(&limits, main, settings, harmonics, seed);
    Ok(vec![
        motion("trajectory", "fast", Purpose::Fit, main.clone())?,
        motion(
            "slow",
            "the same path, slow",
            Purpose::Fit,
            with(slow(&limits, &main.fourier)?),
        )?,
        motion(
            "reversals",
            "many reversals",
            Purpose::Fit,
            with(path(2 * settings.harmonics, 1)?),
        )?,
        motion(
            "holdout",
            "another path, to be predicted",
            Purpose::Holdout,
            with(path(settings.harmonics, 2)?),
        )?,
    ])
}

/// The limits of a robot times a fraction, for all time.
pub(crate) struct Checker {
    plant: Plant,
    /// coordinates with limits times the fraction
    robot: Robot,
    derate: f64,
}

impl Checker {
    /// Of a plant, with the limits that a design assumes where none are stated.
    pub(crate) fn new(plant: &Plant, derate: f64) -> Self {
        let plant = plant.clone().with_assumed_limits();
        let moved = plant.moved();
        Checker {
            robot: Robot {
                joints: moved.joints.iter().map(|j| j.derated(derate)).collect(),
                ..moved.clone()
            },
            plant,
            derate,
        }
    }

    /// Whether the actuators keep their limits at samples of a period: cheap, and necessary.
    ///
    /// # Errors
    /// A motion of another robot.
    pub(crate) fn sampled(&self, fourier: &Fourier) -> Result<bool> {
        let motion = fourier.motion(SAMPLES);
        let (moved, tau) = match self.plant.actuator_motion(&motion) {
            Ok(moved) => (moved, self.plant.nominal_torque(&motion)?),
            // out of reach
            Err(Error::Infeasible(_)) => return Ok(false),
            Err(e) => return Err(e),
        };
        let names = self.plant.actuators();
        Ok((0..moved.dof).all(|a| {
            let l = &names[a].limits;
            let [low, high] = l.position;
            let room = 0.5 * (high - low) * (1.0 - self.derate);
            let room = if room.is_finite() { room } else { 0.0 };
            (a * SAMPLES..(a + 1) * SAMPLES).all(|i| {
                moved.q[i] >= low + room
                    && moved.q[i] <= high - room
                    && moved.qd[i].abs() <= l.velocity * self.derate
                    && moved.qdd[i].abs() <= l.acceleration * self.derate
                    && tau[i].abs() <= l.effort * self.derate
            })
        }))
    }

    /// Whether a motion keeps all of them, and what it may not touch.
    ///
    /// # Errors
    /// A motion of another robot.
    pub(crate) fn holds(&self, fourier: &Fourier) -> Result<bool> {
        Ok(self.sampled(fourier)? && self.proven(fourier)?)
    }

    /// The same without a look at samples, which comes first.
    ///
    /// # Errors
    /// A motion of another robot.
    pub(crate) fn proven(&self, fourier: &Fourier) -> Result<bool> {
        let limits = self.plant.certify_limits(fourier, self.derate);
        // collisions take longer to look at
        let all = limits.and_then(|found| {
            let clear = || self.plant.clearance(fourier);
            Ok(found.satisfied() && clear()?.is_none_or(|c| c.satisfied))
        });
        match all {
            // out of reach
            Err(Error::Infeasible(_)) => Ok(false),
            all => all,
        }
    }

    fn infeasible(&self, what: &str) -> Error {
        Error::Infeasible(format!(
            "{}: no {what} keeps the limits; check the limits, or lower --derate",
            self.plant.name()
        ))
    }
}

fn slow(limits: &Checker, main: &Fourier) -> Result<Fourier> {
    for factor in SLOWER {
        let slower = Fourier {
            period: factor * main.period,
            ..main.clone()
        };
        if limits.holds(&slower)? {
            return Ok(slower);
        }
    }
    Err(limits.infeasible("slow copy of the motion"))
}

/// A random path of so many odd harmonics of equal velocity about the middle of `main`: of
/// [`DRAWS`] the one whose coordinates turn most often.
fn random_path(
    limits: &Checker,
    main: &Trajectory,
    settings: &Settings,
    harmonics: usize,
    stream: u64,
) -> Result<Fourier> {
    let lines = Grid::Odd.harmonics(harmonics, settings.seed);
    let dof = main.fourier.dof();
    let basis = Basis::new(&lines, settings.ends, dof, settings.start.as_deref())?;
    let middle: Vec<f64> = match limits.plant.home() {
        None => main.fourier.joints.iter().map(|s| s.constant).collect(),
        Some(home) => home.to_vec(),
    };
    let mut rng = ChaCha8Rng::seed_from_u64(settings.seed);
    rng.set_stream(stream);
    let mut draws: Vec<(usize, Vec<f64>)> = (0..DRAWS)
        .map(|_| {
            let mut draw = |_| rng.random_range(-1.0..1.0);
            let random: Vec<f64> = (0..basis.len()).map(&mut draw).collect();
            let fourier = basis.fourier(main.fourier.period, &random);
            (turns(&fourier.motion(points(&fourier))), random)
        })
        .collect();
    draws.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
    for (_, random) in draws {
        if let Some(f) = fitted(limits, &basis, main.fourier.period, &middle, &random)? {
            return Ok(f);
        }
    }
    Err(limits.infeasible("random path"))
}

/// `middle + s A_j x`, with `A_j` twice what the bounds of the derivatives allow each joint, shrunk
/// in steps until the limits hold; `None` where it is too small to be a motion.
fn fitted(
    limits: &Checker,
    basis: &Basis,
    period: f64,
    middle: &[f64],
    random: &[f64],
) -> Result<Option<Fourier>> {
    let m = basis.free();
    let omega = std::f64::consts::TAU / period;
    let unit = basis.fourier(period, random);
    let rest: Vec<Vec<f64>> = (0..basis.dof())
        .map(|j| {
            let mut c = vec![0.0; 2 * basis.harmonics.len() + 1];
            c[0] = middle[j];
            basis.parameters(j, &c).as_slice().to_vec()
        })
        .collect();
    let amplitude: Vec<f64> = (0..basis.dof())
        .map(|j| {
            let l = &limits.robot.joints[j].limits;
            let room = (middle[j] - l.position[0]).min(l.position[1] - middle[j]);
            let bounds = [room, l.velocity, l.acceleration, l.jerk];
            let most = (0..4).map(|k| {
                bounds[k as usize] / unit.joints[j].amplitude_sum(&unit.harmonics, omega, k)
            });
            2.0 * most.fold(f64::INFINITY, f64::min)
        })
        .collect();
    let mut size = 1.0;
    while size > SMALLEST {
        let x: Vec<f64> = (0..basis.len())
            .map(|i| rest[i / m][i % m] + size * amplitude[i / m] * random[i])
            .collect();
        let fourier = basis.fourier(period, &x);
        if limits.holds(&fourier)? {
            return Ok(Some(fourier));
        }
        size *= 0.88;
    }
    Ok(None)
}

/// Changes of the sign of the velocity of all actuators in a period.
fn reversals(plant: &Plant, fourier: &Fourier) -> Result<usize> {
    let moved = plant.actuator_motion(&fourier.motion(points(fourier)))?;
    Ok(turns(&moved))
}

/// Samples that show every change of sign.
fn points(fourier: &Fourier) -> usize {
    40 * fourier.harmonic_max() as usize
}

/// Changes of the sign of all velocities.
fn turns(motion: &Samples) -> usize {
    let row = |v: &[f64]| v.windows(2).filter(|w| w[0] * w[1] < 0.0).count();
    motion.qd.chunks_exact(motion.count).map(row).sum()
}
