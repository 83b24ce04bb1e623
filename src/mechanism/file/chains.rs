//! `mechanism = "h4"` and `mechanism = "delta"`: chains of an arm and a parallelogram.

use super::body::{self, BodyEntry, Ring, finite, positive, vector};
use super::common::{Head, identified, mechanism_file, optional};
use crate::error::{Result, Warning};
use crate::mechanism::Mechanism;
use crate::mechanism::delta::Delta;
use crate::mechanism::h4::{H4, Model};
use crate::mechanism::parallelogram::{Bodies, Chain, motor_frame, motor_frame_about};
use crate::robot::file::Text;
use crate::robot::{Inertia, Joint, Motion};
use nalgebra::Vector3;
use serde::Deserialize;
use std::path::Path;
use toml::Spanned;

mechanism_file! {
    /// The file of a Delta.
    DeltaFile {
        bodies: Option<Bodies>,
        #[serde(default)]
        identical: bool,
        platform: BodyEntry,
        #[serde(default)]
        chains: ChainsEntry,
        #[serde(default)]
        chain: Vec<Spanned<ChainEntry>>,
    }
}

mechanism_file! {
    /// The file of an H4.
    H4File {
        bodies: Option<Bodies>,
        model: Option<Model>,
        #[serde(default)]
        identical: bool,
        platform: BodyEntry,
        #[serde(default)]
        bar: Vec<Spanned<BarEntry>>,
        #[serde(default)]
        chains: ChainsEntry,
        #[serde(default)]
        chain: Vec<Spanned<ChainEntry>>,
    }
}

/// One `[[bar]]` of an H4.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BarEntry {
    hinge: Spanned<Vec<f64>>,
    mass: Spanned<f64>,
    com: Option<Spanned<Vec<f64>>>,
    inertia: Option<Spanned<Vec<f64>>>,
}

/// `[chains]`: what all chains share, and their symmetric arrangement.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct ChainsEntry {
    motors: Option<Ring>,
    attachments: Option<Ring>,
    arm_length: Option<Spanned<f64>>,
    rod_length: Option<Spanned<f64>>,
    width: Option<Spanned<f64>>,
    zero: Option<Spanned<f64>>,
    arm: Option<BodyEntry>,
    rod: Option<BodyEntry>,
    rods: Option<Spanned<Vec<BodyEntry>>>,
}

/// One `[[chain]]`; what it leaves out is that of `[chains]`.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct ChainEntry {
    motor: Option<Spanned<Vec<f64>>>,
    azimuth: Option<Spanned<f64>>,
    axis: Option<Spanned<Vec<f64>>>,
    attachment: Option<Spanned<Vec<f64>>>,
    bar: Option<Spanned<usize>>,
    arm_length: Option<Spanned<f64>>,
    rod_length: Option<Spanned<f64>>,
    width: Option<Spanned<f64>>,
    zero: Option<Spanned<f64>>,
    arm: Option<BodyEntry>,
    rod: Option<BodyEntry>,
    rods: Option<Spanned<Vec<BodyEntry>>>,
}

/// Reads a Delta.
pub(super) fn read_delta(source: Text, _folder: &Path) -> Result<Mechanism> {
    let file = DeltaFile::parse(source)?;
    let head = file.head(source);
    let mut warnings = Vec::new();
    let home = head.home("x, y, z")?;
    let reader = Chains {
        source,
        all: &file.chains,
        each: &file.chain,
        bars: false,
    };
    let (chains, actuators) = reader.read(&head, &mut warnings)?;
    let robot = Delta {
        name: head.name(),
        chains,
        platform: file.platform.inertia(source, "[platform]", &mut warnings)?,
        home,
        gravity: head.gravity()?,
        bodies: file.bodies.unwrap_or(Bodies::Rods),
        identical: file.identical,
        identify: identified(&actuators),
    };
    head.finish(robot.setup()?, actuators, warnings)
}

/// Reads an H4.
pub(super) fn read_h4(source: Text, _folder: &Path) -> Result<Mechanism> {
    let file = H4File::parse(source)?;
    let head = file.head(source);
    let mut warnings = Vec::new();
    let home = head.home("x, y, z, theta")?;
    let reader = Chains {
        source,
        all: &file.chains,
        each: &file.chain,
        bars: true,
    };
    let (chains, actuators) = reader.read(&head, &mut warnings)?;
    let [first, second] = &file.bar[..] else {
        return Err(source.error(
            file.bar.get(2).map_or(0, |b| b.span().start),
            "[[bar]]",
            format!(
                "an H4 has two lateral bars, here are {}; give [[bar]] twice with hinge, mass, com \
                 and inertia",
                file.bar.len()
            ),
        ));
    };
    let mut hinges = [Vector3::zeros(); 2];
    let mut bars = [Inertia::default(); 2];
    for (k, bar) in [first, second]
        .into_iter()
        .map(Spanned::get_ref)
        .enumerate()
    {
        let what = format!("bar {}", k + 1);
        hinges[k] = vector(source, &bar.hinge, &what, "hinge")?;
        bars[k] = body::inertia(
            source,
            &what,
            &bar.mass,
            &bar.com,
            &bar.inertia,
            &mut warnings,
        )?;
    }
    let robot = H4 {
        name: head.name(),
        chains,
        hinges,
        platform: file.platform.inertia(source, "[platform]", &mut warnings)?,
        bars,
        home,
        gravity: head.gravity()?,
        model: file.model.unwrap_or(Model::Rods),
        bodies: file.bodies.unwrap_or(Bodies::Rods),
        identical: file.identical,
        identify: identified(&actuators),
    };
    head.finish(robot.setup()?, actuators, warnings)
}

/// The chains of either, as written.
struct Chains<'a> {
    source: Text<'a>,
    all: &'a ChainsEntry,
    each: &'a [Spanned<ChainEntry>],
    bars: bool,
}

impl Chains<'_> {
    fn read(&self, head: &Head, warnings: &mut Vec<Warning>) -> Result<(Vec<Chain>, Vec<Joint>)> {
        let source = self.source;
        let mut count = self.each.len();
        let ring = |ring: &Option<Ring>, key: &str| match ring {
            None => Ok(Vec::new()),
            Some(ring) => ring.points(source, &format!("[chains] {key}")),
        };
        let motors = ring(&self.all.motors, "motors")?;
        let attachments = ring(&self.all.attachments, "attachments")?;
        for (key, points) in [("motors", &motors), ("attachments", &attachments)] {
            if count != 0 && !points.is_empty() && points.len() != count {
                return Err(source.error(
                    self.all.motors.as_ref().map_or(0, Ring::at),
                    &format!("[chains] {key}"),
                    format!("{} angles for {count} chains", points.len()),
                ));
            }
            count = count.max(points.len());
        }
        let actuators = head.actuators("motor", count, Motion::Revolute, warnings)?;
        let mut chains = Vec::new();
        for (i, actuator) in actuators.iter().enumerate() {
            let at = [motors.get(i), attachments.get(i)].map(|p| p.copied());
            chains.push(self.chain(i, actuator, at, warnings)?);
        }
        Ok((chains, actuators))
    }

    fn chain(
        &self,
        i: usize,
        actuator: &Joint,
        [motor, attachment]: [Option<(Vector3<f64>, f64)>; 2],
        warnings: &mut Vec<Warning>,
    ) -> Result<Chain> {
        let (source, all) = (self.source, self.all);
        let spanned = self.each.get(i);
        let none = ChainEntry::default();
        let own = spanned.map_or(&none, Spanned::get_ref);
        let at = spanned.map_or(0, |s| s.span().start);
        let what = format!("chain {}", i + 1);
        let missing = |key: &str| {
            source.error(
                at,
                &what,
                format!("{key} is missing; state it here or in [chains]"),
            )
        };
        let length = |own: &Option<Spanned<f64>>, all: &Option<Spanned<f64>>, key: &str| match own
            .as_ref()
            .or(all.as_ref())
        {
            Some(l) => positive(source, l, &what, key),
            None => Err(missing(key)),
        };
        let azimuth = match (&own.azimuth, motor) {
            (Some(a), _) => finite(source, a, &what, "azimuth")?,
            (None, Some((_, angle))) => angle,
            (None, None) => return Err(missing("azimuth")),
        };
        let rotation = match &own.axis {
            None => motor_frame(azimuth),
            Some(axis) => {
                let u = vector(source, axis, &what, "axis")?;
                motor_frame_about(&u, azimuth).ok_or_else(|| {
                    source.error(
                        axis.span().start,
                        &what,
                        "axis must have a direction other than that of the azimuth",
                    )
                })?
            }
        };
        let hinge = match (&own.bar, self.bars) {
            (None, false) => 0,
            (Some(b), true) if (1..=2).contains(b.get_ref()) => b.get_ref() - 1,
            (Some(b), true) => {
                return Err(source.error(
                    b.span().start,
                    &what,
                    format!("bar = {} must be 1 or 2", b.get_ref()),
                ));
            }
            (None, true) => {
                return Err(source.error(at, &what, "on which bar does it end? bar = 1 or 2"));
            }
            (Some(b), false) => {
                return Err(source.error(b.span().start, &what, "a Delta has no bars"));
            }
        };
        let arm = own.arm.as_ref().or(all.arm.as_ref());
        let arm = arm
            .ok_or_else(|| missing("arm = { mass, com, inertia }"))?
            .inertia(source, &format!("{what}: arm"), warnings)?;
        let mut rod = |entry: &BodyEntry, side: &str| {
            entry.inertia(source, &format!("{what}: rod {side}"), warnings)
        };
        // two bodies or one for both; what the chain states itself comes first
        let (pair, both) = match own.rods.is_some() || own.rod.is_some() {
            true => (&own.rods, &own.rod),
            false => (&all.rods, &all.rod),
        };
        let rods = match (pair, both) {
            (Some(pair), _) => match &pair.get_ref()[..] {
                [a, b] => [rod(a, "a")?, rod(b, "b")?],
                _ => {
                    return Err(source.error(
                        pair.span().start,
                        &what,
                        format!("rods must be two bodies, here are {}", pair.get_ref().len()),
                    ));
                }
            },
            (None, Some(both)) => [rod(both, "a")?, rod(both, "b")?],
            (None, None) => return Err(missing("rod = { mass, com, inertia }")),
        };
        let point = |own: &Option<Spanned<Vec<f64>>>,
                     ring: Option<(Vector3<f64>, f64)>,
                     key: &str| match (own, ring) {
            (Some(p), _) => vector(source, p, &what, key),
            (None, Some((p, _))) => Ok(p),
            (None, None) => Err(missing(key)),
        };
        let zero = optional(source, &own.zero, &what, "zero")?
            .or(optional(source, &all.zero, "[chains]", "zero")?)
            .unwrap_or(0.0);
        Ok(Chain {
            motor: point(&own.motor, motor, "motor")?,
            rotation,
            arm_length: length(&own.arm_length, &all.arm_length, "arm_length")?,
            rod_length: length(&own.rod_length, &all.rod_length, "rod_length")?,
            width: length(&own.width, &all.width, "width")?,
            zero,
            attachment: point(&own.attachment, attachment, "attachment")?,
            hinge,
            limits: actuator.limits,
            terms: actuator.terms,
            torque_noise: actuator.torque_noise,
            arm,
            rods,
        })
    }
}
