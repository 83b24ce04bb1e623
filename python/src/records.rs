//! What was recorded: `Experiment`, from files or from arrays.

use crate::call::simply;
use crate::error::notices;
use crate::plant::Plant;
use excite::log::parts::{Payload, Purpose};
use excite::log::{self, Record, Table};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::Arc;

/// A robot and its records.
#[pyclass(frozen, module = "excite._excite")]
pub struct Experiment {
    pub core: Arc<log::Experiment>,
}

/// A record as Python hands it over.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Given<'py> {
    name: String,
    names: Vec<String>,
    columns: Vec<PyReadonlyArray1<'py, f64>>,
    holdout: bool,
    period: Option<f64>,
    part: [Option<f64>; 2],
    payload: Option<Body>,
}

/// A payload: unknown without a mass.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Body {
    mass: Option<f64>,
    com: Option<[f64; 3]>,
    inertia: Option<[f64; 6]>,
}

impl Body {
    fn payload(&self) -> Payload {
        match self.mass {
            None => Payload::Unknown,
            Some(mass) => Payload::Known {
                mass,
                com: self.com,
                inertia: self.inertia,
            },
        }
    }
}

struct Owned {
    name: String,
    table: Table,
    purpose: Purpose,
    period: Option<f64>,
    part: [Option<f64>; 2],
    payload: Payload,
}

fn purpose(holdout: bool) -> Purpose {
    match holdout {
        true => Purpose::Holdout,
        false => Purpose::Fit,
    }
}

impl Experiment {
    /// The experiment with forces where it has chamber pressures; nothing is copied where it has none.
    ///
    /// # Errors
    /// As [`log::Experiment::press`].
    pub fn pressed(
        core: Arc<log::Experiment>,
        atmosphere: f64,
    ) -> excite::Result<Arc<log::Experiment>> {
        if core.records.iter().all(|r| r.pressures.is_none()) {
            return Ok(core);
        }
        let mut own = log::Experiment {
            path: core.path.clone(),
            spec: core.spec.clone(),
            plant: core.plant.clone(),
            records: core.records.clone(),
        };
        own.press(atmosphere)?;
        Ok(Arc::new(own))
    }
}

#[pymethods]
impl Experiment {
    /// Reads an `experiment.toml`.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let core = simply(py, move |_| log::Experiment::read(&path))?;
        Ok(Experiment {
            core: Arc::new(core),
        })
    }

    /// From arrays, which are copied.
    #[staticmethod]
    fn of(py: Python<'_>, plant: &Plant, records: Vec<Given<'_>>) -> PyResult<Self> {
        let given: Vec<Owned> = records
            .into_iter()
            .map(|r| Owned {
                table: Table {
                    names: r.names,
                    columns: r.columns.iter().map(|c| c.as_array().to_vec()).collect(),
                    ..Table::default()
                },
                name: r.name,
                purpose: purpose(r.holdout),
                period: r.period,
                part: r.part,
                payload: r.payload.map_or(Payload::None, |b| b.payload()),
            })
            .collect();
        let plant = plant.core.clone();
        let core = simply(py, move |_| {
            let records = given.into_iter().map(|g| {
                let mut record =
                    Record::from_table(&g.name, g.table, &plant, g.purpose, g.period, g.part)?;
                record.payload = g.payload;
                Ok(record)
            });
            Ok(log::Experiment {
                path: "experiment".into(),
                spec: plant.name().into(),
                records: records.collect::<excite::Result<_>>()?,
                plant: (*plant).clone(),
            })
        })?;
        Ok(Experiment {
            core: Arc::new(core),
        })
    }

    /// The robot.
    fn plant(&self) -> Plant {
        self.core.plant.clone().into()
    }

    fn warnings(&self) -> Vec<(&'static str, String, String)> {
        notices(&self.core.warnings())
    }

    /// The records as they are used: on an even grid, repaired. Channels are lists of one array an actuator.
    fn records<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        self.core.records.iter().map(|r| channels(py, r)).collect()
    }
}

fn channels<'py>(py: Python<'py>, r: &Record) -> PyResult<Bound<'py, PyDict>> {
    let list = |columns: &[Vec<f64>]| -> Vec<Bound<'py, PyArray1<f64>>> {
        let one = |c: &Vec<f64>| c.clone().into_pyarray(py);
        columns.iter().map(one).collect()
    };
    let d = PyDict::new(py);
    d.set_item("name", &r.name)?;
    d.set_item("holdout", r.purpose == Purpose::Holdout)?;
    d.set_item("period", r.period)?;
    d.set_item("t", r.t.clone().into_pyarray(py))?;
    d.set_item("q", list(&r.q))?;
    d.set_item("tau", list(&r.tau))?;
    for (name, columns) in [
        ("dq", &r.dq),
        ("ddq", &r.ddq),
        ("qref", &r.qref),
        ("ql", &r.ql),
        ("pose", &r.pose),
    ] {
        if let Some(columns) = columns {
            d.set_item(name, list(columns))?;
        }
    }
    if let Some([a, b]) = &r.pressures {
        d.set_item("pa", list(a))?;
        d.set_item("pb", list(b))?;
    }
    let payload = PyDict::new(py);
    match r.payload {
        Payload::None => {}
        Payload::Unknown => d.set_item("payload", "unknown")?,
        Payload::Known { mass, com, inertia } => {
            payload.set_item("mass", mass)?;
            payload.set_item("com", com)?;
            payload.set_item("inertia", inertia)?;
            d.set_item("payload", payload)?;
        }
    }
    Ok(d)
}
