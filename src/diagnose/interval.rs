//! Interval of the share that an effect explains: a block bootstrap over whole seconds.
//!
//! Residuals are autocorrelated, so single samples are no independent draws; blocks of a second
//! (or a sixteenth of the fitted time, where that is shorter) nearly are (Künsch 1989). With the energies of block `b` without the effect `w_b`, with it `a_b`,
//! and of the whole gap above the noise `t_b`, resampled with replacement within the fitted records:
//!
//! ```text
//! ρ* = Σ (w_b − a_b)* / Σ t_b*        interval = explains · quantiles(ρ*) / ρ
//! ```

use super::data::Data;
use super::thresholds::THRESHOLDS as T;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The 95 % interval of `explains` from residuals of the gap (`total`), of the fit without the effect
/// and of the fit with it, by actuator as the gap is counted. With fewer than eight blocks nothing
/// is known: `[0, 1]`.
pub fn explained(
    data: &Data,
    total: &[Vec<f64>],
    without: &[Vec<f64>],
    with: &[Vec<f64>],
    explains: f64,
    seed: u64,
) -> [f64; 2] {
    let fitted = data.records.iter().filter(|r| r.fit);
    let time: f64 = fitted.map(|r| r.count as f64 * r.dt).sum();
    let block = T.interval.block.min(time / T.interval.blocks);
    let mut blocks = Vec::new();
    for (k, r) in data.records.iter().enumerate().filter(|(_, r)| r.fit) {
        let size = ((block / r.dt).round() as usize).max(1);
        let span = data.span(k);
        let counted: Vec<_> = (0..data.joints()).map(|j| r.counted(j)).collect();
        for from in span.clone().step_by(size) {
            let part = from..(from + size).min(span.end);
            let energy = |x: &[Vec<f64>]| -> f64 {
                let row = |x: &Vec<f64>| x[part.clone()].iter().map(|v| v * v).sum::<f64>();
                x.iter().map(row).sum()
            };
            let gone = energy(without) - energy(with);
            let at = part.start - span.start..part.end - span.start;
            let noise = (0..data.joints()).map(|j| match data.counts_whitened(j) {
                true => data.weights[j][part.clone()].iter().map(|w| w * w).sum(),
                false => {
                    let sound = counted[j][at.clone()].iter().filter(|m| **m).count();
                    (1.0 + data.noise[j].excess) * sound as f64
                }
            });
            let noise: f64 = noise.sum();
            blocks.push([gone, energy(total) - noise]);
        }
    }
    let ratio = |sum: [f64; 2]| sum[0] / sum[1].max(1e-9);
    let add = |a: [f64; 2], b: &[f64; 2]| [a[0] + b[0], a[1] + b[1]];
    let whole = blocks.iter().fold([0.0; 2], add);
    if blocks.len() < T.interval.least || whole[0] <= 0.0 || whole[1] <= 0.0 {
        return [0.0, 1.0];
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut drawn: Vec<f64> = (0..T.interval.resamples)
        .map(|_| {
            let draw = |sum, _| add(sum, &blocks[rng.random_range(0..blocks.len())]);
            ratio((0..blocks.len()).fold([0.0; 2], draw)) / ratio(whole)
        })
        .collect();
    drawn.sort_by(f64::total_cmp);
    T.interval
        .quantiles
        .map(|p| (explains * drawn[(p * T.interval.resamples as f64) as usize]).clamp(0.0, 1.0))
}
