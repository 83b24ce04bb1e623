//! `--into SCENE`: the result in a copy of the user's own file.

use super::Folder;
use excite::export::into_scene;
use excite::export::parts::Edited;
use excite::export::parts::Model;
use excite::{Error, Plant, Result, Warning, WarningKind};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Names of the files that will be written, relative to the folder; a scene that is not that of the robot is found here,
/// before any work.
pub fn planned(plant: &Plant, scene: Option<&Path>, folder: &Path) -> Result<Vec<String>> {
    let Some(scene) = scene else {
        return Ok(Vec::new());
    };
    let model = Model {
        plant,
        robot: plant.robot(),
        remarks: &[],
    };
    Ok(into_scene(&model, scene, folder)?.names())
}

/// The scene with a model in it, if one is named; the functions beside it use the names of its joints.
pub fn edit(
    model: &Model,
    scene: Option<&Path>,
    folder: &Path,
    texts: &mut [(&'static str, Result<String>)],
) -> Result<Option<Edited>> {
    let edited = scene.map(|s| into_scene(model, s, folder)).transpose()?;
    if let Some(text) = edited.as_ref().and_then(|e| e.effects.clone())
        && let Some(of) = texts.iter_mut().find(|(name, _)| *name == "effects.py")
    {
        of.1 = Ok(text);
    }
    Ok(edited)
}

/// What a user should know of it.
pub fn warnings(edited: Option<&Edited>) -> Vec<Warning> {
    let Some(edited) = edited else {
        return Vec::new();
    };
    let mut all = edited.warnings.clone();
    all.extend(edited.left_out.iter().map(|line| {
        Warning::new(
            WarningKind::FileNotWritten,
            &edited.file,
            format!("not in it: {line}"),
        )
    }));
    all
}

/// Writes it.
pub fn save(folder: &Folder, edited: Option<&Edited>) -> Result<Vec<PathBuf>> {
    let mut written = Vec::new();
    for (name, text) in edited.iter().flat_map(|e| &e.files) {
        let path = folder.dir.join(name);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).map_err(|e| Error::io(parent, e))?;
        }
        super::write(&path, folder.force, text)?;
        written.push(path);
    }
    Ok(written)
}

/// How much changed.
pub fn summary(edited: Option<&Edited>) -> String {
    let mut out = String::new();
    if let Some(e) = edited {
        let _ = writeln!(
            out,
            "\n{}: {} with {} changes, listed in the report",
            e.file,
            e.scene.display(),
            e.changes.len()
        );
    }
    out
}
