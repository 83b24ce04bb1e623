//! Robots that come with the program, from published figures.
//!
//! Kinematics follow the manufacturers' tables; masses and inertia are published figures where
//! there are any and estimates otherwise, as the head of each file says. They serve to design and
//! to try out; to identify a particular machine, start from its own URDF.

use super::Robot;
use crate::error::Result;

/// A robot that comes with the program.
#[derive(Debug, Clone, Copy)]
pub struct Bundled {
    /// name by which it is loaded
    pub name: &'static str,
    /// one line on what it is
    pub description: &'static str,
    /// where its figures come from
    pub source: &'static str,
    /// its `robot.toml`
    pub toml: &'static str,
    /// its URDF
    pub urdf: &'static str,
}

impl Bundled {
    /// The robot, as from a file.
    ///
    /// # Errors
    /// None for the robots of [`list`]; the type is that of every robot file.
    pub fn load(&self) -> Result<Robot> {
        Robot::from_toml_str(self.toml, self.urdf, self.name)
    }
}

/// Texts of `bundled/<name>.toml` and `bundled/<name>.urdf`.
macro_rules! bundled {
    ($name:literal, $description:literal, $source:literal) => {
        Bundled {
            name: $name,
            description: $description,
            source: $source,
            toml: include_str!(concat!("bundled/", $name, ".toml")),
            urdf: include_str!(concat!("bundled/", $name, ".urdf")),
        }
    };
}

/// Names of the parallel robots that come with the program; [`mechanism`](crate::mechanism) reads
/// them.
pub const PARALLEL: [&str; 3] = ["hexapod", "h4", "delta"];

static BUNDLED: [Bundled; 9] = [
    bundled!(
        "panda",
        "Franka Emika Panda, 7 axes, joint torque sensors",
        "kinematics and limits: Franka control interface documentation; \
         inertia: Gaz et al., IEEE RA-L 4(4), 2019"
    ),
    bundled!(
        "fr3",
        "Franka Research 3, 7 axes, joint torque sensors",
        "kinematics and limits: Franka control interface documentation; \
         inertia: Franka Robotics, franka_description"
    ),
    bundled!(
        "ur10",
        "Universal Robots UR10 (CB3), 6 axes, payload 10 kg",
        "Universal Robots, DH parameters for calculations of kinematics and dynamics; \
         inertia tensors estimated"
    ),
    bundled!(
        "ur10e",
        "Universal Robots UR10e, 6 axes, payload 12.5 kg",
        "Universal Robots, DH parameters for calculations of kinematics and dynamics"
    ),
    bundled!(
        "ur5e",
        "Universal Robots UR5e, 6 axes, payload 5 kg",
        "Universal Robots, DH parameters for calculations of kinematics and dynamics; \
         inertia tensors estimated"
    ),
    bundled!(
        "iiwa14",
        "KUKA LBR iiwa 14 R820, 7 axes, joint torque sensors",
        "KUKA LBR iiwa brochure; inertia tensors estimated"
    ),
    bundled!(
        "puma560",
        "Unimation PUMA 560, 6 axes, the classic of dynamic identification",
        "Armstrong, Khatib & Burdick, IEEE ICRA 1986"
    ),
    bundled!(
        "scara",
        "generic SCARA with 600 mm reach, 4 axes, one of them prismatic",
        "ranges and speeds of the Adept Cobra s600 data sheet; inertia estimated"
    ),
    bundled!(
        "planar2",
        "two-link arm in a vertical plane, for teaching and tests",
        "uniform rods; all figures in the file"
    ),
];

/// The robots that come with the program.
pub fn list() -> &'static [Bundled] {
    &BUNDLED
}

/// The bundled robot of this name.
pub fn find(name: &str) -> Option<&'static Bundled> {
    list().iter().find(|b| b.name == name)
}

/// Names of the bundled robots.
pub(super) fn names() -> [&'static str; BUNDLED.len()] {
    BUNDLED.each_ref().map(|b| b.name)
}
