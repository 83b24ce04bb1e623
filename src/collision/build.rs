//! The scene of a robot: its volumes, the floor, what its file puts around it, and the pairs that matter.
//!
//! A pair is two volumes of different links, or a volume that moves and an obstacle. Left out are links that a
//! joint joins, pairs that the robot file or its SRDF names, and pairs that are nearer than the margin in every
//! one of many random postures: no motion can keep them apart. Where volumes were fitted to meshes, tighter ones
//! (convex hulls) are tried first. Every other pair stays, however far apart. Two links
//! that can hardly be moved apart, as every second one of a wrist, keep half of their median distance instead of the
//! margin.

use super::matter::LeftOuts;
use super::mend::ENOUGH;
use super::scene::{Pair, Partner, Scene, Volume};
use super::srdf;
use crate::error::{Error, Result, Warning, WarningKind};
use crate::robot::Robot;
use crate::robot::geometry::{Geometry, MARGIN, Obstacle, Origin};
use crate::solid::shape::MOST_VERTICES;
use crate::solid::{Pose, Shape};
use nalgebra::Vector3;

/// The base may reach this far below the plane `z = 0` and the plane be a floor all the same, m.
const SUNK: f64 = 0.03;
/// Most hulls about a part of a link that is near another one in every posture: the first number, then the second, then
/// the third. Where no posture is free, all links are enclosed anew by the first.
const FINER: [usize; 3] = [1, 6, 16];

/// Name of the plane `z = 0` of the base frame.
pub const FLOOR: &str = "floor";

/// The scene of a robot over these postures (positions of all joints); `None` where its files tell no volume,
/// or where they say that collisions are not looked at.
///
/// # Errors
/// An SRDF that cannot be read; no posture without contact: the pairs that are in the way.
pub fn scene(robot: &Robot, postures: &[Vec<f64>]) -> Result<Option<Scene>> {
    let Some((mut scene, mut rooms)) = with_volumes(robot, postures)? else {
        return Ok(None);
    };
    if postures.is_empty() {
        return Ok(Some(scene));
    }
    let mut robot = robot.clone();
    for most in FINER {
        let hard: Vec<usize> = match scene.free.is_empty() {
            false => {
                let named = scene.always_near.iter().flatten();
                named.filter_map(|n| robot.geometry.link(n)).collect()
            }
            // what is in the way is told soon
            true if most > FINER[0] => break,
            true => (0..robot.geometry.links.len()).collect(),
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
        match with_volumes(&robot, postures)? {
            Some(finer) => (scene, rooms) = finer,
            None => return Ok(None),
        }
    }
    if scene.free.len() < ENOUGH {
        scene.mend(&robot, postures, &rooms)?;
    }
    Ok(Some(scene))
}

/// The scene with the volumes that the robot's geometry has, and what [`Scene::sample`] finds in it.
fn with_volumes(robot: &Robot, postures: &[Vec<f64>]) -> Result<Option<(Scene, Vec<Vec<f64>>)>> {
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
    let rooms = scene.sample(robot, postures);
    Ok(Some((scene, rooms)))
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
}
