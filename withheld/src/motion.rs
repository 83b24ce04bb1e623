//! Reference motions: finite Fourier series with random phases, scaled into the limits.

use crate::random::Random;
use crate::robots::Machine;
use std::f64::consts::TAU;

/// Centre of a joint's motion, and per harmonic its number and sine and cosine amplitudes.
pub type Series = (f64, Vec<(f64, f64, f64)>);

/// One record of a case: its motion and use.
#[derive(Clone, Debug)]
pub struct Record {
    pub name: String,
    pub fit: bool,
    pub period: f64,
    pub periods: usize,
    pub creep: bool,
    /// One a joint.
    pub series: Vec<Series>,
}

impl Record {
    /// Position, velocity and acceleration of joint `j` at time `t`.
    pub fn at(&self, j: usize, t: f64) -> [f64; 3] {
        let (centre, terms) = &self.series[j];
        let mut out = [*centre, 0.0, 0.0];
        for (h, a, b) in terms {
            let w = h * TAU / self.period;
            let (s, c) = (w * t).sin_cos();
            out[0] += a * s + b * c;
            out[1] += w * (a * c - b * s);
            out[2] -= w * w * (a * s + b * c);
        }
        out
    }

    pub fn duration(&self) -> f64 {
        self.period * self.periods as f64
    }
}

/// How hard a record drives the joints.
#[derive(Clone, Copy)]
enum Pace {
    Usual,
    Slow,
    Creep,
}

/// The five records of a case: three to fit, two held out.
pub fn records(machine: &Machine, creep: bool, rng: &mut Random) -> Vec<Record> {
    let odd = rng.chance(0.67);
    let slow = *[10.0, 12.0].get(rng.index(2)).unwrap_or(&12.0);
    let fast = *[4.0, 5.0].get(rng.index(2)).unwrap_or(&4.0);
    let third = if creep {
        ("fit_3", true, 12.0, 2, Pace::Creep)
    } else {
        ("fit_3", true, fast, 3, Pace::Usual)
    };
    let last = if creep { Pace::Slow } else { Pace::Usual };
    [
        ("fit_1", true, 5.0, 3, Pace::Usual),
        ("fit_2", true, slow, 2, Pace::Usual),
        third,
        ("holdout_1", false, 5.0, 2, Pace::Usual),
        ("holdout_2", false, 8.0, 2, last),
    ]
    .into_iter()
    .map(|(name, fit, period, periods, pace)| Record {
        name: name.into(),
        fit,
        period,
        periods,
        creep: matches!(pace, Pace::Creep),
        series: (0..machine.dof())
            .map(|j| series(machine, j, period, pace, odd, rng))
            .collect(),
    })
    .collect()
}

fn series(
    machine: &Machine,
    j: usize,
    period: f64,
    pace: Pace,
    odd: bool,
    rng: &mut Random,
) -> Series {
    let drive = &machine.drives[j];
    let [low, high] = drive.range;
    let half = 0.5 * (high - low);
    // harmonics up to about 2 Hz, whatever the period
    let highest = (1.8 * period).clamp(5.0, 11.0) as usize;
    let step = if odd { 2 } else { 1 };
    let mut terms: Vec<(f64, f64, f64)> = (1..=highest)
        .step_by(step)
        .map(|h| {
            let h = h as f64;
            let phase = rng.range(0.0, TAU);
            let amplitude = rng.range(0.3, 1.0) / h;
            (h, amplitude * phase.sin(), amplitude * phase.cos())
        })
        .collect();
    if matches!(pace, Pace::Creep) {
        terms.truncate(2);
    }
    let probe = Record {
        name: String::new(),
        fit: true,
        period,
        periods: 1,
        creep: false,
        series: vec![(0.0, terms.clone())],
    };
    let mut peak = [0.0f64; 3];
    for i in 0..400 {
        let x = probe.at(0, period * i as f64 / 400.0);
        for (p, x) in peak.iter_mut().zip(x) {
            *p = p.max(x.abs());
        }
    }
    let top = match pace {
        Pace::Usual => rng.range(0.7, 0.92) * drive.velocity,
        Pace::Slow => rng.range(0.1, 0.2) * drive.velocity,
        Pace::Creep => rng.range(0.02, 0.04) * drive.velocity,
    };
    let scale = (0.9 * half / peak[0])
        .min(top / peak[1])
        .min(0.8 * drive.acceleration / peak[2]);
    let room = (half - scale * peak[0]).max(0.0);
    let centre = 0.5 * (low + high) + room * rng.range(-0.5, 0.5);
    for (_, a, b) in &mut terms {
        *a *= scale;
        *b *= scale;
    }
    (centre, terms)
}
