//! `condense` and `merge`.

use crate::call::simply;
use crate::error::{notices, to_python};
use crate::named::named;
use crate::plant::Plant;
use crate::records::Experiment;
use crate::report::{Report, scene};
use crate::verbs::texts;
use excite::cli::{identify as terms, pretty, unwritten};
use excite::export::parts::Model;
use excite::export::write;
use excite::identify::{self as identification, Factor};
use excite::signals;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::path::Path;
use std::sync::Arc;

/// What errors call a factor from memory.
const NAME: &str = "factor";

/// Kind, subject and text of each.
type Notices = Vec<(&'static str, String, String)>;

/// Condenses the records of an experiment: the bytes of a file, and warnings.
#[pyfunction]
#[pyo3(signature = (experiment, *, cutoff, average, derive, identify, atmosphere))]
pub fn condense<'py>(
    py: Python<'py>,
    experiment: &Experiment,
    cutoff: Option<f64>,
    average: bool,
    derive: bool,
    identify: Option<Vec<String>>,
    atmosphere: f64,
) -> PyResult<(Bound<'py, PyBytes>, Notices)> {
    let core = experiment.core.clone();
    let mut settings = identification::Settings::default();
    settings.signals = signals::Settings::default().with(|set| {
        set.cutoff = cutoff;
        set.average = average;
        set.measured_rates = !derive;
    });
    let (bytes, warnings) = simply(py, move |_| {
        let core = Experiment::pressed(core, atmosphere)?;
        let mut notes = excite::survey::check(&core.plant, &core.records)?;
        let plant = terms::columns(core.plant.clone(), identify.as_deref(), &mut notes)?;
        let mut factor = identification::condense(
            &plant,
            &core.spec,
            identify.as_deref(),
            &core.records,
            &settings,
        )?;
        factor.header.warnings.splice(0..0, notes);
        let warnings = factor.header.warnings.clone();
        Ok((factor.to_bytes()?, warnings))
    })?;
    Ok((PyBytes::new(py, &bytes), notices(&warnings)))
}

/// The header of a factor, JSON.
#[pyfunction]
pub fn header(factor: &[u8]) -> PyResult<String> {
    let read = Factor::from_bytes(factor, Path::new(NAME)).map_err(|e| to_python(&e))?;
    Ok(serde_json::to_string(&read.header).unwrap_or_default())
}

/// Identifies from condensed records.
#[pyfunction]
#[pyo3(signature = (plant, factors, *, method, consistency, prior, identify))]
pub fn merge(
    py: Python<'_>,
    plant: &Plant,
    factors: Vec<Vec<u8>>,
    method: String,
    consistency: String,
    prior: Option<f64>,
    identify: Option<Vec<String>>,
) -> PyResult<Report> {
    let core = plant.core.clone();
    let mut settings = identification::Settings::default();
    settings.method = named("method", &method)?;
    settings.consistency = named("consistency", &consistency)?;
    settings.prior_strength = prior;
    simply(py, move |_| {
        // said when the records were condensed
        let mut said = Vec::new();
        let plant = terms::columns((*core).clone(), identify.as_deref(), &mut said)?;
        let read = |b: &Vec<u8>| Factor::from_bytes(b, Path::new(NAME));
        let factors = factors.iter().map(read).collect::<excite::Result<_>>()?;
        let mut found = identification::merge(&plant, factors, &settings)?;
        let robot = found.robot(&plant);
        let model = Model {
            plant: &plant,
            robot: &robot,
            remarks: &[],
        };
        let robots = write(&model);
        found.warnings.extend(model.warnings());
        found.warnings.extend(unwritten(&robots, "merged.json"));
        Ok(Report {
            json: pretty(&found.json(&plant)),
            warnings: found.warnings.clone(),
            files: texts(robots),
            page: {
                let plant = plant.clone();
                Arc::new(move || found.html(&plant))
            },
            scene: scene(plant, robot, Vec::new()),
        })
    })
}
