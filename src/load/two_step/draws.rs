//! Standard deviations of the two steps: what they would find if what is left of the forces had come out otherwise.
//!
//! Neither step knows what the one before got wrong: the friction that was taken off, the centre of mass that the second
//! step takes from the first, noise in the first column of `X₁`. So the whole chain is repeated: friction fit, both steps,
//! loaded minus empty. Its forces get draws of noise that has the power over frequency of what the fit of each
//! record leaves (`one_step::spectrum`) and grows towards standstill as that does, so what is left counts as
//! autocorrelated as it is. Records of one motion share what comes back in both (friction that the fit has no term for), and
//! the load is their difference: their draws have the coherence that their residuals have. The covariance is the mean
//! square about the estimate: where noise moves the mean, as it does that of `1/m`, the shift is in it.

use super::{PlatformSample, Total, total};
use crate::error::Result;
use crate::load::one_step::{Rest, Solver, of_rows, rms};
use crate::load::weight::Spread;
use crate::robot::Inertia;
use faer::Mat;
use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Draws: a standard deviation is then known to 6 %.
const DRAWS: usize = 150;

/// Seed of the draws.
const SEED: u64 = 0x2517;

/// Difference of the speeds of two records, relative, up to which their motion is the same.
const SAME: f64 = 0.05;

/// What is left of the forces of a record.
struct Left {
    /// velocities of the actuators
    speed: Vec<f64>,
    /// by actuator
    rests: Vec<Rest>,
    /// number of the record, which its draws follow from
    record: u64,
    /// whether its draws follow from those of another record, too
    follows: bool,
}

impl Left {
    fn same_motion(&self, speed: &[f64]) -> bool {
        let square = |of: &mut dyn Iterator<Item = f64>| of.map(|v| v * v).sum::<f64>();
        let pairs = self.speed.iter().zip(speed);
        self.speed.len() == speed.len()
            && square(&mut pairs.map(|(a, b)| a - b))
                <= SAME.powi(2) * square(&mut speed.iter().copied())
    }
}

/// Normal random numbers of a record, in the order of draws, actuators and rows.
struct Normals(ChaCha8Rng);

impl Normals {
    fn of(record: u64) -> Self {
        Normals(ChaCha8Rng::seed_from_u64(SEED + record))
    }

    /// Box and Muller.
    fn next(&mut self) -> f64 {
        let u: f64 = self.0.random_range(f64::MIN_POSITIVE..1.0);
        let v: f64 = self.0.random();
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }
}

/// One record, ready to be evaluated for other forces.
pub struct Chain {
    /// as measured, friction taken off
    pub samples: Vec<PlatformSample>,
    /// force and moment of a unit force of each actuator
    unit: Vec<Vec<[Vector3<f64>; 2]>>,
    /// disturbance of the forces in each draw, friction taken off once more
    draws: Vec<Vec<f64>>,
    left: Left,
}

impl Chain {
    /// From the samples, the wrenches of unit forces of each actuator, those without any force, and the fit of friction.
    /// `before`: records that came before.
    ///
    /// # Errors
    /// Signals that are not finite.
    pub fn new(
        samples: Vec<PlatformSample>,
        none: &[PlatformSample],
        unit: &[Vec<PlatformSample>],
        solver: &Solver,
        record: u64,
        before: &[&Chain],
    ) -> Result<Self> {
        let part = &solver.system.parts[0];
        let (rows, n) = (part.y.len(), part.count);
        // the residual is larger near standstill, where the steps give no weight; power is that of its rest
        let left = solver.solve(&|_, _| 1.0)?;
        let spreads: Vec<Spread> = (0..solver.system.actuators)
            .map(|a| {
                let own = a * n..(a + 1) * n;
                let e = &left.residual[0][own.clone()];
                Spread::fit(e, &part.speed[own], 1e-9 * rms(e))
            })
            .collect();
        let deviation = |i: usize| {
            let variance = spreads[i / n].variance(part.speed[i]);
            variance.sqrt().max(f64::MIN_POSITIVE)
        };
        let rests = solver.left(&|_, i| deviation(i))?;
        let power: Vec<Vec<f64>> = rests.iter().map(Rest::power).collect();
        let first = before.iter().map(|c| &c.left);
        let first = { first }.find(|l| !l.follows && l.same_motion(&part.speed));
        let mut common = first.map(|first| {
            let pairs = first.rests.iter().zip(&rests);
            let coherence: Vec<Vec<f64>> = pairs.map(|(one, other)| one.coherence(other)).collect();
            (Normals::of(first.record), coherence)
        });
        let mut own = Normals::of(record);
        let mut noise = Mat::<f64>::zeros(rows, DRAWS);
        for k in 0..DRAWS {
            for (a, power) in power.iter().enumerate() {
                let drawn: Vec<f64> = { power.iter().enumerate() }
                    .map(|(i, power)| {
                        let z = own.next();
                        let z = match &mut common {
                            Some((first, coherence)) => {
                                let c = coherence[a][i];
                                c * first.next() + (1.0 - c * c).sqrt() * z
                            }
                            None => z,
                        };
                        power.sqrt() * z
                    })
                    .collect();
                for (i, e) in of_rows(&drawn).into_iter().enumerate() {
                    noise[(a * n + i, k)] = deviation(a * n + i) * e;
                }
            }
        }
        let answer = solver.respond(&noise);
        let draws = (0..DRAWS)
            .map(|k| {
                let values: Vec<f64> = (0..answer.nrows()).map(|c| answer[(c, k)]).collect();
                (0..rows)
                    .map(|i| noise[(i, k)] - solver.friction_at(&values, 0, i))
                    .collect()
            })
            .collect();
        let unit = unit
            .iter()
            .map(|u| {
                let pairs = u.iter().zip(none);
                pairs
                    .map(|(u, o)| [u.force - o.force, u.moment - o.moment])
                    .collect()
            })
            .collect();
        Ok(Chain {
            samples,
            unit,
            draws,
            left: Left {
                speed: part.speed.clone(),
                rests,
                record,
                follows: common.is_some(),
            },
        })
    }

    /// The samples of a draw.
    fn drawn(&self, k: usize) -> Vec<PlatformSample> {
        let n = self.samples.len();
        let mut out = self.samples.clone();
        for (a, unit) in self.unit.iter().enumerate() {
            for (i, (sample, [force, moment])) in out.iter_mut().zip(unit).enumerate() {
                let e = self.draws[k][a * n + i];
                sample.force += force * e;
                sample.moment += moment * e;
            }
        }
        out
    }
}

/// Everything that moves with the platform, from all samples of these records; of a draw, or as measured.
fn together(chains: &[Chain], draw: Option<usize>, gravity: &Vector3<f64>) -> Result<Total> {
    let samples: Vec<PlatformSample> = chains
        .iter()
        .flat_map(|c| match draw {
            Some(k) => c.drawn(k),
            None => c.samples.clone(),
        })
        .collect();
    total(&samples, gravity)
}

/// Totals of the loaded and, where there are any, of the empty records.
///
/// # Errors
/// As [`total`].
pub fn totals(
    full: &[Chain],
    empty: &[Chain],
    gravity: &Vector3<f64>,
) -> Result<(Total, Option<Total>)> {
    let all = together(full, None, gravity)?;
    let platform = match empty.is_empty() {
        true => None,
        false => Some(together(empty, None, gravity)?),
    };
    Ok((all, platform))
}

/// Mean square of the ten parameters of the load about the estimate.
pub fn covariance(
    full: &[Chain],
    empty: &[Chain],
    gravity: &Vector3<f64>,
    found: &[f64; 10],
    platform: &[f64; 10],
) -> Mat<f64> {
    let one = |k: usize| -> Option<[f64; 10]> {
        let all = Inertia::from_quantities(&together(full, Some(k), gravity).ok()?.values).0;
        let other = match empty.is_empty() {
            true => *platform,
            false => Inertia::from_quantities(&together(empty, Some(k), gravity).ok()?.values).0,
        };
        Some(std::array::from_fn(|i| all[i] - other[i] - found[i]))
    };
    let away: Vec<[f64; 10]> = (0..DRAWS).into_par_iter().filter_map(one).collect();
    let count = away.len().max(1) as f64;
    // draws that have no solution at all say that nothing is known
    let lost = DRAWS as f64 / count;
    Mat::from_fn(10, 10, |i, j| {
        lost * lost * away.iter().map(|d| d[i] * d[j]).sum::<f64>() / count
    })
}
