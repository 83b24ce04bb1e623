//! Friction and constant forces of the drives.

use crate::load::Identified;
use crate::load::one_step::{Decision, JointFriction};
use crate::report::format::{percent, significant};
use crate::report::html::{self, Section};
use maud::{Markup, html};

/// What was decided about the constant forces; nothing with a single record.
pub fn zeros(found: &Identified) -> Option<Section> {
    let zeros = &found.one_step.zeros;
    if zeros.is_empty() {
        return None;
    }
    let list = |x: &[f64]| x.iter().map(|v| significant(*v, 2)).collect::<Vec<_>>();
    let row = |(joint, z): (&String, &Decision)| {
        let changes: Vec<String> = list(&z.changes)
            .into_iter()
            .zip(list(
                &z.changes_std.iter().map(|s| 1.96 * s).collect::<Vec<_>>(),
            ))
            .map(|(v, s)| format!("{v} ± {s}"))
            .collect();
        vec![
            html! { (joint) },
            html! { (z.kind.word()) },
            match z.drift {
                Some(d) => html! { (significant(d, 2)) },
                None => html! { "any" },
            },
            html! { (changes.join(", ")) },
        ]
    };
    let rows: Vec<Vec<Markup>> = found.joints.iter().zip(zeros).map(row).collect();
    let head = [
        "joint",
        "constant force",
        "drift that counts, N m or N",
        "change from record to record, if it were free",
    ];
    Some(Section::new(
        "Constant forces, decided by the data",
        html! {
            (html::table(&head, &[], &rows))
            p {
                "A constant force of every drive imitates a weight. Where the records show that it stays, they share it; where it \
                 drifts from record to record, it may do so by the spread that the records tell; where one drive changes unlike the \
                 others, it is free. The ± of the load counts what was decided."
            }
        },
    ))
}

/// Value and 95 % interval; a drive that does not move tells nothing.
fn pair(value: f64, std: f64) -> Markup {
    let half = 1.96 * std;
    if !half.is_finite() || half > 1e6 {
        return html! { "not determined" };
    }
    html! { (significant(value, 3)) " ± " (significant(half, 2)) }
}

/// Stribeck force and speed; not determined where the interval of either reaches zero.
fn stribeck(f: &JointFriction) -> Markup {
    let (Some(force), Some(speed)) = (f.stribeck, f.stribeck_velocity) else {
        return html! { "–" };
    };
    match f.stribeck_determined() {
        true => html! {
            (pair(force, f.stribeck_std.unwrap_or(f64::INFINITY))) " at "
            (pair(speed, f.stribeck_velocity_std.unwrap_or(f64::INFINITY)))
        },
        false => html! { "there, not determined" },
    }
}

/// Friction and residuals, record by record.
pub fn section(found: &Identified) -> Section {
    let mut rows = Vec::new();
    for r in &found.one_step.records {
        for (a, f) in r.friction.iter().enumerate() {
            let range = |v: &[f64]| match v.is_empty() {
                true => html! { "–" },
                false => {
                    let low = v.iter().cloned().fold(f64::INFINITY, f64::min);
                    let high = v.iter().cloned().fold(f64::NEG_INFINITY, f64::max);
                    html! { (significant(low, 3)) " … " (significant(high, 3)) }
                }
            };
            rows.push(vec![
                html! { (r.name) },
                html! { (found.joints[a]) },
                pair(f.coulomb, f.coulomb_std),
                range(&f.coulomb_periods),
                pair(f.viscous, f.viscous_std),
                pair(f.offset, f.offset_std),
                stribeck(f),
                html! { (significant(r.residuals[a].rms, 3)) },
                html! { (percent(r.residuals[a].relative)) },
            ]);
        }
    }
    let head = [
        "record",
        "joint",
        "Coulomb",
        "Coulomb, period by period",
        "viscous",
        "offset",
        "Stribeck, at speed",
        "residual",
        "of the torque",
    ];
    Section::new(
        "Friction, refitted for every record",
        html::details("Friction and residuals", html::table(&head, &[], &rows)),
    )
}
