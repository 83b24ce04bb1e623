//! Robot files: a bundled name, a `.urdf`, or a `robot.toml` that adds what a URDF cannot say.

pub(crate) mod joint;
pub(crate) mod names;
mod template;
pub(crate) mod text;
mod tool;

use super::geometry::{CollisionEntry, Entries, KeepInEntry, ShapeEntry};
use super::urdf::{Options, Urdf};
use super::{Prior, Robot, bundled, mjcf, xacro};
use crate::error::{Error, Result, line_of};
use nalgebra::Vector3;
use serde::Deserialize;
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use text::read_text;
use toml::Spanned;

use joint::{JointEntry, joint_values, stated_limits};
use names::{did_you_mean, listed};

/// `robot.toml` as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RobotFile {
    name: Option<Spanned<String>>,
    urdf: Option<Spanned<String>>,
    #[serde(default)]
    lock: BTreeMap<String, Spanned<f64>>,
    // vectors, because an array would swallow further elements in silence
    gravity: Option<Spanned<Vec<f64>>>,
    #[serde(default)]
    prior: Prior,
    #[serde(default)]
    joint: Vec<Spanned<JointEntry>>,
    #[serde(default)]
    collision: CollisionEntry,
    tool: Option<tool::ToolEntry>,
    #[serde(default)]
    volume: Vec<ShapeEntry>,
    #[serde(default)]
    obstacle: Vec<ShapeEntry>,
    #[serde(default)]
    keep_in: Vec<KeepInEntry>,
}

/// A file name and its text, for messages and the hash.
#[derive(Clone, Copy)]
pub(crate) struct Text<'a> {
    pub(crate) file: &'a Path,
    pub(crate) text: &'a str,
}

impl Text<'_> {
    /// An error at a byte of the text, about `what` (may be empty).
    pub(crate) fn error(&self, at: usize, what: &str, message: impl Into<String>) -> Error {
        let line = line_of(self.text, at);
        let colon = if what.is_empty() { "" } else { ": " };
        Error::file(self.file, format!("line {line}{colon}{what}"), message)
    }

    pub(crate) fn toml_error(&self, error: &toml::de::Error) -> Error {
        let message = error.message().trim().replace('\n', "; ");
        match error.span() {
            Some(span) => self.error(span.start, "", message),
            None => Error::file(self.file, "", message),
        }
    }
}

/// Whether a robot is read from this path: a file, or a folder with a `robot.yaml`. Any other folder does not hide the
/// bundled robot of its name.
pub fn holds_robot(path: &Path) -> bool {
    path.is_file() || path.join("robot.yaml").is_file()
}

impl Robot {
    /// Reads a robot: the path of a `robot.toml`, a `.urdf`, a `.xacro` or an MJCF, or the name of a bundled robot. A
    /// file of that name wins over a bundled robot. Arguments of a xacro stand behind its path, as in
    /// `ur.urdf.xacro ur_type:=ur5e`.
    ///
    /// # Errors
    /// Nothing of that name, or whatever [`Robot::from_toml_str`] and [`Robot::from_urdf_str`]
    /// find wrong in it.
    pub fn load(spec: &str) -> Result<Robot> {
        if spec.trim().is_empty() {
            return Err(Error::Argument(format!(
                "no robot is named; give a robot.toml, a .urdf, an MJCF, or one of {}",
                all_bundled().collect::<Vec<_>>().join(", ")
            )));
        }
        let (name, arguments) = xacro::with_arguments(spec);
        let path = Path::new(name);
        let directory = path.is_dir();
        if path.exists() && !directory {
            return load_path(path, &arguments);
        }
        if let Some(robot) = bundled::find(spec) {
            return robot.load();
        }
        if bundled::PARALLEL.contains(&spec) {
            return Err(Error::Infeasible(format!(
                "`{spec}` is a parallel robot, and what was asked for works with serial and tree \
                 robots only"
            )));
        }
        if directory {
            return Err(Error::file(
                path,
                "",
                "it is a directory; name the robot.toml or .urdf in it",
            ));
        }
        let extension = path
            .extension()
            .and_then(|e| e.to_str())
            .unwrap_or_default();
        if path.components().count() > 1 || matches!(extension, "toml" | "urdf" | "xml" | "xacro") {
            return Err(Error::io(
                path,
                std::fs::metadata(path)
                    .err()
                    .unwrap_or_else(|| std::io::Error::from(std::io::ErrorKind::NotFound)),
            ));
        }
        Err(Error::Argument(format!(
            "`{spec}` is neither a file nor a bundled robot{}; bundled are {}",
            did_you_mean(spec, all_bundled()),
            all_bundled().collect::<Vec<_>>().join(", ")
        )))
    }

    /// A robot from the text of a URDF; `name` is what errors call it, and the robot's name where
    /// `<robot>` has none.
    ///
    /// # Errors
    /// See `Urdf::parse` and `Urdf::robot`.
    pub fn from_urdf_str(text: &str, name: &str) -> Result<Robot> {
        from_urdf(Text {
            file: Path::new(name),
            text,
        })
    }

    /// A robot from the texts of a `robot.toml` and of the URDF it refers to; `name` is what errors
    /// call the former.
    ///
    /// # Errors
    /// Unknown keys, unknown or repeated joints, numbers out of range; see also `Urdf::parse` and
    /// `Urdf::robot`.
    pub fn from_toml_str(toml: &str, urdf: &str, name: &str) -> Result<Robot> {
        let text = Text {
            file: Path::new(name),
            text: toml,
        };
        let file = parse(text)?;
        let urdf_name = file.urdf.as_ref().map_or("its URDF", |u| u.get_ref());
        let urdf_path = PathBuf::from(urdf_name);
        apply(
            text,
            &file,
            Text {
                file: &urdf_path,
                text: urdf,
            },
        )
    }

    /// A commented `robot.toml` for this robot with all joints and their present limits; `urdf` is
    /// the path of the URDF relative to the new file. Read again, it gives the same robot.
    pub fn to_toml_template(&self, urdf: &str) -> String {
        template::template(self, urdf)
    }
}

/// Names of all bundled robots, parallel ones included.
fn all_bundled() -> impl Iterator<Item = &'static str> {
    bundled::names().into_iter().chain(bundled::PARALLEL)
}

fn load_path(path: &Path, arguments: &BTreeMap<String, String>) -> Result<Robot> {
    let text = read_text(path)?;
    let source = Text {
        file: path,
        text: &text,
    };
    let is_toml = match path.extension().and_then(|e| e.to_str()) {
        Some(e) if e.eq_ignore_ascii_case("toml") => true,
        Some(e)
            if ["urdf", "xml", "xacro"]
                .iter()
                .any(|x| e.eq_ignore_ascii_case(x)) =>
        {
            false
        }
        // a pipe or an unusual extension: XML begins with <
        _ if text
            .trim_start_matches('\u{feff}')
            .trim_start()
            .starts_with('<') =>
        {
            false
        }
        _ => {
            return Err(Error::file(
                path,
                "",
                "a robot file ends in .toml or .urdf; rename it",
            ));
        }
    };
    let mut robot = if is_toml {
        let file = parse(source)?;
        let Some(urdf) = &file.urdf else {
            return Err(Error::file(
                path,
                "",
                "it names no URDF; add urdf = \"robot.urdf\"",
            ));
        };
        if !arguments.is_empty() {
            return Err(Error::file(
                path,
                "",
                "arguments of a xacro stand in it, behind the name: urdf = \"robot.urdf.xacro name:=value\"",
            ));
        }
        let (urdf_name, arguments) = xacro::with_arguments(urdf.get_ref());
        let urdf_path = path.parent().unwrap_or(Path::new("")).join(urdf_name);
        if urdf_path.is_dir() {
            return Err(source.error(
                urdf.span().start,
                "urdf",
                format!(
                    "{} is a directory; name the .urdf file",
                    urdf_path.display()
                ),
            ));
        }
        let urdf_text = read_text(&urdf_path).map_err(|e| match e {
            Error::Io { source: cause, .. } => source.error(
                urdf.span().start,
                "urdf",
                format!(
                    "cannot read {} ({cause}); the path is relative to this file",
                    urdf_path.display()
                ),
            ),
            other => other,
        })?;
        let (urdf_path, urdf_text) = expanded(urdf_path, urdf_text, &arguments)?;
        apply(
            source,
            &file,
            Text {
                file: &urdf_path,
                text: &urdf_text,
            },
        )?
    } else {
        let (file, text) = expanded(path.to_path_buf(), text.clone(), arguments)?;
        from_urdf(Text {
            file: &file,
            text: &text,
        })?
    };
    robot.path = Some(path.to_path_buf());
    Ok(robot)
}

/// A description with the xacro in it expanded; its name says so then, for lines are those of the URDF.
///
/// # Errors
/// Whatever [`xacro::expand`] finds wrong; arguments for a file that takes none.
pub(crate) fn expanded(
    path: PathBuf,
    text: String,
    arguments: &BTreeMap<String, String>,
) -> Result<(PathBuf, String)> {
    if xacro::is(&text) {
        let text = xacro::expand(&text, &path, arguments)?;
        let mut name = path.into_os_string();
        name.push(" (expanded)");
        return Ok((name.into(), text));
    }
    match arguments.keys().next() {
        Some(name) => Err(Error::Argument(format!(
            "{} takes no argument `{name}`: there is no xacro in it",
            path.display()
        ))),
        None => Ok((path, text)),
    }
}

/// Links and joints of a URDF, or of an MJCF, told apart by the root element; `file` is what errors call it.
///
/// # Errors
/// Those of the format.
pub(crate) fn described(text: &str, file: &Path) -> Result<Urdf> {
    match mjcf::is(text) {
        true => mjcf::read(text, file),
        false => Urdf::parse(text, file),
    }
}

fn from_urdf(source: Text) -> Result<Robot> {
    let urdf = described(source.text, source.file)?;
    let mut robot = urdf.robot(&Options::default())?;
    if robot.name.is_empty() {
        robot.name = file_stem(source.file);
    }
    robot.hash = format!("{:x}", Sha256::digest(source.text));
    Ok(robot)
}

pub(crate) fn file_stem(file: &Path) -> String {
    file.file_stem()
        .map_or_else(|| "robot".to_string(), |s| s.to_string_lossy().into_owned())
}

fn parse(source: Text) -> Result<RobotFile> {
    let table: toml::Table = toml::from_str(source.text).map_err(|e| source.toml_error(&e))?;
    refuse_mechanism(source, &table)?;
    toml::from_str(source.text).map_err(|e| source.toml_error(&e))
}

/// A parallel robot is no tree.
fn refuse_mechanism(source: Text, table: &toml::Table) -> Result<()> {
    let Some(kind) = table.get("mechanism") else {
        return Ok(());
    };
    Err(Error::file(
        source.file,
        "mechanism",
        format!(
            "this is a parallel robot (mechanism = {kind}), and what was asked for works with \
             serial and tree robots only"
        ),
    ))
}

/// The robot of `urdf` with what `file` states.
fn apply(source: Text, file: &RobotFile, urdf: Text) -> Result<Robot> {
    let tree = described(urdf.text, urdf.file)?;
    let names: Vec<&str> = tree.joint_names().collect();
    let unknown = |name: &str, at: usize, what: &str| {
        source.error(
            at,
            what,
            format!(
                "the URDF has no joint `{name}`{}; its joints are {}",
                did_you_mean(name, names.iter().copied()),
                listed(&names)
            ),
        )
    };
    let mut options = Options::default();
    for (name, value) in &file.lock {
        if !names.contains(&name.as_str()) {
            return Err(unknown(name, value.span().start, "lock"));
        }
        if !value.get_ref().is_finite() {
            return Err(source.error(
                value.span().start,
                "lock",
                format!(
                    "`{name}` is locked at {}; state a finite position",
                    value.get_ref()
                ),
            ));
        }
        options.lock.insert(name.clone(), *value.get_ref());
    }
    let mut entries: HashMap<&str, &JointEntry> = HashMap::new();
    for whole in &file.joint {
        let entry = whole.get_ref();
        let (name, at) = (entry.name.get_ref().as_str(), entry.name.span().start);
        if name.is_empty() {
            let at = whole.span().start;
            return Err(source.error(at, "[[joint]]", "it has no name; add name = \"…\""));
        }
        if !names.contains(&name) {
            return Err(unknown(name, at, "[[joint]]"));
        }
        let what = format!("joint `{name}`");
        if entries.insert(name, entry).is_some() {
            return Err(source.error(at, &what, "it has two [[joint]] entries; merge them"));
        }
        if tree.is_fixed(name) == Some(true) {
            return Err(source.error(at, &what, "it is fixed in the URDF; remove this entry"));
        }
        if let Some(leader) = tree.mimics(name)
            && !options.lock.contains_key(name)
        {
            return Err(source.error(
                at,
                &what,
                format!("it mimics `{leader}`; state its values for that joint"),
            ));
        }
        options
            .limits
            .insert(name.to_string(), stated_limits(source, entry, &what)?);
    }

    let mut robot = tree.robot(&options)?;
    robot.prior = file.prior;
    if let Some(gravity) = &file.gravity {
        robot.gravity = match gravity.get_ref()[..] {
            [x, y, z] if x.is_finite() && y.is_finite() && z.is_finite() => Vector3::new(x, y, z),
            _ => {
                return Err(source.error(
                    gravity.span().start,
                    "gravity",
                    "it must be three finite numbers, m/s^2",
                ));
            }
        };
    }
    if let Some(name) = &file.name {
        robot.name = name.get_ref().trim().to_string();
    }
    if robot.name.is_empty() {
        robot.name = file_stem(source.file);
    }
    for entry in file.joint.iter().map(Spanned::get_ref) {
        let name = entry.name.get_ref();
        let what = format!("joint `{name}`");
        // the entry of a locked joint waits until it is free again
        if let Some(joint) = robot.joints.iter_mut().find(|j| j.name == *name) {
            let warnings = &mut robot.warnings;
            joint_values(source, entry, &what, joint, warnings)?;
        }
    }
    if let Some(tool) = &file.tool {
        robot.tool = Some(tool.tool(source, &robot.geometry.links)?);
    }
    let surroundings = Entries {
        collision: &file.collision,
        volume: &file.volume,
        obstacle: &file.obstacle,
        keep_in: &file.keep_in,
    };
    let folder = source.file.parent().unwrap_or(Path::new(""));
    surroundings.apply(source, folder, &mut robot.geometry)?;
    robot.hash = format!(
        "{:x}",
        Sha256::new()
            .chain_update(source.text)
            .chain_update(urdf.text)
            .finalize()
    );
    Ok(robot)
}
