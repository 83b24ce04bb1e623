//! Unknowns of a closed chain, and how they combine the columns of the bodies.
//!
//! A parameter `φ_p` is a sum of raw columns: one of the ten of a body as it stands, the common
//! `Ixx = Iyy` of a body of revolution, or one and the same parameter of six identical legs. With
//! `E` (raw columns × parameters): `Y = Y_raw E`, `φ_raw = E φ`.

use crate::error::{Warning, WarningKind};
use crate::robot::{Column, JointTerm, Parameter, Robot, inertia};

/// Which of the ten parameters of a body are unknowns.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Pattern {
    /// all ten
    Full,
    /// a body of revolution about its `z` axis: `m, mz, Ixx = Iyy, Izz`
    Axisymmetric,
    /// the same with a free spin: `m, mz, Ixx = Iyy`
    NoSpin,
    /// these of the ten; the others are zero
    Only(Vec<usize>),
}

impl Pattern {
    /// The parameters, as lists of those of the ten that are equal.
    fn parts(&self) -> Vec<Vec<usize>> {
        match self {
            Pattern::Full => (0..10).map(|k| vec![k]).collect(),
            Pattern::Axisymmetric => vec![vec![0], vec![3], vec![4, 7], vec![9]],
            Pattern::NoSpin => vec![vec![0], vec![3], vec![4, 7]],
            Pattern::Only(list) => list.iter().map(|&k| vec![k]).collect(),
        }
    }
}

/// Bodies that have the same parameters.
#[derive(Debug, Clone)]
pub struct Group {
    /// what its parameters are called: `rod`, `rod3`
    pub name: String,
    /// indices into [`Robot::bodies`]
    pub bodies: Vec<usize>,
    /// which parameters
    pub pattern: Pattern,
}

impl Group {
    /// One body on its own.
    pub fn one(name: &str, body: usize, pattern: Pattern) -> Self {
        Group::shared(name, &[body], pattern)
    }

    /// Several bodies with common parameters.
    pub fn shared(name: &str, bodies: &[usize], pattern: Pattern) -> Self {
        Group {
            name: name.into(),
            bodies: bodies.to_vec(),
            pattern,
        }
    }
}

/// All unknowns of a mechanism.
#[derive(Debug, Clone)]
pub struct Parameters {
    /// bodies with columns, in their order: body `bodies[b]` has raw columns `10·b ..`
    pub bodies: Vec<usize>,
    /// terms, in the order of the raw columns that follow those of the bodies
    pub terms: Vec<(usize, JointTerm)>,
    /// the unknowns
    pub list: Vec<Parameter>,
    /// whether they are the raw columns as they stand
    pub plain: bool,
}

impl Parameters {
    /// The unknowns of `groups` and of the joint terms that the robot asks for. The nominal inertia
    /// of the robot's bodies becomes that of the model: means over bodies that share, zero where
    /// the pattern has no parameter; changes are reported.
    pub fn new(robot: &mut Robot, groups: &[Group]) -> (Self, Vec<Warning>) {
        let mut warnings = Vec::new();
        let mut bodies: Vec<usize> = groups.iter().flat_map(|g| g.bodies.clone()).collect();
        bodies.sort_unstable();
        bodies.dedup();
        let mut list = Vec::new();
        let mut plain = true;
        for group in groups {
            let before: Vec<_> = group
                .bodies
                .iter()
                .map(|&b| robot.bodies[b].inertia)
                .collect();
            let mut after = vec![crate::robot::Inertia::default(); before.len()];
            for part in group.pattern.parts() {
                let mut sum = 0.0;
                let mut raw = Vec::new();
                for (i, body) in group.bodies.iter().enumerate() {
                    for &k in &part {
                        sum += before[i].0[k];
                        let b = bodies.binary_search(body).unwrap_or_default();
                        raw.push(10 * b + k);
                    }
                }
                let value = sum / raw.len() as f64;
                for a in &mut after {
                    part.iter().for_each(|&k| a.0[k] = value);
                }
                plain &= raw.len() == 1;
                list.push(Parameter {
                    name: format!("{}.{}", group.name, inertia::NAMES[part[0]]),
                    unit: inertia::UNITS[part[0]],
                    value,
                    kind: match group.bodies.first() {
                        Some(&body) => Column::Inertial { body, k: part[0] },
                        None => Column::Nuisance,
                    },
                    raw,
                });
            }
            plain &= group.pattern == Pattern::Full;
            for (i, &body) in group.bodies.iter().enumerate() {
                let size = before[i].0.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                let off =
                    (0..10).fold(0.0f64, |m, k| m.max((before[i].0[k] - after[i].0[k]).abs()));
                if off > 1e-9 * size {
                    warnings.push(Warning::new(WarningKind::InertiaChanged,
                        robot.bodies[body].name.clone(),
                        format!(
                            "its inertia does not fit what the file says of it (shared by identical \
                             legs, a body of revolution, or left out): changed by up to {off:.3e}"
                        ),
                    ));
                }
                robot.bodies[body].inertia = after[i];
            }
        }
        // in raw order, so that `plain` means that nothing has to be gathered
        if plain {
            list.sort_by_key(|p| p.raw[0]);
            plain = list.iter().enumerate().all(|(i, p)| p.raw == [i]);
        }
        let mut parameters = Parameters {
            bodies,
            terms: Vec::new(),
            list,
            plain,
        };
        parameters.set_terms(robot);
        (parameters, warnings)
    }

    /// Makes the joint terms that the robot asks for the unknowns after those of the bodies.
    pub fn set_terms(&mut self, robot: &Robot) {
        let bodies = 10 * self.bodies.len();
        self.list
            .retain(|p| p.raw.first().is_none_or(|&r| r < bodies));
        self.terms.clear();
        for (j, joint) in robot.joints.iter().enumerate() {
            for (term, wanted) in JointTerm::ALL.into_iter().zip(joint.identify) {
                if wanted {
                    self.list.push(Parameter {
                        name: format!("{}.{}", joint.name, term.name()),
                        unit: term.unit(joint.motion),
                        value: joint.terms[term as usize],
                        kind: Column::Term { joint: j, term },
                        raw: vec![bodies + self.terms.len()],
                    });
                    self.terms.push((j, term));
                }
            }
        }
    }

    /// Number of raw columns.
    pub fn raw_count(&self) -> usize {
        10 * self.bodies.len() + self.terms.len()
    }

    /// Meaning of a raw column.
    pub fn raw(&self, column: usize) -> Option<Column> {
        match column.checked_sub(10 * self.bodies.len()) {
            None => Some(Column::Inertial {
                body: self.bodies[column / 10],
                k: column % 10,
            }),
            Some(t) => {
                let &(joint, term) = self.terms.get(t)?;
                Some(Column::Term { joint, term })
            }
        }
    }

    /// `φ_raw = E φ`.
    ///
    /// # Panics
    /// If `phi` has not one number for each parameter.
    pub fn expand(&self, phi: &[f64]) -> Vec<f64> {
        assert_eq!(phi.len(), self.list.len(), "one number for each parameter");
        let mut raw = vec![0.0; self.raw_count()];
        for (p, x) in self.list.iter().zip(phi) {
            p.raw.iter().for_each(|&r| raw[r] += x);
        }
        raw
    }

    /// `Eᵀ g`: derivatives by the parameters from derivatives by the raw columns.
    pub fn gather(&self, raw: &[f64]) -> Vec<f64> {
        self.list
            .iter()
            .map(|p| p.raw.iter().map(|&r| raw[r]).sum())
            .collect()
    }

    /// Nominal values.
    pub fn values(&self) -> Vec<f64> {
        self.list.iter().map(|p| p.value).collect()
    }
}
