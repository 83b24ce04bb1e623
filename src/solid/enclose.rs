//! The smallest shape about some triangles: a box, a capsule or a ball.

use super::hull::hull;
use super::mesh::Mesh;
use super::shape::{Pose, Shape};
use nalgebra::{Matrix3, Rotation3, Vector3};
use std::f64::consts::PI;

type V = Vector3<f64>;

/// A box stands for a part where its volume is less than this part of the capsule's.
const BOX: f64 = 0.75;

/// Directions of the first grid.
const DIRECTIONS: usize = 160;

/// Directions of that grid from which smaller and smaller turns are tried.
const POLISHED: usize = 4;

/// Points that are looked at side by side.
const LANES: usize = 8;

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
pub(super) const MANY: usize = 1500;
/// Directions along which these are looked for.
const LOOKS: usize = 400;

/// The points that lie outermost along many directions.
pub(super) fn extremes(points: &[V]) -> Vec<V> {
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
    let mut tries: Vec<Along> = tries.iter().map(|u| Along::new(points, u)).collect();
    tries.sort_by(|a, b| a.bound.total_cmp(&b.bound));
    let mut found: Vec<(f64, V, Capsule)> = Vec::with_capacity(tries.len());
    for along in &tries {
        // none of the others is among the best
        if found.len() >= POLISHED && along.bound >= found[POLISHED - 1].0 {
            break;
        }
        let c = along.smallest();
        let at = found.partition_point(|f| f.0 <= c.volume());
        found.insert(at, (c.volume(), along.axis, c));
    }
    let polished = found.iter().take(POLISHED).map(|(volume, u, c)| {
        let (mut volume, mut u, mut c) = (*volume, *u, *c);
        let mut step = 0.1;
        while step > 1e-4 {
            let [e, f] = across(&u);
            let near = [e, -e, f, -f].map(|d| (u + d * step).normalize());
            let best = near
                .into_iter()
                .map(|v| Along::new(points, &v))
                .filter(|along| along.bound < volume)
                .map(|along| (along.axis, along.smallest()))
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

/// Points seen along an axis, and what every capsule along it has at least.
struct Along {
    axis: V,
    /// where the axis of the thinnest one passes, and its radius
    base: V,
    least: f64,
    /// place along the axis and squared distance from it, whole rows of lanes
    seen: Vec<[f64; 2]>,
    /// no capsule along the axis has less volume
    bound: f64,
}

impl Along {
    fn new(points: &[V], u: &V) -> Self {
        let [e, f] = across(u);
        let flat: Vec<[f64; 2]> = points.iter().map(|p| [e.dot(p), f.dot(p)]).collect();
        let (centre, least) = smallest_circle(&flat);
        let at = |(p, q): (&V, &[f64; 2])| {
            let d2 = (q[0] - centre[0]).powi(2) + (q[1] - centre[1]).powi(2);
            [u.dot(p), d2]
        };
        let mut seen: Vec<[f64; 2]> = points.iter().zip(&flat).map(at).collect();
        // the last point once more changes nothing
        if let Some(last) = seen.last().copied() {
            seen.resize(seen.len().next_multiple_of(LANES), last);
        }
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for [t, _] in &seen {
            (low, high) = (low.min(*t), high.max(*t));
        }
        // a radius r reaches r beyond either end; what that leaves grows with r
        let between = (high - low - 2.0 * least).max(0.0);
        let bound = PI * least * least * between + 4.0 / 3.0 * PI * least.powi(3);
        Along {
            axis: *u,
            base: e * centre[0] + f * centre[1],
            least,
            seen,
            bound,
        }
    }

    /// The shortest capsule of this radius.
    fn of(&self, radius: f64) -> Capsule {
        let (mut low, mut high) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
        for row in self.seen.chunks_exact(LANES) {
            for (k, [t, d2]) in row.iter().enumerate() {
                let h = (radius * radius - d2).max(0.0).sqrt();
                low[k] = low[k].min(t + h);
                high[k] = high[k].max(t - h);
            }
        }
        let mut a = low.into_iter().fold(f64::INFINITY, f64::min);
        let mut b = high.into_iter().fold(f64::NEG_INFINITY, f64::max);
        if a > b {
            (a, b) = (0.5 * (a + b), 0.5 * (a + b));
        }
        Capsule {
            from: self.base + self.axis * a,
            to: self.base + self.axis * b,
            radius,
        }
    }

    /// The smallest capsule: a golden section over the radius.
    fn smallest(&self) -> Capsule {
        let (mut lo, mut hi) = (self.least, 2.0 * self.least);
        let g = 0.5 * (5.0_f64.sqrt() - 1.0);
        let (mut x, mut y) = (hi - g * (hi - lo), lo + g * (hi - lo));
        let (mut vx, mut vy) = (self.of(x).volume(), self.of(y).volume());
        for _ in 0..24 {
            if vx < vy {
                (hi, y, vy) = (y, x, vx);
                x = hi - g * (hi - lo);
                vx = self.of(x).volume();
            } else {
                (lo, x, vx) = (x, y, vy);
                y = lo + g * (hi - lo);
                vy = self.of(y).volume();
            }
        }
        let (tight, best) = (self.of(self.least), self.of(0.5 * (lo + hi)));
        if tight.volume() <= best.volume() {
            tight
        } else {
            best
        }
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
pub(super) fn half_sphere(k: usize, n: usize) -> V {
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
        let (x, y) = (p[0] - c.0[0], p[1] - c.0[1]);
        x * x + y * y <= (c.1 * (1.0 + 1e-12) + 1e-15).powi(2)
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
