//! Where a mesh file lies.
//!
//! `package://NAME/PATH` and `model://NAME/PATH` are looked for in every folder: as `FOLDER/NAME/PATH`, and as
//! `FOLDER/PATH` where the folder itself is the package. Other names are relative to the folders.

use std::path::{Path, PathBuf};

/// The folders in which the meshes of a robot file are looked for: those that are stated, the file's own and
/// the ones above it, and those of `ROS_PACKAGE_PATH`.
pub(crate) fn folders(file: &Path, stated: &[PathBuf]) -> Vec<PathBuf> {
    let mut out = stated.to_vec();
    let folder = match file.parent() {
        Some(p) if p.as_os_str().is_empty() => Path::new("."),
        Some(p) => p,
        None => Path::new("."),
    };
    let whole = std::fs::canonicalize(folder).unwrap_or_else(|_| folder.to_path_buf());
    out.extend(whole.ancestors().map(Path::to_path_buf));
    if let Some(list) = std::env::var_os("ROS_PACKAGE_PATH") {
        out.extend(std::env::split_paths(&list).filter(|p| !p.as_os_str().is_empty()));
    }
    out
}

/// The file that a URDF names, where there is one.
pub(super) fn mesh(name: &str, folders: &[PathBuf]) -> Option<PathBuf> {
    let name = name.trim();
    let of_package = ["package://", "model://"]
        .iter()
        .find_map(|p| name.strip_prefix(p));
    let found = |path: PathBuf| path.is_file().then_some(path);
    if let Some(rest) = of_package {
        let (package, path) = rest.split_once('/').unwrap_or(("", rest));
        return folders
            .iter()
            .find_map(|f| found(f.join(package).join(path)).or_else(|| found(f.join(path))));
    }
    let plain = name.strip_prefix("file://").unwrap_or(name);
    let path = Path::new(plain);
    match path.is_absolute() {
        true => found(path.to_path_buf()),
        false => folders.iter().find_map(|f| found(f.join(path))),
    }
}
