//! What a user chooses: the method, the physical consistency, the strength of the prior.

use crate::signals;

/// How base parameters are estimated from the equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// ordinary least squares: all rows alike
    Ols,
    /// weighted by the full covariance of the residual between actuators, iterated
    #[default]
    Wls,
    /// the same with Huber's, then Tukey's weights against outliers
    Robust,
    /// maximum likelihood with the noise of torques and positions from the scatter of the periods
    /// (Swevers et al. 1997)
    Ml,
    /// instrumental variables: the regressor along the commanded motion as instruments (IDIM-IV,
    /// Janot, Vandanjon & Gautier 2014)
    Iv,
}

/// How the standard parameters are kept physical.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Consistency {
    /// entropic distance from the nominal bodies
    #[default]
    Entropic,
    /// linear matrix inequalities and a quadratic distance
    Lmi,
    /// not at all: unidentifiable directions stay nominal, bodies may be impossible
    Free,
}

/// Settings of [`identify`](super::identify()).
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct Settings {
    /// estimator of the base parameters
    pub method: Method,
    /// what standard parameters must be
    pub consistency: Consistency,
    /// strength `γ` of the prior; `None` for cross-validation
    pub prior_strength: Option<f64>,
    /// preparation of the signals
    pub signals: signals::Settings,
}

crate::settings::changeable!(Settings);
