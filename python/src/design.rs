//! Before the run: `design`, `assess`, trajectories.

use crate::call::{Interrupted, call, quick, simply};
use crate::error::{argument, to_python};
use crate::named::named;
use crate::plant::Plant;
use crate::report::Report;
use excite::cli::design::{check_rate, diagnostic, harmonics as usual_harmonics, periods, usual};
use excite::cli::pretty;
use excite::design::design_with;
use excite::design::parts::Control;
use excite::design::parts::{Condition, Progress, Question};
use excite::identifiability::{assess as assessed, json::json, page};
use excite::log::parts::Purpose;
use excite::simulate::effects::parse_payload;
use excite::trajectory::Trajectory;
use excite::trajectory::parts::Grid;
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// A trajectory from its JSON.
pub fn trajectory(text: &str) -> PyResult<Trajectory> {
    Trajectory::parse(text, "trajectory").map_err(|e| to_python(&e))
}

/// Motions of a diagnosis: name, purpose, words, trajectory.
type Motions = Vec<(String, bool, String, String)>;

/// Designs a trajectory. Gives the report, the trajectory, further motions, and the exception of a signal that ended it
/// early.
#[pyfunction]
#[allow(clippy::too_many_arguments, clippy::type_complexity)]
#[pyo3(signature = (plant, *, purpose, payload, harmonics, period, periods_, grid, diagnostic, ends, start, criterion, condition, derate, rate, seed, starts, time_limit, threads, spec, progress))]
pub fn design(
    py: Python<'_>,
    plant: &Plant,
    purpose: Option<String>,
    payload: Option<String>,
    harmonics: Option<usize>,
    period: Option<f64>,
    periods_: Option<u32>,
    grid: String,
    diagnostic: bool,
    ends: String,
    start: Option<Vec<f64>>,
    criterion: String,
    condition: Option<String>,
    derate: f64,
    rate: f64,
    seed: u64,
    starts: Option<usize>,
    time_limit: Option<f64>,
    threads: usize,
    spec: String,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<(Report, String, Motions, String, Option<Py<PyAny>>)> {
    let core = plant.core.clone();
    let condition = condition.map(|c| named("condition", &c)).transpose()?;
    let question: Option<Question> = purpose.map(|p| named("purpose", &p)).transpose()?;
    // of a question period, harmonics, criterion and condition are its own
    let mut settings = usual(question, payload.as_deref()).map_err(|e| to_python(&e))?;
    settings.period = period.unwrap_or(settings.period);
    if question.is_none() || periods_.is_some() {
        settings.periods = periods(periods_, diagnostic).map_err(|e| to_python(&e))?;
    }
    settings.grid = match diagnostic {
        true => Grid::Odd,
        false => named("grid", &grid)?,
    };
    settings.ends = named("ends", &ends)?;
    settings.start = start;
    if question.is_none() {
        settings.criterion = named("criterion", &criterion)?;
        settings.condition = condition.unwrap_or(Condition::usual(&core));
        settings.harmonics = usual_harmonics(settings.criterion, diagnostic);
    }
    settings.harmonics = harmonics.unwrap_or(settings.harmonics);
    settings.question = question;
    settings.derate = derate;
    settings.seed = seed;
    settings.starts = starts;
    settings.time_limit = time_limit;
    settings.threads = threads;
    let work = move |reporter: &crate::call::Reporter| {
        let begin = Instant::now();
        settings.check(core.moved())?;
        if let Some(question) = settings.question {
            question.check(&core)?;
        }
        check_rate(rate, &settings)?;
        let tell = |p: Progress| {
            let (most, seconds) = settings.budget();
            let (done, of) = match most {
                usize::MAX => (p.seconds.min(seconds), seconds),
                n => (p.starts as f64, n as f64),
            };
            reporter.note(done, of, format!("{} starts, best {:.4}", p.starts, p.best));
        };
        let control = Control {
            cancel: reporter.flag(),
            progress: &tell,
        };
        let result = design_with(&core, &settings, &control)?;
        let plant = result.plant;
        let assessment = assessed(&plant, Some(&result.trajectory))?;
        let set = match diagnostic {
            true => diagnostic::Set::new(&plant, &result.trajectory, &settings)?,
            false => diagnostic::Set::default(),
        };
        let seconds = begin.elapsed().as_secs_f64();
        let mut value = json(&assessment, Some(&result.record), seconds);
        let mut experiment = String::new();
        if diagnostic {
            value["motions"] = set.json();
            experiment = set.experiment(plant.name(), &spec);
        }
        let motions = (set.motions().skip(1))
            .map(|m| {
                let holdout = m.purpose == Purpose::Holdout;
                let text = m.trajectory.to_json()?;
                Ok((m.name.to_string(), holdout, m.about.to_string(), text))
            })
            .collect::<excite::Result<Motions>>()?;
        let text = result.trajectory.to_json()?;
        let warnings = assessment.warnings.clone();
        let record = result.record;
        let report = Report {
            json: pretty(&value),
            warnings,
            files: Vec::new(),
            page: Arc::new(move || page::html(&assessment, Some(&record))),
            scene: None,
        };
        Ok((report, text, motions, experiment))
    };
    let ((report, text, motions, experiment), signal) =
        call(py, progress.as_ref(), Interrupted::Waits, work)?;
    let signal = signal.map(|e| e.into_value(py).into_any());
    Ok((report, text, motions, experiment, signal))
}

/// What a robot, and a trajectory on it, can identify.
#[pyfunction]
pub fn assess(
    py: Python<'_>,
    plant: &Plant,
    text: Option<String>,
    payload: Option<String>,
) -> PyResult<Report> {
    let core = plant.core.clone();
    let payload = payload
        .map(|p| parse_payload(&p))
        .transpose()
        .map_err(|e| to_python(&e))?;
    let motion = text.as_deref().map(trajectory).transpose()?;
    simply(py, move |_| {
        let begin = Instant::now();
        let mut plant = (*core).clone();
        if let Some(t) = &motion {
            let about = |e: excite::Error| match e {
                excite::Error::Argument(m) => excite::Error::file("trajectory", "", m),
                other => other,
            };
            plant = plant.in_space(t.space).map_err(about)?;
            t.matches(plant.moved()).map_err(about)?;
        }
        let mut assessment = assessed(&plant, motion.as_ref())?;
        if let (Some(load), Some(t)) = (&payload, &motion) {
            assessment = assessment.with_load(&plant, t, load, true)?;
        }
        let value = json(&assessment, None, begin.elapsed().as_secs_f64());
        Ok(Report {
            json: pretty(&value),
            warnings: assessment.warnings.clone(),
            files: Vec::new(),
            page: Arc::new(move || page::html(&assessment, None)),
            scene: None,
        })
    })
}

/// Checks a `trajectory.json` and gives it as the program writes it.
#[pyfunction]
pub fn check_trajectory(text: &str, name: &str) -> PyResult<String> {
    let t = Trajectory::parse(text, name).map_err(|e| to_python(&e))?;
    t.to_json().map_err(|e| to_python(&e))
}

/// Positions, velocities and accelerations at times, coordinate-major.
#[pyfunction]
pub fn sample<'py>(
    py: Python<'py>,
    text: &str,
    t: numpy::PyReadonlyArray1<'py, f64>,
) -> PyResult<[Bound<'py, PyArray1<f64>>; 3]> {
    let fourier = trajectory(text)?.fourier;
    let times = t.as_array().to_vec();
    if times.iter().any(|t| !t.is_finite()) {
        return Err(argument("t holds a number that is not finite"));
    }
    let lists = quick(py, move || {
        let (dof, count) = (fourier.dof(), times.len());
        let mut all = [(); 3].map(|()| vec![0.0; dof * count]);
        let mut state = [(); 3].map(|()| vec![0.0; dof]);
        for (k, &t) in times.iter().enumerate() {
            let [q, dq, ddq] = &mut state;
            fourier.evaluate(t, [q, dq, ddq]);
            for (to, from) in all.iter_mut().zip(&state) {
                for (c, v) in from.iter().enumerate() {
                    to[c * count + k] = *v;
                }
            }
        }
        Ok(all)
    })?;
    Ok(lists.map(|v| v.into_pyarray(py)))
}

/// Writes `samples.csv`.
#[pyfunction]
pub fn write_samples(
    py: Python<'_>,
    plant: &Plant,
    text: &str,
    path: PathBuf,
    rate: f64,
    force: bool,
) -> PyResult<()> {
    let motion = trajectory(text)?;
    let core = plant.core.clone();
    simply(py, move |_| {
        let plant = (*core).clone().in_space(motion.space)?;
        excite::cli::design::samples(&plant, &motion, &path, force, rate)
    })
}
