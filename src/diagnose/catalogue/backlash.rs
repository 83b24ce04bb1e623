//! A gap in the transmission: the link falls from flank to flank when the transmitted torque changes sign.

use super::*;

/// Backlash.
pub struct Backlash;

impl Effect for Backlash {
    fn card(&self) -> Card {
        Card {
            name: "backlash",
            title: "backlash",
            equation: "M δ̈ with δ the way through a dead zone b onto springs",
            source: "Nordin & Gutman 2002",
            aliases: &[],
            separated_by: "a bias torque by gravity: backlash vanishes, Coulomb friction stays",
        }
    }
    fn places(&self, cx: &Context) -> Vec<Vec<usize>> {
        if !cx.serial() {
            return Vec::new();
        }
        // the transmitted torque must change its sign
        let crosses = |j: &usize| {
            let (lo, hi) = cx.rigid[*j]
                .iter()
                .fold((0.0f64, 0.0f64), |(a, b), v| (a.min(*v), b.max(*v)));
            lo < -0.01 * cx.peak[*j] && hi > 0.01 * cx.peak[*j]
        };
        (0..cx.data.joints()).filter(crosses).map(|j| vec![j]).collect()
    }

    fn shapes(&self, _cx: &Context, _place: &[usize]) -> Vec<Vec<f64>> {
        let mut all = Vec::new();
        for gap in ladder(5e-4, 2e-2, 7) {
            for frequency in [12.0, 25.0, 50.0] {
                for damping in [0.05, 0.2] {
                    all.push(vec![gap, frequency, damping]);
                }
            }
        }
        all
    }

    fn refinable(&self, k: usize) -> bool {
        k < 2
    }

    fn columns(&self, cx: &Context, place: &[usize], shape: &[f64], draft: bool) -> Vec<Column> {
        let j = place[0];
        let mut all = Vec::with_capacity(cx.data.rows());
        for (k, r) in cx.data.records.iter().enumerate() {
            let span = cx.data.span(k);
            let load = &cx.rigid[j][span.clone()];
            let mass = &cx.mass[j][j][span];
            fall(load, mass, r.dt, shape, r.cycle, &mut all);
        }
        vec![cx.inertial(j, &all, draft)]
    }

    fn plausible(&self, _cx: &Context, _place: &[usize], _shape: &[f64], eta: &[f64]) -> bool {
        eta[0] > 0.3 && eta[0] < 2.5
    }

    fn values(
        &self,
        cx: &Context,
        place: &[usize],
        shape: &[f64],
        eta: &[f64],
        std: &[f64],
    ) -> Vec<Value> {
        let j = place[0];
        let mass = cx.mass[j][j].iter().sum::<f64>() / cx.data.rows() as f64;
        let stiffness = mass * (2.0 * std::f64::consts::PI * shape[1]).powi(2);
        let unit = match cx.motion(j) {
            Motion::Revolute => "N m/rad",
            Motion::Prismatic => "N/m",
        };
        vec![
            constant("gap", shape[0], cx.position_unit(j)),
            constant("contact_stiffness", stiffness, unit),
            value("scale", eta[0], std[0], ""),
        ]
    }
}

/// Acceleration `δ̈` of the link against the motor, `M δ̈ = T(δ) − τ_J`, where `T` is the torque of
/// flanks at `±b/2` with contact springs; averaged as torque is measured.
fn fall(
    load: &[f64],
    mass: &[f64],
    dt: f64,
    shape: &[f64],
    cycle: Option<usize>,
    out: &mut Vec<f64>,
) {
    use crate::diagnose::data::{FINE, from_fine};
    let (gap, omega, damping) = (shape[0], 2.0 * std::f64::consts::PI * shape[1], shape[2]);
    let n = load.len();
    // sub-steps of the springs, finer than those of the average
    let sub = ((omega * dt / FINE as f64 / 0.15).ceil() as usize).max(1);
    let h = dt / (FINE * sub) as f64;
    let mean = mass.iter().sum::<f64>() / n as f64;
    let k = mean * omega * omega;
    let d = 2.0 * damping * mean * omega;
    let (mut x, mut v) = (-gap / 2.0 * load[0].signum() - load[0] / k, 0.0);
    let mut values = Vec::with_capacity((n - 1) * FINE + 1);
    let settle = cycle.unwrap_or(0).min(n - 1);
    for pass in 0..2 {
        let upto = if pass == 0 { settle } else { n };
        for i in 0..upto {
            let next = (i + 1).min(n - 1);
            for s in 0..FINE {
                let mut sum = 0.0;
                for u in 0..sub {
                    let w = (s * sub + u) as f64 / (FINE * sub) as f64;
                    let tau = load[i] + w * (load[next] - load[i]);
                    let m = mass[i].max(0.05 * mean);
                    // the transmitted torque pushes only while the flanks touch
                    let inside = x.clamp(-gap / 2.0, gap / 2.0);
                    let mut t = -k * (x - inside);
                    if x != inside {
                        let damped = t - d * v;
                        t = if damped * t > 0.0 { damped } else { 0.0 };
                    }
                    let a = (t - tau) / m;
                    sum += a;
                    v += h * a;
                    x += h * v;
                }
                if pass == 1 {
                    values.push(sum / sub as f64);
                }
                if pass == 1 && i + 1 == n {
                    break;
                }
            }
        }
    }
    values.truncate((n - 1) * FINE + 1);
    from_fine(&values, n, out);
}
