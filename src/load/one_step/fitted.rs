//! Records after the fit: friction of every actuator, and what is left.

use super::solver::{Solution, Solver};
use crate::load::body::LoadBody;
use crate::load::system::Part;
use faer::Mat;
use nalgebra::Vector3;

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
    /// standard deviation of `coulomb`
    pub coulomb_std: f64,
    /// of `viscous`
    pub viscous_std: f64,
    /// of `offset`
    pub offset_std: f64,
    /// of `stribeck`
    pub stribeck_std: Option<f64>,
    /// of `stribeck_velocity`
    pub stribeck_velocity_std: Option<f64>,
    /// Coulomb friction of every period, where the motion repeats
    pub coulomb_periods: Vec<f64>,
    /// viscous friction of every period
    pub viscous_periods: Vec<f64>,
}

impl JointFriction {
    /// Whether Stribeck force and speed are known to half of themselves, at 95 %.
    pub fn stribeck_determined(&self) -> bool {
        let known = |value: Option<f64>, std: Option<f64>| match (value, std) {
            (Some(v), Some(s)) => 1.96 * s <= 0.5 * v.abs(),
            _ => false,
        };
        known(self.stribeck, self.stribeck_std)
            && known(self.stribeck_velocity, self.stribeck_velocity_std)
    }
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
#[derive(Debug, Clone, serde::Serialize)]
pub struct Fitted {
    /// name of the record
    pub name: String,
    /// whether it had the load
    pub loaded: bool,
    /// cut-off of the filter that torques and columns passed, Hz; infinite where nothing was filtered
    #[serde(skip)]
    pub cutoff: f64,
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

/// Root mean square.
pub fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|v| v * v).sum::<f64>() / x.len().max(1) as f64).sqrt()
}

/// A record after the fit, with the load as identified.
pub fn fitted(
    solver: &Solver,
    s: &Solution,
    covariance: &Mat<f64>,
    load: &LoadBody,
    p: usize,
) -> Fitted {
    let system = solver.system;
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
            let stds = solver.friction_stds(covariance, p, a);
            let speed = s.values[solver.speed(a)];
            for i in a * n..(a + 1) * n {
                for c in 0..system.deviations.len() {
                    carried[i] -= s.values[c] * part.deviation[(i, c)];
                }
                for f in 0..3 {
                    carried[i] -= values[f] * part.friction[f][i];
                }
                carried[i] -= solver.geometry_at(&s.values, p, i);
                carried[i] -= values[3] * solver.peaks[p][i] + speed * solver.slopes[p][i];
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
                coulomb_std: stds[0],
                viscous_std: stds[1],
                offset_std: stds[2],
                stribeck_std: solver.speeds[a].map(|_| stds[3]),
                stribeck_velocity_std: solver.speeds[a].map(|_| stds[4]),
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
        cutoff: part.cutoff(),
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
