//! What moves each joint: itself, another joint that it mimics, or nothing.

use super::{Kind, Options, Urdf};
use crate::error::{Error, Result, Warning, WarningKind};
use std::collections::HashMap;

/// What moves a joint.
#[derive(Debug, Clone, Copy)]
pub(super) enum Drive {
    /// nothing: it stays at this position
    Held(f64),
    /// the coordinate of joint `leader`: `q = ratio · q_leader + offset`
    Follows {
        leader: usize,
        ratio: f64,
        offset: f64,
    },
}

/// Resolves locks and chains of mimics.
pub(super) fn drives(
    urdf: &Urdf,
    options: &Options,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<Drive>> {
    let index: HashMap<&str, usize> = urdf
        .joints
        .iter()
        .enumerate()
        .map(|(i, j)| (j.name.as_str(), i))
        .collect();
    for name in options.lock.keys() {
        if !index.contains_key(name.as_str()) {
            return Err(Error::file(
                &urdf.file,
                "lock",
                format!("there is no joint `{name}`; correct the name"),
            ));
        }
    }
    let mut drives: Vec<Option<Drive>> = vec![None; urdf.joints.len()];
    let mut on_path = vec![false; urdf.joints.len()];
    for start in 0..urdf.joints.len() {
        // along the mimics until something is known, then back
        let mut path = Vec::new();
        let mut at = start;
        let mut drive = loop {
            if let Some(drive) = drives[at] {
                break drive;
            }
            let joint = &urdf.joints[at];
            if let Some(drive) = own_drive(urdf, at, options, warnings)? {
                drives[at] = Some(drive);
                break drive;
            }
            let Some(mimic) = &joint.mimic else {
                break Drive::Held(0.0);
            };
            if on_path[at] {
                return Err(Error::file(
                    &urdf.file,
                    format!("line {}: joint `{}`", mimic.line, joint.name),
                    "it mimics itself through a circle of <mimic>; one joint must move freely",
                ));
            }
            on_path[at] = true;
            path.push(at);
            at = *index.get(mimic.joint.as_str()).ok_or_else(|| {
                Error::file(
                    &urdf.file,
                    format!("line {}: joint `{}`", mimic.line, joint.name),
                    format!(
                        "it mimics `{}`, which does not exist; correct the name or remove <mimic>",
                        mimic.joint
                    ),
                )
            })?;
        };
        for &follower in path.iter().rev() {
            let joint = &urdf.joints[follower];
            let Some(mimic) = &joint.mimic else { continue };
            drive = match drive {
                Drive::Held(q) => Drive::Held(mimic.multiplier * q + mimic.offset),
                Drive::Follows {
                    leader,
                    ratio,
                    offset,
                } => Drive::Follows {
                    leader,
                    ratio: mimic.multiplier * ratio,
                    offset: mimic.multiplier * offset + mimic.offset,
                },
            };
            if let Drive::Follows { ratio, offset, .. } = drive {
                if !ratio.is_finite() || !offset.is_finite() {
                    return Err(Error::file(
                        &urdf.file,
                        format!("line {}: joint `{}`", mimic.line, joint.name),
                        "its chain of <mimic> overflows; correct the multipliers",
                    ));
                }
                if ratio == 0.0 {
                    drive = Drive::Held(offset);
                }
            }
            if let Drive::Held(q) = drive {
                warnings.push(Warning::new(
                    WarningKind::JointHeld,
                    format!("joint `{}`", joint.name),
                    format!(
                        "`{}`, which it mimics, does not move it; held at {q}",
                        mimic.joint
                    ),
                ));
            }
            drives[follower] = Some(drive);
        }
    }
    Ok(drives
        .into_iter()
        .map(|d| d.unwrap_or(Drive::Held(0.0)))
        .collect())
}

/// The drive of a joint that does not depend on another one; `None` for a mimic joint.
fn own_drive(
    urdf: &Urdf,
    i: usize,
    options: &Options,
    warnings: &mut Vec<Warning>,
) -> Result<Option<Drive>> {
    let joint = &urdf.joints[i];
    let what = || format!("joint `{}`", joint.name);
    match (joint.kind, options.lock.get(&joint.name)) {
        (Kind::Fixed, None) => Ok(Some(Drive::Held(0.0))),
        (Kind::Fixed, Some(_)) => {
            warnings.push(Warning::new(
                WarningKind::EntryIgnored,
                what(),
                "it is fixed in the URDF; its `lock` has no effect",
            ));
            Ok(Some(Drive::Held(0.0)))
        }
        (Kind::Planar | Kind::Floating, Some(&0.0)) => Ok(Some(Drive::Held(0.0))),
        (Kind::Planar | Kind::Floating, lock) => {
            let kind = if joint.kind == Kind::Planar {
                "planar"
            } else {
                "floating"
            };
            let remedy = match lock {
                None => {
                    "write it as revolute and prismatic joints, make it fixed, \
                     or `lock` it at 0 in robot.toml"
                }
                Some(_) => "it can only be locked at 0; make it fixed with the <origin> you want",
            };
            Err(urdf.joint_error(joint, format!("{kind} joints are not supported; {remedy}")))
        }
        (_, Some(&q)) if !q.is_finite() => Err(urdf.joint_error(
            joint,
            format!("it is locked at {q}; state a finite position"),
        )),
        (kind, Some(&q)) => {
            let range = joint.limit.and_then(|l| Some((l.lower?, l.upper?)));
            if let Some((lower, upper)) = range
                && kind != Kind::Continuous
                && lower < upper
                && !(lower..=upper).contains(&q)
            {
                warnings.push(Warning::new(
                    WarningKind::OutsideLimits,
                    what(),
                    format!("locked at {q}, outside its limits {lower} to {upper}"),
                ));
            }
            Ok(Some(Drive::Held(q)))
        }
        (_, None) if joint.mimic.is_none() => Ok(Some(Drive::Follows {
            leader: i,
            ratio: 1.0,
            offset: 0.0,
        })),
        (_, None) => Ok(None),
    }
}
