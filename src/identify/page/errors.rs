//! Errors of the torque: by joint, by model, and what they go with.

use super::force;
use crate::identify::Identification;
use crate::plant::Plant;
use crate::report::format::{percent, with_unit};
use crate::report::html::{self, Section};
use maud::{Markup, html};

pub(super) fn residuals(plant: &Plant, id: &Identification) -> Section {
    let joints = plant.actuators();
    let v = &id.validation;
    let rows: Vec<Vec<Markup>> = joints
        .iter()
        .enumerate()
        .map(|(a, j)| {
            let unit = force(j.motion);
            let fit = &v.fit.joints[a];
            let mut row = vec![
                html! { (j.name) },
                html! { (with_unit(fit.rms, 3, unit)) },
                html! { (percent(fit.relative_error)) },
            ];
            if let Some(h) = &v.holdout {
                row.push(html! { (with_unit(h.joints[a].rms, 3, unit)) });
                row.push(html! { (percent(h.joints[a].relative_error)) });
            }
            row.push(match j.torque_noise {
                Some(x) => html! { (with_unit(x, 2, unit)) },
                None => html! { "–" },
            });
            row
        })
        .collect();
    let head: &[&str] = match v.holdout {
        Some(_) => &[
            "joint",
            "fit rms",
            "fit",
            "holdout rms",
            "holdout",
            "stated noise",
        ],
        None => &["joint", "fit rms", "fit", "stated noise"],
    };
    let models = [
        ("nominal", v.nominal),
        ("least squares alone", v.plain),
        ("essential parameters alone", v.essential),
        (
            "this model",
            (
                v.fit.relative_error,
                v.holdout.as_ref().map(|h| h.relative_error),
            ),
        ),
    ];
    let compare: Vec<Vec<Markup>> = models
        .iter()
        .map(|(name, (fit, holdout))| {
            vec![
                html! { (name) },
                html! { (percent(*fit)) },
                html! { @match holdout { Some(x) => (percent(*x)), None => "–" } },
            ]
        })
        .collect();
    Section::new(
        "What is left",
        html! {
            p { "Norm of the residual over the norm of the measured torque, as recorded, after the filter that \
                 both pass." }
            (html::table(head, &[], &rows))
            h3 { "Compared" }
            (html::table(&["model", "fit", "holdout"], &[], &compare))
        },
    )
}

/// What the residuals of the worst joints go with.
pub(super) fn followers(plant: &Plant, id: &Identification) -> Section {
    let found = &id.validation.followers;
    let joints = plant.actuators();
    let rows: Vec<Vec<Markup>> = found
        .iter()
        .map(|f| {
            vec![
                html! { (joints[f.actuator].name) },
                html! { (f.what) },
                html! { (percent(f.share)) },
            ]
        })
        .collect();
    Section::new(
        "What the residual goes with",
        html! {
            @if rows.is_empty() {
                p { "No joint's residual on the fit records goes with the velocity of another joint (to a tenth of its power)." }
            } @else {
                p { "The residual of these joints on the fit records is proportional, in part, to a function of the velocity \
                     of another joint, which this model has no term for: their friction parameters have taken up what they \
                     could of it, and predict other motion wrongly. " code { "excite diagnose" } " looks closer." }
                (html::table(&["joint", "goes with", "share of its power"], &[1], &rows))
            }
        },
    )
}
