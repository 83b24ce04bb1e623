//! A coordinate: its kind, its limits, its terms.

use super::stribeck::Stribeck;
use super::velocity_by_position::VelocityByPosition;

/// How a body moves relative to its parent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Motion {
    /// Rotation about the axis, rad.
    Revolute,
    /// Translation along the axis, m.
    Prismatic,
}

/// Limits of one coordinate; infinite where there is none.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Limits {
    /// lower and upper position, rad or m
    pub position: [f64; 2],
    /// rad/s or m/s
    pub velocity: f64,
    /// rad/s² or m/s²
    pub acceleration: f64,
    /// rad/s³ or m/s³
    pub jerk: f64,
    /// torque or force, N m or N
    pub effort: f64,
    /// rate of the torque or force, N m/s or N/s
    pub effort_rate: f64,
    /// velocity that shrinks towards the ends of a range
    pub velocity_by_position: Option<VelocityByPosition>,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            position: [f64::NEG_INFINITY, f64::INFINITY],
            velocity: f64::INFINITY,
            acceleration: f64::INFINITY,
            jerk: f64::INFINITY,
            effort: f64::INFINITY,
            effort_rate: f64::INFINITY,
            velocity_by_position: None,
        }
    }
}

impl Limits {
    /// All limits times `factor`; positions keep the middle of their range, a velocity by position its ends.
    pub fn derated(&self, factor: f64) -> Self {
        let mut l = *self;
        let [low, high] = l.position;
        if low.is_finite() && high.is_finite() {
            let (middle, half) = (0.5 * (low + high), 0.5 * (high - low) * factor);
            l.position = [middle - half, middle + half];
        }
        l.velocity *= factor;
        l.acceleration *= factor;
        l.jerk *= factor;
        l.effort *= factor;
        l.effort_rate *= factor;
        l.velocity_by_position = l.velocity_by_position.map(|v| v.derated(factor));
        l
    }
}

/// Joint columns that may stand in the regressor beside the ten of each link.
///
/// The order of the variants is the order of the columns.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum JointTerm {
    /// rotor inertia reflected to the joint: `I_a q̈`
    Armature,
    /// viscous friction: `F_v q̇`
    Viscous,
    /// Coulomb friction: `F_c sign(q̇)`
    Coulomb,
    /// constant torque
    Offset,
}

impl JointTerm {
    /// All four, in the order of their columns.
    pub const ALL: [JointTerm; 4] = [
        JointTerm::Armature,
        JointTerm::Viscous,
        JointTerm::Coulomb,
        JointTerm::Offset,
    ];

    /// What a drive adds to the torque of the bodies: Coulomb and viscous friction, and a constant.
    pub const FRICTION: [JointTerm; 3] =
        [JointTerm::Coulomb, JointTerm::Viscous, JointTerm::Offset];

    /// Which of all four these are, in the order of [`JointTerm::ALL`].
    pub(crate) fn mask(terms: &[JointTerm]) -> [bool; 4] {
        JointTerm::ALL.map(|t| terms.contains(&t))
    }

    /// Name as in `robot.toml`.
    pub fn name(self) -> &'static str {
        match self {
            JointTerm::Armature => "armature",
            JointTerm::Viscous => "viscous",
            JointTerm::Coulomb => "coulomb",
            JointTerm::Offset => "offset",
        }
    }

    /// Unit of the parameter for a joint of this kind.
    pub fn unit(self, motion: Motion) -> &'static str {
        match (self, motion) {
            (JointTerm::Armature, Motion::Revolute) => "kg m^2",
            (JointTerm::Armature, Motion::Prismatic) => "kg",
            (JointTerm::Viscous, Motion::Revolute) => "N m s/rad",
            (JointTerm::Viscous, Motion::Prismatic) => "N s/m",
            (_, Motion::Revolute) => "N m",
            (_, Motion::Prismatic) => "N",
        }
    }
}

/// One coordinate: what is commanded and measured.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Joint {
    /// name of the URDF joint
    pub name: String,
    /// kind of motion (decides the units)
    pub motion: Motion,
    /// `continuous` in the URDF: no position limit by nature
    pub continuous: bool,
    /// limits
    pub limits: Limits,
    /// standard deviation of the measured torque, N m or N; `None` where not stated
    pub torque_noise: Option<f64>,
    /// encoder step, rad or m
    pub position_resolution: Option<f64>,
    /// motor turns per joint turn
    pub gear_ratio: Option<f64>,
    /// areas of a pneumatic or hydraulic piston, m²: of chamber a, which extends the joint, and of
    /// chamber b
    pub piston: Option<[f64; 2]>,
    /// root mean square torque that it bears for ever, N m or N
    pub continuous_torque: Option<f64>,
    /// mean mechanical power that it bears for ever, W
    pub continuous_power: Option<f64>,
    /// values of armature, viscous, Coulomb and offset in the nominal model, in
    /// [`JointTerm::ALL`] order; always part of the torque
    pub terms: [f64; 4],
    /// breakaway friction beside them, known
    pub stribeck: Stribeck,
    /// which of them are unknowns with a column of their own
    pub identify: [bool; 4],
}

impl Joint {
    /// The same joint with all limits times `factor`, see [`Limits::derated`].
    pub fn derated(&self, factor: f64) -> Self {
        Joint {
            limits: self.limits.derated(factor),
            ..self.clone()
        }
    }

    /// How far it is taken to move to either side where its file states no end: π rad or 0.5 m.
    pub(crate) fn free_reach(&self) -> f64 {
        match self.motion {
            Motion::Revolute => std::f64::consts::PI,
            Motion::Prismatic => 0.5,
        }
    }

    /// Its position limits, an end that is not stated taken from [`Joint::free_reach`], without what lies beyond
    /// the positions at which a velocity by position makes it turn.
    pub(crate) fn range(&self) -> [f64; 2] {
        let reach = self.free_reach();
        let [low, high] = match self.limits.velocity_by_position.map(|v| v.range()) {
            Some([a, b]) => [
                self.limits.position[0].max(a),
                self.limits.position[1].min(b),
            ],
            None => self.limits.position,
        };
        match (low.is_finite(), high.is_finite()) {
            (true, true) => [low, high],
            (true, false) => [low, low + 2.0 * reach],
            (false, true) => [high - 2.0 * reach, high],
            (false, false) => [-reach, reach],
        }
    }

    /// A joint without limits and without terms.
    pub fn new(name: &str, motion: Motion) -> Self {
        Joint {
            name: name.into(),
            motion,
            continuous: false,
            limits: Limits::default(),
            torque_noise: None,
            position_resolution: None,
            gear_ratio: None,
            piston: None,
            continuous_torque: None,
            continuous_power: None,
            terms: [0.0; 4],
            stribeck: Stribeck::default(),
            identify: [false; 4],
        }
    }

    /// The line of robot.toml that holds it, in the middle of its range.
    pub(crate) fn lock_line(&self) -> String {
        let [low, high] = self.limits.position;
        let middle = 0.5 * (low + high);
        let hold = if middle.is_finite() { middle } else { 0.0 };
        format!("lock = {{ {} = {} }}", toml_key(&self.name), plain(hold))
    }

    /// The most that dry friction takes, whatever the speed: Coulomb and breakaway, N m or N.
    pub fn dry(&self) -> f64 {
        self.terms[JointTerm::Coulomb as usize].abs() + self.stribeck.force.abs()
    }
}

/// How far the nominal values can be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Prior {
    /// rough
    #[default]
    Cad,
    /// from an earlier identification, close
    Identified,
}

/// A number that people read and TOML takes.
pub(crate) fn plain(x: f64) -> String {
    match x == 0.0 || (1e-3..1e6).contains(&x.abs()) {
        true => format!("{}", (1e4 * x).round() / 1e4),
        false => format!("{x:.2e}"),
    }
}

/// A name as a key of TOML: bare where it can be.
fn toml_key(name: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    match !name.is_empty() && name.chars().all(bare) {
        true => name.to_string(),
        false => format!("{name:?}"),
    }
}
