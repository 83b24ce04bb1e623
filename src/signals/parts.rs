//! What the types of the [module above](super) are made of, and what their settings choose from.

use super::Decimator;
use faer::Mat;

/// How positions are differentiated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Derivation {
    /// a low-pass whose cut-off is chosen from the data: whole harmonics of a motion that repeats, a
    /// Butterworth filter otherwise
    #[default]
    LowPass,
    /// as the diagnosis does it (`wiener`): every harmonic of a motion that repeats weighted by how far it
    /// stands out of the scatter between periods, a fixed low-pass otherwise
    Wiener,
}

/// What the periods of a repeated motion tell beside their mean.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Periods {
    /// number of whole periods
    pub count: usize,
    /// samples of one
    pub samples: usize,
    /// length, s
    pub period: f64,
    /// measured torques of each period, actuator-major (`a·samples + i`), unfiltered
    pub torque: Vec<Vec<f64>>,
    /// measured positions of the actuators of each period, likewise
    pub position: Vec<Vec<f64>>,
    /// covariance of the torque noise of one period between actuators, (N m)², unfiltered:
    /// the scatter about the mean, `1/((n_p−1)N) Σ_p Σ_i e_p(i) e_p(i)ᵀ`
    #[serde(serialize_with = "crate::output::rows")]
    pub torque_covariance: Mat<f64>,
    /// standard deviation of the position noise of one period of each actuator
    pub position_noise: Vec<f64>,
}

/// The filter over fewer samples of the motion.
///
/// Positions that were cut off at `f_p` have next to nothing beyond a few `f_p`, and the columns of the regressor that are
/// smooth functions of them neither. So one sample in `stride` holds what the filter passes of these columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Thin {
    /// every so many-th sample counts, from the first on
    pub stride: usize,
    /// the filter over those
    pub filter: Decimator,
}
