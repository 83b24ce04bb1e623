//! Diagnosis of the gap between a model and its robot: where it lies, which effect causes it, and how
//! far it shrinks once that effect is added.
//!
//! ```text
//! τ = W (φ₀ + δ) + Σ_e Z_e(shape) η_e + noise        δ ~ N(0, P)
//! ```
//!
//! | step | module | what it gives |
//! |---|---|---|
//! | records | `Series`, `noise`, `window` | motion and derivatives, noise floor, whitening |
//! | prior | `prior`, `closeness` | how far a model may be off, how close an identified one is |
//! | loads | `payload` | what the robot carried: known, unknown or nothing |
//! | nominal | `data`, `rigid`, [`evidence`] | what the nominal model absorbs, at the price of its prior |
//! | effects | [`catalogue`] | columns of every effect at every place |
//! | search | `search`, `verdict` | sets of effects, rivals, confidence |
//! | constants | [`thresholds`] | what the verdict rests on, with units and origin |
//! | intervals | `interval` | how sure the share is that an effect explains |
//! | gap | `gap` | residuals against noise: joints, odd, even, non-periodic |
//! | simulation | `forward`, [`controller`] | the robot simulated under the same commands, before and after |
//! | next | [`next`] | the motion that tells rivals apart |
//! | output | `finding`, `result`, `traces`, [`json`], [`page`], `improve` | `diagnosis.json`, report, improved robot |
//!
//! The method with its equations is in `docs/diagnosis-method.md`.

#[doc(hidden)]
pub mod catalogue;
pub(crate) mod closeness;
pub(crate) mod column;
#[doc(hidden)]
pub mod controller;
pub(crate) mod data;
pub(crate) mod decoy;
#[doc(hidden)]
pub mod evidence;
pub(crate) mod finding;
pub(crate) mod forward;
pub(crate) mod gap;
pub(crate) mod improve;
pub(crate) mod interval;
#[doc(hidden)]
pub mod json;
#[doc(hidden)]
pub mod next;
pub(crate) mod noise;
mod noise_floor;
#[doc(hidden)]
pub mod page;
pub(crate) mod payload;
pub(crate) mod prior;
pub(crate) mod result;
mod reversal;
pub(crate) mod rigid;
pub(crate) mod search;
pub(crate) mod settings;
#[doc(hidden)]
pub mod thresholds;
pub(crate) mod traces;
pub(crate) mod verdict;
pub(crate) mod window;

pub use catalogue::{Place, Shape, Value};
pub use finding::Finding;
pub use gap::JointGap;
pub use improve::Improved;
pub use next::Proposal;
pub use result::{Diagnosis, RecordGap};
pub use settings::Settings;
#[doc(hidden)]
pub use traces::Trace;
pub use verdict::Verdict;

use self::thresholds::THRESHOLDS as T;
use crate::error::{Error, Result};
use crate::log::{self, Experiment, Purpose};
use crate::plant::Plant;
use crate::signals::series::Series;
use catalogue::Context;
use data::Data;
use evidence::Evidence;
use rayon::prelude::*;

#[doc(hidden)]
/// Records ready for the diagnosis: noise, window of the torque channel, ordinary imperfections.
///
/// # Errors
/// No record to fit to, records that are too short or hold too few sound samples, a payload that cannot be
/// honoured, poses that cannot be reached.
pub fn prepare<'a>(plant: &'a Plant, logs: &[log::Record]) -> Result<Data<'a>> {
    if !logs.iter().any(|r| r.purpose == Purpose::Fit) {
        return Err(Error::Infeasible(
            "the experiment has no record with use = \"fit\"; name at least one".into(),
        ));
    }
    payload::check(plant, logs)?;
    let likely: Vec<f64> = logs.iter().filter_map(|r| r.period).collect();
    let records = logs
        .par_iter()
        .map(|r| Series::prepare(plant, r, &likely))
        .collect::<Result<Vec<_>>>()?;
    let mut data = Data::new(plant, records)?;
    data.ordinary();
    data.carry()?;
    // the width of the window of the torque channel, then what the encoders cannot resolve
    for pass in 0..2 {
        let e = Evidence::new(&data, 1.0);
        let none = e.fit(&[]);
        let phi = e.parameters(&[], &none);
        let model = data.model_torque(&phi);
        let wider = e.project(&[data.curvature(&model)]);
        let found = e.fit(&[&wider]).eta[0];
        drop(e);
        data.window = (data.window + found).clamp(0.0, T.window.widest);
        if pass == 0 {
            let residual = data.gap_to(&model);
            data.limit_excess(&residual);
        }
        data.start_from_load(&phi);
    }
    Ok(data)
}

/// Diagnoses an experiment.
///
/// ```no_run
/// use excite::diagnose::{Settings, diagnose};
/// use excite::log::Experiment;
///
/// let experiment = Experiment::read("experiment.toml")?;
/// let found = diagnose(&experiment, &Settings::default(), &|step| println!("{step}"))?;
/// for finding in found.findings.iter().filter(|f| f.is_claim()) {
///     println!("{} {:?}: {:.2}", finding.title, finding.joints, finding.confidence);
/// }
/// # Ok::<(), excite::Error>(())
/// ```
///
/// # Errors
/// As [`prepare`].
pub fn diagnose(
    experiment: &Experiment,
    settings: &Settings,
    progress: &(dyn Fn(&str) + Sync),
) -> Result<Diagnosis> {
    let mut warnings = experiment.plant.warnings().to_vec();
    warnings.extend(experiment.records.iter().flat_map(|r| r.warnings.clone()));
    let mut out = of_logs(&experiment.plant, &experiment.records, settings, progress)?;
    out.warnings.splice(0..0, warnings);
    Ok(out)
}

/// Diagnoses logs of a robot.
///
/// # Errors
/// As [`prepare`].
pub fn of_logs(
    plant: &Plant,
    logs: &[log::Record],
    settings: &Settings,
    progress: &(dyn Fn(&str) + Sync),
) -> Result<Diagnosis> {
    progress("noise and nominal model");
    let mut data = prepare(plant, logs)?;
    let effects = catalogue::all();
    closeness::tighten(&mut data, &effects)?;
    let data = data;
    let evidence = Evidence::new(&data, 1.0);
    let none = evidence.fit(&[]);
    let phi = evidence.parameters(&[], &none);
    let cx = Context::new(&data, phi)?;
    progress("every effect at every place");
    let list = search::singles(&evidence, &cx, &effects, &[]);
    let decision = verdict::decide(&evidence, &cx, &effects, &list, progress);
    progress("report");

    let members = decision.projected();
    let fit = evidence.fit(&members);
    let phi_after = evidence.parameters(&members, &fit);
    let frozen = data.gap_to(&data.model_torque(&evidence.phi));
    let [refit, after] = [&[][..], &members].map(|set| evidence.torque_left(set));
    let findings = finding::findings(&evidence, &cx, &effects, &decision, settings.seed);
    progress("forward simulation");
    let added = forward::effects_torque(&cx, &effects, &decision.members);
    let held = controller::identify(&data, &evidence.phi);
    let forward = forward::forward(&data, [&evidence.phi, &cx.phi, &phi_after], &added, held);
    let unknowns = &phi_after[..plant.parameters().len()];
    let (improved, mut warnings) = improve::improve(&evidence, &cx, &effects, unknowns, &findings);
    warnings.extend(payload::warnings(logs));
    let next = settings.next.then(|| {
        progress("next experiment");
        next::propose(&evidence, &cx, &effects, &list, &findings, settings)
    });
    let fitted = |r: &Series| r.fit;
    let scaled = result::scaled(&data, &refit);
    Ok(Diagnosis {
        robot: plant.name().to_string(),
        joints: plant.actuators().iter().map(|j| j.name.clone()).collect(),
        units: (0..data.joints()).map(|j| cx.torque_unit(j)).collect(),
        verdict: decision.verdict,
        findings,
        frozen: gap::joints(&data, &frozen, fitted),
        refit: gap::joints(&data, &refit, fitted),
        explained: gap::joints(&data, &after, fitted),
        shares: gap::shares(&data, &scaled),
        bound: gap::bound(&data, &scaled),
        records: result::record_gaps(&data, &phi_after, [&frozen, &refit, &after]),
        holdout: decision.holdout,
        unexplained: decision.unexplained,
        traces: traces::traces(&data, &refit, &after),
        noise_source: result::noise_source(&data).into(),
        untestable: result::untestable(&data, &list, &effects),
        phi: unknowns.to_vec(),
        improved,
        next: next.flatten(),
        forward,
        warnings,
        surprise: decision.surprise,
        closeness: data.closeness,
        window: data.window,
    })
}
