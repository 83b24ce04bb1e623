//! Variance of an actuator's residual as a function of its speed, from the residuals themselves.

/// `σ(v)² = s² + (F exp(−(v/v_s)²))²`.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Spread {
    /// far from standstill, N m or N
    pub floor: f64,
    /// more at standstill
    pub peak: f64,
    /// speed scale, rad/s or m/s
    pub speed: f64,
}

impl Spread {
    /// Variance at a speed.
    pub fn variance(&self, v: f64) -> f64 {
        let e = (-(v / self.speed).powi(2)).exp();
        self.floor.powi(2) + (self.peak * e).powi(2)
    }

    /// A spread that does not depend on the speed.
    pub fn even(floor: f64) -> Self {
        Spread {
            floor,
            peak: 0.0,
            speed: 1.0,
        }
    }

    /// Maximum likelihood (normal residuals) over a grid of speeds and ratios of peak to floor; an
    /// uneven spread must gain more than chance would (BIC: two parameters more). `least` is a lower
    /// bound of the floor.
    pub fn fit(residual: &[f64], speed: &[f64], least: f64) -> Self {
        let n = residual.len() as f64;
        let mean_square = residual.iter().map(|r| r * r).sum::<f64>() / n.max(1.0);
        let even = Spread::even(mean_square.sqrt().max(least));
        let fastest = speed.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        if residual.len() < 20 || mean_square <= 0.0 || fastest <= 0.0 {
            return even;
        }
        let cost = |s: &Spread| -> f64 {
            residual
                .iter()
                .zip(speed)
                .map(|(r, v)| {
                    let variance = s.variance(*v);
                    variance.ln() + r * r / variance
                })
                .sum()
        };
        let mut best = (cost(&even) - 2.0 * n.ln(), even);
        for i in 0..14 {
            let vs = fastest * 0.004 * 1.45f64.powi(i);
            for k in 0..14 {
                let ratio = 0.7 * 1.55f64.powi(k);
                let shape = Spread {
                    floor: 1.0,
                    peak: ratio,
                    speed: vs,
                };
                let scale = residual
                    .iter()
                    .zip(speed)
                    .map(|(r, v)| r * r / shape.variance(*v))
                    .sum::<f64>()
                    / n;
                let floor = scale.sqrt().max(least);
                let candidate = Spread {
                    floor,
                    peak: ratio * floor,
                    speed: vs,
                };
                let c = cost(&candidate);
                if c < best.0 {
                    best = (c, candidate);
                }
            }
        }
        best.1
    }
}

/// Variance inflation `1 + 2 Σ ρ_k` of the mean of an autocorrelated residual, summed up to the
/// first correlation that is not positive (Geyer 1992); at least 1.
pub fn inflation(residual: &[f64]) -> f64 {
    let n = residual.len();
    let power: f64 = residual.iter().map(|r| r * r).sum();
    if n < 10 || power <= 0.0 {
        return 1.0;
    }
    let mut sum = 1.0;
    for lag in 1..n / 4 {
        let rho = residual[lag..]
            .iter()
            .zip(residual)
            .map(|(a, b)| a * b)
            .sum::<f64>()
            / power;
        if rho <= 0.0 {
            break;
        }
        sum += 2.0 * rho;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_at_standstill_is_found_and_an_even_spread_stays_even() {
        let n = 4000;
        let speed: Vec<f64> = (0..n).map(|i| (i as f64 * 0.37).sin() * 0.2).collect();
        // deterministic, with the moments of noise
        let noise =
            |i: usize| ((i as f64 * 12.9898).sin() * 43758.5453).fract() * 12f64.sqrt() / 2.0;
        let truth = Spread {
            floor: 2.0,
            peak: 15.0,
            speed: 0.01,
        };
        let r: Vec<f64> = (0..n)
            .map(|i| noise(i) * truth.variance(speed[i]).sqrt())
            .collect();
        let found = Spread::fit(&r, &speed, 0.0);
        let level = r.iter().zip(&speed).filter(|(_, v)| v.abs() > 0.05);
        let (sum, count) = level.fold((0.0, 0), |(s, c), (r, _)| (s + r * r, c + 1));
        let floor = (sum / count as f64).sqrt();
        assert!((found.floor / floor - 1.0).abs() < 0.1, "{found:?} {floor}");
        assert!(
            found.peak > 4.0 * found.floor && found.speed < 0.03,
            "{found:?}"
        );
        let r: Vec<f64> = (0..n).map(|i| 2.0 * noise(i)).collect();
        assert_eq!(Spread::fit(&r, &speed, 0.0).peak, 0.0);
    }
}
