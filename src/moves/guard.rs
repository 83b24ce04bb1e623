//! Whether a path keeps clear of everything, proven and given up early.
//!
//! Over a stretch `h` no distance changes faster than `L` (see [`clearance`](crate::collision::clearance)),
//! so that it is nowhere less than `(d₀ + d₁ − L h)/2`. Stretches are halved, the longest first, until
//! that is not below the margin for all pairs, or a distance is.

use crate::collision::clearance::{Path, clearances, reaches};
use crate::collision::scene::{Scene, poses};
use crate::collision::shape::Pose;
use crate::robot::Robot;
use std::collections::VecDeque;

/// Distances closer to the margin than this are not told from it, m.
const FINEST: f64 = 1e-6;
/// Instants at which the least clearance is looked for before stretches are halved.
const INSTANTS: usize = 48;
/// How closely the least clearance is bounded, m.
const TOLERANCE: f64 = 1e-3;

/// Where a path is blocked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blocked {
    /// index of the pair
    pub pair: usize,
    /// distance there, m
    pub distance: f64,
    /// when, s
    pub time: f64,
}

/// Least clearance of a move over all time.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Least {
    /// the two bodies, or a body and an obstacle
    pub between: [String; 2],
    /// least distance that was met, m
    pub met: f64,
    /// when, s
    pub time: f64,
    /// at no time is the distance of any pair less than this, m
    pub bound: f64,
    /// least distance that is allowed, m
    pub margin: f64,
}

/// A robot among the things that it must not touch.
pub struct Guard<'a> {
    robot: &'a Robot,
    /// volumes, obstacles and pairs
    pub scene: &'a Scene,
    reaches: Vec<Vec<f64>>,
}

impl<'a> Guard<'a> {
    /// Of a robot whose coordinates are its joints.
    pub fn new(robot: &'a Robot, scene: &'a Scene) -> Self {
        let reach = |pair| reaches(robot, scene, pair);
        Guard {
            robot,
            scene,
            reaches: scene.pairs.iter().map(reach).collect(),
        }
    }

    /// Names of a pair.
    pub fn names(&self, pair: usize) -> [String; 2] {
        self.scene.names(&self.scene.pairs[pair]).map(String::from)
    }

    fn distances(&self, q: &[f64], pairs: &[usize], at: &mut Vec<Pose>) -> Vec<f64> {
        poses(self.robot, q, at);
        let distance = |&p: &usize| self.scene.separation(&self.scene.pairs[p], at).distance;
        pairs.iter().map(distance).collect()
    }

    /// The closest pair of a posture, where it is closer than the margin.
    pub fn touching(&self, q: &[f64]) -> Option<Blocked> {
        let pairs: Vec<usize> = (0..self.scene.pairs.len()).collect();
        let d = self.distances(q, &pairs, &mut Vec::new());
        let least = (0..d.len()).min_by(|a, b| d[*a].total_cmp(&d[*b]))?;
        // a distance that is not a number is no distance
        (!(d[least] >= self.scene.margin)).then_some(Blocked {
            pair: least,
            distance: d[least],
            time: 0.0,
        })
    }

    /// Whether all pairs keep the margin over a whole path.
    ///
    /// # Errors
    /// A pair that does not, where and when.
    pub fn free(&self, path: &dyn Path) -> Result<(), Blocked> {
        let margin = self.scene.margin;
        let n = self.robot.joints.len();
        let (mut q, mut v, mut at) = (vec![0.0; n], vec![0.0; n], Vec::new());
        let mut look = |t: f64, pairs: &[usize]| -> Result<Vec<f64>, Blocked> {
            path.position(t, &mut q);
            let d = self.distances(&q, pairs, &mut at);
            match (0..d.len()).find(|&k| !(d[k] >= margin)) {
                None => Ok(d),
                Some(k) => Err(Blocked {
                    pair: pairs[k],
                    distance: d[k],
                    time: t,
                }),
            }
        };
        let all: Vec<usize> = (0..self.scene.pairs.len()).collect();
        let end = path.duration();
        let (first, last) = (look(0.0, &all)?, look(end, &all)?);
        let mut queue = VecDeque::from([(0.0, end, all, first, last)]);
        while let Some((from, h, pairs, d0, d1)) = queue.pop_front() {
            path.speed(from, from + h, &mut v);
            let mut open = Vec::new();
            for (k, &pair) in pairs.iter().enumerate() {
                let rate: f64 = v.iter().zip(&self.reaches[pair]).map(|(v, r)| v * r).sum();
                if 0.5 * (d0[k] + d1[k] - rate * h) >= margin {
                    continue;
                }
                if rate * h < FINEST {
                    return Err(Blocked {
                        pair,
                        distance: d0[k].min(d1[k]),
                        time: from,
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
            let d = look(middle, &left)?;
            queue.push_back((from, 0.5 * h, left.clone(), pick(&d0), d.clone()));
            queue.push_back((middle, 0.5 * h, left, d, pick(&d1)));
        }
        Ok(())
    }

    /// Least clearance of a path that is free.
    pub fn least(&self, path: &dyn Path) -> Option<Least> {
        let shortest = 1e-5 * path.duration();
        let all = clearances(self.robot, self.scene, path, INSTANTS, TOLERANCE, shortest);
        let closest = all.iter().min_by(|a, b| a.met.total_cmp(&b.met))?;
        let bound = all.iter().map(|c| c.bound).fold(f64::INFINITY, f64::min);
        Some(Least {
            between: self.names(closest.pair),
            met: closest.met,
            time: closest.time,
            // `free` has proven the margin
            bound: bound.max(self.scene.margin.min(closest.met)),
            margin: self.scene.margin,
        })
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

    fn duration(&self) -> f64 {
        1.0
    }
}
