//! Properties and macros by scope: that of the file, one for each macro that is being expanded, and name spaces of included
//! files. A property is evaluated when it is first asked for.

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
    /// an included file, by the number of its scope
    Space(usize),
}

struct Scope<M> {
    entries: HashMap<String, Entry>,
    macros: HashMap<String, M>,
    /// name spaces of included files
    spaces: HashMap<String, usize>,
    /// the scope that what is not here is looked for in
    outer: Option<usize>,
    /// whether it is a name space, which sees no macros outside
    space: bool,
}

/// Scopes with macros `M`, by number; a later one never is the outer one of an earlier one.
pub(super) struct Scopes<M> {
    all: Vec<Scope<M>>,
    here: usize,
}

impl<M: Clone> Scopes<M> {
    pub(super) fn new() -> Self {
        let mut out = Scopes {
            all: Vec::new(),
            here: 0,
        };
        out.add(None, false);
        out
    }

    fn add(&mut self, outer: Option<usize>, space: bool) -> usize {
        self.all.push(Scope {
            entries: HashMap::new(),
            macros: HashMap::new(),
            spaces: HashMap::new(),
            outer,
            space,
        });
        self.all.len() - 1
    }

    /// The scope that is worked in.
    pub(super) fn here(&self) -> usize {
        self.here
    }

    /// Works in another scope; returns the one before.
    pub(super) fn enter(&mut self, scope: usize) -> usize {
        std::mem::replace(&mut self.here, scope)
    }

    /// Works in a new scope inside of another; returns the one before.
    pub(super) fn open(&mut self, outer: usize) -> usize {
        let new = self.add(Some(outer), false);
        self.enter(new)
    }

    /// Gives up the scope that was opened, with all that came after it, and works in the one before.
    pub(super) fn close(&mut self, before: usize) {
        self.all.truncate(self.here);
        self.here = before;
    }

    /// A new name space in this scope.
    pub(super) fn space(&mut self, name: &str) -> usize {
        let new = self.add(Some(self.here), true);
        let here = &mut self.all[self.here];
        here.spaces.insert(name.to_string(), new);
        here.entries.insert(name.to_string(), Entry::Space(new));
        new
    }

    /// The scope outside, for what a macro or an included file states for its caller: no name space for a macro.
    pub(super) fn caller(&self) -> usize {
        let outer = |s: usize| self.all[s].outer;
        let mut found = outer(self.here);
        while let Some(s) = found.filter(|s| self.all[*s].space && !self.all[self.here].space) {
            found = outer(s);
        }
        found.unwrap_or(0)
    }

    fn chain(&self, from: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(Some(from), |s| self.all.get(*s)?.outer)
    }

    /// Scopes whose macros are seen.
    fn seen(&self, from: usize) -> impl Iterator<Item = &Scope<M>> {
        let up = |s: &usize| {
            let scope = &self.all[*s];
            scope.outer.filter(|_| !scope.space)
        };
        std::iter::successors(Some(from), up).map(|s| &self.all[s])
    }

    /// The entry of a name and the scope it stands in, seen from a scope.
    pub(super) fn find(&self, name: &str, from: usize) -> Option<(usize, &Entry)> {
        let in_one = |s: usize| self.all.get(s)?.entries.get(name).map(|e| (s, e));
        self.chain(from).find_map(in_one)
    }

    pub(super) fn set(&mut self, scope: usize, name: &str, entry: Entry) {
        if let Some(of) = self.all.get_mut(scope) {
            of.entries.insert(name.to_string(), entry);
        }
    }

    /// Removes a property in all scopes that are seen.
    pub(super) fn remove(&mut self, name: &str) {
        let seen: Vec<usize> = self.chain(self.here).collect();
        for s in seen {
            self.all[s].entries.remove(name);
        }
    }

    /// Keeps a macro in this scope.
    pub(super) fn learn(&mut self, name: String, one: M) {
        self.all[self.here].macros.insert(name, one);
    }

    /// A macro, `name` or `space.name`, and the scope that its body sees.
    pub(super) fn called(&self, name: &str) -> Option<(usize, M)> {
        let of =
            |name: &str, from: usize| self.seen(from).find_map(|s| s.macros.get(name).cloned());
        let mut scope = self.here;
        let mut parts = name.split('.').peekable();
        while let Some(part) = parts.next() {
            if parts.peek().is_none() {
                return of(part, scope).map(|m| (scope, m));
            }
            scope = self.seen(scope).find_map(|s| s.spaces.get(part).copied())?;
        }
        None
    }

    /// Names of all macros that are seen.
    pub(super) fn names(&self) -> Vec<String> {
        let mut out = Vec::new();
        for s in self.seen(self.here) {
            out.extend(s.macros.keys().cloned());
            for (space, at) in &s.spaces {
                let inside = self.all[*at].macros.keys();
                out.extend(inside.map(|name| format!("{space}.{name}")));
            }
        }
        out
    }
}
