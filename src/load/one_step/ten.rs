//! The ten parameters of the load: which of them the drives feel, and a point mass where only four are asked.

use super::solver::{Solution, Solver};
use crate::error::{Error, Result};
use crate::load::settings::Parameters;
use crate::load::system::System;
use crate::robot::Inertia;
use crate::robot::inertia::NAMES;
use faer::Mat;
use nalgebra::{Matrix3, Vector3};

/// The parameters that are estimated: base parameters of the load's ten columns.
///
/// # Errors
/// A load that no drive feels.
pub fn unknowns(system: &System, parameters: Parameters) -> Result<Vec<usize>> {
    let kept = system.base.kept.iter().copied();
    let kept: Vec<usize> = match parameters {
        Parameters::Full => kept.collect(),
        Parameters::MassCom => kept.filter(|&k| k < 4).collect(),
    };
    if kept.is_empty() {
        return Err(Error::Infeasible(
            "no parameter of the load acts on the drives of this robot".into(),
        ));
    }
    Ok(kept)
}

/// Values of the ten and their covariance, zero where they are not estimated; `covariance` is that of all
/// columns.
pub fn values(
    solver: &Solver,
    solution: &Solution,
    covariance: &Mat<f64>,
) -> ([f64; 10], Mat<f64>) {
    let first = solver.system.deviations.len();
    let mut phi = [0.0; 10];
    let mut ten = Mat::<f64>::zeros(10, 10);
    for (c, &k) in solver.load.iter().enumerate() {
        phi[k] = solution.values[first + c];
        for (d, &l) in solver.load.iter().enumerate() {
            ten[(k, l)] = covariance[(first + c, first + d)];
        }
    }
    (phi, ten)
}

/// Deviations of the platform of a closed chain, zero where they are not estimated.
pub fn platform(system: &System, solution: &Solution) -> [f64; 10] {
    let value = |name: &str| {
        let at = system
            .deviations
            .iter()
            .position(|d| d.strip_prefix("platform.") == Some(name));
        at.map_or(0.0, |c| solution.values[c])
    };
    NAMES.map(value)
}

/// Which of the ten are known by themselves, and why the others are not.
pub fn known(system: &System) -> ([bool; 10], Vec<String>) {
    let mut known = [false; 10];
    let mut unknown = Vec::new();
    for k in 0..10 {
        match system.base.kept.iter().position(|&x| x == k) {
            Some(row) => {
                let grouped = (0..system.base.dropped.len())
                    .filter(|&d| system.base.k[(row, d)].abs() > 1e-9)
                    .map(|d| NAMES[system.base.dropped[d]])
                    .collect::<Vec<_>>();
                known[k] = grouped.is_empty();
                if !grouped.is_empty() {
                    let name = NAMES[k];
                    unknown.push(format!("{name} only together with {}", grouped.join(", ")));
                }
            }
            None => unknown.push(format!("{} does not act alone", NAMES[k])),
        }
    }
    (known, unknown)
}

/// The ten parameters of a point mass with the first four: the tensor about the origin follows from them.
pub fn point(phi: &[f64; 10]) -> Inertia {
    let m = phi[0];
    let c = match m.abs() > 1e-12 {
        true => Vector3::new(phi[1], phi[2], phi[3]) / m,
        false => Vector3::zeros(),
    };
    Inertia::from_com(m, c, Matrix3::zeros())
}

/// Subtracts what the tensor of a point mass makes of the torques of loaded records; `values` are those of the
/// estimated parameters.
pub fn point_mass(solver: &mut Solver, values: &[f64]) {
    let mut phi = [0.0; 10];
    for (&k, &v) in solver.load.iter().zip(values) {
        phi[k] = v;
    }
    let load = point(&phi);
    for (part, shift) in solver.system.parts.iter().zip(&mut solver.shift) {
        if part.loaded {
            *shift = (0..part.y.len())
                .map(|i| (4..10).map(|k| part.tool[(i, k)] * load.0[k]).sum())
                .collect();
        }
    }
}

/// Condition number of the columns of the load with everything else projected out, scaled.
pub fn condition(r: &Mat<f64>, first: usize, count: usize) -> f64 {
    let n = r.ncols();
    // the columns of the load last: another QR of R with its columns in that order
    let order: Vec<usize> = (0..first)
        .chain(first + count..n)
        .chain(first..first + count)
        .collect();
    let turned = Mat::from_fn(n, n, |i, j| r[(i, order[j])]);
    let r = turned.qr().thin_R().to_owned();
    let from = n - count;
    let block = Mat::from_fn(count, count, |i, j| r[(from + i, from + j)]);
    let unit = Mat::from_fn(count, count, |i, j| {
        block[(i, j)] / block.col(j).norm_l2().max(f64::MIN_POSITIVE)
    });
    match unit.singular_values() {
        Ok(s) if s[count - 1] > 0.0 => s[0] / s[count - 1],
        _ => f64::INFINITY,
    }
}
