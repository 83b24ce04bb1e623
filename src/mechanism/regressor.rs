//! Regressor of a closed chain, `W = Gᵀ Y_tree E`.

use super::Mechanism;
use super::motion::{MechanismMotion, MechanismWorkspace, slice};
use crate::dynamics::{Samples, Workspace};
use crate::error::{Error, Result};
use crate::regressor::term_factor;
use faer::Mat;
use rayon::prelude::*;

impl Mechanism {
    /// Regressor of the raw columns for a motion that was evaluated: actuator `a`, sample `s`,
    /// column `c` at `w[c·stride + a·row + s]`.
    ///
    /// # Panics
    /// If `w` is too short.
    pub fn raw_regressor(
        &self,
        ws: &mut Workspace,
        motion: &MechanismMotion,
        w: &mut [f64],
        stride: usize,
        row: usize,
    ) {
        let (na, count) = (self.actuators(), motion.tree.count);
        let p = &self.parameters;
        self.tree
            .projected_regressor(ws, &p.bodies, &motion.tree, &motion.g, na, w, stride, row);
        for (t, &(joint, term)) in p.terms.iter().enumerate() {
            let c = (10 * p.bodies.len() + t) * stride;
            for a in 0..na {
                let g = &motion.g[(joint * na + a) * count..][..count];
                let own = self.own_row(joint, a);
                for (s, to) in w[c + a * row..][..count].iter_mut().enumerate() {
                    let g = own.unwrap_or(g[s]);
                    *to = g * term_factor(term, motion.tree.at(joint, s));
                }
            }
        }
    }

    /// Entry of `G` where it is known to be 0 or 1: actuated coordinates without redundancy.
    pub(super) fn own_row(&self, joint: usize, a: usize) -> Option<f64> {
        let i = self.actuated.iter().position(|&c| c == joint)?;
        (self.actuators() == self.freedoms()).then_some(if i == a { 1.0 } else { 0.0 })
    }

    /// Regressor of the samples `from .. to` alone, in the cache: actuator `a`, sample `s`, raw
    /// column `c` at `(c·actuators + a)·(to − from) + s` of the result. For sums over samples, such
    /// as an information matrix, that never need the whole of `W`.
    ///
    /// # Errors
    /// As [`Mechanism::motion`].
    ///
    /// # Panics
    /// If the motion does not have these samples.
    pub fn raw_block<'a>(
        &self,
        ws: &'a mut MechanismWorkspace,
        x: &Samples,
        from: usize,
        to: usize,
    ) -> Result<&'a [f64]> {
        let isa = ws.tree.isa();
        slice(x, from, to, &mut ws.part);
        self.motion_into(isa, &ws.part, &mut ws.motion)
            .map_err(|e| shifted(e, from))?;
        let n = to - from;
        let rows = self.actuators() * n;
        ws.raw.resize(rows * self.parameters.raw_count(), 0.0);
        self.raw_regressor(&mut ws.tree, &ws.motion, &mut ws.raw, rows, n);
        Ok(&ws.raw)
    }

    /// The stacked regressor `W` of a motion of the task coordinates, column by column: row
    /// `a·count + s` is actuator `a` at sample `s`, columns are
    /// [`Parameters::list`](super::Parameters). On this thread.
    ///
    /// # Errors
    /// As [`Mechanism::motion`].
    ///
    /// # Panics
    /// If `w` has not `actuators·count` rows for each parameter.
    pub fn regressor_into(
        &self,
        ws: &mut MechanismWorkspace,
        x: &Samples,
        w: &mut [f64],
    ) -> Result<()> {
        let (na, count) = (self.actuators(), x.count);
        let rows = na * count;
        assert_eq!(w.len(), rows * self.parameters.list.len(), "size of W");
        for (from, to) in self.chunks(count) {
            let part = self.raw_block(ws, x, from, to)?;
            self.scatter(part, from, to, count, |c| {
                w[c * rows..][..rows].as_mut_ptr()
            });
        }
        Ok(())
    }

    /// Copies the block of samples `from .. to` to the columns.
    fn scatter(
        &self,
        part: &[f64],
        from: usize,
        to: usize,
        count: usize,
        mut column: impl FnMut(usize) -> *mut f64,
    ) {
        let (na, n) = (self.actuators(), to - from);
        assert!(to <= count);
        for (c, p) in self.parameters.list.iter().enumerate() {
            let column = column(c);
            for a in 0..na {
                // SAFETY: columns have na·count rows, and rows from .. to of an actuator are written
                // by the one thread that has this block
                let to = unsafe { std::slice::from_raw_parts_mut(column.add(a * count + from), n) };
                for (i, &r) in p.raw.iter().enumerate() {
                    let source = &part[(r * na + a) * n..][..n];
                    match i {
                        0 => to.copy_from_slice(source),
                        _ => to.iter_mut().zip(source).for_each(|(t, s)| *t += s),
                    }
                }
            }
        }
    }

    /// [`Mechanism::regressor_into`] on all threads of the pool.
    ///
    /// # Errors
    /// As [`Mechanism::motion`].
    pub fn regressor(&self, x: &Samples) -> Result<Mat<f64>> {
        /// The matrix, shared by threads that write different rows.
        struct Columns(Vec<*mut f64>);
        // SAFETY: see above
        unsafe impl Sync for Columns {}
        impl Columns {
            fn at(&self, c: usize) -> *mut f64 {
                self.0[c]
            }
        }
        let count = x.count;
        let mut w = Mat::zeros(self.actuators() * count, self.parameters.list.len());
        let columns = Columns(
            (0..w.ncols())
                .map(|c| w.col_as_slice_mut(c).as_mut_ptr())
                .collect(),
        );
        self.chunks(count)
            .par_iter()
            .map_init(MechanismWorkspace::default, |ws, &(from, to)| {
                let part = self.raw_block(ws, x, from, to)?;
                self.scatter(part, from, to, count, |c| columns.at(c));
                Ok(())
            })
            .collect::<Vec<Result<()>>>()
            .into_iter()
            .collect::<Result<()>>()?;
        Ok(w)
    }
}

/// An error of sample `s` of a chunk, said of the whole.
fn shifted(e: Error, from: usize) -> Error {
    match e {
        Error::Infeasible(m) if from > 0 => {
            Error::Infeasible(format!("{m} (counted from sample {from})"))
        }
        other => other,
    }
}
