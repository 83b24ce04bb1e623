//! What the types of the [module above](super) are made of, and what their settings choose from.

/// What a record is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Purpose {
    /// parameters are estimated from it
    Fit,
    /// the model is tested on it, and it is used for nothing else
    Holdout,
}

/// What the robot carried.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Payload {
    /// nothing, or nothing was said
    #[default]
    None,
    /// something that is to be identified
    Unknown,
    /// a body that is known
    Known {
        /// kg
        mass: f64,
        /// centre of mass in the frame of the last link (platform), m; `None`: a weight of which only the mass is known
        com: Option<[f64; 3]>,
        /// tensor about the centre of mass, xx, xy, xz, yy, yz, zz, kg m²
        inertia: Option<[f64; 6]>,
    },
}
