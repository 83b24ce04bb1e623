//! The identified parallel robot as a robot file: the file that it was read from with other bodies and
//! joint terms, so that geometry, limits and unknowns stay as they were written. A tree with loops refers
//! to the URDF of [`super::urdf`].

use super::{base_name, possible, rpy};
use crate::error::{Error, Result, number};
use crate::mechanism::loops::{Closure, Coincide, Frame};
use crate::mechanism::{Mechanism, Source};
use crate::robot::{Inertia, JointTerm, Prior, Robot};
use nalgebra::{Matrix3, Vector3};
use toml::{Table, Value};

/// `robot.toml` of a mechanism with the bodies and joint terms of `robot`, its tree with other values.
/// `urdf` is the name of that tree's URDF beside the file, which only loops refer to.
///
/// # Errors
/// A mechanism that was put together in code, and what a file cannot carry: a body of negative mass, or
/// with first moments and no mass.
pub fn toml(mechanism: &Mechanism, robot: &Robot, urdf: &str) -> Result<String> {
    let none = || {
        Error::Infeasible(format!(
            "{}: it was not read from a robot file that its values could be written into",
            robot.name
        ))
    };
    let mut file: Table = match mechanism.text.is_empty() {
        true => return Err(none()),
        false => toml::from_str(&mechanism.text).map_err(|_| none())?,
    };
    file.insert("name".into(), robot.name.clone().into());
    if robot.prior == Prior::Identified {
        file.insert("prior".into(), "identified".into());
    }
    if robot.gravity != mechanism.robot.gravity {
        file.insert("gravity".into(), numbers(robot.gravity.as_slice()));
    }
    terms(&mut file, mechanism, robot);
    match &mechanism.platform().source {
        Source::GoughStewart => legs(&mut file, robot)?,
        Source::H4 | Source::Delta => chains(&mut file, mechanism, robot)?,
        Source::Loops(closures) => loops(&mut file, mechanism, closures, robot, urdf)?,
        source @ (Source::Code(_) | Source::InActuators(_)) => {
            return Err(Error::Infeasible(format!(
                "{}: no robot file can hold a mechanism of kind `{}`, whose kinematics are code; \
                 write its values into that code",
                robot.name,
                source.name()
            )));
        }
    }
    let text = toml::to_string(&file).map_err(|e| Error::Infeasible(e.to_string()))?;
    Ok(format!(
        "# Identified. SI units: rad, m, s, kg, N, N m.\n{text}"
    ))
}

fn numbers(list: &[f64]) -> Value {
    Value::Array(list.iter().map(|&x| Value::Float(x)).collect())
}

/// First moments in words.
fn moments(inertia: &Inertia) -> String {
    let all: Vec<String> = inertia.first_moment().iter().map(|v| number(*v)).collect();
    format!("[{}]", all.join(", "))
}

/// `{ mass, com, inertia }` of a body that can exist.
fn entry(name: &str, inertia: &Inertia) -> Result<Table> {
    let inertia = match inertia.mass() > 0.0 {
        true => &possible(inertia),
        false => inertia,
    };
    let mass = inertia.mass();
    let com = inertia.com().unwrap_or_default();
    if mass < 0.0 || (mass == 0.0 && inertia.first_moment() != Vector3::zeros()) {
        return Err(Error::Infeasible(format!(
            "{name}: a robot file cannot carry a mass of {} kg with first moments {} kg m",
            number(mass),
            moments(inertia)
        )));
    }
    let i = inertia.tensor_com();
    let tensor = [i.m11, i.m12, i.m13, i.m22, i.m23, i.m33];
    let mut table = Table::new();
    table.insert("mass".into(), mass.into());
    table.insert("com".into(), numbers(com.as_slice()));
    table.insert("inertia".into(), numbers(&tensor));
    Ok(table)
}

fn inertia_of(robot: &Robot, name: &str) -> Inertia {
    let body = robot.bodies.iter().find(|b| b.name == name);
    body.map_or(Inertia::default(), |b| b.inertia)
}

/// The tables of an array of tables.
fn tables<'a>(file: &'a mut Table, key: &str) -> Vec<&'a mut Table> {
    let list = file.get_mut(key).and_then(Value::as_array_mut);
    let each = list.into_iter().flatten();
    each.filter_map(Value::as_table_mut).collect()
}

/// Armature, friction and offset of every joint that has any.
fn terms(file: &mut Table, mechanism: &Mechanism, robot: &Robot) {
    let names = JointTerm::ALL.map(JointTerm::name);
    if let Some(all) = file.get_mut("actuator").and_then(Value::as_table_mut) {
        names.iter().for_each(|n| drop(all.remove(*n)));
    }
    for (j, joint) in robot.joints.iter().enumerate() {
        let has_terms =
            joint.terms != [0.0; 4] || joint.stribeck.force > 0.0 || joint.identify.contains(&true);
        let platform = mechanism.task.names().contains(&joint.name.as_str());
        if platform || !(has_terms || mechanism.actuated.contains(&j)) {
            continue;
        }
        let name = Value::from(joint.name.as_str());
        let found = tables(file, "joint")
            .iter()
            .position(|t| t.get("name") == Some(&name));
        let k = found.unwrap_or_else(|| {
            let entry = Table::from_iter([("name".to_string(), name)]);
            let list = file.entry("joint").or_insert(Value::Array(Vec::new()));
            let list = list.as_array_mut().map(|l| {
                l.push(Value::Table(entry));
                l.len() - 1
            });
            list.unwrap_or_default()
        });
        let own = joint.stribeck;
        if let Some(table) = tables(file, "joint").into_iter().nth(k) {
            if own.force > 0.0 {
                table.insert("stribeck".into(), own.force.into());
                table.insert("stribeck_velocity".into(), own.velocity.into());
            }
            for (name, value) in names.iter().zip(joint.terms) {
                table.insert(name.to_string(), value.into());
            }
        }
    }
}

/// Writes what every leg or chain has: where all are alike into the table `shared`, else into the tables
/// `each`. `keys` are all ways to state it, the first is used.
fn place(file: &mut Table, [shared, each]: [&str; 2], keys: &[&str], values: Vec<Value>) {
    let drop_old = |table: &mut Table| keys.iter().for_each(|k| drop(table.remove(*k)));
    tables(file, each).into_iter().for_each(drop_old);
    let all = file
        .entry(shared)
        .or_insert(Value::Table(Table::new()))
        .as_table_mut();
    if let Some(all) = all {
        drop_old(all);
        if values.windows(2).all(|w| w[0] == w[1]) {
            all.extend(values.into_iter().take(1).map(|v| (keys[0].to_string(), v)));
            return;
        }
    }
    let empty = || Value::Array(vec![Value::Table(Table::new()); values.len()]);
    file.entry(each).or_insert_with(empty);
    for (table, value) in tables(file, each).into_iter().zip(values) {
        table.insert(keys[0].into(), value);
    }
}

/// Bodies of a hexapod, as far as its file describes them.
fn legs(file: &mut Table, robot: &Robot) -> Result<()> {
    let platform = entry("platform", &inertia_of(robot, "platform"))?;
    file.insert("platform".into(), platform.into());
    for part in ["cross", "cylinder", "rod"] {
        let shared = file.get("legs").and_then(Value::as_table);
        let described = shared.is_some_and(|t| t.contains_key(part))
            || tables(file, "leg").iter().any(|t| t.contains_key(part));
        let heavy = (1..=6).any(|k| inertia_of(robot, &format!("{part}{k}")) != Inertia::default());
        if !described && !heavy {
            continue;
        }
        let body = |k: usize| {
            let name = format!("{part}{k}");
            entry(&name, &inertia_of(robot, &name)).map(Value::Table)
        };
        let values = (1..=6).map(body).collect::<Result<_>>()?;
        place(file, ["legs", "leg"], &[part], values);
    }
    Ok(())
}

/// Bodies of a Delta or H4.
fn chains(file: &mut Table, mechanism: &Mechanism, robot: &Robot) -> Result<()> {
    let model = file.get("model").and_then(Value::as_str);
    let lumped = model.is_some_and(|m| m.starts_with("lumped"));
    let body = |name: &str| {
        let own = inertia_of(robot, name);
        if lumped && name == "platform" && own.first_moment() != Vector3::zeros() {
            return Err(Error::Infeasible(format!(
                "{name}: a lumped model has no place for its first moments {} kg m",
                moments(&own)
            )));
        }
        let inertia = match (lumped, name.starts_with("arm"), name == "platform") {
            (true, true, _) => lumped_arm(&own),
            (true, _, true) => disc(own.0[0], own.0[9]),
            _ => own,
        };
        entry(name, &inertia).map(Value::Table)
    };
    file.insert("platform".into(), body("platform")?);
    for (k, bar) in tables(file, "bar").into_iter().enumerate() {
        let name = format!("bar{}", k + 1);
        bar.extend(entry(&name, &inertia_of(robot, &name))?);
    }
    let (mut arms, mut rods) = (Vec::new(), Vec::new());
    for k in 1..=mechanism.actuators() {
        arms.push(body(&format!("arm{k}"))?);
        let pair = ["a", "b"].map(|side| body(&format!("rod{k}{side}")));
        rods.push(Value::Array(pair.into_iter().collect::<Result<_>>()?));
    }
    place(file, ["chains", "chain"], &["arm"], arms);
    place(file, ["chains", "chain"], &["rods", "rod"], rods);
    Ok(())
}

/// A body with this mass and moment about `z`.
fn disc(mass: f64, izz: f64) -> Inertia {
    let tensor = Matrix3::from_diagonal(&Vector3::new(0.5 * izz, 0.5 * izz, izz));
    Inertia::from_origin(mass, Vector3::zeros(), tensor)
}

/// The arm of a lumped model, of which `mz` and `Ixx` alone count: a point mass that has both.
fn lumped_arm(own: &Inertia) -> Inertia {
    let (first, second) = (own.0[3], own.0[4]);
    if first == 0.0 {
        let tensor = Matrix3::from_diagonal(&Vector3::new(second, second, 0.0));
        return Inertia::from_origin(0.0, Vector3::zeros(), tensor);
    }
    let at = Vector3::new(0.0, 0.0, second / first);
    Inertia::from_com(first * first / second, at, Matrix3::zeros())
}

/// The tree's URDF, and closures and configuration in its terms.
fn loops(
    file: &mut Table,
    mechanism: &Mechanism,
    closures: &[Closure],
    robot: &Robot,
    urdf: &str,
) -> Result<()> {
    for key in ["yaml", "lock", "home"] {
        file.remove(key);
    }
    let base = base_name(robot);
    let frame = |f: &Frame| {
        let link = f.body.map_or(base.as_str(), |b| &robot.bodies[b].name);
        let mut table = Table::new();
        table.insert("link".into(), link.into());
        table.insert("position".into(), numbers(f.position.as_slice()));
        table.insert("rpy".into(), numbers(&rpy(&f.rotation)));
        Value::Table(table)
    };
    let closures = closures.iter().map(|c| {
        let coincide = match c.coincide {
            Coincide::Position => "position",
            Coincide::Pose => "pose",
        };
        let mut table = Table::new();
        let frames = c.frames.iter().map(frame).collect();
        table.insert("frames".into(), Value::Array(frames));
        table.insert("coincide".into(), coincide.into());
        Value::Table(table)
    });
    let closures = closures.collect();
    let joints = robot.joints.iter().map(|j| j.name.clone());
    let home = mechanism.inverse(&mechanism.home)?;
    let start = joints.zip(home.into_iter().map(Value::Float)).collect();
    let actuated = mechanism.actuator_names().into_iter().map(Value::String);
    for (key, value) in [
        ("urdf", Value::from(urdf)),
        ("length", mechanism.length.into()),
        ("actuated", Value::Array(actuated.collect())),
        ("start", Value::Table(start)),
        ("loop", Value::Array(closures)),
    ] {
        file.insert(key.into(), value);
    }
    Ok(())
}
