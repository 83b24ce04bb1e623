//! `report.json` of `design` and `identifiability`.

use super::page::reproduce::seed;
use super::page::verdict::{verdict, violations};
use crate::design::record::Record;
use crate::identifiability::{
    Answer, Assessment, Excitation, GAIN, LoadAccuracy, Platform, Spread,
};
use crate::trajectory::certificate::{JointCertificate, Peak};
use crate::trajectory::{Proof, SampledBound, Space};
use serde_json::{Map, Value, json};

/// What stands for infinity: JSON has none.
#[doc(hidden)]
pub const INFINITE: f64 = 1e300;

/// A number that JSON can hold: infinities become ±1e300, and what is not a number, being an
/// uncertainty or a ratio that could not be had, 1e300.
fn number(x: f64) -> Value {
    let x = match x.is_nan() {
        true => INFINITE,
        false => x.clamp(-INFINITE, INFINITE),
    };
    json!(x)
}

fn optional(x: Option<f64>) -> Value {
    x.map_or(Value::Null, number)
}

fn numbers(all: &[f64]) -> Value {
    all.iter().copied().map(number).collect()
}

/// The report as JSON; `seconds` is the wall clock of the whole command.
///
/// Every number is finite (±1e300 stands for infinity). `null` means that there is none: what
/// needs a trajectory where there is no trajectory, a limit that is not stated, a percentage of
/// zero.
pub fn json(assessment: &Assessment, record: Option<&Record>, seconds: f64) -> Value {
    let a = assessment;
    let e = a.excitation.as_ref();
    let mut out = Map::new();
    let mut put = |key: &str, value: Value| {
        out.insert(key.into(), value);
    };
    put("robot", json!(a.robot.name));
    put("joints", json!(a.robot.joint_names()));
    put("base_parameters", json!(a.base.count()));
    put("rank_gap", number(a.base.rank_gap));
    put(
        "rank_border",
        json!({
            "above": number(a.base.singular_value_above),
            "below": number(a.base.singular_value_below),
        }),
    );
    put(
        "condition_number",
        e.map_or(Value::Null, |e| {
            json!({
                "headline": a.condition().map(|c| c.0),
                "invariant": number(e.condition.invariant),
                "raw": number(e.condition.raw),
                "normalised": number(e.condition.normalised),
                "weighted": number(e.condition.weighted),
            })
        }),
    );
    // of an information matrix that is singular, or too large to tell: minus infinity
    let log_det = |x: f64| if x.is_nan() { -INFINITE } else { x };
    put(
        "log_det",
        e.map_or(Value::Null, |e| number(log_det(e.log_det))),
    );
    put("relative_std", relative_std(a));
    put(
        "known_to_10_percent",
        e.map_or(Value::Null, |e| {
            let (known, judged) = e.known(10.0);
            json!({ "count": known, "of": judged })
        }),
    );
    put(
        "torque_uncertainty",
        e.map_or(Value::Null, |e| {
            json!({
                "std": numbers(&e.elsewhere.std),
                "rms": numbers(&e.elsewhere.rms),
                "relative": number(e.elsewhere.relative(&a.torque_noise)),
                "states": e.elsewhere.states,
            })
        }),
    );
    put("limits", e.map_or(Value::Null, |e| limits(a, e)));
    put("clearance", e.map_or(Value::Null, clearance));
    put("seconds", number(seconds));
    put("verdict", json!(verdict(a)));
    put("torque_noise", numbers(&a.torque_noise));
    put(
        "singular_values",
        json!({
            "random_states": numbers(&a.base.singular_values),
            "trajectory": e.map_or(Value::Null, |e| numbers(&e.singular_values)),
        }),
    );
    put("standard_parameters", json!(a.base.standard));
    put("warnings", json!(a.warnings));
    put("trajectory", e.map_or(Value::Null, trajectory));
    put(
        "platform",
        e.and_then(|e| e.platform.as_ref())
            .map_or(Value::Null, platform),
    );
    put("load", a.load.as_ref().map_or(Value::Null, load));
    if let Some(a) = &a.answer {
        put("answer", answer(a));
    }
    put("version", json!(env!("CARGO_PKG_VERSION")));
    put("robot_hash", json!(a.robot.hash));
    put(
        "settings",
        match record {
            Some(r) => json!(r.settings),
            None => e.map_or(Value::Null, |e| e.trajectory.settings.clone()),
        },
    );
    put("seed", json!(seed(a, record)));
    put("status", json!(record.map(|r| r.status)));
    put("starts", record.map_or(Value::Null, starts));
    Value::Object(out)
}

/// Base parameters, worst predicted first; without a trajectory in their own order and without
/// predictions.
fn relative_std(a: &Assessment) -> Value {
    match &a.excitation {
        Some(e) => e
            .predictions
            .iter()
            .map(|p| {
                json!({
                    "parameter": p.parameter,
                    "combination": p.combination,
                    "unit": p.unit,
                    "nominal": number(p.nominal),
                    "std": number(p.std),
                    "percent": optional(p.percent),
                })
            })
            .collect(),
        None => {
            let nominal = a.base.project(&a.values);
            (0..a.base.count())
                .map(|k| {
                    json!({
                        "parameter": a.base.name(k),
                        "combination": a.base.combination(k),
                        "unit": a.base.units[a.base.kept[k]],
                        "nominal": number(nominal[k]),
                        "std": Value::Null,
                        "percent": Value::Null,
                    })
                })
                .collect()
        }
    }
}

/// Collisions: how near, where and when, and how that is known.
fn clearance(e: &Excitation) -> Value {
    if let Some(p) = e.platform.as_ref().and_then(|p| p.nearest_axes()) {
        return json!({
            "least": number(p.value),
            "between": p.name.split(" to ").collect::<Vec<_>>(),
            "time": number(p.time),
            "bound": number(p.bound),
            "margin": number(p.limit),
            "proof": "bounded",
            "of": "axes",
            "satisfied": p.satisfied,
        });
    }
    let Some(c) = &e.clearance else {
        return json!({ "least": null, "between": null, "time": null, "proof": "not_checked" });
    };
    let first = c.certificate.pairs.first();
    json!({
        "least": first.map(|p| p.least),
        "between": first.map(|p| &p.between),
        "time": first.map(|p| p.time),
        "bound": first.map(|p| p.bound),
        "margin": first.map(|p| p.margin),
        "proof": match c.certificate.proof {
            Proof::Stated => "bounded",
            _ => "proven",
        },
        "satisfied": c.certificate.satisfied,
        "unseen": c.certificate.unseen,
        "always_near": c.certificate.always_near,
        "pairs": c.certificate.pairs,
        "left_out": c.left_out,
        "volumes": c.volumes,
    })
}

/// The certificate.
fn limits(a: &Assessment, e: &Excitation) -> Value {
    let c = &e.certificate;
    json!({
        "satisfied": c.satisfied,
        "worst": c.worst.as_ref().map(|w| json!({
            "joint": w.joint,
            "kind": w.kind,
            "used": number(w.used),
        })),
        "violations": violations(&a.robot, e),
        "joints": c.joints.iter().map(joint).collect::<Vec<_>>(),
        "tool": c.tool.as_ref().map(|t| json!({
            "frame": t.frame,
            "speed": t.speed.as_ref().map(sampled),
            "acceleration": t.acceleration.as_ref().map(sampled),
        })),
    })
}

/// A magnitude that is sampled, with what is proven between the samples.
fn sampled(b: &SampledBound) -> Value {
    json!({
        "max_on_grid": number(b.max_on_grid),
        "time": number(b.time),
        "between_grid_bound": number(b.between_grid_bound),
        "bound": number(b.bound()),
        "samples": b.samples,
        "limit": number(b.limit),
        "used": number(b.used),
        "margin": number(b.margin),
        "satisfied": b.satisfied(),
    })
}

fn joint(c: &JointCertificate) -> Value {
    let p = &c.position;
    json!({
        "joint": c.joint,
        "position": {
            "min": { "time": number(p.min.time), "value": number(p.min.value) },
            "max": { "time": number(p.max.time), "value": number(p.max.value) },
            "bounds": numbers(&p.bounds),
            "lower": optional(p.lower),
            "upper": optional(p.upper),
            "used": optional(p.used),
            "margin": optional(p.margin),
            "satisfied": p.satisfied(),
        },
        "velocity": peak(&c.velocity),
        "acceleration": peak(&c.acceleration),
        "jerk": peak(&c.jerk),
        "velocity_by_position": c.velocity_by_position.as_ref().map(|p| json!({
            "value": number(p.velocity.abs()),
            "time": number(p.time),
            "position": number(p.position),
            "velocity": number(p.velocity),
            "limit": number(p.limit.abs()),
            "used": number(p.used),
            "used_bound": number(p.bound),
            "margin": number(p.limit.abs() - p.velocity.abs()),
            "satisfied": p.satisfied(),
        })),
        "torque": c.torque.as_ref().map(|t| json!({
            "max_on_grid": number(t.max_on_grid),
            "time": number(t.time),
            "between_grid_bound": number(t.between_grid_bound),
            "coulomb": number(t.coulomb),
            "bound": number(t.bound()),
            "samples": t.samples,
            "limit": optional(t.limit),
            "used": optional(t.used),
            "margin": optional(t.margin),
            "satisfied": t.satisfied(),
        })),
        "torque_rate": c.torque_rate.as_ref().map(sampled),
    })
}

fn peak(p: &Peak) -> Value {
    json!({
        "value": number(p.value),
        "time": number(p.time),
        "bound": number(p.bound),
        "limit": optional(p.limit),
        "used": optional(p.used),
        "margin": optional(p.margin),
        "satisfied": p.satisfied(),
    })
}

/// How well the motion tells what it was designed for.
fn answer(a: &Answer) -> Value {
    let one = |e: &crate::identifiability::Expected| {
        json!({
            "name": e.name,
            "value": number(e.value),
            "std": optional(e.std),
            "unit": e.unit,
        })
    };
    json!({
        "for": a.question.name(),
        "seconds": number(a.seconds),
        "expected": a.expected.iter().map(one).collect::<Vec<_>>(),
    })
}

/// How well the motion tells a load.
fn load(l: &LoadAccuracy) -> Value {
    let of = |s: &[Option<f64>]| -> Value { s.iter().copied().map(optional).collect() };
    let spread = |s: &Spread| json!({ "mass": optional(s[0]), "com": of(&s[1..4]), "inertia_com": of(&s[4..]) });
    json!({
        "payload": {
            "mass": number(l.payload[0]),
            "com": numbers(&l.payload[1..4]),
            "inertia_com": numbers(&l.payload[4..]),
            "named": l.named,
        },
        "frame": l.body,
        "seconds": number(l.seconds),
        "std": spread(&l.shared),
        "std_free_constants": spread(&l.free),
        "std_of_gains_off_by": number(GAIN),
        "std_gains": spread(&l.gains),
        "limits_satisfied": l.broken.is_none(),
        "limit_broken": l.broken,
    })
}

/// What the platform of a parallel robot does.
fn platform(p: &Platform) -> Value {
    let c = &p.certificate;
    let least = |which: usize| {
        let all = p.sigma.iter().filter_map(|s| s[which]);
        all.fold(None, |m: Option<f64>, s| Some(m.map_or(s, |m| m.min(s))))
    };
    json!({
        "coordinates": p.names,
        "box": c.platform.joints.iter().map(joint).collect::<Vec<_>>(),
        "pose": c.pose,
        "singularity": { "actuation": optional(least(0)), "constraint": optional(least(1)) },
        "proven": c.proven(),
        "satisfied": c.satisfied,
    })
}

fn trajectory(e: &Excitation) -> Value {
    let t = &e.trajectory;
    let space = e.platform.as_ref().map_or(Space::Actuators, |p| p.space);
    json!({
        "period": number(t.fourier.period),
        "periods": t.periods,
        "coordinates": space,
        "harmonics": t.fourier.harmonics,
        "grid": t.grid.name(),
        "ends": t.ends.name(),
        "samples": e.samples,
        "robot_hash": t.robot_hash,
        "excite_version": t.excite_version,
    })
}

/// The starts of a design, with the course of the one that gave the result.
fn starts(r: &Record) -> Value {
    let all: Vec<Value> = r
        .starts
        .iter()
        .map(|s| {
            json!({
                "number": s.number,
                "converged": s.converged,
                "iterations": s.history.len().saturating_sub(1),
                "criterion": optional(s.history.last().copied()),
            })
        })
        .collect();
    let history = r
        .starts
        .iter()
        .find(|s| s.number == r.best)
        .map(|s| numbers(&s.history));
    json!({
        "best": r.best,
        "seconds": number(r.seconds),
        "followed": all,
        "history": history,
    })
}
