//! What a reader should doubt in an identified model: that it predicts worse than the nominal one, parameters that
//! no such robot has, columns that the data ask for.

use super::identification::Identification;
use super::trace::Trace;
use crate::error::{Warning, WarningKind};
use crate::log::Purpose;
use crate::plant::Plant;
use crate::report::format::{percent, significant};
use crate::robot::{JointTerm, Motion};

/// How many times more, or less, a link may weigh than the robot file says before that is worth a word.
const MASS: f64 = 1.5;
/// Standard deviations by which the data must insist on it.
const INSIST: f64 = 3.0;
/// Share of what a model leaves of a joint that goes with its acceleration, from which on the inertia of its rotor is
/// proposed.
const ARMATURE: f64 = 0.1;
/// Part of gravity that must turn a joint for it to carry weight.
const CARRIES: f64 = 0.05;

/// Everything doubtful.
pub fn doubts(plant: &Plant, id: &Identification) -> Vec<Warning> {
    let mut out: Vec<Warning> = worse(id).into_iter().collect();
    out.extend(masses(plant, id));
    out.extend(missing(plant, &id.validation.traces));
    out
}

/// Whether the model predicts motion that was not fitted worse than the nominal one does.
pub fn predicts_worse(id: &Identification) -> Option<[f64; 2]> {
    let held = id.validation.holdout.as_ref()?.relative_error;
    let nominal = id.validation.nominal.1?;
    (held > nominal).then_some([held, nominal])
}

fn worse(id: &Identification) -> Option<Warning> {
    let [held, nominal] = predicts_worse(id)?;
    Some(worse_than_nominal(held, nominal))
}

/// What is said of a model with a larger relative error on motion that was not fitted than the nominal one.
pub fn worse_than_nominal(held: f64, nominal: f64) -> Warning {
    Warning::new(
        WarningKind::WorseThanNominal,
        "validation",
        format!(
            "the identified model predicts worse than the nominal model: it leaves {} of the torque of motion that was not \
             fitted, the nominal one {}; keep the nominal model, or record motion that excites more",
            percent(held),
            percent(nominal)
        ),
    )
}

/// Links whose mass is not what such a robot has.
fn masses(plant: &Plant, id: &Identification) -> Vec<Warning> {
    let fitted = plant.with_values(&id.phi);
    let bodies = plant.robot().bodies.iter().zip(&fitted.bodies).enumerate();
    let odd = bodies.filter_map(|(b, (nominal, now))| {
        let (before, after) = (nominal.inertia.mass(), now.inertia.mass());
        let far = before > 0.0 && (after > MASS * before || MASS * after < before);
        far.then_some((b, before, after))
    });
    odd.map(|(b, before, after)| {
        let kind = crate::robot::Column::Inertial { body: b, k: 0 };
        let at = plant.parameters().iter().position(|p| p.kind == kind);
        let std = at.map_or(f64::INFINITY, |i| id.phi_std[i]);
        let certain = (after - before).abs() > INSIST * std;
        let remedy = match (certain, carrying(plant, b)) {
            (false, _) => format!(
                "the data do not fix it (± {} kg at 95 %): a stronger prior keeps it near the file (--prior 4)",
                significant(1.96 * std, 2)
            ),
            (true, Some(joint)) => format!(
                "a gas spring, a counterweight or another counterbalance on {joint}, which carries weight, would look like \
                 this, and so would a wrong torque constant"
            ),
            (true, None) => "a wrong torque constant or gear ratio would look like this".into(),
        };
        Warning::new(
            WarningKind::ParameterImplausible,
            plant.robot().bodies[b].name.clone(),
            format!(
                "its identified mass is {} kg, where the robot file says {} kg; {remedy}",
                significant(after, 3),
                significant(before, 3)
            ),
        )
    })
    .collect()
}

/// The nearest joint towards the base that carries weight: its axis is not vertical in the resting posture of the file.
fn carrying(plant: &Plant, body: usize) -> Option<String> {
    let robot = plant.robot();
    let gravity = robot.gravity;
    if gravity.norm() == 0.0 || plant.driver(body).is_none() {
        return None;
    }
    let down = gravity / gravity.norm();
    // axes in base axes with all joints at zero
    let axis = |b: usize| {
        let (mut axis, mut at) = (robot.bodies[b].axis, Some(b));
        while let Some(i) = at {
            axis = robot.bodies[i].rotation * axis;
            at = robot.bodies[i].parent;
        }
        axis
    };
    let mut at = Some(body);
    while let Some(b) = at {
        let joint = &robot.joints[robot.bodies[b].coordinate];
        let along = axis(b).dot(&down).abs();
        let carries = match joint.motion {
            Motion::Revolute => along < 1.0 - CARRIES,
            Motion::Prismatic => along > CARRIES,
        };
        if carries {
            return Some(joint.name.clone());
        }
        at = robot.bodies[b].parent;
    }
    None
}

/// Joints without an unknown rotor whose residual goes with their acceleration.
fn missing(plant: &Plant, traces: &[Trace]) -> Vec<Warning> {
    let armature = JointTerm::Armature as usize;
    let joints = plant.actuators();
    // the inertia of a rotor cannot be told from that of legs which other drives move, too
    let bodies = 0..plant.robot().bodies.len();
    let alone: Vec<usize> = bodies.filter_map(|b| plant.driver(b)).collect();
    let moves = |a: &usize| alone.contains(&plant.actuated()[*a]);
    let without = (0..joints.len()).filter(|a| !joints[*a].identify[armature]);
    without
        .filter(moves)
        .filter_map(|a| {
            let share = goes_with_acceleration(traces, a)?;
            (share > ARMATURE).then(|| {
                Warning::new(
                    WarningKind::ColumnProposed,
                    joints[a].name.clone(),
                    format!(
                        "{} of what the model leaves of its torque goes with its acceleration, which no unknown of the model \
                         stands for: add \"armature\" to its `identify` (or --identify armature,viscous,coulomb,offset)",
                        percent(share)
                    ),
                )
            })
        })
        .collect()
}

/// Share of the residual of an actuator that is proportional to its acceleration, on the fit records.
fn goes_with_acceleration(traces: &[Trace], a: usize) -> Option<f64> {
    let [mut ae, mut aa, mut ee] = [0.0; 3];
    for t in traces.iter().filter(|t| t.purpose == Purpose::Fit) {
        let n = t.time.len();
        let at = |i: usize| a * n + i;
        for i in 1..n.saturating_sub(1) {
            let acceleration = 0.5 * t.rate * (t.velocity[at(i + 1)] - t.velocity[at(i - 1)]);
            let e = t.measured[at(i)] - t.predicted[at(i)];
            ae += acceleration * e;
            aa += acceleration * acceleration;
            ee += e * e;
        }
    }
    (aa > 0.0 && ee > 0.0).then(|| ae * ae / (aa * ee))
}
