//! The inner product of two lists.

/// `Σ aᵢ bᵢ`, from the first on, so that the last digit is the same on every machine.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}
