//! What the names of the columns state.

use super::claim::{Claim, Means};
use super::frame::Frame;
use crate::error::{Warning, WarningKind, counted, listed};
use crate::log::formats::Format;
use crate::log::names::{self, Quantity};
use crate::plant::Plant;

/// How far a name is believed that nothing confirms.
const NAMED: f64 = 0.8;
/// … and one of a recorder's own file, whose columns are documented.
const DOCUMENTED: f64 = 0.9;

/// Noise of torques, as a share of that of others, below which it is said that a model may have made them.
const SMOOTH: f64 = 0.1;

/// One claim a column, from its name alone.
pub(super) fn claims(
    frames: &[Frame],
    format: Format,
    robot: Option<&Plant>,
    warnings: &mut Vec<Warning>,
) -> Vec<Claim> {
    let Some(frame) = frames.first() else {
        return Vec::new();
    };
    let confidence = match format {
        Format::Csv | Format::Npz | Format::Mat | Format::Json => NAMED,
        _ => DOCUMENTED,
    };
    let mut all = names::all(&frame.names, &frame.labels, format);
    untell_repeated(frame, &mut all, warnings);
    let mut out: Vec<Claim> = frame.names.iter().map(|n| Claim::none(n)).collect();
    if let Some(k) = frame.time {
        out[k].means = Means::Time;
        out[k].unit = Some(frame.time_unit);
        out[k].scale = names::unit(frame.time_unit).map_or(1.0, |(_, f)| f);
        out[k].confidence = 0.99;
        out[k].evidence = "it increases by even steps".into();
    }
    for quantity in [
        Quantity::Position,
        Quantity::Velocity,
        Quantity::Acceleration,
        Quantity::Torque,
        Quantity::Current,
        Quantity::Command,
        Quantity::Link,
    ] {
        let columns: Vec<usize> = (0..all.len())
            .filter(|&k| {
                Some(k) != frame.time && all[k].as_ref().is_some_and(|n| n.quantity == quantity)
            })
            .collect();
        let (columns, others) = plain(columns, robot, frame);
        for &k in &others {
            out[k].abstain(&format!(
                "its name says more than {}, and what that means is not known",
                frame.names[columns[0]]
            ));
            out[k].of_no_joint = true;
        }
        if quantity == Quantity::Torque && !others.is_empty() {
            warnings.push(one_of_several(frame, &columns, &others));
        }
        if columns.is_empty() {
            continue;
        }
        let order = joints_of(&columns, &all, robot, frame, warnings);
        for (k, joint) in columns.iter().zip(order) {
            let Some(name) = &all[*k] else { continue };
            let claim = &mut out[*k];
            claim.means = match quantity {
                Quantity::Position | Quantity::Link => Means::Position,
                Quantity::Velocity => Means::Velocity,
                Quantity::Acceleration => Means::Acceleration,
                Quantity::Torque => Means::Torque,
                Quantity::Current => Means::Current,
                _ => Means::Command,
            };
            claim.side = match quantity {
                Quantity::Link => Some("link"),
                Quantity::Current => Some("motor"),
                _ => None,
            };
            claim.commands = (quantity == Quantity::Command).then_some("position");
            claim.evidence = "its name".into();
            claim.named = true;
            claim.confidence = confidence;
            if let Some((unit, factor)) = name.unit.and_then(names::unit) {
                claim.unit = Some(unit);
                claim.scale = factor;
            }
            match joint {
                Some((at, name)) => {
                    claim.at = Some(at);
                    claim.joint = Some(name);
                }
                None => {
                    claim.abstain("its name says what it is, but of which joint cannot be told")
                }
            }
        }
    }
    magnitudes(frame, &mut out, warnings);
    out
}

/// Of `columns` of one quantity those whose names say no more than it and the joint, where each joint has one: `Torque1` beside
/// `TorqueSm1`; and the others of its kind. All of them where no such choice is to be made.
fn plain(columns: Vec<usize>, robot: Option<&Plant>, frame: &Frame) -> (Vec<usize>, Vec<usize>) {
    let joints = robot.map_or(Vec::new(), |p| p.actuators());
    let joints: Vec<&str> = joints.iter().map(|j| j.name.as_str()).collect();
    let beside = |k: &usize| names::beside(&frame.names[*k], &joints);
    let (plain, others): (Vec<usize>, Vec<usize>) =
        columns.iter().partition(|k| beside(k).is_empty());
    let least = if robot.is_some() { joints.len() } else { 2 };
    let first = others.first().map(beside);
    let alike = others.iter().filter(|k| Some(beside(k)) == first).count();
    let whole = |count: usize| count == least || robot.is_none() && count > least;
    match whole(plain.len()) && alike == plain.len() {
        true => (plain, others),
        false => (columns, Vec::new()),
    }
}

/// Which torques were taken, and from which others: what a program computed may stand beside what was measured.
fn one_of_several(frame: &Frame, taken: &[usize], others: &[usize]) -> Warning {
    let called = |columns: &[usize]| {
        let first = columns.first().map_or("", |&k| &frame.names[k]);
        match columns.len() {
            0 | 1 => first.to_string(),
            n => format!("{first} and {} more", n - 1),
        }
    };
    let grain = |columns: &[usize]| {
        let of = |k: &usize| super::kinematics::grain(&frame.columns[*k]);
        crate::median::median(columns.iter().map(of))
    };
    let smooth = match grain(taken) < SMOOTH * grain(others) {
        true => "They have hardly any noise beside these: a model may have made them. ",
        false => "",
    };
    let message = format!(
        "the torques are taken from {}. Called torques, too: {}. {smooth}State in [record.columns] which were measured",
        called(taken),
        called(others),
    );
    Warning::new(WarningKind::UnitSuspect, &frame.names[taken[0]], message)
}

/// Takes the joint from names that stand in the header more than once: which of them is meant is not known.
fn untell_repeated(frame: &Frame, all: &mut [Option<names::Named>], warnings: &mut Vec<Warning>) {
    for name in names::repeated(&frame.names) {
        let same = |k: &usize| names::as_written(&frame.names[*k], &frame.names) == name;
        let columns: Vec<usize> = (0..all.len()).filter(same).collect();
        let mut told = false;
        for k in &columns {
            let Some(named) = &mut all[*k] else { continue };
            named.number = None;
            told |= named.quantity != Quantity::Time;
            named.joint = None;
        }
        if told {
            let called: Vec<String> = columns.iter().map(|k| frame.names[*k].clone()).collect();
            warnings.push(Warning::new(
                WarningKind::ColumnsIgnored,
                name,
                format!(
                    "{} columns are called so: which is of which joint, their name does not tell. State it in \
                     [record.columns], where they are called {}",
                    columns.len(),
                    listed(&called)
                ),
            ));
        }
    }
}

/// The joint of each column: by name, or in the order of the numbers.
fn joints_of(
    columns: &[usize],
    all: &[Option<names::Named>],
    robot: Option<&Plant>,
    frame: &Frame,
    warnings: &mut Vec<Warning>,
) -> Vec<Option<(usize, String)>> {
    let of = |k: usize| all[k].as_ref();
    let mut out = vec![None; columns.len()];
    let own: Vec<String> = robot.map_or(Vec::new(), |p| {
        p.actuators().iter().map(|j| j.name.clone()).collect()
    });
    let found: Vec<String> = columns
        .iter()
        .map(|&k| of(k).and_then(|n| n.joint.clone()).unwrap_or_default())
        .collect();
    // one word for all and a number is a name only where the robot calls its joints so
    let stem = |name: &String| -> String { name.chars().filter(|c| !c.is_ascii_digit()).collect() };
    let first = found.first().map(stem);
    let alike = |name: &String| Some(stem(name)) == first;
    let counted_only = found.len() > 1
        && found.len() == own.len()
        && columns
            .iter()
            .all(|&k| of(k).is_some_and(|n| n.number.is_some()))
        && found.iter().all(alike)
        && !own.iter().any(alike);
    if found.iter().all(|f| !f.is_empty()) && !counted_only {
        let refs: Vec<&str> = own.iter().map(String::as_str).collect();
        if robot.is_none() {
            for (i, name) in found.iter().enumerate() {
                out[i] = Some((i, name.clone()));
            }
            return out;
        }
        let at = names::match_joints(&found, &refs);
        if at.iter().any(Option::is_some) {
            for (j, i) in at.iter().enumerate() {
                match i {
                    Some(i) => out[*i] = Some((j, own[j].clone())),
                    None => warnings.push(Warning::new(
                        WarningKind::ColumnsIgnored,
                        &own[j],
                        format!(
                            "no column is called like it (there are {})",
                            found.join(", ")
                        ),
                    )),
                }
            }
            return out;
        }
    }
    let mut numbers: Vec<(usize, usize)> = columns
        .iter()
        .enumerate()
        .filter_map(|(i, &k)| Some((of(k)?.number?, i)))
        .collect();
    numbers.sort_unstable();
    // what has no number beside as many as there are joints is something else
    let whole = numbers.len() == columns.len() || numbers.len() == own.len();
    let distinct = numbers.windows(2).all(|w| w[0].0 < w[1].0) && whole;
    if !distinct && columns.len() > 1 {
        return out;
    }
    if columns.len() == 1 && numbers.is_empty() {
        numbers.push((0, 0));
    }
    if robot.is_some() && numbers.len() != own.len() {
        warnings.push(Warning::new(
            WarningKind::ColumnsIgnored,
            &frame.names[columns[0]],
            format!(
                "{} of this kind, but the robot has {}: not given to joints by their order",
                counted(numbers.len(), "column"),
                counted(own.len(), "actuated joint")
            ),
        ));
        return out;
    }
    for (at, (_, i)) in numbers.into_iter().enumerate() {
        let name = own
            .get(at)
            .cloned()
            .unwrap_or_else(|| format!("joint {}", at + 1));
        out[i] = Some((at, name));
    }
    out
}

/// Names of the joints that the claims are about.
pub(super) fn joints(claims: &[Claim]) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    for c in claims {
        if let (Some(at), Some(name)) = (c.at, &c.joint) {
            while out.len() <= at {
                out.push(format!("joint {}", out.len() + 1));
            }
            out[at] = name.clone();
        }
    }
    out
}

/// What is called a torque and is never negative, although its joints go both ways, is the size of a load.
fn magnitudes(frame: &Frame, claims: &mut [Claim], warnings: &mut Vec<Warning>) {
    for means in [Means::Torque, Means::Current] {
        let columns: Vec<usize> = (0..claims.len())
            .filter(|&k| claims[k].means == means)
            .collect();
        let unsigned = |k: &usize| frame.columns[*k].iter().all(|x| *x >= 0.0);
        let changes = |k: &usize| {
            let y = &frame.columns[*k];
            let (a, b) = (y[0], y.iter().copied().fold(0.0, f64::max));
            y.iter().any(|x| *x != a) && y.iter().any(|x| *x < 0.05 * b)
        };
        if columns.len() < 2 || !columns.iter().all(unsigned) || !columns.iter().any(changes) {
            continue;
        }
        for &k in &columns {
            claims[k].abstain("it is never negative although the joint goes both ways: the size of a load, without sign");
        }
        warnings.push(Warning::new(
            WarningKind::UnitSuspect,
            &frame.names[columns[0]],
            format!(
                "it and {} more columns are called torques and are never negative, although the joints go both ways: \
                 they are the size of a load, and no torque. There is no torque here: \
                 positions, velocities and their delay against the command can be told from it, no inertia, no \
                 friction and no load",
                columns.len() - 1
            ),
        ));
    }
}
