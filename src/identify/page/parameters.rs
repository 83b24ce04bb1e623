//! Base, standard and essential parameters, and the prior.

use crate::identify::{Consistency, Identification, Settings, breakaway};
use crate::plant::{Column, Plant};
use crate::report::format::{NBSP, percent, significant, unit};
use crate::report::html::{self, Section};
use maud::{Markup, html};

pub(super) fn base(id: &Identification) -> Section {
    let mut order: Vec<usize> = (0..id.base.count()).collect();
    let relative = |k: usize| id.std[k] / id.pi_consistent[k].abs().max(1e-300);
    order.sort_by(|&a, &b| relative(a).total_cmp(&relative(b)));
    let rows: Vec<Vec<Markup>> = order
        .into_iter()
        .map(|k| {
            let r = relative(k);
            vec![
                html! { span class="code" { (id.base.combination(k)) } },
                html! { (significant(id.pi_consistent[k], 4)) },
                html! { (significant(id.pi[k], 4)) },
                html! { (significant(id.std[k], 2)) },
                html! { (significant(id.predicted_std[k], 2)) },
                html! { (unit(id.base.units[id.base.kept[k]])) },
                html! { @if r < 10.0 { (percent(r)) } @else { "–" } },
                html! { @if id.essential.kept.contains(&k) { "yes" } @else { "no" } },
            ]
        })
        .collect();
    let head = [
        "base parameter",
        "value",
        "least squares",
        "std",
        "predicted std",
        "unit",
        "relative",
        "essential",
    ];
    Section::new(
        "Base parameters, best known first",
        html! {
            p { "Value of this model and of least squares alone. The standard deviation counts the correlation of the \
                 residual in time (spectral sandwich); the predicted one is that of white noise as stated in the robot \
                 file, every recorded sample counted. Where the first is many times the second, the residual is no \
                 noise: the model lacks something." }
            (html::table(&head, &[5, 7], &rows))
        },
    )
}

pub(super) fn standard(plant: &Plant, id: &Identification) -> Section {
    let row = |u: usize, p: &crate::plant::Parameter| {
        vec![
            html! { (p.name) },
            html! { (significant(id.phi[u], 4)) },
            html! { (significant(id.phi_std[u], 2)) },
            html! { (significant(p.value, 4)) },
            html! { (unit(p.unit)) },
        ]
    };
    let all = plant.parameters();
    let pick = |joint: bool| -> Vec<Vec<Markup>> {
        all.iter()
            .enumerate()
            .filter(|(_, p)| joint == matches!(p.kind, Column::Term { .. }))
            .map(|(u, p)| row(u, p))
            .collect()
    };
    let head = ["parameter", "value", "std", "nominal", "unit"];
    let mut joints = pick(true);
    joints.extend(breakaway::values(plant, id).into_iter().map(|v| {
        vec![
            html! { (v.name) },
            html! { (significant(v.value, 4)) },
            html! { (significant(v.std, 2)) },
            html! { (significant(v.nominal, 4)) },
            html! { (unit(v.unit)) },
        ]
    }));
    Section::new(
        "Standard parameters",
        html! {
            p { "What is written to robot.urdf and robot.toml. Combinations that the torques do not show are where the \
                 prior has them; their standard deviation is that of the prior." }
            @if !joints.is_empty() { h3 { "Joints" } (html::table(&head, &[4], &joints)) }
            (html::details("Bodies", html::table(&head, &[4], &pick(false))))
        },
    )
}

pub(super) fn essential(id: &Identification) -> Section {
    let e = &id.essential;
    let rows: Vec<Vec<Markup>> = e
        .removed
        .iter()
        .map(|r| {
            vec![
                html! { span class="code" { (id.base.combination(r.parameter)) } },
                html! { @if r.relative_std_percent < 1000.0 { (significant(r.relative_std_percent, 3)) (NBSP) "%" } @else { "> 1000" (NBSP) "%" } },
                html! { (significant(100.0 * (r.loss - 1.0), 2)) (NBSP) "%" },
            ]
        })
        .collect();
    Section::new(
        "Essential parameters",
        html! {
            p { (e.kept.len()) " of " (id.base.count()) " base parameters are essential: the others were removed one by one, \
                 the most uncertain first, while the residual grew by less than half a percent. With the essential ones \
                 alone the error is " (percent(id.validation.essential.0)) " on fit"
                @if let Some(h) = id.validation.essential.1 { " and " (percent(h)) " on holdout" } "." }
            @if !rows.is_empty() {
                (html::details("Removed, in order", html::table(&["base parameter", "relative std", "residual grown by"], &[], &rows)))
            }
        },
    )
}

pub(super) fn prior(id: &Identification, settings: &Settings) -> Section {
    let rows: Vec<Vec<Markup>> = id
        .trials
        .iter()
        .map(|t| {
            vec![
                html! { (significant(t.strength, 3)) @if t.strength == id.prior_strength { " (taken)" } },
                html! { (significant(t.error, 4)) },
                html! { (significant(t.worse, 3)) },
                html! { (significant(t.chance, 3)) },
            ]
        })
        .collect();
    let how = match settings.consistency {
        Consistency::Entropic => {
            "entropic distance (log-determinant divergence) from the nominal bodies"
        }
        Consistency::Lmi => {
            "linear matrix inequalities and a quadratic distance from the nominal bodies"
        }
        Consistency::Free => "none: unidentifiable directions stay nominal",
    };
    Section::new(
        "Prior and physical consistency",
        html! {
            p { "Consistency: " (how) ". Strength of the prior: " (significant(id.prior_strength, 3)) ". "
                @if let Some((margin, body)) = &id.margin {
                    "Smallest eigenvalue of a pseudo-inertia relative to the largest: " (significant(*margin, 2))
                    " (" (body) ")."
                } }
            @if !rows.is_empty() {
                p { "Cross-validation over five contiguous parts of the fit records: the strength with the smallest error on \
                     the part that was left out is taken." }
                (html::table(&["strength", "error of the part left out", "worse than the best by", "standard error"], &[], &rows))
            }
        },
    )
}
