//! From the geometry of links to volumes that enclose it.

use super::{Form, Geometry, find};
use crate::error::{Warning, WarningKind};
use crate::solid::fit::{self, Fit};
use crate::solid::formats;
use crate::solid::hulls::hulls;
use crate::solid::mesh::Mesh;
use crate::solid::{Pose, Shape};
use nalgebra::Vector3;
use rayon::prelude::*;
use std::path::PathBuf;

/// Most volumes that enclose one mesh.
const MOST: usize = 4;
/// Volumes are added until their union is no more than this times the convex hull.
const ENOUGH: f64 = 1.5;
/// Largest mesh file that is opened, bytes.
const LARGEST_FILE: u64 = 1 << 30;
/// A mesh of more metres than this is taken to be written in millimetres.
const LARGEST_MESH: f64 = 10.0;
/// Sides of the prism that stands for a cylinder.
const SIDES: usize = 32;

/// Where a volume comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Origin {
    /// `[[volume]]` of the robot file
    Stated,
    /// sphere or box of the URDF
    Urdf,
    /// fitted about a mesh or cylinder of the URDF
    Fitted,
}

/// The volumes of one link.
#[derive(Debug, Clone)]
pub struct LinkVolume {
    /// index into [`Geometry::links`]
    pub link: usize,
    /// in the frame of the body that carries the link
    pub shapes: Vec<Shape>,
    /// where they come from
    pub origin: Origin,
    /// volume of their union over that of the convex hull of the geometry; `None` where nothing was fitted
    pub tightness: Option<f64>,
    /// furthest that a fitted surface lies outside the convex hull, m
    pub protrusion: Option<f64>,
}

/// The volumes of all links.
#[derive(Debug, Clone, Default)]
pub struct Volumes {
    /// in the order of the links
    pub links: Vec<LinkVolume>,
    /// links whose geometry could not be read, indices into [`Geometry::links`]
    pub unseen: Vec<usize>,
    /// what was imperfect
    pub warnings: Vec<Warning>,
}

/// Shapes about one part, in the frame of the link.
struct Enclosed {
    shapes: Vec<Shape>,
    fit: Option<Fit>,
    remark: Option<String>,
}

/// Volumes of all links: those that are stated, else those of the geometry.
pub(super) fn fitted(geometry: &Geometry) -> Volumes {
    enclosed(geometry, |mesh| fit::fit(mesh, MOST, ENOUGH))
}

/// The volumes of a geometry with those of some links fitted anew, by up to `most` hulls about each part.
pub(super) fn finer(geometry: &Geometry, links: &[usize], most: usize) -> Volumes {
    let some = Geometry {
        parts: (geometry.parts.iter())
            .filter(|p| links.contains(&p.link))
            .cloned()
            .collect(),
        ..geometry.clone()
    };
    let mut fine = enclosed(&some, |mesh| hulls(mesh, most)).links;
    fine.retain(|v| links.contains(&v.link));
    let mut all = geometry.volumes().clone();
    for volume in &mut all.links {
        if let Some(k) = fine.iter().position(|v| v.link == volume.link) {
            *volume = fine.swap_remove(k);
        }
    }
    all
}

/// Volumes of all links, meshes fitted so.
fn enclosed(geometry: &Geometry, fit: impl Fn(&Mesh) -> Fit + Sync) -> Volumes {
    let stated = |link: usize| geometry.stated.iter().any(|(l, _)| *l == link);
    let parts: Vec<_> = geometry.parts.iter().filter(|p| !stated(p.link)).collect();
    let enclosed: Vec<Result<Enclosed, String>> = parts
        .par_iter()
        .map(|p| enclose(&p.form, &geometry.folders, &fit))
        .collect();
    let mut out = Volumes::default();
    for (index, link) in geometry.links.iter().enumerate() {
        let mut volume = LinkVolume {
            link: index,
            shapes: Vec::new(),
            origin: Origin::Stated,
            tightness: None,
            protrusion: None,
        };
        let own = geometry.stated.iter().filter(|(l, _)| *l == index);
        volume.shapes.extend(own.map(|(_, s)| s.moved(&link.pose)));
        let (mut filled, mut hull) = (0.0, 0.0);
        for (part, enclosed) in parts.iter().zip(&enclosed) {
            if part.link != index {
                continue;
            }
            let subject = format!("link `{}`", link.name);
            let mut warn = |text: &str| {
                let kind = WarningKind::GeometryUnread;
                out.warnings.push(Warning::new(kind, subject.clone(), text));
            };
            match enclosed {
                Err(why) => {
                    warn(&format!("its volume is not known: {why}"));
                    out.unseen.push(index);
                }
                Ok(e) => {
                    if let Some(text) = &e.remark {
                        warn(text);
                    }
                    if volume.origin == Origin::Stated {
                        volume.origin = Origin::Urdf;
                    }
                    if let Some(fit) = &e.fit {
                        volume.origin = Origin::Fitted;
                        filled += fit.volume;
                        hull += fit.hull;
                        let most = volume.protrusion.unwrap_or(0.0);
                        volume.protrusion = Some(fit.protrusion.max(most));
                    }
                    let moved = e.shapes.iter().map(|s| s.moved(&link.pose));
                    volume.shapes.extend(moved);
                }
            }
        }
        volume.tightness = (hull > 0.0).then(|| filled / hull);
        if !volume.shapes.is_empty() {
            out.links.push(volume);
        }
    }
    out.unseen.dedup();
    out
}

/// Shapes about a form, in the frame of the link.
fn enclose(
    form: &Form,
    folders: &[PathBuf],
    fit: impl Fn(&Mesh) -> Fit,
) -> Result<Enclosed, String> {
    let about = |mesh: &Mesh, pose: &Pose, remark| about(fit(mesh), pose, remark);
    let solid = |shapes| Enclosed {
        shapes,
        fit: None,
        remark: None,
    };
    match form {
        Form::Solid(shape) => Ok(solid(vec![shape.clone()])),
        Form::Unreadable(why) => Err(why.clone()),
        Form::Cylinder {
            pose,
            radius,
            length,
        } => Ok(about(&prism(*radius, *length), pose, None)),
        Form::Mesh { pose, file, scale } => {
            let path = find::mesh(file, folders).ok_or_else(|| {
                format!(
                    "the mesh {file} was not found; name its folder by --meshes, in robot.toml \
                     (`[collision]`, `meshes = [\"…\"]`), or in ROS_PACKAGE_PATH"
                )
            })?;
            let size = std::fs::metadata(&path).map_or(0, |m| m.len());
            if size > LARGEST_FILE {
                return Err(format!(
                    "{} is larger than {} MiB; simplify the mesh",
                    path.display(),
                    LARGEST_FILE >> 20
                ));
            }
            let bytes = std::fs::read(&path).map_err(|e| format!("{}: {e}", path.display()))?;
            let name = path.to_string_lossy();
            let mut mesh =
                formats::read(&name, &bytes).map_err(|e| format!("{}: {e}", path.display()))?;
            for p in &mut mesh.points {
                p.component_mul_assign(scale);
            }
            let remark = in_metres(&mut mesh, file)?;
            Ok(about(&mesh, pose, remark))
        }
    }
}

/// Takes a mesh that is far too large for a robot as one in millimetres, and says so.
fn in_metres(mesh: &mut Mesh, file: &str) -> Result<Option<String>, String> {
    let [lo, hi] = mesh.bounds();
    let size = (hi - lo).amax();
    if !size.is_finite() {
        return Err(format!("{file} holds numbers that are not finite"));
    }
    if size <= LARGEST_MESH {
        return Ok(None);
    }
    if size > 1000.0 * LARGEST_MESH {
        return Err(format!("{file} is {size:.0} m large; correct its scale"));
    }
    for p in &mut mesh.points {
        *p *= 1e-3;
    }
    Ok(Some(format!(
        "the mesh {file} is {size:.0} m large as written; it is taken to be in millimetres: \
         write scale=\"0.001 0.001 0.001\""
    )))
}

fn about(fit: Fit, pose: &Pose, remark: Option<String>) -> Enclosed {
    Enclosed {
        shapes: fit.shapes.iter().map(|s| s.moved(pose)).collect(),
        fit: Some(fit),
        remark,
    }
}

/// A prism about a cylinder along z.
fn prism(radius: f64, length: f64) -> Mesh {
    let step = std::f64::consts::TAU / SIDES as f64;
    let outer = radius / (0.5 * step).cos();
    let mut mesh = Mesh::default();
    for end in [-0.5, 0.5] {
        for k in 0..SIDES {
            let (s, c) = (k as f64 * step).sin_cos();
            let p = Vector3::new(outer * c, outer * s, end * length);
            mesh.points.push(p);
        }
    }
    for k in 0..SIDES {
        let (a, b) = (k, (k + 1) % SIDES);
        mesh.triangles.push([a, b, a + SIDES]);
        mesh.triangles.push([b, b + SIDES, a + SIDES]);
        if k > 0 && k + 1 < SIDES {
            mesh.triangles.push([0, k + 1, k]);
            mesh.triangles.push([SIDES, SIDES + k, SIDES + k + 1]);
        }
    }
    mesh
}
