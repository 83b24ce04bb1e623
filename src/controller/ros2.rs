//! ROS 2: `trajectory_msgs/msg/JointTrajectory`, as YAML and as a bag.
//!
//! The joint trajectory controller of `ros2_control` draws straight lines through points that have positions, cubics
//! where they have velocities too, and quintics where they have accelerations.

use super::cdr::{Cdr, SCHEMA, split};
use super::mcap;
use super::options::Column;
use super::playback::Playback;
use super::text::{exact, list, plain, quoted};
use super::{Card, Choice, Format};
use crate::error::{Error, Result};

/// Where the controller listens unless it has another name.
const TOPIC: &str = "/joint_trajectory_controller/joint_trajectory";

/// The derivatives that a message has, with their names in it.
fn fields(playback: &Playback) -> Vec<(&'static str, &[Vec<f64>])> {
    let s = &playback.samples;
    let all = [
        ("positions", Column::Q, &s.q),
        ("velocities", Column::Dq, &s.qd),
        ("accelerations", Column::Ddq, &s.qdd),
    ];
    let chosen = all.into_iter();
    chosen
        .filter(|(_, column, _)| playback.columns.contains(column))
        .map(|(name, _, values)| (name, values.as_slice()))
        .collect()
}

/// State of sample `i`.
fn at(columns: &[Vec<f64>], i: usize) -> Vec<f64> {
    columns.iter().map(|c| c[i]).collect()
}

/// A message counts its seconds in 32 bits.
fn fits(playback: &Playback) -> Result<()> {
    match playback.duration() < f64::from(i32::MAX) {
        true => Ok(()),
        false => Err(Error::Infeasible(format!(
            "a ROS message cannot hold {} s; lower --periods",
            playback.duration()
        ))),
    }
}

/// The message as YAML.
pub struct Yaml;

impl Format for Yaml {
    fn card(&self) -> Card {
        Card {
            choice: Choice::Derivatives,
            ..Card::new(
                "ros2",
                "yaml",
                "ROS 2 JointTrajectory message as YAML (ros2_control, any robot)",
            )
        }
    }

    fn write(&self, playback: &Playback) -> Result<Vec<u8>> {
        fits(playback)?;
        let names: Vec<String> = playback.joints.iter().map(|c| quoted(&c.name)).collect();
        let mut out = format!(
            "# trajectory_msgs/msg/JointTrajectory, robot {}: {} points in {} s\n\
             header:\n  stamp: {{sec: 0, nanosec: 0}}\n  frame_id: ''\njoint_names: [{}]\npoints:\n",
            plain(&playback.robot),
            playback.len(),
            playback.duration(),
            names.join(", ")
        );
        let fields = fields(playback);
        for (i, &t) in playback.samples.t.iter().enumerate() {
            for (k, (name, columns)) in fields.iter().enumerate() {
                let lead = if k == 0 { "- " } else { "  " };
                out += &format!("{lead}{name}: [{}]\n", list(&at(columns, i), exact));
            }
            let (sec, nano) = split(t);
            out += &format!("  time_from_start: {{sec: {sec}, nanosec: {nano}}}\n");
        }
        Ok(out.into_bytes())
    }
}

/// The message in a bag.
pub struct Mcap;

impl Format for Mcap {
    fn card(&self) -> Card {
        Card {
            choice: Choice::Derivatives,
            ..Card::new(
                "ros2-mcap",
                "mcap",
                "the same message in a bag that `ros2 bag play` publishes",
            )
        }
    }

    fn write(&self, playback: &Playback) -> Result<Vec<u8>> {
        fits(playback)?;
        let mut cdr = Cdr::new();
        cdr.time(0.0);
        cdr.string("");
        cdr.u32(playback.joints.len() as u32);
        for joint in &playback.joints {
            cdr.string(&joint.name);
        }
        cdr.u32(playback.len() as u32);
        let fields = fields(playback);
        for (i, &t) in playback.samples.t.iter().enumerate() {
            // positions, velocities, accelerations, effort
            for k in 0..4 {
                let values = fields
                    .get(k)
                    .map_or(Vec::new(), |(_, columns)| at(columns, i));
                cdr.doubles(&values);
            }
            cdr.time(t);
        }
        let data = cdr.bytes();
        if u32::try_from(data.len()).is_err() {
            return Err(Error::Infeasible(
                "the message would be larger than 4 GB; lower --rate or --periods".into(),
            ));
        }
        Ok(mcap::file(&mcap::Message {
            topic: TOPIC,
            schema: "trajectory_msgs/msg/JointTrajectory",
            definition: SCHEMA,
            data: &data,
        }))
    }
}
