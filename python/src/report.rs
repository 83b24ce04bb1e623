//! What every stage gives: a report for machines, one for people, files, warnings.

use crate::call::simply;
use crate::error::{notices, to_python};
use excite::Warning;
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;

/// The result of a stage.
#[pyclass(frozen, module = "excite._excite")]
pub struct Report {
    pub json: String,
    pub warnings: Vec<Warning>,
    /// names and texts of the files beside the reports
    pub files: Vec<(String, String)>,
    /// the page; made when it is asked for
    pub page: Arc<dyn Fn() -> String + Send + Sync>,
}

#[pymethods]
impl Report {
    /// The JSON that the program writes.
    #[getter]
    fn json(&self) -> &str {
        &self.json
    }

    #[getter]
    fn warnings(&self) -> Vec<(&'static str, String, String)> {
        notices(&self.warnings)
    }

    #[getter]
    fn files(&self) -> Vec<(String, String)> {
        self.files.clone()
    }

    fn html(&self, py: Python<'_>) -> PyResult<String> {
        let page = self.page.clone();
        simply(py, move |_| Ok(page()))
    }
}

/// Writes files into a folder: nothing is replaced without `force`, and what an earlier run left under the names `absent`
/// goes with it.
#[pyfunction]
pub fn save(
    folder: PathBuf,
    files: Vec<(String, Vec<u8>)>,
    absent: Vec<String>,
    force: bool,
) -> PyResult<Vec<PathBuf>> {
    let names: Vec<&str> = (files.iter().map(|f| f.0.as_str()))
        .chain(absent.iter().map(String::as_str))
        .collect();
    let work = || -> excite::Result<Vec<PathBuf>> {
        let paths = excite::output::prepare_dir(&folder, &names, force)?;
        for (path, (_, bytes)) in paths.iter().zip(&files) {
            excite::output::write_atomic(path, force, |w| w.write_all(bytes))?;
        }
        for path in paths.iter().skip(files.len()) {
            if force && path.is_file() {
                std::fs::remove_file(path).map_err(|e| excite::Error::io(path, e))?;
            }
        }
        Ok(paths.into_iter().take(files.len()).collect())
    };
    work().map_err(|e| to_python(&e))
}

/// A table as the program writes logs: numbers with the fewest digits that read back as the same number.
#[pyfunction]
pub fn table(
    py: Python<'_>,
    names: Vec<String>,
    columns: Vec<numpy::PyReadonlyArray1<'_, f64>>,
) -> PyResult<String> {
    let columns: Vec<Vec<f64>> = columns.iter().map(|c| c.as_array().to_vec()).collect();
    simply(py, move |_| {
        use std::fmt::Write as _;
        let rows = columns.iter().map(Vec::len).min().unwrap_or(0);
        let mut out = names.join(",");
        out.push('\n');
        for k in 0..rows {
            for (c, column) in columns.iter().enumerate() {
                let comma = if c == 0 { "" } else { "," };
                let _ = write!(out, "{comma}{}", column[k]);
            }
            out.push('\n');
        }
        Ok(out)
    })
}
