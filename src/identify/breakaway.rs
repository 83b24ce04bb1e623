//! Breakaway friction of the drives, from slow and fast parts of the records together.
//!
//! ```text
//! τ = W π + Σ_a F_a s_a(v_a)        s_a = exp(−(q̇_a/v_a)²) sign(q̇_a)
//! ```
//!
//! is linear in all but the speeds `v_a`. The others are projected out (Golub & Pereyra 1973): with the weighted rows
//! `W = Q R` and `P = 1 − Q Qᵀ`, the speed of one drive explains `(s · r)²/(s · P s)` of what the others leave, `r`. Drives
//! take turns until nothing changes. A drive keeps its term where that explains more than chance would (BIC), and against
//! the motion. The covariance is that of `F` and `v` with all columns free; what it makes of the other parameters,
//! `R⁻¹ Qᵀ J C Jᵀ Q R⁻ᵀ`, is added to theirs.
//!
//! **Near standstill** a drive that sticks follows no function of its speed. So all is fitted once more without the rows in
//! which a drive is slower than half of its `v_a`. By how much more the two fits differ than their covariances lead to
//! expect, `δ² − (C' − C)` (Hausman 1978), is model error, and is added to `C`.

mod turn;

use super::equations::{self, Equations};
use super::{Identification, Settings};
use crate::error::{Error, Result, Warning, WarningKind};
use crate::log::Record;
use crate::plant::Plant;
use crate::report::format::unit_of;
use crate::robot::{JointTerm, Stribeck};
use crate::trajectory::certificate::Kind;
use faer::Mat;
pub use turn::Breakaway;
use turn::{Rows, Turn, sticking};

/// A value of a drive, as reports state it.
pub(super) struct Value {
    pub name: String,
    pub value: f64,
    pub std: f64,
    pub nominal: f64,
    pub unit: &'static str,
}

/// Forces and speeds that were found, with those of the robot file.
pub(super) fn values(plant: &Plant, id: &Identification) -> Vec<Value> {
    let joints = plant.actuators();
    let each = id.breakaway.iter().flat_map(|b| {
        let joint = joints[b.actuator];
        let units = [Kind::Torque, Kind::Velocity].map(|kind| unit_of(kind, joint.motion));
        let value = |name: &str, value, std, nominal, unit| Value {
            name: format!("{}.{name}", joint.name),
            value,
            std,
            nominal,
            unit,
        };
        let own = joint.stribeck;
        [
            value("stribeck", b.force, b.force_std, own.force, units[0]),
            value(
                "stribeck_velocity",
                b.velocity,
                b.velocity_std,
                own.velocity,
                units[1],
            ),
        ]
    });
    each.collect()
}

/// Rounds in which the weights follow the residuals.
const ROUNDS: usize = 3;

/// What is found before all else is identified.
pub(super) struct Found {
    /// drives whose term is kept
    pub all: Vec<Breakaway>,
    /// what it makes of the covariance of the base parameters
    pub covariance: Mat<f64>,
    /// drives of which nothing was found
    pub warnings: Vec<Warning>,
}

/// Actuators whose breakaway friction is asked for.
pub(super) fn asked(plant: &Plant) -> Vec<usize> {
    let joints = plant.actuators();
    (0..joints.len())
        .filter(|&a| joints[a].stribeck.fit)
        .collect()
}

/// The plant with this breakaway friction where it was asked for, and none where it was not found.
pub(super) fn with(plant: &Plant, found: &[Breakaway]) -> Plant {
    let all: Vec<(usize, Stribeck)> = asked(plant)
        .into_iter()
        .map(|a| {
            let own = found.iter().find(|b| b.actuator == a);
            let usual = Stribeck::default();
            let stribeck = Stribeck {
                force: own.map_or(0.0, |b| b.force),
                velocity: own.map_or(usual.velocity, |b| b.velocity),
                fit: true,
            };
            (a, stribeck)
        })
        .collect();
    plant.with_stribeck(&all)
}

/// Finds it.
///
/// # Errors
/// As [`super::identify`]; a drive whose Coulomb friction is no unknown.
pub(super) fn find(plant: &Plant, records: &[Record], settings: &Settings) -> Result<Found> {
    let wanted = asked(plant);
    for &a in &wanted {
        let joint = plant.actuators()[a];
        if !joint.identify[JointTerm::Coulomb as usize] {
            return Err(Error::Argument(format!(
                "{}: stribeck can only be identified beside coulomb; list both",
                joint.name
            )));
        }
    }
    let plant = &with(plant, &[]);
    let records = equations::usable(records, &mut Vec::new())?;
    let settings = equations::one_filter(&records, settings);
    let base = plant.base()?;
    let equations = Equations::new(plant, &base, &settings.signals, records)?;
    let fit = equations.fit()?;
    let (na, b) = (plant.actuated().len(), base.count());
    let speed = fit
        .prepared
        .iter()
        .map(|p| Ok(plant.actuator_motion(&p.motion)?.qd))
        .collect::<Result<Vec<_>>>()?;
    let fastest = (0..na)
        .map(|a| {
            let own = speed.iter().flat_map(|s| {
                let n = s.len() / na;
                s[a * n..(a + 1) * n].iter()
            });
            own.fold(0.0f64, |m, v| m.max(v.abs()))
        })
        .collect();
    let stacks = fit.stacks();
    let rows: usize = stacks.iter().map(|s| s.measured.len()).sum();
    let mut all = Rows {
        prepared: fit.prepared.clone(),
        speed,
        fastest,
        actuators: na,
        of: Vec::with_capacity(rows),
        w: Mat::zeros(rows, b),
        y: Vec::with_capacity(rows),
    };
    for s in &stacks {
        for i in 0..s.measured.len() {
            let row = all.y.len();
            let out = s.left_out.get(i).copied().unwrap_or(false);
            all.of.push((!out).then_some(i / s.count));
            all.y
                .push(if out { 0.0 } else { s.measured[i] - s.known[i] });
            for c in 0..b {
                all.w[(row, c)] = if out { 0.0 } else { s.w[(i, c)] };
            }
        }
    }
    let mut sigma = plant.torque_noise().0;
    let mut state: Vec<Option<(f64, f64)>> = vec![None; na];
    let mut last = None;
    for _ in 0..ROUNDS {
        let turn = Turn::new(&all, &sigma);
        turn.go(&wanted, &mut state);
        sigma = turn.spreads(&state);
        last = Some(turn);
    }
    let Some(turn) = last else {
        return Err(Error::Infeasible("no round was made".into()));
    };
    let (mut found, mut c) = turn.terms(&state);
    let moving = all.moving(&state);
    let other = Turn::new(&moving, &sigma);
    let mut elsewhere = state.clone();
    other.go(&wanted, &mut elsewhere);
    sticking(&mut found, &mut c, &other.terms(&elsewhere).0);
    let covariance = turn.carried(&state, &c);
    let missing = wanted.iter().filter(|a| state[**a].is_none());
    Ok(Found {
        warnings: missing
            .map(|&a| {
                Warning::new(
                    WarningKind::NotIdentifiable,
                    plant.actuators()[a].name.clone(),
                    "no breakaway friction shows in its residuals, and none is in the model: record slow parts beside fast ones",
                )
            })
            .collect(),
        all: found,
        covariance,
    })
}

impl Found {
    /// Carries it into what was identified with it: standard deviations, correlation in time included, and warnings.
    pub(super) fn carry(self, plant: &Plant, id: &mut Identification) {
        let root = id.inflation.sqrt();
        id.breakaway = self.all;
        for b in &mut id.breakaway {
            b.force_std *= root;
            b.velocity_std *= root;
        }
        let finite = (0..self.covariance.nrows()).all(|k| self.covariance[(k, k)].is_finite());
        if finite && self.covariance.nrows() == id.base.count() {
            id.covariance += &self.covariance * id.inflation;
            for a in 0..id.base.count() {
                id.std[a] = id.covariance[(a, a)].max(0.0).sqrt();
                let kept = id.base.kept[a];
                if matches!(
                    plant.parameters()[kept].kind,
                    crate::robot::Column::Term { .. }
                ) {
                    let more = self.covariance[(a, a)].max(0.0) * id.inflation;
                    id.phi_std[kept] = (id.phi_std[kept].powi(2) + more).sqrt();
                }
            }
        }
        id.warnings.extend(self.warnings);
        for b in id.breakaway.iter().filter(|b| !b.determined()) {
            id.warnings.push(Warning::new(
                WarningKind::NotIdentifiable,
                plant.actuators()[b.actuator].name.clone(),
                "force and speed of its breakaway friction are not determined: they are not known to half of themselves (95 %). Record a \
                 motion that stays longer at and below this speed without coming to rest",
            ));
        }
    }
}
