//! The report after the run: what the records say about the model.

use crate::identify::validation::Trace;
use crate::identify::{Consistency, Identification, Settings};
use crate::log::Purpose;
use crate::plant::{Kind, Plant};
use crate::report::format::{NBSP, percent, significant, unit, with_unit};
use crate::report::html::{self, Section, Tone};
use crate::report::joints;
use crate::report::plot::{Axis, Colour, Figure, Panel, Rule, Series, Shape, time_series};
use crate::robot::Motion;
use crate::signals::fourier::welch;
use maud::{Markup, html};

/// Records that are drawn; the others are in the tables.
const DRAWN: usize = 2;

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
            if h.relative_error > 2.0 * fit.max(0.01) {
                text += " It does not carry over well: the fit records excite other motion, or the robot \
                         does something that the model lacks; look at the joints with the largest holdout error.";
                Tone::Bad
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

/// `report.html`.
pub fn html(plant: &Plant, id: &Identification, settings: &Settings) -> String {
    let (tone, text) = verdict(plant, id);
    let mut sections = vec![
        Section::new("", tiles(id)),
        residuals(plant, id),
        followers(plant, id),
        torques(plant, id),
        over_time(plant, id),
        over_velocity(plant, id),
        spectra(plant, id),
        base(id),
        standard(plant, id),
        essential(id),
        prior(id, settings),
        signals(id),
        joints::order(plant.actuators().iter().map(|j| j.name.as_str())),
    ];
    if !id.warnings.is_empty() {
        let list = html! { ul { @for w in &id.warnings { li { strong { (w.subject) } ": " (w.message) } } } };
        let mut s = Section::new("Warnings", list);
        s.tone = Tone::Fair;
        sections.insert(1, s);
    }
    let line = format!(
        "identified from {} and tested on {}",
        names(id, Purpose::Fit),
        match names(id, Purpose::Holdout).as_str() {
            "" => "nothing".to_string(),
            other => other.to_string(),
        }
    );
    html::page(
        &format!("Identification of {}", plant.name()),
        &line,
        (tone, &text),
        &sections,
    )
}

fn names(id: &Identification, purpose: Purpose) -> String {
    let list: Vec<&str> = id
        .prepared
        .iter()
        .filter(|p| p.purpose == purpose)
        .map(|p| p.name.as_str())
        .collect();
    list.join(", ")
}

fn tiles(id: &Identification) -> Markup {
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

fn force(motion: Motion) -> &'static str {
    match motion {
        Motion::Revolute => "N m",
        Motion::Prismatic => "N",
    }
}

fn residuals(plant: &Plant, id: &Identification) -> Section {
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
fn followers(plant: &Plant, id: &Identification) -> Section {
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

/// The traces that are drawn: a fit record and a holdout record where there are both.
fn drawn(id: &Identification) -> Vec<&Trace> {
    let traces = &id.validation.traces;
    let first = |p: Purpose| traces.iter().find(|t| t.purpose == p);
    let mut out: Vec<&Trace> = [Purpose::Fit, Purpose::Holdout]
        .into_iter()
        .filter_map(first)
        .collect();
    out.truncate(DRAWN);
    out
}

fn titles(traces: &[&Trace]) -> Vec<String> {
    traces
        .iter()
        .map(|t| match t.purpose {
            Purpose::Fit => format!("{} (fit)", t.name),
            Purpose::Holdout => format!("{} (holdout)", t.name),
        })
        .collect()
}

/// A row for every joint, a column for every trace.
fn grid(
    plant: &Plant,
    traces: &[&Trace],
    panel: impl Fn(usize, &Trace, &str) -> Panel,
) -> Vec<Panel> {
    plant
        .actuators()
        .iter()
        .enumerate()
        .flat_map(|(a, j)| {
            let panel = &panel;
            traces.iter().map(move |t| panel(a, t, force(j.motion)))
        })
        .collect()
}

fn rows(plant: &Plant) -> Vec<String> {
    plant.actuators().iter().map(|j| j.name.clone()).collect()
}

fn points(x: &[f64], y: impl Iterator<Item = f64>) -> Vec<[f64; 2]> {
    x.iter().copied().zip(y).map(|(x, y)| [x, y]).collect()
}

fn part<'a>(t: &Trace, list: &'a [f64], a: usize) -> &'a [f64] {
    let n = t.time.len();
    &list[a * n..(a + 1) * n]
}

fn residual(t: &Trace, a: usize) -> Vec<f64> {
    let pairs = part(t, &t.measured, a).iter().zip(part(t, &t.predicted, a));
    pairs.map(|(m, p)| m - p).collect()
}

fn torques(plant: &Plant, id: &Identification) -> Section {
    let traces = drawn(id);
    let panels = grid(plant, &traces, |a, t, unit| Panel {
        x: Axis::linear("t, s"),
        y: Axis::linear(unit),
        series: vec![
            Series::line(
                points(&t.time, part(t, &t.measured, a).iter().copied()),
                Colour::BLUE,
            ),
            Series::line(
                points(&t.time, part(t, &t.predicted, a).iter().copied()),
                Colour::ORANGE,
            ),
            Series {
                width: 1.0,
                ..Series::line(points(&t.time, residual(t, a).into_iter()), Colour::GREY)
            },
        ],
        ..Panel::default()
    });
    let svg = time_series(
        "measured and predicted torque over time",
        rows(plant),
        titles(&traces),
        panels,
    );
    let caption = html! {
        (html::legend(&[
            (Colour::BLUE, Shape::Line, "measured"),
            (Colour::ORANGE, Shape::Line, "predicted"),
            (Colour::GREY, Shape::Line, "difference"),
        ]))
    };
    Section::new(
        "Measured against predicted torque",
        html::figure(svg, caption),
    )
}

fn over_time(plant: &Plant, id: &Identification) -> Section {
    let traces = drawn(id);
    let panels = grid(plant, &traces, |a, t, unit| Panel {
        x: Axis::linear("t, s"),
        y: Axis::linear(unit),
        series: vec![Series::line(
            points(&t.time, residual(t, a).into_iter()),
            Colour::BLUE,
        )],
        ..Panel::default()
    });
    let svg = time_series(
        "residual torque over time",
        rows(plant),
        titles(&traces),
        panels,
    );
    Section::new(
        "Residual over time",
        html::figure(
            svg,
            html! { "Measured less predicted torque. A drift is warming up; what repeats with the motion is a \
            missing term." },
        ),
    )
}

fn over_velocity(plant: &Plant, id: &Identification) -> Section {
    let traces = drawn(id);
    let panels = grid(plant, &traces, |a, t, unit| {
        let e = residual(t, a);
        let v = part(t, &t.velocity, a);
        // mean in forty bins of velocity, where there is something to average
        let (low, high) = v
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| {
                (l.min(*x), h.max(*x))
            });
        let mut bins = vec![(0.0, 0usize); 40];
        for (x, y) in v.iter().zip(&e) {
            let k = ((x - low) / (high - low).max(1e-300) * 40.0) as usize;
            let bin = &mut bins[k.min(39)];
            bin.0 += y;
            bin.1 += 1;
        }
        let mean: Vec<[f64; 2]> = bins
            .iter()
            .enumerate()
            .filter(|(_, b)| b.1 > 4)
            .map(|(k, b)| {
                [
                    low + (k as f64 + 0.5) / 40.0 * (high - low),
                    b.0 / b.1 as f64,
                ]
            })
            .collect();
        let step = v.len().div_ceil(1500).max(1);
        let dots: Vec<[f64; 2]> = v
            .iter()
            .zip(&e)
            .step_by(step)
            .map(|(x, y)| [*x, *y])
            .collect();
        Panel {
            x: Axis::linear("velocity, rad/s or m/s"),
            y: Axis::linear(unit),
            series: vec![
                Series {
                    width: 0.7,
                    shape: Shape::Dots,
                    ..Series::line(dots, Colour::GREY)
                },
                Series {
                    width: 2.0,
                    ..Series::line(mean, Colour::VERMILLION)
                },
            ],
            rules: vec![Rule {
                at: 0.0,
                upright: false,
                colour: Colour::QUIET,
                label: String::new(),
            }],
            ..Panel::default()
        }
    });
    let svg = Figure {
        description: "residual torque over joint velocity".into(),
        width: Figure::WIDTH,
        height: 110.0,
        columns: traces.len().max(1),
        column_titles: titles(&traces),
        row_titles: rows(plant),
        share_x: false,
        panels,
    }
    .svg();
    let caption = html! {
        (html::legend(&[(Colour::GREY, Shape::Dots, "samples"), (Colour::VERMILLION, Shape::Line, "mean")]))
        " A step at zero is Coulomb friction, a hump beside it Stribeck's, a bend far out nonlinear viscous friction."
    };
    Section::new("Residual over velocity", html::figure(svg, caption))
}

fn spectra(plant: &Plant, id: &Identification) -> Section {
    let traces = drawn(id);
    let panels = grid(plant, &traces, |a, t, unit| {
        let length = t.time.len().min(512.max(t.time.len() / 4));
        let density = |x: &[f64]| {
            let (f, d) = welch(x, t.rate, length);
            let list: Vec<[f64; 2]> = f
                .into_iter()
                .zip(d)
                .skip(1)
                .map(|(f, d)| [f, d.sqrt()])
                .collect();
            list
        };
        Panel {
            x: Axis::log("Hz"),
            y: Axis::log(format!("{unit}/√Hz")),
            series: vec![
                Series::line(density(part(t, &t.measured, a)), Colour::GREY),
                Series::line(density(&residual(t, a)), Colour::BLUE),
            ],
            ..Panel::default()
        }
    });
    let svg = time_series(
        "spectrum of measured torque and residual",
        rows(plant),
        titles(&traces),
        panels,
    );
    let caption = html! {
        (html::legend(&[(Colour::GREY, Shape::Line, "measured"), (Colour::BLUE, Shape::Line, "residual")]))
        " Where both meet, the model explains nothing."
    };
    Section::new("Spectrum of the residual", html::figure(svg, caption))
}

fn base(id: &Identification) -> Section {
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

fn standard(plant: &Plant, id: &Identification) -> Section {
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
            .filter(|(_, p)| joint == matches!(p.kind, Kind::Term { .. }))
            .map(|(u, p)| row(u, p))
            .collect()
    };
    let head = ["parameter", "value", "std", "nominal", "unit"];
    let joints = pick(true);
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

fn essential(id: &Identification) -> Section {
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

fn prior(id: &Identification, settings: &Settings) -> Section {
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

fn signals(id: &Identification) -> Section {
    let rows: Vec<Vec<Markup>> = id
        .prepared
        .iter()
        .map(|p| {
            let cut: Vec<String> = p
                .position_cutoff
                .iter()
                .map(|f| {
                    if f.is_finite() {
                        significant(*f, 3)
                    } else {
                        "–".into()
                    }
                })
                .collect();
            vec![
                html! { (p.name) },
                html! { (significant(p.rate, 5)) },
                html! { (p.count()) },
                html! { @match &p.periods { Some(x) => (x.count), None => "–" } },
                html! { (cut.join(", ")) },
                html! { (significant(p.filter.cutoff, 3)) },
                html! { (p.outputs()) },
                html! { (p.cutoff_reason) },
            ]
        })
        .collect();
    let head = [
        "record",
        "rate, Hz",
        "samples",
        "periods averaged",
        "cut-off of positions, Hz",
        "cut-off of torque and regressor, Hz",
        "equations a joint",
        "why",
    ];
    Section::new("Signals", html::table(&head, &[4, 7], &rows))
}
