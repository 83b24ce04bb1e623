//! `<inertial>`: mass, centre of mass and tensor of a link.

use super::source::{LARGEST, Source, child};
use crate::error::{Result, Warning, WarningKind};
use crate::robot::Inertia;
use nalgebra::{Matrix3, Vector3};
use roxmltree::Node;

/// Relative tolerance on the triangle inequality: published tensors are rounded to three digits.
const TRIANGLE_TOLERANCE: f64 = 1e-3;

/// Relative tolerance on a negative principal moment.
const EIGENVALUE_TOLERANCE: f64 = 1e-6;

/// `<inertial>`, about the origin and in the axes of the link frame:
/// `φ = (m, m c, R I_C Rᵀ + m (|c|² 1 − c cᵀ))`.
pub(super) fn inertial_parameters(
    source: &Source,
    node: Node,
    what: &str,
    warnings: &mut Vec<Warning>,
) -> Result<Inertia> {
    let mut warn = |kind, message: String| warnings.push(Warning::new(kind, what, message));
    let mut again = Vec::new();
    let (rotation, com) = source.origin(child(node, "origin", what, &mut again), what)?;
    let mass = match child(node, "mass", what, &mut again) {
        Some(m) => source.number(m, "value", what)?,
        None => None,
    };
    if mass.is_none() {
        warn(
            WarningKind::InertiaMissing,
            "<inertial> has no <mass value=…>; taken as 0".to_string(),
        );
    }
    let mass = mass.unwrap_or(0.0);
    if mass.abs() > LARGEST[1] {
        return Err(source.error(
            node,
            what,
            format!(
                "its mass is {mass:.1e} kg, and {:.0e} kg is the most that is read; correct it, \
                 in kg",
                LARGEST[1]
            ),
        ));
    }
    let mut entries = [0.0; 6];
    if let Some(tensor) = child(node, "inertia", what, &mut again) {
        let names = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];
        let mut absent = Vec::new();
        for (entry, name) in entries.iter_mut().zip(names) {
            match source.number(tensor, name, what)? {
                Some(value) => *entry = value,
                None => absent.push(name),
            }
        }
        if !absent.is_empty() {
            warn(
                WarningKind::InertiaMissing,
                format!("<inertia> lacks {}; taken as 0", absent.join(", ")),
            );
        }
    }
    let most = entries.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    if most > LARGEST[2] {
        return Err(source.error(
            node,
            what,
            format!(
                "its inertia tensor holds {most:.1e} kg m^2, and {:.0e} is the most that is read; \
                 correct it, in kg m^2",
                LARGEST[2]
            ),
        ));
    }
    let [xx, xy, xz, yy, yz, zz] = entries;
    let tensor = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    let inertia = Inertia::from_com(mass, com, rotation * tensor * rotation.transpose());
    if !inertia.0.iter().all(|x| x.is_finite()) {
        return Err(source.error(
            node,
            what,
            "its inertia overflows; use kg, m and kg m^2 of a real robot",
        ));
    }
    if mass < 0.0 {
        warn(
            WarningKind::InertiaImpossible,
            format!("its mass is {mass} kg; a body has a positive mass"),
        );
    }
    if entries == [0.0; 6] {
        if mass != 0.0 {
            warn(
                WarningKind::InertiaMissing,
                format!("a mass of {mass} kg but no inertia tensor; taken as a point mass"),
            );
        }
    } else if mass == 0.0 {
        warn(
            WarningKind::InertiaImpossible,
            "an inertia tensor but no mass; such a body cannot exist".to_string(),
        );
    } else {
        // about the centre of mass as written, so that a distant origin does not blur it
        let (smallest, triangle) = Inertia::from_com(1.0, Vector3::zeros(), tensor).realizability();
        if smallest < -EIGENVALUE_TOLERANCE {
            warn(
                WarningKind::InertiaImpossible,
                format!(
                    "its inertia tensor has a negative principal moment ({:.2} of the largest); \
                 such a body cannot exist",
                    smallest
                ),
            );
        } else if triangle > TRIANGLE_TOLERANCE {
            warn(
                WarningKind::InertiaImpossible,
                format!(
                    "its largest principal moment exceeds the sum of the others by {:.1} %; \
                 such a body cannot exist",
                    100.0 * triangle
                ),
            );
        }
    }
    warnings.append(&mut again);
    Ok(inertia)
}
