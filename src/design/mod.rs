//! Design of exciting trajectories: the criterion, the limits, and the sequential convex programs
//! that bring them together.
//!
//! ```text
//! minimise over x   cond W(x)      (or another criterion)
//! subject to        q_min ≤ q(t; x) ≤ q_max,  |q̇| ≤ v,  |q̈| ≤ a,  |q⃛| ≤ j,  |τ| ≤ τ_max   for all t
//! ```
//!
//! with `q(t; x)` a Fourier series whose end conditions are built in ([`Basis`]). The problem is
//! not convex, so [`design`] runs many starts in rounds: eight random ones are each improved by
//! convex programs ([`solve`]), the best three of them are followed to the end, and later rounds
//! also start from disturbed copies of the best so far. Each start has its own stream of random
//! numbers and rounds are compared in a fixed order, so the result is the same for the same seed
//! whatever the number of threads, unless a time limit ends the run.

mod closed;
mod closed_limits;
pub mod criterion;
pub mod diagnostic;
pub mod information;
pub mod limits;
pub mod path;
pub mod record;
pub mod settings;
pub mod solve;
pub mod start;
pub mod torque;

pub use criterion::{Condition, Criterion};
pub use record::{Record, Status};
pub use settings::Settings;

use crate::base::BaseParameters;
use crate::dynamics::Tree;
use crate::error::{Error, Result, Warning, WarningKind};
use crate::identifiability::{certificate, torque_noise};
use crate::mechanism::{Mechanism, PosePeak, closed_certificate};
use crate::plant::Plant;
use crate::robot::{JointTerm, Motion, Robot};
use crate::trajectory::{Basis, Certificate, Fourier, Space, Trajectory};
use closed_limits::ClosedLimits;
use criterion::Objective;
use information::Information;
use limits::Limits;
use path::PathLimits;
use rayon::prelude::*;
use solve::{Iterate, Phase, Stop, Task};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use torque::TorqueLimits;

/// Starts in a round, and how many of them are followed to the end.
const ROUND: (usize, usize) = (8, 3);
/// Random candidates of which the best becomes a start.
const CANDIDATES: usize = 24;
/// Exponents of the p-norms that smooth the extreme eigenvalues, first and second phase.
const NORMS: (f64, f64) = (10.0, 40.0);

/// A designed trajectory and how it came about.
#[derive(Debug, Clone)]
pub struct Design {
    /// the robot, with the limits that were assumed where it states none
    pub robot: Robot,
    /// the trajectory, inside all limits for all time
    pub trajectory: Trajectory,
    /// criterion of the result (see [`record::Start::history`] for what it is)
    pub value: f64,
    /// what happened
    pub record: Record,
}

/// Where a design stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// starts done
    pub starts: usize,
    /// starts planned; `None` while only time ends the run
    pub planned: Option<usize>,
    /// best criterion so far
    pub best: f64,
    /// wall clock, s
    pub seconds: f64,
}

/// Fills in limits that a robot does not state, each with a warning: ±π or ±0.5 m, 1 rad/s or
/// 0.25 m/s, five times the velocity per second. Jerk and effort stay unlimited.
pub fn with_assumed_limits(robot: &Robot) -> Robot {
    let mut robot = robot.clone();
    for joint in &mut robot.joints {
        let l = &mut joint.limits;
        let mut assumed = Vec::new();
        let (reach, speed, unit) = match joint.motion {
            Motion::Revolute => (std::f64::consts::PI, 1.0, "rad"),
            Motion::Prismatic => (0.5, 0.25, "m"),
        };
        let [low, high] = l.position;
        if !low.is_finite() || !high.is_finite() {
            l.position = match (low.is_finite(), high.is_finite()) {
                (true, _) => [low, low + 2.0 * reach],
                (_, true) => [high - 2.0 * reach, high],
                _ => [-reach, reach],
            };
            assumed.push(format!(
                "position {:.4} to {:.4} {unit}",
                l.position[0], l.position[1]
            ));
        }
        if !l.velocity.is_finite() {
            l.velocity = speed;
            assumed.push(format!("velocity {speed} {unit}/s"));
        }
        if !l.acceleration.is_finite() {
            l.acceleration = 5.0 * l.velocity;
            assumed.push(format!("acceleration {} {unit}/s^2", l.acceleration));
        }
        if !assumed.is_empty() {
            robot.warnings.push(Warning::new(
                WarningKind::LimitsMissing,
                joint.name.clone(),
                format!(
                    "limits not stated, assumed for the design: {}",
                    assumed.join(", ")
                ),
            ));
        }
        if !joint.limits.effort.is_finite() {
            robot.warnings.push(Warning::new(
                WarningKind::LimitsMissing,
                joint.name.clone(),
                "no effort limit stated: its torque is not limited in the design",
            ));
        }
    }
    robot
}

/// Designs an exciting trajectory.
///
/// `interrupt` ends the run early when set; `progress` is called after every finished start. In
/// both cases, and when a time limit ends the run, the best feasible trajectory so far is
/// returned.
///
/// # Errors
/// [`Error::Argument`] for settings that cannot be, [`Error::Infeasible`] where no trajectory is
/// inside the limits (torques at rest, say) or nothing can be identified.
pub fn design(
    robot: &Robot,
    settings: &Settings,
    interrupt: &AtomicBool,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Design> {
    settings.check(robot)?;
    let begin = Instant::now();
    let robot = with_assumed_limits(robot);
    let base = BaseParameters::new(&robot)?;
    something_to_identify(&robot.name, &base)?;
    let basis = basis(&robot, settings)?;
    let count = samples(&robot, &basis.harmonics);
    let noise = torque_noise(&robot).0;
    let weights = (settings.condition == Condition::Weighted).then_some(noise.as_slice());
    let transform = transform(&base, settings);
    let info = Information::new(&robot, &basis, settings.period, count, transform, weights);
    let mut derated = robot.clone();
    for joint in &mut derated.joints {
        joint.limits.effort *= settings.derate;
    }
    let tree = Tree::new(&robot);
    first_certified(|tighter| {
        let torque = TorqueLimits::new(&robot, settings.derate * tighter);
        Problem {
            robot: &robot,
            settings,
            basis: &basis,
            info: &info,
            limits: Limits::new(&robot, &basis, settings.period, settings.derate),
            path: torque.as_ref().map(|t| t as &dyn PathLimits),
            space: None,
            broken: &|fourier| {
                let c = certificate(&derated, &tree, fourier)?;
                Ok(beyond(c.satisfied, [&c], &[]))
            },
        }
        .solve(begin, interrupt, progress)
    })
}

/// Designs an exciting trajectory of either kind of robot, see [`design`] and [`design_closed`].
///
/// # Errors
/// As these.
pub fn design_plant(
    plant: &Plant,
    settings: &Settings,
    interrupt: &AtomicBool,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Design> {
    match plant {
        Plant::Serial(robot) => design(robot, settings, interrupt, progress),
        Plant::Parallel(mechanism) => design_closed(mechanism, settings, interrupt, progress),
    }
}

/// Designs an exciting trajectory of a closed chain: a Fourier series for each task coordinate (of
/// the platform, or of the actuators of [`Mechanism::in_actuators`] and of loops), inside the
/// workspace box and the limits of actuators, passive joints and singularities. [`Design::robot`] has
/// the task coordinates as its joints.
///
/// # Errors
/// As [`design`].
pub fn design_closed(
    mechanism: &Mechanism,
    settings: &Settings,
    interrupt: &AtomicBool,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Design> {
    let robot = mechanism.task_robot();
    settings.check(&robot)?;
    let begin = Instant::now();
    let base = mechanism.base()?;
    something_to_identify(&robot.name, &base)?;
    let basis = basis(&robot, settings)?;
    let count = samples(&mechanism.robot, &basis.harmonics);
    let noise = torque_noise(&mechanism.actuator_robot()).0;
    let weights = (settings.condition == Condition::Weighted).then_some(noise.as_slice());
    let transform = transform(&base, settings);
    let info = Information::closed(
        mechanism,
        &basis,
        settings.period,
        count,
        transform,
        weights,
    );
    first_certified(|tighter| {
        let derate = settings.derate * tighter;
        let path = ClosedLimits::new(mechanism, derate, settings.period, count);
        let limits = Limits::new(&robot, &basis, settings.period, settings.derate);
        Problem {
            robot: &robot,
            settings,
            basis: &basis,
            info: &info,
            limits: limits.resting(&mechanism.home),
            path: Some(&path),
            space: Some(mechanism.space()),
            broken: &|fourier| {
                let c = closed_certificate(mechanism, fourier, settings.derate)?;
                Ok(beyond(c.satisfied, [&c.platform, &c.actuators], &c.pose))
            },
        }
        .solve(begin, interrupt, progress)
    })
}

/// Shares of the limits along the path within which the search is repeated, one after the other,
/// when the certificate refuses its result: samples miss peaks that lie between them.
const TIGHTER: [f64; 4] = [1.0, 0.97, 0.9, 0.8];

/// The first search whose result is certified. Every other result is dropped: the error says which
/// limit the first one broke, and by how much.
fn first_certified(
    mut search: impl FnMut(f64) -> Result<Result<Design, String>>,
) -> Result<Design> {
    let mut refused = None;
    for tighter in TIGHTER {
        match (search(tighter), &refused) {
            (Ok(Ok(design)), _) => return Ok(design),
            (Ok(Err(why)), None) => refused = Some(why),
            (Ok(Err(_)), Some(_)) => {}
            (Err(e), None) => return Err(e),
            (Err(_), Some(_)) => break,
        }
    }
    Err(Error::Infeasible(refused.unwrap_or_default()))
}

/// Steps by which a motion is shrunk until it is certified: to 82 % of its size at most.
const SHRINKS: usize = 100;

/// What a certificate finds broken, in words; `None` where all limits hold.
fn beyond<'a>(
    satisfied: bool,
    certificates: impl IntoIterator<Item = &'a Certificate>,
    pose: &[PosePeak],
) -> Option<String> {
    if satisfied {
        return None;
    }
    let joints = certificates.into_iter().filter_map(|c| c.worst.as_ref());
    let joints = joints.map(|w| (w.used, format!("{} of {}", w.kind.name(), w.joint)));
    let pose = pose.iter().map(|p| (p.used, p.name.clone()));
    let worst = joints.chain(pose).max_by(|a, b| a.0.total_cmp(&b.0));
    Some(match worst {
        Some((used, what)) => format!("{what} at {:.1} % of its limit", 100.0 * used),
        None => "a limit that cannot be evaluated".into(),
    })
}

fn something_to_identify(name: &str, base: &BaseParameters) -> Result<()> {
    match base.count() {
        0 => Err(Error::Infeasible(format!(
            "{name}: no parameter can be identified from actuator torques, so there is nothing to \
             excite; check gravity, axes and `identify`"
        ))),
        _ => Ok(()),
    }
}

fn basis(robot: &Robot, settings: &Settings) -> Result<Basis> {
    let harmonics = settings.grid.harmonics(settings.harmonics, settings.seed);
    let start = settings.start.as_deref();
    Basis::new(&harmonics, settings.ends, robot.dof(), start)
}

/// `B` of the matrix that the settings ask for.
fn transform(base: &BaseParameters, settings: &Settings) -> faer::Mat<f64> {
    match settings.condition {
        Condition::Invariant => base.row_space.clone(),
        _ => base.selection(),
    }
}

/// One problem of either kind.
struct Problem<'a> {
    /// what the series move, with its limits
    robot: &'a Robot,
    settings: &'a Settings,
    basis: &'a Basis,
    info: &'a Information<'a>,
    limits: Limits,
    path: Option<&'a dyn PathLimits>,
    /// what the series move, of a closed chain
    space: Option<Space>,
    /// the limit that a motion breaks at some time, in words
    broken: &'a dyn Fn(&Fourier) -> Result<Option<String>>,
}

impl Problem<'_> {
    /// The best trajectory that was found and certified, or what is broken in the best one.
    fn solve(
        &self,
        begin: Instant,
        interrupt: &AtomicBool,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<Result<Design, String>> {
        let settings = self.settings;
        let (starts, time_limit) = settings.budget();
        let deadline = begin + Duration::from_secs_f64(time_limit.min(1e8));
        let scale = start::scales(self.robot, settings.period);
        let objective = Objective {
            criterion: settings.criterion,
            condition: settings.condition,
        };
        let task = Task {
            info: self.info,
            objective,
            limits: &self.limits,
            path: self.path,
            scale: &scale,
            deadline: time_limit.is_finite().then_some(deadline),
        };
        let halt = || interrupt.load(Ordering::Relaxed) || Instant::now() >= deadline;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(settings.threads)
            .build()
            .map_err(|e| Error::Argument(format!("threads: {e}")))?;
        let source = start::Source {
            robot: self.robot,
            basis: self.basis,
            task: &task,
            seed: settings.seed,
        };
        let mut search = Search::default();
        pool.install(|| -> Result<()> {
            while search.next < starts && (search.best.is_none() || !halt()) {
                search.round(&source, starts, &halt, &|done, best| {
                    progress(Progress {
                        starts: done,
                        planned: (starts < usize::MAX).then_some(starts),
                        best: best.exp(),
                        seconds: begin.elapsed().as_secs_f64(),
                    });
                })?;
                if search.best.is_none() && search.next >= 8 * ROUND.0 {
                    break;
                }
            }
            Ok(())
        })?;
        let status = match (interrupt.load(Ordering::Relaxed), halt()) {
            (true, _) => Status::Interrupted,
            (_, true) => Status::TimeLimit,
            _ => Status::Converged,
        };
        let Some((best, iterate)) = search.best else {
            return Err(Error::Infeasible(self.infeasible()));
        };
        let fourier = match self.settle(&iterate.x)? {
            Ok(fourier) => fourier,
            Err(broken) => {
                return Ok(Err(format!(
                    "{}: no trajectory inside all limits was found: the best one has {broken}; raise that \
                     limit, lower --derate, or choose a start posture or another --seed",
                    self.robot.name
                )));
            }
        };
        let trajectory = Trajectory {
            space: self.space,
            periods: settings.periods,
            ends: settings.ends,
            grid: settings.grid,
            settings: serde_json::to_value(settings).unwrap_or_default(),
            ..Trajectory::new(self.robot, fourier)
        };
        let record = Record {
            settings: settings.clone(),
            status,
            starts: search.starts,
            best,
            seconds: begin.elapsed().as_secs_f64(),
        };
        Ok(Ok(Design {
            robot: self.robot.clone(),
            trajectory,
            value: iterate.value.exp(),
            record,
        }))
    }

    /// Rounds off: end conditions to the last digit, and the motion shrunk by thousandths while the
    /// certificate, what happens between the samples included, finds anything: about its rest, then
    /// (a rest that needs more torque than the motion makes it worse) about its own mean.
    /// Otherwise what is broken in the motion as it came.
    fn settle(&self, x: &[f64]) -> Result<Result<Fourier, String>> {
        let first = self.basis.fourier(self.settings.period, x);
        let Some(found) = (self.broken)(&first)? else {
            return Ok(Ok(first));
        };
        let m = self.basis.free();
        let rest = (0..self.robot.dof()).flat_map(|j| self.limits.rest_parameters(j));
        let mean = (0..self.robot.dof()).flat_map(|j| {
            let mut c = self.basis.coefficients(j, &x[j * m..(j + 1) * m]);
            c.rows_range_mut(1..).fill(0.0);
            self.basis.parameters(j, c.as_slice()).as_slice().to_vec()
        });
        for centre in [rest.collect::<Vec<f64>>(), mean.collect()] {
            let mut x = x.to_vec();
            for _ in 0..SHRINKS {
                x.iter_mut()
                    .zip(&centre)
                    .for_each(|(x, r)| *x = r + 0.998 * (*x - r));
                let fourier = self.basis.fourier(self.settings.period, &x);
                if (self.broken)(&fourier)?.is_none() {
                    return Ok(Ok(fourier));
                }
            }
        }
        Ok(Err(found))
    }

    /// Why there is no feasible trajectory.
    fn infeasible(&self) -> String {
        let rest: Vec<f64> = (0..self.robot.dof())
            .flat_map(|j| self.limits.rest_parameters(j))
            .collect();
        let mut motion = Default::default();
        self.info.sample(&rest, &mut motion);
        let broken = match self.path {
            Some(path) => path.broken(self.info, &motion),
            None => String::new(),
        };
        match broken.is_empty() {
            false => format!(
                "{}: no feasible trajectory: at rest in the middle of its range {broken}; check \
                 masses, gravity, the limit, or choose a start posture",
                self.robot.name
            ),
            true => format!(
                "{}: no feasible trajectory was found; check the limits and the start posture",
                self.robot.name
            ),
        }
    }
}

/// Samples of a period in the optimiser: enough for the harmonics that trigonometric functions of
/// the positions add, more where the sign of the velocity is a column.
fn samples(robot: &Robot, harmonics: &[u32]) -> usize {
    let most = harmonics.iter().copied().max().unwrap_or(1) as usize;
    let coulomb = robot
        .joints
        .iter()
        .any(|j| j.identify[JointTerm::Coulomb as usize]);
    (most * if coulomb { 36 } else { 20 }).clamp(64, 8000)
}

/// State of the rounds.
#[derive(Default)]
struct Search {
    next: usize,
    best: Option<(usize, Iterate)>,
    starts: Vec<record::Start>,
}

impl Search {
    /// One round: starts, first phase, the best to the end.
    fn round(
        &mut self,
        source: &start::Source,
        most: usize,
        halt: &(dyn Fn() -> bool + Sync),
        report: &(dyn Fn(usize, f64) + Sync),
    ) -> Result<()> {
        let task = source.task;
        let first = self.next;
        let size = ROUND.0.min(most - first);
        self.next += size;
        let incumbent = self.best.as_ref().map(|(_, b)| b);
        let begun: Vec<Option<(usize, Iterate, bool)>> = (first..first + size)
            .into_par_iter()
            .map(|number| {
                if (incumbent.is_some() || number > first) && halt() {
                    return Ok(None);
                }
                // every other start of the later rounds disturbs the best so far
                let x = match incumbent {
                    Some(b) if number % 2 == 1 => Some(source.disturbed(&b.x, number)),
                    _ => source.random(number, CANDIDATES, halt),
                };
                let Some(x) = x else { return Ok(None) };
                let mut it = Iterate::new(task, x);
                let stop = Stop {
                    iterations: 120,
                    gain: 1e-2,
                };
                it.run(task, Phase::Smooth(NORMS.0), stop, halt)?;
                Ok(Some((number, it, false)))
            })
            .collect::<Result<_>>()?;
        let mut begun: Vec<_> = begun.into_iter().flatten().collect();
        begun.sort_by(|a, b| a.1.value.total_cmp(&b.1.value).then(a.0.cmp(&b.0)));
        begun
            .par_iter_mut()
            .take(ROUND.1)
            .try_for_each(|(_, it, done)| -> Result<()> {
                let stop = Stop {
                    iterations: 150,
                    gain: 2e-3,
                };
                it.run(task, Phase::Smooth(NORMS.1), stop, halt)?;
                let stop = Stop {
                    iterations: 60,
                    gain: 5e-4,
                };
                *done = it.run(task, Phase::Exact, stop, halt)?;
                Ok(())
            })?;
        begun.sort_by_key(|b| b.0);
        for (number, it, converged) in begun {
            let history = it.history.iter().map(|v| v.exp().min(1e300)).collect();
            self.starts.push(record::Start {
                number,
                history,
                converged,
            });
            if self.best.as_ref().is_none_or(|(_, b)| it.value < b.value) {
                self.best = Some((number, it));
            }
        }
        if let Some((_, b)) = &self.best {
            report(self.next, b.value);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_refused_is_searched_again_and_then_an_error() {
        let mut tried = Vec::new();
        let found = first_certified(|tighter| {
            tried.push(tighter);
            Ok(Err(format!("torque of j2 at {} %", 106.5 * tighter)))
        });
        assert_eq!(tried, TIGHTER);
        let message = found.unwrap_err().to_string();
        assert_eq!(message, "torque of j2 at 106.5 %");
        let mut count = 0;
        let found = first_certified(|_| {
            count += 1;
            match count {
                1 => Ok(Err("first".into())),
                _ => Err(Error::Infeasible("nothing inside".into())),
            }
        });
        assert_eq!(
            (count, found.unwrap_err().to_string()),
            (2, "first".to_string())
        );
    }
}
