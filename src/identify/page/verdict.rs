//! What the identification says, in words and in key figures.

use crate::identify::Identification;
use crate::identify::doubts::predicts_worse;
use crate::identify::validation::JointError;
use crate::plant::Plant;
use crate::report::format::{NBSP, percent, significant};
use crate::report::html::{self, Tone};
use maud::Markup;

/// Joints of which a model leaves as much as their torque.
fn beyond(joints: &[JointError]) -> Option<String> {
    let all = joints.iter().filter(|j| j.relative_error >= 1.0);
    let names: Vec<&str> = all.map(|j| j.joint.as_str()).collect();
    (!names.is_empty()).then(|| names.join(", "))
}

/// The verdict in words, and its tone.
pub fn verdict(plant: &Plant, id: &Identification) -> (Tone, String) {
    let v = &id.validation;
    let fit = v.fit.relative_error;
    let known = (0..id.pi.len())
        .filter(|&k| id.std[k] <= 0.1 * id.pi[k].abs())
        .count();
    let mut text = format!(
        "The model of {} leaves {} of the measured torque unexplained on the fit records",
        plant.name(),
        percent(fit)
    );
    let tone = match &v.holdout {
        Some(h) => {
            text += &format!(
                " and {} on motion that was not fitted",
                percent(h.relative_error)
            );
            let nominal = v.nominal.1.unwrap_or(f64::INFINITY);
            text += &format!(" (nominal model: {}).", percent(nominal));
            if predicts_worse(id).is_some() {
                text += " It predicts worse than the nominal model: keep that one, or record motion that excites more.";
                Tone::Bad
            } else if h.relative_error > 2.0 * fit.max(0.01) {
                text += " It does not carry over well: the fit records excite other motion, or the robot \
                         does something that the model lacks; look at the joints with the largest holdout error.";
                Tone::Bad
            } else if let Some(names) = beyond(&h.joints) {
                text += &format!(
                    " It carries over, but not to {names}: there it leaves as much as the torque itself and more."
                );
                Tone::Fair
            } else if h.relative_error > 0.1 {
                text += " It carries over, but a tenth or more of the torque is something else than this model.";
                Tone::Fair
            } else {
                text += " It carries over.";
                Tone::Good
            }
        }
        None => {
            text += ". There is no holdout record, so nothing shows whether it carries over to other motion.";
            Tone::Fair
        }
    };
    text += &format!(
        " {known} of {} base parameters are known to 10{NBSP}% or better",
        id.pi.len()
    );
    text += match id.consistent {
        true => "; every body can exist and no friction is negative.",
        false => "; some bodies of this model cannot exist: do not load it into a simulator.",
    };
    let tone = if id.consistent { tone } else { Tone::Bad };
    (tone, text)
}

pub(super) fn tiles(id: &Identification) -> Markup {
    let v = &id.validation;
    let mut tiles = vec![(
        percent(v.fit.relative_error),
        "torque error, fit".to_string(),
        format!("{} without prior and consistency", percent(v.plain.0)),
    )];
    if let Some(h) = &v.holdout {
        tiles.push((
            percent(h.relative_error),
            "torque error, holdout".into(),
            format!(
                "{} without prior and consistency",
                percent(v.plain.1.unwrap_or(f64::NAN))
            ),
        ));
    }
    tiles.push((
        id.base.count().to_string(),
        "base parameters".into(),
        format!("{} of them essential", id.essential.kept.len()),
    ));
    tiles.push((
        significant(id.condition, 3),
        "condition number".into(),
        "of the weighted equations with unit columns".into(),
    ));
    tiles.push((
        significant(id.inflation.sqrt(), 2),
        "times wider".into(),
        "standard deviations through correlation in time".into(),
    ));
    html::tiles(&tiles)
}
