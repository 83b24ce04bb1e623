//! How well one trajectory determines the parameters, in numbers.

/// The four condition numbers of one trajectory.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct ConditionNumbers {
    /// largest over smallest non-zero singular value of the regressor of all standard parameters
    pub invariant: f64,
    /// condition number of the columns kept as base parameters
    pub raw: f64,
    /// the same with unit columns
    pub normalised: f64,
    /// the same with the rows of each joint divided by its torque noise
    pub weighted: f64,
}

/// Predicted uncertainty of one base parameter.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Prediction {
    /// name of its kept column
    pub parameter: String,
    /// the combination in words
    pub combination: String,
    /// unit
    pub unit: String,
    /// value in the nominal model
    pub nominal: f64,
    /// predicted standard deviation, in that unit
    pub std: f64,
    /// predicted relative standard deviation, percent of the nominal value; `None` where that is 0
    pub percent: Option<f64>,
}
