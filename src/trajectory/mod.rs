//! Trajectories: periodic motions as Fourier series, their exact limits, their files.
//!
//! A motion is a [`Fourier`] series per joint over one shared list of harmonics, so it is smooth,
//! repeats for ever, and all its derivatives are known in closed form. From here come the
//! parametrisation an optimiser works in ([`Basis`]), the exact extrema over all time
//! ([`mod@extrema`]), the proof that a robot's limits hold ([`certificate`], [`torque`]), the
//! files ([`file`](mod@file), [`samples`]) and the moves to and from the start ([`transition`]).

pub mod basis;
pub mod certificate;
pub mod extrema;
mod extrema_fast;
pub mod file;
pub mod fourier;
pub mod grid;
pub mod jets;
pub mod samples;
pub mod table;
pub mod torque;
pub mod transition;

pub use basis::{Basis, Ends};
pub use certificate::{Certificate, Proof, TorqueBound, certify};
pub use extrema::{Extrema, Extremum, extrema};
pub use extrema_fast::extrema_fast;
pub use file::{Space, Trajectory};
pub use fourier::{Fourier, RATE, Series, sample_period};
pub use grid::Grid;
pub use samples::Samples;
pub use table::{Sampled, Table};
pub use torque::torque_certificate;
