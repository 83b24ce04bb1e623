//! After the run: `identify`, `load`, `diagnose`, `calibrate`, and `export`.

use crate::call::{Interrupted, Reporter, call, simply};
use crate::design::trajectory;
use crate::error::notices;
use crate::named::named;
use crate::plant::Plant;
use crate::records::Experiment;
use crate::report::{Report, scene};
use excite::calibrate::gap;
use excite::calibrate::parts::Algorithm;
use excite::cli::{export as program, identify as terms, pretty, unwritten};
use excite::controller::{Column, Course, FORMATS, Leg, Options, Playback, Unit, format};
use excite::diagnose::parts::{MOST, Posterior, TABLE};
use excite::export::parts::Model;
use excite::export::write;
use excite::{Error, Result, calibrate as calibration, diagnose as diagnosis};
use excite::{identify as identification, load as payload, signals};
use numpy::{IntoPyArray, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// Files of a model that can be written.
pub fn texts(all: Vec<(&'static str, Result<String>)>) -> Vec<(String, String)> {
    let written = all
        .into_iter()
        .filter_map(|(n, t)| Some((n.into(), t.ok()?)));
    written.collect()
}

/// Identifies the model.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
#[pyo3(signature = (experiment, *, method, consistency, prior, cutoff, position_cutoff, average, derive, identify, atmosphere))]
pub fn identify(
    py: Python<'_>,
    experiment: &Experiment,
    method: String,
    consistency: String,
    prior: Option<f64>,
    cutoff: Option<f64>,
    position_cutoff: Option<f64>,
    average: bool,
    derive: bool,
    identify: Option<Vec<String>>,
    atmosphere: f64,
) -> PyResult<Report> {
    let core = experiment.core.clone();
    let mut settings = identification::Settings::default();
    settings.method = named("method", &method)?;
    settings.consistency = named("consistency", &consistency)?;
    settings.prior_strength = prior;
    settings.signals = signals::Settings::default().with(|set| {
        set.cutoff = cutoff;
        set.position_cutoff = position_cutoff;
        set.average = average;
        set.measured_rates = !derive;
    });
    simply(py, move |_| {
        let begin = Instant::now();
        let core = Experiment::pressed(core, atmosphere)?;
        let mut notes = excite::survey::check(&core.plant, &core.records)?;
        let plant = terms::columns(core.plant.clone(), identify.as_deref(), &mut notes)?;
        let mut id = identification::identify(&plant, &core.records, &settings)?;
        id.warnings.splice(0..0, notes);
        let robot = id.robot(&plant);
        let model = Model {
            plant: &plant,
            robot: &robot,
            remarks: &[],
        };
        let robots = write(&model);
        id.warnings.extend(model.warnings());
        id.warnings.extend(unwritten(&robots, "model.json"));
        let (_, verdict) = identification::page::verdict(&plant, &id);
        let seconds = begin.elapsed().as_secs_f64();
        let report = identification::json::report(&plant, &id, &settings, &verdict, seconds);
        let own = pretty(&identification::json::model(&plant, &id));
        let mut files = vec![("model.json".to_string(), own)];
        files.extend(texts(robots));
        Ok(Report {
            json: pretty(&report),
            warnings: id.warnings.clone(),
            files,
            page: {
                let plant = plant.clone();
                Arc::new(move || identification::page::html(&plant, &id, &settings))
            },
            scene: scene(plant, robot, Vec::new()),
        })
    })
}

/// Identifies the load.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
#[pyo3(signature = (experiment, *, parameters, method, weighted, consistent, checked, standstill, atmosphere, position_cutoff, cutoff, flange))]
pub fn load(
    py: Python<'_>,
    experiment: &Experiment,
    parameters: String,
    method: String,
    weighted: bool,
    consistent: bool,
    checked: bool,
    standstill: Option<f64>,
    atmosphere: f64,
    position_cutoff: Option<f64>,
    cutoff: Option<f64>,
    flange: [f64; 6],
) -> PyResult<Report> {
    let core = experiment.core.clone();
    let mut settings = payload::Settings::default();
    settings.parameters = named("parameters", &parameters)?;
    settings.method = named("method", &method)?;
    settings.weighted = weighted;
    settings.consistent = consistent;
    settings.checked = checked;
    settings.standstill = standstill;
    settings.atmosphere = atmosphere;
    settings.flange = flange;
    settings.signals = signals::Settings::default().with(|set| {
        set.position_cutoff = position_cutoff;
        set.cutoff = cutoff;
    });
    simply(py, move |_| {
        let found = payload::identify(&core, &settings)?;
        let (load, flange) = (&found.load().inertia, &found.flange);
        // where a controller cannot hold the load, its file is not there
        let controllers = [
            (
                "endeffector-config.json",
                payload::controller::franka(load, flange).map(|v| pretty(&v)),
            ),
            (
                "set_target_payload.script",
                payload::controller::urscript(load, flange),
            ),
            ("load_data.dat", payload::controller::kuka(load, flange)),
        ];
        Ok(Report {
            json: pretty(&payload::json::json(&found)),
            warnings: found.warnings.clone(),
            files: texts(controllers.into()),
            page: Arc::new(move || payload::page::html(&found)),
            scene: None,
        })
    })
}

/// Diagnoses the gap.
#[pyfunction]
#[pyo3(signature = (experiment, *, next, next_tries, samples, seed, atmosphere, progress))]
#[allow(clippy::too_many_arguments)]
pub fn diagnose(
    py: Python<'_>,
    experiment: &Experiment,
    next: bool,
    next_tries: usize,
    samples: usize,
    seed: u64,
    atmosphere: f64,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Report> {
    if samples > MOST {
        return Err(crate::error::argument(format!(
            "samples: at most {MOST} robots are drawn, not {samples}"
        )));
    }
    let core = experiment.core.clone();
    let mut settings = diagnosis::Settings::default();
    settings.samples = samples;
    settings.next = next;
    settings.next_tries = next_tries.min(10_000);
    settings.seed = seed;
    let work = move |reporter: &Reporter| {
        let begin = Instant::now();
        let core = Experiment::pressed(core, atmosphere)?;
        let tell = |step: &str| reporter.tell(0.0, 0.0, step);
        let mut d = diagnosis::diagnose(&core, &settings, &tell)?;
        let model = Model {
            plant: &core.plant,
            robot: &d.improved.robot,
            remarks: &d.improved.remarks,
        };
        let robots = write(&model);
        let mut more = model.warnings();
        more.extend(unwritten(&robots, "diagnosis.json"));
        d.warnings.extend(more);
        let json = pretty(&diagnosis::json::json(&d, begin.elapsed().as_secs_f64()));
        let mut files = texts(robots);
        if let Some(p) = &d.posterior {
            files.push((TABLE.into(), p.csv()));
            for k in 0..p.samples.len() {
                let own = texts(p.files(&core.plant, k)).into_iter();
                files.extend(own.map(|(n, t)| (format!("{}/{n}", Posterior::folder(k)), t)));
            }
        }
        if let Some(n) = &d.next {
            files.push(("next.json".into(), n.trajectory.to_json()?));
        }
        Ok(Report {
            json,
            warnings: d.warnings.clone(),
            files,
            scene: scene(
                core.plant.clone(),
                d.improved.robot.clone(),
                d.improved.remarks.clone(),
            ),
            page: Arc::new(move || diagnosis::page::html(&d)),
        })
    };
    Ok(call(py, progress.as_ref(), Interrupted::Leaves, work)?.0)
}

/// Whether a file is a calibration and no experiment.
#[pyfunction]
pub fn is_calibration(path: PathBuf) -> bool {
    calibration::is_calibration(&path)
}

/// Diagnoses the gap in pose of a calibration.
#[pyfunction]
#[pyo3(signature = (path, *, next, seed))]
pub fn diagnose_poses(py: Python<'_>, path: PathBuf, next: bool, seed: u64) -> PyResult<Report> {
    simply(py, move |_| {
        let begin = Instant::now();
        let (input, opened) = calibration::read(&path)?;
        let found = gap::diagnose(&input, &opened, gap::Ask { next, seed })?;
        let json = pretty(&gap::json::json(&found, begin.elapsed().as_secs_f64()));
        let postures = found
            .next
            .as_ref()
            .map(|n| ("next.csv".to_string(), n.csv()));
        Ok(Report {
            json,
            warnings: found.warnings.clone(),
            files: postures.into_iter().collect(),
            page: Arc::new(move || gap::page::html(&found)),
            scene: None,
        })
    })
}

/// Calibrates the geometry.
#[pyfunction]
#[pyo3(signature = (path, *, algorithm, orientation))]
pub fn calibrate(
    py: Python<'_>,
    path: PathBuf,
    algorithm: String,
    orientation: bool,
) -> PyResult<Report> {
    let algorithm = match algorithm.as_str() {
        "inverse" => Algorithm::Inverse,
        "implicit" => Algorithm::Implicit,
        "forward" => Algorithm::Forward,
        other => {
            return Err(crate::error::argument(format!(
                "algorithm is \"inverse\", \"implicit\" or \"forward\", not `{other}`"
            )));
        }
    };
    let mut settings = calibration::Settings::default();
    settings.algorithm = algorithm;
    settings.orientation = orientation;
    simply(py, move |_| {
        let (input, opened) = calibration::read(&path)?;
        let found = calibration::calibrate(&input, &opened, settings)?;
        let own = found.files.iter();
        Ok(Report {
            json: pretty(&calibration::json::json(&found)),
            warnings: found.warnings.clone(),
            files: own.map(|(n, t)| (n.to_string(), t.clone())).collect(),
            page: Arc::new(move || calibration::page::html(&found)),
            scene: None,
        })
    })
}

/// A move as columns `t`, `q1`…, `dq1`…, `ddq1`… of a CSV file.
fn leg(file: Option<PathBuf>, course: &Course, speed: f64) -> Result<Option<Leg>> {
    let read = |f: PathBuf| Ok(Leg::read(f, course.joints().len())?.at_speed(speed));
    file.map(read).transpose()
}

/// Writes a trajectory for a controller: bytes, a second file, and what is said of it.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
#[pyo3(signature = (text, name, plant, *, rate, periods, speed, approach, retreat, joints, columns, units, move_to_start))]
pub fn export<'py>(
    py: Python<'py>,
    text: &str,
    name: String,
    plant: Option<&Plant>,
    rate: Option<f64>,
    periods: Option<u32>,
    speed: f64,
    approach: Option<PathBuf>,
    retreat: Option<PathBuf>,
    joints: Option<Vec<String>>,
    columns: Option<Vec<String>>,
    units: Vec<String>,
    move_to_start: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let motion = trajectory(text)?;
    let core = plant.map(|p| (*p.core).clone());
    let (bytes, beside, said, warnings, card) = simply(py, move |_| {
        let format = format(&name)?;
        let columns = columns.map(|all| all.iter().map(|n| Column::parse(n)).collect());
        let options = Options {
            rate,
            joints,
            columns: columns.transpose()?,
            units: units
                .iter()
                .map(|u| Unit::parse(u))
                .collect::<Result<_>>()?,
            move_to_start,
        };
        let about = |e: Error| match e {
            Error::Infeasible(message) => Error::file("trajectory", "", message),
            other => other,
        };
        let (plant, mut warnings) = program::robot_of(core, &motion, "trajectory".as_ref())?;
        let periods = periods.unwrap_or(motion.periods);
        let mut course = Course::new(&motion, plant.as_ref(), periods, speed).map_err(about)?;
        if let Some(first) = leg(approach, &course, speed)? {
            course = course.after(first)?;
        }
        if let Some(last) = leg(retreat, &course, speed)? {
            course = course.before(last)?;
        }
        let playback = Playback::new(&course, format, &options).map_err(about)?;
        warnings.extend(playback.warnings.iter().cloned());
        let bytes = format.write(&playback).map_err(about)?;
        let card = format.card();
        let said = program::summary(&playback, &card);
        let beside = format.beside(&playback);
        Ok((bytes, beside, said, warnings, card))
    })?;
    let d = PyDict::new(py);
    d.set_item("data", pyo3::types::PyBytes::new(py, &bytes))?;
    d.set_item("beside", beside)?;
    d.set_item("summary", said)?;
    d.set_item("warnings", notices(&warnings))?;
    d.set_item("name", card.name)?;
    d.set_item("extension", card.extension)?;
    Ok(d)
}

/// Formats of controllers: name and what it is.
#[pyfunction]
pub fn formats() -> Vec<(&'static str, &'static str)> {
    let cards = FORMATS.iter().map(|f| f.card());
    cards.map(|c| (c.name, c.about)).collect()
}

/// The records as the diagnosis sees them: what a simulator needs to be compared with them. Of a parallel robot also the
/// motion of its coordinates and of all joints of its tree, and `rates`, entry `(x·actuators + a)·count + s`: by how much
/// coordinate `x` moves with actuator `a`.
#[pyfunction]
pub fn series<'py>(py: Python<'py>, experiment: &Experiment) -> PyResult<Bound<'py, PyDict>> {
    let core = experiment.core.clone();
    let (all, noise) = simply(py, move |_| {
        let data = diagnosis::prepare(&core.plant, &core.records)?;
        let noise: Vec<f64> = data.noise.iter().map(|n| n.std).collect();
        let mut all = Vec::new();
        for r in data.records {
            let loops = core.plant.mechanism();
            let motion = loops.map(|m| m.motion(&r.x)).transpose()?;
            all.push((r, motion));
        }
        Ok((all, noise))
    })?;
    let out = PyDict::new(py);
    let mut records = Vec::new();
    for (r, motion) in all {
        let d = PyDict::new(py);
        d.set_item("name", r.name)?;
        d.set_item("holdout", !r.fit)?;
        d.set_item("order", r.order)?;
        d.set_item("dt", r.dt)?;
        d.set_item("referenced", r.reference.is_some())?;
        d.set_item("measured", r.measured)?;
        for (name, values) in [
            ("q", r.actuators.q),
            ("dq", r.actuators.qd),
            ("ddq", r.actuators.qdd),
            ("tau", r.tau),
        ] {
            d.set_item(name, values.into_pyarray(py))?;
        }
        if let Some(motion) = motion {
            for (name, values) in [
                ("x", r.x.q),
                ("tree_q", motion.tree.q),
                ("tree_dq", motion.tree.qd),
                ("tree_ddq", motion.tree.qdd),
                ("rates", motion.a),
            ] {
                d.set_item(name, values.into_pyarray(py))?;
            }
        }
        records.push(d);
    }
    out.set_item("records", records)?;
    out.set_item("noise", noise)?;
    Ok(out)
}

/// Energies of the gap to models whose torques are given (actuator-major over the rows of all records): by model, record
/// and actuator, in units of the noise variance.
#[pyfunction]
pub fn energies(
    py: Python<'_>,
    experiment: &Experiment,
    models: Vec<PyReadonlyArray1<'_, f64>>,
) -> PyResult<Vec<Vec<Vec<f64>>>> {
    let core = experiment.core.clone();
    let models: Vec<Vec<f64>> = models.iter().map(|m| m.as_array().to_vec()).collect();
    simply(py, move |_| {
        let data = diagnosis::prepare(&core.plant, &core.records)?;
        let (rows, joints) = (data.rows(), data.joints());
        if let Some(wrong) = models.iter().find(|m| m.len() != rows * joints) {
            return Err(Error::Argument(format!(
                "the torques of a model are {} numbers for {joints} joints and {rows} samples",
                wrong.len()
            )));
        }
        let of = |m: &Vec<f64>| {
            let torque: Vec<Vec<f64>> = m.chunks(rows.max(1)).map(<[f64]>::to_vec).collect();
            diagnosis::outside::energies(&data, &torque)
        };
        Ok(models.iter().map(of).collect())
    })
}
