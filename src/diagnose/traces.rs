//! Series for the figures of the report.

use super::data::Data;
use super::noise::{LINES, spectrum};

/// Series for the figures of one actuator: a period or the beginning of one record.
#[derive(Debug, Clone, Default, serde::Serialize)]
pub struct Trace {
    /// time, s
    pub t: Vec<f64>,
    /// residual refitted, N m, mean over periods
    pub before: Vec<f64>,
    /// residual with the effects
    pub after: Vec<f64>,
    /// velocity
    pub velocity: Vec<f64>,
    /// position
    pub position: Vec<f64>,
    /// torque
    pub torque: Vec<f64>,
    /// spectra of residual before, after, and of noise, N m, on frequencies
    pub spectrum: Vec<[f64; 4]>,
    /// residual over time at the pace of periods: start time and rms before and after
    pub drift: Vec<[f64; 3]>,
}

/// Figures: the first fitted record of each actuator.
pub fn traces(data: &Data, before: &[Vec<f64>], after: &[Vec<f64>]) -> Vec<Trace> {
    (0..data.joints())
        .map(|j| {
            let r = &data.records[0];
            let n = r.cycle.unwrap_or(r.count);
            let part = |x: &[f64]| -> Vec<f64> {
                match r.cycle {
                    Some(_) => r.period_mean(j, &x[data.span(0)]),
                    None => x[data.span(0)].to_vec(),
                }
            };
            let (q, v) = r.state(j);
            let fitted = data.fitted;
            let [b, a] = [&before[j], &after[j]].map(|e| spectrum(&e[..fitted]));
            let spectrum = (0..=LINES)
                .map(|l| {
                    let f = l as f64 / (2.0 * r.dt * LINES as f64);
                    let amplitude = |p: f64| (p / LINES as f64).sqrt();
                    [
                        f,
                        amplitude(b[l]),
                        amplitude(a[l]),
                        amplitude(data.noise[j].torque[l]),
                    ]
                })
                .collect();
            let mut drift = Vec::new();
            let mut clock = 0.0;
            let mut order: Vec<usize> = (0..data.records.len()).collect();
            order.sort_by_key(|k| data.records[*k].order);
            for k in order {
                let r = &data.records[k];
                let step = r.cycle.unwrap_or(r.count.div_ceil(4));
                let counted = r.counted(j);
                for (i, piece) in before[j][data.span(k)].chunks(step).enumerate() {
                    let later = &after[j][data.span(k)][i * step..][..piece.len()];
                    let of = &counted[i * step..][..piece.len()];
                    let sound = of.iter().filter(|m| **m).count().max(1);
                    let rms =
                        |x: &[f64]| (x.iter().map(|v| v * v).sum::<f64>() / sound as f64).sqrt();
                    drift.push([
                        clock + i as f64 * step as f64 * r.dt,
                        rms(piece),
                        rms(later),
                    ]);
                }
                clock += r.count as f64 * r.dt;
            }
            Trace {
                t: (0..n).map(|i| i as f64 * r.dt).collect(),
                before: part(&before[j]),
                after: part(&after[j]),
                velocity: v[..n].to_vec(),
                position: q[..n].to_vec(),
                torque: r.torque(j)[..n].to_vec(),
                spectrum,
                drift,
            }
        })
        .collect()
}
