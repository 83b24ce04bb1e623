//! Shapes that bound a robot and its surroundings, and the distance between them.
//!
//! | file | content |
//! |---|---|
//! | [`shape`] | sphere, capsule, box, half-space: a convex core swept by a radius |
//! | [`distance`] | signed distance of two shapes, witness points and normal |
//! | [`mesh`] | triangles from STL and OBJ files |
//! | [`hull`] | convex hull of points, its volume |
//! | [`fit`] | capsules that enclose a mesh |
//! | [`scene`] | volumes and obstacles of a robot, pairs of them, gradients |
//! | [`clearance`] | least clearance of a motion over all time |
//!
//! No command uses this yet: neither a design nor its report looks at collisions.

pub mod clearance;
pub mod distance;
pub mod fit;
pub mod hull;
pub mod mesh;
pub mod scene;
pub mod shape;

pub use distance::{Separation, separation};
pub use shape::{Pose, Shape};
