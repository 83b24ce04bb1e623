//! The report: where the gap lies, what causes it, how far it shrinks, what to run next.

mod effects;
mod next;
mod residuals;
mod samples;
mod second_encoder;
mod simulated;
mod simulators;
mod summary;

use super::catalogue::Value;
use super::finding::Finding;
use super::result::Diagnosis;
use super::thresholds::THRESHOLDS as T;
use super::verdict::Verdict;
use crate::report::format::percent;
use crate::report::html::{Section, Tone, page};
use crate::report::joints;

/// Verdict in one sentence.
pub fn sentence(d: &Diagnosis) -> (Tone, String) {
    let claims: Vec<&Finding> = claims(d);
    let sure = !claims.is_empty() && claims.iter().all(|f| f.confidence >= T.confidence.sure);
    if !d.moves {
        return (
            Tone::Bad,
            "Unknown: nothing moves in the fitted records, and a model can only be judged in motion. What happened at \
             rest is in the warnings."
                .into(),
        );
    }
    let names = || -> String {
        let plain = |f: &&Finding| {
            let place = match (f.records.is_empty(), f.joints.is_empty()) {
                (false, _) => format!(" in {}", f.records.join(" and ")),
                (true, true) => String::new(),
                (true, false) => format!(" on {}", f.joints.join(" and ")),
            };
            let unknown = f.values.iter().any(Value::is_unknown_mass);
            let mass = if unknown {
                ", its mass not determined"
            } else {
                ""
            };
            format!("{}{place}{mass}", f.title)
        };
        let same = |f: &&Finding| f.same.join(" or ").replace('_', " ");
        let told = |f: &&Finding| match f.same.is_empty() {
            true => plain(f),
            false => format!("{}, not told from {}", plain(f), same(f)),
        };
        match (claims.as_slice(), d.findings.first()) {
            ([], Some(f)) if !f.same.is_empty() => format!(
                "{} or {}, which these records do not tell apart",
                plain(&f),
                same(&f)
            ),
            ([], Some(f)) => format!("{} ({} sure)", plain(&f), percent(f.confidence)),
            _ => by_effect(&claims, |all| alike(all, sure, told)),
        }
    };
    let held = d.shrink().map(|gone| 1.0 - gone);
    // what stays where nothing was fitted is said where it is clearly more
    let more = d.findings.iter().filter(|f| f.member && !f.is_claim());
    // what is too unsure to be claimed takes its part, too
    let them = if claims.len() == 1 { "it" } else { "them" };
    let with = match (more.count(), claims.is_empty()) {
        (0, _) | (_, true) => String::new(),
        (1, _) => format!("With {them} and one less sure effect of the table, "),
        _ => format!("With {them} and the less sure effects of the table, "),
    };
    // a verdict that all is explained with much left rests on how small that is
    let apart = held.filter(|h| *h > d.unexplained + 0.1);
    let stays = apart.unwrap_or(d.unexplained);
    let little = d.verdict == Verdict::Explained && stays > T.gap.unexplained;
    let most = apart.map_or(d.unexplained, |h| h.min(1.0));
    let [whole, fitted] = [most, d.unexplained].map(percent);
    let left = match (apart, little) {
        (None, false) => format!("{with}{whole} of the gap stays"),
        (None, true) => format!("{with}{whole} of the gap stays, not far above the noise"),
        (Some(_), _) => format!(
            "{with}{whole} of the gap stays on records held out, {fitted} on those that were fitted{}",
            if little {
                "; neither is far above the noise"
            } else {
                ""
            }
        ),
    };
    let left = match (d.stays_on.as_slice(), d.friction_found) {
        ([], _) => left,
        (joints, false) => format!("{left}. More than half of that of {} stays", listed(joints)),
        (joints, true) => format!(
            "{left}. More than half of what friction leaves on {} stays",
            listed(joints)
        ),
    };
    let left = match d.verdict {
        Verdict::PartlyExplained if d.friction_alone() => {
            format!("{left}, and no other effect of the catalogue explains it")
        }
        _ => left,
    };
    match d.verdict {
        Verdict::NoGap => (
            Tone::Good,
            "No gap: what is left after ordinary corrections of the parameters is noise".to_string()
                + if d.turns_in_part {
                    ", or how the dry friction of a simulator turns."
                } else {
                    "."
                },
        ),
        Verdict::Explained if sure => (
            // much of a small gap is no full success
            if little { Tone::Fair } else { Tone::Good },
            format!("Explained: {}. {left}.", names()),
        ),
        Verdict::Explained => (
            Tone::Fair,
            format!("Probably explained: {}. {left}.", names()),
        ),
        Verdict::PartlyExplained => (
            Tone::Fair,
            format!(
                "{}: {}. {left}.",
                if sure {
                    "Partly explained"
                } else {
                    "Probably explained in part"
                },
                names()
            ),
        ),
        Verdict::Unknown => (
            Tone::Bad,
            match d
                .findings
                .first()
                .filter(|f| f.confidence > T.confidence.nearest)
            {
                Some(f) => format!(
                    "Unknown: there is a gap that no effect of the catalogue explains with confidence. The nearest is {} \
                     ({} sure); see below what could tell.",
                    f.title,
                    percent(f.confidence)
                ),
                None if !d.stands_out => "Unknown: a refit explains the torques, with parameters farther from those of the robot file than \
                     such a model may be, and no effect of the catalogue accounts for that."
                    .into(),
                None => {
                    "Unknown: there is a gap, and no effect of the catalogue explains it.".into()
                }
            },
        ),
    }
}

/// What is said of the findings of each effect, in the order of their first ones.
fn by_effect(claims: &[&Finding], said: impl Fn(&[&Finding]) -> String) -> String {
    let mut kinds: Vec<Vec<&Finding>> = Vec::new();
    for f in claims {
        // what is in some records only, or on the whole robot, is named by itself
        let joins = |kind: &&mut Vec<&Finding>| {
            kind[0].effect == f.effect && !f.joints.is_empty() && f.records.is_empty()
        };
        match kinds.iter_mut().find(joins) {
            Some(kind) => kind.push(f),
            None => kinds.push(vec![f]),
        }
    }
    kinds
        .iter_mut()
        .for_each(|kind| kind.sort_by_key(|f| f.place.first()));
    let all: Vec<String> = kinds.iter().map(|kind| said(kind)).collect();
    all.join("; ")
}

/// One effect at all its places, each with how sure it is unless all are; of many places the least.
fn alike(all: &[&Finding], sure: bool, plain: impl Fn(&&Finding) -> String) -> String {
    const MANY: usize = 4;
    let confidence = |f: &&Finding| format!("({} sure)", percent(f.confidence));
    let place = |f: &&Finding| f.joints.join(" and ");
    let first = &all[0];
    match (all, sure) {
        ([_], true) => plain(first),
        ([_], false) => format!("{} {}", plain(first), confidence(first)),
        (_, true) => {
            let places: Vec<String> = all.iter().map(place).collect();
            format!("{} on {}", first.title, listed(&places))
        }
        (few, false) if few.len() < MANY => {
            let places: Vec<String> = few
                .iter()
                .map(|f| format!("{} {}", place(f), confidence(f)))
                .collect();
            format!("{} on {}", first.title, listed(&places))
        }
        (many, false) => {
            let places: Vec<String> = many.iter().map(place).collect();
            let least = many.iter().map(|f| f.confidence).fold(1.0, f64::min);
            format!(
                "{} on {} (each at least {} sure)",
                first.title,
                listed(&places),
                percent(least)
            )
        }
    }
}

/// `a, b and c`.
fn listed(all: &[String]) -> String {
    match all {
        [] => String::new(),
        [one] => one.clone(),
        [others @ .., last] => format!("{} and {last}", others.join(", ")),
    }
}

fn claims(d: &Diagnosis) -> Vec<&Finding> {
    d.findings.iter().filter(|f| f.is_claim()).collect()
}

/// The page.
pub fn html(d: &Diagnosis) -> String {
    let verdict = sentence(d);
    let line = format!(
        "Diagnosis of {} from {} ({} to predict only)",
        d.robot,
        crate::report::format::count(d.records.len(), "record"),
        d.records.iter().filter(|r| !r.fit).count()
    );
    let sections = [
        Section::new("", summary::summary(d)),
        Section::new("Which effect", effects::effects(d)),
        Section::new(
            "What the second encoders show",
            second_encoder::second_encoder(d),
        ),
        Section::new("Where the gap lies", residuals::residuals(d)),
        Section::new(
            "Over velocity, position, torque and time",
            residuals::maps(d),
        ),
        Section::new("Over frequency", residuals::spectra(d)),
        Section::new("How far it shrinks", effects::shrink(d)),
        Section::new("As the simulator's user sees it", simulated::simulated(d)),
        Section::new("In your simulator", simulators::simulators(d)),
        Section::new("What to randomise", samples::samples(d)),
        Section::new("What to run next", next::next(d)),
        Section::new("What this data cannot say", summary::limits(d)),
        joints::order(d.joints.iter().map(String::as_str)),
    ];
    page(
        &format!("{}: diagnosis", d.robot),
        &line,
        (verdict.0, &verdict.1),
        &sections,
    )
}

fn unit(label: &str, unit: &str) -> String {
    format!("{label}, {}", unit.replace(' ', "\u{a0}"))
}

/// Joints by falling share of the gap, the few that matter.
fn worst(d: &Diagnosis, most: usize) -> Vec<usize> {
    let mut all: Vec<usize> = (0..d.joints.len()).collect();
    all.sort_by(|a, b| d.refit[*b].share.total_cmp(&d.refit[*a].share));
    all.truncate(most);
    all
}
