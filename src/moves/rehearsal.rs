//! A motion at several speeds: what it asks of every actuator, and how long and large it is.
//!
//! At a share `s` of the speed the path is the same and
//!
//! ```text
//! q̇ = s q̇₁,   q̈ = s² q̈₁,   τ = ID(q, s q̇₁, s² q̈₁)
//! τ_rms² = (1/T) ∫ τ² dt       P = τ q̇       P̄ = (1/T) ∫ |P| dt       W = ∫ Σ P dt
//! ```
//!
//! Integrals over the period are sums over even samples, exact for what has few harmonics.

use super::load::largest_rates;
use super::tool::ToolPeak;
use crate::dynamics::Samples;
use crate::error::{Error, Result};
use crate::plant::Plant;
use crate::trajectory::samples::{length_of_samples, times};
use crate::trajectory::{Fourier, Trajectory};

/// Samples of a period: so many a harmonic, and at least.
const PER_HARMONIC: usize = 100;
const FEWEST: usize = 2000;
const MOST: usize = 20_000;

/// What a motion asks of one actuator.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Load {
    /// name of the actuator
    pub joint: String,
    /// largest torque at a sample, N m or N
    pub torque: f64,
    /// share of the limit of torque; `None` where none is stated
    pub torque_used: Option<f64>,
    /// share of the limit of the rate of torque, between two samples and without Coulomb friction; `None` where
    /// none is stated
    pub torque_rate_used: Option<f64>,
    /// largest speed, rad/s or m/s
    pub velocity: f64,
    /// share of the limit of velocity
    pub velocity_used: Option<f64>,
    /// share of the velocity that the position leaves, at a sample; `None` without such a limit
    pub velocity_by_position_used: Option<f64>,
    /// largest acceleration
    pub acceleration: f64,
    /// share of the limit of acceleration
    pub acceleration_used: Option<f64>,
    /// root of the mean square torque
    pub rms_torque: f64,
    /// share of the continuous torque; `None` where none is stated
    pub rms_used: Option<f64>,
    /// largest mechanical power, given out or taken in, W
    pub peak_power: f64,
    /// mean magnitude of the mechanical power, W
    pub mean_power: f64,
    /// share of the continuous power; `None` where none is stated
    pub mean_power_used: Option<f64>,
}

/// A motion at one speed.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Speed {
    /// share of the speed
    pub speed: f64,
    /// all periods, s
    pub seconds: f64,
    /// samples at the rate, end point included
    pub samples: usize,
    /// bytes of the samples as CSV: `t,q..,dq..,ddq..`
    pub bytes: usize,
    /// the actuators
    pub joints: Vec<Load>,
    /// the tool point; `None` where it has no limits
    pub tool: Option<ToolPeak>,
    /// work of all actuators over one period, J: what friction takes
    pub work: f64,
}

impl Speed {
    /// The actuator and the share of the limit or rating that is used most.
    pub fn most(&self) -> Option<(&str, &'static str, f64)> {
        let all = self.joints.iter().flat_map(|l| {
            [
                ("torque", l.torque_used),
                ("rate of torque", l.torque_rate_used),
                ("velocity", l.velocity_used),
                ("velocity by position", l.velocity_by_position_used),
                ("acceleration", l.acceleration_used),
                ("continuous torque", l.rms_used),
                ("continuous power", l.mean_power_used),
            ]
            .into_iter()
            .filter_map(|(what, used)| Some((l.joint.as_str(), what, used?)))
        });
        let tool = self.tool.iter().flat_map(|t| {
            t.shares()
                .map(|(what, used)| (t.frame.as_str(), what, used))
        });
        all.chain(tool).max_by(|a, b| a.2.total_cmp(&b.2))
    }
}

/// A motion at several speeds.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Rehearsal {
    /// name of the robot
    pub robot: String,
    /// samples a second
    pub rate: f64,
    /// periods
    pub periods: u32,
    /// the slowest first
    pub speeds: Vec<Speed>,
}

impl Rehearsal {
    /// Shares of the speed that are rehearsed.
    pub const SPEEDS: [f64; 3] = [0.1, 0.3, 1.0];
}

/// Rehearses a trajectory at some shares of its speed, sampled at `rate` hertz when it is run.
///
/// ```
/// use excite::Plant;
/// use excite::moves::{Rehearsal, rehearse};
/// use excite::trajectory::{Fourier, Trajectory};
/// use excite::trajectory::parts::Series;
///
/// let plant = Plant::load("planar2")?;
/// let swing = Series { constant: 0.0, sin: vec![0.4], cos: vec![0.0] };
/// let fourier = Fourier::new(5.0, vec![1], vec![swing.clone(), swing])?;
/// let table = rehearse(&plant, &Trajectory::new(plant.moved(), fourier), 1000.0, &Rehearsal::SPEEDS)?;
/// assert_eq!(table.speeds[0].samples, 50_001); // a tenth of the speed, 50 s
/// # Ok::<(), excite::Error>(())
/// ```
///
/// # Errors
/// [`Error::Argument`] for a speed that is not positive, a rate as for [`times`], a trajectory of
/// another robot; a pose of a closed chain that cannot be reached.
pub fn rehearse(
    plant: &Plant,
    trajectory: &Trajectory,
    rate: f64,
    speeds: &[f64],
) -> Result<Rehearsal> {
    trajectory.matches(plant.moved())?;
    let fourier = &trajectory.fourier;
    let highest = fourier.harmonics.iter().max().copied().unwrap_or(1) as usize;
    let count = (PER_HARMONIC * highest).clamp(FEWEST, MOST);
    let full = fourier.motion(count);
    let each = speeds.iter().map(|&speed| {
        if !(speed > 0.0 && speed.is_finite()) {
            return Err(Error::Argument(format!(
                "a speed is a positive share of the trajectory's, not {speed}"
            )));
        }
        let mut x = full.clone();
        x.qd.iter_mut().for_each(|v| *v *= speed);
        x.qdd.iter_mut().for_each(|a| *a *= speed * speed);
        let (joints, work) = loads(plant, &x, fourier.period / speed)?;
        let slow = slowed(fourier, speed);
        let seconds = slow.period * f64::from(trajectory.periods);
        let times = times(seconds, rate)?;
        Ok(Speed {
            speed,
            seconds,
            samples: times.len(),
            bytes: length_of_samples(&slow, &times)?,
            joints,
            tool: ToolPeak::of(plant, &x),
            work,
        })
    });
    Ok(Rehearsal {
        robot: plant.name().into(),
        rate,
        periods: trajectory.periods,
        speeds: each.collect::<Result<_>>()?,
    })
}

/// The same path at a share of the speed.
fn slowed(fourier: &Fourier, speed: f64) -> Fourier {
    Fourier {
        period: fourier.period / speed,
        ..fourier.clone()
    }
}

/// Loads of the actuators over even samples of one period, and the work of all of them.
fn loads(plant: &Plant, x: &Samples, period: f64) -> Result<(Vec<Load>, f64)> {
    let tau = plant.nominal_torque(x)?;
    let moved = plant.actuator_motion(x)?;
    let n = x.count;
    let rates = largest_rates(plant, x, &tau, period / n as f64);
    let mut work = 0.0;
    let joints = plant.actuators();
    let each = joints.iter().enumerate().map(|(a, joint)| {
        let rows = a * n..(a + 1) * n;
        let torque = &tau[rows.clone()];
        let (q, v, w) = (
            &moved.q[rows.clone()],
            &moved.qd[rows.clone()],
            &moved.qdd[rows],
        );
        let largest = |x: &[f64]| x.iter().fold(0.0_f64, |m, y| m.max(y.abs()));
        let mean = |sum: f64| sum / n as f64;
        let power: Vec<f64> = torque.iter().zip(v).map(|(t, v)| t * v).collect();
        work += mean(power.iter().sum()) * period;
        let rms = mean(torque.iter().map(|t| t * t).sum()).sqrt();
        let mean_power = mean(power.iter().map(|p| p.abs()).sum());
        let l = joint.limits;
        let share = |x: f64, limit: f64| limit.is_finite().then_some(x / limit);
        Load {
            joint: joint.name.clone(),
            torque: largest(torque),
            torque_used: share(largest(torque), l.effort),
            torque_rate_used: rates[a].map(|r| r / l.effort_rate),
            velocity: largest(v),
            velocity_used: share(largest(v), l.velocity),
            velocity_by_position_used: l.velocity_by_position.map(|limit| {
                let each = q.iter().zip(v).map(|(q, v)| limit.share(*q, *v));
                // JSON has no infinity
                each.fold(0.0, f64::max).min(1e300)
            }),
            acceleration: largest(w),
            acceleration_used: share(largest(w), l.acceleration),
            rms_torque: rms,
            rms_used: joint.continuous_torque.map(|c| rms / c),
            peak_power: largest(&power),
            mean_power,
            mean_power_used: joint.continuous_power.map(|c| mean_power / c),
        }
    });
    Ok((each.collect(), work))
}
