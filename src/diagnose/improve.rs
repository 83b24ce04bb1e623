//! The model with what was found.
//!
//! The parameters fitted beside the effects need not be those of bodies that can exist: the records leave
//! many of them free within the prior. Of all that can, the nearest are taken in the metric of the
//! information `Λ = WᵀW + P⁻¹`, in which what the records do not see costs nothing,
//!
//! ```text
//! minimise over φ   ½ (φ − φ̂)ᵀ Λ (φ − φ̂) + d(φ ‖ φ₀)
//! ```
//!
//! with the entropic distance `d` of [`consistent`], the barrier that keeps
//! every body inside.

use super::catalogue::{self, Context, Effect, Estimate, Value};
use super::evidence::Evidence;
use super::finding::{Finding, names};
use super::forward::effects_torque;
use super::gap;
use super::thresholds::THRESHOLDS as T;
use crate::error::{Warning, WarningKind};
use crate::export::{self, Remark};
use crate::identify::consistent::{self, Prior};
use crate::plant::Plant;
use crate::robot::Robot;

/// The improved model.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Improved {
    /// bodies and joints with the parameters that were fitted and the effects that they can hold; not
    /// serialised, the writers of [`export`](crate::export) write it
    #[serde(skip)]
    pub robot: Robot,
    /// the effects found
    pub remarks: Vec<Remark>,
    /// where MuJoCo's files hold each of them, and how
    pub in_mujoco: Vec<String>,
    /// names of the robot files that hold it
    pub files: Vec<&'static str>,
    /// a file of the user with the model in it
    pub scene: Option<export::Edited>,
}

/// The improved model as it can be simulated along the records.
pub struct Made {
    /// the model for the files
    pub improved: Improved,
    /// parameters that go with the torque of its effects
    pub phi: Vec<f64>,
    /// that torque along the recorded motions, by actuator
    pub torque: Vec<Vec<f64>>,
    /// what is not as it was fitted
    pub warnings: Vec<Warning>,
}

/// The robot with the parameters `phi` of the fit and what was claimed. The nominal one where, as it stands in the files,
/// less of the records that were not fitted is left with that: `nominal` are its parameters, `frozen` the gap to it.
pub fn improve(
    evidence: &Evidence,
    cx: &Context,
    effects: &[Box<dyn Effect>],
    [nominal, phi]: [&[f64]; 2],
    findings: &[Finding],
    frozen: &[Vec<f64>],
) -> Made {
    let (data, plant) = (cx.data, cx.data.plant);
    let count = plant.parameters().len();
    let left = |e: &[Vec<f64>]| -> f64 {
        let held = gap::energies(data, &gap::scaled(data, e), |r| !r.fit);
        held.iter().flatten().sum()
    };
    let claims: Vec<Claim> = findings
        .iter()
        .filter(|f| f.is_claim())
        .filter_map(|f| Some((catalogue::named(effects, f.effect)?, estimate(f))))
        .collect();
    let found = written(evidence, cx, &phi[..count], &claims);
    let claimed = claims
        .iter()
        .map(|(effect, e)| (*effect, e.place, &e.shape, &e.eta[..]));
    let made = |written: Written, phi: &[f64], torque: Vec<Vec<f64>>| {
        let mut phi = data.without_allowance(phi);
        phi[..count].copy_from_slice(&written.values);
        let (improved, warnings) = written.improved(plant);
        Made {
            improved,
            phi,
            torque,
            warnings,
        }
    };
    let added = effects_torque(cx, claimed);
    let found = made(found, phi, added);
    if !data.predicts() {
        return found;
    }
    let mut torque = data.model_torque(&found.phi);
    for (row, more) in torque.iter_mut().zip(&found.torque) {
        row.iter_mut().zip(more).for_each(|(t, v)| *t += v);
    }
    let [before, after] = [left(frozen), left(&data.gap_that_counts(&torque))];
    if after <= before + data.joints() as f64 * T.improved.seen.powi(2) {
        return found;
    }
    // a file that predicts worse than the model that is there helps nobody
    let as_it_was = written(evidence, cx, &nominal[..count], &[]);
    let none = vec![vec![0.0; data.rows()]; data.joints()];
    let mut kept = made(as_it_was, nominal, none);
    kept.warnings.push(Warning::new(
        WarningKind::WorseThanNominal,
        plant.name(),
        match before {
            gap if gap > 0.0 => format!(
                "with what was fitted {:.2} times the gap of the nominal model is left on holdout records; the \
                 robot files hold the nominal model",
                after / gap
            ),
            _ => "with what was fitted more is left on holdout records than with the nominal model, which leaves \
                  nothing but noise there; the robot files hold the nominal model"
                .to_string(),
        },
    ));
    kept
}

/// An effect that a model has.
pub(super) type Claim<'e> = (&'e dyn Effect, Estimate);

/// A finding as it was fitted.
fn estimate(f: &Finding) -> Estimate {
    Estimate {
        place: f.place,
        shape: f.shape.clone(),
        eta: f.eta.clone(),
        std: vec![0.0; f.eta.len()],
    }
}

/// A model for the files.
pub(super) struct Written {
    /// bodies and joints
    pub robot: Robot,
    /// its effects
    pub remarks: Vec<Remark>,
    /// what is not as it was fitted
    pub warnings: Vec<Warning>,
    /// whether its bodies can exist
    pub able: bool,
    /// parameters that go with the torque of the effects: those fitted, with what bodies that can exist change of them
    pub values: Vec<f64>,
}

impl Written {
    /// The improved model, and what is not as it was fitted.
    fn improved(self, plant: &Plant) -> (Improved, Vec<Warning>) {
        let files = export::needed(&export::Model {
            plant,
            robot: &self.robot,
            remarks: &self.remarks,
        });
        let improved = Improved {
            in_mujoco: self.remarks.iter().map(|r| r.in_files(plant)).collect(),
            robot: self.robot,
            remarks: self.remarks,
            files,
            scene: None,
        };
        (improved, self.warnings)
    }
}

/// The model with parameters and effects as files hold it.
pub(super) fn written(
    evidence: &Evidence,
    cx: &Context,
    phi: &[f64],
    effects: &[Claim],
) -> Written {
    let plant = cx.data.plant;
    let mut robot = plant.with_values(phi);
    let mut remarks = Vec::new();
    for (effect, estimate) in effects {
        let card = effect.card();
        let joints = names(cx, &estimate.place);
        let values = effect.values(cx, estimate);
        remarks.push(Remark {
            effect: card.name,
            place: match joints.is_empty() {
                true => "whole robot".to_string(),
                false => joints.join(", "),
            },
            equation: card.equation,
            values: values.iter().map(Value::line).collect(),
            held: effect.apply(cx, estimate, &mut robot),
            element: catalogue::element(cx, *effect, estimate),
        });
    }
    let fitted = plant.values_in(&robot);
    let (able, warnings) = able(plant, evidence, &mut robot);
    let moved = plant.values_in(&robot);
    let moved = moved.iter().zip(&fitted).map(|(a, b)| a - b);
    let values = phi.iter().zip(moved).map(|(x, m)| x + m).collect();
    Written {
        robot,
        remarks,
        warnings,
        able,
        values,
    }
}

/// Turns the bodies of a robot into such that can exist, and whether that was possible.
fn able(plant: &Plant, evidence: &Evidence, robot: &mut Robot) -> (bool, Vec<Warning>) {
    let wanted = plant.values_in(robot);
    let mut same = robot.clone();
    plant.set_values(&mut same, &wanted);
    // values that the unknowns cannot hold are left to the writers
    let held = same
        .bodies
        .iter()
        .zip(&robot.bodies)
        .all(|(a, b)| a.inertia == b.inertia);
    if !held || export::impossible(plant, robot).is_empty() {
        return (true, Vec::new());
    }
    let c = evidence.information(wanted.len());
    let d: Vec<f64> = (0..c.nrows())
        .map(|i| (0..wanted.len()).map(|k| c[(i, k)] * wanted[k]).sum())
        .collect();
    let prior = Prior::new(plant, &|_| None);
    match consistent::solve(c.as_ref(), &d, &prior, 1.0, None) {
        Ok(found) => {
            plant.set_values(robot, &found.phi);
            let cost: f64 = (0..c.nrows())
                .map(|i| {
                    (0..wanted.len())
                        .map(|k| c[(i, k)] * found.phi[k])
                        .sum::<f64>()
                        - d[i]
                })
                .map(|e| e * e)
                .sum();
            let rows = (evidence.data.fitted * evidence.data.joints()).max(1) as f64;
            let rms = (cost / rows).sqrt();
            let seen = (rms > T.improved.seen).then(|| {
                Warning::new(
                    WarningKind::InertiaImpossible,
                    &robot.name,
                    format!(
                        "the parameters that fit best are not those of bodies that can exist; those in the robot \
                         files can, and leave {rms:.2} times the noise more"
                    ),
                )
            });
            (true, seen.into_iter().collect())
        }
        Err(e) => {
            let none = Warning::new(
                WarningKind::InertiaImpossible,
                &robot.name,
                format!(
                    "no bodies that can exist were found for the parameters of the robot files: {e}"
                ),
            );
            (false, vec![none])
        }
    }
}
