//! Triangles of COLLADA (`.dae`) files.
//!
//! Read are the geometries that the scene places, each as often as it is placed, with the transforms of all nodes above
//! it: `p' = M₁ M₂ … p`, the outermost first, and the length of the file's unit in m (`asset/unit`). The axis that the file
//! calls up is left alone, as ROS tools leave it. What would change a shape and is not understood (skins, skewing, curved
//! surfaces) is an error: a part that is passed over is a collision that is not seen.
//!
//! Source: Khronos Group, *COLLADA: Digital Asset Schema Release 1.4.1*, 2008.

use super::mesh::{Builder, Mesh};
use nalgebra::{Matrix4, Point3, Rotation3, Unit, Vector3};
use roxmltree::{Document, Node};
use std::collections::HashMap;

/// Nodes may stand this deep in one another …
const DEEPEST: usize = 64;
/// … and so many may be placed: nodes that place nodes multiply.
const MOST_NODES: usize = 100_000;

/// Reads a COLLADA file.
///
/// # Errors
/// What is wrong with the file, in words: no XML, a reference to nothing, an index beyond its list, a shape of a kind that
/// is not read.
pub fn dae(bytes: &[u8]) -> Result<Mesh, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "the COLLADA file is not text in UTF-8")?;
    let text = text.trim_start_matches('\u{feff}');
    let document = Document::parse(text).map_err(|e| format!("the COLLADA file is no XML: {e}"))?;
    let root = document.root_element();
    if !is(root, "COLLADA") {
        let name = root.tag_name().name();
        return Err(format!("a COLLADA file begins with COLLADA, not {name}"));
    }
    let ids = root.descendants();
    let ids = ids.filter_map(|n| Some((n.attribute("id")?, n))).collect();
    let mut reader = Reader {
        ids,
        builder: Builder::default(),
        nodes: 0,
    };
    let scenes = || root.descendants().filter(|n| is(*n, "visual_scene"));
    let named = child(root, "scene").and_then(|s| child(s, "instance_visual_scene"));
    let scene = match named {
        Some(instance) => Some(reader.target(instance, "url")?),
        None => scenes().next(),
    };
    let scene = scene.ok_or("the COLLADA file has no visual_scene: nothing is placed")?;
    let unit = child(root, "asset").and_then(|a| child(a, "unit"));
    let metre: f64 = match unit.and_then(|u| u.attribute("meter")) {
        None => 1.0,
        Some(text) => text
            .trim()
            .parse()
            .ok()
            .filter(|m: &f64| m.is_finite() && *m > 0.0)
            .ok_or_else(|| format!("unit meter=\"{text}\" is no length"))?,
    };
    for node in children(scene, "node") {
        reader.place(node, &Matrix4::new_scaling(metre), 0)?;
    }
    Ok(reader.builder.mesh)
}

fn is(node: Node, name: &str) -> bool {
    node.is_element() && node.tag_name().name() == name
}

fn children<'a, 'd>(node: Node<'a, 'd>, name: &'a str) -> impl Iterator<Item = Node<'a, 'd>> {
    node.children().filter(move |n| is(*n, name))
}

fn child<'a, 'd>(node: Node<'a, 'd>, name: &'a str) -> Option<Node<'a, 'd>> {
    children(node, name).next()
}

/// What an error calls an element.
fn called(node: Node) -> String {
    let name = node.tag_name().name();
    match node.attribute("id").or_else(|| node.attribute("name")) {
        Some(id) => format!("{name} `{id}`"),
        None => name.to_string(),
    }
}

/// The numbers in an element's text.
fn numbers(node: Node) -> Result<Vec<f64>, String> {
    let words = node.text().unwrap_or_default().split_ascii_whitespace();
    words
        .map(|w| w.parse().ok())
        .collect::<Option<_>>()
        .ok_or_else(|| format!("{} holds what is no number", called(node)))
}

/// Exactly `N` numbers.
fn exactly<const N: usize>(node: Node) -> Result<[f64; N], String> {
    let list = numbers(node)?;
    <[f64; N]>::try_from(list).map_err(|_| format!("{} needs {N} numbers", called(node)))
}

fn indices(node: Node) -> Result<Vec<usize>, String> {
    let words = node.text().unwrap_or_default().split_ascii_whitespace();
    words
        .map(|w| w.parse().ok())
        .collect::<Option<_>>()
        .ok_or_else(|| format!("{} holds what is no index", called(node)))
}

/// The transform of a node on its own: the product of its elements in their order.
fn transform(node: Node) -> Result<Matrix4<f64>, String> {
    let mut all = Matrix4::identity();
    for part in node.children().filter(Node::is_element) {
        all *= match part.tag_name().name() {
            "matrix" => Matrix4::from_row_slice(&exactly::<16>(part)?),
            "translate" => Matrix4::new_translation(&Vector3::from(exactly::<3>(part)?)),
            "scale" => Matrix4::new_nonuniform_scaling(&Vector3::from(exactly::<3>(part)?)),
            "rotate" => {
                let [x, y, z, degrees] = exactly(part)?;
                match Unit::try_new(Vector3::new(x, y, z), 0.0) {
                    Some(axis) => {
                        Rotation3::from_axis_angle(&axis, degrees.to_radians()).to_homogeneous()
                    }
                    // no axis, no rotation: exporters write it so
                    None if degrees == 0.0 => continue,
                    None => return Err(format!("{} has no axis", called(part))),
                }
            }
            "skew" | "lookat" => {
                return Err(format!("{} is not read", called(part)));
            }
            _ => continue,
        };
    }
    Ok(all)
}

/// Where the corners of the shapes of one geometry stand in the lists of indices.
struct Corners {
    points: Vec<Point3<f64>>,
    offset: usize,
    stride: usize,
}

struct Reader<'a, 'd> {
    ids: HashMap<&'a str, Node<'a, 'd>>,
    builder: Builder,
    nodes: usize,
}

impl<'a, 'd> Reader<'a, 'd> {
    /// The element that an attribute names, as in `url="#id"`.
    fn target(&self, node: Node, attribute: &str) -> Result<Node<'a, 'd>, String> {
        let name = node.attribute(attribute).unwrap_or_default();
        let id = name.strip_prefix('#').unwrap_or(name);
        let found = self.ids.get(id).copied();
        found.ok_or_else(|| format!("{} names `{name}`, which is not there", called(node)))
    }

    /// Adds what a node and those below it place.
    fn place(
        &mut self,
        node: Node<'a, 'd>,
        above: &Matrix4<f64>,
        depth: usize,
    ) -> Result<(), String> {
        self.nodes += 1;
        if depth > DEEPEST || self.nodes > MOST_NODES {
            let text = "is one of too many nodes, or places itself";
            return Err(format!("{} {text}", called(node)));
        }
        let here = above * transform(node)?;
        for part in node.children().filter(Node::is_element) {
            match part.tag_name().name() {
                "node" => self.place(part, &here, depth + 1)?,
                "instance_node" => {
                    let target = self.target(part, "url")?;
                    self.place(target, &here, depth + 1)?;
                }
                "instance_geometry" => {
                    let target = self.target(part, "url")?;
                    self.geometry(target, &here)
                        .map_err(|e| format!("{}: {e}", called(target)))?;
                }
                "instance_controller" => {
                    let text = "a skin that bones move (instance_controller) is not read";
                    return Err(format!("{}: {text}", called(node)));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Adds the triangles of a geometry.
    fn geometry(&mut self, geometry: Node<'a, 'd>, at: &Matrix4<f64>) -> Result<(), String> {
        let mesh = child(geometry, "mesh").ok_or("only shapes of the kind mesh are read")?;
        for part in mesh.children().filter(Node::is_element) {
            let name = part.tag_name().name();
            match name {
                "triangles" | "polylist" | "polygons" | "tristrips" | "trifans" => {}
                _ => continue,
            }
            let corners = self.corners(part)?;
            // polygons keep their list inside `ph` where they have holes; only the outline counts
            let lists = part.descendants().filter(|n| is(*n, "p"));
            let mut counts = match child(part, "vcount") {
                Some(list) => indices(list)?,
                None => Vec::new(),
            }
            .into_iter();
            for list in lists {
                let list = indices(list)?;
                let points = corners.along(&list, at)?;
                let mut rest = &points[..];
                match name {
                    "tristrips" => {
                        for w in rest.windows(3) {
                            self.fan(w, part)?;
                        }
                    }
                    "triangles" => {
                        for corner in rest.chunks_exact(3) {
                            self.fan(corner, part)?;
                        }
                    }
                    "polylist" => {
                        for count in counts.by_ref() {
                            let short = || format!("{name} has fewer corners than its vcount says");
                            let (now, after) = rest.split_at_checked(count).ok_or_else(short)?;
                            self.fan(now, part)?;
                            rest = after;
                        }
                    }
                    _ => self.fan(rest, part)?,
                }
            }
        }
        Ok(())
    }

    /// Triangles from the first corner to each edge.
    fn fan(&mut self, corners: &[Vector3<f64>], part: Node) -> Result<(), String> {
        for k in 1..corners.len().saturating_sub(1) {
            let three = [corners[0], corners[k], corners[k + 1]];
            self.builder.triangle(three, || called(part))?;
        }
        Ok(())
    }

    /// The positions that a list of triangles or polygons refers to.
    fn corners(&self, part: Node<'a, 'd>) -> Result<Corners, String> {
        let offset = |input: Node| -> Result<usize, String> {
            let text = input.attribute("offset").unwrap_or("0");
            let parsed = text.parse().ok().filter(|o: &usize| *o < 64);
            parsed.ok_or_else(|| format!("offset=\"{text}\" is no index"))
        };
        let (mut stride, mut vertex) = (1, None);
        for input in children(part, "input") {
            let at = offset(input)?;
            stride = stride.max(at + 1);
            if input.attribute("semantic") == Some("VERTEX") {
                vertex = Some((input, at));
            }
        }
        let (input, offset) = vertex.ok_or_else(|| format!("{} has no corners", called(part)))?;
        let vertices = self.target(input, "source")?;
        let position = children(vertices, "input")
            .find(|i| i.attribute("semantic") == Some("POSITION"))
            .ok_or_else(|| format!("{} has no positions", called(vertices)))?;
        let points = self.points(self.target(position, "source")?)?;
        Ok(Corners {
            points,
            offset,
            stride,
        })
    }

    /// The points of a `source`, through its accessor.
    fn points(&self, source: Node<'a, 'd>) -> Result<Vec<Point3<f64>>, String> {
        let accessor = child(source, "technique_common").and_then(|t| child(t, "accessor"));
        let (array, skip, stride) = match accessor {
            Some(accessor) => {
                let number = |key: &str, default: usize| match accessor.attribute(key) {
                    None => Ok(default),
                    Some(text) => text
                        .parse::<usize>()
                        .map_err(|_| format!("{key}=\"{text}\" is no index")),
                };
                let array = self.target(accessor, "source")?;
                (array, number("offset", 0)?, number("stride", 1)?)
            }
            None => {
                let array = child(source, "float_array");
                let array = array.ok_or_else(|| format!("{} is empty", called(source)))?;
                (array, 0, 3)
            }
        };
        if stride < 3 {
            return Err(format!("{} has no points in space", called(source)));
        }
        let values = numbers(array)?;
        let values = values.get(skip..).unwrap_or_default();
        let points = values.chunks(stride).filter(|p| p.len() >= 3);
        Ok(points.map(|p| Point3::new(p[0], p[1], p[2])).collect())
    }
}

impl Corners {
    /// The points that a list of indices names, moved.
    fn along(&self, list: &[usize], at: &Matrix4<f64>) -> Result<Vec<Vector3<f64>>, String> {
        let named = list.chunks(self.stride).map(|c| c.get(self.offset));
        let points = named.map(|index| {
            let index = *index.ok_or("a corner without its index")?;
            let point = self.points.get(index);
            let point = point.ok_or_else(|| format!("there is no point {index}"))?;
            Ok((at * point.to_homogeneous()).xyz())
        });
        points.collect()
    }
}

#[cfg(test)]
mod tests;
