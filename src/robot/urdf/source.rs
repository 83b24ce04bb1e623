//! Numbers and places of an XML file, with the lines that errors name.

use crate::error::{Error, Result, Warning, WarningKind};
use crate::robot::meant;
use nalgebra::{Matrix3, Vector3};
use roxmltree::Node;
use std::path::Path;

/// Largest length (m), mass (kg) and moment of inertia (kg m²) of anything that is taken for a
/// robot. What is more is a slip of a digit or of a unit, and would leave no digit for the rest.
pub(super) const LARGEST: [f64; 3] = [1e7, 1e6, 1e8];

/// Name and text that errors refer to.
pub(super) struct Source<'a> {
    pub(super) file: &'a Path,
    /// byte offsets at which lines begin
    lines: Vec<usize>,
}

impl<'a> Source<'a> {
    pub(super) fn new(file: &'a Path, text: &str) -> Self {
        let starts = text
            .bytes()
            .enumerate()
            .filter(|(_, b)| *b == b'\n')
            .map(|(i, _)| i + 1);
        Source {
            file,
            lines: std::iter::once(0).chain(starts).collect(),
        }
    }

    pub(super) fn line(&self, node: Node) -> usize {
        self.lines
            .partition_point(|&start| start <= node.range().start)
    }

    /// `what` is a joint or link with its name, or the element itself.
    pub(super) fn error(&self, node: Node, what: &str, message: impl Into<String>) -> Error {
        Error::file(
            self.file,
            format!("line {}: {what}", self.line(node)),
            message,
        )
    }

    /// A finite number in an attribute; `None` where the attribute is absent.
    pub(super) fn number(&self, node: Node, attribute: &str, what: &str) -> Result<Option<f64>> {
        let Some(text) = node.attribute(attribute) else {
            return Ok(None);
        };
        let tag = node.tag_name().name();
        match text.trim().parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            Ok(_) => Err(self.error(
                node,
                what,
                format!("`{attribute}=\"{text}\"` in <{tag}> is not finite; state a number"),
            )),
            Err(_) => Err(self.error(
                node,
                what,
                format!(
                    "`{attribute}=\"{}\"` in <{tag}> is not a number; write it as in 1.5 or 2e-3",
                    shorten(text)
                ),
            )),
        }
    }

    /// Three finite numbers in an attribute.
    pub(super) fn vector(
        &self,
        node: Node,
        attribute: &str,
        what: &str,
    ) -> Result<Option<Vector3<f64>>> {
        let Some(text) = node.attribute(attribute) else {
            return Ok(None);
        };
        let values: Vec<Option<f64>> = text
            .split_whitespace()
            .take(4)
            .map(|t| t.parse::<f64>().ok())
            .collect();
        match values[..] {
            [Some(x), Some(y), Some(z)] if x.is_finite() && y.is_finite() && z.is_finite() => {
                Ok(Some(Vector3::new(x, y, z)))
            }
            _ => Err(self.error(
                node,
                what,
                format!(
                    "`{attribute}=\"{}\"` in <{}> must be three finite numbers separated by spaces",
                    shorten(text),
                    node.tag_name().name()
                ),
            )),
        }
    }

    /// `<origin>` of a joint or inertial: rotation and position; the identity where it is absent.
    pub(super) fn origin(
        &self,
        node: Option<Node>,
        what: &str,
    ) -> Result<(Matrix3<f64>, Vector3<f64>)> {
        let Some(node) = node else {
            return Ok((Matrix3::identity(), Vector3::zeros()));
        };
        let position = self.vector(node, "xyz", what)?.unwrap_or_default();
        if position.amax() > LARGEST[0] {
            return Err(self.error(
                node,
                what,
                format!(
                    "`xyz=\"{}\"` lies {:.1e} m away, and {:.0e} m is the most that is read; \
                     correct it, in m",
                    shorten(node.attribute("xyz").unwrap_or_default()),
                    position.amax(),
                    LARGEST[0]
                ),
            ));
        }
        let rpy = self.vector(node, "rpy", what)?.unwrap_or_default();
        Ok((meant::rotation(&rpy), position))
    }

    /// The rotation that `rpy` of an `<origin>` means, with a warning about numbers that are
    /// written too short.
    pub(super) fn meant_rotation(
        &self,
        node: Option<Node>,
        what: &str,
        warnings: &mut Vec<Warning>,
    ) -> Result<Matrix3<f64>> {
        let Some(node) = node else {
            return Ok(Matrix3::identity());
        };
        let mut rpy = self.vector(node, "rpy", what)?.unwrap_or_default();
        let texts = node.attribute("rpy").unwrap_or_default();
        for (x, text) in rpy.iter_mut().zip(texts.split_whitespace()) {
            let angle = meant::angle(text, *x);
            if angle.coarse {
                warnings.push(Warning::new(
                    WarningKind::AngleRounded,
                    what,
                    format!(
                        "line {}: rpy holds {text}, taken for {} where it is decided what can be \
                         identified; write {:.16}",
                        self.line(node),
                        multiple_of_pi(angle.value),
                        angle.value
                    ),
                ));
            }
            *x = angle.value;
        }
        Ok(meant::rotation(&rpy))
    }
}

/// A multiple of a right angle in words: `pi`, `-pi/2`, `3 pi/2`.
pub(super) fn multiple_of_pi(angle: f64) -> String {
    let halves = (angle / std::f64::consts::FRAC_PI_2).round();
    let sign = if halves < 0.0 { "-" } else { "" };
    let (count, over) = match halves.abs() {
        n if n % 2.0 == 0.0 => (n / 2.0, ""),
        n => (n, "/2"),
    };
    match count == 1.0 {
        true => format!("{sign}pi{over}"),
        false => format!("{sign}{count} pi{over}"),
    }
}

/// At most 60 characters of a value that is quoted in a message.
pub(super) fn shorten(text: &str) -> String {
    match text.char_indices().nth(60) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_string(),
    }
}

/// First child element of this name; a second one is reported.
pub(super) fn child<'a, 'd>(
    node: Node<'a, 'd>,
    tag: &str,
    what: &str,
    warnings: &mut Vec<Warning>,
) -> Option<Node<'a, 'd>> {
    let mut found = node
        .children()
        .filter(|n| n.is_element() && n.tag_name().name() == tag);
    let first = found.next();
    if found.next().is_some() {
        warnings.push(Warning::new(
            WarningKind::EntryIgnored,
            what,
            format!("<{tag}> is given twice; the first is used"),
        ));
    }
    first
}
