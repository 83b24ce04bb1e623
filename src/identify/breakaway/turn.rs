//! Weighted rows of all records, and the terms that explain most of what all else leaves.

use crate::robot::Stribeck;
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

/// Turns of all drives in each.
const TURNS: usize = 4;
/// Least and largest speed that is tried, of the fastest of the drive; steps of the grid between them.
const SPEEDS: (f64, f64, usize) = (0.002, 0.7, 24);

/// Speed, in `v_a`, below which a drive may stick.
const STUCK: f64 = 0.5;
/// Part of the filter's weight in slower samples from which a row counts as slow.
const SLOW: f64 = 0.2;
/// What a force or a speed may be uncertain by, of itself, at 95 %.
const DETERMINED: f64 = 0.5;

impl Breakaway {
    /// Whether force and speed are known to half of themselves, at 95 %.
    pub fn determined(&self) -> bool {
        let known = |value: f64, std: f64| 1.96 * std <= DETERMINED * value.abs();
        known(self.force, self.force_std) && known(self.velocity, self.velocity_std)
    }
}

/// The rows of all records, weighted.
#[derive(Clone)]
pub(super) struct Rows<'a> {
    pub prepared: Vec<&'a Prepared>,
    /// velocities of the actuators at full rate, record by record
    pub speed: Vec<Vec<f64>>,
    /// fastest of each actuator
    pub fastest: Vec<f64>,
    pub actuators: usize,
    /// actuator of each row; none where it does not count
    pub of: Vec<Option<usize>>,
    pub w: Mat<f64>,
    pub y: Vec<f64>,
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

    /// The same without the rows in which a drive that has a term may stick.
    pub fn moving(&self, state: &[Option<(f64, f64)>]) -> Self {
        let mut out = self.clone();
        for (a, term) in state.iter().enumerate() {
            let Some((_, speed)) = term else { continue };
            let slow = self.column(a, 1.0, |v| f64::from(u8::from(v.abs() < STUCK * speed)));
            for (i, of) in out.of.iter_mut().enumerate() {
                if *of == Some(a) && slow[(i, 0)] > SLOW {
                    *of = None;
                }
            }
        }
        out
    }
}

/// Breakaway friction of force one that falls to `1/e` at this speed.
fn unit(speed: f64) -> Stribeck {
    Stribeck {
        force: 1.0,
        velocity: speed,
        fit: false,
    }
}

fn dot(a: &Mat<f64>, b: &Mat<f64>) -> f64 {
    (a.transpose() * b)[(0, 0)]
}

/// One weighting of the rows.
pub(super) struct Turn<'a> {
    rows: &'a Rows<'a>,
    sigma: Vec<f64>,
    q: Mat<f64>,
    r: Mat<f64>,
    /// `P y`
    left: Mat<f64>,
}

impl<'a> Turn<'a> {
    pub fn new(rows: &'a Rows<'a>, sigma: &[f64]) -> Self {
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
        let column = self
            .rows
            .column(a, self.sigma[a], |v| unit(speed).torque(v));
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
    pub fn go(&self, wanted: &[usize], state: &mut [Option<(f64, f64)>]) {
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
    pub fn spreads(&self, state: &[Option<(f64, f64)>]) -> Vec<f64> {
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

    /// Slopes of all rows by force and speed of each term.
    fn slopes(&self, state: &[Option<(f64, f64)>]) -> Mat<f64> {
        let kept: Vec<(usize, f64, f64)> = terms(state);
        let mut j = Mat::<f64>::zeros(self.rows.y.len(), 2 * kept.len());
        for (k, &(a, force, speed)) in kept.iter().enumerate() {
            let peak = self
                .rows
                .column(a, self.sigma[a], |v| unit(speed).torque(v));
            let slope = self
                .rows
                .column(a, self.sigma[a], |v| unit(speed).slopes(v)[1]);
            for i in 0..j.nrows() {
                j[(i, 2 * k)] = peak[(i, 0)];
                j[(i, 2 * k + 1)] = force * slope[(i, 0)];
            }
        }
        j
    }

    /// Terms with their standard deviations, and the covariance of force and speed of each.
    pub fn terms(&self, state: &[Option<(f64, f64)>]) -> (Vec<Breakaway>, Mat<f64>) {
        let kept = terms(state);
        if kept.is_empty() {
            return (Vec::new(), Mat::zeros(0, 0));
        }
        let (b, m) = (self.r.ncols(), 2 * kept.len());
        let free = self.projected(&self.slopes(state));
        let rest = self.residual(state);
        let counted = self.rows.of.iter().filter(|o| o.is_some()).count() as f64;
        let variance = dot(&rest, &rest) / (counted - (b + m) as f64).max(1.0);
        let information = free.transpose() * &free;
        let lost = || Mat::from_fn(m, m, |i, k| if i == k { f64::INFINITY } else { 0.0 });
        let c = match information.llt(Side::Lower) {
            Ok(factor) => factor.solve(Mat::<f64>::identity(m, m)) * variance,
            Err(_) => lost(),
        };
        let each = kept.iter().enumerate();
        let all = each.map(|(k, &(actuator, force, velocity))| Breakaway {
            actuator,
            force,
            velocity,
            force_std: c[(2 * k, 2 * k)].sqrt(),
            velocity_std: c[(2 * k + 1, 2 * k + 1)].sqrt(),
        });
        (all.collect(), c)
    }

    /// What the terms add to the covariance of the base parameters.
    pub fn carried(&self, state: &[Option<(f64, f64)>], c: &Mat<f64>) -> Mat<f64> {
        let b = self.r.ncols();
        if c.nrows() == 0 {
            return Mat::zeros(b, b);
        }
        let j = self.slopes(state);
        let along = self.r.partial_piv_lu().inverse() * (self.q.transpose() * &j);
        &along * c * along.transpose()
    }
}

/// Drive, force and speed of the terms that are kept.
fn terms(state: &[Option<(f64, f64)>]) -> Vec<(usize, f64, f64)> {
    let all = state.iter().enumerate();
    all.filter_map(|(a, term)| term.map(|(f, v)| (a, f, v)))
        .collect()
}

/// Adds to the covariance of the terms by how much more they differ from those of the moving rows than both covariances lead
/// to expect. A term that these do not show is not known at all.
pub(super) fn sticking(found: &mut [Breakaway], c: &mut Mat<f64>, moving: &[Breakaway]) {
    for (k, b) in found.iter_mut().enumerate() {
        let other = moving.iter().find(|o| o.actuator == b.actuator);
        let beyond = |value: f64, std: f64, other: Option<(f64, f64)>| {
            let Some((of_moving, its_std)) = other else {
                return value;
            };
            let off = of_moving - value;
            let expected = (its_std * its_std - std * std).max(0.0);
            let more = (off * off - expected).max(0.0).sqrt().min(value.abs());
            if more.is_finite() {
                more * off.signum()
            } else {
                value
            }
        };
        let more = [
            beyond(b.force, b.force_std, other.map(|o| (o.force, o.force_std))),
            beyond(
                b.velocity,
                b.velocity_std,
                other.map(|o| (o.velocity, o.velocity_std)),
            ),
        ];
        for (i, x) in more.iter().enumerate() {
            for (j, y) in more.iter().enumerate() {
                c[(2 * k + i, 2 * k + j)] += x * y;
            }
        }
        b.force_std = c[(2 * k, 2 * k)].sqrt();
        b.velocity_std = c[(2 * k + 1, 2 * k + 1)].sqrt();
    }
}
