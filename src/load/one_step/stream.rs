//! Recursive weighted least squares: the load as it becomes known, block by block.
//!
//! A block is a period of a record, or a stretch of one that does not repeat. The square root of the information is
//! carried along: with the rows `A_k`, `y_k` of a block over their standard deviations,
//!
//! ```text
//! [ R_k  d_k ]        [ R_{k−1}  d_{k−1} ]
//! [ 0     *  ] = Qᵀ · [ A_k      y_k     ]        β_k = R_k⁻¹ d_k      C_k = R_k⁻¹ R_k⁻ᵀ
//! ```
//!
//! so that the last block gives what the fit of all rows gives (but for the mean over walks of the constants, of which one
//! counts here). Weights, Stribeck speeds and how far the constant forces
//! may walk are those that all records have told: a trace of the information, not a rehearsal of ignorance. The standard
//! deviations are those of white rows times the factor by which those of the whole fit exceed them.

use super::solver::{Solution, Solver};
use super::ten;
use super::zeros::Decision;
use crate::error::Result;
use crate::load::body::LoadBody;
use crate::load::system::Part;
use crate::load::weight::Spread;
use crate::robot::Inertia;
use crate::robot::inertia::Quantities;
use faer::Mat;

/// Blocks of a record that does not repeat.
const BLOCKS: usize = 12;
/// Least change of a constant force that counts as one, in standard deviations of a row: shared ones are equal.
const SAME: f64 = 1e-4;

/// The load after a block.
#[derive(Debug, Clone)]
pub struct Step {
    /// record of the block
    pub record: String,
    /// motion of all records so far, s
    pub seconds: f64,
    /// mass, centre of mass, tensor about it
    pub values: Quantities,
    /// their standard deviations
    pub stds: Quantities,
}

/// Rows of a block: of which record, from which sample to which, its torques, and how many times the variance of a row.
struct Block<'a> {
    part: usize,
    samples: std::ops::Range<usize>,
    torque: &'a [f64],
    variance: f64,
    seconds: f64,
}

fn blocks(p: usize, part: &Part) -> Vec<Block<'_>> {
    let step = part.step();
    if part.periods.len() > 1 {
        let variance = part.periods.len() as f64;
        return part
            .periods
            .iter()
            .map(|torque| Block {
                part: p,
                samples: 0..part.count,
                torque,
                variance,
                seconds: step * part.count as f64,
            })
            .collect();
    }
    let size = part.count.div_ceil(BLOCKS).max(1);
    (0..part.count.div_ceil(size))
        .map(|k| {
            let samples = k * size..((k + 1) * size).min(part.count);
            Block {
                part: p,
                torque: &part.y,
                variance: 1.0,
                seconds: step * samples.len() as f64,
                samples,
            }
        })
        .collect()
}

/// The load after every block of the loaded records; those of the empty robot come first, whatever their order.
/// `whole` is the load of the fit of all rows.
///
/// # Errors
/// Numbers that are not finite.
pub fn stream(
    solver: &Solver,
    s: &Solution,
    zeros: &[Decision],
    spreads: &[Spread],
    whole: &LoadBody,
) -> Result<Vec<Step>> {
    let system = solver.system;
    let (na, n) = (system.actuators, s.values.len());
    let norms: Vec<f64> = (0..n).map(|c| s.r.col(c).norm_l2()).collect();
    let ridge = solver.ridge(&norms);
    let mut r = Mat::from_fn(n, n, |i, j| if i == j { ridge[i] } else { 0.0 });
    let mut d = Mat::<f64>::zeros(n, 1);
    let walks: Vec<(usize, usize, f64)> = zeros
        .iter()
        .enumerate()
        .filter_map(|(a, z)| Some((a, z.drift?.max(SAME * spreads[a].floor))))
        .flat_map(|(a, drift)| {
            (1..system.parts.len())
                .map(move |p| (solver.offset(p - 1, a), solver.offset(p, a), 1.0 / drift))
        })
        .collect();
    let mut a = Mat::<f64>::zeros(walks.len(), n);
    for (row, (from, to, w)) in walks.iter().enumerate() {
        a[(row, *from)] = -w;
        a[(row, *to)] = *w;
    }
    update(&mut r, &mut d, &a, &Mat::zeros(walks.len(), 1));
    let order =
        |loaded: bool| (0..system.parts.len()).filter(move |&p| system.parts[p].loaded == loaded);
    let mut seconds = 0.0;
    let mut out = Vec::new();
    for p in order(false).chain(order(true)) {
        let part = &system.parts[p];
        for block in blocks(p, part) {
            let m = block.samples.len();
            let mut a = Mat::<f64>::zeros(na * m, n);
            let mut y = Mat::<f64>::zeros(na * m, 1);
            for j in 0..na {
                for (k, sample) in block.samples.clone().enumerate() {
                    let (row, i) = (j * m + k, j * part.count + sample);
                    let w = 1.0 / (block.variance * spreads[j].variance(part.speed[i])).sqrt();
                    solver.row(block.part, part, i, &mut |c, v| a[(row, c)] = w * v);
                    let shift = solver.shift[p].get(i).copied().unwrap_or(0.0);
                    y[(row, 0)] = w * (block.torque[i] - shift);
                }
            }
            update(&mut r, &mut d, &a, &y);
            seconds += block.seconds;
            if part.loaded {
                let body = load(solver, &r, &d, whole)?;
                out.push(Step {
                    record: part.name.clone(),
                    seconds,
                    values: body.values(),
                    stds: body.stds(),
                });
            }
        }
    }
    if let Some(last) = out.last().map(|s| s.stds) {
        let factor: Quantities = std::array::from_fn(|k| match last[k] > 0.0 {
            true => whole.stds()[k] / last[k],
            false => 1.0,
        });
        for step in &mut out {
            step.stds.iter_mut().zip(factor).for_each(|(s, f)| *s *= f);
        }
    }
    Ok(out)
}

/// Takes rows into the square root of the information.
fn update(r: &mut Mat<f64>, d: &mut Mat<f64>, a: &Mat<f64>, y: &Mat<f64>) {
    let (n, m) = (r.nrows(), a.nrows());
    let both = Mat::from_fn(n + m, n + 1, |i, j| match (i < n, j < n) {
        (true, true) => r[(i, j)],
        (true, false) => d[(i, 0)],
        (false, true) => a[(i - n, j)],
        (false, false) => y[(i - n, 0)],
    });
    let next = both.qr().thin_R().to_owned();
    *r = Mat::from_fn(n, n, |i, j| if j >= i { next[(i, j)] } else { 0.0 });
    *d = Mat::from_fn(n, 1, |i, _| next[(i, n)]);
}

/// The load that the information gives.
fn load(solver: &Solver, r: &Mat<f64>, d: &Mat<f64>, whole: &LoadBody) -> Result<LoadBody> {
    let n = r.nrows();
    let mut both = Mat::from_fn(n, n + 1, |i, j| match j {
        0 => d[(i, 0)],
        _ if i + 1 == j => 1.0,
        _ => 0.0,
    });
    faer::linalg::triangular_solve::solve_upper_triangular_in_place(
        r.as_ref(),
        both.as_mut(),
        faer::Par::Seq,
    );
    let values = Solution {
        values: (0..n).map(|i| both[(i, 0)]).collect(),
        residual: Vec::new(),
        r: Mat::zeros(0, 0),
    };
    let inverse = both.subcols(1, n);
    let covariance = inverse * inverse.transpose();
    let (phi, ten) = ten::values(solver, &values, &covariance);
    let phi = match whole.known[4..].iter().any(|k| *k) || solver.load.iter().any(|k| *k > 3) {
        true => Inertia(phi),
        false => ten::point(&phi),
    };
    LoadBody::new(phi, ten, whole.known, false)
}
