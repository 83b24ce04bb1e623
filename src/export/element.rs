//! What a machine has beside the values of its bodies and joints, as a simulator can hold it.
//!
//! An effect says itself what it is ([`Effect::element`](crate::diagnose::catalogue::Effect::element)); a format
//! says which of these it has ([`Format::element`](super::Format::element)). What no format has an element for is a
//! [`Function`], which `effects.py` holds.

use crate::robot::Inertia;

/// Name of the file of functions.
pub const FUNCTIONS: &str = "effects.py";

/// A part of a machine. Joints are coordinates of [`Robot::joints`](crate::Robot::joints); torques are those that
/// the drive has to make. Joints of a closed chain are its drives.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Element {
    /// drag `factor |q̇|^power sgn q̇`
    Drag {
        /// coordinate
        joint: usize,
        /// 2 or 3
        power: u8,
        /// N m (s/rad)^power or N (s/m)^power
        factor: f64,
    },
    /// torque `Σ c_k q^k` of a spring
    Spring {
        /// coordinate
        joint: usize,
        /// from the constant to the third power, N m/rad^k or N/m^k
        coefficients: [f64; 4],
    },
    /// friction and inertia of `q_a + ratio q_b`, which both joints turn
    Coupling {
        /// coordinates `a` and `b`
        joints: [usize; 2],
        /// `ratio`
        ratio: f64,
        /// Coulomb friction, N m or N
        coulomb: f64,
        /// viscous friction, N m s/rad or N s/m
        viscous: f64,
        /// inertia, kg m² or kg
        inertia: f64,
    },
    /// a drive that reports `1 + error` times the torque that it makes
    Gain {
        /// coordinate
        joint: usize,
        /// `error`
        error: f64,
    },
    /// drives that report `τ(t − seconds)`; below zero they are told before they act
    Delay {
        /// coordinates
        joints: Vec<usize>,
        /// s
        seconds: f64,
    },
    /// the link behind a spring: it stands at `q + δ`
    Twist {
        /// coordinate
        joint: usize,
        /// N m/rad or N/m
        stiffness: f64,
        /// part of the torque `k₃ δ³`, N m/rad³ or N/m³
        cubic: f64,
        /// N m s/rad or N s/m
        damping: f64,
        /// way between the flanks, rad or m; 0 for none
        gap: f64,
    },
    /// a base that tilts about its x and y on springs
    Base {
        /// N m/rad
        stiffness: [f64; 2],
        /// N m s/rad
        damping: [f64; 2],
        /// inertia of the base itself, kg m²
        inertia: [f64; 2],
    },
    /// a body that hangs on another one, in whose inertia it is contained
    Load {
        /// index of the body
        body: usize,
        /// in and about its frame
        inertia: Inertia,
    },
    /// anything else
    Function(Function),
}

/// How a simulator holds something.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    /// by its own elements
    Native,
    /// by a function that it calls
    Callback,
    /// not at all
    None,
}

/// What a [`Function`] gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// `(q, dq, load, xp)` → level of dry friction and other torque, N m or N
    Torque,
    /// the same from `(q, dq, load, dt, memory, xp)`, with the next memory
    Memory,
    /// `(q, dq, ddq, xp)` → way of the joint beyond what its encoder reads, its rate and acceleration
    Displacement,
    /// `(tau, xp)` → torque that the drive reports where it makes `tau`
    Drive,
}

/// A function of one joint in the lines of a Python function's body, elementwise over arrays of the module `xp`.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Function {
    /// what it gives
    pub kind: Kind,
    /// coordinate
    pub joint: usize,
    /// speed over which the sign of the velocity turns, rad/s or m/s
    pub width: f64,
    /// lines of its body
    pub body: Vec<String>,
    /// memory before the first sample, an expression in the position `q`
    pub start: Option<String>,
    /// share of the memory that goes on from one record to the next
    pub lasts: f64,
}

/// A polynomial of the position, constant first.
pub(crate) fn cubic(coefficients: [f64; 4]) -> String {
    let [a, b, c, d] = coefficients.map(py);
    format!("{a} + q * ({b} + q * ({c} + q * {d}))")
}

/// A number as Python reads it, in brackets below zero.
pub(crate) fn py(x: f64) -> String {
    match x.is_sign_negative() {
        true => format!("({x:?})"),
        false => format!("{x:?}"),
    }
}

impl Element {
    /// Whether it is a function of `effects.py`, at least for inverse dynamics.
    pub fn is_function(&self) -> bool {
        !matches!(
            self,
            Element::Drag { .. }
                | Element::Spring { .. }
                | Element::Coupling { .. }
                | Element::Load { .. }
        )
    }

    /// Dry friction of a level, an expression in `q`, `dq` and `load`.
    pub(crate) fn dry(joint: usize, width: f64, level: String) -> Element {
        Element::torque(joint, width, vec![format!("return {level}, 0.0")])
    }

    /// Another torque, an expression in `q`, `dq` and `load`.
    pub(crate) fn smooth(joint: usize, width: f64, torque: String) -> Element {
        Element::torque(joint, width, vec![format!("return 0.0, {torque}")])
    }

    fn torque(joint: usize, width: f64, body: Vec<String>) -> Element {
        Element::Function(Function {
            kind: Kind::Torque,
            joint,
            width,
            body,
            start: None,
            lasts: 0.0,
        })
    }

    /// Lines that end in `return level, torque, memory`; `lasts` as in [`Function`].
    pub(crate) fn memory(
        joint: usize,
        width: f64,
        start: &str,
        lasts: f64,
        body: Vec<String>,
    ) -> Element {
        Element::Function(Function {
            kind: Kind::Memory,
            joint,
            width,
            body,
            start: Some(start.into()),
            lasts,
        })
    }

    /// Lines that end in `return way, rate, acceleration` or in `return reported`.
    pub(crate) fn of(kind: Kind, joint: usize, body: Vec<String>) -> Element {
        Element::Function(Function {
            kind,
            joint,
            width: 1.0,
            body,
            start: None,
            lasts: 0.0,
        })
    }

    /// The same as a function, where it is one of the state of a joint: for files that have no element for it.
    /// `width` as in [`Function`].
    pub(crate) fn into_function(self, width: f64) -> Element {
        match self {
            Element::Drag {
                joint,
                power,
                factor,
            } => {
                let torque = format!("{} * xp.abs(dq) ** {} * dq", py(factor), power - 1);
                Element::smooth(joint, width, torque)
            }
            Element::Spring {
                joint,
                coefficients,
            } => Element::smooth(joint, width, cubic(coefficients)),
            other => other,
        }
    }

    /// What MuJoCo's files say of it.
    pub(crate) fn words(&self) -> &'static str {
        match self {
            Element::Drag { .. } => "a polynomial of the damping",
            Element::Spring { .. } => "stiffness and springref",
            Element::Coupling { .. } => "a tendon over both joints",
            Element::Gain { .. } => "gain of the actuator",
            Element::Delay { seconds, .. } if *seconds < 0.0 => "delay of the actuator",
            Element::Delay { .. } => "what the drive reports",
            Element::Twist { gap, .. } if *gap == 0.0 => "a second joint on a spring",
            Element::Twist { .. } => "a second joint, and the force of its flanks",
            Element::Base { .. } => "a base on springs",
            Element::Load { .. } => "inertial of the bodies",
            Element::Function(f) => match f.kind {
                Kind::Torque => "a torque",
                Kind::Memory => "a torque with a memory",
                Kind::Displacement => "what the encoder reads",
                Kind::Drive => "what the drive reports",
            },
        }
    }
}
