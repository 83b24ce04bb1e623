//! Mean and scatter of the periods of a signal, over the samples that were measured.

/// Mean period of a signal, over measured samples; `None` where no period has one.
pub fn means(x: &[f64], measured: &[bool], cycle: usize) -> Vec<Option<f64>> {
    (0..cycle)
        .map(|i| {
            let all = (i..x.len()).step_by(cycle).filter(|k| measured[*k]);
            let (sum, count) = all.fold((0.0, 0usize), |(s, n), k| (s + x[k], n + 1));
            (count > 0).then(|| sum / count as f64)
        })
        .collect()
}

/// Measured samples less phases of the period that have any.
pub fn freedoms(measured: &[bool], cycle: usize) -> usize {
    let all = measured.iter().filter(|m| **m).count();
    let any = |i: &usize| (*i..measured.len()).step_by(cycle).any(|k| measured[k]);
    all - (0..cycle).filter(any).count()
}

/// Puts the mean of the other periods in the place of what was not measured.
pub fn repeat(x: &mut [f64], measured: &[bool], cycle: usize) {
    let mean = means(x, measured, cycle);
    for (i, x) in x.iter_mut().enumerate().filter(|(i, _)| !measured[*i]) {
        if let Some(m) = mean[i % cycle] {
            *x = m;
        }
    }
}

/// Takes the neighbourhood of what was not measured out, too, as far as the motion there rests on it:
/// of a motion that repeats only where no period knows better.
pub fn widen(measured: &mut [bool], cycle: Option<usize>, reach: usize) {
    let count = measured.len();
    let holes: Vec<usize> = match cycle {
        Some(c) => (0..c)
            .filter(|i| (*i..count).step_by(c).all(|k| !measured[k]))
            .flat_map(|i| (i..count).step_by(c))
            .collect(),
        None => (0..count).filter(|i| !measured[*i]).collect(),
    };
    for i in holes {
        measured[i.saturating_sub(reach)..(i + reach + 1).min(count)].fill(false);
    }
}

/// Variance between periods by actuator: an estimate of the variance of one sample. `free` are the
/// freedoms of each.
pub fn scatter(x: &[f64], n: usize, count: usize, cycle: usize, free: usize) -> Vec<f64> {
    let periods = count / cycle;
    (0..n)
        .map(|j| {
            let row = &x[j * count..(j + 1) * count];
            let mut sum = 0.0;
            for i in 0..cycle {
                let mean = (0..periods).map(|p| row[p * cycle + i]).sum::<f64>() / periods as f64;
                sum += (0..periods)
                    .map(|p| (row[p * cycle + i] - mean).powi(2))
                    .sum::<f64>();
            }
            sum / free.max(1) as f64
        })
        .collect()
}
