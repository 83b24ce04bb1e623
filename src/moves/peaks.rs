//! The largest that a coordinate does during a move.

/// Largest magnitudes over all time.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct Peaks {
    /// least and largest position
    pub position: [f64; 2],
    /// largest speed
    pub velocity: f64,
    /// largest acceleration
    pub acceleration: f64,
    /// largest jerk
    pub jerk: f64,
}

/// What one coordinate does during a move.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct JointPeaks {
    /// its name
    pub joint: String,
    /// exact extrema over all time
    #[serde(flatten)]
    pub peaks: Peaks,
    /// share of the full limit of velocity, acceleration and jerk that is used, assumed limits included
    pub used: [f64; 3],
    /// share that it exceeds at no time of the velocity that its position leaves; `None` without such a limit
    pub velocity_by_position: Option<f64>,
}
