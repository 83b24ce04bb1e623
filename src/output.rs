//! Writing files: whole or not at all, and never over something by accident. Matrices in serialised results.

use crate::error::{Error, Result};
use faer::Mat;
use nalgebra::{Matrix3, Vector3};
use serde::{Serialize, Serializer};
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// A matrix in a serialised result: a list of its rows.
///
/// # Errors
/// Those of the serialiser.
pub fn rows<S: Serializer>(m: &Mat<f64>, serializer: S) -> std::result::Result<S::Ok, S::Error> {
    let row = |i: usize| (0..m.ncols()).map(move |j| m[(i, j)]).collect::<Vec<f64>>();
    serializer.collect_seq((0..m.nrows()).map(row))
}

/// A vector in a serialised result: a list of its coordinates.
///
/// # Errors
/// Those of the serialiser.
pub fn vector<S: Serializer>(
    v: &Vector3<f64>,
    serializer: S,
) -> std::result::Result<S::Ok, S::Error> {
    [v.x, v.y, v.z].serialize(serializer)
}

/// A rotation in a serialised result: a list of its rows.
///
/// # Errors
/// Those of the serialiser.
pub fn rotation<S: Serializer>(
    r: &Matrix3<f64>,
    serializer: S,
) -> std::result::Result<S::Ok, S::Error> {
    let row = |i: usize| [r[(i, 0)], r[(i, 1)], r[(i, 2)]];
    [row(0), row(1), row(2)].serialize(serializer)
}

/// Two points in a serialised result: a list of their coordinates.
///
/// # Errors
/// Those of the serialiser.
pub fn points<S: Serializer>(
    ends: &[Vector3<f64>; 2],
    serializer: S,
) -> std::result::Result<S::Ok, S::Error> {
    ends.map(|p| [p.x, p.y, p.z]).serialize(serializer)
}

/// Removes the temporary file unless it has been renamed.
struct Temporary(Option<PathBuf>);

impl Drop for Temporary {
    fn drop(&mut self) {
        if let Some(path) = &self.0 {
            // nothing more can be done if this fails too
            let _ = fs::remove_file(path);
        }
    }
}

/// Writes a file through `write`: into a temporary file of the same directory that takes the name
/// `path` only when all is written and stored, so that no half-written file ever carries it. What
/// exists is replaced only with `force`. A device or pipe (`/dev/stdout`) is written directly.
///
/// # Errors
/// [`Error::Exists`] if the file exists and `force` is not set; [`Error::Io`] with the path for
/// everything else, including what `write` returns.
pub fn write_atomic(
    path: impl AsRef<Path>,
    force: bool,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<()> {
    let path = path.as_ref();
    let failed = |source: io::Error| Error::io(path, source);
    // a link is followed: the file it points to is what is replaced
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    if let Ok(kind) = fs::metadata(&target) {
        if kind.is_dir() {
            return Err(failed(io::Error::other("is a directory; name a file")));
        }
        if !kind.is_file() {
            let device = OpenOptions::new()
                .write(true)
                .open(&target)
                .map_err(failed)?;
            let mut out = BufWriter::new(device);
            return write(&mut out).and_then(|()| out.flush()).map_err(failed);
        }
    }
    refuse(path, force)?;
    let (file, name) = create_beside(&target).map_err(failed)?;
    let mut temporary = Temporary(Some(name.clone()));
    let mut out = BufWriter::new(file);
    write(&mut out).map_err(failed)?;
    let file = out.into_inner().map_err(|e| failed(e.into_error()))?;
    if let Ok(old) = fs::metadata(&target) {
        file.set_permissions(old.permissions()).map_err(failed)?;
    }
    file.sync_all().map_err(failed)?;
    refuse(path, force)?;
    fs::rename(&name, &target).map_err(failed)?;
    temporary.0 = None;
    Ok(())
}

/// Makes the output directory (with its parents) and makes sure, before any work is done, that
/// none of the files to be written there exists already, unless `force`. Nothing is made when
/// something is in the way. Returns the full paths, in the order of `names`.
///
/// # Errors
/// [`Error::Exists`] with the first file in the way; [`Error::Argument`] if `dir` is a file;
/// [`Error::Io`] if it cannot be made.
pub fn prepare_dir(dir: impl AsRef<Path>, names: &[&str], force: bool) -> Result<Vec<PathBuf>> {
    let dir = dir.as_ref();
    if dir.exists() && !dir.is_dir() {
        return Err(Error::Argument(format!(
            "{} is a file, not a directory; choose another --output",
            dir.display()
        )));
    }
    let paths: Vec<PathBuf> = names.iter().map(|name| dir.join(name)).collect();
    for path in &paths {
        refuse(path, force)?;
    }
    fs::create_dir_all(dir).map_err(|e| Error::io(dir, e))?;
    Ok(paths)
}

/// [`Error::Exists`] if there is something at `path` (even a dangling link) and no `force`.
fn refuse(path: &Path, force: bool) -> Result<()> {
    if !force && path.symlink_metadata().is_ok() {
        return Err(Error::Exists(path.to_path_buf()));
    }
    Ok(())
}

/// A new, empty, hidden file in the directory of `target`.
fn create_beside(target: &Path) -> io::Result<(File, PathBuf)> {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let name = target
        .file_name()
        .ok_or_else(|| io::Error::other("is not the name of a file"))?
        .to_string_lossy();
    loop {
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let hidden = format!(".{name}.{}-{count}.tmp", std::process::id());
        let path = target.with_file_name(hidden);
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            Ok(file) => return Ok((file, path)),
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
            Err(e) => return Err(e),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(dir: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(dir)
            .unwrap()
            .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn writes_and_replaces_only_by_force() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        write_atomic(&path, false, |w| w.write_all(b"one")).unwrap();
        let again = write_atomic(&path, false, |w| w.write_all(b"two"));
        assert!(matches!(again, Err(Error::Exists(p)) if p == path));
        assert_eq!(fs::read(&path).unwrap(), b"one");
        write_atomic(&path, true, |w| w.write_all(b"three")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"three");
        assert_eq!(entries(dir.path()), ["a.txt"]);
    }

    #[test]
    fn a_failure_leaves_nothing_behind_and_the_old_file_as_it_was() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        fs::write(&path, "old").unwrap();
        let result = write_atomic(&path, true, |w| {
            w.write_all(&[b'x'; 100_000])?;
            Err(io::Error::other("no more ink"))
        });
        let message = result.unwrap_err().to_string();
        assert!(message.contains("a.txt") && message.contains("no more ink"));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(entries(dir.path()), ["a.txt"]);
    }

    #[test]
    fn directories_are_no_files_and_the_other_way_round() {
        let dir = tempfile::tempdir().unwrap();
        assert!(matches!(
            write_atomic(dir.path(), true, |_| Ok(())),
            Err(Error::Io { .. })
        ));
        let nowhere = dir.path().join("none/a.txt");
        assert!(matches!(
            write_atomic(&nowhere, true, |_| Ok(())),
            Err(Error::Io { .. })
        ));
        let file = dir.path().join("f");
        fs::write(&file, "").unwrap();
        assert!(prepare_dir(&file, &["a"], true).unwrap_err().is_argument());
    }

    #[test]
    fn prepare_checks_every_name_first() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("x/y");
        let paths = prepare_dir(&out, &["a.json", "b.csv"], false).unwrap();
        assert_eq!(paths, [out.join("a.json"), out.join("b.csv")]);
        fs::write(&paths[1], "").unwrap();
        let error = prepare_dir(&out, &["a.json", "b.csv"], false).unwrap_err();
        assert!(error.to_string().contains("b.csv") && error.to_string().contains("--force"));
        assert!(prepare_dir(&out, &["a.json", "b.csv"], true).is_ok());
        assert_eq!(entries(&out), ["b.csv"]);
    }

    #[cfg(unix)]
    #[test]
    fn a_device_is_written_to_not_replaced() {
        write_atomic("/dev/null", false, |w| w.write_all(b"gone")).unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
    }
}
