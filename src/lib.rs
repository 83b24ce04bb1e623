//! Exciting trajectories for robots: designed, and proven inside the limits, before the run.
//!
//! The joint torques of a robot are linear in its dynamic parameters, `τ = Y(q, q̇, q̈) φ`. How well
//! a run can identify them is decided by the motion, before the robot moves. With `W` the stacked
//! regressor of the motion, this crate solves
//!
//! ```text
//! minimise over x    cond W(x)                     (or ln det, trace, smallest eigenvalue)
//! subject to         q_min ≤ q(t; x) ≤ q_max
//!                    |q̇| ≤ v,  |q̈| ≤ a,  |q⃛| ≤ j      for all t, not only at samples
//!                    |τ(q, q̇, q̈)| ≤ τ_max
//! ```
//!
//! where `q(t; x)` is a Fourier series for each joint, and says before the run which parameters it
//! will identify and how well.
//!
//! ```
//! use excite::design::{Settings, design};
//! use excite::identifiability::assess;
//!
//! let plant = excite::Plant::load("planar2")?; // a bundled name, a robot.toml or a URDF
//! let settings = Settings::default().with(|set| set.starts = Some(2));
//! let result = design(&plant, &settings)?;
//! let report = assess(&result.plant, Some(&result.trajectory))?;
//! let excitation = report.excitation.expect("a trajectory was given");
//! assert!(excitation.certificate.satisfied && excitation.condition.invariant < 3.0);
//! # Ok::<(), excite::Error>(())
//! ```
//!
//! | stage | module | what it gives |
//! |---|---|---|
//! | robot | [`robot`] | bodies, joints, limits, the ten inertial parameters |
//! | dynamics | [`dynamics`], [`regressor`] | `τ`, `Y`, `W` and exact derivatives, in batches |
//! | parallel | [`mechanism`] | closed chains: kinematics, `τ`, `Y`, singularities |
//! | either | [`plant`] | serial and parallel robots as one |
//! | base | [`base`] | base parameters, rank, what cannot be identified and why |
//! | trajectory | [`trajectory`] | Fourier series, exact extrema, certificates, files |
//! | moves | [`moves`] | the way to the start and back; a motion at several speeds |
//! | design | [`design`] | the optimiser |
//! | before the run | [`identifiability`] | which parameters the run will identify, and how well |
//! | rehearsal | [`simulate`] | a log as the robot would write it |
//! | log | [`log`], [`signals`] | what was recorded, repaired, filtered, differentiated |
//! | identify | [`identify`] | parameters with their uncertainty, validated on other records |
//! | export | [`export`] | identified and improved robots as URDF, MuJoCo XML, `robot.toml` |
//! | load | [`load`] | mass, centre of mass and inertia of what the robot carries |
//! | calibrate | [`calibrate`] | the geometry of a robot, from what was seen or touched |
//! | diagnose | [`diagnose`] | which effect the model lacks, and how far the gap shrinks with it |
//! | documents | [`documentation`] | method, notation, files: the folder `docs/` |
//!
//! The page of a stage has its nouns and verbs. What these are made of (values of settings, parts of results) stands
//! in the module `parts` of the stage, for example [`design::parts`].
//!
//! | symbol | meaning |
//! |---|---|
//! | `q, qd, qdd` | positions, velocities, accelerations (rad or m, s) |
//! | `tau` | joint torques or forces (N m or N) |
//! | `phi` | standard parameters: ten a link, then the joint terms |
//! | `Y`, `W` | regressor of one sample, stacked regressor |
//! | `pi_b` | base parameters |
//!
//! SI units everywhere. All conventions are in [`documentation::notation`], the method with its
//! equations in [`documentation::method`].
#![warn(missing_docs)]
// `!(x <= limit)` is meant: it holds for what is no number, too
#![allow(clippy::neg_cmp_op_on_partial_ord)]

// Modules and names under `#[doc(hidden)]` are internals that the program, the tests and the benchmarks use. They may
// change at any time.

// the command line is written as a program that uses this library
extern crate self as excite;

pub mod base;
pub mod calibrate;
#[doc(hidden)]
pub mod cli;
#[doc(hidden)]
pub mod collision;
#[doc(hidden)]
pub mod conic;
#[doc(hidden)]
pub mod controller;
pub mod design;
pub mod diagnose;
pub mod documentation;
mod dot;
pub mod dynamics;
mod error;
pub mod export;
mod extremes;
#[doc(hidden)]
pub mod heap;
pub mod identifiability;
pub mod identify;
pub mod load;
pub mod log;
pub mod mechanism;
mod median;
pub mod moves;
#[doc(hidden)]
pub mod output;
pub mod plant;
pub mod regressor;
#[doc(hidden)]
pub mod report;
pub mod robot;
mod settings;
pub mod signals;
pub mod simulate;
#[doc(hidden)]
pub mod solid;
#[doc(hidden)]
pub mod survey;
pub mod trajectory;

pub use error::{Error, Result, Warning, WarningKind};
pub use plant::Plant;
pub use robot::Robot;
