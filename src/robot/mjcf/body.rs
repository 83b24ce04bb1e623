//! Bodies and joints of an MJCF as links and joints.

use super::compiler::Compiler;
use super::frame::{Frame, joint_of};
use super::xml::{Element, Node};
use super::{geom, unit};
use crate::error::{Error, Result, Warning, WarningKind};
use crate::robot::Inertia;
use crate::robot::meant;
use crate::robot::urdf::{Kind, Limit, Link, UrdfJoint};
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use std::collections::{HashMap, HashSet};

/// Name of the link that does not move.
const WORLD: &str = "world";
/// Bodies inside one another.
const DEEPEST: usize = 256;

/// A body of the file, and the link that it became.
#[derive(Debug, Clone)]
pub struct Part<'a> {
    /// name of the link
    pub link: String,
    pub node: &'a Node,
    /// origin of the link in the frame of the body, m
    pub anchor: Vector3<f64>,
    /// whether its inertia could be told
    pub known: bool,
    /// its joints, with the defaults of their classes, and their names
    pub joints: Vec<(String, Element<'a>)>,
}

/// Collects links and joints.
pub struct Reader<'a> {
    compiler: &'a Compiler,
    /// whether an inertia that cannot be told (that of a mesh) is left out in place of refused
    pub lenient: bool,
    /// bodies, parents before children
    pub parts: Vec<Part<'a>>,
    pub links: Vec<Link>,
    pub joints: Vec<UrdfJoint>,
    pub warnings: Vec<Warning>,
    /// positions of the joints as the model stands in the file
    pub refs: HashMap<String, f64>,
    names: HashSet<String>,
}

/// What surrounds a body: the link, the frame of the body on it, the class of its elements.
#[derive(Clone)]
struct Place {
    link: String,
    frame: Frame,
    class: Option<String>,
    /// whether any joint moves it
    moves: bool,
    depth: usize,
}

impl<'a> Reader<'a> {
    pub fn new(compiler: &'a Compiler) -> Self {
        Reader {
            compiler,
            lenient: false,
            parts: Vec::new(),
            links: Vec::new(),
            joints: Vec::new(),
            warnings: Vec::new(),
            refs: HashMap::new(),
            names: HashSet::new(),
        }
    }

    /// Bodies of a `<worldbody>`.
    pub fn world(&mut self, node: &'a Node) -> Result<()> {
        if self.links.is_empty() {
            self.link(WORLD.into(), node, None);
        }
        let place = Place {
            link: WORLD.into(),
            frame: Frame::ZERO,
            class: node.own("childclass").map(String::from),
            moves: false,
            depth: 0,
        };
        self.inside(node, &place)
    }

    fn link(&mut self, name: String, node: &Node, inertia: Option<Inertia>) {
        self.links.push(Link {
            name,
            line: node.line as usize,
            inertia,
            forms: Vec::new(),
            warnings: Vec::new(),
        });
    }

    /// A name that nothing of its kind has.
    fn name(&mut self, kind: &str, node: &Node, own: Option<&str>) -> Result<String> {
        let taken = |names: &HashSet<String>, name: &str| names.contains(&format!("{kind} {name}"));
        let name = match own {
            Some(name) if taken(&self.names, name) => {
                return Err(node.error("another one has this name; rename one of them"));
            }
            Some(name) => name.to_string(),
            None => {
                let mut count = self.names.len();
                while taken(&self.names, &format!("{kind}{count}")) {
                    count += 1;
                }
                format!("{kind}{count}")
            }
        };
        self.names.insert(format!("{kind} {name}"));
        Ok(name)
    }

    /// Bodies and frames in an element.
    fn inside(&mut self, node: &'a Node, place: &Place) -> Result<()> {
        if place.depth > DEEPEST {
            return Err(node.error(format!("more than {DEEPEST} bodies inside one another")));
        }
        for child in &node.children {
            match child.tag.as_str() {
                "body" => self.body(child, place)?,
                "frame" => self.inside(child, &self.framed(child, place)?)?,
                "replicate" | "attach" | "composite" | "flexcomp" => {
                    return Err(child.error(
                        "it makes bodies that are not written here; save the model from MuJoCo \
                         (mj_saveLastXML) and read that file",
                    ));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// The place that a `<frame>` makes.
    /// Pose of a `<frame>` or a body, and the class of defaults inside.
    fn frame<'c>(
        &self,
        node: &'c Node,
        class: Option<&'c str>,
    ) -> Result<(Matrix3<f64>, Vector3<f64>, Option<&'c str>)> {
        let e = Element {
            node,
            defaults: None,
        };
        let (rotation, position) = self.pose(&e)?;
        Ok((rotation, position, node.own("childclass").or(class)))
    }

    fn framed(&self, node: &Node, place: &Place) -> Result<Place> {
        let (rotation, position, class) = self.frame(node, place.class.as_deref())?;
        Ok(Place {
            frame: place.frame.then(&rotation, &position),
            class: class.map(String::from),
            depth: place.depth + 1,
            ..place.clone()
        })
    }

    fn pose(&self, e: &Element) -> Result<(Matrix3<f64>, Vector3<f64>)> {
        Ok((
            self.compiler.rotation(e)?,
            e.vector("pos")?.unwrap_or_default(),
        ))
    }

    fn body(&mut self, node: &'a Node, place: &Place) -> Result<()> {
        let e = Element {
            node,
            defaults: None,
        };
        let (rotation, position) = self.pose(&e)?;
        let frame = place.frame.then(&rotation, &position);
        let class = node
            .own("childclass")
            .map(String::from)
            .or(place.class.clone());
        let name = self.name("body", node, node.own("name").filter(|n| *n != WORLD))?;
        if node.own("mocap") == Some("true") {
            return Ok(());
        }
        if e.number("gravcomp")?.is_some_and(|x| x != 0.0) {
            self.warnings.push(Warning::new(
                WarningKind::EntryIgnored,
                format!("line {}: body `{name}`", node.line),
                "`gravcomp` is no part of the model: its weight counts whole",
            ));
        }
        let mut joints = Vec::new();
        self.joints_in(node, class.as_deref(), Frame::ZERO, &mut joints)?;
        let moves = place.moves || !joints.is_empty();
        // that of what stands matters only for the sum of all masses
        let (inertia, known) = match moves || self.compiler.total_mass.is_some() {
            true => match self.inertia(node, class.as_deref(), &name) {
                Err(_) if self.lenient => (Inertia::default(), false),
                told => (told?, true),
            },
            false => (Inertia::default(), true),
        };
        // the frame of the body on the link that carries it, and the last joint's place on the body
        let (mut parent, mut on, mut anchor) = (place.link.clone(), frame, Vector3::zeros());
        let mut of_body = Vec::new();
        for (k, &(joint, turned)) in joints.iter().enumerate() {
            let at = joint.vector("pos")?.unwrap_or_default();
            let at = turned.position + turned.rotation * at;
            let last = k + 1 == joints.len();
            let link = match last {
                true => name.clone(),
                false => self.name("body", node, Some(&format!("{name}__{k}")))?,
            };
            let on_parent = on.then(&Matrix3::identity(), &(at - anchor));
            self.joint(&joint, &turned, &parent, &link, on_parent)?;
            let called = self.joints.last().map(|j| j.name.clone());
            of_body.push((called.unwrap_or_default(), joint));
            if !last {
                self.link(link.clone(), node, Some(Inertia::default()));
            }
            anchor = at;
            on = Frame::ZERO;
            parent = link;
        }
        if joints.is_empty() {
            let fixed = self.name("joint", node, Some(&format!("{name}__fixed")))?;
            self.joints.push(joint_of(
                fixed,
                Kind::Fixed,
                node,
                parent,
                name.clone(),
                frame,
            ));
        }
        self.parts.push(Part {
            link: name.clone(),
            node,
            anchor,
            known,
            joints: of_body,
        });
        let inertia = inertia.in_parent(&Matrix3::identity(), &-anchor);
        self.link(name.clone(), node, Some(inertia));
        let place = Place {
            link: name,
            frame: Frame {
                rotation: Matrix3::identity(),
                position: -anchor,
            },
            class,
            moves,
            depth: place.depth + 1,
        };
        self.inside(node, &place)
    }

    /// Joints of a body, those in frames included, each with the frame it stands in.
    fn joints_in(
        &self,
        node: &'a Node,
        class: Option<&str>,
        frame: Frame,
        out: &mut Vec<(Element<'a>, Frame)>,
    ) -> Result<()> {
        for child in &node.children {
            match child.tag.as_str() {
                "freejoint" => return Err(floats(child)),
                "joint" => {
                    let e = self.compiler.element(child, class)?;
                    match e.text("type").unwrap_or("hinge") {
                        "hinge" | "slide" => {}
                        "free" => return Err(floats(child)),
                        _ => {
                            return Err(child.error(
                                "a ball joint has no single position; write it as three hinges through one point",
                            ));
                        }
                    }
                    out.push((e, frame));
                }
                "frame" => {
                    let (rotation, position, class) = self.frame(child, class)?;
                    self.joints_in(child, class, frame.then(&rotation, &position), out)?;
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// The inertia of a body about its origin.
    fn inertia(&mut self, node: &'a Node, class: Option<&str>, name: &str) -> Result<Inertia> {
        let c = self.compiler;
        let stated = node.all("inertial").next();
        let mut sum = match (stated, c.from_geoms) {
            (Some(inertial), None | Some(false)) => self.stated(inertial)?,
            (_, Some(false)) => Inertia::default(),
            _ => self.of_geoms(node, class, name)?,
        };
        if sum.mass() < c.least_mass || c.least_inertia > 0.0 || c.balance {
            let at = sum.com().unwrap_or_default();
            let eigen = sum.tensor_com().symmetric_eigen();
            let mut moments = eigen.eigenvalues.map(|x| x.max(c.least_inertia));
            if c.balance && moments.sum() < 2.0 * moments.max() {
                moments.fill(moments.mean());
            }
            let r = eigen.eigenvectors;
            let tensor = r * Matrix3::from_diagonal(&moments) * r.transpose();
            sum = Inertia::from_com(sum.mass().max(c.least_mass), at, tensor);
        }
        Ok(sum)
    }

    fn of_geoms(&self, node: &'a Node, class: Option<&str>, name: &str) -> Result<Inertia> {
        let mut sum = Inertia::default();
        for child in &node.children {
            match child.tag.as_str() {
                "geom" => {
                    let e = self.compiler.element(child, class)?;
                    if let Some(one) = geom::inertia(self.compiler, &e, name)? {
                        sum = sum + one;
                    }
                }
                "frame" => {
                    let (rotation, position, class) = self.frame(child, class)?;
                    let inner = self.of_geoms(child, class, name)?;
                    sum = sum + inner.in_parent(&rotation, &position);
                }
                _ => {}
            }
        }
        Ok(sum)
    }

    fn stated(&self, node: &Node) -> Result<Inertia> {
        let e = Element {
            node,
            defaults: None,
        };
        let mass = e
            .number("mass")?
            .ok_or_else(|| node.error("it states no `mass`"))?;
        let (rotation, position) = self.pose(&e)?;
        let tensor = match (e.exactly::<6>("fullinertia")?, e.vector("diaginertia")?) {
            (Some([xx, yy, zz, xy, xz, yz]), _) => Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
            (None, Some(d)) => Matrix3::from_diagonal(&d),
            (None, None) => {
                return Err(node.error("it states neither `diaginertia` nor `fullinertia`"));
            }
        };
        let tensor = rotation * tensor * rotation.transpose();
        Ok(Inertia::from_com(mass, position, tensor))
    }

    fn joint(
        &mut self,
        e: &Element,
        turned: &Frame,
        parent: &str,
        link: &str,
        at: Frame,
    ) -> Result<()> {
        let node = e.node;
        let name = self.name("joint", node, node.own("name"))?;
        let slides = e.text("type") == Some("slide");
        let axis = unit(node, "axis", e.vector("axis")?.unwrap_or(Vector3::z()))?;
        let axis = turned.rotation * axis;
        let scale = if slides { 1.0 } else { self.compiler.angle };
        let range = e
            .exactly::<2>("range")?
            .filter(|_| match e.text("limited") {
                Some("false") => false,
                Some("true") => true,
                _ => self.compiler.autolimits,
            });
        let kind = match (slides, range) {
            (true, _) => Kind::Prismatic,
            (false, Some(_)) => Kind::Revolute,
            (false, None) => Kind::Continuous,
        };
        // the position that the joint has where the bodies are as written
        let zero = scale * e.number("ref")?.unwrap_or(0.0);
        let at = match slides {
            true => at.then(&Matrix3::identity(), &(axis * -zero)),
            false => {
                let back = Rotation3::from_axis_angle(&Unit::new_unchecked(axis), -zero);
                at.then(back.matrix(), &Vector3::zeros())
            }
        };
        self.refs.insert(name.clone(), zero);
        for (what, kind) in [
            ("stiffness", "a spring on the joint"),
            ("springdamper", "a spring on the joint"),
        ] {
            if e.number(what)?.is_some_and(|x| x != 0.0) {
                self.warnings.push(Warning::new(
                    WarningKind::EntryIgnored,
                    format!("line {}: joint `{name}`", node.line),
                    format!("{kind} (`{what}`) is no part of the model"),
                ));
            }
        }
        let force = e
            .exactly::<2>("actuatorfrcrange")?
            .filter(|_| e.text("actuatorfrclimited") != Some("false"));
        let mut joint = joint_of(name, kind, node, parent.into(), link.into(), at);
        joint.axis = axis;
        joint.meant.axis = meant::axis(&axis);
        joint.damping = e.number("damping")?.unwrap_or(0.0);
        joint.friction = e.number("frictionloss")?.unwrap_or(0.0);
        joint.armature = e.number("armature")?.unwrap_or(0.0);
        joint.limit = Some(Limit {
            line: node.line as usize,
            lower: range.map(|r| scale * r[0]),
            upper: range.map(|r| scale * r[1]),
            velocity: None,
            effort: force.map(|[a, b]| a.abs().max(b.abs())),
        });
        self.joints.push(joint);
        Ok(())
    }
}

fn floats(node: &Node) -> Error {
    node.error(
        "the robot floats, and only robots on a base that stands are read; remove the joint to bolt it to the ground",
    )
}
