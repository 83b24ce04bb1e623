//! Where a package of ROS lies.
//!
//! The folders above the file come first: one that is the package by its `package.xml` or its name, or that contains
//! it. Then those of `ROS_PACKAGE_PATH`, and `share` in those of `AMENT_PREFIX_PATH`.

use std::path::{Path, PathBuf};

/// The folder of a package.
pub(super) fn find(name: &str, file: &Path) -> Option<PathBuf> {
    let folder = file
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let whole = std::fs::canonicalize(folder).unwrap_or_else(|_| folder.to_path_buf());
    let listed = |variable: &str| -> Vec<PathBuf> {
        let list = std::env::var_os(variable).unwrap_or_default();
        let all = std::env::split_paths(&list).filter(|p| !p.as_os_str().is_empty());
        all.collect()
    };
    let above = whole.ancestors().map(Path::to_path_buf);
    let stated = listed("ROS_PACKAGE_PATH").into_iter();
    let shared = listed("AMENT_PREFIX_PATH")
        .into_iter()
        .map(|p| p.join("share"));
    above
        .chain(stated)
        .chain(shared)
        .find_map(|folder| of(&folder, name))
}

fn of(folder: &Path, name: &str) -> Option<PathBuf> {
    let named = std::fs::read_to_string(folder.join("package.xml")).is_ok_and(|text| {
        text.split("<name>")
            .nth(1)
            .and_then(|t| t.split('<').next())
            .map(str::trim)
            == Some(name)
    });
    let called = folder.file_name().is_some_and(|n| n == name);
    if named || called {
        return Some(folder.to_path_buf());
    }
    let inside = folder.join(name);
    inside.is_dir().then_some(inside)
}
