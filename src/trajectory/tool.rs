//! Speed and acceleration of the tool point over all time.

use super::bounds::SampledBound;
use super::enclose::{Motion, enclose};
use super::fourier::{Fourier, check};
use super::jets::point_jet;
use crate::dynamics::point::{Point, PointMotion};
use crate::error::Result;
use crate::robot::Robot;

/// What may be missing between samples, as a fraction of the limit.
const TARGET: f64 = 0.002;

/// What is known of the tool point: the largest magnitudes of its velocity and acceleration.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct ToolCertificate {
    /// link that it sits on
    pub frame: String,
    /// m/s; `None` where it has no limit
    pub speed: Option<SampledBound>,
    /// m/s²; `None` where it has no limit
    pub acceleration: Option<SampledBound>,
}

impl ToolCertificate {
    /// Whether the bounds stay within the limits.
    pub fn satisfied(&self) -> bool {
        let both = [&self.speed, &self.acceleration];
        both.into_iter().flatten().all(SampledBound::satisfied)
    }
}

/// Bounds speed and acceleration of the tool point over all time; `None` where the robot states no limits. A
/// vector between two samples a time `h` apart is no longer than the longer of both, and `(h²/8)` times the
/// largest magnitude of its second derivative, which norm jets bound.
///
/// # Errors
/// A malformed trajectory, or one with another number of joints than the robot.
pub fn tool_certificate(
    robot: &Robot,
    trajectory: &Fourier,
    samples: usize,
) -> Result<Option<ToolCertificate>> {
    check(robot, trajectory)?;
    let Some(tool) = &robot.tool else {
        return Ok(None);
    };
    let (point, chain) = (Point::of(robot, tool), tool.chain(robot));
    let n = robot.dof();
    let mut state = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
    let mut at = PointMotion::default();
    let take = |t: f64, out: &mut [f64]| {
        let [q, qd, qdd] = &mut state;
        trajectory.evaluate(t, [q, qd, qdd]);
        point.at(q, qd, qdd, &mut at);
        out.copy_from_slice(&[at.velocity.norm(), at.acceleration.norm()]);
        Ok(())
    };
    let reach = tool.point.norm();
    let curvature = |motion: &Motion, start: f64, width: f64| {
        let jet = point_jet(robot, &chain, reach, &motion.on(start, width));
        vec![jet[3], jet[4]]
    };
    let limits = [tool.speed, tool.acceleration];
    let target = |best: &[f64]| {
        let each = limits.iter().zip(best);
        each.map(|(l, best)| TARGET * if l.is_finite() { *l } else { 1e3 * best + 1.0 })
            .collect()
    };
    let found = enclose(trajectory, samples, take, curvature, &target)?;
    let mut each = found.into_iter().zip(limits).map(|(found, limit)| {
        limit.is_finite().then(|| SampledBound {
            max_on_grid: found.highest,
            time: found.time,
            between_grid_bound: found.between,
            samples: found.samples,
            limit,
            used: found.highest / limit,
            margin: limit - found.highest,
        })
    });
    Ok(Some(ToolCertificate {
        frame: tool.frame.clone(),
        speed: each.next().flatten(),
        acceleration: each.next().flatten(),
    }))
}
