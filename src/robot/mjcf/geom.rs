//! The inertia of geoms: solids of constant density.

use super::compiler::{Compiler, onto};
use super::xml::Element;
use crate::error::Result;
use crate::robot::Inertia;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;

/// Density where none is stated, kg/m³.
const DENSITY: f64 = 1000.0;

/// The inertia of a geom about the origin of its body; `None` for one without mass.
pub fn inertia(compiler: &Compiler, e: &Element, body: &str) -> Result<Option<Inertia>> {
    let group = e.number("group")?.unwrap_or(0.0);
    if group < compiler.groups[0] || group > compiler.groups[1] {
        return Ok(None);
    }
    let (mass, density) = (e.number("mass")?, e.number("density")?.unwrap_or(DENSITY));
    if mass == Some(0.0) || (mass.is_none() && density == 0.0) {
        return Ok(None);
    }
    let kind = e.text("type").unwrap_or(match e.text("mesh") {
        Some(_) => "mesh",
        None => "sphere",
    });
    if matches!(kind, "plane" | "hfield") {
        return Ok(None);
    }
    if e.text("shellinertia") == Some("true") {
        return Err(e.node.error(format!(
            "body `{body}` gets its inertia from a shell, which is not read; give it an <inertial>"
        )));
    }
    let mut size = e.numbers("size")?.unwrap_or_default();
    let mut rotation = compiler.rotation(e)?;
    let mut position = e.vector("pos")?.unwrap_or_default();
    if let Some([a, b, c, d, f, g]) = e.exactly("fromto")?
        && matches!(kind, "capsule" | "cylinder" | "box" | "ellipsoid")
    {
        let (from, to) = (Vector3::new(a, b, c), Vector3::new(d, f, g));
        position = 0.5 * (from + to);
        // the axis runs from the end to the beginning
        let way = from - to;
        let z = way.try_normalize(1e-12);
        rotation = onto(&z.ok_or_else(|| e.node.error("`fromto` has no length"))?);
        let radius = size.first().copied().unwrap_or(0.0);
        size = match kind {
            "capsule" | "cylinder" => vec![radius, 0.5 * way.norm()],
            _ => vec![radius, radius, 0.5 * way.norm()],
        };
    }
    let needed = match kind {
        "sphere" => 1,
        "capsule" | "cylinder" => 2,
        "box" | "ellipsoid" => 3,
        "mesh" | "sdf" => {
            return Err(e.node.error(format!(
                "body `{body}` gets its inertia from a mesh, which is not read; give it an <inertial>, or save the \
                 model from MuJoCo with `compiler saveinertial=\"true\"`"
            )));
        }
        other => {
            return Err(e
                .node
                .error(format!("a geom of type `{other}` is not known")));
        }
    };
    if size.len() < needed || size[..needed].iter().any(|x| *x <= 0.0) {
        return Err(e.node.error(format!(
            "a {kind} needs {needed} positive numbers in `size`"
        )));
    }
    let s = |k: usize| size.get(k).copied().unwrap_or(0.0);
    let (r, h) = (s(0), 2.0 * s(1));
    let volume = match kind {
        "sphere" => 4.0 / 3.0 * PI * r.powi(3),
        "capsule" => PI * r * r * (h + 4.0 / 3.0 * r),
        "cylinder" => PI * r * r * h,
        "ellipsoid" => 4.0 / 3.0 * PI * s(0) * s(1) * s(2),
        _ => 8.0 * s(0) * s(1) * s(2),
    };
    let m = mass.unwrap_or(density * volume);
    if m < 0.0 {
        return Err(e.node.error("its mass is negative"));
    }
    let of = |a: f64, b: f64, c: f64| {
        m / 5.0 * Vector3::new(b * b + c * c, a * a + c * c, a * a + b * b)
    };
    let moments = match kind {
        "sphere" => of(r, r, r),
        "ellipsoid" => of(s(0), s(1), s(2)),
        "box" => of(s(0), s(1), s(2)) * (5.0 / 3.0),
        "cylinder" => {
            let side = m * (3.0 * r * r + h * h) / 12.0;
            Vector3::new(side, side, 0.5 * m * r * r)
        }
        _ => {
            // a cylinder, and two half spheres whose centres are 3/8 r beyond its ends
            let ends = m * 4.0 * r / (4.0 * r + 3.0 * h);
            let middle = m - ends;
            let side = middle * (3.0 * r * r + h * h) / 12.0
                + ends * (0.4 * r * r + h * h / 4.0 + 0.375 * h * r);
            Vector3::new(side, side, 0.5 * middle * r * r + 0.4 * ends * r * r)
        }
    };
    let tensor = rotation * Matrix3::from_diagonal(&moments) * rotation.transpose();
    Ok(Some(Inertia::from_com(m, position, tensor)))
}
