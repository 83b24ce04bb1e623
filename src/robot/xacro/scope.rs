//! Properties by scope, evaluated when they are first asked for.

use super::tree::Node;
use super::value::Value;
use std::collections::HashMap;

/// What stands under a name.
#[derive(Debug, Clone)]
pub(super) enum Entry {
    Value(Value),
    /// text that is evaluated when it is asked for, in the scope that it stands in
    Later(String),
    /// the same while that goes on
    Busy,
    /// elements
    Block(Vec<Node>),
}

/// Scopes: that of the file, one for each macro that is being expanded.
pub(super) struct Scopes {
    all: Vec<HashMap<String, Entry>>,
}

impl Scopes {
    pub(super) fn new() -> Self {
        Scopes {
            all: vec![HashMap::new()],
        }
    }

    pub(super) fn depth(&self) -> usize {
        self.all.len()
    }

    pub(super) fn open(&mut self) {
        self.all.push(HashMap::new());
    }

    pub(super) fn close(&mut self) {
        self.all.pop();
    }

    /// The entry of a name and the scope it stands in, seen from a scope.
    pub(super) fn find(&self, name: &str, from: usize) -> Option<(usize, &Entry)> {
        let upto = self.all.iter().enumerate().take(from + 1).rev();
        upto.filter_map(|(k, scope)| scope.get(name).map(|e| (k, e)))
            .next()
    }

    pub(super) fn set(&mut self, scope: usize, name: &str, entry: Entry) {
        if let Some(of) = self.all.get_mut(scope) {
            of.insert(name.to_string(), entry);
        }
    }

    pub(super) fn remove(&mut self, scope: usize, name: &str) {
        if let Some(of) = self.all.get_mut(scope) {
            of.remove(name);
        }
    }
}
