//! Interpolation of unevenly sampled channels.

/// How a channel is interpolated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// straight lines: torques, pressures
    Linear,
    /// cubic Hermite with slopes from the parabola through neighbours: positions and velocities
    Cubic,
}

/// Values at times `to` of a channel with values `y` at increasing times `t`; continued
/// by at most 0.15 of a step outside, constant from there.
/// O(samples), both lists are walked once. `to` must be increasing.
pub fn interpolate(t: &[f64], y: &[f64], to: &[f64], order: Order) -> Vec<f64> {
    let n = t.len();
    if n == 1 {
        return vec![y[0]; to.len()];
    }
    // slope at a sample from the parabola through it and its neighbours, one-sided at the ends
    let slope = |i: usize| {
        let chord = |a: usize| (y[a + 1] - y[a]) / (t[a + 1] - t[a]);
        if n == 2 {
            return chord(0);
        }
        let k = i.clamp(1, n - 2);
        let (h0, h1) = (t[k] - t[k - 1], t[k + 1] - t[k]);
        let (d0, d1) = (chord(k - 1), chord(k));
        let middle = (d0 * h1 + d1 * h0) / (h0 + h1);
        let curve = (d1 - d0) / (h0 + h1);
        match i {
            i if i < k => middle - 2.0 * curve * h0,
            i if i > k => middle + 2.0 * curve * h1,
            _ => middle,
        }
    };
    let mut i = 0;
    to.iter()
        .map(|&x| {
            while i + 2 < n && t[i + 1] < x {
                i += 1;
            }
            let h = t[i + 1] - t[i];
            let s = ((x - t[i]) / h).clamp(-0.15, 1.15);
            match order {
                Order::Linear => y[i] + s * (y[i + 1] - y[i]),
                Order::Cubic => {
                    let (m0, m1) = (slope(i) * h, slope(i + 1) * h);
                    let (s2, s3) = (s * s, s * s * s);
                    y[i] * (2.0 * s3 - 3.0 * s2 + 1.0)
                        + m0 * (s3 - 2.0 * s2 + s)
                        + y[i + 1] * (3.0 * s2 - 2.0 * s3)
                        + m1 * (s3 - s2)
                }
            }
        })
        .collect()
}

/// Puts interpolated numbers in the place of those that are NaN; returns how many there were.
/// Nothing can be done for a channel of NaN alone.
pub fn fill(t: &[f64], y: &mut [f64], order: Order) -> usize {
    let good: Vec<usize> = (0..y.len()).filter(|&i| y[i].is_finite()).collect();
    let missing = y.len() - good.len();
    if missing == 0 || good.is_empty() {
        return missing;
    }
    let times: Vec<f64> = good.iter().map(|&i| t[i]).collect();
    let values: Vec<f64> = good.iter().map(|&i| y[i]).collect();
    let holes: Vec<usize> = (0..y.len()).filter(|&i| !y[i].is_finite()).collect();
    let to: Vec<f64> = holes.iter().map(|&i| t[i]).collect();
    for (&i, x) in holes.iter().zip(interpolate(&times, &values, &to, order)) {
        y[i] = x;
    }
    missing
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parabolas_are_exact_on_an_uneven_grid() {
        let t: Vec<f64> = (0..20)
            .map(|i| f64::from(i) + 0.3 * f64::from(i % 3))
            .collect();
        let f = |x: f64| 2.0 - 0.7 * x + 0.11 * x * x;
        let y: Vec<f64> = t.iter().map(|&x| f(x)).collect();
        let to: Vec<f64> = (0..190).map(|i| 0.1 * f64::from(i)).collect();
        for (x, z) in to.iter().zip(interpolate(&t, &y, &to, Order::Cubic)) {
            assert!((z - f(*x)).abs() < 1e-12, "{x}");
        }
        let mut holed = y.clone();
        holed[7] = f64::NAN;
        holed[8] = f64::NAN;
        assert_eq!(fill(&t, &mut holed, Order::Cubic), 2);
        assert!((holed[7] - y[7]).abs() < 1e-12);
    }
}
