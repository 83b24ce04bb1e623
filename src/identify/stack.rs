//! The filtered equations of a record: `W_b π = τ`, built in blocks of time.

use crate::base::BaseParameters;
use crate::dynamics::Samples;
use crate::error::Result;
use crate::log::Purpose;
use crate::plant::Plant;
use crate::regressor::sign;
use crate::signals::Prepared;
use faer::Mat;
use rayon::prelude::*;

/// Equations of one record, actuator-major: row `a·count + k`.
#[derive(Debug, Clone)]
pub struct Stack {
    /// name of the record
    pub name: String,
    /// what it is for
    pub purpose: Purpose,
    /// actuators
    pub actuators: usize,
    /// samples after filtering and decimation
    pub count: usize,
    /// their rate, Hz
    pub rate: f64,
    /// samples as recorded that one of them stands for
    pub stands_for: f64,
    /// times of the samples, s
    pub time: Vec<f64>,
    /// columns kept as base parameters, filtered
    pub w: Mat<f64>,
    /// measured torque, filtered
    pub measured: Vec<f64>,
    /// the known part of the torque, filtered
    pub known: Vec<f64>,
    /// equations that do not count and are zero, in the order of the rows
    pub left_out: Vec<bool>,
}

/// Samples of the motion that a thread works on at least: few enough for what they make to stay near the processor.
const BLOCK: usize = 512;

/// A block of outputs: their columns one after the other, and the known torque.
struct Part {
    w: Vec<f64>,
    known: Vec<f64>,
}

impl Stack {
    /// The equations of a prepared record. The regressor is never held at full rate for more than a
    /// few thousand samples.
    ///
    /// # Errors
    /// A pose of a parallel robot that cannot be reached.
    pub fn new(plant: &Plant, base: &BaseParameters, p: &Prepared) -> Result<Stack> {
        Self::with_motion(plant, base, p, &p.motion)
    }

    /// The same with another motion of the same samples in the place of the measured one, as
    /// instruments need it.
    ///
    /// # Errors
    /// As [`Stack::new`].
    pub fn with_motion(
        plant: &Plant,
        base: &BaseParameters,
        p: &Prepared,
        motion: &Samples,
    ) -> Result<Stack> {
        let (n, m, b) = (p.actuators, p.outputs(), base.count());
        let jumps = plant.jumps();
        // where the columns are smooth, fewer samples hold them
        let thin = p.thin.as_ref().zip(jumps.as_deref());
        let (stride, filter) = thin.map_or((1, &p.filter), |(t, _)| (t.stride, &t.filter));
        let each = (BLOCK.max(8 * filter.reach()) / filter.factor).max(16);
        let structure = (jumps.is_some().then(|| structure(plant, base))).transpose()?;
        let holds = |a: usize, c: usize, column: &[f64]| match &structure {
            Some(all) => all[c * n + a],
            None => column.iter().any(|x| *x != 0.0),
        };
        let ranges: Vec<_> = (0..m)
            .step_by(each)
            .map(|from| from..(from + each).min(m))
            .collect();
        let parts: Vec<Part> = ranges
            .par_iter()
            .map(|range| {
                let mut inputs = filter.inputs(range.clone());
                inputs.iter_mut().for_each(|i| *i *= stride);
                let part = motion.select(&inputs);
                let w = plant.regressor_columns(&part)?;
                let outputs = range.len();
                let mut out = Part {
                    w: vec![0.0; b * n * outputs],
                    known: vec![0.0; n * outputs],
                };
                let count = inputs.len();
                for (c, to) in out.w.chunks_exact_mut(n * outputs).enumerate() {
                    let column = &w[base.kept[c] * n * count..][..n * count];
                    for a in 0..n {
                        let from = &column[a * count..(a + 1) * count];
                        if holds(a, c, from) {
                            let to = &mut to[a * outputs..(a + 1) * outputs];
                            filter.apply_part(from, range.clone(), to);
                        }
                    }
                }
                let known = match thin {
                    None => plant.known_torque(&part)?,
                    Some((_, jumps)) => {
                        let inputs = p.filter.inputs(range.clone());
                        for (c, to) in out.w.chunks_exact_mut(n * outputs).enumerate() {
                            let jump = jumps.iter().find(|j| j.0 == base.kept[c]);
                            let Some((_, joint)) = jump else { continue };
                            // one after the other: a motion that repeats is not thinned
                            let from = joint * motion.count + inputs[0];
                            let speeds = &motion.qd[from..][..inputs.len()];
                            let signs: Vec<f64> = speeds.iter().map(|v| sign(*v)).collect();
                            let to = &mut to[joint * outputs..(joint + 1) * outputs];
                            p.filter.apply_part(&signs, range.clone(), to);
                        }
                        match plant.knows_terms() {
                            true => plant.known_torque(&motion.select(&inputs))?,
                            false => return Ok(out),
                        }
                    }
                };
                let whole = known.len() / n;
                for (a, to) in out.known.chunks_exact_mut(outputs).enumerate() {
                    let from = &known[a * whole..(a + 1) * whole];
                    p.filter.apply_part(from, range.clone(), to);
                }
                Ok(out)
            })
            .collect::<Result<_>>()?;
        let mut w = Mat::zeros(n * m, b);
        let mut known = vec![0.0; n * m];
        for (range, part) in ranges.iter().zip(&parts) {
            let outputs = range.len();
            for a in 0..n {
                let to = a * m + range.start;
                let from = a * outputs;
                known[to..to + outputs].copy_from_slice(&part.known[from..from + outputs]);
                for c in 0..b {
                    let from = &part.w[c * n * outputs + a * outputs..][..outputs];
                    if holds(a, c, from) {
                        let mut to = w.as_mut().subrows_mut(to, outputs).col_mut(c);
                        to.copy_from(faer::ColRef::from_slice(from));
                    }
                }
            }
        }
        let averaged = p.periods.as_ref().map_or(1.0, |x| x.count as f64);
        Ok(Stack {
            name: p.name.clone(),
            purpose: p.purpose,
            actuators: n,
            count: m,
            rate: p.output_rate(),
            stands_for: p.filter.factor as f64 * averaged,
            time: p.output_times(),
            w,
            measured: p.filtered(&p.torque),
            known,
            left_out: vec![false; n * m],
        })
    }

    /// Leaves the equation of an actuator at a sample out: it becomes `0 = 0`.
    pub fn leave_out(&mut self, a: usize, k: usize) {
        let row = a * self.count + k;
        for c in 0..self.w.ncols() {
            self.w[(row, c)] = 0.0;
        }
        self.measured[row] = 0.0;
        self.known[row] = 0.0;
        self.left_out[row] = true;
    }

    /// Number of equations of an actuator that count.
    pub fn used(&self, a: usize) -> usize {
        self.used_within(a, self.count)
    }

    /// The same among the first samples.
    pub fn used_within(&self, a: usize, samples: usize) -> usize {
        let rows = &self.left_out[a * self.count..][..samples];
        rows.iter().filter(|out| !**out).count()
    }

    /// Number of equations that count.
    pub fn equations(&self) -> usize {
        (0..self.actuators).map(|a| self.used(a)).sum()
    }

    /// Measured torque less the known part: the right-hand side.
    pub fn tau(&self) -> Vec<f64> {
        let pairs = self.measured.iter().zip(&self.known);
        pairs.map(|(m, k)| m - k).collect()
    }

    /// Torque that base parameters predict, the known part included.
    pub fn predicted(&self, pi: &[f64]) -> Vec<f64> {
        let y = &self.w * faer::ColRef::from_slice(pi);
        (0..y.nrows()).map(|i| y[i] + self.known[i]).collect()
    }

    /// Measured less predicted torque.
    pub fn residual(&self, pi: &[f64]) -> Vec<f64> {
        let predicted = self.predicted(pi);
        let pairs = self.measured.iter().zip(predicted);
        pairs.map(|(m, p)| m - p).collect()
    }
}

/// Whether a base column holds anything in the equations of an actuator, column after column: what the links that it does not
/// move weigh it never feels. Of a tree, from two postures and motions as good as any.
fn structure(plant: &Plant, base: &BaseParameters) -> Result<Vec<bool>> {
    let mut any = Samples::zeros(plant.coordinates(), 2);
    let all = [&mut any.q, &mut any.qd, &mut any.qdd]
        .into_iter()
        .flatten();
    all.enumerate()
        .for_each(|(i, x)| *x = (1.0 + 0.7 * (i as f64).powf(1.3)).sin());
    let w = plant.regressor_columns(&any)?;
    let rows = w.len() / plant.parameters().len().max(1);
    let columns = base.kept.iter().map(|c| &w[c * rows..(c + 1) * rows]);
    let each = columns.flat_map(|column| column.chunks(any.count));
    Ok(each.map(|x| x.iter().any(|x| *x != 0.0)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn what_a_column_holds_it_holds_in_all_motions() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        for name in ["panda", "ur10", "scara", "planar2"] {
            let plant = Plant::load(name)
                .unwrap()
                .with_terms(&crate::robot::JointTerm::FRICTION);
            let base = plant.base().unwrap();
            let found = structure(&plant, &base).unwrap();
            let n = found.len() / base.count();
            let mut x = Samples::zeros(plant.coordinates(), 40);
            for all in [&mut x.q, &mut x.qd, &mut x.qdd] {
                all.iter_mut()
                    .for_each(|v| *v = rng.random_range(-2.0..2.0));
            }
            let w = plant.regressor_columns(&x).unwrap();
            for (c, kept) in base.kept.iter().enumerate() {
                for a in 0..n {
                    let column = &w[kept * n * x.count + a * x.count..][..x.count];
                    let largest = column.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                    // what rounding leaves may be zero or not
                    if largest > 1e-12 || largest == 0.0 {
                        assert_eq!(found[c * n + a], largest > 0.0, "{name}: {c} {a}");
                    }
                }
            }
            assert!(found.contains(&false), "{name}");
        }
    }
}
