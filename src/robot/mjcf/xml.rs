//! The elements of an MJCF with its includes in their place, and what stands in their attributes.

use crate::error::{Error, Result};
use crate::robot::xml_error::malformed;
use nalgebra::Vector3;
use roxmltree::Document;
use std::collections::HashMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Files that may include one another in a row.
const DEEPEST: usize = 16;

/// Attributes by name.
pub type Attributes = HashMap<String, String>;

/// An element.
#[derive(Debug, Clone)]
pub struct Node {
    pub tag: String,
    pub attributes: Attributes,
    pub children: Vec<Node>,
    pub line: u32,
    pub file: PathBuf,
    /// bytes of the element in its file
    pub span: Range<usize>,
    /// bytes of each attribute, and of its value
    pub spans: HashMap<String, [Range<usize>; 2]>,
}

/// A file that was read, without its byte order mark.
#[derive(Debug, Clone)]
pub struct Source {
    pub path: PathBuf,
    pub text: String,
    /// bytes of the name of each file that it includes, and that file as it is found
    pub includes: Vec<(Range<usize>, PathBuf)>,
}

impl Node {
    /// An error at this element.
    pub fn error(&self, message: impl Into<String>) -> Error {
        let name = self.attributes.get("name").or(self.attributes.get("class"));
        let name = name.map_or(String::new(), |n| format!(" `{n}`"));
        Error::file(
            &self.file,
            format!("line {}: <{}>{name}", self.line, self.tag),
            message,
        )
    }

    /// Its own attribute.
    pub fn own(&self, name: &str) -> Option<&str> {
        self.attributes.get(name).map(String::as_str)
    }

    /// Children with a tag.
    pub fn all<'a>(&'a self, tag: &'a str) -> impl Iterator<Item = &'a Node> {
        self.children.iter().filter(move |c| c.tag == tag)
    }

    /// Finite numbers of a text.
    pub fn numbers_in(&self, name: &str, text: &str) -> Result<Vec<f64>> {
        let all = text.split_whitespace().map(|t| t.parse::<f64>());
        let all: std::result::Result<Vec<f64>, _> = all.collect();
        match all {
            Ok(all) if all.iter().all(|x| x.is_finite()) => Ok(all),
            _ => Err(self.error(format!(
                "`{name}=\"{}\"` must be finite numbers separated by spaces",
                text.chars().take(60).collect::<String>()
            ))),
        }
    }
}

/// An element with the defaults of its class.
#[derive(Debug, Clone, Copy)]
pub struct Element<'a> {
    pub node: &'a Node,
    pub defaults: Option<&'a Attributes>,
}

impl<'a> Element<'a> {
    /// An attribute, its own or that of its class.
    pub fn text(&self, name: &str) -> Option<&'a str> {
        let own = self.node.attributes.get(name);
        own.or_else(|| self.defaults?.get(name)).map(String::as_str)
    }

    /// Numbers of an attribute.
    pub fn numbers(&self, name: &str) -> Result<Option<Vec<f64>>> {
        let text = self.text(name);
        text.map(|t| self.node.numbers_in(name, t)).transpose()
    }

    /// The first number of an attribute.
    pub fn number(&self, name: &str) -> Result<Option<f64>> {
        let all = self.numbers(name)?;
        Ok(all.and_then(|x| x.first().copied()))
    }

    /// So many numbers of an attribute.
    pub fn exactly<const N: usize>(&self, name: &str) -> Result<Option<[f64; N]>> {
        match self.numbers(name)? {
            None => Ok(None),
            Some(all) => match <[f64; N]>::try_from(all) {
                Ok(x) => Ok(Some(x)),
                Err(all) => Err(self
                    .node
                    .error(format!("`{name}` must be {N} numbers, not {}", all.len()))),
            },
        }
    }

    /// A vector.
    pub fn vector(&self, name: &str) -> Result<Option<Vector3<f64>>> {
        Ok(self.exactly::<3>(name)?.map(Vector3::from))
    }
}

/// Parses a file, its includes in their place.
pub fn parse(text: &str, file: &Path) -> Result<Node> {
    Ok(sources(text, file)?.0)
}

/// The same, with the texts of all files; the file itself is the last.
pub fn sources(text: &str, file: &Path) -> Result<(Node, Vec<Source>)> {
    let mut parser = Parser {
        folder: file.parent().unwrap_or(Path::new("")).to_path_buf(),
        sources: Vec::new(),
    };
    let root = parser.one(text, file, 0)?;
    Ok((root, parser.sources))
}

struct Parser {
    /// what the names of included files are relative to: the folder of the file that is loaded
    folder: PathBuf,
    sources: Vec<Source>,
}

impl Parser {
    fn one(&mut self, text: &str, file: &Path, depth: usize) -> Result<Node> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let document = Document::parse(text).map_err(|e| {
            let (place, said) = malformed(text, &e);
            Error::file(file, place, format!("{said}; correct the file"))
        })?;
        let mut includes = Vec::new();
        let root = document.root_element();
        let node = self.convert(root, &document, file, depth, &mut includes)?;
        self.sources.push(Source {
            path: file.to_path_buf(),
            text: text.to_string(),
            includes,
        });
        Ok(node)
    }

    fn convert(
        &mut self,
        node: roxmltree::Node,
        document: &Document,
        file: &Path,
        depth: usize,
        includes: &mut Vec<(Range<usize>, PathBuf)>,
    ) -> Result<Node> {
        let spans = |a: roxmltree::Attribute| (a.name().to_string(), [a.range(), a.range_value()]);
        let mut out = Node {
            tag: node.tag_name().name().to_string(),
            attributes: node
                .attributes()
                .map(|a| (a.name().to_string(), a.value().to_string()))
                .collect(),
            children: Vec::new(),
            line: document.text_pos_at(node.range().start).row,
            file: file.to_path_buf(),
            span: node.range(),
            spans: node.attributes().map(spans).collect(),
        };
        for child in node.children().filter(roxmltree::Node::is_element) {
            let child = self.convert(child, document, file, depth, includes)?;
            if child.tag != "include" {
                out.children.push(child);
                continue;
            }
            let name = child
                .own("file")
                .ok_or_else(|| child.error("it names no `file`"))?;
            if depth >= DEEPEST {
                return Err(child.error("files include one another; remove one of the includes"));
            }
            let path = self.folder.join(name);
            let text = crate::robot::file::text::read_text(&path)
                .map_err(|e| child.error(format!("cannot read {}: {e}", path.display())))?;
            if let Some([_, value]) = child.spans.get("file") {
                includes.push((value.clone(), path.clone()));
            }
            let included = self.one(&text, &path, depth + 1)?;
            out.children.extend(included.children);
        }
        Ok(out)
    }
}
