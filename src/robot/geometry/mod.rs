//! Volumes of links and things around a robot, as its files state them.
//!
//! A URDF gives geometry by link: `<collision>`, or `<visual>` where a link has none. `robot.toml` can state
//! volumes instead (`[[volume]]`), what stands around (`[[obstacle]]`), where a frame must stay (`[[keep_in]]`)
//! and rules (`[collision]`). Meshes are opened, and enclosed by capsules and boxes, when the volumes are first
//! asked for ([`Geometry::volumes`]).

mod entry;
mod find;
mod volumes;

pub(crate) use entry::{CollisionEntry, Entries, KeepInEntry, ShapeEntry, folders};
pub use volumes::{LinkVolume, Origin, Volumes};

use super::Body;
use crate::solid::{Pose, Shape};
use nalgebra::Vector3;
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

/// A link, and where it sits.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// name
    pub name: String,
    /// body that carries it; `None`: the base
    pub body: Option<usize>,
    /// of the link's frame in that of the body
    pub pose: Pose,
    /// name of the link that carries it
    pub parent: Option<String>,
}

/// A form of a link's geometry.
#[derive(Debug, Clone, PartialEq)]
pub enum Form {
    /// sphere or box, in the frame of the link
    Solid(Shape),
    /// cylinder along z
    Cylinder {
        /// in the frame of the link
        pose: Pose,
        /// m
        radius: f64,
        /// m
        length: f64,
    },
    /// mesh file
    Mesh {
        /// in the frame of the link
        pose: Pose,
        /// as the file names it
        file: String,
        /// factors of its three coordinates
        scale: Vector3<f64>,
    },
    /// geometry that cannot be read, and why
    Unreadable(String),
}

/// One geometry of a link.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// index into [`Geometry::links`]
    pub link: usize,
    /// what it is
    pub form: Form,
}

/// A fixed thing in the base frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Obstacle {
    /// what lies below `normalᵀ x = offset`: a floor, a table, a wall, a ceiling
    Plane {
        /// name in reports
        name: String,
        /// unit normal, away from the solid
        normal: Vector3<f64>,
        /// m
        offset: f64,
    },
    /// a convex thing
    Solid {
        /// name in reports
        name: String,
        /// in the base frame
        shape: Shape,
    },
}

impl Obstacle {
    /// Name in reports.
    pub fn name(&self) -> &str {
        match self {
            Obstacle::Plane { name, .. } | Obstacle::Solid { name, .. } => name,
        }
    }
}

/// Box of the base frame in which the origin of a frame must stay.
#[derive(Debug, Clone, PartialEq)]
pub struct KeepIn {
    /// name of a link
    pub frame: String,
    /// least coordinates, m; infinite where there is no bound
    pub low: Vector3<f64>,
    /// largest coordinates, m
    pub high: Vector3<f64>,
}

/// Distance that is kept where none is stated, m.
pub const MARGIN: f64 = 0.02;

/// What the files of a robot say about volumes.
#[derive(Debug, Clone, Default)]
pub struct Geometry {
    /// links in document order
    pub links: Vec<Link>,
    /// geometry of links, in document order
    pub parts: Vec<Part>,
    /// volumes that stand instead of a link's geometry, in the frame of the link: index into `links`
    pub stated: Vec<(usize, Shape)>,
    /// what stands around the robot
    pub obstacles: Vec<Obstacle>,
    /// where frames must stay
    pub keep_in: Vec<KeepIn>,
    /// whether collisions are looked at
    pub check: Option<bool>,
    /// whether the plane `z = 0` of the base frame is a floor
    pub floor: Option<bool>,
    /// least distance of any two, m
    pub margin: Option<f64>,
    /// pairs of links that are not looked at
    pub ignore: Vec<[String; 2]>,
    /// SRDF file whose disabled pairs are not looked at
    pub srdf: Option<PathBuf>,
    /// folders in which meshes are looked for, the first that has one wins
    pub folders: Vec<PathBuf>,
    pub(super) fitted: Arc<OnceLock<Volumes>>,
}

impl Geometry {
    /// Volumes of all links, in body frames. Meshes are opened and enclosed at the first call; robots that are
    /// copies of each other share the result.
    pub fn volumes(&self) -> &Volumes {
        self.fitted.get_or_init(|| volumes::fitted(self))
    }

    /// The same statements, each part of these links enclosed by up to `most` hulls.
    pub(crate) fn finer(&self, links: &[usize], most: usize) -> Self {
        self.with_volumes(volumes::finer(self, links, most))
    }

    /// The same statements with these volumes.
    pub(crate) fn with_volumes(&self, volumes: Volumes) -> Self {
        Geometry {
            fitted: Arc::new(OnceLock::from(volumes)),
            ..self.clone()
        }
    }

    /// The links of a tree that comes from no URDF: the base and its bodies, without geometry.
    pub(crate) fn of_bodies(bodies: &[Body]) -> Self {
        let base = Link {
            name: "base".into(),
            body: None,
            pose: Pose::identity(),
            parent: None,
        };
        let links = bodies.iter().enumerate().map(|(i, b)| Link {
            name: b.name.clone(),
            body: Some(i),
            pose: Pose::identity(),
            parent: Some(b.parent.map_or("base", |p| bodies[p].name.as_str()).into()),
        });
        Geometry {
            links: std::iter::once(base).chain(links).collect(),
            ..Geometry::default()
        }
    }

    /// Index of the link of this name.
    pub fn link(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|l| l.name == name)
    }

    /// Whether the files say anything about volumes or surroundings.
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty() && self.stated.is_empty() && self.keep_in.is_empty()
    }

    /// Looks for meshes in these folders first.
    pub fn look_in(&mut self, folders: &[PathBuf]) {
        self.folders.splice(0..0, folders.iter().cloned());
        self.forget();
    }

    /// These statements with other ones: what was fitted is forgotten.
    pub(crate) fn forget(&mut self) {
        self.fitted = Arc::default();
    }
}
