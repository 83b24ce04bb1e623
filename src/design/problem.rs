//! One problem: the search for the best motion, and its certificate.

use super::criterion::{Objective, Targets};
use super::information::Information;
use super::limits::Limits;
use super::path::{PathLimits, PathMemory};
use super::record::{Record, Status};
use super::result::{Control, Design, Progress};
use super::rounds::{ROUND, Search};
use super::settings::Settings;
use super::solve::Task;
use super::start;
use crate::dynamics::Samples;
use crate::error::{Error, Result};
use crate::plant::Plant;
use crate::trajectory::{Basis, Fourier, Trajectory};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// Shares of the limits along the path within which the search is repeated, one after the other,
/// when the certificate refuses its result: samples miss peaks that lie between them.
const TIGHTER: [f64; 4] = [1.0, 0.97, 0.9, 0.8];

/// The first search whose result is certified. Every other result is dropped: the error says which
/// limit the first one broke, and by how much.
pub(super) fn first_certified(
    mut search: impl FnMut(f64) -> Result<Result<Design, String>>,
) -> Result<Design> {
    let mut refused = None;
    for tighter in TIGHTER {
        match (search(tighter), &refused) {
            (Ok(Ok(design)), _) => return Ok(design),
            (Ok(Err(why)), None) => refused = Some(why),
            (Ok(Err(_)), Some(_)) => {}
            (Err(e), None) => return Err(e),
            (Err(_), Some(_)) => break,
        }
    }
    Err(Error::Infeasible(refused.unwrap_or_default()))
}

/// Steps by which a motion is shrunk until it is certified: to 82 % of its size at most.
const SHRINKS: usize = 100;

/// One problem.
pub(super) struct Problem<'a> {
    pub plant: &'a Plant,
    /// the same robot without the load that it carries, where it also runs so
    pub empty: Option<&'a Plant>,
    pub settings: &'a Settings,
    pub basis: &'a Basis,
    pub info: &'a Information<'a>,
    pub limits: Limits,
    pub path: Option<&'a dyn PathLimits>,
    /// where parameters that are known are counted
    pub targets: Option<Targets>,
}

impl Problem<'_> {
    /// The best trajectory that was found and certified, or what is broken in the best one.
    pub fn solve(&self, begin: Instant, control: &Control) -> Result<Result<Design, String>> {
        let Control { cancel, progress } = control;
        let (settings, robot) = (self.settings, self.plant.moved());
        let (starts, time_limit) = settings.budget();
        let deadline = begin + Duration::from_secs_f64(time_limit.min(1e8));
        let scale = start::scales(robot, settings.period);
        let objective = Objective {
            criterion: settings.criterion,
            condition: settings.condition,
            targets: self.targets.clone(),
        };
        let task = Task {
            info: self.info,
            objective: &objective,
            limits: &self.limits,
            path: self.path,
            scale: &scale,
            deadline: time_limit.is_finite().then_some(deadline),
        };
        let halt = || cancel.load(Ordering::Relaxed) || Instant::now() >= deadline;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(settings.threads)
            .build()
            .map_err(|e| Error::Argument(format!("threads: {e}")))?;
        let source = start::Source {
            robot,
            basis: self.basis,
            task: &task,
            seed: settings.seed,
            rough: settings.rough,
            postures: pool.install(|| start::holding(&task, self.basis)),
        };
        let mut search = Search::default();
        pool.install(|| -> Result<()> {
            while search.next < starts && (search.best.is_none() || !halt()) {
                search.round(&source, starts, &halt, &|done, best| {
                    progress(Progress {
                        starts: done,
                        planned: (starts < usize::MAX).then_some(starts),
                        best: best.exp(),
                        seconds: begin.elapsed().as_secs_f64(),
                    });
                })?;
                if search.best.is_none() && search.next >= 8 * ROUND.0 {
                    break;
                }
            }
            Ok(())
        })?;
        let status = match (cancel.load(Ordering::Relaxed), halt()) {
            (true, _) => Status::Interrupted,
            (_, true) => Status::TimeLimit,
            _ => Status::Converged,
        };
        let Some((best, iterate)) = search.best else {
            return Err(Error::Infeasible(self.infeasible()));
        };
        let fourier = match self.settle(&iterate.x)? {
            Ok(fourier) => fourier,
            Err(broken) => {
                return Ok(Err(format!(
                    "{}: no trajectory inside all limits was found: the best one has {broken}; raise that \
                     limit, lower --derate, or choose a start posture or another --seed",
                    self.plant.name()
                )));
            }
        };
        let trajectory = Trajectory {
            space: self.plant.space(),
            periods: settings.periods,
            ends: settings.ends,
            grid: settings.grid,
            settings: serde_json::to_value(settings).unwrap_or_default(),
            ..Trajectory::new(robot, fourier)
        };
        let record = Record {
            settings: settings.clone(),
            status,
            starts: search.starts,
            best,
            seconds: begin.elapsed().as_secs_f64(),
        };
        Ok(Ok(Design {
            plant: self.plant.clone(),
            trajectory,
            value: iterate.value.exp(),
            record,
        }))
    }

    /// Rounds off: end conditions to the last digit, and the motion shrunk by thousandths while the
    /// certificate, what happens between the samples included, finds anything: about its rest, then
    /// (a rest that needs more torque than the motion makes it worse) about its own mean.
    /// Otherwise what is broken in the motion as it came.
    fn settle(&self, x: &[f64]) -> Result<Result<Fourier, String>> {
        let first = self.basis.fourier(self.settings.period, x);
        let Some(found) = self.broken(&first)? else {
            return Ok(Ok(first));
        };
        let m = self.basis.free();
        let rest = (0..self.plant.coordinates()).flat_map(|j| self.limits.rest_parameters(j));
        let mean = (0..self.plant.coordinates()).flat_map(|j| {
            let mut c = self.basis.coefficients(j, &x[j * m..(j + 1) * m]);
            c.rows_range_mut(1..).fill(0.0);
            self.basis.parameters(j, c.as_slice()).as_slice().to_vec()
        });
        for centre in [rest.collect::<Vec<f64>>(), mean.collect()] {
            let mut x = x.to_vec();
            for _ in 0..SHRINKS {
                x.iter_mut()
                    .zip(&centre)
                    .for_each(|(x, r)| *x = r + 0.998 * (*x - r));
                let fourier = self.basis.fourier(self.settings.period, &x);
                if self.broken(&fourier)?.is_none() {
                    return Ok(Ok(fourier));
                }
            }
        }
        Ok(Err(found))
    }

    /// The limit that a motion breaks at some time, in words.
    fn broken(&self, fourier: &Fourier) -> Result<Option<String>> {
        let derate = self.settings.derate;
        if let Some(broken) = self.plant.certify_limits(fourier, derate)?.broken() {
            return Ok(Some(broken));
        }
        if let Some(broken) = self.plant.certify(fourier, derate)?.broken() {
            return Ok(Some(broken));
        }
        match self.empty {
            Some(plant) => Ok(plant.certify(fourier, derate)?.broken()),
            None => Ok(None),
        }
    }

    /// Why there is no feasible trajectory.
    fn infeasible(&self) -> String {
        let name = self.plant.name();
        match self.path.and_then(|path| self.broken_at_rest(path)) {
            Some(broken) => format!(
                "{name}: no feasible trajectory: {broken}; check masses, gravity, the limits and what \
                 stands around, or choose {} start posture",
                match self.settings.start {
                    Some(_) => "another",
                    None => "a",
                }
            ),
            None => format!(
                "{name}: no trajectory that keeps the limits was found to excite every parameter; \
                 check masses, inertias, the limits and the start posture",
            ),
        }
    }

    /// The limit that is broken at rest in the best posture that is known, in words; `None` where none is.
    fn broken_at_rest(&self, path: &dyn PathLimits) -> Option<String> {
        let mut motion = Samples::default();
        let known = path.postures();
        let (x, place) = match &self.settings.start {
            None if !known.is_empty() => (
                self.best(path, known)?,
                format!("in the best of {} postures free of contact", known.len()),
            ),
            start => {
                let joints = 0..self.plant.coordinates();
                let place = match start {
                    Some(_) => "in the start posture",
                    None => "in the middle of its range",
                };
                let rest = joints.flat_map(|j| self.limits.rest_parameters(j));
                (rest.collect(), place.into())
            }
        };
        self.info.sample(&x, &mut motion);
        let broken = path.broken(self.info, &x, &motion);
        (!broken.is_empty()).then(|| format!("at rest {place} {broken}"))
    }

    /// Of these postures the one that uses least of the limits at rest, as free numbers.
    fn best(&self, path: &dyn PathLimits, postures: &[Vec<f64>]) -> Option<Vec<f64>> {
        let (mut motion, mut memory) = (Samples::default(), PathMemory::default());
        let all = postures.iter().map(|posture| {
            let x = start::standing(self.basis, posture);
            self.info.sample(&x, &mut motion);
            let used = path.used(self.info, &x, &motion, &mut memory);
            (if used.is_nan() { f64::INFINITY } else { used }, x)
        });
        all.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, x)| x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_refused_is_searched_again_and_then_an_error() {
        let mut tried = Vec::new();
        let found = first_certified(|tighter| {
            tried.push(tighter);
            Ok(Err(format!("torque of j2 at {} %", 106.5 * tighter)))
        });
        assert_eq!(tried, TIGHTER);
        let message = found.unwrap_err().to_string();
        assert_eq!(message, "torque of j2 at 106.5 %");
        let mut count = 0;
        let found = first_certified(|_| {
            count += 1;
            match count {
                1 => Ok(Err("first".into())),
                _ => Err(Error::Infeasible("nothing inside".into())),
            }
        });
        assert_eq!(
            (count, found.unwrap_err().to_string()),
            (2, "first".to_string())
        );
    }
}
