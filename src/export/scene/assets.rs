//! Files that a scene refers to, seen from the folder that the result stands in.

use super::text::Edits;
use crate::error::{Error, Result};
use crate::robot::mjcf::xml::Node;
use std::path::{Component, Path, PathBuf};

/// Attributes of `<compiler>` that name folders, and the elements whose files are there.
const FOLDERS: [(&str, &[&str]); 2] = [
    ("meshdir", &["mesh", "hfield", "skin", "flex", "flexcomp"]),
    ("texturedir", &["texture"]),
];

/// A path without links and dots, of a file that may not exist yet.
fn real(path: &Path) -> PathBuf {
    if let Ok(found) = path.canonicalize() {
        return found;
    }
    let full = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    match (full.parent(), full.file_name()) {
        (Some(parent), Some(name)) => real(parent).join(name),
        _ => full,
    }
}

/// The way from a folder to a file or folder.
fn from(folder: &Path, to: &Path) -> String {
    let (folder, to) = (real(folder), real(to));
    let common = folder
        .components()
        .zip(to.components())
        .take_while(|(a, b)| a == b)
        .count();
    if common == 0 {
        return to.display().to_string();
    }
    let up = folder.components().skip(common).map(|_| "..".to_string());
    let down = to.components().skip(common);
    let down = down.map(|c| c.as_os_str().to_string_lossy().into_owned());
    let all: Vec<String> = up.chain(down).collect();
    match all.is_empty() {
        true => ".".into(),
        false => all.join("/"),
    }
}

fn folder_of(file: &Path) -> PathBuf {
    match file.parent() {
        Some(p) if !p.as_os_str().is_empty() => p.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

/// Names of the files of a scene in the folder that they are written to, in the order of the sources; the last is the
/// scene.
///
/// # Errors
/// The folder of the scene itself.
pub(super) fn names(scene: &Path, edits: &mut Edits, folder: &Path) -> Result<Vec<PathBuf>> {
    let home = folder_of(scene);
    if real(&home) == real(folder) {
        return Err(Error::Argument(format!(
            "{}: it stands in the folder that the result is written to; choose another --output",
            scene.display()
        )));
    }
    let mut names: Vec<PathBuf> = Vec::new();
    for source in &edits.sources {
        let inside = source
            .path
            .strip_prefix(scene.parent().unwrap_or(Path::new("")));
        let plain = |p: &&Path| p.components().all(|c| matches!(c, Component::Normal(_)));
        let flat = || PathBuf::from(source.path.file_name().unwrap_or_default());
        let mut name = inside.ok().filter(plain).map_or_else(flat, PathBuf::from);
        let taken = |n: &PathBuf, names: &[PathBuf]| {
            names.contains(n) || crate::export::all().iter().any(|f| n == Path::new(f))
        };
        while taken(&name, &names) {
            let file = name.file_name().unwrap_or_default().to_string_lossy();
            name = name.with_file_name(format!("scene_{file}"));
        }
        if real(&folder.join(&name)) == real(&source.path) {
            return Err(Error::Argument(format!(
                "{}: the result would be written over it; choose another --output",
                source.path.display()
            )));
        }
        names.push(name);
    }
    // includes whose file has another place now
    let mut moved = Vec::new();
    for (s, source) in edits.sources.iter().enumerate() {
        for (range, path) in &source.includes {
            let at = edits.sources.iter().position(|o| o.path == *path);
            let Some(name) = at.map(|at| names[at].display().to_string()) else {
                continue;
            };
            if source.text.get(range.clone()) != Some(name.as_str()) {
                moved.push((s, range.clone(), name));
            }
        }
    }
    for (s, range, name) in moved {
        edits.put(s, range, &name);
    }
    Ok(names)
}

/// Elements with these tags anywhere.
fn all<'a>(node: &'a Node, tags: &[&str], out: &mut Vec<&'a Node>) {
    for child in &node.children {
        if tags.contains(&child.tag.as_str()) {
            out.push(child);
        }
        all(child, tags, out);
    }
}

/// Points the folders of meshes and textures of an MJCF to where they are.
pub(super) fn mjcf(scene: &Path, root: &Node, edits: &mut Edits, folder: &Path) {
    let home = folder_of(scene);
    let compilers: Vec<&Node> = root.all("compiler").collect();
    let mut missing = Vec::new();
    for name in ["assetdir", "meshdir", "texturedir"] {
        for c in &compilers {
            if let Some(old) = c.own(name).filter(|f| Path::new(f).is_relative()) {
                edits.set(c, "compiler", name, from(folder, &home.join(old)), None);
            }
        }
    }
    for (name, tags) in FOLDERS {
        let mut users = Vec::new();
        all(root, tags, &mut users);
        let relative = |n: &&Node| n.own("file").is_some_and(|f| Path::new(f).is_relative());
        let stated = |c: &&Node| c.own(name).is_some() || c.own("assetdir").is_some();
        if users.iter().any(relative) && !compilers.iter().any(stated) {
            missing.push((name, from(folder, &home)));
        }
    }
    match (compilers.first(), root.children.first()) {
        (Some(c), _) => {
            for (name, value) in missing {
                edits.set(c, "compiler", name, value, None);
            }
        }
        (None, Some(first)) if !missing.is_empty() => {
            let all: String = missing
                .iter()
                .map(|(n, v)| format!(" {n}=\"{}\"", crate::export::escape(v)))
                .collect();
            edits.before(first, &[format!("<compiler{all}/>")]);
            for (name, value) in missing {
                edits.say(first, "compiler".into(), name, [None, Some(value)]);
            }
        }
        _ => {}
    }
    let mut models = Vec::new();
    all(root, &["model"], &mut models);
    for m in models {
        if let Some(old) = m.own("file").filter(|f| Path::new(f).is_relative()) {
            let of = Edits::called(m);
            edits.set(m, &of, "file", from(folder, &home.join(old)), None);
        }
    }
}

/// Points the meshes and textures of a URDF to where they are.
pub(super) fn urdf(scene: &Path, root: &Node, edits: &mut Edits, folder: &Path) {
    let mut users = Vec::new();
    all(root, &["mesh", "texture"], &mut users);
    for node in users {
        let old = node.own("filename");
        let old = old.filter(|f| !f.contains("://") && Path::new(f).is_relative());
        if let Some(old) = old {
            let value = from(folder, &folder_of(scene).join(old));
            edits.set(node, &Edits::called(node), "filename", value, None);
        }
    }
}
