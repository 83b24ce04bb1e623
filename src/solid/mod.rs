//! Convex volumes, the distance between them, and volumes that enclose a mesh.
//!
//! | file | content |
//! |---|---|
//! | [`shape`] | sphere, capsule, box: a convex core swept by a radius |
//! | [`distance`] | signed distance of two shapes, witness points and normal |
//! | [`mesh`] | triangles |
//! | [`formats`] | triangles from STL and OBJ files |
//! | [`dae`] | triangles from COLLADA files |
//! | [`hull`] | convex hull of points, its volume |
//! | [`fit`] | capsules and boxes that enclose a mesh |
//! | `parts` | a mesh in parts, split where that saves most |
//! | [`hulls`] | hulls of few corners that enclose a mesh |

pub mod dae;
pub mod distance;
mod enclose;
pub mod fit;
pub mod formats;
pub mod hull;
pub mod hulls;
pub mod mesh;
mod parts;
pub mod shape;

pub use distance::{Separation, separation};
pub use shape::{Pose, Shape};
