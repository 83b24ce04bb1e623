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
        (0..cx.data.joints())
            .filter(crosses)
            .map(|j| vec![j])
            .collect()
    }

    fn shapes(&self, _cx: &Context, _place: &[usize]) -> Vec<Vec<f64>> {
        let mut all = Vec::new();
        for gap in ladder(6e-4, 3e-2, 6) {
            for frequency in [8.0, 16.0, 32.0, 60.0] {
                for damping in [0.03, 0.15] {
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
            let [_, _, a] = fall(load, mass, r.dt, shape[0], shape[1], shape[2], 0.0, r.cycle);
            all.extend(a);
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

/// Way `δ` of the link against the motor, its rate and acceleration, `M δ̈ = T(δ) − τ_J`, where `T`
/// is the torque of flanks at `±b/2` with springs of `M (2πf)²` and a damping ratio; the springs
/// stiffen by `cubic` at the largest load. Averaged as torque is measured.
#[allow(clippy::too_many_arguments)]
pub(crate) fn fall(
    load: &[f64],
    mass: &[f64],
    dt: f64,
    gap: f64,
    frequency: f64,
    damping: f64,
    cubic: f64,
    cycle: Option<usize>,
) -> [Vec<f64>; 3] {
    use crate::diagnose::data::{FINE, from_fine};
    let omega = 2.0 * std::f64::consts::PI * frequency;
    let n = load.len();
    // sub-steps of the springs, finer than those of the average
    let sub = ((omega * dt / FINE as f64 / 0.2).ceil() as usize).max(1);
    let h = dt / (FINE * sub) as f64;
    let mean = mass.iter().sum::<f64>() / n as f64;
    let k = mean * omega * omega;
    let d = 2.0 * damping * mean * omega;
    let twist = load.iter().fold(1e-12f64, |m, v| m.max(v.abs())) / k;
    let (mut x, mut v) = (-gap / 2.0 * load[0].signum() - load[0] / k, 0.0);
    let mut values: [Vec<f64>; 3] = Default::default();
    let settle = cycle.unwrap_or(0).min(n - 1);
    for pass in 0..2 {
        let upto = if pass == 0 { settle } else { n };
        for i in 0..upto {
            let next = (i + 1).min(n - 1);
            let m = mass[i].max(0.05 * mean);
            for s in 0..FINE {
                let mut sum = 0.0;
                let begin = (x, v);
                for u in 0..sub {
                    let w = (s * sub + u) as f64 / (FINE * sub) as f64;
                    let tau = load[i] + w * (load[next] - load[i]);
                    let beyond = x - x.clamp(-gap / 2.0, gap / 2.0);
                    let mut t = -k * beyond * (1.0 + cubic * (beyond / twist).powi(2).min(9.0));
                    // flanks push only while they touch
                    if gap == 0.0 {
                        t -= d * v;
                    } else if beyond != 0.0 {
                        let damped = t - d * v;
                        t = if damped * t > 0.0 { damped } else { 0.0 };
                    }
                    let a = (t - tau) / m;
                    sum += a;
                    v += h * a;
                    x += h * v;
                }
                if pass == 1 {
                    values[0].push(begin.0);
                    values[1].push(begin.1);
                    values[2].push(sum / sub as f64);
                }
                if pass == 1 && i + 1 == n {
                    break;
                }
            }
        }
    }
    values.map(|mut all| {
        all.truncate((n - 1) * FINE + 1);
        let mut out = Vec::with_capacity(n);
        from_fine(&all, n, &mut out);
        out
    })
}
