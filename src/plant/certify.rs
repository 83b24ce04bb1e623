//! Proof that a motion keeps all limits for all time.

use super::{ClearanceCertificate, Plant};
use crate::error::Result;
use crate::mechanism::MechanismCertificate;
use crate::regressor::smooth_torque_function;
use crate::robot::Robot;
use crate::trajectory::Fourier;
use crate::trajectory::certificate::{Certificate, Kind, Proof, Worst, certify};
use crate::trajectory::tool::tool_certificate;
use crate::trajectory::torque::{rate_certificate, torque_certificate};

/// Samples that the bound of the torques may spend.
const TORQUE_SAMPLES: usize = 2000;

/// What is known of all limits of a plant along a motion.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Certified {
    /// position, velocity, acceleration, jerk and torque of the actuators; whether every limit
    /// holds, and the worst of all, those of the pose of a closed chain included
    pub actuators: Certificate,
    /// workspace box, passive joints, singularities and distances of a closed chain
    pub mechanism: Option<MechanismCertificate>,
    /// how the kinematic limits of the actuators are known between the samples
    pub proof: Proof,
    /// what is known of collisions; `None` where they were not looked at
    pub clearance: Option<ClearanceCertificate>,
}

impl Certified {
    /// Whether every limit holds for all time.
    pub fn satisfied(&self) -> bool {
        self.actuators.satisfied && self.clearance.as_ref().is_none_or(|c| c.satisfied)
    }

    /// The limit that is exceeded most, in words; `None` where all hold.
    pub fn broken(&self) -> Option<String> {
        if self.satisfied() {
            return None;
        }
        if self.actuators.satisfied
            && let Some(c) = &self.clearance
        {
            let short = c.pairs.iter().find(|p| p.bound < p.margin);
            return Some(match short {
                Some(p) => format!(
                    "{} and {} are {:.4} m apart at {:.3} s (known to be at least {:.4} m), less than the \
                     margin of {} m",
                    p.between[0], p.between[1], p.least, p.time, p.bound, p.margin
                ),
                None => "a clearance that cannot be evaluated".into(),
            });
        }
        Some(match &self.actuators.worst {
            Some(w) => {
                let what = match w.kind {
                    Kind::Pose => w.joint.clone(),
                    kind => format!("{} of {}", kind.name(), w.joint),
                };
                match w.used.is_finite() {
                    true => format!("{what} at {:.1} % of its limit", 100.0 * w.used),
                    false => format!("{what} without bound"),
                }
            }
            None => "a limit that cannot be evaluated".into(),
        })
    }
}

impl Plant {
    /// Judges a motion of the coordinates against all limits times `derate` (positions keep the
    /// middle of their range; the workspace box of a closed chain is taken as it is).
    ///
    /// ```
    /// use excite::Plant;
    /// use excite::trajectory::Fourier;
    /// use excite::trajectory::parts::Series;
    ///
    /// let plant = Plant::load("planar2")?;
    /// let swing = Series { constant: 0.0, sin: vec![0.1], cos: vec![0.0] };
    /// let fourier = Fourier::new(5.0, vec![1], vec![swing.clone(), swing])?;
    /// let certified = plant.certify(&fourier, 0.9)?; // within 90 % of all limits?
    /// assert_eq!(certified.satisfied(), certified.broken().is_none());
    /// # Ok::<(), excite::Error>(())
    /// ```
    ///
    /// # Errors
    /// A motion of another robot, or one that leaves the reach of a closed chain.
    pub fn certify(&self, fourier: &Fourier, derate: f64) -> Result<Certified> {
        Ok(Certified {
            clearance: self.clearance(fourier)?,
            ..self.certify_limits(fourier, derate)?
        })
    }

    /// [`Plant::certify`] without a look at collisions, which takes longer.
    pub(crate) fn certify_limits(&self, fourier: &Fourier, derate: f64) -> Result<Certified> {
        let Some(mechanism) = self.mechanism() else {
            return self.certify_tree(fourier, derate);
        };
        let found = mechanism.certify(fourier, derate)?;
        Ok(Certified {
            clearance: None,
            actuators: overall(&found),
            proof: found.proof,
            mechanism: Some(found),
        })
    }

    /// Exact extrema of the series, and a bound of the torques from their curvature.
    fn certify_tree(&self, fourier: &Fourier, derate: f64) -> Result<Certified> {
        let derated;
        let robot = match derate == 1.0 {
            true => &self.robot,
            false => {
                derated = Robot {
                    joints: self
                        .robot
                        .joints
                        .iter()
                        .map(|j| j.derated(derate))
                        .collect(),
                    tool: self.robot.tool.as_ref().map(|t| t.derated(derate)),
                    ..self.robot.clone()
                };
                &derated
            }
        };
        let kinematic = certify(robot, fourier)?;
        let torque = smooth_torque_function(robot, &self.tree);
        let bounds = torque_certificate(robot, fourier, TORQUE_SAMPLES, &torque)?;
        let tool = tool_certificate(robot, fourier, TORQUE_SAMPLES)?;
        let rates = rate_certificate(robot, fourier, TORQUE_SAMPLES, &torque)?;
        Ok(Certified {
            actuators: kinematic
                .with_torque(bounds)
                .with_torque_rate(rates)
                .with_tool(tool),
            mechanism: None,
            proof: Proof::Exact,
            clearance: None,
        })
    }
}

/// The certificate of the actuators, with box and poses counted in.
fn overall(found: &MechanismCertificate) -> Certificate {
    let mut worst = found.actuators.worst.clone();
    let mut offer = |other: Option<Worst>| {
        if let Some(w) = other
            && worst.as_ref().is_none_or(|old| w.used > old.used)
        {
            worst = Some(w);
        }
    };
    offer(found.platform.worst.clone());
    for p in &found.pose {
        offer(Some(Worst {
            joint: p.name.clone(),
            kind: Kind::Pose,
            used: p.used,
        }));
    }
    Certificate {
        joints: found.actuators.joints.clone(),
        tool: None,
        satisfied: found.satisfied,
        worst,
    }
}
