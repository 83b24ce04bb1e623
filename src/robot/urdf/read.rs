//! XML to links and joints.

use super::geometry::forms;
use super::{ByPosition, Kind, Limit, Link, Mimic, Urdf, UrdfJoint};
use crate::error::{Error, Result, Warning, WarningKind};
use crate::robot::{Inertia, Placement, meant};
use nalgebra::{Matrix3, Vector3};
use roxmltree::{Document, Node};
use std::collections::HashMap;
use std::path::Path;

/// Relative tolerance on the triangle inequality: published tensors are rounded to three digits.
const TRIANGLE_TOLERANCE: f64 = 1e-3;
/// Relative tolerance on a negative principal moment.
const EIGENVALUE_TOLERANCE: f64 = 1e-6;

/// Largest length (m), mass (kg) and moment of inertia (kg m²) of anything that is taken for a
/// robot. What is more is a slip of a digit or of a unit, and would leave no digit for the rest.
const LARGEST: [f64; 3] = [1e7, 1e6, 1e8];

/// Elements whose attributes are read.
const READ: [&str; 13] = [
    "robot",
    "link",
    "joint",
    "parent",
    "child",
    "origin",
    "axis",
    "limit",
    BY_POSITION,
    "mimic",
    "dynamics",
    "mass",
    "inertia",
];

/// Franka's extension of `<joint>`: velocity limits that depend on the position.
const BY_POSITION: &str = "position_based_velocity_limits";

/// Name and text that errors refer to.
struct Source<'a> {
    file: &'a Path,
    /// byte offsets at which lines begin
    lines: Vec<usize>,
}

impl<'a> Source<'a> {
    fn new(file: &'a Path, text: &str) -> Self {
        let starts = text
            .bytes()
            .enumerate()
            .filter(|(_, b)| *b == b'\n')
            .map(|(i, _)| i + 1);
        Source {
            file,
            lines: std::iter::once(0).chain(starts).collect(),
        }
    }

    fn line(&self, node: Node) -> usize {
        self.lines
            .partition_point(|&start| start <= node.range().start)
    }

    /// `what` is a joint or link with its name, or the element itself.
    fn error(&self, node: Node, what: &str, message: impl Into<String>) -> Error {
        Error::file(
            self.file,
            format!("line {}: {what}", self.line(node)),
            message,
        )
    }

    /// A finite number in an attribute; `None` where the attribute is absent.
    fn number(&self, node: Node, attribute: &str, what: &str) -> Result<Option<f64>> {
        let Some(text) = node.attribute(attribute) else {
            return Ok(None);
        };
        let tag = node.tag_name().name();
        match text.trim().parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            Ok(_) => Err(self.error(
                node,
                what,
                format!("`{attribute}=\"{text}\"` in <{tag}> is not finite; state a number"),
            )),
            Err(_) => Err(self.error(
                node,
                what,
                format!(
                    "`{attribute}=\"{}\"` in <{tag}> is not a number; write it as in 1.5 or 2e-3",
                    shorten(text)
                ),
            )),
        }
    }

    /// Three finite numbers in an attribute.
    fn vector(&self, node: Node, attribute: &str, what: &str) -> Result<Option<Vector3<f64>>> {
        let Some(text) = node.attribute(attribute) else {
            return Ok(None);
        };
        let values: Vec<Option<f64>> = text
            .split_whitespace()
            .take(4)
            .map(|t| t.parse::<f64>().ok())
            .collect();
        match values[..] {
            [Some(x), Some(y), Some(z)] if x.is_finite() && y.is_finite() && z.is_finite() => {
                Ok(Some(Vector3::new(x, y, z)))
            }
            _ => Err(self.error(
                node,
                what,
                format!(
                    "`{attribute}=\"{}\"` in <{}> must be three finite numbers separated by spaces",
                    shorten(text),
                    node.tag_name().name()
                ),
            )),
        }
    }

    /// `<origin>` of a joint or inertial: rotation and position; the identity where it is absent.
    fn origin(&self, node: Option<Node>, what: &str) -> Result<(Matrix3<f64>, Vector3<f64>)> {
        let Some(node) = node else {
            return Ok((Matrix3::identity(), Vector3::zeros()));
        };
        let position = self.vector(node, "xyz", what)?.unwrap_or_default();
        if position.amax() > LARGEST[0] {
            return Err(self.error(
                node,
                what,
                format!(
                    "`xyz=\"{}\"` lies {:.1e} m away, and {:.0e} m is the most that is read; \
                     correct it, in m",
                    shorten(node.attribute("xyz").unwrap_or_default()),
                    position.amax(),
                    LARGEST[0]
                ),
            ));
        }
        let rpy = self.vector(node, "rpy", what)?.unwrap_or_default();
        Ok((meant::rotation(&rpy), position))
    }

    /// The rotation that `rpy` of an `<origin>` means, with a warning about numbers that are
    /// written too short.
    fn meant_rotation(
        &self,
        node: Option<Node>,
        what: &str,
        warnings: &mut Vec<Warning>,
    ) -> Result<Matrix3<f64>> {
        let Some(node) = node else {
            return Ok(Matrix3::identity());
        };
        let mut rpy = self.vector(node, "rpy", what)?.unwrap_or_default();
        let texts = node.attribute("rpy").unwrap_or_default();
        for (x, text) in rpy.iter_mut().zip(texts.split_whitespace()) {
            let angle = meant::angle(text, *x);
            if angle.coarse {
                warnings.push(Warning::new(
                    WarningKind::AngleRounded,
                    what,
                    format!(
                        "line {}: rpy holds {text}, taken for {} where it is decided what can be \
                         identified; write {:.16}",
                        self.line(node),
                        multiple_of_pi(angle.value),
                        angle.value
                    ),
                ));
            }
            *x = angle.value;
        }
        Ok(meant::rotation(&rpy))
    }
}

/// A multiple of a right angle in words: `pi`, `-pi/2`, `3 pi/2`.
fn multiple_of_pi(angle: f64) -> String {
    let halves = (angle / std::f64::consts::FRAC_PI_2).round();
    let sign = if halves < 0.0 { "-" } else { "" };
    let (count, over) = match halves.abs() {
        n if n % 2.0 == 0.0 => (n / 2.0, ""),
        n => (n, "/2"),
    };
    match count == 1.0 {
        true => format!("{sign}pi{over}"),
        false => format!("{sign}{count} pi{over}"),
    }
}

/// At most 60 characters of a value that is quoted in a message.
fn shorten(text: &str) -> String {
    match text.char_indices().nth(60) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_string(),
    }
}

/// First child element of this name; a second one is reported.
fn child<'a, 'd>(
    node: Node<'a, 'd>,
    tag: &str,
    what: &str,
    warnings: &mut Vec<Warning>,
) -> Option<Node<'a, 'd>> {
    let mut found = node
        .children()
        .filter(|n| n.is_element() && n.tag_name().name() == tag);
    let first = found.next();
    if found.next().is_some() {
        warnings.push(Warning::new(
            WarningKind::EntryIgnored,
            what,
            format!("<{tag}> is given twice; the first is used"),
        ));
    }
    first
}

pub(super) fn read(text: &str, file: &Path) -> Result<Urdf> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    if text.trim().is_empty() {
        return Err(Error::file(
            file,
            "",
            "the file is empty; a URDF begins with <robot name=…>",
        ));
    }
    let document = Document::parse(text).map_err(|e| xml_error(text, file, &e))?;
    let source = Source::new(file, text);
    let root = document.root_element();
    xacro(&source, root)?;
    if root.tag_name().name() != "robot" {
        let tag = root.tag_name().name();
        let hint = match tag {
            "sdf" => "this is an SDF model; convert it to URDF",
            _ => "is this another kind of file?",
        };
        return Err(source.error(
            root,
            &format!("<{tag}>"),
            format!("the root element of a URDF is <robot>; {hint}"),
        ));
    }
    let mut urdf = Urdf {
        name: root
            .attribute("name")
            .unwrap_or_default()
            .trim()
            .to_string(),
        file: file.to_path_buf(),
        links: Vec::new(),
        joints: Vec::new(),
        warnings: Vec::new(),
        gravity: super::GRAVITY,
    };
    let (mut links, mut joints) = (HashMap::new(), HashMap::new());
    for node in root.children().filter(Node::is_element) {
        let tag = node.tag_name().name();
        let seen = match tag {
            "link" => &mut links,
            "joint" => &mut joints,
            _ => continue,
        };
        let name = node.attribute("name").unwrap_or_default();
        if name.trim().is_empty() {
            return Err(source.error(node, &format!("<{tag}>"), "it needs a `name`"));
        }
        let what = format!("{tag} `{name}`");
        if let Some(line) = seen.insert(name, source.line(node)) {
            return Err(source.error(
                node,
                &what,
                format!("line {line} has a {tag} of the same name; rename one of them"),
            ));
        }
        if tag == "link" {
            urdf.links.push(link(&source, node, name, &what)?);
        } else {
            urdf.joints
                .push(joint(&source, node, name, &what, &mut urdf.warnings)?);
        }
    }
    if urdf.links.is_empty() {
        return Err(source.error(root, "<robot>", "it has no <link>; nothing can move"));
    }
    let coordinates = urdf.joints.iter().flat_map(|j| j.position.iter().copied());
    let largest = coordinates.fold(0.0, |most: f64, x| most.max(x.abs()));
    for joint in &mut urdf.joints {
        joint.meant.position = meant::position(&joint.position, largest);
    }
    Ok(urdf)
}

/// Malformed XML, with the line and a remedy for the common causes.
fn xml_error(text: &str, file: &Path, error: &roxmltree::Error) -> Error {
    use roxmltree::Error as Xml;
    let message = match error {
        Xml::UnknownNamespace(prefix, _) if prefix == "xacro" => {
            "it uses xacro, and <robot> does not declare it; add \
             xmlns:xacro=\"http://www.ros.org/wiki/xacro\""
                .to_string()
        }
        _ if !text.trim_start().starts_with('<') => {
            "this is not XML; a URDF begins with <robot name=…>".to_string()
        }
        Xml::DtdDetected => "document type definitions are not read; remove <!DOCTYPE>".to_string(),
        _ => {
            let said = error.to_string();
            let said = said.split(" at ").next().unwrap_or_default().to_string();
            format!("malformed XML: {said}; correct the file or export it again")
        }
    };
    let row = match error {
        Xml::NoRootNode | Xml::UnclosedRootNode | Xml::DtdDetected => None,
        _ => Some(error.pos().row),
    };
    let place = row.map_or(String::new(), |row| format!("line {row}"));
    Error::file(file, place, message)
}

/// An unexpanded xacro has elements in its namespace or expressions in attributes. The declaration
/// alone (`xmlns:xacro`) stays in expanded files, too.
fn xacro(source: &Source, root: Node) -> Result<()> {
    let unexpanded = root.descendants().filter(Node::is_element).find(|n| {
        n.tag_name()
            .namespace()
            .is_some_and(|ns| ns.contains("xacro"))
            || (READ.contains(&n.tag_name().name())
                && n.attributes()
                    .any(|a| a.value().contains("${") || a.value().contains("$(")))
    });
    match unexpanded {
        Some(node) => Err(source.error(
            node,
            &format!("<{}>", node.tag_name().name()),
            "this is the text of a xacro file; name the file itself, which is expanded as it is read",
        )),
        None => Ok(()),
    }
}

fn link(source: &Source, node: Node, name: &str, what: &str) -> Result<Link> {
    let mut warnings = Vec::new();
    let inertia = match child(node, "inertial", what, &mut warnings) {
        Some(inertial) => Some(inertial_parameters(source, inertial, what, &mut warnings)?),
        None => None,
    };
    Ok(Link {
        name: name.to_string(),
        line: source.line(node),
        inertia,
        forms: forms(node, &|n| source.line(n)),
        warnings,
    })
}

/// `<inertial>`, about the origin and in the axes of the link frame:
/// `φ = (m, m c, R I_C Rᵀ + m (|c|² 1 − c cᵀ))`.
fn inertial_parameters(
    source: &Source,
    node: Node,
    what: &str,
    warnings: &mut Vec<Warning>,
) -> Result<Inertia> {
    let mut warn = |kind, message: String| warnings.push(Warning::new(kind, what, message));
    let mut again = Vec::new();
    let (rotation, com) = source.origin(child(node, "origin", what, &mut again), what)?;
    let mass = match child(node, "mass", what, &mut again) {
        Some(m) => source.number(m, "value", what)?,
        None => None,
    };
    if mass.is_none() {
        warn(
            WarningKind::InertiaMissing,
            "<inertial> has no <mass value=…>; taken as 0".to_string(),
        );
    }
    let mass = mass.unwrap_or(0.0);
    if mass.abs() > LARGEST[1] {
        return Err(source.error(
            node,
            what,
            format!(
                "its mass is {mass:.1e} kg, and {:.0e} kg is the most that is read; correct it, \
                 in kg",
                LARGEST[1]
            ),
        ));
    }
    let mut entries = [0.0; 6];
    if let Some(tensor) = child(node, "inertia", what, &mut again) {
        let names = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];
        let mut absent = Vec::new();
        for (entry, name) in entries.iter_mut().zip(names) {
            match source.number(tensor, name, what)? {
                Some(value) => *entry = value,
                None => absent.push(name),
            }
        }
        if !absent.is_empty() {
            warn(
                WarningKind::InertiaMissing,
                format!("<inertia> lacks {}; taken as 0", absent.join(", ")),
            );
        }
    }
    let most = entries.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    if most > LARGEST[2] {
        return Err(source.error(
            node,
            what,
            format!(
                "its inertia tensor holds {most:.1e} kg m^2, and {:.0e} is the most that is read; \
                 correct it, in kg m^2",
                LARGEST[2]
            ),
        ));
    }
    let [xx, xy, xz, yy, yz, zz] = entries;
    let tensor = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    let inertia = Inertia::from_com(mass, com, rotation * tensor * rotation.transpose());
    if !inertia.0.iter().all(|x| x.is_finite()) {
        return Err(source.error(
            node,
            what,
            "its inertia overflows; use kg, m and kg m^2 of a real robot",
        ));
    }
    if mass < 0.0 {
        warn(
            WarningKind::InertiaImpossible,
            format!("its mass is {mass} kg; a body has a positive mass"),
        );
    }
    if entries == [0.0; 6] {
        if mass != 0.0 {
            warn(
                WarningKind::InertiaMissing,
                format!("a mass of {mass} kg but no inertia tensor; taken as a point mass"),
            );
        }
    } else if mass == 0.0 {
        warn(
            WarningKind::InertiaImpossible,
            "an inertia tensor but no mass; such a body cannot exist".to_string(),
        );
    } else {
        // about the centre of mass as written, so that a distant origin does not blur it
        let (smallest, triangle) = Inertia::from_com(1.0, Vector3::zeros(), tensor).realizability();
        if smallest < -EIGENVALUE_TOLERANCE {
            warn(
                WarningKind::InertiaImpossible,
                format!(
                    "its inertia tensor has a negative principal moment ({:.2} of the largest); \
                 such a body cannot exist",
                    smallest
                ),
            );
        } else if triangle > TRIANGLE_TOLERANCE {
            warn(
                WarningKind::InertiaImpossible,
                format!(
                    "its largest principal moment exceeds the sum of the others by {:.1} %; \
                 such a body cannot exist",
                    100.0 * triangle
                ),
            );
        }
    }
    warnings.append(&mut again);
    Ok(inertia)
}

fn joint(
    source: &Source,
    node: Node,
    name: &str,
    what: &str,
    warnings: &mut Vec<Warning>,
) -> Result<UrdfJoint> {
    let kind = match node.attribute("type").map(str::trim) {
        Some("revolute") => Kind::Revolute,
        Some("continuous") => Kind::Continuous,
        Some("prismatic") => Kind::Prismatic,
        Some("fixed") => Kind::Fixed,
        Some("planar") => Kind::Planar,
        Some("floating") => Kind::Floating,
        other => {
            let said = other.map_or("it has no `type`".to_string(), |t| {
                format!("type `{}` does not exist", shorten(t))
            });
            return Err(source.error(
                node,
                what,
                format!("{said}; use revolute, continuous, prismatic or fixed"),
            ));
        }
    };
    let mut end = |tag: &str| -> Result<String> {
        let link = child(node, tag, what, warnings).and_then(|n| n.attribute("link"));
        link.map(str::to_string).ok_or_else(|| {
            source.error(
                node,
                what,
                format!("it has no {tag}; add <{tag} link=\"…\"/>"),
            )
        })
    };
    let (parent, child_link) = (end("parent")?, end("child")?);
    let origin = child(node, "origin", what, warnings);
    let (rotation, position) = source.origin(origin, what)?;
    let mut coarse = Vec::new();
    let meant_rotation = source.meant_rotation(origin, what, &mut coarse)?;
    if kind != Kind::Fixed {
        warnings.append(&mut coarse);
    }
    let axis = match child(node, "axis", what, warnings) {
        Some(a) => {
            let axis = source.vector(a, "xyz", what)?.unwrap_or(Vector3::x());
            // scaled first: squares of very large or small entries would leave the range
            let scale = axis.amax();
            if scale == 0.0 && kind != Kind::Fixed {
                return Err(source.error(
                    a,
                    what,
                    "its axis is zero; state the direction in which it moves",
                ));
            }
            if scale == 0.0 {
                Vector3::x()
            } else {
                (axis / scale).normalize()
            }
        }
        None => Vector3::x(),
    };
    let limit = match child(node, "limit", what, warnings) {
        Some(l) => Some(Limit {
            line: source.line(l),
            lower: source.number(l, "lower", what)?,
            upper: source.number(l, "upper", what)?,
            velocity: source.number(l, "velocity", what)?,
            effort: source.number(l, "effort", what)?,
        }),
        None => None,
    };
    let by_position = match child(node, BY_POSITION, what, warnings) {
        Some(l) => Some(ByPosition {
            line: source.line(l),
            deceleration: source.number(l, "deceleration_limit", what)?,
            offset: source.number(l, "velocity_offset", what)?,
        }),
        None => None,
    };
    let mimic = match child(node, "mimic", what, warnings) {
        Some(m) => Some(Mimic {
            line: source.line(m),
            joint: m
                .attribute("joint")
                .ok_or_else(|| {
                    source.error(
                        m,
                        what,
                        "<mimic> names no joint; add joint=\"…\" or remove it",
                    )
                })?
                .to_string(),
            multiplier: source.number(m, "multiplier", what)?.unwrap_or(1.0),
            offset: source.number(m, "offset", what)?.unwrap_or(0.0),
        }),
        None => None,
    };
    let (mut damping, mut friction) = (0.0, 0.0);
    if let Some(d) = child(node, "dynamics", what, warnings) {
        damping = source.number(d, "damping", what)?.unwrap_or(0.0);
        friction = source.number(d, "friction", what)?.unwrap_or(0.0);
        if damping < 0.0 || friction < 0.0 {
            warnings.push(Warning::new(
                WarningKind::NegativeParameter,
                what,
                "negative damping or friction in <dynamics>; kept as written",
            ));
        }
    }
    Ok(UrdfJoint {
        name: name.to_string(),
        line: source.line(node),
        kind,
        parent,
        child: child_link,
        rotation,
        position,
        axis,
        meant: Placement {
            axis: meant::axis(&axis),
            rotation: meant_rotation,
            position,
        },
        limit,
        by_position,
        mimic,
        damping,
        friction,
        armature: 0.0,
    })
}
