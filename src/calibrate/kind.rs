//! What was measured, and what it is for.

use serde::Deserialize;

/// What was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// pose of a target in the frame of a camera
    Pose,
    /// position of a point in the frame of a tracker
    Position,
    /// the frame's origin sits in a fixed point that is not known
    Point,
    /// the frame's origin touches a fixed plane that is not known
    Plane,
    /// a dial gauge reads the distance of the frame's origin from a fixed plane
    Gauge,
    /// a second arm holds what the first one holds: its frame does not move in that of the first
    Loop,
    /// a ball joint between two arms: a point of one frame stays in a point of the other
    Ball,
}

impl Kind {
    /// As the file writes it.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Pose => "pose",
            Kind::Position => "position",
            Kind::Point => "point",
            Kind::Plane => "plane",
            Kind::Gauge => "gauge",
            Kind::Loop | Kind::Ball => "loop",
        }
    }

    /// Columns behind the joint readings.
    pub fn columns(self) -> &'static [&'static str] {
        match self {
            Kind::Pose => &["x", "y", "z", "qw", "qx", "qy", "qz"],
            Kind::Position => &["x", "y", "z"],
            Kind::Gauge => &["reading"],
            Kind::Point | Kind::Plane | Kind::Loop | Kind::Ball => &[],
        }
    }

    /// Noise where none is stated: m and rad.
    pub(super) fn noise(self) -> [f64; 2] {
        match self {
            Kind::Pose => [3e-4, 3.5e-4],
            Kind::Position => [5e-5, f64::NAN],
            Kind::Loop => [2e-4, 5e-4],
            Kind::Point | Kind::Ball => [2e-4, f64::NAN],
            Kind::Plane | Kind::Gauge => [5e-5, f64::NAN],
        }
    }

    /// Whether a row of it is one number, along a normal.
    pub(super) fn is_line(self) -> bool {
        matches!(self, Kind::Plane | Kind::Gauge)
    }

    /// Whether it is of two arms.
    pub fn is_loop(self) -> bool {
        matches!(self, Kind::Loop | Kind::Ball)
    }

    /// Whether poses of its instrument are unknown.
    pub fn has_instrument(self) -> bool {
        matches!(self, Kind::Pose | Kind::Position)
    }
}

/// What a file of readings holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Held {
    /// poses
    Pose,
    /// points of a target in pictures, from which poses are solved
    Pixels,
    /// positions
    Position,
    /// contacts with a point
    Point,
    /// contacts with a plane
    Plane,
    /// readings of a gauge
    Gauge,
    /// postures of two arms that hold the same thing
    Loop,
}

impl Held {
    /// What is measured by it.
    pub fn kind(self) -> Kind {
        match self {
            Held::Pose | Held::Pixels => Kind::Pose,
            Held::Position => Kind::Position,
            Held::Point => Kind::Point,
            Held::Plane => Kind::Plane,
            Held::Gauge => Kind::Gauge,
            Held::Loop => Kind::Loop,
        }
    }
}

/// What rows are for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Purpose {
    /// unknowns are identified with them
    Fit,
    /// the result is judged by them
    Holdout,
}
