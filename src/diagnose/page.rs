//! The report: where the gap lies, what causes it, how far it shrinks, what to run next.

use super::controller::Kind;
use super::finding::Finding;
use super::next::Proposal;
use super::result::Diagnosis;
use super::thresholds::THRESHOLDS as T;
use super::verdict::Verdict;
use crate::report::format::{percent, significant};
use crate::report::html::{Section, Tone, details, figure, legend, page, table, tiles};
use crate::report::joints;
use crate::report::plot::{Axis, Colour, Figure, Panel, Rule, Series, Shape};
use maud::{Markup, html};

/// Verdict in one sentence.
pub fn sentence(d: &Diagnosis) -> (Tone, String) {
    let claims: Vec<&Finding> = claims(d);
    let names = || -> String {
        let each = |f: &&Finding| match f.joints.is_empty() {
            true => f.title.to_string(),
            false => format!("{} on {}", f.title, f.joints.join(" and ")),
        };
        match (claims.as_slice(), d.findings.first()) {
            ([], Some(f)) if !f.same.is_empty() => format!(
                "{} or {}, which these records do not tell apart",
                each(&f),
                f.same.join(" or ").replace('_', " ")
            ),
            ([], Some(f)) => format!("probably {} ({} sure)", each(&f), percent(f.confidence)),
            _ => claims.iter().map(each).collect::<Vec<_>>().join("; "),
        }
    };
    let left = percent(d.unexplained);
    match d.verdict {
        Verdict::NoGap => (
            Tone::Good,
            "No gap: what is left after ordinary corrections of the parameters is noise.".into(),
        ),
        Verdict::Explained => (
            Tone::Good,
            format!("Explained: {}. {left} of the gap stays.", names()),
        ),
        Verdict::PartlyExplained => (
            Tone::Fair,
            format!(
                "Partly explained: {}. Something remains: {left} of the gap.",
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
                None => {
                    "Unknown: there is a gap, and no effect of the catalogue explains it.".into()
                }
            },
        ),
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
        Section::new("", summary(d)),
        Section::new("Which effect", effects(d)),
        Section::new("Where the gap lies", residuals(d)),
        Section::new("Over velocity, position, torque and time", maps(d)),
        Section::new("Over frequency", spectra(d)),
        Section::new("How far it shrinks", shrink(d)),
        Section::new("As the simulator's user sees it", simulated(d)),
        Section::new("What to run next", next(d)),
        Section::new("What this data cannot say", limits(d)),
        joints::order(d.joints.iter().map(String::as_str)),
    ];
    page(
        &format!("{}: diagnosis", d.robot),
        &line,
        (verdict.0, &verdict.1),
        &sections,
    )
}

fn summary(d: &Diagnosis) -> Markup {
    let worst = (0..d.joints.len())
        .max_by(|a, b| d.refit[*a].share.total_cmp(&d.refit[*b].share))
        .unwrap_or(0);
    let g = &d.refit[worst];
    let shrink = 1.0 - d.holdout[1] / d.holdout[0].max(1e-9);
    let share = |s: Option<f64>| s.map_or("–".to_string(), percent);
    let all = [
        (
            format!("{} ×", significant(g.rms / g.noise, 3)),
            "gap over noise after a refit".into(),
            format!(
                "{}: {} {} rms over a noise of {}",
                g.joint,
                significant(g.rms, 3),
                d.units[worst],
                significant(g.noise, 3)
            ),
        ),
        (
            percent(shrink.max(0.0)),
            "of the gap gone on holdout records".into(),
            "with the effects found, parameters from the fitted records".into(),
        ),
        (
            format!(
                "{} / {} / {}",
                share(d.shares.odd),
                share(d.shares.even),
                share(d.shares.non_periodic)
            ),
            "odd / even / not repeating".into(),
            match (d.shares.odd, d.shares.non_periodic) {
                (None, None) => "no record repeats: this cannot be said".into(),
                (None, _) => "odd and even need a motion of odd harmonics".into(),
                _ => "shares of the refitted gap".to_string(),
            },
        ),
        (
            d.bound.map_or("–".into(), percent),
            "any function of the state could explain".into(),
            "bins of position and velocity of each joint, tried on other periods".into(),
        ),
    ];
    tiles(&all)
}

fn values(f: &Finding) -> Markup {
    html! {
        @for v in &f.values {
            div class="value" {
                (v.name.replace('_', " ")) " " (significant(v.value, 4))
                @if let Some(s) = v.std { @if s > 0.0 { " ± " (significant(1.96 * s, 2)) } }
                " " (v.unit)
            }
        }
    }
}

fn effects(d: &Diagnosis) -> Markup {
    if d.findings.is_empty() {
        return html! { p { "No effect stands out: " (match d.verdict {
            Verdict::NoGap => "there is nothing to explain.",
            _ => "none of the catalogue explains a share of the gap that holds on holdout records.",
        }) } };
    }
    let row = |f: &Finding| {
        vec![
            html! {
                @if f.is_claim() { strong { (f.title) } } @else { (f.title) }
                div class="code" { (f.equation) }
            },
            html! { @if f.joints.is_empty() { "whole robot" } @else { (f.joints.join(", ")) } },
            html! { (percent(f.confidence)) },
            html! { (percent(f.explains)) @if f.member { div { small { (percent(f.interval[0])) "–" (percent(f.interval[1])) } } } },
            html! { (percent(f.holdout)) },
            html! { (percent(f.visibility)) @if f.frozen { div { small { "against the prior" } } } },
            html! {
                @if let Some(d) = f.decoys { (percent(d)) } @else { "–" }
                div { small { @if let Some(u) = f.unsteady { "unsteady " (percent(u)) } } }
            },
            values(f),
            html! { @if f.same.is_empty() { "–" } @else { (f.same.join(", ").replace('_', " ")) } },
        ]
    };
    let head = [
        "effect",
        "where",
        "confidence",
        "explains",
        "on holdout",
        "visible",
        "decoys",
        "parameters (95 %)",
        "not told from",
    ];
    let (set, rest): (Vec<&Finding>, Vec<&Finding>) = d.findings.iter().partition(|f| f.member);
    html! {
        p { "An effect is claimed from a confidence of 50 % on. " strong { "Explains" } " is the share of the gap above the \
            noise that goes when the effect is added to the others; " strong { "visible" } " the share of the effect that the \
            nominal model cannot absorb by other parameters; " strong { "decoys" } " the most that the effect explains of its own when it \
            is moved in time, over what it explains in place: near 100 % it is as good as any signal; " strong { "unsteady" } " \
            what coefficients of their own for every record would add to that, near 0 % where it is the same in all." }
        (table(&head, &[1, 7, 8], &set.iter().map(|f| row(f)).collect::<Vec<_>>()))
        @if !rest.is_empty() {
            (details("Rivals: what else could stand in their place", table(&head, &[1, 7, 8],
                &rest.iter().map(|f| row(f)).collect::<Vec<_>>())))
        }
    }
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

fn residuals(d: &Diagnosis) -> Markup {
    let panels: Vec<Panel> = (0..d.joints.len())
        .map(|j| {
            let t = &d.traces[j];
            let line = |y: &[f64], colour| {
                let points = t.t.iter().zip(y).map(|(t, y)| [*t, *y]).collect();
                Series::line(points, colour)
            };
            let noise = d.refit[j].noise;
            let level = |at: f64, label: &str| Rule {
                at,
                upright: false,
                colour: Colour::GREY,
                label: label.into(),
            };
            Panel {
                title: d.joints[j].clone(),
                note: format!("{} of the gap", percent(d.refit[j].share)),
                x: Axis::linear("time, s"),
                y: Axis::linear(unit("residual", d.units[j])),
                rules: vec![level(2.0 * noise, "2σ noise"), level(-2.0 * noise, "")],
                series: vec![
                    line(&t.before, Colour::BLUE),
                    line(&t.after, Colour::ORANGE),
                ],
                ..Panel::default()
            }
        })
        .collect();
    let svg = Figure {
        description: "residual of each joint over a period, before and after".into(),
        width: Figure::WIDTH,
        height: 120.0,
        columns: if d.joints.len() > 1 { 2 } else { 1 },
        column_titles: Vec::new(),
        row_titles: Vec::new(),
        share_x: false,
        panels,
    }
    .svg();
    let rows: Vec<Vec<Markup>> = (0..d.joints.len())
        .map(|j| {
            let cell = |g: &super::gap::JointGap| {
                html! { (significant(g.rms, 3)) " " (d.units[j])
                div { small { (percent(g.relative)) " of the torque, " (significant(g.rms / g.noise, 2)) " × noise" } } }
            };
            vec![
                html! { (d.joints[j]) },
                html! { (significant(d.refit[j].noise, 3)) " " (d.units[j]) },
                cell(&d.frozen[j]),
                cell(&d.refit[j]),
                cell(&d.explained[j]),
                html! { (percent(d.refit[j].share)) },
            ]
        })
        .collect();
    html! {
        (figure(svg, html! {
            (legend(&[(Colour::BLUE, Shape::Line, "refitted nominal model"), (Colour::ORANGE, Shape::Line, "with the effects found")]))
            "Mean over the periods of the first fitted record."
        }))
        (table(&["joint", "noise", "frozen model", "refitted", "with the effects", "share"], &[], &rows))
        p { "rms above the noise over the fitted records. The noise floor comes from " (d.noise_source) ". The refit moves the \
            nominal parameters within what is ordinary for a model of this origin (its prior)."
            @if d.closeness.iter().any(|c| *c < 1.0) {
                " The records agree with this identified model so well that its links are allowed less: "
                (percent(d.closeness[0])) " of that in mass, first moment and rotors, "
                (percent(d.closeness[1])) " in tensors."
            }
        }
    }
}

fn maps(d: &Diagnosis) -> Markup {
    let few = worst(d, 3);
    let mut panels = Vec::new();
    for &j in &few {
        let t = &d.traces[j];
        let step = (t.t.len() / 1500).max(1);
        let dots = |x: &[f64], y: &[f64], colour| Series {
            points: x
                .iter()
                .zip(y)
                .step_by(step)
                .map(|(x, y)| [*x, *y])
                .collect(),
            colour,
            width: 0.8,
            shape: Shape::Dots,
        };
        for (k, (label, x)) in [
            ("velocity", &t.velocity),
            ("position", &t.position),
            ("torque", &t.torque),
        ]
        .into_iter()
        .enumerate()
        {
            let position = d.forward.units[j];
            let of = [format!("{position}/s"), position.into(), d.units[j].into()][k].clone();
            panels.push(Panel {
                title: if k == 0 {
                    d.joints[j].clone()
                } else {
                    String::new()
                },
                x: Axis::linear(unit(label, &of)),
                y: Axis::linear(unit("residual", d.units[j])),
                series: vec![
                    dots(x, &t.before, Colour::BLUE),
                    dots(x, &t.after, Colour::ORANGE),
                ],
                ..Panel::default()
            });
        }
        let drift = |k: usize, colour| Series {
            points: t.drift.iter().map(|p| [p[0], p[k]]).collect(),
            colour,
            width: 1.8,
            shape: Shape::Line,
        };
        panels.push(Panel {
            x: Axis::linear("time over all records, s"),
            y: Axis::linear(unit("rms of a period", d.units[j])),
            series: vec![drift(1, Colour::BLUE), drift(2, Colour::ORANGE)],
            ..Panel::default()
        });
    }
    let svg = Figure {
        description: "residual over velocity, position, torque and time".into(),
        width: Figure::WIDTH,
        height: 150.0,
        columns: 4,
        column_titles: Vec::new(),
        row_titles: Vec::new(),
        share_x: false,
        panels,
    }
    .svg();
    figure(
        svg,
        html! {
            (legend(&[(Colour::BLUE, Shape::Dots, "refitted nominal model"), (Colour::ORANGE, Shape::Dots, "with the effects found")]))
            "The joints with the largest share of the gap, first fitted record (mean period); at the right the course over all records."
        },
    )
}

fn spectra(d: &Diagnosis) -> Markup {
    let few = worst(d, 3);
    let panels = few
        .iter()
        .map(|&j| {
            let t = &d.traces[j];
            let line = |k: usize, colour| {
                let points = t.spectrum.iter().skip(1).map(|p| [p[0], p[k]]).collect();
                Series::line(points, colour)
            };
            Panel {
                title: d.joints[j].clone(),
                x: Axis::linear("frequency, Hz"),
                y: Axis::log(unit("amplitude", d.units[j])),
                series: vec![
                    line(3, Colour::GREY),
                    line(1, Colour::BLUE),
                    line(2, Colour::ORANGE),
                ],
                ..Panel::default()
            }
        })
        .collect();
    let svg = Figure {
        description: "spectrum of the residual before and after".into(),
        width: Figure::WIDTH,
        height: 170.0,
        columns: few.len().max(1),
        column_titles: Vec::new(),
        row_titles: Vec::new(),
        share_x: false,
        panels,
    }
    .svg();
    figure(
        svg,
        html! {
            (legend(&[(Colour::GREY, Shape::Line, "noise"), (Colour::BLUE, Shape::Line, "refitted nominal model"), (Colour::ORANGE, Shape::Line, "with the effects found")]))
        },
    )
}

fn shrink(d: &Diagnosis) -> Markup {
    let rows: Vec<Vec<Markup>> = d
        .records
        .iter()
        .map(|r| {
            let mean = |i: usize| {
                let n = r.joints.len() as f64;
                (r.joints.iter().map(|v| v[i]).sum::<f64>() / n).sqrt()
            };
            let [a, b, c] = [mean(0), mean(1), mean(2)];
            let share = if b > 0.0 { 1.0 - (c / b).powi(2) } else { 0.0 };
            vec![
                html! { (r.name) @for remark in &r.remarks { div { small { (remark) } } } },
                html! { (if r.fit { "fit" } else { "holdout" }) },
                html! { (significant(a, 3)) },
                html! { (significant(b, 3)) },
                html! { (significant(c, 3)) },
                html! { (percent(share.max(0.0))) },
            ]
        })
        .collect();
    let mut total = 0.0;
    let steps: Vec<Vec<Markup>> = d
        .findings
        .iter()
        .filter(|f| f.member)
        .map(|f| {
            total += f.holdout;
            vec![
                html! { (f.title) },
                html! { (percent(f.explains)) },
                html! { (percent(f.holdout)) },
                html! { (percent(total.clamp(0.0, 1.0))) },
            ]
        })
        .collect();
    html! {
        p { "Gap of all joints in multiples of their noise (root of the mean energy above the noise), record by record. Holdout records were \
            not fitted to." }
        (table(&["record", "use", "frozen", "refitted", "with the effects", "of the energy gone"], &[1], &rows))
        @if !steps.is_empty() {
            h3 { "Effect by effect" }
            (table(&["effect", "of the fitted gap", "of the holdout gap", "sum on holdout"], &[], &steps))
        }
    }
}

/// Forward simulation of the first record: curves of the joints that stray most, and all rms.
fn simulated(d: &Diagnosis) -> Markup {
    let f = &d.forward;
    let Some(first) = f.records.first() else {
        return html! { p { "No record was simulated." } };
    };
    let colours = [Colour::GREY, Colour::BLUE, Colour::ORANGE];
    let names = ["nominal", "refitted", "with the effects"];
    let step = (first.t.len() / 1500).max(1);
    let panels = worst(d, 3)
        .into_iter()
        .map(|j| {
            let curves = (0..3).filter(|m| !first.deviation[*m].is_empty());
            let line = |m: usize| {
                let points = first.t.iter().zip(&first.deviation[m][j]);
                let points = points.step_by(step).map(|(t, y)| [*t, *y]).collect();
                Series::line(points, colours[m])
            };
            Panel {
                title: d.joints[j].clone(),
                x: Axis::linear("time, s"),
                y: Axis::linear(unit("deviation", f.units[j])),
                series: curves.map(line).collect(),
                ..Panel::default()
            }
        })
        .collect();
    let svg = Figure {
        description: "deviation of the simulated robot from the log".into(),
        width: Figure::WIDTH,
        height: 150.0,
        columns: d.joints.len().clamp(1, 3),
        column_titles: Vec::new(),
        row_titles: Vec::new(),
        share_x: false,
        panels,
    }
    .svg();
    let mut rows = Vec::new();
    for r in &f.records {
        for j in 0..d.joints.len() {
            let figure = |of: &Option<Vec<f64>>, unit: &str| match of {
                Some(rms) => html! { (significant(rms[j], 3)) " " (unit) },
                None => html! { "–" },
            };
            // what the controller sends for it, where there is one
            let cell = |m: usize| {
                html! {
                    (figure(&r.rms[m], f.units[j]))
                    @if let Some(Ok(_)) = f.held { ", " (figure(&r.torque[m], d.units[j])) }
                }
            };
            let shrinks = match (&r.rms[1], &r.rms[2]) {
                (Some(a), Some(b)) if a[j] > 0.0 => percent(1.0 - b[j] / a[j]),
                _ => "–".to_string(),
            };
            rows.push(vec![
                html! { (r.record) },
                html! { (d.joints[j]) },
                cell(0),
                cell(1),
                cell(2),
                html! { (shrinks) },
            ]);
        }
    }
    let kind = match first.fit {
        true => "first fitted record (no record is kept out)",
        false => "holdout records",
    };
    html! {
        p { "Simulated: the " (kind) ", at most " (significant(super::forward::LONGEST, 2)) " s of each; rms of the deviation from \
            the recorded position. " (driven(d)) " Effects act as the torque that they have along the recorded motion." }
        (figure(svg, html! {
            (legend(&[0, 1, 2].map(|m| (colours[m], Shape::Line, names[m]))))
            "The joints with the largest share of the gap in " (first.record) "."
        }))
        (table(&["record", "joint", names[0], names[1], names[2], "less than refitted by"], &[0, 1], &rows))
        @for why in &f.failed { p { "Not simulated: " (why) } }
    }
}

/// What drives the simulated robot.
fn driven(d: &Diagnosis) -> Markup {
    match &d.forward.held {
        Some(Ok(c)) => {
            let known = (0..c.left.len()).filter(|j| !c.soft.contains(j));
            let left = known.map(|j| c.left[j]).fold(0.0, f64::max);
            html! {
                "The simulated robot is under the same commands: its controller, identified from the commanded positions and the torques of \
                 the logs " @match c.kind {
                    Kind::Actuators => { "(feedback of every joint on its own; " }
                    Kind::InverseDynamics => { "(inverse dynamics; " }
                } "it leaves at most " (percent(left)) " of a joint's torque), sends what was recorded less its answer to the deviation, whose rms stands beside."
                @if !c.soft.is_empty() {
                    " The gains of " (c.soft.iter().map(|j| d.joints[*j].as_str()).collect::<Vec<_>>().join(", "))
                    " are not certain; a soft spring stands in their place."
                }
            }
        }
        held => html! {
            "The recorded torque drives the simulated robot, and a soft spring and damper of "
            (significant(super::controller::BANDWIDTH, 2)) " Hz hold it, for no model stays on a path that is driven by torque alone; so the \
             figures compare models, and are no tracking errors under the robot's own controller"
            @if let Some(Err(why)) = held { ": " (why) } "."
        },
    }
}

/// The coordinates of the proposed motion over a period.
fn proposed(n: &Proposal) -> Markup {
    const POINTS: usize = 400;
    let motion = n.trajectory.fourier.motion(POINTS);
    let step = n.trajectory.fourier.period / POINTS as f64;
    let curves = motion.q.chunks_exact(POINTS).zip(&n.trajectory.joints);
    let panels = curves
        .zip(&n.units)
        .map(|((q, name), of)| {
            let points = q.iter().enumerate().map(|(i, q)| [i as f64 * step, *q]);
            Panel {
                title: name.clone(),
                x: Axis::linear("time, s"),
                y: Axis::linear(unit("position", of)),
                series: vec![Series::line(points.collect(), Colour::BLUE)],
                ..Panel::default()
            }
        })
        .collect();
    let svg = Figure {
        description: "coordinates of the proposed motion over a period".into(),
        width: Figure::WIDTH,
        height: 110.0,
        columns: n.units.len().clamp(1, 3),
        column_titles: Vec::new(),
        row_titles: Vec::new(),
        share_x: false,
        panels,
    }
    .svg();
    figure(
        svg,
        html! { "The proposed motion: joints of a serial robot, the platform of a parallel one." },
    )
}

fn next(d: &Diagnosis) -> Markup {
    html! {
        @match &d.next {
            Some(n) => {
                p { (n.why) "." }
                p { "The motion is in " code { "next.json" } ": period " (significant(n.trajectory.fourier.period, 3)) " s, run "
                    (n.trajectory.periods) " times, inside all limits of the robot file. Overlap " (percent(n.overlap[0]))
                    " in the present records, " (percent(n.overlap[1])) " predicted. "
                    code { "excite identifiability" } " shows how far it uses each limit." }
                (proposed(n))
            }
            None => {
                p { @if d.findings.iter().any(Finding::is_claim) {
                    "The effects that are claimed are told apart from their rivals by the records at hand."
                } @else { "No pair of effects is near enough to the gap to be worth separating." } }
            }
        }
        @for f in d.findings.iter().filter(|f| f.member && !f.same.is_empty()) {
            p { "To tell " (f.title) " from " (f.same.join(", ").replace('_', " ")) ": " (f.separated_by) "." }
        }
    }
}

fn limits(d: &Diagnosis) -> Markup {
    html! {
        @if d.untestable.is_empty() {
            p { "Every effect of the catalogue shows in this motion by more than one percent." }
        } @else {
            p { "The nominal model absorbs more than 99 % of these effects in this motion. They are untestable here, not absent:" }
            (details("Untestable effects", table(&["effect", "where", "visible"], &[1],
                &d.untestable.iter().map(|(e, p, v)| vec![
                    html! { (e.replace('_', " ")) },
                    html! { @if p.is_empty() { "whole robot" } @else { (p) } },
                    html! { (percent(*v)) },
                ]).collect::<Vec<_>>())))
        }
        @if !d.warnings.is_empty() {
            h3 { "Warnings" }
            ul { @for w in &d.warnings { li { (w.to_string()) } } }
        }
    }
}
