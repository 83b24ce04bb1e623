//! What Python's operators, functions and methods do with values.

use super::value::{Value, number};
use std::cmp::Ordering;
use std::rc::Rc;

/// Longest text or list that an expression may make.
const LONGEST: usize = 1 << 20;

type Made = Result<Value, String>;

/// Names of Python's `math` that stand for numbers.
pub(super) fn name(name: &str) -> Option<Value> {
    Some(match name {
        "pi" => Value::Float(std::f64::consts::PI),
        "tau" => Value::Float(std::f64::consts::TAU),
        "e" => Value::Float(std::f64::consts::E),
        "inf" => Value::Float(f64::INFINITY),
        "nan" => Value::Float(f64::NAN),
        "True" | "true" => Value::Bool(true),
        "False" | "false" => Value::Bool(false),
        "None" => Value::None,
        _ => return None,
    })
}

/// `a op b`.
pub(super) fn operation(op: &str, a: &Value, b: &Value) -> Made {
    let wrong = || Err(format!("`{op}` between {} and {}", a.kind(), b.kind()));
    let whole = |v: &Value| match v {
        Value::Int(i) => Some(*i),
        Value::Bool(x) => Some(i64::from(*x)),
        _ => None,
    };
    match (op, a, b) {
        ("+", Value::Text(x), Value::Text(y)) => return Ok(format!("{x}{y}").as_str().into()),
        ("+", Value::List(x), Value::List(y)) => {
            return Ok(Value::List(Rc::new(
                x.iter().chain(&**y).cloned().collect(),
            )));
        }
        ("*", Value::Text(t), n) | ("*", n, Value::Text(t)) => {
            let Some(n) = whole(n) else { return wrong() };
            let times = usize::try_from(n).unwrap_or(0);
            return match t.len().saturating_mul(times) > LONGEST {
                true => Err("the text is too long".into()),
                false => Ok(t.repeat(times).as_str().into()),
            };
        }
        _ => {}
    }
    if let (Some(x), Some(y)) = (whole(a), whole(b)) {
        let exact = match op {
            "+" => x.checked_add(y),
            "-" => x.checked_sub(y),
            "*" => x.checked_mul(y),
            "//" | "%" if y == 0 => return Err("division by zero".into()),
            // towards minus infinity, with the sign of the divisor
            "%" => x.checked_rem(y).map(|r| {
                if r != 0 && (r < 0) != (y < 0) {
                    r + y
                } else {
                    r
                }
            }),
            "//" => x.checked_div(y).map(|d| {
                if x % y != 0 && (x < 0) != (y < 0) {
                    d - 1
                } else {
                    d
                }
            }),
            "**" if y >= 0 => u32::try_from(y).ok().and_then(|y| x.checked_pow(y)),
            _ => None,
        };
        if let Some(i) = exact {
            return Ok(Value::Int(i));
        }
    }
    let (Some(x), Some(y)) = (a.number(), b.number()) else {
        return wrong();
    };
    Ok(Value::Float(match op {
        "+" => x + y,
        "-" => x - y,
        "*" => x * y,
        "**" => x.powf(y),
        "/" | "//" | "%" if y == 0.0 => return Err("division by zero".into()),
        "/" => x / y,
        "//" => (x / y).floor(),
        "%" => x - y * (x / y).floor(),
        _ => return wrong(),
    }))
}

fn equal(a: &Value, b: &Value) -> bool {
    match (a.number(), b.number()) {
        (Some(x), Some(y)) => x == y,
        _ => a == b,
    }
}

/// `a op b` of a comparison.
pub(super) fn compared(op: &str, a: &Value, b: &Value) -> Result<bool, String> {
    let holds = || match b {
        Value::Text(t) => match a {
            Value::Text(part) => Ok(t.contains(&**part)),
            _ => Err(format!("`in` of {} in text", a.kind())),
        },
        Value::List(all) => Ok(all.iter().any(|v| equal(v, a))),
        Value::Dict(all) => Ok(all.iter().any(|(k, _)| equal(k, a))),
        _ => Err(format!("`in` of {}", b.kind())),
    };
    let order = || {
        let found = match (a, b) {
            (Value::Text(x), Value::Text(y)) => Some(x.cmp(y)),
            _ => match (a.number(), b.number()) {
                (Some(x), Some(y)) => return Ok(x.partial_cmp(&y)),
                _ => None,
            },
        };
        found
            .map(Some)
            .ok_or_else(|| format!("`{op}` between {} and {}", a.kind(), b.kind()))
    };
    Ok(match op {
        "==" => equal(a, b),
        "!=" => !equal(a, b),
        "in" => holds()?,
        "not in" => !holds()?,
        "<" => order()? == Some(Ordering::Less),
        ">" => order()? == Some(Ordering::Greater),
        "<=" => matches!(order()?, Some(Ordering::Less | Ordering::Equal)),
        _ => matches!(order()?, Some(Ordering::Greater | Ordering::Equal)),
    })
}

/// Where an index points to, from the end below zero.
fn place(i: i64, length: usize) -> Option<usize> {
    let length = i64::try_from(length).ok()?;
    let at = if i < 0 { i + length } else { i };
    (0..length)
        .contains(&at)
        .then_some(usize::try_from(at).ok()?)
}

/// `of[key]`.
pub(super) fn item(of: &Value, key: &Value) -> Made {
    match (of, key) {
        (Value::Dict(_), _) => of
            .get(key)
            .cloned()
            .ok_or_else(|| format!("there is no `{key}` in it")),
        (Value::List(all), Value::Int(i)) => {
            let found = place(*i, all.len()).and_then(|at| all.get(at).cloned());
            found.ok_or_else(|| format!("there is no item {i} of {}", all.len()))
        }
        (Value::Text(t), Value::Int(i)) => {
            let letters: Vec<char> = t.chars().collect();
            let found = place(*i, letters.len()).and_then(|at| letters.get(at));
            let found = found.map(|c| c.to_string().as_str().into());
            found.ok_or_else(|| format!("there is no letter {i} of {}", letters.len()))
        }
        _ => Err(format!("{} has no item `{key}`", of.kind())),
    }
}

/// `of[a:b]`.
pub(super) fn slice(of: &Value, ends: [Option<Value>; 2]) -> Made {
    let range = |length: usize| -> Result<std::ops::Range<usize>, String> {
        let at = |end: &Option<Value>, otherwise: usize| match end {
            None => Ok(otherwise),
            Some(Value::Int(i)) if *i < 0 => {
                let back = usize::try_from(i.unsigned_abs()).unwrap_or(usize::MAX);
                Ok(length.saturating_sub(back))
            }
            Some(Value::Int(i)) => Ok(usize::try_from(*i).unwrap_or(usize::MAX).min(length)),
            Some(v) => Err(format!("{v} is no place in a list")),
        };
        let (from, to) = (at(&ends[0], 0)?, at(&ends[1], length)?);
        Ok(from..to.max(from))
    };
    match of {
        Value::List(all) => Ok(Value::List(Rc::new(all[range(all.len())?].to_vec()))),
        Value::Text(t) => {
            let letters: Vec<char> = t.chars().collect();
            let part: String = letters[range(letters.len())?].iter().collect();
            Ok(part.as_str().into())
        }
        _ => Err(format!("{} has no parts", of.kind())),
    }
}

fn numbers(name: &str, args: &[Value]) -> Result<Vec<f64>, String> {
    let one = |v: &Value| {
        v.number()
            .ok_or_else(|| format!("`{name}` of {}", v.kind()))
    };
    args.iter().map(one).collect()
}

/// Functions of Python and its `math`.
pub(super) fn call(name: &str, args: &[Value]) -> Made {
    let few = || Err(format!("`{name}` with {} values", args.len()));
    let exact = |x: f64| match x.is_finite() && x.abs() < 9e15 {
        true => Ok(Value::Int(x as i64)),
        false => Err(format!("`{name}` of {x}")),
    };
    match (name, args) {
        ("str", [v]) => return Ok(v.to_string().as_str().into()),
        ("bool", [v]) => return Ok(Value::Bool(v.truth())),
        ("len", [Value::Text(t)]) => return Ok(Value::Int(t.chars().count() as i64)),
        ("len", [Value::List(all)]) => return Ok(Value::Int(all.len() as i64)),
        ("len", [Value::Dict(all)]) => return Ok(Value::Int(all.len() as i64)),
        ("list" | "tuple", [v @ Value::List(_)]) => return Ok(v.clone()),
        ("list" | "tuple", [Value::Dict(all)]) => {
            return Ok(Value::List(Rc::new(
                all.iter().map(|(k, _)| k.clone()).collect(),
            )));
        }
        ("list" | "tuple", []) => return Ok(Value::List(Rc::default())),
        ("dict", [v @ Value::Dict(_)]) => return Ok(v.clone()),
        ("dict", []) => return Ok(Value::Dict(Rc::default())),
        ("float", [Value::Text(t)]) => {
            let x = number(t.trim()).ok_or_else(|| format!("`{t}` is not a number"))?;
            return Ok(Value::Float(x));
        }
        ("int", [Value::Text(t)]) => {
            let i = t
                .trim()
                .parse()
                .map_err(|_| format!("`{t}` is not a whole number"))?;
            return Ok(Value::Int(i));
        }
        ("int", [v @ (Value::Int(_) | Value::Bool(_))]) => return exact(v.number().unwrap_or(0.0)),
        ("abs", [Value::Int(i)]) if *i != i64::MIN => return Ok(Value::Int(i.abs())),
        ("min" | "max" | "sum", [Value::List(all)]) => return call(name, all),
        ("min" | "max", [first, rest @ ..]) => {
            let mut best = first;
            let sign = if name == "min" { "<" } else { ">" };
            for v in rest {
                if compared(sign, v, best)? {
                    best = v;
                }
            }
            return Ok(best.clone());
        }
        ("sum", all) => {
            return all
                .iter()
                .try_fold(Value::Int(0), |sum, v| operation("+", &sum, v));
        }
        ("range", _) => {
            let whole = |v: &Value| match v {
                Value::Int(i) => Ok(*i),
                other => Err(format!("`range` of {}", other.kind())),
            };
            let (from, to) = match args {
                [to] => (0, whole(to)?),
                [from, to] => (whole(from)?, whole(to)?),
                _ => return few(),
            };
            return match to.saturating_sub(from) > LONGEST as i64 {
                true => Err("the list is too long".into()),
                false => Ok(Value::List(Rc::new((from..to).map(Value::Int).collect()))),
            };
        }
        _ => {}
    }
    let x = numbers(name, args);
    let one = |f: fn(f64) -> f64| match x.as_deref() {
        Ok([v]) => Ok(Value::Float(f(*v))),
        Ok(_) => few(),
        Err(e) => Err(e.clone()),
    };
    let two = |f: fn(f64, f64) -> f64| match x.as_deref() {
        Ok([a, b]) => Ok(Value::Float(f(*a, *b))),
        Ok(_) => few(),
        Err(e) => Err(e.clone()),
    };
    let whole = |f: fn(f64) -> f64| match x.as_deref() {
        Ok([v]) => exact(f(*v)),
        Ok(_) => few(),
        Err(e) => Err(e.clone()),
    };
    match name {
        "sin" => one(f64::sin),
        "cos" => one(f64::cos),
        "tan" => one(f64::tan),
        "asin" => one(f64::asin),
        "acos" => one(f64::acos),
        "atan" => one(f64::atan),
        "sinh" => one(f64::sinh),
        "cosh" => one(f64::cosh),
        "tanh" => one(f64::tanh),
        "exp" => one(f64::exp),
        "log10" => one(f64::log10),
        "sqrt" => one(f64::sqrt),
        "fabs" | "abs" => one(f64::abs),
        "float" => one(|v| v),
        "radians" => one(f64::to_radians),
        "degrees" => one(f64::to_degrees),
        "log" if args.len() == 2 => two(f64::log),
        "log" => one(f64::ln),
        "atan2" => two(f64::atan2),
        "hypot" => two(f64::hypot),
        "pow" => two(f64::powf),
        "fmod" => two(|a, b| a % b),
        "copysign" => two(f64::copysign),
        "floor" => whole(f64::floor),
        "ceil" => whole(f64::ceil),
        "trunc" | "int" => whole(f64::trunc),
        "round" if args.len() == 1 => whole(f64::round_ties_even),
        "round" => match (x.as_deref(), args) {
            (Ok([v, _]), [_, Value::Int(digits)]) if (0..=300).contains(digits) => {
                let text = format!("{v:.*}", usize::try_from(*digits).unwrap_or(0));
                Ok(Value::Float(text.parse().unwrap_or(*v)))
            }
            _ => few(),
        },
        _ => Err(format!("there is no function `{name}`")),
    }
}

/// Methods of texts, lists and dictionaries.
pub(super) fn method(of: &Value, name: &str, args: &[Value]) -> Made {
    let texts = |all: Vec<&str>| Value::List(Rc::new(all.into_iter().map(Value::from).collect()));
    let text = |t: &str| Ok(Value::from(t));
    match (of, name, args) {
        (Value::Text(t), "split", []) => Ok(texts(t.split_whitespace().collect())),
        (Value::Text(t), "split", [Value::Text(by)]) if !by.is_empty() => {
            Ok(texts(t.split(&**by).collect()))
        }
        (Value::Text(t), "strip", []) => text(t.trim()),
        (Value::Text(t), "lower", []) => text(&t.to_lowercase()),
        (Value::Text(t), "upper", []) => text(&t.to_uppercase()),
        (Value::Text(t), "replace", [Value::Text(a), Value::Text(b)]) => {
            let out = t.replace(&**a, b);
            match out.len() > LONGEST {
                true => Err("the text is too long".into()),
                false => text(&out),
            }
        }
        (Value::Text(t), "startswith", [Value::Text(a)]) => Ok(Value::Bool(t.starts_with(&**a))),
        (Value::Text(t), "endswith", [Value::Text(a)]) => Ok(Value::Bool(t.ends_with(&**a))),
        (Value::Text(t), "join", [Value::List(all)]) => {
            let all: Vec<String> = all.iter().map(Value::to_string).collect();
            text(&all.join(t))
        }
        (Value::Dict(_), "get", [key]) => Ok(of.get(key).cloned().unwrap_or(Value::None)),
        (Value::Dict(_), "get", [key, otherwise]) => Ok(of.get(key).unwrap_or(otherwise).clone()),
        (Value::Dict(all), "keys", []) => Ok(Value::List(Rc::new(
            all.iter().map(|p| p.0.clone()).collect(),
        ))),
        (Value::Dict(all), "values", []) => Ok(Value::List(Rc::new(
            all.iter().map(|p| p.1.clone()).collect(),
        ))),
        (Value::List(all), "index", [v]) => match all.iter().position(|x| equal(x, v)) {
            Some(i) => Ok(Value::Int(i as i64)),
            None => Err(format!("there is no `{v}` in it")),
        },
        _ => Err(format!(
            "{} has no method `{name}` of {} values",
            of.kind(),
            args.len()
        )),
    }
}
