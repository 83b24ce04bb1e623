//! Motions as sums of sines, with their derivatives.

use crate::random::Random;
use std::f64::consts::TAU;

/// A sine of one coordinate: frequency in Hz, amplitude, phase.
#[derive(Clone, Debug)]
pub struct Sine {
    pub coordinate: usize,
    pub frequency: f64,
    pub amplitude: f64,
    pub phase: f64,
}

/// Sum with first and second derivative at a time.
pub fn at(sines: &[Sine], home: &[f64; 6], t: f64) -> [[f64; 6]; 3] {
    let mut x = [*home, [0.0; 6], [0.0; 6]];
    for s in sines {
        let w = TAU * s.frequency;
        let (sin, cos) = (w * t + s.phase).sin_cos();
        x[0][s.coordinate] += s.amplitude * sin;
        x[1][s.coordinate] += s.amplitude * w * cos;
        x[2][s.coordinate] -= s.amplitude * w * w * sin;
    }
    x
}

/// A periodic motion in all coordinates up to about 1.8 Hz; `size` scales its amplitudes.
pub fn periodic(period: f64, size: f64, rng: &mut Random) -> Vec<Sine> {
    let mut all = Vec::new();
    for coordinate in 0..6 {
        for f in [0.3, 0.5, 0.8, 1.1, 1.4, 1.7] {
            let harmonic = (f * period + rng.range(-1.2, 1.2)).round().max(1.0);
            let most = if coordinate < 3 { 0.07 } else { 0.2 };
            all.push(Sine {
                coordinate,
                frequency: harmonic / period,
                amplitude: size * most / 6.0 * rng.range(0.6, 1.2) * (0.5 / f).sqrt(),
                phase: rng.range(0.0, TAU),
            });
        }
    }
    all
}

/// What a controller leaves of it: smooth, of 0.5 to 4 Hz, not periodic; 30 µm and 0.1 mrad.
pub fn wandering(rng: &mut Random) -> Vec<Sine> {
    let mut all = Vec::new();
    for coordinate in 0..6 {
        let most = if coordinate < 3 { 3e-5 } else { 1e-4 };
        for _ in 0..10 {
            let frequency: f64 = rng.log_range(0.5, 4.0);
            all.push(Sine {
                coordinate,
                frequency,
                amplitude: most * 0.45 * rng.range(0.5, 1.5) / (1.0 + 0.1 * frequency * frequency),
                phase: rng.range(0.0, TAU),
            });
        }
    }
    all
}
