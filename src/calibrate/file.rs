//! `calibration.toml`.

use super::entry::{Entry, KnownPlace};
use super::frame::Frame;
use super::kind::Kind;
use super::row::{Row, Source};
use super::rows;
use crate::error::{Error, Result, Warning, line_of};
use crate::robot::holds_robot;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// One file of readings.
#[derive(Debug, Clone)]
pub struct Measurement {
    /// what was measured
    pub kind: Kind,
    /// the file, as it is named
    pub file: String,
    /// rows of one placement of the set-up
    pub group: String,
    /// standard deviations: m, rad
    pub std: [f64; 2],
    /// camera or tracker, by name; measurements of one name share it and its target
    pub instrument: String,
    /// the second arm's frame in that of the first where it is known, and its standard deviations (m, rad); of a loop
    pub grip: Option<(Frame, [f64; 2])>,
    /// where the base is known to stand before the instrument
    pub base_at: Option<KnownPlace>,
    /// where the target is known to sit on the frame
    pub target_at: Option<KnownPlace>,
}

/// A known distance between the points of two files.
#[derive(Debug, Clone)]
pub struct Distance {
    /// indices of the measurements
    pub between: [usize; 2],
    /// m
    pub value: f64,
    /// m
    pub std: f64,
}

/// Standard deviations of what is not known beforehand.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Tolerances {
    /// lengths of the robot, m
    pub length: f64,
    /// angles of the robot, rad
    pub angle: f64,
    /// position of camera, tracker and target about their start, m
    pub pose_length: f64,
    /// their orientation, rad
    pub pose_angle: f64,
}

impl Default for Tolerances {
    fn default() -> Self {
        Tolerances {
            length: 0.002,
            angle: 0.005,
            pose_length: 0.1,
            pose_angle: 0.1,
        }
    }
}

/// A calibration: what was measured on which robot.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// the `calibration.toml`
    pub path: PathBuf,
    /// path of the robot, or bundled name
    pub robot: String,
    /// the frame that the measurement sees
    pub frame: Option<String>,
    /// the second arm's frame; of a loop
    pub other: Option<String>,
    /// robot whose inertia tells the torques of gravity
    pub gravity: Option<String>,
    /// effects of the joints that are to be identified; `None`: those that the data bear out
    pub effects: Option<Vec<String>>,
    /// files of readings
    pub measurements: Vec<Measurement>,
    /// known distances
    pub distances: Vec<Distance>,
    /// all rows, in the order of the files
    pub rows: Vec<Row>,
    /// priors
    pub prior: Tolerances,
    /// whether noise was stated by the file
    pub noise_stated: bool,
    /// what was imperfect
    pub warnings: Vec<Warning>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    robot: String,
    frame: Option<String>,
    other: Option<Spanned<String>>,
    gravity: Option<String>,
    effects: Option<Spanned<Vec<String>>>,
    poses: Option<String>,
    std: Option<Spanned<f64>>,
    angle_std: Option<Spanned<f64>>,
    #[serde(default)]
    measurement: Vec<Spanned<Entry>>,
    #[serde(default)]
    distance: Vec<Spanned<DistanceEntry>>,
    prior: Option<Spanned<Tolerances>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DistanceEntry {
    between: [String; 2],
    value: f64,
    std: Option<f64>,
}

/// Noise of a distance where none is stated, m.
const DISTANCE_STD: f64 = 1e-4;

/// The effects that can be asked for, by their names.
pub const EFFECTS: [&str; 4] = [
    "joint_compliance",
    "encoder_eccentricity",
    "backlash",
    "link_compliance",
];

/// Whether a file is a calibration and no experiment, by its content.
pub fn is_calibration(path: &Path) -> bool {
    let table = std::fs::read_to_string(path)
        .ok()
        .and_then(|t| t.parse::<toml::Table>().ok());
    table.is_some_and(|t| {
        !t.contains_key("record") && (t.contains_key("measurement") || t.contains_key("poses"))
    })
}

impl Calibration {
    /// Reads a `calibration.toml` and its files. `joints` gives the names of the joints whose readings stand in them,
    /// from the robot and the frame that the file names.
    ///
    /// # Errors
    /// Unknown or missing keys, files that cannot be read, rows that do not fit: each with file and line.
    pub fn read<K>(
        path: &Path,
        open: impl FnOnce(&str, Option<&str>, Option<&str>) -> Result<(K, Vec<String>)>,
    ) -> Result<(Self, K)> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
        let place = |at: usize| format!("line {}", line_of(&text, at));
        let file: File = toml::from_str(&text).map_err(|e| {
            let at = e.span().map_or(String::new(), |s| place(s.start));
            Error::file(path, at, e.message().trim().replace('\n', "; "))
        })?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let robot = beside(folder, &file.robot);
        let other = file.other.as_ref().map(|o| o.get_ref().as_str());
        let (kinematics, joints) = open(&robot, file.frame.as_deref(), other)?;
        let positive = |x: f64, at: usize, what: &str, unit: &str| match x.is_finite() && x > 0.0 {
            true => Ok(x),
            false => Err(Error::file(
                path,
                place(at),
                format!("{what} is {x}; it must be positive, in {unit}"),
            )),
        };
        let prior = match &file.prior {
            None => Tolerances::default(),
            Some(p) => {
                let (at, p) = (p.span().start, *p.get_ref());
                positive(p.length, at, "length", "m")?;
                positive(p.angle, at, "angle", "rad")?;
                positive(p.pose_length, at, "pose_length", "m")?;
                positive(p.pose_angle, at, "pose_angle", "rad")?;
                p
            }
        };
        if let Some(list) = &file.effects
            && let Some(wrong) = list
                .get_ref()
                .iter()
                .find(|e| !EFFECTS.contains(&e.as_str()))
        {
            return Err(Error::file(
                path,
                place(list.span().start),
                format!("`{wrong}` is no effect; known are {}", EFFECTS.join(", ")),
            ));
        }
        let stated = |own: Option<f64>,
                      at: usize,
                      all: &Option<Spanned<f64>>,
                      what: &str,
                      unit: &str| {
            match (own, all) {
                (Some(x), _) => positive(x, at, what, unit).map(Some),
                (None, Some(x)) => positive(*x.get_ref(), x.span().start, what, unit).map(Some),
                (None, None) => Ok(None),
            }
        };
        let mut measurements: Vec<Measurement> = Vec::new();
        let mut all = Vec::new();
        let mut warnings = Vec::new();
        let mut noise_stated = true;
        let mut entries: Vec<(usize, Entry)> = Vec::new();
        if let Some(poses) = &file.poses {
            entries.push((0, Entry::poses(poses.clone())));
        }
        for e in file.measurement {
            entries.push((e.span().start, e.into_inner()));
        }
        if entries.is_empty() {
            return Err(Error::file(
                path,
                "",
                "nothing is measured; state poses = \"poses.csv\", or [[measurement]] with kind and file",
            ));
        }
        for (at, entry) in entries {
            if entry.file.trim().is_empty() {
                return Err(Error::file(
                    path,
                    place(at),
                    "file is empty; name the file of readings",
                ));
            }
            if let Some(first) = measurements.iter().find(|m| m.file == entry.file) {
                return Err(Error::file(
                    path,
                    place(at),
                    format!(
                        "`{}` is named twice; its rows would count twice",
                        first.file
                    ),
                ));
            }
            let kind = entry.kind();
            if kind.is_loop() && other.is_none() {
                return Err(Error::file(
                    path,
                    place(at),
                    "kind = \"loop\" is of two arms of one robot file; write frame = \"LINK\" for the first and other = \"LINK\" \
                     for the second above",
                ));
            }
            let here = |e: Error| match e {
                Error::Argument(what) => Error::file(path, place(at), what),
                other => other,
            };
            let grip = entry.grip().map_err(here)?;
            let [base_at, target_at] = entry.known().map_err(here)?;
            let [usual, usual_angle] = kind.noise();
            let optics = entry.optics(folder).map_err(here)?;
            // of pictures the noise is one of pixels, and that of the poses follows from it
            let (std, angle) = match optics {
                Some(_) => (None, None),
                None => (
                    stated(entry.std, at, &file.std, "std", "m")?,
                    stated(entry.angle_std, at, &file.angle_std, "angle_std", "rad")?,
                ),
            };
            let source = Source {
                path: &folder.join(&entry.file),
                kind,
                optics: optics.as_ref(),
                joints: &joints,
                measurement: measurements.len(),
                purpose: entry.purpose,
            };
            let table = rows::read(&source, &mut warnings)?;
            noise_stated &= match optics {
                Some(_) => entry.std.is_some(),
                None => std.is_some() || table.iter().all(|r| r.covariance.is_some()),
            };
            all.extend(table);
            let instrument = match kind {
                Kind::Pose => "camera",
                _ => "tracker",
            };
            measurements.push(Measurement {
                kind,
                group: entry.group.unwrap_or_else(|| entry.file.clone()),
                file: entry.file,
                std: [std.unwrap_or(usual), angle.unwrap_or(usual_angle)],
                instrument: entry.instrument.unwrap_or_else(|| instrument.into()),
                grip,
                base_at,
                target_at,
            });
        }
        if let Some(o) = &file.other
            && !measurements.iter().any(|m| m.kind.is_loop())
        {
            return Err(Error::file(
                path,
                place(o.span().start),
                "other is the second arm of a [[measurement]] with kind = \"loop\", and there is none",
            ));
        }
        let mut distances = Vec::new();
        for d in &file.distance {
            let (at, d) = (d.span().start, d.get_ref());
            let mut between = [0; 2];
            for (to, name) in between.iter_mut().zip(&d.between) {
                let found = measurements
                    .iter()
                    .position(|m| m.file == *name && m.kind == Kind::Point);
                *to = found.ok_or_else(|| {
                    Error::file(
                        path,
                        place(at),
                        format!("`{name}` is no file of a [[measurement]] of kind \"point\""),
                    )
                })?;
            }
            if between[0] == between[1] {
                return Err(Error::file(
                    path,
                    place(at),
                    "the distance of a point from itself",
                ));
            }
            distances.push(Distance {
                between,
                value: positive(d.value, at, "value", "m")?,
                std: positive(d.std.unwrap_or(DISTANCE_STD), at, "std", "m")?,
            });
        }
        let calibration = Calibration {
            path: path.to_path_buf(),
            robot,
            frame: file.frame,
            other: file.other.map(Spanned::into_inner),
            gravity: file.gravity.map(|g| beside(folder, &g)),
            effects: file.effects.map(Spanned::into_inner),
            measurements,
            distances,
            rows: all,
            prior,
            noise_stated,
            warnings,
        };
        Ok((calibration, kinematics))
    }

    /// Names of the groups, in the order of the file.
    pub fn groups(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for m in &self.measurements {
            if !names.contains(&m.group.as_str()) {
                names.push(&m.group);
            }
        }
        names
    }

    /// Index of the group of a row.
    pub fn group_of(&self, row: &Row) -> usize {
        let name = &self.measurements[row.measurement].group;
        self.groups().iter().position(|g| g == name).unwrap_or(0)
    }
}

/// A file beside another one, or the name of a bundled robot.
fn beside(folder: &Path, name: &str) -> String {
    let path = folder.join(name);
    let is_path = Path::new(name).components().count() > 1
        || [".toml", ".urdf", ".xml"].iter().any(|e| name.ends_with(e));
    match holds_robot(&path) || is_path {
        true => path.to_string_lossy().into_owned(),
        false => name.to_string(),
    }
}
