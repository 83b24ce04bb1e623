//! Settings by their names.

use crate::error::argument;
use pyo3::prelude::*;
use serde::de::DeserializeOwned;

/// A value by its name in the settings.
pub fn named<T: DeserializeOwned>(what: &str, text: &str) -> PyResult<T> {
    serde_json::from_value(serde_json::Value::String(text.into()))
        .map_err(|e| argument(format!("{what}: {e}")))
}
