//! Python where it is there: `PYTHON` names the interpreter, `python3` otherwise.

use std::process::Command;

/// The interpreter if it has these modules (`"mujoco, numpy"`), or a word that it has not.
pub fn with(modules: &str) -> Option<String> {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let import = format!("import {modules}");
    let found = Command::new(&python).args(["-c", &import]).output();
    match found.is_ok_and(|o| o.status.success()) {
        true => Some(python),
        false => {
            println!("skipped: {python} has no {modules}");
            None
        }
    }
}
