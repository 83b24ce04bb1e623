//! Puts the tree of a mechanism together: legs from the base, and the platform on massless bodies
//! that move along its task coordinates.

use super::task::Task;
use crate::robot::geometry::Geometry;
use crate::robot::{Body, Inertia, Joint, Motion, Prior, Robot};
use nalgebra::{Matrix3, Vector3};

/// Where a body hangs at zero joint position.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// parent body; `None` for the base
    pub parent: Option<usize>,
    /// `R_PB`
    pub rotation: Matrix3<f64>,
    /// origin in the parent's frame, m
    pub position: Vector3<f64>,
}

impl Place {
    /// In the frame of a body.
    pub fn on(parent: usize) -> Self {
        Place::at(parent, Vector3::zeros())
    }

    /// At a point of a body, with its axes.
    pub fn at(parent: usize, position: Vector3<f64>) -> Self {
        Place {
            parent: Some(parent),
            rotation: Matrix3::identity(),
            position,
        }
    }
}

/// Collects coordinates and bodies of a [`Robot`].
#[derive(Debug, Default)]
pub struct Builder {
    joints: Vec<Joint>,
    bodies: Vec<Body>,
}

impl Builder {
    /// Adds a coordinate without limits; returns its index.
    pub fn coordinate(&mut self, name: &str, motion: Motion) -> usize {
        self.add(Joint::new(name, motion))
    }

    /// Adds a coordinate with its limits and terms; returns its index.
    pub fn add(&mut self, joint: Joint) -> usize {
        self.joints.push(joint);
        self.joints.len() - 1
    }

    /// Adds a massless body that moves with a coordinate about or along `axis` (body axes); returns
    /// its index.
    pub fn body(
        &mut self,
        name: &str,
        place: Place,
        coordinate: usize,
        axis: Vector3<f64>,
    ) -> usize {
        self.bodies.push(Body {
            name: name.into(),
            joint_name: self.joints[coordinate].name.clone(),
            parent: place.parent,
            motion: self.joints[coordinate].motion,
            axis,
            rotation: place.rotation,
            position: place.position,
            inertia: Inertia::default(),
            merged: Vec::new(),
            coordinate,
            ratio: 1.0,
            offset: 0.0,
            meant: None,
        });
        self.bodies.len() - 1
    }

    /// Gives a body its inertia.
    pub fn set(&mut self, body: usize, inertia: Inertia) {
        self.bodies[body].inertia = inertia;
    }

    /// Joint position of a body where its coordinate is zero.
    pub fn zero(&mut self, body: usize, offset: f64) {
        self.bodies[body].offset = offset;
    }

    /// Adds the task coordinates of a platform (named as in [`Task::names`]) and the bodies that
    /// carry it; returns the platform, whose frame follows the pose.
    pub fn platform(&mut self, task: Task) -> usize {
        let first = self.joints.len();
        for (k, name) in task.names().iter().enumerate() {
            let motion = match task.is_angle(k) {
                true => Motion::Revolute,
                false => Motion::Prismatic,
            };
            self.coordinate(name, motion);
        }
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        // yaw, pitch, roll: R = Rz Ry Rx
        let order: &[(usize, usize)] = match task {
            Task::Pose => &[(0, 0), (1, 1), (2, 2), (5, 2), (4, 1), (3, 0)],
            Task::Schoenflies => &[(0, 0), (1, 1), (2, 2), (3, 2)],
            Task::Translation => &[(0, 0), (1, 1), (2, 2)],
            Task::Joints(_) => &[],
        };
        let mut parent = None;
        for (i, &(k, axis)) in order.iter().enumerate() {
            let name = match i + 1 == order.len() {
                true => "platform".to_string(),
                false => format!("platform_{}", task.names()[k]),
            };
            let place = Place {
                parent,
                rotation: Matrix3::identity(),
                position: Vector3::zeros(),
            };
            parent = Some(self.body(&name, place, first + k, axes[axis]));
        }
        self.bodies.len().saturating_sub(1)
    }

    /// The robot.
    pub fn robot(self, name: &str, gravity: Vector3<f64>) -> Robot {
        let geometry = Geometry::of_bodies(&self.bodies);
        Robot {
            name: name.into(),
            bodies: self.bodies,
            joints: self.joints,
            gravity,
            prior: Prior::Cad,
            warnings: Vec::new(),
            path: None,
            hash: String::new(),
            geometry,
            tool: None,
        }
    }
}
