//! Postures that the robot can take.

use super::reach::{Wanted, reach};
use super::{Request, Sight};
use crate::calibrate::frame::Frame;
use crate::calibrate::kin::Kin;
use crate::calibrate::kind::Kind;
use crate::calibrate::open::Opened;
use crate::calibrate::parallel::Parallel;
use crate::collision::Scene;
use crate::collision::scene::{Balls, append_poses};
use crate::error::{Error, Result, Warning, WarningKind};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::sync::Arc;

/// One posture.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// joint readings
    pub q: Vec<f64>,
    /// task coordinates of a parallel robot
    pub x: Vec<f64>,
    /// pose of the frame, nominal
    pub frame: Frame,
    /// index of the point it reaches
    pub point: usize,
}

/// Where postures are looked for.
pub struct Search<'a> {
    opened: &'a Opened,
    request: &'a Request,
    scene: Option<(Arc<Scene>, Balls)>,
    /// range of each joint, or of each task coordinate
    ranges: Vec<[f64; 2]>,
    pairs: Vec<(usize, usize)>,
    zeros: Vec<f64>,
    pub warnings: Vec<Warning>,
}

/// Draws for each posture that is wanted before the search is given up.
const DRAWS: usize = 20;
/// Draws at a time.
const BATCH: usize = 256;
/// Part of a range that is left free at both ends.
const MARGIN: f64 = 0.03;

impl<'a> Search<'a> {
    /// For a robot.
    ///
    /// # Errors
    /// Meshes that cannot be read; points for a robot that cannot be steered to them.
    pub fn new(opened: &'a Opened, request: &'a Request) -> Result<Self> {
        let plant = &opened.plant;
        let mut warnings = plant.scene_warnings();
        let scene = plant.scene()?.map(|s| {
            let balls = Balls::new(&s);
            (s, balls)
        });
        let inner = |[low, high]: [f64; 2]| {
            let m = MARGIN * (high - low);
            [low + m, high - m]
        };
        let (ranges, pairs) = match &opened.kin {
            Kin::Arm(_) => {
                let joints = &plant.robot().joints;
                if scene.is_none() {
                    warnings.push(Warning::new(
                        WarningKind::CollisionNotChecked,
                        plant.name(),
                        "no volume of its links is known: postures may collide; look at each before it is taken",
                    ));
                }
                let ranges = opened
                    .indices
                    .iter()
                    .map(|&j| inner(joints[j].range()))
                    .collect();
                (ranges, Vec::new())
            }
            Kin::Parallel(p) => {
                if request.kind == Kind::Point || request.kind.is_loop() {
                    return Err(Error::Argument(
                        "points and loops are for serial robots and trees; the platform of a parallel robot is seen by a camera or tracker"
                            .into(),
                    ));
                }
                let box_ = p
                    .mechanism
                    .workspace
                    .iter()
                    .map(|w| inner(w.position))
                    .collect();
                (box_, p.mechanism.pairs())
            }
        };
        let looked_through = scene.is_some() && matches!(opened.kin, Kin::Arm(_));
        if request.sight.is_some() && !looked_through {
            warnings.push(Warning::new(
                WarningKind::CollisionNotChecked,
                plant.name(),
                "no volume of it is looked at: arms or legs may stand between target and camera",
            ));
        }
        let zeros = vec![0.0; opened.kin.errors()];
        Ok(Search {
            opened,
            request,
            scene,
            ranges,
            pairs,
            zeros,
            warnings,
        })
    }

    /// Names of the task coordinates of a parallel robot.
    pub fn task_names(&self) -> Vec<String> {
        match &self.opened.kin {
            Kin::Arm(_) => Vec::new(),
            Kin::Parallel(p) => p.mechanism.task_names.clone(),
        }
    }

    /// Where the way begins: joints in the middle, or at zero where that is inside.
    pub fn rest(&self) -> Vec<f64> {
        match &self.opened.kin {
            Kin::Arm(_) => self
                .ranges
                .iter()
                .map(|[a, b]| 0.0f64.clamp(*a, *b))
                .collect(),
            Kin::Parallel(p) => p
                .mechanism
                .actuator_positions(&p.mechanism.home)
                .unwrap_or_default(),
        }
    }

    /// Candidates, and the number of draws. Draws come in batches that are looked at on all threads, so that the answer
    /// does not depend on their number.
    pub fn draw(&self, rng: &mut ChaCha8Rng, wanted: usize) -> (Vec<Candidate>, usize) {
        let points = self.request.points.len().max(1);
        let mut found = Vec::new();
        let mut draws = 0;
        while found.len() < wanted && draws < DRAWS * wanted {
            let batch: Vec<(usize, Vec<f64>)> = (0..BATCH)
                .map(|k| {
                    let at = self
                        .ranges
                        .iter()
                        .map(|[a, b]| rng.random_range(*a..=*b))
                        .collect();
                    ((draws + k) % points, at)
                })
                .collect();
            draws += BATCH;
            let new: Vec<Candidate> = batch
                .into_par_iter()
                .filter_map(|(point, at)| self.posture(at, point))
                .collect();
            found.extend(new);
            // a search with hardly any room ends early
            if draws >= 20 * BATCH && found.len() * 1000 < draws {
                break;
            }
        }
        found.truncate(wanted);
        (found, draws)
    }

    /// A posture a little away from another one.
    pub fn near(&self, from: &Candidate, step: f64, rng: &mut ChaCha8Rng) -> Option<Candidate> {
        let base = match &self.opened.kin {
            Kin::Arm(_) => &from.q,
            Kin::Parallel(_) => &from.x,
        };
        let moved = |(v, [a, b]): (&f64, &[f64; 2])| {
            let d = step * (b - a);
            (v + rng.random_range(-d..=d)).clamp(*a, *b)
        };
        let at: Vec<f64> = base.iter().zip(&self.ranges).map(moved).collect();
        self.posture(at, from.point)
    }

    /// The posture of these coordinates, brought to its point where there is one; `None` where it cannot be taken.
    fn posture(&self, mut at: Vec<f64>, point: usize) -> Option<Candidate> {
        let candidate = match &self.opened.kin {
            Kin::Arm(_) => {
                self.bring(&mut at, point)?;
                let frame = self.opened.kin.nominal(&at).ok()?;
                Candidate {
                    q: at,
                    x: Vec::new(),
                    frame,
                    point,
                }
            }
            Kin::Parallel(p) => platform(p, at, &self.pairs)?,
        };
        let inside = |region: &[[f64; 2]; 3]| {
            (0..3).all(|k| (region[k][0]..=region[k][1]).contains(&candidate.frame.p[k]))
        };
        let seen = |s: &Sight| s.sees(&candidate.frame);
        if self.request.region.as_ref().is_some_and(|r| !inside(r))
            || self.request.sight.as_ref().is_some_and(|s| !seen(s))
            || !self.clear(&candidate)
        {
            return None;
        }
        Some(candidate)
    }

    /// Moves the joints until the frame's origin is in its point, or the second arm where the first one holds it; as they
    /// are where neither is asked for.
    fn bring(&self, q: &mut [f64], point: usize) -> Option<()> {
        let Kin::Arm(arm) = &self.opened.kin else {
            return None;
        };
        let wanted = match (self.request.points.get(point), &self.request.grip) {
            (Some(p), _) => Wanted::Point(*p),
            (None, Some(grip)) => Wanted::Grip(*grip),
            (None, None) => return Some(()),
        };
        reach(arm, q, &self.zeros, &wanted)?;
        let inside = |(v, [a, b]): (&f64, &[f64; 2])| (*a..=*b).contains(v);
        q.iter().zip(&self.ranges).all(inside).then_some(())
    }

    /// Whether nothing touches, and nothing stands between the target and a camera.
    fn clear(&self, candidate: &Candidate) -> bool {
        let Some((scene, balls)) = &self.scene else {
            return true;
        };
        let robot = self.opened.plant.robot();
        let mut all: Vec<f64> = robot
            .joints
            .iter()
            .map(|j| {
                let [a, b] = j.range();
                0.0f64.clamp(a, b)
            })
            .collect();
        for (&j, v) in self.opened.indices.iter().zip(&candidate.q) {
            all[j] = *v;
        }
        let mut poses = Vec::new();
        append_poses(robot, &all, &mut poses);
        let hidden = |s: &Sight| match &self.opened.kin {
            Kin::Arm(arm) => {
                let last = arm.links.get(arm.ends[0].link);
                let last = last.map(|l| l.body.name.as_str());
                let carrier = robot
                    .bodies
                    .iter()
                    .position(|b| Some(b.name.as_str()) == last);
                !s.free(
                    &candidate.frame,
                    scene,
                    &poses,
                    carrier.unwrap_or(usize::MAX),
                )
            }
            Kin::Parallel(_) => false,
        };
        if self.request.sight.as_ref().is_some_and(hidden) {
            return false;
        }
        scene.pairs.iter().all(|pair| {
            balls.lower_bound(pair, &poses) > pair.margin
                || scene.separation(pair, &poses).distance > pair.margin
        })
    }
}

/// A pose of a platform: inside the limits of its actuators and its margins.
fn platform(p: &Parallel, x: Vec<f64>, pairs: &[(usize, usize)]) -> Option<Candidate> {
    let m = &p.mechanism;
    let q = m.actuator_positions(&x).ok()?;
    let inside = m.actuated.iter().zip(&q).all(|(&a, v)| {
        let [low, high] = m.robot.joints[a].limits.position;
        (low..=high).contains(v)
    });
    if !inside || m.pose_uses(&x, pairs).iter().any(|u| !(u.used() <= 1.0)) {
        return None;
    }
    let frame = p.frame_of(&x);
    Some(Candidate {
        q,
        x,
        frame,
        point: 0,
    })
}
