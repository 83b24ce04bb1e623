//! Base parameters in words: combinations, and why a parameter is not felt alone.

use super::{BaseParameters, Identifiability};
use crate::robot::{Column, JointTerm, Motion, Robot};

impl BaseParameters {
    /// Readable linear combination, `link2.Izz + link3.m·0.0998 − …`. Coefficients that are
    /// rounding noise (below 1e-6 of what the parameter itself carries) are left out.
    pub fn combination(&self, a: usize) -> String {
        let mut text = self.name(a).to_string();
        for (d, &j) in self.dropped.iter().enumerate() {
            let c = self.k[(a, d)];
            if c.abs() < 1e-5 {
                continue;
            }
            text.push_str(if c < 0.0 { " - " } else { " + " });
            let c = c.abs();
            if (c - 1.0).abs() > 1e-5 {
                text.push_str(&format!("{}·", short(c)));
            }
            text.push_str(&self.names[j]);
        }
        text
    }

    /// Why a parameter is what it is, where that can be said simply.
    pub(super) fn reason(&self, robot: &Robot, index: usize, column: Column) -> String {
        match (self.standard[index].identifiability, column) {
            (Identifiability::Alone, _) => String::new(),
            (Identifiability::None, Column::Inertial { body, k }) => none_reason(robot, body, k),
            (Identifiability::None, _) => String::new(),
            (Identifiability::Combination, _) => {
                let partners = self.partners(index);
                let mut text = if partners.is_empty() {
                    String::new()
                } else {
                    format!("felt only together with {}", list(&partners, 4))
                };
                if let Column::Term {
                    joint,
                    term: JointTerm::Armature,
                } = column
                    && robot
                        .bodies
                        .iter()
                        .any(|b| b.coordinate == joint && b.parent.is_none())
                {
                    text = format!("the rotor of a first joint turns exactly as its link: {text}");
                }
                text
            }
        }
    }

    /// Fills in the simple reasons, for regressors of any kind.
    pub fn explain_all(&mut self) {
        for index in 0..self.standard.len() {
            self.standard[index].reason = match self.standard[index].identifiability {
                Identifiability::Alone => String::new(),
                Identifiability::None => "it never acts on an actuator".into(),
                Identifiability::Combination => {
                    let partners = self.partners(index);
                    match partners.is_empty() {
                        true => String::new(),
                        false => format!("felt only together with {}", list(&partners, 4)),
                    }
                }
            };
        }
    }

    /// Names of the parameters that share a base parameter with this one.
    fn partners(&self, index: usize) -> Vec<&str> {
        let significant = |a: usize, d: usize| self.k[(a, d)].abs() > 1e-5;
        let mut all: Vec<usize> = Vec::new();
        if let Ok(a) = self.kept.binary_search(&index) {
            all.extend(
                (0..self.dropped.len())
                    .filter(|&d| significant(a, d))
                    .map(|d| self.dropped[d]),
            );
        }
        if let Ok(d) = self.dropped.binary_search(&index) {
            all.extend(
                (0..self.count())
                    .filter(|&a| significant(a, d))
                    .map(|a| self.kept[a]),
            );
        }
        all.iter().map(|&j| self.names[j].as_str()).collect()
    }
}

/// Four significant digits without trailing zeros.
fn short(x: f64) -> String {
    let digits = (3 - x.abs().log10().floor() as i32).clamp(0, 8) as usize;
    let s = format!("{x:.digits$}");
    match s.contains('.') {
        true => s.trim_end_matches('0').trim_end_matches('.').to_string(),
        false => s,
    }
}

fn list(names: &[&str], most: usize) -> String {
    match names.len() {
        0 => String::new(),
        n if n <= most => names.join(", "),
        n => format!("{} and {} more", names[..most].join(", "), n - most),
    }
}

/// Why an inertial parameter never acts.
fn none_reason(robot: &Robot, body: usize, k: usize) -> String {
    let mut chain = vec![body];
    while let Some(p) = robot.bodies[chain[chain.len() - 1]].parent {
        chain.push(p);
    }
    let turns = chain
        .iter()
        .filter(|&&i| robot.bodies[i].motion == Motion::Revolute)
        .count();
    if turns == 0 {
        return match k {
            0 => "the link only slides at right angles to gravity and force".into(),
            _ => "the link only slides: only its mass is felt".into(),
        };
    }
    if chain.len() == 1 {
        let b = &robot.bodies[body];
        let axis = b.rotation * b.axis;
        let along = robot.gravity.cross(&axis).norm() < 1e-4 * robot.gravity.norm();
        let why = if robot.gravity.norm() == 0.0 {
            "without gravity"
        } else if along {
            "parallel to gravity"
        } else {
            "through its own origin"
        };
        return format!("first joint: the link turns about a fixed axis {why}");
    }
    let parallel = chain.windows(2).all(|w| {
        let b = &robot.bodies[w[0]];
        let up = &robot.bodies[w[1]];
        up.motion == Motion::Prismatic
            || b.motion == Motion::Prismatic
            || (b.rotation * b.axis).cross(&up.axis).norm() < 1e-4
    });
    if parallel && turns > 0 {
        return "all axes up to this link are parallel: it moves in a plane and does not feel what \
                lies across it"
            .into();
    }
    String::new()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_numbers() {
        assert_eq!(short(0.316), "0.316");
        assert_eq!(short(0.099_856_3), "0.09986");
        assert_eq!(short(2.0), "2");
        assert_eq!(short(1234.6), "1235");
    }
}
