//! Triangles of a link's geometry.

use nalgebra::Vector3;

type V = Vector3<f64>;

/// Most triangles that are read of one file.
pub const MOST: usize = 4_000_000;

/// Triangles.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// corners, each point once
    pub points: Vec<V>,
    /// indices into [`Mesh::points`]
    pub triangles: Vec<[usize; 3]>,
}

/// Joins equal points.
#[derive(Default)]
pub(super) struct Builder {
    pub(super) mesh: Mesh,
    known: std::collections::HashMap<[u64; 3], usize>,
}

impl Builder {
    pub(super) fn triangle(
        &mut self,
        corners: [V; 3],
        place: impl Fn() -> String,
    ) -> Result<(), String> {
        if !corners.iter().all(|c| c.iter().all(|x| x.is_finite())) {
            return Err(format!("{}: a number that is not finite", place()));
        }
        if self.mesh.triangles.len() >= MOST {
            return Err(format!("more than {MOST} triangles: simplify the mesh"));
        }
        let mesh = &mut self.mesh;
        let at = corners.map(|c| {
            let key = [c.x, c.y, c.z].map(|x| (x + 0.0).to_bits());
            *self.known.entry(key).or_insert_with(|| {
                mesh.points.push(c);
                mesh.points.len() - 1
            })
        });
        self.mesh.triangles.push(at);
        Ok(())
    }
}

impl Mesh {
    /// Whether every edge has exactly two triangles.
    pub fn closed(&self) -> bool {
        let mut edges = std::collections::HashMap::new();
        for t in &self.triangles {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                *edges.entry((a.min(b), a.max(b))).or_insert(0_usize) += 1;
            }
        }
        edges.values().all(|n| *n == 2)
    }

    /// Lower and upper corner of the box about all points.
    pub fn bounds(&self) -> [V; 2] {
        let far = f64::INFINITY;
        self.points
            .iter()
            .fold([V::repeat(far), V::repeat(-far)], |[lo, hi], p| {
                [lo.inf(p), hi.sup(p)]
            })
    }
}
