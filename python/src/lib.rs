//! The Python package `excite`: the parts that are not written in Python.
//!
//! Arrays cross as lists that are one joint after the other, which is how the library holds them; the Python side shows
//! them with one row a sample, without a copy.

mod call;
mod condense;
mod design;
mod error;
mod named;
mod plant;
mod records;
mod report;
mod simulate;
mod verbs;

use pyo3::prelude::*;
use std::ffi::OsString;

/// Runs the program; gives the exit status.
#[pyfunction]
fn main(py: Python<'_>, args: Vec<OsString>) -> u8 {
    py.detach(|| excite::cli::run(args))
}

#[pymodule]
fn _excite(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("Error", m.py().get_type::<error::Error>())?;
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    m.add_class::<plant::Plant>()?;
    m.add_class::<records::Experiment>()?;
    m.add_class::<report::Report>()?;
    m.add_function(wrap_pyfunction!(plant::robots, m)?)?;
    m.add_function(wrap_pyfunction!(report::save, m)?)?;
    m.add_function(wrap_pyfunction!(report::table, m)?)?;
    m.add_function(wrap_pyfunction!(design::design, m)?)?;
    m.add_function(wrap_pyfunction!(design::assess, m)?)?;
    m.add_function(wrap_pyfunction!(design::check_trajectory, m)?)?;
    m.add_function(wrap_pyfunction!(design::sample, m)?)?;
    m.add_function(wrap_pyfunction!(design::write_samples, m)?)?;
    m.add_function(wrap_pyfunction!(simulate::simulate, m)?)?;
    m.add_function(wrap_pyfunction!(verbs::identify, m)?)?;
    m.add_function(wrap_pyfunction!(condense::condense, m)?)?;
    m.add_function(wrap_pyfunction!(condense::header, m)?)?;
    m.add_function(wrap_pyfunction!(condense::merge, m)?)?;
    m.add_function(wrap_pyfunction!(verbs::load, m)?)?;
    m.add_function(wrap_pyfunction!(verbs::diagnose, m)?)?;
    m.add_function(wrap_pyfunction!(verbs::is_calibration, m)?)?;
    m.add_function(wrap_pyfunction!(verbs::diagnose_poses, m)?)?;
    m.add_function(wrap_pyfunction!(verbs::calibrate, m)?)?;
    m.add_function(wrap_pyfunction!(verbs::export, m)?)?;
    m.add_function(wrap_pyfunction!(verbs::formats, m)?)?;
    m.add_function(wrap_pyfunction!(verbs::series, m)?)?;
    m.add_function(wrap_pyfunction!(verbs::energies, m)?)?;
    m.add_function(wrap_pyfunction!(main, m)?)?;
    Ok(())
}
