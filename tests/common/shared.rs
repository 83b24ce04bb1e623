//! Recordings and reference cases that do not come with the repository.

use std::io::Write;
use std::path::{Path, PathBuf};

/// `name` in the folder of shared data, which `EXCITE_SHARED` names or which is `../shared`. Where it is not there, the
/// test has nothing to do, and says so.
pub fn shared(name: &str) -> Option<PathBuf> {
    let found = find(name);
    if found.is_none() {
        say(&format!("skipped: ../shared/{name} is not there"));
    }
    found
}

/// The reference cases of parallel robots, whole: `tests/data` has a few of them. Where they are not there, says what
/// the test does `without` them.
pub fn checks(without: &str) -> Option<PathBuf> {
    let named = std::env::var_os("EXCITE_CHECKS").map(PathBuf::from);
    let found = named.filter(|p| p.is_dir()).or_else(|| find("checks"));
    if found.is_none() {
        say(&format!("{without}: ../shared/checks is not there"));
    }
    found
}

fn find(name: &str) -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let places = match std::env::var_os("EXCITE_SHARED") {
        Some(named) => vec![PathBuf::from(named)],
        None => ["../shared", "../../shared"].map(|p| root.join(p)).into(),
    };
    places.iter().map(|p| p.join(name)).find(|p| p.exists())
}

/// A line on standard error that is shown although the test passes: unlike that of `eprintln!`, what is written to the
/// stream itself is not captured.
fn say(what: &str) {
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("a test");
    let _ = std::io::stderr().write_all(format!("{test}: {what}\n").as_bytes());
}
