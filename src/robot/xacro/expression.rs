//! Expressions in `${…}`: those of Python without statements, lambdas and comprehensions.

use super::parser::{Node, parse};
use super::value::Value;
use std::rc::Rc;

/// What names stand for.
pub(super) trait Names {
    /// Value of a name; `None` where there is none.
    fn value(&mut self, name: &str) -> Result<Option<Value>, String>;
    /// Value of a name in the name space of an included file.
    fn inside(&mut self, space: usize, name: &str) -> Result<Option<Value>, String>;
    /// A function of `xacro`; `None` where there is none of this name.
    fn function(&mut self, name: &str, args: &[Value]) -> Result<Option<Value>, String>;
}

/// Value of an expression.
pub(super) fn evaluate(text: &str, names: &mut dyn Names) -> Result<Value, String> {
    match value(&parse(text)?, names)? {
        Value::Space(_) => {
            Err("the name space of a file is no value; name a property in it".into())
        }
        other => Ok(other),
    }
}

/// An expression without names beside those of Python's `math`.
pub(super) fn constant(text: &str) -> Option<Value> {
    struct Nothing;
    impl Names for Nothing {
        fn value(&mut self, _: &str) -> Result<Option<Value>, String> {
            Ok(None)
        }
        fn inside(&mut self, _: usize, _: &str) -> Result<Option<Value>, String> {
            Ok(None)
        }
        fn function(&mut self, _: &str, _: &[Value]) -> Result<Option<Value>, String> {
            Ok(None)
        }
    }
    evaluate(text, &mut Nothing).ok()
}

fn value(node: &Node, names: &mut dyn Names) -> Result<Value, String> {
    let mut all = |nodes: &[Node]| {
        nodes
            .iter()
            .map(|n| value(n, names))
            .collect::<Result<Vec<_>, _>>()
    };
    match node {
        Node::Value(v) => Ok(v.clone()),
        Node::List(nodes) => Ok(Value::List(Rc::new(all(nodes)?))),
        Node::Dict(pairs) => {
            let one = |(k, v): &(Node, Node)| Ok((value(k, names)?, value(v, names)?));
            Ok(Value::Dict(Rc::new(
                pairs.iter().map(one).collect::<Result<_, String>>()?,
            )))
        }
        Node::Name(name) => match names.value(name)? {
            Some(v) => Ok(v),
            None => super::python::name(name).ok_or_else(|| format!("`{name}` is not defined")),
        },
        Node::Not(one) => Ok(Value::Bool(!value(one, names)?.truth())),
        Node::Minus(one) => match value(one, names)? {
            Value::Int(i) => i
                .checked_neg()
                .map(Value::Int)
                .ok_or_else(|| "the number is too large".into()),
            v => match v.number() {
                Some(x) => Ok(Value::Float(-x)),
                None => Err(format!("{} has no negative", v.kind())),
            },
        },
        Node::Both(op @ ("and" | "or"), a, b) => {
            let left = value(a, names)?;
            match left.truth() == (*op == "or") {
                true => Ok(left),
                false => value(b, names),
            }
        }
        Node::Both(op, a, b) => super::python::operation(op, &value(a, names)?, &value(b, names)?),
        Node::Compared(first, more) => {
            let mut left = value(first, names)?;
            for (op, next) in more {
                let right = value(next, names)?;
                if !super::python::compared(op, &left, &right)? {
                    return Ok(Value::Bool(false));
                }
                left = right;
            }
            Ok(Value::Bool(true))
        }
        Node::Either { condition, yes, no } => match value(condition, names)?.truth() {
            true => value(yes, names),
            false => value(no, names),
        },
        Node::Index(of, key) => match (value(of, names)?, value(key, names)?) {
            (Value::Space(space), Value::Text(name)) => inside(space, &name, names),
            (of, key) => super::python::item(&of, &key),
        },
        Node::Slice(of, ends) => {
            let of = value(of, names)?;
            let mut end = |k: usize| ends[k].as_ref().map(|n| value(n, names)).transpose();
            let ends = [end(0)?, end(1)?];
            super::python::slice(&of, ends)
        }
        Node::Attribute(of, name) => {
            if let Node::Name(module) = &**of
                && module == "math"
                && names.value(module)?.is_none()
            {
                return super::python::name(name)
                    .ok_or_else(|| format!("there is no `math.{name}`"));
            }
            let of = value(of, names)?;
            if let Value::Space(space) = of {
                return inside(space, name, names);
            }
            let found = of.get(&name.as_str().into()).cloned();
            found.ok_or_else(|| match &of {
                Value::Dict(_) => format!("there is no `{name}` in it"),
                other => format!("{} has no `{name}`", other.kind()),
            })
        }
        Node::Call(f, args) => {
            let args = all(args)?;
            match &**f {
                Node::Name(name) => call(name, &args, names),
                Node::Attribute(of, name) => match &**of {
                    Node::Name(module) if module == "xacro" => call(name, &args, names),
                    Node::Name(module) if module == "math" || module == "python" => {
                        super::python::call(name, &args)
                    }
                    of => super::python::method(&value(of, names)?, name, &args),
                },
                _ => Err("this is no function".into()),
            }
        }
    }
}

fn call(name: &str, args: &[Value], names: &mut dyn Names) -> Result<Value, String> {
    match names.function(name, args)? {
        Some(v) => Ok(v),
        None => super::python::call(name, args),
    }
}

fn inside(space: usize, name: &str, names: &mut dyn Names) -> Result<Value, String> {
    names
        .inside(space, name)?
        .ok_or_else(|| format!("`{name}` is not defined in the included file"))
}
