//! What every stage gives: a report for machines, one for people, files, warnings.

use crate::call::simply;
use crate::error::{notices, to_python};
use excite::export::parts::Edited;
use excite::export::parts::Model;
use excite::export::{Remark, into_scene};
use excite::robot::Robot;
use excite::{Error, Plant, Warning};
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The model of a result written into a file of the user, for a folder.
pub type Scene = Arc<dyn Fn(&Path, &Path) -> excite::Result<Edited> + Send + Sync>;

/// The [`Scene`] of a model: a robot of this plant, and what its bodies and joints cannot hold.
pub fn scene(plant: Plant, robot: Robot, remarks: Vec<Remark>) -> Option<Scene> {
    Some(Arc::new(move |scene, folder| {
        let model = Model {
            plant: &plant,
            robot: &robot,
            remarks: &remarks,
        };
        into_scene(&model, scene, folder)
    }))
}

/// The result of a stage.
#[pyclass(frozen, module = "excite._excite")]
pub struct Report {
    pub json: String,
    pub warnings: Vec<Warning>,
    /// names and texts of the files beside the reports
    pub files: Vec<(String, String)>,
    /// the page; made when it is asked for
    pub page: Arc<dyn Fn() -> String + Send + Sync>,
    /// of a result that is a model
    pub scene: Option<Scene>,
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

    /// The model in a copy of an MJCF or URDF: names and texts of the files, what changed as JSON, warnings.
    #[allow(clippy::type_complexity)]
    fn edited_scene(
        &self,
        py: Python<'_>,
        scene: PathBuf,
        folder: PathBuf,
    ) -> PyResult<(
        Vec<(String, String)>,
        String,
        Vec<(&'static str, String, String)>,
    )> {
        let write = self.scene.clone();
        let edited = simply(py, move |_| match &write {
            Some(write) => write(&scene, &folder),
            None => Err(Error::Argument(
                "the result is no model that a scene could hold".into(),
            )),
        })?;
        let mut files: Vec<(String, String)> = edited
            .files
            .iter()
            .map(|(name, text)| (name.display().to_string(), text.clone()))
            .collect();
        files.extend(
            edited
                .effects
                .clone()
                .map(|t| ("effects.py".to_string(), t)),
        );
        let json = serde_json::to_string(&edited).unwrap_or_default();
        Ok((files, json, notices(&edited.warnings)))
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
            if let Some(parent) = path.parent() {
                std::fs::create_dir_all(parent).map_err(|e| excite::Error::io(parent, e))?;
            }
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
