//! What a user chooses: the unknowns, the method, the weights, physical consistency.

use crate::signals;

/// Which parameters of the load are unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Parameters {
    /// all ten
    #[default]
    Full,
    /// mass and centre of mass; the load counts as a point mass
    MassCom,
}

/// Which estimate goes into `load.json`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// all parameters at once
    #[default]
    OneStep,
    /// `1/m` and centre of mass, then the tensor (platforms only)
    TwoStep,
}

/// How the load is estimated.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Settings {
    /// unknowns
    pub parameters: Parameters,
    /// estimate that counts
    pub method: Method,
    /// whether rows near standstill lose weight
    pub weighted: bool,
    /// whether the result must be a body that can exist
    pub consistent: bool,
    /// mean speed of the actuators below which the two-step estimator gives no weight, rad/s or
    /// m/s; `None`: a fifth of its root mean square
    pub standstill: Option<f64>,
    /// whether a log that fits the robot only if it is read otherwise than stated is refused
    pub checked: bool,
    /// pressure outside of the cylinders, Pa; 0 where the logged pressures are relative to it
    pub atmosphere: f64,
    /// where the flange is in the frame of the body that carries the load: x y z, m, roll pitch yaw, rad
    pub flange: [f64; 6],
    /// preparation of the signals
    pub signals: signals::Settings,
}

crate::settings::changeable!(Settings);

impl Default for Settings {
    fn default() -> Self {
        Settings {
            parameters: Parameters::Full,
            method: Method::OneStep,
            weighted: true,
            consistent: true,
            standstill: None,
            checked: true,
            atmosphere: crate::log::pressure::ATMOSPHERE,
            flange: [0.0; 6],
            signals: signals::Settings::default(),
        }
    }
}
