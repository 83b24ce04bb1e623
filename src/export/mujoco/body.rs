//! Bodies in MuJoCo's XML: where they stand and what they weigh.

use super::solid;
use crate::export::escape;
use crate::robot::{Body, Inertia, Motion};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use std::fmt::Write;

/// `pos="…" quat="…"` of a frame in its parent's.
pub(in crate::export) fn placement(position: &Vector3<f64>, q: &UnitQuaternion<f64>) -> String {
    format!(
        "pos=\"{} {} {}\" quat=\"{} {} {} {}\"",
        position.x, position.y, position.z, q.w, q.i, q.j, q.k
    )
}

/// The element `inertial` of the massless body between the ground and a base that tilts about x and y. Its moment about z
/// is felt by no small tilt: the larger of both, with which the body can exist.
pub(in crate::export) fn tilting(inertia: &[f64; 2]) -> String {
    let [x, y] = inertia.map(|i| i.max(1e-6));
    format!(
        "<inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"{x} {y} {}\"/>",
        x.max(y)
    )
}

/// The element `inertial` of a body; at its frame's origin where it has no mass.
pub(in crate::export) fn inertial(body: &Inertia) -> String {
    let (c, i) = (body.com().unwrap_or_default(), body.tensor_com());
    format!(
        "<inertial pos=\"{} {} {}\" mass=\"{}\" fullinertia=\"{} {} {} {} {} {}\"/>",
        c.x,
        c.y,
        c.z,
        body.mass(),
        i.m11,
        i.m22,
        i.m33,
        i.m12,
        i.m13,
        i.m23
    )
}

/// Opens a body that stands there in its parent, with its inertia where it has one.
pub(in crate::export) fn open(
    out: &mut String,
    pad: &str,
    body: &Body,
    position: &Vector3<f64>,
    rotation: &Matrix3<f64>,
) {
    let at = placement(position, &UnitQuaternion::from_matrix(rotation));
    let _ = writeln!(out, "{pad}<body name=\"{}\" {at}>", escape(&body.name));
    let inertia = solid(&body.inertia);
    if inertia.com().is_some() {
        let _ = writeln!(out, "{pad}  {}", inertial(&inertia));
    }
}

/// Type of the joint that moves a body.
pub(in crate::export) fn kind(body: &Body) -> &'static str {
    match body.motion {
        Motion::Revolute => "hinge",
        Motion::Prismatic => "slide",
    }
}
