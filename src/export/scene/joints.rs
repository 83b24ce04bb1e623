//! MJCF: the attributes of joints and of the actuators on them.

use super::bodies::SAME;
use super::mjcf::Work;
use super::text::Edits;
use crate::export::mujoco::{OnJoint, STIFF, spring};
use crate::robot::mjcf::xml::Element;
use crate::robot::{JointTerm, Motion};

/// Step of a scene that states none, s.
const DEFAULT_STEP: f64 = 0.002;

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= SAME * (a.abs() + b.abs()).max(1e-9)
}

/// Whether lists are the same, zeros behind them left out.
fn alike(a: &[f64], b: &[f64]) -> bool {
    let at = |x: &[f64], k: usize| x.get(k).copied().unwrap_or(0.0);
    (0..a.len().max(b.len())).all(|k| close(at(a, k), at(b, k)))
}

/// Numbers without the zeros behind them, at least one.
fn list(x: &[f64]) -> String {
    let used = x.iter().rposition(|v| *v != 0.0).map_or(1, |i| i + 1);
    let all: Vec<String> = x[..used].iter().map(f64::to_string).collect();
    all.join(" ")
}

impl Work<'_> {
    /// Attributes of the joint of coordinate `j`.
    pub(super) fn joint(&mut self, j: usize, on: &OnJoint) -> crate::error::Result<()> {
        let (b, name) = self.leader(j);
        let Some(e) = self.element(&name) else {
            return Ok(());
        };
        let of = Edits::called(e.node);
        let theirs = self.scene.robot.joints.iter().find(|c| c.name == name);
        let theirs = theirs.map_or([0.0; 4], |c| c.terms);
        let stated = e.numbers("damping")?.unwrap_or_default();
        let springs = e.numbers("springdamper")?.unwrap_or_default();
        let timed = springs.len() == 2 && springs.iter().all(|x| *x > 0.0);
        if timed {
            let was = e.text("springdamper");
            self.edits
                .set(e.node, &of, "springdamper", "0 0".into(), was);
        }
        // what joints that follow it add is left to them
        let mut left = |what: &str, short: f64| {
            let more = format!("{what} of `{name}`: joints that follow it have {short} too much");
            self.left_out.push(more);
        };
        let mut share = |term: JointTerm, what: &str, wanted: f64, own: f64| {
            let others = theirs[term as usize] - own;
            let share = wanted - others;
            if share < -SAME * others.abs() {
                left(what, -share);
            }
            share.max(0.0)
        };
        let own = e.number("armature")?.unwrap_or(0.0);
        let armature = share(JointTerm::Armature, "rotor inertia", on.armature, own);
        let first = stated.first().copied().unwrap_or(0.0);
        let viscous = share(JointTerm::Viscous, "damping", on.damping[0], first);
        let loss = e.number("frictionloss")?.unwrap_or(0.0);
        let dry = match on.coulomb > 0.0 {
            true => share(JointTerm::Coulomb, "dry friction", on.coulomb, loss),
            false => 0.0,
        };
        let was = |name: &str| e.text(name);
        if !close(own, armature) {
            let value = armature.to_string();
            self.edits
                .set(e.node, &of, "armature", value, was("armature"));
        }
        let polynomial = [viscous, on.damping[1], on.damping[2]];
        if !alike(&stated, &polynomial) {
            let value = list(&polynomial);
            self.edits
                .set(e.node, &of, "damping", value, was("damping"));
        }
        if !close(loss, dry) {
            let value = dry.to_string();
            self.edits
                .set(e.node, &of, "frictionloss", value, was("frictionloss"));
            for (name, value) in STIFF {
                if dry > 0.0 && was(name) != Some(value) {
                    self.edits.set(e.node, &of, name, value.into(), was(name));
                }
            }
        }
        self.spring(&e, &of, b, on)?;
        self.reference(&e, &of, b)
    }

    /// rad or m of the unit in which the file states positions of the joint of a body.
    fn unit(&self, b: usize) -> f64 {
        match self.model.robot.bodies[b].motion {
            Motion::Revolute => self.compiler.angle,
            Motion::Prismatic => 1.0,
        }
    }

    fn spring(
        &mut self,
        e: &Element,
        of: &str,
        b: usize,
        on: &OnJoint,
    ) -> crate::error::Result<()> {
        let now = e.numbers("stiffness")?.unwrap_or_default();
        let at = self.unit(b) * e.number("springref")?.unwrap_or(0.0);
        let set = |edits: &mut Edits, name: &str, value: String| {
            edits.set(e.node, of, name, value, e.text(name));
        };
        match spring(on.spring) {
            Some((stiffness, rest)) if !alike(&now, &stiffness) || !close(at, rest) => {
                set(&mut self.edits, "stiffness", list(&stiffness));
                let value = (rest / self.unit(b)).to_string();
                set(&mut self.edits, "springref", value);
            }
            // a spring that the model has not, so that the records speak against it
            None if now.iter().any(|k| *k != 0.0) => {
                set(&mut self.edits, "stiffness", "0".into());
            }
            _ => {}
        }
        Ok(())
    }

    /// The position of the joint where the bodies stand as written, moved by the offset of its encoder.
    fn reference(&mut self, e: &Element, of: &str, b: usize) -> crate::error::Result<()> {
        let offset = self.offset(b);
        if offset != 0.0 {
            let unit = self.unit(b);
            let now = e.number("ref")?.unwrap_or(0.0);
            let value = (now - offset / unit).to_string();
            self.edits.set(e.node, of, "ref", value, e.text("ref"));
        }
        Ok(())
    }

    /// Way by which the model has a body further along its joint than the robot had it, rad or m.
    fn offset(&mut self, b: usize) -> f64 {
        let way = super::mjcf::moved(
            &self.model.plant.robot().bodies[b],
            &self.model.robot.bodies[b],
        );
        way.unwrap_or_else(|| {
            let name = &self.model.robot.bodies[b].joint_name;
            self.left_out.push(format!(
                "the frame of the link of `{name}`, which is another one"
            ));
            0.0
        })
    }

    /// Gain and delay of the actuators of coordinate `j`.
    pub(super) fn drive(&mut self, j: usize, on: &OnJoint) -> crate::error::Result<()> {
        if on.gain == 1.0 && on.delay == 0.0 {
            return Ok(());
        }
        let (_, name) = self.leader(j);
        let step = self.option("timestep")?.unwrap_or(DEFAULT_STEP);
        let mut found = false;
        for node in self.root.all("actuator").flat_map(|a| &a.children) {
            let e = self.compiler.element(node, None)?;
            let joint = e.text("joint").or(e.text("jointinparent"));
            if joint != Some(name.as_str()) {
                continue;
            }
            found = true;
            let of = Edits::called(node);
            let bias = e.text("biastype").unwrap_or("none") != "none";
            let scaled: &[(&str, f64)] = match node.tag.as_str() {
                _ if on.gain == 1.0 => &[],
                "motor" => &[("gear", 1.0)],
                "general" if !bias => &[("gear", 1.0)],
                "general" => &[("gainprm", 1.0), ("biasprm", 0.0)],
                "position" | "intvelocity" => &[("kp", 1.0), ("kv", 0.0)],
                "velocity" | "damper" => &[("kv", 1.0)],
                tag => {
                    self.left_out
                        .push(format!("gain of the {tag} actuator of `{name}`"));
                    &[]
                }
            };
            for (key, default) in scaled {
                let now = e.numbers(key)?.unwrap_or(vec![*default]);
                if now.iter().all(|x| *x == 0.0) {
                    continue;
                }
                let new: Vec<String> = now.iter().map(|x| (x * on.gain).to_string()).collect();
                self.edits.set(node, &of, key, new.join(" "), e.text(key));
            }
            if on.delay > 0.0 {
                let samples = (on.delay / step).ceil() + 1.0;
                self.edits
                    .set(node, &of, "delay", on.delay.to_string(), e.text("delay"));
                self.edits
                    .set(node, &of, "nsample", samples.to_string(), e.text("nsample"));
            }
        }
        if !found {
            self.left_out.push(format!(
                "gain and delay of the drive of `{name}`: the scene has no actuator on it"
            ));
        }
        Ok(())
    }
}
