//! `<compiler>` and `<default>`: what numbers mean, and what stands where nothing is written.

use super::xml::{Attributes, Element, Node};
use crate::error::Result;
use nalgebra::{Matrix3, Quaternion, Rotation3, Unit, UnitQuaternion, Vector3};
use std::collections::HashMap;

/// Name of the class of what names none.
const MAIN: &str = "main";

/// Options of the file, and its classes.
#[derive(Debug, Clone)]
pub struct Compiler {
    /// rad of a unit of angle
    pub angle: f64,
    pub autolimits: bool,
    /// axes of Euler angles; capital letters are fixed in space
    eulerseq: Vec<char>,
    /// `Some(true)`: always, `Some(false)`: never, `None`: where there is no `<inertial>`
    pub from_geoms: Option<bool>,
    pub balance: bool,
    pub least_mass: f64,
    pub least_inertia: f64,
    pub total_mass: Option<f64>,
    /// groups of geoms that count
    pub groups: [f64; 2],
    classes: HashMap<String, HashMap<String, Attributes>>,
}

impl Compiler {
    /// Of a file.
    pub fn of(root: &Node) -> Result<Self> {
        let mut out = Compiler {
            angle: 1f64.to_radians(),
            autolimits: true,
            eulerseq: "xyz".chars().collect(),
            from_geoms: None,
            balance: false,
            least_mass: 0.0,
            least_inertia: 0.0,
            total_mass: None,
            groups: [0.0, 5.0],
            classes: HashMap::from([(MAIN.to_string(), HashMap::new())]),
        };
        for node in root.all("compiler") {
            let e = Element {
                node,
                defaults: None,
            };
            match e.text("angle") {
                Some("radian") => out.angle = 1.0,
                Some("degree") => out.angle = 1f64.to_radians(),
                Some(_) => return Err(node.error("`angle` is \"degree\" or \"radian\"")),
                None => {}
            }
            if e.text("coordinate") == Some("global") {
                return Err(node.error(
                    "coordinate=\"global\" is of MuJoCo before 2.3.4; save the model again with a newer one",
                ));
            }
            if let Some(text) = e.text("autolimits") {
                out.autolimits = text == "true";
            }
            if let Some(text) = e.text("eulerseq") {
                let axes: Vec<char> = text.chars().collect();
                if axes.len() != 3 || !axes.iter().all(|c| "xyzXYZ".contains(*c)) {
                    return Err(node.error("`eulerseq` is three of x, y, z, X, Y, Z"));
                }
                out.eulerseq = axes;
            }
            match e.text("inertiafromgeom") {
                Some("true") => out.from_geoms = Some(true),
                Some("false") => out.from_geoms = Some(false),
                Some(_) => out.from_geoms = None,
                None => {}
            }
            if let Some(text) = e.text("balanceinertia") {
                out.balance = text == "true";
            }
            out.least_mass = e.number("boundmass")?.unwrap_or(out.least_mass);
            out.least_inertia = e.number("boundinertia")?.unwrap_or(out.least_inertia);
            if let Some(total) = e.number("settotalmass")? {
                out.total_mass = (total > 0.0).then_some(total);
            }
            out.groups = e.exactly("inertiagrouprange")?.unwrap_or(out.groups);
        }
        for node in root.all("default") {
            let name = node.own("class").unwrap_or(MAIN);
            let start = out.classes.get(MAIN).cloned().unwrap_or_default();
            out.class(name, node, start)?;
        }
        Ok(out)
    }

    /// A class and those in it, which begin with what it has.
    fn class(
        &mut self,
        name: &str,
        node: &Node,
        mut has: HashMap<String, Attributes>,
    ) -> Result<()> {
        for child in node.children.iter().filter(|c| c.tag != "default") {
            let of = has.entry(kind(&child.tag).to_string()).or_default();
            of.extend(child.attributes.clone());
        }
        self.classes.insert(name.to_string(), has.clone());
        for child in node.all("default") {
            let name = child
                .own("class")
                .ok_or_else(|| child.error("a class inside another needs a name: `class`"))?;
            self.class(name, child, has.clone())?;
        }
        Ok(())
    }

    /// An element with the defaults of its class; `childclass` is that of the bodies around it.
    pub fn element<'a>(&'a self, node: &'a Node, childclass: Option<&str>) -> Result<Element<'a>> {
        let name = node.own("class").or(childclass).unwrap_or(MAIN);
        let class = self.classes.get(name).ok_or_else(|| {
            node.error(format!(
                "no <default> has the class `{name}`; add it or correct it"
            ))
        })?;
        Ok(Element {
            node,
            defaults: class.get(kind(&node.tag)),
        })
    }

    /// The rotation that an element states, in any of the five forms.
    pub fn rotation(&self, e: &Element) -> Result<Matrix3<f64>> {
        let bad = |what: &str| e.node.error(format!("`{what}` has no direction"));
        if let Some([w, x, y, z]) = e.exactly("quat")? {
            let q = Quaternion::new(w, x, y, z);
            let q = UnitQuaternion::try_new(q, 1e-12).ok_or_else(|| bad("quat"))?;
            return Ok(q.to_rotation_matrix().into_inner());
        }
        if let Some([x, y, z, angle]) = e.exactly("axisangle")? {
            let axis = Unit::try_new(Vector3::new(x, y, z), 1e-12);
            let axis = axis.ok_or_else(|| bad("axisangle"))?;
            return Ok(Rotation3::from_axis_angle(&axis, angle * self.angle).into_inner());
        }
        if let Some([a, b, c, d, f, g]) = e.exactly("xyaxes")? {
            let x = Vector3::new(a, b, c).try_normalize(1e-12);
            let x = x.ok_or_else(|| bad("xyaxes"))?;
            let y = Vector3::new(d, f, g);
            let y = (y - x * x.dot(&y)).try_normalize(1e-12);
            let y = y.ok_or_else(|| bad("xyaxes"))?;
            return Ok(Matrix3::from_columns(&[x, y, x.cross(&y)]));
        }
        if let Some(z) = e.vector("zaxis")? {
            let z = z.try_normalize(1e-12).ok_or_else(|| bad("zaxis"))?;
            return Ok(onto(&z));
        }
        if let Some(angles) = e.exactly::<3>("euler")? {
            let mut out = Matrix3::identity();
            for (axis, angle) in self.eulerseq.iter().zip(angles) {
                let unit = match axis.to_ascii_lowercase() {
                    'x' => Vector3::x_axis(),
                    'y' => Vector3::y_axis(),
                    _ => Vector3::z_axis(),
                };
                let turn = Rotation3::from_axis_angle(&unit, angle * self.angle).into_inner();
                out = match axis.is_ascii_lowercase() {
                    true => out * turn,
                    false => turn * out,
                };
            }
            return Ok(out);
        }
        Ok(Matrix3::identity())
    }
}

/// The smallest rotation that takes z onto a direction.
pub fn onto(z: &Vector3<f64>) -> Matrix3<f64> {
    match Rotation3::rotation_between(&Vector3::z(), z) {
        Some(r) => r.into_inner(),
        // straight back
        None => Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI).into_inner(),
    }
}

/// Elements that share their defaults.
fn kind(tag: &str) -> &str {
    match tag {
        "motor" | "position" | "velocity" | "intvelocity" | "damper" | "cylinder" | "muscle"
        | "adhesion" | "general" | "dcmotor" | "pid" => "general",
        _ => tag,
    }
}
