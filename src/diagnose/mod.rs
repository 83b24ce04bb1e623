//! Diagnosis of the gap between a model and its robot: where it lies, which effect causes it, and how
//! far it shrinks once that effect is added.
//!
//! ```text
//! τ = W (φ₀ + δ) + Σ_e Z_e(shape) η_e + noise        δ ~ N(0, P)
//! ```
//!
//! | step | module | what it gives |
//! |---|---|---|
//! | prior | [`closeness`] | how close an identified model is |
//! | records | [`record`], [`noise`] | motion and derivatives, noise floor, whitening |
//! | nominal | [`data`], [`evidence`] | what the nominal model absorbs, at the price of its prior |
//! | effects | [`catalogue`] | columns of every effect at every place |
//! | search | [`search`], [`verdict`] | sets of effects, rivals, confidence |
//! | intervals | [`interval`] | how sure the share is that an effect explains |
//! | gap | [`gap`] | residuals against noise: joints, odd, even, non-periodic |
//! | simulation | [`forward`], [`controller`] | the robot simulated under the same commands, before and after |
//! | next | [`next`] | the motion that tells rivals apart |
//! | output | [`json`], [`page`], [`improve`] | `diagnosis.json`, report, improved robot |
//!
//! The method with its equations is in `docs/diagnosis-method.md`.

pub mod catalogue;
pub mod closed;
pub mod closeness;
pub mod controller;
pub mod data;
pub mod decoy;
pub mod evidence;
pub mod forward;
pub mod gap;
pub mod improve;
pub mod interval;
pub mod json;
pub mod next;
pub mod noise;
pub mod page;
pub mod record;
pub mod search;
pub mod verdict;

pub use verdict::Verdict;

use crate::error::{Error, Result, Warning};
use crate::log::{Experiment, Purpose};
use crate::plant::Plant;
use catalogue::{Context, Estimate, Place, Shape, Value};
use data::Data;
use evidence::{Evidence, Projected};
use gap::{JointGap, Shares};
use rayon::prelude::*;
use record::{Raw, Record};

/// What a diagnosis is asked for.
#[derive(Debug, Clone)]
pub struct Settings {
    /// whether to design the next experiment where effects are not told apart
    pub next: bool,
    /// random steps by which that design is improved
    pub next_tries: usize,
    /// seed of random starts
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            next: true,
            next_tries: 64,
            seed: 1,
        }
    }
}

/// One effect in the result.
#[derive(Debug, Clone)]
pub struct Finding {
    /// name, as in `formats.md`
    pub effect: &'static str,
    /// name in sentences
    pub title: &'static str,
    /// equation of the catalogue
    pub equation: &'static str,
    /// what tells it apart
    pub separated_by: &'static str,
    /// names of the actuators; empty for the whole robot
    pub joints: Vec<String>,
    /// where
    pub place: Place,
    /// shape
    pub shape: Shape,
    /// coefficients
    pub eta: Vec<f64>,
    /// 0 to 1; a claim from 0.5 on
    pub confidence: f64,
    /// share of the gap on fitted records
    pub explains: f64,
    /// 95 % interval of it
    pub interval: [f64; 2],
    /// share of the gap on holdout records
    pub holdout: f64,
    /// share of the effect that the nominal model cannot absorb
    pub visibility: f64,
    /// the most that a decoy, the effect moved in time, gains of its own over what the effect gains; of
    /// members of the set
    pub decoys: Option<f64>,
    /// what coefficients of their own for every fitted record gain over what the effect gains; of members
    pub unsteady: Option<f64>,
    /// parameters
    pub values: Vec<Value>,
    /// effects that this data cannot tell from it
    pub same: Vec<&'static str>,
    /// whether it is part of the set that was fitted, or only a rival
    pub member: bool,
    /// whether it shows against the prior of the parameters, not in a refitted residual
    pub frozen: bool,
}

/// Energy of the gap in one record before and after the set, in units of the noise variance a sample.
#[derive(Debug, Clone)]
pub struct RecordGap {
    /// name
    pub name: String,
    /// whether it was fitted to
    pub fit: bool,
    /// by actuator: frozen, refitted, with the effects
    pub joints: Vec<[f64; 3]>,
    /// whether periods repeat
    pub repeats: bool,
    /// remarks
    pub remarks: Vec<String>,
}

/// Series for the figures of one actuator: a period or the beginning of one record.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    /// time, s
    pub t: Vec<f64>,
    /// residual refitted, N m, mean over periods
    pub before: Vec<f64>,
    /// residual with the effects
    pub after: Vec<f64>,
    /// velocity
    pub velocity: Vec<f64>,
    /// position
    pub position: Vec<f64>,
    /// torque
    pub torque: Vec<f64>,
    /// spectra of residual before, after, and of noise, N m, on frequencies
    pub spectrum: Vec<[f64; 4]>,
    /// residual over time at the pace of periods: start time and rms before and after
    pub drift: Vec<[f64; 3]>,
}

/// Result of a diagnosis.
#[derive(Debug, Clone)]
pub struct Diagnosis {
    /// robot
    pub robot: String,
    /// names of the actuators
    pub joints: Vec<String>,
    /// units of their torques
    pub units: Vec<&'static str>,
    /// verdict
    pub verdict: Verdict,
    /// effects by falling confidence
    pub findings: Vec<Finding>,
    /// gap of the frozen model, fitted records
    pub frozen: Vec<JointGap>,
    /// gap after a refit under the prior
    pub refit: Vec<JointGap>,
    /// gap with the effects
    pub explained: Vec<JointGap>,
    /// odd, even, non-periodic
    pub shares: Shares,
    /// records
    pub records: Vec<RecordGap>,
    /// gap energy on holdout before and after
    pub holdout: [f64; 2],
    /// share of the gap that stays
    pub unexplained: f64,
    /// share of the gap that any function of the state could explain, by cross-validation between
    /// periods of state bins; `None` where there is nothing to explain
    pub bound: Option<f64>,
    /// figures
    pub traces: Vec<Trace>,
    /// where the noise floor comes from
    pub noise_source: String,
    /// effects that this motion cannot show: name, joint, visibility
    pub untestable: Vec<(&'static str, String, f64)>,
    /// parameters of the nominal model as fitted beside the effects
    pub phi: Vec<f64>,
    /// the model with the effects that were claimed
    pub improved: improve::Improved,
    /// proposal for the next experiment
    pub next: Option<next::Proposal>,
    /// the robot simulated under the recorded torques, before and after
    pub forward: forward::Forward,
    /// warnings
    pub warnings: Vec<Warning>,
    /// threshold and scale: penalty of the prior before and after
    pub surprise: [f64; 2],
    /// factors on the deviations of the prior that the records find likeliest
    pub closeness: closeness::Closeness,
    /// window of the torque channel, samples squared beyond ±1 sample
    pub window: f64,
}

/// Raw logs of an experiment.
///
/// # Errors
/// A record without torques.
pub fn raw(experiment: &Experiment) -> Result<Vec<Raw>> {
    experiment
        .records
        .iter()
        .map(|r| {
            if r.tau.is_empty() {
                return Err(Error::Infeasible(format!(
                    "{} has no torque columns tau1…: a diagnosis needs measured torques",
                    r.path.display()
                )));
            }
            let mut raw = Raw {
                name: r.name.clone(),
                fit: r.purpose == Purpose::Fit,
                period: r.period,
                t: r.t.clone(),
                q: r.q.clone(),
                tau: r.tau.clone(),
                qref: r.qref.clone(),
            };
            // stamps that jitter about a clock are not believed before the samples were compared
            // both ways; interpolation to an even grid would smooth the torque for good
            if let Some((t, [q, tau, qref])) = as_written(r) {
                raw.t = t;
                raw.q = q;
                raw.tau = tau;
                raw.qref = r.qref.is_some().then_some(qref);
            }
            Ok(raw)
        })
        .collect()
}

/// One channel an actuator.
type Columns = Vec<Vec<f64>>;

/// Times, and positions, torques and commanded positions as they stand in the file, where every value
/// is sound and no sample is missing.
fn as_written(r: &crate::log::Record) -> Option<(Vec<f64>, [Columns; 3])> {
    let n = r.actuators();
    let wanted = |name: &str| name == "t" || name.starts_with('q') || name.starts_with("tau");
    let mut table = crate::log::Table::read(&r.path, &wanted).ok()?;
    let mut take = |name: String| -> Option<Vec<f64>> {
        let at = table.find(&name)?;
        let column = std::mem::take(&mut table.columns[at]);
        column.iter().all(|v| v.is_finite()).then_some(column)
    };
    let t = take("t".into())?;
    let mut all =
        |group: &str| -> Option<Columns> { (1..=n).map(|j| take(format!("{group}{j}"))).collect() };
    let (q, tau) = (all("q")?, all("tau")?);
    let qref = match r.qref {
        Some(_) => all("qref")?,
        None => Vec::new(),
    };
    let mean = (t.last()? - t.first()?) / (t.len() - 1).max(1) as f64;
    let regular = t
        .iter()
        .enumerate()
        .all(|(i, v)| (v - t[0] - i as f64 * mean).abs() < 0.5 * mean);
    regular.then_some((t, [q, tau, qref]))
}

/// Records ready for the diagnosis: noise, window of the torque channel, ordinary imperfections.
///
/// # Errors
/// No record to fit to, records that are too short, poses that cannot be reached.
pub fn prepare<'a>(plant: &'a Plant, raws: &[Raw]) -> Result<Data<'a>> {
    if !raws.iter().any(|r| r.fit) {
        return Err(Error::Infeasible(
            "the experiment has no record with use = \"fit\"; name at least one".into(),
        ));
    }
    if let Some(r) = raws.iter().find(|r| r.t.len() < 64) {
        return Err(Error::Infeasible(format!(
            "{}: {} samples are too few for a diagnosis; record at least a whole period",
            r.name,
            r.t.len()
        )));
    }
    let likely: Vec<f64> = raws.iter().filter_map(|r| r.period).collect();
    let records = raws
        .par_iter()
        .map(|r| Record::prepare(plant, r, &likely))
        .collect::<Result<Vec<_>>>()?;
    let mut data = Data::new(plant, records)?;
    data.ordinary();
    // the width of the window of the torque channel, then what the encoders cannot resolve
    for pass in 0..2 {
        let e = Evidence::new(&data, 1.0);
        let none = e.fit(&[]);
        let phi = e.parameters(&[], &none);
        let model = data.model_torque(&phi);
        let wider = e.project(&[data.curvature(&model)]);
        let found = e.fit(&[&wider]).eta[0];
        drop(e);
        data.window = (data.window + found).clamp(0.0, 3.0);
        if pass == 0 {
            let residual: Vec<Vec<f64>> = (0..data.joints())
                .map(|j| {
                    let model = data.windowed(&model[j]);
                    data.tau[j].iter().zip(&model).map(|(a, b)| a - b).collect()
                })
                .collect();
            data.limit_excess(&residual);
        }
    }
    Ok(data)
}

/// Diagnoses an experiment.
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
    let raws = raw(experiment)?;
    let mut out = of_logs(&experiment.plant, &raws, settings, progress)?;
    out.warnings.splice(0..0, warnings);
    Ok(out)
}

/// Diagnoses logs of a robot.
///
/// # Errors
/// As [`prepare`].
pub fn of_logs(
    plant: &Plant,
    raws: &[Raw],
    settings: &Settings,
    progress: &(dyn Fn(&str) + Sync),
) -> Result<Diagnosis> {
    progress("noise and nominal model");
    let mut data = prepare(plant, raws)?;
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

    let actuators = plant.actuators();
    let name = |place: &Place| {
        let named = place.named().into_iter();
        named.map(|j| actuators[j].name.clone()).collect()
    };
    let members: Vec<&Projected> = decision
        .members
        .iter()
        .map(|m| &m.candidate.projected)
        .collect();
    let fit = evidence.fit(&members);
    let phi_after = evidence.parameters(&members, &fit);
    let scatter = |set: &[&Projected]| -> Vec<Vec<f64>> {
        evidence.unwhitened(&evidence.residual(set, &evidence.fit(set)))
    };
    let (all, gap) = (scatter(&members), scatter(&[]));
    let plain = |scatter: &[Vec<f64>]| -> Vec<Vec<f64>> {
        let row = |(j, e): (usize, &Vec<f64>)| e.iter().map(|v| v * data.noise[j].std).collect();
        scatter.iter().enumerate().map(row).collect()
    };
    let (refit, after) = (plain(&gap), plain(&all));
    let model = data.model_torque(&evidence.phi);
    let frozen: Vec<Vec<f64>> = (0..data.joints())
        .map(|j| {
            let model = data.windowed(&model[j]);
            data.tau[j].iter().zip(&model).map(|(a, b)| a - b).collect()
        })
        .collect();

    let estimate = |place: Place, shape: &Shape, eta: &[f64], std: &[f64]| Estimate {
        place,
        shape: shape.clone(),
        eta: eta.to_vec(),
        std: std.to_vec(),
    };
    let mut findings = Vec::new();
    for (i, m) in decision.members.iter().enumerate() {
        let mut rest = members.clone();
        rest.remove(i);
        let total = match m.frozen {
            true => &evidence.unwhitened(&evidence.r),
            false => &gap,
        };
        let without = scatter(&rest);
        let interval = interval::explained(&data, total, &without, &all, m.explains, settings.seed);
        let c = &m.candidate;
        let effect = effects[c.effect].as_ref();
        let card = effect.card();
        let mut same: Vec<&'static str> = Vec::new();
        for r in m.rivals.iter().filter(|r| r.weight > 0.25) {
            let rival = effects[r.effect].card().name;
            if rival != card.name && !same.contains(&rival) {
                same.push(rival);
            }
        }
        findings.push(Finding {
            effect: card.name,
            title: card.title,
            equation: card.equation,
            separated_by: card.separated_by,
            joints: name(&c.place),
            place: c.place,
            shape: c.shape.clone(),
            eta: c.eta.clone(),
            confidence: m.confidence,
            explains: m.explains,
            interval,
            holdout: m.holdout,
            visibility: m.visibility,
            decoys: m.decoys,
            unsteady: m.unsteady,
            values: effect.values(&cx, &estimate(c.place, &c.shape, &c.eta, &m.std)),
            same,
            member: true,
            frozen: m.frozen,
        });
    }
    // what could stand in the place of a member, with what is left of its confidence
    for (m, of) in decision.members.iter().enumerate() {
        let mut seen: Vec<usize> = Vec::new();
        for r in &of.rivals {
            let (effect, card) = (effects[r.effect].as_ref(), effects[r.effect].card());
            let known = findings.iter().any(|f| f.effect == card.name);
            if seen.len() >= 4 || r.weight < 0.01 || seen.contains(&r.effect) || known {
                continue;
            }
            seen.push(r.effect);
            let main = &findings[m];
            findings.push(Finding {
                effect: card.name,
                title: card.title,
                equation: card.equation,
                separated_by: card.separated_by,
                joints: name(&r.place),
                place: r.place,
                shape: r.shape.clone(),
                eta: r.eta.clone(),
                confidence: (main.confidence * r.weight).min(0.49),
                explains: main.explains * (1.0 - r.loss).clamp(0.0, 1.0),
                interval: main.interval.map(|v| v * (1.0 - r.loss).clamp(0.0, 1.0)),
                holdout: main.holdout * (1.0 - r.loss).clamp(0.0, 1.0),
                visibility: of.visibility,
                decoys: None,
                unsteady: None,
                values: effect.values(
                    &cx,
                    &estimate(r.place, &r.shape, &r.eta, &vec![0.0; r.eta.len()]),
                ),
                same: if r.weight > 0.25 {
                    vec![main.effect]
                } else {
                    Vec::new()
                },
                member: false,
                frozen: main.frozen,
            });
        }
    }
    findings.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));

    let records = record_gaps(&data, &frozen, &refit, &after);
    progress("forward simulation");
    let added = forward::effects_torque(&cx, &effects, &decision.members);
    let held = controller::identify(&data, &evidence.phi);
    let forward = forward::forward(&data, [&evidence.phi, &cx.phi, &phi_after], &added, held);
    let untestable = untestable(&data, &list, &effects);
    let fitted = |r: &Record| r.fit;
    let noise_source = match data.noise[0].source {
        noise::Source::Periods => "the scatter between repeated periods",
        noise::Source::HighBand => {
            "the residual above the band of the motion (no record repeats, so that noise below it is \
             assumed to be as high)"
        }
    };
    if settings.next {
        progress("next experiment");
    }
    let unknowns = &phi_after[..plant.parameters().len()];
    let (improved, warnings) = improve::improve(&evidence, &cx, &effects, unknowns, &findings);
    let next = match settings.next {
        true => next::propose(&evidence, &cx, &effects, &list, &findings, settings),
        false => None,
    };
    Ok(Diagnosis {
        robot: plant.name().to_string(),
        joints: actuators.iter().map(|j| j.name.clone()).collect(),
        units: (0..data.joints()).map(|j| cx.torque_unit(j)).collect(),
        verdict: decision.verdict,
        findings,
        frozen: gap::joints(&data, &frozen, fitted),
        refit: gap::joints(&data, &refit, fitted),
        explained: gap::joints(&data, &after, fitted),
        shares: gap::shares(&data, &scaled(&data, &refit)),
        bound: gap::bound(&data, &scaled(&data, &refit)),
        records,
        holdout: decision.holdout,
        unexplained: decision.unexplained,
        traces: traces(&data, &refit, &after),
        noise_source: noise_source.into(),
        untestable,
        phi: unknowns.to_vec(),
        improved,
        next,
        forward,
        warnings,
        surprise: decision.surprise,
        closeness: data.closeness,
        window: data.window,
    })
}

/// Residuals in units of the noise.
fn scaled(data: &Data, residual: &[Vec<f64>]) -> Vec<Vec<f64>> {
    residual
        .iter()
        .enumerate()
        .map(|(j, e)| e.iter().map(|v| v / data.noise[j].std).collect())
        .collect()
}

fn record_gaps(
    data: &Data,
    frozen: &[Vec<f64>],
    refit: &[Vec<f64>],
    after: &[Vec<f64>],
) -> Vec<RecordGap> {
    let all = [
        scaled(data, frozen),
        scaled(data, refit),
        scaled(data, after),
    ];
    data.records
        .iter()
        .enumerate()
        .map(|(k, r)| RecordGap {
            name: r.name.clone(),
            fit: r.fit,
            joints: (0..data.joints())
                .map(|j| {
                    std::array::from_fn(|i| {
                        let (a, b) = gap::excess(r, &all[i][j][data.span(k)]);
                        ((a + b) / r.count as f64 - data.noise[j].excess).max(0.0)
                    })
                })
                .collect(),
            repeats: r.cycle.is_some(),
            remarks: r.remarks.clone(),
        })
        .collect()
}

/// Effects that the nominal model absorbs to more than 99 % in this motion.
fn untestable(
    data: &Data,
    list: &[search::Candidate],
    effects: &[Box<dyn catalogue::Effect>],
) -> Vec<(&'static str, String, f64)> {
    let names = data.plant.actuators();
    let mut out = Vec::new();
    for c in list {
        let visibility = c.projected.visibility(None);
        if visibility < next::INVISIBLE {
            let named = c.place.named().into_iter();
            let place: Vec<&str> = named.map(|j| names[j].name.as_str()).collect();
            out.push((effects[c.effect].card().name, place.join(", "), visibility));
        }
    }
    out
}

/// Figures: the first fitted record of each actuator.
fn traces(data: &Data, before: &[Vec<f64>], after: &[Vec<f64>]) -> Vec<Trace> {
    (0..data.joints())
        .map(|j| {
            let r = &data.records[0];
            let n = r.cycle.unwrap_or(r.count);
            let part = |x: &[f64]| -> Vec<f64> {
                match r.cycle {
                    Some(cycle) => noise::period_mean(&x[data.span(0)], cycle),
                    None => x[data.span(0)].to_vec(),
                }
            };
            let (q, v) = r.state(j);
            let fitted = data.fitted;
            let [b, a] = [&before[j], &after[j]].map(|e| noise::spectrum(&e[..fitted]));
            let spectrum = (0..=noise::LINES)
                .map(|l| {
                    let f = l as f64 / (2.0 * r.dt * noise::LINES as f64);
                    let amplitude = |p: f64| (p / noise::LINES as f64).sqrt();
                    [
                        f,
                        amplitude(b[l]),
                        amplitude(a[l]),
                        amplitude(data.noise[j].torque[l]),
                    ]
                })
                .collect();
            let mut drift = Vec::new();
            let mut clock = 0.0;
            let mut order: Vec<usize> = (0..data.records.len()).collect();
            order.sort_by_key(|k| data.records[*k].order);
            for k in order {
                let r = &data.records[k];
                let step = r.cycle.unwrap_or(r.count.div_ceil(4));
                for (i, piece) in before[j][data.span(k)].chunks(step).enumerate() {
                    let later = &after[j][data.span(k)][i * step..][..piece.len()];
                    let rms =
                        |x: &[f64]| (x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64).sqrt();
                    drift.push([
                        clock + i as f64 * step as f64 * r.dt,
                        rms(piece),
                        rms(later),
                    ]);
                }
                clock += r.count as f64 * r.dt;
            }
            Trace {
                t: (0..n).map(|i| i as f64 * r.dt).collect(),
                before: part(&before[j]),
                after: part(&after[j]),
                velocity: v[..n].to_vec(),
                position: q[..n].to_vec(),
                torque: r.torque(j)[..n].to_vec(),
                spectrum,
                drift,
            }
        })
        .collect()
}
