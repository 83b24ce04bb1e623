//! What kind of robot a plant is, for what only one kind has.

use super::Plant;
use crate::dynamics::Samples;
use crate::error::Result;
use crate::mechanism::{MechanismMotion, Segment, Source};

impl Plant {
    /// Whether something closes the tree to a chain: a parallel robot.
    ///
    /// ```
    /// use excite::Plant;
    ///
    /// assert!(!Plant::load("ur5e")?.closed());
    /// assert!(Plant::load("delta")?.closed());
    /// # Ok::<(), excite::Error>(())
    /// ```
    pub fn closed(&self) -> bool {
        self.mechanism().is_some()
    }

    /// Whether the chain is closed by loops of general shape, which are followed step by step and
    /// have no legs.
    pub fn looped(&self) -> bool {
        self.mechanism()
            .is_some_and(|m| matches!(m.source, Source::Loops(_)))
    }

    /// The actuator that moves a body by itself; none where all of them move it together.
    pub fn driver(&self, body: usize) -> Option<usize> {
        let alone = !self.closed();
        alone.then(|| self.robot.bodies[body].coordinate)
    }

    /// Whether all actuators together hold the body that carries a load: a platform.
    pub(crate) fn held_together(&self) -> bool {
        self.tool().is_some_and(|body| self.driver(body).is_none())
    }

    /// How many numbers of its geometry may deviate, as the file states them; 0 where they are not known one by one.
    pub(crate) fn deviations(&self) -> usize {
        self.mechanism().map_or(0, |m| m.deviations())
    }

    /// Change of the actuator forces per unit of each of [`Plant::deviations`], with these values of the unknowns and this
    /// load in the body that carries one; empty where there are none. `dt` is the time from sample to sample, s.
    ///
    /// # Errors
    /// Poses that cannot be reached.
    pub(crate) fn deformations(
        &self,
        x: &Samples,
        dt: f64,
        phi: &[f64],
        load: Option<&[f64; 10]>,
    ) -> Result<Vec<Vec<f64>>> {
        let Some(mechanism) = self.mechanism() else {
            return Ok(Vec::new());
        };
        let mut bodies = mechanism.bodies_with(phi);
        if let (Some(load), Some(tool)) = (load, self.tool()) {
            let body = bodies[10 * tool..].iter_mut();
            body.zip(load).for_each(|(b, l)| *b += l);
        }
        mechanism.deformations(x, dt, &bodies)
    }

    /// Actuator forces that stand for generalised forces of the joints of the tree, `Gᵀ Γ`, actuator-major; `None` of a
    /// tree, where they are the same.
    pub(crate) fn projected(
        &self,
        x: &Samples,
        gamma: impl FnOnce(&MechanismMotion) -> Vec<f64>,
    ) -> Option<Result<Vec<f64>>> {
        let mechanism = self.mechanism()?;
        let forces = |motion| mechanism.project(&motion, &gamma(&motion));
        Some(mechanism.motion(x).map(forces))
    }

    /// Axes of legs, arms, rods and platform at coordinates `x`, for pictures; a tree has none.
    pub(crate) fn segments(&self, x: &[f64]) -> Vec<Segment> {
        self.mechanism()
            .map_or_else(Vec::new, |m| m.geometry().segments(x))
    }

    /// Coordinates from positions of the actuators, coordinate-major, `count` samples each: as
    /// [`Plant::coordinates_of`], with forward kinematics from the pose `start` on.
    ///
    /// # Errors
    /// Positions that no pose of the assembly mode gives.
    pub(crate) fn coordinates_from(
        &self,
        start: &[f64],
        q: &[f64],
        count: usize,
    ) -> Result<Vec<f64>> {
        let Some(mechanism) = self.mechanism() else {
            return Ok(q.to_vec());
        };
        let (actuators, freedoms) = (mechanism.actuators(), mechanism.freedoms());
        let mut x = vec![0.0; freedoms * count];
        let mut pose = start.to_vec();
        for i in 0..count {
            let at: Vec<f64> = (0..actuators).map(|a| q[a * count + i]).collect();
            pose = mechanism.forward(&at, &pose)?.x;
            for (c, v) in pose.iter().enumerate() {
                x[c * count + i] = *v;
            }
        }
        Ok(x)
    }
}
