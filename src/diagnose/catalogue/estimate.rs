//! An effect as data: where it is, which shape it has, and how large it is.

use crate::robot::Motion;
use std::ops::Index;

/// Where an effect sits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Place {
    /// on the whole robot
    Robot,
    /// on one actuator (the body that it moves)
    Actuator(usize),
    /// on two actuators
    Pair(usize, usize),
}

impl Place {
    /// The actuators that it names; none for the whole robot.
    pub fn named(&self) -> Vec<usize> {
        match *self {
            Place::Robot => Vec::new(),
            Place::Actuator(j) => vec![j],
            Place::Pair(j, k) => vec![j, k],
        }
    }

    /// The actuators on whose rows it acts most, of `count`.
    pub fn actuators(&self, count: usize) -> Vec<usize> {
        match self {
            Place::Robot => (0..count).collect(),
            _ => self.named(),
        }
    }

    /// The first actuator that it names; 0 for the whole robot.
    pub fn first(&self) -> usize {
        self.named().first().copied().unwrap_or(0)
    }

    /// Whether it acts on the rows of an actuator.
    pub fn includes(&self, j: usize) -> bool {
        *self == Place::Robot || self.named().contains(&j)
    }

    /// Whether both name the same actuator.
    pub fn meets(&self, other: &Place) -> bool {
        let theirs = other.named();
        self.named().iter().any(|j| theirs.contains(j))
    }
}

/// What does not enter linearly: a form among those of the effect, and its constants.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Shape {
    /// which of the forms of the effect, from 0
    pub form: u8,
    /// constants, with the meaning that the form gives them
    pub constants: Vec<f64>,
}

impl Shape {
    /// A form with constants.
    pub fn new(form: u8, constants: &[f64]) -> Self {
        Shape {
            form,
            constants: constants.to_vec(),
        }
    }

    /// Constants of an effect with one form.
    pub fn of(constants: &[f64]) -> Self {
        Shape::new(0, constants)
    }
}

impl Index<usize> for Shape {
    type Output = f64;
    fn index(&self, k: usize) -> &f64 {
        &self.constants[k]
    }
}

/// An effect as it was fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// where
    pub place: Place,
    /// which shape
    pub shape: Shape,
    /// coefficients of the columns
    pub eta: Vec<f64>,
    /// their standard deviations
    pub std: Vec<f64>,
}

/// One number of an effect.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct Value {
    /// name
    pub name: &'static str,
    /// value
    pub value: f64,
    /// standard deviation; `None` for shape constants taken from a grid
    pub std: Option<f64>,
    /// SI unit
    pub unit: &'static str,
}

impl Value {
    /// Whether it is a mass that may as well be none (95 %).
    pub fn is_unknown_mass(&self) -> bool {
        self.name == "mass" && self.std.is_some_and(|s| 1.96 * s > self.value)
    }

    /// `name = value unit`.
    pub fn line(&self) -> String {
        let line = format!("{} = {:.6} {}", self.name, self.value, self.unit);
        line.trim_end().to_string()
    }
}

/// What is measured at an actuator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// angle or way
    Position,
    /// its rate
    Speed,
    /// torque or force
    Torque,
    /// torque per angle
    Stiffness,
    /// torque per speed
    Damping,
    /// torque per acceleration
    Inertia,
    /// angle of a wave per angle
    Order,
}

impl Quantity {
    /// SI unit at an actuator of this kind of motion.
    pub fn unit(self, motion: Motion) -> &'static str {
        let [turning, sliding] = match self {
            Quantity::Position => ["rad", "m"],
            Quantity::Speed => ["rad/s", "m/s"],
            Quantity::Torque => ["N m", "N"],
            Quantity::Stiffness => ["N m/rad", "N/m"],
            Quantity::Damping => ["N m s/rad", "N s/m"],
            Quantity::Inertia => ["kg m^2", "kg"],
            Quantity::Order => ["rad/rad", "rad/m"],
        };
        match motion {
            Motion::Revolute => turning,
            Motion::Prismatic => sliding,
        }
    }
}

/// A linear coefficient.
pub(crate) fn value(name: &'static str, value: f64, std: f64, unit: &'static str) -> Value {
    Value {
        name,
        value,
        std: Some(std),
        unit,
    }
}

/// A shape constant.
pub(crate) fn constant(name: &'static str, value: f64, unit: &'static str) -> Value {
    Value {
        name,
        value,
        std: None,
        unit,
    }
}
