//! Joints of a hexapod's legs that are not where the file says, or lengths that are not what they read.

use super::*;
use nalgebra::{DMatrix, SymmetricEigen};

/// Geometry of the legs.
pub struct LegGeometry;

/// What a drawing is usually off by, m: the deviation a priori of every coordinate, as in a calibration.
const SPREAD: f64 = 2e-3;
/// Least squared signal of that deviation, in noise variances, that makes a direction worth an unknown: three standard
/// deviations.
const SEEN: f64 = 9.0;
/// No joint is off by more, m.
const MOST: f64 = 0.02;

macro_rules! names {
    ($leg:literal) => {
        [
            concat!($leg, "base_x"),
            concat!($leg, "base_y"),
            concat!($leg, "base_z"),
            concat!($leg, "platform_x"),
            concat!($leg, "platform_y"),
            concat!($leg, "platform_z"),
            concat!($leg, "zero"),
        ]
    };
}

/// Deviations of a leg, then with its name before them where all are meant.
const NAMES: [[&str; PARTS]; 7] = [
    names!(""),
    names!("leg1_"),
    names!("leg2_"),
    names!("leg3_"),
    names!("leg4_"),
    names!("leg5_"),
    names!("leg6_"),
];
/// Deviations of a leg.
const PARTS: usize = 7;

impl Effect for LegGeometry {
    fn card(&self) -> Card {
        Card {
            name: "leg_geometry",
            title: "geometry of the legs",
            equation: "∂τ/∂g δg at the same actuator motion, δg ~ N(0, (2 mm)²)",
            source: "Zhuang & Roth 1993; Masory, Wang & Zhuang 1993",
            aliases: &[],
            separated_by: "a calibration; large tilts of the platform",
        }
    }
    fn hides(&self) -> bool {
        true
    }

    fn prior(&self) -> f64 {
        1.0
    }

    fn robots(&self) -> Robots {
        Robots::Closed
    }

    fn places(&self, cx: &Context) -> Vec<Place> {
        match cx.data.plant.deviations() {
            0 => Vec::new(),
            _ => std::iter::once(Place::Robot).chain(cx.singles()).collect(),
        }
    }

    fn columns(&self, cx: &Context, place: &Place, _shape: &Shape, _draft: bool) -> Vec<Column> {
        let Some(all) = cx.deformations() else {
            return Vec::new();
        };
        let of = range(cx, place);
        let directions = all.directions(place);
        directions
            .column_iter()
            .map(|v| {
                let mut rows = vec![vec![0.0; cx.data.rows()]; cx.data.joints()];
                for (w, column) in v.iter().zip(&all.columns[of.clone()]) {
                    for (j, values) in &column.rows {
                        let to = rows[*j].iter_mut().zip(values);
                        to.for_each(|(to, x)| *to += w * x);
                    }
                }
                Column {
                    rows: rows.into_iter().enumerate().collect(),
                }
            })
            .collect()
    }

    fn impossible(
        &self,
        cx: &Context,
        place: &Place,
        _shape: &Shape,
        eta: &[f64],
    ) -> Option<String> {
        let e = off(cx, place, eta)?;
        let most = e.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        (most > MOST).then(|| format!("a joint would be off by {:.0} mm", 1e3 * most))
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let (Some(all), Some(off)) = (cx.deformations(), off(cx, &e.place, &e.eta)) else {
            return Vec::new();
        };
        let v = all.directions(&e.place);
        // directions that the records do not show keep the deviation that they have a priori
        let std = (0..off.len()).map(|p| {
            let seen: f64 = v.row(p).iter().map(|w| w * w).sum();
            let known: f64 = v
                .row(p)
                .iter()
                .zip(&e.std)
                .map(|(w, s)| (w * s).powi(2))
                .sum();
            SPREAD * (known + (1.0 - seen).max(0.0)).sqrt()
        });
        let names = range(cx, &e.place).map(|k| match e.place {
            Place::Robot => NAMES[1 + (k / PARTS).min(5)][k % PARTS],
            _ => NAMES[0][k % PARTS],
        });
        let numbers = off.iter().zip(std).zip(names);
        numbers
            .map(|((x, std), name)| value(name, *x, std, "m"))
            .collect()
    }
}

/// Deviations of a place among those of all legs.
fn range(cx: &Context, place: &Place) -> std::ops::Range<usize> {
    match place {
        Place::Robot => 0..PARTS * cx.data.joints(),
        _ => PARTS * place.first()..PARTS * (place.first() + 1),
    }
}

/// Deviations with coefficients, m.
fn off(cx: &Context, place: &Place, eta: &[f64]) -> Option<Vec<f64>> {
    let v = cx.deformations()?.directions(place);
    let sum = |p: usize| -> f64 { v.row(p).iter().zip(eta).map(|(w, e)| w * e).sum() };
    Some((0..v.nrows()).map(|p| SPREAD * sum(p)).collect())
}

/// What deviations of the legs change.
pub struct Deformations {
    /// for a deviation as large as they are a priori, leg after leg
    pub columns: Vec<Column>,
    /// directions among them that the records can show: of all legs, then of each
    directions: Vec<DMatrix<f64>>,
}

impl Deformations {
    /// Of the bodies of the nominal model as fitted; `None` for other mechanisms than hexapods.
    pub fn of(cx: &Context) -> Option<Self> {
        let data = cx.data;
        let (n, count) = (data.joints(), data.plant.deviations());
        if count == 0 {
            return None;
        }
        let known = &cx.phi[..data.plant.parameters().len()];
        let mut columns = vec![vec![Vec::with_capacity(data.rows()); n]; count];
        for (k, r) in data.records.iter().enumerate() {
            let load = data.load(k, &cx.phi);
            let changes = data.plant.deformations(&r.x, r.dt, known, load.as_ref());
            for (column, change) in columns.iter_mut().zip(changes.ok()?) {
                for (row, values) in column.iter_mut().zip(change.chunks_exact(r.count)) {
                    row.extend(values.iter().map(|v| SPREAD * v));
                }
            }
        }
        let columns: Vec<Column> = columns
            .into_iter()
            .map(|rows| Column {
                rows: rows.into_iter().enumerate().collect(),
            })
            .collect();
        // signals as the tests see them
        let seen: Vec<Vec<f64>> = columns
            .iter()
            .map(|c| {
                let rows = c.rows.iter();
                rows.flat_map(|(j, v)| data.modelled(*j, v)[..data.fitted].to_vec())
                    .collect()
            })
            .collect();
        let gram = DMatrix::from_fn(count, count, |i, k| match k <= i {
            true => seen[i].iter().zip(&seen[k]).map(|(a, b)| a * b).sum(),
            false => 0.0,
        });
        let of = |range: std::ops::Range<usize>| {
            let m = range.len();
            let part = DMatrix::from_fn(m, m, |i, k| {
                let (i, k) = (range.start + i.max(k), range.start + i.min(k));
                gram[(i, k)]
            });
            let e = SymmetricEigen::new(part);
            let kept: Vec<usize> = (0..m).filter(|i| e.eigenvalues[*i] > SEEN).collect();
            DMatrix::from_fn(m, kept.len(), |p, i| e.eigenvectors[(p, kept[i])])
        };
        let each = (0..n).map(|leg| of(PARTS * leg..PARTS * (leg + 1)));
        let directions = std::iter::once(of(0..count)).chain(each).collect();
        Some(Deformations {
            columns,
            directions,
        })
    }

    /// Directions of a place that the records can show, one a column.
    fn directions(&self, place: &Place) -> &DMatrix<f64> {
        match place {
            Place::Robot => &self.directions[0],
            _ => &self.directions[1 + place.first()],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mechanism::Mechanism;
    use crate::plant::Plant;
    use std::f64::consts::TAU;

    /// The bundled hexapod with the joints of its first leg off along x: at the base, at the platform.
    fn hexapod(off: [f64; 2]) -> Plant {
        let mut text = include_str!("../../mechanism/bundled/hexapod.toml").to_string();
        let at = |radius: f64, angle: f64, off: f64| {
            format!(
                "[{}, {}, 0.0]",
                radius * angle.cos() + off,
                radius * angle.sin()
            )
        };
        let (base, platform) = (at(0.60, -0.2085, off[0]), at(0.35, -0.88, off[1]));
        text += &format!("[[leg]]\nbase = {base}\nplatform = {platform}\n");
        text += &"[[leg]]\n".repeat(5);
        let mechanism = Mechanism::from_toml_str(&text, "robot.toml").unwrap();
        Plant::from(mechanism).with_terms(&[])
    }

    #[test]
    fn columns_are_the_forces_of_another_file() {
        let plant = hexapod([0.0; 2]);
        let mechanism = plant.mechanism().unwrap();
        let count = 500;
        let mut x = Samples::zeros(6, count);
        for k in 0..6 {
            for i in 0..count {
                let w = TAU * (1 + k % 3) as f64 / 5.0;
                let (s, c) = (w * i as f64 * 0.01 + k as f64).sin_cos();
                let (a, at) = (if k < 3 { 0.03 } else { 0.1 }, k * count + i);
                x.q[at] = mechanism.home[k] + a * s;
                (x.qd[at], x.qdd[at]) = (a * w * c, -a * w * w * s);
            }
        }
        let bodies = mechanism.bodies_with(&plant.values());
        let columns = mechanism.deformations(&x, 0.01, &bodies).unwrap();
        let before = plant.rigid_torque(&x, &plant.values()).unwrap();
        let actuators = plant.actuator_motion(&x).unwrap();
        for (off, k) in [([1e-4, 0.0], 0), ([0.0, 1e-4], 3)] {
            let other = hexapod(off);
            // found by that robot from what its encoders read
            let y = other.coordinate_motion(&actuators, Some(count)).unwrap();
            let after = other.rigid_torque(&y, &other.values()).unwrap();
            let (mut wrong, mut size) = (0.0, 0.0);
            for i in 0..before.len() {
                let change = (after[i] - before[i]) / 1e-4;
                wrong += (change - columns[k][i]).powi(2);
                size += change * change;
            }
            assert!(wrong < 1e-4 * size, "{k}: {} of it", (wrong / size).sqrt());
        }
    }
}
