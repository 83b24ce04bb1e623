//! What the types of the [module above](super) are made of, and what their settings choose from.

/// What can be said about one standard parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Identifiability {
    /// it has a value of its own in the torques
    Alone,
    /// only a combination with others has
    Combination,
    /// it never acts on any joint
    None,
}

/// One standard parameter, classed.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct StandardParameter {
    /// name, `link3.mx`
    pub name: String,
    /// class
    pub identifiability: Identifiability,
    /// why, in words, where a simple reason exists; empty otherwise
    pub reason: String,
}
