//! Linear equations of a loop, solved in the sense of least squares.

use nalgebra::{DMatrix, DVector, Dyn, PermutationSequence};

/// `Φ_p⁺` by orthogonal triangularisation with column pivots. (The singular values of nalgebra are
/// good to 1e-8 only, which is enough to measure with but not to move with.)
pub(super) struct LeastSquares {
    q: DMatrix<f64>,
    r: DMatrix<f64>,
    order: PermutationSequence<Dyn>,
}

impl LeastSquares {
    pub fn new(jp: DMatrix<f64>) -> Self {
        let qr = jp.col_piv_qr();
        LeastSquares {
            q: qr.q(),
            r: qr.r(),
            order: qr.p().clone(),
        }
    }

    /// Smallest and largest pivot; zero where there are fewer rows than columns.
    pub fn range(&self) -> (f64, f64) {
        if self.r.nrows() < self.r.ncols() {
            return (0.0, self.r.amax());
        }
        let pivots = self.r.diagonal().abs();
        (pivots.min(), pivots.max())
    }

    /// Not numbers where it is singular.
    pub fn solve(&self, b: DVector<f64>) -> DVector<f64> {
        let mut x = self.q.tr_mul(&b);
        match self.r.nrows() == self.r.ncols() && self.r.solve_upper_triangular_mut(&mut x) {
            true => self.order.inv_permute_rows(&mut x),
            false => x = DVector::from_element(self.r.ncols(), f64::NAN),
        }
        x
    }
}
