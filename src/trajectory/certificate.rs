//! The certificate: position, velocity, acceleration and jerk limits over all time.

use super::bounds::{SampledBound, TOLERANCE, TorqueBound};
use super::by_position::{PositionPeak, velocity_by_position};
use super::extrema::{Extremum, extrema};
use super::fourier::{Fourier, check};
use super::tool::ToolCertificate;
use crate::error::Result;
use crate::robot::Robot;

/// Kinds of limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// position, rad or m
    Position,
    /// velocity
    Velocity,
    /// acceleration
    Acceleration,
    /// jerk
    Jerk,
    /// velocity against the one that is allowed at the position
    #[serde(rename = "velocity_by_position")]
    VelocityByPosition,
    /// torque or force
    Torque,
    /// rate of the torque or force
    #[serde(rename = "torque_rate")]
    TorqueRate,
    /// speed of the tool point
    #[serde(rename = "tool_speed")]
    ToolSpeed,
    /// acceleration of the tool point
    #[serde(rename = "tool_acceleration")]
    ToolAcceleration,
    /// of the pose of a parallel robot: passive joint, singularity, distance
    Pose,
}

impl Kind {
    /// Name as in reports.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Position => "position",
            Kind::Velocity => "velocity",
            Kind::Acceleration => "acceleration",
            Kind::Jerk => "jerk",
            Kind::VelocityByPosition => "velocity by position",
            Kind::Torque => "torque",
            Kind::TorqueRate => "torque rate",
            Kind::ToolSpeed => "speed",
            Kind::ToolAcceleration => "acceleration",
            Kind::Pose => "margin",
        }
    }
}

/// The largest magnitude of a quantity over all time, against its limit.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct Peak {
    /// largest magnitude
    pub value: f64,
    /// when, s into the period
    pub time: f64,
    /// the magnitude exceeds this at no time (rigorous, including rounding)
    pub bound: f64,
    /// limit; `None` where there is none
    pub limit: Option<f64>,
    /// `value / limit`
    pub used: Option<f64>,
    /// `limit − value`
    pub margin: Option<f64>,
}

impl Peak {
    /// The largest magnitude `peak.value`, which lies below `bound` at all times, against a limit.
    pub fn new(peak: Extremum, bound: f64, limit: f64) -> Self {
        let limit = limit.is_finite().then_some(limit);
        let used = limit.map(|l| {
            if peak.value == 0.0 {
                0.0
            } else {
                peak.value / l
            }
        });
        let margin = limit.map(|l| l - peak.value);
        Peak {
            value: peak.value,
            time: peak.time,
            bound,
            limit,
            used,
            margin,
        }
    }

    /// Whether the bound stays within the limit.
    pub fn satisfied(&self) -> bool {
        match self.limit {
            Some(limit) => self.bound <= limit * (1.0 + TOLERANCE),
            None => self.bound.is_finite(),
        }
    }
}

/// Range of a joint position over all time, against its limits.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct Range {
    /// smallest position and when
    pub min: Extremum,
    /// largest position and when
    pub max: Extremum,
    /// rigorous enclosure, lower and upper
    pub bounds: [f64; 2],
    /// lower limit; `None` where there is none
    pub lower: Option<f64>,
    /// upper limit; `None` where there is none
    pub upper: Option<f64>,
    /// `max |q − mid| / half range`; `None` unless both limits are there
    pub used: Option<f64>,
    /// distance to the nearer limit, negative beyond it; `None` without limits
    pub margin: Option<f64>,
}

impl Range {
    /// The range from `min` to `max`, which lies in `bounds` at all times, against limits (infinite
    /// where there are none).
    pub fn new(min: Extremum, max: Extremum, bounds: [f64; 2], limits: [f64; 2]) -> Self {
        let [lower, upper] = limits.map(|v| v.is_finite().then_some(v));
        let used = lower.zip(upper).map(|(a, b)| {
            let far = (max.value - 0.5 * (a + b)).max(0.5 * (a + b) - min.value);
            if far == 0.0 {
                0.0
            } else {
                far / (0.5 * (b - a))
            }
        });
        let margin = match (lower.map(|a| min.value - a), upper.map(|b| b - max.value)) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
        Range {
            min,
            max,
            bounds,
            lower,
            upper,
            used,
            margin,
        }
    }

    /// Whether the enclosure stays within the limits.
    pub fn satisfied(&self) -> bool {
        let range = match (self.lower, self.upper) {
            (Some(a), Some(b)) => b - a,
            (Some(a), None) | (None, Some(a)) => a.abs().max(1.0),
            (None, None) => 0.0,
        };
        let slack = TOLERANCE * range;
        self.bounds[0] >= self.lower.map_or(f64::MIN, |a| a - slack)
            && self.bounds[1] <= self.upper.map_or(f64::MAX, |b| b + slack)
    }
}

/// How it is known that kinematic limits hold between the samples, the strongest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Proof {
    /// exact extrema of a series over all time
    Exact,
    /// interval arithmetic on the closed form of the kinematics, rounding included
    Enclosed,
    /// a bound from twice the largest second difference of the samples: stated, not proven
    Stated,
}

/// What is proven of one joint.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct JointCertificate {
    /// name of the joint
    pub joint: String,
    /// range of the position
    pub position: Range,
    /// largest speed
    pub velocity: Peak,
    /// largest acceleration
    pub acceleration: Peak,
    /// largest jerk
    pub jerk: Peak,
    /// largest share of the velocity by position, where there is such a limit
    #[serde(default)]
    pub velocity_by_position: Option<PositionPeak>,
    /// largest torque, where it was asked for
    pub torque: Option<TorqueBound>,
    /// largest rate of the torque, where it has a limit and was asked for
    #[serde(default)]
    pub torque_rate: Option<SampledBound>,
}

impl JointCertificate {
    /// Kind, used fraction and whether it holds, of every limit.
    fn verdicts(&self) -> impl Iterator<Item = (Kind, Option<f64>, bool)> {
        let torque = self.torque.as_ref();
        let by_position = self.velocity_by_position.as_ref();
        let rate = self.torque_rate.as_ref();
        [
            (
                Kind::Position,
                self.position.used,
                self.position.satisfied(),
            ),
            (
                Kind::Velocity,
                self.velocity.used,
                self.velocity.satisfied(),
            ),
            (
                Kind::Acceleration,
                self.acceleration.used,
                self.acceleration.satisfied(),
            ),
            (Kind::Jerk, self.jerk.used, self.jerk.satisfied()),
            (
                Kind::VelocityByPosition,
                by_position.map(|p| p.used),
                by_position.is_none_or(|p| p.satisfied()),
            ),
            (
                Kind::Torque,
                torque.and_then(|t| t.used),
                torque.is_none_or(|t| t.satisfied()),
            ),
            (
                Kind::TorqueRate,
                rate.map(|r| r.used),
                rate.is_none_or(|r| r.satisfied()),
            ),
        ]
        .into_iter()
    }
}

/// The limit nearest to, or furthest beyond, exhaustion.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Worst {
    /// name of the joint
    pub joint: String,
    /// which limit
    pub kind: Kind,
    /// fraction used
    pub used: f64,
}

/// Proof that a motion keeps a robot's limits at all times, or where it does not.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct Certificate {
    /// joint by joint
    pub joints: Vec<JointCertificate>,
    /// the tool point, where it has limits
    #[serde(default)]
    pub tool: Option<ToolCertificate>,
    /// whether every limit holds (to 1e-9 of its range)
    pub satisfied: bool,
    /// the most used limit; `None` where there are no limits
    pub worst: Option<Worst>,
}

impl Certificate {
    /// Of all joints.
    pub fn new(joints: Vec<JointCertificate>) -> Self {
        let mut worst: Option<Worst> = None;
        let mut satisfied = true;
        for joint in &joints {
            for (kind, used, holds) in joint.verdicts() {
                satisfied &= holds;
                if let Some(used) = used
                    && worst.as_ref().is_none_or(|w| used > w.used)
                {
                    worst = Some(Worst {
                        joint: joint.joint.clone(),
                        kind,
                        used,
                    });
                }
            }
        }
        Certificate {
            joints,
            tool: None,
            satisfied,
            worst,
        }
    }

    /// This certificate with the torques of [`torque_certificate`](super::torque_certificate),
    /// one per joint.
    pub fn with_torque(self, torque: Vec<TorqueBound>) -> Self {
        let mut joints = self.joints;
        for (joint, bound) in joints.iter_mut().zip(torque) {
            joint.torque = Some(bound);
        }
        Certificate::new(joints)
    }
}

impl Certificate {
    /// This certificate with what is known of the tool point.
    pub fn with_tool(self, tool: Option<ToolCertificate>) -> Self {
        let mut all = Certificate { tool, ..self };
        let Some(tool) = &all.tool else { return all };
        all.satisfied &= tool.satisfied();
        let both = [
            (Kind::ToolSpeed, &tool.speed),
            (Kind::ToolAcceleration, &tool.acceleration),
        ];
        for (kind, bound) in both {
            if let Some(b) = bound
                && all.worst.as_ref().is_none_or(|w| b.used > w.used)
            {
                all.worst = Some(Worst {
                    joint: tool.frame.clone(),
                    kind,
                    used: b.used,
                });
            }
        }
        all
    }

    /// This certificate with the rates of [`rate_certificate`](super::rate_certificate), one per joint.
    pub fn with_torque_rate(self, rates: Vec<Option<SampledBound>>) -> Self {
        let mut joints = self.joints;
        for (joint, rate) in joints.iter_mut().zip(rates) {
            joint.torque_rate = rate;
        }
        Certificate::new(joints)
    }
}

/// Exact extrema of every joint's position, velocity, acceleration and jerk over all time (see
/// [`extrema`]), compared with the robot's limits. Torques are added by
/// [`Certificate::with_torque`].
///
/// ```
/// use excite::Robot;
/// use excite::trajectory::{Fourier, certify};
/// use excite::trajectory::parts::Series;
///
/// let robot = Robot::load("planar2")?;
/// // 0.1 sin(2π t / 5 s) for both joints
/// let swing = Series { constant: 0.0, sin: vec![0.1], cos: vec![0.0] };
/// let fourier = Fourier::new(5.0, vec![1], vec![swing.clone(), swing])?;
/// let certificate = certify(&robot, &fourier)?;
/// let speed = certificate.joints[0].velocity;
/// assert!((speed.value - 0.1 * fourier.omega()).abs() < 1e-9 && speed.value <= speed.bound);
/// # Ok::<(), excite::Error>(())
/// ```
///
/// # Errors
/// [`Error::Argument`](crate::Error::Argument) if the trajectory is malformed or has another number of joints than the
/// robot.
pub fn certify(robot: &Robot, trajectory: &Fourier) -> Result<Certificate> {
    check(robot, trajectory)?;
    let range = |j: usize, order: u32| {
        extrema(
            trajectory.period,
            &trajectory.harmonics,
            &trajectory.joints[j],
            order,
        )
    };
    let joints = robot
        .joints
        .iter()
        .enumerate()
        .map(|(j, joint)| {
            let q = range(j, 0);
            let bounds = [q.lower_bound, q.upper_bound];
            let position = Range::new(q.min, q.max, bounds, joint.limits.position);
            let peak = |order: u32, limit: f64| {
                let e = range(j, order);
                Peak::new(e.largest(), e.magnitude_bound(), limit)
            };
            JointCertificate {
                joint: joint.name.clone(),
                position,
                velocity: peak(1, joint.limits.velocity),
                acceleration: peak(2, joint.limits.acceleration),
                jerk: peak(3, joint.limits.jerk),
                velocity_by_position: joint.limits.velocity_by_position.map(|limit| {
                    let series = &trajectory.joints[j];
                    velocity_by_position(trajectory.period, &trajectory.harmonics, series, &limit)
                }),
                torque: None,
                torque_rate: None,
            }
        })
        .collect();
    Ok(Certificate::new(joints))
}
