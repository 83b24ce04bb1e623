//! The report before the run: is this trajectory inside the limits, and worth running?
//!
//! The same report stands for a robot alone; what needs a trajectory is then left out.

mod answer;
mod clearance;
mod load;
mod motion;
mod parameters;
mod platform;
pub(super) mod reproduce;
mod spectrum;
pub(super) mod verdict;
pub(super) mod view;

pub use verdict::{Grade, Verdict, verdict};

use crate::design::record::Record;
use crate::identifiability::Assessment;
use crate::report::format::{count, percent, significant, with_unit};
use crate::report::html::{self, Section, Tone};
use crate::report::joints;
use maud::{Markup, html};

/// A parameter counts as known from this relative standard deviation downwards, percent.
pub const KNOWN: f64 = 10.0;

/// The report as one HTML file; `record` where the trajectory comes from a design just made.
pub fn html(assessment: &Assessment, record: Option<&Record>) -> String {
    let verdict = verdict(assessment);
    let tone = match verdict.grade {
        Grade::Worthwhile => Tone::Good,
        Grade::Weak | Grade::Unexciting => Tone::Fair,
        Grade::Unsafe => Tone::Bad,
        Grade::RobotAlone => Tone::Neutral,
    };
    let robot = &assessment.robot;
    let (subject, what) = match &assessment.excitation {
        Some(e) => (
            "Before the run",
            format!(
                "{} of {} each",
                count(e.trajectory.periods as usize, "period"),
                with_unit(e.trajectory.fourier.period, 6, "s")
            ),
        ),
        None => (
            "Identifiability",
            "the robot alone, without a trajectory".to_string(),
        ),
    };
    let line = format!("{}, {what}", count(robot.dof(), "actuated joint"));
    let mut sections = Vec::new();
    sections.extend(warnings(assessment));
    sections.push(Section::new("", tiles(assessment)));
    if let Some(e) = &assessment.excitation {
        sections.extend(e.view.as_ref().and_then(view::section));
        if let Some(p) = &e.platform {
            sections.extend(platform::sections(e, p));
        }
        sections.push(motion::curves(robot, e));
        sections.push(motion::usage(robot, e));
        sections.push(clearance::section(e));
    }
    sections.extend(assessment.load.as_ref().map(load::section));
    sections.extend(assessment.answer.as_ref().map(answer::section));
    sections.push(parameters::uncertainty(assessment));
    sections.push(spectrum::section(assessment));
    sections.extend(record.map(spectrum::history));
    sections.push(parameters::classes(assessment));
    sections.push(joints::order(robot.joints.iter().map(|j| j.name.as_str())));
    sections.push(reproduce::section(assessment, record));
    html::page(
        &format!("{subject}: {}", robot.name),
        &line,
        (tone, &verdict.text),
        &sections,
    )
}

/// The warnings, where there are any.
fn warnings(a: &Assessment) -> Option<Section> {
    let body = html! {
        ul { @for w in &a.warnings { li { strong { (w.subject) } ": " (w.message) } } }
    };
    (!a.warnings.is_empty()).then(|| Section {
        tone: Tone::Fair,
        ..Section::new(format!("Warnings ({})", a.warnings.len()), body)
    })
}

/// Key figures.
fn tiles(a: &Assessment) -> Markup {
    let mut tiles = vec![(
        a.base.count().to_string(),
        "base parameters".to_string(),
        format!("of {} standard parameters", a.base.names.len()),
    )];
    let Some(e) = &a.excitation else {
        let class = |c| {
            a.base
                .standard
                .iter()
                .filter(|s| s.identifiability == c)
                .count()
        };
        use crate::base::Identifiability::{Alone, Combination, None};
        tiles.extend([
            (
                class(Alone).to_string(),
                "identifiable alone".to_string(),
                "each has a value of its own".to_string(),
            ),
            (
                class(Combination).to_string(),
                "in combination".to_string(),
                "felt only together with others".to_string(),
            ),
            (
                class(None).to_string(),
                "not at all".to_string(),
                "never act on a joint".to_string(),
            ),
            (
                significant(a.base.rank_gap, 2),
                "rank gap".to_string(),
                "how clear the count is".to_string(),
            ),
        ]);
        return html::tiles(&tiles);
    };
    let worst = match &e.certificate.worst {
        Some(w) => (
            percent(w.used),
            if w.used > 1.0 {
                "of the limit most exceeded".to_string()
            } else {
                "of the closest limit".to_string()
            },
            format!("{} {}", w.joint, w.kind.name()),
        ),
        None => (
            "–".into(),
            "of the closest limit".into(),
            "no limits stated".into(),
        ),
    };
    let (known, judged) = e.known(KNOWN);
    tiles.extend([
        worst,
        (
            significant(a.condition().map_or(f64::INFINITY, |c| c.1), 3),
            "condition number".to_string(),
            match a.unit_columns() {
                true => "columns scaled to unit length".to_string(),
                false => "independent of the choice of base parameters".to_string(),
            },
        ),
        (
            format!("{known} of {judged}"),
            format!("known to {KNOWN}\u{a0}% or better"),
            if judged == a.base.count() {
                "predicted relative standard deviation".to_string()
            } else {
                "of those with a nominal value other than 0".to_string()
            },
        ),
        (
            with_unit(e.trajectory.duration(), 4, "s"),
            "of motion".to_string(),
            format!(
                "{} of {}",
                count(e.trajectory.periods as usize, "period"),
                with_unit(e.trajectory.fourier.period, 6, "s")
            ),
        ),
    ]);
    html::tiles(&tiles)
}
