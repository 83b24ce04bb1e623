//! Rehearsal: the robot simulated under a tracking controller, so that the whole experiment can be
//! run before the robot is touched.
//!
//! ```text
//! M(x) ẍ + b(x, ẋ) + Dᵀ f(q̇) = D_aᵀ τ(t, x, ẋ)
//! ```
//!
//! (`dynamics`) with the controller of `control`, friction that sticks and slides (`friction`)
//! and the deviations from the nominal model that the user asks for ([`effects`]). The classic
//! Runge-Kutta method of fourth order runs with a fixed largest step; where a joint's velocity
//! passes zero the step is cut there, to rounding, so that friction never changes inside a step.
//! The controller is continuous in time: torque and acceleration of a log belong to the same
//! instant. [`record`] then measures the motion: encoder steps, torque noise, a log file.
//!
//! ```
//! use excite::plant::Plant;
//! use excite::simulate::{Settings, simulate};
//! use excite::trajectory::Fourier;
//! use excite::trajectory::parts::Series;
//!
//! let plant = Plant::load("planar2")?;
//! let series = |a: f64| Series { constant: 0.0, sin: vec![a], cos: vec![0.1] };
//! let motion = Fourier::new(2.0, vec![1], vec![series(0.5), series(-0.4)])?;
//! let settings = Settings::default().with(|set| set.rate = 200.0);
//! let run = simulate(&plant, &motion, 1, &settings, &|_| {})?;
//! assert_eq!(run.motion.count, 400);
//! # Ok::<(), excite::Error>(())
//! ```

pub(crate) mod control;
pub(crate) mod dynamics;
#[doc(hidden)]
pub mod effects;
pub(crate) mod friction;
#[doc(hidden)]
pub mod monte_carlo;
pub mod parts;
#[doc(hidden)]
pub mod record;
pub(crate) mod run;
pub(crate) mod settings;
mod simulator;

#[doc(hidden)]
pub use dynamics::{Dynamics, Terms};
pub use effects::Effects;
pub use record::{measure, to_record};
pub use run::Run;
pub use settings::Settings;

use crate::error::{Error, Result, Warning, WarningKind, number};
use crate::plant::Plant;
use crate::trajectory::Fourier;
use simulator::{Instant, Simulator};

/// Most numbers of a simulated log in memory (1.6 GB).
const NUMBERS: f64 = 2e8;
/// Most steps of the integrator.
const STEPS: f64 = 1e9;
/// Most steps of one period, for which the controller keeps a table.
const TABLE: f64 = 2e6;
/// A coordinate this many times as large as any of the reference is lost.
const LOST: f64 = 1e3;
/// Samples between two reports of the progress.
const REPORT: usize = 256;

/// Runs `periods` periods of a reference in the coordinates of the plant. `progress` is called with
/// the fraction done.
///
/// ```
/// use excite::Plant;
/// use excite::simulate::{Settings, simulate};
/// use excite::trajectory::Fourier;
/// use excite::trajectory::parts::Series;
///
/// let plant = Plant::load("planar2")?;
/// let swing = Series { constant: 0.0, sin: vec![0.1], cos: vec![0.0] };
/// let fourier = Fourier::new(2.0, vec![1], vec![swing.clone(), swing])?;
/// let run = simulate(&plant, &fourier, 1, &Settings::default(), &|_| {})?;
/// assert_eq!(run.t.len(), 2000); // 2 s at 1 kHz
/// # Ok::<(), excite::Error>(())
/// ```
///
/// # Errors
/// [`Error::Argument`]: settings that cannot be. [`Error::Infeasible`]: a pose that cannot be
/// reached, a mass matrix that is not positive definite, a robot that does not follow.
pub fn simulate(
    plant: &Plant,
    fourier: &Fourier,
    periods: u32,
    settings: &Settings,
    progress: &dyn Fn(f64),
) -> Result<Run> {
    settings.check()?;
    check_coordinates(plant, fourier)?;
    let count = samples(plant, fourier, periods, settings)?;
    let dt = 1.0 / settings.rate;
    // the log starts after whole periods; its grid is the log's
    let start = fourier.period * f64::from(settings.lead_in);
    let end = start + count as f64 * dt;
    let actuated = plant.actuated();
    let mut simulator = Simulator::new(plant, fourier, settings)?;
    let mut run = Run::new(plant, count, dt);
    let mut now = simulator.begin(fourier)?;
    let mut clock = Clock::new(fourier, settings);
    for k in 0..count {
        let goal = start + k as f64 * dt;
        now = clock.advance(&mut simulator, now, goal)?;
        // what breaks away at this very instant does so in the next step
        simulator.remember(clock.t, &now.tau);
        let seen = simulator.delayed(clock.t, &now.tau);
        run.set(k, &now, &seen, actuated);
        if k % REPORT == 0 {
            progress((goal / end).clamp(0.0, 1.0));
        }
    }
    run.reference = run::reference(plant, fourier, start, &run.t)?;
    run.warnings = clock.warnings(plant, simulator.unsettled);
    Ok(run)
}

/// Time, and what happened in the steps up to it.
struct Clock {
    /// s
    t: f64,
    /// largest step, s
    step: f64,
    /// coordinate beyond which the robot is lost
    lost: f64,
    steps: usize,
    /// steps in which an effort limit cut the torque
    saturated: usize,
}

impl Clock {
    fn new(fourier: &Fourier, settings: &Settings) -> Self {
        Clock {
            t: 0.0,
            step: settings.step,
            lost: LOST * largest(fourier),
            steps: 0,
            saturated: 0,
        }
    }

    /// Goes on to a time in equal steps.
    fn advance(
        &mut self,
        simulator: &mut Simulator,
        mut now: Instant,
        goal: f64,
    ) -> Result<Instant> {
        let from = self.t;
        let pieces = ((goal - from) / self.step - 1e-9).ceil().max(0.0) as usize;
        for i in 0..pieces {
            simulator.remember(self.t, &now.tau);
            let until = match i + 1 == pieces {
                true => goal,
                false => from + (goal - from) * (i + 1) as f64 / pieces as f64,
            };
            now = simulator.advance(self.t, now, until - self.t)?;
            self.t = until;
            self.steps += 1;
            self.saturated += usize::from(now.cut);
            if !now.x.iter().all(|v| v.abs() < self.lost) {
                return Err(Error::Infeasible(format!(
                    "the simulated robot does not follow its reference (t = {:.3} s): its effort \
                     limits may be too low for the load; or lower --bandwidth, or --step",
                    self.t
                )));
            }
        }
        Ok(now)
    }

    fn warnings(&self, plant: &Plant, unsettled: usize) -> Vec<Warning> {
        let mut out = Vec::new();
        if self.saturated > 0 {
            let percent = 100.0 * self.saturated as f64 / self.steps.max(1) as f64;
            out.push(Warning::new(
                WarningKind::TorqueSaturated,
                plant.name(),
                format!("an effort limit cut the torque in {percent:.2} % of the steps"),
            ));
        }
        if unsettled > 0 {
            out.push(Warning::new(
                WarningKind::FrictionChattered,
                plant.name(),
                format!(
                    "friction chattered in {unsettled} of {} steps; a smaller --step resolves it",
                    self.steps
                ),
            ));
        }
        out
    }
}

/// Refuses a reference of another robot.
fn check_coordinates(plant: &Plant, fourier: &Fourier) -> Result<()> {
    if fourier.dof() == plant.coordinates() {
        return Ok(());
    }
    Err(Error::Argument(format!(
        "the trajectory moves {} coordinates, {} has {}: {}",
        fourier.dof(),
        plant.name(),
        plant.coordinates(),
        plant.coordinate_names().join(", ")
    )))
}

/// Samples of the log, if they and the steps to them are not too many.
fn samples(plant: &Plant, fourier: &Fourier, periods: u32, settings: &Settings) -> Result<usize> {
    let samples = (fourier.period * f64::from(periods) * settings.rate).round();
    let (m, na) = (plant.coordinates(), plant.actuated().len());
    let most = (NUMBERS / (1 + 3 * m + 6 * na) as f64).floor();
    if !(1.0..=most).contains(&samples) {
        return Err(Error::Argument(format!(
            "{periods} periods of {} s at {} Hz are {samples} samples; from 1 to {most} can be simulated: choose \
             another --rate or fewer --periods",
            fourier.period, settings.rate
        )));
    }
    let duration = fourier.period * (f64::from(periods) + f64::from(settings.lead_in));
    if duration / settings.step > STEPS || fourier.period / settings.step > TABLE {
        return Err(Error::Argument(format!(
            "{} periods before the log and {periods} in it, {} s, are too many steps of {} s: \
             {STEPS:e} in all and {TABLE:e} a period are possible; choose a larger --step or fewer periods",
            settings.lead_in,
            number(duration),
            settings.step
        )));
    }
    Ok(samples as usize)
}

/// Largest coordinate of a reference, at least 1: a bound for a robot that got lost.
fn largest(fourier: &Fourier) -> f64 {
    fourier
        .joints
        .iter()
        .map(|s| s.constant.abs() + s.amplitude_sum(&fourier.harmonics, fourier.omega(), 0))
        .fold(1.0, f64::max)
}
