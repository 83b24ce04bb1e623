//! Loops: the entries of the file, and the frames that they join.

use crate::error::Result;
use crate::mechanism::file::body::{numbers, vector};
use crate::mechanism::loops::yaml;
use crate::mechanism::loops::{Closure, Coincide, Frame};
use crate::mechanism::task::rotation;
use crate::robot::Robot;
use crate::robot::file::Text;
use crate::robot::file::names::{did_you_mean, listed};
use crate::robot::urdf::Urdf;
use nalgebra::Vector3;
use serde::Deserialize;
use serde::de::{MapAccess, Visitor, value::MapAccessDeserializer};
use std::collections::BTreeMap;
use toml::Spanned;

/// One `[[loop]]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LoopEntry {
    frames: Spanned<Vec<Spanned<FrameEntry>>>,
    coincide: Spanned<String>,
}

/// A link, or a frame on it.
struct FrameEntry {
    link: String,
    position: Option<Spanned<Vec<f64>>>,
    rpy: Option<Spanned<Vec<f64>>>,
}

impl<'de> Deserialize<'de> for FrameEntry {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Table {
            link: String,
            position: Option<Spanned<Vec<f64>>>,
            rpy: Option<Spanned<Vec<f64>>>,
        }
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = FrameEntry;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("the name of a link, or { link, position, rpy }")
            }
            fn visit_str<E: serde::de::Error>(self, link: &str) -> Result<FrameEntry, E> {
                Ok(FrameEntry {
                    link: link.into(),
                    position: None,
                    rpy: None,
                })
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<FrameEntry, A::Error> {
                let t = Table::deserialize(MapAccessDeserializer::new(map))?;
                Ok(FrameEntry {
                    link: t.link,
                    position: t.position,
                    rpy: t.rpy,
                })
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// Finds frames and joints by name.
pub(super) struct Names<'a> {
    pub(super) urdf: &'a Urdf,
    pub(super) robot: &'a Robot,
    pub(super) lock: &'a BTreeMap<String, f64>,
}

impl Names<'_> {
    /// The frame of a link.
    fn frame(&self, link: &str) -> Result<Frame, String> {
        let bodies = &self.robot.bodies;
        let at = |name: &str| bodies.iter().position(|b| b.name == name);
        let Some((body, rotation, position)) =
            self.urdf.frame(link, |l| at(l).is_some(), self.lock)
        else {
            let all: Vec<&str> = self.urdf.link_names().collect();
            return Err(format!(
                "the URDF has no link `{link}`{}; its links are {}",
                did_you_mean(link, all.iter().copied()),
                listed(&all)
            ));
        };
        Ok(Frame {
            name: link.to_string(),
            body: body.as_deref().and_then(at),
            rotation,
            position,
        })
    }

    /// Index of a coordinate.
    pub(super) fn joint(&self, name: &str) -> Result<usize, String> {
        let all = &self.robot.joints;
        all.iter().position(|j| j.name == name).ok_or_else(|| {
            let names: Vec<&str> = all.iter().map(|j| j.name.as_str()).collect();
            let fixed = match self.urdf.joint_names().any(|n| n == name) {
                true => " that moves (it is fixed, locked, or follows another)",
                false => "",
            };
            format!(
                "there is no joint `{name}`{fixed}{}; joints that move are {}",
                did_you_mean(name, names.iter().copied()),
                listed(&names)
            )
        })
    }
}

pub(super) fn closure(
    source: Text,
    names: &Names,
    entry: &LoopEntry,
    number: usize,
) -> Result<Closure> {
    let what = format!("[[loop]] {number}");
    let coincide = match entry.coincide.get_ref().as_str() {
        "position" => Coincide::Position,
        "pose" => Coincide::Pose,
        other => {
            return Err(source.error(
                entry.coincide.span().start,
                &what,
                format!("coincide = \"{other}\" must be \"position\" or \"pose\""),
            ));
        }
    };
    let [a, b] = &entry.frames.get_ref()[..] else {
        return Err(source.error(
            entry.frames.span().start,
            &what,
            format!(
                "a loop joins two frames, here are {}",
                entry.frames.get_ref().len()
            ),
        ));
    };
    let frame = |spanned: &Spanned<FrameEntry>| -> Result<Frame> {
        let (entry, at) = (spanned.get_ref(), spanned.span().start);
        let mut frame = names
            .frame(&entry.link)
            .map_err(|why| source.error(at, &what, why))?;
        if let Some(p) = &entry.position {
            frame.position += frame.rotation * vector(source, p, &what, "position")?;
        }
        if let Some(rpy) = &entry.rpy {
            let rpy = numbers::<3>(source, rpy, &what, "rpy")?;
            frame.rotation *= rotation(&Vector3::from(rpy));
        }
        Ok(frame)
    };
    let frames = [frame(a)?, frame(b)?];
    if frames[0].body == frames[1].body {
        return Err(source.error(
            entry.frames.span().start,
            &what,
            format!(
                "`{}` and `{}` sit on the same body: nothing is closed",
                frames[0].name, frames[1].name
            ),
        ));
    }
    Ok(Closure { frames, coincide })
}

pub(super) fn from_yaml(
    names: &Names,
    listed: &yaml::Closures,
    key: Option<&Spanned<String>>,
    source: Text,
) -> Result<Vec<Closure>> {
    let at = key.map_or(0, |k| k.span().start);
    let frame = |link: &String| {
        names
            .frame(link)
            .map_err(|why| source.error(at, "closed_loop", why))
    };
    listed
        .loops
        .iter()
        .map(|([a, b], coincide)| {
            Ok(Closure {
                frames: [frame(a)?, frame(b)?],
                coincide: *coincide,
            })
        })
        .collect()
}
