//! From a record to a [`Prepared`] one.

use super::butterworth;
use super::cutoff::Spectra;
use super::{Decimator, Derivation, Periods, Prepared, Settings, Thin, cutoff, fourier, wiener};
use crate::dynamics::Samples;
use crate::error::{Error, Result, Warning, WarningKind};
use crate::extremes::extremes;
use crate::log::Record;
use crate::plant::{self, Plant};
use faer::Mat;
use rayon::prelude::*;
use std::borrow::Cow;

/// Windows that say what the spectrum of a part of a long log is.
const WINDOWS: usize = 8;
/// Samples that hold a motion, in cut-offs of its positions.
const DENSITY: f64 = 8.0;
/// Cut-off of the parallel filter, in bandwidths of the motion.
const BANDS: f64 = 10.0;
/// Highest cut-off of the positions, in cut-offs of the parallel filter, which its pass band must not
/// feel.
const MARGIN: f64 = 2.5;

/// Cut-off of the filter that torque and regressor pass, from the data: ten times the bandwidth of the
/// motion, over all joints of all these records, so that they are all filtered alike. The rigid-body
/// torque has twice the frequencies of the motion and friction its harmonics; what lies beyond is drive
/// and structure.
pub fn common_cutoff<'a>(records: impl IntoIterator<Item = &'a Record>) -> f64 {
    let mut highest = 0.0f64;
    for r in records {
        let spread = |q: &[f64]| {
            let [low, high] = extremes(q);
            high - low
        };
        let most = r.q.iter().map(|q| spread(q)).fold(0.0, f64::max);
        // a joint that is held still moves with noise alone
        let moving: Vec<&Vec<f64>> = r.q.iter().filter(|q| spread(q) > 1e-3 * most).collect();
        highest = moving
            .par_iter()
            .map(|q| cutoff::bandwidth(q, r.rate()))
            .collect::<Vec<_>>()
            .into_iter()
            .fold(highest, f64::max);
    }
    BANDS * highest
}

/// Positions of the coordinates and their two derivatives.
type Rates = [Vec<f64>; 3];

impl Prepared {
    /// Prepares a record.
    ///
    /// # Errors
    /// Settings that cannot be, positions that no pose of a parallel robot gives, or no sound
    /// samples.
    pub fn new(record: &Record, plant: &Plant, settings: &Settings) -> Result<Prepared> {
        check(settings, record)?;
        let cutoff = settings.cutoff.unwrap_or_else(|| common_cutoff([record]));
        let settings = &Settings {
            cutoff: Some(cutoff),
            ..settings.clone()
        };
        match record.periods() {
            Some((samples, count)) if settings.average && averaged(record).is_some() => {
                Self::periodic(record, plant, settings, samples, count)
            }
            _ => Self::aperiodic(record, plant, settings),
        }
    }

    fn aperiodic(record: &Record, plant: &Plant, settings: &Settings) -> Result<Prepared> {
        let rate = record.rate();
        let windows = match settings.thin {
            true => WINDOWS,
            false => usize::MAX,
        };
        let x = coordinates(record, plant, settings)?;
        let measured = measured_rates(record, plant, settings, &x)?;
        let dq = measured.as_ref().map(|m| &m.velocity);
        let ddq = measured.as_ref().and_then(|m| m.acceleration.as_ref());
        let (frequencies, motion) = match (dq, ddq) {
            (Some(dq), Some(ddq)) => {
                let all = |j: usize| [&x[j], &dq[j], &ddq[j]].map(Vec::clone);
                let all = (0..x.len()).map(all).collect();
                (vec![f64::INFINITY; x.len()], assemble(all))
            }
            (None, _) if settings.derivation == Derivation::Wiener => {
                let derived = |q: &Vec<f64>| {
                    let d = wiener::differentiated(q, &[0.0], q.len(), None, record.step);
                    (d.band, [d.motion.q, d.motion.qd, d.motion.qdd])
                };
                let (bands, all) = x.par_iter().map(derived).unzip();
                (bands, assemble(all))
            }
            _ => low_passed(&x, dq.map(Vec::as_slice), record.step, settings, windows)?,
        };
        let reason = match (dq, ddq, settings.position_cutoff) {
            (Some(_), Some(_), _) => "measured velocities and accelerations, taken as they are",
            (_, _, Some(_)) => "as asked for",
            (Some(_), None, _) => "least estimated error of the acceleration (measured velocities)",
            _ if settings.derivation == Derivation::Wiener => "the low-pass of the diagnosis",
            _ => "least estimated error of the acceleration, at most 2.5 cut-offs of the torque",
        };
        let mut valid = record.valid.clone();
        let highest = frequencies.iter().cloned().fold(0.0, f64::max);
        let coarse = Spectra::coarse(record.len(), rate, windows);
        let noise_of =
            |q: &Vec<f64>| cutoff::velocity_noise(coarse.floor(q), highest.min(0.5 * rate));
        let velocity_noise = match dq.and(record.dq.as_ref()) {
            // as measured, at most up to half the rate
            Some(dq) => (dq.iter())
                .map(|v| (coarse.floor(v) * highest.min(0.5 * rate)).sqrt())
                .collect(),
            None => record.q.iter().map(noise_of).collect(),
        };
        // the ends of a smoothed record are continued, not measured
        let lowest = frequencies.iter().cloned().fold(f64::INFINITY, f64::min);
        if lowest.is_finite() {
            let edge = ((0.5 * rate / lowest) as usize).min(valid.len() / 10);
            let n = valid.len();
            valid[..edge].fill(false);
            valid[n - edge..].fill(false);
        }
        finish(
            Prepared {
                name: record.name.clone(),
                purpose: record.purpose,
                rate,
                time: record.t.clone(),
                motion,
                torque: record.tau.concat(),
                actuators: record.actuators(),
                valid,
                periods: None,
                velocity_noise,
                position_cutoff: frequencies,
                cutoff_reason: reason.into(),
                filter: Decimator::new(f64::INFINITY, rate, &[], false),
                thin: None,
                warnings: Vec::new(),
            },
            settings,
        )
    }

    fn periodic(
        record: &Record,
        plant: &Plant,
        settings: &Settings,
        samples: usize,
        count: usize,
    ) -> Result<Prepared> {
        let mut warnings = Vec::new();
        if record.dq.is_some() && settings.measured_rates {
            warnings.push(Warning::new(WarningKind::ColumnsIgnored,
                record.path.display().to_string(),
                "its measured velocities (dq1…) were not used: the mean of the periods is differentiated in \
                 the frequency domain; without `period` in the experiment the record is taken as it is, with them",
            ));
        }
        let rate = record.rate();
        let period = samples as f64 * record.step;
        // from the end backwards: what is left over is the transient at the beginning
        let mut from = record.len() - samples * count;
        let mut count = count;
        if count > 2 && transient(&record.q, from, samples, count) {
            warnings.push(Warning::new(WarningKind::TransientLeftOut,
                record.path.display().to_string(),
                "the first period differs from the others by more than they do among themselves; it was \
                 left out of the mean",
            ));
            from += samples;
            count -= 1;
        }
        let cut = |channel: &[f64], p: usize| -> Vec<f64> {
            channel[from + p * samples..from + (p + 1) * samples].to_vec()
        };
        let split = |group: &[Vec<f64>]| -> Vec<Vec<f64>> {
            (0..count)
                .map(|p| group.iter().flat_map(|c| cut(c, p)).collect())
                .collect()
        };
        // a sample of the mean is sound where it is in every period
        let valid: Vec<bool> = (0..samples)
            .map(|i| (0..count).all(|p| record.valid[from + p * samples + i]))
            .collect();
        let torque = split(&record.tau);
        let position = split(&record.q);
        let x = coordinates(record, plant, settings)?;
        let series: Vec<(f64, Rates)> = x
            .par_iter()
            .map(|q| {
                if settings.derivation == Derivation::Wiener {
                    let all = &q[from..from + samples * count];
                    let cycles = Some((samples, samples * (count - 1)));
                    let d = wiener::differentiated(all, &[0.0], all.len(), cycles, record.step);
                    let x = d.motion;
                    let one = [x.q, x.qd, x.qdd].map(|x| x[..samples].to_vec());
                    return (if d.band > 0.0 { d.band } else { wiener::BAND }, one);
                }
                let parts: Vec<&[f64]> = (0..count)
                    .map(|p| &q[from + p * samples..from + (p + 1) * samples])
                    .collect();
                let (highest, frequency) = match settings.position_cutoff {
                    Some(f) => ((f * period).floor().max(1.0) as usize, f),
                    None => {
                        let (k, c) = cutoff::periodic(&parts, period);
                        let most = MARGIN * settings.cutoff.unwrap_or(f64::INFINITY);
                        match c.frequency <= most {
                            true => (k, c.frequency),
                            false => ((most * period).ceil() as usize, most),
                        }
                    }
                };
                (
                    frequency,
                    fourier::derivatives(&mean(&parts), period, highest),
                )
            })
            .collect();
        let n = record.actuators();
        let parts: Vec<&[f64]> = torque.iter().map(Vec::as_slice).collect();
        let average = mean(&parts);
        let has_torque = !record.tau.is_empty();
        let covariance = match has_torque {
            true => scatter(&torque, &average, n, samples),
            false => Mat::zeros(n, n),
        };
        let places: Vec<&[f64]> = position.iter().map(Vec::as_slice).collect();
        let noise = scatter(&position, &mean(&places), n, samples);
        let position_cutoff: Vec<f64> = series.iter().map(|s| s.0).collect();
        let highest = position_cutoff.iter().cloned().fold(0.0, f64::max);
        // white noise of the mean period
        let density = |a: usize| 2.0 * noise[(a, a)] / (rate * count as f64);
        let velocity_noise = (0..n)
            .map(|a| cutoff::velocity_noise(density(a), highest))
            .collect();
        let reason = match settings.position_cutoff {
            Some(_) => "as asked for",
            None if settings.derivation == Derivation::Wiener => {
                "harmonics weighted by how far they stand out of the scatter of the periods"
            }
            None => {
                "least estimated error of the acceleration, noise from the scatter of the periods"
            }
        };
        finish(
            Prepared {
                name: record.name.clone(),
                purpose: record.purpose,
                rate,
                time: (0..samples).map(|i| i as f64 * record.step).collect(),
                position_cutoff,
                velocity_noise,
                motion: assemble(series.into_iter().map(|s| s.1).collect()),
                torque: if has_torque { average } else { Vec::new() },
                actuators: n,
                valid,
                periods: Some(Periods {
                    count,
                    samples,
                    period,
                    torque,
                    position,
                    torque_covariance: covariance,
                    position_noise: (0..n).map(|a| noise[(a, a)].sqrt()).collect(),
                }),
                cutoff_reason: reason.into(),
                filter: Decimator::new(f64::INFINITY, rate, &[], true),
                thin: None,
                warnings,
            },
            settings,
        )
    }
}

/// Cut-offs, Hz, and low-passed positions with their derivatives; with measured velocities those, low-passed alike.
fn low_passed(
    x: &[Vec<f64>],
    dq: Option<&[Vec<f64>]>,
    step: f64,
    settings: &Settings,
    windows: usize,
) -> Result<(Vec<f64>, Samples)> {
    let (order, rate) = (settings.order, 1.0 / step);
    let count = x.first().map_or(0, Vec::len);
    let most = MARGIN * settings.cutoff.unwrap_or(f64::INFINITY);
    let cutoffs: Vec<f64> = match settings.position_cutoff {
        Some(f) => vec![f; x.len()],
        None => {
            let spectra = Spectra::fine(count, rate, windows);
            let of = |q: &Vec<f64>| cutoff::aperiodic(q, &spectra, order).frequency;
            let found = x.par_iter().map(of);
            found.map(|f| f.min(most).min(0.45 * rate)).collect()
        }
    };
    let low = |x: &[Vec<f64>]| butterworth::smooth(order, rate, &cutoffs, x);
    let q = low(x)?;
    let mut qdd = vec![0.0; q.len()];
    let rows = |x: &mut [f64], y: &[f64], derive: fn(&[f64], f64, &mut [f64])| {
        let rows = x.par_chunks_mut(count.max(1));
        (rows.zip(y.par_chunks(count.max(1)))).for_each(|(to, from)| derive(from, step, to));
    };
    let qd = match dq {
        Some(dq) => {
            let qd = low(dq)?;
            rows(&mut qdd, &qd, butterworth::first_derivative_into);
            qd
        }
        None => {
            let mut qd = vec![0.0; q.len()];
            rows(&mut qd, &q, butterworth::first_derivative_into);
            rows(&mut qdd, &q, butterworth::second_derivative_into);
            qd
        }
    };
    let motion = Samples {
        dof: x.len(),
        count,
        q,
        qd,
        qdd,
    };
    Ok((cutoffs, motion))
}

/// Whole periods of a record that is averaged: two or more, which make up at least nine tenths of it
/// (what is left over would be lost).
pub fn averaged(record: &Record) -> Option<usize> {
    let (samples, count) = record.periods()?;
    (count >= 2 && 10 * samples * count >= 9 * record.len()).then_some(count)
}

/// Whether the settings can be.
fn check(settings: &Settings, record: &Record) -> Result<()> {
    let half = 0.5 * record.rate();
    if let Some(f) = settings.position_cutoff
        && !(f > 0.0 && f < half)
    {
        return Err(Error::Argument(format!(
            "a cut-off of {f} Hz for the positions: {} is sampled with {:.6} Hz, so it must lie between 0 \
             and {half:.6} Hz",
            record.path.display(),
            record.rate()
        )));
    }
    if settings.derivation == Derivation::Wiener && settings.position_cutoff.is_some() {
        return Err(Error::Argument(
            "a cut-off of the positions belongs to the derivation \"low_pass\"; \"wiener\" weighs every \
             harmonic by its own noise: leave one of the two out"
                .into(),
        ));
    }
    if let Some(f) = settings.cutoff
        && (f.is_nan() || f <= 0.0)
    {
        return Err(Error::Argument(format!(
            "a cut-off of {f} Hz: it must be positive"
        )));
    }
    // infinity is how a caller leaves the filter out
    if let Some(f) = settings.cutoff
        && f.is_finite()
        && f >= half
    {
        return Err(Error::Argument(format!(
            "a cut-off of {f} Hz: {} is sampled with {:.6} Hz, so it must be below {half:.6} Hz",
            record.path.display(),
            record.rate()
        )));
    }
    Ok(())
}

/// Chooses the common filter from the cut-offs of the positions.
fn finish(mut p: Prepared, settings: &Settings) -> Result<Prepared> {
    let cutoff = settings.cutoff.unwrap_or(f64::INFINITY);
    let cyclic = p.periods.is_some();
    let most = match settings.thin && settings.derivation == Derivation::LowPass {
        true => thin_stride(&p, cutoff),
        false => 1,
    };
    let (filter, stride) = Decimator::with_stride(cutoff, p.rate, &p.valid, cyclic, most);
    p.filter = filter;
    let thin = p.filter.over_every(stride);
    p.thin = thin.map(|filter| Thin { stride, filter });
    if p.filter.outputs() < 4 {
        return Err(Error::Infeasible(format!(
            "record {}: after filtering at {cutoff:.3} Hz {} sound samples are left. A sample counts where all channels are \
             sound for as long as the filter reaches to either side: too many were dropped, or the cut-off is too low; a \
             higher --cutoff reaches less far",
            p.name,
            p.filter.outputs()
        )));
    }
    Ok(p)
}

/// Samples of the motion of which one is enough for the columns that are smooth in it: `1/(8 f)` apart, with the highest cut-off
/// `f` of the positions, or that of the filter if it is higher. Both passes of the smoother leave `1/(1 + 4⁸)` at half of that
/// rate.
fn thin_stride(p: &Prepared, cutoff: f64) -> usize {
    let highest = p.position_cutoff.iter().cloned().fold(cutoff, f64::max);
    ((p.rate / (DENSITY * highest)) as usize).max(1)
}

/// Velocities and accelerations of the coordinates where the log has those of the actuators and they
/// are wanted.
fn measured_rates(
    record: &Record,
    plant: &Plant,
    settings: &Settings,
    x: &[Vec<f64>],
) -> Result<Option<plant::Rates>> {
    let Some(dq) = record.dq.as_ref().filter(|_| settings.measured_rates) else {
        return Ok(None);
    };
    plant.rates_of(x, dq, record.ddq.as_deref()).map(Some)
}

/// Coordinates over the whole record.
fn coordinates<'a>(
    record: &'a Record,
    plant: &Plant,
    settings: &Settings,
) -> Result<Cow<'a, [Vec<f64>]>> {
    match (&record.pose, settings.measured_pose) {
        (_, false) => plant.coordinates_of(&record.q),
        (Some(pose), true) => plant.coordinates_of_pose(pose).map(Cow::Owned),
        (None, true) => Err(Error::Argument(format!(
            "{} has no pose columns x y z qw qx qy qz",
            record.path.display()
        ))),
    }
}

fn assemble(series: Vec<Rates>) -> Samples {
    let count = series.first().map_or(0, |s| s[0].len());
    let all = |k: usize| {
        let mut out = Vec::with_capacity(series.len() * count);
        series.iter().for_each(|s| out.extend_from_slice(&s[k]));
        out
    };
    let ([q, qd], qdd) = rayon::join(|| [all(0), all(1)], || all(2));
    Samples {
        dof: series.len(),
        count,
        q,
        qd,
        qdd,
    }
}

/// Mean of signals of one length, sample by sample.
pub(crate) fn mean(parts: &[&[f64]]) -> Vec<f64> {
    let n = parts.first().map_or(0, |p| p.len());
    (0..n)
        .map(|i| parts.iter().map(|p| p[i]).sum::<f64>() / parts.len() as f64)
        .collect()
}

/// Covariance between channels of the deviations of each period from the mean.
fn scatter(parts: &[Vec<f64>], mean: &[f64], n: usize, samples: usize) -> Mat<f64> {
    let freedom = ((parts.len() - 1) * samples).max(1) as f64;
    Mat::from_fn(n, n, |a, b| {
        let sum: f64 = parts
            .iter()
            .map(|p| {
                (0..samples)
                    .map(|i| {
                        let (u, v) = (a * samples + i, b * samples + i);
                        (p[u] - mean[u]) * (p[v] - mean[v])
                    })
                    .sum::<f64>()
            })
            .sum();
        sum / freedom
    })
}

/// Whether the first period is unlike the others.
fn transient(q: &[Vec<f64>], from: usize, samples: usize, count: usize) -> bool {
    let scaled: Vec<(&Vec<f64>, f64)> = q
        .iter()
        .map(|c| (c, c.iter().fold(0.0f64, |m, x| m.max(x.abs())).max(1e-12)))
        .collect();
    let far = |a: usize, b: usize| -> f64 {
        scaled
            .iter()
            .map(|(c, range)| {
                let (a, b) = (from + a * samples, from + b * samples);
                (0..samples)
                    .map(|i| ((c[a + i] - c[b + i]) / range).powi(2))
                    .sum::<f64>()
            })
            .sum()
    };
    let first = (1..count).map(|p| far(0, p)).sum::<f64>() / (count - 1) as f64;
    // the mean over all pairs of `n` periods is 2/(n - 1) times the scatter about the mean period
    let n = (count - 1) as f64;
    let scatter: f64 = scaled
        .iter()
        .map(|(c, range)| {
            (0..samples)
                .map(|i| {
                    let values = (1..count).map(|p| c[from + p * samples + i] / range);
                    let mean = values.clone().sum::<f64>() / n;
                    values.map(|x| (x - mean).powi(2)).sum::<f64>()
                })
                .sum::<f64>()
        })
        .sum();
    let others = 2.0 * scatter / (n - 1.0).max(1.0);
    first > 9.0 * others + 1e-16 * samples as f64
}
