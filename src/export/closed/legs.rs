//! Legs without mass: tendons between two points.
//!
//! MuJoCo lets a constraint give by `(1 − d)/d` of the inverse inertia of what it acts on in the open tree. On bodies of a
//! leg that weighs nothing that is without bound: a platform of 20 kg on such legs would open its loops by millimetres, and
//! dry friction in the legs would be next to none. A leg of a Gough-Stewart platform that has no mass is nothing but a
//! force along the line between its two joints, so it is written as that.

use super::Join;
use crate::export::escape;
use crate::mechanism::{Mechanism, Source};
use crate::robot::{JointTerm, Robot};
use std::fmt::Write;

/// The legs of a Gough-Stewart platform, none of which has mass; a leg each in the order of the loops.
pub(super) struct Legs(Vec<Leg>);

struct Leg {
    coordinate: usize,
    /// the body that hangs on the base
    first: usize,
    /// length less the position of the drive, m
    zero: f64,
}

impl Legs {
    /// `None` where the robot has no such legs.
    pub(super) fn of(mechanism: &Mechanism, robot: &Robot, joins: &[Join]) -> Option<Self> {
        if !matches!(mechanism.source, Source::GoughStewart) {
            return None;
        }
        let light = |b: &usize| {
            let body = &robot.bodies[*b];
            let driven = mechanism.actuated.contains(&body.coordinate);
            let terms = &robot.joints[body.coordinate].terms;
            let bare = driven || terms.iter().all(|t| *t == 0.0);
            bare && body.inertia.0.iter().all(|x| *x == 0.0)
        };
        let of = |join: &Join| {
            let rod = join.sites[0].body?;
            let chain: Vec<usize> =
                std::iter::successors(Some(rod), |b| robot.bodies[*b].parent).collect();
            chain.iter().all(light).then_some(Leg {
                coordinate: robot.bodies[rod].coordinate,
                first: *chain.last()?,
                zero: robot.bodies[rod].offset,
            })
        };
        let legs: Vec<Leg> = joins.iter().map(of).collect::<Option<_>>()?;
        (legs.len() == mechanism.actuated.len()).then_some(Self(legs))
    }

    /// The leg whose first body this is.
    pub(super) fn begins(&self, body: usize) -> Option<usize> {
        self.0.iter().position(|l| l.first == body)
    }

    /// Whether a body is a leg's, and so in no file.
    pub(super) fn has(&self, robot: &Robot, body: usize) -> bool {
        let up = std::iter::successors(Some(body), |b| robot.bodies[*b].parent);
        up.last().is_some_and(|b| self.begins(b).is_some())
    }

    /// Length of the leg of a coordinate less that coordinate, m.
    pub(super) fn zero(&self, coordinate: usize) -> f64 {
        let leg = self.0.iter().find(|l| l.coordinate == coordinate);
        leg.map_or(0.0, |l| l.zero)
    }

    /// The tendons and their drives.
    pub(super) fn write(&self, robot: &Robot, out: &mut String) {
        out.push_str("  <tendon>\n");
        for (i, leg) in self.0.iter().enumerate() {
            let joint = &robot.joints[leg.coordinate];
            let mut attributes = String::new();
            if joint.limits.position.iter().all(|x| x.is_finite()) {
                let [low, high] = joint.limits.position.map(|x| x + leg.zero);
                let _ = write!(attributes, " range=\"{} {high}\"", low.max(0.0));
            }
            for (name, term) in [
                ("armature", JointTerm::Armature),
                ("damping", JointTerm::Viscous),
                ("frictionloss", JointTerm::Coulomb),
            ] {
                let value = joint.terms[term as usize];
                if value > 0.0 {
                    let _ = write!(attributes, " {name}=\"{value}\"");
                }
            }
            let _ = writeln!(
                out,
                "    <spatial name=\"{}\"{attributes}>\n      <site site=\"loop{1}_a\"/><site site=\"loop{1}_b\"/>\n    </spatial>",
                escape(&joint.name),
                i + 1
            );
        }
        out.push_str("  </tendon>\n");
    }

    /// What a drive of this coordinate acts on, and the force that it has without a command, N.
    pub(super) fn drive(&self, robot: &Robot, coordinate: usize) -> String {
        let joint = &robot.joints[coordinate];
        let offset = joint.terms[JointTerm::Offset as usize];
        let bias = match offset == 0.0 {
            true => String::new(),
            false => format!(" biastype=\"affine\" biasprm=\"{} 0 0\"", -offset),
        };
        format!("tendon=\"{}\"{bias}", escape(&joint.name))
    }
}
