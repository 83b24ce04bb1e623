//! Which pairs of a scene matter: those that can come near and can be kept apart, in many postures.

use super::mend::{LEAST, Mended, mended};
use super::scene::{Balls, LeftOut, Pair, Partner, Scene, poses};
use crate::error::{Error, Result, Warning, WarningKind};
use crate::robot::Robot;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// A pair that never has more room than this is left out: nothing can move it, m.
const HARDLY: f64 = 1e-3;
/// Room beyond which a posture is spacious, however much more there is, m.
const FAR: f64 = 0.05;
/// Two links can hardly be moved apart where their room is less than this, m …
const SLIM: f64 = 5e-3;
/// … in this part of the postures.
const NEARLY_ALL: f64 = 0.9;
/// They keep this part of their median distance.
const PART: f64 = 0.5;
/// What to do where links or their surroundings are too near.
const REMEDY: &str = "Check [[obstacle]], `floor` and `margin`, hold joints that stand still in the run, as those of a hand, with \
                      `lock`, name pairs that may touch in `ignore` (`excite new` writes a robot.toml that has all of these), \
                      or look at no collision (--no-collision)";

impl Scene {
    /// Looks at the pairs in many postures: leaves out those that no posture keeps apart, and keeps postures
    /// without contact. The room of the other pairs beyond their margin, posture by posture and pair by pair.
    pub(super) fn sample(&mut self, robot: &Robot, postures: &[Vec<f64>]) -> Vec<Vec<f64>> {
        if postures.is_empty() {
            return Vec::new();
        }
        let balls = Balls::new(self);
        let mut rooms: Vec<Vec<f64>> = postures
            .par_iter()
            .map(|q| self.rooms(robot, &balls, q))
            .collect();
        self.own_margins(&mut rooms);
        // what stands around can be too near for ever only of a body that the base carries
        let may_stay = |pair: &Pair| match pair.partner {
            Partner::Volume(_) => true,
            Partner::Obstacle(_) => {
                let body = self.volumes[pair.volume].body;
                pair.margin > 0.0 && body.is_none_or(|b| robot.bodies[b].parent.is_none())
            }
        };
        let never: Vec<bool> = (self.pairs.iter().enumerate())
            .map(|(p, pair)| may_stay(pair) && rooms.iter().all(|r| r[p] < HARDLY))
            .collect();
        let mut always: Vec<[String; 2]> = Vec::new();
        let mut out = LeftOuts(std::mem::take(&mut self.left_out));
        for (pair, _) in self.pairs.iter().zip(&never).filter(|(_, n)| **n) {
            let [a, b] = self.names(pair);
            out.add(a, b, "nearer than the margin in every posture");
            let names = [a.to_string(), b.to_string()];
            if matches!(pair.partner, Partner::Volume(_)) && !always.contains(&names) {
                always.push(names);
            }
        }
        self.left_out = out.0;
        if !always.is_empty() {
            self.warnings.push(Warning::new(
                WarningKind::CollisionNotChecked,
                "collisions",
                format!(
                    "volumes of {} are near in every posture, so that nothing is known of these: look at the \
                     meshes, state tighter [[volume]]s, or name the pair in `ignore`",
                    in_words(&always)
                ),
            ));
        }
        self.always_near = always;
        leave_out(&mut self.pairs, &never);
        rooms.iter_mut().for_each(|r| leave_out(r, &never));
        let most = |p: usize| rooms.iter().map(|r| r[p]).fold(0.0, f64::max);
        self.most = (0..self.pairs.len()).map(most).collect();
        self.free = spacious_first(free(&rooms, postures));
        rooms
    }

    /// Where few postures are free of contact, moves links apart in others. `rooms`: what [`Scene::sample`] found.
    ///
    /// # Errors
    /// No posture without contact: the pairs that are in the way.
    pub(super) fn mend(
        &mut self,
        robot: &Robot,
        postures: &[Vec<f64>],
        rooms: &[Vec<f64>],
    ) -> Result<()> {
        let mut free = free(rooms, postures);
        let mut found = mended(self, robot, postures, rooms);
        if free.is_empty() && !found.iter().any(Mended::free) {
            let best = self.narrow(robot, found);
            let best = best.map_err(|stuck| self.no_room(robot, rooms, &stuck))?;
            found = mended(self, robot, postures, rooms);
            found.push(best);
        }
        let apart = found.into_iter().filter(Mended::free);
        free.extend(apart.map(|m| (m.room, m.posture)));
        if free.is_empty() {
            return Err(self.no_room(robot, rooms, &[]));
        }
        self.free = spacious_first(free);
        Ok(())
    }

    /// Links that can hardly be moved apart keep `PART` of their median distance over the postures, where that is
    /// less than the margin and not next to nothing. `rooms`: beyond the margin, posture by posture and pair by pair.
    fn own_margins(&mut self, rooms: &mut [Vec<f64>]) {
        let mut links: BTreeMap<[String; 2], Vec<usize>> = BTreeMap::new();
        for (p, pair) in self.pairs.iter().enumerate() {
            if matches!(pair.partner, Partner::Volume(_)) {
                let names = self.names(pair).map(String::from);
                links.entry(names).or_default().push(p);
            }
        }
        let mut told = Vec::new();
        for ([a, b], pairs) in links {
            let nearest = |r: &Vec<f64>| pairs.iter().map(|p| r[*p]).fold(f64::INFINITY, f64::min);
            let mut room: Vec<f64> = rooms.iter().map(nearest).collect();
            room.sort_by(f64::total_cmp);
            let at = |part: f64| room[(part * (room.len() - 1) as f64) as usize];
            let own = PART * (self.margin + at(0.5));
            if at(NEARLY_ALL) >= SLIM || own < HARDLY || own >= self.margin {
                continue;
            }
            for &p in &pairs {
                self.pairs[p].margin = own;
                for r in rooms.iter_mut() {
                    r[p] += self.margin - own;
                }
            }
            told.push(format!("{a} and {b} {:.1} mm", 1e3 * own));
        }
        if !told.is_empty() {
            self.warnings.push(Warning::new(
                WarningKind::MarginReduced,
                "collisions",
                format!(
                    "links that can hardly be moved apart keep half of their median distance instead of {:.1} mm: {}",
                    1e3 * self.margin,
                    told.join("; ")
                ),
            ));
        }
    }

    /// Room of every pair beyond its margin in a posture.
    fn rooms(&self, robot: &Robot, balls: &Balls, q: &[f64]) -> Vec<f64> {
        let mut at = Vec::new();
        poses(robot, q, &mut at);
        let room = |p: &Pair| match balls.lower_bound(p, &at) - p.margin {
            far if far > FAR => far,
            _ => self.separation(p, &at).distance - p.margin,
        };
        self.pairs.iter().map(room).collect()
    }

    /// Where no posture leaves every pair its margin: two links that are nearer in the best one, but apart, keep a part of the
    /// distance that they have there. The best one, with the room that it has then.
    ///
    /// # Errors
    /// In words: volumes that overlap there, or are too near to what stands around.
    fn narrow(
        &mut self,
        robot: &Robot,
        mended: Vec<Mended>,
    ) -> std::result::Result<Mended, Vec<String>> {
        let best = mended
            .into_iter()
            .min_by(|a, b| a.missing.total_cmp(&b.missing))
            .ok_or_else(Vec::new)?;
        let own = |distance: f64| (PART * distance).min(distance - LEAST);
        let rooms = self.rooms(robot, &Balls::new(self), &best.posture);
        let mut links: BTreeMap<[String; 2], f64> = BTreeMap::new();
        let mut stuck: Vec<String> = Vec::new();
        for (p, pair) in self.pairs.iter().enumerate() {
            if rooms[p] >= LEAST {
                continue;
            }
            let [a, b] = self.names(pair).map(String::from);
            let distance = rooms[p] + pair.margin;
            if matches!(pair.partner, Partner::Volume(_)) && own(distance) >= HARDLY {
                let known = links.entry([a, b]).or_insert(distance);
                *known = known.min(distance);
            } else {
                stuck.push(format!("{a} and {b} {:.1} mm", 1e3 * distance));
            }
        }
        if !stuck.is_empty() {
            return Err(stuck);
        }
        let mut told = Vec::new();
        for ([a, b], distance) in links {
            for pair in &mut self.pairs {
                let Partner::Volume(v) = pair.partner else {
                    continue;
                };
                if self.volumes[pair.volume].link == a && self.volumes[v].link == b {
                    pair.margin = pair.margin.min(own(distance));
                }
            }
            told.push(format!("{a} and {b} {:.1} mm", 1e3 * own(distance)));
        }
        self.warnings.push(Warning::new(
            WarningKind::MarginReduced,
            "collisions",
            format!(
                "no posture keeps everything apart by the margin of {:.1} mm. These links keep half of the distance that \
                 they have in the best one, or less: {}. {REMEDY}",
                1e3 * self.margin,
                told.join("; ")
            ),
        ));
        let rooms = self.rooms(robot, &Balls::new(self), &best.posture);
        Ok(Mended {
            room: least(&rooms),
            ..best
        })
    }

    /// Which pairs leave no free posture: those in contact most often, and those that are `stuck` where links were moved apart.
    fn no_room(&self, robot: &Robot, rooms: &[Vec<f64>], stuck: &[String]) -> Error {
        let mut often: Vec<(usize, usize)> = (0..self.pairs.len())
            .map(|p| (rooms.iter().filter(|r| r[p] < 0.0).count(), p))
            .collect();
        often.sort_by(|a, b| b.cmp(a));
        let mut named: Vec<String> = Vec::new();
        for (count, p) in often {
            let [a, b] = self.names(&self.pairs[p]);
            let share = 100.0 * count as f64 / rooms.len() as f64;
            let text = format!("{a} and {b} ({share:.0} %)");
            if named.len() < 3
                && !named
                    .iter()
                    .any(|n| n.starts_with(&format!("{a} and {b} ")))
            {
                named.push(text);
            }
        }
        Error::Infeasible(format!(
            "{}: none of {} random postures is free of contact at a margin of {} m; most often in contact: \
             {}{}. {REMEDY}",
            robot.name,
            rooms.len(),
            self.margin,
            named.join(", "),
            match stuck.len() {
                0 => String::new(),
                n => format!(
                    "; in the best one that was found, links moved apart, these are too near: {}{}",
                    stuck[..n.min(3)].join("; "),
                    if n > 3 {
                        format!("; and {} more", n - 3)
                    } else {
                        String::new()
                    }
                ),
            }
        ))
    }
}

/// Least room of all pairs.
fn least(rooms: &[f64]) -> f64 {
    rooms.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Postures without contact, each with its room.
fn free(rooms: &[Vec<f64>], postures: &[Vec<f64>]) -> Vec<(f64, Vec<f64>)> {
    let each = rooms.iter().map(|r| least(r)).zip(postures);
    each.filter(|(room, _)| *room >= 0.0)
        .map(|(room, q)| (room, q.clone()))
        .collect()
}

/// Postures in the order of their room; of two with the same the first one stays first.
fn spacious_first(mut free: Vec<(f64, Vec<f64>)>) -> Vec<Vec<f64>> {
    free.sort_by(|a, b| b.0.total_cmp(&a.0));
    free.into_iter().map(|(_, q)| q).collect()
}

/// Drops what is never looked at.
fn leave_out<T>(all: &mut Vec<T>, never: &[bool]) {
    let mut never = never.iter();
    all.retain(|_| !never.next().is_some_and(|n| *n));
}

/// Pairs of names that are left out, each once.
#[derive(Default)]
pub(super) struct LeftOuts(pub(super) Vec<LeftOut>);

impl LeftOuts {
    pub(super) fn add(&mut self, a: &str, b: &str, why: &str) {
        let known = |l: &LeftOut| l.between[0] == a && l.between[1] == b;
        if !self.0.iter().any(known) {
            self.0.push(LeftOut {
                between: [a.into(), b.into()],
                why: why.into(),
            });
        }
    }
}

/// `a and b; c and d`.
pub fn in_words(pairs: &[[String; 2]]) -> String {
    let each: Vec<String> = pairs.iter().map(|[a, b]| format!("{a} and {b}")).collect();
    each.join("; ")
}
