//! Convex hulls of few corners that enclose a mesh.
//!
//! The core `C` of a hull is chosen among the corners of the mesh: the one that lies furthest outside is added until
//! none lies farther than half a millimetre, or there are [`MOST_VERTICES`]. Swept by the ball of the radius
//!
//! ```text
//! r = max_i d(p_i, C)            p_i: all corners of the mesh
//! ```
//!
//! it holds every corner, and so every triangle, since it is convex; and it reaches no farther than `r` outside the convex
//! hull of the mesh. A mesh with hollows is split where that saves most of the hulls'
//! volume.

use super::distance::from_point;
use super::enclose::{corners, enclose, principal_axes};
use super::fit::{self, Fit};
use super::hull::hull;
use super::mesh::Mesh;
use super::parts::{Parts, Split};
use super::shape::{MOST_VERTICES, Shape};
use nalgebra::Vector3;
use rayon::prelude::*;

type V = Vector3<f64>;

/// A corner that lies this far outside is let be, m.
const NEAR: f64 = 5e-4;
/// A skin of this part of the mesh's size counts as volume: without it a surface is best split into its flat faces,
/// which have none.
const SKIN: f64 = 0.02;
/// Splits that save less than this part of the whole, all together, are let be.
const WORTH: f64 = 0.02;

/// Encloses a mesh by at most `most` hulls.
pub fn hulls(mesh: &Mesh, most: usize) -> Fit {
    let cut = fit::subdivided(mesh);
    let all: Vec<usize> = (0..cut.triangles.len()).collect();
    let [lo, hi] = cut.bounds();
    let skin = SKIN * (hi - lo).norm();
    let worth = WORTH * bulk(&cut, &all, skin);
    let mut parts = Parts::new(all);
    // what all splits so far saved, and what they left
    let mut saved = 0.0;
    let mut stages = vec![(saved, parts.all.clone())];
    while parts.all.len() < most {
        let Some(more) = parts.split(|part| split(&cut, part, skin)) else {
            break;
        };
        saved += more;
        stages.push((saved, parts.all.clone()));
    }
    // a ring saves nothing until it is in thirds: so all the splits are made, and the fewest that are about as good kept
    let best = stages.iter().map(|s| s.0).fold(0.0, f64::max);
    let parts = stages
        .into_iter()
        .find(|s| s.0 >= best - worth)
        .map_or(Vec::new(), |s| s.1);
    let shapes = parts.par_iter().map(|part| polytope(&cut, part)).collect();
    fit::judged(mesh, shapes)
}

/// Volume of the hull of some triangles, and [`SKIN`] times the surface of the box about their axes, m³.
fn bulk(mesh: &Mesh, triangles: &[usize], skin: f64) -> f64 {
    let points = corners(mesh, triangles);
    let volume = hull(&points).map_or(0.0, |h| h.volume);
    let size = principal_axes(&points).map(|axis| {
        let along = points.iter().map(|p| axis.dot(p));
        let (lo, hi) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
            (a.min(x), b.max(x))
        });
        hi - lo
    });
    let surface = 2.0 * (size[0] * size[1] + size[1] * size[2] + size[2] * size[0]);
    volume + skin * surface
}

/// The way to part triangles in two that saves most of the hulls' volume.
fn split(mesh: &Mesh, triangles: &[usize], skin: f64) -> Option<Split<Vec<usize>>> {
    let whole = bulk(mesh, triangles, skin);
    let all: Vec<Split<Vec<usize>>> = fit::splits(mesh, triangles)
        .into_par_iter()
        .map(|halves| {
            let left: f64 = halves.iter().map(|h| bulk(mesh, h, skin)).sum();
            (whole - left, halves)
        })
        .collect();
    // the first of equals
    all.into_iter().rev().max_by(|a, b| a.0.total_cmp(&b.0))
}

/// The hull of few corners that holds these triangles; a capsule or box where they lie in a plane.
fn polytope(mesh: &Mesh, triangles: &[usize]) -> Shape {
    let outer = corners(mesh, triangles);
    let mut core: Vec<V> = outer.first().copied().into_iter().collect();
    // upper bounds of the distances: each falls as the core grows
    let mut far: Vec<(f64, usize)> = vec![(f64::INFINITY, 0); outer.len()];
    while core.len() < MOST_VERTICES {
        let Some(next) = (0..outer.len()).max_by(|a, b| far[*a].0.total_cmp(&far[*b].0)) else {
            break;
        };
        if far[next].1 != core.len() {
            far[next] = (from_point(&core, &outer[next]), core.len());
            continue;
        }
        if far[next].0 < NEAR {
            break;
        }
        core.push(outer[next]);
    }
    let mut used: Vec<usize> = triangles.iter().flat_map(|t| mesh.triangles[*t]).collect();
    used.sort_unstable();
    used.dedup();
    let outside = used.par_iter().map(|i| from_point(&core, &mesh.points[*i]));
    // rounding must leave no corner outside
    let radius = outside.reduce(|| 0.0, f64::max) * (1.0 + 1e-9) + 1e-9;
    Shape::hull(&core, radius).unwrap_or_else(|| enclose(mesh, triangles))
}
