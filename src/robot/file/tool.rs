//! `[tool]` of a `robot.toml`.

use super::Text;
use super::joint::positive;
use super::names::did_you_mean;
use crate::error::Result;
use crate::robot::geometry::Link;
use crate::robot::tool::Tool;
use nalgebra::Vector3;
use serde::Deserialize;
use toml::Spanned;

/// `[tool]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ToolEntry {
    frame: Spanned<String>,
    // a vector, because an array would swallow further elements in silence
    point: Option<Spanned<Vec<f64>>>,
    speed: Option<Spanned<f64>>,
    acceleration: Option<Spanned<f64>>,
}

impl ToolEntry {
    /// The limits of a point of one of these links.
    pub fn tool(&self, source: Text, links: &[Link]) -> Result<Tool> {
        let (name, at) = (self.frame.get_ref(), self.frame.span().start);
        let Some(link) = links.iter().find(|l| l.name == *name) else {
            let close = did_you_mean(name, links.iter().map(|l| l.name.as_str()));
            let message = format!("the URDF has no link `{name}`{close}");
            return Err(source.error(at, "[tool]", message));
        };
        let Some(body) = link.body else {
            let message = format!("link `{name}` does not move; name one that does");
            return Err(source.error(at, "[tool]", message));
        };
        let own = match &self.point {
            None => Vector3::zeros(),
            Some(p) => match p.get_ref()[..] {
                [x, y, z] if [x, y, z].iter().all(|x| x.abs() < 1e3) => Vector3::new(x, y, z),
                _ => {
                    let message = "point must be three numbers in m, in the axes of the frame";
                    return Err(source.error(p.span().start, "[tool]", message));
                }
            },
        };
        let limit = |entry, key| positive(source, entry, key, "[tool]");
        let speed = limit(&self.speed, "speed")?;
        let acceleration = limit(&self.acceleration, "acceleration")?;
        if speed.is_none() && acceleration.is_none() {
            let message = "it states no limit; add speed (m/s) or acceleration (m/s^2)";
            return Err(source.error(at, "[tool]", message));
        }
        Ok(Tool {
            frame: name.clone(),
            body,
            point: link.pose.rotation * own + link.pose.position,
            speed: speed.unwrap_or(f64::INFINITY),
            acceleration: acceleration.unwrap_or(f64::INFINITY),
        })
    }
}
