//! The robot of a calibration: its chain, its joints, and the texts that a calibrated file is written from.

use super::frame::Frame;
use super::kin::Kin;
use super::parallel::Parallel;
use super::serial::{Arm, End, Link};
use crate::error::{Error, Result};
use crate::mechanism::Mechanism;
use crate::plant::Plant;
use crate::robot::file::expanded;
use crate::robot::file::names::did_you_mean;
use crate::robot::urdf::Urdf;
use crate::robot::{bundled, xacro};
use std::collections::BTreeMap;
use std::path::Path;

/// A robot, opened.
#[derive(Debug)]
#[non_exhaustive]
pub struct Opened {
    /// the robot
    pub plant: Plant,
    /// its kinematics with errors
    pub kin: Kin,
    /// names of the joints whose readings are measured, in their order
    pub joints: Vec<String>,
    /// indices of these joints among the robot's
    pub indices: Vec<usize>,
    /// the frame that is measured
    pub frame: String,
    /// text of its URDF
    pub urdf: Option<String>,
    /// text of its `robot.toml`
    pub toml: Option<String>,
}

/// Text of a file.
fn text(path: &Path) -> Result<String> {
    std::fs::read_to_string(path).map_err(|e| Error::io(path, e))
}

/// Texts of a robot file: `robot.toml` where there is one, and URDF.
fn texts(spec: &str) -> Result<(Option<String>, String)> {
    let (name, arguments) = xacro::with_arguments(spec);
    let path = Path::new(name);
    if path.is_file() {
        let own = text(path)?;
        let is_toml = path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("toml"));
        if !is_toml {
            let (_, urdf) = expanded(path.to_path_buf(), own, &arguments)?;
            return Ok((None, urdf));
        }
        let table: toml::Table = toml::from_str(&own)
            .map_err(|e| Error::file(path, "", e.message().replace('\n', "; ")))?;
        let urdf = table
            .get("urdf")
            .and_then(toml::Value::as_str)
            .unwrap_or_default();
        let (urdf, arguments) = xacro::with_arguments(urdf);
        let beside = path.parent().unwrap_or(Path::new("")).join(urdf);
        let urdf = text(&beside)?;
        return Ok((Some(own), expanded(beside, urdf, &arguments)?.1));
    }
    match bundled::find(spec) {
        Some(b) => Ok((Some(b.toml.to_string()), b.urdf.to_string())),
        None => Err(Error::Argument(format!(
            "`{spec}` is neither a file nor a bundled robot"
        ))),
    }
}

/// Opens the robot `spec` for a measurement of `frame`.
///
/// # Errors
/// What reading a robot finds; a frame that there is not; a robot with several tips and no frame stated.
pub fn open(spec: &str, frame: Option<&str>) -> Result<Opened> {
    opened(spec, frame, None)
}

/// Opens the robot `spec` for a measurement of two arms that hold the same thing: the frames of both.
///
/// # Errors
/// As [`open()`]; frames without a joint between them, or in one chain; a parallel robot.
pub fn open_pair(spec: &str, frame: Option<&str>, other: &str) -> Result<Opened> {
    opened(spec, frame, Some(other))
}

fn opened(spec: &str, frame: Option<&str>, other: Option<&str>) -> Result<Opened> {
    let plant = Plant::load(spec)?;
    if let Some(mechanism) = plant.mechanism() {
        if let Some(other) = other {
            return Err(Error::Infeasible(format!(
                "{}: other = \"{other}\", but a parallel robot has one platform; a loop is of two arms of a tree",
                plant.name()
            )));
        }
        return open_parallel(mechanism, frame, &plant);
    }
    let (toml, urdf_text) = texts(spec)?;
    let urdf = Urdf::parse(&urdf_text, Path::new(spec))?;
    let robot = plant.robot();
    let lock = locked(toml.as_deref());
    let is_body = |name: &str| robot.bodies.iter().any(|b| b.name == name);
    let frame = match frame {
        Some(f) => f.to_string(),
        None => only_tip(&plant, other.is_some())?,
    };
    let found = |frame: &str, key: &str| -> Result<(usize, Frame)> {
        let Some((body, rotation, position)) = urdf.frame(frame, is_body, &lock) else {
            return Err(Error::Infeasible(format!(
                "{}: there is no link `{frame}`{}; {key} names the link that the measurement sees",
                plant.name(),
                did_you_mean(frame, urdf.link_names())
            )));
        };
        let body = body.and_then(|b| robot.bodies.iter().position(|o| o.name == b));
        let Some(body) = body else {
            return Err(Error::Infeasible(format!(
                "{}: link `{frame}` does not move; {key} names the link that the measurement sees",
                plant.name()
            )));
        };
        let tip = Frame {
            r: rotation,
            p: position,
        };
        Ok((body, tip))
    };
    let chain = |body: usize| {
        let mut chain = vec![body];
        while let Some(parent) = robot.bodies[chain[chain.len() - 1]].parent {
            chain.push(parent);
        }
        chain.reverse();
        chain
    };
    let mut tips = vec![(frame.clone(), found(&frame, "frame")?)];
    let mut bodies = chain(tips[0].1.0);
    if let Some(other) = other {
        let own = found(other, "other")?;
        let second = chain(own.0);
        if second.contains(&tips[0].1.0) || bodies.contains(&own.0) {
            return Err(Error::Infeasible(format!(
                "{}: `{frame}` and `{other}` sit in one chain of joints{}; a loop takes the tools of two arms that part from \
                 one another",
                plant.name(),
                if own.0 == tips[0].1.0 {
                    ", with no moving joint between them"
                } else {
                    ""
                }
            )));
        }
        tips.push((other.to_string(), own));
        let more: Vec<usize> = second.into_iter().filter(|b| !bodies.contains(b)).collect();
        bodies.extend(more);
    }
    let place = |body: usize| bodies.iter().position(|&b| b == body);
    let mut indices: Vec<usize> = Vec::new();
    let mut links = Vec::new();
    for &b in &bodies {
        let body = robot.bodies[b].clone();
        let coordinate = match indices.iter().position(|&c| c == body.coordinate) {
            Some(k) => k,
            None => {
                indices.push(body.coordinate);
                indices.len() - 1
            }
        };
        links.push(Link {
            parent: body.parent.and_then(place),
            body,
            coordinate,
        });
    }
    let joints = indices
        .iter()
        .map(|&j| robot.joints[j].name.clone())
        .collect();
    let ends = tips.into_iter().map(|(name, (body, tip))| End {
        link: place(body).unwrap_or(0),
        tip,
        tip_joint: match is_body(&name) {
            true => None,
            false => urdf.joint_to(&name).map(str::to_string),
        },
    });
    let kin = Kin::Arm(Arm {
        ends: ends.collect(),
        links,
    });
    Ok(Opened {
        kin,
        joints,
        indices,
        frame,
        urdf: Some(urdf_text),
        toml,
        plant,
    })
}

/// Positions at which a `robot.toml` holds joints.
fn locked(toml: Option<&str>) -> BTreeMap<String, f64> {
    let table = toml.and_then(|t| toml::from_str::<toml::Table>(t).ok());
    let held = table.as_ref().and_then(|t| t.get("lock")?.as_table());
    let each = held.into_iter().flatten().map(|(name, v)| {
        let value = v.as_float().or(v.as_integer().map(|i| i as f64));
        (name.clone(), value.unwrap_or(0.0))
    });
    each.collect()
}

/// The last link of a robot that has one.
fn only_tip(plant: &Plant, pair: bool) -> Result<String> {
    let bodies = &plant.robot().bodies;
    let is_leaf = |i: &usize| !bodies.iter().any(|b| b.parent == Some(*i));
    let leaves: Vec<usize> = (0..bodies.len()).filter(is_leaf).collect();
    match leaves[..] {
        [one] if !pair => Ok(bodies[one].name.clone()),
        _ => Err(Error::Infeasible(format!(
            "{}: it has {} tips; state which one the measurement sees: frame = \"{}\"",
            plant.name(),
            leaves.len(),
            leaves.first().map_or("link", |&l| bodies[l].name.as_str())
        ))),
    }
}

/// A parallel robot: its dimensions and the joint readings of its actuators.
fn open_parallel(mechanism: &Mechanism, frame: Option<&str>, plant: &Plant) -> Result<Opened> {
    let name = plant.name();
    let parallel = Parallel::new(mechanism).ok_or_else(|| {
        Error::Infeasible(format!(
            "{name}: the geometry of a mechanism of kind `{}` cannot be calibrated; gough-stewart, h4, delta, serial \
             robots and trees can",
            mechanism.platform().source.name()
        ))
    })?;
    if let Some(f) = frame.filter(|f| *f != "platform") {
        return Err(Error::Infeasible(format!(
            "{name}: frame = \"{f}\", but the measurement of a parallel robot sees its platform; remove frame, and \
             let the target stand for the place on it"
        )));
    }
    let text = mechanism.platform().text.clone();
    Ok(Opened {
        joints: parallel.mechanism.actuator_names(),
        indices: parallel.mechanism.actuated.clone(),
        kin: Kin::Parallel(Box::new(parallel)),
        frame: "platform".into(),
        urdf: None,
        toml: (!text.is_empty()).then_some(text),
        plant: plant.clone(),
    })
}
