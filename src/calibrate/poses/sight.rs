//! What a fixed camera sees: a target in its view and range, that faces it, with nothing in between.

use crate::calibrate::frame::Frame;
use crate::collision::Scene;
use crate::robot::geometry::Obstacle;
use crate::solid::distance::separation;
use crate::solid::shape::{Pose, Shape};
use nalgebra::Vector3;

/// Radius of the line of sight that must be free, m: half of a target of the size of a hand.
const CLEAR: f64 = 0.03;

/// A fixed camera and the target on the frame.
#[derive(Debug, Clone)]
pub struct Sight {
    /// place of the camera, base axes, m
    pub camera: Vector3<f64>,
    /// a point that it looks at, base axes, m
    pub towards: Vector3<f64>,
    /// half of the angle of its view, rad
    pub half_view: f64,
    /// nearest and farthest distance at which the target is read, m
    pub range: [f64; 2],
    /// place of the target, axes of the frame, m
    pub target: Vector3<f64>,
    /// unit normal of its face, axes of the frame
    pub normal: Vector3<f64>,
    /// largest angle between the normal and the line to the camera, rad
    pub facing: f64,
}

impl Sight {
    /// For `report.json`.
    pub fn json(&self) -> serde_json::Value {
        let list = |v: &Vector3<f64>| [v.x, v.y, v.z];
        serde_json::json!({
            "camera": list(&self.camera),
            "towards": list(&self.towards),
            "view": 2.0 * self.half_view,
            "range": self.range,
            "target": list(&self.target),
            "normal": list(&self.normal),
            "facing": self.facing,
        })
    }

    /// Whether the target is in view and range and faces the camera.
    pub fn sees(&self, frame: &Frame) -> bool {
        let target = frame.p + frame.r * self.target;
        let line = target - self.camera;
        let away = line.norm();
        if !(self.range[0]..=self.range[1]).contains(&away) || away < 1e-9 {
            return false;
        }
        let view = (self.towards - self.camera).normalize();
        let in_view = view.dot(&line) >= away * self.half_view.cos();
        let faces = -(frame.r * self.normal).dot(&line) >= away * self.facing.cos();
        in_view && faces
    }

    /// Whether no volume of the robot but those of the body that carries the target, and nothing around it, stands
    /// between target and camera.
    pub fn free(&self, frame: &Frame, scene: &Scene, poses: &[Pose], carrier: usize) -> bool {
        let line = Shape::Capsule {
            from: frame.p + frame.r * self.target,
            to: self.camera,
            radius: CLEAR,
        };
        let base = Pose::identity();
        let apart = |shape: &Shape, at: &Pose| separation(shape, at, &line, &base).distance > 0.0;
        let robot = scene.volumes.iter().filter(|v| v.body != Some(carrier));
        let mut solid = scene.obstacles.iter().filter_map(|o| match o {
            Obstacle::Solid { shape, .. } => Some(shape),
            Obstacle::Plane { .. } => None,
        });
        robot
            .into_iter()
            .all(|v| apart(&v.shape, &v.body.map_or(base, |b| poses[b])))
            && solid.all(|s| apart(s, &base))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_is_seen_in_view_in_range_and_from_its_front() {
        let sight = Sight {
            camera: Vector3::new(0.0, 0.0, 2.0),
            towards: Vector3::zeros(),
            half_view: 0.4,
            range: [0.5, 3.0],
            target: Vector3::new(0.0, 0.0, 0.05),
            normal: Vector3::z(),
            facing: 1.0,
        };
        let at = |x: f64, z: f64, tilt: f64| Frame {
            r: crate::calibrate::frame::exp(&Vector3::new(tilt, 0.0, 0.0)),
            p: Vector3::new(x, 0.0, z),
        };
        assert!(sight.sees(&at(0.0, 0.5, 0.0)) && sight.sees(&at(0.3, 0.5, 0.5)));
        assert!(!sight.sees(&at(0.9, 0.5, 0.0)), "out of view");
        assert!(!sight.sees(&at(0.0, 1.6, 0.0)), "too near");
        assert!(!sight.sees(&at(0.0, 0.5, 1.2)), "turned away");
        assert!(!sight.sees(&at(0.0, 0.5, 3.0)), "from behind");
        let ball = |centre| Scene {
            volumes: vec![crate::collision::scene::Volume {
                link: "arm".into(),
                body: None,
                shape: Shape::Sphere {
                    centre,
                    radius: 0.1,
                },
            }],
            ..Scene::default()
        };
        let frame = at(0.0, 0.5, 0.0);
        assert!(!sight.free(&frame, &ball(Vector3::new(0.05, 0.0, 1.2)), &[], 0));
        assert!(sight.free(&frame, &ball(Vector3::new(0.3, 0.0, 1.2)), &[], 0));
        assert!(
            sight.free(&frame, &ball(Vector3::new(0.0, 0.0, 0.3)), &[], 0),
            "behind the target"
        );
    }
}
