//! Trajectories: periodic motions as Fourier series, their exact limits, their files.
//!
//! A motion is a [`Fourier`] series per joint over one shared list of harmonics, so it is smooth,
//! repeats for ever, and all its derivatives are known in closed form. From here come the
//! parametrisation an optimiser works in ([`Basis`]), the exact extrema over all time
//! ([`mod@extrema`]), the proof that a robot's limits hold ([`certificate`], `torque`) and the
//! files (`file`, [`samples`]).

pub(crate) mod basis;
pub(crate) mod bounds;
pub(crate) mod by_position;
#[doc(hidden)]
pub mod certificate;
mod enclose;
#[doc(hidden)]
pub mod extrema;
mod extrema_fast;
pub(crate) mod file;
pub(crate) mod fourier;
pub(crate) mod grid;
#[doc(hidden)]
pub mod jets;
pub mod parts;
#[doc(hidden)]
pub mod samples;
pub(crate) mod table;
pub(crate) mod tool;
pub(crate) mod torque;

#[doc(hidden)]
pub use basis::Basis;
pub(crate) use basis::Ends;
pub(crate) use bounds::{SampledBound, TorqueBound};
pub(crate) use by_position::PositionPeak;
pub use certificate::Certificate;
#[doc(hidden)]
pub use certificate::certify;
pub(crate) use certificate::{JointCertificate, Proof};
#[doc(hidden)]
pub use extrema::{Extrema, Extremum, extrema};
#[doc(hidden)]
pub use extrema_fast::extrema_fast;
pub(crate) use file::Space;
pub use file::Trajectory;
pub use fourier::Fourier;
pub(crate) use fourier::Series;
pub(crate) use fourier::evaluate_series;
#[doc(hidden)]
pub use fourier::{RATE, sample_period};
pub(crate) use grid::Grid;
#[doc(hidden)]
pub use samples::Samples;
#[doc(hidden)]
pub use table::{Sampled, Table};
pub(crate) use tool::ToolCertificate;
#[doc(hidden)]
pub use torque::{rate_certificate, torque_certificate};
