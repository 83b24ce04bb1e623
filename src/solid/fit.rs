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

use super::hull::{Hull, hull};
use super::mesh::Mesh;
use super::parts::{Parts, Split};
use super::shape::{MOST_VERTICES, Pose, Shape};
use nalgebra::{Matrix3, Rotation3, Vector3};
use rayon::prelude::*;
use std::f64::consts::PI;

type V = Vector3<f64>;

/// Directions of the first grid.
const DIRECTIONS: usize = 160;

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

/// A box stands for a part where its volume is less than this part of the capsule's.
const BOX: f64 = 0.75;

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

#[derive(Debug, Clone, Copy)]
struct Capsule {
    from: V,
    to: V,
    radius: f64,
}

impl Capsule {
    fn volume(&self) -> f64 {
        let r = self.radius;
        PI * r * r * (self.to - self.from).norm() + 4.0 / 3.0 * PI * r.powi(3)
    }

    fn shape(&self) -> Shape {
        Shape::Capsule {
            from: self.from,
            to: self.to,
            radius: self.radius,
        }
    }
}

/// Corners of these triangles, or those of their hull where it has a volume.
pub(super) fn corners(mesh: &Mesh, triangles: &[usize]) -> Vec<V> {
    let mut used: Vec<usize> = triangles.iter().flat_map(|t| mesh.triangles[*t]).collect();
    used.sort_unstable();
    used.dedup();
    let points: Vec<V> = used.iter().map(|i| mesh.points[*i]).collect();
    if points.len() > MANY {
        return extremes(&points);
    }
    match hull(&points) {
        Some(h) => h.corners.iter().map(|i| points[*i]).collect(),
        None => points,
    }
}

/// Points of a part beyond which only the outermost ones are searched with.
const MANY: usize = 1500;
/// Directions along which these are looked for.
const LOOKS: usize = 400;

/// The points that lie outermost along many directions.
fn extremes(points: &[V]) -> Vec<V> {
    let mut found: Vec<usize> = Vec::with_capacity(2 * LOOKS);
    for k in 0..LOOKS {
        let u = half_sphere(k, LOOKS);
        let (mut low, mut high) = ((f64::INFINITY, 0), (f64::NEG_INFINITY, 0));
        for (i, p) in points.iter().enumerate() {
            let x = u.dot(p);
            if x < low.0 {
                low = (x, i);
            }
            if x > high.0 {
                high = (x, i);
            }
        }
        found.extend([low.1, high.1]);
    }
    found.sort_unstable();
    found.dedup();
    found.into_iter().map(|i| points[i]).collect()
}

/// The smallest shape found about these triangles.
pub(super) fn enclose(mesh: &Mesh, triangles: &[usize]) -> Shape {
    let found = search(mesh, triangles);
    // those that were not searched with, and rounding
    let over = triangles
        .iter()
        .flat_map(|t| mesh.triangles[*t])
        .map(|i| found.signed_distance(&mesh.points[i]))
        .fold(0.0, f64::max);
    let more = over * (1.0 + 1e-9) + 1e-12;
    match found {
        Shape::Box { pose, half } => Shape::Box {
            pose,
            half: half + V::repeat(more),
        },
        Shape::Capsule { from, to, radius } => Shape::Capsule {
            from,
            to,
            radius: radius + more,
        },
        Shape::Sphere { centre, radius } => Shape::Sphere {
            centre,
            radius: radius + more,
        },
        hull @ Shape::Hull(_) => hull,
    }
}

fn search(mesh: &Mesh, triangles: &[usize]) -> Shape {
    let points = corners(mesh, triangles);
    let capsule = capsule(&points);
    let boxed = smallest_box(&points);
    match boxed.volume() < BOX * capsule.volume() {
        true => boxed,
        false => capsule.shape(),
    }
}

/// The smallest box found about points: turned about its axes by smaller and smaller angles.
fn smallest_box(points: &[V]) -> Shape {
    let about = |axes: &Matrix3<f64>| -> (f64, V, V) {
        let (mut lo, mut hi) = (V::repeat(f64::INFINITY), V::repeat(f64::NEG_INFINITY));
        for p in points {
            let x = axes.tr_mul(p);
            lo = lo.inf(&x);
            hi = hi.sup(&x);
        }
        let size = hi - lo;
        (size.x * size.y * size.z, lo, hi)
    };
    let [a, b, _] = principal_axes(points);
    let principal = Matrix3::from_columns(&[a, b, a.cross(&b)]);
    let best = [principal, Matrix3::identity()].into_iter().map(|start| {
        let (mut axes, mut least) = (start, about(&start).0);
        let mut step = 0.4;
        while step > 1e-4 {
            let turns = (0..6).map(|k| {
                let mut by = V::zeros();
                by[k / 2] = if k % 2 == 0 { step } else { -step };
                let turned = axes * Rotation3::new(by).into_inner();
                (about(&turned).0, turned)
            });
            match turns.min_by(|x, y| x.0.total_cmp(&y.0)) {
                Some((volume, turned)) if volume < least * (1.0 - 1e-9) => {
                    (least, axes) = (volume, turned);
                }
                _ => step *= 0.5,
            }
        }
        (least, axes)
    });
    let axes = best
        .min_by(|x, y| x.0.total_cmp(&y.0))
        .map_or(Matrix3::identity(), |b| b.1);
    let (_, lo, hi) = about(&axes);
    // rounding must leave no corner outside
    let half = (hi - lo) * 0.5 * (1.0 + 1e-9) + V::repeat(1e-12);
    Shape::Box {
        pose: Pose {
            rotation: axes,
            position: axes * ((lo + hi) * 0.5),
        },
        half,
    }
}

/// The smallest capsule found about points.
fn capsule(points: &[V]) -> Capsule {
    let mut tries: Vec<V> = principal_axes(points).to_vec();
    tries.extend((0..DIRECTIONS).map(|k| half_sphere(k, DIRECTIONS)));
    let mut found: Vec<(f64, V, Capsule)> = tries
        .into_iter()
        .map(|u| {
            let c = along(points, &u);
            (c.volume(), u, c)
        })
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let polished = found.iter().take(4).map(|(volume, u, c)| {
        let (mut volume, mut u, mut c) = (*volume, *u, *c);
        let mut step = 0.1;
        while step > 1e-4 {
            let [e, f] = across(&u);
            let near = [e, -e, f, -f].map(|d| (u + d * step).normalize());
            let best = near
                .into_iter()
                .map(|v| (v, along(points, &v)))
                .min_by(|a, b| a.1.volume().total_cmp(&b.1.volume()));
            match best {
                Some((v, k)) if k.volume() < volume * (1.0 - 1e-9) => {
                    (volume, u, c) = (k.volume(), v, k);
                }
                _ => step *= 0.5,
            }
        }
        c
    });
    let best = polished.min_by(|a, b| a.volume().total_cmp(&b.volume()));
    let mut c = best.unwrap_or(Capsule {
        from: V::zeros(),
        to: V::zeros(),
        radius: 0.0,
    });
    // rounding must leave no corner outside
    let over = points
        .iter()
        .map(|p| c.shape().signed_distance(p))
        .fold(0.0, f64::max);
    c.radius += over * (1.0 + 1e-9) + 1e-12;
    c
}

/// The smallest capsule with an axis along `u`.
fn along(points: &[V], u: &V) -> Capsule {
    let [e, f] = across(u);
    let flat: Vec<[f64; 2]> = points.iter().map(|p| [e.dot(p), f.dot(p)]).collect();
    let (centre, least) = smallest_circle(&flat);
    let base = e * centre[0] + f * centre[1];
    let seen: Vec<(f64, f64)> = points
        .iter()
        .zip(&flat)
        .map(|(p, q)| {
            let d2 = (q[0] - centre[0]).powi(2) + (q[1] - centre[1]).powi(2);
            (u.dot(p), d2)
        })
        .collect();
    let of = |radius: f64| -> Capsule {
        let (mut a, mut b) = (f64::INFINITY, f64::NEG_INFINITY);
        for (t, d2) in &seen {
            let h = (radius * radius - d2).max(0.0).sqrt();
            a = a.min(t + h);
            b = b.max(t - h);
        }
        if a > b {
            (a, b) = (0.5 * (a + b), 0.5 * (a + b));
        }
        Capsule {
            from: base + u * a,
            to: base + u * b,
            radius,
        }
    };
    // golden section over the radius
    let (mut lo, mut hi) = (least, 2.0 * least);
    let g = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut x, mut y) = (hi - g * (hi - lo), lo + g * (hi - lo));
    let (mut vx, mut vy) = (of(x).volume(), of(y).volume());
    for _ in 0..24 {
        if vx < vy {
            (hi, y, vy) = (y, x, vx);
            x = hi - g * (hi - lo);
            vx = of(x).volume();
        } else {
            (lo, x, vx) = (x, y, vy);
            y = lo + g * (hi - lo);
            vy = of(y).volume();
        }
    }
    let (tight, best) = (of(least), of(0.5 * (lo + hi)));
    if tight.volume() <= best.volume() {
        tight
    } else {
        best
    }
}

/// Two unit vectors across `u`.
fn across(u: &V) -> [V; 2] {
    let mut e = V::zeros();
    e[u.iamin()] = 1.0;
    let e = u.cross(&e).normalize();
    [e, u.cross(&e)]
}

/// Direction `k` of `n` evenly over half a sphere (Fibonacci).
fn half_sphere(k: usize, n: usize) -> V {
    let z = (k as f64 + 0.5) / n as f64;
    let angle = k as f64 * PI * (3.0 - 5.0_f64.sqrt());
    let r = (1.0 - z * z).sqrt();
    V::new(r * angle.cos(), r * angle.sin(), z)
}

pub(super) fn principal_axes(points: &[V]) -> [V; 3] {
    let n = points.len().max(1) as f64;
    let mean = points.iter().sum::<V>() / n;
    let scatter: Matrix3<f64> = points
        .iter()
        .map(|p| (p - mean) * (p - mean).transpose())
        .sum();
    let eigen = nalgebra::SymmetricEigen::new(scatter);
    std::array::from_fn(|k| eigen.eigenvectors.column(k).into_owned())
}

/// Smallest circle about points of a plane (Welzl 1991, in the order of the points, moved to front).
fn smallest_circle(points: &[[f64; 2]]) -> ([f64; 2], f64) {
    let mut list: Vec<[f64; 2]> = points.to_vec();
    // a fixed shuffle: the expected time is linear for any order but a sorted one
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    for i in (1..list.len()).rev() {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        list.swap(i, (state >> 33) as usize % (i + 1));
    }
    let inside = |c: &([f64; 2], f64), p: &[f64; 2]| {
        (p[0] - c.0[0]).hypot(p[1] - c.0[1]) <= c.1 * (1.0 + 1e-12) + 1e-15
    };
    let mut c = (list.first().copied().unwrap_or_default(), 0.0);
    for i in 1..list.len() {
        if inside(&c, &list[i]) {
            continue;
        }
        c = (list[i], 0.0);
        for j in 0..i {
            if inside(&c, &list[j]) {
                continue;
            }
            c = two(list[i], list[j]);
            for k in 0..j {
                if !inside(&c, &list[k]) {
                    c = three(list[i], list[j], list[k]);
                }
            }
        }
    }
    c
}

fn two(a: [f64; 2], b: [f64; 2]) -> ([f64; 2], f64) {
    let centre = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
    (centre, 0.5 * (a[0] - b[0]).hypot(a[1] - b[1]))
}

fn three(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> ([f64; 2], f64) {
    let (bx, by, cx, cy) = (b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]);
    let d = 2.0 * (bx * cy - by * cx);
    if d.abs() < 1e-30 {
        // on a line: the circle about the two that are furthest apart
        let all = [two(a, b), two(a, c), two(b, c)];
        let widest = all.into_iter().max_by(|x, y| x.1.total_cmp(&y.1));
        return widest.unwrap_or((a, 0.0));
    }
    let (b2, c2) = (bx * bx + by * by, cx * cx + cy * cy);
    let (ux, uy) = ((cy * b2 - by * c2) / d, (bx * c2 - cx * b2) / d);
    ([a[0] + ux, a[1] + uy], ux.hypot(uy))
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
