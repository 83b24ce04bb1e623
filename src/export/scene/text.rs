//! Edits of files as text: everything that is not edited stays as it was written.

use crate::robot::mjcf::xml::{Node, Source};
use std::ops::Range;
use std::path::PathBuf;

/// An attribute or element of a file that is not what it was.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Change {
    /// name of the file, as it is written
    pub file: String,
    /// line of the file as it was
    pub line: u32,
    /// `joint elbow`
    pub element: String,
    /// attribute; empty where a whole element is new
    pub attribute: String,
    /// what stood there, or what the element had from its class; `None` where nothing did
    pub old: Option<String>,
    /// what stands there; `None` where it is taken away
    pub new: Option<String>,
}

/// Text that may stand between quotes of either kind.
fn quoted(text: &str) -> String {
    super::super::escape(text).replace('\'', "&apos;")
}

/// The files, and what is to be changed in them.
pub(super) struct Edits {
    pub(super) sources: Vec<Source>,
    /// by source: bytes, and what takes their place
    list: Vec<(usize, Range<usize>, String)>,
    pub(super) changes: Vec<Change>,
}

impl Edits {
    pub(super) fn new(sources: Vec<Source>) -> Self {
        Edits {
            sources,
            list: Vec::new(),
            changes: Vec::new(),
        }
    }

    fn source(&self, node: &Node) -> Option<usize> {
        self.sources.iter().position(|s| s.path == node.file)
    }

    fn text(&self, node: &Node) -> &str {
        self.source(node)
            .and_then(|s| self.sources[s].text.get(node.span.clone()))
            .unwrap_or_default()
    }

    /// What a change calls an element.
    pub(super) fn called(node: &Node) -> String {
        let name = node.own("name").or(node.own("joint")).unwrap_or_default();
        format!("{} {name}", node.tag).trim_end().to_string()
    }

    fn replace(&mut self, node: &Node, range: Range<usize>, text: String) {
        if let Some(source) = self.source(node) {
            self.list.push((source, range, text));
        }
    }

    /// Replaces the value of an attribute in a file by its number.
    pub(super) fn put(&mut self, source: usize, range: Range<usize>, value: &str) {
        self.list.push((source, range, quoted(value)));
    }

    pub(super) fn say(
        &mut self,
        node: &Node,
        element: String,
        attribute: &str,
        [old, new]: [Option<String>; 2],
    ) {
        self.changes.push(Change {
            file: node.file.display().to_string(),
            line: node.line,
            element,
            attribute: attribute.into(),
            old,
            new,
        });
    }

    /// Writes an attribute; `was` is what the element had from its class. `of` is what the change calls it.
    pub(super) fn set(
        &mut self,
        node: &Node,
        of: &str,
        name: &str,
        value: String,
        was: Option<&str>,
    ) {
        let old = node.own(name).or(was).map(String::from);
        match node.spans.get(name) {
            Some([_, range]) => self.replace(node, range.clone(), quoted(&value)),
            None => {
                let at = self.after_attributes(node);
                let text = format!(" {name}=\"{}\"", quoted(&value));
                self.replace(node, at..at, text);
            }
        }
        self.say(node, of.into(), name, [old, Some(value)]);
    }

    /// Takes an attribute away.
    pub(super) fn unset(&mut self, node: &Node, of: &str, name: &str) {
        let Some([range, _]) = node.spans.get(name).cloned() else {
            return;
        };
        let text = self.source(node).map(|s| self.sources[s].text.as_str());
        let before = text.and_then(|t| t.get(..range.start)).unwrap_or_default();
        let start = before.trim_end().len();
        self.replace(node, start..range.end, String::new());
        let old = node.own(name).map(String::from);
        self.say(node, of.into(), name, [old, None]);
    }

    /// Byte after the last attribute, or after the name of the tag.
    fn after_attributes(&self, node: &Node) -> usize {
        let last = node.spans.values().map(|[range, _]| range.end).max();
        last.unwrap_or_else(|| {
            let tag = self.text(node).char_indices().skip(1);
            let mut end = tag.filter(|(_, c)| c.is_whitespace() || "/>".contains(*c));
            node.span.start + end.next().map_or(0, |(at, _)| at)
        })
    }

    /// White space before an element, where it begins a line.
    pub(super) fn indent(&self, node: &Node) -> String {
        let text = self.source(node).map(|s| self.sources[s].text.as_str());
        let before = text.and_then(|t| t.get(..node.span.start));
        let line = before.unwrap_or_default().rsplit('\n').next();
        let line = line.unwrap_or_default();
        match line.trim().is_empty() {
            true => line.to_string(),
            false => "  ".into(),
        }
    }

    /// Puts lines before an element, each on a line of its own.
    pub(super) fn before(&mut self, node: &Node, lines: &[String]) {
        let pad = self.indent(node);
        let text: String = lines.iter().map(|l| format!("{l}\n{pad}")).collect();
        self.replace(node, node.span.start..node.span.start, text);
    }

    /// Puts lines after an element.
    pub(super) fn after(&mut self, node: &Node, lines: &[String]) {
        let pad = self.indent(node);
        let text: String = lines.iter().map(|l| format!("\n{pad}{l}")).collect();
        self.replace(node, node.span.end..node.span.end, text);
    }

    /// Puts lines before the end of an element that has one.
    pub(super) fn inside(&mut self, node: &Node, lines: &[String]) {
        let pad = self.indent(node);
        let text: String = lines.iter().map(|l| format!("  {l}\n{pad}")).collect();
        let all = self.text(node);
        match all.rfind("</") {
            Some(at) if all.ends_with('>') => {
                let at = node.span.start + at;
                self.replace(node, at..at, text);
            }
            // `<body/>`
            _ => {
                let end = node.span.end;
                let close = format!(">\n{pad}{text}</{}>", node.tag);
                self.replace(node, end.saturating_sub(2)..end, close);
            }
        }
    }

    /// The texts of all files with the edits, in the order of the sources.
    pub(super) fn texts(&self) -> Vec<(PathBuf, String)> {
        let mut order: Vec<usize> = (0..self.list.len()).collect();
        // what is put at one place stays in the order in which it was put there
        order.sort_by_key(|&i| (self.list[i].0, self.list[i].1.start));
        let mut out = Vec::new();
        for (s, source) in self.sources.iter().enumerate() {
            let (mut text, mut at) = (String::new(), 0);
            for (_, range, new) in order.iter().map(|&i| &self.list[i]).filter(|e| e.0 == s) {
                text += source.text.get(at..range.start).unwrap_or_default();
                text += new;
                at = range.end.max(at);
            }
            text += source.text.get(at..).unwrap_or_default();
            out.push((source.path.clone(), text));
        }
        out
    }
}
