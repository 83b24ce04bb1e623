//! Magnitudes that are sampled, with a bound of what happens between the samples.

/// A limit counts as kept when it is exceeded by no more than this part of its range.
pub const TOLERANCE: f64 = 1e-9;

/// The largest torque of one joint over all time, against its limit.
///
/// At no time is the magnitude of the torque larger than [`TorqueBound::bound`]
/// `= max_on_grid + between_grid_bound + coulomb`.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct TorqueBound {
    /// name of the joint
    pub joint: String,
    /// largest magnitude of the smooth torque at a sample, N m or N
    pub max_on_grid: f64,
    /// when, s into the period
    pub time: f64,
    /// the smooth torque exceeds `max_on_grid` by no more than this between samples (rigorous)
    pub between_grid_bound: f64,
    /// Coulomb friction, counted as `±F_c` at all times
    pub coulomb: f64,
    /// samples taken
    pub samples: usize,
    /// effort limit; `None` where there is none
    pub limit: Option<f64>,
    /// `(max_on_grid + coulomb) / limit`
    pub used: Option<f64>,
    /// `limit − max_on_grid − coulomb`
    pub margin: Option<f64>,
}

impl TorqueBound {
    /// The magnitude of the torque is larger than this at no time.
    pub fn bound(&self) -> f64 {
        self.max_on_grid + self.between_grid_bound + self.coulomb
    }

    /// Whether the bound stays within the limit.
    pub fn satisfied(&self) -> bool {
        match self.limit {
            Some(limit) => self.bound() <= limit * (1.0 + TOLERANCE),
            None => self.bound().is_finite(),
        }
    }
}

/// The largest magnitude of a quantity that is sampled, over all time, against its limit.
///
/// At no time is the magnitude larger than [`SampledBound::bound`]
/// `= max_on_grid + between_grid_bound`.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct SampledBound {
    /// largest magnitude at a sample
    pub max_on_grid: f64,
    /// when, s into the period
    pub time: f64,
    /// it exceeds `max_on_grid` by no more than this between samples (rigorous)
    pub between_grid_bound: f64,
    /// samples taken
    pub samples: usize,
    /// limit
    pub limit: f64,
    /// `max_on_grid / limit`
    pub used: f64,
    /// `limit − max_on_grid`
    pub margin: f64,
}

impl SampledBound {
    /// The magnitude is larger than this at no time.
    pub fn bound(&self) -> f64 {
        self.max_on_grid + self.between_grid_bound
    }

    /// Whether the bound stays within the limit.
    pub fn satisfied(&self) -> bool {
        self.bound() <= self.limit * (1.0 + TOLERANCE)
    }
}
