//! Robots: `Plant`.

use crate::call::{quick, simply};
use crate::error::{argument, internal, notices, to_python};
use excite::dynamics::Samples;
use excite::plant::Plant as Core;
use excite::regressor::Regressor;
use excite::robot::parts::Limits;
use excite::robot::parts::Motion;
use excite::trajectory::parts::Space;
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use serde_json::json;
use std::path::PathBuf;
use std::sync::Arc;

/// A robot, as every stage sees it.
#[pyclass(frozen, module = "excite._excite")]
pub struct Plant {
    pub core: Arc<Core>,
}

impl From<Core> for Plant {
    fn from(core: Core) -> Self {
        Plant {
            core: Arc::new(core),
        }
    }
}

/// A number, or nothing where it is infinite.
fn finite(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

fn limits(l: &Limits) -> serde_json::Value {
    json!({
        "position": l.position.map(finite),
        "velocity": finite(l.velocity),
        "acceleration": finite(l.acceleration),
        "jerk": finite(l.jerk),
        "effort": finite(l.effort),
    })
}

fn motion(m: Motion) -> &'static str {
    match m {
        Motion::Revolute => "revolute",
        Motion::Prismatic => "prismatic",
    }
}

/// A motion from joint-major lists.
fn samples(core: &Core, [q, dq, ddq]: [&PyReadonlyArray1<f64>; 3]) -> PyResult<Samples> {
    let dof = core.coordinates();
    let [q, qd, qdd] = [q, dq, ddq].map(|a| a.as_array().to_vec());
    if dof == 0 || q.len() % dof != 0 || qd.len() != q.len() || qdd.len() != q.len() {
        return Err(argument("q, dq and ddq differ in shape"));
    }
    let count = q.len() / dof;
    Ok(Samples {
        dof,
        count,
        q,
        qd,
        qdd,
    })
}

#[pymethods]
impl Plant {
    #[staticmethod]
    fn load(py: Python<'_>, spec: String) -> PyResult<Self> {
        simply(py, move |_| Core::load(&spec)).map(Self::from)
    }

    /// From the text of a URDF and, where there is one, of a robot.toml.
    #[staticmethod]
    fn from_text(
        py: Python<'_>,
        urdf: String,
        toml: Option<String>,
        name: String,
    ) -> PyResult<Self> {
        simply(py, move |_| {
            Ok(match toml {
                None => excite::Robot::from_urdf_str(&urdf, &name)?.into(),
                Some(toml) => excite::Robot::from_toml_str(&toml, &urdf, &name)?.into(),
            })
        })
        .map(|core: Core| core.into())
    }

    /// Other joint columns, the same for every joint.
    fn with_terms(&self, names: Vec<String>) -> PyResult<Self> {
        let terms = excite::cli::terms(&names).map_err(|e| crate::error::to_python(&e))?;
        Ok((*self.core).clone().with_terms(&terms).into())
    }

    fn in_space(&self, py: Python<'_>, space: Option<String>) -> PyResult<Self> {
        let space = space.map(|s| crate::named::named::<Space>("coordinates", &s));
        let space = space.transpose()?;
        let core = (*self.core).clone();
        simply(py, move |_| core.in_space(space)).map(Self::from)
    }

    fn without_collisions(&self) -> Self {
        (*self.core).clone().without_collisions().into()
    }

    fn with_meshes(&self, folders: Vec<PathBuf>) -> Self {
        (*self.core).clone().with_meshes(&folders).into()
    }

    /// What there is to know of it, as JSON.
    fn card(&self) -> String {
        let p = &self.core;
        let joints: Vec<_> = (p.actuators().iter())
            .map(|j| json!({ "name": j.name, "motion": motion(j.motion), "limits": limits(&j.limits) }))
            .collect();
        let coordinates: Vec<_> = (p.moved().joints.iter())
            .map(|j| json!({ "name": j.name, "motion": motion(j.motion), "limits": limits(&j.limits) }))
            .collect();
        let parameters: Vec<_> = (p.parameters().iter())
            .map(|x| json!({ "name": x.name, "unit": x.unit, "value": x.value }))
            .collect();
        json!({
            "name": p.name(),
            "closed": p.closed(),
            "hash": p.robot().hash,
            "gravity": p.robot().gravity.as_slice(),
            "joints": joints,
            "coordinates": coordinates,
            "tree": p.robot().joint_names(),
            "parameters": parameters,
            "bodies": p.robot().bodies.iter().map(|b| &b.name).collect::<Vec<_>>(),
        })
        .to_string()
    }

    fn warnings(&self) -> Vec<(&'static str, String, String)> {
        notices(self.core.warnings())
    }

    /// Entry `(c·actuators + a)·count + s` is column `c`, actuator `a`, sample `s`; motions are coordinate-major.
    fn regressor<'py>(
        &self,
        py: Python<'py>,
        q: PyReadonlyArray1<'py, f64>,
        dq: PyReadonlyArray1<'py, f64>,
        ddq: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let motion = samples(&self.core, [&q, &dq, &ddq])?;
        let core = &self.core;
        let w = quick(py, || match core.closed() {
            false => Ok(Regressor::with_tree(core.robot(), core.tree(), &motion).into_columns()),
            true => {
                let w = core.regressor(&motion)?;
                let mut all = Vec::with_capacity(w.nrows() * w.ncols());
                for c in 0..w.ncols() {
                    all.extend(w.col(c).iter());
                }
                Ok(all)
            }
        })?;
        Ok(w.into_pyarray(py))
    }

    /// Entry `a·count + s` is actuator `a`, sample `s`; of the nominal model, or with other values of the parameters.
    fn torque<'py>(
        &self,
        py: Python<'py>,
        q: PyReadonlyArray1<'py, f64>,
        dq: PyReadonlyArray1<'py, f64>,
        ddq: PyReadonlyArray1<'py, f64>,
        phi: Option<Vec<f64>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let motion = samples(&self.core, [&q, &dq, &ddq])?;
        let core = &self.core;
        if let Some(phi) = &phi
            && phi.len() != core.parameters().len()
        {
            return Err(argument(format!(
                "phi has {} numbers; {} has {} parameters",
                phi.len(),
                core.name(),
                core.parameters().len()
            )));
        }
        let tau = quick(py, || match &phi {
            None => core.nominal_torque(&motion),
            Some(phi) => core.torque(&motion, phi),
        })?;
        Ok(tau.into_pyarray(py))
    }

    /// Base parameters as JSON.
    fn base(&self, py: Python<'_>) -> PyResult<String> {
        let core = self.core.clone();
        simply(py, move |_| {
            let base = core.base()?;
            let mut out = serde_json::to_value(&base)
                .map_err(|e| excite::Error::Infeasible(e.to_string()))?;
            out["combinations"] = (0..base.count()).map(|a| base.combination(a)).collect();
            out["values"] = json!(base.project(&core.values()));
            Ok(out.to_string())
        })
    }

    /// Positions, velocities, accelerations of random states, coordinate-major.
    #[allow(clippy::type_complexity)]
    fn random_states<'py>(
        &self,
        py: Python<'py>,
        count: usize,
        seed: u64,
    ) -> PyResult<[Bound<'py, PyArray1<f64>>; 3]> {
        let core = self.core.clone();
        let s = simply(py, move |_| Ok(core.random_states(count, seed)))?;
        Ok([s.q, s.qd, s.qdd].map(|v| v.into_pyarray(py)))
    }

    /// The files of a model with these values of the parameters: name, and text or why there is none.
    fn files(&self, phi: Vec<f64>) -> PyResult<Vec<(String, Option<String>, String)>> {
        let core = &self.core;
        if phi.len() != core.parameters().len() {
            return Err(internal("one number for each parameter"));
        }
        let robot = core.with_values(&phi);
        let model = excite::export::parts::Model {
            plant: core,
            robot: &robot,
            remarks: &[],
        };
        let all = excite::export::write(&model).into_iter();
        Ok(all
            .map(|(name, text)| match text {
                Ok(text) => (name.to_string(), Some(text), String::new()),
                Err(e) => (name.to_string(), None, e.to_string()),
            })
            .collect())
    }

    /// `effects.py` without an effect: what it has beside them serves any closed chain.
    fn functions(&self) -> PyResult<String> {
        let model = excite::export::parts::Model {
            plant: &self.core,
            robot: self.core.robot(),
            remarks: &[],
        };
        excite::export::parts::functions(&model).map_err(|e| to_python(&e))
    }
}

/// Names of the bundled robots and what they are.
#[pyfunction]
pub fn robots() -> Vec<(&'static str, &'static str)> {
    let serial = excite::robot::bundled::list().iter();
    let parallel = excite::mechanism::bundled::list().iter();
    serial
        .map(|b| (b.name, b.description))
        .chain(parallel.map(|b| (b.name, b.description)))
        .collect()
}
