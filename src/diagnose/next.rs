//! What to run next: the motion that tells two effects apart.
//!
//! Two effects look alike where their projected columns point the same way. With the effect `A` that is
//! believed, `a = R^½ Z_A η_A`, and the columns `B` of its rival, the share of `A` that `B` can imitate is
//!
//! ```text
//! overlap = bᵀ S_B⁻¹ b / aᵀa,   b = Z_Bᵀ R Z_A η_A
//! ```
//!
//! The distinguishable part, `(1 − overlap) aᵀa`, is the non-centrality of the test between the two:
//! the criterion of T-optimal design (Atkinson & Fedorov 1975). Motions come from the program's own
//! optimiser with several grids and seeds, each also run slower; the best is improved by random steps of
//! its coefficients that keep inside all limits.

use super::catalogue::{Context, Effect};
use super::data::Data;
use super::evidence::Evidence;
use super::record::Record;
use super::{Finding, Settings};
use crate::design::{Settings as Design, design, with_assumed_limits};
use crate::dynamics::Tree;
use crate::error::Result;
use crate::identifiability::certificate;
use crate::plant::Plant;
use crate::trajectory::{Fourier, Grid, Trajectory};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// The next experiment.
#[derive(Debug, Clone)]
pub struct Proposal {
    /// the two effects
    pub separates: Vec<&'static str>,
    /// the motion
    pub trajectory: Trajectory,
    /// overlap in the records at hand, and predicted for the motion
    pub overlap: [f64; 2],
    /// why this pair
    pub why: String,
}

/// Samples of a trial motion.
const SAMPLES: usize = 1500;

struct Trial<'a> {
    plant: &'a Plant,
    data: &'a Data<'a>,
    cx: &'a Context<'a>,
    a: (&'a dyn Effect, &'a Finding),
    b: (&'a dyn Effect, &'a Finding),
}

impl Trial<'_> {
    /// A record of three periods of a motion, without torques.
    fn record(&self, motion: &Fourier) -> Record {
        let n = motion.dof();
        let dt = (motion.period / SAMPLES as f64).max(self.data.records[0].dt);
        let count = (motion.period / dt).round() as usize;
        let dt = motion.period / count as f64;
        let mut x = crate::dynamics::Samples::zeros(n, count);
        let (mut q, mut qd, mut qdd) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        for i in 0..count {
            motion.evaluate(i as f64 * dt, [&mut q, &mut qd, &mut qdd]);
            for j in 0..n {
                x.q[j * count + i] = q[j];
                x.qd[j * count + i] = qd[j];
                x.qdd[j * count + i] = qdd[j];
            }
        }
        Record {
            name: "next".into(),
            fit: true,
            dt,
            count,
            cycle: Some(count),
            actuators: x.clone(),
            x,
            tau: vec![0.0; n * count],
            position_noise: vec![0.0; n],
            band: 20.0,
            order: 0,
            remarks: Vec::new(),
        }
    }

    /// Overlap of the two effects in a motion; `None` where the believed effect hardly shows.
    fn overlap(&self, motion: &Fourier) -> Option<f64> {
        let record = self.record(motion);
        let noise = Some(self.data.noise.clone());
        let data = Data::with_noise(self.plant, vec![record], noise).ok()?;
        let evidence = Evidence::new(&data, 1.0);
        let phi = self.cx.phi[..data.parameters.len()].to_vec();
        let cx = Context::new(&data, phi).ok()?;
        let of = |(effect, f): (&dyn Effect, &Finding)| {
            let columns = effect.columns(&cx, &f.place, &f.shape, false);
            (!columns.is_empty()).then(|| evidence.project(&columns))
        };
        let (a, b) = (of(self.a)?, of(self.b)?);
        let eta = &self.a.1.eta;
        if eta.len() != a.z.len() {
            return None;
        }
        let k = eta.len();
        let seen: f64 = (0..k)
            .map(|i| (0..k).map(|m| eta[i] * a.s[(i, m)] * eta[m]).sum::<f64>())
            .sum();
        // a motion in which the effect is lost in the noise separates nothing
        (seen > 0.05 * data.fitted as f64).then(|| evidence.overlap(&a, eta, &b))
    }
}

/// Designs the next motion, where the first two findings are not told apart.
///
/// # Errors
/// A robot that cannot be moved within its limits.
pub fn propose(
    plant: &Plant,
    data: &Data,
    cx: &Context,
    effects: &[Box<dyn Effect>],
    findings: &[Finding],
    settings: &Settings,
) -> Result<Option<Proposal>> {
    let Plant::Serial(robot) = plant else {
        return Ok(None);
    };
    let Some(main) = findings.iter().find(|f| f.member && f.confidence > 0.02) else {
        return Ok(None);
    };
    let rival = findings
        .iter()
        .find(|f| !f.member && f.effect != main.effect && f.confidence > 0.08 * main.confidence);
    let Some(rival) = rival else {
        return Ok(None);
    };
    let of = |f: &Finding| {
        effects
            .iter()
            .find(|e| e.card().name == f.effect)
            .map(|e| e.as_ref())
    };
    let (Some(a), Some(b)) = (of(main), of(rival)) else {
        return Ok(None);
    };
    let trial = Trial {
        plant,
        data,
        cx,
        a: (a, main),
        b: (b, rival),
    };
    let evidence = Evidence::new(data, 1.0);
    let project =
        |e: &dyn Effect, f: &Finding| evidence.project(&e.columns(cx, &f.place, &f.shape, false));
    let now = evidence.overlap(&project(a, main), &main.eta, &project(b, rival));
    drop(evidence);

    let begin = Instant::now();
    let left = || settings.next_seconds - begin.elapsed().as_secs_f64();
    let limited = with_assumed_limits(robot);
    let tree = Tree::new(&limited);
    let mut best: Option<(f64, Trajectory)> = None;
    let mut consider = |trajectory: Trajectory| {
        if let Some(o) = trial.overlap(&trajectory.fourier)
            && best.as_ref().is_none_or(|b| o < b.0)
        {
            best = Some((o, trajectory));
        }
    };
    for (k, grid) in [Grid::Odd, Grid::Full].into_iter().enumerate() {
        let wanted = Design {
            harmonics: 5,
            period: 8.0,
            periods: 3,
            grid,
            seed: settings.seed + k as u64,
            starts: Some(1),
            time_limit: Some((settings.next_seconds / 4.0).max(0.5)),
            ends: crate::trajectory::Ends::Free,
            ..Design::default()
        };
        let Ok(found) = design(robot, &wanted, &AtomicBool::new(false), &|_| {}) else {
            continue;
        };
        for slower in [1.0, 2.5, 6.0] {
            let mut t = found.trajectory.clone();
            t.fourier.period *= slower;
            consider(t);
        }
    }
    // and from the positions of the records, small enough to be inside all limits
    let mut rng = ChaCha8Rng::seed_from_u64(settings.seed);
    for period in [4.0, 10.0, 24.0] {
        let joints = data
            .range
            .iter()
            .map(|[a, b]| {
                let mut draw = |h: f64| (b - a) / 3.0 / h * rng.random_range(-1.0..1.0);
                crate::trajectory::Series {
                    constant: 0.5 * (a + b),
                    sin: [1.0, 3.0, 5.0, 7.0].map(&mut draw).to_vec(),
                    cos: [1.0, 3.0, 5.0, 7.0].map(&mut draw).to_vec(),
                }
            })
            .collect();
        let mut fourier = Fourier::new(period, vec![1, 3, 5, 7], joints)?;
        for _ in 0..16 {
            if certificate(&limited, &tree, &fourier).is_ok_and(|c| c.satisfied) {
                let mut t = Trajectory::new(&limited, fourier);
                t.periods = 3;
                t.grid = Grid::Odd;
                consider(t);
                break;
            }
            for s in &mut fourier.joints {
                s.sin.iter_mut().chain(&mut s.cos).for_each(|v| *v *= 0.8);
            }
        }
    }
    let Some((mut lowest, mut trajectory)) = best else {
        return Ok(None);
    };
    // random steps inside the limits
    let mut step = 0.3;
    let mut tries = 0;
    while left() > 0.0 && tries < 60 && lowest > 0.02 {
        tries += 1;
        let mut t = trajectory.clone();
        for s in &mut t.fourier.joints {
            let size = s
                .sin
                .iter()
                .chain(&s.cos)
                .fold(0.0f64, |m, v| m.max(v.abs()));
            for v in s.sin.iter_mut().chain(&mut s.cos) {
                *v += step * size * rng.random_range(-1.0..1.0);
            }
        }
        // back inside: smaller about the same middle until all limits hold
        let mut inside = false;
        for _ in 0..4 {
            if certificate(&limited, &tree, &t.fourier).is_ok_and(|c| c.satisfied) {
                inside = true;
                break;
            }
            for s in &mut t.fourier.joints {
                s.sin.iter_mut().chain(&mut s.cos).for_each(|v| *v *= 0.8);
            }
        }
        match inside.then(|| trial.overlap(&t.fourier)).flatten() {
            Some(o) if o < lowest => (lowest, trajectory) = (o, t),
            _ => step = f64::max(0.97 * step, 0.05),
        }
    }
    if lowest >= now {
        return Ok(None);
    }
    Ok(Some(Proposal {
        separates: vec![main.effect, rival.effect],
        why: format!(
            "{} on {} and {} explain the records at hand almost equally well; in the proposed motion {} could \
             imitate {:.0} % of it instead of {:.0} %",
            main.title,
            match main.joints.is_empty() {
                true => "the whole robot".to_string(),
                false => main.joints.join(", "),
            },
            rival.title,
            rival.title,
            100.0 * lowest,
            100.0 * now
        ),
        trajectory,
        overlap: [now, lowest],
    }))
}
