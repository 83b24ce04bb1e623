//! Robot files of parallel robots: `robot.toml` with `mechanism = "…"`, or a bundled name.
//!
//! What a file may say is described in `docs/formats.md`. All kinds share the head: name,
//! gravity, home, workspace, actuators, joints; what describes the bodies is read by one file a
//! kind.

mod body;
mod chains;
mod common;
mod legs;
mod loops;

use super::{Mechanism, bundled};
use crate::error::{Error, Result};
use crate::robot::file::Text;
use crate::robot::file::names::did_you_mean;
use crate::robot::file::text::read_text;
use sha2::{Digest, Sha256};
use std::path::Path;

/// Builds a mechanism from the text of its file; relative paths in it start at the folder.
type Reader = fn(Text, &Path) -> Result<Mechanism>;

/// Every kind, by what `mechanism = …` says.
const KINDS: [(&str, Reader); 4] = [
    ("gough-stewart", legs::read),
    ("h4", chains::read_h4),
    ("delta", chains::read_delta),
    ("loops", loops::read),
];

/// Names of all kinds.
fn kinds() -> impl Iterator<Item = &'static str> {
    KINDS.iter().map(|(name, _)| *name)
}

/// Whether the text is a `robot.toml` of a parallel robot. A text that is no TOML is none.
pub fn is_mechanism(text: &str) -> bool {
    toml::from_str::<toml::Table>(text).is_ok_and(|t| t.contains_key("mechanism"))
}

impl Mechanism {
    /// Reads a parallel robot: the path of its `robot.toml`, a bundled name, or (of the collection
    /// `example-parallel-robots`, see [`loops::yaml`](super::loops::yaml)) a `robot.yaml` or the
    /// folder that holds it beside its URDF. A file of that name wins over a bundled robot. `None` where this is no parallel robot: then
    /// [`Robot::load`](crate::Robot::load) may know it.
    ///
    /// # Errors
    /// A file that cannot be read, keys that are unknown, numbers that make no mechanism (with the
    /// line), and what [`Mechanism::new`] finds.
    pub fn load(spec: &str) -> Result<Option<Mechanism>> {
        let path = Path::new(spec);
        if path.is_dir() {
            let yaml = path.join("robot.yaml");
            if yaml.is_file() {
                return load_path(&yaml);
            }
        } else if path.exists() {
            return load_path(path);
        }
        bundled::find(spec).map(|b| b.load()).transpose()
    }

    /// A parallel robot from the text of its file; `name` is what errors call it. Files that it
    /// refers to are looked for in the working directory.
    ///
    /// # Errors
    /// As [`Mechanism::load`].
    pub fn from_toml_str(toml: &str, name: &str) -> Result<Mechanism> {
        let file = Path::new(name);
        read(Text { file, text: toml }, Path::new(""))
    }
}

fn load_path(path: &Path) -> Result<Option<Mechanism>> {
    let is_yaml = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("yaml") || e.eq_ignore_ascii_case("yml"));
    if is_yaml {
        let mut mechanism = loops::read_yaml(path)?;
        mechanism.robot.path = Some(path.to_path_buf());
        return Ok(Some(mechanism));
    }
    let is_toml = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("toml"));
    if !is_toml {
        return Ok(None);
    }
    let text = read_text(path)?;
    if !is_mechanism(&text) {
        return Ok(None);
    }
    let source = Text {
        file: path,
        text: &text,
    };
    let mut mechanism = read(source, path.parent().unwrap_or(Path::new("")))?;
    mechanism.robot.path = Some(path.to_path_buf());
    Ok(Some(mechanism))
}

/// The mechanism of a file of any kind.
fn read(source: Text, folder: &Path) -> Result<Mechanism> {
    let table: toml::Table = toml::from_str(source.text).map_err(|e| source.toml_error(&e))?;
    let Some(toml::Value::String(kind)) = table.get("mechanism") else {
        return Err(Error::file(
            source.file,
            "mechanism",
            format!(
                "state the kind: mechanism = \"{}\"",
                kinds().collect::<Vec<_>>().join("\" | \"")
            ),
        ));
    };
    let Some((_, reader)) = KINDS.iter().find(|(name, _)| name == kind) else {
        return Err(Error::file(
            source.file,
            "mechanism",
            format!(
                "`{kind}` is no kind of mechanism{}; known are {}",
                did_you_mean(kind, kinds()),
                kinds().collect::<Vec<_>>().join(", ")
            ),
        ));
    };
    let mut mechanism = reader(source, folder)?;
    if mechanism.robot.hash.is_empty() {
        mechanism.robot.hash = format!("{:x}", Sha256::digest(source.text));
    }
    Ok(mechanism)
}
