//! Filters, derivatives, cut-offs and period averages.

use crate::common::noise::normal;
use excite::signals::butterworth::{Butterworth, first_derivative, second_derivative};
use excite::signals::cutoff::Spectra;
use excite::signals::fourier::Welch;
use excite::signals::{Decimator, cutoff, fourier};
use rand::{Rng, SeedableRng};
use std::f64::consts::PI;

fn signal(n: usize) -> Vec<f64> {
    (0..n)
        .map(|i| {
            let i = i as f64;
            (0.1 * i).sin() + 0.3 * (0.37 * i).cos() + 0.01 * i
        })
        .collect()
}

/// `scipy.signal.sosfiltfilt(butter(order, fc, fs=fs, output='sos'), x, padlen=…)`, SciPy 1.16.
#[test]
fn zero_phase_filter_is_that_of_scipy() {
    type Case = (
        usize,
        f64,
        f64,
        usize,
        Option<usize>,
        &'static [(usize, f64)],
    );
    let cases: [Case; 3] = [
        (
            4,
            10.0,
            200.0,
            300,
            None,
            &[
                (0, 0.28527729802954155),
                (1, 0.3058223151931768),
                (7, 0.579837348941879),
                (100, 0.5038849267706068),
                (150, 2.1814023920391548),
                (298, 1.7898178506144211),
                (299, 1.725652211270817),
            ],
        ),
        (
            3,
            10.0,
            200.0,
            300,
            None,
            &[
                (0, 0.2779572848644012),
                (1, 0.30671288399958535),
                (7, 0.5876488490781698),
                (100, 0.5182304696709151),
                (150, 2.18985106349993),
                (298, 1.7811901471120801),
                (299, 1.7270520201694706),
            ],
        ),
        (
            8,
            0.5,
            1000.0,
            6000,
            Some(3000),
            &[
                (0, 0.25267512579041407),
                (7, 0.32000229429157195),
                (2000, 20.004571770489466),
                (3000, 30.005198426265192),
                (5999, 59.96021988723665),
            ],
        ),
    ];
    for (order, fc, rate, n, pad, values) in cases {
        let f = Butterworth::low_pass(order, fc, rate).unwrap();
        let y = f.zero_phase(&signal(n), pad.unwrap_or(f.default_pad()));
        for &(k, v) in values {
            let tolerance = if order == 8 { 1e-7 } else { 1e-12 };
            assert!(
                (y[k] - v).abs() < tolerance,
                "order {order}, sample {k}: {} {v}",
                y[k]
            );
        }
    }
    assert!(Butterworth::low_pass(4, 100.0, 200.0).is_err());
    assert!(Butterworth::low_pass(0, 10.0, 200.0).is_err());
}

#[test]
fn differences_are_of_sixth_order() {
    let h = 0.01;
    let omega = 6.0;
    let x: Vec<f64> = (0..200).map(|i| (omega * h * i as f64).sin()).collect();
    let (d, dd) = (first_derivative(&x, h), second_derivative(&x, h));
    for i in 10..190 {
        let t = omega * h * i as f64;
        assert!((d[i] - omega * t.cos()).abs() < 1e-8 * omega);
        assert!((dd[i] + omega * omega * t.sin()).abs() < 1e-8 * omega * omega);
    }
}

#[test]
fn any_length_is_transformed_and_periodic_signals_are_differentiated_exactly() {
    for n in [1usize, 2, 7, 64, 120, 6240, 997] {
        let x: Vec<f64> = signal(n);
        let s = fourier::spectrum(&x);
        for k in [0, 1, n / 3, n / 2] {
            let (mut re, mut im) = (0.0, 0.0);
            for (i, v) in x.iter().enumerate() {
                let a = -2.0 * PI * ((k * i) % n) as f64 / n as f64;
                re += v * a.cos();
                im += v * a.sin();
            }
            assert!(
                (s[k % n].re - re).abs() + (s[k % n].im - im).abs() < 1e-9 * n as f64,
                "{n} {k}"
            );
        }
    }
    let (n, period) = (1250, 2.5);
    let w = 2.0 * PI / period;
    let f = |t: f64| 0.4 + (w * t).sin() - 0.2 * (5.0 * w * t).cos();
    let x: Vec<f64> = (0..n).map(|i| f(period * i as f64 / n as f64)).collect();
    let [q, qd, qdd] = fourier::derivatives(&x, period, 8);
    for i in 0..n {
        let t = period * i as f64 / n as f64;
        assert!((q[i] - f(t)).abs() < 1e-12);
        assert!((qd[i] - w * (w * t).cos() - w * (5.0 * w * t).sin()).abs() < 1e-11);
        let second = -w * w * (w * t).sin() + 5.0 * w * w * (5.0 * w * t).cos();
        assert!((qdd[i] - second).abs() < 1e-9);
    }
}

#[test]
fn the_parallel_filter_is_flat_linear_and_blind_to_what_was_not_measured() {
    let (n, rate, fc) = (4000, 1000.0, 20.0);
    let mut valid = vec![true; n];
    let d = Decimator::new(fc, rate, &valid, false);
    assert_eq!(d.factor, 16);
    let wave = |f: f64| -> Vec<f64> {
        (0..n)
            .map(|i| (2.0 * PI * f * i as f64 / rate).sin())
            .collect()
    };
    let gain = |f: f64| {
        let (y, x) = (d.apply(&wave(f)), wave(f));
        let worst = d
            .at()
            .iter()
            .zip(&y)
            .map(|(&i, y)| (y - x[i]).abs())
            .fold(0.0, f64::max);
        (worst, y.iter().fold(0.0f64, |m, v| m.max(v.abs())))
    };
    assert!(
        gain(3.0).0 < 2e-4 && gain(10.0).0 < 2e-4,
        "pass band without phase"
    );
    assert!(gain(31.0).1 < 2e-4 && gain(200.0).1 < 2e-4, "stop band");
    assert!((gain(20.0).1 - 0.5).abs() < 0.02);
    // a hole of nonsense leaves no trace
    valid[2000..2010].fill(false);
    let d = Decimator::new(fc, rate, &valid, false);
    let clean = wave(5.0);
    let mut dirty = clean.clone();
    dirty[2000..2010].fill(1e9);
    assert_eq!(d.apply(&clean), d.apply(&dirty));
    assert!(d.outputs() > 150);
    // in parts as at once
    let whole = d.apply(&clean);
    let mut part = vec![0.0; 40];
    let inputs = d.inputs(30..70);
    let x: Vec<f64> = inputs.iter().map(|&i| clean[i]).collect();
    // a range across the hole has outputs on both sides; one side is enough here
    if d.at()[69] - d.at()[30] == 39 * d.factor {
        d.apply_part(&x, 30..70, &mut part);
        for (a, b) in part.iter().zip(&whole[30..70]) {
            assert!((a - b).abs() < 1e-14);
        }
    }
    // a signal that repeats has no ends
    let cyclic = Decimator::new(fc, rate, &vec![true; n], true);
    assert_eq!(cyclic.outputs(), n / 16);
    let y = cyclic.apply(&clean);
    assert!(
        cyclic
            .at()
            .iter()
            .zip(&y)
            .all(|(&i, y)| (y - clean[i]).abs() < 2e-4)
    );
    let mut wrapped = vec![0.0; 5];
    let inputs = cyclic.inputs(0..5);
    let x: Vec<f64> = inputs.iter().map(|&i| clean[i]).collect();
    cyclic.apply_part(&x, 0..5, &mut wrapped);
    assert!(wrapped.iter().zip(&y).all(|(a, b)| (a - b).abs() < 1e-14));
}

#[test]
fn the_cutoff_lies_where_motion_sinks_into_noise() {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
    let rate = 1000.0;
    let q: Vec<f64> = (0..20_000)
        .map(|i| {
            let t = i as f64 / rate;
            let noise: f64 = (0..12).map(|_| rng.random_range(-0.5..0.5)).sum();
            (2.0 * PI * 0.7 * t).sin() + 0.1 * (2.0 * PI * 6.0 * t).sin() + 1e-5 * noise
        })
        .collect();
    let spectra = Spectra::fine(q.len(), rate, usize::MAX);
    let c = cutoff::aperiodic(&q, &spectra, 4);
    assert!((12.0..40.0).contains(&c.frequency), "{}", c.frequency);
    let truth = 2.0 * 1e-10 / rate;
    assert!(
        (0.5 * truth..2.0 * truth).contains(&c.floor),
        "{} {truth}",
        c.floor
    );
    assert!((5.5..7.0).contains(&cutoff::bandwidth(&q, rate)));
    // periods of 4 s: the same from their scatter
    let parts: Vec<&[f64]> = q.chunks_exact(10_000).collect();
    let (k, c) = cutoff::periodic(&parts, 10.0);
    assert!((60..110).contains(&k), "{k} {}", c.frequency);
}

/// Both derivations give the motion of a log that repeats, from positions with the noise of an encoder; a cut-off
/// of the positions belongs to one of them only.
#[test]
fn the_derivation_is_an_option() {
    use excite::log::parts::Purpose;
    use excite::log::{Channels, Record};
    use excite::plant::Plant;
    use excite::signals::parts::Derivation;
    use excite::signals::{Prepared, Settings};
    let plant = Plant::load("planar2").unwrap();
    let (rate, period) = (200.0, 4.0);
    let count = 3 * 800;
    let t: Vec<f64> = (0..count).map(|i| i as f64 / rate).collect();
    let w = 2.0 * PI / period;
    let exact = |j: usize, t: f64| {
        let (a, b) = (0.6 - 0.2 * j as f64, 0.15);
        let q = a * (w * t).sin() + b * (5.0 * w * t).cos();
        let qdd = -a * w * w * (w * t).sin() - b * 25.0 * w * w * (5.0 * w * t).cos();
        [q, qdd]
    };
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
    let mut noisy = |x: f64| x + 2e-5 * rng.random_range(-1.0..1.0);
    let q = (0..2)
        .map(|j| t.iter().map(|t| noisy(exact(j, *t)[0])).collect())
        .collect();
    let tau = (0..2)
        .map(|j| t.iter().map(|t| noisy(exact(j, *t)[1])).collect())
        .collect();
    let channels = Channels {
        t: t.clone(),
        q,
        tau,
        qref: None,
    };
    let record =
        Record::from_channels("made", channels, &plant, Purpose::Fit, Some(period)).unwrap();
    for derivation in [Derivation::LowPass, Derivation::Wiener] {
        let settings = Settings::default().with(|set| set.derivation = derivation);
        let p = Prepared::new(&record, &plant, &settings).unwrap();
        for j in 0..2 {
            let off: f64 = (0..800)
                .map(|i| (p.motion.qdd[j * 800 + i] - exact(j, t[i])[1]).powi(2))
                .sum();
            let off = (off / 800.0).sqrt();
            println!(
                "{derivation:?} joint {j}: {off:.2e} rad/s², {}",
                p.cutoff_reason
            );
            assert!(off < 0.2, "{derivation:?}: {off}");
        }
    }
    let both = Settings::default().with(|set| {
        set.derivation = Derivation::Wiener;
        set.position_cutoff = Some(10.0);
    });
    assert!(Prepared::new(&record, &plant, &both).is_err());
}

/// One sample in many is enough for what has no high frequencies: the outputs are those of the filter over all samples, at the
/// same times, with gaps where they have some.
#[test]
fn the_parallel_filter_over_fewer_samples_is_the_same_filter() {
    let (n, rate, fc) = (20_000, 1000.0, 4.5);
    let mut valid = vec![true; n];
    valid[9000..9003].fill(false);
    for most in [1, 2, 7, 27, 1000] {
        let (all, stride) = Decimator::with_stride(fc, rate, &valid, false, most);
        assert!(stride <= most && all.factor.is_multiple_of(stride));
        assert!((60..=74).contains(&all.factor), "{}", all.factor);
        let Some(few) = all.over_every(stride) else {
            assert_eq!(stride, 1);
            continue;
        };
        let stamps: Vec<usize> = few.at().iter().map(|i| i * stride).collect();
        assert_eq!(stamps, all.at(), "the same outputs");
        // from the pass band to the edge of the stop band, and a constant
        for f in [0.0, 0.7, 4.5, 6.0] {
            let wave = |i: usize| (2.0 * PI * f * i as f64 / rate + 0.4).sin();
            let x: Vec<f64> = (0..n).map(wave).collect();
            let thin: Vec<f64> = x.iter().step_by(stride).copied().collect();
            let pairs = all.apply(&x).into_iter().zip(few.apply(&thin));
            let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            // beyond the highest that so few samples can hold, images fold back
            let enough = rate / stride as f64 > 6.0 * fc;
            assert!(worst < 3e-4 || !enough, "{most} {f} Hz: {worst:.1e}");
        }
    }
    // nothing is thinned of a signal that repeats
    let cyclic = Decimator::new(fc, rate, &vec![true; 1000], true);
    assert!(cyclic.over_every(2).is_none());
}

/// A few windows say of white noise what all of them do.
#[test]
fn a_few_windows_give_the_level_of_all() {
    let mut rng = rand::rngs::StdRng::seed_from_u64(3);
    let x: Vec<f64> = (0..60_000).map(|_| normal(&mut rng)).collect();
    let mean = |(_, d): (Vec<f64>, Vec<f64>)| d.iter().sum::<f64>() / d.len() as f64;
    let all = mean(fourier::welch(&x, 1.0, 1000));
    let put = |from: usize, to: &mut [f64]| to.copy_from_slice(&x[from..from + to.len()]);
    let of = |most| Welch::new(x.len(), 1000, most).density(1.0, put);
    let few = mean(of(16));
    assert!((few / all - 1.0).abs() < 0.05, "{few} {all}");
    assert_eq!(fourier::welch(&x, 1.0, 1000), of(1 << 20));
}
