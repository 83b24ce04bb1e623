//! Whether a path keeps clear of everything, proven and given up early.
//!
//! Over a stretch `h` no distance changes faster than `L` (see [`clearance`](crate::collision::clearance)),
//! so that it is nowhere less than `(d₀ + d₁ − L h)/2`. Stretches are halved, the longest first, until
//! that is not below the margin for all pairs, or a distance is. Closed chains have no scene, so that the robot is a tree.

use crate::collision::clearance::{Fineness, Path, clearances, reaches};
use crate::collision::scene::{Scene, poses};
use crate::error::Error;
use crate::robot::{Body, Motion, Robot};
use crate::solid::Pose;
use crate::trajectory::certificate::Proof;
use std::collections::VecDeque;

/// Margins are kept to this, m: a motion may begin or end at its margin.
const GIVE: f64 = 1e-4;
/// Ends may be short of their margin by so much, m.
const TOUCH: f64 = 1e-6;
/// Stretches in which nothing moves farther than this are not halved, m.
const FINEST: f64 = 1e-5;
/// Most instants that one path is looked at.
const LOOKS: usize = 20_000;
/// How closely the least clearance of a tree is bounded.
const CLOSELY: Fineness = Fineness {
    stretches: 60,
    tolerance: 1e-3,
    shortest: 1e-5,
};

/// Where a path is blocked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blocked {
    /// index of the pair
    pub pair: usize,
    /// distance there, m
    pub distance: f64,
}

/// Least clearance of a move over all time.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Least {
    /// the two bodies, or a body and an obstacle
    pub between: [String; 2],
    /// least distance that was met, m
    pub met: f64,
    /// when, s
    pub time: f64,
    /// no pair is at any time nearer to its margin than `bound - margin`, m
    pub bound: f64,
    /// least distance that is allowed, m
    pub margin: f64,
    /// how the bound is known
    pub proof: Proof,
    /// links whose volume is not known: what touches there is not seen
    pub unseen: Vec<String>,
}

/// A robot among the things that it must not touch.
pub struct Guard<'a> {
    robot: &'a Robot,
    /// volumes, obstacles and pairs
    pub scene: &'a Scene,
    /// reaches of the joints where they are the same for all paths
    reaches: Option<Vec<Vec<f64>>>,
}

impl<'a> Guard<'a> {
    /// Of a robot and its scene.
    pub fn new(robot: &'a Robot, scene: &'a Scene) -> Self {
        let mut guard = Guard {
            robot,
            scene,
            reaches: None,
        };
        let slides = |b: &Body| b.motion == Motion::Prismatic;
        if !robot.bodies.iter().any(slides) {
            guard.reaches = Some(guard.reaches_within(&vec![0.0; robot.dof()]));
        }
        guard
    }

    fn reaches_within(&self, largest: &[f64]) -> Vec<Vec<f64>> {
        let reach = |pair| reaches(self.robot, self.scene, pair, largest);
        self.scene.pairs.iter().map(reach).collect()
    }

    /// Names of the two of a pair, in words.
    pub fn names(&self, pair: usize) -> String {
        self.scene.names(&self.scene.pairs[pair]).join(" and ")
    }

    fn margin(&self, pair: usize) -> f64 {
        self.scene.pairs[pair].margin
    }

    /// What a path must keep.
    fn kept(&self, pair: usize) -> f64 {
        self.margin(pair) - GIVE
    }

    /// Distances of some pairs in a posture.
    fn distances(&self, q: &[f64], pairs: &[usize], at: &mut Vec<Pose>) -> Vec<f64> {
        poses(self.robot, q, at);
        let distance = |&p: &usize| self.scene.separation(&self.scene.pairs[p], at).distance;
        pairs.iter().map(distance).collect()
    }

    /// The pair of a posture that is short of its margin by most.
    pub fn touching(&self, q: &[f64]) -> Option<Blocked> {
        let pairs: Vec<usize> = (0..self.scene.pairs.len()).collect();
        let d = self.distances(q, &pairs, &mut Vec::new());
        let room = |p: usize| d[p] - self.margin(p);
        let least = (0..d.len()).min_by(|a, b| room(*a).total_cmp(&room(*b)))?;
        // a distance that is not a number is no distance
        (!(room(least) >= -TOUCH)).then_some(Blocked {
            pair: least,
            distance: d[least],
        })
    }

    /// Whether all pairs keep their margins over a whole path.
    ///
    /// # Errors
    /// A pair that does not.
    pub fn free(&self, path: &dyn Path) -> Result<(), Blocked> {
        let n = self.robot.dof();
        let own;
        let reaches = match &self.reaches {
            Some(known) => known,
            None => {
                let largest: Vec<f64> = (0..n).map(|j| path.largest(j)).collect();
                own = self.reaches_within(&largest);
                &own
            }
        };
        let (mut q, mut v, mut at) = (vec![0.0; n], vec![0.0; n], Vec::new());
        let mut look = |t: f64, pairs: &[usize]| -> Result<Vec<f64>, Blocked> {
            path.position(t, &mut q);
            let d = self.distances(&q, pairs, &mut at);
            match (0..d.len()).find(|&k| !(d[k] >= self.kept(pairs[k]))) {
                None => Ok(d),
                Some(k) => Err(Blocked {
                    pair: pairs[k],
                    distance: d[k],
                }),
            }
        };
        let all: Vec<usize> = (0..self.scene.pairs.len()).collect();
        let end = path.duration();
        let (first, last) = (look(0.0, &all)?, look(end, &all)?);
        let mut looks = 0;
        let mut queue = VecDeque::from([(0.0, end, all, first, last)]);
        while let Some((from, h, pairs, d0, d1)) = queue.pop_front() {
            path.speed(from, from + h, &mut v);
            let mut open = Vec::new();
            for (k, &pair) in pairs.iter().enumerate() {
                let rate: f64 = v.iter().zip(&reaches[pair]).map(|(v, r)| v * r).sum();
                if 0.5 * (d0[k] + d1[k] - rate * h) >= self.kept(pair) {
                    continue;
                }
                if !(rate * h >= FINEST) || looks > LOOKS {
                    return Err(Blocked {
                        pair,
                        distance: d0[k].min(d1[k]),
                    });
                }
                open.push(k);
            }
            if open.is_empty() {
                continue;
            }
            let pick = |d: &[f64]| -> Vec<f64> { open.iter().map(|&k| d[k]).collect() };
            let left: Vec<usize> = open.iter().map(|&k| pairs[k]).collect();
            let middle = from + 0.5 * h;
            looks += 1;
            let d = look(middle, &left)?;
            queue.push_back((from, 0.5 * h, left.clone(), pick(&d0), d.clone()));
            queue.push_back((middle, 0.5 * h, left, d, pick(&d1)));
        }
        Ok(())
    }

    /// Least clearance of a path for all time. `None` where there are no pairs.
    pub fn least(&self, path: &dyn Path) -> Option<Least> {
        // pair, met, time, bound
        let all: Vec<(usize, f64, f64, f64)> = clearances(self.robot, self.scene, path, CLOSELY)
            .iter()
            .map(|c| (c.pair, c.met, c.time, c.bound))
            .collect();
        let closest = (all.iter())
            .min_by(|a, b| (a.1 - self.margin(a.0)).total_cmp(&(b.1 - self.margin(b.0))));
        let &(pair, met, time, _) = closest?;
        let margin = self.margin(pair);
        let room = |&(p, _, _, bound): &(usize, f64, f64, f64)| bound - self.margin(p);
        let room = all.iter().map(room).fold(f64::INFINITY, f64::min);
        Some(Least {
            between: self.scene.names(&self.scene.pairs[pair]).map(String::from),
            met,
            time,
            // `free` has shown that there is that room
            bound: margin + room.max(-GIVE).min(met - margin),
            margin,
            proof: Proof::Enclosed,
            unseen: self.scene.unseen.clone(),
        })
    }

    /// What is wrong with a posture that touches, as an error.
    pub fn refused(&self, which: &str, blocked: Blocked) -> Error {
        Error::Infeasible(format!(
            "at the {which} of the move {} are {:.4} m apart, {:.4} m are required; choose another posture, or correct \
             the volumes or the margin",
            self.names(blocked.pair),
            blocked.distance,
            self.margin(blocked.pair)
        ))
    }
}

/// A straight line between two postures; its time runs from 0 to 1.
pub struct Line<'a> {
    /// begin
    pub from: &'a [f64],
    /// end
    pub to: &'a [f64],
}

impl Path for Line<'_> {
    fn position(&self, t: f64, q: &mut [f64]) {
        let ends = self.from.iter().zip(self.to);
        for (q, (a, b)) in q.iter_mut().zip(ends) {
            *q = a + t * (b - a);
        }
    }

    fn speed(&self, _: f64, _: f64, v: &mut [f64]) {
        let ends = self.from.iter().zip(self.to);
        for (v, (a, b)) in v.iter_mut().zip(ends) {
            *v = (b - a).abs();
        }
    }

    fn largest(&self, joint: usize) -> f64 {
        self.from[joint].abs().max(self.to[joint].abs())
    }

    fn duration(&self) -> f64 {
        1.0
    }
}
