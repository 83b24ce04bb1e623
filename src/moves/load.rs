//! What a leg asks of the actuators, sampled and then bounded: torques and their rates, the speed of the tool point, and of closed chains the
//! motion of the actuators and the limits of the pose.

use super::bound::{Bounds, bounds};
use super::closed;
use super::leg::Leg;
use super::most::Most;
use super::tool::ToolPeak;
use crate::dynamics::Samples;
use crate::error::Result;
use crate::plant::Plant;
use crate::regressor::term_factor;
use crate::robot::JointTerm;

/// Samples of a leg: so many a second, within bounds.
const RATE: f64 = 500.0;
const FEWEST: usize = 100;
const MOST: usize = 4000;
/// Factor at which a leg counts as standing.
const SLOWEST: f64 = 1e6;
/// Factor to which slowness is found, and times that a slowed leg is slowed by it again, where its own samples ask for it.
const CLOSE: f64 = 1.01;
const AGAIN: usize = 30;

/// Largest torque of an actuator during a move.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct TorquePeak {
    /// name of the actuator
    pub joint: String,
    /// largest magnitude at a sample, N m or N
    pub value: f64,
    /// its limit; `None` where none is stated
    pub limit: Option<f64>,
    /// share of the limit
    pub used: Option<f64>,
    /// largest rate of the smooth torque between two samples, N m/s or N/s; `None` without a limit of it
    pub rate: Option<f64>,
    /// share of the limit of the rate
    pub rate_used: Option<f64>,
    /// the torque exceeds this at no time (proven for serial and tree robots, stated for parallel ones); `None` without a limit
    pub bound: Option<f64>,
    /// the rate exceeds this at no time; `None` without a limit
    pub rate_bound: Option<f64>,
}

/// Samples of a leg, ends included, and the time between two of them.
fn samples(leg: &Leg) -> (Samples, f64) {
    let count = ((leg.duration * RATE) as usize).clamp(FEWEST, MOST) + 1;
    let times = (0..count).map(|s| leg.duration * s as f64 / (count - 1) as f64);
    let times: Vec<f64> = times.collect();
    (leg.samples(&times), leg.duration / (count - 1) as f64)
}

/// The same samples `factor` times as slow; without end: at rest.
fn slower(x: &Samples, factor: f64) -> Samples {
    let mut out = x.clone();
    out.qd.iter_mut().for_each(|v| *v /= factor);
    out.qdd.iter_mut().for_each(|a| *a /= factor * factor);
    out
}

/// Largest torques of samples `step` seconds apart, raised in `peaks`, and their largest rates.
fn torques(
    plant: &Plant,
    x: &Samples,
    step: f64,
    peaks: &mut [f64],
    rates: &mut [f64],
) -> Result<()> {
    let tau = plant.nominal_torque(x)?;
    for (rate, own) in rates.iter_mut().zip(largest_rates(plant, x, &tau, step)) {
        *rate = rate.max(own.unwrap_or(0.0));
    }
    for (peak, row) in peaks.iter_mut().zip(tau.chunks_exact(x.count)) {
        *peak = row.iter().fold(
            *peak,
            |m, t| if t.is_nan() { f64::NAN } else { m.max(t.abs()) },
        );
    }
    Ok(())
}

/// Largest rate of the torque of each actuator between samples `step` seconds apart, without Coulomb friction,
/// which jumps; `None` where it has no limit.
pub(super) fn largest_rates(
    plant: &Plant,
    x: &Samples,
    tau: &[f64],
    step: f64,
) -> Vec<Option<f64>> {
    let joints = plant.actuators();
    let each = joints.iter().enumerate().map(|(a, joint)| {
        if joint.limits.effort_rate.is_infinite() || !(step > 0.0) {
            return None;
        }
        let coulomb = joint.terms[JointTerm::Coulomb as usize];
        let smooth = |s: usize| {
            let state = x.at(a, s);
            let jump = coulomb * term_factor(JointTerm::Coulomb, state);
            tau[a * x.count + s] - jump - joint.stribeck.torque(state[1])
        };
        let rates = (1..x.count).map(|s| ((smooth(s) - smooth(s - 1)) / step).abs());
        Some(rates.fold(0.0, f64::max))
    });
    each.collect()
}

/// The limit of torques, their rates and the tool point that samples use most.
fn most(plant: &Plant, x: &Samples, step: f64) -> Result<Most> {
    let mut out = Most::default();
    let joints = plant.actuators();
    let mut peaks = vec![0.0; joints.len()];
    let mut rates = peaks.clone();
    torques(plant, x, step, &mut peaks, &mut rates)?;
    if let Some(tool) = ToolPeak::of(plant, x) {
        for (what, used) in tool.shares() {
            out.offer(used, || {
                format!("{what} {}: {:.1} %", tool.frame, 100.0 * used)
            });
        }
    }
    for (joint, rate) in joints.iter().zip(&rates) {
        let limit = joint.limits.effort_rate;
        out.offer(rate / limit, || {
            format!("rate of torque of {}: {rate:.4} of {limit:.4}", joint.name)
        });
    }
    for (joint, peak) in joints.iter().zip(&peaks) {
        let limit = joint.limits.effort;
        out.offer(peak / limit, || {
            format!("torque of {}: {peak:.4} of {limit:.4}", joint.name)
        });
    }
    Ok(out)
}

/// The leg as slow as the limits ask for that were sampled: the factor is found by bisection to 1 %.
/// Otherwise the limit that no slowness keeps, because the postures alone exceed it. A leg that may not
/// be slowed (its ends move) is taken as it is or not at all.
pub fn bearable(plant: &Plant, leg: &Leg) -> Result<std::result::Result<Leg, Most>> {
    let leg = match sampled(plant, leg)? {
        Ok(leg) => leg,
        Err(most) => return Ok(Err(most)),
    };
    let used = |leg: &Leg| Ok(bounded(plant, &bounds(plant, leg)?, share(leg)));
    let first = used(&leg)?;
    if first.kept() {
        return Ok(Ok(leg));
    }
    if !leg.resting {
        return Ok(Err(first));
    }
    // a hundredth mostly is enough
    let (mut low, mut high) = (1.0, CLOSE);
    loop {
        let most = used(&leg.stretched(high))?;
        if most.kept() {
            break;
        }
        if high > SLOWEST {
            return Ok(Err(most));
        }
        (low, high) = (high, 1.0 + 2.0 * (high - 1.0));
    }
    let high = narrowed(low, high, |f| Ok(used(&leg.stretched(f))?.kept()))?;
    Ok(Ok(leg.stretched(high)))
}

/// The least factor that is kept, to [`CLOSE`], between one that is not and one that is.
fn narrowed(mut low: f64, mut high: f64, kept: impl Fn(f64) -> Result<bool>) -> Result<f64> {
    while high > CLOSE * low {
        let middle = 0.5 * (low + high);
        match kept(middle)? {
            true => high = middle,
            false => low = middle,
        }
    }
    Ok(high)
}

/// The limit that bounds use most, `share` of those of velocity, acceleration and jerk of a closed chain's joints being allowed.
fn bounded(plant: &Plant, found: &Bounds, share: f64) -> Most {
    let mut out = Most::default();
    if let Some(reached) = &found.closed {
        closed::offer(&mut out, reached, share);
    }
    let each = plant
        .actuators()
        .into_iter()
        .zip(&found.torque)
        .zip(&found.rate);
    for ((joint, torque), rate) in each {
        let (effort, fastest) = (joint.limits.effort, joint.limits.effort_rate);
        out.offer(torque / effort, || {
            format!("torque of {}: up to {torque:.4} of {effort:.4}", joint.name)
        });
        out.offer(rate / fastest, || {
            format!(
                "rate of torque of {}: up to {rate:.4} of {fastest:.4}",
                joint.name
            )
        });
    }
    if let Some(tool) = &plant.robot().tool {
        let both = [("speed", tool.speed), ("acceleration", tool.acceleration)];
        for ((what, limit), bound) in both.into_iter().zip(found.tool) {
            out.offer(bound / limit, || {
                format!(
                    "{what} of the tool point {}: up to {bound:.4} of {limit:.4}",
                    tool.frame
                )
            });
        }
    }
    out
}

/// What all legs exceed at no time.
pub fn all_bounds(plant: &Plant, legs: &[Leg]) -> Result<Bounds> {
    let (mut all, mut start) = (Bounds::none(plant.actuators().len()), 0.0);
    for leg in legs {
        all = all.or(bounds(plant, leg)?.later(start));
        start += leg.duration;
    }
    Ok(all)
}

/// Share of the limits of velocity, acceleration and jerk that a leg may use.
fn share(leg: &Leg) -> f64 {
    match leg.resting {
        true => leg.scale,
        false => 1.0,
    }
}

fn sampled(plant: &Plant, leg: &Leg) -> Result<std::result::Result<Leg, Most>> {
    let ((x, step), may_slow) = (samples(leg), leg.resting);
    let slow = |f: f64| most(plant, &slower(&x, f), f * step);
    let first = most(plant, &x, step)?;
    if first.kept() {
        return Ok(Ok(leg.clone()));
    }
    let held = slow(SLOWEST)?;
    if !may_slow || !held.kept() {
        return Ok(Err(if may_slow { held } else { first }));
    }
    let (mut low, mut high) = (1.0, 2.0);
    while high < SLOWEST && !slow(high)?.kept() {
        (low, high) = (high, 2.0 * high);
    }
    let high = narrowed(low, high, |f| Ok(slow(f)?.kept()))?;
    let mut slow = leg.stretched(high);
    // its own samples lie elsewhere than those that were slowed
    for _ in 0..AGAIN {
        let (x, step) = samples(&slow);
        if most(plant, &x, step)?.kept() {
            break;
        }
        slow = slow.stretched(CLOSE);
    }
    Ok(Ok(slow))
}

/// Largest speed and acceleration of the tool point of all legs, and their bounds.
pub fn tool(plant: &Plant, legs: &[Leg], bounds: &Bounds) -> Option<ToolPeak> {
    let each = legs
        .iter()
        .filter_map(|leg| ToolPeak::of(plant, &samples(leg).0));
    let mut most = each.reduce(|a, b| a.or(&b))?;
    most.speed_bound = most.speed_used.map(|_| bounds.tool[0]);
    most.acceleration_bound = most.acceleration_used.map(|_| bounds.tool[1]);
    Some(most)
}

/// Largest torques of all legs, and their bounds.
pub fn peaks(plant: &Plant, legs: &[Leg], bounds: &Bounds) -> Result<Vec<TorquePeak>> {
    let joints = plant.actuators();
    let mut most = vec![0.0; joints.len()];
    let mut rates = most.clone();
    for leg in legs {
        let (x, step) = samples(leg);
        torques(plant, &x, step, &mut most, &mut rates)?;
    }
    let each = joints.iter().zip(most).zip(rates).enumerate();
    Ok(each
        .map(|(a, ((joint, value), rate))| {
            let fastest = joint.limits.effort_rate;
            let rate = fastest.is_finite().then_some(rate);
            let limit = joint.limits.effort;
            let limit = limit.is_finite().then_some(limit);
            TorquePeak {
                joint: joint.name.clone(),
                value,
                limit,
                used: limit.map(|l| value / l),
                rate,
                rate_used: rate.map(|r| r / fastest),
                bound: limit.map(|_| bounds.torque[a]),
                rate_bound: rate.map(|_| bounds.rate[a]),
            }
        })
        .collect())
}
