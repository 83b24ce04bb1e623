//! Convex hull of points in space (Barber, Dobkin & Huhdanpaa, ACM TOMS 22(4), 1996).
//!
//! Meshes hold many corners that lie in a plane up to rounding, which can lead the construction astray. So a hull is
//! verified: it is closed and bends outwards at every edge, and of few points none lies above a face. Where it fails, the points are moved by a little at
//! random and the hull of those is taken, as Qhull does under the name "joggle".

use nalgebra::Vector3;

type V = Vector3<f64>;

/// Convex hull: indices into the points it was made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Hull {
    /// triangles, counter-clockwise seen from outside
    pub faces: Vec<[usize; 3]>,
    /// corners, each once, ascending
    pub corners: Vec<usize>,
    /// volume, in the cube of the points' unit
    pub volume: f64,
}

struct Face {
    corners: [usize; 3],
    normal: V,
    offset: f64,
    outside: Vec<usize>,
    alive: bool,
}

impl Face {
    fn new(points: &[V], corners: [usize; 3]) -> Self {
        let [a, b, c] = corners.map(|i| points[i]);
        let normal = (b - a).cross(&(c - a));
        let normal = normal.try_normalize(0.0).unwrap_or_default();
        Face {
            corners,
            normal,
            offset: normal.dot(&a),
            outside: Vec::new(),
            alive: true,
        }
    }

    fn height(&self, p: &V) -> f64 {
        self.normal.dot(p) - self.offset
    }
}

/// By how much of their size points are moved, in this order until a hull is sound.
const JOGGLES: [f64; 5] = [0.0, 1e-8, 1e-7, 1e-6, 1e-5];

/// The hull of the points; `None` where they lie in a plane, or are fewer than four.
pub fn hull(points: &[V]) -> Option<Hull> {
    let size = points.iter().map(|p| p.amax()).fold(0.0, f64::max);
    let eps = 1e-10 * size.max(1e-300);
    simplex(points, eps)?;
    let mut state = 1_u64;
    let mut share = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    JOGGLES.iter().find_map(|by| {
        let by = by * size;
        let moved: Vec<V> = (points.iter())
            .map(|p| p + V::new(share(), share(), share()) * by)
            .collect();
        quick(&moved, eps).filter(|h| h.sound(&moved, 1e-9 * size))
    })
}

/// Points times faces up to which every point is held against every face.
const FEW: usize = 200_000;

impl Hull {
    /// Whether every edge has two faces, one in each direction, neither of which bends inwards by more than this, and, of
    /// few points, none lies higher above a face.
    fn sound(&self, points: &[V], most: f64) -> bool {
        // the corner that faces an edge, by its direction
        let mut across = std::collections::BTreeMap::new();
        for [a, b, c] in &self.faces {
            for (from, to, corner) in [(a, b, c), (b, c, a), (c, a, b)] {
                if across.insert((*from, *to), *corner).is_some() {
                    return false;
                }
            }
        }
        let planes = self.faces.iter().map(|f| Face::new(points, *f));
        let beside = |f: &Face| {
            let [a, b, c] = f.corners;
            [(b, a), (c, b), (a, c)].into_iter().all(|edge| {
                let other = across.get(&edge);
                other.is_some_and(|corner| f.height(&points[*corner]) <= most)
            })
        };
        let few = self.faces.len() * points.len() <= FEW;
        let below = |f: &Face| !few || points.iter().all(|p| f.height(p) <= most);
        self.volume > 0.0 && planes.into_iter().all(|f| beside(&f) && below(&f))
    }
}

/// The hull by adding the point that lies highest above a face, as long as there is one.
fn quick(points: &[V], eps: f64) -> Option<Hull> {
    let start = simplex(points, eps)?;
    let centre = start.iter().map(|i| points[*i]).sum::<V>() / 4.0;
    let mut faces: Vec<Face> = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]
        .iter()
        .map(|f| {
            let mut corners = f.map(|i| start[i]);
            if Face::new(points, corners).height(&centre) > 0.0 {
                corners.swap(1, 2);
            }
            Face::new(points, corners)
        })
        .collect();
    let assign = |faces: &mut [Face], from: usize, list: Vec<usize>| {
        for i in list {
            let highest = faces[from..]
                .iter_mut()
                .map(|f| (f.height(&points[i]), f))
                .max_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((h, f)) = highest
                && h > eps
            {
                f.outside.push(i);
            }
        }
    };
    let all = (0..points.len()).filter(|i| !start.contains(i)).collect();
    assign(&mut faces, 0, all);
    let mut next = 0;
    while next < faces.len() {
        if !faces[next].alive || faces[next].outside.is_empty() {
            next += 1;
            continue;
        }
        let face = &faces[next];
        let height = |i: &usize| face.height(&points[*i]);
        let apex = *face
            .outside
            .iter()
            .max_by(|a, b| height(a).total_cmp(&height(b)))?;
        // every face that sees the apex goes; the edges between seen and unseen make new ones
        let seen: Vec<usize> = (0..faces.len())
            .filter(|&f| faces[f].alive && faces[f].height(&points[apex]) > eps)
            .collect();
        let mut edges = std::collections::BTreeSet::new();
        let mut orphans = Vec::new();
        for &f in &seen {
            faces[f].alive = false;
            orphans.append(&mut faces[f].outside);
            let [a, b, c] = faces[f].corners;
            for (i, k) in [(a, b), (b, c), (c, a)] {
                if !edges.remove(&(k, i)) {
                    edges.insert((i, k));
                }
            }
        }
        let from = faces.len();
        faces.extend(
            edges
                .into_iter()
                .map(|(i, k)| Face::new(points, [i, k, apex])),
        );
        orphans.retain(|i| *i != apex);
        orphans.sort_unstable();
        assign(&mut faces, from, orphans);
        if faces.len() > 4 * points.len().max(1000) {
            // compact, so that the search for seen faces stays short
            faces.retain(|f| f.alive);
            next = 0;
        }
    }
    faces.retain(|f| f.alive);
    let volume = faces
        .iter()
        .map(|f| {
            let [a, b, c] = f.corners.map(|i| points[i] - centre);
            a.dot(&b.cross(&c)) / 6.0
        })
        .sum();
    let mut corners: Vec<usize> = faces.iter().flat_map(|f| f.corners).collect();
    corners.sort_unstable();
    corners.dedup();
    Some(Hull {
        faces: faces.into_iter().map(|f| f.corners).collect(),
        corners,
        volume,
    })
}

/// Four points that span a volume.
fn simplex(points: &[V], eps: f64) -> Option<[usize; 4]> {
    let furthest = |value: &dyn Fn(&V) -> f64| -> Option<(usize, f64)> {
        let all = points.iter().map(value).enumerate();
        all.max_by(|a, b| a.1.total_cmp(&b.1))
    };
    let (a, _) = furthest(&|p| -p.x)?;
    let (b, length) = furthest(&|p| (p - points[a]).norm())?;
    if length <= eps {
        return None;
    }
    let along = (points[b] - points[a]) / length;
    let (c, width) = furthest(&|p| (p - points[a]).cross(&along).norm())?;
    if width <= eps {
        return None;
    }
    let normal = (points[b] - points[a])
        .cross(&(points[c] - points[a]))
        .normalize();
    let (d, height) = furthest(&|p| normal.dot(&(p - points[a])).abs())?;
    (height > eps).then_some([a, b, c, d])
}
