//! How far two vectors are apart.

/// The greatest absolute value, zero of nothing.
pub fn largest<'a>(x: impl IntoIterator<Item = &'a f64>) -> f64 {
    x.into_iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// The greatest absolute difference of two vectors of one length.
pub fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).fold(0.0, |m, (x, y)| m.max((x - y).abs()))
}

/// The greatest difference from `b`, as a part of the greatest value of `b` or of one where that is less.
pub fn relative(a: &[f64], b: &[f64]) -> f64 {
    difference(a, b) / largest(b).max(1.0)
}
