//! Motions to choose from, all of them inside the limits: of the joints of a serial robot, of the
//! platform of a parallel one.

use crate::design::diagnostic::Checker;
use crate::design::{Settings as Design, design};
use crate::diagnose::chain;
use crate::diagnose::data::Data;
use crate::diagnose::thresholds::THRESHOLDS as T;
use crate::plant::Plant;
use crate::report::format::unit_of;
use crate::robot::Robot;
use crate::trajectory::certificate::Kind;
use crate::trajectory::{Ends, Fourier, Grid, Series, Trajectory};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Periods that a motion is run.
pub(super) const PERIODS: u32 = T.motions.periods;

/// Motions of one robot.
pub(super) struct Motions<'a> {
    plant: &'a Plant,
    /// the coordinates with their limits
    moved: Robot,
    limits: Checker,
    /// lowest and highest value of each coordinate in the fitted records
    range: Vec<[f64; 2]>,
}

impl<'a> Motions<'a> {
    pub fn new(data: &Data<'a>) -> Self {
        let plant = data.plant;
        let moved = plant.clone().with_assumed_limits().moved().clone();
        let fitted = || data.records.iter().filter(|r| r.fit);
        let range = (0..plant.coordinates())
            .map(|k| {
                let all = fitted().flat_map(|r| &r.x.q[k * r.count..(k + 1) * r.count]);
                all.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| {
                    [a.min(*v), b.max(*v)]
                })
            })
            .collect();
        Motions {
            limits: Checker::new(plant, 1.0),
            plant,
            moved,
            range,
        }
    }

    /// Designed and random motions, each inside all limits.
    pub fn first(&self, seed: u64, rng: &mut ChaCha8Rng) -> Vec<Trajectory> {
        let mut all = self.designed(seed);
        all.extend(self.random(rng));
        let inside = all
            .into_par_iter()
            .with_max_len(1)
            .filter_map(|(motion, often)| self.inside(motion, often, |_| Some(())));
        inside.map(|(_, f)| self.trajectory(f)).collect()
    }

    /// The program's own designs on two grids, each also slower.
    fn designed(&self, seed: u64) -> Vec<(Fourier, usize)> {
        let Some(harmonics) = chain::harmonics(self.plant) else {
            return Vec::new();
        };
        let grids = [Grid::Odd, Grid::Full].into_par_iter().enumerate();
        let designs = grids.with_max_len(1).filter_map(|(k, grid)| {
            let wanted = Design {
                harmonics,
                period: T.motions.period,
                grid,
                seed: seed + k as u64,
                starts: Some(1),
                ends: Ends::Free,
                // random steps go on from here, towards another criterion
                rough: true,
                ..Design::default()
            };
            // a robot that no motion of this period suits may have others
            design(self.plant, &wanted).ok()
        });
        let slowed = designs.flat_map_iter(|found| {
            T.motions.slower.map(|factor| {
                let mut motion = found.trajectory.fourier.clone();
                motion.period *= factor;
                (motion, T.motions.often[1])
            })
        });
        slowed.collect()
    }

    /// Random motions about the middle of the records.
    fn random(&self, rng: &mut ChaCha8Rng) -> Vec<(Fourier, usize)> {
        let periods = T.motions.random.iter();
        let periods = periods.flat_map(|p| [*p; T.motions.draws]);
        periods
            .filter_map(|period| {
                let joints = self.range.iter().map(|[a, b]| {
                    let mut draw = |h: u32| {
                        (b - a) / T.motions.spread / f64::from(h) * rng.random_range(-1.0..1.0)
                    };
                    Series {
                        constant: 0.5 * (a + b),
                        sin: T.motions.lines.map(&mut draw).to_vec(),
                        cos: T.motions.lines.map(&mut draw).to_vec(),
                    }
                });
                let motion =
                    Fourier::new(period, T.motions.lines.to_vec(), joints.collect()).ok()?;
                Some((motion, T.motions.often[0]))
            })
            .collect()
    }

    /// A random step from a motion: every coefficient by up to `step` of the largest of its
    /// coordinate, the middle by half of that, the period by a factor of `exp(± step)`.
    pub fn changed(&self, from: &Trajectory, step: f64, rng: &mut ChaCha8Rng) -> Fourier {
        let mut motion = from.fourier.clone();
        let mut draw = |size: f64| size * step * rng.random_range(-1.0..1.0);
        motion.period *= draw(1.0).exp();
        for s in &mut motion.joints {
            let all = s.sin.iter().chain(&s.cos);
            let size = all.fold(0.0f64, |m, v| m.max(v.abs()));
            let each = s.sin.iter_mut().chain(&mut s.cos);
            each.for_each(|v| *v += draw(size));
            s.constant += draw(0.5 * size);
        }
        motion
    }

    /// A changed motion [inside](Self::inside) all limits, with its figure.
    pub fn kept(
        &self,
        motion: Fourier,
        figure: impl Fn(&Fourier) -> Option<f64>,
    ) -> Option<(f64, Trajectory)> {
        let (figure, motion) = self.inside(motion, T.motions.often[1], figure)?;
        Some((figure, self.trajectory(motion)))
    }

    /// A motion shrunk about its middle until all limits hold, with its `figure`; `None` where that fails, or no figure is there when
    /// the limits of the actuators hold at samples. The proof, and collisions, take longer to look at.
    fn inside<F>(
        &self,
        mut motion: Fourier,
        often: usize,
        figure: impl Fn(&Fourier) -> Option<F>,
    ) -> Option<(F, Fourier)> {
        for _ in 0..often {
            if self.limits.sampled(&motion).unwrap_or(false) {
                let figure = figure(&motion)?;
                if self.limits.proven(&motion).unwrap_or(false) {
                    return Some((figure, motion));
                }
            }
            for s in &mut motion.joints {
                let each = s.sin.iter_mut().chain(&mut s.cos);
                each.for_each(|v| *v *= T.motions.shrink);
            }
        }
        None
    }

    fn trajectory(&self, fourier: Fourier) -> Trajectory {
        let odd = fourier.harmonics.iter().all(|h| h % 2 == 1);
        Trajectory {
            periods: PERIODS,
            ends: Ends::Free,
            grid: if odd { Grid::Odd } else { Grid::Full },
            ..Trajectory::new(&self.moved, fourier)
        }
    }

    /// Units of the coordinates.
    pub fn units(&self) -> Vec<&'static str> {
        let unit = |motion| unit_of(Kind::Position, motion);
        self.moved.joints.iter().map(|j| unit(j.motion)).collect()
    }
}
