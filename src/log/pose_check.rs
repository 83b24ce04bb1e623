//! Measured poses as a check of the geometry: what the actuators would read at each pose, against what they read.
//!
//! ```text
//! r_j = q_j − F_j(pose) = δ q̇_j + what the geometry gets wrong + noise
//! ```
//!
//! Noise is what differs between neighbours, `Σ(r_{i−1} − 2 r_i + r_{i+1})²/6`. A delay `δ` of the poses against the encoders, one for
//! all, is taken out first.

use super::Record;
use crate::dynamics::Samples;
use crate::error::{Warning, WarningKind};
use crate::plant::Plant;
use crate::robot::Motion;

/// Groups of three neighbours that are looked at.
const GROUPS: usize = 400;
/// How many deviations of the noise of one sample a mean error must be to contradict the geometry.
const BEYOND: f64 = 0.5;
/// Least error that matters, in encoder steps.
const STEPS: f64 = 3.0;
/// The same where no step is stated, m or rad.
const LEAST: f64 = 5e-5;

/// What the poses of a record say of one actuator, m or rad.
struct Error {
    rms: f64,
    mean: f64,
    noise: f64,
}

/// A warning where the measured poses of a parallel robot contradict its geometry.
pub(super) fn check(plant: &Plant, record: &Record) -> Option<Warning> {
    let pose = record.pose.as_ref().filter(|_| plant.held_together())?;
    let valid = |i: usize| (i - 1..=i + 1).all(|k| record.valid.get(k) == Some(&true));
    let all: Vec<usize> = (1..record.len().saturating_sub(1))
        .filter(|i| valid(*i))
        .collect();
    let few: Vec<usize> = (all.iter().step_by(all.len().div_ceil(GROUPS).max(1)))
        .flat_map(|i| [i - 1, *i, i + 1])
        .collect();
    let picked: Vec<Vec<f64>> = pose
        .iter()
        .map(|c| few.iter().map(|i| c[*i]).collect())
        .collect();
    let subject = format!("{}: pose", record.name);
    let warn = |message: String| {
        Some(Warning::new(
            WarningKind::PoseContradicts,
            subject.as_str(),
            message,
        ))
    };
    let x = match plant.coordinates_of_pose(&picked) {
        Ok(x) => x,
        Err(e) => return warn(format!("cannot be used: {e}")),
    };
    let mut motion = Samples::zeros(x.len(), few.len());
    for (to, from) in motion.q.chunks_exact_mut(few.len().max(1)).zip(&x) {
        to.copy_from_slice(from);
    }
    let read = match plant.actuator_motion(&motion) {
        Ok(read) => read,
        Err(e) => return warn(format!("some cannot be reached with this geometry: {e}")),
    };
    let n = record.q.len();
    let residual: Vec<Vec<f64>> = (0..n)
        .map(|j| {
            let at = |(k, i): (usize, &usize)| record.q[j][*i] - read.q[j * few.len() + k];
            few.iter().enumerate().map(at).collect()
        })
        .collect();
    let speed = |j: usize, k: usize| {
        let i = few[k - k % 3 + 1];
        (record.q[j][i + 1] - record.q[j][i - 1]) / (2.0 * record.step)
    };
    let (errors, delay) = errors(&residual, &speed)?;
    let actuators = plant.actuators();
    let beyond = |j: usize| -> f64 {
        let step = actuators[j].position_resolution;
        let least = step.map_or(LEAST, |s| STEPS * s);
        errors[j].rms / (BEYOND * errors[j].noise).hypot(least)
    };
    let worst = (0..n).max_by(|a, b| beyond(*a).total_cmp(&beyond(*b)))?;
    if beyond(worst).is_nan() || beyond(worst) < 1.0 {
        return None;
    }
    let (unit, scale) = match actuators[worst].motion {
        Motion::Prismatic => ("mm", 1e3),
        Motion::Revolute => ("mrad", 1e3),
    };
    let e = &errors[worst];
    let late = match delay {
        Some(d) => format!(
            ", after a delay of the poses by {:.2} ms was taken out",
            1e3 * d
        ),
        None => String::new(),
    };
    warn(format!(
        "contradicts the geometry of the robot file: {} reads {:.3} {unit} (rms; mean {:+.3}) other than at the measured \
         poses, whose noise is {:.3} {unit}{late}. Calibrate the geometry (excite calibrate), or check the frames of the poses; forces \
         follow the geometry",
        actuators[worst].name,
        scale * e.rms,
        scale * e.mean,
        scale * e.noise,
    ))
}

/// What is left of the residuals after a common delay, and that delay where it takes away a part.
fn errors(
    residual: &[Vec<f64>],
    speed: &dyn Fn(usize, usize) -> f64,
) -> Option<(Vec<Error>, Option<f64>)> {
    let count = residual.first()?.len();
    if count < 30 {
        return None;
    }
    let middle = |r: &[f64]| r.iter().sum::<f64>() / count as f64;
    let means: Vec<f64> = residual.iter().map(|r| middle(r)).collect();
    let (mut product, mut power, mut before) = (0.0, 0.0, 0.0);
    for (j, r) in residual.iter().enumerate() {
        for (k, v) in r.iter().enumerate() {
            let (s, away) = (speed(j, k), v - means[j]);
            product += s * away;
            power += s * s;
            before += away * away;
        }
    }
    let delay = product / power.max(1e-300);
    // what chance would take is nothing
    let taken = (delay * product / before.max(1e-300) > 0.01).then_some(delay);
    let d = taken.unwrap_or(0.0);
    let of = |(j, r): (usize, &Vec<f64>)| {
        let left: Vec<f64> = (r.iter().enumerate())
            .map(|(k, v)| v - d * speed(j, k))
            .collect();
        let bends = left.chunks_exact(3).map(|g| g[0] - 2.0 * g[1] + g[2]);
        let noise = (bends.map(|b| b * b).sum::<f64>() / (2.0 * count as f64)).sqrt();
        let power = left.iter().map(|v| v * v).sum::<f64>() / count as f64;
        Error {
            rms: (power - noise * noise).max(0.0).sqrt(),
            mean: middle(&left),
            noise,
        }
    };
    Some((residual.iter().enumerate().map(of).collect(), taken))
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_delay_is_no_error_of_the_geometry() {
        let v = |k: usize| (0.1 * (k / 3) as f64).sin();
        let noise = |k: usize| 1e-5 * ((k * 7919 % 1000) as f64 / 500.0 - 1.0);
        let late: Vec<f64> = (0..900).map(|k| 2e-3 * v(k) + noise(k)).collect();
        let (errors, delay) = super::errors(std::slice::from_ref(&late), &|_, k| v(k)).unwrap();
        assert!((delay.unwrap() - 2e-3).abs() < 1e-4 && errors[0].rms < 1e-5);
        let off: Vec<f64> = late.iter().map(|r| r + 1e-3).collect();
        let (errors, _) = super::errors(&[off], &|_, k| v(k)).unwrap();
        assert!((errors[0].rms - 1e-3).abs() < 1e-4, "{}", errors[0].rms);
    }
}
