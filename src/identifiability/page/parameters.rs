//! What will be known: predicted uncertainty of the base parameters, classes of the standard ones.

use super::KNOWN;
use crate::base::{Identifiability, StandardParameter};
use crate::identifiability::{Assessment, Excitation};
use crate::report::format::{NBSP, count, significant, unit};
use crate::report::html::{self, Section};
use crate::robot::{JointTerm, Motion, inertia};
use crate::trajectory::RATE;
use maud::{Markup, html};

/// Base parameters with their predicted uncertainty, worst first; without a trajectory what they
/// are.
pub(super) fn uncertainty(a: &Assessment) -> Section {
    match &a.excitation {
        Some(e) => Section::new("Predicted uncertainty, worst first", predicted(a, e)),
        None => Section::new("Base parameters", plain(a)),
    }
}

fn predicted(a: &Assessment, e: &Excitation) -> Markup {
    // what cannot be put in percent comes last
    let (relative, absolute): (Vec<_>, Vec<_>) =
        e.predictions.iter().partition(|p| p.percent.is_some());
    let rows: Vec<Vec<Markup>> = relative
        .into_iter()
        .chain(absolute)
        .map(|p| {
            vec![
                html! { span class="code" { (p.combination) } },
                html! { (significant(p.nominal, 3)) },
                html! { (significant(p.std, 2)) },
                html! { (unit(&p.unit)) },
                match p.percent {
                    Some(x) => html! { (significant(x, 2)) (NBSP) "%" },
                    None => html! { "–" },
                },
                p.percent.map_or(html! {}, bar),
            ]
        })
        .collect();
    let head = [
        "base parameter",
        "nominal",
        "std",
        "unit",
        "relative",
        "0 to 100 %",
    ];
    html! {
        p {
            "Standard deviation that weighted least squares will have, counting on "
            (count(e.samples, "sample")) " a joint (" (significant(RATE, 4)) " a second over "
            (count(e.trajectory.periods as usize, "period"))
            ") with white torque noise, independent between samples and joints, of "
            (noise(a)) ". Relative to the nominal value, which may itself be small: a large percentage \
             of a small parameter need not matter for the torques. Parameters whose nominal value is 0 \
             come last, without a percentage."
        }
        (html::table(&head, &[3, 5], &rows))
    }
}

/// A percentage as a bar, orange where the parameter does not count as known.
fn bar(percent: f64) -> Markup {
    let class = if percent <= KNOWN { "bar" } else { "bar far" };
    let width = format!("width:{:.1}%", percent.clamp(0.0, 100.0));
    html! { span class=(class) { i style=(width) {} } }
}

/// Noise of the joints, equal neighbours together: `0.08 N m (joint1 to joint4), …`.
fn noise(a: &Assessment) -> String {
    let force = |m: Motion| match m {
        Motion::Revolute => "N\u{a0}m",
        Motion::Prismatic => "N",
    };
    let all: Vec<(String, &str)> = a
        .robot
        .joints
        .iter()
        .zip(&a.torque_noise)
        .map(|(j, s)| {
            let text = format!("{}{NBSP}{}", significant(*s, 3), force(j.motion));
            (text, j.name.as_str())
        })
        .collect();
    let groups: Vec<String> = all
        .chunk_by(|x, y| x.0 == y.0)
        .map(|group| match group {
            [one] => format!("{} ({})", one.0, one.1),
            [first, .., last] => format!("{} ({} to {})", first.0, first.1, last.1),
            [] => String::new(),
        })
        .collect();
    groups.join(", ")
}

fn plain(a: &Assessment) -> Markup {
    let nominal = a.base.project(&a.values);
    let rows: Vec<Vec<Markup>> = nominal
        .iter()
        .enumerate()
        .map(|(k, value)| {
            vec![
                html! { span class="code" { (a.base.combination(k)) } },
                html! { (significant(*value, 3)) },
                html! { (unit(a.base.units[a.base.kept[k]])) },
            ]
        })
        .collect();
    html! {
        p {
            "Exactly these combinations of standard parameters act on the joints; each is named after \
             the parameter nearest to the base."
        }
        (html::table(&["base parameter", "nominal", "unit"], &[2], &rows))
    }
}

/// Owner and parameter of a name: `link3` and `mz` of `link3.mz`.
fn split(name: &str) -> (&str, &str) {
    name.rsplit_once('.').unwrap_or(("", name))
}

/// Which standard parameters are identifiable, link by link and joint by joint, and why not.
pub(super) fn classes(a: &Assessment) -> Section {
    let standard = &a.base.standard;
    // owners of parameters of a kind, in order, with a cell for each of the names
    let sheet = |names: &[&str]| -> Vec<Vec<Markup>> {
        let of_kind = |s: &&StandardParameter| names.contains(&split(&s.name).1);
        let mut owners: Vec<&str> = Vec::new();
        for s in standard.iter().filter(of_kind) {
            let owner = split(&s.name).0;
            if !owners.contains(&owner) {
                owners.push(owner);
            }
        }
        let row = |owner: &&str| {
            let mut row = vec![html! { (owner) }];
            row.extend(names.iter().map(|name| {
                let wanted = (*owner, *name);
                chip(standard.iter().find(|s| split(&s.name) == wanted))
            }));
            row
        };
        owners.iter().map(row).collect()
    };
    let links = sheet(&inertia::NAMES);
    let terms: Vec<&str> = JointTerm::ALL
        .into_iter()
        .map(JointTerm::name)
        .filter(|t| standard.iter().any(|s| split(&s.name).1 == *t))
        .collect();
    let joints = sheet(&terms);
    let total = |c| standard.iter().filter(|s| s.identifiability == c).count();
    let body = html! {
        p class="key" {
            span { i class="chip alone" {} "identifiable alone ("
                (total(Identifiability::Alone)) ")" }
            span { i class="chip combination" {} "only in combination ("
                (total(Identifiability::Combination)) ")" }
            span { i class="chip none" {} "not at all (" (total(Identifiability::None)) ")" }
        }
        (matrix("link", &inertia::NAMES, &links))
        @if !joints.is_empty() {
            h3 { "Joint terms" }
            (matrix("joint", &terms, &joints))
        }
        (html::details("Reasons, parameter by parameter", reasons(standard)))
    };
    Section::new("Which standard parameters are identifiable", body)
}

fn matrix(corner: &str, names: &[&str], rows: &[Vec<Markup>]) -> Markup {
    html! {
        div class="sheet" {
            table class="classes" {
                thead { tr { th { (corner) } @for name in names { th { (name) } } } }
                tbody { @for row in rows { tr { @for cell in row { td { (cell) } } } } }
            }
        }
    }
}

/// A class as a mark, with class and reason where the pointer rests.
fn chip(parameter: Option<&StandardParameter>) -> Markup {
    let Some(p) = parameter else {
        return html! {};
    };
    let (class, word) = match p.identifiability {
        Identifiability::Alone => ("chip alone", "identifiable alone"),
        Identifiability::Combination => ("chip combination", "only in combination"),
        Identifiability::None => ("chip none", "not at all"),
    };
    let title = match p.reason.as_str() {
        "" => format!("{}: {word}", p.name),
        reason => format!("{}: {word}; {reason}", p.name),
    };
    html! { i class=(class) title=(title) role="img" aria-label=(title) {} }
}

/// Reasons, equal neighbours of a link together.
fn reasons(standard: &[StandardParameter]) -> Markup {
    let said = |p: &StandardParameter| match (p.identifiability, p.reason.as_str()) {
        (Identifiability::Alone, "") => "has a value of its own in the torques".to_string(),
        (Identifiability::Combination, "") => "felt only together with others".to_string(),
        (Identifiability::None, "") => "never acts on any joint".to_string(),
        (_, reason) => reason.to_string(),
    };
    let mut rows: Vec<Vec<Markup>> = Vec::new();
    for group in standard.chunk_by(|x, y| split(&x.name).0 == split(&y.name).0) {
        // in the order in which a reason first appears
        let mut texts: Vec<(String, Vec<String>)> = Vec::new();
        for p in group {
            let text = said(p);
            match texts.iter_mut().find(|(t, _)| *t == text) {
                Some((_, names)) => names.push(split(&p.name).1.to_string()),
                None => texts.push((text, vec![split(&p.name).1.to_string()])),
            }
        }
        let name = group.first().map_or("", |p| split(&p.name).0);
        for (k, (text, names)) in texts.into_iter().enumerate() {
            rows.push(vec![
                html! { @if k == 0 { strong { (name) } } },
                html! { (names.join(", ")) },
                html! { (text) },
            ]);
        }
    }
    html::table(&["link or joint", "parameters", "why"], &[1, 2], &rows)
}
