//! XML as it is expanded: elements and text, without comments.

use roxmltree::{Document, Node as Xml, ParsingOptions};
use std::fmt::Write;

/// Deepest nesting of elements.
pub(super) const DEEPEST: usize = 200;

/// A node.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Node {
    Element(Element),
    Text(String),
}

/// An element; `xacro` says whether it is one of xacro's, whose name stands without prefix.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) xacro: bool,
    pub(super) line: usize,
    pub(super) attributes: Vec<(String, String)>,
    pub(super) children: Vec<Node>,
}

impl Element {
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        let found = self.attributes.iter().find(|(n, _)| n == name);
        found.map(|(_, v)| v.as_str())
    }

    pub(super) fn elements(&self) -> impl Iterator<Item = &Element> {
        self.children.iter().filter_map(|n| match n {
            Node::Element(e) => Some(e),
            Node::Text(_) => None,
        })
    }
}

/// Root of a document.
pub(super) fn read(text: &str) -> Result<Element, String> {
    let options = ParsingOptions {
        allow_dtd: false,
        nodes_limit: 1 << 22,
        ..ParsingOptions::default()
    };
    let document = Document::parse_with_options(text, options).map_err(|e| e.to_string())?;
    let lines: Vec<usize> = text
        .bytes()
        .enumerate()
        .filter(|(_, b)| *b == b'\n')
        .map(|(i, _)| i)
        .collect();
    let deep = |n: Xml| n.ancestors().count() > DEEPEST;
    match document.descendants().any(deep) {
        true => Err("it is nested too deeply".into()),
        false => Ok(element(document.root_element(), &lines)),
    }
}

/// Whether this is a namespace of xacro.
pub(super) fn of_xacro(namespace: Option<&str>) -> bool {
    namespace.is_some_and(|ns| ns.contains("xacro"))
}

fn element(node: Xml, lines: &[usize]) -> Element {
    let xacro = of_xacro(node.tag_name().namespace());
    // of xacro's own attributes one has a meaning: the name that an element gets
    let named = xacro && node.tag_name().name() == "element";
    let attributes = node.attributes().filter_map(|a| {
        let name = match of_xacro(a.namespace()) {
            true => (named && a.name() == "name").then(|| "xacro:name".to_string())?,
            false => a.name().to_string(),
        };
        Some((name, a.value().to_string()))
    });
    let children = node
        .children()
        .filter_map(|c| match (c.is_element(), c.is_text()) {
            (true, _) => Some(Node::Element(element(c, lines))),
            (_, true) => Some(Node::Text(c.text().unwrap_or_default().to_string())),
            _ => None,
        });
    Element {
        name: node.tag_name().name().to_string(),
        xacro,
        line: 1 + lines.partition_point(|at| *at < node.range().start),
        attributes: attributes.collect(),
        children: children.collect(),
    }
}

fn escape(text: &str, out: &mut String) {
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            other => out.push(other),
        }
    }
}

/// As text, an element a line.
pub(super) fn write(root: &Element) -> String {
    let mut out = String::from("<?xml version=\"1.0\"?>\n");
    one(root, 0, &mut out);
    out
}

fn one(e: &Element, depth: usize, out: &mut String) {
    let pad = "  ".repeat(depth);
    let _ = write!(out, "{pad}<{}", e.name);
    for (name, value) in &e.attributes {
        let _ = write!(out, " {name}=\"");
        escape(value, out);
        out.push('"');
    }
    let inside: Vec<&Node> = e
        .children
        .iter()
        .filter(|n| !matches!(n, Node::Text(t) if t.trim().is_empty()))
        .collect();
    if inside.is_empty() {
        out.push_str("/>\n");
        return;
    }
    out.push_str(">\n");
    for node in inside {
        match node {
            Node::Element(child) => one(child, depth + 1, out),
            Node::Text(t) => {
                let _ = write!(out, "{pad}  ");
                escape(t.trim(), out);
                out.push('\n');
            }
        }
    }
    let _ = writeln!(out, "{pad}</{}>", e.name);
}
