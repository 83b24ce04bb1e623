//! Where a sampled motion is smooth, and what may be missing between its samples.
//!
//! Between two samples a time `h` apart
//!
//! ```text
//! |u(t)| ≤ max(|u_i|, |u_{i+1}|) + (h²/8) · 2 max |ü|
//! ```
//!
//! with the largest second difference of neighbours, doubled, for `h² ü`: a bound that is **stated**, not proven. Neighbours
//! lie in one stretch in which the motion is smooth.

use std::ops::Range;

/// Samples of a smooth motion.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Smooth {
    /// one period, with this step: the first sample follows the last
    Period(f64),
    /// stretches one after the other, ends included
    Stretches(Vec<Stretch>),
}

/// Equidistant samples of a smooth stretch.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Stretch {
    /// which samples, three or more
    pub samples: Range<usize>,
    /// time of the first
    pub start: f64,
    /// time between two
    pub step: f64,
}

impl Smooth {
    /// Time of a sample.
    pub fn time(&self, s: usize) -> f64 {
        match self {
            Smooth::Period(step) => s as f64 * step,
            Smooth::Stretches(all) => {
                let own = all.iter().find(|p| p.samples.contains(&s));
                own.map_or(0.0, |p| p.start + (s - p.samples.start) as f64 * p.step)
            }
        }
    }

    /// Samples with a neighbour on either side, `[before, here, after]`, and the step.
    fn triples(&self, n: usize) -> Vec<([usize; 3], f64)> {
        match self {
            Smooth::Period(step) => (0..n)
                .map(|s| ([(s + n - 1) % n, s, (s + 1) % n], *step))
                .collect(),
            Smooth::Stretches(all) => {
                let inner = |p: &Stretch| {
                    let step = p.step;
                    (p.samples.start + 1..p.samples.end - 1).map(move |s| ([s - 1, s, s + 1], step))
                };
                all.iter().flat_map(inner).collect()
            }
        }
    }

    /// What may be missing between two samples of a sequence.
    pub fn missing(&self, u: &[f64]) -> f64 {
        let bend = |([a, b, c], _): ([usize; 3], f64)| f64::abs(u[c] - 2.0 * u[b] + u[a]);
        let all = self.triples(u.len()).into_iter().map(bend);
        all.fold(0.0, f64::max) / 4.0
    }

    /// Rates of a sequence by central differences; at the ends of a stretch, of the nearest sample inside.
    pub fn rates(&self, u: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; u.len()];
        for ([a, b, c], step) in self.triples(u.len()) {
            // a stretch that lasts no time has none
            if step > 0.0 {
                out[b] = (u[c] - u[a]) / (2.0 * step);
            }
        }
        if let Smooth::Stretches(all) = self {
            for Range { start, end } in all.iter().map(|p| p.samples.clone()) {
                out[start] = out[start + 1];
                out[end - 1] = out[end - 2];
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `|sin|` has a kink at π: two smooth stretches know nothing of it, a period does.
    #[test]
    fn neighbours_lie_in_one_stretch() {
        let step = std::f64::consts::PI / 20.0;
        let stretch = |from: usize| Stretch {
            samples: from..from + 21,
            start: from as f64 * step,
            step,
        };
        let u: Vec<f64> = (0..=20)
            .chain(20..=40)
            .map(|s| (s as f64 * step).sin().abs())
            .collect();
        let two = Smooth::Stretches(vec![stretch(0), stretch(21)]);
        let most = 2.0 * step * step / 8.0;
        assert!(two.missing(&u) < most && two.missing(&u) > 0.9 * most);
        assert!(Smooth::Period(step).missing(&u) > 5.0 * most);
        let rates = two.rates(&u);
        let right = |s: usize| (s as f64 * step).cos();
        assert!((1..20).all(|s| (rates[s] - right(s)).abs() < 0.01));
        assert_eq!((rates[0], rates[20]), (rates[1], rates[19]));
        assert!(rates[20] < -0.98 && rates[21] > 0.98);
        assert_eq!(two.time(21), 21.0 * step);
    }
}
