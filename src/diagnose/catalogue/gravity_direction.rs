//! The base stands inclined: gravity has another direction in its axes.

use super::*;

/// Gravity direction (base tilt).
pub struct GravityDirection;

impl Effect for GravityDirection {
    fn card(&self) -> Card {
        Card {
            name: "gravity_direction",
            title: "gravity direction (base tilt)",
            equation: "∂τ_g/∂g₀ δg",
            source: "Khalil & Dombre 2002",
            aliases: &[],
            separated_by: "a slow full turn of a vertical first joint with the arm stretched, with two payloads",
        }
    }
    fn hides(&self) -> bool {
        true
    }

    fn places(&self, cx: &Context) -> Vec<Vec<usize>> {
        if cx.serial() {
            vec![Vec::new()]
        } else {
            Vec::new()
        }
    }

    fn columns(&self, cx: &Context, _place: &[usize], _shape: &[f64], _draft: bool) -> Vec<Column> {
        base_compliance::tilted(cx, |r, _, _| {
            [vec![1.0; r.count], vec![0.0; r.count], vec![0.0; r.count]]
        })
    }

    fn plausible(&self, _cx: &Context, _place: &[usize], _shape: &[f64], eta: &[f64]) -> bool {
        eta.iter().all(|t| t.abs() < 0.5)
    }

    fn values(
        &self,
        _cx: &Context,
        _place: &[usize],
        _shape: &[f64],
        eta: &[f64],
        std: &[f64],
    ) -> Vec<Value> {
        vec![
            value("tilt_x", eta[0], std[0], "rad"),
            value("tilt_y", eta[1], std[1], "rad"),
        ]
    }
}
