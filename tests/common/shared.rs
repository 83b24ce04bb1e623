//! Recordings and reference cases that do not come with the repository.

use std::io::Write;
use std::path::{Path, PathBuf};

/// `name` in the folder of shared data: that of the variable `EXCITE_SHARED`, or `../shared`. Where it is not there,
/// a line on standard error says which test did not run.
pub fn shared(name: &str) -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let named = std::env::var_os("EXCITE_SHARED").map(PathBuf::from);
    let found = named
        .into_iter()
        .chain(["../shared", "../../shared"].map(|p| root.join(p)))
        .map(|p| p.join(name))
        .find(|p| p.exists());
    if found.is_none() {
        say(&format!("skipped: ../shared/{name} is not there"));
    }
    found
}

/// The reference cases of parallel robots, whole; `tests/data` has a few of them.
pub fn checks() -> Option<PathBuf> {
    let named = std::env::var_os("EXCITE_CHECKS").map(PathBuf::from);
    named.filter(|p| p.is_dir()).or_else(|| shared("checks"))
}

/// A line on standard error that is shown although the test passes: unlike `eprintln!`, what is written to the
/// stream itself is not captured.
fn say(what: &str) {
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("a test");
    let _ = std::io::stderr().write_all(format!("{test}: {what}\n").as_bytes());
}
