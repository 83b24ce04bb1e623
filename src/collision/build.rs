//! The scene of a robot: its volumes, the floor, what its file puts around it, and the pairs that matter.
//!
//! A pair is two volumes of different links, or a volume that moves and an obstacle. Left out are links that a
//! joint joins, pairs that the robot file or its SRDF names, and pairs that are nearer than the margin in every
//! one of many random postures: no motion can keep them apart. Where volumes were fitted to meshes, tighter ones
//! (convex hulls) are tried first. Every other pair stays, however far apart. Two links
//! that can hardly be moved apart, as every second one of a wrist, keep half of their median distance instead of the
//! margin.

use super::scene::{Balls, LeftOut, Pair, Partner, Scene, Volume, poses};
use super::srdf;
use crate::error::{Error, Result, Warning, WarningKind};
use crate::robot::Robot;
use crate::robot::geometry::{Geometry, MARGIN, Obstacle, Origin};
use crate::solid::shape::MOST_VERTICES;
use crate::solid::{Pose, Shape};
use nalgebra::Vector3;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The base may reach this far below the plane `z = 0` and the plane be a floor all the same, m.
const SUNK: f64 = 0.03;
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
/// Most hulls about a part of a link that is near another one in every posture: the first number, then the second, then
/// the third. Where no posture is free, all links are enclosed anew by the first.
const FINER: [usize; 3] = [1, 6, 16];
/// Free postures that are kept.
const KEPT: usize = 400;

/// Name of the plane `z = 0` of the base frame.
pub const FLOOR: &str = "floor";

/// The scene of a robot over these postures (positions of all joints); `None` where its files tell no volume,
/// or where they say that collisions are not looked at.
///
/// # Errors
/// An SRDF that cannot be read; no posture without contact: the pairs that are in the way.
pub fn scene(robot: &Robot, postures: &[Vec<f64>]) -> Result<Option<Scene>> {
    let mut found = with_volumes(robot, postures);
    let mut robot = robot.clone();
    for most in FINER {
        let hard: Vec<usize> = match &found {
            Ok(None) => break,
            Ok(Some(scene)) => {
                let named = scene.always_near.iter().flatten();
                named.filter_map(|n| robot.geometry.link(n)).collect()
            }
            // what is in the way is told soon
            Err(_) if most > FINER[0] => break,
            Err(_) => (0..robot.geometry.links.len()).collect(),
        };
        let fitted = &robot.geometry.volumes().links;
        let fitted = fitted.iter().filter(|v| v.origin == Origin::Fitted);
        let hard: Vec<usize> = fitted
            .map(|v| v.link)
            .filter(|l| hard.contains(l))
            .collect();
        if hard.is_empty() {
            break;
        }
        robot.geometry = robot.geometry.finer(&hard, most);
        found = with_volumes(&robot, postures);
    }
    found
}

/// The scene with the volumes that the robot's geometry has.
fn with_volumes(robot: &Robot, postures: &[Vec<f64>]) -> Result<Option<Scene>> {
    let geometry = &robot.geometry;
    if geometry.is_empty() || geometry.check == Some(false) {
        return Ok(None);
    }
    let found = geometry.volumes();
    let mut scene = Scene {
        margin: geometry.margin.unwrap_or(MARGIN),
        obstacles: geometry.obstacles.clone(),
        unseen: found
            .unseen
            .iter()
            .map(|l| geometry.links[*l].name.clone())
            .collect(),
        warnings: found.warnings.clone(),
        fitted: found.clone(),
        ..Scene::default()
    };
    for link in &found.links {
        let at = &geometry.links[link.link];
        scene.volumes.extend(link.shapes.iter().map(|shape| Volume {
            link: at.name.clone(),
            body: at.body,
            shape: shape.clone(),
        }));
    }
    if scene.volumes.is_empty() && geometry.keep_in.is_empty() {
        return Ok(None);
    }
    scene.bodies_unseen(robot);
    scene.floor(geometry, robot);
    let joined = Joined::new(geometry);
    let ignored = ignored(geometry, &mut scene.warnings)?;
    scene.pair_up(robot, &joined, &ignored);
    scene.keep_in(robot);
    scene.sample(robot, postures)?;
    Ok(Some(scene))
}

/// Pairs that the robot file and its SRDF name.
fn ignored(geometry: &Geometry, warnings: &mut Vec<Warning>) -> Result<Vec<[String; 2]>> {
    let mut all = geometry.ignore.clone();
    let Some(path) = &geometry.srdf else {
        return Ok(all);
    };
    let disabled = srdf::disabled(path)?;
    let (known, other): (Vec<_>, Vec<_>) = disabled
        .into_iter()
        .partition(|pair| pair.iter().all(|l| geometry.link(l).is_some()));
    if let Some([a, b]) = other.first() {
        let message = format!(
            "{} of its {} pairs name links that this robot does not have (`{a}` and `{b}` first): \
             is it the SRDF of another robot?",
            other.len(),
            other.len() + known.len()
        );
        if known.is_empty() {
            return Err(Error::file(path, "", message));
        }
        let name = path.display().to_string();
        warnings.push(Warning::new(WarningKind::EntryIgnored, name, message));
    }
    all.extend(known);
    Ok(all)
}

/// Which links a joint joins, links without volume passed over.
struct Joined(Vec<(String, String)>);

impl Joined {
    fn new(geometry: &Geometry) -> Self {
        let with: Vec<usize> = geometry.volumes().links.iter().map(|v| v.link).collect();
        let up = |name: &Option<String>| name.as_deref().and_then(|n| geometry.link(n));
        let mut pairs = Vec::new();
        for &link in &with {
            let mut at = up(&geometry.links[link].parent);
            while let Some(parent) = at {
                if with.contains(&parent) {
                    let name = |l: usize| geometry.links[l].name.clone();
                    pairs.push((name(link), name(parent)));
                    break;
                }
                at = up(&geometry.links[parent].parent);
            }
        }
        Joined(pairs)
    }

    fn holds(&self, a: &str, b: &str) -> bool {
        let same = |(x, y): &(String, String)| (x == a && y == b) || (x == b && y == a);
        self.0.iter().any(same)
    }
}

impl Scene {
    /// Bodies with a mass that no volume stands for.
    fn bodies_unseen(&mut self, robot: &Robot) {
        for (i, body) in robot.bodies.iter().enumerate() {
            let seen = self.volumes.iter().any(|v| v.body == Some(i));
            if !seen && body.inertia.0[0] > 0.0 && !self.unseen.contains(&body.name) {
                self.unseen.push(body.name.clone());
            }
        }
        if let Some(first) = self.unseen.first() {
            self.warnings.push(Warning::new(
                WarningKind::CollisionNotChecked,
                "collisions",
                format!(
                    "the volume of {} link{} is not known (`{first}` first): what touches there is not \
                     seen; add [[volume]] to robot.toml",
                    self.unseen.len(),
                    if self.unseen.len() == 1 { "" } else { "s" }
                ),
            ));
        }
    }

    /// The plane `z = 0` of the base frame, where the file asks for it, or where it says nothing and the base
    /// stands on it. The base of one arm that reaches lower stands on its own lowest point.
    fn floor(&mut self, geometry: &Geometry, robot: &Robot) {
        let lowest = |v: &Volume| {
            let mut corners = [Vector3::zeros(); MOST_VERTICES];
            let k = v.shape.core(&Pose::identity(), &mut corners);
            let z = corners[..k]
                .iter()
                .map(|p| p.z)
                .fold(f64::INFINITY, f64::min);
            z - v.shape.radius()
        };
        let base = self.volumes.iter().filter(|v| v.body.is_none()).map(lowest);
        let low = base.fold(f64::INFINITY, f64::min);
        let sunk = low < -SUNK;
        // the trunk of a walker does not stand on the floor
        let limbs = robot.bodies.iter().filter(|b| b.parent.is_none()).count();
        let offset = match (geometry.floor, sunk, limbs) {
            (Some(false), ..) => None,
            (Some(true), ..) | (None, false, _) => Some(0.0),
            (None, true, 1) => Some(low),
            (None, true, _) => None,
        };
        if geometry.floor.is_none() && sunk {
            let assumed = match offset {
                Some(at) => {
                    format!("the floor is assumed there, at z = {at:.3} m, and not at z = 0")
                }
                None => "no floor is assumed at z = 0".into(),
            };
            self.warnings.push(Warning::new(
                WarningKind::CollisionNotChecked,
                "floor",
                format!(
                    "the base reaches {:.3} m below its own frame, so {assumed}; state `floor = true` (a floor at \
                     z = 0) or `floor = false` in [collision], or the floor as an [[obstacle]]",
                    -low
                ),
            ));
        }
        if let Some(offset) = offset {
            self.obstacles.push(Obstacle::Plane {
                name: FLOOR.into(),
                normal: Vector3::z(),
                offset,
            });
        }
    }

    /// All pairs but those that are joined or named.
    fn pair_up(&mut self, robot: &Robot, joined: &Joined, ignored: &[[String; 2]]) {
        let margin = self.margin;
        // the fingers of a gripper: they hang on one body and meet where its joint says
        let together = |a: Option<usize>, b: Option<usize>| match (a, b) {
            (Some(a), Some(b)) => {
                let (a, b) = (&robot.bodies[a], &robot.bodies[b]);
                a.coordinate == b.coordinate && a.parent == b.parent
            }
            _ => false,
        };
        let named = |a: &str, b: &str| {
            ignored
                .iter()
                .any(|[x, y]| (x == a && y == b) || (x == b && y == a))
        };
        let mut out = LeftOuts::default();
        for (i, a) in self.volumes.iter().enumerate() {
            for (k, b) in self.volumes.iter().enumerate().skip(i + 1) {
                if a.body == b.body || a.link == b.link {
                    continue;
                }
                if joined.holds(&a.link, &b.link) {
                    out.add(&a.link, &b.link, "joined by a joint");
                } else if together(a.body, b.body) {
                    out.add(&a.link, &b.link, "both follow one joint");
                } else if named(&a.link, &b.link) {
                    out.add(&a.link, &b.link, "named by the robot file");
                } else {
                    // the first one moves
                    let (volume, other) = if a.body.is_some() { (i, k) } else { (k, i) };
                    let partner = Partner::Volume(other);
                    self.pairs.push(Pair {
                        volume,
                        partner,
                        margin,
                    });
                }
            }
            if a.body.is_none() {
                continue;
            }
            for (o, obstacle) in self.obstacles.iter().enumerate() {
                match named(&a.link, obstacle.name()) {
                    true => out.add(&a.link, obstacle.name(), "named by the robot file"),
                    false => self.pairs.push(Pair {
                        volume: i,
                        partner: Partner::Obstacle(o),
                        margin,
                    }),
                }
            }
        }
        self.left_out = out.0;
    }

    /// Boxes in which frames must stay: a point at the frame, and a plane for each face.
    fn keep_in(&mut self, robot: &Robot) {
        let geometry = &robot.geometry;
        for keep in &geometry.keep_in {
            let Some(link) = geometry.link(&keep.frame).map(|l| &geometry.links[l]) else {
                continue;
            };
            let volume = self.volumes.len();
            self.volumes.push(Volume {
                link: format!("origin of {}", keep.frame),
                body: link.body,
                shape: Shape::Sphere {
                    centre: link.pose.position,
                    radius: 0.0,
                },
            });
            for axis in 0..3 {
                for (bound, sign, side) in [
                    (keep.low[axis], 1.0, "low"),
                    (keep.high[axis], -1.0, "high"),
                ] {
                    if !bound.is_finite() {
                        continue;
                    }
                    let mut normal = Vector3::zeros();
                    normal[axis] = sign;
                    let name = format!("keep_in {side} {}", ["x", "y", "z"][axis]);
                    self.obstacles.push(Obstacle::Plane {
                        name,
                        normal,
                        offset: sign * bound,
                    });
                    self.pairs.push(Pair {
                        volume,
                        partner: Partner::Obstacle(self.obstacles.len() - 1),
                        margin: 0.0,
                    });
                }
            }
        }
    }

    /// Looks at the pairs in many postures: leaves out those that no posture keeps apart, and keeps postures
    /// without contact.
    fn sample(&mut self, robot: &Robot, postures: &[Vec<f64>]) -> Result<()> {
        if postures.is_empty() {
            return Ok(());
        }
        let balls = Balls::new(self);
        let mut rooms: Vec<Vec<f64>> = postures
            .par_iter()
            .map(|q| {
                let mut at = Vec::new();
                poses(robot, q, &mut at);
                let room = |p: &Pair| match balls.lower_bound(p, &at) - p.margin {
                    far if far > FAR => far,
                    _ => self.separation(p, &at).distance - p.margin,
                };
                self.pairs.iter().map(room).collect()
            })
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
        let mut free: Vec<(f64, usize)> = rooms
            .iter()
            .enumerate()
            .map(|(i, r)| {
                let kept = r.iter().zip(&never).filter(|(_, n)| !**n);
                (kept.map(|(d, _)| *d).fold(f64::INFINITY, f64::min), i)
            })
            .filter(|(room, _)| *room >= 0.0)
            .collect();
        if free.is_empty() {
            return Err(self.no_room(robot, &rooms, &never));
        }
        free.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        self.free = free
            .iter()
            .take(KEPT)
            .map(|(_, i)| postures[*i].clone())
            .collect();
        let most = |p: usize| rooms.iter().map(|r| r[p]).fold(0.0, f64::max);
        self.most = (0..self.pairs.len())
            .filter(|p| !never[*p])
            .map(most)
            .collect();
        let mut never = never.into_iter();
        self.pairs.retain(|_| !never.next().unwrap_or(false));
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

    /// Which pairs leave no free posture: those in contact most often.
    fn no_room(&self, robot: &Robot, rooms: &[Vec<f64>], never: &[bool]) -> Error {
        let mut often: Vec<(usize, usize)> = (0..self.pairs.len())
            .filter(|p| !never[*p])
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
             {}. Check [[obstacle]], `floor` and `margin`, name pairs that may touch in `ignore`, or look at \
             no collision (--no-collision)",
            robot.name,
            rooms.len(),
            self.margin,
            named.join(", ")
        ))
    }
}

/// `a and b; c and d`.
pub fn in_words(pairs: &[[String; 2]]) -> String {
    let each: Vec<String> = pairs.iter().map(|[a, b]| format!("{a} and {b}")).collect();
    each.join("; ")
}

/// Pairs of names that are left out, each once.
#[derive(Default)]
struct LeftOuts(Vec<LeftOut>);

impl LeftOuts {
    fn add(&mut self, a: &str, b: &str, why: &str) {
        let known = |l: &LeftOut| l.between[0] == a && l.between[1] == b;
        if !self.0.iter().any(known) {
            self.0.push(LeftOut {
                between: [a.into(), b.into()],
                why: why.into(),
            });
        }
    }
}
