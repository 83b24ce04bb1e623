//! Capsules and boxes that enclose a mesh.
//!
//! One capsule is convex, so it holds a triangle if it holds its corners. For a given direction `u` of the
//! axis the least radius is that of the smallest circle about the points seen along `u`; with a radius
//! `r` and the distances `d_i` of the points from the axis, the ends lie at
//!
//! ```text
//! a = min_i (t_i + √(r² − d_i²))        b = max_i (t_i − √(r² − d_i²))
//! ```
//!
//! so that the volume `π r² (b − a) + 4/3 π r³` is a function of `u` and `r`, least over a grid of
//! directions and then by pattern search. Where one capsule is much larger than the convex hull the
//! triangles are split across the axes of the part and each part gets its own. A part that a box encloses much
//! more tightly than a capsule gets the box.

use super::enclose::{MANY, enclose, extremes, half_sphere, principal_axes};
use super::hull::{Hull, hull};
use super::mesh::Mesh;
use super::parts::{Parts, Split};
use super::shape::{MOST_VERTICES, Pose, Shape};
use nalgebra::Vector3;
use rayon::prelude::*;

type V = Vector3<f64>;

/// What a fit of one mesh came to.
#[derive(Debug, Clone)]
pub struct Fit {
    /// capsules (a sphere is one of length zero) and boxes
    pub shapes: Vec<Shape>,
    /// volume of their union, m³
    pub volume: f64,
    /// volume of the convex hull of the mesh, m³
    pub hull: f64,
    /// furthest that a surface of a capsule lies from the hull of the mesh, m
    pub protrusion: f64,
}

/// Encloses a mesh by at most `most` shapes, until their volume is below `enough` times that of the hull.
pub fn fit(mesh: &Mesh, most: usize, enough: f64) -> Fit {
    let whole = whole(mesh);
    let cut = subdivided(mesh);
    let original = mesh;
    let mesh = &cut;
    let hull_volume = whole.as_ref().map_or(0.0, |h| h.volume);
    let all: Vec<usize> = (0..mesh.triangles.len()).collect();
    let first = enclose(mesh, &all);
    let mut parts: Parts<Part> = Parts::new((all, first));
    let mut best = parts.all.clone();
    let mut volume = union_volume(&shapes(&best));
    while volume > enough * hull_volume && parts.all.len() < most.max(1) {
        if parts.split(|part| split(mesh, part)).is_none() {
            break;
        }
        let now = union_volume(&shapes(&parts.all));
        if now < volume {
            volume = now;
            best.clone_from(&parts.all);
        }
    }
    of(original, whole, shapes(&best), volume)
}

/// The hull of a mesh, of its outermost points where there are very many.
fn whole(mesh: &Mesh) -> Option<Hull> {
    match mesh.points.len() > MANY {
        true => hull_of(mesh, &extremes(&mesh.points)),
        false => hull(&mesh.points),
    }
}

/// Shapes about a mesh beside its hull.
pub(super) fn judged(mesh: &Mesh, shapes: Vec<Shape>) -> Fit {
    let volume = union_volume(&shapes);
    of(mesh, whole(mesh), shapes, volume)
}

fn of(mesh: &Mesh, whole: Option<Hull>, shapes: Vec<Shape>, volume: f64) -> Fit {
    Fit {
        protrusion: match &whole {
            Some(h) => protrusion(&shapes, mesh, h),
            None => shapes.iter().map(Shape::radius).fold(0.0, f64::max),
        },
        shapes,
        volume,
        hull: whole.map_or(0.0, |h| h.volume),
    }
}

/// Hull of some of the points, with their indices in the mesh.
fn hull_of(mesh: &Mesh, some: &[V]) -> Option<Hull> {
    let mut found = hull(some)?;
    let index = |p: &V| mesh.points.iter().position(|q| q == p).unwrap_or(0);
    let place: Vec<usize> = some.iter().map(index).collect();
    for face in &mut found.faces {
        *face = face.map(|i| place[i]);
    }
    for corner in &mut found.corners {
        *corner = place[*corner];
    }
    Some(found)
}

/// Triangles and the shape that holds them.
type Part = (Vec<usize>, Shape);

/// The way to part a part in two that saves most.
fn split(mesh: &Mesh, (triangles, shape): &Part) -> Option<Split<Part>> {
    let halves = splits(mesh, triangles).into_par_iter().map(|split| {
        let halves = split.map(|t| {
            let c = enclose(mesh, &t);
            (t, c)
        });
        let saved = shape.volume() - halves.iter().map(|h| h.1.volume()).sum::<f64>();
        (saved, halves)
    });
    let all: Vec<Split<Part>> = halves.collect();
    // the first of equals
    all.into_iter().rev().max_by(|a, b| a.0.total_cmp(&b.0))
}

/// The same surface with no edge longer than an eighth of the mesh's size, so that it can be split anywhere;
/// a mesh that is fine enough already, or very large, stays as it is.
pub(super) fn subdivided(mesh: &Mesh) -> Mesh {
    let [lo, hi] = mesh.bounds();
    let longest = (hi - lo).norm() / 8.0;
    let mut out = Mesh {
        points: mesh.points.clone(),
        triangles: Vec::new(),
    };
    let mut todo = mesh.triangles.clone();
    let mut halves = std::collections::HashMap::new();
    while let Some(t) = todo.pop() {
        let edge = |k: usize| (out.points[t[k]] - out.points[t[(k + 1) % 3]]).norm();
        let widest = (0..3)
            .max_by(|a, b| edge(*a).total_cmp(&edge(*b)))
            .unwrap_or(0);
        if edge(widest) <= longest || out.triangles.len() + todo.len() > 200_000 {
            out.triangles.push(t);
            continue;
        }
        let (a, b, c) = (t[widest], t[(widest + 1) % 3], t[(widest + 2) % 3]);
        let middle = *halves.entry((a.min(b), a.max(b))).or_insert_with(|| {
            out.points.push((out.points[a] + out.points[b]) * 0.5);
            out.points.len() - 1
        });
        todo.extend([[a, middle, c], [middle, b, c]]);
    }
    out
}

fn shapes(parts: &[Part]) -> Vec<Shape> {
    parts.iter().map(|p| p.1.clone()).collect()
}

/// Ways to part triangles in two: across each principal axis, at a few places.
pub(super) fn splits(mesh: &Mesh, triangles: &[usize]) -> Vec<[Vec<usize>; 2]> {
    let middle = |t: &usize| {
        mesh.triangles[*t]
            .iter()
            .map(|i| mesh.points[*i])
            .sum::<V>()
            / 3.0
    };
    let centres: Vec<V> = triangles.iter().map(middle).collect();
    let mut out = Vec::new();
    for axis in principal_axes(&centres) {
        let along: Vec<f64> = centres.iter().map(|c| axis.dot(c)).collect();
        let (lo, hi) = along
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
                (a.min(*x), b.max(*x))
            });
        for part in [0.2, 0.35, 0.5, 0.65, 0.8] {
            let cut = lo + part * (hi - lo);
            let side = |below: bool| -> Vec<usize> {
                let chosen = triangles
                    .iter()
                    .zip(&along)
                    .filter(|(_, x)| (**x < cut) == below);
                chosen.map(|(t, _)| *t).collect()
            };
            let halves = [side(true), side(false)];
            if halves.iter().all(|h| !h.is_empty()) {
                out.push(halves);
            }
        }
    }
    out
}

/// Volume of a union, by points on a grid of at most `100³` cells.
pub fn union_volume(shapes: &[Shape]) -> f64 {
    if let [one] = shapes {
        return one.volume();
    }
    let (mut lo, mut hi) = (V::repeat(f64::INFINITY), V::repeat(f64::NEG_INFINITY));
    for s in shapes {
        let mut v = [V::zeros(); MOST_VERTICES];
        let k = s.core(&Pose::identity(), &mut v);
        for p in &v[..k] {
            lo = lo.inf(&(p - V::repeat(s.radius())));
            hi = hi.sup(&(p + V::repeat(s.radius())));
        }
    }
    let size = hi - lo;
    let step = size.max() / 60.0;
    if step <= 0.0 || !step.is_finite() {
        return 0.0;
    }
    let counts = size.map(|s| (s / step).ceil().max(1.0));
    let cell = size.component_div(&counts);
    let mut inside = 0_usize;
    let counts = counts.map(|c| c as usize);
    for i in 0..counts.x {
        for j in 0..counts.y {
            for k in 0..counts.z {
                let at = V::new(i as f64 + 0.5, j as f64 + 0.5, k as f64 + 0.5);
                let p = lo + at.component_mul(&cell);
                inside += usize::from(shapes.iter().any(|s| s.signed_distance(&p) <= 0.0));
            }
        }
    }
    inside as f64 * cell.x * cell.y * cell.z
}

/// Furthest point of the capsules' surface above the faces of the hull, over a grid of surface points.
fn protrusion(shapes: &[Shape], mesh: &Mesh, hull: &Hull) -> f64 {
    let [lo, hi] = mesh.bounds();
    let rounding = 1e-4 * (hi - lo).norm();
    let planes: Vec<(V, f64)> = hull
        .faces
        .iter()
        .filter_map(|f| {
            let [a, b, c] = f.map(|i| mesh.points[i]);
            let n = (b - a).cross(&(c - a)).try_normalize(1e-300)?;
            let offset = n.dot(&a);
            // the normal of a sliver is made of rounding
            let below = |i: &usize| n.dot(&mesh.points[*i]) - offset <= rounding;
            hull.corners.iter().all(below).then_some((n, offset))
        })
        .collect();
    let mut most: f64 = 0.0;
    for s in shapes {
        let mut v = [V::zeros(); MOST_VERTICES];
        let k = s.core(&Pose::identity(), &mut v);
        for end in &v[..k] {
            for d in 0..400 {
                let u = half_sphere(d / 2, 200) * if d % 2 == 0 { 1.0 } else { -1.0 };
                let p = end + u * s.radius();
                let height = planes
                    .iter()
                    .map(|(n, o)| n.dot(&p) - o)
                    .fold(0.0, f64::max);
                most = most.max(height);
            }
        }
    }
    most
}
