//! `trajectory.json`: a designed trajectory with all that is needed to run and to understand it.
//!
//! ```json
//! { "format": "excite-trajectory", "version": 1, "excite_version": "0.1.0",
//!   "robot": "panda", "robot_hash": "…", "joints": ["panda_joint1"],
//!   "kind": "fourier", "period": 5.0, "periods": 3, "harmonics": [1, 2],
//!   "coefficients": [ { "joint": "panda_joint1", "constant": 0.1, "sin": [0.2, -0.1], "cos": [0.4, -0.1] } ],
//!   "ends": "rest", "grid": "full", "settings": {} }
//! ```
//!
//! Numbers are written with the fewest digits that read back as the same number, so a round trip
//! is exact. `coordinates` says what the series of a parallel robot move, its `"platform"` or its
//! `"actuators"`; without it they move the robot's own coordinates. Unknown keys are ignored.

use super::basis::Ends;
use super::fourier::{Fourier, Series};
use super::grid::Grid;
use crate::error::{Error, Result, Warning, WarningKind};
use crate::output::write_atomic;
use crate::robot::Robot;
use std::path::Path;

/// Value of `format`.
pub const FORMAT: &str = "excite-trajectory";
/// Newest `version` known.
pub const VERSION: u32 = 1;

/// What describes the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Kind {
    /// a Fourier series for each coordinate
    #[default]
    Fourier,
}

/// Coordinates in which a parallel robot moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Space {
    /// pose of the platform
    Platform,
    /// positions of the actuators
    Actuators,
}

/// A designed trajectory, as stored in `trajectory.json`.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// name of the robot it was designed for
    pub robot: String,
    /// [`Robot::hash`] of that robot
    pub robot_hash: String,
    /// names of the joints, in order
    pub joints: Vec<String>,
    /// what describes the motion
    pub kind: Kind,
    /// what the series move; `None`: the robot's own coordinates
    pub space: Option<Space>,
    /// the motion
    pub fourier: Fourier,
    /// how many periods to run
    pub periods: u32,
    /// what holds at the ends of a period
    pub ends: Ends,
    /// how the harmonics were chosen
    pub grid: Grid,
    /// settings of the design, as they were
    pub settings: serde_json::Value,
    /// version of the program that wrote it
    pub excite_version: String,
}

#[derive(serde::Serialize, serde::Deserialize)]
struct Document {
    format: String,
    version: u32,
    #[serde(default)]
    excite_version: String,
    robot: String,
    #[serde(default)]
    robot_hash: String,
    joints: Vec<String>,
    kind: Kind,
    #[serde(
        default,
        rename = "coordinates",
        skip_serializing_if = "Option::is_none"
    )]
    space: Option<Space>,
    period: f64,
    periods: u32,
    harmonics: Vec<u32>,
    coefficients: Vec<Entry>,
    ends: Ends,
    grid: Grid,
    #[serde(default)]
    settings: serde_json::Value,
}

#[derive(serde::Serialize, serde::Deserialize)]
struct Entry {
    joint: String,
    constant: f64,
    sin: Vec<f64>,
    cos: Vec<f64>,
}

impl Trajectory {
    /// One period of a motion of this robot; the other fields can be set afterwards.
    pub fn new(robot: &Robot, fourier: Fourier) -> Self {
        Trajectory {
            robot: robot.name.clone(),
            robot_hash: robot.hash.clone(),
            joints: robot.joint_names(),
            kind: Kind::Fourier,
            space: None,
            fourier,
            periods: 1,
            ends: Ends::Free,
            grid: Grid::Full,
            settings: serde_json::Value::Null,
            excite_version: env!("CARGO_PKG_VERSION").into(),
        }
    }

    /// Duration of all periods, s.
    pub fn duration(&self) -> f64 {
        self.fourier.period * f64::from(self.periods)
    }

    /// Reads and checks `trajectory.json`.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be read; [`Error::File`] with file and place (line and column, or
    /// key such as `coefficients[2].sin[4]`) if it is not a trajectory of a known version, or
    /// contradicts itself.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
        Self::parse(&text, path)
    }

    /// The trajectory in a JSON text; `path` is for messages only.
    ///
    /// # Errors
    /// As [`Trajectory::read`].
    pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<Self> {
        #[derive(serde::Deserialize)]
        struct Header {
            format: Option<String>,
            version: Option<u32>,
        }
        let path = path.as_ref();
        let malformed = |e: serde_json::Error| {
            let message = e.to_string();
            let place = format!(" at line {} column {}", e.line(), e.column());
            let message = message.strip_suffix(place.as_str()).unwrap_or(&message);
            Error::file(
                path,
                format!("line {}, column {}", e.line(), e.column()),
                message,
            )
        };
        if !text.trim_start().starts_with('{') {
            let message = "it is no trajectory.json (`excite design` writes one)";
            return Err(Error::file(path, "", message));
        }
        let header: Header = serde_json::from_str(text).map_err(malformed)?;
        if header.format.as_deref() != Some(FORMAT) {
            let message = format!("is not a trajectory; {FORMAT:?} expected");
            return Err(Error::file(path, "format", message));
        }
        if header.version != Some(VERSION) {
            let message = match header.version {
                Some(v) => format!("version {v} is not known; this program reads {VERSION}"),
                None => format!("is missing; this program reads {VERSION}"),
            };
            return Err(Error::file(path, "version", message));
        }
        let document: Document = serde_json::from_str(text).map_err(malformed)?;
        document
            .check()
            .map_err(|(place, message)| Error::file(path, place, message))
    }

    /// Writes `trajectory.json`, whole or not at all.
    ///
    /// # Errors
    /// [`Error::Argument`] if the trajectory contradicts itself or holds a number that is not
    /// finite; otherwise as [`write_atomic`].
    pub fn write(&self, path: impl AsRef<Path>, force: bool) -> Result<()> {
        let text = self.to_json()?;
        write_atomic(path, force, |w| w.write_all(text.as_bytes()))
    }

    /// The text of `trajectory.json`, indented, with a newline at the end.
    ///
    /// # Errors
    /// [`Error::Argument`] as for [`Trajectory::write`].
    pub fn to_json(&self) -> Result<String> {
        let unusable = |place: String, message: String| {
            Error::Argument(format!("trajectory, {place}: {message}"))
        };
        let document = self.document().map_err(|(p, m)| unusable(p, m))?;
        let text = serde_json::to_string_pretty(&document)
            .map_err(|e| unusable("settings".into(), e.to_string()))?;
        document
            .check()
            .map_err(|(place, message)| unusable(place, message))?;
        Ok(text + "\n")
    }

    /// What the file holds.
    fn document(&self) -> Result<Document, (String, String)> {
        if self.joints.len() != self.fourier.dof() {
            return Err(("joints".into(), "one name per series is needed".into()));
        }
        let coefficients = self
            .joints
            .iter()
            .zip(&self.fourier.joints)
            .map(|(joint, s)| Entry {
                joint: joint.clone(),
                constant: s.constant,
                sin: s.sin.clone(),
                cos: s.cos.clone(),
            })
            .collect();
        Ok(Document {
            format: FORMAT.into(),
            version: VERSION,
            excite_version: self.excite_version.clone(),
            robot: self.robot.clone(),
            robot_hash: self.robot_hash.clone(),
            joints: self.joints.clone(),
            kind: self.kind,
            space: self.space,
            period: self.fourier.period,
            periods: self.periods,
            harmonics: self.fourier.harmonics.clone(),
            coefficients,
            ends: self.ends,
            grid: self.grid,
            settings: self.settings.clone(),
        })
    }

    /// Whether the trajectory can be run on a robot: the same joints in the same order. A robot
    /// file that has changed since gives a warning.
    ///
    /// # Errors
    /// [`Error::Argument`] with the first joint that differs.
    pub fn matches(&self, robot: &Robot) -> Result<Option<Warning>> {
        let names = robot.joint_names();
        if let Some(k) =
            (0..names.len().max(self.joints.len())).find(|&k| names.get(k) != self.joints.get(k))
        {
            let name = |list: &[String]| list.get(k).map_or("none".into(), |n| format!("{n:?}"));
            return Err(Error::Argument(format!(
                "joint {} of the trajectory is {}, of robot {:?} {}; use the robot it was \
                 designed for ({:?})",
                k + 1,
                name(&self.joints),
                robot.name,
                name(&names),
                self.robot
            )));
        }
        let changed = !self.robot_hash.is_empty() && self.robot_hash != robot.hash;
        Ok(changed.then(|| {
            Warning::new(
                WarningKind::RobotChanged,
                &robot.name,
                "the robot's files are not those the trajectory was designed with; limits are \
                 judged by the present ones",
            )
        }))
    }
}

/// As in `trajectory.json`.
impl serde::Serialize for Trajectory {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let document = self.document();
        document
            .map_err(|(place, message)| serde::ser::Error::custom(format!("{place}: {message}")))?
            .serialize(serializer)
    }
}

impl Document {
    /// The trajectory, or place and message of the first contradiction.
    fn check(self) -> Result<Trajectory, (String, String)> {
        if self.periods == 0 {
            return Err(("periods".into(), "must be at least 1".into()));
        }
        for (k, name) in self.joints.iter().enumerate() {
            if self.joints[..k].contains(name) {
                return Err((format!("joints[{k}]"), format!("{name:?} is there twice")));
            }
        }
        if self.coefficients.len() != self.joints.len() {
            let (found, wanted) = (self.coefficients.len(), self.joints.len());
            let message = format!("{found} entries, but there are {wanted} joints");
            return Err(("coefficients".into(), message));
        }
        let mut joints = Vec::with_capacity(self.joints.len());
        for (k, (entry, name)) in self.coefficients.into_iter().zip(&self.joints).enumerate() {
            if entry.joint != *name {
                let message = format!(
                    "{:?} found where {name:?} is expected, as in joints",
                    entry.joint
                );
                return Err((format!("coefficients[{k}].joint"), message));
            }
            joints.push(Series {
                constant: entry.constant,
                sin: entry.sin,
                cos: entry.cos,
            });
        }
        let fourier = Fourier {
            period: self.period,
            harmonics: self.harmonics,
            joints,
        };
        fourier.check()?;
        Ok(Trajectory {
            robot: self.robot,
            robot_hash: self.robot_hash,
            joints: self.joints,
            kind: self.kind,
            space: self.space,
            fourier,
            periods: self.periods,
            ends: self.ends,
            grid: self.grid,
            settings: self.settings,
            excite_version: self.excite_version,
        })
    }
}

#[cfg(test)]
mod tests;
