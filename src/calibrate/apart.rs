//! Known distances between points that all other rows contradict: files exchanged, or a number that is wrong.
//!
//! Two sockets are some centimetres apart, the robot is known to some millimetres. So the rows alone, with the tolerances
//! for the scale, tell every distance to a fraction of a millimetre, and a stated one can be held against that.

use super::bench::Bench;
use super::file::{Calibration, Distance};
use super::kind::Kind;
use super::model::{Model, Settings};
use super::open::Opened;
use super::{fit, judge, robust};
use crate::error::{Error, Result, Warning, WarningKind, number};
use faer::Mat;
use nalgebra::Vector3;
use std::borrow::Cow;

/// A stated distance is off where it differs from that of the rows by so many standard deviations,
const FAR: f64 = 5.0;
/// by so many times what the rows leave, for what is not geometry shifts a socket, too,
const ROUGH: f64 = 3.0;
/// and by such a share of the tolerance of a length.
const LITTLE: f64 = 0.5;

/// The points as all rows have them without any known distance.
struct Points {
    /// by measurement
    at: Vec<Vector3<f64>>,
    /// first unknown of each
    columns: Vec<Option<usize>>,
    covariance: Mat<f64>,
    /// no smaller difference tells anything, m
    least: f64,
}

impl Points {
    fn new(model: &Model, x: &[f64], covariance: Mat<f64>) -> Self {
        let errors = judge::errors(model, x).robust;
        let rows = model.input.rows.iter().zip(errors);
        let own = rows
            .filter(|(r, _)| r.fit && model.input.measurements[r.measurement].kind == Kind::Point);
        Points {
            at: (0..model.input.measurements.len())
                .map(|m| model.socket(m, x))
                .collect(),
            columns: model.layout.contact.clone(),
            covariance,
            least: (ROUGH * crate::median::median(own.map(|(_, e)| e)))
                .max(LITTLE * model.input.prior.length),
        }
    }

    /// Distance of two points and its standard deviation, m.
    fn between(&self, [a, b]: [usize; 2]) -> Option<(f64, f64)> {
        let (ca, cb) = (self.columns[a]?, self.columns[b]?);
        let apart = self.at[a] - self.at[b];
        let length = apart.norm();
        let c = &self.covariance;
        let mut square = 0.0;
        for i in 0..3 {
            for j in 0..3 {
                let both = c[(ca + i, ca + j)] + c[(cb + i, cb + j)]
                    - c[(ca + i, cb + j)]
                    - c[(cb + i, ca + j)];
                // points in one place have no direction: the worst one counts
                square += match length > 1e-6 {
                    true => apart[i] * apart[j] / (length * length) * both,
                    false => f64::from(u8::from(i == j)) * both,
                };
            }
        }
        Some((length, square.max(0.0).sqrt()))
    }

    /// Whether a stated distance cannot be.
    fn contradicts(&self, d: &Distance) -> bool {
        self.between(d.between).is_some_and(|(found, std)| {
            let off = (found - d.value).abs();
            off > FAR * std.hypot(d.std) && off > self.least
        })
    }
}

/// Pairs of files of points that, exchanged, would make all distances right.
fn exchanged(input: &Calibration, points: &Points) -> Vec<[usize; 2]> {
    let known: Vec<usize> = (0..input.measurements.len())
        .filter(|&m| points.columns[m].is_some() && input.measurements[m].kind == Kind::Point)
        .collect();
    let right = |a: usize, b: usize| {
        let swap = |m: usize| match m {
            m if m == a => b,
            m if m == b => a,
            m => m,
        };
        input.distances.iter().all(|d| {
            let between = d.between.map(swap);
            !points.contradicts(&Distance {
                between,
                ..d.clone()
            })
        })
    };
    let mut pairs = Vec::new();
    for (k, &a) in known.iter().enumerate() {
        pairs.extend(
            known[k + 1..]
                .iter()
                .filter(|&&b| right(a, b))
                .map(|&b| [a, b]),
        );
    }
    pairs
}

/// The calibration without the distances that its rows contradict, each with a warning.
///
/// # Errors
/// More than half of the distances are so.
pub(super) fn sound<'a>(
    input: &'a Calibration,
    opened: &Opened,
    settings: Settings,
    warnings: &mut Vec<Warning>,
) -> Result<Cow<'a, Calibration>> {
    if input.distances.is_empty() {
        return Ok(Cow::Borrowed(input));
    }
    let mut free = input.clone();
    free.distances.clear();
    let bench = Bench::new(&free, opened, settings, &mut Vec::new())?;
    let mut model = bench.model(Vec::new());
    let mut plan = bench.plan(&model);
    let x = robust::set_up(&model, &plan, &vec![0.0; model.count()])?;
    plan.free = robust::seen(&model, &plan);
    let fit = robust::robustly(&mut model, &mut plan, &x)?;
    let Some(covariance) = fit::covariance(&model, &plan, &fit.x) else {
        return Ok(Cow::Borrowed(input));
    };
    let points = Points::new(&model, &fit.x, covariance);
    let off: Vec<usize> = (0..input.distances.len())
        .filter(|&k| points.contradicts(&input.distances[k]))
        .collect();
    let Some(&first) = off.first() else {
        return Ok(Cow::Borrowed(input));
    };
    let file = |m: usize| input.measurements[m].file.as_str();
    let pairs = exchanged(input, &points);
    let why = match pairs[..] {
        [] => "is the number in m, and are these the two files?".to_string(),
        _ => {
            let each: Vec<String> = pairs
                .iter()
                .take(2)
                .map(|&[a, b]| format!("{} and {}", file(a), file(b)))
                .collect();
            format!(
                "all distances would be right if {} had been exchanged: name each file after its own point",
                each.join(", or ")
            )
        }
    };
    let said = |k: usize| {
        let d = &input.distances[k];
        let (found, std) = points.between(d.between).unwrap_or((f64::NAN, f64::NAN));
        format!(
            "{} mm are stated, but by all rows the points are {} mm apart (± {}); {why}",
            number(1e3 * d.value),
            number((1e4 * found).round() / 10.0),
            number((1e5 * std).round() / 100.0)
        )
    };
    let named = |k: usize| {
        let [a, b] = input.distances[k].between.map(file);
        format!("distance between {a} and {b}")
    };
    if 2 * off.len() > input.distances.len() {
        return Err(Error::file(&input.path, named(first), said(first)));
    }
    for &k in &off {
        let message = format!("left out: {}", said(k));
        warnings.push(Warning::new(WarningKind::RecordLeftOut, named(k), message));
    }
    let sound = (0..input.distances.len()).filter(|k| !off.contains(k));
    free.distances = sound.map(|k| input.distances[k].clone()).collect();
    Ok(Cow::Owned(free))
}
