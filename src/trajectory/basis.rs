//! Coefficients that meet the end conditions by construction.

use super::fourier::{Fourier, Series};
use crate::error::{Error, Result};
use nalgebra::{DMatrix, DVector};

/// What holds at both ends of every period.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ends {
    /// velocity and acceleration are zero
    #[default]
    Rest,
    /// nothing
    Free,
}

impl Ends {
    /// Name as in files and on the command line: `rest`, `free`.
    pub fn name(self) -> &'static str {
        match self {
            Ends::Rest => "rest",
            Ends::Free => "free",
        }
    }
}

impl std::str::FromStr for Ends {
    type Err = Error;
    fn from_str(text: &str) -> Result<Self> {
        [Ends::Rest, Ends::Free]
            .into_iter()
            .find(|e| e.name() == text)
            .ok_or_else(|| {
                Error::Argument(format!("ends {text:?} are not known; use rest or free"))
            })
    }
}

/// Linear parametrisation of the coefficients `[c_0, s_1 … s_H, c_1 … c_H]` of each joint by free
/// numbers `x_j`, such that the end conditions hold for every `x_j`: `c_j = offset_j + map x_j`.
///
/// The conditions at `t = 0` (and so at every period's end) are `Σ h s_h = 0` (velocity) and
/// `Σ h² c_h = 0` (acceleration) for ends at rest, and `c_0 + Σ c_h = q_start` for a fixed start
/// posture. With the scaling `D = diag(1, 1/h, 1/h)` (a unit of `x` is a unit of velocity in every
/// harmonic) the columns of `D⁻¹ map` are orthonormal: they span the null space of the conditions
/// times `D`.
#[derive(Debug, Clone)]
pub struct Basis {
    /// harmonics of the series
    pub harmonics: Vec<u32>,
    /// end conditions
    pub ends: Ends,
    /// start posture where it is fixed, per joint
    pub start: Option<Vec<f64>>,
    /// `(2H + 1) × m`, the same for every joint
    pub map: DMatrix<f64>,
    /// particular solution of each joint: rest at the start posture, or zero
    pub offset: Vec<DVector<f64>>,
}

impl Basis {
    /// The parametrisation for `dof` joints; `start` is the posture at `t = 0` if it is fixed.
    ///
    /// # Errors
    /// [`Error::Argument`] if too few harmonics are given for a motion (two are needed for ends at
    /// rest), if they do not strictly increase from 1, if there is no joint, or if `start` has
    /// another number of joints or is not finite.
    pub fn new(harmonics: &[u32], ends: Ends, dof: usize, start: Option<&[f64]>) -> Result<Self> {
        let count = harmonics.len();
        let needed = if ends == Ends::Rest { 2 } else { 1 };
        if count < needed {
            return Err(Error::Argument(format!(
                "{count} harmonic(s) leave no motion with {} ends; use at least {needed}{}",
                ends.name(),
                if ends == Ends::Rest {
                    ", or free ends"
                } else {
                    ""
                }
            )));
        }
        if harmonics[0] == 0 || harmonics.windows(2).any(|w| w[0] >= w[1]) {
            return Err(Error::Argument(
                "harmonics must be positive and strictly increasing".into(),
            ));
        }
        if dof == 0 {
            return Err(Error::Argument(
                "a trajectory needs at least one joint".into(),
            ));
        }
        if let Some(posture) = start {
            if posture.len() != dof {
                return Err(Error::Argument(format!(
                    "the start posture has {} values, the robot {dof} joints",
                    posture.len()
                )));
            }
            if posture.iter().any(|q| !q.is_finite()) {
                return Err(Error::Argument("the start posture must be finite".into()));
            }
        }

        let size = 2 * count + 1;
        let scale = scaling(harmonics);
        let mut conditions: Vec<(usize, DVector<f64>)> = Vec::new();
        let mut condition = |pivot: usize, entry: &dyn Fn(usize) -> f64| {
            conditions.push((pivot, DVector::from_fn(size, |k, _| entry(k) * scale[k])));
        };
        if ends == Ends::Rest {
            condition(1, &|k| {
                if (1..=count).contains(&k) {
                    f64::from(harmonics[k - 1])
                } else {
                    0.0
                }
            });
            condition(count + 1, &|k| {
                if k > count {
                    f64::from(harmonics[k - count - 1]).powi(2)
                } else {
                    0.0
                }
            });
        }
        if start.is_some() {
            condition(0, &|k| if k == 0 || k > count { 1.0 } else { 0.0 });
        }
        let mut map = null_space(size, conditions);
        for (k, &d) in scale.iter().enumerate() {
            map.row_mut(k).scale_mut(d);
        }
        let offset = (0..dof)
            .map(|j| {
                let mut at = DVector::zeros(size);
                at[0] = start.map_or(0.0, |posture| posture[j]);
                at
            })
            .collect();
        let (harmonics, start) = (harmonics.to_vec(), start.map(<[f64]>::to_vec));
        Ok(Basis {
            harmonics,
            ends,
            start,
            map,
            offset,
        })
    }

    /// Free numbers per joint, `m`.
    pub fn free(&self) -> usize {
        self.map.ncols()
    }

    /// Number of joints.
    pub fn dof(&self) -> usize {
        self.offset.len()
    }

    /// Free numbers of all joints, `m · dof`.
    pub fn len(&self) -> usize {
        self.free() * self.dof()
    }

    /// Never true for a basis made by [`Basis::new`].
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Coefficients of joint `j`: `offset_j + map x_j`.
    ///
    /// # Panics
    /// If `x_j` does not have [`Basis::free`] entries or there is no joint `j`.
    pub fn coefficients(&self, j: usize, x_j: &[f64]) -> DVector<f64> {
        let mut out = self.offset[j].clone();
        out.gemv(
            1.0,
            &self.map,
            &nalgebra::DVectorView::from_slice(x_j, x_j.len()),
            1.0,
        );
        out
    }

    /// The free numbers whose coefficients are nearest (in the scaling of the basis) to the given
    /// ones of joint `j`; exactly the inverse of [`Basis::coefficients`] where the end conditions
    /// hold: `x = (D⁻¹ map)ᵀ D⁻¹ (c − offset)`.
    ///
    /// # Panics
    /// If there are not `2H + 1` coefficients or there is no joint `j`.
    pub fn parameters(&self, j: usize, coefficients: &[f64]) -> DVector<f64> {
        let scale = scaling(&self.harmonics);
        assert_eq!(
            coefficients.len(),
            scale.len(),
            "2H + 1 coefficients expected"
        );
        let z = DVector::from_fn(scale.len(), |k, _| {
            (coefficients[k] - self.offset[j][k]) / (scale[k] * scale[k])
        });
        self.map.tr_mul(&z)
    }

    /// Takes the last rounding out of the coefficients of joint `j`: the lowest harmonic (and the
    /// constant, for a fixed start) absorbs what is left in the end conditions, summed in twofold
    /// precision, so that they hold to half a unit in the last place of one coefficient.
    ///
    /// # Panics
    /// If there are not `2H + 1` coefficients or there is no joint `j`.
    pub fn clean(&self, j: usize, coefficients: &mut [f64]) {
        let count = self.harmonics.len();
        assert_eq!(
            coefficients.len(),
            2 * count + 1,
            "2H + 1 coefficients expected"
        );
        let (constant, rest) = coefficients.split_at_mut(1);
        let (sin, cos) = rest.split_at_mut(count);
        if self.ends == Ends::Rest {
            for (values, power) in [(sin, 1), (&mut *cos, 2)] {
                let weight = |h: u32| f64::from(h).powi(power);
                for _ in 0..2 {
                    let left = dot2(self.harmonics.iter().map(|&h| weight(h)), values);
                    values[0] -= left / weight(self.harmonics[0]);
                }
            }
        }
        if let Some(posture) = &self.start {
            constant[0] = posture[j] - dot2(std::iter::repeat(1.0), cos);
        }
    }

    /// The motion of the free numbers `x` (joint after joint, [`Basis::len`] of them), cleaned.
    ///
    /// # Panics
    /// If `x` has another length.
    pub fn fourier(&self, period: f64, x: &[f64]) -> Fourier {
        assert_eq!(x.len(), self.len(), "m free numbers per joint expected");
        let joints = x
            .chunks_exact(self.free())
            .enumerate()
            .map(|(j, x_j)| {
                let mut c = self.coefficients(j, x_j);
                self.clean(j, c.as_mut_slice());
                Series::from_coefficients(c.as_slice())
            })
            .collect();
        Fourier {
            period,
            harmonics: self.harmonics.clone(),
            joints,
        }
    }
}

/// Diagonal of `D`: 1 for the constant, `1/h` for the sine and the cosine of harmonic `h`.
fn scaling(harmonics: &[u32]) -> Vec<f64> {
    let inverse = harmonics.iter().map(|&h| 1.0 / f64::from(h));
    std::iter::once(1.0)
        .chain(inverse.clone())
        .chain(inverse)
        .collect()
}

/// Orthonormal null space of a few conditions by Householder reflections. Every condition comes
/// with the row it is reflected to; rows outside a condition's support stay untouched, so sines
/// and cosines are not mixed.
fn null_space(size: usize, mut conditions: Vec<(usize, DVector<f64>)>) -> DMatrix<f64> {
    let mut reflections: Vec<DVector<f64>> = Vec::new();
    let mut used = Vec::new();
    let reflect = |v: &DVector<f64>, x: &mut DVector<f64>| {
        let factor = -2.0 * v.dot(x) / v.norm_squared();
        x.axpy(factor, v, 1.0);
    };
    for (pivot, a) in &mut conditions {
        reflections.iter().for_each(|v| reflect(v, a));
        used.iter().for_each(|&k: &usize| a[k] = 0.0);
        let mut v = a.clone();
        v[*pivot] += a.norm().copysign(a[*pivot]);
        reflections.push(v);
        used.push(*pivot);
    }
    let free: Vec<usize> = (0..size).filter(|k| !used.contains(k)).collect();
    let columns: Vec<DVector<f64>> = free
        .iter()
        .map(|&k| {
            let mut x = DVector::zeros(size);
            x[k] = 1.0;
            reflections.iter().rev().for_each(|v| reflect(v, &mut x));
            x
        })
        .collect();
    DMatrix::from_columns(&columns)
}

/// Dot product in twofold working precision (Ogita, Rump & Oishi 2005, algorithm 5.3).
fn dot2(weights: impl Iterator<Item = f64>, values: &[f64]) -> f64 {
    let (mut sum, mut low) = (0.0f64, 0.0f64);
    for (w, &v) in weights.zip(values) {
        let product = w * v;
        let error = w.mul_add(v, -product);
        let next = sum + product;
        let back = next - sum;
        low += (sum - (next - back)) + (product - back) + error;
        sum = next;
    }
    sum + low
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory::Grid;
    use proptest::prelude::*;

    fn residual(f: &Fourier) -> [f64; 3] {
        let mut worst = [0.0f64; 3];
        for s in &f.joints {
            let weight = |p: i32| f.harmonics.iter().map(move |&h| f64::from(h).powi(p));
            worst[0] = worst[0].max(dot2(weight(1), &s.sin).abs());
            worst[1] = worst[1].max(dot2(weight(2), &s.cos).abs());
        }
        worst
    }

    proptest! {
        #[test]
        fn ends_hold_to_rounding(
            count in 2usize..40, seed in any::<u64>(), grid in 0usize..3, fixed in any::<bool>(),
            x in proptest::collection::vec(-3.0..3.0f64, 3 * 81),
        ) {
            let harmonics = Grid::ALL[grid].harmonics(count, seed);
            let posture = [0.3, -1.7, 2.0];
            let start = fixed.then_some(&posture[..]);
            let basis = Basis::new(&harmonics, Ends::Rest, 3, start).unwrap();
            prop_assert_eq!(basis.free(), 2 * count - 1 - usize::from(fixed));
            let x = &x[..basis.len()];
            // before cleaning: rounding of the matrix product
            for (j, x_j) in x.chunks(basis.free()).enumerate() {
                let series = Series::from_coefficients(basis.coefficients(j, x_j).as_slice());
                let raw = Fourier { period: 1.0, harmonics: harmonics.clone(), joints: vec![series] };
                let size = f64::from(*harmonics.last().unwrap()) * 3.0 * count as f64;
                prop_assert!(residual(&raw)[0] < 1e-14 * size && residual(&raw)[1] < 1e-14 * size);
                // and the inverse
                let back = basis.parameters(j, &raw.joints[0].coefficients());
                let far = back.iter().zip(x_j).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                prop_assert!(far < 1e-12);
            }
            let f = basis.fourier(1.0, x);
            let left = residual(&f);
            prop_assert!(left[0] < 1e-14 && left[1] < 1e-14, "{:?}", left);
            let [mut q, mut qd, mut qdd] = [[0.0; 3]; 3];
            f.evaluate(7.0, [&mut q, &mut qd, &mut qdd]);
            for j in 0..3 {
                prop_assert!(qd[j].abs() < 1e-11 && qdd[j].abs() < 1e-8);
                prop_assert!(!fixed || (q[j] - posture[j]).abs() < 1e-14 * 3.0 * count as f64);
            }
        }
    }

    #[test]
    fn columns_are_orthonormal_in_the_scaling_and_keep_sine_and_cosine_apart() {
        for (ends, start) in [
            (Ends::Free, None),
            (Ends::Free, Some(&[0.5][..])),
            (Ends::Rest, Some(&[0.5][..])),
        ] {
            let harmonics = [1, 3, 4, 9];
            let basis = Basis::new(&harmonics, ends, 1, start).unwrap();
            let mut z = basis.map.clone();
            for (k, d) in scaling(&harmonics).into_iter().enumerate() {
                z.row_mut(k).scale_mut(1.0 / d);
            }
            let gram = z.tr_mul(&z) - DMatrix::identity(basis.free(), basis.free());
            assert!(gram.amax() < 1e-15 * 8.0);
            for column in z.column_iter() {
                let (sin, cos) = (column.rows(1, 4).norm(), column.rows(5, 4).norm());
                assert!(sin == 0.0 || (cos == 0.0 && column[0] == 0.0));
            }
        }
    }

    #[test]
    fn free_ends_give_every_coefficient() {
        let basis = Basis::new(&[1, 2], Ends::Free, 2, None).unwrap();
        assert_eq!((basis.free(), basis.len()), (5, 10));
    }

    #[test]
    fn unusable_arguments() {
        let fails = |r: Result<Basis>| r.unwrap_err().to_string();
        assert!(fails(Basis::new(&[1], Ends::Rest, 1, None)).contains("at least 2, or free ends"));
        assert!(fails(Basis::new(&[], Ends::Free, 1, None)).contains("at least 1"));
        assert!(fails(Basis::new(&[2, 2], Ends::Free, 1, None)).contains("increasing"));
        assert!(fails(Basis::new(&[1, 2], Ends::Rest, 0, None)).contains("one joint"));
        assert!(fails(Basis::new(&[1, 2], Ends::Rest, 2, Some(&[0.0]))).contains("1 values"));
        assert!(fails(Basis::new(&[1, 2], Ends::Rest, 1, Some(&[f64::NAN]))).contains("finite"));
        assert_eq!("free".parse::<Ends>().unwrap(), Ends::Free);
        assert!("open".parse::<Ends>().is_err());
    }
}
