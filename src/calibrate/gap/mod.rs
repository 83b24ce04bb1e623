//! The gap in pose: which kinematic effect the robot file lacks.
//!
//! What `diagnose` does for torques, from the rows of a calibration. The rows are whitened and made linear about the
//! present explanation, the set-up (camera, target, sockets) is eliminated, and of all sets of effects at places the
//! one of largest evidence is looked for (`search`). What would explain the rows as well is a rival and lowers the
//! confidence; what no rival can take and what lowers the error of rows held out is a claim. Noise and strays are those
//! of a fit with everything in it.

mod catalogue;
mod conditions;
#[doc(hidden)]
pub mod json;
mod linear;
mod next;
#[doc(hidden)]
pub mod page;
mod problem;
mod search;
mod verdict;

pub use next::Next;
pub use verdict::{Finding, Found};

use super::bench::Bench;
use super::file::Calibration;
use super::fit::Plan;
use super::judge::{self, Errors, Stats};
use super::model::{Model, Settings};
use super::open::Opened;
use super::{apart, doubts, robust};
use crate::error::{Result, Warning, WarningKind};
use catalogue::Catalogue;
use conditions::Conditions;
use linear::Bed;

/// Largest share of fitted rows that are left out as strays.
const STRAY: f64 = 0.25;
/// Residuals for each unknown from which on they tell the noise.
const MANY: usize = 3;

/// What is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Ask {
    /// whether postures are looked for that tell rivals apart
    pub next: bool,
    /// seed of their draws
    pub seed: u64,
}

/// A row of the diagnosis.
#[derive(Debug, Clone)]
pub struct Line {
    /// index of its group
    pub group: usize,
    /// whether the effects were identified with it
    pub fit: bool,
    /// whether it does not belong to the others
    pub stray: bool,
    /// joint readings
    pub q: Vec<f64>,
    /// error with the robot of the file, and with the effects, m
    pub errors: [f64; 2],
}

/// The diagnosis of a calibration.
#[derive(Debug)]
pub struct PoseDiagnosis {
    /// name of the robot
    pub robot: String,
    /// frame that is measured
    pub frame: String,
    /// joints
    pub joints: Vec<String>,
    /// names of the groups
    pub groups: Vec<String>,
    /// what came out
    pub found: Found,
    /// rows
    pub lines: Vec<Line>,
    /// root mean square of the position's noise in a row, m
    pub noise: f64,
    /// where that is known from
    pub noise_from: &'static str,
    /// effects that these postures do not show
    pub untestable: Vec<(&'static str, String)>,
    /// postures that tell rivals apart
    pub next: Option<Next>,
    /// what was imperfect
    pub warnings: Vec<Warning>,
}

impl PoseDiagnosis {
    /// Errors of sound rows: fitted or held out, before or after.
    pub fn errors(&self, fit: bool, after: usize) -> Option<Stats> {
        let own = self.lines.iter().filter(|l| l.fit == fit && !l.stray);
        Stats::of(&own.map(|l| l.errors[after]).collect::<Vec<_>>())
    }
}

/// Diagnoses.
///
/// # Errors
/// As [`super::calibrate`].
pub fn diagnose(input: &Calibration, opened: &Opened, ask: Ask) -> Result<PoseDiagnosis> {
    let mut warnings = doubts::carried(input, opened);
    doubts::too_few(input)?;
    let settings = Settings::default();
    let sound = apart::sound(input, opened, settings, &mut warnings)?;
    let input = sound.as_ref();
    let bench = Bench::new(input, opened, settings, &mut warnings)?;
    let nominal = bench.model(Vec::new());
    let plan = bench.plan(&nominal);
    let x_before = robust::set_up(&nominal, &plan, &vec![0.0; nominal.count()])?;
    let before = judge::errors(&nominal, &x_before);
    doubts::suspicious(input, &before, &mut warnings);
    doubts::unmoved(input, &opened.joints, &mut warnings);
    let conditions = Conditions::of(input, opened, &bench);
    let tolerance = [input.prior.length, input.prior.angle];
    let mut catalogue = Catalogue::new(opened, &conditions, tolerance);
    let mut model = bench.model(catalogue.features.clone());
    model.rates.clone_from(&catalogue.rates);
    catalogue.add_bases(input, model.count());
    let x = robust::extend(&nominal, &model, &x_before);
    let (noise, weights) = everything(input, opened, &catalogue, &model, &plan, &x)?;
    model.noise = noise;
    let mut bed = Bed::new(model, weights, &catalogue, tolerance, x);
    let found = verdict::found(&mut bed, input.noise_stated, &mut warnings)?;
    let after = judge::errors(&bed.model, &found.x);
    let spread = spread(&bed.model, &bed.weights, input.noise_stated);
    let next = match ask.next {
        true => next::next(opened, &bed, &found, bench.gravity.as_ref(), ask.seed)?,
        false => None,
    };
    if !input.noise_stated {
        warnings.push(Warning::new(
            WarningKind::NotIdentifiable,
            "noise",
            "no noise is stated; it is what all effects together leave. An effect that the catalogue lacks looks like \
             noise then. State std",
        ));
    }
    Ok(PoseDiagnosis {
        robot: opened.plant.name().to_string(),
        frame: opened.frame.clone(),
        joints: opened.joints.clone(),
        groups: input.groups().iter().map(|g| g.to_string()).collect(),
        lines: lines(&bed, [&before, &after]),
        noise: spread,
        noise_from: match input.noise_stated {
            true => "stated",
            false => "what all effects together leave",
        },
        untestable: bed.untestable()?,
        found,
        next,
        warnings,
    })
}

/// Noise and rows that belong, from a fit with all dimensions and effects, each group with a base of its own.
fn everything(
    input: &Calibration,
    opened: &Opened,
    catalogue: &Catalogue,
    model: &Model,
    plan: &Plan,
    x: &[f64],
) -> Result<(f64, Vec<f64>)> {
    let fit = |mut full: Model, x: &[f64]| -> Result<(f64, Vec<f64>)> {
        let mut plan = plan.clone();
        plan.free = robust::seen(&full, &plan);
        let wanted = plan.weights.clone();
        robust::robustly(&mut full, &mut plan, x)?;
        let (kept, all): (f64, f64) = (plan.weights.iter().sum(), wanted.iter().sum());
        // so many do not stray: they are what is not explained
        let rows = if kept < (1.0 - STRAY) * all {
            wanted
        } else {
            plan.weights
        };
        Ok((full.noise, rows))
    };
    let mut apart = input.clone();
    if !catalogue.bases.is_empty() {
        for m in &mut apart.measurements {
            m.instrument = format!("{} of {}", m.instrument, m.group);
        }
    }
    // with many rows what is left says more of the noise than what is stated
    let rows = input.rows.iter().enumerate().filter(|(_, r)| r.fit);
    let residuals: usize = rows.map(|(i, _)| model.residuals(i)).sum();
    apart.noise_stated &= residuals < MANY * model.count();
    let Ok(bench) = Bench::new(&apart, opened, model.settings, &mut Vec::new()) else {
        return fit(model.clone(), x);
    };
    let mut full = bench.model(catalogue.features.clone());
    full.rates.clone_from(&catalogue.rates);
    let zeros = vec![0.0; full.count()];
    fit(full, &zeros)
}

/// Root mean square of the position's noise in the fitted rows, m.
fn spread(model: &Model, weights: &[f64], stated: bool) -> f64 {
    let factor = if stated { 1.0 } else { model.noise };
    let each = (0..weights.len()).filter(|&i| weights[i] > 0.0).map(|i| {
        let row = &model.input.rows[i];
        let m = &model.input.measurements[row.measurement];
        match row.covariance {
            Some(c) => c[(0, 0)] + c[(1, 1)] + c[(2, 2)],
            None if m.kind.is_line() => m.std[0].powi(2),
            None => 3.0 * m.std[0].powi(2),
        }
    });
    let all: Vec<f64> = each.collect();
    factor * (all.iter().sum::<f64>() / all.len().max(1) as f64).sqrt()
}

fn lines(bed: &Bed, [before, after]: [&Errors; 2]) -> Vec<Line> {
    let input = bed.model.input;
    let (_, strays) = judge::strays(&bed.model, after);
    let each = |(i, r): (usize, &super::row::Row)| Line {
        group: input.group_of(r),
        fit: r.fit,
        stray: if r.fit {
            !(bed.weights[i] > 0.0)
        } else {
            strays.contains(&i)
        },
        q: r.q.clone(),
        errors: [before.distance[i], after.distance[i]],
    };
    input.rows.iter().enumerate().map(each).collect()
}
