//! What kind of robot a plant is, for what only one kind has.

use super::Plant;
use crate::error::Result;
use crate::mechanism::Source;

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

    /// How many numbers of its geometry may deviate, as the file states them; 0 where they are not known one by one.
    pub(crate) fn deviations(&self) -> usize {
        self.mechanism().map_or(0, |m| m.deviations())
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
