//! Weights from the residuals: the spread of each actuator as a function of its speed, iterated.

use super::fitted::rms;
use super::solver::{Solution, Solver};
use super::ten::point_mass;
use crate::error::Result;
use crate::load::settings::{Parameters, Settings};
use crate::load::system::{Part, System};
use crate::load::weight::Spread;
use crate::plant::Plant;
use faer::Mat;

/// Rounds of reweighting.
const ROUNDS: usize = 10;

/// Change of the load's parameters, relative, at which reweighting ends.
const SETTLED: f64 = 1e-8;

/// Standard deviation of each actuator's torque that the first weights take: the stated noise, or a hundredth
/// of the torque.
pub fn first_noise(plant: &Plant, system: &System) -> Vec<f64> {
    plant
        .actuators()
        .iter()
        .enumerate()
        .map(|(a, joint)| {
            joint.torque_noise.unwrap_or_else(|| {
                let rows = |p: &Part| p.torque[a * p.count..(a + 1) * p.count].to_vec();
                let all: Vec<f64> = system.parts.iter().flat_map(rows).collect();
                (rms(&all) * 0.01).max(1e-12)
            })
        })
        .collect()
}

/// Share of the torque below which what is left of it is rounding.
const EXACT: f64 = 1e-9;

/// A fit: what was solved, with which spreads, and what it gave.
pub struct Fit<'a> {
    pub solver: Solver<'a>,
    pub solution: Solution,
    pub covariance: Mat<f64>,
    pub spreads: Vec<Spread>,
}

impl<'a> Fit<'a> {
    /// Weights until they settle, then the Stribeck speeds with all else.
    ///
    /// # Errors
    /// Signals that are not finite.
    pub fn new(mut solver: Solver<'a>, noise: &[f64], settings: &Settings) -> Result<Self> {
        let (solution, spreads) = reweighted(&mut solver, noise, settings)?;
        let (solution, covariance) = completed(&mut solver, solution, &spreads, settings)?;
        Ok(Fit {
            solver,
            solution,
            covariance,
            spreads,
        })
    }

    /// Whether what is left is rounding: no sensor is that good.
    pub fn exact(&self) -> bool {
        let parts = &self.solver.system.parts;
        let left = parts.iter().zip(&self.solution.residual);
        left.into_iter()
            .all(|(part, left)| rms(left) <= EXACT * rms(&part.torque))
    }

    /// Standard deviation of row `i` of record `p`.
    pub fn deviation(&self, p: usize, i: usize) -> f64 {
        deviation(self.solver.system, &self.spreads, p, i)
    }
}

/// Standard deviation of row `i` of record `p`.
fn deviation(system: &System, spreads: &[Spread], p: usize, i: usize) -> f64 {
    let part = &system.parts[p];
    spreads[i / part.count].variance(part.speed[i]).sqrt()
}

/// Spread of the residual of an actuator.
fn spread(system: &System, s: &Solution, a: usize, least: f64, weighted: bool) -> Spread {
    let (mut r, mut v) = (Vec::new(), Vec::new());
    for (part, rest) in system.parts.iter().zip(&s.residual) {
        r.extend_from_slice(&rest[a * part.count..(a + 1) * part.count]);
        v.extend_from_slice(&part.speed[a * part.count..(a + 1) * part.count]);
    }
    match weighted {
        true => Spread::fit(&r, &v, least),
        false => Spread::even(rms(&r).max(least)),
    }
}

/// Solves with weights from the residuals of the solution before, until the load no longer changes.
///
/// # Errors
/// Signals that are not finite.
fn reweighted(
    solver: &mut Solver,
    noise: &[f64],
    settings: &Settings,
) -> Result<(Solution, Vec<Spread>)> {
    let system = solver.system;
    let load = system.deviations.len()..system.deviations.len() + solver.load.len();
    let mut spreads: Vec<Spread> = noise.iter().map(|&n| Spread::even(n)).collect();
    let mut solution = solver.solve(&|p, i| deviation(system, &spreads, p, i))?;
    for _ in 0..ROUNDS {
        let before = solution.values.clone();
        if settings.weighted {
            let noise: Vec<f64> = spreads.iter().map(|s| s.floor).collect();
            solver.find_peaks(&solution, &noise);
        }
        if settings.parameters == Parameters::MassCom {
            point_mass(solver, &solution.values[load.clone()]);
        }
        for (a, s) in spreads.iter_mut().enumerate() {
            *s = spread(system, &solution, a, 1e-9 * noise[a], settings.weighted);
        }
        solution = solver.solve(&|p, i| deviation(system, &spreads, p, i))?;
        let change = load
            .clone()
            .map(|c| (solution.values[c] - before[c]).abs() / solution.values[c].abs().max(1e-9))
            .fold(0.0f64, f64::max);
        if change < SETTLED {
            break;
        }
    }
    Ok((solution, spreads))
}

/// Rounds in which the Stribeck speeds settle.
const SPEEDS: usize = 4;

/// Largest Stribeck force that a machine ordinarily has, in Coulomb forces: its standard deviation before the records are
/// seen.
const STICKING: f64 = 2.0;

/// Solves once more with the Stribeck speeds as unknowns. The covariance of all columns counts them, and what residuals
/// that are not white are worth.
///
/// # Errors
/// Signals that are not finite.
fn completed(
    solver: &mut Solver,
    first: Solution,
    spreads: &[Spread],
    settings: &Settings,
) -> Result<(Solution, Mat<f64>)> {
    let system = solver.system;
    let load = system.deviations.len()..system.deviations.len() + solver.load.len();
    let mut solution = first;
    for a in 0..system.actuators {
        let dry = (0..system.parts.len())
            .map(|p| solver.friction_of(&solution, p, a)[0].abs())
            .fold(0.0f64, f64::max);
        solver.breakaway[a] = STICKING * dry.max(spreads[a].floor);
    }
    let deviation = |p, i| deviation(system, spreads, p, i);
    for round in 0..SPEEDS {
        if settings.parameters == Parameters::MassCom {
            point_mass(solver, &solution.values[load.clone()]);
        }
        if settings.weighted {
            solver.linearise(&solution);
        }
        if round + 1 < SPEEDS {
            solution = solver.solve(&deviation)?;
        }
    }
    solver.solve_coloured(&deviation)
}
