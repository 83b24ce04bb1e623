//! A record as a triangular factor that adds by QR and gives the same estimate.
//!
//! Weighted least squares asks of a record for sums of products of its equations, of one actuator and of two: those of
//! two make the covariance of the residual, which is known only when all records are there. So the equations of all
//! actuators at a sample stand side by side in one row:
//!
//! ```text
//! v_k = [w_1 τ_1 … w_n τ_n]_k        w_a: row of W_b of actuator a, its columns that are not zero
//! [v_1; v_2; …] = Q R                Σ_k v_kᵀ v_k = Rᵀ R
//! [R'; R''] = Q R                    records together
//! ```
//!
//! The rows of `R` are as good as samples: any weights, residual and base parameters that are made of sums of products
//! come out of them as of the samples. The contiguous parts that the cross-validation of the prior leaves out in turn have
//! factors of each actuator alone, and so have the records that are only predicted: [`Factor`].

use super::breakaway;
use super::cross_validation::FOLDS;
use super::equations::{self, Equations};
use super::factor::{self, Factor, Header, Part, columns_of};
use super::linear::{self, Weights};
use super::merge;
use super::method;
use super::settings::{Method, Settings};
use super::stack::Stack;
use super::uncertainty;
use crate::base::BaseParameters;
use crate::error::{Result, Warning, WarningKind};
use crate::log::{Purpose, Record};
use crate::plant::Plant;
use crate::signals::fourier;
use faer::{ColRef, Mat};
use std::borrow::Cow;

/// Rows that are factored at once, over the columns.
const CHUNK: usize = 8;

/// Condenses records, those for the fit and the holdout ones apart.
///
/// Joints that stand still are left out as in [`identify`](super::identify), and what goes with another joint is fitted
/// aside where these records show it. The warnings go with the factor.
///
/// # Errors
/// As [`identify`](super::identify).
pub fn condense(
    plant: &Plant,
    spec: &str,
    asked: Option<&[String]>,
    records: &[Record],
    settings: &Settings,
) -> Result<Factor> {
    let mut warnings = Vec::new();
    if !breakaway::asked(plant).is_empty() {
        warnings.push(Warning::new(
            WarningKind::NotIdentifiable,
            "breakaway friction",
            "it is asked for, but it is not linear and no factor holds it: identify it from the logs themselves",
        ));
    }
    let records = equations::usable(records, &mut warnings)?;
    let settings = equations::one_filter(&records, settings);
    of_records(
        plant,
        &plant.base()?,
        spec,
        asked,
        records,
        &settings,
        true,
        warnings,
    )
}

/// The same of records without payload, for the fit or not, with a cut-off that is chosen; `correlated` says whether the
/// variance through correlation in time is looked for.
///
/// # Errors
/// As [`condense`].
#[allow(clippy::too_many_arguments)]
pub(super) fn of_records(
    plant: &Plant,
    base: &BaseParameters,
    spec: &str,
    asked: Option<&[String]>,
    records: Vec<&Record>,
    settings: &Settings,
    correlated: bool,
    mut warnings: Vec<Warning>,
) -> Result<Factor> {
    let mut all = Equations::new(plant, base, &settings.signals, records)?;
    warnings.extend(all.prepared.iter().flat_map(|p| p.warnings.clone()));
    let (mut a, mut folds) = part(&[], FOLDS);
    let mut together = None;
    let (fitted, others): (Vec<Stack>, Vec<Stack>) =
        (std::mem::take(&mut all.stacks).into_iter()).partition(|s| s.purpose == Purpose::Fit);
    if !fitted.is_empty() {
        let mut fit = all.fit_of(fitted.into_iter().map(Cow::Owned).collect())?;
        warnings.extend(fit.unit_suspicions());
        fit.keep_moving(&mut warnings)?;
        let mut solved = Solved::new(&fit.stacks(), base.count())?;
        if fit.set_aside(&solved.estimate.pi, &mut warnings)? {
            solved = Solved::new(&fit.stacks(), base.count())?;
        }
        let Solved {
            part,
            folds: of_folds,
            together: of_all,
            rows,
            estimate,
        } = solved;
        (a, folds, together) = (part, of_folds, Some(of_all));
        let stacks = fit.stacks();
        for s in stacks.iter().filter(|_| correlated) {
            let inflation = match stacks.len() {
                // the estimate from all records is that of the only one
                1 => inflation(s, &estimate.weights, &estimate.pi, &rows)?,
                _ => {
                    let own = method::of_stacks(&[s], Method::Wls)?;
                    inflation(s, &own.weights, &own.pi, s)?
                }
            };
            a.inflated += s.equations() as f64 * inflation;
        }
    }
    let others: Vec<&Stack> = others.iter().collect();
    let (b, tests) = part(&others, 1);
    let alone = [(&a, &folds), (&b, &tests)].map(|(part, each)| {
        let of = |m: &Mat<f64>| columns_of(part, m).iter().map(triangle).collect();
        each.iter().map(of).collect()
    });
    let header = Header {
        robot: spec.into(),
        hash: plant.robot().hash.clone(),
        identify: asked.map(<[String]>::to_vec),
        names: (0..base.count())
            .map(|k| base.name(k).to_string())
            .collect(),
        cutoff: settings.signals.cutoff.unwrap_or(f64::NAN),
        average: settings.signals.average,
        derive: !settings.signals.measured_rates,
        warnings,
        parts: [a, b],
    };
    Ok(Factor {
        header,
        together: together.unwrap_or_else(|| linear::factor(&folds)),
        alone,
    })
}

fn triangle(columns: &Mat<f64>) -> Mat<f64> {
    linear::factor(std::slice::from_ref(columns))
}

/// Records for the fit: condensed, and the estimate that this gives.
struct Solved {
    part: Part,
    folds: Vec<Mat<f64>>,
    /// the triangle of all of them
    together: Mat<f64>,
    /// rows that are as good as those of the records
    rows: Stack,
    estimate: merge::Estimate,
}

impl Solved {
    /// With so many base parameters.
    fn new(stacks: &[&Stack], count: usize) -> Result<Solved> {
        let (part, folds) = part(stacks, FOLDS);
        let together = linear::factor(&folds);
        let columns = columns_of(&part, &together);
        let rows = factor::equations(&part, Purpose::Fit, count, &columns);
        Ok(Solved {
            estimate: merge::estimate(&rows, &part, Method::Wls)?,
            part,
            folds,
            together,
            rows,
        })
    }
}

/// What is said of records, and the factor of each fold.
fn part(stacks: &[&Stack], folds: usize) -> (Part, Vec<Mat<f64>>) {
    let n = stacks.first().map_or(0, |s| s.actuators);
    let b = stacks.first().map_or(0, |s| s.w.ncols());
    let right: Vec<Vec<f64>> = stacks.iter().map(|s| s.tau()).collect();
    let mut columns = Vec::new();
    for a in 0..n {
        for c in 0..b {
            let holds = |s: &Stack| (a * s.count..(a + 1) * s.count).any(|i| s.w[(i, c)] != 0.0);
            if stacks.iter().copied().any(holds) {
                columns.push([a, c]);
            }
        }
        columns.push([a, b]);
    }
    let k = columns.len();
    let mut out = Vec::new();
    for f in 0..folds {
        let mut sum: Option<Mat<f64>> = None;
        for (r, s) in stacks.iter().enumerate() {
            let (from, to) = (f * s.count / folds, (f + 1) * s.count / folds);
            for start in (from..to).step_by((CHUNK * k).max(1)) {
                let count = (CHUNK * k).min(to - start);
                let mut rows = Mat::<f64>::zeros(count, k);
                for (j, &[a, c]) in columns.iter().enumerate() {
                    let from = a * s.count + start;
                    let from = match c < b {
                        true => s.w.as_ref().subrows(from, count).col(c),
                        false => ColRef::from_slice(&right[r][from..from + count]),
                    };
                    rows.as_mut().col_mut(j).copy_from(from);
                }
                let both: Vec<Mat<f64>> = sum.into_iter().chain([rows]).collect();
                sum = Some(linear::factor(&both));
            }
        }
        out.push(sum.unwrap_or_else(|| Mat::zeros(k, k)));
    }
    let sums = |f: &dyn Fn(&Stack, usize) -> f64, join: fn(f64, f64) -> f64| -> Vec<f64> {
        let each = |a: usize| stacks.iter().map(|s| f(s, a)).fold(0.0, join);
        (0..n).map(each).collect()
    };
    let torque = |s: &Stack, a: usize| s.measured[a * s.count..(a + 1) * s.count].to_vec();
    let part = Part {
        records: stacks.iter().map(|s| s.name.clone()).collect(),
        columns,
        folds,
        used: sums(&|s, a| s.used(a) as f64, |x, y| x + y),
        largest: sums(
            &|s, a| torque(s, a).iter().fold(0.0, |m: f64, x| m.max(x.abs())),
            f64::max,
        ),
        energy: sums(&|s, a| torque(s, a).iter().map(|x| x * x).sum(), |x, y| {
            x + y
        }),
        inflated: 0.0,
    };
    (part, out)
}

/// Variance through correlation in time of a record, with its estimate, and equations that are as good as its own for all
/// that does not depend on their order.
fn inflation(stack: &Stack, weights: &Weights, pi: &[f64], rows: &Stack) -> Result<f64> {
    let factor = linear::factor(&linear::fold_factors(&[rows], weights, 1));
    let r = linear::solve(factor.as_ref())?.r;
    let found = uncertainty::covariance_within(&[stack], weights, pi, r.as_ref(), fourier::quick)?;
    Ok(found.inflation.max(1.0))
}
