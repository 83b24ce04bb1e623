//! What is identified: deviations from what the robot file says, and what the set-up leaves open.

/// What an unknown belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// geometry of the robot, as its file states it
    Geometry,
    /// how joints give way under gravity
    Compliance,
    /// how links bend under gravity
    Bending,
    /// error of a joint that repeats with its turn
    Eccentricity,
    /// dead play that gravity closes to one side
    Backlash,
    /// zero of a joint, where it is looked at alone
    Offset,
    /// pose of the base in the camera's (or tracker's) frame
    Camera,
    /// pose of the target on the tool or platform
    Target,
    /// fixed point that a frame's origin sits in
    Socket,
    /// plane that a frame's origin touches
    Plane,
    /// how the second arm's frame sits in that of the first
    Grip,
}

/// One unknown. Its value is the deviation from the start; see [`Unknown::prior`].
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Unknown {
    /// `panda_joint2.x`, `camera.rz`
    pub name: String,
    /// `m`, `rad`, …
    pub unit: &'static str,
    /// what it belongs to
    pub part: Part,
    /// standard deviation before any measurement, in its unit; infinite where nothing is known
    pub prior: f64,
    /// size by which columns of the Jacobian are scaled, in its unit
    pub scale: f64,
    /// stated, not to be found
    pub held: bool,
}

impl Unknown {
    /// An unknown with a prior, which is its scale, too.
    pub fn new(name: impl Into<String>, unit: &'static str, part: Part, prior: f64) -> Self {
        Unknown {
            name: name.into(),
            unit,
            part,
            prior,
            scale: prior,
            held: false,
        }
    }

    /// Six numbers of a frame: `x, y, z` and the rotation vector.
    pub fn frame(name: &str, part: Part, [length, angle]: [f64; 2]) -> Vec<Self> {
        let names = ["x", "y", "z", "rx", "ry", "rz"];
        let each = names.iter().enumerate().map(|(k, n)| {
            let (unit, prior) = if k < 3 { ("m", length) } else { ("rad", angle) };
            Unknown::new(format!("{name}.{n}"), unit, part, prior)
        });
        each.collect()
    }

    /// Whether it is of the robot, not of the set-up.
    pub fn of_robot(&self) -> bool {
        matches!(
            self.part,
            Part::Geometry
                | Part::Compliance
                | Part::Bending
                | Part::Eccentricity
                | Part::Backlash
                | Part::Offset
        )
    }
}
