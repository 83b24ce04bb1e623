//! A whole move: the direct leg where it is free, otherwise legs through postures at rest.

use super::guard::{Blocked, Guard, Line};
use super::leg::Leg;
use super::limits::{by_position, inside, limits, raised, scaled, still_at};
use super::load::{all_bounds, bearable, peaks, tool};
use super::most::Most;
use super::moving::{braked, through};
use super::planner::{Found, search};
use super::profile::Profile;
use super::{JointPeaks, Move, Settings, State, check, rest};
use crate::collision::scene::Scene;
use crate::error::{Error, Result};
use crate::plant::Plant;
use crate::robot::{Limits, Motion};

/// Shares of the limits, relative to the one asked for, that legs with an end in motion are tried with.
const SHARES: [f64; 8] = [1.0, 0.5, 0.25, 1.5, 2.0, 3.0, 5.0, 10.0];
/// Times that the duration is adapted to the samples.
const ALIGNED: usize = 4;
/// Pairs that a message names.
const NAMED: usize = 3;

/// Why a leg cannot be.
enum Refusal {
    /// the motion leaves a limit, or there is none
    Motion(String),
    /// sampled limits
    Load(Most),
    /// something is in the way
    Blocked(Blocked),
}

struct Planner<'a> {
    plant: &'a Plant,
    full: Vec<Limits>,
    low: Vec<Limits>,
    settings: &'a Settings,
    guard: Option<Guard<'a>>,
}

/// [`Move::plan`].
pub fn plan(
    plant: &Plant,
    from: &State,
    to: &State,
    settings: &Settings,
    scene: Option<&Scene>,
) -> Result<Move> {
    check(settings)?;
    let (full, warnings) = limits(plant)?;
    inside(plant, &full, "start", from)?;
    inside(plant, &full, "target", to)?;
    let planner = Planner {
        plant,
        low: scaled(&full, settings.scale),
        full,
        settings,
        guard: scene.map(|s| Guard::new(plant.robot(), s)),
    };
    planner.untouched("start", &from.q)?;
    planner.untouched("target", &to.q)?;
    let (mut legs, tries) = planner.legs(from, to)?;
    planner.align(&mut legs)?;
    let mut found = planner.assembled(from, to, legs, tries)?;
    found.warnings = warnings;
    Ok(found)
}

impl Planner<'_> {
    /// Whether a posture keeps clear of everything.
    fn untouched(&self, which: &str, q: &[f64]) -> Result<()> {
        let Some(guard) = &self.guard else {
            return Ok(());
        };
        match guard.touching(q) {
            None => Ok(()),
            Some(blocked) => Err(guard.refused(which, blocked)),
        }
    }

    /// A leg that keeps all limits and touches nothing.
    fn accepted(&self, leg: Leg) -> Result<Result<Leg, Refusal>> {
        let leg = match by_position(&self.full, &self.plant.coordinate_names(), leg) {
            Ok(leg) => leg,
            Err(why) => return Ok(Err(Refusal::Motion(why))),
        };
        if let Some(guard) = &self.guard
            && let Err(blocked) = guard.free(&leg)
        {
            return Ok(Err(Refusal::Blocked(blocked)));
        }
        Ok(bearable(self.plant, &leg)?.map_err(Refusal::Load))
    }

    /// From one posture at rest to another, each joint by its own fastest motion.
    fn resting(&self, from: &[f64], to: &[f64]) -> Result<Result<Leg, Refusal>> {
        let leg = Leg::new(
            rest::fastest(from, to, &self.low),
            self.settings.scale,
            true,
        );
        self.accepted(leg)
    }

    /// A leg one of whose ends moves, with the share of the limits nearest to the one asked for.
    fn moving(
        &self,
        ends: impl Fn(&[Limits]) -> Option<(State, State)>,
    ) -> Result<Result<(Leg, State, State), Refusal>> {
        let mut why = Refusal::Motion("no motion was found".into());
        for share in SHARES {
            let scale = share * self.settings.scale;
            if scale > 1.0 && share > 1.0 {
                let last = why;
                return self.moving_at(1.0, &ends).map(|r| r.map_err(|_| last));
            }
            match self.moving_at(scale, &ends)? {
                Ok(found) => return Ok(Ok(found)),
                Err(refusal) => why = refusal,
            }
        }
        Ok(Err(why))
    }

    fn moving_at(
        &self,
        scale: f64,
        ends: &impl Fn(&[Limits]) -> Option<(State, State)>,
    ) -> Result<Result<(Leg, State, State), Refusal>> {
        let low = scaled(&self.full, scale);
        let none = || Refusal::Motion("no posture at rest was found near the motion".into());
        let Some((from, to)) = ends(&low) else {
            return Ok(Err(none()));
        };
        let bounds = raised(&low, &self.full, &from, &to);
        let profiles = match through(&from, &to, &bounds) {
            Ok(profiles) => profiles,
            Err(e) => return Ok(Err(Refusal::Motion(e))),
        };
        let leg = self.accepted(Leg::new(profiles, scale, false))?;
        Ok(leg.map(|leg| (leg, from, to)))
    }

    /// The legs, and how many postures the search tried.
    fn legs(&self, from: &State, to: &State) -> Result<(Vec<Leg>, usize)> {
        let resting = from.is_rest() && to.is_rest();
        if resting && from.q == to.q {
            return Ok((Vec::new(), 0));
        }
        let direct = match resting {
            true => self.resting(&from.q, &to.q)?,
            false => self
                .moving(|_| Some((from.clone(), to.clone())))?
                .map(|(leg, ..)| leg),
        };
        match direct {
            Ok(leg) => return Ok((vec![leg], 0)),
            Err(Refusal::Load(most)) if resting => return Err(self.unbearable(&most)),
            Err(Refusal::Motion(why)) if resting => return Err(self.impossible(&why)),
            Err(_) => {}
        }
        // out of the motion, through postures at rest, into the motion
        let (mut first, mut last) = (Vec::new(), Vec::new());
        let (mut a, mut b) = (from.q.clone(), to.q.clone());
        if !from.is_rest() {
            let out = self.moving(|l| {
                let l = raised(l, &self.full, from, from);
                Some((from.clone(), State::rest(&braked(from, &l, false)?)))
            })?;
            let (leg, _, end) = out.map_err(|r| self.unreached("out of", "from its end", r))?;
            (a, first) = (end.q, vec![leg]);
        }
        if !to.is_rest() {
            let into = self.moving(|l| {
                let l = raised(l, &self.full, to, to);
                Some((State::rest(&braked(to, &l, true)?), to.clone()))
            })?;
            let (leg, begin, _) = into.map_err(|r| self.unreached("into", "to its start", r))?;
            (b, last) = (begin.q, vec![leg]);
        }
        let (postures, tries) = self.way(&a, &b)?;
        for ends in postures.windows(2) {
            first.push(self.leg_of_way(&ends[0], &ends[1])?);
        }
        first.append(&mut last);
        Ok((first, tries))
    }

    /// A leg of a way whose straight lines are free: the fastest one where that is free, too.
    fn leg_of_way(&self, from: &[f64], to: &[f64]) -> Result<Leg> {
        if let Ok(leg) = self.resting(from, to)? {
            return Ok(leg);
        }
        let leg = Leg::new(
            rest::straight(from, to, &self.low),
            self.settings.scale,
            true,
        );
        let leg = by_position(&self.full, &self.plant.coordinate_names(), leg)
            .map_err(|why| self.impossible(&why))?;
        bearable(self.plant, &leg)?.map_err(|most| self.unbearable(&most))
    }

    /// Makes the longest leg at rest slower, so that the whole lasts a whole number of steps.
    fn align(&self, legs: &mut [Leg]) -> Result<()> {
        let Some(rate) = self.settings.rate else {
            return Ok(());
        };
        // torques may change with the speed, and ask for more time
        for _ in 0..ALIGNED {
            let total: f64 = legs.iter().map(|leg| leg.duration).sum();
            let extra = (total * rate - 1e-6).ceil() / rate - total;
            let resting = legs.iter_mut().filter(|leg| leg.resting);
            let longest = resting.max_by(|a, b| a.duration.total_cmp(&b.duration));
            let Some(leg) = longest.filter(|leg| extra > 1e-12 && leg.duration > 0.0) else {
                return Ok(());
            };
            let slower = Leg {
                slowed: leg.slowed,
                ..leg.stretched(1.0 + extra / leg.duration)
            };
            *leg = bearable(self.plant, &slower)?.map_err(|most| self.unbearable(&most))?;
        }
        Ok(())
    }

    /// Postures of a way between two postures, both included, and how many were tried.
    fn way(&self, from: &[f64], to: &[f64]) -> Result<(Vec<Vec<f64>>, usize)> {
        let ends = |via: Vec<Vec<f64>>| {
            let mut all = vec![from.to_vec()];
            all.extend(via);
            all.push(to.to_vec());
            all
        };
        let Some(guard) = &self.guard else {
            return Ok((ends(Vec::new()), 0));
        };
        if guard.free(&Line { from, to }).is_ok() {
            return Ok((ends(Vec::new()), 0));
        }
        let span = self.span(from, to);
        let tries = self.settings.tries;
        let found = search(guard, &span, from, to, tries, self.settings.seed);
        match found.via {
            Some(via) => Ok((ends(via), found.tries)),
            None => Err(self.no_way(guard, &found)),
        }
    }

    /// The box in which postures are looked for: the position limits, or what lies about the ends.
    fn span(&self, from: &[f64], to: &[f64]) -> Vec<[f64; 2]> {
        let joints = self.plant.moved().joints.iter();
        let ends = from.iter().zip(to);
        joints
            .zip(ends)
            .map(|(joint, (a, b))| {
                let room = match joint.motion {
                    Motion::Revolute => std::f64::consts::PI,
                    Motion::Prismatic => 0.5,
                };
                let [low, high] = joint.limits.position;
                let limited =
                    |limit: f64, other: f64| if limit.is_finite() { limit } else { other };
                [
                    limited(low, a.min(*b) - room),
                    limited(high, a.max(*b) + room),
                ]
            })
            .collect()
    }

    fn no_way(&self, guard: &Guard, found: &Found) -> Error {
        let total: usize = found.blocked.iter().map(|(_, count)| count).sum();
        let pairs: Vec<String> = (found.blocked.iter().take(NAMED))
            .map(|(pair, count)| {
                let share = 100.0 * *count as f64 / total.max(1) as f64;
                format!("{} ({share:.0} % of the blocked lines)", guard.names(*pair))
            })
            .collect();
        Error::Infeasible(format!(
            "no way free of collisions was found between the two postures after {} random postures; \
             in the way are {}; choose another posture, move what is in the way, or ask for more tries",
            found.tries,
            pairs.join(", ")
        ))
    }

    fn impossible(&self, why: &str) -> Error {
        Error::Infeasible(format!(
            "robot {:?} cannot make this move: {why}; choose another posture",
            self.plant.name()
        ))
    }

    fn unbearable(&self, most: &Most) -> Error {
        Error::Infeasible(format!(
            "the move of robot {:?} exceeds a limit however slow it is: {}; choose another posture, \
             or correct the limit in the robot file",
            self.plant.name(),
            most.what
        ))
    }

    fn unreached(&self, how: &str, which: &str, why: Refusal) -> Error {
        let why = match (why, &self.guard) {
            (Refusal::Motion(e), _) => e,
            (Refusal::Load(most), _) => most.what,
            (Refusal::Blocked(b), Some(guard)) => {
                format!(
                    "in the way: {}, at {:.4} m",
                    guard.names(b.pair),
                    b.distance
                )
            }
            (Refusal::Blocked(_), None) => "something is in the way".into(),
        };
        Error::Infeasible(format!(
            "robot {:?} has no way {how} the motion {which} within all limits ({why}); design the \
             trajectory with ends at rest",
            self.plant.name()
        ))
    }

    /// The move of its legs, with what is known of it.
    fn assembled(&self, from: &State, to: &State, legs: Vec<Leg>, tries: usize) -> Result<Move> {
        let via = legs.iter().skip(1).map(|leg| {
            let begin = leg.profiles.iter().map(|p| p.at(0.0)[0]);
            begin.collect::<Vec<f64>>()
        });
        let still = |q: &f64| Profile::still(*q, 0.0);
        let whole = match legs.is_empty() {
            true => vec![Leg::new(
                from.q.iter().map(still).collect(),
                self.settings.scale,
                true,
            )],
            false => legs.clone(),
        };
        let names = self.plant.coordinate_names();
        let joints = names.into_iter().zip(&self.full).enumerate();
        let joints = joints.map(|(k, (joint, l))| {
            let mut all = whole.iter().map(|leg| leg.profiles[k].peaks());
            let mut most = all.next().unwrap_or_default();
            for p in all {
                most.position[0] = most.position[0].min(p.position[0]);
                most.position[1] = most.position[1].max(p.position[1]);
                most.velocity = most.velocity.max(p.velocity);
                most.acceleration = most.acceleration.max(p.acceleration);
                most.jerk = most.jerk.max(p.jerk);
            }
            JointPeaks {
                joint,
                peaks: most,
                used: [
                    most.velocity / l.velocity,
                    most.acceleration / l.acceleration,
                    most.jerk / l.jerk,
                ],
                velocity_by_position: l.velocity_by_position.map(|v| {
                    let each = whole
                        .iter()
                        .map(|leg| leg.profiles[k].share(&v, still_at(l)));
                    each.fold(0.0, f64::max)
                }),
            }
        });
        let bounds = all_bounds(self.plant, &whole)?;
        let mut found = Move {
            duration: whole.iter().map(|leg| leg.duration).sum(),
            from: from.clone(),
            to: to.clone(),
            via: via.collect(),
            joints: joints.collect(),
            torques: peaks(self.plant, &whole, &bounds)?,
            tool: tool(self.plant, &whole, &bounds),
            slowed: whole.iter().map(|leg| leg.slowed).fold(1.0, f64::max),
            scale: whole.iter().map(|leg| leg.scale).fold(0.0, f64::max),
            closed: bounds.closed.map(Into::into),
            clearance: None,
            tries,
            warnings: Vec::new(),
            legs: whole,
        };
        if let Some(guard) = &self.guard {
            found.clearance = guard.least(&found);
        }
        Ok(found)
    }
}
