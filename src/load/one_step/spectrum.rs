//! Power of a residual over frequency.
//!
//! The residual `e` of an actuator in a record, divided by the standard deviation at its speed, is not white: noise of
//! sensors is low-passed, and what the model misses follows the motion. The orthonormal real transform makes of its rows
//! those of single frequencies, which hardly correlate, and
//!
//! ```text
//! S(f) = Σ e_i² / Σ (1 − h_i)        i in a window about f,  h_i: leverage of row i
//! ```
//!
//! is its power there. What the columns of the fit have taken out of the residual, `h_i`, is made up for: without that
//! the noise would seem smallest at the frequencies of the motion, where it counts.

use crate::signals::fourier::{Inverse, spectrum};
use realfft::num_complex::Complex64;

/// Degrees of freedom that a window must hold: the power is then known to 30 %.
const FREEDOM: f64 = 20.0;

/// Least power, relative to the mean: what is left of exact data is rounding.
const LEAST: f64 = 1e-4;

/// Orthonormal real transform: mean, then cosine and sine of every frequency, then the highest where the length is even.
pub fn rows(x: &[f64]) -> Vec<f64> {
    let n = x.len();
    let scale = 1.0 / (n.max(1) as f64).sqrt();
    let mut out = Vec::with_capacity(n);
    for (k, c) in spectrum(x).iter().enumerate() {
        if k == 0 || 2 * k == n {
            out.push(scale * c.re);
        } else {
            out.push(std::f64::consts::SQRT_2 * scale * c.re);
            out.push(std::f64::consts::SQRT_2 * scale * c.im);
        }
    }
    out
}

/// Back from these rows to samples.
pub fn samples(rows: &[f64]) -> Vec<f64> {
    let n = rows.len();
    let scale = 1.0 / (n.max(1) as f64).sqrt();
    let half = scale * std::f64::consts::FRAC_1_SQRT_2;
    let at = |k: usize| match k {
        0 => Complex64::from(scale * rows[0]),
        _ if 2 * k == n => Complex64::from(scale * rows[n - 1]),
        _ => Complex64::new(half * rows[2 * k - 1], half * rows[2 * k]),
    };
    let kept = if n > 0 { n / 2 + 1 } else { 0 };
    Inverse::new(n).signal((0..kept).map(at).collect())
}

/// What a fit leaves of an actuator in a record, turned into rows of single frequencies.
#[derive(Debug, Clone)]
pub struct Rest {
    /// residual of each row
    pub rows: Vec<f64>,
    /// leverage of each row
    pub leverage: Vec<f64>,
}

impl Rest {
    /// Power at each row.
    pub fn power(&self) -> Vec<f64> {
        power(&self.rows, &self.leverage)
    }

    /// What of this comes back in another record of as many rows: `Σ e_i f_i/√(Σ e_i² Σ f_i²)` in a window about each row,
    /// `1` where both leave the same.
    pub fn coherence(&self, other: &Rest) -> Vec<f64> {
        let n = self.rows.len();
        let mut sums = vec![[0.0; 4]; n + 1];
        for i in 0..n {
            let (e, f) = (self.rows[i], other.rows[i]);
            let more = [e * f, e * e, f * f, 1.0 - self.leverage[i]];
            sums[i + 1] = std::array::from_fn(|k| sums[i][k] + more[k]);
        }
        (0..n)
            .map(|i| {
                let (from, to) = window(i, n, &|from, to| sums[to][3] - sums[from][3]);
                let [both, own, its] = std::array::from_fn(|k| sums[to][k] - sums[from][k]);
                let size = (own * its).sqrt();
                match size > 0.0 {
                    true => (both / size).clamp(-1.0, 1.0),
                    false => 0.0,
                }
            })
            .collect()
    }
}

/// Rows about row `i` of `n` that hold [`FREEDOM`], or all.
fn window(i: usize, n: usize, held: &dyn Fn(usize, usize) -> f64) -> (usize, usize) {
    let mut half = 2;
    loop {
        let (from, to) = (i.saturating_sub(half), (i + half + 1).min(n));
        if to - from == n || held(from, to) >= FREEDOM {
            return (from, to);
        }
        half += 1 + half / 4;
    }
}

/// Power at each of these rows, from the residuals `e` in them and their leverages.
fn power(e: &[f64], leverage: &[f64]) -> Vec<f64> {
    let n = e.len();
    let mut square = vec![0.0; n + 1];
    let mut freedom = vec![0.0; n + 1];
    for i in 0..n {
        square[i + 1] = square[i] + e[i] * e[i];
        freedom[i + 1] = freedom[i] + (1.0 - leverage[i]).clamp(0.0, 1.0);
    }
    let all = freedom[n];
    if all <= 0.0 || square[n] <= 0.0 {
        return vec![1.0; n];
    }
    let least = LEAST * square[n] / all;
    (0..n)
        .map(|i| {
            let held = |from: usize, to: usize| freedom[to] - freedom[from];
            let (from, to) = window(i, n, &held);
            ((square[to] - square[from]) / held(from, to).max(1e-9)).max(least)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_transform_keeps_lengths_and_a_sine_is_one_row() {
        for n in [7, 8, 100] {
            let x: Vec<f64> = (0..n)
                .map(|i| (std::f64::consts::TAU * 2.0 * i as f64 / n as f64).sin())
                .collect();
            let y = rows(&x);
            assert_eq!(y.len(), n);
            let power = |x: &[f64]| x.iter().map(|v| v * v).sum::<f64>();
            assert!((power(&x) - power(&y)).abs() < 1e-9);
            let back = samples(&y);
            assert!(x.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-12));
            assert!((y[4].abs() - power(&x).sqrt()).abs() < 1e-9, "{y:?}");
        }
    }

    #[test]
    fn what_a_fit_took_away_is_made_up_for() {
        // ten rows of power 4, half of which were fitted away
        let e: Vec<f64> = (0..200)
            .map(|i| if i % 2 == 0 { 2.0 } else { 0.0 })
            .collect();
        let h: Vec<f64> = (0..200).map(|i| f64::from(i % 2)).collect();
        let s = power(&e, &h);
        assert!(s.iter().all(|s| (s - 4.0).abs() < 0.6), "{s:?}");
    }

    #[test]
    fn what_two_records_leave_alike_is_coherent() {
        let wave =
            |n: usize, k: f64| -> Vec<f64> { (0..n).map(|i| (k * i as f64).sin()).collect() };
        let rest = |rows: Vec<f64>| Rest {
            leverage: vec![0.0; rows.len()],
            rows,
        };
        let (one, other) = (rest(wave(400, 1.3)), rest(wave(400, 2.1)));
        let turned = rest(one.rows.iter().map(|v| -2.0 * v).collect());
        assert!(one.coherence(&one).iter().all(|c| (c - 1.0).abs() < 1e-12));
        assert!(
            one.coherence(&turned)
                .iter()
                .all(|c| (c + 1.0).abs() < 1e-12)
        );
        let mean = one.coherence(&other).iter().sum::<f64>() / 400.0;
        assert!(mean.abs() < 0.1, "{mean}");
    }
}
