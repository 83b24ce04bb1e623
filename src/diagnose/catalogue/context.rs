//! What columns of effects are computed from: the records, the nominal model as fitted, and its torques.

use super::estimate::{Estimate, Place, Quantity, Value, constant, value};
use super::leg_geometry::Deformations;
use super::{Robots, base_compliance};
use crate::diagnose::column::Column;
use crate::diagnose::data::Data;
use crate::diagnose::window::averaged;
use crate::dynamics::Samples;
use crate::mechanism::MechanismMotion;
use crate::median::median;
use crate::plant;
use crate::robot::{JointTerm, Motion, Prior};
use crate::signals::series::Series;
use rayon::prelude::*;
use std::sync::OnceLock;

/// Step of the differences by which the torque of a joint is derived, rad or m, and of its rate.
const STEP: f64 = 1e-5;

/// Torques that a drive reports, over all records.
pub(crate) struct Reported {
    /// each, as a mean
    pub torque: Vec<f64>,
    /// largest absolute value
    pub peak: f64,
    /// median of the absolute values
    pub median: f64,
}

/// State of the diagnosis that columns may depend on.
pub struct Context<'a> {
    /// the records
    pub data: &'a Data<'a>,
    /// parameters of the nominal model, as fitted
    pub phi: Vec<f64>,
    /// modelled torque by actuator, over all records
    pub model: Vec<Vec<f64>>,
    /// rigid-body part of it
    pub rigid: Vec<Vec<f64>>,
    /// largest rigid-body torque by actuator
    pub peak: Vec<f64>,
    /// column `j` of the mass matrix over all records: `mass[j][i]` is `M_ij` (serial robots)
    pub mass: Vec<Vec<Vec<f64>>>,
    /// how the torque of each joint changes with its position and velocity, once it was asked for (serial robots)
    slopes: Vec<OnceLock<[Vec<f64>; 2]>>,
    reported: Vec<OnceLock<Reported>>,
    /// what the robot exerts on its base, once it was asked for
    base: OnceLock<base_compliance::Load>,
    /// what other geometry changes, once it was asked for
    deformations: OnceLock<Option<Deformations>>,
}

impl<'a> Context<'a> {
    /// With parameters `phi` of the nominal model.
    ///
    /// # Errors
    /// Poses that cannot be reached.
    pub fn new(data: &'a Data<'a>, phi: Vec<f64>) -> crate::error::Result<Self> {
        let model = data.model_torque(&phi);
        let rigid = data.rigid_torque(&phi);
        let largest = rigid.iter().map(|r| peak(r)).collect();
        let mut mass = Vec::new();
        if Robots::Open.hold(data.plant) {
            for j in 0..data.joints() {
                let more = data.torque_of(&phi, |r, _, x| {
                    x.qdd[j * r.count..(j + 1) * r.count]
                        .iter_mut()
                        .for_each(|a| *a += 1.0);
                })?;
                let column = more
                    .iter()
                    .zip(&rigid)
                    .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect())
                    .collect();
                mass.push(column);
            }
        }
        Ok(Context {
            data,
            phi,
            model,
            rigid,
            peak: largest,
            mass,
            slopes: (0..data.joints()).map(|_| OnceLock::new()).collect(),
            reported: (0..data.joints()).map(|_| OnceLock::new()).collect(),
            base: OnceLock::new(),
            deformations: OnceLock::new(),
        })
    }

    /// How the rigid-body torque of joint `j` changes with its position and with its velocity, over all records; empty
    /// where that cannot be had.
    pub(crate) fn slopes(&self, j: usize) -> &[Vec<f64>; 2] {
        self.slopes[j].get_or_init(|| {
            [0, 1].map(|rate| {
                let side = |step: f64| {
                    self.data.torque_of(&self.phi, |r, _, x: &mut Samples| {
                        let all = if rate == 0 { &mut x.q } else { &mut x.qd };
                        all[j * r.count..(j + 1) * r.count]
                            .iter_mut()
                            .for_each(|v| *v += step);
                    })
                };
                match (side(STEP), side(-STEP)) {
                    (Ok(plus), Ok(minus)) => (plus[j].iter().zip(&minus[j]))
                        .map(|(a, b)| (a - b) / (2.0 * STEP))
                        .collect(),
                    _ => Vec::new(),
                }
            })
        })
    }

    /// Torques that a drive reports.
    pub(crate) fn reported(&self, j: usize) -> &Reported {
        self.reported[j].get_or_init(|| {
            let torque = self.data.each(|r, _| smooth(r.torque(j)));
            Reported {
                peak: peak(&torque),
                median: median(torque.iter().map(|u| u.abs())),
                torque,
            }
        })
    }

    /// What the robot exerts on its base (serial robots).
    pub(crate) fn base(&self) -> &base_compliance::Load {
        self.base.get_or_init(|| base_compliance::Load::of(self))
    }

    /// What deviations of the legs change (hexapods).
    pub(crate) fn deformations(&self) -> Option<&Deformations> {
        self.deformations
            .get_or_init(|| Deformations::of(self))
            .as_ref()
    }

    /// Every actuator by itself.
    pub fn singles(&self) -> Vec<Place> {
        (0..self.data.joints()).map(Place::Actuator).collect()
    }

    /// A term of an actuator in the nominal model.
    pub fn stated(&self, place: &Place, term: JointTerm) -> f64 {
        let plant = self.data.plant;
        plant.robot().joints[plant.actuated()[place.first()]].terms[term as usize]
    }

    /// The same where `phi` are the parameters.
    pub fn term_of(&self, place: &Place, term: JointTerm, phi: &[f64]) -> f64 {
        self.unknown(place, term)
            .map_or_else(|| self.stated(place, term), |at| phi[at])
    }

    /// Where a term of an actuator stands among the parameters of the model, if it is one.
    fn unknown(&self, place: &Place, term: JointTerm) -> Option<usize> {
        let joint = self.data.plant.actuated()[place.first()];
        let kind = plant::Column::Term { joint, term };
        self.data.parameters.iter().position(|p| p.kind == kind)
    }

    /// The whole of a term of which an effect adds a part.
    pub fn whole(&self, place: &Place, term: JointTerm, eta: &[f64]) -> f64 {
        self.stated(place, term) + eta[0]
    }

    /// Actuators whose term of this kind may be another than the nominal model has it: all of an identified model; of a rough one those
    /// of which it has no unknown, because whatever value a refit gives the others is ordinary.
    pub fn changed(&self, term: JointTerm) -> Vec<Place> {
        let identified = self.data.plant.prior() == Prior::Identified;
        let mut all = self.singles();
        all.retain(|place| identified || self.unknown(place, term).is_none());
        all
    }

    /// The whole of a term of which an effect adds a part, and what the nominal model has of it where that is not 0, under two names.
    pub fn term_values(
        &self,
        [name, before]: [&'static str; 2],
        term: JointTerm,
        e: &Estimate,
        unit: &'static str,
    ) -> Vec<Value> {
        let stated = self.stated(&e.place, term);
        let whole = value(name, self.whole(&e.place, term, &e.eta), e.std[0], unit);
        let nominal = (stated != 0.0).then(|| constant(before, stated, unit));
        [Some(whole), nominal].into_iter().flatten().collect()
    }

    /// Terms of an actuator's own joint, in the order of [`JointTerm::ALL`]: as fitted, else as the robot file has them;
    /// `None` where those of one drive act on others.
    pub fn terms(&self, j: usize) -> Option<[f64; 4]> {
        let plant = self.data.plant;
        let mut all = plant.actuators()[j].terms;
        let own = plant.actuated()[j];
        for (p, value) in self.data.parameters.iter().zip(&self.phi) {
            for (k, of) in JointTerm::ALL.into_iter().enumerate() {
                if p.kind
                    == (plant::Column::Term {
                        joint: own,
                        term: of,
                    })
                {
                    all[k] = *value;
                }
            }
        }
        (!plant.redundant()).then_some(all)
    }

    /// Kind of motion of an actuator.
    pub fn motion(&self, j: usize) -> Motion {
        self.data.plant.actuators()[j].motion
    }

    /// Name of an actuator.
    pub fn name(&self, j: usize) -> &str {
        &self.data.plant.actuators()[j].name
    }

    /// Unit of a quantity of an actuator.
    pub fn unit(&self, j: usize, quantity: Quantity) -> &'static str {
        quantity.unit(self.motion(j))
    }

    /// The largest torque that an actuator can make, where the robot file states one.
    pub fn effort(&self, j: usize) -> Option<f64> {
        let effort = self.data.plant.actuators()[j].limits.effort;
        (effort.is_finite() && effort > 0.0).then_some(effort)
    }

    /// Unit of the torque of an actuator.
    pub fn torque_unit(&self, j: usize) -> &'static str {
        self.unit(j, Quantity::Torque)
    }

    /// Smooth sign of the velocity of an actuator over all records, averaged as torque is.
    pub fn sign(&self, j: usize) -> Vec<f64> {
        self.data.dry_sign(j, self.data.lead_of_effects(j))
    }

    /// The same as dry friction of the model feels it: that of a simulator's constraint reverses before the velocity does.
    /// What comes on top is a torque of the velocity.
    pub fn dry_sign(&self, j: usize) -> Vec<f64> {
        self.data.dry_sign(j, self.data.lead)
    }

    /// Change of the rigid-body torque of all actuators when coordinate `j` moves by a small `δ`
    /// more: `∂τ/∂(q_j, q̇_j, q̈_j) (δ, δ̇, δ̈)`. `delta` gives `(δ, δ̇, δ̈)` of a record, sample by
    /// sample.
    pub fn displaced(
        &self,
        j: usize,
        delta: impl Fn(&Series, usize) -> [Vec<f64>; 3] + Sync,
    ) -> Column {
        // ways, and the step by which the torque is differentiated along each
        let of = |k: usize| {
            let way = delta(&self.data.records[k], k);
            let largest = way[0].iter().fold(1e-12f64, |m, v| m.max(v.abs()));
            (way, 1e-4 / largest)
        };
        let ways = (0..self.data.records.len()).into_par_iter().with_max_len(1);
        let ways: Vec<([Vec<f64>; 3], f64)> = ways.map(of).collect();
        let side = |sign: f64| {
            self.data.torque_of(&self.phi, |r, k, x: &mut Samples| {
                let (way, step) = &ways[k];
                let row = j * r.count..(j + 1) * r.count;
                for (to, from) in [&mut x.q, &mut x.qd, &mut x.qdd].into_iter().zip(way) {
                    for (x, v) in to[row.clone()].iter_mut().zip(from) {
                        *x += sign * step * v;
                    }
                }
            })
        };
        let (Ok(plus), Ok(minus)) = rayon::join(|| side(1.0), || side(-1.0)) else {
            return Column::default();
        };
        let rows = plus.into_iter().zip(minus).map(|(mut plus, minus)| {
            for (k, (_, step)) in ways.iter().enumerate() {
                let span = self.data.span(k);
                let both = plus[span.clone()].iter_mut().zip(&minus[span]);
                both.for_each(|(a, b)| *a = (*a - b) / (2.0 * step));
            }
            plus
        });
        prune(Column {
            rows: rows.enumerate().collect(),
        })
    }

    /// `M_ij δ̈` on the rows of all actuators for an acceleration `δ̈` of coordinate `j` given on all
    /// samples (or only on the row of `j`).
    pub fn inertial(&self, j: usize, acceleration: &[f64], own_only: bool) -> Column {
        let rows = (0..self.data.joints())
            .filter(|i| !own_only || *i == j)
            .map(|i| {
                let values = self.mass[j][i]
                    .iter()
                    .zip(acceleration)
                    .map(|(m, a)| m * a)
                    .collect();
                (i, values)
            })
            .collect();
        prune(Column { rows })
    }
}

/// Actuator forces of a closed chain whose tree has the inertial parameters `phi` (ten a body) and
/// nothing else, `Gᵀ Y_tree φ`; `None` for a serial robot and poses that cannot be reached.
pub(crate) fn closed_column(cx: &Context, phi: &[f64]) -> Option<Column> {
    projected(cx, |motion| {
        let mut gamma = vec![0.0; motion.tree.dof * motion.tree.count];
        let tree = cx.data.plant.tree();
        tree.inverse_dynamics(&mut Default::default(), phi, &motion.tree, &mut gamma);
        gamma
    })
}

/// Generalised forces of the joints of the tree, record by record, as the actuators of a closed
/// chain feel them: `Gᵀ Γ`.
pub(crate) fn projected(
    cx: &Context,
    gamma: impl Fn(&MechanismMotion) -> Vec<f64>,
) -> Option<Column> {
    let mut rows = vec![Vec::with_capacity(cx.data.rows()); cx.data.joints()];
    for r in &cx.data.records {
        let tau = cx.data.plant.projected(&r.x, &gamma)?.ok()?;
        for (row, tau) in rows.iter_mut().zip(tau.chunks_exact(r.count)) {
            row.extend(smooth(tau));
        }
    }
    Some(Column {
        rows: rows.into_iter().enumerate().collect(),
    })
}

/// Without rows that are zero throughout.
pub(crate) fn prune(mut column: Column) -> Column {
    column
        .rows
        .retain(|(_, v)| v.iter().any(|x| x.abs() > 1e-12));
    column
}

/// Average as torque is measured.
pub(crate) fn smooth(x: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; x.len()];
    averaged(x, &mut out);
    out
}

/// Largest absolute value, but at least 1e-9: it may be divided by.
pub(crate) fn peak(x: &[f64]) -> f64 {
    x.iter().fold(1e-9, |m, v| m.max(v.abs()))
}

/// What was made for a key last.
pub(crate) struct Last<K, V>(Option<(K, V)>);

impl<K: PartialEq, V> Last<K, V> {
    /// Nothing yet.
    pub fn none() -> Self {
        Last(None)
    }

    /// That of a key, made where the last one was another.
    pub fn of(&mut self, key: K, make: impl FnOnce() -> V) -> &V {
        let known = self.0.take().filter(|l| l.0 == key);
        &self.0.insert(known.unwrap_or_else(|| (key, make()))).1
    }
}

/// `count` numbers from `a` to `b` in equal ratios.
pub(crate) fn ladder(a: f64, b: f64, count: usize) -> Vec<f64> {
    (0..count)
        .map(|i| a * (b / a).powf(i as f64 / (count - 1) as f64))
        .collect()
}
