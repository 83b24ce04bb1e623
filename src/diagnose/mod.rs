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
//! | friction | `lacking` | that of a robot whose file states none |
//! | loads | `payload` | what the robot carried: known, unknown or nothing |
//! | nominal | `data`, `rigid`, [`evidence`] | what the nominal model absorbs, at the price of its prior |
//! | effects | [`catalogue`] | columns of every effect at every place |
//! | search | `search`, `settle`, `verdict`, `searched` | sets of effects, rivals, confidence |
//! | constants | [`thresholds`] | what the verdict rests on, with units and origin |
//! | intervals | `interval` | how sure the share is that an effect explains |
//! | gap | `gap` | residuals against noise: joints, odd, even, non-periodic |
//! | simulation | `forward`, [`controller`] | the robot simulated under the same commands, before and after |
//! | next | [`next`] | the motion that tells rivals apart |
//! | output | `finding`, `result`, `traces`, [`json`], [`page`], `improve` | `diagnosis.json`, report, improved robot |
//!
//! The method with its equations is in `docs/diagnosis-method.md`.

pub(crate) mod at_rest;
pub(crate) mod carried;
#[doc(hidden)]
pub mod catalogue;
mod chain;
mod channel;
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
mod lacking;
#[doc(hidden)]
pub mod next;
pub(crate) mod noise;
mod noise_floor;
#[doc(hidden)]
pub mod outside;
#[doc(hidden)]
pub mod page;
pub mod parts;
pub(crate) mod payload;
pub(crate) mod posterior;
pub(crate) mod prior;
pub(crate) mod result;
mod reversal;
pub(crate) mod rigid;
pub(crate) mod search;
mod searched;
#[doc(hidden)]
pub mod second_encoder;
pub(crate) mod settings;
mod settle;
#[doc(hidden)]
pub mod thresholds;
pub(crate) mod traces;
pub(crate) mod verdict;
pub(crate) mod window;

pub use finding::Finding;
pub(crate) use gap::JointGap;
pub use result::Diagnosis;
#[doc(hidden)]
pub use second_encoder::{SecondEncoder, Seen};
pub use settings::Settings;
#[doc(hidden)]
pub use traces::Trace;
pub(crate) use verdict::Verdict;

use self::thresholds::THRESHOLDS as T;
use crate::error::{Error, Result};
use crate::log::{self, Experiment, Purpose};
use crate::plant::Plant;
use crate::signals::series::Series;
use channel::Assumed;
use data::Data;
use lacking::{Beyond, Lacking};
use payload::Loads;
use rayon::prelude::*;
use searched::Searched;
use std::borrow::Cow;

#[doc(hidden)]
/// Records ready for the diagnosis: noise, window of the torque channel, ordinary imperfections.
///
/// # Errors
/// No record to fit to, records that are too short or hold too few sound samples, a payload that cannot be
/// honoured, poses that cannot be reached.
pub fn prepare<'a>(plant: &'a Plant, logs: &[log::Record]) -> Result<Data<'a>> {
    gathered(plant, logs, Loads::One)?.completed(Assumed::default())
}

/// Records before anything is said of what the log makes of a torque, with one unknown load, or one by record.
fn gathered<'a>(plant: &'a Plant, logs: &[log::Record], loads: Loads) -> Result<Data<'a>> {
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
    data.carry(loads)?;
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
    let mut out = of_logs(&experiment.plant, &experiment.records, settings, progress)?;
    out.warnings.splice(0..0, experiment.warnings());
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
    let (plant, found) = lacking::with_friction(plant, logs)?;
    let file = found.as_ref().map(|(file, lacking)| (file, lacking));
    of_plant(&plant, file, logs, settings, progress)
}

/// Diagnoses logs of a robot with its friction, where its `file` leaves some of it out.
fn of_plant<'a>(
    plant: &'a Plant,
    file: Option<(&Plant, &Lacking)>,
    logs: &[log::Record],
    settings: &Settings,
    progress: &(dyn Fn(&str) + Sync),
) -> Result<Diagnosis> {
    let mut logs = Cow::Borrowed(logs);
    let mut plain = gathered(plant, &logs, Loads::One)?;
    let mut data = plain.clone().completed(Assumed::default())?;
    let mut carried = carried::find(&mut data)?;
    let mut with = |found: &carried::Carried, data: &mut Data<'a>| -> Result<()> {
        logs = Cow::Owned(found.stated(&logs));
        plain = gathered(plant, &logs, found.loads)?;
        *data = plain.clone().completed(Assumed::default())?;
        Ok(())
    };
    if let Some(found) = &carried {
        with(found, &mut data)?;
    }
    if let Some(found) = carried::remounted(&mut data)? {
        with(&found, &mut data)?;
        carried.iter_mut().for_each(|c| c.loads = found.loads);
    }
    let logs = logs.as_ref();
    let effects = catalogue::all();
    closeness::tighten(&mut data, &effects)?;
    let first = Searched::of(&data, &effects, None, progress)?;
    let others = first.doubts(&effects).into_iter().map(|assumed| {
        let mut data = plain.clone().completed(assumed)?;
        closeness::tighten(&mut data, &effects)?;
        Ok(data)
    });
    let others = others.collect::<Result<Vec<Data>>>()?;
    drop(plain);
    let mut found = first;
    for data in &others {
        let before = found.set_aside(&effects);
        let other = Searched::of(data, &effects, Some(&before), progress)?;
        found = match other.stands_for(&before, &effects) {
            true => other,
            false => before.taken_up(),
        };
    }
    let Searched {
        evidence,
        cx,
        list,
        decision,
    } = found;
    let data = evidence.data;
    progress("report");

    let members = decision.projected();
    let fit = evidence.fit(&members);
    let phi_after = evidence.parameters(&members, &fit);
    let left = [&[][..], &members].map(|set| evidence.residual(set, &evidence.fit(set)));
    let lacked = file.map(|(file, lacking)| {
        let found = Beyond {
            lacking,
            evidence: &evidence,
            cx: &cx,
            effects: &effects,
            set: &members,
            fit: &fit,
            left: left.each_ref().map(|e| &e[..]),
            phi: &phi_after,
            seed: settings.seed,
        };
        found.lacked(file)
    });
    // the gap is counted from the file
    let (nominal, refitted, [of_file, of_refit]) = match &lacked {
        Some(l) => (&l.nominal, &l.refit, l.residuals.each_ref()),
        None => (&evidence.phi, &cx.phi, [&evidence.r, &left[0]]),
    };
    let frozen = data.gap_that_counts(&data.model_torque(nominal));
    let [refit, after] = [of_refit, &left[1]].map(|e| evidence.in_torque(e));
    let mut findings = finding::findings(&evidence, &cx, &effects, &decision, settings.seed);
    let fitted = |r: &Series| r.fit;
    let residual_gap = gap::joints(&evidence, &refit, of_refit, fitted);
    let improve::Made {
        mut improved,
        phi: phi_improved,
        torque: added,
        mut warnings,
    } = improve::improve(
        &evidence,
        &cx,
        &effects,
        [nominal, &phi_after],
        &findings,
        &frozen,
    );
    progress("forward simulation");
    let held = controller::identify(data, nominal);
    let forward = forward::forward(data, [nominal, refitted, &phi_improved], &added, held);
    drop(added);
    let posterior = (settings.samples > 0).then(|| {
        progress("samples");
        posterior::sample(&evidence, &cx, &effects, &decision, &after, settings)
    });
    warnings.extend(payload::warnings(logs));
    let units: Vec<&'static str> = (0..data.joints()).map(|j| cx.torque_unit(j)).collect();
    let at_rest = at_rest::find(data, &units);
    warnings.extend(at_rest::warnings(&at_rest));
    let much = match lacked {
        None => too_much(&residual_gap, data),
        Some(_) => {
            let beside = evidence.in_torque(&left[0]);
            too_much(&gap::joints(&evidence, &beside, &left[0], fitted), data)
        }
    };
    let honest = match (decision.verdict, much) {
        (Verdict::NoGap, true) => Verdict::Unknown,
        (verdict, _) => verdict,
    };
    let verdict = match (data.moves(), &carried) {
        // nothing was compared
        (false, _) => Verdict::Unknown,
        (true, None) => honest,
        (true, Some(load)) => {
            let body = finding::carried(&evidence, &cx, &phi_after, load, effects.as_slice());
            findings.extend(body);
            finding::order(&mut findings);
            match honest {
                Verdict::NoGap => Verdict::Explained,
                Verdict::Unknown => Verdict::PartlyExplained,
                other => other,
            }
        }
    };
    let second_encoder = second_encoder::find(data, &cx.phi)?;
    let claims = findings.iter().filter(|f| f.is_claim());
    let claims: Vec<_> = claims.map(|f| (f.effect, f.joints.clone())).collect();
    warnings.extend(second_encoder::warnings(&second_encoder, &claims));
    let next = settings.next.then(|| {
        progress("next experiment");
        next::propose(&evidence, &cx, &effects, &list, &findings, settings)
    });
    let scaled = evidence.as_counted(of_refit);
    let verdict = match &lacked {
        Some(lacked) => {
            lacked.remark(plant, &mut improved);
            lacked.told(verdict, &mut findings)
        }
        None => verdict,
    };
    warnings.extend(file.map(|(file, lacking)| lacking.warning(file)));
    let (holdout, unexplained) = match &lacked {
        Some(l) => (l.holdout, l.unexplained),
        None => (decision.holdout, decision.unexplained),
    };
    Ok(Diagnosis {
        robot: plant.name().to_string(),
        joints: plant.actuators().iter().map(|j| j.name.clone()).collect(),
        units,
        verdict,
        findings,
        frozen: gap::joints(&evidence, &frozen, of_file, fitted),
        refit: residual_gap,
        explained: gap::joints(&evidence, &after, &left[1], fitted),
        shares: gap::shares(data, &scaled),
        bound: match data.records.iter().any(|r| r.fit && r.cycle.is_some()) {
            true => gap::bound(data, &scaled),
            // tried on other periods, of which there are none
            false => None,
        },
        records: result::record_gaps(
            &evidence,
            &phi_after,
            [&frozen, &refit, &after],
            [of_file, of_refit, &left[1]],
        ),
        holdout: data.predicts().then_some(holdout),
        moves: data.moves(),
        at_rest,
        second_encoder,
        stands_out: decision.stands_out || much,
        stays_on: decision
            .stay
            .iter()
            .map(|j| plant.actuators()[*j].name.clone())
            .collect(),
        unexplained: if data.moves() { unexplained } else { 1.0 },
        traces: traces::traces(data, &refit, &after),
        noise_source: result::noise_source(data),
        untestable: result::untestable(data, &list, &effects),
        ruled_out: result::ruled_out(data, &list, &effects),
        phi: phi_after[..plant.parameters().len()].to_vec(),
        improved,
        posterior,
        next: next.flatten(),
        forward,
        warnings,
        surprise: decision.surprise,
        closeness: data.closeness,
        window: data.window,
        lead: data.lead,
        friction_found: file.is_some(),
        turns_in_part: (0..data.joints()).any(|j| data.turns_in_part(j)),
    })
}

/// Whether the refit leaves more on any joint than a sound model does, counted as the report counts it: `no_gap` is not
/// said then.
fn too_much(refit: &[JointGap], data: &Data) -> bool {
    let left = |g: &JointGap| (g.rms / g.noise.max(1e-300)).powi(2);
    let mut joints = refit.iter().enumerate();
    joints.any(|(j, g)| left(g) > T.gap.left * data.allowance(j))
}
