//! Identification: from records to parameters that can be trusted.
//!
//! ```text
//! records ─ signals ─▶ W_b, τ ─ method ─▶ π̂, Λ ─ prior, consistency ─▶ φ ─▶ report
//! ```
//!
//! 1. `equations`: the filtered equations `W_b π = τ` of each record (`stack`).
//!    Those of joints that stand still are left out of the fit (`standstill`).
//! 2. `method`: base parameters `π̂` by the chosen [`Method`](parts::Method), from rows compressed by blocks
//!    (`linear`). What follows another joint is fitted aside (`aside`).
//! 3. `normal`: their information `Λ`, and their covariance with the residual's correlation in time
//!    (`uncertainty`).
//! 4. `standard`: standard parameters that a robot can have (`consistent`, `lmi`); the strength of
//!    the prior is chosen by `cross_validation` over contiguous parts of the fit records.
//! 5. `essential`: the base parameters that matter.
//! 6. `validation`: residuals on fit and holdout records.
//!
//! [`condense`](condense()) reduces records to triangular factors, from which [`merge`](merge()) identifies. Logs that
//! are longer than the memory go that way part by part (`in_parts`).

pub(crate) mod aside;
mod breakaway;
pub(crate) mod condense;
pub(crate) mod consistent;
pub(crate) mod cross_validation;
pub(crate) mod doubts;
pub(crate) mod equations;
pub(crate) mod essential;
pub(crate) mod factor;
mod factor_file;
pub(crate) mod followers;
pub(crate) mod identification;
mod in_parts;
#[doc(hidden)]
pub mod json;
pub(crate) mod linear;
pub(crate) mod lmi;
pub(crate) mod merge;
mod merge_page;
pub(crate) mod method;
pub(crate) mod normal;
#[doc(hidden)]
pub mod page;
pub mod parts;
pub(crate) mod settings;
pub(crate) mod stack;
pub(crate) mod standard;
pub(crate) mod standstill;
pub(crate) mod torque_units;
pub(crate) mod trace;
pub(crate) mod uncertainty;
pub(crate) mod validation;
pub(crate) mod weights;

pub use condense::condense;
pub use factor::Factor;
pub use identification::Identification;
#[doc(hidden)]
pub use in_parts::{condense_parts, identify_parts};
pub use merge::merge;
pub(crate) use settings::Consistency;
pub use settings::Settings;

use crate::error::Result;
use crate::log::Record;
use crate::plant::Plant;
use equations::Equations;
use normal::Normal;

/// Identifies a plant from records.
///
/// ```
/// use excite::Plant;
/// use excite::identify::{Settings, identify};
/// use excite::log::parts::Purpose;
/// use excite::simulate::{Settings as Simulation, measure, simulate, to_record};
/// use excite::simulate::parts::Sensors;
///
/// // a rehearsal: design, simulate, measure
/// let plant = Plant::load("planar2")?;
/// let settings = excite::design::Settings::default().with(|set| set.starts = Some(1));
/// let motion = excite::design::design(&plant, &settings)?.trajectory.fourier;
/// let settings = Simulation::default();
/// let run = simulate(&plant, &motion, 3, &settings, &|_| {})?;
/// let measured = measure(&run, &Sensors::new(&plant, 1.0).0, &settings.effects, 1);
/// let record = to_record(&run, &measured, Purpose::Fit, motion.period);
///
/// let found = identify(&plant, &[record], &Settings::default())?;
/// for (a, pi) in found.pi.iter().enumerate() {
///     println!("{} = {pi:.4} ± {:.4}", found.base.combination(a), found.std[a]);
/// }
/// assert_eq!(found.pi.len(), found.base.count());
/// # Ok::<(), excite::Error>(())
/// ```
///
/// # Errors
/// No record for the fit, settings that cannot be, records that carry an unknown payload.
pub fn identify(plant: &Plant, records: &[Record], settings: &Settings) -> Result<Identification> {
    if breakaway::asked(plant).is_empty() {
        return linear_part(plant, records, settings);
    }
    let found = breakaway::find(plant, records, settings)?;
    let plant = breakaway::with(plant, &found.all);
    let mut id = linear_part(&plant, records, settings)?;
    found.carry(&plant, &mut id);
    Ok(id)
}

/// All that is linear in its parameters, breakaway friction being known.
fn linear_part(plant: &Plant, records: &[Record], settings: &Settings) -> Result<Identification> {
    let mut warnings = plant.warnings().to_vec();
    let records = equations::usable(records, &mut warnings)?;
    let settings = equations::one_filter(&records, settings);
    let base = plant.base()?;
    warnings.extend(base.warnings.iter().cloned());

    let equations = Equations::new(plant, &base, &settings.signals, records)?;
    warnings.extend(equations.prepared.iter().flat_map(|p| p.warnings.clone()));
    let mut fit = equations.fit()?;
    warnings.extend(fit.unit_suspicions());
    fit.keep_moving(&mut warnings)?;

    let estimate = method::estimate(&mut fit, settings.method, &mut warnings)?;
    let normal = Normal::new(&fit, &estimate)?;
    warnings.extend(normal.warning(&base));
    let standard = standard::estimate(plant, &base, &normal, &settings, &mut warnings)?;
    let essential = essential::reduce(normal.factor.as_ref(), fit.equations(), normal.inflation)?;
    let models = [&normal.pi, &standard.pi, &essential.pi];
    let validation = validation::validate(&equations, models.map(Vec::as_slice))?;

    let mut found = Identification {
        scene: None,
        std: normal.std(),
        predicted_std: uncertainty::predicted(plant, &fit.stacks())?,
        residual_covariance: weights::residual_covariance(&fit.stacks(), &normal.pi),
        pi: normal.pi,
        covariance: normal.covariance,
        inflation: normal.inflation,
        condition: normal.condition,
        phi: standard.phi,
        pi_consistent: standard.pi,
        phi_std: standard.std,
        prior_strength: standard.strength,
        trials: standard.trials,
        margin: standard.margin,
        consistent: standard.consistent,
        outliers: estimate.outliers,
        breakaway: Vec::new(),
        prepared: equations.prepared,
        essential,
        validation,
        in_parts: Vec::new(),
        warnings,
        base,
    };
    let doubts = doubts::doubts(plant, &found);
    found.warnings.extend(doubts);
    Ok(found)
}
