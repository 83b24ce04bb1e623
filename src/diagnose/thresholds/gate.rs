//! Conditions that are met gradually.

/// A condition that is met gradually: `1/(1 + exp(−(x − centre)/width))`.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Gate {
    /// value at which it is half met
    pub centre: f64,
    /// by how much more it is met to 73 %
    pub width: f64,
}

impl Gate {
    /// The same for values that are `factor` times as large.
    pub fn scaled(&self, factor: f64) -> Gate {
        gate(factor * self.centre, factor * self.width)
    }

    /// How far `x` lies above, 0 to 1.
    pub fn above(&self, x: f64) -> f64 {
        logistic((x - self.centre) / self.width)
    }

    /// How far `x` lies below, 0 to 1.
    pub fn below(&self, x: f64) -> f64 {
        logistic((self.centre - x) / self.width)
    }
}

fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

/// Half met at `centre`, to 73 % at `centre + width`.
pub(super) const fn gate(centre: f64, width: f64) -> Gate {
    Gate { centre, width }
}
