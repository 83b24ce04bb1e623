//! `[collision]`, `[[volume]]`, `[[obstacle]]` and `[[keep_in]]` of a robot file.

use super::{Geometry, KeepIn, Obstacle, find};
use crate::error::Result;
use crate::robot::file::Text;
use crate::robot::file::names::did_you_mean;
use crate::robot::meant;
use crate::solid::{Pose, Shape};
use nalgebra::Vector3;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// `[collision]`.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct CollisionEntry {
    check: Option<bool>,
    floor: Option<bool>,
    margin: Option<Spanned<f64>>,
    ignore: Vec<Spanned<Vec<String>>>,
    srdf: Option<String>,
    meshes: Vec<String>,
}

/// `[[volume]]` and `[[obstacle]]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ShapeEntry {
    link: Option<Spanned<String>>,
    name: Option<String>,
    kind: Spanned<String>,
    from: Option<Vec<f64>>,
    to: Option<Vec<f64>>,
    centre: Option<Vec<f64>>,
    radius: Option<f64>,
    points: Option<Vec<Vec<f64>>>,
    size: Option<Vec<f64>>,
    pose: Option<Vec<f64>>,
    normal: Option<Vec<f64>>,
    offset: Option<f64>,
}

/// `[[keep_in]]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct KeepInEntry {
    frame: Spanned<String>,
    low: Option<Vec<f64>>,
    high: Option<Vec<f64>>,
}

/// The four, borrowed from a robot file.
pub(crate) struct Entries<'a> {
    /// `[collision]`
    pub collision: &'a CollisionEntry,
    /// `[[volume]]`
    pub volume: &'a [ShapeEntry],
    /// `[[obstacle]]`
    pub obstacle: &'a [ShapeEntry],
    /// `[[keep_in]]`
    pub keep_in: &'a [KeepInEntry],
}

/// Largest coordinate, m.
const LARGEST: f64 = 1e4;

impl Entries<'_> {
    /// Adds what they say; `folder` is that of the robot file.
    ///
    /// # Errors
    /// Unknown links and kinds, numbers that make no volume: with the line.
    pub(crate) fn apply(&self, source: Text, folder: &Path, geometry: &mut Geometry) -> Result<()> {
        geometry.forget();
        let c = self.collision;
        geometry.check = c.check;
        geometry.floor = c.floor;
        if let Some(margin) = &c.margin {
            let m = *margin.get_ref();
            if !(0.0..=1.0).contains(&m) {
                let message = format!("margin must be between 0 and 1 m, not {m}");
                return Err(source.error(margin.span().start, "collision", message));
            }
            geometry.margin = Some(m);
        }
        for pair in &c.ignore {
            let at = pair.span().start;
            let [a, b] = pair.get_ref().as_slice() else {
                let message = "ignore holds pairs of names: [[\"link5\", \"link7\"]]";
                return Err(source.error(at, "collision", message));
            };
            for name in [a, b] {
                let obstacle = self.obstacle.iter().any(|o| o.name.as_ref() == Some(name));
                if !obstacle && name != "floor" {
                    known(source, at, "collision", name, geometry)?;
                }
            }
            geometry.ignore.push([a.clone(), b.clone()]);
        }
        geometry.srdf = c.srdf.as_ref().map(|f| folder.join(f));
        let stated: Vec<PathBuf> = c.meshes.iter().map(|m| folder.join(m)).collect();
        if !stated.is_empty() {
            let mut all = stated;
            all.append(&mut geometry.folders);
            geometry.folders = all;
        }
        for v in self.volume {
            let at = v.kind.span().start;
            let Some(link) = &v.link else {
                let message = "name the link that it belongs to: link = \"…\"";
                return Err(source.error(at, "[[volume]]", message));
            };
            let what = format!("[[volume]] of link `{}`", link.get_ref());
            let index = known(source, link.span().start, &what, link.get_ref(), geometry)?;
            let shape = shape(source, &what, v)?;
            geometry.stated.push((index, shape));
        }
        for (i, o) in self.obstacle.iter().enumerate() {
            let name = match &o.name {
                Some(n) => n.clone(),
                None => format!("obstacle {}", i + 1),
            };
            let what = format!("[[obstacle]] `{name}`");
            if let Some(link) = &o.link {
                let message = "an obstacle stands in the base frame; remove `link`";
                return Err(source.error(link.span().start, &what, message));
            }
            let obstacle = match o.kind.get_ref().as_str() {
                "plane" => plane(source, &what, name, o)?,
                _ => Obstacle::Solid {
                    name,
                    shape: shape(source, &what, o)?,
                },
            };
            geometry.obstacles.push(obstacle);
        }
        for k in self.keep_in {
            let what = format!("[[keep_in]] of `{}`", k.frame.get_ref());
            let at = k.frame.span().start;
            known(source, at, &what, k.frame.get_ref(), geometry)?;
            let corner = |list: &Option<Vec<f64>>, free: f64| match list.as_deref() {
                None => Some(Vector3::repeat(free)),
                Some([x, y, z]) if !(x + y + z).is_nan() => Some(Vector3::new(*x, *y, *z)),
                Some(_) => None,
            };
            let (low, high) = (
                corner(&k.low, f64::NEG_INFINITY),
                corner(&k.high, f64::INFINITY),
            );
            let (Some(low), Some(high)) = (low, high) else {
                let message = "low and high are three numbers each, in m (inf for no bound)";
                return Err(source.error(at, &what, message));
            };
            if low.iter().zip(&high).any(|(a, b)| a >= b) {
                let message = "low must be less than high";
                return Err(source.error(at, &what, message));
            }
            let frame = k.frame.get_ref().clone();
            geometry.keep_in.push(KeepIn { frame, low, high });
        }
        Ok(())
    }
}

/// Folders for the meshes of a URDF.
pub(crate) fn folders(urdf: &Path) -> Vec<PathBuf> {
    find::folders(urdf, &[])
}

/// Index of a link that must exist.
fn known(source: Text, at: usize, what: &str, name: &str, geometry: &Geometry) -> Result<usize> {
    geometry.link(name).ok_or_else(|| {
        let names = geometry.links.iter().map(|l| l.name.as_str());
        let hint = did_you_mean(name, names);
        source.error(at, what, format!("there is no link `{name}`{hint}"))
    })
}

fn plane(source: Text, what: &str, name: String, o: &ShapeEntry) -> Result<Obstacle> {
    own_keys(source, what, o)?;
    let at = o.kind.span().start;
    let bad = || source.error(at, what, "a plane has normal = [x, y, z] and offset, in m");
    let normal = three(o.normal.as_deref()).ok_or_else(bad)?;
    let normal = normal.try_normalize(1e-9).ok_or_else(bad)?;
    let offset = o.offset.unwrap_or(0.0);
    if !(offset.abs() <= LARGEST) {
        return Err(bad());
    }
    Ok(Obstacle::Plane {
        name,
        normal,
        offset,
    })
}

/// Three finite numbers of a plausible size.
fn three(list: Option<&[f64]>) -> Option<Vector3<f64>> {
    match list? {
        [x, y, z] if [x, y, z].iter().all(|v| v.abs() <= LARGEST) => Some(Vector3::new(*x, *y, *z)),
        _ => None,
    }
}

/// Refuses keys that belong to another kind.
fn own_keys(source: Text, what: &str, e: &ShapeEntry) -> Result<()> {
    let kind = e.kind.get_ref().as_str();
    let keys = [
        ("from", e.from.is_some(), "capsule"),
        ("to", e.to.is_some(), "capsule"),
        ("centre", e.centre.is_some(), "sphere"),
        ("radius", e.radius.is_some(), "capsule sphere hull"),
        ("points", e.points.is_some(), "hull"),
        ("size", e.size.is_some(), "box"),
        ("pose", e.pose.is_some(), "box"),
        ("normal", e.normal.is_some(), "plane"),
        ("offset", e.offset.is_some(), "plane"),
    ];
    let other = keys
        .iter()
        .find(|(_, there, kinds)| *there && !kinds.split(' ').any(|k| k == kind));
    match other {
        Some((key, _, kinds)) => {
            let kinds = kinds.replace(' ', " or a ");
            let message = format!("`{key}` belongs to a {kinds}, not to a {kind}; remove it");
            Err(source.error(e.kind.span().start, what, message))
        }
        None => Ok(()),
    }
}

fn shape(source: Text, what: &str, e: &ShapeEntry) -> Result<Shape> {
    let at = e.kind.span().start;
    let positive = |x: f64| (x > 0.0 && x <= LARGEST).then_some(x);
    let radius = e.radius.and_then(positive);
    let (needs, found) = match e.kind.get_ref().as_str() {
        "capsule" => {
            let ends = three(e.from.as_deref()).zip(three(e.to.as_deref()));
            let found =
                ends.zip(radius)
                    .map(|((from, to), radius)| Shape::Capsule { from, to, radius });
            (
                "a capsule has from = [x, y, z], to = [x, y, z] and radius > 0, in m",
                found,
            )
        }
        "sphere" => {
            let found = three(e.centre.as_deref()).zip(radius);
            let found = found.map(|(centre, radius)| Shape::Sphere { centre, radius });
            (
                "a sphere has centre = [x, y, z] and radius > 0, in m",
                found,
            )
        }
        "box" => {
            let size = three(e.size.as_deref()).filter(|s| s.min() > 0.0);
            let pose = match e.pose.as_deref() {
                None => Some(Pose::identity()),
                Some(list) if list.len() == 6 => {
                    let angles = three(Some(&list[3..]));
                    three(Some(&list[..3]))
                        .zip(angles)
                        .map(|(position, rpy)| Pose {
                            rotation: meant::rotation(&rpy),
                            position,
                        })
                }
                Some(_) => None,
            };
            let found = size.zip(pose).map(|(size, pose)| Shape::Box {
                pose,
                half: size * 0.5,
            });
            (
                "a box has size = [x, y, z] > 0 and pose = [x, y, z, roll, pitch, yaw], in m and rad",
                found,
            )
        }
        "hull" => {
            let points = e.points.iter().flatten();
            let points: Option<Vec<_>> = points.map(|p| three(Some(p.as_slice()))).collect();
            let radius = match e.radius {
                None => Some(0.0),
                Some(r) => (r == 0.0).then_some(r).or(positive(r)),
            };
            let found = points.zip(radius);
            (
                "a hull has points = [[x, y, z], …], at most 32 and not all in a plane, and perhaps a radius, in m",
                found.and_then(|(points, radius)| Shape::hull(&points, radius)),
            )
        }
        other => {
            let kinds = ["capsule", "sphere", "box", "hull"];
            let hint = did_you_mean(other, kinds);
            let message =
                format!("kind `{other}` is not known{hint}; use capsule, sphere, box or hull");
            return Err(source.error(at, what, message));
        }
    };
    own_keys(source, what, e)?;
    found.ok_or_else(|| source.error(at, what, needs))
}
