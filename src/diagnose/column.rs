//! A column of a linear model on the rows of some actuators.

/// A column of a linear model: values on the rows of some actuators, all records one after another
/// (the fitted ones first).
#[derive(Debug, Clone, Default)]
pub struct Column {
    /// actuator and its values; actuators that are missing have zeros
    pub rows: Vec<(usize, Vec<f64>)>,
}

impl Column {
    /// A column on one actuator.
    pub fn on(joint: usize, values: Vec<f64>) -> Self {
        Column {
            rows: vec![(joint, values)],
        }
    }

    /// Values on an actuator.
    pub fn get(&self, joint: usize) -> Option<&[f64]> {
        self.rows
            .iter()
            .find(|(j, _)| *j == joint)
            .map(|(_, v)| v.as_slice())
    }
}
