//! Identification from logs that are longer than the memory: read in parts, condensed one after the other.
//!
//! ```text
//! part 1 ─ condense ─▶ R₁ ┐
//! part 2 ─ condense ─▶ R₂ ┼─ QR ─▶ R ─ merge ─▶ π̂, φ
//! …                       ┘
//! ```
//!
//! The estimate, its errors and its uncertainty come from all rows. Figures over time, and the search for joints that
//! move with others, show the first rows of each record.

use super::condense::of_records;
use super::equations::{self, Equations};
use super::factor::Factor;
use super::identification::{Identification, Share};
use super::merge::{Merged, merge};
use super::settings::{Method, Settings};
use super::validation::{Errors, validate};
use super::{doubts, uncertainty};
use crate::base::BaseParameters;
use crate::error::{Error, Result, Warning, WarningKind, counted};
use crate::log::{Outline, Payload, Purpose, Record};
use crate::plant::Plant;
use crate::signals;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::{Mutex, mpsc};

/// Rows that figures show of a record, or two periods where those are more.
const SHOWN: usize = 60_000;
/// Most records that figures show.
const RECORDS: usize = 6;
/// Most parts that are condensed at a time.
const AT_ONCE: usize = 4;

/// Records that were read in parts.
pub struct Condensed {
    /// their equations
    pub factor: Factor,
    /// the first rows of each record
    pub shown: Vec<Record>,
    /// how each was read
    pub shares: Vec<Share>,
    /// settings, with the cut-off that all parts share
    pub settings: Settings,
}

/// Condenses the records of an experiment, read in parts of `rows` rows; `check` looks at the first part of each.
///
/// The cut-off, where none is stated, is chosen from the first part of each fit record in which something moves.
///
/// # Errors
/// As [`Record::read_parts`] and [`condense`](super::condense()); a method that needs all samples at once.
pub fn condense_parts(
    outline: &Outline,
    plant: &Plant,
    asked: Option<&[String]>,
    rows: usize,
    settings: &Settings,
    check: &(dyn Fn(&Record) -> Result<Vec<Warning>> + Sync),
) -> Result<Condensed> {
    if !matches!(settings.method, Method::Ols | Method::Wls) {
        return Err(Error::Argument(
            "the logs are so long that they are read in parts, for which the methods are ols and wls; --rows 0 reads \
             them whole"
                .into(),
        ));
    }
    let purposes = outline.purposes();
    let settings = one_filter(outline, rows, settings)?;
    let base = plant.base()?;
    let mut all: Option<Factor> = None;
    let (mut shown, mut shares) = (Vec::new(), Vec::new());
    let mut left_out = Vec::new();
    for k in 0..purposes.len() {
        let mut sum: Option<Factor> = None;
        let mut share: Option<Share> = None;
        let work = |index: usize, part: Record| -> Result<Done> {
            let mut warnings = match index {
                0 => check(&part)?,
                _ => Vec::new(),
            };
            let used = equations::without_payload(std::slice::from_ref(&part), &mut warnings)?;
            if used.is_empty() {
                return Ok(Done::LeftOut(warnings));
            }
            let spec = &outline.spec;
            let correlated = correlated(index);
            let factor = of_records(
                plant, &base, spec, asked, used, &settings, correlated, warnings,
            )?;
            Ok(Done::Part {
                factor: Box::new(factor),
                rows: part.len(),
                head: (index == 0).then(|| Box::new(head(&part))),
            })
        };
        // equations of the parts whose correlation in time was looked at
        let mut looked = 0.0;
        each_part(outline, k, rows, &work, &mut |done| {
            let (factor, rows, first) = match done {
                Done::LeftOut(mut warnings) => {
                    left_out.append(&mut warnings);
                    return Ok(ControlFlow::Break(()));
                }
                Done::Part { factor, rows, head } => (*factor, rows, head),
            };
            if correlated(share.as_ref().map_or(0, |s| s.parts)) {
                looked += factor.header.parts[0].used.iter().sum::<f64>();
            }
            sum = Some(match sum.take() {
                Some(all) => all.and_then(factor)?,
                None => factor,
            });
            let share = share.get_or_insert_with(|| Share {
                record: first.as_ref().map_or(String::new(), |r| r.name.clone()),
                rows: 0,
                parts: 0,
                shown: 0,
            });
            if let Some(first) = first
                && shown.len() < RECORDS
            {
                shown.push(*first);
            }
            share.rows += rows;
            share.parts += 1;
            Ok(ControlFlow::Continue(()))
        })?;
        let (Some(mut sum), Some(share)) = (sum, share) else {
            continue;
        };
        let fitted = &mut sum.header.parts[0];
        fitted.inflated *= fitted.used.iter().sum::<f64>() / looked.max(1.0);
        for part in sum
            .header
            .parts
            .iter_mut()
            .filter(|p| !p.records.is_empty())
        {
            part.records = vec![share.record.clone()];
        }
        shares.push(share);
        all = Some(match all {
            Some(all) => all.with(sum)?,
            None => sum,
        });
    }
    let fitted = all.filter(|f| !f.header.parts[0].records.is_empty());
    let mut factor = fitted.ok_or_else(equations::nothing_to_fit)?;
    factor.header.warnings.extend(left_out);
    for share in &mut shares {
        let of = shown.iter().find(|r: &&Record| r.name == share.record);
        share.shown = of.map_or(0, Record::len);
    }
    Ok(Condensed {
        factor,
        shown,
        shares,
        settings,
    })
}

/// Whether the variance through correlation in time is looked for in a part: of a long record an eighth of them say enough.
fn correlated(index: usize) -> bool {
    index < 4 || index.is_multiple_of(8)
}

/// What becomes of a part.
enum Done {
    /// the record is of no use here, for these reasons
    LeftOut(Vec<Warning>),
    /// its equations
    Part {
        factor: Box<Factor>,
        rows: usize,
        /// the first rows, of the first part
        head: Option<Box<Record>>,
    },
}

/// Does `work` for the parts of a record, several at a time, and hands what comes of it to `each` in their order; the next
/// one is read meanwhile.
fn each_part<T: Send>(
    outline: &Outline,
    record: usize,
    rows: usize,
    work: &(dyn Fn(usize, Record) -> Result<T> + Sync),
    each: &mut dyn FnMut(T) -> Result<ControlFlow<()>>,
) -> Result<()> {
    let workers = rayon::current_num_threads().clamp(1, AT_ONCE);
    // threads of their own: a part that is worked on need not wait for what another part or the reader asks for
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(workers)
        .build()
        .map_err(|e| Error::Infeasible(format!("no threads to work with: {e}")))?;
    std::thread::scope(|scope| {
        let (send, parts) = mpsc::sync_channel(1);
        let reader = scope.spawn(move || {
            let mut index = 0;
            outline.parts(record, rows, &mut |part| {
                index += 1;
                Ok(match send.send((index - 1, part)) {
                    Ok(()) => ControlFlow::Continue(()),
                    // nobody wants more
                    Err(_) => ControlFlow::Break(()),
                })
            })
        });
        let (give, done) = mpsc::channel();
        let parts = Mutex::new(parts);
        let mut ended = Ok(());
        pool.in_place_scope(|scope| {
            for _ in 0..workers {
                let (parts, give) = (&parts, give.clone());
                scope.spawn(move |_| {
                    loop {
                        let next = parts.lock().map(|parts| parts.recv());
                        let Ok(Ok((index, part))) = next else { break };
                        if give.send((index, work(index, part))).is_err() {
                            break;
                        }
                    }
                });
            }
            drop(give);
            let mut waiting = BTreeMap::new();
            let mut next = 0;
            'parts: for (index, result) in &done {
                waiting.insert(index, result);
                while let Some(result) = waiting.remove(&next) {
                    next += 1;
                    match result.and_then(&mut *each) {
                        Ok(ControlFlow::Continue(())) => {}
                        Ok(ControlFlow::Break(())) => break 'parts,
                        Err(e) => {
                            ended = Err(e);
                            break 'parts;
                        }
                    }
                }
            }
            drop(done);
        });
        // nobody wants more
        drop(parts);
        match reader.join() {
            Ok(read) => ended.and(read),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    })
}

/// The cut-off that all parts share.
fn one_filter(outline: &Outline, rows: usize, settings: &Settings) -> Result<Settings> {
    let mut settings = settings.clone();
    settings.signals.thin = true;
    if settings.signals.cutoff.is_some() {
        return Ok(settings);
    }
    let mut cutoff = 0.0f64;
    for (k, purpose) in outline.purposes().into_iter().enumerate() {
        if purpose == Purpose::Fit {
            outline.parts(k, rows, &mut |part| {
                if part.payload == Payload::None {
                    cutoff = cutoff.max(signals::common_cutoff([&part]));
                }
                Ok(ControlFlow::Break(()))
            })?;
        }
    }
    settings.signals.cutoff = (cutoff > 0.0).then_some(cutoff);
    Ok(settings)
}

/// The first rows of a part, under the name of the record: without the number of the part.
fn head(part: &Record) -> Record {
    let periods = part.periods().map_or(0, |(each, _)| 2 * each);
    let mut out = part.first(SHOWN.max(periods));
    if let (Some(from), Some(to)) = (out.name.rfind('['), out.name.rfind(']'))
        && from < to
    {
        out.name.replace_range(from..=to, "");
    }
    out
}

/// Identifies a plant from records that were condensed in parts.
///
/// # Errors
/// As [`identify`](super::identify()).
pub fn identify_parts(plant: &Plant, records: Condensed) -> Result<Identification> {
    let merged = merge(plant, vec![records.factor.clone()], &records.settings)?;
    found(plant, plant.base()?, merged, records)
}

/// The result as of records that were read whole.
fn found(
    plant: &Plant,
    base: BaseParameters,
    merged: Merged,
    records: Condensed,
) -> Result<Identification> {
    let Condensed {
        factor,
        shown,
        shares,
        settings,
    } = records;
    let equations = Equations::new(plant, &base, &settings.signals, shown.iter().collect())?;
    let models = [&merged.pi, &merged.pi_consistent, &merged.essential.pi];
    let mut validation = validate(&equations, models.map(Vec::as_slice))?;
    let relative = |e: &Option<Errors>| e.as_ref().map(|e| e.relative_error);
    let both = |all: [&Option<Errors>; 2]| (relative(all[0]).unwrap_or(f64::NAN), relative(all[1]));
    let [fit, holdout] = &merged.errors;
    let [plain, essential] = [0, 1].map(|k| [0, 1].map(|p| &merged.other_errors[p][k]));
    validation.nominal = both([&fit[0], &holdout[0]]);
    validation.plain = both(plain);
    validation.essential = both(essential);
    if let Some(fit) = &fit[1] {
        validation.fit = fit.clone();
    }
    validation.holdout = holdout[1].clone();

    let mut all = factor.fitted();
    let one = equations.stacks.iter().find(|s| s.purpose == Purpose::Fit);
    all.stands_for = one.map_or(1.0, |s| s.stands_for);
    let predicted_std = uncertainty::predicted(plant, &[&all])?;

    let mut warnings = merged.warnings;
    warnings.extend(shares.iter().map(|s| {
        let message = format!(
            "{} rows were read in {}: parameters and errors are of all of them, figures over time of the first {}",
            s.rows,
            counted(s.parts, "part"),
            s.shown
        );
        Warning::new(WarningKind::ReadInParts, &s.record, message)
    }));
    let mut out = Identification {
        scene: None,
        std: merged.std,
        predicted_std,
        residual_covariance: merged.residual_covariance,
        pi: merged.pi,
        covariance: merged.covariance,
        inflation: merged.inflation,
        condition: merged.condition,
        phi: merged.phi,
        pi_consistent: merged.pi_consistent,
        phi_std: merged.phi_std,
        prior_strength: merged.prior_strength,
        trials: merged.trials,
        margin: merged.margin,
        consistent: merged.consistent,
        outliers: None,
        breakaway: Vec::new(),
        prepared: equations.prepared,
        essential: merged.essential,
        validation,
        in_parts: shares,
        warnings,
        base,
    };
    // what predicts worse is said of condensed records as well
    let said = |w: &Warning, all: &[Warning]| {
        all.iter()
            .any(|o| o.kind == w.kind && o.subject == w.subject)
    };
    let doubts = doubts::doubts(plant, &out);
    let new = doubts.into_iter().filter(|w| !said(w, &out.warnings));
    let new: Vec<Warning> = new.collect();
    out.warnings.extend(new);
    Ok(out)
}
