//! Local extrema by grid and Newton's method: for the inner loop of an optimiser, without proof.

use super::extrema::Extremum;
use super::fourier::{Series, differentiated, sin_cos_turns};
use super::table::Table;
use std::f64::consts::TAU;

/// All local extrema of the derivative of the given order that a grid resolves, refined by
/// Newton's method: times in `[0, T)` and values, in order of time, into `out` (cleared first);
/// never empty. `table` should hold at least 16 samples per period of the highest harmonic, then
/// nothing of size is missed; `work` is memory kept between calls. A constant curve gives its
/// first sample.
pub fn extrema_fast(
    table: &Table,
    series: &Series,
    order: u32,
    work: &mut Vec<f64>,
    out: &mut Vec<Extremum>,
) {
    out.clear();
    let n = table.len();
    work.resize(n, 0.0);
    table.series(series, order, work);
    let (step, omega) = (1.0 / n as f64, table.omega());
    let curve = |x: f64| {
        // value and its derivatives per turn, straight from the undifferentiated coefficients
        let mut p = [if order == 0 { series.constant } else { 0.0 }, 0.0, 0.0];
        for ((&s, &c), &h) in series.sin.iter().zip(&series.cos).zip(table.harmonics()) {
            let (sin, cos) = sin_cos_turns(h, x);
            let (s, c) = differentiated(s, c, f64::from(h) * omega, order);
            let w = TAU * f64::from(h);
            let value = s * sin + c * cos;
            p[0] += value;
            p[1] += w * (s * cos - c * sin);
            p[2] -= w * w * value;
        }
        p
    };
    for i in 0..n {
        let (a, b, c) = (work[(i + n - 1) % n], work[i], work[(i + 1) % n]);
        if !((b > a && b >= c) || (b < a && b <= c)) {
            continue;
        }
        let centre = i as f64 * step;
        // vertex of the parabola through the three samples, at most half a step away
        let bend = a - 2.0 * b + c;
        let mut x = centre
            + if bend == 0.0 {
                0.0
            } else {
                0.5 * step * (a - c) / bend
            };
        let mut value = b;
        for _ in 0..4 {
            let [p, p1, p2] = curve(x);
            let newton = -p1 / p2;
            let inside = newton.is_finite() && (x + newton - centre).abs() <= step;
            let towards = (b > a) == (p2 < 0.0);
            if !(inside && towards) {
                value = if (b > a) == (p > b) { p } else { b };
                if value == b {
                    x = centre;
                }
                break;
            }
            x += newton;
            value = p + newton * (p1 + 0.5 * newton * p2);
            if newton.abs() < 1e-7 * step {
                break;
            }
        }
        let turns = x - x.floor();
        let turns = if turns < 1.0 { turns } else { 0.0 };
        out.push(Extremum {
            time: turns * table.period(),
            value,
        });
    }
    if out.is_empty() {
        out.push(Extremum {
            time: 0.0,
            value: work[0],
        });
    }
    out.sort_by(|a, b| a.time.total_cmp(&b.time));
}
