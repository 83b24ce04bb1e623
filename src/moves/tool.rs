//! How fast the tool point is along samples.

use crate::dynamics::Samples;
use crate::dynamics::point::{Point, PointMotion};
use crate::plant::Plant;

/// Largest speed and acceleration of the tool point, sampled.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct ToolPeak {
    /// link that it sits on
    pub frame: String,
    /// largest speed at a sample, m/s
    pub speed: f64,
    /// share of its limit; `None` where none is stated
    pub speed_used: Option<f64>,
    /// largest acceleration at a sample, m/s²
    pub acceleration: f64,
    /// share of its limit; `None` where none is stated
    pub acceleration_used: Option<f64>,
    /// the speed exceeds this at no time; `None` where it is only sampled
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed_bound: Option<f64>,
    /// the acceleration exceeds this at no time; `None` where it is only sampled
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acceleration_bound: Option<f64>,
}

impl ToolPeak {
    /// Along samples of a tree; `None` where it states no limits of its tool point.
    pub(super) fn of(plant: &Plant, x: &Samples) -> Option<Self> {
        let robot = plant.robot();
        let tool = robot.tool.as_ref()?;
        let (point, mut at) = (Point::of(robot, tool), PointMotion::default());
        let mut most = [0.0_f64; 2];
        for s in 0..x.count {
            let of = |k: usize| -> Vec<f64> { (0..x.dof).map(|j| x.at(j, s)[k]).collect() };
            point.at(&of(0), &of(1), &of(2), &mut at);
            for (most, now) in most
                .iter_mut()
                .zip([at.velocity.norm(), at.acceleration.norm()])
            {
                // what is not a number is beyond every limit
                *most = if now > *most || now.is_nan() {
                    now
                } else {
                    *most
                };
            }
        }
        let share = |x: f64, limit: f64| limit.is_finite().then_some(x / limit);
        Some(ToolPeak {
            frame: tool.frame.clone(),
            speed: most[0],
            speed_used: share(most[0], tool.speed),
            acceleration: most[1],
            acceleration_used: share(most[1], tool.acceleration),
            speed_bound: None,
            acceleration_bound: None,
        })
    }

    /// Names of the limits and their shares.
    pub(super) fn shares(&self) -> impl Iterator<Item = (&'static str, f64)> {
        let both = [
            ("speed of the tool point", self.speed_used),
            ("acceleration of the tool point", self.acceleration_used),
        ];
        both.into_iter()
            .filter_map(|(what, used)| Some((what, used?)))
    }

    /// The larger of both, quantity by quantity.
    pub(super) fn or(self, other: &ToolPeak) -> Self {
        let most = |a: Option<f64>, b: Option<f64>| a.zip(b).map(|(a, b)| a.max(b));
        ToolPeak {
            speed: self.speed.max(other.speed),
            speed_used: most(self.speed_used, other.speed_used),
            acceleration: self.acceleration.max(other.acceleration),
            acceleration_used: most(self.acceleration_used, other.acceleration_used),
            ..self
        }
    }
}
