//! The `experiment.toml` of a survey, with every decision in it.

use super::claim::{Claim, Means};
use super::frame::{Course, Frame};
use super::{Survey, file_name};
use crate::log::formats::detect;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Part of a single record that is fitted; the rest tests the model.
const FIT: f64 = 0.7;
/// Rest before the first and after the last motion that is kept, s.
const MARGIN: f64 = 0.5;

/// A text as TOML writes it.
fn quoted(text: &str) -> String {
    toml::Value::String(text.into()).to_string()
}

/// A path as seen from a folder; as it is where they share no root.
fn from(folder: &Path, file: &Path) -> String {
    let (Ok(a), Ok(b)) = (folder.canonicalize(), file.canonicalize()) else {
        return file.display().to_string();
    };
    let same = a
        .components()
        .zip(b.components())
        .take_while(|(x, y)| x == y)
        .count();
    if same < 2 {
        return b.display().to_string();
    }
    let mut out = PathBuf::new();
    a.components().skip(same).for_each(|_| out.push(".."));
    b.components().skip(same).for_each(|c| out.push(c));
    out.display().to_string()
}

/// The file; `robot` is the robot as it was named, `folder` where the file will stand.
pub fn experiment(survey: &Survey, robot: Option<&str>, folder: &Path) -> String {
    let mut out = String::from(
        "# Written by `excite log`: every decision that it took about these files. Change what you know better;\n\
         # `excite identify`, `excite load` and `excite diagnose` read the files as this says. The files stay as they are.\n",
    );
    match robot {
        Some(spec) => {
            let path = Path::new(spec);
            let spec = if path.is_file() { from(folder, path) } else { spec.to_string() };
            let _ = writeln!(out, "robot = {}", quoted(&spec));
        }
        None => out.push_str(
            "# robot = \"robot.toml\"   # TODO: a robot.toml, a URDF, or a bundled name (`excite robots`)\n",
        ),
    }
    for w in &survey.warnings {
        let text = w.to_string().replace('\n', " ");
        let _ = writeln!(out, "# warning: {text}");
    }
    let several = survey.frames.len() > 1;
    for (k, (frame, courses)) in survey.frames.iter().zip(&survey.courses).enumerate() {
        let [a, b] = span(frame, courses);
        match several {
            true => {
                let last = k + 1 == survey.frames.len();
                let why = match last {
                    true => "the last file tests the model; any other may",
                    false => "",
                };
                record(
                    &mut out,
                    survey,
                    frame,
                    folder,
                    if last { "holdout" } else { "fit" },
                    [a, b],
                    why,
                );
            }
            false => {
                let cut = a + FIT * (b - a);
                record(
                    &mut out,
                    survey,
                    frame,
                    folder,
                    "fit",
                    [a, cut],
                    "the first part of the motion",
                );
                record(
                    &mut out,
                    survey,
                    frame,
                    folder,
                    "holdout",
                    [cut, b],
                    "the rest tests the model",
                );
            }
        }
    }
    out
}

/// From the first to the last motion of any joint, with a little rest.
fn span(frame: &Frame, courses: &[Course]) -> [f64; 2] {
    let moves = || courses.iter().flat_map(|c| &c.moves);
    let a = moves().map(|m| m[0]).fold(f64::INFINITY, f64::min);
    let b = moves().map(|m| m[1]).fold(f64::NEG_INFINITY, f64::max);
    match a < b {
        true => [(a - MARGIN).max(0.0), (b + MARGIN).min(frame.duration())],
        false => [0.0, frame.duration()],
    }
}

fn record(
    out: &mut String,
    survey: &Survey,
    frame: &Frame,
    folder: &Path,
    purpose: &str,
    [a, b]: [f64; 2],
    why: &str,
) {
    let logs: Vec<String> = frame
        .paths
        .iter()
        .map(|p| quoted(&from(folder, p)))
        .collect();
    let log = match &logs[..] {
        [one] => one.clone(),
        list => format!("[{}]", list.join(", ")),
    };
    let names: Vec<String> = frame.paths.iter().map(|p| file_name(p)).collect();
    let _ = writeln!(
        out,
        "\n[[record]]   # {}: {} rows, {:.2} s at {}\nlog = {log}",
        names.join(" + "),
        frame.rows,
        frame.duration(),
        frame.pace(),
    );
    // files of several formats are told apart as they are read
    let formats = frame.paths.iter().map(|p| detect(p).ok());
    let formats: Vec<_> = formats.collect();
    if formats.windows(2).all(|w| w[0] == w[1]) {
        let _ = writeln!(out, "format = \"{}\"", survey.format.name());
    }
    if let Some(topic) = &survey.topic {
        let _ = writeln!(out, "topic = {}", quoted(topic));
    }
    let why = if why.is_empty() {
        String::new()
    } else {
        format!("   # {why}")
    };
    let _ = writeln!(out, "use = \"{purpose}\"{why}");
    out.push_str("# payload = \"unknown\"   # where the robot carried a load: \"unknown\" or { mass = 2.0 }\n");
    out.push_str("# period = 5.0            # s, where the motion repeats\n");
    if a > 0.0 || b < frame.duration() {
        let _ = writeln!(
            out,
            "from = {a:.3}   # s from the record's start; what lies outside stands still or is the other part\nto = {b:.3}"
        );
    }
    out.push_str("[record.columns]\n");
    match frame.time {
        Some(k) => {
            let _ = writeln!(
                out,
                "time = {{ column = {}, unit = \"{}\" }}",
                place(&frame.names[k], k),
                frame.time_unit
            );
        }
        None => {
            let _ = match frame.rate {
                Some(rate) => writeln!(out, "time = {{ rate = {rate} }}   # by its velocities"),
                None => writeln!(
                    out,
                    "# time = {{ rate = 500.0 }}   # TODO: samples a second; no column is a time"
                ),
            };
        }
    }
    for (key, means) in [
        ("q", Means::Position),
        ("dq", Means::Velocity),
        ("ddq", Means::Acceleration),
        ("tau", Means::Torque),
        ("tau", Means::Current),
        ("qref", Means::Command),
    ] {
        if means == Means::Current
            && survey
                .claims
                .iter()
                .any(|c| c.means == Means::Torque && c.confidence >= 0.5)
        {
            continue;
        }
        group(out, survey, key, means);
    }
}

/// A column as an experiment names it.
fn place(name: &str, k: usize) -> String {
    match name.parse::<usize>() == Ok(k + 1) {
        true => (k + 1).to_string(),
        false => quoted(name),
    }
}

/// One line for the columns of a quantity, with what is not plain; a comment where joints are missing.
fn group(out: &mut String, survey: &Survey, key: &str, means: Means) {
    let of = |j: usize| {
        survey.claims.iter().enumerate().find(|(_, c)| {
            c.means == means
                && c.at == Some(j)
                && c.confidence >= 0.5
                && c.side != Some("link")
                && c.commands != Some("torque")
        })
    };
    let list: Vec<Option<(usize, &Claim)>> = (0..survey.joints.len()).map(of).collect();
    if list.iter().all(Option::is_none) {
        if key == "q" {
            out.push_str("# q = [\"…\"]   # TODO: no positions were recognised\n");
        }
        return;
    }
    let found: Vec<(usize, &Claim)> = list.iter().flatten().copied().collect();
    if found.len() < list.len() {
        let missing: Vec<&str> = survey
            .joints
            .iter()
            .zip(&list)
            .filter(|(_, l)| l.is_none())
            .map(|(n, _)| n.as_str())
            .collect();
        let columns: Vec<String> = found.iter().map(|(k, c)| place(&c.column, *k)).collect();
        let _ = writeln!(
            out,
            "# {key} = [{}]   # TODO: incomplete, nothing was found for {}",
            columns.join(", "),
            missing.join(", ")
        );
        return;
    }
    let columns: Vec<String> = found.iter().map(|(k, c)| place(&c.column, *k)).collect();
    let columns = format!("[{}]", columns.join(", "));
    let numbers = |f: &dyn Fn(&Claim) -> f64| {
        let all: Vec<String> = found
            .iter()
            .map(|(_, c)| format!("{}", round(f(c))))
            .collect();
        match all.iter().all(|x| *x == all[0]) {
            true => all[0].clone(),
            false => format!("[{}]", all.join(", ")),
        }
    };
    let mut parts = Vec::new();
    let unit = found[0]
        .1
        .unit
        .filter(|u| found.iter().all(|(_, c)| c.unit == Some(u)));
    let factor = unit
        .and_then(crate::log::names::unit)
        .map_or(1.0, |(_, f)| f);
    if let Some(unit) = unit {
        parts.push(format!("unit = \"{unit}\""));
    }
    let scaled = found
        .iter()
        .any(|(_, c)| (c.scale / factor - 1.0).abs() > 1e-9);
    if scaled {
        parts.push(format!("scale = {}", numbers(&|c| c.scale / factor)));
    }
    if found.iter().any(|(_, c)| c.sign < 0.0) {
        parts.push(format!("sign = {}", numbers(&|c| c.sign)));
    }
    if found.iter().any(|(_, c)| c.delay != 0.0) {
        parts.push(format!("delay = {}", numbers(&|c| c.delay)));
    }
    if let Some(what) = found.iter().find_map(|(_, c)| c.without.first()) {
        parts.push(format!("without = [\"{what}\"]"));
    }
    let least = found.iter().map(|(_, c)| c.confidence).fold(1.0, f64::min);
    let joints = |of: &dyn Fn(&Claim) -> bool| {
        let all = found.iter().filter(|(_, c)| of(c));
        let all: Vec<&str> = all.filter_map(|(_, c)| c.joint.as_deref()).collect();
        all.join(", ")
    };
    let mut note = String::new();
    if means == Means::Current && !scaled {
        note += "   # TODO: currents: state scale = [N m at the joint for each A]";
    } else if means == Means::Current {
        let others = joints(&|c| c.gain_of_others);
        let untold = joints(&|c| c.scale == factor);
        note += "; gains by the nominal model";
        if !others.is_empty() {
            let _ = write!(note, ", of {others} the middle of the others");
        }
        if !untold.is_empty() {
            let _ = write!(note, ", of {untold} not told: 1 stands for it");
        }
        note += ": state those of the drives in scale";
    }
    let _ = match parts.is_empty() {
        true => writeln!(out, "{key} = {columns}   # confidence {least:.2}{note}"),
        false => writeln!(
            out,
            "{key} = {{ columns = {columns}, {} }}   # confidence {least:.2}{note}",
            parts.join(", ")
        ),
    };
}

/// Six digits, without dust.
fn round(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x)
}
