//! How well a motion will tell what it was designed for: the platform, the legs, the friction of the drives.
//!
//! One record of the motion, evaluated with `excite identify`; white noise of the robot file. Friction and constants of all
//! drives are estimated along, breakaway friction where the file states it.

use super::columns::{Columns, Kind};
use super::spread::{Felt, spread};
use crate::design::Question;
use crate::design::question::{of_legs, with_friction};
use crate::error::{Error, Result};
use crate::plant::Plant;
use crate::report::format::unit_of;
use crate::robot::{Column, JointTerm};
use crate::trajectory::certificate::Kind as Limited;
use crate::trajectory::{Trajectory, sample_period};
use faer::Mat;

/// Names and units of mass, centre of mass and tensor about it.
const QUANTITIES: [(&str, &str); 10] = [
    ("mass", "kg"),
    ("com.x", "m"),
    ("com.y", "m"),
    ("com.z", "m"),
    ("inertia_com.xx", "kg m²"),
    ("inertia_com.xy", "kg m²"),
    ("inertia_com.xz", "kg m²"),
    ("inertia_com.yy", "kg m²"),
    ("inertia_com.yz", "kg m²"),
    ("inertia_com.zz", "kg m²"),
];

/// One value that was asked for.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Expected {
    /// its name; of a group of parameters the one that stands for it
    pub name: String,
    /// in the robot file
    pub value: f64,
    /// expected standard deviation; `None` where the motion does not tell it
    pub std: Option<f64>,
    /// unit of both
    pub unit: String,
}

/// How well a motion tells what it was designed for.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Answer {
    /// what was asked for
    pub question: Question,
    /// length of the record, s
    pub seconds: f64,
    /// the values
    pub expected: Vec<Expected>,
}

impl Answer {
    /// Along a trajectory of this plant; `None` for a load, which takes two records
    /// ([`LoadAccuracy`](super::LoadAccuracy)).
    ///
    /// # Errors
    /// A question that this plant cannot be asked; a motion that it cannot make.
    pub fn of(plant: &Plant, trajectory: &Trajectory, question: Question) -> Result<Option<Self>> {
        let plant = &plant.clone().in_space(trajectory.space)?;
        question.check(plant)?;
        let expected = match question {
            Question::Load => return Ok(None),
            Question::Platform => platform(plant, trajectory)?,
            Question::Legs => parameters(plant, trajectory, question)?,
            Question::Friction => parameters(&with_friction(plant), trajectory, question)?,
        };
        Ok(Some(Answer {
            question,
            seconds: trajectory.duration(),
            expected,
        }))
    }

    /// How many values will be known to so many percent (95 %), of how many that are not zero in the file.
    pub fn known(&self, percent: f64) -> (usize, usize) {
        let judged = || self.expected.iter().filter(|e| e.value != 0.0);
        let good = |e: &&Expected| {
            e.std
                .is_some_and(|s| 1.96 * s <= 0.01 * percent * e.value.abs())
        };
        (judged().filter(good).count(), judged().count())
    }
}

/// Mass, centre of mass and tensor of the platform.
fn platform(plant: &Plant, trajectory: &Trajectory) -> Result<Vec<Expected>> {
    let Some(tool) = plant.tool() else {
        return Err(Error::Infeasible(format!(
            "{}: it has no platform",
            plant.name()
        )));
    };
    let felt = Felt::of(plant, tool)?;
    let motion = sample_period(&trajectory.fourier);
    let ten = felt.columns(plant, tool, &motion)?;
    let columns = Columns::new(plant, ten.as_ref(), &motion, true)?;
    let covariance = columns.covariance(true, f64::from(trajectory.periods));
    let own = plant.robot().bodies[tool].inertia;
    let values = own.quantities();
    let stds = spread(covariance.as_ref(), &felt, &own);
    let each = QUANTITIES.iter().zip(values).zip(stds);
    Ok(each
        .map(|(((name, unit), value), std)| Expected {
            name: format!("platform.{name}"),
            value,
            std,
            unit: (*unit).into(),
        })
        .collect())
}

/// Base parameters of the legs, or friction of the drives.
fn parameters(plant: &Plant, trajectory: &Trajectory, question: Question) -> Result<Vec<Expected>> {
    let base = plant.base()?;
    let motion = sample_period(&trajectory.fourier);
    let all = base.select(plant.regressor(&motion)?.as_ref());
    let drive = |k: usize| match plant.parameters()[base.kept[k]].kind {
        Column::Term { joint, term } => JointTerm::FRICTION
            .contains(&term)
            .then(|| plant.actuated().iter().position(|&j| j == joint))
            .flatten()
            .map(|a| (a, term)),
        Column::Inertial { .. } | Column::Nuisance => None,
    };
    // friction of the drives has columns of its own
    let bodies: Vec<usize> = (0..base.count()).filter(|&k| drive(k).is_none()).collect();
    let w = Mat::from_fn(all.nrows(), bodies.len(), |r, c| all[(r, bodies[c])]);
    let columns = Columns::new(plant, w.as_ref(), &motion, true)?;
    let covariance = columns.covariance(true, f64::from(trajectory.periods));
    let std = |c: usize| {
        let variance = covariance.as_ref()?[(c, c)];
        variance.is_finite().then(|| variance.max(0.0).sqrt())
    };
    let nominal = base.project(&plant.values());
    if question == Question::Legs {
        let own = bodies.iter().enumerate().filter(|(_, k)| {
            let kind = plant.parameters()[base.kept[**k]].kind;
            of_legs(plant, kind)
        });
        return Ok(own
            .map(|(c, &k)| Expected {
                name: base.combination(k),
                value: nominal[k],
                std: std(c),
                unit: base.units[base.kept[k]].to_string(),
            })
            .collect());
    }
    let joints = plant.actuators();
    let each = columns.drives.iter().enumerate().map(|(d, (a, kind))| {
        let joint = joints[*a];
        let own = |term: JointTerm| joint.terms[term as usize];
        let (name, value, unit) = match kind {
            Kind::Term(term) => (term.name(), own(*term), term.unit(joint.motion)),
            Kind::Force => (
                "stribeck",
                joint.stribeck.force,
                JointTerm::Coulomb.unit(joint.motion),
            ),
            Kind::Speed => (
                "stribeck_velocity",
                joint.stribeck.velocity,
                unit_of(Limited::Velocity, joint.motion),
            ),
        };
        Expected {
            name: format!("{}.{name}", joint.name),
            value,
            std: std(columns.bodies + d),
            unit: unit.into(),
        }
    });
    Ok(each.collect())
}
