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

/// In-place transform of a power of two: `X_k = Σ x_n e^{∓2πi kn/N}`, unscaled. `roots` are those of the
/// stages, one after the other; with `CONJUGATE` their conjugates.
fn radix2<const CONJUGATE: bool>(x: &mut [Complex], roots: &[Complex]) {
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
    let turn = |w: Complex| if CONJUGATE { [w[0], -w[1]] } else { w };
    let mut half = 1;
    // two stages at a time, which go through the memory once
    while 2 * half < n {
        let first = &roots[half - 1..2 * half - 1];
        let (second, third) = roots[2 * half - 1..4 * half - 1].split_at(half);
        for part in x.chunks_exact_mut(4 * half) {
            let (a, rest) = part.split_at_mut(half);
            let (b, rest) = rest.split_at_mut(half);
            let (c, d) = rest.split_at_mut(half);
            let values = a.iter_mut().zip(b).zip(c.iter_mut().zip(d));
            let weights = first.iter().zip(second.iter().zip(third));
            for (((a, b), (c, d)), (w, (u, v))) in values.zip(weights) {
                let (w, u, v) = (turn(*w), turn(*u), turn(*v));
                let ([p, q], [r, s]) = (fly(*a, *b, w), fly(*c, *d, w));
                [*a, *c] = fly(p, r, u);
                [*b, *d] = fly(q, s, v);
            }
        }
        half *= 4;
    }
    if half < n {
        let (low, high) = x.split_at_mut(half);
        for ((a, b), w) in low.iter_mut().zip(high).zip(&roots[half - 1..]) {
            [*a, *b] = fly(*a, *b, turn(*w));
        }
    }
}

/// Two values of a stage.
#[inline]
fn fly(a: Complex, b: Complex, w: Complex) -> [Complex; 2] {
    let v = mul(b, w);
    [[a[0] + v[0], a[1] + v[1]], [a[0] - v[0], a[1] - v[1]]]
}

/// Roots of unity of all stages of a transform of this power of two, in the order of their use.
fn roots(n: usize) -> Vec<Complex> {
    let all: Vec<Complex> = (0..n / 2)
        .map(|k| unit(-2.0 * PI * k as f64 / n as f64))
        .collect();
    let mut out = Vec::with_capacity(n);
    let mut half = 1;
    while half < n {
        out.extend(all.iter().step_by(n / (2 * half)));
        half *= 2;
    }
    out
}

/// What transforms of one length share: roots of unity, and the chirp where the length is no power of two.
pub struct Plan {
    count: usize,
    inverse: bool,
    /// of the power of two
    roots: Vec<Complex>,
    /// Bluestein's chirp and the transform of its conjugate; empty for a power of two
    chirp: Vec<Complex>,
    against: Vec<Complex>,
}

impl Plan {
    /// For signals of `count` samples.
    pub fn new(count: usize, inverse: bool) -> Plan {
        let n = count;
        let mut plan = Plan {
            count,
            inverse,
            roots: Vec::new(),
            chirp: Vec::new(),
            against: Vec::new(),
        };
        if n.is_power_of_two() || n == 0 {
            plan.roots = roots(n);
            return plan;
        }
        let m = (2 * n - 1).next_power_of_two();
        plan.roots = roots(m);
        let sign = if inverse { 1.0 } else { -1.0 };
        // k² mod 2N keeps the angle small and exact
        let turned = |k: usize| (k as u128 * k as u128 % (2 * n as u128)) as f64;
        plan.chirp = (0..n)
            .map(|k| unit(sign * PI * turned(k) / n as f64))
            .collect();
        let mut b = vec![[0.0; 2]; m];
        for (k, c) in plan.chirp.iter().enumerate() {
            let c = [c[0], -c[1]];
            b[k] = c;
            b[(m - k) % m] = c;
        }
        radix2::<false>(&mut b, &plan.roots);
        plan.against = b;
        plan
    }

    /// The transform of a signal, see [`transform`].
    ///
    /// # Panics
    /// If it is not as long as planned.
    pub fn transform(&self, x: &[Complex]) -> Vec<Complex> {
        assert_eq!(x.len(), self.count, "samples of the signal and of the plan");
        if self.against.is_empty() {
            let mut y = x.to_vec();
            match self.inverse {
                true => radix2::<true>(&mut y, &self.roots),
                false => radix2::<false>(&mut y, &self.roots),
            }
            return y;
        }
        let m = self.against.len();
        let mut a = vec![[0.0; 2]; m];
        for ((a, x), c) in a.iter_mut().zip(x).zip(&self.chirp) {
            *a = mul(*x, *c);
        }
        radix2::<false>(&mut a, &self.roots);
        let both = a.iter_mut().zip(&self.against);
        both.for_each(|(a, b)| *a = mul(*a, *b));
        radix2::<true>(&mut a, &self.roots);
        a.iter()
            .zip(&self.chirp)
            .map(|(a, c)| {
                let y = mul(*a, *c);
                [y[0] / m as f64, y[1] / m as f64]
            })
            .collect()
    }

    /// Transform of a real signal.
    ///
    /// # Panics
    /// As [`Plan::transform`].
    pub fn spectrum(&self, x: &[f64]) -> Vec<Complex> {
        let z: Vec<Complex> = x.iter().map(|v| [*v, 0.0]).collect();
        self.transform(&z)
    }
}

/// Transform of any length, `X_k = Σ x_n e^{−2πi kn/N}` (with `inverse` the conjugate, unscaled);
/// by Bluestein's chirp where the length is no power of two. O(N log N).
pub fn transform(x: &[Complex], inverse: bool) -> Vec<Complex> {
    Plan::new(x.len(), inverse).transform(x)
}

/// Transform of a real signal.
pub fn spectrum(x: &[f64]) -> Vec<Complex> {
    Plan::new(x.len(), false).spectrum(x)
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
    let back = Plan::new(n, true);
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
        back.transform(&y)
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
    let plan = Plan::new(n, false);
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
        for (s, c) in sum.iter_mut().zip(plan.spectrum(&z)) {
            *s += c[0] * c[0] + c[1] * c[1];
        }
        count += 1;
        start += (n / 2).max(1);
    }
    let scale = 2.0 / (rate * power * f64::from(count.max(1)));
    let frequencies = (0..bins).map(|k| k as f64 * rate / n as f64).collect();
    (frequencies, sum.into_iter().map(|s| s * scale).collect())
}
