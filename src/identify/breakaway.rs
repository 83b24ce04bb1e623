//! Breakaway friction of the drives, from slow and fast parts of the records together.
//!
//! ```text
//! τ = W π + Σ_a F_a s_a(v_a)        s_a = exp(−(q̇_a/v_a)²) sign(q̇_a)
//! ```
//!
//! is linear in all but the speeds `v_a`. The others are projected out (Golub & Pereyra 1973): with the weighted rows
//! `W = Q R` and `P = 1 − Q Qᵀ`, the speed of one drive explains `(s · r)²/(s · P s)` of what the others leave, `r`. Drives
//! take turns until nothing changes. A drive keeps its term where that explains more than chance would (BIC), and against
//! the motion. The covariance is that of `F` and `v` with all columns free; what it makes of the other parameters,
//! `R⁻¹ Qᵀ J C Jᵀ Q R⁻ᵀ`, is added to theirs.

use super::equations::{self, Equations};
use super::{Identification, Settings};
use crate::error::{Error, Result, Warning, WarningKind};
use crate::log::Record;
use crate::plant::Plant;
use crate::robot::{JointTerm, Motion, Stribeck};
use crate::signals::Prepared;
use faer::linalg::solvers::{DenseSolveCore, Solve};
use faer::{Mat, Side};

/// Breakaway friction of one actuator.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Breakaway {
    /// index of the actuator
    pub actuator: usize,
    /// beyond Coulomb friction, N m or N
    pub force: f64,
    /// speed at which it has fallen to `1/e`, rad/s or m/s
    pub velocity: f64,
    /// standard deviation of `force`
    pub force_std: f64,
    /// of `velocity`
    pub velocity_std: f64,
}

/// A value of a drive, as reports state it.
pub(super) struct Value {
    pub name: String,
    pub value: f64,
    pub std: f64,
    pub nominal: f64,
    pub unit: &'static str,
}

/// Forces and speeds that were found, with those of the robot file.
pub(super) fn values(plant: &Plant, id: &Identification) -> Vec<Value> {
    let joints = plant.actuators();
    let each = id.breakaway.iter().flat_map(|b| {
        let joint = joints[b.actuator];
        let units = match joint.motion {
            Motion::Revolute => ["N m", "rad/s"],
            Motion::Prismatic => ["N", "m/s"],
        };
        let value = |name: &str, value, std, nominal, unit| Value {
            name: format!("{}.{name}", joint.name),
            value,
            std,
            nominal,
            unit,
        };
        let own = joint.stribeck;
        [
            value("stribeck", b.force, b.force_std, own.force, units[0]),
            value(
                "stribeck_velocity",
                b.velocity,
                b.velocity_std,
                own.velocity,
                units[1],
            ),
        ]
    });
    each.collect()
}

/// Rounds in which the weights follow the residuals.
const ROUNDS: usize = 3;
/// Turns of all drives in each.
const TURNS: usize = 4;
/// Least and largest speed that is tried, of the fastest of the drive; steps of the grid between them.
const SPEEDS: (f64, f64, usize) = (0.002, 0.7, 24);

/// What is found before all else is identified.
pub(super) struct Found {
    /// drives whose term is kept
    pub all: Vec<Breakaway>,
    /// what it makes of the covariance of the base parameters
    pub covariance: Mat<f64>,
    /// drives of which nothing was found
    pub warnings: Vec<Warning>,
}

/// Actuators whose breakaway friction is asked for.
pub(super) fn asked(plant: &Plant) -> Vec<usize> {
    let joints = plant.actuators();
    (0..joints.len())
        .filter(|&a| joints[a].stribeck.fit)
        .collect()
}

/// The plant with this breakaway friction where it was asked for, and none where it was not found.
pub(super) fn with(plant: &Plant, found: &[Breakaway]) -> Plant {
    let all: Vec<(usize, Stribeck)> = asked(plant)
        .into_iter()
        .map(|a| {
            let own = found.iter().find(|b| b.actuator == a);
            let usual = Stribeck::default();
            let stribeck = Stribeck {
                force: own.map_or(0.0, |b| b.force),
                velocity: own.map_or(usual.velocity, |b| b.velocity),
                fit: true,
            };
            (a, stribeck)
        })
        .collect();
    plant.with_stribeck(&all)
}

/// The rows of all records, weighted.
struct Rows<'a> {
    prepared: Vec<&'a Prepared>,
    /// velocities of the actuators at full rate, record by record
    speed: Vec<Vec<f64>>,
    /// fastest of each actuator
    fastest: Vec<f64>,
    actuators: usize,
    /// actuator of each row; none where it does not count
    of: Vec<Option<usize>>,
    w: Mat<f64>,
    y: Vec<f64>,
}

impl Rows<'_> {
    /// A function of the speed of an actuator in all its rows, filtered like everything else, over `sigma`.
    fn column(&self, a: usize, sigma: f64, f: impl Fn(f64) -> f64) -> Mat<f64> {
        let mut out = Mat::zeros(self.y.len(), 1);
        let mut first = 0;
        for (p, speed) in self.prepared.iter().zip(&self.speed) {
            let n = speed.len() / self.actuators;
            let raw: Vec<f64> = speed[a * n..(a + 1) * n]
                .iter()
                .map(|v| if *v == 0.0 { 0.0 } else { f(*v) })
                .collect();
            let count = p.outputs();
            for (k, v) in p.filter.apply(&raw).into_iter().enumerate() {
                let row = first + a * count + k;
                if self.of[row].is_some() {
                    out[(row, 0)] = v / sigma;
                }
            }
            first += self.actuators * count;
        }
        out
    }

    fn factor(&self, speed: f64) -> impl Fn(f64) -> f64 {
        move |v: f64| (-(v / speed).powi(2)).exp() * v.signum()
    }

    fn slope(&self, speed: f64) -> impl Fn(f64) -> f64 {
        move |v: f64| {
            let u = v / speed;
            2.0 * u * u / speed * (-u * u).exp() * v.signum()
        }
    }
}

fn dot(a: &Mat<f64>, b: &Mat<f64>) -> f64 {
    (a.transpose() * b)[(0, 0)]
}

/// Finds it.
///
/// # Errors
/// As [`super::identify`]; a drive whose Coulomb friction is no unknown.
pub(super) fn find(plant: &Plant, records: &[Record], settings: &Settings) -> Result<Found> {
    let wanted = asked(plant);
    for &a in &wanted {
        let joint = plant.actuators()[a];
        if !joint.identify[JointTerm::Coulomb as usize] {
            return Err(Error::Argument(format!(
                "{}: stribeck can only be identified beside coulomb; list both",
                joint.name
            )));
        }
    }
    let plant = &with(plant, &[]);
    let records = equations::usable(records, &mut Vec::new())?;
    let settings = equations::one_filter(&records, settings);
    let base = plant.base()?;
    let equations = Equations::new(plant, &base, &settings.signals, records)?;
    let fit = equations.fit()?;
    let (na, b) = (plant.actuated().len(), base.count());
    let speed = fit
        .prepared
        .iter()
        .map(|p| Ok(plant.actuator_motion(&p.motion)?.qd))
        .collect::<Result<Vec<_>>>()?;
    let fastest = (0..na)
        .map(|a| {
            let own = speed.iter().flat_map(|s| {
                let n = s.len() / na;
                s[a * n..(a + 1) * n].iter()
            });
            own.fold(0.0f64, |m, v| m.max(v.abs()))
        })
        .collect();
    let stacks = fit.stacks();
    let rows: usize = stacks.iter().map(|s| s.measured.len()).sum();
    let mut all = Rows {
        prepared: fit.prepared.clone(),
        speed,
        fastest,
        actuators: na,
        of: Vec::with_capacity(rows),
        w: Mat::zeros(rows, b),
        y: Vec::with_capacity(rows),
    };
    for s in &stacks {
        for i in 0..s.measured.len() {
            let row = all.y.len();
            let out = s.left_out.get(i).copied().unwrap_or(false);
            all.of.push((!out).then_some(i / s.count));
            all.y
                .push(if out { 0.0 } else { s.measured[i] - s.known[i] });
            for c in 0..b {
                all.w[(row, c)] = if out { 0.0 } else { s.w[(i, c)] };
            }
        }
    }
    let mut sigma = plant.torque_noise().0;
    let mut state: Vec<Option<(f64, f64)>> = vec![None; na];
    let mut last = None;
    for _ in 0..ROUNDS {
        let turn = Turn::new(&all, &sigma);
        turn.go(&wanted, &mut state);
        sigma = turn.spreads(&state);
        last = Some(turn);
    }
    let Some(turn) = last else {
        return Err(Error::Infeasible("no round was made".into()));
    };
    let (found, covariance) = turn.certainty(&state);
    let missing = wanted.iter().filter(|a| state[**a].is_none());
    Ok(Found {
        warnings: missing
            .map(|&a| {
                Warning::new(
                    WarningKind::NotIdentifiable,
                    plant.actuators()[a].name.clone(),
                    "no breakaway friction shows in its residuals, and none is in the model: record slow parts beside fast ones",
                )
            })
            .collect(),
        all: found,
        covariance,
    })
}

/// One weighting of the rows.
struct Turn<'a> {
    rows: &'a Rows<'a>,
    sigma: Vec<f64>,
    q: Mat<f64>,
    r: Mat<f64>,
    /// `P y`
    left: Mat<f64>,
}

impl<'a> Turn<'a> {
    fn new(rows: &'a Rows<'a>, sigma: &[f64]) -> Self {
        let weight = |i: usize| rows.of[i].map_or(0.0, |a| 1.0 / sigma[a]);
        let w = Mat::from_fn(rows.w.nrows(), rows.w.ncols(), |i, c| {
            weight(i) * rows.w[(i, c)]
        });
        let y = Mat::from_fn(rows.y.len(), 1, |i, _| weight(i) * rows.y[i]);
        let qr = w.qr();
        let q = qr.compute_thin_Q();
        let left = &y - &q * (q.transpose() * &y);
        Turn {
            rows,
            sigma: sigma.to_vec(),
            r: qr.thin_R().to_owned(),
            q,
            left,
        }
    }

    fn projected(&self, column: &Mat<f64>) -> Mat<f64> {
        column - &self.q * (self.q.transpose() * column)
    }

    /// `P s` of a drive at a speed.
    fn peak(&self, a: usize, speed: f64) -> Mat<f64> {
        let column = self.rows.column(a, self.sigma[a], self.rows.factor(speed));
        self.projected(&column)
    }

    /// What the terms of all drives but one leave.
    fn without(&self, state: &[Option<(f64, f64)>], a: usize) -> Mat<f64> {
        let mut left = self.left.clone();
        for (b, term) in state.iter().enumerate() {
            if let (Some((force, speed)), true) = (term, a != b) {
                left -= self.peak(b, *speed) * *force;
            }
        }
        left
    }

    /// Drives in turn.
    fn go(&self, wanted: &[usize], state: &mut [Option<(f64, f64)>]) {
        for _ in 0..TURNS {
            for &a in wanted {
                let left = self.without(state, a);
                state[a] = self.best(a, &left);
            }
        }
    }

    /// Force and speed of a drive that explain most, where that is more than chance would.
    fn best(&self, a: usize, left: &Mat<f64>) -> Option<(f64, f64)> {
        let (least, most, steps) = SPEEDS;
        let fastest = self.rows.fastest[a];
        let explained = |speed: f64| -> (f64, f64) {
            let peak = self.peak(a, speed);
            let (size, along) = (dot(&peak, &peak), dot(&peak, left));
            match size > 1e-12 && along > 0.0 {
                true => (along * along / size, along / size),
                false => (0.0, 0.0),
            }
        };
        let step = (most / least).ln() / (steps - 1) as f64;
        let grid = (0..steps).map(|k| fastest * least * (step * k as f64).exp());
        let centre = grid
            .map(|v| (explained(v).0, v))
            .max_by(|x, y| x.0.total_cmp(&y.0))
            .filter(|x| x.0 > 0.0)?
            .1;
        let (mut low, mut high) = (centre.ln() - step, centre.ln() + step);
        for _ in 0..18 {
            let (u, v) = (low + 0.382 * (high - low), high - 0.382 * (high - low));
            match explained(u.exp()).0 > explained(v.exp()).0 {
                true => high = v,
                false => low = u,
            }
        }
        let speed = (0.5 * (low + high)).exp();
        let (gain, force) = explained(speed);
        let own: Vec<usize> = (0..self.rows.of.len())
            .filter(|&i| self.rows.of[i] == Some(a))
            .collect();
        let total: f64 = own.iter().map(|&i| left[(i, 0)].powi(2)).sum();
        let n = own.len() as f64;
        let price = 2.0 * n.ln();
        let worth = n * (total / (total - gain).max(1e-12 * total)).ln() > price;
        worth.then_some((force, speed))
    }

    /// What all terms leave of the rows.
    fn residual(&self, state: &[Option<(f64, f64)>]) -> Mat<f64> {
        self.without(state, usize::MAX)
    }

    /// Spread of what is left of each actuator, N m or N.
    fn spreads(&self, state: &[Option<(f64, f64)>]) -> Vec<f64> {
        let left = self.residual(state);
        (0..self.rows.actuators)
            .map(|a| {
                let own = (0..self.rows.of.len()).filter(|&i| self.rows.of[i] == Some(a));
                let (sum, n) =
                    own.fold((0.0, 0.0), |(s, n), i| (s + left[(i, 0)].powi(2), n + 1.0));
                let spread = self.sigma[a] * (sum / f64::max(n, 1.0)).sqrt();
                spread.max(1e-9 * self.sigma[a])
            })
            .collect()
    }

    /// Terms with their standard deviations, and what these add to the covariance of the base parameters.
    fn certainty(&self, state: &[Option<(f64, f64)>]) -> (Vec<Breakaway>, Mat<f64>) {
        let b = self.r.ncols();
        let kept: Vec<(usize, f64, f64)> = (0..state.len())
            .filter_map(|a| state[a].map(|(f, v)| (a, f, v)))
            .collect();
        if kept.is_empty() {
            return (Vec::new(), Mat::zeros(b, b));
        }
        let m = 2 * kept.len();
        let mut j = Mat::<f64>::zeros(self.rows.y.len(), m);
        for (k, &(a, force, speed)) in kept.iter().enumerate() {
            let peak = self.rows.column(a, self.sigma[a], self.rows.factor(speed));
            let slope = self.rows.column(a, self.sigma[a], self.rows.slope(speed));
            for i in 0..j.nrows() {
                j[(i, 2 * k)] = peak[(i, 0)];
                j[(i, 2 * k + 1)] = force * slope[(i, 0)];
            }
        }
        let free = self.projected(&j);
        let rest = self.residual(state);
        let counted = self.rows.of.iter().filter(|o| o.is_some()).count() as f64;
        let variance = dot(&rest, &rest) / (counted - (b + m) as f64).max(1.0);
        let information = free.transpose() * &free;
        let lost = || Mat::from_fn(m, m, |i, k| if i == k { f64::INFINITY } else { 0.0 });
        let c = match information.llt(Side::Lower) {
            Ok(factor) => factor.solve(Mat::<f64>::identity(m, m)) * variance,
            Err(_) => lost(),
        };
        let along = self.r.partial_piv_lu().inverse() * (self.q.transpose() * &j);
        let more = &along * &c * along.transpose();
        let all = kept
            .iter()
            .enumerate()
            .map(|(k, &(actuator, force, velocity))| Breakaway {
                actuator,
                force,
                velocity,
                force_std: c[(2 * k, 2 * k)].sqrt(),
                velocity_std: c[(2 * k + 1, 2 * k + 1)].sqrt(),
            })
            .collect();
        (all, more)
    }
}

impl Found {
    /// Carries it into what was identified with it: standard deviations, correlation in time included, and warnings.
    pub(super) fn carry(self, plant: &Plant, id: &mut Identification) {
        let root = id.inflation.sqrt();
        id.breakaway = self.all;
        for b in &mut id.breakaway {
            b.force_std *= root;
            b.velocity_std *= root;
        }
        let finite = (0..self.covariance.nrows()).all(|k| self.covariance[(k, k)].is_finite());
        if finite && self.covariance.nrows() == id.base.count() {
            id.covariance += &self.covariance * id.inflation;
            for a in 0..id.base.count() {
                id.std[a] = id.covariance[(a, a)].max(0.0).sqrt();
                let kept = id.base.kept[a];
                if matches!(
                    plant.parameters()[kept].kind,
                    crate::robot::Column::Term { .. }
                ) {
                    let more = self.covariance[(a, a)].max(0.0) * id.inflation;
                    id.phi_std[kept] = (id.phi_std[kept].powi(2) + more).sqrt();
                }
            }
        }
        id.warnings.extend(self.warnings);
    }
}
