//! A model written into a file of its user: an MJCF or a URDF in which only what differs from the model is changed.
//!
//! | step | module |
//! |---|---|
//! | elements with their bytes, edits of the text | `text` |
//! | which body is which, by joints, checked by motion | `matching` |
//! | inertia of a body whose welded parts stay as they are | `bodies` |
//! | MJCF: joints, drives, gravity | `mjcf`, `joints` |
//! | MJCF: bodies and joints that effects add | `added` |
//! | URDF | `urdf` |
//! | files that the scene refers to, from another folder | `assets` |
//! | what changed, for people | `page` |
//!
//! Comments, order, meshes, cameras and everything else stay as they are.

mod added;
mod assets;
mod bodies;
mod joints;
mod matching;
mod mjcf;
mod page;
#[cfg(test)]
mod tests;
mod text;
mod urdf;

pub(crate) use page::page;
pub use text::Change;

use super::mujoco::Mujoco;
use super::{Format, Model};
use crate::error::{Error, Result, Warning};
use crate::robot::file::text::read_text;
use crate::robot::mjcf as format;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// A scene with a model in it.
#[derive(Debug, Clone, Serialize)]
pub struct Edited {
    /// the file that was read
    pub scene: PathBuf,
    /// name of the file that is written
    pub file: String,
    /// all files to be written, relative to the folder, with their texts
    #[serde(skip)]
    pub files: Vec<(PathBuf, String)>,
    /// what is not as it was
    pub changes: Vec<Change>,
    /// what of the model is not in it
    pub left_out: Vec<String>,
    /// `effects.py` with the names of the joints in the scene, where they are others
    #[serde(skip)]
    pub effects: Option<String>,
    /// what a user should know of it
    #[serde(skip)]
    pub warnings: Vec<Warning>,
}

/// Writes a model into the MJCF or URDF at `scene`, for a folder that the result is to stand in.
///
/// # Errors
/// A scene that cannot be read, is not that of the robot or stands in `folder` itself; a closed chain; a body that
/// the scene cannot hold.
pub fn into_scene(model: &Model, scene: &Path, folder: &Path) -> Result<Edited> {
    if !Mujoco.holds(model.plant) {
        return Err(Error::Infeasible(format!(
            "{}: closed chains are not written into a scene",
            model.robot.name
        )));
    }
    let text = read_text(scene)?;
    if crate::robot::xacro::is(&text) {
        return Err(Error::file(
            scene,
            "",
            "a xacro is not written back, for its values come from macros and other files; take the robot.urdf that is \
             written anyway",
        ));
    }
    let mut edited = match format::is(&text) {
        true => mjcf::write(model, scene, &text, folder)?,
        false => urdf::write(model, scene, &text, folder)?,
    };
    for change in &mut edited.changes {
        let path = Path::new(&change.file);
        let base = scene.parent().unwrap_or(Path::new(""));
        change.file = path
            .strip_prefix(base)
            .unwrap_or(path)
            .display()
            .to_string();
    }
    Ok(edited)
}

impl Edited {
    /// Names of the files, relative to the folder.
    pub fn names(&self) -> Vec<String> {
        let all = self.files.iter();
        all.map(|(path, _)| path.display().to_string()).collect()
    }
}
