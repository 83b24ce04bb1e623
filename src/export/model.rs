//! What an exporter is given.

use super::Remark;
use crate::plant::Plant;
use crate::robot::Robot;

/// A model to be written.
#[derive(Debug, Clone, Copy)]
pub struct Model<'a> {
    /// the robot that it is a model of: geometry, loops, the file it was read from
    pub plant: &'a Plant,
    /// its bodies and joints with the values to be written
    pub robot: &'a Robot,
    /// what the bodies and joints cannot hold
    pub remarks: &'a [Remark],
}
