//! Parallel robots that come with the program.
//!
//! They serve to design and to try out; which figures are public and which are estimates is said at
//! the head of each file. To identify a particular machine, write its own.

use super::Mechanism;
use crate::error::Result;
use crate::robot::bundled::PARALLEL;

/// A parallel robot that comes with the program.
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
}

impl Bundled {
    /// The mechanism, as from a file.
    ///
    /// # Errors
    /// None for those of [`list`]; the type is that of every robot file.
    pub fn load(&self) -> Result<Mechanism> {
        Mechanism::from_toml_str(self.toml, self.name)
    }
}

static BUNDLED: [Bundled; 3] = [
    Bundled {
        name: PARALLEL[0],
        description: "pneumatic hexapod with a platform of 30 kg, 6 cylinders",
        source: "platform and load as in Schulte & Gerland (load identification of parallel \
                 robots); geometry, strokes, legs and friction estimated",
        toml: include_str!("bundled/hexapod.toml"),
    },
    Bundled {
        name: PARALLEL[1],
        description: "H4-like robot, 4 motors, x y z theta",
        source: "architecture of Pierrot & Company 1999 in the regular layout; dimensions and \
                 masses estimated, not those of the LIRMM robot",
        toml: include_str!("bundled/h4.toml"),
    },
    Bundled {
        name: PARALLEL[2],
        description: "Delta robot of pick-and-place size, 3 motors, x y z",
        source: "architecture of Clavel 1988; dimensions and masses estimated",
        toml: include_str!("bundled/delta.toml"),
    },
];

/// The parallel robots that come with the program.
pub fn list() -> &'static [Bundled] {
    &BUNDLED
}

/// The bundled parallel robot of this name.
pub fn find(name: &str) -> Option<&'static Bundled> {
    list().iter().find(|b| b.name == name)
}
