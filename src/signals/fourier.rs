//! Discrete Fourier transforms of any length, spectra, and differentiation of periodic signals.

use std::f64::consts::PI;

/// A complex number: real and imaginary part.
pub type Complex = [f64; 2];

#[inline]
fn mul(a: Complex, b: Complex) -> Complex {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

#[inline]
fn unit(angle: f64) -> Complex {
    [angle.cos(), angle.sin()]
}

/// In-place transform of a power of two: `X_k = Σ x_n e^{∓2πi kn/N}`, unscaled.
fn radix2(x: &mut [Complex], inverse: bool) {
    let n = x.len();
    let mut j = 0;
    for i in 1..n {
        let mut bit = n >> 1;
        while j & bit != 0 {
            j ^= bit;
            bit >>= 1;
        }
        j |= bit;
        if i < j {
            x.swap(i, j);
        }
    }
    let sign = if inverse { 2.0 } else { -2.0 };
    let roots: Vec<Complex> = (0..n / 2)
        .map(|k| unit(sign * PI * k as f64 / n as f64))
        .collect();
    let mut length = 2;
    while length <= n {
        let (half, stride) = (length / 2, n / length);
        for start in (0..n).step_by(length) {
            for k in 0..half {
                let (a, b) = (x[start + k], mul(x[start + k + half], roots[k * stride]));
                x[start + k] = [a[0] + b[0], a[1] + b[1]];
                x[start + k + half] = [a[0] - b[0], a[1] - b[1]];
            }
        }
        length *= 2;
    }
}

/// Transform of any length, `X_k = Σ x_n e^{−2πi kn/N}` (with `inverse` the conjugate, unscaled);
/// by Bluestein's chirp where the length is no power of two. O(N log N).
pub fn transform(x: &[Complex], inverse: bool) -> Vec<Complex> {
    let n = x.len();
    if n.is_power_of_two() {
        let mut y = x.to_vec();
        radix2(&mut y, inverse);
        return y;
    }
    if n == 0 {
        return Vec::new();
    }
    let m = (2 * n - 1).next_power_of_two();
    let sign = if inverse { 1.0 } else { -1.0 };
    // k² mod 2N keeps the angle small and exact
    let chirp: Vec<Complex> = (0..n)
        .map(|k| unit(sign * PI * ((k as u128 * k as u128 % (2 * n as u128)) as f64) / n as f64))
        .collect();
    let mut a = vec![[0.0; 2]; m];
    let mut b = vec![[0.0; 2]; m];
    for k in 0..n {
        a[k] = mul(x[k], chirp[k]);
        let c = [chirp[k][0], -chirp[k][1]];
        b[k] = c;
        b[(m - k) % m] = c;
    }
    radix2(&mut a, false);
    radix2(&mut b, false);
    a.iter_mut().zip(&b).for_each(|(a, b)| *a = mul(*a, *b));
    radix2(&mut a, true);
    (0..n)
        .map(|k| {
            let y = mul(a[k], chirp[k]);
            [y[0] / m as f64, y[1] / m as f64]
        })
        .collect()
}

/// Transform of a real signal.
pub fn spectrum(x: &[f64]) -> Vec<Complex> {
    let z: Vec<Complex> = x.iter().map(|v| [*v, 0.0]).collect();
    transform(&z, false)
}

/// A signal of one period, low-passed to the harmonics up to `highest`, and its first two
/// derivatives with respect to time; `period` in seconds.
///
/// Exact for a signal that has no other harmonics, whatever its length.
pub fn derivatives(x: &[f64], period: f64, highest: usize) -> [Vec<f64>; 3] {
    let n = x.len();
    let mean = x.iter().sum::<f64>() / n.max(1) as f64;
    let centred: Vec<f64> = x.iter().map(|v| v - mean).collect();
    let full = spectrum(&centred);
    let omega = 2.0 * PI / period;
    std::array::from_fn(|d| {
        let mut y = vec![[0.0; 2]; n];
        for k in 1..n.div_ceil(2).min(highest.saturating_add(1)) {
            let w = (omega * k as f64).powi(d as i32);
            let c = full[k];
            let z = match d {
                0 => c,
                1 => [-c[1] * w, c[0] * w],
                _ => [-c[0] * w, -c[1] * w],
            };
            y[k] = z;
            y[n - k] = [z[0], -z[1]];
        }
        let constant = if d == 0 { mean } else { 0.0 };
        transform(&y, true)
            .into_iter()
            .map(|z| z[0] / n as f64 + constant)
            .collect()
    })
}

/// Power spectral density (one-sided, units²/Hz) by Welch's method: Hann windows of `length`
/// samples that overlap by half, means removed. Returns frequencies and densities.
pub fn welch(x: &[f64], rate: f64, length: usize) -> (Vec<f64>, Vec<f64>) {
    let n = length.min(x.len()).max(2);
    let window: Vec<f64> = (0..n)
        .map(|i| 0.5 - 0.5 * (2.0 * PI * i as f64 / n as f64).cos())
        .collect();
    let power: f64 = window.iter().map(|w| w * w).sum();
    let bins = n / 2 + 1;
    let mut sum = vec![0.0; bins];
    let mut count = 0;
    let mut start = 0;
    while start + n <= x.len() {
        let part = &x[start..start + n];
        let mean = part.iter().sum::<f64>() / n as f64;
        let z: Vec<f64> = part
            .iter()
            .zip(&window)
            .map(|(v, w)| (v - mean) * w)
            .collect();
        for (s, c) in sum.iter_mut().zip(spectrum(&z)) {
            *s += c[0] * c[0] + c[1] * c[1];
        }
        count += 1;
        start += (n / 2).max(1);
    }
    let scale = 2.0 / (rate * power * f64::from(count.max(1)));
    let frequencies = (0..bins).map(|k| k as f64 * rate / n as f64).collect();
    (frequencies, sum.into_iter().map(|s| s * scale).collect())
}
