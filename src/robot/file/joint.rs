//! One `[[joint]]` of a `robot.toml`.

use super::Text;
use crate::error::{Result, Warning, WarningKind};
use crate::robot::urdf::StatedLimits;
use crate::robot::{Joint, JointTerm, VelocityByPosition};
use serde::Deserialize;
use toml::Spanned;

/// One `[[joint]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct JointEntry {
    /// empty where it is missing, so that the same entry can state what all joints share
    #[serde(default = "nameless")]
    pub(crate) name: Spanned<String>,
    pub(crate) position: Option<Spanned<Vec<f64>>>,
    velocity: Option<Spanned<f64>>,
    acceleration: Option<Spanned<f64>>,
    jerk: Option<Spanned<f64>>,
    effort: Option<Spanned<f64>>,
    pub(crate) effort_rate: Option<Spanned<f64>>,
    pub(crate) velocity_by_position: Option<Spanned<ByPositionEntry>>,
    torque_noise: Option<Spanned<f64>>,
    position_resolution: Option<Spanned<f64>>,
    gear_ratio: Option<Spanned<f64>>,
    piston: Option<Spanned<Vec<f64>>>,
    stribeck: Option<Spanned<f64>>,
    stribeck_velocity: Option<Spanned<f64>>,
    continuous_torque: Option<Spanned<f64>>,
    continuous_power: Option<Spanned<f64>>,
    armature: Option<Spanned<f64>>,
    viscous: Option<Spanned<f64>>,
    coulomb: Option<Spanned<f64>>,
    offset: Option<Spanned<f64>>,
    #[serde(default)]
    identify: Vec<Spanned<String>>,
}

/// `velocity_by_position`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ByPositionEntry {
    deceleration: f64,
    #[serde(default)]
    offset: f64,
    // a vector, because an array would swallow further elements in silence
    position: Option<Vec<f64>>,
}

/// Smallest and largest limit: what lies outside is a slip, and powers of it would leave the range
/// of numbers.
const SMALLEST: f64 = 1e-12;
const LARGEST: f64 = 1e12;

fn in_range(x: f64) -> bool {
    x == 0.0 || (SMALLEST..=LARGEST).contains(&x.abs())
}

fn nameless() -> Spanned<String> {
    Spanned::new(0..0, String::new())
}

/// The limits that replace those of the URDF, checked.
pub(crate) fn stated_limits(source: Text, entry: &JointEntry, what: &str) -> Result<StatedLimits> {
    let position = match &entry.position {
        None => None,
        Some(position) => match position.get_ref()[..] {
            // false where one of them is not a number
            [lower, upper]
                if lower < upper
                    && [lower, upper]
                        .iter()
                        .all(|x| x.is_infinite() || x.abs() <= LARGEST) =>
            {
                Some([lower, upper])
            }
            [lower, upper] if lower < upper => {
                return Err(source.error(
                    position.span().start,
                    what,
                    format!(
                        "position = [{lower:e}, {upper:e}] is beyond {LARGEST:e}; write inf where \
                         there is no limit"
                    ),
                ));
            }
            _ => {
                return Err(source.error(
                    position.span().start,
                    what,
                    "position must be two numbers [lower, upper] with lower < upper",
                ));
            }
        },
    };
    Ok(StatedLimits {
        position,
        velocity: positive(source, &entry.velocity, "velocity", what)?,
        effort: positive(source, &entry.effort, "effort", what)?,
        by_position: entry.velocity_by_position.is_some(),
    })
}

/// A velocity by position, at the ends of the joint's range where it states none.
fn by_position(
    source: Text,
    entry: &Spanned<ByPositionEntry>,
    what: &str,
    range: [f64; 2],
) -> Result<VelocityByPosition> {
    let (at, e) = (entry.span().start, entry.get_ref());
    let error =
        |message: String| source.error(at, what, format!("velocity_by_position: {message}"));
    let (d, o) = (e.deceleration, e.offset);
    if !(d > 0.0 && in_range(d) && o >= 0.0 && in_range(o)) {
        return Err(error(format!(
            "deceleration = {d} must be positive and offset = {o} not negative, in SI units"
        )));
    }
    let position = match e.position.as_deref() {
        None => range,
        Some(&[low, high]) if low < high => [low, high],
        Some(_) => return Err(error("position must be two numbers [lower, upper]".into())),
    };
    let limit = VelocityByPosition {
        deceleration: d,
        offset: o,
        position,
    };
    match limit.flaw() {
        None => Ok(limit),
        Some(flaw) => Err(error(format!(
            "it {flaw}; state other figures, or `position` in it"
        ))),
    }
}

/// A positive limit; infinite means none.
pub(super) fn positive(
    source: Text,
    value: &Option<Spanned<f64>>,
    key: &str,
    what: &str,
) -> Result<Option<f64>> {
    match value {
        Some(v) if v.get_ref().is_nan() || *v.get_ref() <= 0.0 => Err(source.error(
            v.span().start,
            what,
            format!(
                "{key} = {} must be positive; leave it out where there is none",
                v.get_ref()
            ),
        )),
        Some(v) if v.get_ref().is_finite() && !in_range(*v.get_ref()) => Err(source.error(
            v.span().start,
            what,
            format!(
                "{key} = {:e} is not between {SMALLEST:e} and {LARGEST:e}; correct it, in SI units",
                v.get_ref()
            ),
        )),
        Some(v) => Ok(Some(*v.get_ref())),
        None => Ok(None),
    }
}

/// A positive number; infinite is an error, too.
fn positive_finite(
    source: Text,
    value: &Option<Spanned<f64>>,
    key: &str,
    what: &str,
) -> Result<Option<f64>> {
    match (positive(source, value, key, what)?, value) {
        (Some(x), Some(v)) if x.is_infinite() => {
            Err(source.error(v.span().start, what, format!("{key} must be finite")))
        }
        (x, _) => Ok(x),
    }
}

/// Everything of a `[[joint]]` that the tree does not need.
pub(crate) fn joint_values(
    source: Text,
    entry: &JointEntry,
    what: &str,
    joint: &mut Joint,
    warnings: &mut Vec<Warning>,
) -> Result<()> {
    if let Some(a) = positive(source, &entry.acceleration, "acceleration", what)? {
        joint.limits.acceleration = a;
    }
    if let Some(j) = positive(source, &entry.jerk, "jerk", what)? {
        joint.limits.jerk = j;
    }
    if let Some(rate) = positive(source, &entry.effort_rate, "effort_rate", what)? {
        joint.limits.effort_rate = rate;
    }
    if let Some(entry) = &entry.velocity_by_position {
        let limit = by_position(source, entry, what, joint.limits.position)?;
        joint.limits.velocity_by_position = Some(limit);
    }
    joint.torque_noise = positive_finite(source, &entry.torque_noise, "torque_noise", what)?;
    joint.position_resolution = positive_finite(
        source,
        &entry.position_resolution,
        "position_resolution",
        what,
    )?;
    for (to, entry, key) in [
        (
            &mut joint.continuous_torque,
            &entry.continuous_torque,
            "continuous_torque",
        ),
        (
            &mut joint.continuous_power,
            &entry.continuous_power,
            "continuous_power",
        ),
    ] {
        *to = positive_finite(source, entry, key, what)?.or(*to);
    }
    if let Some(ratio) = &entry.gear_ratio {
        let value = *ratio.get_ref();
        if !in_range(value) || value == 0.0 {
            return Err(source.error(
                ratio.span().start,
                what,
                format!("gear_ratio = {value:e} must be finite, not 0, and that of a real gear"),
            ));
        }
        joint.gear_ratio = Some(value);
    }
    if let Some(piston) = &entry.piston {
        joint.piston = match piston.get_ref()[..] {
            [a, b] if a > 0.0 && b > 0.0 && a < 10.0 && b < 10.0 => Some([a, b]),
            _ => {
                return Err(source.error(
                    piston.span().start,
                    what,
                    "piston must be two areas in m^2 (chamber a, which extends, and chamber b), as in \
                     [1.963e-3, 1.649e-3]",
                ));
            }
        };
    }
    let terms = [
        &entry.armature,
        &entry.viscous,
        &entry.coulomb,
        &entry.offset,
    ];
    for (term, value) in JointTerm::ALL.into_iter().zip(terms) {
        let Some(value) = value else { continue };
        let (at, value) = (value.span().start, *value.get_ref());
        if !value.is_finite() {
            return Err(source.error(at, what, format!("{} must be finite", term.name())));
        }
        if value.abs() > LARGEST {
            return Err(source.error(
                at,
                what,
                format!(
                    "{} = {value:e} is beyond {LARGEST:e}; correct it, in SI units",
                    term.name()
                ),
            ));
        }
        if value < 0.0 && term != JointTerm::Offset {
            warnings.push(Warning::new(
                WarningKind::NegativeParameter,
                what,
                format!("{} = {value} is negative; kept as written", term.name()),
            ));
        }
        joint.terms[term as usize] = value;
    }
    if let Some(force) = &entry.stribeck {
        let (at, force) = (force.span().start, *force.get_ref());
        if !(0.0..=LARGEST).contains(&force) {
            return Err(source.error(
                at,
                what,
                format!("stribeck = {force:e} must be a friction of 0 or more, N m or N"),
            ));
        }
        joint.stribeck.force = force;
    }
    if let Some(speed) = &entry.stribeck_velocity {
        let (at, speed) = (speed.span().start, *speed.get_ref());
        if !(speed > 1e-9 && speed <= LARGEST) {
            return Err(source.error(
                at,
                what,
                format!("stribeck_velocity = {speed:e} must be a speed above 0, rad/s or m/s"),
            ));
        }
        joint.stribeck.velocity = speed;
    }
    for term in &entry.identify {
        let name = term.get_ref();
        if name == "stribeck" {
            joint.stribeck.fit = true;
            continue;
        }
        let Some(known) = JointTerm::ALL.into_iter().find(|t| t.name() == name) else {
            let all = JointTerm::ALL.map(JointTerm::name);
            return Err(source.error(
                term.span().start,
                what,
                format!(
                    "identify has no term `{name}`; its terms are {}, stribeck",
                    all.join(", ")
                ),
            ));
        };
        joint.identify[known as usize] = true;
    }
    Ok(())
}
