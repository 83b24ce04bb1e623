//! The link follows the motor through a spring: `q_link = q − τ_J/K`.

use super::*;

/// Joint elasticity.
pub struct JointElasticity;

impl Effect for JointElasticity {
    fn card(&self) -> Card {
        Card {
            name: "joint_elasticity",
            title: "joint elasticity",
            equation: "−∂τ/∂(q, q̇, q̈) (τ_J, τ̇_J, τ̈_J)/K, and τ_J³",
            source: "Spong 1987; Wernholt & Gunnarsson 2006",
            aliases: &[],
            separated_by: "high harmonics, a locked output, or a second encoder",
        }
    }
    fn places(&self, cx: &Context) -> Vec<Vec<usize>> {
        if cx.serial() { cx.singles() } else { Vec::new() }
    }

    fn shapes(&self, _cx: &Context, _place: &[usize]) -> Vec<Vec<f64>> {
        vec![vec![1.0], vec![3.0]]
    }

    fn columns(&self, cx: &Context, place: &[usize], shape: &[f64], _draft: bool) -> Vec<Column> {
        let j = place[0];
        let peak = cx.peak[j];
        let twist = |power: i32| {
            cx.displaced(j, move |r, k| {
                let load: Vec<f64> = cx.rigid[j][cx.data.span(k)]
                    .iter()
                    .map(|t| -peak * (t / peak).powi(power))
                    .collect();
                cx.derivatives(r, &load)
            })
        };
        let mut all = vec![twist(1)];
        if shape[0] > 1.0 {
            all.push(twist(3));
        }
        all
    }

    fn plausible(&self, cx: &Context, place: &[usize], _shape: &[f64], eta: &[f64]) -> bool {
        // twist at the peak torque: positive and not more than a tenth of a radian
        let twist = cx.peak[place[0]] * eta.iter().sum::<f64>();
        eta[0] > 0.0 && twist > 0.0 && twist < 0.1
    }

    fn values(
        &self,
        cx: &Context,
        place: &[usize],
        shape: &[f64],
        eta: &[f64],
        std: &[f64],
    ) -> Vec<Value> {
        let unit = match cx.motion(place[0]) {
            Motion::Revolute => "N m/rad",
            Motion::Prismatic => "N/m",
        };
        let mut all = vec![value("stiffness", 1.0 / eta[0], std[0] / (eta[0] * eta[0]), unit)];
        if shape[0] > 1.0 {
            all.push(value("cubic_share", eta[1] / eta[0], std[1] / eta[0].abs(), ""));
        }
        all
    }
}
