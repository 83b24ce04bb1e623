//! `<collision>` and `<visual>` of a link.
//!
//! Nothing here is an error of the file: what cannot be read becomes [`Form::Unreadable`] and is told where
//! volumes are asked for. Identification needs none.

use crate::robot::geometry::Form;
use crate::robot::meant;
use crate::solid::{Pose, Shape};
use nalgebra::Vector3;
use roxmltree::Node;

/// Most geometries of one link that are read.
const MOST: usize = 256;

/// The collision geometry of a link, else its visual one, in the frame of the link; `line` tells where an element
/// stands.
pub(super) fn forms(link: Node, line: &dyn Fn(Node) -> usize) -> Vec<Form> {
    let of = |tag: &'static str| {
        link.children()
            .filter(move |n| n.is_element() && n.tag_name().name() == tag)
            .take(MOST)
            .flat_map(|n| form(n, line))
            .collect::<Vec<_>>()
    };
    let collision = of("collision");
    match collision.is_empty() {
        true => of("visual"),
        false => collision,
    }
}

/// The form in one `<collision>`; none where it holds no `<geometry>`.
fn form(node: Node, line: &dyn Fn(Node) -> usize) -> Option<Form> {
    let element = |node: Node<'_, '_>, name: &str| {
        node.children()
            .find(|n| n.is_element() && n.tag_name().name() == name)
            .map(|n| n.id())
    };
    let get = |id| node.document().get_node(id);
    let geometry = element(node, "geometry").and_then(get)?;
    let kind = geometry.children().find(Node::is_element)?;
    let place = format!("line {}", line(kind));
    let pose = match element(node, "origin").and_then(get) {
        None => Some(Pose::identity()),
        Some(origin) => {
            let of = |name| three(origin, name, Vector3::zeros());
            of("xyz").zip(of("rpy")).map(|(position, rpy)| Pose {
                rotation: meant::rotation(&rpy),
                position,
            })
        }
    };
    let Some(pose) = pose else {
        let why = format!("{place}: its <origin> is not three numbers each");
        return Some(Form::Unreadable(why));
    };
    let number = |name: &str| {
        let value: Option<f64> = kind.attribute(name)?.trim().parse().ok();
        value.filter(|x| *x > 0.0 && *x < LARGEST)
    };
    let found = match kind.tag_name().name() {
        "sphere" => number("radius").map(|radius| {
            Form::Solid(Shape::Sphere {
                centre: pose.position,
                radius,
            })
        }),
        "box" => three(kind, "size", Vector3::zeros())
            .filter(|s| s.min() > 0.0)
            .map(|size| {
                Form::Solid(Shape::Box {
                    pose,
                    half: size * 0.5,
                })
            }),
        "capsule" => number("radius")
            .zip(number("length"))
            .map(|(radius, length)| {
                let half = Vector3::z() * (0.5 * length);
                Form::Solid(Shape::Capsule {
                    from: pose.apply(&-half),
                    to: pose.apply(&half),
                    radius,
                })
            }),
        "cylinder" => number("radius")
            .zip(number("length"))
            .map(|(radius, length)| Form::Cylinder {
                pose,
                radius,
                length,
            }),
        "mesh" => {
            let file = kind.attribute("filename").map(str::to_string);
            let scale = three(kind, "scale", Vector3::repeat(1.0));
            file.zip(scale)
                .map(|(file, scale)| Form::Mesh { pose, file, scale })
        }
        other => {
            let why = format!("{place}: geometry <{other}> is not known");
            return Some(Form::Unreadable(why));
        }
    };
    let tag = kind.tag_name().name();
    Some(found.unwrap_or_else(|| {
        Form::Unreadable(format!(
            "{place}: <{tag}> lacks sizes that are positive numbers"
        ))
    }))
}

/// Largest size, m.
const LARGEST: f64 = 1e4;

/// Three numbers of an attribute, `absent` where it is not there, nothing where they cannot be read.
fn three(node: Node, name: &str, absent: Vector3<f64>) -> Option<Vector3<f64>> {
    let Some(text) = node.attribute(name) else {
        return Some(absent);
    };
    let numbers: Vec<f64> = text
        .split_whitespace()
        .take(4)
        .map(|w| w.parse().ok().filter(|x: &f64| x.abs() < LARGEST))
        .collect::<Option<_>>()?;
    match numbers[..] {
        [x, y, z] => Some(Vector3::new(x, y, z)),
        _ => None,
    }
}
