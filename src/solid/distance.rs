//! Signed distance of two convex shapes, with the points where they are nearest.
//!
//! For cores `A`, `B` (convex hulls of a few vertices) with radii `r_A`, `r_B`,
//!
//! ```text
//! d = min_{a ∈ A, b ∈ B} |b − a| − r_A − r_B          cores apart
//! d = −(least translation that parts the cores) − r_A − r_B   cores overlapping
//! ```
//!
//! The normal `n` points from `A` to `B`; with the witness points `a`, `b` on the surfaces the rate of
//! the distance is `ḋ = nᵀ (v_b − v_a)` with the velocities of the material points there, which is the
//! exact derivative where the nearest points are unique.
//!
//! Two points or segments are solved in closed form (Ericson, Real-Time Collision Detection, 2005, sec.
//! 5.1.9); boxes and hulls by the nearest point to the origin of the Minkowski difference (Gilbert, Johnson &
//! Keerthi, IEEE J. Robotics and Automation 4, 1988), with the separating axes of the two polytopes
//! where the cores overlap. Of hulls only the normals of the faces are tried there, so that the depth of an overlap
//! may be stated too large; that there is one is exact.

use super::shape::{MOST_VERTICES, Pose, Shape, nearest_on_segment};
use nalgebra::Vector3;

type V = Vector3<f64>;

/// How far two shapes are apart, and where.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Separation {
    /// signed distance of the surfaces, m; negative where they overlap
    pub distance: f64,
    /// point on the surface of the first shape
    pub on_first: V,
    /// point on the surface of the second shape
    pub on_second: V,
    /// unit normal from the first to the second
    pub normal: V,
}

/// Separation of shape `a` on a body at `at_a` and shape `b` on a body at `at_b`, in the frame of both poses.
pub fn separation(a: &Shape, at_a: &Pose, b: &Shape, at_b: &Pose) -> Separation {
    // the buffers of a hull cost more than the distance of two capsules
    if let (Some(va), Some(vb)) = (a.segment(at_a), b.segment(at_b)) {
        let nearest = segments(va[0], va[1], vb[0], vb[1]);
        return swept((a, at_a, &va), (b, at_b, &vb), nearest);
    }
    let (mut va, mut vb) = ([V::zeros(); MOST_VERTICES], [V::zeros(); MOST_VERTICES]);
    let (ka, kb) = (a.core(at_a, &mut va), b.core(at_b, &mut vb));
    let (va, vb) = (&va[..ka], &vb[..kb]);
    swept((a, at_a, va), (b, at_b, vb), gjk(va, vb))
}

/// Separation of two shapes whose cores are nearest at `p` and `q`.
fn swept(first: Placed, second: Placed, (p, q): (V, V)) -> Separation {
    let (ra, rb) = (first.0.radius(), second.0.radius());
    let (va, vb) = (first.2, second.2);
    let gap = q - p;
    let core = gap.norm();
    let scale = 1e-9 * (1.0 + p.amax().max(q.amax()));
    if core > scale {
        let n = gap / core;
        return Separation {
            distance: core - ra - rb,
            on_first: p + n * ra,
            on_second: q - n * rb,
            normal: n,
        };
    }
    let (depth, n) = overlap(first, second);
    let p = match depth > 0.0 {
        true => contact(va, vb, &n),
        false => p,
    };
    Separation {
        distance: -depth - ra - rb,
        on_first: p + n * (ra + depth),
        on_second: p - n * rb,
        normal: n,
    }
}

impl Shape {
    /// Distance of a point of the body's frame from the surface, negative inside, m.
    pub fn signed_distance(&self, p: &Vector3<f64>) -> f64 {
        match self {
            Shape::Sphere { centre, radius } => (p - centre).norm() - radius,
            Shape::Capsule { from, to, radius } => {
                (p - nearest_on_segment(from, to, p)).norm() - radius
            }
            Shape::Box { pose, half } => {
                let local = pose.rotation.transpose() * (p - pose.position);
                let over = local.abs() - half;
                let outside = over.map(|x| x.max(0.0)).norm();
                outside + over.max().min(0.0)
            }
            Shape::Hull(h) => {
                let heights = h.faces.iter().map(|(n, o)| n.dot(p) - o);
                let highest = heights.fold(f64::NEG_INFINITY, f64::max);
                match highest > 0.0 {
                    true => from_point(&h.points, p) - h.radius,
                    false => highest - h.radius,
                }
            }
        }
    }
}

/// Distance of a point from the convex hull of some others; 0 inside.
pub(super) fn from_point(hull: &[V], p: &V) -> f64 {
    let (a, b) = gjk(&[*p], hull);
    (b - a).norm()
}

/// Separation of a shape and the half-space `normalᵀ x ≤ offset` (floor, wall), the shape being the first.
pub fn separation_from_plane(a: &Shape, at: &Pose, normal: &V, offset: f64) -> Separation {
    let mut v = [V::zeros(); MOST_VERTICES];
    let k = a.core(at, &mut v);
    let deepest = v[..k]
        .iter()
        .copied()
        .min_by(|x, y| normal.dot(x).total_cmp(&normal.dot(y)))
        .unwrap_or_default();
    let height = normal.dot(&deepest) - offset;
    Separation {
        distance: height - a.radius(),
        on_first: deepest - normal * a.radius(),
        on_second: deepest - normal * height,
        normal: -normal,
    }
}

/// Nearest points of the segments `p1 q1` and `p2 q2`.
pub fn segments(p1: V, q1: V, p2: V, q2: V) -> (V, V) {
    let (d1, d2, r) = (q1 - p1, q2 - p2, p1 - p2);
    let (a, e, f) = (d1.norm_squared(), d2.norm_squared(), d2.dot(&r));
    let tiny = 1e-24;
    let (s, t) = if a <= tiny && e <= tiny {
        (0.0, 0.0)
    } else if a <= tiny {
        (0.0, (f / e).clamp(0.0, 1.0))
    } else {
        let c = d1.dot(&r);
        if e <= tiny {
            ((-c / a).clamp(0.0, 1.0), 0.0)
        } else {
            let b = d1.dot(&d2);
            let denominator = a * e - b * b;
            let s = match denominator > 1e-12 * a * e {
                true => ((b * f - c * e) / denominator).clamp(0.0, 1.0),
                false => 0.0,
            };
            let t = (b * s + f) / e;
            if t < 0.0 {
                ((-c / a).clamp(0.0, 1.0), 0.0)
            } else if t > 1.0 {
                (((b - c) / a).clamp(0.0, 1.0), 1.0)
            } else {
                (s, t)
            }
        }
    };
    (p1 + d1 * s, p2 + d2 * t)
}

/// One vertex of the Minkowski difference `B − A` and the vertices that it comes from.
#[derive(Clone, Copy)]
struct Vertex {
    w: V,
    a: V,
    b: V,
}

/// Vertex of `B − A` furthest along `d`.
fn support(va: &[V], vb: &[V], d: &V) -> Vertex {
    let furthest = |v: &[V], d: &V| {
        let best = v.iter().max_by(|x, y| d.dot(x).total_cmp(&d.dot(y)));
        best.copied().unwrap_or_default()
    };
    let (a, b) = (furthest(va, &-d), furthest(vb, d));
    Vertex { w: b - a, a, b }
}

/// Some of the at most four vertices of a simplex, and their weights.
#[derive(Clone, Copy)]
struct Carried {
    count: usize,
    at: [usize; 4],
    weights: [f64; 4],
}

impl Carried {
    fn sum(&self, s: &[Vertex], of: fn(&Vertex) -> V) -> V {
        (0..self.count).fold(V::zeros(), |sum, k| {
            sum + of(&s[self.at[k]]) * self.weights[k]
        })
    }
}

/// Nearest points of two convex hulls; equal points where they overlap.
fn gjk(va: &[V], vb: &[V]) -> (V, V) {
    let first = support(va, vb, &(va[0] - vb[0]));
    let mut simplex = [first; 5];
    let mut count = 1;
    let mut carried = Carried {
        count: 1,
        at: [0; 4],
        weights: [1.0, 0.0, 0.0, 0.0],
    };
    let mut nearest = first.w;
    for _ in 0..64 {
        let length = nearest.norm();
        if length < 1e-12 {
            break;
        }
        let next = support(va, vb, &-nearest);
        // no vertex lies nearer to the origin by more than rounding
        if nearest.dot(&(nearest - next.w)) <= 1e-13 * (length * length).max(1e-12) {
            break;
        }
        if count == 4 || simplex[..count].iter().any(|v| v.w == next.w) {
            break;
        }
        simplex[count] = next;
        count += 1;
        let found = nearest_of_simplex(&simplex[..count]);
        let point = found.sum(&simplex, |v| v.w);
        let kept = found.at.map(|k| simplex[k]);
        count = found.count;
        simplex[..4].copy_from_slice(&kept);
        carried = Carried {
            at: [0, 1, 2, 3],
            ..found
        };
        if point.norm() >= length {
            break;
        }
        nearest = point;
    }
    (
        carried.sum(&simplex, |v| v.a),
        carried.sum(&simplex, |v| v.b),
    )
}

/// The point of a simplex of up to four vertices nearest to the origin: which vertices carry it and
/// their weights. Every face is tried; the nearest one that holds its own projection is the answer.
fn nearest_of_simplex(s: &[Vertex]) -> Carried {
    let mut best = Carried {
        count: 1,
        at: [0; 4],
        weights: [1.0, 0.0, 0.0, 0.0],
    };
    let mut least = f64::INFINITY;
    for mask in 1_usize..1 << s.len() {
        let mut kept = [0; 4];
        let mut count = 0;
        for i in 0..s.len() {
            if mask >> i & 1 == 1 {
                kept[count] = i;
                count += 1;
            }
        }
        let Some(weights) = projection(s, &kept[..count]) else {
            continue;
        };
        let found = Carried {
            count,
            at: kept,
            weights,
        };
        let d = found.sum(s, |v| v.w).norm_squared();
        // of faces that are equally near the one of fewest vertices
        if d < least - 1e-15 * least.min(1.0) {
            least = d;
            best = found;
        }
    }
    best
}

/// Barycentric weights of the origin's projection on the affine hull of these vertices, where none is
/// negative.
fn projection(s: &[Vertex], kept: &[usize]) -> Option<[f64; 4]> {
    let origin = s[kept[0]].w;
    let n = kept.len() - 1;
    if n == 0 {
        return Some([1.0, 0.0, 0.0, 0.0]);
    }
    let mut edges = [V::zeros(); 3];
    for (e, k) in edges.iter_mut().zip(&kept[1..]) {
        *e = s[*k].w - origin;
    }
    // normal equations of at most three edges, by Gaussian elimination with pivoting
    let mut m = [[0.0; 4]; 3];
    for i in 0..n {
        for k in 0..n {
            m[i][k] = edges[i].dot(&edges[k]);
        }
        m[i][3] = -edges[i].dot(&origin);
    }
    let scale = (0..n).map(|i| m[i][i]).fold(0.0, f64::max);
    for c in 0..n {
        let pivot = (c..n).max_by(|i, k| m[*i][c].abs().total_cmp(&m[*k][c].abs()))?;
        m.swap(c, pivot);
        if m[c][c].abs() <= 1e-13 * scale {
            return None;
        }
        for i in 0..n {
            if i != c {
                let f = m[i][c] / m[c][c];
                let pivot = m[c];
                for (x, p) in m[i].iter_mut().zip(pivot).skip(c) {
                    *x -= f * p;
                }
            }
        }
    }
    let mut weights = [1.0, 0.0, 0.0, 0.0];
    for i in 0..n {
        weights[i + 1] = m[i][3] / m[i][i];
        weights[0] -= weights[i + 1];
    }
    weights[..=n].iter().all(|w| *w >= 0.0).then_some(weights)
}

/// A shape, the pose of its body and the vertices of its core there.
type Placed<'a> = (&'a Shape, &'a Pose, &'a [V]);

/// Least translation of `B` that parts two overlapping cores: its length and its direction, over the
/// separating axes of two polytopes (face normals and products of edges).
fn overlap((a, at_a, va): Placed, (b, at_b, vb): Placed) -> (f64, V) {
    let edges = |shape: &Shape, v: &[V]| -> Vec<V> {
        match shape {
            Shape::Sphere { .. } | Shape::Hull(_) => vec![],
            Shape::Capsule { .. } => vec![v[1] - v[0]],
            Shape::Box { .. } => vec![v[1] - v[0], v[2] - v[0], v[4] - v[0]],
        }
    };
    let (ea, eb) = (edges(a, va), edges(b, vb));
    let mut axes: Vec<V> = Vec::new();
    // a box has its faces across its edges; flat cores have any axis across them
    axes.extend(ea.iter().chain(&eb));
    for (shape, at) in [(a, at_a), (b, at_b)] {
        if let Shape::Hull(h) = shape {
            axes.extend(h.normals().map(|n| at.rotation * n));
        }
    }
    for (i, a) in ea.iter().enumerate() {
        axes.extend(eb.iter().map(|b| a.cross(b)));
        axes.extend(ea[i + 1..].iter().map(|b| a.cross(b)));
    }
    for (i, a) in eb.iter().enumerate() {
        axes.extend(eb[i + 1..].iter().map(|b| a.cross(b)));
    }
    if va.len() <= 2 && vb.len() <= 2 {
        // points and segments meet in a point: any direction across them parts them at once
        let across = match (ea.first(), eb.first()) {
            (Some(a), Some(b)) => a.cross(b),
            (Some(a), None) | (None, Some(a)) => perpendicular(a),
            (None, None) => V::z(),
        };
        let n = across.try_normalize(1e-12);
        return (
            0.0,
            n.unwrap_or_else(|| ea.first().map_or(V::z(), perpendicular)),
        );
    }
    let range = |v: &[V], n: &V| {
        v.iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), p| {
                let x = n.dot(p);
                (lo.min(x), hi.max(x))
            })
    };
    let mut best = (f64::INFINITY, V::z());
    for axis in axes {
        let Some(n) = axis.try_normalize(1e-12) else {
            continue;
        };
        let ((a0, a1), (b0, b1)) = (range(va, &n), range(vb, &n));
        // push B along +n, or along −n
        for (depth, n) in [(a1 - b0, n), (b1 - a0, -n)] {
            if depth < best.0 {
                best = (depth, n);
            }
        }
    }
    (best.0.max(0.0), best.1)
}

/// Point of `B` that the overlap along `n` is about: where the deepest features of both cores meet.
fn contact(va: &[V], vb: &[V], n: &V) -> V {
    let deepest = |v: &[V], n: &V| -> Vec<V> {
        let most = v.iter().map(|p| n.dot(p)).fold(f64::NEG_INFINITY, f64::max);
        let size = v.iter().map(|p| p.amax()).fold(0.0, f64::max);
        let near = v.iter().filter(|p| n.dot(p) >= most - 1e-9 * (1.0 + size));
        near.copied().collect()
    };
    let (a, b) = (deepest(va, n), deepest(vb, &-n));
    let middle = |v: &[V]| v.iter().sum::<V>() / v.len() as f64;
    match (a.len(), b.len()) {
        (2, 2) => segments(a[0], a[1], b[0], b[1]).1,
        (i, k) if k <= i => middle(&b),
        _ => {
            // along `n` onto the face of B
            let p = middle(&a);
            p + n * n.dot(&(b[0] - p))
        }
    }
}

/// A unit vector across `a`.
fn perpendicular(a: &V) -> V {
    let least = a.iamin();
    let mut e = V::zeros();
    e[least] = 1.0;
    a.cross(&e).try_normalize(1e-300).unwrap_or(V::z())
}
