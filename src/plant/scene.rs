//! What a plant must not touch, and proof that a motion does not.

use super::Plant;
use crate::collision::clearance::{Fineness, Path, clearances};
use crate::collision::{Clearance, Scene, build};
use crate::error::{Result, Warning, WarningKind};
use crate::robot::{Joint, Robot};
use crate::trajectory::Fourier;
use crate::trajectory::certificate::Proof;
use crate::trajectory::extrema::extrema;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::borrow::Cow;
use std::path::PathBuf;
use std::sync::Arc;

/// Random postures in which pairs are looked at.
const POSTURES: usize = 2000;
const SEED: u64 = 23;
/// A clearance counts as kept when it is short by no more than this, m.
const TOLERANCE: f64 = 1e-9;

/// Least distance of two things along a motion.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct PairClearance {
    /// names of the two
    pub between: [String; 2],
    /// least distance that was met, m
    pub least: f64,
    /// when, s into the period
    pub time: f64,
    /// at no time is it less than this, m
    pub bound: f64,
    /// least distance that is allowed, m
    pub margin: f64,
}

/// What is known of collisions along a motion.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct ClearanceCertificate {
    /// every pair of links or of a link and an obstacle, the one with the least room first
    pub pairs: Vec<PairClearance>,
    /// how the bounds are known
    pub proof: Proof,
    /// links whose volume is not known: what touches there is not seen
    pub unseen: Vec<String>,
    /// pairs of links whose volumes are so near in every posture that they are not looked at
    pub always_near: Vec<[String; 2]>,
    /// whether every pair that is looked at keeps its margin at all times
    pub satisfied: bool,
}

impl Plant {
    /// The same robot with no look at collisions.
    pub fn without_collisions(self) -> Self {
        Plant {
            collisions: false,
            ..self
        }
    }

    /// The same robot, its meshes looked for in these folders first.
    pub fn with_meshes(mut self, folders: &[PathBuf]) -> Self {
        if !folders.is_empty() {
            self.robot.geometry.look_in(folders);
            self.scene = Arc::default();
        }
        self
    }

    /// Volumes, obstacles and pairs that must stay apart; `None` where the robot's files tell no volume, or
    /// collisions are not to be looked at, and for closed chains. Meshes are opened at the first call, which also settles that
    /// there is an error.
    ///
    /// # Errors
    /// As [`build::scene`].
    pub fn scene(&self) -> Result<Option<Arc<Scene>>> {
        if !self.collisions || self.mechanism().is_some() {
            return Ok(None);
        }
        let known = match self.scene.get() {
            Some(known) => known,
            None => {
                let found = build::scene(self.robot(), &postures(self.robot()));
                (self.scene).get_or_init(|| found.map(|s| s.map(Arc::new)))
            }
        };
        match known {
            Ok(scene) => Ok(scene.clone()),
            Err(why) => Err(why.again()),
        }
    }

    /// A robot of the same links with the volumes of this one's [`Plant::scene`], which can be tighter than those of its
    /// geometry alone. As it is where there is no scene, or none can be had.
    #[doc(hidden)]
    pub fn lend_volumes(&self, robot: &Robot) -> Robot {
        let mut robot = robot.clone();
        let fits = !robot.geometry.parts.is_empty();
        if let Some(scene) = fits.then(|| self.scene().ok().flatten()).flatten() {
            robot.geometry = robot.geometry.with_volumes(scene.fitted.clone());
        }
        robot
    }

    /// Why there is no [`Plant::scene`] although the robot's files say something of volumes or surroundings.
    pub fn scene_warnings(&self) -> Vec<Warning> {
        let geometry = &self.robot.geometry;
        if !self.collisions || geometry.check == Some(false) {
            return Vec::new();
        }
        let mut all = match geometry.parts.is_empty() {
            true => Vec::new(),
            false => geometry.volumes().warnings.clone(),
        };
        if !geometry.obstacles.is_empty() || !geometry.keep_in.is_empty() {
            all.push(Warning::new(
                WarningKind::CollisionNotChecked,
                "collisions",
                "[[obstacle]] and [[keep_in]] have no effect here: no volume of a link is known, or this is a \
                 closed chain",
            ));
        }
        all
    }

    /// Positions of all joints, passive ones included, from coordinates.
    ///
    /// # Errors
    /// A pose that cannot be reached.
    pub fn posture<'a>(&self, x: &'a [f64]) -> Result<Cow<'a, [f64]>> {
        match self.mechanism() {
            None => Ok(Cow::Borrowed(x)),
            Some(mechanism) => Ok(Cow::Owned(mechanism.inverse(x)?)),
        }
    }

    /// Least clearances of a motion over all time. `None` where there is no [`Plant::scene`].
    ///
    /// # Errors
    /// As [`Plant::scene`].
    pub fn clearance(&self, fourier: &Fourier) -> Result<Option<ClearanceCertificate>> {
        let Some(scene) = self.scene()? else {
            return Ok(None);
        };
        let path = SeriesPath::new(fourier);
        let found = clearances(self.robot(), &scene, &path, Fineness::default());
        let pairs = by_names(found.iter().map(|c| named(&scene, c)));
        let kept = |p: &PairClearance| p.bound >= p.margin - TOLERANCE;
        Ok(Some(ClearanceCertificate {
            satisfied: pairs.iter().all(kept),
            pairs,
            proof: Proof::Enclosed,
            unseen: scene.unseen.clone(),
            always_near: scene.always_near.clone(),
        }))
    }
}

/// Random postures over the whole range of every joint (±π, ±0.5 m where there is none), from a fixed stream.
fn postures(robot: &Robot) -> Vec<Vec<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let ranges: Vec<[f64; 2]> = robot.joints.iter().map(Joint::range).collect();
    let one = |rng: &mut ChaCha8Rng| -> Vec<f64> {
        let each = ranges.iter();
        each.map(|[low, high]| low + (high - low) * rng.random_range(0.0..1.0))
            .collect()
    };
    (0..POSTURES).map(|_| one(&mut rng)).collect()
}

/// With the names of the two.
fn named(scene: &Scene, found: &Clearance) -> PairClearance {
    let pair = &scene.pairs[found.pair];
    PairClearance {
        between: scene.names(pair).map(String::from),
        least: found.met,
        time: found.time,
        bound: found.bound,
        margin: pair.margin,
    }
}

/// One entry for two names that have several volumes each, the least room first.
fn by_names(all: impl Iterator<Item = PairClearance>) -> Vec<PairClearance> {
    let mut out: Vec<PairClearance> = Vec::new();
    for p in all {
        match out.iter_mut().find(|o| o.between == p.between) {
            Some(old) => {
                let bound = old.bound.min(p.bound);
                if p.least < old.least {
                    *old = p;
                }
                old.bound = bound;
            }
            None => out.push(p),
        }
    }
    out.sort_by(|a, b| (a.least - a.margin).total_cmp(&(b.least - b.margin)));
    out
}

/// A Fourier series as a path: speeds are bounded by the speed in the middle of a stretch and the largest
/// acceleration.
pub struct SeriesPath<'a> {
    fourier: &'a Fourier,
    acceleration: Vec<f64>,
    speed: Vec<f64>,
    largest: Vec<f64>,
}

impl<'a> SeriesPath<'a> {
    /// Of a motion.
    pub fn new(fourier: &'a Fourier) -> Self {
        let bound = |order: u32| -> Vec<f64> {
            let joints = fourier.joints.iter();
            joints
                .map(|s| extrema(fourier.period, &fourier.harmonics, s, order).magnitude_bound())
                .collect()
        };
        SeriesPath {
            fourier,
            acceleration: bound(2),
            speed: bound(1),
            largest: bound(0),
        }
    }
}

impl Path for SeriesPath<'_> {
    fn position(&self, t: f64, q: &mut [f64]) {
        self.fourier.evaluate(t, [q]);
    }

    fn speed(&self, from: f64, to: f64, v: &mut [f64]) {
        let half = 0.5 * (to - from);
        self.fourier.derivative(1, from + half, v);
        for ((v, a), most) in v.iter_mut().zip(&self.acceleration).zip(&self.speed) {
            *v = (v.abs() + a * half).min(*most);
        }
    }

    fn largest(&self, joint: usize) -> f64 {
        self.largest[joint]
    }

    fn duration(&self) -> f64 {
        self.fourier.period
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const URDF: &str = r#"<robot name="two">
<link name="foot"><collision><geometry><box size="0.2 0.2 0.3"/></geometry></collision></link>
<link name="upper"><inertial><mass value="2"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/></inertial></link>
<link name="lower"><inertial><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/></inertial>
<collision><geometry><sphere radius="0.05"/></geometry></collision></link>
<joint name="a" type="continuous"><parent link="foot"/><child link="upper"/><origin xyz="0 0 0.4"/><axis xyz="0 1 0"/></joint>
<joint name="b" type="continuous"><parent link="upper"/><child link="lower"/><origin xyz="0.3 0 0"/><axis xyz="0 1 0"/></joint>
</robot>"#;

    fn two(margin: f64) -> Plant {
        let toml = format!(
            "name = \"two\"\nurdf = \"two.urdf\"\n[collision]\nmargin = {margin}\n\
             [[obstacle]]\nkind = \"plane\"\nnormal = [0.0, 0.0, -1.0]\noffset = -0.8\n"
        );
        let robot = Robot::from_toml_str(&toml, URDF, "robot.toml").unwrap();
        robot.into()
    }

    /// A scene takes seconds where meshes are to be enclosed, so it is looked for once, also where there is none and where a
    /// design has filled limits in.
    #[test]
    fn a_scene_is_looked_for_once() {
        let free = two(0.01);
        let scene = free.scene().unwrap().unwrap();
        let again = free.clone().with_assumed_limits().scene().unwrap().unwrap();
        assert!(Arc::ptr_eq(&scene, &again));
        let ends = |p: &Plant| postures(p.robot());
        assert_eq!(ends(&free), ends(&free.clone().with_assumed_limits()));

        // what is far enough from the floor is too near to the ceiling
        let narrow = two(0.45);
        let told = || narrow.scene().map(|s| s.is_some()).unwrap_err().to_string();
        let why = told();
        assert!(why.contains("free of contact"), "{why}");
        assert!(narrow.scene.get().is_some_and(|s| s.is_err()));
        assert_eq!(why, told());
    }
}
