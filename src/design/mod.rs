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

pub mod criterion;
pub mod diagnostic;
pub mod information;
pub mod limits;
mod mechanism_limits;
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
use crate::error::{Error, Result};
use crate::plant::Plant;
use crate::robot::{JointTerm, Robot};
use crate::trajectory::{Basis, Fourier, Trajectory};
use criterion::Objective;
use information::Information;
use limits::Limits;
use mechanism_limits::MechanismLimits;
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
    pub plant: Plant,
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

/// What a design tells while it runs, and what ends it early.
pub struct Control<'a> {
    /// ends the run when set; the best feasible trajectory so far is the result
    pub cancel: &'a AtomicBool,
    /// called after every finished start
    pub progress: &'a (dyn Fn(Progress) + Sync),
}

impl Default for Control<'_> {
    /// Never cancelled, and silent.
    fn default() -> Self {
        static NEVER: AtomicBool = AtomicBool::new(false);
        fn silent(_: Progress) {}
        Control {
            cancel: &NEVER,
            progress: &silent,
        }
    }
}

/// Designs an exciting trajectory: a Fourier series for each coordinate of the plant (the joints of
/// a tree; the platform or the actuators of a closed chain), inside all limits for all time.
///
/// ```
/// use excite::Plant;
/// use excite::design::{Settings, design};
///
/// let plant = Plant::load("planar2")?;
/// let settings = Settings { starts: Some(1), ..Settings::default() };
/// let result = design(&plant, &settings)?;
/// assert!(result.plant.certify(&result.trajectory.fourier, 1.0)?.satisfied());
/// # Ok::<(), excite::Error>(())
/// ```
///
/// # Errors
/// [`Error::Argument`] for settings that cannot be, [`Error::Infeasible`] where no trajectory is
/// inside the limits (torques at rest, say), none that was found is certified, or nothing can be
/// identified.
pub fn design(plant: &Plant, settings: &Settings) -> Result<Design> {
    design_with(plant, settings, &Control::default())
}

/// [`design`] with progress and cancellation. When it is cancelled, and when a time limit ends the
/// run, the best feasible trajectory so far is returned.
///
/// # Errors
/// As [`design`].
pub fn design_with(plant: &Plant, settings: &Settings, control: &Control) -> Result<Design> {
    settings.check(plant.moved())?;
    let begin = Instant::now();
    let plant = &plant.clone().with_assumed_limits();
    let moved = plant.moved();
    let base = plant.base()?;
    something_to_identify(plant.name(), &base)?;
    let basis = basis(moved, settings)?;
    let count = samples(plant.robot(), &basis.harmonics);
    let noise = plant.torque_noise().0;
    let weights = (settings.condition == Condition::Weighted).then_some(noise.as_slice());
    let transform = transform(&base, settings);
    let (period, derate) = (settings.period, settings.derate);
    let info = Information::new(plant, &basis, period, count, transform, weights);
    first_certified(|tighter| {
        let share = derate * tighter;
        let path: Option<Box<dyn PathLimits + '_>> = match plant.mechanism() {
            None => TorqueLimits::new(plant.robot(), share).map(|t| Box::new(t) as _),
            Some(m) => Some(Box::new(MechanismLimits::new(m, share, period, count))),
        };
        let mut limits = Limits::new(moved, &basis, period, derate);
        if let Some(home) = plant.home() {
            limits = limits.resting(home);
        }
        Problem {
            plant,
            settings,
            basis: &basis,
            info: &info,
            limits,
            path: path.as_deref(),
        }
        .solve(begin, control)
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

/// One problem.
struct Problem<'a> {
    plant: &'a Plant,
    settings: &'a Settings,
    basis: &'a Basis,
    info: &'a Information<'a>,
    limits: Limits,
    path: Option<&'a dyn PathLimits>,
}

impl Problem<'_> {
    /// The best trajectory that was found and certified, or what is broken in the best one.
    fn solve(&self, begin: Instant, control: &Control) -> Result<Result<Design, String>> {
        let Control { cancel, progress } = control;
        let (settings, robot) = (self.settings, self.plant.moved());
        let (starts, time_limit) = settings.budget();
        let deadline = begin + Duration::from_secs_f64(time_limit.min(1e8));
        let scale = start::scales(robot, settings.period);
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
        let halt = || cancel.load(Ordering::Relaxed) || Instant::now() >= deadline;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(settings.threads)
            .build()
            .map_err(|e| Error::Argument(format!("threads: {e}")))?;
        let source = start::Source {
            robot,
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
        let status = match (cancel.load(Ordering::Relaxed), halt()) {
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
                    self.plant.name()
                )));
            }
        };
        let trajectory = Trajectory {
            space: self.plant.space(),
            periods: settings.periods,
            ends: settings.ends,
            grid: settings.grid,
            settings: serde_json::to_value(settings).unwrap_or_default(),
            ..Trajectory::new(robot, fourier)
        };
        let record = Record {
            settings: settings.clone(),
            status,
            starts: search.starts,
            best,
            seconds: begin.elapsed().as_secs_f64(),
        };
        Ok(Ok(Design {
            plant: self.plant.clone(),
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
        let Some(found) = self.broken(&first)? else {
            return Ok(Ok(first));
        };
        let m = self.basis.free();
        let rest = (0..self.plant.coordinates()).flat_map(|j| self.limits.rest_parameters(j));
        let mean = (0..self.plant.coordinates()).flat_map(|j| {
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
                if self.broken(&fourier)?.is_none() {
                    return Ok(Ok(fourier));
                }
            }
        }
        Ok(Err(found))
    }

    /// The limit that a motion breaks at some time, in words.
    fn broken(&self, fourier: &Fourier) -> Result<Option<String>> {
        Ok(self.plant.certify(fourier, self.settings.derate)?.broken())
    }

    /// Why there is no feasible trajectory.
    fn infeasible(&self) -> String {
        let rest: Vec<f64> = (0..self.plant.coordinates())
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
                self.plant.name()
            ),
            true => format!(
                "{}: no feasible trajectory was found; check the limits and the start posture",
                self.plant.name()
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
