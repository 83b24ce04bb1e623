//! Errors and warnings on their way to Python.

use excite::Warning;
use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

create_exception!(
    excite,
    Error,
    PyException,
    "What could not be done, and why. The text is that of the program; ``kind`` is one of ``\"argument\"``, ``\"file\"``, ``\"io\"``, ``\"infeasible\"``, ``\"exists\"`` and ``\"internal\"``."
);

fn make(kind: &str, text: String) -> PyErr {
    Python::attach(|py| {
        let error = Error::new_err(text);
        // an exception has a dictionary of its own
        let _ = error.value(py).setattr("kind", kind);
        error
    })
}

/// The exception of an error of the library.
pub fn to_python(error: &excite::Error) -> PyErr {
    let kind = match error {
        excite::Error::Io { .. } => "io",
        excite::Error::File { .. } => "file",
        excite::Error::Argument(_) => "argument",
        excite::Error::Exists(_) => "exists",
        _ => "infeasible",
    };
    make(kind, error.to_string())
}

/// An argument that cannot be.
pub fn argument(text: impl Into<String>) -> PyErr {
    make("argument", text.into())
}

/// A mistake of ours.
pub fn internal(text: &str) -> PyErr {
    make(
        "internal",
        format!("internal error: {text}; please report it with what led to it"),
    )
}

/// Code, subject and message of each warning.
pub fn notices(warnings: &[Warning]) -> Vec<(&'static str, String, String)> {
    let one = |w: &Warning| (w.kind.code(), w.subject.clone(), w.message.clone());
    warnings.iter().map(one).collect()
}
