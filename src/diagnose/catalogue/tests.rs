//! One test over all effects: what each of them promises.

use super::*;
use crate::diagnose::data::Data;
use crate::diagnose::evidence::{Evidence, Projected};
use crate::diagnose::search;
use crate::diagnose::window::averaged;
use crate::export::{self, Model};
use crate::mechanism::Mechanism;
use crate::plant::{self, Plant};
use crate::signals::series::Series;
use rand::{Rng, SeedableRng};
use std::collections::BTreeSet;
use std::f64::consts::TAU;

const COUNT: usize = 600;
const PERIOD: f64 = 6.0;

/// A robot whose model has no joint terms to identify, so that those may be missing.
fn robot(name: &str) -> Plant {
    let plant = match name {
        // legs without mass
        "hexapod" => {
            let text = include_str!("../../mechanism/bundled/hexapod.toml");
            let legs = |l: &&str| !l.starts_with("cylinder = ") && !l.starts_with("rod = ");
            let text: Vec<&str> = text.lines().filter(legs).collect();
            let text = text
                .join("\n")
                .replace("bodies = \"legs\"", "bodies = \"platform\"");
            let mechanism = Mechanism::from_toml_str(&text, "robot.toml").unwrap();
            mechanism.into()
        }
        _ => Plant::load(name).unwrap(),
    };
    plant.with_terms(&[])
}

/// Two periods of a motion that moves every coordinate.
fn motion(plant: &Plant) -> Samples {
    let (middle, reach): (Vec<f64>, Vec<f64>) = match plant.mechanism() {
        None => plant
            .robot()
            .joints
            .iter()
            .map(|j| match j.limits.position {
                [a, b] if (b - a).is_finite() => (0.5 * (a + b), (0.3 * (b - a)).min(1.2)),
                _ => (0.3, 1.2),
            })
            .unzip(),
        Some(m) => {
            let width = |l: &crate::robot::Limits| 0.1 * (l.position[1] - l.position[0]);
            (m.home.clone(), m.workspace.iter().map(width).collect())
        }
    };
    let n = middle.len();
    let mut x = Samples::zeros(n, 2 * COUNT);
    for j in 0..n {
        for i in 0..x.count {
            let (t, at) = (i as f64 * PERIOD / COUNT as f64, j * x.count + i);
            x.q[at] = middle[j];
            for (k, share) in [(1 + j % 3, 0.6), (3 + j, 0.3), (8, 0.1)] {
                let w = TAU * k as f64 / PERIOD;
                let (s, c) = (w * t + 1.7 * j as f64 + 0.4 * k as f64).sin_cos();
                let a = reach[j] * share;
                x.q[at] += a * s;
                x.qd[at] += a * w * c;
                x.qdd[at] -= a * w * w * s;
            }
        }
    }
    x
}

fn record(plant: &Plant, x: &Samples, tau: Vec<f64>) -> Series {
    let n = plant.actuators().len();
    Series {
        name: "test".into(),
        fit: true,
        dt: PERIOD / COUNT as f64,
        count: x.count,
        cycle: Some(COUNT),
        actuators: plant.actuator_motion(x).unwrap(),
        x: x.clone(),
        reference: None,
        tau,
        deflection: None,
        measured: vec![true; x.count],
        standing: Vec::new(),
        position_noise: vec![0.0; n],
        band: 20.0,
        coarse: Vec::new(),
        filters: Vec::new(),
        payload: crate::log::Payload::None,
        order: 0,
        remarks: Vec::new(),
    }
}

fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|v| v * v).sum::<f64>() / x.len().max(1) as f64).sqrt()
}

/// A torque with a little noise, actuator after actuator.
fn noisy(clean: &[Vec<f64>]) -> Vec<f64> {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
    let level = clean.iter().map(|r| rms(r)).fold(0.0, f64::max);
    let all = clean.iter().flatten();
    all.map(|t| t + 1e-3 * level * random.random_range(-1.0..1.0))
        .collect()
}

/// Torque of columns with coefficients, actuator after actuator.
fn sum(cx: &Context, columns: &[Column], eta: &[f64]) -> Vec<Vec<f64>> {
    let mut out = vec![vec![0.0; cx.data.rows()]; cx.data.joints()];
    for (column, eta) in columns.iter().zip(eta) {
        for (j, values) in &column.rows {
            out[*j]
                .iter_mut()
                .zip(values)
                .for_each(|(t, v)| *t += eta * v);
        }
    }
    out
}

/// Coefficients of a body or angle that can be, otherwise such that every column counts for as much.
fn sizes(name: &str, cx: &Context, columns: &[Column]) -> Vec<f64> {
    let body = [
        0.3, 0.003, 0.006, -0.004, 2e-3, 1e-4, -1e-4, 2e-3, 1e-4, 2e-3,
    ];
    let leg = [0.1, 0.004, 0.001, 0.0005];
    let n = columns.len();
    match name {
        "payload" => body[..n].to_vec(),
        "link_inertia" if n > 1 => body[..n].to_vec(),
        "leg_inertia" => (0..n).map(|k| leg[k % 4]).collect(),
        "joint_offset" | "gravity_direction" | "encoder_eccentricity" => {
            [0.004, -0.003][..n].to_vec()
        }
        "leg_geometry" => vec![0.2; n],
        "passive_joint_friction" => vec![0.02, 0.05],
        "joint_elasticity" | "backlash" | "torque_delay" => vec![1.0],
        _ => {
            let level = cx.rigid.iter().map(|r| rms(r)).fold(0.0, f64::max);
            let of = |c: &Column| c.rows.iter().map(|(_, v)| rms(v)).fold(1e-12, f64::max);
            columns.iter().map(|c| 0.05 * level / of(c)).collect()
        }
    }
}

/// Torque of a robot along a motion, averaged as it is measured.
fn measured(plant: &Plant, x: &Samples) -> Vec<Vec<f64>> {
    let tau = plant.nominal_torque(x).unwrap();
    let average = |row: &[f64]| {
        let mut out = vec![0.0; row.len()];
        averaged(row, &mut out);
        out
    };
    tau.chunks_exact(x.count).map(average).collect()
}

/// The robot files of a model, read again.
fn read_back(plant: &Plant, robot: &Robot) -> Plant {
    let model = Model {
        plant,
        robot,
        remarks: &[],
    };
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in export::write(&model) {
        std::fs::write(folder.path().join(name), text.unwrap()).unwrap();
    }
    let file = folder.path().join("robot.toml");
    Plant::load(file.to_str().unwrap()).unwrap()
}

/// Largest difference over the size of the second.
fn off(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let pairs = a.iter().zip(b).flat_map(|(a, b)| a.iter().zip(b));
    let (mut d, mut s) = (0.0, 1e-300);
    for (a, b) in pairs {
        d += (a - b) * (a - b);
        s += b * b;
    }
    (d / s).sqrt()
}

fn minus(a: &[Vec<f64>], b: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let row = |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(b).map(|(a, b)| a - b).collect();
    a.iter().zip(b).map(row).collect()
}

/// Units of what is measured at an actuator that turns, and at one that slides.
const TURNING: [&str; 6] = ["N m", "N m/rad", "N m s/rad", "rad/s", "kg m^2", "rad/rad"];
const SLIDING: [&str; 6] = ["N", "N/m", "N s/m", "m/s", "m", "rad/m"];

#[test]
fn every_effect_keeps_its_promises() {
    let effects = all();
    let mut tested = BTreeSet::new();
    let mut seen_by_refit = BTreeSet::new();
    for name in ["planar2", "scara", "hexapod", "delta"] {
        let plant = robot(name);
        let x = motion(&plant);
        let (n, rows) = (plant.actuators().len(), x.count);
        let nominal = measured(&plant, &x);
        let tau = noisy(&nominal);
        let data = Data::new(&plant, vec![record(&plant, &x, tau)]).unwrap();
        let noise = data.noise.clone();
        let cx = Context::new(&data, plant.values()).unwrap();
        let evidence = Evidence::new(&data, 1.0);
        // one candidate of every effect, place and form
        let mut list: Vec<(usize, Place, Shape, Vec<Column>)> = Vec::new();
        for (i, effect) in effects.iter().enumerate() {
            let places = effect.sites(&cx);
            let mut few: Vec<Place> = places.first().copied().into_iter().collect();
            // the last joint may be one that slides
            few.extend(places.last().copied().filter(|p| Some(p) != places.first()));
            for place in few {
                let shapes = effect.shapes(&cx, &place);
                for form in 0..effect.forms() {
                    let of: Vec<&Shape> = shapes.iter().filter(|s| s.form == form).collect();
                    let card = effect.card().name;
                    assert!(!of.is_empty(), "{card} has no shape of form {form}");
                    let shape = of[of.len() / 2].clone();
                    let columns = effect.columns(&cx, &place, &shape, false);
                    let whole = !columns.is_empty() && columns.iter().all(|c| !c.rows.is_empty());
                    if whole {
                        list.push((i, place, shape, columns));
                    }
                }
            }
        }
        let sets: Vec<Vec<Column>> = list.iter().map(|(.., c)| c.clone()).collect();
        let projected: Vec<Projected> = evidence.project_all(&sets);
        for (k, (i, place, shape, columns)) in list.iter().enumerate() {
            let effect = &effects[*i];
            let card = effect.card();
            let what = format!(
                "{} of form {} at {place:?} of {name}",
                card.name, shape.form
            );
            let eta = sizes(card.name, &cx, columns);
            let gap = sum(&cx, columns, &eta);
            assert!(gap.iter().flatten().all(|v| v.is_finite()), "{what}");
            for (j, v) in columns.iter().flat_map(|c| &c.rows) {
                assert!(*j < n && v.len() == rows, "{what}");
            }

            // a draft is the same on the joint itself, or nearly
            let draft = effect.columns(&cx, place, shape, true);
            assert_eq!(draft.len(), columns.len(), "{what}");
            let own = place.first();
            for (a, b) in draft.iter().zip(columns) {
                if let (Some(a), Some(b)) = (a.get(own), b.get(own)) {
                    let product: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                    let cosine = product / (rms(a) * rms(b) * rows as f64).max(1e-300);
                    assert!(cosine > 0.5 || rms(b) < 1e-9, "{what}: draft {cosine}");
                }
            }

            // values have the units of the joint
            let estimate = Estimate {
                place: *place,
                shape: shape.clone(),
                eta: eta.clone(),
                std: vec![0.1; eta.len()],
            };
            let values = effect.values(&cx, &estimate);
            assert!(!values.is_empty(), "{what}");
            for v in &values {
                assert!(
                    v.value.is_finite() && v.std.is_none_or(f64::is_finite),
                    "{what}: {v:?}"
                );
                // a body has its own units, whatever moves it
                if let (Place::Actuator(j), false) =
                    (place, matches!(card.name, "payload" | "link_inertia"))
                {
                    let wrong = match cx.motion(*j) {
                        Motion::Revolute => SLIDING,
                        Motion::Prismatic => TURNING,
                    };
                    assert!(!wrong.contains(&v.unit), "{what}: {v:?}");
                }
            }
            // a torque is a torque: in other words, what has its unit grows with the coefficients, from what the file states on
            let stated = match card.name {
                "coulomb_friction" => cx.stated(place, JointTerm::Coulomb),
                "torque_offset" => cx.stated(place, JointTerm::Offset),
                _ => 0.0,
            };
            let double = Estimate {
                eta: eta.iter().map(|v| 2.0 * v).collect(),
                std: vec![0.2; eta.len()],
                ..estimate.clone()
            };
            for (a, b) in values.iter().zip(effect.values(&cx, &double)) {
                if a.std.is_some() && ["N", "N m"].contains(&a.unit) {
                    assert!(
                        (b.value - 2.0 * a.value + stated).abs() <= 1e-9 * a.value.abs(),
                        "{what}: {a:?} {b:?}"
                    );
                }
            }

            // a gap made of its own columns: nothing gains more, and it is gone
            let mut with = Data::with_noise(
                &plant,
                vec![record(&plant, &x, {
                    let all = nominal.iter().zip(&gap);
                    all.flat_map(|(t, g)| t.iter().zip(g).map(|(t, g)| t + g))
                        .collect()
                })],
                Some(noise.clone()),
            )
            .unwrap();
            with.weights.clone_from(&data.weights);
            let seen = Evidence::new(&with, 1.0);
            let again = seen.project_all(&sets);
            let gain = |i: usize| seen.fit(&[&again[i]]).gain;
            let (mine, all) = (gain(k), seen.j0);
            // unless the nominal model absorbs it whole
            if projected[k].visibility(Some(&eta)) > 0.01 {
                seen_by_refit.insert(card.name);
                assert!(
                    mine > 0.99 * all,
                    "{what} explains {} of its own gap",
                    mine / all
                );
                let best = (0..list.len()).map(gain).fold(0.0, f64::max);
                assert!(
                    mine > 0.999 * best,
                    "{what}: another gains {} of it",
                    best / mine
                );
            }

            // a model that holds it has no gap left, and nor have its files
            let mut changed = plant.robot().clone();
            if let Some(part) = effect.apply(&cx, &estimate, &mut changed) {
                let new = read_back(&plant, &changed);
                let more = minus(&measured(&new, &x), &nominal);
                let left = off(&more, &gap);
                println!("{what}: {part:?}, {left:.1e} of the gap stays");
                // the sign of a velocity is averaged over a sample, or it is not
                let most = match part {
                    Part::Term(JointTerm::Coulomb) => 0.15,
                    _ => 0.03,
                };
                assert!(left < most, "{what}: {left:.3} of the gap stays");
            }
            tested.insert(card.name);
        }
    }
    let missing: Vec<_> = effects
        .iter()
        .map(|e| e.card().name)
        .filter(|e| !tested.contains(e))
        .collect();
    // most of them are no ordinary error of the parameters
    assert!(seen_by_refit.len() > 20, "{seen_by_refit:?}");
    assert!(
        missing.is_empty(),
        "no robot of this test can have {missing:?}"
    );
}

#[test]
fn an_eccentric_encoder_is_a_displacement() {
    let plant = robot("planar2");
    let x = motion(&plant);
    let nominal = measured(&plant, &x);
    let data = Data::new(&plant, vec![record(&plant, &x, noisy(&nominal))]).unwrap();
    let cx = Context::new(&data, plant.values()).unwrap();
    let effect = encoder_eccentricity::EncoderEccentricity;
    let (place, eta) = (Place::Actuator(1), [2e-4, -1e-4]);
    let columns = effect.columns(&cx, &place, &Shape::default(), false);
    let mut moved = x.clone();
    for i in x.count..2 * x.count {
        let ((s, c), v) = (x.q[i].sin_cos(), x.qd[i]);
        let [sine, cosine] = eta;
        let slope = sine * c - cosine * s;
        moved.q[i] += sine * s + cosine * c;
        moved.qd[i] += slope * v;
        moved.qdd[i] += slope * x.qdd[i] - (sine * s + cosine * c) * v * v;
    }
    let difference = minus(&measured(&plant, &moved), &nominal);
    let left = off(&sum(&cx, &columns, &eta), &difference);
    assert!(left < 0.02, "{left}");
}

#[test]
fn a_spring_has_its_sign() {
    let plant = robot("planar2");
    let x = motion(&plant);
    let nominal = measured(&plant, &x);
    let data = Data::new(&plant, vec![record(&plant, &x, noisy(&nominal))]).unwrap();
    let cx = Context::new(&data, plant.values()).unwrap();
    let place = Place::Actuator(0);
    // torque k (q − q₀) of a spring that pulls back
    let [a, b] = data.range[0];
    let (k, rest, middle) = (2.0, 0.1, 0.5 * (a + b));
    let estimate = Estimate {
        place,
        shape: Shape::default(),
        eta: vec![k * (middle - rest), k * 0.5 * (b - a)],
        std: vec![0.0; 2],
    };
    let spring = cable_spring::CableSpring;
    let columns = spring.columns(&cx, &place, &estimate.shape, false);
    let torque = &sum(&cx, &columns, &estimate.eta)[0];
    let wanted = data.own(0, |q, _| k * (q - rest));
    assert!(
        torque
            .iter()
            .zip(&wanted)
            .all(|(a, b)| (a - b).abs() < 1e-9)
    );
    let Some(Element::Spring { coefficients, .. }) = spring.element(&cx, &estimate) else {
        panic!("a spring");
    };
    for (c, wanted) in coefficients.iter().zip([-k * rest, k, 0.0, 0.0]) {
        assert!((c - wanted).abs() < 1e-9, "{coefficients:?}");
    }
    assert!((spring.values(&cx, &estimate)[0].value - k).abs() < 1e-9);
}

/// Torque ahead of the positions is the one effect that must explain most of a gap: many others leave something like it.
#[test]
fn only_torque_that_is_ahead_may_not_explain_a_part() {
    for effect in all() {
        let delay = effect.card().name == "torque_delay";
        for sign in [-1.0, 1.0] {
            let shape = Shape::of(&[0.004 * sign]);
            assert_eq!(effect.of_a_part(&shape), !delay || sign > 0.0);
        }
    }
}

fn with_friction() -> Plant {
    let plant = Plant::load("planar2").unwrap();
    plant.with_terms(&JointTerm::FRICTION)
}

/// A record in which a robot is as its file.
fn moved(plant: &Plant) -> Data<'_> {
    let x = motion(plant);
    let tau = noisy(&measured(plant, &x));
    Data::new(plant, vec![record(plant, &x, tau)]).unwrap()
}

/// Deviations of parameters beside an effect are those of all unknowns together.
#[test]
fn parameters_are_less_known_beside_an_effect() {
    let plant = with_friction();
    let data = moved(&plant);
    let cx = Context::new(&data, plant.values()).unwrap();
    let evidence = Evidence::new(&data, 1.0);
    let effects = all();
    let effect = named(&effects, "nonlinear_viscous_friction").unwrap();
    let columns = effect.columns(&cx, &Place::Actuator(0), &Shape::of(&[0.7]), false);
    let projected = evidence.project(&columns);
    let set = [&projected];
    let fit = evidence.fit(&set);
    let draws = evidence.draws(&set, &fit, 1.0).unwrap();
    let at = |k: Option<usize>| {
        let one = |i: usize| f64::from(Some(i) == k);
        let all: Vec<f64> = (0..draws.count()).map(one).collect();
        draws.at(&all).0
    };
    let mean = at(None);
    let each: Vec<Vec<f64>> = (0..draws.count()).map(|k| at(Some(k))).collect();
    let mut more = 0;
    for i in 0..mean.len() {
        let drawn: f64 = each.iter().map(|d| (d[i] - mean[i]).powi(2)).sum();
        let told = evidence.std_beside(&set, &fit, i);
        assert!((told / drawn.sqrt() - 1.0).abs() < 1e-6, "{i}: {told}");
        more += usize::from(told > 1.01 * evidence.std(i));
    }
    assert!(more > 0, "nothing is less known");
}

/// Friction that would drive its joint at some speed is none.
#[test]
fn friction_brakes_at_all_speeds() {
    let plant = with_friction();
    let data = moved(&plant);
    let cx = Context::new(&data, plant.values()).unwrap();
    let effects = all();
    let [grows, rises] = ["nonlinear_viscous_friction", "stribeck_friction"];
    let (place, top) = (Place::Actuator(0), data.speed[0]);
    let brakes = |of: &[(&str, Shape, f64)], viscous: f64, coulomb: f64| {
        let mut phi = plant.values();
        for (p, x) in plant.parameters().iter().zip(&mut phi) {
            *x = match p.kind {
                plant::Column::Term { joint: 0, term } => match term {
                    JointTerm::Viscous => viscous,
                    JointTerm::Coulomb => coulomb,
                    _ => *x,
                },
                _ => *x,
            };
        }
        let of: Vec<_> = of.iter().map(|(n, s, eta)| (*n, s, [*eta])).collect();
        let members: Vec<search::Member> = of
            .iter()
            .map(|(name, shape, eta)| (named(&effects, name).unwrap(), *shape, &eta[..]))
            .collect();
        search::brakes(&cx, &place, &members, || phi)
    };
    let power = |a: f64, eta: f64| (grows, Shape::of(&[a]), eta);
    let rise = |eta: f64| (rises, Shape::of(&[0.1 * top, 2.0]), eta);
    assert!(brakes(&[power(0.5, 10.0)], 1.0 / top, 2.0));
    // little below nothing is within what is not known
    assert!(brakes(&[power(0.5, 10.0)], 0.0, -0.5));
    assert!(!brakes(&[power(0.5, 10.0)], 1.0 / top, -5.0));
    // a rise makes up for it at rest, and not behind it
    assert!(!brakes(&[rise(6.0)], 10.0 / top, -5.0));
    assert!(brakes(&[rise(6.0)], 10.0 / top, 5.0));
    assert!(brakes(&[rise(6.0), power(0.35, 20.0)], 0.0, -4.0));
    assert!(!brakes(&[rise(2.0), power(0.35, 20.0)], 0.0, -6.0));
    // viscous friction that falls by itself drives nothing where the other grows
    assert!(brakes(&[power(0.7, 12.0)], -6.0 / top, 1.0));
    assert!(!brakes(&[power(2.0, -12.0)], 6.0 / top, 1.0));
    // nothing that has to brake
    assert!(brakes(&[], -6.0, -6.0));
}
