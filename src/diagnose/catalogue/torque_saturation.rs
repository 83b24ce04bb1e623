//! A motor that gives less torque per current at high torque, or a limited torque.

use super::*;

/// Saturation of the torque constant.
pub struct TorqueSaturation;

/// Loss grows with this power of the torque.
const EXPONENT: u8 = 0;
/// Loss beyond this share of the peak.
const LIMIT: u8 = 1;
/// The torque tends to a limit, however much more is asked for: a share of the peak that is reported. What a drive makes tells little of
/// what is asked for there, so the loss is one of what is reported.
const TENDS: u8 = 2;

/// Most of it that a drive may lose at half of all times: one that is at its limit then moves no robot as it is told, and what is
/// lost is the torque itself.
const AT_MEDIAN: f64 = 0.1;

/// Steps of the torque up to its peak, in which the formula for a simulator asks where its end is.
const STEPS: usize = 500;

/// Share of a torque that is lost where it tends to a limit, from their ratio.
fn lost(ratio: f64, sharp: f64) -> f64 {
    1.0 - (1.0 + ratio.powf(sharp)).powf(-1.0 / sharp)
}

/// The limit that a torque tends to, with which as much is lost at the peak `top` as was fitted there.
fn limit(e: &Estimate, top: f64) -> f64 {
    let [near, sharp] = [e.shape[0], e.shape[1]];
    let left = (1.0 - e.eta[0] * lost(1.0 / near, sharp)).max(1e-3);
    top / (left.powf(-sharp) - 1.0).powf(1.0 / sharp)
}

impl Effect for TorqueSaturation {
    fn card(&self) -> Card {
        Card {
            name: "torque_saturation",
            title: "saturation of the torque constant",
            equation: "κ τ |τ|^{e−1}, or beyond a limit; u − u/(1 + |u/τ_s|^e)^{1/e} of what is reported",
            source: "motor handbooks; Krishnan 2010",
            aliases: &[],
            separated_by: "high torques at low speed",
        }
    }
    fn places(&self, cx: &Context) -> Vec<Place> {
        cx.singles()
    }

    fn shapes(&self, _cx: &Context, _place: &Place) -> Vec<Shape> {
        let with = |form: u8, all: &[f64]| -> Vec<Shape> {
            all.iter().map(|c| Shape::new(form, &[*c])).collect()
        };
        let exponents = with(EXPONENT, &[2.0, 3.0, 5.0]);
        let limits = with(LIMIT, &[0.4, 0.55, 0.7, 0.85]);
        let tends = ladder(0.012, 0.8, 13)
            .into_iter()
            .flat_map(|limit| [2.0, 4.0, 8.0].map(|sharp| Shape::new(TENDS, &[limit, sharp])));
        exponents.into_iter().chain(limits).chain(tends).collect()
    }

    fn most(&self) -> f64 {
        // it is what the drive does not make, however much is asked of it
        f64::INFINITY
    }

    fn forms(&self) -> u8 {
        3
    }

    fn freedoms(&self, shape: &Shape) -> usize {
        // the exponent, the limit, or both
        shape.constants.len()
    }

    fn refinable(&self, shape: &Shape, _k: usize) -> bool {
        shape.form == TENDS
    }

    fn explains_itself(&self, shape: &Shape) -> bool {
        shape.form == TENDS
    }

    fn element(&self, cx: &Context, e: &Estimate) -> Option<Element> {
        let j = e.place.first();
        if e.shape.form == TENDS {
            let top = cx.reported(j).peak;
            let (limit, sharp, loss) = (e.shape[0] * top, e.shape[1], e.eta[0]);
            // up to twice what was seen; where no more is made from some torque on, the rest is reported within a thousandth of it
            let made = |u: f64| u - loss * u * lost(u / limit, sharp);
            let at = |k: usize| top * k as f64 / STEPS as f64;
            let grows = (1..=2 * STEPS).take_while(|k| made(at(*k)) > made(at(*k - 1)));
            let end = grows.count().max(1);
            let (rest, within) = (at(2 * STEPS) - at(end), 1e-3 * made(at(end)));
            let [limit, sharp, loss, end, rest, within] =
                [limit, sharp, loss, at(end), rest, within].map(py);
            let lines = vec![
                format!("told = {end} * xp.linspace(0.0, 1.0, 401) ** 2"),
                format!("left = (1.0 + (told / {limit}) ** {sharp}) ** (-1.0 / {sharp})"),
                format!("made = told - {loss} * told * (1.0 - left)"),
                "at = xp.abs(tau)".to_string(),
                "beyond = xp.clip(at - made[-1], 0.0, None)".to_string(),
                format!("flat = xp.minimum(beyond / {within}, 1.0) * {rest}"),
                "return xp.sign(tau) * (xp.interp(at, made, told) + flat + beyond)".to_string(),
            ];
            return Some(Element::of(Kind::Drive, j, lines));
        }
        let peak = peak(&cx.model[j]);
        let [loss, peak, at] = [e.eta[0], peak, e.shape[0]].map(py);
        let part = match e.shape.form {
            EXPONENT => format!("(xp.abs(tau) / {peak}) ** {at}"),
            _ => format!("xp.clip(xp.abs(tau) / {peak} - {at}, 0.0, None)"),
        };
        let lines = vec![format!(
            "return tau + {loss} * {peak} * xp.sign(tau) * {part}"
        )];
        Some(Element::of(Kind::Drive, j, lines))
    }

    fn columns(&self, cx: &Context, place: &Place, shape: &Shape, _draft: bool) -> Vec<Column> {
        let j = place.first();
        if shape.form == TENDS {
            let all = cx.reported(j);
            let limit = shape[0] * all.peak;
            let loss = |u: &f64| u * lost((u / limit).abs(), shape[1]);
            return vec![Column::on(j, all.torque.iter().map(loss).collect())];
        }
        let peak = peak(&cx.model[j]);
        let values = cx.model[j]
            .iter()
            .map(|t| {
                let x = t.abs() / peak;
                let y = if shape.form == EXPONENT {
                    x.powf(shape[0])
                } else {
                    (x - shape[0]).max(0.0)
                };
                t.signum() * peak * y
            })
            .collect();
        vec![Column::on(j, values)]
    }

    // a drive that gave more torque per current at high torque would be no saturated one
    fn plausible(&self, cx: &Context, place: &Place, shape: &Shape, eta: &[f64]) -> bool {
        match shape.form {
            // its formula has the size of the loss in it
            TENDS => {
                let all = cx.reported(place.first());
                let ratio = all.median / (shape[0] * all.peak);
                (0.6..1.5).contains(&eta[0]) && shape[1] > 1.0 && lost(ratio, shape[1]) < AT_MEDIAN
            }
            _ => eta[0] > 0.0,
        }
    }

    fn values(&self, cx: &Context, e: &Estimate) -> Vec<Value> {
        let Estimate {
            place,
            shape,
            eta,
            std,
        } = e;
        let j = place.first();
        let unit = cx.torque_unit(j);
        if shape.form == TENDS {
            let top = cx.reported(j).peak;
            let loss = lost(1.0 / shape[0], shape[1]);
            return vec![
                value("loss_at_peak", eta[0] * loss, std[0] * loss, ""),
                constant("exponent", shape[1], ""),
                constant("limit", limit(e, top), unit),
                constant("peak", top, unit),
            ];
        }
        let peak = peak(&cx.model[j]);
        let mut all = vec![value("loss_at_peak", eta[0], std[0], "")];
        all.push(match shape.form {
            EXPONENT => constant("exponent", shape[0], ""),
            _ => constant("limit", shape[0] * peak, unit),
        });
        all.push(constant("peak", peak, unit));
        all
    }
}
