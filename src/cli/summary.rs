//! What is printed when all is written: 80 columns, the verdict in words.

use excite::base::parts::Identifiability;
use excite::design::parts::{Record, Status};
use excite::identifiability::json::INFINITE;
use excite::identifiability::parts::{Answer, LoadAccuracy};
use excite::identifiability::{Assessment, Excitation};
use std::fmt::Write;
use std::path::PathBuf;

/// Summary of a report before the run.
pub fn summary(assessment: &Assessment, record: Option<&Record>, files: &[PathBuf]) -> String {
    let mut out = String::new();
    let base = &assessment.base;
    let felt = base
        .standard
        .iter()
        .filter(|s| s.identifiability != Identifiability::None)
        .count();
    let _ = writeln!(
        out,
        "{}: {} joints; {felt} of {} parameters are felt, in {} base parameters",
        assessment.robot.name,
        assessment.robot.dof(),
        base.names.len(),
        base.count(),
    );
    if let Some(e) = &assessment.excitation {
        out.push_str(&excitation(assessment, e));
    }
    if let Some(l) = &assessment.load {
        out.push_str(&load(l));
    }
    if let Some(a) = &assessment.answer {
        out.push_str(&answer(a));
    }
    if let Some(r) = record {
        let how = match r.status {
            Status::Converged => "all starts followed to their end",
            Status::TimeLimit => "ended by the time limit",
            Status::Interrupted => "interrupted; this is the best so far",
        };
        let _ = writeln!(
            out,
            "design: {} starts in {:.1} s, {how}",
            r.starts.len(),
            r.seconds
        );
    }
    for f in files {
        let _ = writeln!(out, "wrote {}", f.display());
    }
    out
}

/// How well it tells the platform, the legs or the friction: the three values that are told worst.
fn answer(a: &Answer) -> String {
    let mut out = String::new();
    let (known, judged) = a.known(10.0);
    let _ = writeln!(
        out,
        "{}, {:.0} s, 95 %: {known} of {judged} values that are not zero to 10 % or better",
        a.question.name(),
        a.seconds
    );
    let relative = |e: &excite::identifiability::parts::Expected| match e.std {
        Some(s) => 1.96 * s / e.value.abs(),
        None => f64::INFINITY,
    };
    let mut all: Vec<_> = a.expected.iter().filter(|e| e.value != 0.0).collect();
    all.sort_by(|x, y| relative(y).total_cmp(&relative(x)));
    for e in all.into_iter().take(3) {
        let _ = match e.std {
            Some(s) => writeln!(
                out,
                "  {} {:.3e} ± {:.1e} {}",
                e.name,
                e.value,
                1.96 * s,
                e.unit
            ),
            None => writeln!(out, "  {} not determined", e.name),
        };
    }
    out
}

/// How well it tells a load.
fn load(l: &LoadAccuracy) -> String {
    let mut out = String::new();
    let [mass, com, tensor] = l.in_short(&l.shared);
    let of = |x: Option<f64>, factor: f64, unit: &str| match x {
        Some(x) => format!("{:.2} {unit}", 1.96 * factor * x),
        None => "not determined".into(),
    };
    let relative = |m: f64| m / l.payload[0];
    let _ = writeln!(
        out,
        "load of {:.4} kg{}, {:.0} s empty and {:.0} s loaded, 95 %:\n  mass {}, centre of mass {}, tensor {}",
        l.payload[0],
        if l.named { "" } else { " (none was named)" },
        l.seconds,
        l.seconds,
        of(mass.map(relative), 100.0, "%"),
        of(com, 1e3, "mm"),
        of(tensor, 100.0, "%"),
    );
    let [mass, com, tensor] = l.in_short(&l.free);
    let _ = writeln!(
        out,
        "  {}, {}, {} where constants of the drives move in between",
        of(mass.map(relative), 100.0, "%"),
        of(com, 1e3, "mm"),
        of(tensor, 100.0, "%"),
    );
    if let Some(why) = &l.broken {
        let _ = writeln!(out, "  WITH THE LOAD, do not run this: {why}");
    }
    out
}

/// A condition number.
fn size(x: f64) -> String {
    match x >= INFINITE {
        true => "∞".into(),
        false => format!("{x:.3}"),
    }
}

fn excitation(a: &Assessment, e: &Excitation) -> String {
    let mut out = String::new();
    let torque_noise = &a.torque_noise;
    let c = &e.condition;
    let (name, headline) = a.condition().unwrap_or(("invariant", c.invariant));
    let all = [
        ("invariant", c.invariant),
        ("raw", c.raw),
        ("normalised", c.normalised),
        ("weighted", c.weighted),
    ];
    let others = all.iter().filter(|(n, _)| *n != name);
    let others: Vec<String> = others.map(|(n, v)| format!("{n} {}", size(*v))).collect();
    let what = if a.unit_columns() {
        " of unit columns"
    } else {
        ""
    };
    let _ = writeln!(
        out,
        "condition number{what} {} ({})",
        size(headline),
        others.join(", ")
    );
    let verdict = match e.certificate.satisfied {
        true => "all hold for all time",
        false => "EXCEEDED, do not run this",
    };
    let _ = match &e.certificate.worst {
        Some(w) => writeln!(
            out,
            "limits: {verdict}; closest: {} of {} at {:.1} %",
            w.kind.name(),
            w.joint,
            100.0 * w.used
        ),
        None => writeln!(out, "limits: none stated"),
    };
    let axes = e.platform.as_ref().and_then(|p| p.nearest_axes());
    match (&e.clearance, axes) {
        (None, Some(p)) => {
            let _ = writeln!(
                out,
                "collisions: axes of legs and platform only\n  closest: {}, {:.1} mm at {:.2} s (never below {:.1} mm)",
                p.name,
                1e3 * p.value,
                p.time,
                1e3 * p.bound
            );
        }
        (None, None) => out.push_str("collisions: not looked at\n"),
        (Some(c), _) => {
            let verdict = match c.certificate.satisfied {
                true if c.certificate.unseen.is_empty() && c.certificate.always_near.is_empty() => {
                    "none"
                }
                true => "none of what was looked at",
                false => "TOO NEAR, do not run this",
            };
            if let Some(p) = c.certificate.pairs.first() {
                let _ = writeln!(
                    out,
                    "collisions: {verdict}\n  closest: {} and {}, {:.1} mm at {:.2} s (never below {:.1} mm)",
                    p.between[0],
                    p.between[1],
                    1e3 * p.least,
                    p.time,
                    1e3 * p.bound
                );
            }
        }
    }
    if let Some(p) = e.predictions.first() {
        let (good, judged) = e.known(10.0);
        let worst = match p.percent {
            _ if p.std >= INFINITE => "not at all".into(),
            Some(x) => format!("{x:.1} %"),
            None => format!("{:.2e} {} about 0", p.std, p.unit),
        };
        let _ = writeln!(
            out,
            "predicted: {good} of {judged} base parameters{} to 10 % or better\n           worst {}: {worst}",
            match judged == e.predictions.len() {
                true => "",
                false => " that are not 0",
            },
            p.parameter
        );
        let relative = e.elsewhere.relative(torque_noise);
        // a model without bodies has no torque to compare with
        if relative < 1e6 {
            let _ = writeln!(
                out,
                "torque elsewhere: uncertain by {:.1} % of its size, at {} random states",
                100.0 * relative,
                e.elsewhere.states
            );
        }
    }
    out
}
