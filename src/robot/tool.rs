//! Limits of the tool point: how fast a point of a moving link may be.

use super::Robot;
use nalgebra::Vector3;

/// Limits of the speed and acceleration of one point.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Tool {
    /// link that its file names
    pub frame: String,
    /// body that carries it
    pub body: usize,
    /// in the frame of that body, m
    #[serde(serialize_with = "crate::output::vector")]
    pub point: Vector3<f64>,
    /// m/s; infinite where there is none
    pub speed: f64,
    /// m/s²; infinite where there is none
    pub acceleration: f64,
}

impl Tool {
    /// Limits times a factor.
    pub fn derated(&self, factor: f64) -> Self {
        Tool {
            speed: factor * self.speed,
            acceleration: factor * self.acceleration,
            ..self.clone()
        }
    }

    /// Bodies between the base and the point, the base's first.
    pub(crate) fn chain(&self, robot: &Robot) -> Vec<usize> {
        let mut chain = Vec::new();
        let mut at = Some(self.body);
        while let Some(b) = at {
            chain.push(b);
            at = robot.bodies[b].parent;
        }
        chain.reverse();
        chain
    }
}
