//! Positions, velocities and accelerations of many samples.

use super::Tree;
use super::kernel::Pack;

/// A sampled motion of all coordinates, joint by joint: joint `j` at sample `i` is
/// `q[j * count + i]`.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Samples {
    /// number of coordinates
    pub dof: usize,
    /// number of samples
    pub count: usize,
    /// positions, rad or m
    pub q: Vec<f64>,
    /// velocities
    pub qd: Vec<f64>,
    /// accelerations
    pub qdd: Vec<f64>,
}

impl Samples {
    /// The samples with these numbers, in this order.
    ///
    /// # Panics
    /// If there is no such sample.
    pub fn select(&self, at: &[usize]) -> Self {
        let rows = |x: &[f64]| -> Vec<f64> {
            let mut out = Vec::with_capacity(self.dof * at.len());
            for row in x.chunks_exact(self.count.max(1)) {
                out.extend(at.iter().map(|&i| row[i]));
            }
            out
        };
        Samples {
            dof: self.dof,
            count: at.len(),
            q: rows(&self.q),
            qd: rows(&self.qd),
            qdd: rows(&self.qdd),
        }
    }

    /// A motion at rest in zero, to be filled.
    pub fn zeros(dof: usize, count: usize) -> Self {
        let z = vec![0.0; dof * count];
        Samples {
            dof,
            count,
            q: z.clone(),
            qd: z.clone(),
            qdd: z,
        }
    }

    /// From one row a sample.
    ///
    /// # Panics
    /// If a row has not `dof` entries, or the three lists differ in length.
    pub fn from_rows<R: AsRef<[f64]>>(dof: usize, q: &[R], qd: &[R], qdd: &[R]) -> Self {
        assert!(
            q.len() == qd.len() && q.len() == qdd.len(),
            "as many positions as derivatives"
        );
        let mut s = Samples::zeros(dof, q.len());
        for i in 0..q.len() {
            for (to, from) in [
                (&mut s.q, &q[i]),
                (&mut s.qd, &qd[i]),
                (&mut s.qdd, &qdd[i]),
            ] {
                assert_eq!(from.as_ref().len(), dof, "one entry for each coordinate");
                for (j, x) in from.as_ref().iter().enumerate() {
                    to[j * q.len() + i] = *x;
                }
            }
        }
        s
    }

    /// The motion of these coordinates alone.
    ///
    /// # Panics
    /// If there is no such coordinate.
    pub fn rows(&self, rows: &[usize]) -> Samples {
        let n = self.count;
        let pick = |a: &[f64]| {
            rows.iter()
                .flat_map(|&j| &a[j * n..(j + 1) * n])
                .copied()
                .collect()
        };
        Samples {
            dof: rows.len(),
            count: n,
            q: pick(&self.q),
            qd: pick(&self.qd),
            qdd: pick(&self.qdd),
        }
    }

    /// Position, velocity and acceleration of joint `j` at sample `i`.
    pub fn at(&self, j: usize, i: usize) -> [f64; 3] {
        let k = j * self.count + i;
        [self.q[k], self.qd[k], self.qdd[k]]
    }

    pub(super) fn check(&self, tree: &Tree) {
        assert_eq!(
            self.dof,
            tree.dof(),
            "motion and robot differ in their coordinates"
        );
        let n = self.dof * self.count;
        assert!(self.q.len() == n && self.qd.len() == n && self.qdd.len() == n);
    }

    /// Pointers to the pack that starts at sample `i`.
    ///
    /// # Safety
    /// `i` must be a sample.
    #[inline(always)]
    pub(super) unsafe fn pack(&self, i: usize) -> Pack {
        // SAFETY: by the caller's promise
        unsafe {
            Pack {
                q: self.q.as_ptr().add(i),
                qd: self.qd.as_ptr().add(i),
                qdd: self.qdd.as_ptr().add(i),
                stride: self.count,
            }
        }
    }
}
