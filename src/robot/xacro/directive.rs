//! Elements of xacro.

use super::scope::Entry;
use super::token::{Token, tokens};
use super::tree::{self, Element, Node};
use super::value::Value;
use super::{Work, Wrong};

impl Work {
    /// An element of xacro, expanded.
    pub(super) fn directive(&mut self, e: &Element) -> Result<Vec<Node>, Wrong> {
        match e.name.as_str() {
            "arg" => self.argument(e).map(|()| Vec::new()),
            "property" => self.define(e).map(|()| Vec::new()),
            "macro" => self.learn(e).map(|()| Vec::new()),
            "include" => self.include(e),
            "if" | "unless" => {
                let text = wanted(e, "value")?;
                let value = self.text(text)?;
                let holds = value.condition().ok_or_else(|| {
                    format!(
                        "`{text}` is `{value}` in xacro:{}, and no truth value",
                        e.name
                    )
                })?;
                match holds == (e.name == "if") {
                    true => self.nodes(&e.children),
                    false => Ok(Vec::new()),
                }
            }
            "insert_block" => {
                let name = self.text(wanted(e, "name")?)?.to_string();
                let scope = self.scopes.here();
                let block = ["**", "*"].iter().find_map(|stars| {
                    match self.scopes.find(&format!("{stars}{name}"), scope) {
                        Some((_, Entry::Block(nodes))) => Some(nodes.clone()),
                        _ => None,
                    }
                });
                self.nodes(&block.ok_or_else(|| format!("there is no block `{name}`"))?)
            }
            "call" => {
                let name = self.text(wanted(e, "macro")?)?.to_string();
                let mut call = e.clone();
                call.attributes.retain(|(n, _)| n != "macro");
                self.call(&name, &call)
            }
            "element" => {
                let name = self.named(wanted(e, "xacro:name")?, "xacro:element")?;
                let mut one = e.clone();
                one.attributes.retain(|(n, _)| n != "xacro:name");
                match name.strip_prefix("xacro:") {
                    Some(of) => {
                        one.name = of.to_string();
                        self.directive(&one)
                    }
                    None => {
                        one.name = name;
                        Ok(vec![Node::Element(self.plain(&one)?)])
                    }
                }
            }
            name => self.call(name, e),
        }
    }

    /// `xacro:attribute`: an attribute of the element that it stands in.
    pub(super) fn attribute(&mut self, e: &Element) -> Result<(String, String), Wrong> {
        let name = self.named(wanted(e, "name")?, "xacro:attribute")?;
        Ok((name, self.text(wanted(e, "value")?)?.to_string()))
    }

    /// A name of an element or an attribute.
    fn named(&mut self, text: &str, of: &str) -> Result<String, Wrong> {
        let name = self.text(text)?.to_string();
        let able = |c: char| c.is_alphanumeric() || "_-.:".contains(c);
        let first = name
            .chars()
            .next()
            .is_some_and(|c| c.is_alphabetic() || c == '_');
        match first && name.chars().all(able) {
            true => Ok(name),
            false => Err(format!("`{name}` of {of} is no name that XML has")),
        }
    }

    /// `xacro:arg`: a default of an argument.
    pub(super) fn argument(&mut self, e: &Element) -> Result<(), Wrong> {
        let name = wanted(e, "name")?.to_string();
        self.asked.insert(name.clone());
        if let Some(default) = e.attribute("default")
            && !self.arguments.contains_key(&name)
        {
            let value = self.text(default)?.to_string();
            self.arguments.insert(name, value);
        }
        Ok(())
    }

    /// `xacro:property`.
    fn define(&mut self, e: &Element) -> Result<(), Wrong> {
        let name = self.text(wanted(e, "name")?)?.to_string();
        let here = self.scopes.here();
        let truth = |text: Option<&str>| text.and_then(|t| Value::literal(t).condition());
        let stated = e.attribute("scope");
        let scope = match stated {
            Some("global") => 0,
            Some("parent") => self.scopes.caller(),
            Some(other) => {
                return Err(format!(
                    "a property has no scope `{other}`; use parent or global"
                ));
            }
            None => here,
        };
        if truth(e.attribute("remove")) == Some(true) {
            self.scopes.remove(&name);
            return Ok(());
        }
        let value = match (e.attribute("default"), e.attribute("value")) {
            (Some(_), None) if self.scopes.find(&name, here).is_some() => return Ok(()),
            (_, Some(text)) | (Some(text), None) => text,
            (None, None) => {
                let block = Entry::Block(e.children.clone());
                self.scopes.set(scope, &format!("**{name}"), block);
                return Ok(());
            }
        };
        let later = stated.is_none() && truth(e.attribute("lazy_eval")) != Some(false);
        let entry = match Value::literal(value) {
            Value::Text(_) if later && value.contains('$') => Entry::Later(value.into()),
            Value::Text(_) => match self.text(value)? {
                Value::Text(t) => Entry::Value(Value::literal(&t)),
                other => Entry::Value(other),
            },
            literal => Entry::Value(literal),
        };
        // a property that is stated anew by itself has its old value in it
        if let Entry::Later(text) = &entry
            && self
                .scopes
                .find(&name, here)
                .is_some_and(|(at, _)| at == scope)
            && mentions(text, &name)
        {
            return Err(format!("the property `{name}` needs itself"));
        }
        self.scopes.set(scope, &name, entry);
        Ok(())
    }

    /// `xacro:include`: the children of the root of another file, whose properties and macros may have a name space.
    fn include(&mut self, e: &Element) -> Result<Vec<Node>, Wrong> {
        let name = self.text(wanted(e, "filename")?)?.to_string();
        let optional = e
            .attribute("optional")
            .and_then(|t| Value::literal(t).condition())
            == Some(true);
        let (path, text) = match self.open(&name) {
            Err(_) if optional => return Ok(Vec::new()),
            other => other?,
        };
        let inside = match e.attribute("ns") {
            Some(ns) => {
                let name = self.text(ns)?.to_string();
                self.scopes.space(&name)
            }
            None => self.scopes.here(),
        };
        let line = self.line;
        self.files.push(path);
        self.line = 1;
        let root = tree::read(&text)?;
        let before = self.scopes.enter(inside);
        let out = self.nodes(&root.children)?;
        self.scopes.enter(before);
        self.files.pop();
        self.line = line;
        Ok(out)
    }
}

/// Whether the expressions of a text have a name in them.
fn mentions(text: &str, name: &str) -> bool {
    let inside = text
        .split("${")
        .skip(1)
        .filter_map(|part| part.split('}').next());
    let mut all = inside.map(|part| tokens(part).unwrap_or_default());
    all.any(|all| {
        all.iter().enumerate().any(|(k, token)| {
            let behind = k.checked_sub(1).and_then(|k| all.get(k));
            // text, attributes and names of values are none
            matches!(token, Token::Name(word) if word == name)
                && behind != Some(&Token::Sign("."))
                && all.get(k + 1) != Some(&Token::Sign("="))
        })
    })
}

/// An attribute that must be there.
pub(super) fn wanted<'a>(e: &'a Element, name: &str) -> Result<&'a str, Wrong> {
    e.attribute(name)
        .ok_or_else(|| format!("xacro:{} has no `{name}`", e.name))
}
