//! All parameters of the load at once, by weighted least squares over the actuators.

use super::body::LoadBody;
use super::system::{Part, System};
use super::weight::{Spread, inflation};
use super::{Loaded, Parameters, Settings};
use crate::error::{Error, Result, Warning, WarningKind};
use crate::log::Payload;
use crate::plant::Plant;
use crate::robot::Inertia;
use faer::Mat;
use faer::linalg::solvers::{DenseSolveCore, SolveLstsq};
use nalgebra::{Matrix3, Vector3};

/// Friction of one actuator in one record.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct JointFriction {
    /// Coulomb, N m or N
    pub coulomb: f64,
    /// viscous, N m s/rad or N s/m
    pub viscous: f64,
    /// constant
    pub offset: f64,
    /// what breaking away takes beyond Coulomb friction, N m or N, where the residual shows it
    pub stribeck: Option<f64>,
    /// speed at which that has fallen to `1/e`, rad/s or m/s
    pub stribeck_velocity: Option<f64>,
    /// Coulomb friction of every period, where the motion repeats
    pub coulomb_periods: Vec<f64>,
    /// viscous friction of every period
    pub viscous_periods: Vec<f64>,
}

/// What is left of one actuator's torque in one record.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Residual {
    /// root mean square, N m or N
    pub rms: f64,
    /// over the root mean square of the measured torque
    pub relative: f64,
}

/// One record after the fit, for the report; lists actuator-major.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// name of the record
    pub name: String,
    /// whether it had the load
    pub loaded: bool,
    /// samples
    pub count: usize,
    /// times, s
    pub time: Vec<f64>,
    /// velocities of the actuators
    pub speed: Vec<f64>,
    /// what is left without the load: measured minus model and friction
    pub carried: Vec<f64>,
    /// torque of the load as identified
    pub load: Vec<f64>,
    /// friction of the actuators
    pub friction: Vec<JointFriction>,
    /// what is left
    pub residuals: Vec<Residual>,
}

/// Result of [`estimate`].
#[derive(Debug, Clone)]
pub struct OneStep {
    /// the load
    pub load: LoadBody,
    /// records
    pub records: Vec<Fitted>,
    /// spread of the residual of each actuator
    pub spreads: Vec<Spread>,
    /// condition number of the weighted columns of the load, scaled to unit length
    pub condition: f64,
    /// parameters of the load that cannot be told, with the reason
    pub unknown: Vec<String>,
    /// what was found
    pub warnings: Vec<Warning>,
}

/// Rounds of reweighting.
const ROUNDS: usize = 10;

/// Values of all columns: deviations, load, then friction record by record.
pub(super) struct Solution {
    values: Vec<f64>,
    residual: Vec<Vec<f64>>,
    r: Mat<f64>,
}

/// The system with weights.
pub(super) struct Solver<'a> {
    system: &'a System,
    load: Vec<usize>,
    /// what is subtracted from the torques of loaded records, part by part
    shift: Vec<Vec<f64>>,
    /// Stribeck speed of each actuator, where its residual shows one
    speeds: Vec<Option<f64>>,
    /// Stribeck factors, part by part
    peaks: Vec<Vec<f64>>,
}

/// Friction columns of an actuator in a record: Coulomb, viscous, offset, Stribeck.
const EACH: usize = 4;

impl<'a> Solver<'a> {
    pub(super) fn new(system: &'a System, load: Vec<usize>) -> Self {
        Solver {
            system,
            load,
            shift: vec![Vec::new(); system.parts.len()],
            speeds: vec![None; system.actuators],
            peaks: system.parts.iter().map(|p| vec![0.0; p.y.len()]).collect(),
        }
    }

    fn columns(&self) -> usize {
        let friction = EACH * self.system.actuators * self.system.parts.len();
        self.system.deviations.len() + self.load.len() + friction
    }

    /// First friction column of a record.
    fn friction(&self, part: usize) -> usize {
        self.system.deviations.len() + self.load.len() + EACH * self.system.actuators * part
    }

    fn row(&self, p: usize, part: &Part, i: usize, to: &mut dyn FnMut(usize, f64)) {
        let nd = self.system.deviations.len();
        for c in 0..nd {
            to(c, part.deviation[(i, c)]);
        }
        if part.loaded {
            for (c, &k) in self.load.iter().enumerate() {
                to(nd + c, part.tool[(i, k)]);
            }
        }
        let first = self.friction(p) + EACH * (i / part.count);
        for (f, column) in part.friction.iter().enumerate() {
            to(first + f, column[i]);
        }
        to(first + 3, self.peaks[p][i]);
    }

    /// Looks for Stribeck friction in the residuals: for each actuator the speed `v_s` whose
    /// factor explains most of them, one force a record. It is kept where it explains more than
    /// chance would (BIC).
    fn find_peaks(&mut self, s: &Solution, sigma: &[f64]) {
        for (a, sigma) in sigma.iter().enumerate() {
            // residuals without the Stribeck force found so far
            let rest: Vec<Vec<f64>> = self
                .system
                .parts
                .iter()
                .enumerate()
                .map(|(p, part)| {
                    let force = s.values[self.friction(p) + EACH * a + 3];
                    (a * part.count..(a + 1) * part.count)
                        .map(|i| s.residual[p][i] + force * self.peaks[p][i])
                        .collect()
                })
                .collect();
            let total: f64 = rest.iter().flatten().map(|r| r * r).sum();
            let n: usize = rest.iter().map(Vec::len).sum();
            let explained = |speed: f64| -> f64 {
                self.system
                    .parts
                    .iter()
                    .zip(&rest)
                    .map(|(part, r)| {
                        let b = part.stribeck(a, speed);
                        let bb: f64 = b.iter().map(|x| x * x).sum();
                        let br: f64 = b.iter().zip(r).map(|(x, y)| x * y).sum();
                        if bb > 1e-9 { br * br / bb } else { 0.0 }
                    })
                    .sum()
            };
            let fastest = self
                .system
                .parts
                .iter()
                .flat_map(|p| &p.speed[a * p.count..(a + 1) * p.count])
                .fold(0.0f64, |m, v| m.max(v.abs()));
            // a grid, then the golden section about its best point
            const STEP: f64 = 1.35;
            let grid = (0..15).map(|k| 0.005 * fastest * STEP.powi(k));
            let best = grid
                .map(|v| (explained(v), v))
                .max_by(|x, y| x.0.total_cmp(&y.0));
            let Some((_, centre)) = best.filter(|b| b.0.is_finite() && b.1 > 0.0) else {
                continue;
            };
            let (mut low, mut high) = ((centre / STEP).ln(), (centre * STEP).ln());
            for _ in 0..12 {
                let (u, v) = (low + 0.382 * (high - low), high - 0.382 * (high - low));
                if explained(u.exp()) > explained(v.exp()) {
                    high = v;
                } else {
                    low = u;
                }
            }
            let speed = (0.5 * (low + high)).exp();
            let left = (total - explained(speed)).max(n as f64 * (1e-6 * sigma).powi(2));
            let gain = n as f64 * (total / left).ln();
            let price = 2.0 * (self.system.parts.len() + 1) as f64 * (n as f64).ln();
            self.speeds[a] = (gain > price && total > 0.0).then_some(speed);
        }
        for (p, part) in self.system.parts.iter().enumerate() {
            for (a, speed) in self.speeds.iter().enumerate() {
                let to = &mut self.peaks[p][a * part.count..(a + 1) * part.count];
                match speed {
                    Some(v) => to.copy_from_slice(&part.stribeck(a, *v)),
                    None => to.fill(0.0),
                }
            }
        }
    }

    /// Weighted least squares; `deviation(p, i)` is the standard deviation of row `i` of record `p`.
    pub(super) fn solve(&self, deviation: &dyn Fn(usize, usize) -> f64) -> Result<Solution> {
        let n = self.columns();
        let rows: usize = self.system.parts.iter().map(|p| p.y.len()).sum();
        let mut a = Mat::<f64>::zeros(rows + n, n);
        let mut y = Mat::<f64>::zeros(rows + n, 1);
        let mut r = 0;
        for (p, part) in self.system.parts.iter().enumerate() {
            for i in 0..part.y.len() {
                let w = 1.0 / deviation(p, i);
                self.row(p, part, i, &mut |c, v| a[(r, c)] = w * v);
                let shift = self.shift[p].get(i).copied().unwrap_or(0.0);
                y[(r, 0)] = w * (part.y[i] - shift);
                r += 1;
            }
        }
        // a breath of regularisation for columns that the motion does not tell apart; it changes
        // the others by 1e-18 of themselves
        let mut top = 0.0f64;
        for c in 0..n {
            top = top.max(a.col(c).norm_l2());
        }
        for c in 0..n {
            let norm = a.col(c).norm_l2();
            a[(rows + c, c)] = 1e-9 * if norm > 0.0 { norm } else { top.max(1.0) };
        }
        let qr = a.qr();
        let values: Vec<f64> = {
            let x = qr.solve_lstsq(&y);
            (0..n).map(|c| x[(c, 0)]).collect()
        };
        if values.iter().any(|v| !v.is_finite()) {
            return Err(Error::Infeasible(
                "the least-squares problem of the load has no finite solution: the logs hold \
                 numbers that are not finite, or the robot does not move"
                    .into(),
            ));
        }
        let residual = self
            .system
            .parts
            .iter()
            .enumerate()
            .map(|(p, part)| {
                (0..part.y.len())
                    .map(|i| {
                        let mut rest = part.y[i] - self.shift[p].get(i).copied().unwrap_or(0.0);
                        self.row(p, part, i, &mut |c, v| rest -= values[c] * v);
                        rest
                    })
                    .collect()
            })
            .collect();
        Ok(Solution {
            values,
            residual,
            r: qr.thin_R().to_owned(),
        })
    }

    /// Coulomb, viscous, offset and Stribeck force of an actuator in a record.
    pub(super) fn friction_of(&self, s: &Solution, part: usize, a: usize) -> [f64; EACH] {
        let first = self.friction(part) + EACH * a;
        std::array::from_fn(|f| s.values[first + f])
    }
}

/// Estimates the load of the records with an unknown one.
///
/// # Errors
/// A motion that does not excite the load, or signals that are not finite.
pub fn estimate(
    plant: &Plant,
    tool: usize,
    records: &[Loaded],
    settings: &Settings,
) -> Result<OneStep> {
    let used: Vec<&Loaded> = records
        .iter()
        .filter(|r| !matches!(r.payload, Payload::Known { .. }))
        .collect();
    let empty = used.iter().any(|r| r.payload == Payload::None);
    let system = System::new(plant, tool, &used, empty)?;
    let na = system.actuators;
    let kept: Vec<usize> = match settings.parameters {
        Parameters::Full => system.base.kept.clone(),
        Parameters::MassCom => system
            .base
            .kept
            .iter()
            .copied()
            .filter(|&k| k < 4)
            .collect(),
    };
    if kept.is_empty() {
        return Err(Error::Infeasible(
            "no parameter of the load acts on the drives of this robot".into(),
        ));
    }
    let nd = system.deviations.len();
    let mut solver = Solver::new(&system, kept.clone());

    // first weights: the stated noise, or the size of the torques
    let noise: Vec<f64> = plant
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
        .collect();
    let least: Vec<f64> = noise.iter().map(|n| 1e-9 * n).collect();
    let mut spreads: Vec<Spread> = noise.iter().map(|&n| Spread::even(n)).collect();
    let weigh = |spreads: &[Spread], p: usize, i: usize| {
        let part = &system.parts[p];
        spreads[i / part.count].variance(part.speed[i]).sqrt()
    };
    let mut solution = solver.solve(&|p, i| weigh(&spreads, p, i))?;
    for _ in 0..ROUNDS {
        let before = solution.values.clone();
        if settings.weighted {
            let noise: Vec<f64> = spreads.iter().map(|s| s.floor).collect();
            solver.find_peaks(&solution, &noise);
        }
        if settings.parameters == Parameters::MassCom {
            point_mass(&mut solver, &kept, &solution.values[nd..nd + kept.len()]);
        }
        for (a, spread) in spreads.iter_mut().enumerate() {
            let (mut r, mut v) = (Vec::new(), Vec::new());
            for (part, rest) in system.parts.iter().zip(&solution.residual) {
                r.extend_from_slice(&rest[a * part.count..(a + 1) * part.count]);
                v.extend_from_slice(&part.speed[a * part.count..(a + 1) * part.count]);
            }
            *spread = match settings.weighted {
                true => Spread::fit(&r, &v, least[a]),
                false => Spread::even(rms(&r).max(least[a])),
            };
        }
        solution = solver.solve(&|p, i| weigh(&spreads, p, i))?;
        let change = (nd..nd + kept.len())
            .map(|c| (solution.values[c] - before[c]).abs() / solution.values[c].abs().max(1e-9))
            .fold(0.0f64, f64::max);
        if change < 1e-8 {
            break;
        }
    }

    // the covariance counts what autocorrelated residuals are worth
    let worth: Vec<Vec<f64>> = system
        .parts
        .iter()
        .zip(&solution.residual)
        .enumerate()
        .map(|(p, (part, rest))| {
            (0..na)
                .map(|a| {
                    let whitened: Vec<f64> = (a * part.count..(a + 1) * part.count)
                        .map(|i| rest[i] / weigh(&spreads, p, i))
                        .collect();
                    inflation(&whitened)
                })
                .collect()
        })
        .collect();
    let deflated = solver.solve(&|p, i| {
        let a = i / system.parts[p].count;
        weigh(&spreads, p, i) * worth[p][a].sqrt()
    })?;
    let information = deflated.r.transpose() * &deflated.r;
    let covariance = information.partial_piv_lu().inverse();

    let mut phi = [0.0; 10];
    let mut c10 = Mat::<f64>::zeros(10, 10);
    for (c, &k) in kept.iter().enumerate() {
        phi[k] = solution.values[nd + c];
        for (d, &l) in kept.iter().enumerate() {
            c10[(k, l)] = covariance[(nd + c, nd + d)];
        }
    }
    let mut known = [false; 10];
    let mut unknown = Vec::new();
    for k in 0..10 {
        match system.base.kept.iter().position(|&x| x == k) {
            Some(row) => {
                let grouped = (0..system.base.dropped.len())
                    .filter(|&d| system.base.k[(row, d)].abs() > 1e-9)
                    .map(|d| crate::robot::inertia::NAMES[system.base.dropped[d]])
                    .collect::<Vec<_>>();
                known[k] = grouped.is_empty();
                if !grouped.is_empty() {
                    let name = crate::robot::inertia::NAMES[k];
                    unknown.push(format!("{name} only together with {}", grouped.join(", ")));
                }
            }
            None => unknown.push(format!(
                "{} does not act alone",
                crate::robot::inertia::NAMES[k]
            )),
        }
    }
    if settings.parameters == Parameters::MassCom {
        // a point mass: the tensor about the origin follows from mass and centre of mass
        let load = point(&phi);
        phi = load.0;
        known[4..].fill(false);
        unknown.retain(|u| !u.starts_with('I'));
    }
    let condition = condition(&solution.r, nd, kept.len());
    let mut warnings = Vec::new();
    if !unknown.is_empty() {
        warnings.push(Warning::new(
            WarningKind::NotIdentifiable,
            "load",
            format!(
                "this robot cannot tell all ten parameters: {}",
                unknown.join("; ")
            ),
        ));
    }
    if condition > 1e4 {
        warnings.push(Warning::new(
            WarningKind::NotExcited,
            "load",
            format!(
                "the motion hardly excites the load (condition number {condition:.1e}): turn the \
                 load about several axes, at more than one frequency"
            ),
        ));
    }
    let consistent = settings.consistent && settings.parameters == Parameters::Full;
    let load = LoadBody::new(Inertia(phi), c10, known, consistent)?;
    if load.projected {
        warnings.push(Warning::new(
            WarningKind::InertiaImpossible,
            "load",
            "the estimate itself is no body that can exist; the nearest one is given",
        ));
    } else if settings.parameters == Parameters::Full
        && known.iter().all(|k| *k)
        && !load.consistent
    {
        warnings.push(Warning::new(
            WarningKind::InertiaImpossible,
            "load",
            "the estimate is no body that can exist: its inertia is not known well enough",
        ));
    }
    let fitted = (0..system.parts.len())
        .map(|p| fitted(&system, &solver, &solution, &load, p))
        .collect();
    Ok(OneStep {
        load,
        records: fitted,
        spreads,
        condition,
        unknown,
        warnings,
    })
}

/// Tensor of a point mass at the centre of mass of the first four parameters.
fn point(phi: &[f64; 10]) -> Inertia {
    let m = phi[0];
    let c = match m.abs() > 1e-12 {
        true => Vector3::new(phi[1], phi[2], phi[3]) / m,
        false => Vector3::zeros(),
    };
    Inertia::from_com(m, c, Matrix3::zeros())
}

/// Subtracts what the tensor of a point mass makes of the torques.
fn point_mass(solver: &mut Solver, kept: &[usize], values: &[f64]) {
    let mut phi = [0.0; 10];
    for (&k, &v) in kept.iter().zip(values) {
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
fn condition(r: &Mat<f64>, first: usize, count: usize) -> f64 {
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

pub(super) fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|v| v * v).sum::<f64>() / x.len().max(1) as f64).sqrt()
}

fn fitted(system: &System, solver: &Solver, s: &Solution, load: &LoadBody, p: usize) -> Fitted {
    let part = &system.parts[p];
    let n = part.count;
    let torque: Vec<f64> = match part.loaded {
        true => (0..part.y.len())
            .map(|i| (0..10).map(|k| part.tool[(i, k)] * load.inertia.0[k]).sum())
            .collect(),
        false => vec![0.0; part.y.len()],
    };
    let mut carried = part.y.clone();
    let friction: Vec<JointFriction> = (0..system.actuators)
        .map(|a| {
            let values = solver.friction_of(s, p, a);
            for i in a * n..(a + 1) * n {
                for c in 0..system.deviations.len() {
                    carried[i] -= s.values[c] * part.deviation[(i, c)];
                }
                for f in 0..3 {
                    carried[i] -= values[f] * part.friction[f][i];
                }
                carried[i] -= values[3] * solver.peaks[p][i];
            }
            let (mut coulomb, mut viscous) = (Vec::new(), Vec::new());
            for period in &part.periods {
                let [dc, dv] = period_friction(part, period, a);
                coulomb.push(values[0] + dc);
                viscous.push(values[1] + dv);
            }
            JointFriction {
                coulomb: values[0],
                viscous: values[1],
                offset: values[2],
                stribeck: solver.speeds[a].map(|_| values[3]),
                stribeck_velocity: solver.speeds[a],
                coulomb_periods: coulomb,
                viscous_periods: viscous,
            }
        })
        .collect();
    let residuals = (0..system.actuators)
        .map(|a| {
            let r = rms(&s.residual[p][a * n..(a + 1) * n]);
            let all = rms(&part.torque[a * n..(a + 1) * n]);
            Residual {
                rms: r,
                relative: if all > 0.0 { r / all } else { 0.0 },
            }
        })
        .collect();
    Fitted {
        name: part.name.clone(),
        loaded: part.loaded,
        count: n,
        time: part.time.clone(),
        speed: part.speed.clone(),
        carried,
        load: torque,
        friction,
        residuals,
    }
}

/// Coulomb and viscous friction of one period beyond those of the mean: the periods share their
/// motion, so a fit with friction of its own for every period gives the load of the mean torque,
/// and these.
fn period_friction(part: &Part, period: &[f64], a: usize) -> [f64; 2] {
    let rows = a * part.count..(a + 1) * part.count;
    let mut normal = nalgebra::Matrix3::<f64>::zeros();
    let mut right = Vector3::<f64>::zeros();
    for i in rows {
        let row = Vector3::new(
            part.friction[0][i],
            part.friction[1][i],
            part.friction[2][i],
        );
        normal += row * row.transpose();
        right += row * (period[i] - part.y[i]);
    }
    match normal.cholesky() {
        Some(c) => {
            let x = c.solve(&right);
            [x[0], x[1]]
        }
        None => [0.0, 0.0],
    }
}
