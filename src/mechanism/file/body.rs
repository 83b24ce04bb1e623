//! Bodies and checked numbers of a mechanism's file.

use crate::error::{Result, Warning, WarningKind};
use crate::robot::Inertia;
use crate::robot::file::Text;
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use toml::Spanned;

/// `{ mass, com, inertia }`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BodyEntry {
    mass: Spanned<f64>,
    com: Option<Spanned<Vec<f64>>>,
    inertia: Option<Spanned<Vec<f64>>>,
}

impl BodyEntry {
    /// About the origin of the body's frame.
    pub(super) fn inertia(
        &self,
        source: Text,
        what: &str,
        warnings: &mut Vec<Warning>,
    ) -> Result<Inertia> {
        inertia(source, what, &self.mass, &self.com, &self.inertia, warnings)
    }
}

/// Inertia from a mass, a centre of mass and the tensor about it.
pub(super) fn inertia(
    source: Text,
    what: &str,
    mass: &Spanned<f64>,
    com: &Option<Spanned<Vec<f64>>>,
    tensor: &Option<Spanned<Vec<f64>>>,
    warnings: &mut Vec<Warning>,
) -> Result<Inertia> {
    let m = *mass.get_ref();
    if !m.is_finite() || m < 0.0 {
        let at = mass.span().start;
        return Err(source.error(at, what, format!("mass = {m} kg must be 0 or more")));
    }
    let com = match com {
        Some(c) => vector(source, c, what, "com")?,
        None => Vector3::zeros(),
    };
    let i = match tensor {
        None => Matrix3::zeros(),
        Some(t) => {
            let v = t.get_ref();
            if v.iter().any(|x| !x.is_finite()) {
                return Err(source.error(t.span().start, what, "inertia must be finite numbers"));
            }
            match v[..] {
                [xx, xy, xz, yy, yz, zz] => Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
                [xx, yy, zz] => Matrix3::from_diagonal(&Vector3::new(xx, yy, zz)),
                _ => {
                    return Err(source.error(
                        t.span().start,
                        what,
                        "inertia must be [Ixx, Ixy, Ixz, Iyy, Iyz, Izz] or [Ixx, Iyy, Izz] about \
                         the centre of mass, kg m^2",
                    ));
                }
            }
        }
    };
    let all = Inertia::from_com(m, com, i);
    let (smallest, triangle) = match all.tensor_com().norm() > 0.0 {
        true => all.realizability(),
        false => (0.0, 0.0),
    };
    if smallest < -1e-9 || triangle > 1e-9 {
        warnings.push(Warning::new(
            WarningKind::InertiaImpossible,
            what,
            format!(
                "no body has this inertia: smallest principal moment {smallest:.1e} of the \
                 largest, triangle inequality violated by {triangle:.1e}; kept as written"
            ),
        ));
    }
    Ok(all)
}

/// Three finite numbers.
pub(super) fn vector(
    source: Text,
    v: &Spanned<Vec<f64>>,
    what: &str,
    key: &str,
) -> Result<Vector3<f64>> {
    let [x, y, z] = numbers::<3>(source, v, what, key)?;
    Ok(Vector3::new(x, y, z))
}

/// So many finite numbers.
pub(super) fn numbers<const N: usize>(
    source: Text,
    v: &Spanned<Vec<f64>>,
    what: &str,
    key: &str,
) -> Result<[f64; N]> {
    match <[f64; N]>::try_from(&v.get_ref()[..]) {
        Ok(a) if a.iter().all(|x| x.is_finite()) => Ok(a),
        _ => Err(source.error(
            v.span().start,
            what,
            format!(
                "{key} must be {N} finite numbers, here are {}",
                v.get_ref().len()
            ),
        )),
    }
}

/// A finite number.
pub(super) fn finite(source: Text, v: &Spanned<f64>, what: &str, key: &str) -> Result<f64> {
    match *v.get_ref() {
        x if x.is_finite() => Ok(x),
        x => Err(source.error(v.span().start, what, format!("{key} = {x} must be finite"))),
    }
}

/// A positive finite number.
pub(super) fn positive(source: Text, v: &Spanned<f64>, what: &str, key: &str) -> Result<f64> {
    match *v.get_ref() {
        x if x.is_finite() && x > 0.0 => Ok(x),
        x => Err(source.error(
            v.span().start,
            what,
            format!("{key} = {x} must be positive and finite"),
        )),
    }
}

/// Points on a circle about the vertical: a symmetric arrangement.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Ring {
    radius: Spanned<f64>,
    angles: Spanned<Vec<f64>>,
    z: Option<Spanned<f64>>,
}

impl Ring {
    /// Its points with their angles.
    pub(super) fn points(&self, source: Text, what: &str) -> Result<Vec<(Vector3<f64>, f64)>> {
        let r = finite(source, &self.radius, what, "radius")?;
        let z = match &self.z {
            Some(z) => finite(source, z, what, "z")?,
            None => 0.0,
        };
        self.angles
            .get_ref()
            .iter()
            .map(|&a| match a.is_finite() {
                true => Ok((Vector3::new(r * a.cos(), r * a.sin(), z), a)),
                false => Err(source.error(
                    self.angles.span().start,
                    what,
                    "angles must be finite numbers, rad",
                )),
            })
            .collect()
    }

    /// Where its angles stand, for messages.
    pub(super) fn at(&self) -> usize {
        self.angles.span().start
    }
}
