//! What the names of columns say: quantity, joint, unit. Names are a statement of whoever recorded; what the
//! numbers say is looked at elsewhere.

use super::formats::Format;
pub(crate) use super::unit::unit;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum Quantity {
    Time,
    Position,
    Velocity,
    Acceleration,
    Torque,
    Current,
    /// link-side positions of a second encoder
    Link,
    /// commanded position
    Command,
    /// a command that is no position, an error, or something that is known to be no quantity of a joint
    Other,
}

impl Quantity {
    /// The group of columns of our own that it becomes.
    pub fn group(self) -> Option<&'static str> {
        Some(match self {
            Quantity::Position => "q",
            Quantity::Velocity => "dq",
            Quantity::Acceleration => "ddq",
            Quantity::Torque | Quantity::Current => "tau",
            Quantity::Link => "ql",
            Quantity::Command => "qref",
            Quantity::Time | Quantity::Other => return None,
        })
    }
}

/// What a name says.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Named {
    pub quantity: Quantity,
    /// name of the joint
    pub joint: Option<String>,
    /// number of the joint, from whichever one the recorder counts
    pub number: Option<usize>,
    pub unit: Option<&'static str>,
}

/// Words of a name in small letters; letters and digits are different words.
fn words(name: &str) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    let mut before = ' ';
    for c in name.chars() {
        let new = !c.is_alphanumeric()
            || before.is_ascii_digit() != c.is_ascii_digit()
            || (before.is_lowercase() && c.is_uppercase());
        if c.is_alphanumeric() {
            match out.last_mut() {
                Some(last) if !new && before.is_alphanumeric() => last.extend(c.to_lowercase()),
                _ => out.push(c.to_lowercase().collect()),
            }
        }
        before = c;
    }
    out
}

fn quantity(word: &str) -> Option<Quantity> {
    Some(match word {
        "q" | "qs" | "pos" | "posn" | "position" | "positions" | "angle" | "angles" | "qpos"
        | "qm" | "jpos" | "encoder" | "enc" | "winkel" | "lage" | "istposition" | "istwinkel"
        | "lageistwert" | "posicion" | "posizione" | "位置" | "角度" => Quantity::Position,
        "dq" | "qd" | "qdot" | "vel" | "velocity" | "velocities" | "speed" | "speeds" | "spd"
        | "qvel" | "omega" | "geschwindigkeit" | "drehzahl" | "istgeschwindigkeit"
        | "istdrehzahl" | "vitesse" | "velocidad" | "velocita" | "速度" => Quantity::Velocity,
        "ddq" | "qdd" | "qddot" | "acc" | "accel" | "acceleration" | "accelerations" | "qacc" => {
            Quantity::Acceleration
        }
        "tau" | "torque" | "torques" | "effort" | "efforts" | "moment" | "trq" | "force"
        | "eff" | "drehmoment" | "istmoment" | "istdrehmoment" | "couple" | "coppia" | "力矩"
        | "扭矩" | "トルク" => Quantity::Torque,
        "current" | "currents" | "curr" | "cur" | "amps" | "strom" | "motorstrom" | "iststrom"
        | "iq" | "courant" | "corriente" | "corrente" | "电流" | "電流" => Quantity::Current,
        "dtau" | "taudot" => Quantity::Other,
        "ql" | "qlink" => Quantity::Link,
        "qref" | "qdes" | "qcmd" | "sollposition" | "sollwinkel" | "lagesollwert" => {
            Quantity::Command
        }
        _ => return None,
    })
}

/// What a position becomes by the word that follows it, as in `q_dot` and `theta_ddot`.
fn derived(words: &[String], at: usize) -> Option<Quantity> {
    let of = quantity(&words[at]);
    if of.is_some_and(|of| of != Quantity::Position) {
        return None;
    }
    match words.get(at + 1)?.as_str() {
        "dot" => Some(Quantity::Velocity),
        "ddot" | "dotdot" => Some(Quantity::Acceleration),
        _ => None,
    }
}

/// Words of a command.
fn commands(word: &str) -> bool {
    matches!(
        word,
        "ref"
            | "reference"
            | "des"
            | "desired"
            | "cmd"
            | "command"
            | "commanded"
            | "target"
            | "setpoint"
            | "goal"
            | "control"
            | "soll"
            | "sollwert"
            | "cmptd"
            | "computed"
            | "planned"
            | "demand"
            | "demanded"
    )
}

/// Words of what is no quantity of one joint.
fn elsewhere(word: &str) -> bool {
    matches!(
        word,
        "tcp"
            | "tcps"
            | "tcpf"
            | "temp"
            | "temperature"
            | "voltage"
            | "mode"
            | "status"
            | "scaling"
            | "wrench"
            | "cartesian"
            | "tool"
            | "ee"
            | "success"
            | "limit"
            | "stiffness"
            | "damping"
            | "covariance"
            | "orientation"
            | "pose"
            | "twist"
            | "index"
            | "id"
            | "seq"
            | "error"
            | "disturbance"
            | "err"
    )
}

/// … of one joint as measured.
fn foreign(word: &str) -> bool {
    let other = matches!(
        word,
        "ext" | "external" | "model" | "std" | "hat" | "dtau" | "theta" | "dtheta"
    );
    other || elsewhere(word)
}

/// Whether a name is that of no quantity of a joint as measured, whatever its numbers look like: of something else, or of a
/// command that is no position.
pub(crate) fn of_no_joint(name: &str) -> bool {
    let words = words(name);
    let commanded = || words.iter().any(|w| commands(w));
    let other = || named(name, Format::Csv).is_some_and(|n| n.quantity == Quantity::Other);
    words.iter().any(|w| elsewhere(w)) || commanded() && other()
}

/// Words of what was measured.
fn measured(word: &str) -> bool {
    matches!(
        word,
        "actual" | "act" | "measured" | "meas" | "feedback" | "ist"
    )
}

/// Words that say nothing of which joint it is.
fn idle(word: &str) -> bool {
    let other = matches!(
        word,
        "joint"
            | "joints"
            | "axis"
            | "actuator"
            | "actuators"
            | "achse"
            | "gelenk"
            | "axe"
            | "articulation"
            | "articulacion"
            | "eje"
            | "asse"
            | "giunto"
            | "关节"
            | "軸"
            | "istwert"
            | "motor"
            | "motors"
            | "state"
            | "states"
            | "raw"
            | "robot"
            | "field"
            | "msg"
            | "data"
            | "j"
            | "fb"
            | "rad"
            | "deg"
            | "nm"
            | "ma"
            | "a"
            | "m"
            | "n"
            | "s"
            | "per"
            | "as"
    );
    other || measured(word)
}

/// A name as the header has it, where a number was added because it stands there more than once.
pub(crate) fn as_written<'n>(name: &'n str, all: &[String]) -> &'n str {
    let Some((first, number)) = name.rsplit_once('#') else {
        return name;
    };
    let added = number.parse::<usize>().is_ok_and(|n| n > 1) && all.iter().any(|n| n == first);
    if added { first } else { name }
}

/// Names that stand in the header more than once.
pub(crate) fn repeated(all: &[String]) -> Vec<&str> {
    let mut out: Vec<&str> = Vec::new();
    for name in all {
        let written = as_written(name, all);
        if written != name && !out.contains(&written) {
            out.push(written);
        }
    }
    out
}

/// Whether a name is one of a time.
fn time(name: &str) -> Option<Option<&'static str>> {
    // of a path or of a field of a structure, its last part
    let last = name.rsplit(['.', '/']).next().unwrap_or(name);
    let whole = last.is_empty() || matches!(last, "sec" | "secs");
    let words = words(if whole { name } else { last });
    let clock = |w: &str| {
        matches!(
            w,
            "t" | "time"
                | "ts"
                | "timestamp"
                | "timestamps"
                | "stamp"
                | "clock"
                | "elapsed"
                | "duration"
                | "date"
                | "datetime"
                | "zeit"
                | "zeitstempel"
                | "uhrzeit"
                | "temps"
                | "tiempo"
                | "tempo"
                | "时间"
                | "時間"
        )
    };
    let beside = |w: &str| {
        matches!(
            w,
            "header"
                | "pc"
                | "host"
                | "ros"
                | "robot"
                | "epoch"
                | "utc"
                | "unix"
                | "s"
                | "sec"
                | "secs"
                | "seconds"
                | "ms"
                | "us"
                | "ns"
                | "msec"
                | "usec"
        )
    };
    let time = words.iter().any(|w| clock(w));
    let unit = words.iter().find_map(|w| match w.as_str() {
        "ms" | "msec" => Some("ms"),
        "us" | "usec" => Some("us"),
        "ns" => Some("ns"),
        "s" | "sec" | "secs" | "seconds" => Some("s"),
        _ => None,
    });
    (time && words.iter().all(|w| clock(w) || beside(w))).then_some(unit)
}

/// What the names of all columns say. Where columns of texts, the `labels`, hold the names of joints, as `name0` beside
/// `position0`, or the list `name` beside the list `position`, columns with the same number are of those joints.
pub(crate) fn all(names: &[String], labels: &[[String; 2]], format: Format) -> Vec<Option<Named>> {
    let mut out: Vec<Option<Named>> = names.iter().map(|n| named(n, format)).collect();
    let says = |n: &Option<Named>| n.as_ref().is_some_and(|n| n.quantity == Quantity::Position);
    // beside other positions they are those of motors
    if format != Format::Libfranka && !out.iter().any(says) {
        let angles = names.iter().map(|n| angle(n));
        out.iter_mut()
            .zip(angles)
            .for_each(|(named, angle)| *named = named.take().or(angle));
    }
    if !out.iter().any(|n| n.is_some() && !of_time(n)) {
        measured_beside_commanded(names, &mut out);
    }
    // what is left of a name, so that those of one message are told from others
    let rest = |name: &str, what: fn(&str) -> bool| -> Vec<String> {
        let all = words(name).into_iter();
        all.filter(|w| !what(w) && !idle(w) && w.parse::<usize>().is_err())
            .collect()
    };
    let calls: fn(&str) -> bool = |w| matches!(w, "name" | "names");
    for [label, joint] in labels {
        let parts = words(label);
        let Some(number) = number(&parts).filter(|_| parts.iter().any(|w| calls(w))) else {
            continue;
        };
        let message = rest(label, calls);
        for (name, named) in names.iter().zip(&mut out) {
            let Some(named) = named else { continue };
            let own = named.number == Some(number) && named.joint.is_none();
            if own && rest(name, |w| quantity(w).is_some() || commands(w)) == message {
                named.joint = Some(joint.clone());
            }
        }
    }
    out
}

fn of_time(named: &Option<Named>) -> bool {
    named.as_ref().is_some_and(|n| n.quantity == Quantity::Time)
}

/// Names without a quantity, where as many say that they were measured as that they were commanded, `actual_3` and `desired_3`:
/// positions and their commands.
fn measured_beside_commanded(names: &[String], out: &mut [Option<Named>]) {
    let says = |name: &String| {
        let words = words(name);
        let number = number(&words)?;
        let whole = |w: &String| idle(w) || commands(w) || w.parse::<usize>().is_ok();
        let quantity = match (
            words.iter().any(|w| measured(w)),
            words.iter().any(|w| commands(w)),
        ) {
            (true, false) => Quantity::Position,
            (false, true) => Quantity::Command,
            _ => return None,
        };
        words.iter().all(whole).then_some((quantity, number))
    };
    let found: Vec<Option<(Quantity, usize)>> = names.iter().map(says).collect();
    let count = |of| found.iter().flatten().filter(|f| f.0 == of).count();
    let positions = count(Quantity::Position);
    if positions == 0 || positions != count(Quantity::Command) {
        return;
    }
    for ((name, found), out) in names.iter().zip(found).zip(out) {
        let Some((quantity, number)) = found else {
            continue;
        };
        *out = Some(Named {
            quantity,
            joint: None,
            number: Some(number),
            unit: unit_of(name, quantity, Format::Csv),
        });
    }
}

/// What a name says in which an angle is called theta.
fn angle(name: &str) -> Option<Named> {
    let words = words(name);
    let theta = |w: &String| match w.as_str() {
        "theta" | "thetas" | "θ" => Some(Quantity::Position),
        "dtheta" | "thetadot" | "thetad" => Some(Quantity::Velocity),
        "ddtheta" | "thetaddot" | "thetadd" => Some(Quantity::Acceleration),
        _ => None,
    };
    let at = words.iter().position(|w| theta(w).is_some())?;
    let derived = derived(&words, at);
    let quantity = derived.or(theta(&words[at]))?;
    let dot = |w: &String| derived.is_some() && w.ends_with("dot");
    let plain = |w: &String| theta(w).is_some() || idle(w) || w.parse::<usize>().is_ok() || dot(w);
    words.iter().all(plain).then(|| Named {
        quantity,
        joint: None,
        number: number(&words),
        unit: unit_of(name, quantity, Format::Csv),
    })
}

/// What a name says beside the quantity, whether it is a command, a joint's number or one of the words `of` joints:
/// `["sm"]` of `TorqueSm1`.
pub(crate) fn beside(name: &str, of: &[&str]) -> Vec<String> {
    let joints: Vec<String> = of.iter().flat_map(|joint| words(joint)).collect();
    let mut out = words(name);
    if let Some(at) = out.iter().position(|w| quantity(w).is_some()) {
        out.drain(at..=at + usize::from(derived(&out, at).is_some()));
    }
    // beside others, those of motors are their own
    let says = |w: &String| {
        commands(w) || idle(w) && !w.starts_with("motor") || w.parse::<usize>().is_ok()
    };
    out.retain(|w| !(says(w) || joints.contains(w)));
    out
}

/// The number of a joint in a name that is a word for a joint and a number, as `axis_3`.
pub(crate) fn joint_of(name: &str) -> Option<usize> {
    let all = words(name);
    let joint = |w: &String| {
        matches!(
            w.as_str(),
            "joint" | "axis" | "motor" | "actuator" | "servo" | "j" | "achse" | "gelenk" | "axe"
        )
    };
    let plain = |w: &String| joint(w) || w.parse::<usize>().is_ok();
    (all.len() == 2 && all.iter().any(joint) && all.iter().all(plain)).then(|| number(&all))?
}

/// The last number of a name.
fn number(words: &[String]) -> Option<usize> {
    words.iter().rev().find_map(|w| w.parse().ok())
}

/// What a name says, if anything.
pub(crate) fn named(name: &str, format: Format) -> Option<Named> {
    let plain = |quantity, joint, number, unit| {
        Some(Named {
            quantity,
            joint,
            number,
            unit,
        })
    };
    // columns of bags: what/joint
    if matches!(format, Format::Db3 | Format::Mcap)
        && let Some((what, joint)) = name.split_once('/')
    {
        let (part, what) = what.split_once('.').unwrap_or(("", what));
        let quantity = match (part, quantity(what)?) {
            ("reference", Quantity::Position) => Quantity::Command,
            ("reference" | "error", _) => Quantity::Other,
            (_, quantity) => quantity,
        };
        return plain(quantity, Some(joint.into()), None, None);
    }
    if let Some(unit) = time(name) {
        let unit = match format {
            Format::Libfranka => unit.or(Some("ms")),
            _ => unit,
        };
        return plain(Quantity::Time, None, None, unit);
    }
    if format == Format::Csv && matches!(name, "x" | "y" | "z" | "qw" | "qx" | "qy" | "qz") {
        return plain(Quantity::Other, None, None, None);
    }
    let words = words(name);
    let Some(at) = words.iter().position(|w| quantity(w).is_some()) else {
        return by_unit(name, &words);
    };
    let mut what = quantity(&words[at])?;
    let derived = derived(&words, at);
    what = derived.unwrap_or(what);
    let desired = format == Format::Libfranka
        && (words.get(at + 1).is_some_and(|w| w == "d")
            || words.get(at + 1).is_some_and(|w| w == "j")
                && words.get(at + 2).is_some_and(|w| w == "d")
            || words[0] == "cmd");
    let commanded = desired || words.iter().any(|w| commands(w));
    if words.iter().any(|w| foreign(w)) {
        what = Quantity::Other;
    } else if commanded {
        what = match what {
            Quantity::Position | Quantity::Command => Quantity::Command,
            _ => Quantity::Other,
        };
    } else if words.iter().any(|w| w == "link") && what == Quantity::Position {
        what = Quantity::Link;
    }
    // two measurements of one kind in a name, as in actual_current_as_torque
    if what == Quantity::Current && words.iter().any(|w| w == "torque") {
        what = Quantity::Torque;
    }
    let number = number(&words);
    let rest: Vec<&str> = words
        .iter()
        .map(String::as_str)
        .filter(|w| {
            quantity(w).is_none() && !commands(w) && !idle(w) && w.parse::<usize>().is_err()
        })
        .filter(|w| derived.is_none() || !w.ends_with("dot"))
        .collect();
    let joint = match rest.is_empty() || number.is_some() && format != Format::Csv {
        true => None,
        false => Some(joint_part(name)),
    };
    plain(what, joint, number, unit_of(name, what, format))
}

/// What a name says that is no more than the number of a joint, as `A1 [deg]` or `i1_mA`: its unit tells. `AXIS_ACT.A1` is what KUKA calls
/// a position.
fn by_unit(name: &str, words: &[String]) -> Option<Named> {
    let number = number(words)?;
    let unit = in_brackets(name).or_else(|| at_end(name));
    let quantity = match unit {
        _ if words.windows(2).any(|w| w[0] == "axis" && w[1] == "act") => Quantity::Position,
        Some("rad" | "deg" | "rev") => Quantity::Position,
        Some("rad/s" | "deg/s" | "rev/s" | "rpm") => Quantity::Velocity,
        Some("rad/s^2" | "deg/s^2") => Quantity::Acceleration,
        Some("N m" | "Nm" | "mNm") => Quantity::Torque,
        Some("A" | "mA") => Quantity::Current,
        _ => return None,
    };
    let before = name.split(['[', '(']).next().unwrap_or(name);
    let current = quantity == Quantity::Current;
    let plain = |w: &String| {
        idle(w) || w.parse::<usize>().is_ok() || current && matches!(w.as_str(), "i" | "iq")
    };
    self::words(before).iter().all(plain).then_some(Named {
        quantity,
        joint: None,
        number: Some(number),
        unit,
    })
}

/// Of a path such as `/joint_states/elbow/position` the part that names the joint.
fn joint_part(name: &str) -> String {
    let says = |part: &&str| {
        !part.is_empty()
            && !words(part)
                .iter()
                .all(|w| quantity(w).is_some() || commands(w))
    };
    let part = name.rsplit('/').find(says);
    part.unwrap_or(name).to_string()
}

/// The unit that stands in brackets at the end of a name.
fn in_brackets(name: &str) -> Option<&'static str> {
    let (_, rest) = name.rsplit_once(['[', '('])?;
    unit(rest.trim_end_matches([']', ')'])).map(|(u, _)| u)
}

/// The unit that is the last word of a name, of those that mean nothing else.
fn at_end(name: &str) -> Option<&'static str> {
    match name.rsplit_once('_')?.1.to_lowercase().as_str() {
        "rad" => Some("rad"),
        "deg" => Some("deg"),
        "nm" => Some("N m"),
        "ma" => Some("mA"),
        _ => None,
    }
}

/// Whether a name has a unit of time in brackets.
pub(crate) fn in_unit_of_time(name: &str) -> bool {
    matches!(in_brackets(name), Some("s" | "ms" | "us" | "ns" | "min"))
}

/// The unit that stands in a name, in brackets or at its end; of Kortex degrees.
fn unit_of(name: &str, quantity: Quantity, format: Format) -> Option<&'static str> {
    let bracket = in_brackets(name);
    let low = name.to_lowercase();
    let angle = matches!(
        quantity,
        Quantity::Position
            | Quantity::Velocity
            | Quantity::Acceleration
            | Quantity::Command
            | Quantity::Link
    );
    let degrees = angle
        && words(&low)
            .iter()
            .any(|w| matches!(w.as_str(), "deg" | "degree" | "degrees"));
    let milli = quantity == Quantity::Current && words(&low).iter().any(|w| w == "ma");
    bracket
        .or(degrees.then_some("deg"))
        .or(milli.then_some("mA"))
        .or((format == Format::Kortex && angle).then_some("deg"))
        .or((quantity == Quantity::Current).then_some("A"))
}

/// Which of `found` is each joint of `robot`: by equal names, else by the end that they share. `None` for a
/// joint that none or several fit.
pub(crate) fn match_joints(found: &[String], robot: &[&str]) -> Vec<Option<usize>> {
    let all: Vec<Vec<String>> = found.iter().map(|f| words(f)).collect();
    let scores: Vec<Vec<i64>> = robot
        .iter()
        .map(|r| {
            let own = words(r);
            all.iter()
                .map(|f| {
                    if *f == own {
                        return i64::MAX;
                    }
                    // the name of the joint within that of a column
                    let inside = !own.is_empty() && f.windows(own.len()).any(|w| w == own);
                    let same = own
                        .iter()
                        .rev()
                        .zip(f.iter().rev())
                        .take_while(|(a, b)| a == b)
                        .count() as i64;
                    match (inside, same) {
                        (true, _) => 1000 - f.len() as i64,
                        (_, 0) => i64::MIN,
                        _ => 3 * same - own.len() as i64 - f.len() as i64,
                    }
                })
                .collect()
        })
        .collect();
    (0..robot.len())
        .map(|j| {
            let best = (0..found.len()).max_by_key(|&k| scores[j][k])?;
            let score = scores[j][best];
            let tied = (0..found.len()).filter(|&k| scores[j][k] == score).count() > 1;
            // and no other joint wants it more
            let wanted = (0..robot.len()).any(|i| i != j && scores[i][best] >= score);
            (score > i64::MIN && !tied && !wanted).then_some(best)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn says(name: &str, format: Format) -> Option<(Quantity, Option<usize>)> {
        named(name, format).map(|n| (n.quantity, n.number))
    }

    #[test]
    fn names_of_recorders_are_understood() {
        use Quantity::*;
        for (name, format, quantity, number) in [
            ("actual_q_0", Format::Rtde, Position, Some(0)),
            ("target_q_5", Format::Rtde, Command, Some(5)),
            ("actual_current_3", Format::Rtde, Current, Some(3)),
            ("target_moment_3", Format::Rtde, Other, Some(3)),
            ("actual_qd_2", Format::Rtde, Velocity, Some(2)),
            ("state.q[6]", Format::Libfranka, Position, Some(6)),
            ("state.q_d[6]", Format::Libfranka, Command, Some(6)),
            ("state.dq[1]", Format::Libfranka, Velocity, Some(1)),
            ("state.tau_J[1]", Format::Libfranka, Torque, Some(1)),
            ("state.tau_J_d[1]", Format::Libfranka, Other, Some(1)),
            ("state.dtau_J[1]", Format::Libfranka, Other, Some(1)),
            ("cmd.tau_J_d[1]", Format::Libfranka, Other, Some(1)),
            (
                "state.tau_ext_hat_filtered[1]",
                Format::Libfranka,
                Other,
                Some(1),
            ),
            ("actuators[0].position", Format::Kortex, Position, Some(0)),
            ("positions[2]", Format::Csv, Position, Some(2)),
            ("control.positions[2]", Format::Csv, Command, Some(2)),
            (
                "/joint_states/elbow_joint/effort",
                Format::Csv,
                Torque,
                None,
            ),
            ("field.velocity3", Format::Csv, Velocity, Some(3)),
            ("Joint 4 angle [deg]", Format::Csv, Position, Some(4)),
            ("Achse 4 Ist [Grad]", Format::Csv, Position, Some(4)),
            ("Istposition_A4", Format::Csv, Position, Some(4)),
            ("Sollposition_A4", Format::Csv, Command, Some(4)),
            ("Achse4_Winkel_Soll", Format::Csv, Command, Some(4)),
            ("Drehmoment Achse 4 [Nm]", Format::Csv, Torque, Some(4)),
            ("Motorstrom Achse 4 [A]", Format::Csv, Current, Some(4)),
            ("q_dot_4", Format::Csv, Velocity, Some(4)),
            ("q_ddot_4", Format::Csv, Acceleration, Some(4)),
            ("tau_model_4", Format::Csv, Other, Some(4)),
            ("PositionCmptd4", Format::Csv, Command, Some(4)),
        ] {
            assert_eq!(says(name, format), Some((quantity, number)), "{name}");
        }
        assert_eq!(named("foo", Format::Csv), None);
        assert_eq!(named("O_T_EE[3]", Format::Libfranka), None);
        assert_eq!(
            named("Joint 4 angle [deg]", Format::Csv).unwrap().unit,
            Some("deg")
        );
        assert_eq!(named("time_ms", Format::Csv).unwrap().unit, Some("ms"));
        assert_eq!(named("%time", Format::Csv).unwrap().quantity, Time);
    }

    #[test]
    fn theta_is_a_position_where_no_other_is() {
        let quantities = |names: &[&str], format| -> Vec<Option<Quantity>> {
            let names: Vec<String> = names.iter().map(|n| n.to_string()).collect();
            let all = all(&names, &[], format);
            all.into_iter().map(|n| n.map(|n| n.quantity)).collect()
        };
        let [position, velocity] = [Quantity::Position, Quantity::Velocity].map(Some);
        let torque = Some(Quantity::Torque);
        let alone = ["theta1", "thetadot1", "dtheta_1", "tau1"];
        let found = quantities(&alone, Format::Csv);
        assert_eq!(found, [position, velocity, velocity, torque]);
        let beside = quantities(&["q1", "theta1", "tau1"], Format::Csv);
        assert_eq!(beside, [position, None, torque]);
        let franka = quantities(&["state.theta[0]"], Format::Libfranka);
        assert_eq!(franka, [None]);
        let dotted = quantities(&["theta_1", "theta_dot_1", "theta_ddot_1"], Format::Csv);
        let acceleration = Some(Quantity::Acceleration);
        assert_eq!(dotted, [position, velocity, acceleration]);
        let pairs = ["t", "actual_1", "desired_1", "error_1"];
        let told = quantities(&pairs, Format::Csv);
        let [time, command] = [Quantity::Time, Quantity::Command].map(Some);
        assert_eq!(told, [time, position, command, None]);
        assert_eq!(quantities(&["actual_1", "x_1"], Format::Csv), [None, None]);
    }

    #[test]
    fn what_a_name_says_beside_quantity_and_joint_is_told() {
        let joints = ["panda_joint1", "panda_joint2"];
        for (name, says) in [
            ("Position1", &[][..]),
            ("q_raw_1", &[]),
            ("q_dot_1", &[]),
            ("panda_joint1_position", &[]),
            ("TorqueCur1", &["cur"]),
            ("q1_filtered", &["filtered"]),
            ("motor_pos_1", &["motor"]),
            ("e_q_1", &["e"]),
            ("tau_dot_1", &["dot"]),
        ] {
            assert_eq!(beside(name, &joints), says, "{name}");
        }
    }

    #[test]
    fn joints_are_matched_by_name() {
        let names = |list: &[&str]| list.iter().map(|s| s.to_string()).collect::<Vec<_>>();
        let found = names(&["elbow_joint", "shoulder_lift_joint", "shoulder_pan_joint"]);
        let robot = [
            "ur_shoulder_pan_joint",
            "ur_shoulder_lift_joint",
            "ur_elbow_joint",
        ];
        assert_eq!(match_joints(&found, &robot), [Some(2), Some(1), Some(0)]);
        let found = names(&["fer_finger_joint1", "fer_joint2", "fer_joint1"]);
        assert_eq!(
            match_joints(&found, &["panda_joint1", "panda_joint2"]),
            [Some(2), Some(1)]
        );
        let found = names(&["left_wrist", "right_wrist"]);
        assert_eq!(match_joints(&found, &["wrist", "elbow"]), [None, None]);
    }
}
