//! The documents of the folder `docs/`.
//!
//! | document | what it says |
//! |---|---|
//! | [`formats`] | every file that is read or written, every key |
//! | [`notation`] | symbols, units, frames, signs |
//! | [`method`] | robot, regressor, base parameters, design: the equations |
//! | [`parallel`] | parallel robots |
//! | [`identification`] | from a log to a model |
//! | [`calibration`] | the geometry of a robot, from a camera, a tracker or a ball in sockets |
//! | [`logs`] | logs of any format, and what their columns mean |
//! | [`load`] | mass, centre of mass and inertia of a load |
//! | [`collisions`] | what a motion must not touch, how it keeps clear, and how that is proven |
//! | [`moves`] | the way to the start of a motion and back; a motion at several speeds |
//! | [`simulation`] | the simulated robot |
//! | [`run`] | files for controllers, and the programs that play them |
//! | [`diagnosis`] | how to read a diagnosis, and what to do next |
//! | [`diagnosis_method`] | how the diagnosis works, with its equations, constants and catalogue |
//! | [`diagnosis_results`] | what the diagnosis found on rehearsals and real robots |
//! | [`python`] | the same from Python: functions, arrays, notebooks |
//! | [`limits`] | what is not known, not proven, or not there |
//! | [`withheld`] | how often the diagnosis is right |
//! | [`results`], [`benchmarks`] | what was measured, and how to measure it again |
//! | [`design`], [`compare`] | why it is as it is; other tools |

/// A module that holds one document. The documents link to one another by file name, which the
/// definitions in front of the text turn into links between these modules.
macro_rules! documents {
    ($($name:ident $file:literal)*) => {
        $(
            #[doc = "[benchmarks.md]: crate::documentation::benchmarks"]
            #[doc = "[calibration.md]: crate::documentation::calibration"]
            #[doc = "[collisions.md]: crate::documentation::collisions"]
            #[doc = "[compare.md]: crate::documentation::compare"]
            #[doc = "[design.md]: crate::documentation::design"]
            #[doc = "[diagnosis.md]: crate::documentation::diagnosis"]
            #[doc = "[diagnosis-method.md]: crate::documentation::diagnosis_method"]
            #[doc = "[diagnosis-results.md]: crate::documentation::diagnosis_results"]
            #[doc = "[formats.md]: crate::documentation::formats"]
            #[doc = "[identification.md]: crate::documentation::identification"]
            #[doc = "[limits.md]: crate::documentation::limits"]
            #[doc = "[load.md]: crate::documentation::load"]
            #[doc = "[logs.md]: crate::documentation::logs"]
            #[doc = "[method.md]: crate::documentation::method"]
            #[doc = "[moves.md]: crate::documentation::moves"]
            #[doc = "[notation.md]: crate::documentation::notation"]
            #[doc = "[parallel.md]: crate::documentation::parallel"]
            #[doc = "[python.md]: crate::documentation::python"]
            #[doc = "[results.md]: crate::documentation::results"]
            #[doc = "[run.md]: crate::documentation::run"]
            #[doc = "[simulation.md]: crate::documentation::simulation"]
            #[doc = "[simulators.md]: crate::documentation::simulators"]
            #[doc = "[withheld.md]: crate::documentation::withheld"]
            #[doc = ""]
            #[cfg_attr(any(doc, doctest), doc = include_str!(concat!("../docs/", $file, ".md")))]
            pub mod $name {}
        )*
    };
}

documents! {
    benchmarks "benchmarks"
    calibration "calibration"
    collisions "collisions"
    compare "compare"
    design "design"
    diagnosis "diagnosis"
    diagnosis_method "diagnosis-method"
    diagnosis_results "diagnosis-results"
    formats "formats"
    identification "identification"
    limits "limits"
    load "load"
    logs "logs"
    method "method"
    moves "moves"
    notation "notation"
    parallel "parallel"
    python "python"
    results "results"
    run "run"
    simulation "simulation"
    simulators "simulators"
    withheld "withheld"
}
