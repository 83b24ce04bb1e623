//! xacro: robot descriptions with properties, macros, conditions and included files, expanded to a URDF.
//!
//! The language is that of ROS: properties are evaluated when they are first used, in the scope that they stand in;
//! macros have scopes of their own, whose outer one is that of the call; `${…}` holds an expression of Python, `$(…)`
//! an argument, a package or a variable of the environment. What is not here: lambdas and comprehensions; each is refused
//! by name.
//!
//! | module | what |
//! |---|---|
//! | `tree` | XML in and out |
//! | `value`, `python`, `token`, `parser`, `expression`, `yaml` | values, expressions, values of YAML files |
//! | `scope`, `text` | properties and name spaces, `${…}` and `$(…)` in text |
//! | `directive` | elements of xacro |
//! | `macros` | macros and their parameters |

mod directive;
mod expression;
mod macros;
mod packages;
mod parser;
mod python;
mod scope;
mod text;
mod token;
mod tree;
mod value;
mod yaml;

use crate::error::{Error, Result};
use crate::robot::file::text::read_text;
use macros::Macro;
use scope::Scopes;
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use tree::{Element, Node};

/// Most nodes that a description may become.
const MOST: usize = 1 << 20;
/// Deepest nesting of macros, included files and elements.
const DEEPEST: usize = 160;

/// What is wrong, with the place where that is known.
type Wrong = String;

/// Arguments behind the name of a file, as `ur.urdf.xacro ur_type:=ur5e name:=arm`.
pub(crate) fn with_arguments(spec: &str) -> (&str, BTreeMap<String, String>) {
    let mut arguments = BTreeMap::new();
    let mut rest = spec.trim_end();
    while let Some((before, last)) = rest.rsplit_once(char::is_whitespace) {
        let Some((name, value)) = last.split_once(":=").filter(|(n, _)| !n.is_empty()) else {
            break;
        };
        // as where it is stated once
        arguments
            .entry(name.to_string())
            .or_insert_with(|| value.to_string());
        rest = before.trim_end();
    }
    match arguments.is_empty() {
        true => (spec, arguments),
        false => (rest, arguments),
    }
}

/// Whether the text is a description that is not expanded: elements of xacro, or expressions. The namespace
/// alone stays in expanded files.
pub(crate) fn is(text: &str) -> bool {
    if !text.contains("xacro") {
        return false;
    }
    tree::read(text).is_ok_and(|root| unexpanded(&root))
}

fn unexpanded(e: &Element) -> bool {
    let open = |v: &str| v.contains("${") || v.contains("$(");
    e.xacro || e.attributes.iter().any(|(_, v)| open(v)) || e.elements().any(unexpanded)
}

/// The URDF that a description stands for.
///
/// # Errors
/// Files that cannot be read; what is not defined or not known, with file and line.
pub(crate) fn expand(
    text: &str,
    file: &Path,
    arguments: &BTreeMap<String, String>,
) -> Result<String> {
    let mut work = Work {
        scopes: Scopes::new(),
        arguments: arguments.clone(),
        asked: Default::default(),
        files: vec![file.to_path_buf()],
        line: 1,
        depth: 0,
        nodes: 0,
        packages: HashMap::new(),
    };
    let done = work.document(text);
    let unknown = arguments.keys().find(|a| !work.asked.contains(*a));
    let at = work
        .files
        .last()
        .cloned()
        .unwrap_or_else(|| file.to_path_buf());
    let root = done.map_err(|why| Error::file(&at, format!("line {}", work.line), why))?;
    if let Some(name) = unknown {
        let mut known: Vec<&str> = work.asked.iter().map(String::as_str).collect();
        known.sort_unstable();
        return Err(Error::Argument(format!(
            "{} has no argument `{name}`{}; it has {}",
            file.display(),
            crate::robot::file::names::did_you_mean(name, known.iter().copied()),
            crate::robot::file::names::listed(&known)
        )));
    }
    Ok(tree::write(&root))
}

/// A description that is being expanded.
struct Work {
    scopes: Scopes<std::rc::Rc<Macro>>,
    /// those that were given, then also those with a default
    arguments: BTreeMap<String, String>,
    /// those that the description has
    asked: std::collections::BTreeSet<String>,
    /// the file, and those that are included, the innermost last
    files: Vec<PathBuf>,
    /// line of the innermost element of xacro, in the last file
    line: usize,
    depth: usize,
    nodes: usize,
    packages: HashMap<String, PathBuf>,
}

impl Work {
    fn document(&mut self, text: &str) -> std::result::Result<Element, Wrong> {
        let mut root = tree::read(text)?;
        // arguments may be asked for above the line where they have their default
        let early: Vec<Element> = root
            .elements()
            .filter(|e| e.xacro && e.name == "arg")
            .cloned()
            .collect();
        for e in &early {
            // what needs properties waits for its turn
            let _ = self.argument(e);
            self.depth = 0;
        }
        root.xacro = false;
        self.plain(&root)
    }

    /// Nodes, expanded. What `xacro:attribute` states here belongs to no element that stays.
    fn nodes(&mut self, nodes: &[Node]) -> std::result::Result<Vec<Node>, Wrong> {
        self.nodes_of(nodes, &mut Vec::new())
    }

    /// Nodes of an element, expanded, and the attributes that they state for it.
    fn nodes_of(
        &mut self,
        nodes: &[Node],
        attributes: &mut Vec<(String, String)>,
    ) -> std::result::Result<Vec<Node>, Wrong> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err("macros or included files call themselves without end".into());
        }
        let mut out = Vec::new();
        for node in nodes {
            self.nodes += 1;
            if self.nodes > MOST {
                return Err("it becomes too large; does a macro call itself?".into());
            }
            match node {
                Node::Text(t) if t.contains('$') => out.push(Node::Text(self.text(t)?.to_string())),
                Node::Text(_) => out.push(node.clone()),
                Node::Element(e) if e.xacro => {
                    self.line = e.line;
                    match e.name.as_str() {
                        "attribute" => attributes.push(self.attribute(e)?),
                        _ => out.extend(self.directive(e)?),
                    }
                }
                Node::Element(e) => out.push(Node::Element(self.plain(e)?)),
            }
        }
        self.depth -= 1;
        Ok(out)
    }

    fn plain(&mut self, e: &Element) -> std::result::Result<Element, Wrong> {
        self.line = e.line;
        let mut attributes = Vec::with_capacity(e.attributes.len());
        for (name, value) in &e.attributes {
            attributes.push((name.clone(), self.text(value)?.to_string()));
        }
        let mut stated = Vec::new();
        let children = self.nodes_of(&e.children, &mut stated)?;
        for (name, value) in stated {
            match attributes.iter_mut().find(|(n, _)| *n == name) {
                Some((_, old)) => *old = value,
                None => attributes.push((name, value)),
            }
        }
        Ok(Element {
            name: e.name.clone(),
            xacro: false,
            line: e.line,
            attributes,
            children,
        })
    }

    /// A file that the description names, with its text; relative to the file that names it.
    fn open(&self, name: &str) -> std::result::Result<(PathBuf, String), Wrong> {
        let folder = self
            .files
            .last()
            .and_then(|f| f.parent())
            .unwrap_or(Path::new(""));
        let path = folder.join(name.trim());
        let text = read_text(&path).map_err(|e| e.to_string())?;
        Ok((path, text))
    }
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_of_files;
