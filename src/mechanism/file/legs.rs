//! `mechanism = "gough-stewart"`.

use super::body::{BodyEntry, Ring, numbers, vector};
use super::common::{identified, mechanism_file, optional};
use crate::error::{Result, Warning, WarningKind, number};
use crate::mechanism::Mechanism;
use crate::mechanism::gough_stewart::{Bodies, GoughStewart, Leg, joint_frame};
use crate::mechanism::task::rotation;
use crate::robot::file::Text;
use crate::robot::{Inertia, Motion};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use std::path::Path;
use toml::Spanned;

mechanism_file! {
    /// The file of a hexapod.
    HexapodFile {
        bodies: Option<Bodies>,
        #[serde(default)]
        identical: bool,
        #[serde(default)]
        axisymmetric: bool,
        #[serde(default)]
        spherical: bool,
        platform: BodyEntry,
        #[serde(default)]
        legs: LegsEntry,
        #[serde(default)]
        leg: Vec<Spanned<LegEntry>>,
    }
}

/// `[legs]`: what all legs share.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct LegsEntry {
    base: Option<Ring>,
    platform: Option<Ring>,
    zero: Option<Spanned<f64>>,
    cone: Option<Spanned<Vec<f64>>>,
    cross: Option<BodyEntry>,
    cylinder: Option<BodyEntry>,
    rod: Option<BodyEntry>,
}

/// One `[[leg]]`; what it leaves out is that of `[legs]`.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct LegEntry {
    base: Option<Spanned<Vec<f64>>>,
    platform: Option<Spanned<Vec<f64>>>,
    axis: Option<Spanned<Vec<f64>>>,
    rotation: Option<Spanned<Vec<Vec<f64>>>>,
    zero: Option<Spanned<f64>>,
    cone: Option<Spanned<Vec<f64>>>,
    cross: Option<BodyEntry>,
    cylinder: Option<BodyEntry>,
    rod: Option<BodyEntry>,
}

/// Reads a hexapod.
pub(super) fn read(source: Text, _folder: &Path) -> Result<Mechanism> {
    let file = HexapodFile::parse(source)?;
    let head = file.head(source);
    let home: [f64; 6] = head.home("x, y, z, roll, pitch, yaw")?;
    let mut warnings = Vec::new();
    let rings = [("base", &file.legs.base), ("platform", &file.legs.platform)];
    let mut points = [Vec::new(), Vec::new()];
    let mut count = file.leg.len();
    for ((key, ring), to) in rings.into_iter().zip(&mut points) {
        let Some(ring) = ring else { continue };
        *to = ring.points(source, &format!("[legs] {key}"))?;
        if count != 0 && to.len() != count {
            return Err(source.error(
                ring.at(),
                &format!("[legs] {key}"),
                format!("{} angles for {count} legs", to.len()),
            ));
        }
        count = to.len();
    }
    if count == 0 {
        return Err(source.error(
            0,
            "legs",
            "no legs: give [legs] with base = { radius = …, angles = […] } and platform likewise, \
             or six [[leg]] with base and platform",
        ));
    }
    let bodies = file.bodies.unwrap_or(
        match file.legs.cylinder.is_some()
            || file.leg.iter().any(|l| l.get_ref().cylinder.is_some())
        {
            true => Bodies::Legs,
            false => Bodies::Platform,
        },
    );
    let actuators = head.actuators("leg", count, Motion::Prismatic, &mut warnings)?;
    let pose = rotation(&Vector3::new(home[3], home[4], home[5]));
    let centre = Vector3::new(home[0], home[1], home[2]);
    let mut legs = Vec::new();
    for i in 0..count {
        let spanned = file.leg.get(i);
        let none = LegEntry::default();
        let own = spanned.map_or(&none, Spanned::get_ref);
        let at = spanned.map_or(0, |s| s.span().start);
        let what = format!("leg {}", i + 1);
        let point = |own: &Option<Spanned<Vec<f64>>>, ring: usize, key: &str| match own {
            Some(p) => vector(source, p, &what, key),
            None => points[ring].get(i).map(|p| p.0).ok_or_else(|| {
                source.error(
                    at,
                    &what,
                    format!("it has no {key}; state {key} = [x, y, z], or a ring in [legs]"),
                )
            }),
        };
        let base = point(&own.base, 0, "base")?;
        let platform = point(&own.platform, 1, "platform")?;
        let along = centre + pose * platform - base;
        if along.norm() < 1e-9 {
            return Err(source.error(at, &what, "it has no length at home"));
        }
        let mut body =
            |own: &Option<BodyEntry>, all: &Option<BodyEntry>, key: &str, need: bool| match (
                own.as_ref().or(all.as_ref()),
                need,
            ) {
                (Some(b), _) => b.inertia(source, &format!("{what}: {key}"), &mut warnings),
                (None, false) => Ok(Inertia::default()),
                (None, true) => Err(source.error(
                    at,
                    &what,
                    format!(
                        "its {key} is missing: state {key} = {{ mass, com, inertia }}, or bodies = \
                         \"platform\""
                    ),
                )),
            };
        let massive = bodies != Bodies::Platform;
        let crossed = bodies == Bodies::Cross;
        let cross = body(&own.cross, &file.legs.cross, "cross", crossed)?;
        let cylinder = body(&own.cylinder, &file.legs.cylinder, "cylinder", massive)?;
        let rod = body(&own.rod, &file.legs.rod, "rod", massive)?;
        let zero = optional(source, &own.zero, &what, "zero")?
            .or(optional(source, &file.legs.zero, "[legs]", "zero")?)
            .unwrap_or(0.0);
        legs.push(Leg {
            base,
            platform,
            rotation: joint_rotation(source, own, &what, &along)?,
            zero,
            limits: actuators[i].limits,
            terms: actuators[i].terms,
            force_noise: actuators[i].torque_noise,
            cone: cone(source, own.cone.as_ref().or(file.legs.cone.as_ref()), &what)?,
            cross,
            cylinder,
            rod,
        });
    }
    let platform = file.platform.inertia(source, "[platform]", &mut warnings)?;
    check_lengths(&legs, &centre, &pose, &mut warnings);
    let robot = GoughStewart {
        name: head.name(),
        legs,
        platform,
        home,
        gravity: head.gravity()?,
        bodies,
        identical: file.identical,
        axisymmetric: file.axisymmetric,
        spherical: file.spherical,
        identify: identified(&actuators),
    };
    head.finish(robot.setup()?, actuators, warnings)
}

/// A home outside the stroke is worth a warning.
fn check_lengths(
    legs: &[Leg],
    centre: &Vector3<f64>,
    pose: &Matrix3<f64>,
    warnings: &mut Vec<Warning>,
) {
    for (i, leg) in legs.iter().enumerate() {
        let q = (centre + pose * leg.platform - leg.base).norm() - leg.zero;
        let [low, high] = leg.limits.position;
        if q < low || q > high {
            warnings.push(Warning::new(
                WarningKind::OutsideLimits,
                format!("leg{}", i + 1),
                format!(
                    "home lies outside its stroke: it would read {q:.4} m, its limits are \
                     [{}, {}] m",
                    number(low),
                    number(high)
                ),
            ));
        }
    }
}

/// Frame of the universal joint.
fn joint_rotation(
    source: Text,
    leg: &LegEntry,
    what: &str,
    along: &Vector3<f64>,
) -> Result<Matrix3<f64>> {
    match (&leg.rotation, &leg.axis) {
        (Some(r), Some(_)) => Err(source.error(
            r.span().start,
            what,
            "it has axis and rotation; state one of them",
        )),
        (None, None) => Ok(joint_frame(along)),
        (None, Some(axis)) => {
            let a = vector(source, axis, what, "axis")?;
            let frame = a.try_normalize(1e-9).and_then(|x| {
                let z = (along - x * x.dot(along)).try_normalize(1e-6 * along.norm())?;
                Some(Matrix3::from_columns(&[x, z.cross(&x), z]))
            });
            frame.ok_or_else(|| {
                source.error(
                    axis.span().start,
                    what,
                    "axis must have a direction, and the leg must not lie along it at home",
                )
            })
        }
        (Some(rows), None) => {
            let flat: Vec<f64> = rows.get_ref().concat();
            let bad = || {
                source.error(
                    rows.span().start,
                    what,
                    "rotation must be three rows of three numbers that form a rotation matrix",
                )
            };
            if rows.get_ref().len() != 3 || flat.len() != 9 || flat.iter().any(|x| !x.is_finite()) {
                return Err(bad());
            }
            let m = Matrix3::from_row_slice(&flat);
            let off = (m.transpose() * m - Matrix3::identity()).norm();
            match off < 1e-6 && m.determinant() > 0.0 {
                true => Ok(m),
                false => Err(bad()),
            }
        }
    }
}

/// Half openings of the joints at base and platform.
fn cone(source: Text, cone: Option<&Spanned<Vec<f64>>>, what: &str) -> Result<[f64; 2]> {
    let Some(cone) = cone else {
        return Ok([f64::INFINITY; 2]);
    };
    let both = numbers::<2>(source, cone, what, "cone = [base, platform]")?;
    match both.iter().all(|c| *c > 0.0) {
        true => Ok(both),
        false => Err(source.error(
            cone.span().start,
            what,
            "cone = [base, platform] must be positive half openings, rad",
        )),
    }
}
