//! XML to links and joints.

use super::geometry::forms;
use super::inertial::inertial_parameters;
use super::source::{Source, child, shorten};
use super::{ByPosition, Kind, Limit, Link, Mimic, Urdf, UrdfJoint};
use crate::error::{Error, Result, Warning, WarningKind};
use crate::robot::xml_error::malformed;
use crate::robot::{Placement, meant};
use nalgebra::Vector3;
use roxmltree::{Document, Node};
use std::collections::HashMap;
use std::path::Path;

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
    let (place, said) = malformed(text, error);
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
        _ => format!("{said}; correct the file or export it again"),
    };
    let place = match error {
        Xml::DtdDetected => String::new(),
        _ => place,
    };
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
