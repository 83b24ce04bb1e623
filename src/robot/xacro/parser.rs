//! Grammar of the expressions in `${…}`.

use super::token::{Token, tokens};
use super::value::Value;

/// Deepest nesting of an expression.
const DEEPEST: usize = 60;
/// Most names, numbers and signs of an expression, which bounds its depth where signs follow each other.
const LONGEST: usize = 1000;

#[derive(Debug, Clone)]
pub(super) enum Node {
    Value(Value),
    Name(String),
    List(Vec<Node>),
    Dict(Vec<(Node, Node)>),
    Not(Box<Node>),
    Minus(Box<Node>),
    Both(&'static str, Box<Node>, Box<Node>),
    /// `a < b < c`
    Compared(Box<Node>, Vec<(String, Node)>),
    Either {
        condition: Box<Node>,
        yes: Box<Node>,
        no: Box<Node>,
    },
    Index(Box<Node>, Box<Node>),
    Slice(Box<Node>, [Option<Box<Node>>; 2]),
    Attribute(Box<Node>, String),
    Call(Box<Node>, Vec<Node>),
}

struct Parser {
    tokens: Vec<Token>,
    at: usize,
    depth: usize,
}

type Parsed = Result<Node, String>;

impl Parser {
    fn peek(&self) -> Option<&Token> {
        self.tokens.get(self.at)
    }

    fn sign(&mut self, one: &'static str) -> bool {
        let is = matches!(self.peek(), Some(Token::Sign(s)) if *s == one);
        self.at += usize::from(is);
        is
    }

    fn word(&mut self, one: &str) -> bool {
        let is = matches!(self.peek(), Some(Token::Name(s)) if s == one);
        self.at += usize::from(is);
        is
    }

    fn expect(&mut self, one: &'static str) -> Result<(), String> {
        match self.sign(one) {
            true => Ok(()),
            false => Err(format!("`{one}` is missing")),
        }
    }

    fn any(&mut self) -> Parsed {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err("it is nested too deeply".into());
        }
        let yes = self.or()?;
        let out = match self.word("if") {
            true => {
                let condition = self.or()?;
                if !self.word("else") {
                    return Err("`if` has no `else`".into());
                }
                let no = self.any()?;
                Node::Either {
                    condition: condition.into(),
                    yes: yes.into(),
                    no: no.into(),
                }
            }
            false => yes,
        };
        self.depth -= 1;
        Ok(out)
    }

    fn or(&mut self) -> Parsed {
        let mut left = self.and()?;
        while self.word("or") {
            left = Node::Both("or", left.into(), self.and()?.into());
        }
        Ok(left)
    }

    fn and(&mut self) -> Parsed {
        let mut left = self.not()?;
        while self.word("and") {
            left = Node::Both("and", left.into(), self.not()?.into());
        }
        Ok(left)
    }

    fn not(&mut self) -> Parsed {
        let mut times = 0;
        while self.word("not") {
            times += 1;
        }
        let mut out = self.comparison()?;
        // two of them make a truth value of what is none
        for _ in 0..if times > 1 { 2 - times % 2 } else { times } {
            out = Node::Not(out.into());
        }
        Ok(out)
    }

    fn comparison(&mut self) -> Parsed {
        let first = self.sum()?;
        let mut more = Vec::new();
        loop {
            let sign = ["==", "!=", "<=", ">=", "<", ">"]
                .into_iter()
                .find(|s| self.sign(s));
            let op = match sign {
                Some(s) => s.to_string(),
                None if self.word("in") => "in".into(),
                None if self.word("is") => if self.word("not") { "!=" } else { "==" }.into(),
                None if self.word("not") => match self.word("in") {
                    true => "not in".into(),
                    false => return Err("`not` stands between two values".into()),
                },
                None => break,
            };
            more.push((op, self.sum()?));
        }
        Ok(match more.is_empty() {
            true => first,
            false => Node::Compared(first.into(), more),
        })
    }

    fn sum(&mut self) -> Parsed {
        let mut left = self.product()?;
        while let Some(op) = ["+", "-"].into_iter().find(|s| self.sign(s)) {
            left = Node::Both(op, left.into(), self.product()?.into());
        }
        Ok(left)
    }

    fn product(&mut self) -> Parsed {
        let mut left = self.unary()?;
        while let Some(op) = ["*", "//", "/", "%"].into_iter().find(|s| self.sign(s)) {
            left = Node::Both(op, left.into(), self.unary()?.into());
        }
        Ok(left)
    }

    fn unary(&mut self) -> Parsed {
        let mut minus = false;
        loop {
            if self.sign("-") {
                minus = !minus;
            } else if !self.sign("+") {
                break;
            }
        }
        let out = self.power()?;
        Ok(if minus { Node::Minus(out.into()) } else { out })
    }

    fn power(&mut self) -> Parsed {
        let base = self.postfix()?;
        if !self.sign("**") {
            return Ok(base);
        }
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err("it is nested too deeply".into());
        }
        let exponent = self.unary()?;
        self.depth -= 1;
        Ok(Node::Both("**", base.into(), exponent.into()))
    }

    fn postfix(&mut self) -> Parsed {
        let mut out = self.atom()?;
        loop {
            if self.sign(".") {
                match self.tokens.get(self.at) {
                    Some(Token::Name(name)) => out = Node::Attribute(out.into(), name.clone()),
                    _ => return Err("a name is missing behind `.`".into()),
                }
                self.at += 1;
            } else if matches!(&out, Node::Name(n) if n == "dict") && self.named() {
                self.at += 1;
                out = self.dict()?;
            } else if self.sign("(") {
                out = Node::Call(out.into(), self.list(")")?);
            } else if self.sign("[") {
                let first = match self.peek() {
                    Some(Token::Sign(":")) => None,
                    _ => Some(self.any()?),
                };
                out = match (self.sign(":"), first) {
                    (false, Some(i)) => Node::Index(out.into(), i.into()),
                    (_, first) => {
                        let last = match self.peek() {
                            Some(Token::Sign("]")) => None,
                            _ => Some(self.any()?.into()),
                        };
                        Node::Slice(out.into(), [first.map(Box::new), last])
                    }
                };
                self.expect("]")?;
            } else {
                return Ok(out);
            }
        }
    }

    /// Whether values by name follow in brackets.
    fn named(&self) -> bool {
        matches!(
            self.tokens.get(self.at..self.at + 3),
            Some([Token::Sign("("), Token::Name(_), Token::Sign("=")])
        )
    }

    /// `a=1, b=2)` of a dictionary.
    fn dict(&mut self) -> Parsed {
        let mut all = Vec::new();
        while !self.sign(")") {
            let Some(Token::Name(key)) = self.peek().cloned() else {
                return Err("`dict` takes values by name, as in dict(a=1, b=2)".into());
            };
            self.at += 1;
            self.expect("=")?;
            all.push((Node::Value(key.as_str().into()), self.any()?));
            if !self.sign(",") {
                self.expect(")")?;
                break;
            }
        }
        Ok(Node::Dict(all))
    }

    /// Values up to a sign.
    fn list(&mut self, end: &'static str) -> Result<Vec<Node>, String> {
        let mut out = Vec::new();
        while !self.sign(end) {
            out.push(self.any()?);
            if matches!(self.peek(), Some(Token::Sign("="))) {
                return Err("arguments by name are not known".into());
            }
            if !self.sign(",") {
                self.expect(end)?;
                break;
            }
        }
        Ok(out)
    }

    fn atom(&mut self) -> Parsed {
        let token = self.peek().cloned();
        self.at += 1;
        match token {
            Some(Token::Number(v)) => Ok(Node::Value(v)),
            Some(Token::Text(mut t)) => {
                while let Some(Token::Text(more)) = self.peek().cloned() {
                    t += &more;
                    self.at += 1;
                }
                Ok(Node::Value(t.as_str().into()))
            }
            Some(Token::Name(n)) => match n.as_str() {
                "lambda" | "for" | "if" | "else" | "and" | "or" | "in" => {
                    Err(format!("`{n}` is not known here"))
                }
                _ => Ok(Node::Name(n)),
            },
            Some(Token::Sign("(")) => {
                let first = match self.peek() {
                    Some(Token::Sign(")")) => None,
                    _ => Some(self.any()?),
                };
                match first {
                    Some(one) if self.sign(")") => Ok(one),
                    Some(one) => {
                        self.expect(",")?;
                        let mut all = vec![one];
                        all.extend(self.list(")")?);
                        Ok(Node::List(all))
                    }
                    None => {
                        self.expect(")")?;
                        Ok(Node::List(Vec::new()))
                    }
                }
            }
            Some(Token::Sign("[")) => Ok(Node::List(self.list("]")?)),
            Some(Token::Sign("{")) => {
                let mut all = Vec::new();
                while !self.sign("}") {
                    let key = self.any()?;
                    self.expect(":")?;
                    all.push((key, self.any()?));
                    if !self.sign(",") {
                        self.expect("}")?;
                        break;
                    }
                }
                Ok(Node::Dict(all))
            }
            Some(Token::Sign(s)) => Err(format!("`{s}` is not expected")),
            None => Err("it ends too early".into()),
        }
    }
}

/// The tree of an expression.
pub(super) fn parse(text: &str) -> Result<Node, String> {
    let tokens = tokens(text)?;
    if tokens.len() > LONGEST {
        return Err(format!(
            "it has more than {LONGEST} names, numbers and signs"
        ));
    }
    let mut parser = Parser {
        tokens,
        at: 0,
        depth: 0,
    };
    let node = parser.any()?;
    match parser.peek() {
        None => Ok(node),
        Some(_) => Err("there is more than one value".into()),
    }
}
